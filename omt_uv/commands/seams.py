"""Mark the seams that unwrapping needs, and stop: the command seams."""

from __future__ import annotations

import argparse

from ..settings import DEFAULT_MAX_SHEAR
from .common import CommandError, check_paths, refusals, require_blender, warn
from .options import add_cut_options, add_files, add_subdivision, chosen_subdivision, shear
from .selection import read_file


def add(commands) -> None:
    command = commands.add_parser("seams", help="mark the seams that unwrapping needs, and stop")
    command.set_defaults(run=run)
    add_files(command, writes=".blend, which keeps seams")
    add_cut_options(command)
    command.add_argument(
        "--max-shear",
        type=shear,
        default=DEFAULT_MAX_SHEAR,
        metavar="S",
        help="add seams until maps are predicted to shear less than S > 1 in the mean; 0: only those that open a part",
    )
    add_subdivision(command)


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..blender.mesh import check_local
    from ..blender.seams import mark_seams
    from ..blender.vertex_groups import avoided
    from ..files.saving import save
    from ..pipelines.subdivision import on_subdivided_surface
    from ..solver.parameterization.chart_indices import clear_of_pins
    from ..solver.parameterization.unwrap import predicted_cuts

    if options.output.suffix.lower() != ".blend":
        raise CommandError(f"{options.output}: only .blend files keep seams. Write one of these.")
    check_paths(options)
    pairs = read_file(options)
    objects = [obj for obj, _ in pairs]
    for obj in objects:
        check_local(obj)
    told, lines = [], []
    free = avoided(objects, options.keep_free)
    readings = chosen_subdivision(options, [reading for _, reading in pairs])
    for k, (obj, reading, avoid) in enumerate(zip(objects, readings, free, strict=True)):
        with refusals(name=obj.name):
            avoid = clear_of_pins(reading.surface, reading.pins, avoid)
            surface = on_subdivided_surface(reading.surface, reading.subdivision)
            given = {"avoid": avoid, "fill": options.fill_holes}
            cuts = predicted_cuts(surface, reading.faces, options.max_shear, reading.axes, **given)
        told += [(k, text) for text in cuts.warnings]
        mark_seams(obj, cuts.edges)
        lines.append(f"{obj.name}: {len(cuts.edges)} edges of seam, {cuts.length:.4g} long")
    warn(objects, told, save(options.output, objects, options.input))
    print("\n".join(lines))
