"""Follow a flow by Runge and Kutta's method of order 4, in steps that are planned beforehand on a few points.

The field depends on the handles alone, and these go along chords that are known. So the steps are found once, by
doubling them on probes, with the fields of their stages, and then every point goes through all of them by itself: a
block of points stays in the cache from start to end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import HandleError
from .kernel import FlowField

# Steps are not made longer or shorter than this by one estimate, nor as long as the estimate says.
SHORTER = 0.2
LONGER = 4.0
SAFETY = 0.85
# The first step that is tried, and the shortest, of a unit of time: to try costs little, as probes are few.
FIRST = 1.0
SHORTEST = 1e-5
# Points that go through the steps together.
BLOCK = 2048


@dataclass(frozen=True)
class FlowStep:
    """A step of length h, and the field at its beginning, middle and end."""

    length: float
    fields: tuple[FlowField, FlowField, FlowField]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Where points (k,d) are after it."""
        first, middle, last = self.fields
        h = self.length
        a = first(points)
        b = middle(points + 0.5 * h * a)
        c = middle(points + 0.5 * h * b)
        return points + h / 6 * (a + 2 * (b + c) + last(points + h * c))


def planned_steps(
    field_at: Callable[[int, float], FlowField], knots: np.ndarray, probes: np.ndarray, tolerance: float
) -> list[list[FlowStep]]:
    """Steps between knots (k + 1,) of time, a list for each of the k stretches, that keep probes (q,d) within
    `tolerance` per unit of time. `field_at(j, t)` is the field at time t of stretch j, smooth within the stretch.

    Raises
    ------
    HandleError : no step is short enough
    """
    plan: list[list[FlowStep]] = []
    length = FIRST
    for j in range(len(knots) - 1):
        steps: list[FlowStep] = []
        time, first = knots[j], field_at(j, knots[j])
        while time < knots[j + 1]:
            left = knots[j + 1] - time
            # No rest that is shorter than a step should be.
            h = left if length > 0.999 * left else min(length, left / 2) if length > left / 2 else length
            end = knots[j + 1] if h == left else time + h
            quarter, half, third = (field_at(j, time + s * h) for s in (0.25, 0.5, 0.75))
            last = field_at(j, end)
            pair = [FlowStep(h / 2, (first, quarter, half)), FlowStep(h / 2, (half, third, last))]
            fine = pair[1](pair[0](probes))
            error = np.abs(fine - FlowStep(h, (first, half, last))(probes)).max(initial=0.0) / 15
            allowed = tolerance * h
            length = h * float(np.clip(SAFETY * (allowed / max(error, 1e-300)) ** 0.25, SHORTER, LONGER))
            if error > allowed:
                if not length >= SHORTEST:
                    raise HandleError("Handles tear what is between them apart: no step of the flow is short enough")
                continue
            steps += pair
            time, first, probes = end, last, fine
        plan.append(steps)
    return plan


def carried(points: np.ndarray, steps: list[FlowStep]) -> np.ndarray:
    """Where a block of points (k,d) is after all steps."""
    for step in steps:
        points = step(points)
    return points
