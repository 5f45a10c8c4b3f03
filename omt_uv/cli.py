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
    DEFAULT_SEAMS,
    DEFAULT_TEXTURE_SIZE,
    QUALITIES,
    SEAMS,
    RefineSettings,
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
    unwrap.add_argument("--seams", choices=_names(SEAMS), default=DEFAULT_SEAMS.lower(), help="where islands are cut")
    _add_cut_options(unwrap)
    unwrap.add_argument(
        "--max-shear", type=_shear, default=0.0, metavar="S", help="cut further until the mean shear is below S > 1"
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

    refine = commands.add_parser("refine", help="improve existing UVs of every mesh, whatever unwrapped them")
    refine.set_defaults(run=run_refine)
    refine.add_argument("input", type=Path, metavar="IN", help=f"{formats}, with UVs")
    refine.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=formats)
    refine.add_argument(
        "--balance", type=_share, default=DEFAULT_BALANCE, metavar="T", help="from 0, exact areas, to 1, least shear"
    )
    refine.add_argument(
        "--quality", choices=_names(QUALITIES), default=DEFAULT_QUALITY.lower(), help="how exact the areas become"
    )
    refine.add_argument("--keep-boundary", action="store_true", help="leave the outline of every island as it is")
    refine.add_argument("--uv-layer", default="", metavar="NAME", help="UV map to refine; default: the active one")
    refine.add_argument("--report", type=Path, metavar="R.json", help="write figures of every island")

    seams = commands.add_parser("seams", help="mark the seams that unwrapping needs, and stop")
    seams.set_defaults(run=run_seams)
    seams.add_argument("input", type=Path, metavar="IN", help=f"{formats} .off")
    seams.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help=".blend, which keeps seams")
    _add_cut_options(seams)

    measure = commands.add_parser("measure", help="area error, shear, folds and overlap of the active UV maps")
    measure.set_defaults(run=run_measure)
    measure.add_argument("input", type=Path, metavar="IN", help=f"{formats} .off")
    measure.add_argument("--json", action="store_true", help="print the figures as JSON")
    return top


def _add_cut_options(command: argparse.ArgumentParser) -> None:
    command.add_argument("--fill-holes", action="store_true", help="take all holes but the longest boundary for filled")
    command.add_argument("--keep-free", default="", metavar="GROUP", help="vertex group that new cuts avoid")


def _shear(text: str) -> float:
    value = float(text)
    if not 1 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not greater than 1, which is no shear")
    return value


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
    from .blender_seams import GroupError, avoided
    from .packing import PackingError
    from .unwrapping import Job, Refusal, lay_out

    _check_output(options.output, files)
    settings = Settings(
        boundary=options.boundary,
        quality=options.quality,
        balance=options.balance,
        margin=options.margin,
        texture_size=options.texture_size,
        pack=not options.no_pack,
        seams=options.seams,
        fill_holes=options.fill_holes,
        max_shear=options.max_shear,
    )
    pairs = _read(options.input, files, blender_mesh, options.uv_layer)
    objects = [obj for obj, _ in pairs]
    try:
        for obj in objects:
            blender_mesh.check_target(obj.data, options.uv_layer)
        free = avoided(objects, options.keep_free)
        jobs = [Job(r.surface, r.faces, r.pins, avoid) for (_, r), avoid in zip(pairs, free, strict=True)]
        layout = _drain(lay_out(jobs, settings, blender_pack.pack))
        for obj, corners, uv in zip(objects, layout.corners, layout.uv, strict=True):
            blender_mesh.write_uv(obj, blender_mesh.target_layer(obj.data, options.uv_layer), corners, uv)
        warnings = files.save(options.output, objects)
    except Refusal as refusal:
        raise CommandError(f"{objects[refusal.index].name}: {refusal.error}") from refusal
    except (PackingError, GroupError, blender_mesh.TargetError, files.FileError) as error:
        raise CommandError(str(error)) from error
    warnings = _warn(objects, layout.warnings, warnings)
    if options.report:
        charts = [surface_map.report() for surface_map in layout.maps]
        packing = {"packer": layout.packing.packer, "scale": layout.packing.scale}
        if not options.no_pack:
            packing["coverage"] = layout.packing.coverage
        _write_report(options, {"boundary": options.boundary, "packing": packing}, objects, charts, warnings)


