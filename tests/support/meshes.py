"""Meshes for tests and benchmarks: procedural ones, and published models where they are at hand.

Every function returns `(V, F)`: (n,3) float64 positions and (m,3) int64 triangles, counter-clockwise seen from
outside (from above for height fields). Published models are never part of this project: they are read from the
folder named by the environment variable OMT_UV_MODELS.
"""

from __future__ import annotations

import functools
import os
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
DISK_MODELS = ["snail", "lilium", "camel_b", "face", "lion", "alligator", "woody", "hemisphere", "maze"]
CLOSED_MODELS = ["max_planck", "bunny_small", "spot", "homer", "bunny", "david", "armadillo"]


# ---- disks --------------------------------------------------------------------------------------------------


def single_triangle():
    """One triangle."""
    return np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])


def quad_patch():
    """A unit square of two triangles."""
    return np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])


def grid(columns=8, rows=8, width=1.0, height=1.0):
    """A flat rectangle of 2 * columns * rows right triangles, diagonals alternating."""
    y, x = np.mgrid[0 : rows + 1, 0 : columns + 1]
    V = np.column_stack([x.ravel() * width / columns, y.ravel() * height / rows, np.zeros(x.size)])
    return V, _grid_faces(columns, rows)


def _grid_faces(columns, rows):
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    a, b, c, d = corner, corner + 1, corner + columns + 2, corner + columns + 1
    odd = ((np.arange(rows)[:, None] + np.arange(columns)) % 2).ravel().astype(bool)
    first = np.where(odd[:, None], np.column_stack([a, b, d]), np.column_stack([a, b, c]))
    second = np.where(odd[:, None], np.column_stack([b, c, d]), np.column_stack([a, c, d]))
    return np.concatenate([first, second])


def bumpy(columns=16, rows=16, height=0.4, waves=2.0):
    """A square height field with a few bumps."""
    V, F = grid(columns, rows)
    V[:, 2] = height * np.sin(waves * np.pi * V[:, 0]) * np.cos(waves * np.pi * V[:, 1])
    return V, F


