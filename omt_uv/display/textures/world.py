"""A map of the world in longitude and latitude: rough continents with names, a graticule, circles of one size.

On an area-preserving map all circles show the same area, on a conformal one all stay round.
"""

from __future__ import annotations

import numpy as np

from ..canvas import write

SEA = (196, 222, 236)
LINE = (150, 188, 210)
INK = (40, 44, 60)
RADIUS = 6.0  # of the circles, in degrees
STEP = 30  # between their centres, in degrees
GRATICULE = 15  # degrees between its lines
CIRCLE = (196, 40, 60)

# Outlines as longitude and latitude, colour, and where the name stands.
LANDS = {
    "NORTH\nAMERICA": (
        (232, 180, 120),
        (-102, 44),
        "-168 66 -156 71 -125 70 -95 72 -82 70 -92 62 -82 53 -78 62 -65 60 -55 52 -66 45 -70 42 -75 37 -81 31 -80 25 "
        "-84 30 -97 28 -97 22 -91 18 -87 21 -88 16 -83 10 -79 8 -85 11 -95 16 -105 20 -112 29 -117 33 -124 41 -124 48 "
        "-133 56 -150 60 -160 56 -166 61",
    ),
    "GREENLAND": ((240, 240, 244), (-42, 73), "-55 60 -44 59 -22 70 -20 80 -35 83 -60 82 -70 77 -54 70"),
    "SOUTH\nAMERICA": (
        (160, 200, 120),
        (-59, -12),
        "-79 9 -72 12 -62 10 -50 1 -35 -6 -39 -15 -41 -22 -48 -26 -57 -37 -65 -43 -68 -54 -74 -52 -73 -38 -70 -20 "
        "-76 -14 -81 -5 -78 3",
    ),
    "AFRICA": (
        (244, 208, 104),
        (20, 12),
        "-6 36 10 37 20 31 32 31 43 12 51 12 40 -3 40 -15 33 -27 20 -35 12 -17 13 -6 9 4 -7 5 -17 14 -16 24",
    ),
    "EUROPE": (
        (196, 164, 212),
        (22, 51),
        "-9 37 -9 43 -1 44 -4 48 8 54 11 58 5 61 14 68 28 71 42 67 60 69 60 52 48 46 40 46 30 46 28 41 23 37 19 42 13 "
        "45 18 40 15 38 9 44 0 40 -5 36",
    ),
    "ASIA": (
        (152, 196, 168),
        (92, 46),
        "60 69 75 73 105 77 140 73 180 69 180 65 163 59 156 51 150 59 135 54 140 48 128 39 122 40 121 31 117 24 108 21 "
        "109 12 103 2 98 9 94 17 88 22 80 15 77 8 72 20 62 25 57 26 50 30 57 23 52 16 44 13 38 22 34 30 36 36 27 37 "
        "28 41 40 42 48 46 60 52",
    ),
    "AUSTRALIA": (
        (236, 156, 128),
        (134, -25),
        "114 -22 122 -18 130 -12 136 -12 142 -11 146 -19 153 -26 150 -37 140 -38 131 -32 116 -35",
    ),
    "ANTARCTICA": (
        (244, 246, 250),
        (20, -79),
        "-180 -78 -150 -77 -120 -74 -75 -73 -60 -64 -56 -66 -60 -75 -35 -78 -10 -71 30 -69 60 -67 90 -66 120 -67 "
        "150 -69 168 -72 164 -78 180 -78 180 -90 -180 -90",
    ),
    "": ((208, 176, 148), (0, 0), "-6 50 2 52 -3 59 -6 56"),
    " ": ((208, 176, 148), (0, 0), "131 32 140 36 145 44 141 44 137 37"),
    "  ": ((208, 176, 148), (0, 0), "44 -25 48 -25 50 -15 44 -18"),
    "   ": ((208, 176, 148), (0, 0), "96 5 106 -6 103 -3 100 3"),
    "    ": ((208, 176, 148), (0, 0), "109 1 117 7 118 1 115 -4 110 -3"),
    "     ": ((208, 176, 148), (0, 0), "131 -1 141 -3 150 -10 141 -9"),
    "      ": ((208, 176, 148), (0, 0), "167 -46 174 -41 178 -38 173 -35 171 -43"),
    "       ": ((240, 240, 244), (0, 0), "-24 65 -14 65 -16 66 -22 66"),
}


def world_map(size: int) -> np.ndarray:
    """The map (size/2,size,3) in [0,1], top row first."""
    height = max(size // 2, 1)
    longitude = 360 * (np.arange(size) + 0.5) / size - 180
    latitude = 90 - 180 * (np.arange(height) + 0.5) / height
    x, y = np.meshgrid(longitude, latitude)
    picture = np.tile(_colour(SEA), (height, size, 1))
    wide = 180 / height
    for grid in (x, y):
        picture[np.abs((grid + GRATICULE / 2) % GRATICULE - GRATICULE / 2) < 0.6 * wide] = _colour(LINE)
    for colour, _, outline in LANDS.values():
        picture[_inside(x, y, np.array(outline.split(), float).reshape(-1, 2))] = _colour(colour)
    _draw_circles(picture, np.radians(x), np.radians(y))
    if size >= 256:
        for name, (_, middle, _) in LANDS.items():
            lines = name.strip().split("\n")
            for k, text in enumerate(lines):
                px, py = (middle[0] + 180) / 360 * size, (90 - middle[1]) / 180 * height
                py += (k - (len(lines) - 1) / 2 + 0.35) * size / 48
                write(picture, text, px, py, size / 52, tuple(_colour(INK)), "middle")
    return picture


def _colour(rgb) -> np.ndarray:
    return np.array(rgb, float) / 255


def _inside(x: np.ndarray, y: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Which points (h,w) lie inside an outline (k,2), by the parity of its crossings of a ray."""
    odd = np.zeros(x.shape, bool)
    for (ax, ay), (bx, by) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if ay != by:
            crosses = ((ay > y) != (by > y)) & (x < ax + (y - ay) * (bx - ax) / (by - ay))
            odd ^= crosses
    return odd


def _draw_circles(picture: np.ndarray, longitude: np.ndarray, latitude: np.ndarray) -> None:
    """Blend rings of one radius on the sphere into the picture; longitude and latitude (h,w) in radians."""
    for y in range(-60, 61, STEP):
        count = round(360 / STEP * np.cos(np.radians(y)))
        for x in np.arange(count) * 360 / count - 180 + 180 / count:
            a, b = np.radians(y), np.radians(x)
            cosine = np.sin(a) * np.sin(latitude) + np.cos(a) * np.cos(latitude) * np.cos(longitude - b)
            distance = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            strength = np.where(distance < RADIUS, np.where(distance > RADIUS - 0.8, 1.0, 0.3), 0.0)[..., None]
            picture += strength * (_colour(CIRCLE) - picture)
