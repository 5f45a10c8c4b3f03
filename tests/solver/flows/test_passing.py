"""Handles that pass one another closely are named, with a radius that is calmer."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere

from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.flows.passing import NEAR, Passing, closest_passing
from omt_uv.solver.progress import drain


def opposed(distance, way):
    """Two handles beside one another that go opposite ways, and points around them."""
    V, _ = icosphere(3)
    a, b = np.array([[0.0, -distance / 2, 0]]), np.array([[0.0, distance / 2, 0]])
    step = np.array([[way, 0, 0]])
    return V, (FlowHandle(a, a + step, None, "left"), FlowHandle(b, b - step, None, "right"))


def test_handles_close_together_that_part_are_named():
    V, handles = opposed(0.008, 0.2)
    found = drain(flow(V, handles, FlowOptions(radius=0.6)))
    assert found.surge > 3 and found.missed < 1e-9
    (warning,) = found.warnings
    assert "left and right" in warning


def test_a_narrow_kernel_keeps_the_rest_calm_and_the_way_back_leads_back():
    V, handles = opposed(0.05, 0.2)
    options = FlowOptions(radius=0.3, diagonal=3.0)
    found = drain(flow(V, handles, options))
    # One kernel alone: what is around moves by the radius over the distance.
    assert 3 * found.surge < 0.3 * 3 / 0.05 and found.missed < 1e-9
    back = tuple(FlowHandle(h.end, h.start) for h in handles)
    returned = drain(flow(found.positions, back, options)).positions
    assert np.abs(returned - V).max() < 1e-4 * options.diagonal


def test_what_is_far_from_the_others_is_calm():
    V, handles = opposed(1.5, 0.2)
    calm = drain(flow(V, handles, FlowOptions(radius=0.1)))
    assert calm.surge < 1.5 and not calm.warnings


def test_how_strongly_handles_contradict_each_other():
    here = np.array([[0.0, 0, 0], [0.0, 0.1, 0]])
    way = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    path = np.stack([here - way, here + way])
    found = closest_passing(path, np.array([4, 2]), 0.2)
    assert found.handles == (2, 4) and found.strength == pytest.approx(2 * 0.2 / 0.1, rel=0.2)
    assert 0 < found.near < NEAR
    turned = closest_passing(path[::-1], np.array([4, 2]), 0.2)
    assert turned.strength == pytest.approx(found.strength, rel=1e-12)
    assert closest_passing(path, np.zeros(2, int), 0.2) == Passing(0.0, (-1, -1), 0.0)
    assert not Passing(0.0, (-1, -1), 0.0).warning([], 9.0, np.zeros((3, 2)))


def test_one_handle_is_as_fast_as_what_it_takes_along():
    V, handles = opposed(0.0, 0.2)
    found = drain(flow(np.concatenate([V, handles[0].start]), handles[:1]))
    assert found.surge == pytest.approx(1.0, abs=1e-6)
