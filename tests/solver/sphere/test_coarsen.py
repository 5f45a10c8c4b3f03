"""Coarsening of closed meshes: spheres on every level, masses kept, rounds independent."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from sphere_shapes import SHAPES, blob

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import signed_volumes
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.coarsen import collapse_to_tetrahedron
from omt_uv.solver.sphere.multilevel import multilevel_start


@pytest.mark.parametrize("name", SHAPES)
def test_coarse_to_fine_never_folds(name):
    V, F = SHAPES[name]
    area = face_areas(V, F)
    for level in (levels := collapse_to_tetrahedron(V, F, area)):
        assert len(level.triangles) == 2 * len(level.vertices) - 4 and (twins(level.triangles) >= 0).all()
        np.testing.assert_allclose(level.mass.sum(), area.sum())
        assert len(level.mass) == len(level.triangles) and level.mass.min() > 0
    assert len(levels[-1].vertices) == 4
    p, _ = drain(multilevel_start(V, F, area))
    assert (signed_volumes(p, F) > 0).all()


def test_levels_hold_the_vertices_that_are_left_and_rounds_whose_neighbourhoods_do_not_meet():
    V, F = blob(2)
    levels = collapse_to_tetrahedron(V, F, face_areas(V, F))
    for fine, coarse in itertools.pairwise(levels):
        np.testing.assert_array_equal(fine.vertices[fine.kept], coarse.vertices)
        removed = np.concatenate([step.removed for step in fine.rounds])
        np.testing.assert_array_equal(np.sort(np.concatenate([removed, fine.kept])), np.arange(len(fine.vertices)))
        for step in fine.rounds:
            np.testing.assert_array_equal(step.star[:, 0], step.removed[step.owner])
            around = np.unique(np.column_stack([step.owner, step.star[:, 1]]), axis=0)[:, 1]
            assert len(np.unique(np.concatenate([around, step.removed]))) == len(around) + len(step.removed)
            # The vertex that each moves into is one of its neighbours.
            pairs = set(zip(step.owner.tolist(), step.star[:, 1].tolist(), strict=True))
            assert all(pair in pairs for pair in enumerate(step.parent.tolist()))


def test_the_unit_of_length_does_not_count_and_the_seed_does():
    V, F = blob(2)
    area = face_areas(V, F)
    levels = collapse_to_tetrahedron(V, F, area)
    for level, scaled in zip(levels, collapse_to_tetrahedron(4 * V, F, 16 * area), strict=True):
        np.testing.assert_array_equal(level.triangles, scaled.triangles)
        np.testing.assert_array_equal(16 * level.mass, scaled.mass)
    other = collapse_to_tetrahedron(V, F, area, seed=1)
    assert not np.array_equal(levels[0].kept, other[0].kept)
