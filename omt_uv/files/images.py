"""Images of Blender as arrays, and back as copies; see `blender_mesh.py`."""

from __future__ import annotations

from pathlib import Path

import bpy

import numpy as np

from ..errors import UserError

# File formats by suffix.
FORMATS = {
    ".png": "PNG",
    ".exr": "OPEN_EXR",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".tga": "TARGA",
    ".bmp": "BMP",
}
# What formats can hold: alpha, and more than 8 bits.
WITH_ALPHA = {"PNG", "OPEN_EXR", "TIFF", "TARGA"}
DEPTHS = {"PNG": "16", "TIFF": "16", "OPEN_EXR": "32"}


class ImageError(UserError):
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


def straight_alpha(name: str) -> bool:
    """Whether the colours of an image are not multiplied by its alpha. Those of floats are, whatever the file has."""
    image = bpy.data.images[name]
    return image.alpha_mode == "STRAIGHT" and not image.is_float


def write_copy(name: str, picture: np.ndarray) -> str:
    """A new packed image like `name` with the picture (h,w,4) in it; its name."""
    image = _copy(name, picture)
    image.pack()
    return image.name


def save_copy(name: str, picture: np.ndarray, path: Path) -> None:
    """Write the picture (h,w,4) to a file, in the format that its suffix names, as an image like `name`.

    Raises RuntimeError if it cannot be written.
    """
    image = _copy(name, picture)
    kind = FORMATS[path.suffix.lower()]
    try:
        if image.is_float:
            _render(image, path, kind)
        else:
            image.filepath_raw, image.file_format = str(path.resolve()), kind
            image.save()
    finally:
        bpy.data.images.remove(image)


def _render(image: bpy.types.Image, path: Path, kind: str) -> None:
    """Write an image of floats with as many bits as the format has; `Image.save` would write 8."""
    scene = bpy.data.scenes.new("omt")
    try:
        scene.view_settings.view_transform = "Standard"
        settings = scene.render.image_settings
        settings.file_format = kind
        settings.color_mode = "RGBA" if kind in WITH_ALPHA else "RGB"
        settings.color_depth = DEPTHS.get(kind, "8")
        image.save_render(str(path.resolve()), scene=scene)
    finally:
        bpy.data.scenes.remove(scene)


def _copy(name: str, picture: np.ndarray) -> bpy.types.Image:
    old = bpy.data.images[name]
    height, width = picture.shape[:2]
    image = bpy.data.images.new(f"{name} warped", width, height, alpha=True, float_buffer=old.is_float)
    if not old.is_float:
        image.colorspace_settings.name, image.alpha_mode = old.colorspace_settings.name, old.alpha_mode
    else:
        # Its pixels are linear, and multiplied by alpha, and are packed so, whatever the file had.
        image.alpha_mode = "PREMUL" if old.alpha_mode == "STRAIGHT" else old.alpha_mode
        if old.colorspace_settings.is_data:
            image.colorspace_settings.name = old.colorspace_settings.name
    image.pixels.foreach_set(np.ascontiguousarray(picture, np.float32).ravel())
    image.update()
    return image
