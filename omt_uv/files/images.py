"""Read and write Blender's images as arrays (h,w,4) float32, row 0 at the bottom.

What is written looks like the image it comes from: the same colour space, depth and kind of alpha.
"""

from __future__ import annotations

import os
from pathlib import Path

import bpy

import numpy as np

from ..errors import UserError
from .silence import silence
from .verified import FileError, check_readable, check_writable, staged

# What can be written: Blender's name of the format by the suffix of the file.
FORMATS = {
    ".png": "PNG",
    ".exr": "OPEN_EXR",
    ".hdr": "HDR",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".tga": "TARGA",
    ".bmp": "BMP",
}
# Formats that hold alpha.
WITH_ALPHA = {"PNG", "OPEN_EXR", "TIFF", "TARGA"}
# How a PNG begins, and ends: readers take one without its end for whole.
PNG_START = b"\x89PNG"
PNG_END = b"IEND\xaeB`\x82"
# Bits per channel of formats that hold more than 8.
DEPTHS = {"PNG": "16", "TIFF": "16", "OPEN_EXR": "32", "HDR": "32"}


class ImageError(UserError):
    """An image that is missing, has no pixels, or cannot be read or written."""


def named(name: str) -> bpy.types.Image:
    """Find an image of the open session by its name.

    Raises
    ------
    ImageError : there is none
    """
    image = bpy.data.images.get(name)
    if image is None:
        raise ImageError(f"There is no image {name!r}. Choose one, or leave it empty.")
    return image


def load(path: Path) -> bpy.types.Image:
    """Load an image from a file.

    Raises
    ------
    ImageError : there is no such file, or it is no image
    """
    try:
        check_readable(path)
    except FileError as error:
        raise ImageError(str(error)) from error
    try:
        with silence():
            image = bpy.data.images.load(str(path.resolve()))
            pixels_of(image)
    except (RuntimeError, ImageError) as error:
        raise ImageError(f"{path}: cannot be read as an image") from error
    return image


def pixels_of(image: bpy.types.Image) -> np.ndarray:
    """Read the pixels (h,w,4) of an image as they are stored, in its own colour space.

    Raises
    ------
    ImageError : it has none, for example because its file is missing, or other than four channels
    """
    width, height = image.size
    if not width or not height:
        raise ImageError(f"The image {image.name!r} has no pixels. Reload it, or choose another one.")
    if image.channels != 4:
        raise ImageError(f"The image {image.name!r} has {image.channels} channels. Convert it to RGBA.")
    values = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)


def has_straight_alpha(image: bpy.types.Image) -> bool:
    """Whether the colours of an image are not multiplied by its alpha.

    Those of floats are, whatever the file has; those of bytes are not: Blender divides what it reads as premultiplied.
    """
    return image.alpha_mode in ("STRAIGHT", "PREMUL") and not image.is_float


def packed_image(name: str, pixels: np.ndarray, like: bpy.types.Image) -> bpy.types.Image:
    """Make a packed image of the pixels (h,w,4), in colour space, depth and alpha like another."""
    image = _new_image(name, pixels, like)
    image.pack()
    return image


def check_target(path: Path) -> None:
    """Raise ImageError unless an image can be written to the path."""
    if path.suffix.lower() not in FORMATS:
        raise ImageError(f"{path}: unknown image format. Use one of {' '.join(FORMATS)}.")
    check_writable(path)


def save(path: Path, pixels: np.ndarray, like: bpy.types.Image) -> None:
    """Write pixels (h,w,4) to a file in the format of its suffix, in colour space, depth and alpha like an image.

    Raises
    ------
    ImageError : the file cannot be written
    """
    check_target(path)
    image = _new_image(path.stem, pixels, like)
    file_format = FORMATS[path.suffix.lower()]
    try:
        with staged(path) as made, silence():
            if image.is_float:
                _render(image, made, file_format)
            else:
                image.filepath_raw, image.file_format = str(made), file_format
                image.save()
            check_whole(made, tuple(image.size))
    except RuntimeError as error:
        raise ImageError(f"{path}: {str(error).strip() or 'cannot be written'}") from error
    finally:
        bpy.data.images.remove(image)


def check_whole(path: Path, size: tuple[int, ...] = ()) -> None:
    """Raise RuntimeError unless a file reads as an image, of a size if one is given."""
    if not os.path.isfile(path):
        raise RuntimeError("nothing was written. Is the disk full?")
    data = path.read_bytes()
    if data.startswith(PNG_START) and not data.endswith(PNG_END):
        raise RuntimeError("the end of the picture is missing. Is the disk full?")
    there = bpy.data.images.load(str(path), check_existing=False)
    try:
        # Reading a pixel reads the file.
        whole = tuple(there.size) == (size or tuple(there.size)) and len(there.pixels) > 0 and there.has_data
    finally:
        bpy.data.images.remove(there)
    if not whole:
        raise RuntimeError("what was written cannot be read again. Is the disk full?")


def _render(image: bpy.types.Image, path: Path, file_format: str) -> None:
    """Write an image of floats with as many bits as the format has; `Image.save` would write 8."""
    scene = bpy.data.scenes.new("omt")
    try:
        scene.view_settings.view_transform = "Standard"
        settings = scene.render.image_settings
        settings.file_format = file_format
        settings.color_mode = "RGBA" if file_format in WITH_ALPHA else "RGB"
        settings.color_depth = DEPTHS.get(file_format, "8")
        image.save_render(str(path.resolve()), scene=scene)
    finally:
        bpy.data.scenes.remove(scene)


def _new_image(name: str, pixels: np.ndarray, like: bpy.types.Image) -> bpy.types.Image:
    """An image of the pixels (h,w,4), in colour space, depth and alpha like another."""
    height, width = pixels.shape[:2]
    # Names of files may be no UTF-8, those of images are.
    name = name.encode("utf-8", "replace").decode()
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=like.is_float)
    if not like.is_float:
        # Its pixels are not multiplied by alpha. They are written so, and where they were said to be, they would be
        # divided once more when they are read.
        image.alpha_mode = "STRAIGHT" if has_straight_alpha(like) else like.alpha_mode
        image.colorspace_settings.name = like.colorspace_settings.name
    else:
        # Its pixels are linear, and multiplied by alpha, and are packed so, whatever the file had.
        image.alpha_mode = "PREMUL" if like.alpha_mode == "STRAIGHT" else like.alpha_mode
        if like.colorspace_settings.is_data:
            image.colorspace_settings.name = like.colorspace_settings.name
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    return image
