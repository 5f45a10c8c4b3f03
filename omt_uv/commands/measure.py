"""Measure area error, shear, folds and overlap of the active UV maps: the command measure."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from .common import CommandError, check_paths, refusals, require_blender
from .options import add_input
from .selection import read_file


def add(commands) -> None:
    command = commands.add_parser("measure", help="area error, shear, folds and overlap of the active UV maps")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument(
        "--histogram", type=Path, metavar="H.png", help="draw how area error and shear are spread over the surface"
    )
    command.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ..pipelines.distortion import measure_readings, on_subdivision, summary
    from ..pipelines.subdivision import evaluated

    if options.histogram and options.histogram.suffix.lower() != ".png":
        raise CommandError(f"{options.histogram}: a histogram is a picture. Name a .png file.")
    check_paths(options)
    with refusals(name=str(options.input)):
        readings = [reading for _, reading in read_file(options)]
        figures = measure_readings(readings)
        if options.histogram:
            _draw(options.histogram, [evaluated(reading) for reading in readings])
    subdivided = on_subdivision(readings)
    more = {"on_subdivided_surface": True} if subdivided else {}
    print(json.dumps(asdict(figures) | more, indent=1) if options.json else summary(figures, subdivided))


def _draw(path: Path, readings: list) -> None:
    from ..display.canvas import save
    from ..display.histogram import histogram
    from ..files.images import check_whole
    from ..files.silence import silence
    from ..files.verified import staged

    try:
        with staged(path) as made, silence():
            save(made, histogram(readings))
            check_whole(made)
    except (OSError, RuntimeError) as error:
        raise CommandError(f"{path}: {error}") from error
