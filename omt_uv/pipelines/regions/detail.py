"""Lay images of higher resolution over what is magnified: their boxes, and the picture of the new layout."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...solver.editing.inset_images import InsetImage, warp_with_insets
from ..magnify import Magnified, Region, layouts

# Weights from which on vertices belong to a region, where its box is asked for.
INSIDE = 0.5


def parsed_inset(text: str) -> tuple[str, tuple[float, float], tuple[float, float]]:
    """The file and the corners of the box of a text such as "roi.png:0.2,0.3,0.4,0.5": u0, v0, u1, v1.

    >>> parsed_inset("a:b.png:0,0,0.5,1")
    ('a:b.png', (0.0, 0.0), (0.5, 1.0))

    Raises ValueError for what is none.
    """
    name, _, box = text.rpartition(":")
    numbers = [float(x) for x in box.split(",")] if name else []
    if len(numbers) != 4 or not np.isfinite(numbers).all():
        raise ValueError(f"{text!r} is no file and box such as roi.png:0.2,0.3,0.4,0.5")
    if numbers[0] >= numbers[2] or numbers[1] >= numbers[3]:
        raise ValueError(f"the box of {text!r} has no area: it goes from the lower left to the upper right corner")
    return name, (numbers[0], numbers[1]), (numbers[2], numbers[3])


def box_of(regions: Sequence[Region]) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """The box of the old UVs of the faces in a region, lower left and upper right corner; None where there are none."""
    points = []
    for region in regions:
        if region.pins is not None:
            weights = region.of_triangles(np.arange(len(region.surface.triangles)))
            points.append(np.asarray(region.pins.uv, float)[region.surface.triangles[weights > INSIDE]].reshape(-1, 2))
    every = np.concatenate([np.zeros((0, 2)), *points])
    if not len(every) or not (np.ptp(every, axis=0) > 0).all():
        return None
    (u0, v0), (u1, v1) = every.min(axis=0).tolist(), every.max(axis=0).tolist()
    return (u0, v0), (u1, v1)


def detailed_picture(
    picture: np.ndarray,
    regions: Sequence[Region],
    result: Magnified,
    insets: Sequence[InsetImage],
    size: tuple[int, int] | None = None,
    margin: float = 4,
) -> np.ndarray:
    """A picture (h,w,c) of the UVs there were as one of those that the result has, with insets: `warp_with_insets`."""
    return warp_with_insets(picture, *layouts(regions, result), insets, size, int(margin))
