"""One run after another of all commands and operators on bodies without symmetry, and all that is told and left."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator
from pathlib import Path

import bpy

import command_runs
import numpy as np
import scenes
import twin_scenes
from sphere_shapes import blob

DRAFT = {"quality": "DRAFT"}
MESHED = {"target_vertices": 40}
# Operator, objects, arguments.
OPERATORS: list[tuple[str, str, dict]] = [
    ("uv.omt_unwrap", "Closed Band", {**DRAFT, "max_shear": 1.25, "mark_seams": True}),
    ("uv.omt_unwrap", "Closed Cubes", {**DRAFT, "seams": "CHARTS", "margin": 8, "tile": 1012}),
    ("uv.omt_unwrap", "Band", {**DRAFT, "max_shear": 0.0, "fill_holes": True, "boundary": "RECTANGLE",
                               "corner_group": "corners"}),
    ("uv.omt_refine", "Closed Band", {**DRAFT, "pack": True}),
    ("uv.omt_magnify", "Band", {**DRAFT, "weight_group": "region", "source": "UV", "factor": 1.5}),
    ("uv.omt_magnify", "Smooth", {**DRAFT, "weight_group": "region", "source": "MESH", "factor": 2.0}),
    ("uv.omt_sphere", "Closed", {**DRAFT, "orientation": "GROUPS", "pole_group": "pole",
                                 "meridian_group": "meridian"}),
    ("uv.omt_sphere", "Closed Wall", {**DRAFT, "projection": "OCTAHEDRAL"}),
    ("uv.omt_seams", "Closed Band", {"max_shear": 1.25}),
    ("uv.omt_density_set", "Closed Band", {"density": 40.0, "scope": "ALL"}),
    ("uv.omt_density_get", "Closed Band", {"unit": "M"}),
    ("uv.omt_flow", "Closed", {"start": (0.5, 0.5), "move": (0.0, 0.1), "radius": 0.5}),
    ("uv.omt_stack", "Cubes", {}),
    ("uv.omt_symmetrize", "Cubes", {"halves": "STACKED"}),
    ("uv.omt_rectify", "Smooth", {}),
    ("uv.omt_measure", "Closed Band", {}),
    ("uv.omt_regions", "Closed Band", {"kind": "GROUPS"}),
    ("uv.omt_regions", "Closed", {"kind": "MATERIALS"}),
    ("uv.omt_worst", "Closed Band", {}),
    ("uv.omt_histogram", "Closed", {}),
    ("uv.omt_attributes", "Closed Band", {}),
    ("uv.omt_overlay", "Closed Band", {"show": "SHEAR"}),
    ("uv.omt_layout_image", "Closed Band", {"size": 32, "kind": "AREA"}),
    ("uv.omt_checker", "Closed", {"size": 256}),
    ("object.omt_weights", "Closed Band", {"kind": "GAUSSIAN", "show": False}),
    ("object.omt_remesh", "Closed", {**MESHED, "density": "CURVATURE", "levels": 2}),
    ("object.omt_remesh", "Band", {**MESHED, "density": "WEIGHTS", "weight_group": "region"}),
    ("object.omt_diagram", "Smooth", {"domain": "SQUARE"}),
    ("object.omt_distance", "Wall Closed", {}),
    ("object.omt_strain", "Wall Closed", {"of": "UV"}),
    ("object.omt_match", "Wall Closed", {"mode": "WRAP"}),
    ("object.omt_match", "Wall Closed", {}),
    ("object.omt_landmarks_suggest", "Wall Closed", {"most": 5, "prefix": "New"}),
    ("object.omt_flow", "Closed", {"rotate": (0.0, 0.0, 0.75), "frames": 3, "samples": 4}),
    ("mesh.omt_partition", "Closed Band", {"cells": 6, "relax": 1, "write": "ATTRIBUTE"}),
    ("mesh.omt_partition", "Closed", {"cells": 5, "relax": 0, "write": "MESH"}),
    ("mesh.omt_partition", "Closed Band", {"cells": 5, "relax": 0, "write": "POINTS", "capacity_group": "region"}),
    ("uv.omt_sphere", "Closed", {**DRAFT, "inside": True, "projection": "LAMBERT", "weight_group": "region"}),
    ("uv.omt_magnify", "Closed", {**DRAFT, "weight_group": "region", "source": "UV", "factor": 1.25,
                                  "further": "second=0.5"}),
    ("uv.omt_magnify", "Closed Band", {**DRAFT, "weight_group": "region", "source": "UV", "factor": 1.5,
                                       "cascade": 2}),
    *(("object.omt_volume", "Closed", {"tets": 150, "result": result, "shells": 2, "points": 40})
      for result in ("TETS", "SHELLS", "POINTS", "SLICE", "ATTRIBUTE")),
    ("object.omt_volume", "Closed Wall", {"tets": 150, "domain": "BODY", "body": "Wall"}),
    *(("object.omt_match", "Wall Closed", {"mode": mode}) for mode in ("MORPH", "CHECKER")),
    ("object.omt_landmarks_clear", "Wall Closed", {"prefix": "mark "}),
    ("object.omt_strain", "Wall Closed", {"of": "OBJECT"}),
    ("uv.omt_unwrap", "Smooth", {**DRAFT, "boundary": "DISK"}),
    ("uv.omt_unwrap", "Seamed", {**DRAFT, "max_shear": 1.25, "cut_further": True}),
    ("object.omt_diagram", "Closed", {"domain": "SPHERE"}),
    ("uv.omt_checker", "Closed", {"size": 256, "kind": "WORLD"}),
    ("uv.omt_checker", "Closed", {"size": 256, "kind": "CIRCLES"}),
    ("object.omt_weights", "Closed Band", {"kind": "SALIENCY", "low": 0.3, "invert": True}),
    ("object.omt_weights", "Closed Band", {"kind": "DISTANCE"}),
]  # fmt: skip


BLEND = ("in.blend", "two.blend")
PLAIN = ("plain.obj", "plain.ply", "plain.glb")
# Files that each command is called with, and words besides; what takes long is called once.
COMMANDS: list[tuple[str, tuple[str, ...], str]] = [
    ("unwrap", (*BLEND, *PLAIN), ""),
    ("unwrap", ("in.blend",), "--max-shear 1.25 --seams auto --mark-seams --udim 1012"),
    ("stack", (*BLEND, *PLAIN), ""),
    *((name, (*BLEND, "plain.obj"), "") for name in ("sphere", "refine", "flow")),
    ("sphere", ("in.blend",), "--projection octahedral --weights region --weight-factor 2"),
    ("flow", ("in.blend",), "--frames 2 --shape-key --inside ball"),
    ("magnify", BLEND, ""),
    ("magnify", ("two.blend",), "--no-exact --cascade 1 --factor 0.5"),
    ("weights", BLEND, "--low 0.3 --invert"),
    ("seams", BLEND, ""),
    ("measure", BLEND, ""),
    ("measure", ("two.blend",), "--json --beltrami"),
    ("measure", ("two.blend",), "--csv --regions groups"),
    ("measure", ("in.blend",), "--regions region --texture-size 512"),
    ("compare", ("in.blend",), "--csv"),
    ("remesh", ("in.blend",), ""),
    ("remesh", ("in.blend",), "--density curvature --levels 2"),
    *((name, BLEND, "") for name in ("symmetrize", "rectify", "queue", "test-texture", "diagram", "volume")),
    ("volume", ("in.blend",), "--domain cube"),
    ("diagram", ("in.blend",), "--domain rectangle --json"),
    ("match", ("in.blend",), ""),
    ("average", ("",), ""),
    ("average", ("",), "--scaled --score 1"),
    ("partition", BLEND, ""),
    ("partition", ("two.blend",), "--write points --relax 2"),
    ("distance", BLEND, ""),
    ("distance", ("in.blend",), "--json --points 90"),
    ("signature", BLEND, "--points 100"),
    ("library", ("",), "--points 100"),
    ("similar", BLEND, ""),
    ("similar", ("in.blend",), "--top 1"),
]
# What is read of the files that a command writes.
TEXTS = (".csv", ".json", ".obj", ".html", ".txt")


def prepare(folder: Path, run) -> None:
    """Files of twins and of commands, and plain ones; run: a command, words."""
    twin_scenes.prepare(folder)
    there = folder / "commands"
    there.mkdir()
    command_runs.prepare(run, there)
    # The second body is not like the first.
    scenes.open_empty()
    V, F = blob(1, seed=3)
    command_runs.body("other", at=0.5).data.vertices.foreach_set("co", (V * [0.9, 0.8, 1.1]).ravel())
    bpy.ops.wm.save_as_mainfile(filepath=str(there / "other.blend"))
    command_runs.body("in", at=5.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(there / "two.blend"))
    (there / "shapes" / "b.blend").write_bytes((there / "other.blend").read_bytes())
    (there / "index.npz").unlink()
    run("library", there / "shapes", "-o", there / "index.npz")
    bpy.ops.wm.open_mainfile(filepath=str(there / "in.blend"))
    bpy.ops.wm.obj_export(filepath=str(there / "plain.obj"), export_materials=False)
    bpy.ops.wm.ply_export(filepath=str(there / "plain.ply"), export_uv=True)
    bpy.ops.export_scene.gltf(filepath=str(there / "plain.glb"))


def text_of(path: Path):
    """What a file says, a report by its keys, of which seconds are let be; None for what is no text."""
    if path.suffix not in TEXTS:
        return None
    return json.loads(path.read_text()) if path.suffix == ".json" else path.read_text()


def left() -> dict:
    """All that twins compare, as texts and numbers that go on where a value changes a little."""
    found = {}
    for name, of in twin_scenes.left().items():
        for key, value in of.items():
            if isinstance(value, tuple) and isinstance(value[-1], bytes):
                kind = np.float32 if len(value[-1]) % 4 == 0 and "FLOAT" in str(value) else np.uint8
                value = [*value[:-1], np.frombuffer(value[-1], kind).astype(float)]
            elif isinstance(value, bytes):
                value = np.frombuffer(value, np.float32).astype(float)
            found[f"{name} {key}"] = value
    return found


def rows_of(summary) -> list:
    """The rows of a summary but for the time it took."""
    return [row for row in summary.rows if row[0] != "Time"]


def told(folder: Path, run, capfd) -> Iterator[tuple[str, object]]:
    """Names of runs, and what each printed, reported and left; run: a command, words."""
    summary = importlib.import_module("omt_uv.session.last_run").state
    for name, objects, arguments in OPERATORS:
        twin_scenes.begin(folder, objects)
        why, lines = twin_scenes.told(capfd, name, arguments)
        rows = rows_of(summary.summary) if summary.summary else []
        yield f"{name} {objects} {list(arguments.values())}", [why, lines, rows, left()]
    yield from commanded(folder, run, capfd, COMMANDS)


def commanded(folder: Path, run, capfd, commands) -> Iterator[tuple[str, object]]:
    """Names of runs of commands, as `COMMANDS` has them, and what each printed, wrote and left."""
    there = folder / "commands"
    given = {path: path.read_bytes() for path in there.iterdir() if path.is_file()}
    for name, files, more in commands:
        for file in files:
            for path in there.iterdir():
                if path.is_file() and path not in given:
                    path.unlink()
            words = [*command_runs.words(name, there, file), *more.split()]
            if file.startswith(("plain", "made")):
                suffix = Path(file).suffix
                words = [w.with_suffix(suffix) if isinstance(w, Path) and w.stem == "out" else w for w in words]
            scenes.open_empty()
            capfd.readouterr()
            status, printed = run(*words), list(capfd.readouterr())
            written = sorted(path for path in there.iterdir() if path.is_file() and path not in given)
            texts = [text_of(path) for path in written]
            if status == 0 and (there / "out.blend").exists():
                bpy.ops.wm.open_mainfile(filepath=str(there / "out.blend"))
            yield f"{name} {file} {more}".strip(), [status, printed, written, texts, left()]
