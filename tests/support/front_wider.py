"""Runs of commands and operators that `front_runs` has not: objects that are edited, choices seldom taken, files of all
formats, broken and refused ones, many files at once, and operators in a window."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

import front_runs
import numpy as np
import scenes
import twin_scenes
from broken_meshes import broken_mesh
from fbx_bytes import file_of, scene
from mesh_bytes import QUADS, glb_bytes, gltf_parts, imported, imported_triangles, mutants, obj_bytes, ply_bytes, spread
from windows import Window, event

DRAFT = {"quality": "DRAFT"}
MESHED = {"target_vertices": 40}
EDITED = "edited: "
FORMS = ("ascii", "binary_little_endian", "binary_big_endian")
# As those of `front_runs`; of what is edited, some faces are selected.
OPERATORS: list[tuple[str, str, dict]] = [
    ("uv.omt_unwrap", f"{EDITED}Closed Band", {**DRAFT, "max_shear": 0.0, "mark_seams": True, "keep_free": "second"}),
    ("uv.omt_unwrap", f"{EDITED}Cubes", {**DRAFT, "balance": 0.4}),
    ("uv.omt_refine", f"{EDITED}Closed Band", DRAFT),
    ("uv.omt_refine", "Smooth", DRAFT),
    ("uv.omt_magnify", f"{EDITED}Band", {**DRAFT, "weight_group": "region", "source": "UV", "factor": 1.5}),
    ("uv.omt_magnify", "Closed", {**DRAFT, "region": "ATTRIBUTE", "attribute": "height", "source": "UV",
                                  "factor": 1.5}),
    ("uv.omt_sphere", f"{EDITED}Closed", {**DRAFT, "fill_holes": True}),
    ("uv.omt_seams", f"{EDITED}Closed Band", {"max_shear": 0.0, "keep_free": "region"}),
    *(("uv.omt_density_set", f"{EDITED}Closed Band", {"density": 30.0, "scope": scope})
      for scope in ("ISLANDS", "ALL")),
    ("uv.omt_stack", f"{EDITED}Cubes", {}),
    ("uv.omt_symmetrize", f"{EDITED}Cubes", {"halves": "APART"}),
    ("uv.omt_rectify", f"{EDITED}Smooth", {}),
    ("uv.omt_measure", f"{EDITED}Closed Band", {}),
    ("uv.omt_worst", f"{EDITED}Closed Band", {"share": 20.0}),
    ("uv.omt_regions", "Closed", {"kind": "ATTRIBUTE", "attribute": "height"}),
    ("uv.omt_flow", f"{EDITED}Closed", {"start": (0.5, 0.5), "move": (0.0, 0.1), "radius": 0.5}),
    ("uv.omt_layout_image", "Closed Cubes", {"size": 48, "kind": "SHEAR"}),
    *(("object.omt_weights", "Closed Band", {"kind": kind, "show": True}) for kind in ("MEAN", "SHARPNESS")),
    *(("object.omt_remesh", "Closed", {**MESHED, "density": kind}) for kind in ("GAUSSIAN", "SALIENCY")),
    ("object.omt_remesh", "Closed", {**MESHED, "density": "ATTRIBUTE", "density_attribute": "height",
                                     "grading": 0.5}),
    ("object.omt_remesh", "Closed", {"count_of": "FACES", "target_faces": 90, "strategy": "CFP-APP",
                                     "use_preserve_sharp": True, "sharp_angle": 0.3}),
    ("object.omt_remesh", "Smooth", {"count_of": "EDGE", "edge_length": 0.3, "use_modifiers": True,
                                     "preserve_attributes": False, "use_preserve_boundary": False}),
    *(("mesh.omt_partition", "Closed Band", {"cells": 6, "relax": 1, "write": kind})
      for kind in ("FACE_SETS", "MATERIALS", "SEAMS")),
    ("object.omt_flow", "Closed", {"move": (0.0, 0.1, 0.2), "walls": "BALL", "path": "BLEND", "result": "MESH"}),
    ("object.omt_flow", "Closed", {"move": (0.1, 0.0, 0.0), "walls": "MESH", "wall_object": "Wall",
                                   "keep_group": "second", "samples": 4}),
    ("object.omt_volume", "Closed", {"tets": 150, "method": "FLOW", "domain": "CUBE", "result": "SLICE", "axis": "Z"}),
    ("object.omt_match", "Closed Wall", {"mode": "TRANSFER", "transfer": {"UV", "MATERIALS"}, "mirrored": True}),
    ("object.omt_match", "Wall Closed", {"mode": "WRAP", "shape_key": "Mine", "use_polish": False, "balance": 0.9}),
    *(("object.omt_similar", "Closed Wall Seamed", {"select": kind, "bound": 2.0})
      for kind in ("DUPLICATES", "NEAREST")),
    ("object.omt_similar", "Closed Wall", {"centre_group": "pole", "start_group": "meridian", "select": "NOTHING"}),
    ("uv.omt_queue", "Closed Band Cubes", {"limit": 0.0}),
    ("uv.omt_checker_remove", "Closed", {}),
    *(("uv.omt_remedy", "Closed Band", {"action": kind}) for kind in ("MERGE", "NORMALS", "DISSOLVE", "CUT_FURTHER")),
    ("uv.omt_remedy", "Smooth", {"action": "APPLY_LEVEL"}),
    ("object.omt_compare", "Closed Wall", {}),
    # What is refused, or told of: the second of two is none, a group that is not there, a body that is open.
    ("uv.omt_unwrap", "Closed Band", {**DRAFT, "boundary": "RECTANGLE", "corner_group": "nowhere"}),
    ("uv.omt_unwrap", "Closed Band", {**DRAFT, "keep_free": "nowhere"}),
    ("uv.omt_sphere", "Closed Band", DRAFT),
    ("uv.omt_sphere", "Closed Wall", {**DRAFT, "orientation": "GROUPS", "pole_group": "pole",
                                      "meridian_group": "meridian"}),
    ("uv.omt_magnify", "Closed Smooth", {**DRAFT, "weight_group": "second", "source": "UV"}),
    ("object.omt_remesh", "Closed Smooth", {**MESHED, "density": "WEIGHTS", "weight_group": "second"}),
    ("object.omt_remesh", "Closed Band", {**MESHED, "density": "ATTRIBUTE", "density_attribute": "height"}),
    ("object.omt_match", "Wall Band", {}),
    ("object.omt_match", "Closed", {}),
    ("object.omt_volume", "Closed Band", {"tets": 150}),
    ("object.omt_distance", "Closed Band", {}),
    ("object.omt_strain", "Closed Band", {"of": "OBJECT"}),
    ("object.omt_flow", "Closed", {"handles": "EMPTIES"}),
    ("object.omt_flow", "Closed", {"handles": "GROUPS"}),
    ("mesh.omt_partition", "Closed Band", {"cells": 5, "relax": 0, "capacity_group": "nowhere"}),
    ("uv.omt_regions", "Closed Band", {"kind": "ATTRIBUTE", "attribute": "nowhere"}),
]  # fmt: skip

COMMANDS: list[tuple[str, tuple[str, ...], str]] = [
    *(("unwrap", (f"made{suffix}",), "") for suffix in (".obj", ".glb", ".gltf", "_inside.gltf", ".off", ".stl")),
    *(("unwrap", (f"made_{form}.ply",), "") for form in FORMS),
    ("stack", ("made.fbx",), ""),
    ("compare", ("in.blend",), "--beltrami"),
    ("measure", ("two.blend",), "--regions materials --csv"),
    ("seams", ("two.blend",), "--max-shear 1.2"),
    ("match", ("in.blend",), "--wrap --balance 0.8"),
    ("flow", ("in.blend",), "--path straight --keep region"),
    ("remesh", ("in.blend",), "--strategy cfp-cfp --grading 0.4"),
    ("remesh", ("in.blend",), "--density gaussian --levels 2 --ratio 0.6"),
    ("volume", ("in.blend",), "--method flow"),
    ("distance", ("in.blend",), "--markers 0,5"),
    ("signature", ("in.blend",), "--markers 0,5 --points 90"),
    # What is refused.
    *((name, ("in.blend",), "--object nowhere") for name in ("unwrap", "measure", "sphere", "match", "volume")),
    *((name, ("two.blend",), "--strict --skip-linked") for name in ("unwrap", "seams", "partition")),
    ("distance", ("two.blend",), "--markers 0,1"),
    ("distance", ("in.blend",), "--markers 0,900"),
    ("flow", ("in.blend",), "--keep nowhere"),
    ("magnify", ("in.blend",), "--weights nowhere"),
    ("measure", ("in.blend",), "--shape-key Smile"),
    ("partition", ("in.blend",), "--capacity nowhere"),
]
# Broken files of each kind.
BROKEN = 18

# Meshes of `broken_meshes` that operators are given.
MESHES = range(12)
# What two bodies are solved by in a window, in single steps.
WINDOWED = {
    "uv.omt_unwrap": {**DRAFT, "balance": 0.5},
    "uv.omt_refine": DRAFT,
    "uv.omt_magnify": {**DRAFT, "weight_group": "region", "factor": 2.0},
    "uv.omt_seams": {},
    "object.omt_remesh": MESHED,
    "uv.omt_queue": {},
}


def prepare(folder: Path, run) -> None:
    """Files of `front_runs`, and some of all formats; run: a command, words."""
    front_runs.prepare(folder, run)
    there = folder / "commands"
    (there / "made.obj").write_bytes(obj_bytes())
    (there / "made.glb").write_bytes(glb_bytes(shared=True))
    for name, embedded in (("made", False), ("made_inside", True)):
        text, raw = gltf_parts(2, embedded)
        (there / f"{name}.gltf").write_bytes(text)
        (there / "cu be.bin").write_bytes(raw)
    for form in FORMS:
        (there / f"made_{form}.ply").write_bytes(ply_bytes(form, corners=form != "ascii"))
    (there / "made.off").write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1.5 0\n0 0 2\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n")
    bpy.ops.wm.open_mainfile(filepath=str(there / "in.blend"))
    bpy.ops.wm.stl_export(filepath=str(there / "made.stl"))
    bpy.ops.export_scene.fbx(filepath=str(there / "made.fbx"))


def _began(folder: Path, objects: str) -> None:
    """Open the file with objects selected, and edited with some of their faces where that is said."""
    twin_scenes.begin(folder, objects.removeprefix(EDITED))
    if objects.startswith(EDITED):
        chosen = [bpy.data.objects[name] for name in objects.removeprefix(EDITED).split()]
        scenes.edit(*chosen, faces=range(3))


def operated(folder: Path, capfd) -> Iterator[tuple[str, object]]:
    """What operators report and leave."""
    for name, objects, arguments in OPERATORS:
        _began(folder, objects)
        try:
            told = [twin_scenes.told(capfd, name, arguments), _rows()]
        except TypeError as error:
            raise AssertionError((name, arguments)) from error
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        yield f"{name} {objects} {list(arguments.values())}", [told, front_runs.left()]


def _rows() -> list:
    summary = importlib.import_module("omt_uv.session.last_run").state.summary
    return [front_runs.rows_of(summary), summary.notices] if summary else []


def on_broken_meshes(capfd) -> Iterator[tuple[str, object]]:
    """What operators tell of a body beside one that is broken, in each order."""
    for k in MESHES:
        surface = broken_mesh(k)[0]
        for name, more in (("uv.omt_unwrap", DRAFT), ("uv.omt_measure", {}), ("uv.omt_remedy", {"action": "MERGE"})):
            scenes.open_empty()
            good = scenes.bump(4, 3, 0.6, "Good")
            faces = np.split(surface.corner_vertex, surface.face_start[1:-1])
            points = np.nan_to_num(surface.positions, nan=0.0, posinf=1e3, neginf=-1e3)
            bad = scenes.add(points, [face.tolist() for face in faces if len(face)], "Bad")
            scenes.select([good, bad] if k % 2 else [bad, good])
            yield f"{name} on a broken mesh {k}", [twin_scenes.told(capfd, name, more), _rows()]


def _putting(there: Path) -> Iterator[tuple[str, bytes, Callable[[bytes], object]]]:
    """Kinds of files, one of each, and what puts UVs into its bytes, or reads them, without Blender."""
    own = importlib.import_module("omt_uv.files.in_place").__name__
    obj, ply, glb, gltf, plain = (
        importlib.import_module(f"{own}.{name}") for name in ("obj", "ply", "glb", "gltf", "plain_obj")
    )
    headers, off = (importlib.import_module(f"omt_uv.files.formats.{name}") for name in ("headers", "off"))
    fbx = importlib.import_module("omt_uv.files.fbx_nodes")

    def of_file(suffix: str, read: Callable[[Path], object]) -> Callable[[bytes], object]:
        path = there / f"broken{suffix}"
        return lambda data: [path.write_bytes(data), read(path)]

    quads = [imported(QUADS, spread(24))]
    yield "obj", obj_bytes(), lambda data: obj.put(data, quads)
    yield "obj read", (there / "plain.obj").read_bytes(), of_file(".obj", plain.read_plain)
    for form in FORMS:
        yield form, ply_bytes(form), lambda data: ply.put(data, quads)
        yield f"{form} of vertices", ply_bytes(form, corners=False), lambda data: ply.put(data, quads)
    for shared in (False, True):
        triangles = [imported_triangles(spread(36), shared)]
        yield f"glb {shared}", glb_bytes(shared), lambda data, given=triangles: glb.put(data, given)
    triangles = [imported_triangles(spread(36))]
    for embedded in (False, True):
        text = gltf_parts(None, embedded)[0]
        yield f"gltf {embedded}", text, lambda data: gltf.put(data, triangles, there, there / "out.gltf")
    for suffix, whole in ((".glb", glb_bytes()), (".ply", ply_bytes()), (".gltf", gltf_parts(None, True)[0]),
                          (".stl", (there / "made.stl").read_bytes())):  # fmt: skip
        yield f"header {suffix}", whole, of_file(suffix, headers.check_header)
    yield "off", (there / "made.off").read_bytes(), of_file(".off", off.read_off)
    for long in (False, True):
        yield f"fbx {long}", file_of(long, scene(long)), fbx.count


def on_broken_files(there: Path) -> Iterator[tuple[str, object]]:
    """What comes of files with bytes changed, or which error."""
    for name, whole, put in _putting(there):
        told: list[object] = []
        for data in [whole, b"", *mutants(whole, BROKEN)]:
            try:
                told.append(put(data))
            except Exception as error:  # noqa: BLE001, which one it is counts
                told.append(error)
        yield f"broken {name}", told


def of_many(there: Path, run, capfd) -> Iterator[tuple[str, object]]:
    """Many files at once, and what is told of them afterwards; one of them is none."""
    (there / "many").mkdir()
    for name in ("a.obj", "sub.obj"):
        (there / "many" / name).write_bytes((there / "plain.obj").read_bytes())
    (there / "many" / "bad.obj").write_text("v 0 0 0\n")
    out = there / "many out"
    for words in (
        ["batch", "unwrap", there / "many", "-o", out, "--jobs", "1", "--", "--quality", "draft", "--max-shear", "0"],
        ["table", out],
        ["summary", out],
        ["summary", out, "--json"],
        ["page", out],
        ["distances", there / "index.npz", "-o", there / "far.csv", "--picture", there / "far.png"],
        ["distances", there / "shapes", "-o", there / "far2.csv", "--points", "80", "--mds", there / "far2.png"],
    ):
        capfd.readouterr()
        status = run(*words)
        yield " ".join(str(word).rpartition("/")[2] for word in words[:2]), [status, list(capfd.readouterr())]
    yield "far.csv", [(there / name).read_text() for name in ("far.csv", "far2.csv")]


def in_a_window(folder: Path) -> Iterator[tuple[str, object]]:
    """What operators tell in a window, which somebody else lets stand in for Blender's, step by step, and where they
    are let be; what the slider moves."""
    for name, settings in WINDOWED.items():
        for most in (10_000, 3):
            twin_scenes.begin(folder, "Closed Band" if name != "uv.omt_magnify" else "Band")
            window, operator, k = Window("VIEW_3D"), scenes.stand_in(name, **settings), 0
            state = operator.invoke(window, event("LEFTMOUSE"))
            while not state & {"FINISHED", "CANCELLED"}:
                k += 1
                state = operator.modal(window, event("TIMER" if k != most else "ESC"))
            told = [text for _, text in operator.reports]
            yield f"{name} in a window {most}", [sorted(state), told, front_runs.left()]
    for key in ("RET", "ESC"):
        twin_scenes.begin(folder, "Band")
        slider = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
        operator = scenes.stand_in("uv.omt_live", pack=key == "RET")
        operator.begin(bpy.context)
        for balance in (0.2, 0.9):
            slider.balance = balance
            for _ in range(4):
                operator.modal(bpy.context, event("TIMER", "NOTHING"))
        operator.modal(bpy.context, event(key))
        slider.property_unset("balance")
        yield f"uv.omt_live {key}", [[text for _, text in operator.reports], front_runs.left()]


def told(folder: Path, run, capfd) -> Iterator[tuple[str, object]]:
    """Names of runs, and what each told and left; run: a command, words."""
    there = folder / "commands"
    yield from operated(folder, capfd)
    yield from front_runs.commanded(folder, run, capfd, COMMANDS)
    yield from on_broken_meshes(capfd)
    yield from on_broken_files(there)
    yield from of_many(there, run, capfd)
