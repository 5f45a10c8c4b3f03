"""Strain of parts of a surface, and how two maps of it differ part by part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .beltrami import Beltrami

BINS = 20


@dataclass(frozen=True)
class RegionStrain:
    """|mu| over a region: its name, share of the area, mean, greatest, and the histogram (BINS,) over [0, 1]."""

    name: str
    share: float
    mean: float
    greatest: float
    histogram: np.ndarray


def region_strain(found: Beltrami, regions: dict[str, np.ndarray]) -> list[RegionStrain]:
    """Strain of the whole, named "all", and of regions, each weights (m,) in [0, 1] of the triangles.

    A region without area is left out.
    """
    whole = np.ones(len(found.area))
    rows = []
    for name, weight in {"all": whole, **regions}.items():
        area = found.area * weight
        total = float(area.sum())
        if not total > 0:
            continue
        size = np.clip(found.size, 0, 1)
        counts, _ = np.histogram(size, BINS, (0.0, 1.0), weights=area)
        greatest = float(size[area > 0].max())
        rows.append(
            RegionStrain(name, total / float(found.area.sum()), float(area @ size / total), greatest, counts / total)
        )
    return rows


def compare_regions(first: list[RegionStrain], second: list[RegionStrain]) -> dict[str, float]:
    """How far apart the histograms of the regions that both have are: 0 for equal ones, 1 for ones without overlap.

    Half of the sum of absolute differences (total variation).
    """
    others = {row.name: row.histogram for row in second}
    return {
        row.name: 0.5 * float(np.abs(row.histogram - others[row.name]).sum()) for row in first if row.name in others
    }
