"""Run the command line: `python -m omt_uv ...` and `blender -b --command omt_uv ...`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from . import __version__
from .commands import magnify, measure, refine, remesh, seams, sphere, unwrap, weights
from .commands.common import PROGRAM
from .errors import UserError

COMMANDS = (unwrap, refine, magnify, weights, seams, sphere, measure, remesh)
FAILURE = 1


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    try:
        options = parser().parse_args(arguments)
    except SystemExit as stop:  # argparse has printed help or the error
        return stop.code if isinstance(stop.code, int) else FAILURE
    try:
        options.run(options)
    except UserError as error:
        print(f"{PROGRAM}: error: {' '.join(str(error).split())}", file=sys.stderr)
        return FAILURE
    return 0


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog=PROGRAM, description="Area-preserving UV unwrapping.")
    top.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.add(commands)
    return top
