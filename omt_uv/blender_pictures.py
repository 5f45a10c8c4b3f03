"""Images of Blender as arrays, and back as copies; see `blender_mesh.py`."""

from __future__ import annotations

import bpy

import numpy as np


class ImageError(ValueError):
    """There is no such image, or it has no pixels."""


def picture_of(name: str) -> np.ndarray:
    """Pixels (h,w,4) float32 of an image, the lowest row first.

    Raises
    ------
    ImageError : no image of this name, or one without pixels
    """
    image = bpy.data.images.get(name)
    if image is None:
        raise ImageError(f"There is no image {name!r}. Choose one, or leave it empty.")
    width, height = image.size
    if not width or not height:
        raise ImageError(f"The image {name!r} has no pixels. Reload it, or choose another one.")
    if image.channels != 4:
        raise ImageError(f"The image {name!r} has {image.channels} channels. Convert it to RGBA.")
    pixels = np.zeros(4 * width * height, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)


def write_copy(name: str, picture: np.ndarray) -> str:
    """A new packed image like `name` with the picture (h,w,4) in it; its name."""
    old = bpy.data.images[name]
    height, width = picture.shape[:2]
    image = bpy.data.images.new(f"{name} warped", width, height, alpha=True, float_buffer=old.is_float)
    image.colorspace_settings.name = old.colorspace_settings.name
    image.pixels.foreach_set(np.ascontiguousarray(picture, np.float32).ravel())
    image.update()
    image.pack()
    return image.name
