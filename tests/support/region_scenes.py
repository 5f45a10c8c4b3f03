"""Meshes with a painted region, in Blender, and pictures that follow their UVs."""

from __future__ import annotations

import bpy

import numpy as np
import scenes


def painted(name="Bump", radius=0.35, group="region", **options):
    """A bump with the UVs seen from above and a soft region in its middle; the object and its weights (n,)."""
    obj = scenes.bump(name=name, **options)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.5, (0.1, 0.2)))
    co = np.array([v.co for v in obj.data.vertices])[:, :2]
    middle = (co.min(0) + co.max(0)) / 2
    d = np.linalg.norm(co - middle, axis=1) / np.ptp(co, axis=0).max()
    weights = np.clip((radius - d) / (0.5 * radius), 0, 1)
    layer = obj.vertex_groups.new(name=group)
    for index, weight in enumerate(weights.tolist()):
        if weight > 0:
            layer.add([index], weight, "REPLACE")
    return obj


def weights_of(obj, name="region"):
    """Weights (n,) of a vertex group, 0 outside of it."""
    group = obj.vertex_groups[name].index
    return np.array([next((g.weight for g in v.groups if g.group == group), 0.0) for v in obj.data.vertices])


def with_attribute(values, domain="POINT", name="heat", data_type="FLOAT", **options):
    """A painted bump with an attribute as well; the object."""
    obj = painted(**options)
    attribute = obj.data.attributes.new(name, data_type, domain)
    if data_type == "FLOAT":
        attribute.data.foreach_set("value", np.asarray(values(obj), np.float32))
    return obj


def of_group(obj):
    """Weights (n,) of the region."""
    return weights_of(obj)


def picture_file(path, kind, depth, is_float):
    """A file of one colour, (0.5, 0.25, 0.1) and, as far as it can, an alpha of 0.8."""
    image = bpy.data.images.new("made", 16, 8, alpha=True, float_buffer=is_float)
    image.pixels.foreach_set(np.tile(np.array([0.5, 0.25, 0.1, 0.8], np.float32), 128))
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_depth = kind, depth
    settings.color_mode = "RGB" if kind == "JPEG" else "RGBA"
    image.save_render(str(path), scene=bpy.context.scene)
