"""What is shown while handles are dragged is the flow of the last place alone, and what was there comes back."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_every_place_shows_what_it_shows_alone(package, monkeypatch, mode):
    """Some vertices move at one place and not at another, and some come back to where they were."""
    drag, flow, obj = package("operators.volumes.drag"), package("pipelines.volumes.flow"), scenes.bump(4, 3)
    own = np.array([v.co[:] for v in obj.data.vertices])
    if mode == "EDIT":
        scenes.edit(obj)
    handle = package("solver.flows.handles").FlowHandle(own[:1], own[:1], np.array([0]), "first")
    body = flow.FlowBody(obj.name, own, np.zeros((0, 3), int))
    asked = []

    def flowed(job):
        """Those of every n-th vertex, n as far as the handle is shifted upwards."""
        ((_, moved),) = job.handles
        asked.append(moved.end - moved.start)
        every = round(float(asked[-1][0, 2]))
        world = own.copy()
        world[::every] += [0.25 * every, 0, 1]
        yield from ()
        return SimpleNamespace(frames=((world,),))

    monkeypatch.setattr(drag, "flow_bodies", flowed)
    shown = drag.FlowDrag([obj], flow.FlowJob((body,), ((0, handle),)))
    np.testing.assert_allclose(shown.middle, own[0])
    for every in (2, 3, 0, 5, 1, 4, 0):
        assert shown.to(np.array([0, 0, every]))
        found = package("blender.volumes.bodies").read_positions(obj)
        expected = own.copy()
        if every:
            expected[::every] += [0.25 * every, 0, 1]
        np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_allclose([shift[0, 2] for shift in asked], [2, 3, 5, 1, 4])
    shown.restore()
    assert np.array_equal(package("blender.volumes.bodies").read_positions(obj), own.astype(np.float32))
