"""Draw pictures that show what UVs do: the command test-texture."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..common import CommandError, blaming, check_paths, place_objects, refusals, require_blender, write_picture
from ..options import add_input, texture_size
from ..selection import read_file

PATTERNS = ("checker", "circles", "world")
LAYOUTS = ("area", "shear", "normals")
SIZE = 2048


def add(commands) -> None:
    command = commands.add_parser("test-texture", help="pictures to look at UVs with, and layouts in colours")
    command.set_defaults(run=run)
    add_input(command, accepts="the mesh that has the UVs; any file for a pattern that needs none, such as - ")
    command.add_argument("-o", "--output", dest="made", type=Path, metavar="OUT.png", required=True)
    command.add_argument(
        "--kind",
        choices=(*PATTERNS, *LAYOUTS),
        default=PATTERNS[0],
        help="labelled checker, circle packing, map of the world; or the layout by area, shear, or normals",
    )
    command.add_argument("--size", type=texture_size, default=SIZE, metavar="PX", help="width, default %(default)s")


def run(options: argparse.Namespace) -> None:
    require_blender()
    if options.made.suffix.lower() != ".png":
        raise CommandError(f"{options.made}: a test picture is a .png file. Name one.")
    check_paths(options, [])
    write_picture(options.made, drawn(options))


def drawn(options: argparse.Namespace):
    """The picture (h,w,3) in [0,1]."""
    if options.kind in PATTERNS:
        from ...display.textures.patterns import picture_of

        with refusals():
            return picture_of(options.kind, options.size)
    from ...display.textures.layouts import layout_picture

    pairs = read_file(options)
    bare = [obj.name for obj, reading in pairs if reading.uv is None]
    if bare:
        raise CommandError(f"{', '.join(bare)}: There are no UVs to draw. Unwrap the mesh first.")
    with refusals(), blaming(pairs):
        return layout_picture(place_objects(options, pairs), options.kind, options.size)
