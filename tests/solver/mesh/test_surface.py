"""Surfaces: what is wrong with them is named, and nothing else."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import DuplicateFaceError, EmptyMeshError, NonFiniteError, ZeroAreaFaceError
from omt_uv.solver.mesh import surface as surfaces
from omt_uv.solver.mesh.surface import (
    chosen_triangles,
    degenerate_triangles,
    duplicate_faces,
    is_seam,
    strict_gluing,
    triangle_surface,
    using_twice,
)
from omt_uv.solver.mesh.topology import pair_keys


def test_triangles_are_their_polygons():
    V, F = meshes.bumpy()
    surface = triangle_surface(V, F)
    np.testing.assert_array_equal(surface.corner_vertex[surface.triangles], F)
    np.testing.assert_array_equal(surface.triangle_face, np.arange(len(F)))
    assert not len(surface.seams) and not len(surface.sharp)


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_needles_are_degenerate_at_any_scale(scale):
    V = scale * np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1e-12, 0], [0, 1, 0]])
    np.testing.assert_array_equal(degenerate_triangles(V, np.array([[0, 1, 2], [0, 1, 3]])), [True, False])


def test_duplicates_are_numbered_among_their_likes():
    V, F = meshes.grid(2, 2)
    twice = np.concatenate([F, F[[3, 5, 3]][:, [1, 2, 0]]])
    rows = duplicate_faces(triangle_surface(V, twice), np.ones(len(twice), bool))
    assert rows[:, :2].tolist() == [[3, 0], [5, 0], [8, 1], [9, 1], [10, 2]]
    assert (np.sort(twice[rows[:, 0]], axis=1) == np.sort(twice[rows[:, 2]], axis=1)).all()
    assert set(rows[:, 2]) == {3, 5}


@pytest.mark.parametrize("seed", range(3))
def test_duplicates_of_many_faces_are_those_of_few(seed, monkeypatch):
    V, F = meshes.grid(30, 30)
    rng = np.random.default_rng(seed)
    again = rng.permuted(F[rng.integers(0, len(F), 20)], axis=1)
    surface = triangle_surface(V, rng.permutation(np.concatenate([F, again])))
    every = np.ones(len(surface.triangles), bool)
    found = duplicate_faces(surface, every)
    monkeypatch.setattr(surfaces, "FEW_CORNERS", surface.triangles.size)
    expected = duplicate_faces(surface, every)
    assert len(expected) > 20 and (found == expected).all()


def test_polygons_with_a_vertex_used_twice_are_nobody_s_duplicates():
    V, F = meshes.grid(2, 2)
    a, b = F[0, :2]
    surface = triangle_surface(V, np.vstack([F, [[a, b, a], [b, a, a]]]))
    assert len(duplicate_faces(surface, np.ones(len(F) + 2, bool))) == 0


def test_polygons_with_a_vertex_used_twice_are_those_of_their_corners():
    rng = np.random.default_rng(0)
    polygons = [rng.integers(0, 9, size).tolist() for size in rng.integers(3, 7, 200)]
    twice = [k for k, corners in enumerate(polygons) if len(set(corners)) < len(corners)]
    assert using_twice(meshes.polygon_surface(rng.random((9, 3)), polygons)).tolist() == twice
    assert 50 < len(twice) < 200


def test_seams_know_no_direction():
    surface = triangle_surface(*meshes.grid(), seams=[(1, 0), (5, 6)])
    keys = pair_keys(np.array([0, 6, 0]), np.array([1, 5, 2]))
    assert is_seam(surface, keys).tolist() == [True, True, False]


def test_only_chosen_faces_are_judged():
    V, F = meshes.grid(4, 4)
    V[0] = np.nan
    F = np.concatenate([F, F[[-1]], [[7, 7, 8]]])
    surface = triangle_surface(V, F)
    with pytest.raises(NonFiniteError) as caught:
        chosen_triangles(surface, None)
    assert caught.value.elements.tolist() == [0]
    good = ~(F == 0).any(axis=1)
    with pytest.raises(ZeroAreaFaceError) as caught:
        strict_gluing(surface, good)
    assert caught.value.elements.tolist() == [len(F) - 1]
    good[-1] = False
    with pytest.raises(DuplicateFaceError, match="Faces share all their vertices with another"):
        strict_gluing(surface, good)
    good[-2] = False
    assert len(strict_gluing(surface, good).triangles) == good.sum()
    with pytest.raises(EmptyMeshError, match="There are no faces to unwrap"):
        strict_gluing(surface, np.zeros(len(F), bool))
