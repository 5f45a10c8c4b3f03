"""Give several regions of a map that exists factors of their own at once, in steps, with exact shares in the end.

Steps go along the tilts that the shares need together (`joint_density`), each at most a factor of two; what a step
leaves of the shares, short steps along what is missing take away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.density import area_error_warnings, normalised_density
from ..analysis.joint_density import JointDensity, joint_density, shares_of
from ..mesh.geometry import signed_areas
from ..progress import Steps, part_of
from ..refinement.continuation_rules import QUALITIES
from .magnify import LARGEST_STEP, Magnification, magnify_map, refuse_folds, share_error

# Steps that only mend shares, at most; relative errors of shares that need none; and how exact their areas are.
MENDING = 4
EXACT_SHARES = 2e-4
STRICTER = 10.0
# Of the time, what is left for them.
MENDING_TIME = 0.3


@dataclass(frozen=True)
class JointMagnification(Magnification):
    """A map with several magnified regions; target: what those were to get."""

    target: JointDensity


def magnify_regions(
    uv: np.ndarray,
    triangles: np.ndarray,
    regions: np.ndarray,
    factors: Sequence[float],
    *,
    exact: bool = True,
    boundary: str = "own",
    quality: str = "standard",
    polygons: np.ndarray | None = None,
) -> Steps[JointMagnification]:
    """Give every region (k,m), weights in [0, 1], its own factor (k,) times its share of a map uv (n,2), (m,3).

    exact, boundary, quality, polygons : see `magnify.magnify_region`

    Raises
    ------
    FoldedUVError : see `magnify.magnify_map`
    WeightError, ShareError : see `joint_density.joint_density`
    """
    refuse_folds(uv, triangles)
    before = np.abs(signed_areas(uv, triangles))
    whole = joint_density(regions, before, factors, exact)
    exponent = np.log(whole.density)
    count = max(1, int(np.ceil(np.ptp(exponent) / LARGEST_STEP - 1e-9)))
    given: dict[str, Any] = {"boundary": boundary, "quality": quality, "polygons": polygons}
    done, texts = 0, []
    for k in range(count + MENDING):
        area, mends = np.abs(signed_areas(uv, triangles)), k >= count
        goal = shares_of(regions, before * np.exp(min((k + 1) / count, 1.0) * exponent))
        factor = goal / shares_of(regions, area)
        if mends and (not exact or np.abs(factor - 1).max() < EXACT_SHARES):
            break
        density = joint_density(regions, area, factor).density if exact else np.exp(exponent / count)
        stricter = STRICTER if mends else max(1.0, np.sqrt(count / 2))
        job = magnify_map(uv, triangles, normalised_density(density, area), region=_direction(density),
                          stricter=float(stricter), **given)  # fmt: skip
        begin = 1 - MENDING_TIME + MENDING_TIME * (k - count) / MENDING if mends else (1 - MENDING_TIME) * k / count
        width = MENDING_TIME / MENDING if mends else (1 - MENDING_TIME) / count
        step = yield from part_of(job, begin, width)
        uv, done = step.uv, done + step.iterations
        texts += [text for text in step.warnings if text not in texts]
    error = share_error(uv, triangles, before * whole.density, polygons)
    return JointMagnification(
        uv=uv,
        outline=step.outline,
        iterations=done,
        residual=step.residual,
        status=step.status,
        area_error=error,
        warnings=(*texts, *area_error_warnings(error, count * QUALITIES[quality].area_error)),
        target=whole,
    )


def _direction(density: np.ndarray) -> np.ndarray | None:
    """The logarithm of a density (m,) as weights in [0, 1], whose share is to be exact; None where it is 1."""
    exponent = np.log(density)
    wide = float(np.ptp(exponent))
    return (exponent - exponent.min()) / wide if wide > 0 else None
