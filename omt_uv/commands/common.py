"""Read files, show progress, print warnings and write reports, for all commands."""

from __future__ import annotations

import argparse
import gc
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path

from .. import __version__
from ..errors import UserError, one_line
from ..supervision import PROGRAM

# Formats in which Y is up, by custom, and what turns that to Z.
Y_IS_UP = (".obj", ".off", ".ply")
Y_TO_Z = ((1, 0, 0), (0, 0, -1), (0, 1, 0))
# Options that hold files which commands write beside OUT, and such as they read, with what they are called.
WRITTEN = {name: f"--{name.replace('_', '-')}" for name in (
    "report", "histogram", "preview", "plot", "image_out", "image_output")} | {"made": "OUT"}  # fmt: skip
READ = {"input": "IN", "target": "DST", "other": "B", "others": "B", "image": "--image", "handles": "--handles",
        "index": "--index", "landmarks": "--landmarks"}  # fmt: skip
# What is read, and what may take its place.
REPLACED = {("IN", "OUT"), ("DST", "OUT"), ("--image", "--image-out"), ("--image", "--image-output")}


class CommandError(UserError):
    """Told on one line, with a status that is not zero."""

    status = 1


class UsageError(CommandError):
    """Options that make no sense together, before anything was read."""

    status = 2


def require_blender() -> None:
    """Import what needs Blender, which the help and a misspelt option do not; CommandError says what is missing."""
    from ..files.silence import silence

    try:
        with silence(), without_collections():
            from ..blender import mesh  # noqa: F401
            from ..files import meshes  # noqa: F401
    except ModuleNotFoundError as error:
        raise CommandError(f"{error}. Install bpy, numpy, scipy and xatlas, or run inside Blender.") from error


@contextmanager
def without_collections(module: str = "bpy") -> Iterator[None]:
    """Look for no garbage while a module is imported for the first time, nor in what that has left, ever.

    Of Blender it is a hundred thousand objects that stay: to go through them again and again takes a tenth of a small
    command.
    """
    if module in sys.modules or not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        gc.enable()


