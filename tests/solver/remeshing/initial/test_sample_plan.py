"""Plans have room for their samples, fit face counts, and give corners up only when they must."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.topology import paired
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


@pytest.mark.parametrize("count", [80, 300])
def test_sides_that_lie_on_one_another_are_planned_as_if_they_were_apart(count):
    """A tube that is slit along, its sides on one another or next to it: edges as long, samples on both sides."""
    plans, lengths = [], []
    for gap in (0.0, 1e-3):
        V, F = meshes.grid(16, 10)
        turn = 2 * np.pi * (1 - gap) * V[:, 0]
        P = np.column_stack([np.cos(turn), 2 * V[:, 1], -np.sin(turn)])
        number = np.arange(len(P)).reshape(11, 17)
        P[number[:, 16]] = P[number[:, 0]] if gap == 0 else P[number[:, 16]]
        plans.append(plan(P, F, count))
        component = RemeshSource(P, F).maps[0].component
        ends = component.vertices[paired(component.to_reopen)]
        lengths.append(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum())
    closed, apart = plans
    assert closed.size == pytest.approx(apart.size, rel=1e-2)
    assert closed.initial_size == pytest.approx(apart.initial_size, rel=1e-2)
    assert apart.vertex_count == count > closed.vertex_count
    # Copies on the slit make up for what is less.
    assert lengths[0] > 0 == lengths[1]
    assert count - closed.vertex_count == pytest.approx(lengths[0] / closed.size, abs=2)
