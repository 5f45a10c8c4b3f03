"""Write the power diagram of the transport as a mesh or as a picture: the command diagram."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ...settings import DOMAINS
from ...solver.errors import plural
from ..common import CommandError, check_paths, drain_shown, refusals, require_blender, warn, write_picture
from ..options import add_input, names, texture_size
from ..selection import read_file

ENDINGS = (".obj", ".png")
SIZE = 1024


def add(commands) -> None:
    command = commands.add_parser("diagram", help="cells of the transport of a surface's areas, as mesh or picture")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument("-o", "--output", dest="made", type=Path, metavar="OUT", required=True, help=" ".join(ENDINGS))
    command.add_argument("--domain", choices=names(DOMAINS), default=DOMAINS[0][0].lower(), help="what the cells fill")
    command.add_argument("--size", type=texture_size, default=SIZE, metavar="PX", help="width of a picture")
    command.add_argument("--json", action="store_true", help="print the number of cells, their error, Newton steps")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ...files.verified import write_bytes
    from ...pipelines.measuring.diagrams import diagram

    ending = options.made.suffix.lower()
    if ending not in ENDINGS:
        raise CommandError(f"{options.made}: a diagram is written as {' or '.join(ENDINGS)}. Name such a file.")
    check_paths(options, [])
    pairs = read_file(options)
    obj, reading = max(pairs, key=lambda pair: len(pair[1].surface.triangles))
    told = [] if len(pairs) == 1 else [_left_out(obj.name, len(pairs) - 1)]
    if told and options.strict:
        raise CommandError(f"{options.input}: {told[0]}. Nothing was written, as --strict asks.")
    with refusals(name=obj.name):
        found = drain_shown(diagram(reading.surface, reading.faces, options.domain))
    warn([obj], [(0, text) for text in found.warnings], told)
    if ending == ".png":
        from ...display.textures.layouts import cells_picture

        with refusals(name=obj.name):
            picture = cells_picture(found, options.size)
        write_picture(options.made, picture)
    else:
        write_bytes(options.made, obj_text(*found.mesh()).encode())
    if options.json:
        print(json.dumps(found.report()))


def _left_out(name: str, count: int) -> str:
    """What is told of other objects than the one of this name."""
    others = plural(count, "another object is", "{} other objects are")
    return f"The diagram is that of {name}, which has most triangles; {others} left out: name one by --object"


def obj_text(vertices, polygons) -> str:
    """Vertices (n,3) and polygons as the text of an .obj file."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices.tolist()]
    lines += ["f " + " ".join(str(k + 1) for k in polygon.tolist()) for polygon in polygons]
    return "\n".join([*lines, ""])