@contextmanager
def refusals(objects: Sequence = (), name: str = "", others: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Turn errors of the solver into CommandErrors; what the user can mend passes as it is.

    objects : those that the index of a Refusal counts
    name : what a MeshError of the block is about, if it is about one thing
    others : errors that tell the user what to do, too, although they are no UserErrors
    """
    from ..pipelines.layout import Refusal
    from ..remedies import explain
    from ..solver.errors import MeshError

    try:
        yield
    except Refusal as refusal:
        raise CommandError(f"{objects[refusal.index].name}: {explain(refusal.error)}") from refusal
    except MeshError as error:
        raise CommandError(f"{name}: {explain(error)}" if name else explain(error)) from error
    except others as error:
        raise CommandError(str(error)) from error


def blaming(pairs: list) -> AbstractContextManager[None]:
    """Refuse the first object, of pairs of object and Reading that a block measures as one, without a measure."""
    from ..pipelines import distortion

    return distortion.blaming(pairs, lambda obj: refusals(name=obj.name))


def check_paths(options: argparse.Namespace, outputs: Sequence[Path] | None = None) -> None:
    """Refuse what cannot be written before the long work: all files of the options, and whatever names one twice.

    outputs : mesh files that are written, if other than OUT. OUT may be IN or DST, which is replaced, and a picture
        that is written the one that is read; whatever else is read is not written over

    Raises
    ------
    UsageError : two options lead to one file
    FileError : a file cannot be written
    """
    from ..files.saving import check_target
    from ..files.verified import check_writable, clash

    check_picture(getattr(options, "preview", None))
    meshes = [options.output] if outputs is None and "output" in options else list(outputs or ())
    written, read = _named_paths(options, WRITTEN), _named_paths(options, READ)
    outs = [("OUT", path) for path in meshes] or _named_paths(options, {"output": "OUT"})
    found = clash([*outs, *written])
    for told, path in read:
        others = [pair for pair in [*outs, *written] if (told, pair[0]) not in REPLACED]
        found = found or next(filter(None, (clash([(told, path), pair]) for pair in others)), None)
    if found:
        raise UsageError(f"{found[0]} and {found[1]} are one file. Give each a name of its own.")
    for path in meshes:
        check_target(path)
    for _, path in written:
        check_writable(path)


def _named_paths(options: argparse.Namespace, names: dict[str, str]) -> list[tuple[str, Path]]:
    """Pairs of a name for the user and a path that an option holds; one that takes a list gives several."""
    found = []
    for name, told in names.items():
        value = getattr(options, name, None)
        values = value if isinstance(value, list) else [value]
        # The landmarks of a file, where they may be a prefix as well.
        values = [Path(v) if isinstance(v, str) and v.endswith(".json") else v for v in values]
        found += [(told, path) for path in values if isinstance(path, Path)]
    return found


def write_picture(path: Path, picture) -> None:
    """Write a picture (h,w,3) in [0,1] as a PNG file, whole or not at all.

    Raises
    ------
    CommandError : it cannot be written
    """
    from ..display.canvas import save
    from ..files.images import check_whole
    from ..files.silence import silence
    from ..files.verified import staged

    try:
        with staged(path) as made, silence():
            save(made, picture)
            check_whole(made)
    except (OSError, RuntimeError) as error:
        raise CommandError(f"{path}: {error}") from error


def write_preview(options: argparse.Namespace, pairs, cells=None) -> None:
    """Draw objects with their Readings into a PNG file, if there is to be one; cells: (f,) of the polygons of each."""
    if options.preview is None:
        return
    from ..display.png import png_bytes
    from ..display.preview import preview
    from ..files.verified import write_bytes

    placed = place_objects(options, pairs)
    if cells is not None:
        placed = [replace(item, cells=mine) for item, mine in zip(placed, cells, strict=True)]
    write_bytes(options.preview, png_bytes(preview(placed)))


def place_objects(options: argparse.Namespace, pairs) -> list:
    """Objects with their Readings as they stand in the world, where Z is up: `preview.Placed`."""
    import numpy as np

    from ..blender.mesh import place_of
    from ..display.preview import Placed

    # Their axes are taken as they are.
    upright = np.array(Y_TO_Z if options.input.suffix.lower() in Y_IS_UP else np.eye(3), float)
    placed = []
    for obj, reading in pairs:
        rotation, shift = place_of(obj)
        placed.append(Placed(reading, upright @ rotation, upright @ shift))
    return placed


def check_picture(path: Path | None) -> None:
    """Raise UsageError if a picture that is asked for is no .png file."""
    if path is not None and path.suffix.lower() != ".png":
        raise UsageError(f"{path}: this picture is a .png file. Name one.")


def drain_shown(steps):
    """The result of a solver; a terminal shows its progress."""
    from ..solver.progress import drain, part_of

    shown = sys.stderr.isatty()
    try:
        return drain(part_of(steps, 0.0, 1.0), _show_progress if shown else None)
    finally:
        if shown:
            print("\r\033[K", end="", file=sys.stderr)


def _show_progress(progress) -> None:
    print(f"\r\033[K{100 * progress.fraction:3.0f} % {progress.stage}", end="", file=sys.stderr, flush=True)


def warn(objects: list, solver_warnings: list[tuple[int, str]], warnings: list[str]) -> list[str]:
    """Print and return the warnings of the writer and of the solver, each once."""
    from ..remedies import advise

    told = list(warnings)
    for index, text in dict.fromkeys(solver_warnings):
        told.append(f"{objects[index].name}: {advise(text)}" if index >= 0 else advise(text))
    for text in told:
        warn_of(text)
    return told


def warn_of(text: str) -> None:
    """Print a warning on a line of its own."""
    print(f"{PROGRAM}: warning: {one_line(text)}", file=sys.stderr)


def write_report(options: argparse.Namespace, more: dict, objects: list, charts: list, written) -> None:
    """Settings, `more`, the figures of the charts of every object, and what was written (`layers.Written`), as JSON."""
    figures = {
        "quality": options.quality,
        "balance": options.balance,
        **more,
        "charts": [
            {"object": obj.name, "chart": k, **figures}
            for obj, mine in zip(objects, charts, strict=True)
            for k, figures in enumerate(mine)
        ],
        "gate": written.gate.report(),
    }
    write_figures(options, figures, written.warnings)


def write_figures(options: argparse.Namespace, figures: dict, told: list[str]) -> None:
    """What was read and written, figures, and warnings that were told, as JSON."""
    from ..files.verified import write_text

    report = {
        "version": __version__,
        "input": str(options.input),
        "output": str(options.output),
        **figures,
        "warnings": [*options.told, *told],
    }
    write_text(options.report, json.dumps(report, indent=1) + "\n")
