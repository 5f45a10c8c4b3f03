"""Read meshes before UVs are computed and write UVs after, for the commands that do."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from .common import CommandError, check_paths, require_blender, warn, write_preview
from .selection import read_file

if TYPE_CHECKING:
    from ..pipelines.gate import Gate


@dataclass(frozen=True)
class Written:
    """What was told about a file that was written, and what the last look at its UVs has found."""

    warnings: list[str]
    gate: Gate


def read_layers(options: argparse.Namespace) -> tuple[list, list]:
    """Objects and their Readings; refuses an output or a layer that cannot be written before the long work."""
    require_blender()
    from ..blender.mesh import check_target

    check_paths(options)
    pairs = read_file(options, options.uv_layer)
    for obj, _ in pairs:
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
    from ..blender.mesh import read_uv, target_layer, write_uv
    from ..files.saving import save_uvs
    from ..pipelines.gate import gate

    pairs, final = list(pairs), []
    for (obj, reading), corners, uv in zip(pairs, result.corners, result.uv, strict=True):
        layer = target_layer(obj, options.uv_layer)
        write_uv(obj, layer, corners, uv)
        final.append(replace(reading, uv=read_uv(obj.data, layer)))
    found = gate(final, apart)
    told = found.warnings()
    if told and options.strict:
        raise CommandError(f"{options.input}: {'; '.join(told)}. Nothing was written, as --strict asks.")
    if told and existed:
        told = found.warnings(gate([reading for _, reading in pairs], apart))
    objects = [obj for obj, _ in pairs]
    warnings = [*result.warnings, *((-1, text) for text in told)]
    lines = warn(objects, warnings, save_uvs(options.output, objects, options.input))
    write_preview(options, zip(objects, final, strict=True))
    return Written(lines, found)
