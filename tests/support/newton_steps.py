"""Newton's problem for a hemisphere, and steps that are nearly those of a factorisation."""

import meshes
import numpy as np

from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.refinement.projected_newton import CircleMotion, FreeMotion, newton_direction


def hemisphere(kind):
    """Vertices, triangles, a map with true meridians, and how it may move: "free", but for some, or on a "circle"."""
    V, F = meshes.hemisphere(40, 96)
    direction = V[:, 0] + 1j * V[:, 1]
    w = np.arctan2(np.abs(direction), V[:, 2]) * np.exp(1j * np.angle(direction))
    if kind == "free":
        return V, F, w, FreeMotion(np.arange(len(w)) % 97 == 0)
    return V, F, w, CircleMotion(boundary_loops(F)[0], np.pi / 2, len(w))


def check_promise(whole, other, w):
    """A step of another solver promises nearly as much as that of a factorisation, and moves nothing that may not."""
    _, most = newton_direction(whole, w)
    step, slope = newton_direction(other, w)
    assert most <= slope * (1 - 1e-9) and slope < 0.9 * most
    axes = step.view(float).reshape(-1, 2)
    np.testing.assert_array_equal(axes[~other.motion.free], 0)
