"""Take the mean of the shapes of a folder, and say where each is off: the command average."""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ... import __version__
from ...pipelines.shapes.choices import DEFAULT_PREFIX
from ..common import CommandError, UsageError, drain_shown, refusals, require_blender, warn_of
from ..options import number

READABLE = (".blend", ".obj", ".ply", ".stl", ".glb", ".fbx", ".off")
# A z-score beyond which a vertex is told of as off.
FAR = 3.0
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
    command.set_defaults(run=run, told=[], timeout=0.0, memory=0.0)
    command.add_argument("input", type=Path, metavar="DIR", help="folder with a mesh a file")
    command.add_argument("-o", "--output", type=Path, metavar="MEAN.blend", required=True, help=".blend")
    command.add_argument(
        "--landmarks", default=DEFAULT_PREFIX, metavar="PREFIX", help="landmarks of shapes that have other vertices"
    )
    command.add_argument("--scaled", action="store_true", help="make sizes alike first")
    command.add_argument("--score", type=number, default=FAR, metavar="Z", help="tell of vertices beyond, default 3")
    command.add_argument("--report", type=Path, metavar="R.json", help="write figures of every shape")


def run(options: argparse.Namespace) -> None:
    require_blender()
    from ...files.verified import check_writable

    if options.output.suffix.lower() != ".blend":
        raise UsageError(f"{options.output}: the mean and its attributes go into a .blend. Name one.")
    for path in filter(None, (options.output, options.report)):
        check_writable(path)
    if not options.input.is_dir():
        raise CommandError(f"{options.input}: there is no such folder")
    output = options.output.resolve()
    files = sorted(p for p in options.input.iterdir() if p.suffix.lower() in READABLE and p.resolve() != output)
    if len(files) < 2:
        raise CommandError(f"{options.input}: a mean needs two shapes or more. Put their files there.")
    shapes, surface, polygons = _registered(options, files)
    _write(options, shapes, surface, polygons)


def _registered(options: argparse.Namespace, files: list[Path]):
    """All shapes with the vertices of the first, its surface, and its polygons."""
    from ...pipelines.shapes.landmark_pairs import pairs_of
    from ...pipelines.shapes.match import MatchJob, match_surfaces
    from ...solver.registration.register import RegistrationOptions

    first, shapes, polygons = None, [], []
    for path in files:
        obj, surface, landmarks = _read(path, options.landmarks)
        if first is None:
            first, first_landmarks = surface, landmarks
            polygons = [list(polygon.vertices) for polygon in obj.data.polygons]
            shapes.append(Registered(path, obj.name, surface.positions, False))
            continue
        if _same_faces(first, surface):
            shapes.append(Registered(path, obj.name, surface.positions, False))
            continue
        with refusals(name=obj.name):
            pairs = pairs_of(first_landmarks, landmarks, (shapes[0].name, obj.name))
            job = MatchJob(first, surface, pairs, RegistrationOptions(), first.seams[:0])
            found = drain_shown(match_surfaces(job))
        shapes.append(Registered(path, obj.name, found.wrapped, True))
        for text in found.warnings:
            warn_of(f"{obj.name}: {text}")
    return shapes, first, polygons


def _read(path: Path, prefix: str):
    """The one mesh of a file, its surface and its landmarks."""
    from ...blender.mesh import read
    from ...blender.shapes.landmarks import read_landmarks
    from ...files.meshes import load

    objects = load(path)
    if len(objects) > 1:
        raise CommandError(f"{path}: it has several meshes. Join them.")
    with refusals(name=objects[0].name):
        surface = read(objects[0]).surface
    if not len(surface.triangles):
        raise CommandError(f"{path}: The mesh has no faces. Give files with faces.")
    return objects[0], surface, read_landmarks(objects[0], prefix) if prefix else []


def _same_faces(first, other) -> bool:
    """Whether two surfaces have the same polygons of the same vertices."""
    import numpy as np

    same = len(first.positions) == len(other.positions)
    same = same and np.array_equal(first.corner_vertex, other.corner_vertex)
    return bool(same and np.array_equal(first.face_start, other.face_start))


def _write(options: argparse.Namespace, shapes: list[Registered], surface, polygons: list[list[int]]) -> None:
    """The mean, and beside it every shape with its deviation and its scores."""
    import bpy

    import numpy as np

    from ...blender.mesh import new_mesh
    from ...files.saving import save
    from ...files.verified import write_text
    from ...solver.mesh.geometry import vertex_areas
    from ...solver.strain.collection import mean_shape

    triangles = surface.corner_vertex[surface.triangles]
    area = vertex_areas(surface.positions, triangles)
    found = mean_shape(np.array([shape.positions for shape in shapes]), area, options.scaled)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    width = 1.2 * float(np.ptp(found.mean, axis=0)[0])
    rows = [("Mean", found.mean, {DEVIATION: found.deviation})]
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
        print(f"{row['file']}: rms {row['rms']:.4g}, greatest z-score {row['greatest_score']:.1f}, "
              f"{row['vertices_beyond']} vertices beyond {options.score:g}")  # fmt: skip
    for text in warnings:
        warn_of(text)
    if options.report is not None:
        report = {"version": __version__, "shapes": table, "warnings": [*options.told, *warnings]}
        write_text(options.report, json.dumps(report, indent=1) + "\n")
