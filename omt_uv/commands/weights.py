"""Write what stands out, curves or is sharp into a vertex group: the command weights."""

from __future__ import annotations

import argparse

from ..settings import DEFAULT_GROUP, DEFAULT_HIGH, DEFAULT_KIND, DEFAULT_LOW, WEIGHT_KINDS
from .common import CommandError, check_paths, refusals, require_blender, warn
from .options import add_files, names, share
from .selection import read_file


def add(commands) -> None:
    command = commands.add_parser("weights", help="write saliency, curvature or sharpness into a vertex group")
    command.set_defaults(run=run)
    add_files(command, writes=".blend, which keeps vertex groups")
    command.add_argument("--kind", choices=names(WEIGHT_KINDS), default=DEFAULT_KIND.lower(), help="what is weighed")
    command.add_argument("--group", default=DEFAULT_GROUP, metavar="NAME", help="vertex group to write or make")
    command.add_argument("--low", type=share, default=DEFAULT_LOW, metavar="T", help="share of the area with weight 0")
    command.add_argument("--high", type=share, default=DEFAULT_HIGH, metavar="T", help="share above which it is 1")
    command.add_argument("--invert", action="store_true", help="weight 1 where it would be 0")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..blender.vertex_groups import check_group_target, selected_vertices, write_group
    from ..blender.weights import computed_weights
    from ..files.saving import save

    if options.output.suffix.lower() != ".blend":
        raise CommandError(f"{options.output}: only .blend files keep vertex groups. Write one of these.")
    check_paths(options)
    pairs = read_file(options)
    objects, found = [obj for obj, _ in pairs], []
    for obj in objects:
        check_group_target(obj, options.group)
    for obj, reading in pairs:
        with refusals(name=obj.name):
            selected = selected_vertices(obj)
            found.append(computed_weights(reading, options.kind, options.low, options.high, options.invert, selected))
    for obj, weights in zip(objects, found, strict=True):
        write_group(obj, options.group, weights)
    warn(objects, [], save(options.output, objects, options.input))
