"""The mirror symmetry of maps to the sphere."""

from __future__ import annotations

import meshes
import numpy as np
from scipy.spatial import cKDTree
from sphere_shapes import random_rotation

from omt_uv.solver.sphere.symmetry import symmetric_map, with_mirrored_quads


def test_the_nearest_symmetric_map_in_two_mirrors():
    V, _ = meshes.icosphere(2)
    images = np.array([cKDTree(V).query(V * turn)[1] for turn in ([1, 1, -1], [-1, 1, 1])])
    turned = V @ random_rotation().T
    noisy = turned + 0.01 * np.random.default_rng(0).normal(size=V.shape)
    symmetry, found = symmetric_map(images, noisy / np.linalg.norm(noisy, axis=1, keepdims=True))
    assert len(symmetry.images) == 3 and np.abs(found - turned).max() < 0.05
    assert np.abs(symmetry.averaged(found) - found).max() < 1e-12
    assert symmetric_map(images[:1], V[np.random.default_rng(0).permutation(len(V))]) is None


def test_diagonals_alone_are_no_asymmetry():
    V, F = meshes.icosphere(2)
    assert with_mirrored_quads(V, F, None) is None
    upper = V[F].mean(axis=1)[:, 2] > 0
    shared = [(i, j) for i in np.flatnonzero(upper)[:20] for j in np.flatnonzero(upper) if len({*F[i], *F[j]}) == 4]
    i, j = shared[0]
    other = F.copy()
    (a,), (c,) = set(F[i]) - set(F[j]), set(F[j]) - set(F[i])
    k = int(np.flatnonzero(F[i] == a)[0])
    b, d = F[i][(k + 1) % 3], F[i][(k + 2) % 3]
    other[i], other[j] = [a, b, c], [a, c, d]
    joined = with_mirrored_quads(V, other, None)
    assert joined is not None and len(np.unique(joined)) == len(F) - 2 and joined[i] == joined[j]
