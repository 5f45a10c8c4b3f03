"""Draw a map of the world in longitude and latitude: rough continents with names, a graticule, circles of one size.

On an area-preserving map all circles show the same area, on a conformal one all stay round.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw
from textures import typeface

from omt_uv.display.textures.world import LANDS

HEIGHT = 1024
OVERSAMPLE = 2
SEA = (196, 222, 236)
LINE = (150, 188, 210)
INK = (40, 44, 60)
RADIUS = 6.0  # of the circles, in degrees
STEP = 30  # between their centres, in degrees
CIRCLE = np.array([196.0, 40, 60])


def draw(path):
    """Write the map, twice as wide as high, to `path`."""
    size = OVERSAMPLE * HEIGHT
    image = Image.new("RGB", (2 * size, size), SEA)
    pen = ImageDraw.Draw(image)
    for degree in range(0, 360, 15):
        x = degree / 360 * 2 * size
        pen.line([x, 0, x, size], LINE, size // 600)
    for degree in range(15, 180, 15):
        y = degree / 180 * size
        pen.line([0, y, 2 * size, y], LINE, size // 600)
    for colour, _, outline in LANDS.values():
        points = np.array(outline.split(), float).reshape(-1, 2)
        pen.polygon([_pixel(p, size) for p in points], colour, INK, size // 400)
    image = Image.fromarray(_with_circles(np.asarray(image)))
    pen = ImageDraw.Draw(image)
    letters = typeface(size // 26)
    for name, (_, middle, _) in LANDS.items():
        if name.strip():
            pen.multiline_text(
                _pixel(middle, size), name, INK, letters, anchor="mm", align="center", spacing=size // 200
            )
    image.resize((2 * HEIGHT, HEIGHT), Image.Resampling.LANCZOS).save(path)
    return path


def _pixel(point, size):
    return (point[0] + 180) / 360 * 2 * size, (90 - point[1]) / 180 * size


def _with_circles(rgb):
    """The picture (h,w,3) with rings of one radius on the sphere."""
    rows, columns = rgb.shape[:2]
    latitude = np.radians(90 - 180 * (np.arange(rows) + 0.5) / rows)[:, None]
    longitude = np.radians(360 * (np.arange(columns) + 0.5) / columns - 180)[None, :]
    result = rgb.astype(float)
    for y in range(-60, 61, STEP):
        count = round(360 / STEP * np.cos(np.radians(y)))
        near = slice(*(int((90 - y + s * 1.5 * RADIUS) / 180 * rows) for s in (-1, 1)))
        for x in np.arange(count) * 360 / count - 180 + 180 / count:
            a, b = np.radians(y), np.radians(x)
            cosine = np.sin(a) * np.sin(latitude[near]) + np.cos(a) * np.cos(latitude[near]) * np.cos(longitude - b)
            distance = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            ring = np.where(distance < RADIUS, np.where(distance > RADIUS - 0.8, 1.0, 0.3), 0.0)[..., None]
            result[near] += ring * (CIRCLE - result[near])
    return np.round(result).astype(np.uint8)
