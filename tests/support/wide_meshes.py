"""Meshes of kinds that no breaking of small ones comes to.

Bodies of cubes, sponges, surfaces of one side, strips, fans, many pieces, soups, vertices of many neighbours, sieves,
slivers, and units from the least to the largest.
"""

from __future__ import annotations

import hard_meshes
import meshes
import numpy as np
from broken_meshes import broken_mesh, soup

from omt_uv.settings import Settings


def voxels(rng):
    """Cubes by chance, side by side."""
    return hard_meshes.voxel_blob(int(rng.integers(3, 7)), rng.uniform(0.2, 0.7), int(rng.integers(1000)))


def porous(rng):
    """A cube of which cells are gone in every octant alike, as in a sponge."""
    part = rng.random((3, 3, 3)) > 0.35
    part[0, 0, 0] = True
    return hard_meshes.voxel_surface(np.kron(np.ones((int(rng.integers(1, 3)),) * 3), part).astype(bool))


def one_sided(rng):
    """A Klein bottle, or a strip with half turns."""
    if rng.random() < 0.5:
        return hard_meshes.klein_bottle(int(rng.integers(8, 20)), int(rng.integers(6, 14)))
    n, turns = int(rng.integers(8, 40)), int(rng.integers(1, 4))
    u = 2 * np.pi * np.arange(n) / n
    edges = [(1 + s * np.cos(turns * u / 2), s * np.sin(turns * u / 2)) for s in (-0.3, 0.3)]
    V = np.concatenate([np.column_stack([r * np.cos(u), r * np.sin(u), z]) for r, z in edges])
    k = np.arange(n)
    last, swap = (k + 1) % n, (k == n - 1) & (turns % 2 == 1)
    return V, np.column_stack([k, np.where(swap, n, last), np.where(swap, 0, last + n), k + n])


def strip(rng):
    """A strip of quads, rolled."""
    V, P = hard_meshes.strip(int(10 ** rng.uniform(0, 2.8)))
    V[:, 2] = rng.uniform(0, 2) * np.sin(V[:, 0] * rng.uniform(0, 1))
    V[:, 1] *= 10 ** rng.uniform(-3, 3)
    return V, P


def fan(rng):
    """A cone of few or many sides, flat, steep or jagged."""
    V, P = hard_meshes.fan(int(10 ** rng.uniform(0.6, 3)), rng.choice([0.0, 0.01, 0.5, 3.0, 50.0]))
    V[:-1] *= rng.uniform(0.2, 1, (len(V) - 1, 1)) if rng.random() < 0.5 else 1
    return V, P


def pieces(rng):
    """Triangles that have nothing in common, of one size or of many."""
    V, P = hard_meshes.pieces(int(rng.integers(2, 80)), int(rng.integers(1000)))
    V *= np.repeat(10 ** rng.uniform(-3, 3, len(P)), 3)[:, None] if rng.random() < 0.3 else 1
    return V, P


def poles(rng):
    """A ball whose poles have many neighbours."""
    V, P = hard_meshes.sliver_sphere(int(10 ** rng.uniform(2.2, 3.4)))
    return V * 10 ** rng.uniform(-1, 1, 3), P


def sieve(rng):
    """A patch with holes by chance."""
    return hard_meshes.percolation(int(rng.integers(6, 24)), rng.uniform(0.05, 0.35), int(rng.integers(1000)))


def slivers(rng):
    """A bumpy patch, stretched along the axes."""
    V, P = meshes.bumpy(int(rng.integers(4, 24)), int(rng.integers(4, 24)))
    return V * 10 ** rng.uniform(-3, 3, 3), P


def ring(rng):
    """A torus, a cylinder or a ball of one of these at an odd size."""
    V, P = [meshes.torus, meshes.annulus, lambda: meshes.icosphere(1)][rng.integers(3)]()
    return V * 10 ** rng.uniform(-2, 2, 3), P


KINDS = (voxels, porous, one_sided, strip, fan, pieces, soup, poles, sieve, slivers, ring)


def wide_case(seed):
    """The name of its kind, the surface, the chosen faces (or None) and the settings of case `seed`; a third of the
    cases are of these kinds, the others of `broken_mesh`."""
    rng = np.random.default_rng(seed)
    boundary = str(rng.choice(["free", "free", "free", "disk", "square"]))
    settings = Settings(
        boundary,
        "draft" if rng.random() < 0.6 else "standard",
        balance=float(rng.choice([0.0, 0.0, 0.5, 1.0])),
        texture_size=int(rng.choice([64, 512, 2048])),
        fill_holes=bool(rng.random() < 0.2),
        max_shear=float(rng.choice([0.0, 1.35, 1.1])) if boundary == "free" else 0.0,
    )
    if seed % 3:
        surface, faces, _ = broken_mesh(seed)
        return "broken", surface, faces, settings
    kind = KINDS[seed // 3 % len(KINDS)]
    V, P = kind(rng)
    if rng.random() < 0.3:
        V = V * 10.0 ** rng.uniform(-30, 25) + (
            rng.normal(size=3) * 10 ** rng.uniform(0, 4) if rng.random() < 0.5 else 0
        )
    polygons = [[int(v) for v in p] for p in P]
    seams = rng.integers(len(V), size=(rng.integers(0, 4), 2)) if rng.random() < 0.3 else ()
    return kind.__name__, meshes.polygon_surface(V, polygons, seams), None, settings
