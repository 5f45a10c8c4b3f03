"""Find the density that gives several painted regions their exact shares at once, by tilting in all of their weights.

Of all measures in which the regions have given shares, exp(sum_k t_k w_k) times the present one is the nearest in
relative entropy (Csiszar 1975). The tilts t are the minimum of a convex function of as many unknowns as there are
regions, log sum a exp(t . w) - t . shares: its slope is what shares miss, its Hessian the covariance of the weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from ..errors import EmptyRegionError, ShareError
from .density import CONTRAST, check_factor, check_region, painted_density

# Newton's method ends where all shares are exact to this, and takes no more steps than that.
TOLERANCE = 1e-11
MOST_STEPS = 200
# Least share of the decrease promised by the slope; and what rounding may hide of it.
DECREASE = 1e-4
ROUNDING = 1e-14
# Tilts beyond this stand for shares that no density has.
MOST_TILT = 100.0
# Of the way to shares that would not go, this much is told as what would go.
SAFE = 0.95
OTHERWISE = "or take the factors between weight 1 and weight 0 alone (Exact Share off, --no-exact)"


@dataclass(frozen=True)
class JointDensity:
    """What several painted regions are to get.

    density : (m,) of the faces, before it is normalised
    tilts : (k,), exponents of the regions; shares_before, target_shares : (k,) of the area that they have, and get
    """

    density: np.ndarray
    tilts: np.ndarray
    shares_before: np.ndarray
    target_shares: np.ndarray

    @property
    def contrast(self) -> float:
        """The greatest density over the least."""
        return float(self.density.max() / self.density.min())


def shares_of(regions: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Shares (k,) that painted regions (k,m) have of areas (m,).

    >>> shares_of(np.array([[1.0, 0, 0.5]]), np.array([1.0, 1, 2])).tolist()
    [0.5]
    """
    return regions @ area / area.sum()


def joint_density(regions: np.ndarray, area: np.ndarray, factors: Sequence[float], exact: bool = True) -> JointDensity:
    """The density (m,) that gives every region (k,m), weights in [0, 1], its own factor (k,) times its share.

    area : (m,) measure in which the regions have their shares before; exact : False for the product of the densities
        in which each factor holds between weight 1 and weight 0

    >>> two, area = np.eye(2, 4), np.ones(4)
    >>> found = joint_density(two, area, [2.0, 0.5])
    >>> (found.density / found.density.sum()).round(4).tolist()
    [0.5, 0.125, 0.1875, 0.1875]

    Raises
    ------
    WeightError, ShareError : weights that mark nothing; factors that together no map has, with those that would go
    """
    regions, asked = np.array([check_region(region) for region in regions]), np.asarray(factors, float)
    for factor in factors:
        check_factor(factor)
    before = shares_of(regions, area)
    if not (before > 0).all():
        raise EmptyRegionError("A region has no area")
    if not exact:
        density = np.prod([painted_density(w, f) for w, f in zip(regions, factors, strict=True)], axis=0)
        target = shares_of(regions, area * density)
        return JointDensity(density, np.log(asked), before, target)
    target = asked * before
    tilts = _tilts(regions, area, target)
    if tilts is None:
        raise _too_much(regions, before, asked)
    exponent = tilts @ regions
    found = JointDensity(np.exp(exponent - exponent.mean()), tilts, before, target)
    if found.contrast > CONTRAST:
        raise _too_much(regions, before, asked, f"densities would vary by {found.contrast:.3g}")
    return found


def _tilts(regions: np.ndarray, area: np.ndarray, target: np.ndarray) -> np.ndarray | None:
    """The tilts (k,) by Newton's method with halved steps; None where they go to infinity."""
    tilts = np.zeros(len(regions))
    measure, value = _tilted(regions, area, tilts, target)
    for _ in range(MOST_STEPS):
        missing = regions @ measure - target
        if np.abs(missing).max() <= TOLERANCE * max(target.max(), 1.0):
            return tilts
        spread = (regions * measure) @ regions.T - np.outer(regions @ measure, regions @ measure)
        step = np.linalg.lstsq(spread, -missing, rcond=1e-14)[0]
        size, slope = 1.0, float(missing @ step)
        while size > 1e-12:
            trial, new = _tilted(regions, area, tilts + size * step, target)
            if new <= value + DECREASE * size * slope + ROUNDING:
                break
            size /= 2
        else:
            return tilts if np.abs(missing).max() < 1e-9 else None
        tilts, measure, value = tilts + size * step, trial, new
        if np.abs(tilts).max() > MOST_TILT:
            return None
    return None


def _tilted(regions, area, tilts, target) -> tuple[np.ndarray, float]:
    """The tilted measure (m,), summing to 1, and the convex function whose slope is what its shares miss."""
    exponent = tilts @ regions
    most = exponent.max()
    weight = area * np.exp(exponent - most)
    total = weight.sum()
    return weight / total, float(np.log(total / area.sum()) + most - tilts @ target)


def _too_much(regions: np.ndarray, before: np.ndarray, factors: np.ndarray, why: str = "") -> ShareError:
    """The error of shares that no map has, with the factors on the way there that would go."""
    target = factors * before
    going = 1 + SAFE * _share_of_the_way(regions, before, target) * (factors - 1)
    sums = " + ".join(f"{100 * share:.4g}" for share in target)
    cause = f"The regions cannot have {sums} % of the texture together"
    named = ", ".join(f"{factor:.4g}" for factor in going)
    return ShareError(f"{cause}: {why}" if why else cause, f"Choose factors such as {named}, {OTHERWISE}")


def _share_of_the_way(regions: np.ndarray, before: np.ndarray, target: np.ndarray) -> float:
    """How far, of the way from the shares before (k,) to the target (k,), measures exist at all: a linear program."""
    rows = np.unique(regions.T.round(6), axis=0)
    k, m = len(regions), len(rows)
    equal = np.block([[rows.T, (before - target)[:, None]], [np.ones((1, m)), np.zeros((1, 1))]])
    cost = np.append(np.zeros(m), -1.0)
    bounds = [(0, None)] * m + [(0, 1)]
    found = linprog(cost, A_eq=equal, b_eq=np.append(before, 1.0), bounds=bounds)
    return float(found.x[-1]) if found.success and k else 0.0
