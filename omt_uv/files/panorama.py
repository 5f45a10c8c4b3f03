"""Panoramas in and out of Blender, as arrays (h,w,4) float32 with row 0 at the bottom."""

from __future__ import annotations

from pathlib import Path

import bpy

import numpy as np

from ..errors import UserError
from .silence import silence

# What can be written, by the ending of the file.
FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".exr": "OPEN_EXR", ".hdr": "HDR", ".tif": "TIFF"}


class ImageError(UserError):
    """An image that cannot be read or written."""


def pixels_of(image: bpy.types.Image) -> np.ndarray:
    """Pixels (h,w,4) of an image as they are stored, in its own colour space.

    Raises
    ------
    ImageError : it has none, for example because its file is missing
    """
    width, height = image.size
    if not width or not height:
        raise ImageError(f"The image {image.name!r} has no pixels. Load one.")
    values = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)


def named(name: str) -> bpy.types.Image:
    """An image of the file by its name; raises ImageError if there is none."""
    image = bpy.data.images.get(name)
    if image is None:
        raise ImageError(f"There is no image {name!r}. Open one, or leave it empty.")
    return image


def make(name: str, values: np.ndarray, like: bpy.types.Image) -> bpy.types.Image:
    """A new packed image with the pixels (h,w,4), in the colour space and depth of another."""
    height, width = values.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=like.is_float)
    image.colorspace_settings.name = like.colorspace_settings.name
    image.pixels.foreach_set(np.ascontiguousarray(values, np.float32).ravel())
    image.update()
    image.pack()
    return image


def load(path: Path) -> bpy.types.Image:
    """An image from a file.

    Raises
    ------
    ImageError : there is no such file, or it is no image
    """
    if not path.is_file():
        raise ImageError(f"{path}: there is no such file")
    try:
        with silence():
            image = bpy.data.images.load(str(path.resolve()))
            pixels_of(image)
    except (RuntimeError, ImageError) as error:
        raise ImageError(f"{path}: cannot be read as an image") from error
    return image


def check_target(path: Path) -> None:
    """Raise ImageError unless an image can be written to the path."""
    if path.suffix.lower() not in FORMATS:
        raise ImageError(f"{path}: unknown image format. Use one of {' '.join(FORMATS)}.")
    if not path.resolve().parent.is_dir():
        raise ImageError(f"{path}: there is no such folder")


def save(path: Path, values: np.ndarray, like: bpy.types.Image) -> None:
    """Write pixels (h,w,4) to a file, in the colour space and depth of an image.

    Raises
    ------
    ImageError : the file cannot be written
    """
    check_target(path)
    image = make(path.stem, values, like)
    image.file_format = FORMATS[path.suffix.lower()]
    image.filepath_raw = str(path.resolve())
    try:
        with silence():
            image.save()
    except RuntimeError as error:
        raise ImageError(f"{path}: {str(error).strip() or 'cannot be written'}") from error
    finally:
        bpy.data.images.remove(image)