def two_bumps(n=40):
    """A square with two bumps, its own mirror image across x = 1/2, also by its triangles; n is even."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    z = sum(0.7 * np.exp(-40 * ((x - a) ** 2 + (y - 0.5) ** 2)) for a in (0.28, 0.72))
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([i, i + n + 1, i + n + 2, i + 1], axis=1)
    left = (quads // (n + 1))[:, 0] < n // 2
    one, other = quads[left], quads[~left]
    F = np.concatenate([one[:, [0, 1, 2]], one[:, [0, 2, 3]], other[:, [0, 1, 3]], other[:, [1, 2, 3]]])
    return np.stack([x, y, z], axis=2).reshape(-1, 3), F


def single_bump(columns=60):
    """A flat unit square but for one bump around (0.4, 0.5), and the distance (n,) of its vertices from there."""
    V, F = grid(columns, columns)
    r = np.linalg.norm(V[:, :2] - [0.4, 0.5], axis=1)
    V[:, 2] = 0.06 * np.exp(-((r / 0.06) ** 2))
    return V, F, r


def polar(radius, height, rings=8, sectors=24):
    """A disk of rings around one apex vertex: ring k has the given radius and height (callables of k / rings)."""
    t = np.arange(1, rings + 1) / rings
    angle = 2 * np.pi * np.arange(sectors) / sectors
    r, z = np.broadcast_to(radius(t), t.shape), np.broadcast_to(height(t), t.shape)
    ring = np.stack([r[:, None] * np.cos(angle), r[:, None] * np.sin(angle), np.repeat(z[:, None], sectors, 1)], axis=2)
    V = np.concatenate([[[0, 0, float(height(np.zeros(1))[0])]], ring.reshape(-1, 3)])
    s, n = np.arange(sectors), (np.arange(sectors) + 1) % sectors
    fan = np.column_stack([np.zeros(sectors, int), 1 + s, 1 + n])
    strips = [fan]
    for k in range(rings - 1):
        a, b = 1 + k * sectors, 1 + (k + 1) * sectors
        strips += [np.column_stack([a + s, b + s, b + n]), np.column_stack([a + s, b + n, a + n])]
    return V, np.concatenate(strips)


def cone(rings=8, sectors=24, height=2.0):
    """A cone without its base."""
    return polar(lambda t: t, lambda t: height * (1 - t), rings, sectors)


def hemisphere(rings=10, sectors=32):
    """The upper half of the unit sphere."""
    return polar(lambda t: np.sin(np.pi / 2 * t), lambda t: np.cos(np.pi / 2 * t), rings, sectors)


def cap(rings=16, sectors=32, opening=0.9):
    """A sphere with a small hole at the bottom: `opening` of the meridian is there."""
    return polar(lambda t: np.sin(np.pi * opening * t), lambda t: np.cos(np.pi * opening * t), rings, sectors)


def spiral_strip(turns=3.0, segments=120, width=0.3):
    """A flat strip wound into a spiral staircase: a disk with a very long boundary."""
    V, F = grid(segments, 2)
    angle, r = V[:, 0] * 2 * np.pi * turns, 1 + width * (V[:, 1] - 0.5)
    return np.column_stack([-r * np.cos(angle), r * np.sin(angle), 0.4 * V[:, 0] * turns]), F


def comb(teeth=6, length=6, pitch=2):
    """A flat comb of unit squares: teeth of one square's width and the given length on a common bar."""
    squares = {(x, 0) for x in range(pitch * (teeth - 1) + 1)}
    squares |= {(pitch * k, y) for k in range(teeth) for y in range(1, length + 1)}
    cells = np.array(sorted(squares))
    corners = cells[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    points, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    quads = index.reshape(-1, 4)
    V = np.column_stack([points, np.zeros(len(points))]).astype(float)
    return V, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def hinge(columns=10, rows=10, height=0.4):
    """A bumpy square slit along its middle but for the first edge: its halves hang together by one edge."""
    V, F = bumpy(2 * columns, rows, height)
    slit = np.arange(2, rows + 1) * (2 * columns + 1) + columns
    copy = np.arange(len(V))
    copy[slit] = len(V) + np.arange(len(slit))
    right = V[F].mean(axis=1)[:, 0] > 0.5
    return np.concatenate([V, V[slit]]), np.where(right[:, None], copy[F], F)


def random_disk(count=300, seed=0, height=0.3):
    """The Delaunay triangulation of random points of the unit disk, lifted to a smooth random height field."""
    rng = np.random.default_rng(seed)
    angle = np.linspace(0, 2 * np.pi, max(8, int(2 * np.sqrt(count))), endpoint=False)
    inner, turn = 0.95 * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    P = np.concatenate([np.column_stack([np.cos(angle), np.sin(angle)]),
                        np.column_stack([inner * np.cos(turn), inner * np.sin(turn)])])  # fmt: skip
    from scipy.spatial import Delaunay  # Blender's tests import this module where scipy comes with the extension

    F = Delaunay(P).simplices.astype(np.int64)
    e1, e2 = P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]]
    clockwise = e1[:, 0] * e2[:, 1] < e1[:, 1] * e2[:, 0]
    F[clockwise] = F[clockwise][:, [0, 2, 1]]
    wave, phase = rng.normal(0, 3, (4, 2)), 2 * np.pi * rng.random(4)
    return np.column_stack([P, height * np.sin(P @ wave.T + phase).mean(1)]), F


