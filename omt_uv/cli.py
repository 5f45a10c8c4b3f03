"""Run the command line: `python -m omt_uv ...` and `blender -b --command omt_uv ...`."""

from __future__ import annotations

import argparse
import errno
import importlib
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path

from . import __version__, supervision
from .errors import UserError
from .supervision import PROGRAM, tell

# Modules of commands, by package; a run reads that of its own command alone.
COMMANDS = {
    "commands": "unwrap refine magnify weights seams sphere measure compare remesh",
    "commands.arranging": "islands queue",
    "commands.pictures": "test_texture diagram",
    "commands.volumes": "flow volume",
    "commands.shapes": "match average partition distance signature library distances",
    # Of many files, without Blender in their own process.
    "commands.batches": "batch table summary page",
}
# As their modules have it, which runs of single files do not read.
BATCH = "batch"
SERVE = "serve"
# What only the system, its disks and its limits decide; any other error of a file that no module named is a defect.
OF_SYSTEM = {getattr(errno, name) for name in (
    "ENOSPC", "EDQUOT", "EROFS", "EACCES", "EPERM", "EIO", "EFBIG", "EMFILE", "ENFILE", "ENXIO", "ESTALE", "ETXTBSY")
    if hasattr(errno, name)}  # fmt: skip


def script() -> None:
    """Run the command that the arguments of this process ask for, and end it; what an installed `omt-uv` calls."""
    supervision.open_streams()
    supervision.leave(program(sys.argv[1:], [sys.executable, *sys.orig_argv[1:]]))


def program(arguments: Sequence[str], words: Sequence[str]) -> int:
    """Run a command in a child process, which `words` start; returns the exit status."""
    if supervision.is_child() and arguments[:1] == [SERVE]:
        from .commands.batches import serve

        return serve.serve(float(arguments[1]), main)
    try:
        options = parsed(arguments)
    except SystemExit as stop:
        return _status(stop)
    options.start = list(words)[: len(words) - len(arguments)]
    if supervision.is_child():
        supervision.begin_child(getattr(options, "memory", 0.0))
        return carry_out(options)
    if getattr(options, "alone", False):
        return carry_out(options)
    paths = [value for value in vars(options).values() if isinstance(value, Path)]
    errand = supervision.Errand(
        words=words,
        about=str(options.input),
        folders=tuple({path.absolute().parent for path in paths}),
        timeout=options.timeout,
        memory=options.memory > 0,
    )
    try:
        return supervision.supervise(errand)
    except OSError as error:
        return _told(f"{options.input}: no child process can be started: {_of_system(error)}", supervision.FAILURE)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command in this process, without its limits; returns the exit status."""
    try:
        return carry_out(parsed(sys.argv[1:] if arguments is None else arguments))
    except SystemExit as stop:
        return _status(stop)


def parsed(arguments: Sequence[str]) -> argparse.Namespace:
    """The options of a command; `rest` is what a batch hands to the command that it runs, after --."""
    words, rest = list(arguments), []
    if words[:1] == [BATCH] and "--" in words:
        cut = words.index("--")
        words, rest = words[:cut], words[cut + 1 :]
    options = parser(words[0] if words else "").parse_args(words)
    options.rest = rest
    return options


def carry_out(options: argparse.Namespace) -> int:
    """Run a parsed command; what goes wrong is one line and a status."""
    try:
        options.run(options)
    except UserError as error:
        return _told(str(error), getattr(error, "status", supervision.FAILURE))
    except MemoryError as error:
        return _told(f"{options.input}: not enough memory. {error}", supervision.MEMORY)
    except KeyboardInterrupt:
        return _told(f"{options.input}: stopped by SIGINT", supervision.INTERRUPTED)
    except BrokenPipeError as error:
        return supervision.lost(error)
    except OSError as error:
        if error.errno not in OF_SYSTEM:
            return _defect(options, error)
        return _told(f"{options.input}: {_of_system(error)}", supervision.FAILURE)
    except Exception as error:  # noqa: BLE001 - told with its place, and with a status of its own
        return _defect(options, error)
    return 0


def _of_system(error: OSError) -> str:
    """What the system refuses, where, and what to do."""
    # What is printed goes to files, too.
    where = error.filename or "what is written or printed"
    return f"{where}: {error.strerror or error}. Look for space, rights and limits there."


def _defect(options: argparse.Namespace, error: Exception) -> int:
    """The last one there is: whatever no module named, in one line with a status of its own."""
    if sys.flags.dev_mode:
        raise error
    where = traceback.extract_tb(error.__traceback__)[-1]
    text = f"{type(error).__name__} in {Path(where.filename).name}:{where.lineno}: {error}"
    return _told(f"{options.input}: a defect of this program, please report it: {text}", supervision.DEFECT)


def _told(text: str, status: int) -> int:
    tell(text)
    return status


def _status(stop: SystemExit) -> int:
    """The status with which argparse ends, which has printed help or the error."""
    return stop.code if isinstance(stop.code, int) else supervision.FAILURE


def parser(command: str = "") -> argparse.ArgumentParser:
    """The parser of this command alone; of all where none is of this name, and for a batch, which runs any of them."""
    top = argparse.ArgumentParser(prog=PROGRAM, description="Area-preserving UV unwrapping.")
    top.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    modules = {name: package for package, names in COMMANDS.items() for name in names.split()}
    for name in [command] if command in modules and command != BATCH else modules:
        importlib.import_module(f".{modules[name]}.{name}", __package__).add(commands)
    return top
