"""A city that is drawn at any resolution: avenues, streets, blocks, parks, and houses that need many pixels."""

from __future__ import annotations

import numpy as np

# Blocks along a side, houses along a side of a block, and samples along a side of a pixel.
BLOCKS = 24
HOUSES = 6
SAMPLES = 3
# Widths, in blocks, of streets and of avenues, which are every fourth street.
STREET = 0.12
AVENUE = 0.3
GAP = 0.14
GROUND = np.array([0.93, 0.91, 0.86])
ROAD = np.array([1.0, 1.0, 1.0])
MAIN_ROAD = np.array([0.98, 0.82, 0.45])
PARK = np.array([0.72, 0.85, 0.62])
WATER = np.array([0.62, 0.78, 0.9])


def city(low, high, columns: int, rows: int) -> np.ndarray:
    """The part of the city from low (2,) to high (2,) of the unit square as a picture (rows,columns,3), bottom row
    first."""
    x = low[0] + (high[0] - low[0]) * (np.arange(columns * SAMPLES) + 0.5) / (columns * SAMPLES)
    y = low[1] + (high[1] - low[1]) * (np.arange(rows * SAMPLES) + 0.5) / (rows * SAMPLES)
    colour = _colours(*np.meshgrid(x, y))
    return colour.reshape(rows, SAMPLES, columns, SAMPLES, 3).mean(axis=(1, 3))


def _colours(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Colours (h,w,3) of places (h,w)."""
    u, v = x * BLOCKS, y * BLOCKS
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    s, t = u - i, v - j
    colour = np.broadcast_to(GROUND, (*x.shape, 3)).copy()
    p, q = np.floor(s * HOUSES).astype(int), np.floor(t * HOUSES).astype(int)
    a, b = s * HOUSES - p, t * HOUSES - q
    number = _hash(i, j, p, q)
    house = (np.minimum(a, 1 - a) > GAP) & (np.minimum(b, 1 - b) > GAP) & (number > 0.15)
    roof = 0.45 + 0.4 * number[..., None] * np.array([1.0, 0.75, 0.65])
    roof[(np.abs(a - 0.5) < 0.04) & (number > 0.5)] *= 0.8
    colour = np.where(house[..., None], roof, colour)
    park = _hash(i, j, 0 * i, 7 + 0 * j) > 0.88
    trees = np.hypot(a - 0.5, b - 0.5) < 0.15 + 0.3 * number
    colour = np.where(park[..., None], np.where(trees[..., None], PARK * [0.7, 0.85, 0.7], PARK), colour)
    for along, index in ((s, i), (t, j)):
        for offset, line in ((along, index), (1 - along, index + 1)):
            main = line % 4 == 0
            road = offset < np.where(main, AVENUE, STREET) / 2
            colour = np.where(road[..., None], np.where(main[..., None], MAIN_ROAD, ROAD), colour)
    river = np.abs(y - 0.2 - 0.08 * np.sin(5 * x)) < 0.03
    return np.where(river[..., None], WATER, colour)


def _hash(*numbers: np.ndarray) -> np.ndarray:
    """Numbers in [0, 1) that look random, the same for the same integers."""
    mixed = sum(n * k for n, k in zip(numbers, (12.9898, 78.233, 37.719, 4.581), strict=True))
    return (np.sin(mixed) * 43758.5453) % 1
