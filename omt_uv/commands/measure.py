"""Measure area error, shear, folds and overlap of the active UV maps: the command measure."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from .common import CommandError, check_paths, refusals, require_blender, write_picture, write_preview
from .options import add_input, add_preview
from .selection import read_file


def add(commands) -> None:
    command = commands.add_parser("measure", help="area error, shear, folds and overlap of the active UV maps")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument(
        "--histogram", type=Path, metavar="H.png", help="draw how area error and shear are spread over the surface"
    )
    add_preview(command)
    command.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..pipelines.distortion import measure_readings, on_subdivision, summary
    from ..pipelines.subdivision import evaluated

    if options.histogram and options.histogram.suffix.lower() != ".png":
        raise CommandError(f"{options.histogram}: a histogram is a picture. Name a .png file.")
    check_paths(options)
    with refusals(name=str(options.input)):
        pairs = read_file(options)
        readings = [reading for _, reading in pairs]
        figures = measure_readings(readings)
        if options.histogram:
            from ..display.histogram import histogram

            write_picture(options.histogram, histogram([evaluated(reading) for reading in readings]))
        write_preview(options, pairs)
    subdivided = on_subdivision(readings)
    more = {"on_subdivided_surface": True} if subdivided else {}
    print(json.dumps(asdict(figures) | more, indent=1) if options.json else summary(figures, subdivided))
