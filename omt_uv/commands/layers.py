"""What the commands that write UVs share: meshes read, refusals told, layers and file written."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager

from .common import CommandError, blender, check_output, read, warn


def read_layers(options: argparse.Namespace) -> list:
    """Pairs of object and Reading; refuses an output or a layer that cannot be written before the long work."""
    files, blender_mesh, _ = blender()
    check_output(options.output, files)
    pairs = read(options.input, files, blender_mesh, options.uv_layer)
    with refusals([]):
        for obj, _ in pairs:
            blender_mesh.check_target(obj.data, options.uv_layer)
    return pairs


@contextmanager
def refusals(objects: list, *errors: type[Exception]) -> Iterator[None]:
    """Turn what is refused, and the given errors, into a CommandError that names the object."""
    from ..pipelines.layout import Refusal

    files, blender_mesh, _ = blender()
    try:
        yield
    except Refusal as refusal:
        raise CommandError(f"{objects[refusal.index].name}: {refusal.error}") from refusal
    except (*errors, blender_mesh.TargetError, files.FileError) as error:
        raise CommandError(str(error)) from error


def write_layers(options: argparse.Namespace, objects: list, result) -> list[str]:
    """Write `result.uv` to `result.corners` of the layer of every object, and the file; print and return warnings."""
    files, blender_mesh, _ = blender()
    for obj, corners, uv in zip(objects, result.corners, result.uv, strict=True):
        blender_mesh.write_uv(obj, blender_mesh.target_layer(obj.data, options.uv_layer), corners, uv)
    return warn(objects, result.warnings, files.save(options.output, objects))