def head(count=40, seed=0):
    """A bust-like disk: a cap with a nose, ears and sockets; about 2 * count**2 faces, opened at the neck."""
    V, F = cap(rings=count, sectors=count, opening=0.85)
    bumps = [
        # direction, height, width: nose, ears, sockets, crown
        (1, 0, 0, 0.5, 0.2),
        (0, 1, 0.1, 0.4, 0.25),
        (0, -1, 0.1, 0.4, 0.25),
        (0.9, 0.35, 0.25, -0.15, 0.15),
        (0.9, -0.35, 0.25, -0.15, 0.15),
        (0, 0, 1, 0.3, 0.5),
    ]
    scale = np.ones(len(V))
    for *centre, amount, width in bumps:
        direction = np.array(centre) / np.linalg.norm(centre)
        scale += amount * np.exp(-((V - direction) ** 2).sum(1) / (2 * width**2))
    return V * scale[:, None] * [1.0, 0.8, 1.2], F


def quad_grid(columns=6, rows=6):
    """A wavy square of quads: positions and polygons, a list of vertex lists."""
    V, _ = bumpy(columns, rows, height=0.2, waves=1.0)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    return V, np.column_stack([corner, corner + 1, corner + columns + 2, corner + columns + 1]).tolist()


# ---- charts that are no disks -------------------------------------------------------------------------------


def annulus(sectors=24, rings=3):
    """A flat ring: two boundaries."""
    V, F = polar(lambda t: 1 + t, lambda t: 0 * t, rings + 1, sectors)
    keep = (F >= 1).all(1)
    return V[1:], F[keep] - 1


def cube():
    """The surface of [0, 1]^3, 12 triangles."""
    V = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return V, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def icosphere(subdivisions=2):
    """The unit sphere: an icosahedron subdivided, 20 * 4**subdivisions faces."""
    golden = (1 + np.sqrt(5)) / 2
    V = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0],
                  [0, -1, golden], [0, 1, golden], [0, -1, -golden], [0, 1, -golden],
                  [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1]])  # fmt: skip
    F = np.array([[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2],
                  [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5],
                  [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]])  # fmt: skip
    for _ in range(subdivisions):
        V, F = subdivide(V, F)
    return V / np.linalg.norm(V, axis=1, keepdims=True), F


def subdivide(V, F):
    """Split every triangle into four at the midpoints of its edges."""
    sides = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    edges, index = np.unique(sides, axis=0, return_inverse=True)
    ab, bc, ca = (len(V) + index).reshape(3, -1)
    a, b, c = F.T
    faces = [np.column_stack(t) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
    return np.concatenate([V, V[edges].mean(1)]), np.concatenate(faces)


def torus(major=24, minor=12, radius=0.4):
    """A torus around the z axis."""
    i, j = np.meshgrid(np.arange(major), np.arange(minor), indexing="ij")
    u, v = 2 * np.pi * i / major, 2 * np.pi * j / minor
    r = 1 + radius * np.cos(v)
    V = np.stack([r * np.cos(u), r * np.sin(u), radius * np.sin(v)], axis=2).reshape(-1, 3)
    a, b = i * minor + j, (i + 1) % major * minor + j
    c, d = (i + 1) % major * minor + (j + 1) % minor, i * minor + (j + 1) % minor
    a, b, c, d = (k.ravel() for k in (a, b, c, d))
    return V, np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def helical_gear(teeth=8, rings=10, around=16, twist=1.0, taper=0.5, height=1.2):
    """A closed cone with so many teeth, that wind about its axis by an angle; `around` vertices a tooth."""
    count = teeth * around
    angle = 2 * np.pi * np.arange(count) / count
    out = 1 + 0.25 * np.tanh(3 * np.sin(teeth * angle)) / np.tanh(3)
    # From the middle of one end to that of the other: a ring within each, and those of the teeth.
    level = np.array([0, *np.arange(rings + 1) / rings, 1])[:, None]
    r = (1 - taper * level) * [0 * out + 0.5, *[out] * (rings + 1), 0 * out + 0.5]
    turned, z = angle + twist * level, height * level + 0 * angle
    V = np.stack([r * np.cos(turned), r * np.sin(turned), z], axis=2).reshape(-1, 3)
    a = np.arange(len(V)).reshape(-1, count)
    b = np.roll(a, -1, axis=1)
    corners = [(a[:-1], b[:-1], b[1:]), (a[:-1], b[1:], a[1:]), (b[0], a[0], 0 * a[0] + len(V))]
    corners.append((a[-1], b[-1], 0 * a[-1] + len(V) + 1))
    F = [np.stack(each, axis=-1).reshape(-1, 3) for each in corners]
    return np.concatenate([V, [[0, 0, 0], [0, 0, height]]]), np.concatenate(F)


# ---- polygons -----------------------------------------------------------------------------------------------


def climbed(V, F, begin, steps, up):
    """Edges (steps,2) of a mesh from a vertex to where it goes most up (1) or down (-1)."""
    ends, path = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), [begin]
    for _ in range(steps):
        beside = ends[ends[:, 0] == path[-1], 1]
        path.append(int(beside[np.argmax(up * V[beside, 2])]))
    return np.stack([path[:-1], path[1:]], axis=1)


