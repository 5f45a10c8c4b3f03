"""Declare the options that several commands share, and check their values."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from ..settings import DEFAULT_BALANCE, DEFAULT_QUALITY, FIRST_TILE, QUALITIES
from ..supervision import MEMORY_IS_LIMITED

# Levels of subdivision, as many as Blender's slider has.
MOST_LEVELS = 6
FORMATS = ".blend .obj .ply .stl .glb .gltf .fbx"
# Height over width, or width over height, of what still is a rectangle.
MOST_ASPECT = 1e4
# Gigabytes; with 0.35 Blender hangs while it starts.
LEAST_MEMORY = 0.5
# Corners of faces that Blender can count; a closed mesh of triangles has six for every vertex.
MOST_CORNERS = 2**31 - 1
MOST_FACES = MOST_CORNERS // 3
MOST_VERTICES = MOST_CORNERS // 6


def add_files(command: argparse.ArgumentParser, accepts: str = f"{FORMATS} .off", writes: str = FORMATS) -> None:
    add_input(command, accepts)
    command.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=writes)


def add_input(command: argparse.ArgumentParser, accepts: str = f"{FORMATS} .off", metavar: str = "IN") -> None:
    """What is read, how strictly, and how much time and memory that may take; a folder's files are each read so."""
    command.set_defaults(told=[])
    command.add_argument("input", type=Path, metavar=metavar, help=accepts)
    command.add_argument(
        "--object",
        action="append",
        default=[],
        metavar="NAME",
        help=f"take this object of {metavar} alone; may be repeated",
    )
    command.add_argument("--scene", default="", metavar="NAME", help="take the objects of this scene of a .blend alone")
    command.add_argument(
        "--skip-linked", action="store_true", help="leave out linked objects and library overrides instead of refusing"
    )
    command.add_argument(
        "--strict", action="store_true", help="refuse what is read incompletely, and UVs with folds or overlap"
    )
    command.add_argument("--timeout", type=positive, default=0.0, metavar="S", help="give up after so many seconds")
    command.add_argument("--memory", type=gigabytes, default=0.0, metavar="GB", help="take no more memory than this")


def add_area_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--balance", type=share, default=DEFAULT_BALANCE, metavar="T", help="from 0, exact areas, to 1, least shear"
    )
    command.add_argument(
        "--quality", choices=names(QUALITIES), default=DEFAULT_QUALITY.lower(), help="how exact the areas become"
    )


def add_report(command: argparse.ArgumentParser, of: str) -> None:
    command.add_argument("--report", type=Path, metavar="R.json", help=f"write figures of every {of}")
    add_preview(command)


def add_preview(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--preview", type=Path, metavar="P.png", help="draw the checkered mesh, the layout and the wireframe"
    )


def add_cut_options(command: argparse.ArgumentParser) -> None:
    command.add_argument("--fill-holes", action="store_true", help="take all holes but the longest boundary for filled")
    command.add_argument("--keep-free", default="", metavar="GROUP", help="vertex group that new cuts avoid")


def add_marker_options(command: argparse.ArgumentParser) -> None:
    """Vertex groups that fix what a map leaves open."""
    command.add_argument("--centre", default="", metavar="GROUP", help="vertex that goes to the middle of a disk")
    command.add_argument(
        "--start", dest="start_group", default="", metavar="GROUP", help="vertex of the boundary that goes to the right"
    )
    command.add_argument(
        "--corners", default="", metavar="GROUP", help="four vertices: corners; three, on a disk: to 1, i and -1"
    )


def names(items) -> list[str]:
    return [identifier.lower() for identifier, *_ in items]


def number(text: str) -> float:
    """A float that is one: every option of floats is of this type or made of it."""
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a finite number")
    return value


def positive(text: str) -> float:
    value = number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not greater than 0")
    return value


def aspect(text: str) -> float:
    value = number(text)
    if not 0 <= value < MOST_ASPECT:
        raise argparse.ArgumentTypeError(f"{text} is no aspect from 0, its own, to {MOST_ASPECT:g}")
    return value


def angle(text: str) -> float:
    value = number(text)
    if not 0 <= value <= 180:
        raise argparse.ArgumentTypeError(f"{text} is not an angle from 0 to 180 degrees")
    return value


def gigabytes(text: str) -> float:
    value = number(text)
    if value < LEAST_MEMORY:
        raise argparse.ArgumentTypeError(f"{text} is less than {LEAST_MEMORY}, which Blender needs to start")
    if not MEMORY_IS_LIMITED:
        raise argparse.ArgumentTypeError("this system does not hold a program to a limit of memory; Linux does")
    return value


def vertices(text: str) -> int:
    return _count(text, MOST_VERTICES)


def faces(text: str) -> int:
    return _count(text, MOST_FACES)


def _count(text: str, most: int) -> int:
    value = int(text)
    if not 1 <= value <= most:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 to {most}, the most that a mesh can hold")
    return value


def share(text: str) -> float:
    value = number(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return value


def shear(text: str) -> float:
    """A bound of the shear, or 0 for none."""
    value = number(text)
    if value and value <= 1:
        raise argparse.ArgumentTypeError(f"{text} is not greater than 1, which is no shear, nor 0 for no bound")
    return value


def subdivision(text: str) -> str | int:
    """ "auto", or levels; "off" is 0."""
    if text in ("auto", "off"):
        return "auto" if text == "auto" else 0
    value = int(text)
    if not 0 <= value <= MOST_LEVELS:
        raise argparse.ArgumentTypeError(f"{text} is not a number of levels from 0 to {MOST_LEVELS}")
    return value


def add_subdivision(command) -> None:
    """--subdivision, whose value `chosen_subdivision` applies."""
    command.add_argument(
        "--subdivision",
        type=subdivision,
        default="auto",
        metavar="auto|off|N",
        help="keep the areas of the subdivided surface: of the modifier's, of the mesh alone, or of N levels",
    )


def chosen_subdivision(options: argparse.Namespace, readings: list) -> list:
    """The readings with the levels that were asked for."""
    if options.subdivision == "auto":
        return readings
    from ..blender.subdivision import with_levels

    return [with_levels(r, options.subdivision) for r in readings]


def margin(text: str) -> float:
    value = number(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is not a number of pixels")
    return value


def tile(text: str) -> int:
    value = int(text)
    if not FIRST_TILE <= value <= 1999:
        raise argparse.ArgumentTypeError(f"{text} is no UDIM tile: they go from {FIRST_TILE} to 1999")
    return value


def texture_size(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of pixels")
    return value
