"""The same body is near itself in any place, size and mirroring, others are not, and distances are symmetric."""

import functools

import meshes
import numpy as np
import pytest
import sphere_shapes

from omt_uv.solver import errors
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.signature import closed_part, signature
from omt_uv.solver.signatures.wasserstein import nearest, shape_distance, spectrum

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
    assert found.raw <= 2 * found.floor
    assert found.raw < 0.7 * shape_distance(of(0), of(3)).raw


def test_distances_are_symmetric_and_zero_on_the_diagonal():
    there, back = shape_distance(of(0), of(1)), shape_distance(of(1), of(0))
    assert abs(there.raw - back.raw) < 1e-6 and shape_distance(of(0), of(0)).raw < 1e-6
    assert np.allclose(there.rotation @ there.rotation.T, np.eye(3))


def test_the_nearest_of_a_library_is_the_body_itself():
    library = [of(seed) for seed in (1, 2, 0, 3)]
    assert nearest(of(0, "moved"), library, 2)[0][0] == 2
    turned = np.linalg.norm(spectrum(of(0)) - spectrum(of(0, "moved")))
    assert turned < 0.5 * np.linalg.norm(spectrum(of(0)) - spectrum(of(1)))


def test_holes_are_filled_and_small_parts_left_out():
    V, F = meshes.hemisphere()
    W, G = meshes.icosphere(1)
    P, T = closed_part(np.concatenate([V, 0.1 * W + 9]), np.concatenate([F, G + len(V)]))
    assert len(P) == len(V) + 1 and len(P) - len(T) // 2 == 2


def test_handles_are_named():
    with pytest.raises(errors.NotASphereError, match="handle"):
        drain(signature(*meshes.torus(), COUNT))
    with pytest.raises(errors.EmptyMeshError):
        drain(signature(np.zeros((0, 3)), np.zeros((0, 3), int)))
