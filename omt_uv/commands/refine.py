"""Refine existing UVs of every mesh of a file, whatever unwrapped them: the command refine."""

from __future__ import annotations

import argparse

from ..settings import RefineSettings
from .common import drain_shown, refusals, write_report
from .layers import read_layers, write_layers
from .options import FORMATS, add_area_options, add_files, add_report, add_subdivision, chosen_subdivision


def add(commands) -> None:
    command = commands.add_parser("refine", help="improve existing UVs of every mesh, whatever unwrapped them")
    command.set_defaults(run=run)
    add_files(command, accepts=f"{FORMATS}, with UVs")
    add_area_options(command)
    command.add_argument("--keep-boundary", action="store_true", help="leave the outline of every island as it is")
    add_subdivision(command)
    command.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to refine; default: the active one")
    add_report(command, "island")


def run(options: argparse.Namespace) -> None:
    objects, readings = read_layers(options, existing=True)
    from ..pipelines.refine import refine_islands

    settings = RefineSettings(quality=options.quality, balance=options.balance, keep_boundary=options.keep_boundary)
    with refusals(objects):
        readings = chosen_subdivision(options, readings)
        surfaces, modifiers = [(r.surface, r.faces, r.all_pins) for r in readings], [r.subdivision for r in readings]
        refined = drain_shown(refine_islands(surfaces, settings, modifiers))
        written = write_layers(options, zip(objects, readings, strict=True), refined, existed=True)
    if options.report:
        write_report(options, {"keep_boundary": options.keep_boundary}, objects, refined.reports, written)
