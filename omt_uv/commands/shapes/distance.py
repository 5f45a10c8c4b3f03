"""Say how far apart two shapes are, whatever their topology, size and place: the command distance."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..common import drain_shown, refusals, require_blender
from ..options import add_input


def add(commands) -> None:
    command = commands.add_parser("distance", help="how far apart two shapes are, by optimal transport")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument("other", type=Path, metavar="B", help="what IN is compared with")
    command.add_argument("--json", action="store_true", help="print as JSON")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ...solver.signatures.wasserstein import shape_distance

    found = shape_distance(signature_of_file(options.input), signature_of_file(options.other))
    if options.json:
        figures = {"distance": found.distance, "raw": found.raw, "floor": found.floor}
        print(json.dumps({"a": str(options.input), "b": str(options.other), **figures}))
    else:
        print(f"{found.distance:.4f}, {found.raw:.4f} with the floor of {found.floor:.4f} of sampling")


def signature_of_file(path: Path):
    """The signature of the meshes of a file. Raises CommandError."""
    from ...blender.mesh import read
    from ...files.meshes import load
    from ...pipelines.shapes.distance import signature_of

    with refusals(name=path.name):
        surfaces = [reading.surface for reading in map(read, load(path)) if reading.faces.any()]
        return drain_shown(signature_of(surfaces))
