"""Decide for many charts, which take their steps together, how each goes on, by the rules of `continuation_rules`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .continuation_rules import (
    FIRST_PRESSURE,
    QUALITIES,
    SQUEEZED_WEIGHT,
    STAGE_STEPS,
    is_enough,
    is_futile,
    is_squeezed,
    judge_step,
    next_pressure,
    next_weight,
    planned_weights,
    promised,
    spare_weight,
    stage_tolerances,
)

Energies = Callable[[np.ndarray], np.ndarray]  # of each chart (c,), by the area weights (c,)


@dataclass(frozen=True)
class AreaErrors:
    """What the map of every chart lacks of its areas, (c,) each.

    Attributes
    ----------
    error : see `energy.target_error`
    error_but_share : the same, the share of the region aside
    tilt : of the targets, which the share of the region lacks, see `energy.missing_tilt`
    """

    error: np.ndarray
    error_but_share: np.ndarray
    tilt: np.ndarray


class BatchContinuation:
    """The stages of every chart of a batch, (c,) each.

    Attributes
    ----------
    live : on its way
    solved : arrived where the quality asks for
    steps : Newton steps
    area_weight, value : weight of the area term, and the energy with it
    pressure : of the Hessian, see `continuation_rules.next_pressure`
    residual, multiplier : see `continuation.ContinuationResult`
    """

    def __init__(self, with_polygons: np.ndarray, quality: str, balance: float, energies: Energies):
        """Start all charts; with_polygons (c,) : which have more than triangles."""
        self.quality, self.balance = QUALITIES[quality], balance
        self._with_polygons, count = with_polygons, len(with_polygons)
        self._planned = np.array(planned_weights(balance, self.quality))
        self._level, self.area_weight = np.zeros(count, np.int64), np.full(count, self._planned[0])
        squeezed = is_squeezed(energies(self.area_weight), self._planned[0])
        self._level[squeezed], self.area_weight[squeezed] = -1, SQUEEZED_WEIGHT
        self.multiplier, self._error_before = np.zeros(count), np.full(count, np.inf)
        self.value = energies(self.area_weight)
        self.live = np.isfinite(self.value)
        self.solved = np.zeros(count, bool)
        self.steps, self._stage_steps = np.zeros_like(self._level), np.zeros_like(self._level)
        self.pressure, self.residual = np.full(count, FIRST_PRESSURE), np.full(count, np.inf)

    def update(self, value, decrement, share, errors: AreaErrors, energies: Energies) -> None:
        """After a step: new energies, decreases promised, shares of the step taken, (c,) each; what is left to do."""
        used, gain = self.pressure, self.value - value
        self.value = np.where(self.live, value, self.value)
        self.residual = np.where(self.live, promised(decrement, value), self.residual)
        self.steps += self.live
        self._stage_steps += self.live
        self.pressure = next_pressure(used, share, gain, decrement)
        on_the_way = self._level < len(self._planned) - 1
        tolerance, loose = stage_tolerances(self.quality, self.balance, on_the_way=False, early=False)
        met = (self.residual < loose) & (errors.error <= np.where(on_the_way, np.inf, self.quality.area_error))
        verdict = judge_step(share, used, self.residual, met, tolerance)
        self.pressure[verdict.sharpen] = 0.0
        spent = self.steps >= self.quality.max_steps
        long = (self._stage_steps >= STAGE_STEPS) & (self.balance == 0)
        ended = self.live & (verdict.stalled | verdict.converged | spent | long)
        self._next_stage(ended, verdict.stalled | spent, verdict.converged, errors)
        self.value = np.where(self.live & (self._stage_steps == 0), energies(self.area_weight), self.value)

    def _next_stage(self, ended, failed, converged, errors: AreaErrors) -> None:
        """A greater area weight where a stage has ended and it was not the last."""
        quality, weight, planned = self.quality, self.area_weight, len(self._planned)
        self._level += ended
        enough = is_enough(quality, self.balance, errors.error, weight)
        enough |= converged & is_futile(quality, errors.error, self._error_before)
        self._error_before = np.where(ended, errors.error, self._error_before)
        finished = ended & (failed | (enough & (self._level >= planned)))
        self.solved |= finished & ~failed
        self.live = self.live & ~finished
        further = ended & ~finished
        if self.balance == 0:
            self.multiplier = np.where(further, self.multiplier + weight * errors.tilt, self.multiplier)
        following = self._planned[np.clip(self._level, 0, planned - 1)]
        spare = spare_weight(following, weight, errors.error, quality)
        following = np.where(self._with_polygons, spare, following)
        following = np.where(self._level < planned, following, next_weight(weight, errors.error_but_share, quality))
        self.area_weight = np.where(further, following, weight)
        self.pressure[further], self._stage_steps[further] = FIRST_PRESSURE, 0
