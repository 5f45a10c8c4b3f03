"""Renders of a mesh with a UV map: a labelled checker, or distortion as colours, by Blender's Workbench engine.

Needs the `bpy` module and matplotlib; no GPU.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy

import matplotlib
import matplotlib.colors
import numpy as np
from mathutils import Matrix, Vector
from PIL import Image, ImageDraw, ImageFont
from rivals import make_object, remove_object, write_uv

TILE = 8  # cells of the checker along one side of the texture
AREA_OCTAVES = 2.0  # ends of the colour scale for area
SHEAR_TOP = 4.0  # end of the colour scale for s1/s2
AREA_COLOURS = matplotlib.colormaps["RdBu_r"]
SHEAR_COLOURS = matplotlib.colormaps["magma_r"]


@dataclass(frozen=True)
class View:
    """A camera: which axis of the model points up, and turns about and above it, in degrees; zoom 1 fits all."""

    up: str = "Z"
    azimuth: float = 0.0
    elevation: float = 10.0
    zoom: float = 1.0


VIEWS = {
    "face": View("Y", 8, 4),
    "lion": View("Y", 130, 5),
    "lilium": View("Z", 30, 50),
    "max_planck": View("Y", 100, 5),
    "bunny": View("Y", -10, 12),
    "spot": View("Y", 155, 15),
    "head": View("Z", 30, 5),
}


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


def checker_material(texture):
    """A material that shows the image file `texture` by the active UV layer, in Workbench and the viewport."""
    material = bpy.data.materials.new("checker")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(texture), check_existing=True)
    material.node_tree.nodes.active = node
    material.node_tree.links.new(node.outputs["Color"], material.node_tree.nodes["Principled BSDF"].inputs[0])
    return material


def equal_density(V, F, uv, cells):
    """The UVs scaled so that the surface carries about `cells` checker cells: every map is shown at one scale."""
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2
    return (uv - uv.reshape(-1, 2).mean(0)) * np.sqrt(cells / area) / TILE


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


def layout(uv, rgb, path, pixels=480):
    """Draw the UV layout (m,3,2), one colour (m,3) per face, to `path`."""
    low, high = uv.reshape(-1, 2).min(0), uv.reshape(-1, 2).max(0)
    scale = 3 * pixels / (1.06 * (high - low).max())  # drawn three times too large: Pillow has no antialiasing
    points = (uv - (low + high) / 2) * scale * [1, -1] + 1.5 * pixels
    image = Image.new("RGBA", (3 * pixels, 3 * pixels))
    draw = ImageDraw.Draw(image)
    colours = np.round(255 * rgb).astype(int).tolist()
    for triangle, colour in zip(points.reshape(-1, 6).tolist(), colours, strict=True):
        draw.polygon(triangle, fill=tuple(colour))
    image.resize((pixels, pixels), Image.Resampling.LANCZOS).save(path)


def sheet(path, columns, rows):
    """Compose pictures into a labelled sheet.

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


def typeface(size, bold=True):
    return ImageFont.truetype(
        str(Path(matplotlib.get_data_path()) / f"fonts/ttf/DejaVuSans{'-Bold' * bold}.ttf"), max(size, 9)
    )


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


AREA_SCALE = (
    lambda t: area_colours((2 * t - 1) * AREA_OCTAVES),
    ["1/4 texture", "1/2", "as asked", "2x", "4x texture"],
)
SHEAR_SCALE = (lambda t: shear_colours(SHEAR_TOP**t), ["conformal", "s1/s2 = 2", "4"])


def front_to_south(view):
    """Rotation (3,3) that brings the model's up to +Z and what faces the camera of a view to -Y, Blender's front."""
    up, towards = _axes(view, 0.0)
    up, towards = np.array(up), np.array(towards)
    return np.stack([np.cross(up, -towards) * -1, -towards, up])


def render_checker(V, F, uv, view, path, texture, pixels=480):
    """Render the mesh with the checker on it to `path`; uv (m,3,2) already scaled to taste."""
    obj = make_object(V, F)
    write_uv(obj, uv)
    material = checker_material(texture)
    obj.data.materials.append(material)
    _render(obj, V[np.unique(F)], view, path, "TEXTURE", pixels)
    remove_object(obj)
    bpy.data.materials.remove(material)


def render_colours(V, F, rgb, view, path, pixels=480):
    """Render the mesh with one colour (m,3) per face to `path`."""
    obj = make_object(V, F)
    layer = obj.data.color_attributes.new("distortion", "BYTE_COLOR", "CORNER")
    rgba = np.ones((len(F), 3, 4), np.float32)
    rgba[..., :3] = rgb[:, None]
    layer.data.foreach_set("color_srgb", rgba.ravel())
    obj.data.color_attributes.active_color = layer
    _render(obj, V[np.unique(F)], view, path, "VERTEX", pixels)
    remove_object(obj)


def render_wires(V, F, view, path, pixels=480):
    """Render the mesh in clay with its edges drawn on it to `path`."""
    points = V[np.unique(F)]
    clay, wires = make_object(V, F), make_object(V, F, name="wires")
    clay.color, wires.color = (0.75, 0.8, 0.86, 1), (0.03, 0.05, 0.09, 1)
    modifier = wires.modifiers.new("wires", "WIREFRAME")
    modifier.use_even_offset = False
    modifier.thickness = 0.0022 * float(np.linalg.norm(np.ptp(points, axis=0)))
    _render(clay, points, view, path, "OBJECT", pixels, also=(wires,))
    remove_object(wires)
    remove_object(clay)


def _render(obj, points, view, path, color_type, pixels, also=()):
    obj.data.shade_smooth()
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.resolution_x = scene.render.resolution_y = pixels
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform = "Standard"
    scene.display.render_aa = "16"
    shading = scene.display.shading
    shading.light, shading.studio_light, shading.color_type = "STUDIO", "paint.sl", color_type
    shading.show_cavity, shading.cavity_type = True, "WORLD"
    shading.show_shadows = False
    camera = _camera(points, view)
    scene.camera = camera
    shown = (obj, *also)
    hidden = [o for o in scene.objects if o.type == "MESH" and o not in shown and not o.hide_render]
    for other in hidden:
        other.hide_render = True
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    for other in hidden:
        other.hide_render = False
    data = camera.data
    bpy.data.objects.remove(camera)
    bpy.data.cameras.remove(data)


def _axes(view, elevation):
    """Up, and the direction to the camera at an elevation in degrees."""
    up = Vector({"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1)}[view.up[-1]]) * (-1 if view.up[0] == "-" else 1)
    side = up.orthogonal().normalized()
    forward = up.cross(side)
    a, e = np.radians(view.azimuth), np.radians(elevation)
    towards = (side * np.cos(a) + forward * np.sin(a)) * np.cos(e) + up * np.sin(e)
    return up, towards


def _camera(points, view):
    """An orthographic camera that fits the points (n,3)."""
    up, towards = _axes(view, view.elevation)
    right = up.cross(towards).normalized()
    axes = np.array([right, towards.cross(right), towards])
    local = points @ axes.T
    low, high = local.min(0), local.max(0)
    centre = (low + high) / 2
    centre[2] = high[2] + (high - low).max()
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 1.06 * max(high[0] - low[0], high[1] - low[1]) / view.zoom
    camera.data.clip_start, camera.data.clip_end = 1e-3 * (high - low).max(), 10 * (high - low).max()
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes.T, centre @ axes
    camera.matrix_world = Matrix(matrix.tolist())
    bpy.context.collection.objects.link(camera)
    return camera
