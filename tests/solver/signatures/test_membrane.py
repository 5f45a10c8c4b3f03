"""Membranes close any loop, are flat within flat outlines, and let an outline be near itself with other triangles."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_edges, boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.membrane import with_membranes
from omt_uv.solver.signatures.signature import signature
from omt_uv.solver.signatures.wasserstein import shape_distance


@pytest.mark.parametrize("sectors", [3, 4, 7, 24, 200])
def test_a_cone_without_its_base_is_closed(sectors):
    V, F = meshes.cone(3, sectors)
    P, T = with_membranes(V, F, boundary_loops(F))
    assert not len(boundary_edges(T)) and len(P) - len(T) // 2 == 2
    base = T[len(F) :]
    outline = V[boundary_loops(F)[0]][:, :2]
    flat = 0.5 * abs(np.cross(outline, np.roll(outline, -1, axis=0)).sum())
    assert np.allclose(P[base][..., 2], V[-1, 2]) and np.isclose(face_areas(P, base).sum(), flat)
    assert len(P) - len(V) <= 6 * sectors, "as many as the loop, times a number"


def test_edges_of_no_length_and_several_loops():
    V, F = meshes.annulus(24, 3)
    V[F[0, 0]] = V[F[0, 1]]
    P, T = with_membranes(V, F, boundary_loops(F))
    assert np.isfinite(P).all() and not len(boundary_edges(T)) and len(P) - len(T) // 2 == 2


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1]])
def test_every_hole_is_closed_as_if_it_were_alone(order):
    """Holes of three, five and more sides, at once and one after the other; every vertex is there and has a face."""
    V, F = meshes.icosphere(2)
    far = V @ V[0]
    six = int(np.argmin(np.abs(far) + (np.arange(len(V)) < 12)))
    single = F[far[F].sum(axis=1).argmin()]
    gone = np.isin(F, [0, six]).any(axis=1) | (np.sort(F, axis=1) == np.sort(single)).all(axis=1)
    bare = F[~gone]
    loops = [boundary_loops(bare)[k] for k in order]
    assert sorted(map(len, loops)) == [3, 5, 6]
    # What is left of the vertices within the holes is nobody's.
    used, local = np.unique(np.concatenate([bare.ravel(), *loops]), return_inverse=True)
    V, bare = V[used], local[: bare.size].reshape(-1, 3)
    loops = [np.searchsorted(used, loop) for loop in loops]
    P, T = with_membranes(V, bare, loops)
    one, closed = V, bare
    for loop in loops:
        one, closed = with_membranes(one, closed, [loop])
    np.testing.assert_array_equal(T, closed)
    np.testing.assert_array_equal(P, one)
    assert not len(boundary_edges(T)) and np.array_equal(np.unique(T), np.arange(len(P)))


def test_an_outline_is_near_itself_with_other_triangles():
    V, F = meshes.subdivide(*meshes.comb(3, 3))
    own, finer = (drain(signature(*mesh, 300)) for mesh in ((V, F), meshes.subdivide(V, F)))
    found = shape_distance(own, finer)
    assert found.raw <= 1.5 * found.floor
