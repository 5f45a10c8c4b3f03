"""Measure area error, shear, folds and overlap of the active UV maps: the command measure."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from ..settings import DEFAULT_TEXTURE_SIZE
from .common import (
    CommandError,
    UsageError,
    blaming,
    check_paths,
    refusals,
    require_blender,
    warn,
    write_picture,
    write_preview,
)
from .options import add_input, add_preview, texture_size
from .selection import read_file


def add(commands) -> None:
    command = commands.add_parser("measure", help="area error, shear, folds and overlap of the active UV maps")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument(
        "--histogram", type=Path, metavar="H.png", help="draw how area error and shear are spread over the surface"
    )
    add_preview(command)
    command.add_argument(
        "--regions",
        default="",
        metavar="groups|materials|NAME",
        help="figures of regions as well: of vertex groups, of materials, or of the values of an attribute of faces",
    )
    command.add_argument("--csv", action="store_true", help="print the figures of regions as CSV")
    command.add_argument("--texture-size", type=texture_size, default=DEFAULT_TEXTURE_SIZE, metavar="PX")
    command.add_argument(
        "--attributes",
        type=Path,
        metavar="OUT.blend",
        help="write area ratio, shear and stretch as attributes of faces of the mesh, without its modifiers",
    )
    command.add_argument(
        "--beltrami",
        action="store_true",
        help="strain of UV maps, or of a shape key, by vertex groups and materials",
    )
    command.add_argument("--shape-key", default="", metavar="NAME", help="with --beltrami: measure this shape key")
    command.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..pipelines.distortion import measure_readings, on_subdivision, summary
    from ..pipelines.measuring.region_figures import table_text
    from ..pipelines.subdivision import evaluated

    if options.histogram and options.histogram.suffix.lower() != ".png":
        raise CommandError(f"{options.histogram}: a histogram is a picture. Name a .png file.")
    if options.attributes and options.attributes.suffix.lower() != ".blend":
        raise CommandError(f"{options.attributes}: only .blend files keep attributes of faces. Write one of these.")
    if options.csv and not options.regions:
        raise UsageError("--csv is a table of regions. Name these by --regions.")
    if options.shape_key and not options.beltrami:
        raise UsageError("--shape-key goes with --beltrami. Give both.")
    if options.beltrami and options.regions:
        raise UsageError("--beltrami has regions of its own. Leave --regions out.")
    check_paths(options, [options.attributes] if options.attributes else [])
    with refusals(name=str(options.input)):
        pairs = read_file(options)
        readings = [reading for _, reading in pairs]
        strain = _strain(pairs, options) if options.beltrami else ""
        with blaming(pairs):
            figures = None if options.beltrami else measure_readings(readings)
        rows = _regions(options, pairs) if options.regions else []
        if options.histogram:
            from ..display.histogram import histogram

            write_picture(options.histogram, histogram([evaluated(reading) for reading in readings]))
        write_preview(options, pairs)
        if options.attributes:
            _write_attributes(options, pairs)
    if figures is None:
        print(strain)
        return
    subdivided = on_subdivision(readings)
    more: dict[str, object] = {"on_subdivided_surface": True} if subdivided else {}
    if options.csv:
        print(table_text(rows), end="")
    elif options.json:
        more |= {"regions": [asdict(row) for row in rows]} if options.regions else {}
        print(json.dumps(asdict(figures) | more, indent=1))
    else:
        print("\n".join([summary(figures, subdivided), *map(_line, rows)]))


def _regions(options: argparse.Namespace, pairs: list) -> list:
    """Figures of the regions, a row for each, and for all first."""
    from ..blender.measuring.region_labels import regions_of
    from ..pipelines.measuring.region_figures import figures_by_region

    regions = regions_of(pairs, options.regions)
    return figures_by_region([reading for _, reading in pairs], regions, options.texture_size)


def _line(row) -> str:
    """Figures of a region in words."""
    return (
        f"{row.name}: {row.faces} faces, area {row.area:.4g}, {100 * row.surface_share:.2f} % of the surface "
        f"and {100 * row.texture_share:.2f} % of the texture, perimeter {row.perimeter:.4g}, UV diameter "
        f"{row.uv_diameter:.4f}, area ratio {row.ratio_mean:.3f} +- {row.ratio_sd:.3f}, "
        f"shear {row.shear:.3f}, {row.texel_density:.1f} px a unit"
    )


def _write_attributes(options: argparse.Namespace, pairs: list) -> None:
    """Put values of faces into attributes of the objects, and write the file."""
    from ..blender.measuring.face_attributes import write_face_values
    from ..files.saving import save
    from ..pipelines.measuring.per_face import face_values

    values = [face_values(reading) for _, reading in pairs]
    for (obj, _), found in zip(pairs, values, strict=True):
        write_face_values(obj, found)
    warn([], [], save(options.attributes, [obj for obj, _ in pairs], options.input))


def _strain(pairs: list, options: argparse.Namespace) -> str:
    """|mu| of the active UV maps, or of a shape key, over all and by region, as a table or JSON."""
    from ..blender.shapes.strain import strain_rows
    from ..pipelines.shapes.strain import strain_report

    found = {}
    for obj, reading in pairs:
        with refusals(name=obj.name):
            found[obj.name] = strain_report(strain_rows(obj, reading, options.shape_key))
    if options.json:
        return json.dumps(found, indent=1)
    return "\n".join(
        f"{name}, {row['name']}: mean strain {row['mean']:.4f}, greatest {row['greatest']:.4f}, "
        f"{100 * row['share']:.1f} % of the surface"
        for name, table in found.items()
        for row in table
    )
