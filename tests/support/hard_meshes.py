"""Meshes that are hard on a solver by their shape or their number, as positions (n,3) and polygons (f,k) or lists.

Sponges and voxels have many handles, strips and fans graphs that are paths and stars, soups thousands of pieces.
"""

from __future__ import annotations

import numpy as np

# Corners of the unit cube's sides, counter-clockwise from outside, and to which neighbour each side looks.
SIDES = {
    (-1, 0, 0): [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)],
    (1, 0, 0): [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
    (0, -1, 0): [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)],
    (0, 1, 0): [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
    (0, 0, -1): [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)],
    (0, 0, 1): [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


def voxel_surface(filled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sides of filled cells (a,b,c) bool that no other cell covers, vertices shared wherever they coincide."""
    around = np.pad(filled, 1)
    quads = []
    for side, corners in SIDES.items():
        bare = around & ~np.roll(around, [-s for s in side], axis=(0, 1, 2))
        quads.append((np.argwhere(bare) - 1)[:, None] + np.array(corners))
    corners = np.concatenate(quads).reshape(-1, 3)
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return points.astype(float), index.reshape(-1, 4)


def sponge(level: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """The surface of a Menger sponge."""
    middle = np.add.outer(np.add.outer(np.arange(3) == 1, np.arange(3) == 1), (np.arange(3) == 1).astype(int))
    filled = np.ones((1, 1, 1), bool)
    for _ in range(level):
        filled = np.kron(filled, middle < 2)
    return voxel_surface(filled.astype(bool))


def voxel_blob(size: int = 12, density: float = 0.5, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The surface of random cells, smoothed a little."""
    noise = np.random.default_rng(seed).random((size,) * 3)
    for axis in range(3):
        noise = noise + np.roll(noise, 1, axis)
    return voxel_surface(noise > np.quantile(noise, 1 - density))


def klein_bottle(around: int = 48, across: int = 30) -> tuple[np.ndarray, np.ndarray]:
    """The figure-8 immersion of the Klein bottle, quads."""
    u, v = np.meshgrid(*(2 * np.pi * np.arange(k) / k for k in (around, across)), indexing="ij")
    r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    V = np.stack([r * np.cos(u), r * np.sin(u), z], axis=2).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))

    def vertex(i, j):
        # Once around, the figure 8 has turned by half a turn: v goes to -v.
        return i % around * across + np.where(i == around, -j, j) % across

    return V, np.column_stack([vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)])


def strip(count: int = 50_000) -> tuple[np.ndarray, np.ndarray]:
    """A flat strip of quads, one beside the other."""
    x = np.arange(count + 1.0)
    V = np.concatenate([np.column_stack([x, 0 * x, 0 * x]), np.column_stack([x, 0 * x + 1, 0 * x])])
    k = np.arange(count)
    return V, np.column_stack([k, k + 1, k + count + 2, k + count + 1])


def fan(count: int = 20_000, height: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Triangles around one vertex, a cone."""
    angle = 2 * np.pi * np.arange(count) / count
    around = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    k = np.arange(count)
    return np.concatenate([around, [[0, 0, height]]]), np.column_stack([k, (k + 1) % count, np.full(count, count)])


def pieces(count: int = 20_000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Triangles that have nothing in common."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 3, 3)) + 5 * rng.normal(size=(count, 1, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def percolation(side: int = 128, density: float = 0.22, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The largest part of a square grid whose quads are there by chance: a disk with hundreds of holes."""
    from scipy.ndimage import label

    there = np.random.default_rng(seed).random((side, side)) > density
    parts, _ = label(there)
    cells = np.argwhere(parts == np.bincount(parts[there]).argmax())
    corners = cells[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    points, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    V = np.column_stack([points, 0.1 * side * np.sin(points / side * 7).prod(1)])
    return V.astype(float), index.reshape(-1, 4)


def sliver_sphere(count: int = 100_000) -> tuple[np.ndarray, np.ndarray]:
    """A sphere of triangles from pole to pole: rings of few, meridians of many vertices."""
    rings = 10
    sectors = count // (2 * rings - 2)
    polar = np.pi * np.arange(1, rings) / rings
    angle = 2 * np.pi * np.arange(sectors) / sectors
    ring = np.stack(
        np.broadcast_arrays(np.sin(polar)[:, None] * np.cos(angle), np.sin(polar)[:, None] * np.sin(angle),
                            np.cos(polar)[:, None]), axis=2)  # fmt: skip
    V = np.concatenate([ring.reshape(-1, 3), [[0, 0, 1.0], [0, 0, -1]]])
    s, n = np.arange(sectors), (np.arange(sectors) + 1) % sectors
    top, bottom = np.full(sectors, len(V) - 2), np.full(sectors, len(V) - 1)
    last = (rings - 2) * sectors
    faces = [np.column_stack([top, s, n]), np.column_stack([bottom, last + n, last + s])]
    for k in range(rings - 2):
        a, b = k * sectors, (k + 1) * sectors
        faces += [np.column_stack([a + s, b + s, b + n]), np.column_stack([a + s, b + n, a + n])]
    return V, np.concatenate(faces)


def terrain(side: int = 1000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A height field of side * side quads, hills over hills."""
    rng = np.random.default_rng(seed)
    x = np.arange(side + 1) / side
    height = np.zeros((side + 1, side + 1))
    for octave in range(6):
        (p, q), (a, b) = rng.random((2, 2)) * 2 * np.pi
        waves = 2.0**octave * 3
        height += 0.1 / 2**octave * np.sin(waves * x[:, None] + p + a) * np.sin(waves * x[None] + q + b)
    u, v = np.meshgrid(x, x, indexing="ij")
    V = np.column_stack([u.ravel(), v.ravel(), height.ravel()])
    i = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    return V, np.column_stack([i, i + side + 1, i + side + 2, i + 1])


def surface(V: np.ndarray, polygons: np.ndarray):
    """The `Surface` of polygons (f,k) that all have k corners, cut into fans."""
    from omt_uv.solver.mesh.surface import Surface

    f, k = polygons.shape
    start = k * np.arange(f)
    fans = np.stack([np.column_stack([start, start + i, start + i + 1]) for i in range(1, k - 1)], axis=1)
    return Surface(
        positions=V,
        corner_vertex=polygons.ravel(),
        face_start=k * np.arange(f + 1),
        triangles=fans.reshape(-1, 3),
        triangle_face=np.repeat(np.arange(f), k - 2),
        seams=np.zeros((0, 2), np.int64),
    )
