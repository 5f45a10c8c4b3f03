"""The density that gives a painted region exactly the share asked of the domain, whatever its rim and its rest.

The share of a region with weights w is sum(w a) / sum(a), a soft count of the areas a: see `density.region_share`. Of
all measures in which the region has a given share, M^w times the present one is the nearest in relative entropy
(Csiszar 1975). These densities form a group: magnified twice by 2 the region has just the density of once by 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import ShareError
from .density import CONTRAST, check_factor, check_region, painted_density, region_share

# A factor so many times what a region with a hard rim would need is said: the rest gets little of the texture.
MOST_OF_HARD = 4.0
BISECTIONS = 60


@dataclass(frozen=True)
class RegionDensity:
    """What a painted region is to get.

    density : (m,) of the faces, before it is normalised
    contrast : density of weight 1 over that of weight 0
    share_before, target_share : shares of the area that the region has, and that it gets
    """

    density: np.ndarray
    contrast: float
    share_before: float
    target_share: float
    warnings: tuple[str, ...] = ()


def exact_density(
    weights: np.ndarray, area: np.ndarray, factor: float, base: np.ndarray | None = None
) -> RegionDensity:
    """Density that gives a region with weights (m,) in [0, 1] `factor` times its share.

    The density is M^w. It has every share between the smallest and the largest weight, and varies as smoothly as the
    weights on a logarithmic scale, the one that shear is about: a map's scale is the root of its density.

    Parameters
    ----------
    area : (m,) measure in which the region has its share before: areas of the surface, or of a UV map
    base : (m,) density that is there already, 1 by default; the share before is that in area times base

    Raises
    ------
    WeightError, ShareError : weights that mark nothing; a factor or a share that no map has
    """
    check_factor(factor)
    weights = check_region(weights)
    measure = area if base is None else area * base
    before = region_share(weights, measure)
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
    found = _contrast(weights, measure, asked)
    if not 1 / CONTRAST <= found <= CONTRAST:
        raise _too_far(factor, found)
    hard = asked / (1 - asked) * (1 - before) / before
    soft = abs(np.log(found)) > abs(np.log(hard)) + np.log(MOST_OF_HARD)
    warning = f"The rim of the region is very soft for this factor: densities vary by {max(found, 1 / found):.3g}"
    return RegionDensity(found**weights, found, before, asked, (warning,) if soft else ())


def _too_far(factor: float, contrast: float) -> ShareError:
    return ShareError(
        f"For {factor:g} times the share densities would vary by {max(contrast, 1 / contrast):.3g}; "
        f"no map shows more than {CONTRAST:g}",
        "Choose a factor nearer to 1, or paint the region with a harder rim",
    )


def target_density(weights: np.ndarray, area: np.ndarray, factor: float, exact: bool) -> RegionDensity:
    """The density of a region (m,) for its exact share, or for exactly the factor between weight 1 and weight 0.

    Raises
    ------
    WeightError, ShareError : see `exact_density` and `density.painted_density`
    """
    if exact:
        return exact_density(weights, area, factor)
    density = painted_density(weights, factor)
    if not 1 / CONTRAST <= factor <= CONTRAST:
        raise _too_far(factor, factor)
    return RegionDensity(density, factor, region_share(weights, area), region_share(weights, area * density))


def _contrast(weights, measure, asked: float) -> float:
    """The M at which sum(w M^w a) / sum(M^w a) is the share asked, by bisection in log M, where it is monotone."""

    def error(log: float) -> float:
        # Taking off the largest exponent keeps the powers finite.
        power = np.exp(log * weights - max(log, 0.0) * weights.max())
        return region_share(weights, power * measure) - asked

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
