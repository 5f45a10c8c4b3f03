"""Say how far apart two shapes are, whatever their topology, size and place: the command distance."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..common import CommandError, drain_shown, refusals, require_blender
from ..options import add_input, vertices
from ..selection import of_file, read_file

# Of a signature; solver.signatures has this number, too, and is not read before there is something to do.
POINTS = 400


def add(commands) -> None:
    command = commands.add_parser("distance", help="how far apart two shapes are, by optimal transport")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument("other", type=Path, metavar="B", help="what IN is compared with")
    command.add_argument("--json", action="store_true", help="print as JSON")
    add_points(command)


def add_points(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--points",
        type=vertices,
        default=POINTS,
        metavar="N",
        help=f"of a signature: more are slower, default {POINTS}",
    )
    add_markers(command)


def add_markers(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--markers",
        type=pair_of_markers,
        default=None,
        metavar="P,Q",
        help="vertex groups, empties, or numbers of vertices: compare what is around P, as far as Q or the boundary "
        "with Q",
    )


def pair_of_markers(text: str) -> tuple[str, str]:
    """Two names."""
    parts = tuple(part.strip() for part in text.split(","))
    if len(parts) != 2 or not all(parts):
        raise argparse.ArgumentTypeError(f"{text!r}: markers are two names with a comma between them")
    return parts


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ...solver.signatures.wasserstein import shape_distance

    found = shape_distance(signature_of_file(options, options.input), signature_of_file(options, options.other))
    if options.json:
        figures = {"distance": found.distance, "raw": found.raw, "floor": found.floor}
        print(json.dumps({"a": str(options.input), "b": str(options.other), **figures}))
    else:
        print(f"{found.distance:.4f}, {found.raw:.4f} with the floor of {found.floor:.4f} of sampling")


def signature_of_file(options: argparse.Namespace, path: Path, points: int = 0):
    """The signature of the chosen meshes of a file; `--object` is about IN. Raises CommandError."""
    from ...pipelines.shapes.distance import signature_of

    pairs = read_file(of_file(options, path))
    with refusals(name=path.name):
        markers = _markers(options, path, pairs)
        surfaces = [reading.surface for _, reading in pairs]
        return drain_shown(signature_of(surfaces, points or options.points, markers))


def _markers(options: argparse.Namespace, path: Path, pairs: list) -> list | None:
    """The markers of each object, None without any. Raises CommandError, GroupError."""
    if options.markers is None:
        return None
    from ...blender.shapes.landmarks import disk_markers
    from ...pipelines.shapes.distance import markers_of

    objects = [obj for obj, _ in pairs]
    if not all(name.isdecimal() for name in options.markers):
        return disk_markers(objects, [reading.surface.positions for _, reading in pairs], options.markers)
    if len(objects) > 1:
        raise CommandError(f"{path}: numbers of vertices are those of one mesh. Choose it by --object.")
    centre, start = map(int, options.markers)
    count = len(objects[0].data.vertices)
    if max(centre, start) >= count:
        raise CommandError(f"{path}: there is no vertex {max(centre, start)}. It has {count}, from 0.")
    return [markers_of([centre], [start])]
