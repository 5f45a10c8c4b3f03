"""Handles that pass one another closely are named, with a radius that is calmer."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere

from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.flows.passing import Surge
from omt_uv.solver.progress import drain


def opposed(distance, way):
    """Two handles beside one another that go opposite ways, and points around them."""
    V, _ = icosphere(3)
    a, b = np.array([[0.0, -distance / 2, 0]]), np.array([[0.0, distance / 2, 0]])
    step = np.array([[way, 0, 0]])
    return V, (FlowHandle(a, a + step, None, "left"), FlowHandle(b, b - step, None, "right"))


def test_handles_close_together_that_part_are_named():
    V, handles = opposed(0.05, 0.2)
    found = drain(flow(V, handles, FlowOptions(radius=0.3)))
    assert found.surge > 3
    (warning,) = found.warnings
    assert "left and right" in warning and "radius" in warning
    # What is far from the others is calm.
    V, handles = opposed(1.5, 0.2)
    calm = drain(flow(V, handles, FlowOptions(radius=0.1)))
    assert calm.surge < 1.5 and not calm.warnings


def test_one_handle_is_as_fast_as_what_it_takes_along():
    V, handles = opposed(0.0, 0.2)
    found = drain(flow(np.concatenate([V, handles[0].start]), handles[:1]))
    assert found.surge == pytest.approx(1.0, abs=1e-6)
    assert Surge(9.0, (-1, -1), 0.0).warning([], 0.1) is None
