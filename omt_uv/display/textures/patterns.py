"""Patterns that show what a map does: a checker with labels, and a packing of equal circles."""

from __future__ import annotations

import numpy as np

from ...solver.counts import check_pixels
from ..canvas import write
from .world import world_map

# Cells of the checker along a side of the texture, and circles of the packing.
CELLS = 8
COLUMNS = 14
# Samples of a pixel along either axis.
SAMPLES = 2
PAPER = np.array([0.97, 0.95, 0.92])
OUTLINE = np.array([0.23, 0.23, 0.23])


def picture_of(kind: str, size: int) -> np.ndarray:
    """The picture (h,w,3) in [0,1], top row first, of "checker", "circles" or "world", so many pixels wide.
    Raises CountError for more than this machine has memory for."""
    check_pixels(size * SAMPLES, size * SAMPLES)
    return {"checker": labelled_checker, "circles": circle_packing, "world": world_map}[kind](size)


def labelled_checker(size: int) -> np.ndarray:
    """A checker (size,size,3) of tinted cells with labels and circles."""
    place = (np.arange(size) + 0.5) * CELLS / size
    x, y = np.meshgrid(place, place)
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    dark = (row + column) % 2 == 1
    hue = (row * CELLS + column * 3) % CELLS**2 / CELLS**2
    ground = hsv(hue, np.where(dark, 0.5, 0.1), np.where(dark, 0.58, 0.9))
    ink = hsv(hue, np.where(dark, 0.05, 0.55), np.where(dark, 1.0, 0.45))
    radius = np.hypot(x - column - 0.5, y - row - 0.5)
    ring = np.clip((0.02 - np.abs(radius - 0.4)) * size / CELLS + 0.5, 0, 1)[..., None]
    picture = ground + ring * (ink - ground)
    cell = size / CELLS
    if cell >= 24:
        for k in range(CELLS**2):
            i, j = divmod(k, CELLS)
            colour = ink[int((i + 0.5) * cell), int((j + 0.5) * cell)]
            label = f"{chr(65 + i)}{j + 1}"
            write(picture, label, (j + 0.5) * cell, (i + 0.62) * cell, cell / 3, tuple(colour), "middle")
    return picture


def circle_packing(size: int) -> np.ndarray:
    """Equal circles (size,size,3) that touch six others each; a tile closes with a hundredth of stretch."""
    # 16 rows at a distance of sqrt(3)/2 are 13.86 columns wide.
    rows = 2 * round(COLUMNS / np.sqrt(3))
    place = (np.arange(SAMPLES * size) + 0.5) / (SAMPLES * size)
    x, y = np.meshgrid(place * COLUMNS, place * rows)
    best, which = np.full(x.shape, np.inf), np.zeros((*x.shape, 2), int)
    base = np.floor(y - 0.5).astype(int)
    for row in (base, base + 1):
        shift = 0.5 * (row % 2) + 0.25
        column = np.rint(x - shift).astype(int)
        away = np.hypot(x - shift - column, (y - row - 0.5) * np.sqrt(3) / 2)
        nearer = away < best
        best = np.where(nearer, away, best)
        which = np.where(nearer[..., None], np.stack([row % rows, column % COLUMNS], axis=-1), which)
    hue = (which[..., 0] * 5 + which[..., 1] * 3) % 24 / 24
    colour = hsv(hue, np.full(hue.shape, 0.42), np.full(hue.shape, 0.88))
    colour = np.where((best > 0.45)[..., None], OUTLINE, colour)
    colour = np.where((best > 0.47)[..., None], PAPER, colour)
    return colour.reshape(size, SAMPLES, size, SAMPLES, 3).mean(axis=(1, 3))


def hsv(hue: np.ndarray, saturation: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Colours (..., 3) in [0,1] of hue, saturation and value (...) in [0,1]."""
    place = (hue[..., None] * 6 + np.array([5.0, 3.0, 1.0])) % 6
    share = np.clip(np.minimum(place, 4 - place), 0, 1)
    return value[..., None] * (1 - saturation[..., None] * share)
