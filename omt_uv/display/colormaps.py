"""Colour distortion, the area in octaves from blue over white to red, shear in viridis; and cells by their numbers."""

from __future__ import annotations

import numpy as np

# Ends of the scale of areas, in octaves: a quarter and four times the texture that is due.
AREA_OCTAVES = 2.0
# End of the scale of shear, the ratio of the singular values.
SHEAR_TOP = 4.0

# Where a face has too little texture it is blue, where it has too much, red (ColorBrewer's RdBu).
_AREA = (
    (5, 48, 97), (33, 102, 172), (67, 147, 195), (146, 197, 222), (247, 247, 247),
    (244, 165, 130), (214, 96, 77), (178, 24, 43), (103, 0, 31),
)  # fmt: skip
# Viridis (van der Walt, Smith 2015) at even steps.
_SHEAR = (
    (68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141),
    (39, 173, 129), (92, 200, 99), (170, 220, 50), (253, 231, 37),
)  # fmt: skip


def cell_colours(cells: np.ndarray) -> np.ndarray:
    """sRGB (m,3) in [0,1] of the numbers of cells (m,): hues a golden section apart, so that neighbours differ."""
    return 0.84 + 0.12 * np.cos(2 * np.pi * ((cells * 0.618034) % 1)[:, None] + np.array([0.0, 2.1, 4.2]))


def area_colours(octaves: np.ndarray) -> np.ndarray:
    """sRGB (m,3) in [0,1] of octaves (m,), log2 of the texture a face has over what is due to it."""
    return _scale(_AREA, octaves / (2 * AREA_OCTAVES) + 0.5)


def shear_colours(shear: np.ndarray) -> np.ndarray:
    """sRGB (m,3) in [0,1] of the ratio of the singular values (m,), logarithmic; 1 is conformal."""
    return _scale(_SHEAR, np.log(np.maximum(shear, 1)) / np.log(SHEAR_TOP))


def _scale(anchors, t) -> np.ndarray:
    """sRGB (m,3) in [0,1] of t (m,), linear between anchors at even steps from 0 to 1."""
    place = np.linspace(0, 1, len(anchors))
    t = np.clip(t, 0, 1)
    return np.column_stack([np.interp(t, place, channel) for channel in np.array(anchors, float).T]) / 255
