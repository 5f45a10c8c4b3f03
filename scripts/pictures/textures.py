"""Draw the textures that the pictures show on surfaces: a labelled checker and a packing of circles."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import matplotlib.colors
import numpy as np
from PIL import Image, ImageDraw, ImageFont

TILE = 8  # cells of the checker along one side of the texture
SMALLEST_TYPE = 9  # pixels


def typeface(size, bold=True):
    """The font of all pictures, in pixels."""
    return ImageFont.truetype(
        str(Path(matplotlib.get_data_path()) / f"fonts/ttf/DejaVuSans{'-Bold' * bold}.ttf"), max(size, SMALLEST_TYPE)
    )


def checker(path, cell=128):
    """Write the checker texture: TILE x TILE tinted cells with a label and a circle that shows shear."""
    size = TILE * cell
    image = Image.new("RGB", (size, size))
    draw = ImageDraw.Draw(image)
    font = typeface(cell // 3)
    for row in range(TILE):
        for column in range(TILE):
            dark = (row + column) % 2
            hue = ((row * TILE + column * 3) % (TILE * TILE)) / (TILE * TILE)
            ground = matplotlib.colors.hsv_to_rgb([hue, 0.50 if dark else 0.10, 0.58 if dark else 0.90])
            ink = matplotlib.colors.hsv_to_rgb([hue, 0.05 if dark else 0.55, 1.0 if dark else 0.45])
            ground, ink = (tuple(int(255 * c) for c in colour) for colour in (ground, ink))
            x, y, pad = column * cell, row * cell, cell // 10
            draw.rectangle([x, y, x + cell - 1, y + cell - 1], fill=ground)
            draw.ellipse([x + pad, y + pad, x + cell - pad, y + cell - pad], outline=ink, width=cell // 24)
            draw.text((x + cell / 2, y + cell / 2), f"{chr(65 + row)}{column + 1}", ink, font, anchor="mm")
    image.save(path)
    return path


def circle_packing(path, size=2048, columns=14):
    """Write a texture of equal circles that touch six others each, as dense as circles can lie in the plane."""
    # 16 rows at a distance of sqrt(3)/2 are 13.86 columns wide: the tile closes with a hundredth of stretch.
    rows = 2 * round(columns / np.sqrt(3))
    scale = 2
    image = Image.new("RGB", (scale * size, scale * size), "#f7f3ea")
    draw = ImageDraw.Draw(image)
    step, rise = scale * size / columns, scale * size / rows
    for row in range(-1, rows + 1):
        for column in range(-1, columns + 1):
            x, y = (column + 0.5 * (row % 2) + 0.25) * step, (row + 0.5) * rise
            hue = ((row % rows) * 5 + (column % columns) * 3) % 24 / 24
            fill = tuple(int(255 * c) for c in matplotlib.colors.hsv_to_rgb([hue, 0.42, 0.88]))
            r, ry = 0.47 * step, 0.47 * rise * 2 / np.sqrt(3)
            draw.ellipse([x - r, y - ry, x + r, y + ry], fill=fill, outline="#3a3a3a", width=scale * size // 420)
    image.resize((size, size), Image.Resampling.LANCZOS).save(path)
    return path


def equal_density(V, F, uv, cells):
    """The UVs scaled so that the surface carries about `cells` checker cells: every map is shown at one scale."""
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2
    return (uv - uv.reshape(-1, 2).mean(0)) * np.sqrt(cells / area) / TILE
