"""A live session that is on ends, with its UVs kept, before anything else changes UVs: whatever it is that begins, and
the result is of the UVs that the session left."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

DRAFT = {"quality": "DRAFT"}
# Operator, arguments, and whether where UVs are after it hangs on where they were.
RUNS = {
    "unwrap": ("omt_unwrap", {**DRAFT, "max_shear": 0.0}, False),
    "refine": ("omt_refine", DRAFT, True),
    "live": ("omt_live", {"pack": False}, False),
    "density": ("omt_density_set", {"density": 40.0}, True),
    "stack": ("omt_stack", {}, True),
    "rectify": ("omt_rectify", {}, True),
    "push": ("omt_flow", {"start": (0.5, 0.5), "move": (0.05, 0.0)}, True),
}


class StandingSession:
    """A session that is on: once it is kept, UVs stand elsewhere."""

    def __init__(self, obj, following):
        self.obj, self.following, self.told = obj, following, []
        self.is_on, self.goes_back = True, False

    def keep(self, _context):
        self.told.append("kept")
        scenes.set_uv(self.obj, scenes.uv_of(self.obj) * [0.5, 0.75] + [0.25, 0.125])
        self.following.end()

    def close(self):
        self.told.append("closed")


@pytest.mark.parametrize("run", RUNS)
def test_a_session_is_kept_before_another_operator_reads_what_there_is(package, run):
    name, given, depends = RUNS[run]
    following = package("session.following")

    def after(live):
        scenes.open_empty()
        obj = scenes.bump(4, 3)
        scenes.set_uv(obj, scenes.seen_from_above(obj))
        session = StandingSession(obj, following)
        if live:
            following.begin(session, session.keep)
        else:
            session.keep(None)
        try:
            assert getattr(bpy.ops.uv, name)(**given) == {"FINISHED"}
        finally:
            following.end()
        return scenes.uv_of(obj), session.told

    found, told = after(True)
    expected, _ = after(False)
    assert told == ["kept", "closed"]
    if depends:
        np.testing.assert_allclose(found, expected, atol=1e-6)
