"""Register the insides of two bodies by landmarks, without a change of volume (Hu, Zou, Hua 2014, section 5).

Both bodies are in the ball, each by its own map. The landmarks of one are turned onto those of the other (Kabsch
1976), and then led to them by a flow without divergence that no point leaves the ball by (`flows/flow_map`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import HandleError
from ..flows.domain import ball_domain
from ..flows.flow_map import flow
from ..flows.handles import FlowHandle
from ..flows.options import BLEND, FlowOptions
from ..mesh.geometry import nearest_rotations
from ..progress import Steps

# Landmarks farther out than this are pulled in: at the wall a flow only goes along it.
OUTERMOST = 0.97


@dataclass(frozen=True)
class VolumeRegistration:
    """Positions (n,3) of the first body's map in the ball of the second; the rotation (3,3) that came first.

    before, after: mean distance of landmarks after the rotation, and after the flow
    """

    positions: np.ndarray
    rotation: np.ndarray
    before: float
    after: float


def registered(
    positions: np.ndarray, landmarks: np.ndarray, goals: np.ndarray, options: FlowOptions | None = None
) -> Steps[VolumeRegistration]:
    """Lead landmarks (k,3) in the ball to goals (k,3) there, and the positions (n,3) of a map along.

    Raises
    ------
    HandleError : fewer than three landmarks, or pairs that contradict each other
    """
    if len(landmarks) < 3 or len(landmarks) != len(goals):
        raise HandleError("A registration needs three landmarks or more, in pairs", "Give more landmarks")
    rotation = nearest_rotations(goals.T @ landmarks)
    turned, start, end = positions @ rotation.T, _inner(landmarks @ rotation.T), _inner(goals)
    before = float(np.linalg.norm(start - end, axis=1).mean())
    options = options or FlowOptions(radius=0.25, path=BLEND)
    handles = tuple(
        FlowHandle(a[None], b[None], None, f"landmark {k}") for k, (a, b) in enumerate(zip(start, end, strict=True))
    )
    if before < 1e-12:
        return VolumeRegistration(turned, rotation, before, before)
    everything = np.concatenate([turned, start])
    found = yield from flow(everything, handles, options, domain=ball_domain(np.zeros(3), 1.0))
    after = float(np.linalg.norm(found.positions[len(turned) :] - end, axis=1).mean())
    return VolumeRegistration(found.positions[: len(turned)], rotation, before, after)


def _inner(points: np.ndarray) -> np.ndarray:
    """Points (k,3), those near the wall a little farther in."""
    distance = np.linalg.norm(points, axis=1)
    return points * np.minimum(1.0, OUTERMOST / np.maximum(distance, 1e-300))[:, None]
