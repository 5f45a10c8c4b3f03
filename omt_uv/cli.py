"""The command line: `python -m omt_uv ...` and `blender -b --command omt_uv ...`."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from . import __version__
from .settings import (
    BOUNDARIES,
    DEFAULT_BALANCE,
    DEFAULT_BOUNDARY,
    DEFAULT_MARGIN,
    DEFAULT_QUALITY,
    DEFAULT_TEXTURE_SIZE,
    QUALITIES,
    Settings,
)

PROGRAM = "omt_uv"
FAILURE = 1


class CommandError(Exception):
    """Told on one line, with a status that is not zero."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    try:
        options = parser().parse_args(arguments)
    except SystemExit as stop:  # argparse has printed help or the error
        return stop.code if isinstance(stop.code, int) else FAILURE
    try:
        options.run(options)
    except CommandError as error:
        print(f"{PROGRAM}: error: {' '.join(str(error).split())}", file=sys.stderr)
        return FAILURE
    return 0


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog=PROGRAM, description="Area-preserving UV unwrapping.")
    top.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    formats = ".blend .obj .ply .stl .glb"

    unwrap = commands.add_parser("unwrap", help="unwrap every mesh of a file, all at one texel density")
    unwrap.set_defaults(run=run_unwrap)
    unwrap.add_argument("input", type=Path, metavar="IN", help=f"{formats} .off")
    unwrap.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=formats)
    unwrap.add_argument(
        "--boundary", choices=_names(BOUNDARIES), default=DEFAULT_BOUNDARY.lower(), help="outline of every island"
    )
    unwrap.add_argument(
        "--balance", type=_share, default=DEFAULT_BALANCE, metavar="T", help="from 0, exact areas, to 1, least shear"
    )
    unwrap.add_argument(
        "--quality", choices=_names(QUALITIES), default=DEFAULT_QUALITY.lower(), help="how exact the areas become"
    )
    unwrap.add_argument(
        "--margin", type=_margin, default=DEFAULT_MARGIN, metavar="PX", help="least distance of islands, in pixels"
    )
    unwrap.add_argument(
        "--texture-size", type=_texture_size, default=DEFAULT_TEXTURE_SIZE, metavar="PX", help="width of the texture"
    )
    unwrap.add_argument("--no-pack", action="store_true", help="centre the islands one upon the other")
    unwrap.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to write or make; default: the active")
    unwrap.add_argument("--report", type=Path, metavar="R.json", help="write figures of every chart")

    measure = commands.add_parser("measure", help="area error, shear, folds and overlap of the active UV maps")
    measure.set_defaults(run=run_measure)
    measure.add_argument("input", type=Path, metavar="IN", help=f"{formats} .off")
    measure.add_argument("--json", action="store_true", help="print the figures as JSON")
    return top


def _names(items) -> list[str]:
    return [identifier.lower() for identifier, *_ in items]


def _share(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return value


def _margin(text: str) -> float:
    value = float(text)
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of pixels")
    return value


def _texture_size(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of pixels")
    return value


def run_unwrap(options: argparse.Namespace) -> None:
    files, blender_mesh, blender_pack = _blender()
    from .packing import PackingError
    from .solver.progress import drain
    from .unwrapping import Refusal, lay_out

    if options.output.suffix.lower() not in files.WRITABLE:
        raise CommandError(f"{options.output}: unknown format. Use one of {' '.join(files.WRITABLE)}.")
    settings = Settings(
        boundary=options.boundary,
        quality=options.quality,
        balance=options.balance,
        margin=options.margin,
        texture_size=options.texture_size,
        pack=not options.no_pack,
    )
    pairs = _read(options.input, files, blender_mesh, options.uv_layer)
    objects = [obj for obj, _ in pairs]
    try:
        for obj in objects:
            blender_mesh.check_target(obj.data, options.uv_layer)
        layout = drain(
            lay_out([(r.surface, r.faces, r.pins) for _, r in pairs], settings, blender_pack.pack),
            _show_progress if sys.stderr.isatty() else None,
        )
        for obj, corners, uv in zip(objects, layout.corners, layout.uv, strict=True):
            blender_mesh.write_uv(obj, blender_mesh.target_layer(obj.data, options.uv_layer), corners, uv)
        warnings = files.save(options.output, objects)
    except Refusal as refusal:
        raise CommandError(f"{objects[refusal.index].name}: {refusal.error}") from refusal
    except (PackingError, blender_mesh.TargetError, files.FileError) as error:
        raise CommandError(str(error)) from error
    finally:
        if sys.stderr.isatty():
            print("\r\033[K", end="", file=sys.stderr)
    for index, text in dict.fromkeys(layout.warnings):
        warnings.append(f"{objects[index].name}: {text}" if index >= 0 else text)
    for text in warnings:
        print(f"{PROGRAM}: warning: {text}", file=sys.stderr)
    if options.report:
        _write_report(options, [obj.name for obj in objects], layout, warnings)


def run_measure(options: argparse.Namespace) -> None:
    files, blender_mesh, _ = _blender()
    from .measuring import measure_readings, summary
    from .solver.errors import MeshError

    try:
        figures = measure_readings([reading for _, reading in _read(options.input, files, blender_mesh)])
    except MeshError as error:
        raise CommandError(f"{options.input}: {error}") from error
    print(json.dumps(asdict(figures), indent=1) if options.json else summary(figures))


def _blender():
    """The modules that need Blender, which the help and a misspelt option do not."""
    from .quiet import silence

    try:
        with silence():
            from . import blender_mesh, blender_pack, files
    except ModuleNotFoundError as error:
        raise CommandError(f"{error}. Install bpy, numpy, scipy and xatlas, or run inside Blender.") from error
    return files, blender_mesh, blender_pack


def _read(path: Path, files, blender_mesh, layer: str = "") -> list:
    """Pairs of object and Reading of a UV layer (the active one by default) of all meshes with faces."""
    from .solver.errors import MeshError

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


def _show_progress(progress) -> None:
    print(f"\r\033[K{100 * progress.fraction:3.0f} % {progress.stage}", end="", file=sys.stderr, flush=True)


def _write_report(options: argparse.Namespace, names: list[str], layout, warnings: list[str]) -> None:
    charts = [
        {"object": name, "chart": k, **figures}
        for name, surface_map in zip(names, layout.maps, strict=True)
        for k, figures in enumerate(surface_map.report())
    ]
    packing = {"packer": layout.packing.packer, "scale": layout.packing.scale}
    if not options.no_pack:
        packing["coverage"] = layout.packing.coverage
    report = {
        "version": __version__,
        "input": str(options.input),
        "output": str(options.output),
        "boundary": options.boundary,
        "quality": options.quality,
        "balance": options.balance,
        "packing": packing,
        "charts": charts,
        "warnings": warnings,
    }
    try:
        options.report.write_text(json.dumps(report, indent=1) + "\n")
    except OSError as error:
        raise CommandError(f"{options.report}: {error.strerror}") from error
