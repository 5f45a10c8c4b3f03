"""Unwrap every mesh of a file, all at one texel density: the command unwrap."""

from __future__ import annotations

import argparse

from ..settings import (
    BOUNDARIES,
    DEFAULT_BOUNDARY,
    DEFAULT_MAP,
    DEFAULT_MARGIN,
    DEFAULT_MAX_SHEAR,
    DEFAULT_SEAMS,
    DEFAULT_TEXTURE_SIZE,
    FIRST_TILE,
    MAPS,
    SEAMS,
    Settings,
)
from .common import drain_shown, refusals, write_report
from .layers import is_plain, read_layers, write_layers
from .options import (
    add_area_options,
    add_cut_options,
    add_files,
    add_marker_options,
    add_report,
    add_subdivision,
    aspect,
    chosen_subdivision,
    margin,
    names,
    shear,
    texture_size,
    tile,
)


def add(commands) -> None:
    command = commands.add_parser("unwrap", help="unwrap every mesh of a file, all at one texel density")
    command.set_defaults(run=run)
    add_settings(command)
    command.add_argument("--mark-seams", action="store_true", help="mark the edges that were cut as seams")
    add_report(command, "chart")


def add_settings(command: argparse.ArgumentParser) -> None:
    """Files, and what is asked of the UVs."""
    add_files(command)
    command.add_argument(
        "--boundary", choices=names(BOUNDARIES), default=DEFAULT_BOUNDARY.lower(), help="outline of every island"
    )
    command.add_argument("--map", choices=names(MAPS), default=DEFAULT_MAP.lower(), help="which map")
    command.add_argument(
        "--aspect", type=aspect, default=0.0, metavar="A", help="height over width of a rectangle; 0: its own"
    )
    add_marker_options(command)
    add_area_options(command)
    command.add_argument("--seams", choices=names(SEAMS), default=DEFAULT_SEAMS.lower(), help="where islands are cut")
    add_cut_options(command)
    command.add_argument(
        "--max-shear",
        type=shear,
        default=DEFAULT_MAX_SHEAR,
        metavar="S",
        help="add seams until the mean shear of islands is below S > 1; 0: only those that open a part",
    )
    command.add_argument("--cut-further", action="store_true", help="add seams to islands whose seams are marked, too")
    command.add_argument(
        "--udim", type=tile, default=FIRST_TILE, metavar="TILE", help="tile to pack into; 1001 is the unit square"
    )
    command.add_argument(
        "--margin", type=margin, default=DEFAULT_MARGIN, metavar="PX", help="least distance of islands, in pixels"
    )
    command.add_argument(
        "--texture-size", type=texture_size, default=DEFAULT_TEXTURE_SIZE, metavar="PX", help="width of the texture"
    )
    add_subdivision(command)
    command.add_argument("--pack-around", action="store_true", help="leave room for islands with pins, which stay")
    command.add_argument("--turn-to-fit", action="store_true", help="turn islands any way that packs them closer")
    command.add_argument("--no-pack", action="store_true", help="centre the islands one upon the other")
    command.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to write or make; default: the active")


def chosen(options: argparse.Namespace) -> Settings:
    """The settings that the options of the command ask for."""
    return Settings(
        boundary=options.boundary,
        quality=options.quality,
        balance=options.balance,
        margin=options.margin,
        texture_size=options.texture_size,
        tile=options.udim,
        pack=not options.no_pack,
        pack_around=options.pack_around,
        turn_to_fit=options.turn_to_fit,
        seams=options.seams,
        fill_holes=options.fill_holes,
        max_shear=options.max_shear,
        cut_further=options.cut_further,
        kind=options.map,
        aspect=options.aspect,
    )


def run(options: argparse.Namespace) -> None:
    objects, readings = read_layers(options, plain=True)
    from ..pipelines.layout import UnwrapJob
    from ..pipelines.unwrap import lay_out

    with refusals(objects):
        free, marked = _groups(options, objects)
        readings = chosen_subdivision(options, readings)
        jobs = [
            UnwrapJob.of(r, r.subdivision, avoid, marks) for r, avoid, marks in zip(readings, free, marked, strict=True)
        ]
        layout = drain_shown(lay_out(jobs, chosen(options)))
        if options.subdivision != 0 and not is_plain(objects):
            from ..blender.subdivision import subdivision_warnings

            layout.warnings.extend(subdivision_warnings(objects))
        if options.mark_seams:
            from ..blender.seams import mark_seams

            for obj, surface_map in zip(objects, layout.maps, strict=True):
                mark_seams(obj, surface_map.seams)
        written = write_layers(options, zip(objects, readings, strict=True), layout, apart=options.no_pack)
    if options.report:
        charts = [surface_map.report() for surface_map in layout.maps]
        packing = {"packer": layout.packing.packer, "scale": layout.packing.scale}
        if not options.no_pack:
            packing["coverage"] = layout.packing.coverage
        write_report(
            options, {"boundary": options.boundary, "map": options.map, "packing": packing}, objects, charts, written
        )


def _groups(options: argparse.Namespace, objects: list) -> tuple[list, list]:
    """Weights (n,) of what cuts avoid, and markers of maps, for each object; None where it has none."""
    groups = {"centre": options.centre, "start": options.start_group, "corners": options.corners}
    if not options.keep_free and not any(groups.values()):
        return [None] * len(objects), [None] * len(objects)
    from ..blender.vertex_groups import avoided, map_markers

    return avoided(objects, options.keep_free), map_markers(objects, groups)