def polygon_surface(V, polygons, seams=()):
    """The `Surface` of a polygon mesh, polygons (lists of vertices) cut into fans of triangles."""
    from omt_uv.solver.mesh.surface import Surface

    sizes = np.array([len(p) for p in polygons], dtype=np.int64)
    start = np.concatenate([[0], np.cumsum(sizes)])
    fans = [(s, s + k, s + k + 1) for s, size in zip(start[:-1], sizes, strict=True) for k in range(1, size - 1)]
    return Surface(
        positions=np.asarray(V, float),
        corner_vertex=np.array([v for p in polygons for v in p], np.int64),
        face_start=start,
        triangles=np.array(fans, np.int64).reshape(-1, 3),
        triangle_face=np.repeat(np.arange(len(sizes)), np.maximum(sizes - 2, 0)),
        seams=np.asarray(seams, np.int64).reshape(-1, 2),
    )


# ---- published models ---------------------------------------------------------------------------------------


def models_folder():
    """Where published models are looked for."""
    return Path(os.environ.get("OMT_UV_MODELS") or ROOT.parent / "shared" / "models")


def model_path(name):
    """The file of a model, or None where it is not at hand."""
    paths = [models_folder() / f"{name}{suffix}" for suffix in (".obj", ".off")]
    return next((p for p in paths if p.is_file()), None)


models_missing = pytest.mark.skipif(
    not all(model_path(name) for name in DISK_MODELS),
    reason=f"no models in {models_folder()}: set OMT_UV_MODELS to a folder with {', '.join(DISK_MODELS)}",
)


@functools.cache
def load_model(name):
    """A published model by its name, polygons cut into fans; the arrays are shared, so they are read-only."""
    V, polygons = load_polygons(name)
    F = np.array([(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)], dtype=np.int64)
    V.flags.writeable = F.flags.writeable = False
    return V, F


def load_polygons(name):
    """Positions of a published model by its name, and its polygons, lists of vertices."""
    path = model_path(name)
    if path is None:
        raise FileNotFoundError(f"no {name}.obj or {name}.off in {models_folder()}; set OMT_UV_MODELS")
    return (_read_off if path.suffix == ".off" else _read_obj)(path)


def _read_obj(path):
    positions, polygons = [], []
    for line in path.read_text().splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            positions.append([float(x) for x in rest.split()[:3]])
        elif kind == "f":
            polygons.append([int(corner.partition("/")[0]) for corner in rest.split()])
    count = len(positions)
    return np.array(positions), [[i - 1 if i > 0 else count + i for i in p] for p in polygons]


def _read_off(path):
    text = path.read_text().split("\n", 1)[1].split()
    count, faces = int(text[0]), int(text[1])
    V = np.array(text[3 : 3 + 3 * count], dtype=float).reshape(-1, 3)
    polygons, at = [], 3 + 3 * count
    for _ in range(faces):
        size = int(text[at])
        polygons.append([int(i) for i in text[at + 1 : at + 1 + size]])
        at += 1 + size
    return V, polygons
