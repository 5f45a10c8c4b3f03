"""The same body is near itself in any place, size and mirroring, others are not, and distances are symmetric."""

import functools

import meshes
import numpy as np
import pytest
import sphere_shapes

from omt_uv.solver import errors
from omt_uv.solver.mesh.spherical_geometry import fibonacci_sphere, signed_volumes
from omt_uv.solver.mesh.topology import boundary_edges
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.alignment import rotation_grid
from omt_uv.solver.signatures.harmonics import grid_matrices, harmonics
from omt_uv.solver.signatures.signature import Signature, closed_part, signature
from omt_uv.solver.signatures.wasserstein import nearest, prepared, shape_distance, spectrum, starts
from omt_uv.solver.sphere import sphere_map

COUNT = 200


@functools.cache
def of(seed, change=""):
    V, F = sphere_shapes.blob(seed=seed)
    if change == "moved":
        V = 3 * V @ sphere_shapes.random_rotation(4).T + 5
    if change == "mirrored":
        V, F = V * [-1, 1, 1], F[:, ::-1]
    if change == "subdivided":
        V, F = meshes.subdivide(V, F)
    return drain(signature(V, F, COUNT))


@pytest.mark.parametrize("change", ["moved", "mirrored", "subdivided"])
def test_a_body_is_near_itself(change):
    found = shape_distance(of(0), of(0, change))
    assert found.raw <= 1.3 * found.floor
    assert found.distance < 0.5 * shape_distance(of(0), of(3)).distance


def test_distances_are_symmetric_and_zero_on_the_diagonal():
    there, back = shape_distance(of(0), of(1)), shape_distance(of(1), of(0))
    assert abs(there.raw - back.raw) < 1e-6 and shape_distance(of(0), of(0)).raw < 1e-6
    assert np.allclose(there.rotation @ there.rotation.T, np.eye(3))


def test_the_nearest_of_a_library_is_the_body_itself():
    library = [of(seed) for seed in (1, 2, 0, 3)]
    assert nearest(of(0, "moved"), library, 2)[0][0] == 2
    mine, moved, other = (spectrum(prepared(s).coefficients) for s in (of(0), of(0, "moved"), of(1)))
    assert np.linalg.norm(mine - moved) < 0.5 * np.linalg.norm(mine - other)


def test_harmonics_are_orthonormal_and_turn_by_their_matrices():
    at = fibonacci_sphere(4000)
    every = np.concatenate(harmonics(at), axis=1)
    assert np.allclose(every.T @ every * 4 * np.pi / len(at), np.eye(every.shape[1]), atol=0.01)
    grid, matrices, column = rotation_grid(), grid_matrices(), 0
    for before, after in zip(harmonics(at[::50])[1:], harmonics(at[::50] @ grid[1234].T)[1:], strict=True):
        size = before.shape[1]
        matrix = matrices[1234, column : column + size**2].reshape(size, size)
        assert np.allclose(before @ matrix.T, after, atol=1e-4)
        column += size**2


def test_the_best_start_is_the_rotation_that_was_made():
    found = of(0)
    rotation = sphere_shapes.random_rotation(7)
    for sign in (1, -1):
        turned = Signature(sign * found.points @ rotation.T, found.curvature)
        best = starts(prepared(found), prepared(turned))[0]
        assert np.trace(best @ (sign * rotation).T) > 1 + 2 * np.cos(np.radians(3))


def test_isometric_bodies_are_told_apart_by_curvature():
    found = of(0)
    dented = Signature(found.points, -found.curvature, found.floor)
    assert shape_distance(found, dented, curvature=0).raw < 1e-6
    assert shape_distance(found, dented).distance > 0.1


def test_holes_are_filled_and_small_parts_left_out():
    V, F = meshes.hemisphere()
    W, G = meshes.icosphere(1)
    P, T = closed_part(np.concatenate([V, 0.1 * W + 9]), np.concatenate([F, G + len(V)]))
    assert np.abs(P).max() < 2 and len(P) - len(T) // 2 == 2 and not len(boundary_edges(T))


def test_what_is_pinched_or_inside_out_is_compared_all_the_same():
    V, F = sphere_shapes.blob(seed=0)
    n = len(V)
    # A fin on an edge, and another blob that hangs by a vertex.
    fin = np.concatenate([F, [[F[0, 0], F[0, 1], n]]])
    P, T = closed_part(np.concatenate([V, V[:1] * 1.2]), fin)
    assert len(P) - len(T) // 2 == 2 and abs(len(T) - len(F)) <= 6
    hanging = np.where(F == 0, 0, F + n - 1)
    P, T = closed_part(np.concatenate([V, 0.5 * (V[1:] - V[0]) + V[0]]), np.concatenate([F, hanging]))
    assert len(P) == n and len(T) == len(F)
    for faces in (F, F[:, ::-1]):
        P, T = closed_part(V, faces)
        assert signed_volumes(P, T).sum() > 0


def test_handles_are_named():
    with pytest.raises(errors.NotASphereError, match="handle"):
        drain(signature(*meshes.torus(), COUNT))
    with pytest.raises(errors.EmptyMeshError, match="There are no faces to compare"):
        drain(signature(np.zeros((0, 3)), np.zeros((0, 3), int)))


def test_faces_too_small_for_double_precision_change_no_signature(monkeypatch):
    V, F = sphere_shapes.blob(seed=0)

    def fails(*_):
        raise errors.PrecisionError("Faces of the conformal map are too small for double precision on the sphere")
        yield

    monkeypatch.setattr(sphere_map, "straightened", fails)
    found = shape_distance(of(0), drain(signature(V, F, COUNT)))
    # The map with exact areas starts elsewhere, and the conformal one is the same.
    assert found.raw <= 1.3 * found.floor
