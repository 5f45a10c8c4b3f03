"""Read meshes before UVs are computed and write UVs after, for the commands that do."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from .common import CommandError, check_paths, require_blender, warn, without_collections, write_preview
from .selection import read_file, read_plain_file

if TYPE_CHECKING:
    import numpy as np

    from ..pipelines.gate import Gate


@dataclass(frozen=True)
class Written:
    """What was told about a file that was written, and what the last look at its UVs has found."""

    warnings: list[str]
    gate: Gate


def read_layers(options: argparse.Namespace, plain: bool = False, existing: bool = False) -> tuple[list, list]:
    """Objects and their Readings; refuses an output or a layer that cannot be written before the long work.

    plain : the object may be a `PlainObj`, of which nothing but UVs is asked; existing : a layer that is named has to
        be there, or the UVs of another one would be taken for it

    Raises
    ------
    CommandError : an object has no such layer
    """
    with without_collections("numpy"):
        check_paths(options)
        found = read_plain_file(options) if plain else None
    if found is not None:
        return [found[0]], [found[1]]
    require_blender()
    from ..blender.mesh import check_target

    pairs = read_file(options, options.uv_layer)
    for obj, _ in pairs:
        if existing and options.uv_layer and options.uv_layer not in obj.data.uv_layers:
            raise CommandError(f"{obj.name} has no UV map {options.uv_layer!r}. Name one that it has.")
        check_target(obj, options.uv_layer)
    return [obj for obj, _ in pairs], [reading for _, reading in pairs]


def write_layers(options: argparse.Namespace, pairs, result, apart: bool = False, existed: bool = False) -> Written:
    """Write `result.uv` to `result.corners` of the layer of every object, and the file; print and return warnings.

    pairs : objects and their Readings; apart : islands may lie on one another; existed : the UVs come from others,
        which may have had folds and overlap

    Raises
    ------
    CommandError : `--strict` does not let UVs with folds or overlap pass
    """
    from ..pipelines.gate import gate

    pairs, objects, final = list(pairs), [], []
    for (obj, reading), corners, uv in zip(pairs, result.corners, result.uv, strict=True):
        mapped, values = _mapped(obj, options.uv_layer, corners, uv)
        objects.append(mapped)
        final.append(replace(reading, uv=values))
    found = gate(final, apart)
    told = found.warnings()
    if told and options.strict:
        raise CommandError(f"{options.input}: {'; '.join(told)}. Nothing was written, as --strict asks.")
    if told and existed:
        told = found.warnings(gate([reading for _, reading in pairs], apart))
    warnings = [*result.warnings, *((-1, text) for text in told)]
    lines = warn(objects, warnings, _saved(options, objects))
    write_preview(options, zip(objects, final, strict=True))
    return Written(lines, found)


def is_plain(objects: list) -> bool:
    """Whether objects are none of Blender's, which has not been started then."""
    from ..files.in_place.plain_obj import PlainObj

    return any(isinstance(obj, PlainObj) for obj in objects)


def _mapped(obj, layer: str, corners, uv) -> tuple[Any, np.ndarray]:
    """An object with UVs (k,2) at corners (k,) of a layer, and the UVs (c,2) float32 that it has then."""
    if is_plain([obj]):
        mapped = obj.with_uv(corners, uv)
        return mapped, mapped.mesh.uv
    from ..blender.mesh import read_uv, target_layer, write_uv

    layer = target_layer(obj, layer)
    write_uv(obj, layer, corners, uv)
    return obj, read_uv(obj.data, layer)


def _saved(options: argparse.Namespace, objects: list) -> list[str]:
    """Write the file with the UVs that its objects have now; returns warnings."""
    from ..files.saving import put_uvs, save_uvs

    if is_plain(objects):
        return [text for told in put_uvs(options.output, [obj.mesh for obj in objects], options.input) for text in told]
    return save_uvs(options.output, objects, options.input)
