"""Arrange the UV islands of every mesh of a file: the commands stack, symmetrize and rectify."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from ..common import refusals
from ..layers import read_layers, write_layers
from ..options import FORMATS, add_files, add_preview

AXES = "xyz"
HALVES = ("apart", "stacked")


def add(commands) -> None:
    stack = _command(commands, "stack", "put UV islands of equal shape on one another", _stacked)
    stack.add_argument("--no-mirrored", action="store_true", help="leave islands that are only mirror images apart")
    halves = _command(commands, "symmetrize", "give both halves of symmetric objects the same UVs", _symmetrized)
    halves.add_argument("--axis", choices=list(AXES), default="x", help="axis that the halves face each other along")
    halves.add_argument(
        "--halves", choices=HALVES, default="apart", help="mirror images beside one another, or on one another"
    )
    _command(commands, "rectify", "make rectangles of UV islands that are grids of quads", _rectified)


def _command(commands, name: str, words: str, arranged: Callable) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=words)
    command.set_defaults(run=arrange, arranged=arranged)
    add_files(command, accepts=f"{FORMATS}, with UVs")
    command.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to arrange; default: the active one")
    add_preview(command)
    return command


def _stacked(options: argparse.Namespace, readings: list):
    from ...pipelines.arranging.actions import stack_islands

    return stack_islands(readings, not options.no_mirrored)


def _symmetrized(options: argparse.Namespace, readings: list):
    from ...pipelines.arranging.actions import symmetrize_islands

    return symmetrize_islands(readings, AXES.index(options.axis), options.halves == "stacked")


def _rectified(_options: argparse.Namespace, readings: list):
    from ...pipelines.arranging.actions import rectify_islands

    return rectify_islands(readings)


def arrange(options: argparse.Namespace) -> None:
    """Run one of the three; islands may lie on one another, which two of them are for."""
    objects, readings = read_layers(options, existing=True)
    with refusals(objects):
        done = options.arranged(options, readings)
        write_layers(options, zip(objects, readings, strict=True), done, apart=True, existed=True)
