"""Choose where a surface of revolution comes apart: into bands that are nearly cones, and caps, nearly discs."""

from __future__ import annotations

import numpy as np

from .axis import EVEN
from .profile import Profile

# What maps shear by costs this much more than a cut as long as the side of a square with the area, where the mean of
# the square of log(shear) is all that is asked for.
WORTH = 2.5
# One island more costs this much, too.
ISLAND = 0.25
# A ring where the profile turns by a right angle costs less by this share, and less by part of it for smaller turns.
CREASE = 0.5
# Less than this share of the greatest radius counts as much.
NEEDLE = 1e-6


def cheapest_bands(profile: Profile, price: np.ndarray, asked: float) -> np.ndarray:
    """The numbers (b,) of the levels at which a surface comes apart, in order; none where it stays in one piece.

    price (k,) : of a cut around at every level, over its length; asked : the mean square of log(shear) that maps may
    have. Bands are taken for sectors of an annulus, whose radius is linear along the profile, and shear by the square
    of the ratio of lengths around them; caps that are not slit for discs of the same area. The cheapest of all choices,
    by dynamic programming (Bellman 1957).
    """
    return bands_and_cost(profile, price, asked)[0]


def bands_and_cost(profile: Profile, price: np.ndarray, asked: float) -> tuple[np.ndarray, float]:
    """What `cheapest_bands` gives, and what it costs over the side of a square with the area; infinite where no
    choice keeps what is asked for."""
    r, s = profile.radius, profile.length
    # A needle has no radius, but no length around it to be off either.
    step, middle = np.diff(s), np.maximum((r[1:] + r[:-1]) / 2, NEEDLE * r.max())
    area = 2 * np.pi * middle * step
    side = np.sqrt(area.sum())
    apart = _sectors(middle, (s[1:] + s[:-1]) / 2, step)
    count = len(r)
    size = np.append(0.0, np.cumsum(area))
    share = (size[None] - size[:, None]) / size[-1]
    cost = _cost(apart, share, asked) + (s[None] - s[:, None]) / side
    if profile.poles[0]:
        cost[0] = np.minimum(cost[0], _cost(_discs(area, middle), share[0], asked))
    if profile.poles[1]:
        cost[:, -1] = np.minimum(cost[:, -1], _cost(_discs(area[::-1], middle[::-1])[::-1], share[:, -1], asked))
    ring = ISLAND + ring_lengths(r, price, _turns(r, s)) / side
    best, before = np.full(count, np.inf), np.zeros(count, np.int64)
    best[0] = 0.0
    for k in range(1, count):
        ways = best[:k] + cost[:k, k] + np.where(np.arange(k) > 0, ring[:k], 0.0)
        # Of two that cost the same, as on bodies with two like ends, rounding chooses none.
        before[k] = np.argmax(ways <= (1 + EVEN) * ways.min())
        best[k] = ways.min()
    if not np.isfinite(best[-1]):
        return np.zeros(0, np.int64), np.inf
    found, k = list[int](), int(before[-1])
    while k > 0:
        found.append(k)
        k = int(before[k])
    return np.array(found[::-1], np.int64), float(best[-1])


def ring_lengths(radius: np.ndarray, price: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """How long rings (k,) of such radii are as cuts, at a price per length, where the profile turns by such angles."""
    return 2 * np.pi * radius * price * (1 - CREASE * np.minimum(turns / (np.pi / 2), 1))


def _sectors(middle: np.ndarray, s: np.ndarray, step: np.ndarray) -> np.ndarray:
    """The mean square of log(shear) (k,k) of a band between two levels, for pieces (k-1,) of the profile in between:
    their radius, their place along it, and their length."""
    # Areas times the square of what the radius is off by, over itself.
    weight, mean = step / middle, s.mean()
    s = s - mean
    sums = [np.append(0.0, np.cumsum(weight * x)) for x in (s**0, s, s**2, middle, middle * s, middle**2)]
    w, ws, wss, wr, wrs, wrr = (x[None] - x[:, None] for x in sums)
    total = np.append(0.0, np.cumsum(middle * step))
    total = total[None] - total[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        flat = w * wss - ws**2
        slope = np.where(flat > 1e-12 * w * wss, (w * wrs - ws * wr) / flat, 0.0)
        base = (wr - slope * ws) / w
        left = wrr - base * wr - slope * wrs
        return np.where(total > 0, 4 * np.maximum(left, 0.0) / total, np.inf)


def _discs(area: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """The mean square of log(shear) (k,) of caps from the first level up to every one, as discs of the same area, for
    pieces (k-1,) of the profile: their area, and their radius."""
    within = np.cumsum(area)
    ratio = np.sqrt((within - area / 2) / np.pi) / middle
    return np.append(0.0, np.cumsum(area * (2 * np.log(ratio)) ** 2) / within)


def _turns(radius: np.ndarray, length: np.ndarray) -> np.ndarray:
    """The angles (k,) by which a profile turns at its levels, 0 at its ends."""
    slope = np.arccos(np.clip(np.diff(radius) / np.maximum(np.diff(length), 1e-300), -1, 1))
    return np.concatenate([[0.0], np.abs(np.diff(slope)), [0.0]])


def _cost(left: np.ndarray, share: np.ndarray, asked: float) -> np.ndarray:
    """What bands cost (...,) that are such a share of the surface and have this mean square of log(shear) left."""
    keeps = left <= asked
    return np.where(keeps, WORTH * share * np.where(keeps, left, 0.0) / asked, np.inf)
