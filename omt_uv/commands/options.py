"""Declare the options that several commands share, and check their values."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..settings import DEFAULT_BALANCE, DEFAULT_QUALITY, FIRST_TILE, QUALITIES

# Levels of subdivision, as many as Blender's slider has.
MOST_LEVELS = 6
FORMATS = ".blend .obj .ply .stl .glb .fbx"


def add_files(command: argparse.ArgumentParser, accepts: str = f"{FORMATS} .off", writes: str = FORMATS) -> None:
    command.add_argument("input", type=Path, metavar="IN", help=accepts)
    command.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=writes)


def add_area_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--balance", type=share, default=DEFAULT_BALANCE, metavar="T", help="from 0, exact areas, to 1, least shear"
    )
    command.add_argument(
        "--quality", choices=names(QUALITIES), default=DEFAULT_QUALITY.lower(), help="how exact the areas become"
    )


def add_report(command: argparse.ArgumentParser, of: str) -> None:
    command.add_argument("--report", type=Path, metavar="R.json", help=f"write figures of every {of}")


def add_cut_options(command: argparse.ArgumentParser) -> None:
    command.add_argument("--fill-holes", action="store_true", help="take all holes but the longest boundary for filled")
    command.add_argument("--keep-free", default="", metavar="GROUP", help="vertex group that new cuts avoid")


def names(items) -> list[str]:
    return [identifier.lower() for identifier, *_ in items]


def share(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return value


def shear(text: str) -> float:
    value = float(text)
    if not 1 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not greater than 1, which is no shear")
    return value


def subdivision(text: str) -> str | int:
    """ "auto", or levels; "off" is 0."""
    if text in ("auto", "off"):
        return "auto" if text == "auto" else 0
    value = int(text)
    if not 0 <= value <= MOST_LEVELS:
        raise argparse.ArgumentTypeError(f"{text} is not a number of levels from 0 to {MOST_LEVELS}")
    return value


def margin(text: str) -> float:
    value = float(text)
    if not 0 <= value < float("inf"):
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
