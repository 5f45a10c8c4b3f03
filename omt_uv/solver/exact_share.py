"""The density that gives a painted region exactly the share asked of the domain, whatever its rim and its rest.

The share of a region with weights w is sum(w a) / sum(a), a soft count of the areas a: see `measure.share`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import ShareError
from .measure import check_factor, check_weights, share

# Where the linear law takes this many times the factor that a region with a hard rim would need, or has none, the
# rim eats what the region is meant to get.
MOST_OF_HARD = 4.0
BISECTIONS = 60


@dataclass(frozen=True)
class ExactShare:
    """density (m,), before it is normalised; factor of weight 1 against weight 0 in it; `law` "linear" for
    1 + (factor - 1) w or "geometric" for factor ** w; shares before and asked; warnings."""

    density: np.ndarray
    factor: float
    law: str
    before: float
    asked: float
    warnings: tuple[str, ...] = ()


def exact_share(weights: np.ndarray, area: np.ndarray, factor: float, base: np.ndarray | None = None) -> ExactShare:
    """Density that gives a region with weights (m,) in [0, 1] `factor` times its share.

    The linear law 1 + (M - 1) w with mean <.> over the measure has the share

        (<w> + (M - 1) <w w>) / (1 + (M - 1) <w>),

    solved for M in closed form. It never exceeds <w w> / <w>: what the rim takes is lost. Where that is too little,
    M ** w takes its place: among all densities of a given share the nearest to the present one in relative entropy,
    and it has every share between the smallest and the largest weight.

    Parameters
    ----------
    area : (m,) measure in which the region has its share before: areas of the surface, or of a UV map
    base : (m,) density that is there already, 1 by default; the share before is that in area times base

    Raises
    ------
    WeightError, ShareError : weights that mark nothing; a factor or a share that no map has
    """
    check_factor(factor)
    weights = check_weights(weights)
    measure = area if base is None else area * base
    before = share(weights, measure)
    asked = factor * before
    if not before > 0:
        raise ShareError("The region has no area", "Paint a region with area")
    least, most = float(weights.min()), float(weights.max())
    if asked >= 1:
        raise ShareError(
            f"The region has {100 * before:.3g} % of the area; {factor:g} times that is {100 * asked:.4g} % "
            "of the texture, which leaves nothing for the rest",
            f"Choose a factor below {1 / before:.3g}, or paint a smaller region",
        )
    if not least < asked < most:
        raise ShareError(
            f"With weights from {least:.3g} to {most:.3g} the region cannot have {100 * asked:.3g} % of the texture",
            "Paint the region with weight 1 and the rest with 0",
        )
    linear = _linear(weights, measure, before, asked)
    if linear is not None:
        return ExactShare(1 + (linear - 1) * weights, linear, "linear", before, asked)
    found = _geometric(weights, measure, asked)
    warning = "The rim of the region is too soft for this factor; its density grows geometrically with the weight"
    return ExactShare(found**weights, found, "geometric", before, asked, (warning,))


def _linear(weights, measure, before: float, asked: float) -> float | None:
    """The factor of the linear law; None where it is out of bounds."""
    square = share(weights**2, measure)
    # For w in {0, 1}, where <w w> = <w>.
    hard = asked / (1 - asked) * (1 - before) / before
    room = square - asked * before
    if room <= 0:
        return None
    factor = 1 + (asked - before) / room
    fits = hard / MOST_OF_HARD <= factor <= hard * MOST_OF_HARD
    return factor if fits else None


def _geometric(weights, measure, asked: float) -> float:
    """The M at which sum(w M^w a) / sum(M^w a) is the share asked, by bisection in log M, where it is monotone."""

    def error(log: float) -> float:
        # Taking off the largest exponent keeps the powers finite.
        power = np.exp(log * weights - max(log, 0.0) * weights.max())
        return share(weights, power * measure) - asked

    low = high = 0.0
    step = 1.0
    while error(low) > 0 or error(high) < 0:
        low, high, step = (low - step, high, 2 * step) if error(low) > 0 else (low, high + step, 2 * step)
        if step > 1e4:
            raise ShareError("No density gives the region this share")
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if error(middle) > 0 else (middle, high)
    return float(np.exp((low + high) / 2))
