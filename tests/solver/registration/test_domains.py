"""Surfaces made ready for a domain: holes get fans, and a disk keeps the boundary that is longest along its edges."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.errors import TopologyMismatchError
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.registration.domains import DISK, SPHERE, filled


def ring(inner, n=24):
    """A ring whose inner boundary has these radii, in turn: vertices of the outer one come first."""
    angle = 2 * np.pi * np.arange(n) / n
    radius = np.concatenate([np.ones(n), np.resize(inner, n)])
    V = radius[:, None] * np.column_stack([np.tile(np.cos(angle), 2), np.tile(np.sin(angle), 2), np.zeros(2 * n)])
    k, after = np.arange(n), (np.arange(n) + 1) % n
    return V, np.concatenate([np.column_stack([k, after, n + k]), np.column_stack([after, n + after, n + k])])


# A jagged boundary is longer than the round one around it.
@pytest.mark.parametrize("inner, kept", [([0.5], "outer"), ([0.3, 0.75], "inner"), ([0.69, 0.75], "outer")])
@pytest.mark.parametrize("unit", [1e-6, 1.0])
def test_a_disk_keeps_the_boundary_with_the_longest_edges(inner, kept, unit):
    V, F = ring(inner)
    found = filled((unit * V, F), DISK, "ring")
    assert set(found.loop.tolist()) == (set(range(24)) if kept == "outer" else set(range(24, 48)))
    assert found.holes == 1 and found.own == 48 and found.count == len(F)
    np.testing.assert_array_equal(found.triangles[: len(F)], F)
    (loop,) = boundary_loops(found.triangles)
    assert set(loop.tolist()) == set(found.loop.tolist())


def test_a_sphere_has_no_boundary_and_a_disk_needs_one():
    V, F = ring([0.5])
    closed = filled((V, F), SPHERE, "ring")
    assert closed.holes == 2 and not len(closed.loop) and not len(boundary_loops(closed.triangles))
    with pytest.raises(TopologyMismatchError, match="is closed"):
        filled((closed.vertices, closed.triangles), DISK, "ball")
