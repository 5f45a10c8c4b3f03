"""What `stages.py` decides for one chart from step to step, for many charts that take their steps together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .continuation import (
    FIRST_PRESSURE,
    LEAST_PRESSURE,
    LOOSE,
    NO_ENERGY,
    QUALITIES,
    SQUEEZED,
    STAGE_STEPS,
    STRICT,
    STUCK,
    planned_weights,
    weight_growth,
)

Energies = Callable[[np.ndarray], np.ndarray]  # of each chart (c,), by the weights of the area term (c,)


@dataclass(frozen=True)
class AreaErrors:
    """What the map of every chart lacks (c,): `energy.target_error`, the same but for the share of its region, and the
    tilt that this share lacks."""

    error: np.ndarray
    but_share: np.ndarray
    tilt: np.ndarray


class BatchContinuation:
    """Weight of the area term, `pressure` of the Hessian, energy and fate of every chart, (c,) each.

    live: on its way; solved: arrived where the quality asks for; steps: Newton steps; residual: see
    `continuation.StageResult`; multiplier: see `continuation.ContinuationResult`.
    """

    def __init__(self, count: int, quality: str, balance: float, energies: Energies):
        self.settings, self.balance = QUALITIES[quality], balance
        self.weights = np.array(planned_weights(balance, self.settings))
        self.level, self.weight = np.zeros(count, np.int64), np.full(count, self.weights[0])
        squeezed = (energies(self.weight) > SQUEEZED) & (self.weights[0] > 1)
        self.level[squeezed], self.weight[squeezed] = -1, 1.0
        self.multiplier, self.error = np.zeros(count), np.full(count, np.inf)
        self.value = energies(self.weight)
        self.live = np.isfinite(self.value)
        self.solved = np.zeros(count, bool)
        self.steps, self.stage_steps = np.zeros_like(self.level), np.zeros_like(self.level)
        self.pressure, self.residual = np.full(count, FIRST_PRESSURE), np.full(count, np.inf)

    def update(self, value, decrement, share, lack: AreaErrors, energies: Energies) -> None:
        """After a step: new energies, decreases promised, shares of the step taken, (c,) each; what is left to do."""
        live, used, error = self.live, self.pressure, lack.error
        gain = self.value - value
        self.value = np.where(live, value, self.value)
        self.residual = np.where(live, decrement / np.maximum(value, NO_ENERGY), self.residual)
        self.steps += live
        self.stage_steps += live
        self.pressure = _next_pressure(used, share, gain, decrement)
        tolerance = self.settings.tolerance if self.balance == 0 else STRICT
        goal = np.where(self.level >= len(self.weights) - 1, self.settings.area_error, np.inf)
        stalled = (share == 0) & (used == 1)
        met = (self.residual < LOOSE) & (error <= goal)
        low = self.residual < tolerance
        self.pressure[low & (used > LEAST_PRESSURE)] = 0.0
        spent = self.steps >= self.settings.max_steps
        long = (self.stage_steps >= STAGE_STEPS) & (self.balance == 0)
        self._next_stage(
            live & (stalled | met | (low & (used <= LEAST_PRESSURE)) | spent | long), stalled | spent, lack
        )
        self.value = np.where(self.live & (self.stage_steps == 0), energies(self.weight), self.value)

    def _next_stage(self, ended, failed, lack: AreaErrors) -> None:
        settings, last = self.settings, len(self.weights)
        self.level += ended
        enough = (lack.error <= settings.area_error) | (self.balance > 0) | (self.weight >= settings.greatest_weight)
        enough |= (lack.error > STUCK * self.error) & (self.stage_steps < STAGE_STEPS)
        self.error = np.where(ended, lack.error, self.error)
        finished = ended & (failed | (enough & (self.level >= last)))
        self.solved |= finished & ~failed
        self.live = self.live & ~finished
        further = ended & ~finished
        if self.balance == 0:
            self.multiplier = np.where(further, self.multiplier + self.weight * lack.tilt, self.multiplier)
        more = self.weight * weight_growth(lack.but_share / settings.area_error)
        planned = self.weights[np.clip(self.level, 0, last - 1)]
        self.weight = np.where(further, np.where(self.level < last, planned, more), self.weight)
        self.pressure[further], self.stage_steps[further] = FIRST_PRESSURE, 0


def _next_pressure(pressure, share, gain, decrement):
    """See `stages._next_pressure`."""
    full, poor = (share == 1) & (gain > 0.7 * decrement), (share < 0.5) | (gain < 0.3 * decrement)
    more = np.minimum(1.0, np.maximum(3 * pressure, 3 * LEAST_PRESSURE))
    less = np.where(pressure > LEAST_PRESSURE, pressure / 3, 0.0)
    return np.where(full, less, np.where(share == 0, 1.0, np.where(poor, more, pressure)))
