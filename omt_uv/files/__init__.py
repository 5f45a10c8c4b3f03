"""Files in and out of Blender: meshes in several formats with all their digits, and images as arrays.

Imports errors, temporary, supervision, blender and in_place.
Main names: meshes.load, saving.save, saving.save_uvs, verified.staged, images.load, images.save, pixels_of.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    images="ImageError has_straight_alpha packed_image pixels_of",
    verified="FileError",
    obj_precision="restore_precision",
)
