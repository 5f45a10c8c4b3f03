"""Find the density that gives a painted region its exact share of the domain, by tilting (Csiszar 1975).

The share of a region with weights w is sum(w a) / sum(a), a soft count of the areas a: see `density.region_share`. Of
all measures in which the region has a given share, M^w times the present one is the nearest in relative entropy
(Csiszar). These densities form a group: magnified twice by 2 the region has just the density of once by 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import EmptyRegionError, ShareError, SoftRegionError
from .density import CONTRAST, check_factor, check_region, painted_density, region_share

# A factor so many times what a region with a hard border would need is said: the rest gets little of the texture.
MOST_OF_HARD = 4.0
# Bisections of log M, so many that double precision is exhausted.
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


def exact_density(region: np.ndarray, area: np.ndarray, factor: float, base: np.ndarray | None = None) -> RegionDensity:
    """Density that gives a painted region (m,), weights in [0, 1], `factor` times its share.

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
    region = check_region(region)
    base_area = area if base is None else area * base
    before = region_share(region, base_area)
    target = factor * before
    _check_share(region, before, target, factor)
    found = _contrast(region, base_area, target)
    if not 1 / CONTRAST <= found <= CONTRAST:
        raise _too_far(factor, found)
    hard = target / (1 - target) * (1 - before) / before
    soft = abs(np.log(found)) > abs(np.log(hard)) + np.log(MOST_OF_HARD)
    warning = f"The border of the region is very soft for this factor: densities vary by {max(found, 1 / found):.3g}"
    return RegionDensity(
        density=found**region,
        contrast=found,
        share_before=before,
        target_share=target,
        warnings=(warning,) if soft else (),
    )


def _check_share(region: np.ndarray, before: float, target: float, factor: float) -> None:
    """Raise ShareError unless a map can give the region `factor` times the share it has before, the target."""
    if not before > 0:
        raise EmptyRegionError("The region has no area")
    least, most = float(region.min()), float(region.max())
    if target >= 1:
        raise ShareError(
            f"The region has {100 * before:.3g} % of the area; {factor:g} times that is {100 * target:.4g} % "
            "of the texture, which leaves nothing for the rest",
            f"Choose a factor below {1 / before:.3g}, or paint a smaller region",
        )
    if not least < target < most:
        raise SoftRegionError(
            f"With weights from {least:.3g} to {most:.3g} the region cannot have {100 * target:.3g} % of the texture"
        )


def _too_far(factor: float, contrast: float) -> ShareError:
    """The error of a density whose contrast is beyond what a map can show."""
    return ShareError(
        f"For {factor:g} times the share densities would vary by {max(contrast, 1 / contrast):.3g}; "
        f"no map shows more than {CONTRAST:g}",
        "Choose a factor nearer to 1, or paint the region with a harder border",
    )


def target_density(region: np.ndarray, area: np.ndarray, factor: float, exact: bool) -> RegionDensity:
    """The density of a region (m,) for its exact share, or for exactly the factor between weight 1 and weight 0.

    Raises
    ------
    WeightError, ShareError : see `exact_density` and `density.painted_density`
    """
    if exact:
        return exact_density(region, area, factor)
    density = painted_density(region, factor)
    if not 1 / CONTRAST <= factor <= CONTRAST:
        raise _too_far(factor, factor)
    return RegionDensity(
        density=density,
        contrast=factor,
        share_before=region_share(region, area),
        target_share=region_share(region, area * density),
    )


def _contrast(region: np.ndarray, area: np.ndarray, target: float) -> float:
    """The M at which sum(w M^w a) / sum(M^w a) is the share, by bisection in log M, where it is monotone."""

    def error(log: float) -> float:
        # Taking off the largest exponent keeps the powers finite.
        power = np.exp(log * region - max(log, 0.0) * region.max())
        return region_share(region, power * area) - target

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