def run_seams(options: argparse.Namespace) -> None:
    files, blender_mesh, _ = _blender()
    from .blender_seams import GroupError, avoided, mark_seams
    from .solver.cutting import cut
    from .solver.errors import MeshError

    if options.output.suffix.lower() != ".blend":
        raise CommandError(f"{options.output}: only .blend files keep seams. Write one of these.")
    pairs = _read(options.input, files, blender_mesh)
    objects = [obj for obj, _ in pairs]
    told = []
    try:
        free = avoided(objects, options.keep_free)
        for k, ((obj, reading), avoid) in enumerate(zip(pairs, free, strict=True)):
            cuts = cut(reading.surface, reading.faces, avoid=avoid, fill=options.fill_holes)
            told += [(k, text) for text in cuts.warnings]
            mark_seams(obj, cuts.edges)
            print(f"{obj.name}: {len(cuts.edges)} edges of seam, {cuts.length:.4g} long")
        warnings = files.save(options.output, objects)
    except MeshError as error:
        raise CommandError(f"{obj.name}: {error}") from error
    except (GroupError, files.FileError) as error:
        raise CommandError(str(error)) from error
    _warn(objects, told, warnings)


def run_refine(options: argparse.Namespace) -> None:
    files, blender_mesh, _ = _blender()
    from .refining import refine_islands
    from .unwrapping import Refusal

    _check_output(options.output, files)
    pairs = _read(options.input, files, blender_mesh, options.uv_layer)
    objects = [obj for obj, _ in pairs]
    for obj in objects:
        if options.uv_layer and options.uv_layer not in obj.data.uv_layers:
            raise CommandError(f"{obj.name} has no UV map {options.uv_layer!r}. Name one that it has.")
    settings = RefineSettings(quality=options.quality, balance=options.balance, keep_boundary=options.keep_boundary)
    try:
        for obj in objects:
            blender_mesh.check_target(obj.data, options.uv_layer)
        refined = _drain(refine_islands([(r.surface, r.faces, r.all_pins) for _, r in pairs], settings))
        for obj, corners, uv in zip(objects, refined.corners, refined.uv, strict=True):
            blender_mesh.write_uv(obj, blender_mesh.target_layer(obj.data, options.uv_layer), corners, uv)
        warnings = files.save(options.output, objects)
    except Refusal as refusal:
        raise CommandError(f"{objects[refusal.index].name}: {refusal.error}") from refusal
    except (blender_mesh.TargetError, files.FileError) as error:
        raise CommandError(str(error)) from error
    warnings = _warn(objects, refined.warnings, warnings)
    if options.report:
        _write_report(options, {"keep_boundary": options.keep_boundary}, objects, refined.reports, warnings)


def _check_output(path: Path, files) -> None:
    if path.suffix.lower() not in files.WRITABLE:
        raise CommandError(f"{path}: unknown format. Use one of {' '.join(files.WRITABLE)}.")


def _drain(steps):
    """The result of a solver; a terminal shows its progress."""
    from .solver.progress import drain

    shown = sys.stderr.isatty()
    try:
        return drain(steps, _show_progress if shown else None)
    finally:
        if shown:
            print("\r\033[K", end="", file=sys.stderr)


def _warn(objects: list, solver_warnings: list[tuple[int, str]], warnings: list[str]) -> list[str]:
    """Print and return the warnings of the writer and of the solver, each once."""
    told = list(warnings)
    for index, text in dict.fromkeys(solver_warnings):
        told.append(f"{objects[index].name}: {text}" if index >= 0 else text)
    for text in told:
        print(f"{PROGRAM}: warning: {text}", file=sys.stderr)
    return told


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


def _write_report(options: argparse.Namespace, more: dict, objects: list, charts: list, warnings: list[str]) -> None:
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
