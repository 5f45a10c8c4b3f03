"""Read meshes before UVs are computed and write UVs after, for the commands that do."""

from __future__ import annotations

import argparse

from .common import check_paths, read_file, require_blender, warn


def read_layers(options: argparse.Namespace) -> tuple[list, list]:
    """Objects and their Readings; refuses an output or a layer that cannot be written before the long work."""
    require_blender()
    from ..blender.mesh import check_target

    check_paths(options)
    pairs = read_file(options.input, options.uv_layer)
    for obj, _ in pairs:
        check_target(obj.data, options.uv_layer)
    return [obj for obj, _ in pairs], [reading for _, reading in pairs]


def write_layers(options: argparse.Namespace, objects: list, result) -> list[str]:
    """Write `result.uv` to `result.corners` of the layer of every object, and the file; print and return warnings."""
    from ..blender.mesh import target_layer, write_uv
    from ..files.saving import save_uvs

    for obj, corners, uv in zip(objects, result.corners, result.uv, strict=True):
        write_uv(obj, target_layer(obj.data, options.uv_layer), corners, uv)
    return warn(objects, result.warnings, save_uvs(options.output, objects, options.input))
