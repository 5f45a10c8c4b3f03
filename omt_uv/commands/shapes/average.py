"""Take the mean of the shapes of a folder, and say where each is off: the command average."""

from __future__ import annotations

import argparse
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ... import __version__
from ...batch.plan import READABLE
from ...pipelines.shapes.choices import DEFAULT_PREFIX
from ..common import CommandError, UsageError, check_paths, drain_shown, refusals, require_blender, warn, warn_of
from ..options import add_input, number
from ..selection import of_file, read_file

# A z-score beyond which a vertex is told of as off.
FAR = 3.0
MEAN = "Mean"
DEVIATION = "OMT Deviation"
SCORE = "OMT Z-Score"


@dataclass(frozen=True)
class Registered:
    """A shape with the vertices of the first one: file, name, positions (n,3), and whether it had to be matched."""

    path: Path
    name: str
    positions: Any
    matched: bool


def add(commands) -> None:
    command = commands.add_parser("average", help="the mean of a folder's shapes, and where each of them is off")
    command.set_defaults(run=run)
    add_input(command, "folder with a mesh a file", metavar="DIR")
    command.add_argument("-o", "--output", type=Path, metavar="MEAN.blend", required=True, help=".blend")
    command.add_argument(
        "--landmarks", default=DEFAULT_PREFIX, metavar="PREFIX", help="landmarks of shapes that have other vertices"
    )
    command.add_argument("--scaled", action="store_true", help="make sizes alike first")
    command.add_argument("--score", type=number, default=FAR, metavar="Z", help="tell of vertices beyond, default 3")
    command.add_argument("--report", type=Path, metavar="R.json", help="write figures of every shape")


def run(options: argparse.Namespace) -> None:
    require_blender()
    if options.output.suffix.lower() != ".blend":
        raise UsageError(f"{options.output}: the mean and its attributes go into a .blend. Name one.")
    check_paths(options)
    if not os.path.isdir(options.input):
        raise CommandError(f"{options.input}: there is no such folder")
    files = _shape_files(options)
    if len(files) < 2:
        raise CommandError(f"{options.input}: a mean needs two shapes or more. Put their files there.")
    shapes, surface, polygons = _registered(options, files)
    _write(options, shapes, surface, polygons)


def _shape_files(options: argparse.Namespace) -> list[Path]:
    """The files of the shapes, without a mean that was written there before.

    Raises
    ------
    UsageError : a file that is written is one of the shapes
    """
    import bpy

    from ...files.verified import same_file

    files = sorted(path for path in options.input.iterdir() if path.suffix.lower() in READABLE)
    for path in [path for path in files if same_file(path, options.output)]:
        try:
            with bpy.data.libraries.load(str(path)) as (there, _):
                is_mean = MEAN in there.objects
        except OSError:
            is_mean = False
        if not is_mean:
            raise UsageError(f"OUT and {path} of DIR are one file. Give the mean a name of its own.")
        files.remove(path)
    if options.report is not None and any(same_file(path, options.report) for path in files):
        raise UsageError(f"--report and a shape of {options.input} are one file. Give each a name of its own.")
    return files


def _registered(options: argparse.Namespace, files: list[Path]):
    """All shapes with the vertices of the first, its surface, and its polygons."""
    from ...pipelines.shapes.landmark_pairs import pairs_of
    from ...pipelines.shapes.match import MatchJob
    from ...pipelines.shapes.strain import same_polygons
    from ...pipelines.shapes.wrap import wrap_surfaces
    from ...solver.registration.results import RegistrationOptions

    first, shapes, polygons = None, [], []
    for path in files:
        obj, surface, landmarks = _read(options, path)
        if first is None:
            first, first_landmarks = surface, landmarks
            polygons = [list(polygon.vertices) for polygon in obj.data.polygons]
            shapes.append(Registered(path, obj.name, surface.positions, False))
            continue
        if same_polygons(first, surface):
            shapes.append(Registered(path, obj.name, surface.positions, False))
            continue
        with refusals(name=obj.name):
            pairs = pairs_of(first_landmarks, landmarks, (shapes[0].name, obj.name))
            job = MatchJob(first, surface, pairs, RegistrationOptions(), first.seams[:0])
            found = drain_shown(wrap_surfaces(job))
        shapes.append(Registered(path, obj.name, found.wrapped, True))
        options.told += warn([obj], [(0, text) for text in found.warnings], [])
    return shapes, first, polygons


def _read(options: argparse.Namespace, path: Path):
    """The one mesh of a file, its surface and its landmarks."""
    from ...blender.shapes.landmarks import read_landmarks

    pairs = read_file(of_file(options, path))
    if len(pairs) > 1:
        every = ", ".join(obj.name for obj, _ in pairs)
        raise CommandError(f"{path}: it has several meshes: {every}. Join them, or name one by --object.")
    obj, reading = pairs[0]
    return obj, reading.surface, read_landmarks(obj, options.landmarks) if options.landmarks else []


def _write(options: argparse.Namespace, shapes: list[Registered], surface, polygons: list[list[int]]) -> None:
    """The mean, and beside it every shape with its deviation and its scores."""
    import bpy

    import numpy as np

    from ...blender.mesh import new_mesh
    from ...blender.versions import open_empty
    from ...files.saving import save
    from ...files.verified import write_text
    from ...solver.mesh.geometry import vertex_areas
    from ...solver.strain.collection import mean_shape

    triangles = surface.corner_vertex[surface.triangles]
    area = vertex_areas(surface.positions, triangles)
    found = mean_shape(np.array([shape.positions for shape in shapes]), area, options.scaled)
    open_empty()
    width = 1.2 * float(np.ptp(found.mean, axis=0)[0])
    rows = [(MEAN, found.mean, {DEVIATION: found.deviation})]
    rows += [
        (shape.path.stem, found.aligned[k], {DEVIATION: found.distance[k], SCORE: found.score[k]})
        for k, shape in enumerate(shapes)
    ]
    for k, (name, positions, values) in enumerate(rows):
        mesh = new_mesh(name, positions.tolist(), polygons)
        for title, value in values.items():
            mesh.attributes.new(title, "FLOAT", "POINT").data.foreach_set("value", value.astype(np.float32))
        obj = bpy.data.objects.new(name, mesh)
        obj.location.x = k * width
        bpy.context.scene.collection.objects.link(obj)
    warnings = save(options.output, [], shapes[0].path)
    table = [
        {
            "file": str(shape.path),
            "matched": shape.matched,
            "rms": float(np.sqrt((found.distance[k] ** 2).mean())),
            "greatest": float(found.distance[k].max()),
            "greatest_score": float(found.score[k].max()),
            "vertices_beyond": int((found.score[k] > options.score).sum()),
        }
        for k, shape in enumerate(shapes)
    ]
    for row in table:
        judged = (
            f"greatest z-score {row['greatest_score']:.1f}, {row['vertices_beyond']} vertices beyond {options.score:g}"
        )
        print(f"{row['file']}: rms {row['rms']:.4g}, {judged if len(table) > 2 else 'no z-scores of two shapes'}")
    for text in warnings:
        warn_of(text)
    if options.report is not None:
        report = {"version": __version__, "shapes": table, "warnings": [*options.told, *warnings]}
        write_text(options.report, json.dumps(report, indent=1) + "\n")
