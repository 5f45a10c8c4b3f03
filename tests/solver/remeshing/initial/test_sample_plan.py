"""Plans have room for their samples, fit face counts, and give corners up only when they must."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.options import RemeshOptions
from omt_uv.solver.remeshing.initial.sample_plan import min_sample_count, plan_samples


def plan(V, F, count, **options):
    maps = RemeshSource(V, F).maps[0]
    component = maps.component
    one, at_vertices = np.ones(len(component.triangles)), np.ones(len(component.vertices))
    return plan_samples(maps, count, one, at_vertices, RemeshOptions(**options), 1.0)


@pytest.mark.parametrize("count", [120, 121])
def test_faces_come_out_exactly(count):
    """F = 2 V - 2 euler - b, for b samples on the boundary."""
    found = plan(*meshes.annulus(), count, count_of="faces")
    assert 2 * found.vertex_count - found.samples.fixed.sum() == count


def test_samples_never_exceed_the_count():
    for count in (4, 6, 12, 60):
        found = plan(*meshes.grid(8, 8), count)
        assert found.samples.fixed.sum() <= found.vertex_count == count and found.warnings == ()
    assert "corners" in plan(*meshes.grid(8, 8), 3).warnings[0]
    assert plan(*meshes.grid(8, 8), 3, preserve_boundary=False).warnings == ()


def test_the_least_samples_are_those_of_the_corners():
    maps = RemeshSource(*meshes.grid(8, 8)).maps[0]
    assert (min_sample_count(maps, True), min_sample_count(maps, False)) == (4, 3)
    assert min_sample_count(RemeshSource(*meshes.torus()).maps[0], True) == 0
