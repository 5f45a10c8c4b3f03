"""Draw UV layouts in the colours of their distortion, and compose pictures into labelled plates."""

from __future__ import annotations

import matplotlib
import numpy as np
from PIL import Image, ImageDraw
from textures import typeface

AREA_OCTAVES = 2.0  # ends of the colour scale for area
SHEAR_TOP = 4.0  # end of the colour scale for s1/s2
OUTLINE = (60, 66, 78, 255)
AREA_COLOURS = matplotlib.colormaps["RdBu_r"]
SHEAR_COLOURS = matplotlib.colormaps["magma_r"]


def area_colours(octaves):
    """RGB (m,3): blue where a face has too little texture, red where it has too much."""
    return AREA_COLOURS(octaves / (2 * AREA_OCTAVES) + 0.5)[:, :3]


def shear_colours(shear):
    """RGB (m,3) from s1/s2 on a logarithmic scale, light is conformal."""
    return SHEAR_COLOURS(0.02 + 0.9 * np.log(np.maximum(shear, 1)) / np.log(SHEAR_TOP))[:, :3]


def lit(V, F, rgb):
    """Colours (m,3) darkened by a lamp on the surface, so that its features can be found again in the layout."""
    normal = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    lamp = np.array([0.5, 0.62, 0.6])
    return rgb * (0.75 + 0.25 * normal @ lamp)[:, None]


AREA_SCALE = (
    lambda t: area_colours((2 * t - 1) * AREA_OCTAVES),
    ["1/4 texture", "1/2", "as asked", "2x", "4x texture"],
)
SHEAR_SCALE = (lambda t: shear_colours(SHEAR_TOP**t), ["conformal", "s1/s2 = 2", "4"])


def layout(uv, rgb, path, pixels=480, outline=()):
    """Draw the UV layout (m,3,2), one colour (m,3) per face, to `path`; lines (k,2,2) of the map are drawn dark."""
    low, high = uv.reshape(-1, 2).min(0), uv.reshape(-1, 2).max(0)
    scale = 3 * pixels / (1.06 * (high - low).max())  # drawn three times too large: Pillow has no antialiasing

    def placed(points):
        return (points - (low + high) / 2) * scale * [1, -1] + 1.5 * pixels

    image = Image.new("RGBA", (3 * pixels, 3 * pixels))
    draw = ImageDraw.Draw(image)
    colours = np.round(255 * rgb).astype(int).tolist()
    for triangle, colour in zip(placed(uv).reshape(-1, 6).tolist(), colours, strict=True):
        draw.polygon(triangle, fill=tuple(colour))
    for line in placed(np.reshape(outline, (-1, 2, 2))).reshape(-1, 4).tolist():
        draw.line(line, OUTLINE, width=pixels // 120)
    image.resize((pixels, pixels), Image.Resampling.LANCZOS).save(path)


def plate(path, columns, rows):
    """Compose pictures into a labelled plate.

    columns : titles
    rows : (title, pictures, captions, scale), one picture path and one caption per column; scale is None or
        (colour function, tick labels) for a colour bar under the row
    """
    size = Image.open(rows[0][1][0]).width
    font, small = typeface(size // 20), typeface(size // 26, bold=False)
    left, top, under = size // 10, size // 9, size // 11
    heights = [size + under + (under if scale else 0) for *_, scale in rows]
    out = Image.new("RGB", (left + size * len(columns), top + sum(heights)), "white")
    draw = ImageDraw.Draw(out)
    for k, title in enumerate(columns):
        draw.text((left + size * (k + 0.5), top / 2), title, "black", font, anchor="mm")
    y = top
    for (title, pictures, captions, scale), height in zip(rows, heights, strict=True):
        _vertical_text(out, title, font, left, y, size)
        for k, (picture, caption) in enumerate(zip(pictures, captions, strict=True)):
            image = Image.open(picture)
            out.paste(image, (left + k * size, y), image.getchannel("A"))
            draw.text((left + size * (k + 0.5), y + size + under / 2), caption, "#333333", small, anchor="mm")
        if scale:
            _colour_bar(out, draw, small, (left, y + size + under, size * len(columns), under), *scale)
        y += height
    _palette(out, [scale[0] for *_, scale in rows if scale]).save(path, optimize=True)


def _palette(image, colour_functions):
    """The image in 256 colours, of which the colour bars get their share though they cover little."""
    bars = [_bar(colour, image.width, image.height // 4) for colour in colour_functions]
    sample = Image.new("RGB", (image.width, image.height + sum(b.height for b in bars)))
    sample.paste(image)
    for k, bar in enumerate(bars):
        sample.paste(bar, (0, image.height + k * bar.height))
    result = image.quantize(palette=sample.quantize(256, kmeans=3), dither=Image.Dither.NONE)
    palette = result.getpalette()
    ground = 3 * result.getpixel((0, 0))
    palette[ground : ground + 3] = [255, 255, 255]  # clustering has mixed the paper with the lightest of the rest
    result.putpalette(palette)
    return result


def _bar(colour, length, thick):
    rgb = (255 * colour(np.linspace(0, 1, length))).astype(np.uint8)
    return Image.fromarray(np.broadcast_to(rgb, (thick, length, 3)).copy())


def _vertical_text(out, text, font, width, y, height):
    strip = Image.new("RGB", (height, width), "white")
    ImageDraw.Draw(strip).text((height / 2, width / 2), text, "black", font, anchor="mm")
    out.paste(strip.rotate(90, expand=True), (0, y))


def _colour_bar(out, draw, font, box, colour, ticks):
    x, y, width, height = box
    length, thick = width // 2, max(height // 3, 6)
    x += (width - length) // 2
    out.paste(_bar(colour, length, thick), (x, y))
    for k, tick in enumerate(ticks):
        draw.text((x + length * k / (len(ticks) - 1), y + 2 * thick), tick, "#333333", font, anchor="mm")
