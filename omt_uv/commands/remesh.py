"""Make a new mesh of a chosen size for every mesh of a file, or a series of them: the command remesh."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path

from ..settings import DEFAULT_STRATEGY, STRATEGIES, RemeshSettings
from .common import (
    CommandError,
    UsageError,
    check_paths,
    drain_shown,
    refusals,
    require_blender,
    warn,
    write_figures,
    write_preview,
)
from .options import add_files, add_preview, angle, faces, names, number, positive, vertices
from .selection import read_file

KINDS = ("uniform", "curvature", "gaussian", "saliency")


def add(commands) -> None:
    command = commands.add_parser("remesh", help="new meshes of a chosen size, with triangles of even shape")
    command.set_defaults(run=run)
    add_files(command)
    count = command.add_mutually_exclusive_group(required=True)
    count.add_argument("--vertices", type=vertices, metavar="N", help="vertices of each new mesh")
    count.add_argument("--faces", type=faces, metavar="N", help="triangles of each new mesh")
    count.add_argument("--edge", type=positive, metavar="L", help="mean length of the edges")
    command.add_argument(
        "--density",
        default="uniform",
        metavar="D",
        help=f"{', '.join(KINDS)}, or the name of a vertex group or attribute",
    )
    command.add_argument(
        "--factor",
        type=number,
        metavar="M",
        help="density where the weight is 1 next to where it is 0, default 4; amount of curvature, default 1",
    )
    command.add_argument("--grading", type=_growth, default=0.0, metavar="G", help="most growth of edges per length")
    command.add_argument("--levels", type=_positive, default=1, metavar="K", help="make K meshes, OUT_LOD0 and so on")
    command.add_argument(
        "--ratio", type=_ratio, default=0.5, metavar="R", help="size of a level next to the one before"
    )
    command.add_argument("--strategy", choices=names(STRATEGIES), default=DEFAULT_STRATEGY.lower(), help="two maps")
    _add_features(command)
    add_preview(command)
    command.add_argument(
        "--report", type=Path, metavar="R.json", help="write figures of every new mesh beside the old one"
    )
    command.add_argument("--no-attributes", action="store_true", help="carry no UVs, groups, colours, shape keys")


def _add_features(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--sharp", type=angle, nargs="?", const=40.0, metavar="DEGREES", help="keep sharp edges, by default above 40"
    )
    command.add_argument("--no-boundary", action="store_true", help="smooth the boundary, and do not keep its corners")
    command.add_argument("--no-seams", action="store_true", help="do not keep seams and outlines of UV islands")
    command.add_argument("--no-materials", action="store_true", help="do not keep borders of materials")


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of meshes")
    return value


def _growth(text: str) -> float:
    value = number(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is no growth per length")
    return value


def _ratio(text: str) -> float:
    value = number(text)
    if not 0 < value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return value


def run(options: argparse.Namespace) -> None:
    require_blender()
    import bpy

    from ..blender.mesh import read
    from ..blender.remesh_objects import carried_attributes, carried_gate, lost, new_objects, read_request, source_of
    from ..files.verified import same_file
    from ..pipelines.remesh import remesh_series

    targets = _targets(options.output, options.levels)
    check_paths(options, targets or [options.output])
    if any(same_file(options.input, path) for path in targets):
        raise UsageError(f"{options.input}: the new mesh would replace the input. Give another name.")
    common = _settings(options)
    objects = [obj for obj, _ in read_file(options)]
    results = []
    for obj in objects:
        with refusals(name=obj.name):
            settings = replace(common, density=source_of(obj, common))
            request = read_request(obj, settings, weld=_is_split(options.input, obj))
            series = drain_shown(remesh_series(request.job, settings))
        results.append((obj, request, series, carried_attributes(request, series)))
    rows = _compared(objects, results) if options.report else []
    told, made = [], []
    by_hand = options.input.suffix.lower() == ".blend"
    for k, (obj, request, series, carried) in enumerate(results):
        told += [(k, text) for text in (*lost(obj, request, carried, by_hand), *series.warnings)]
        made.append(new_objects([obj], request, series, carried))
        found = [text for texts in carried_gate(obj, made[-1]) for text in texts]
        if found and options.strict:
            raise CommandError(f"{options.input}: {'; '.join(found)}. Nothing was written, as --strict asks.")
        told += [(-1, text) for text in found]
    lines = warn(objects, told, _save(options.output, made, options.input))
    if options.report:
        write_figures(options, {"levels": rows}, lines)
    if options.preview:
        # Of a series the coarsest: it differs most from what was given.
        shown = [bpy.data.objects[names[-1]] for names in made]
        write_preview(options, [(obj, read(obj)) for obj in shown])


def _compared(objects: list, results: list) -> list[dict]:
    """A row of figures for every level of every object, which is compared with what it was made of."""
    from ..solver.comparison.comparison_figures import compare

    rows = []
    for obj, (_, request, series, _) in zip(objects, results, strict=True):
        surface = request.job.surface
        old = (surface.positions, surface.corner_vertex[surface.triangles])
        for k, level in enumerate(series.levels):
            with refusals(name=obj.name):
                found = drain_shown(compare(old, (level.positions, level.triangles)))
            rows.append({"object": obj.name, "level": k, **vars(found)})
    return rows


def _is_split(path: Path, obj) -> bool:
    """Whether the file had to split vertices: glTF holds one normal and one UV for each, .ply one UV."""
    suffix = path.suffix.lower()
    return suffix in (".glb", ".gltf") or (suffix == ".ply" and len(obj.data.uv_layers) > 0)


def _settings(options: argparse.Namespace) -> RemeshSettings:
    counts = {"vertices": options.vertices, "faces": options.faces, "edge": options.edge}
    count_of = next(name for name, count in counts.items() if count is not None)
    known = options.density in KINDS
    return RemeshSettings(
        count_of=count_of,
        count=counts[count_of],
        density=options.density if known else "weights",
        factor=4.0 if options.factor is None else options.factor,
        amount=1.0 if options.factor is None else options.factor,
        source="" if known else options.density,
        grading=options.grading,
        preserve_boundary=not options.no_boundary,
        preserve_sharp=options.sharp is not None,
        sharp_angle=math.radians(options.sharp or 0.0),
        preserve_seams=not options.no_seams,
        preserve_materials=not options.no_materials,
        preserve_attributes=not options.no_attributes,
        levels=options.levels,
        ratio=options.ratio,
        strategy=options.strategy,
    )


def _save(path: Path, made: list[list[str]], source: Path) -> list[str]:
    """A .blend with everything in it; other files hold the new objects alone, every level a file of its own."""
    import bpy

    from ..files.saving import save

    if path.suffix.lower() == ".blend":
        return save(path, [], source)
    warnings: list[str] = []
    for k, target in enumerate(_targets(path, len(made[0]))):
        warnings += save(target, [bpy.data.objects[names[k]] for names in made])
    return list(dict.fromkeys(warnings))


def _targets(path: Path, levels: int) -> list[Path]:
    """Files that hold new meshes alone, one for every level; none for a .blend, which keeps the input."""
    if path.suffix.lower() == ".blend":
        return []
    return [path] if levels == 1 else [path.with_name(f"{path.stem}_LOD{k}{path.suffix}") for k in range(levels)]
