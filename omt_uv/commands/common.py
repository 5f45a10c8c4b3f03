"""What all commands share: errors, files in and out, progress, warnings, reports."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from .. import __version__
from ..errors import UserError

PROGRAM = "omt_uv"


class CommandError(UserError):
    """Told on one line, with a status that is not zero."""


def blender():
    """The modules that need Blender, which the help and a misspelt option do not; says what is missing."""
    from ..files.silence import silence

    try:
        with silence():
            from ..blender import mesh as blender_mesh
            from ..blender import uv_packer as blender_pack
            from ..files import meshes as files
    except ModuleNotFoundError as error:
        raise CommandError(f"{error}. Install bpy, numpy, scipy and xatlas, or run inside Blender.") from error
    return files, blender_mesh, blender_pack


def read(path: Path, files, blender_mesh, layer: str = "") -> list:
    """Pairs of object and Reading of a UV layer (the active one by default) of all meshes with faces."""
    from ..solver.errors import MeshError

    try:
        objects = files.load(path)
    except files.FileError as error:
        raise CommandError(str(error)) from error
    unique = {obj.data: obj for obj in reversed(objects)}
    pairs = []
    for obj in reversed(unique.values()):
        try:
            reading = blender_mesh.read(obj, layer)
        except MeshError as error:
            raise CommandError(f"{obj.name}: {error}") from error
        if path.suffix.lower() == ".glb":
            reading = blender_mesh.weld_split_vertices(reading)
        if reading.faces.any():
            pairs.append((obj, reading))
        elif len(unique) > 1:
            print(f"{PROGRAM}: warning: {obj.name} has no faces and is left alone", file=sys.stderr)
    if not pairs:
        raise CommandError(f"{path}: The mesh has no faces. Give a file with faces.")
    return pairs


def check_output(path: Path, files) -> None:
    if path.suffix.lower() not in files.WRITABLE:
        raise CommandError(f"{path}: unknown format. Use one of {' '.join(files.WRITABLE)}.")
    if not path.resolve().parent.is_dir():
        raise CommandError(f"{path}: there is no such folder")


def drain_shown(steps):
    """The result of a solver; a terminal shows its progress."""
    from ..solver.progress import drain

    shown = sys.stderr.isatty()
    try:
        return drain(steps, _show_progress if shown else None)
    finally:
        if shown:
            print("\r\033[K", end="", file=sys.stderr)


def _show_progress(progress) -> None:
    print(f"\r\033[K{100 * progress.fraction:3.0f} % {progress.stage}", end="", file=sys.stderr, flush=True)


def warn(objects: list, solver_warnings: list[tuple[int, str]], warnings: list[str]) -> list[str]:
    """Print and return the warnings of the writer and of the solver, each once."""
    told = list(warnings)
    for index, text in dict.fromkeys(solver_warnings):
        told.append(f"{objects[index].name}: {text}" if index >= 0 else text)
    for text in told:
        print(f"{PROGRAM}: warning: {text}", file=sys.stderr)
    return told


def write_report(options: argparse.Namespace, more: dict, objects: list, charts: list, warnings: list[str]) -> None:
    """Settings, `more`, the figures of the charts of every object, and warnings as JSON."""
    report = {
        "version": __version__,
        "input": str(options.input),
        "output": str(options.output),
        "quality": options.quality,
        "balance": options.balance,
        **more,
        "charts": [
            {"object": obj.name, "chart": k, **figures}
            for obj, mine in zip(objects, charts, strict=True)
            for k, figures in enumerate(mine)
        ],
        "warnings": warnings,
    }
    try:
        options.report.write_text(json.dumps(report, indent=1) + "\n")
    except OSError as error:
        raise CommandError(f"{options.report}: {error.strerror}") from error
