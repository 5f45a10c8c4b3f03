"""Make Blender images and PNG files of arrays, and draw text into arrays with Blender's own font."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import bpy

import numpy as np

# Every pixel is sampled at so many places along either axis.
SAMPLES = 4


def show(name: str, picture: np.ndarray) -> bpy.types.Image:
    """An image data-block of this name with the picture (h,w,3) in [0,1], top row first; made or replaced."""
    height, width = picture.shape[:2]
    image = bpy.data.images.get(name)
    if image is not None and tuple(image.size) != (width, height):
        bpy.data.images.remove(image)
        image = None
    image = image or bpy.data.images.new(name, width, height)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = picture[::-1]
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    return image


def set_preview(image: bpy.types.Image, picture: np.ndarray) -> None:
    """Let panels show the picture (h,w,4) in [0,1], top row first, for the image."""
    preview = image.preview_ensure()
    preview.image_size = picture.shape[1::-1]
    preview.image_pixels_float.foreach_set(np.ascontiguousarray(picture[::-1], np.float32).ravel())


def save(path: Path, picture: np.ndarray) -> None:
    """Write the picture (h,w,3) in [0,1] as a PNG file.

    Raises
    ------
    OSError, RuntimeError : the file cannot be written
    """
    path = Path(path).resolve()
    image = show("OMT UV Export", picture)
    try:
        image.filepath_raw, image.file_format = str(path), "PNG"
        image.save()
    finally:
        bpy.data.images.remove(image)
    if not path.is_file():
        raise OSError("the picture could not be written")


def write(
    picture: np.ndarray, text: str, x: float, y: float, size: float, colour=(0, 0, 0), align: str = "left"
) -> None:
    """Blend text into the picture (h,w,3); x, y is the left end, middle or right end of the base line, y down."""
    mask, left, top = _text(text, size)
    shift = {"left": 0.0, "middle": 0.5, "right": 1.0}[align] * mask.shape[1]
    x0, y0 = round(x - shift + (left if align == "left" else 0)), round(y - top)
    height, width = picture.shape[:2]
    a, b = max(-y0, 0), max(-x0, 0)
    mask = mask[a : height - y0, b : width - x0]
    if mask.size:
        area = picture[y0 + a : y0 + a + mask.shape[0], x0 + b : x0 + b + mask.shape[1]]
        area += mask[..., None] * (np.array(colour) - area)


@cache
def _text(text: str, size: float) -> tuple[np.ndarray, float, float]:
    """Coverage (h,w) of the text, where its left end is, and how far its top is above the base line, in pixels."""
    points, triangles = _outline(text)
    if not len(triangles):
        return np.zeros((1, 1)), 0.0, 0.0
    corners = points[triangles] * size
    low, high = np.floor(corners.min((0, 1))), np.ceil(corners.max((0, 1)))
    width, height = ((high - low) * SAMPLES).astype(int)
    fine = np.zeros((height, width), bool)
    for a, b, c in (corners - low) * SAMPLES - 0.5:
        _fill(fine, np.stack([a, b, c]))
    coverage = fine.reshape(height // SAMPLES, SAMPLES, width // SAMPLES, SAMPLES).mean((1, 3))
    return coverage[::-1], float(low[0]), float(high[1])


def _fill(fine: np.ndarray, corner: np.ndarray) -> None:
    """Set the samples inside a triangle (3,2)."""
    low = np.maximum(np.ceil(corner.min(0)).astype(int), 0)
    high = np.floor(corner.max(0)).astype(int) + 1
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
    inside = np.ones(x.shape, bool)
    (ax, ay), (bx, by), (cx, cy) = corner
    sign = np.sign((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) or 1.0
    for (px, py), (qx, qy) in (((ax, ay), (bx, by)), ((bx, by), (cx, cy)), ((cx, cy), (ax, ay))):
        inside &= sign * ((qx - px) * (y - py) - (qy - py) * (x - px)) >= 0
    fine[low[1] : high[1], low[0] : high[0]] |= inside[: fine.shape[0] - low[1], : fine.shape[1] - low[0]]


def _outline(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,2) and triangles (m,3) of the text in Blender's own font, one unit high."""
    curve = bpy.data.curves.new("OMT UV text", "FONT")
    curve.body, curve.resolution_u = text, 3
    obj = bpy.data.objects.new("OMT UV text", curve)
    try:
        mesh = obj.to_mesh()
        mesh.calc_loop_triangles()
        points, triangles = (
            np.zeros(3 * len(mesh.vertices), np.float32),
            np.zeros(3 * len(mesh.loop_triangles), np.int32),
        )
        mesh.vertices.foreach_get("co", points)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        obj.to_mesh_clear()
    finally:
        bpy.data.objects.remove(obj)
        bpy.data.curves.remove(curve)
    return points.reshape(-1, 3)[:, :2].astype(float), triangles.reshape(-1, 3)
