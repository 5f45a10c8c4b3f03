"""What lies around a vertex, as far as another: circles of the plane, caps of the sphere, over holes, not over ends."""

import meshes
import numpy as np
import pytest
import sphere_shapes

from omt_uv.solver import errors
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.marked import marked_signature
from omt_uv.solver.signatures.surroundings import surroundings
from omt_uv.solver.signatures.wasserstein import shape_distance

COUNT = 150


def at(V, place):
    """The vertex nearest to a place."""
    return int(((V - np.array(place)) ** 2).sum(axis=1).argmin())


def test_a_circle_of_the_plane_is_cut_out_through_the_start():
    V, F = meshes.grid(30, 30)
    centre, start = at(V, [0.5, 0.5, 0]), at(V, [0.8, 0.5, 0])
    P, T, old = surroundings(V, F, centre, start)
    away = np.linalg.norm(P - V[centre], axis=1)
    (loop,) = boundary_loops(T)
    assert abs(away[loop] - 0.3).max() < 0.003 and away.max() < 0.303
    assert face_areas(P, T).sum() == pytest.approx(np.pi * 0.09, rel=0.01)
    assert {centre, start} <= set(old.tolist()) and np.array_equal(P[old >= 0], V[old[old >= 0]])
    assert np.flatnonzero(old == start)[0] in loop


def test_a_cap_of_the_sphere_has_its_area():
    V, F = meshes.icosphere(4)
    centre, start = at(V, [0, 0, 1]), at(V, [1, 0, 0.3])
    P, T, _ = surroundings(V, F, centre, start)
    assert face_areas(P, T).sum() == pytest.approx(2 * np.pi * (1 - V[centre] @ V[start]), rel=0.02)


def test_holes_are_filled_and_ends_are_not_passed():
    V, F = meshes.grid(30, 30)
    centre = at(V, [0.5, 0.5, 0])
    hole = np.linalg.norm(V[F].mean(axis=1) - [0.6, 0.6, 0], axis=1) < 0.06
    P, T, _ = surroundings(V, F[~hole], centre, at(V, [0.8, 0.5, 0]))
    assert face_areas(P, T).sum() == pytest.approx(np.pi * 0.09, rel=0.01)
    # Nothing of what a fan over the open side would have added.
    start = at(V, [0.95, 0.8, 0])
    P, T, _ = surroundings(V, F, centre, start)
    x, y = np.mgrid[0:1:500j, 0:1:500j]
    inside = np.hypot(x - 0.5, y - 0.5) < np.linalg.norm(V[start] - V[centre])
    assert face_areas(P, T).sum() == pytest.approx(inside.mean(), rel=0.01) and len(boundary_loops(T)) == 1


def beasts():
    """A body (n,3), (m,3), the same with another back, and vertices in the middle and at the side of the front."""
    V, F = meshes.icosphere(4)
    V = V @ sphere_shapes.random_rotation(1).T
    waves = np.random.default_rng(0).normal(size=(3, 3)) * 3
    V = V * (1 + 0.06 * np.sin(V @ waves.T).sum(axis=1))[:, None]
    other = V + np.maximum(-V[:, [2]] - 0.2, 0) * [0.5, -0.8, -3]
    return V, other, F, at(V, [0, 0, 1]), at(V, [0.9, 0, 0.5])


def test_bodies_are_compared_by_what_is_marked_alone():
    V, other, F, centre, start = beasts()
    own = drain(marked_signature(V, F, centre, start, COUNT))
    assert own.points.shape == (COUNT, 2)
    same = drain(marked_signature(3 * other @ sphere_shapes.random_rotation(3).T, F, centre, start, COUNT))
    assert shape_distance(own, same).raw < 0.3 * own.floor
    finer = drain(marked_signature(*meshes.subdivide(other, F), centre, start, COUNT))
    assert shape_distance(own, finer).raw <= 1.3 * own.floor
    elsewhere = drain(marked_signature(V, F, start, centre, COUNT))
    assert shape_distance(own, elsewhere).raw > 1.35 * own.floor


def test_markers_at_one_place_are_refused():
    V, F = meshes.icosphere(3)
    with pytest.raises(errors.LandmarkError, match="one place"):
        surroundings(V, F, 0, 0)
    with pytest.raises(errors.LandmarkError, match="Nothing is farther"):
        drain(marked_signature(V, F, 0, at(V, -V[0]), COUNT))
