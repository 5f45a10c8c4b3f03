"""Runs of commands and operators that neither `front_runs` nor `front_wider` has: objects with all that a mesh may
hold, scaled unevenly, some of them edited as a whole; operators one after another, of which one undoes what another
did; pictures that are warped; drags; and commands with files and words seldom given."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator
from pathlib import Path

import bpy

import bmesh
import command_runs
import dressed_bodies
import front_runs
import numpy as np
import scenes
import twin_scenes
from mathutils import Matrix
from sphere_shapes import blob

DRAFT = {"quality": "DRAFT"}
MESHED = {"target_vertices": 60}
EDITED = "edited: "
REGION = {"weight_group": "painted", "source": "UV", "factor": 1.6}
ALL_KINDS = {"UV", "GROUPS", "COLOURS", "SHAPE_KEYS", "FACE_SETS", "MATERIALS"}
# Objects, and operators one after the other with their arguments.
SEQUENCES: list[tuple[str, list[tuple[str, dict]]]] = [
    ("One Two", [("uv.omt_overlay", {"show": "AREA"}), ("uv.omt_overlay", {"show": "SHEAR"}),
                 ("uv.omt_overlay", {"show": "NONE"})]),
    (f"{EDITED}One", [("uv.omt_overlay", {"show": "AREA"}), ("uv.omt_overlay", {"show": "NONE"})]),
    ("One Two", [("uv.omt_checker", {"kind": "CIRCLES", "size": 256}), ("uv.omt_checker", {"size": 256})]),
    ("One Bare", [("uv.omt_checker", {"size": 256}), ("uv.omt_checker_remove", {})]),
    *((f"{EDITED}{name}", [("uv.omt_seams", {"max_shear": 0.0})]) for name in ("One Two", "Bare")),
    (f"{EDITED}One", [("object.omt_weights", {"kind": "GAUSSIAN", "weight_group": "painted"})]),
    ("Two", [("object.omt_weights", {"kind": "SALIENCY", "weight_group": "new", "low": 0.2, "high": 0.7})]),
    *((f"{EDITED}Bare One", [("mesh.omt_partition", {"cells": 5, "relax": 0, "write": kind})])
      for kind in ("ATTRIBUTE", "MATERIALS", "FACE_SETS", "MESH")),
    ("One", [("mesh.omt_partition", {"cells": 5, "relax": 1, "write": "ATTRIBUTE"}),
             ("mesh.omt_partition", {"cells": 4, "relax": 0, "write": "ATTRIBUTE", "seed": 3})]),
    ("One", [("mesh.omt_partition", {"cells": 4, "relax": 0, "write": "MESH", "capacity_group": "painted"})]),
    ("One", [("uv.omt_magnify", {**DRAFT, **REGION, "image": "painting", "image_size": 40, "detail": "detail"})]),
    ("One", [("uv.omt_magnify", {**DRAFT, **REGION, "image": "painting", "detail": "detail", "margin": 1,
                                 "detail_box": (0.2, 0.1, 0.6, 0.8)})]),
    ("Two One", [("uv.omt_magnify", {**DRAFT, **REGION, "image": "painting", "use_image": True})]),
    ("One", [("uv.omt_magnify", {**DRAFT, **REGION, "source": "MESH", "further": "second=0.5"})]),
    ("One Two", [("uv.omt_magnify", {**DRAFT, **REGION, "source": "MESH", "boundary": "FREE", "balance": 0.3,
                                     "max_shear": 0.0})]),
    *(("Flat", [("uv.omt_magnify", {**DRAFT, **REGION, "boundary": kind})])
      for kind in ("OWN", "FREE", "DISK", "SQUARE", "RECTANGLE")),
    ("Flat", [("uv.omt_magnify", {**DRAFT, **REGION, "boundary": "FREE", "further": "second=2"})]),
    ("Flat", [("uv.omt_refine", {**DRAFT, "keep_boundary": True}), ("uv.omt_refine", {"balance": 0.4, "pack": True})]),
    ("One Two", [("uv.omt_refine", {**DRAFT, "pack": True, "margin": 9, "tile": 1013})]),
    ("One", [("uv.omt_sphere", {**DRAFT, "image": "painting", "projection": kind, "image_layout": layout})
             for kind, layout in (("LAMBERT", "EQUIRECT"), ("OCTAHEDRAL", "SINUSOIDAL"), ("EQUIRECT", "SINUSOIDAL"))]),
    *(("Two", [("uv.omt_sphere", {**DRAFT, "method": kind, "weight_group": "painted", "weight_factor": 3.0,
                                  "inside": False})]) for kind in ("FLOW", "MOSER")),
    ("One Two", [("uv.omt_density_set", {"density": 2.0, "unit": "IN", "texture_size": 512, "scope": "ISLANDS"}),
                 ("uv.omt_density_get", {"unit": "IN", "texture_size": 512})]),
    (f"{EDITED}One Two", [("uv.omt_density_set", {"density": 3.0, "unit": "M", "scope": "ALL"}),
                          ("uv.omt_density_get", {"unit": "CM"})]),
    *(("One Two", [("uv.omt_regions", {"kind": "ATTRIBUTE", "attribute": name, "texture_size": 300})])
      for name in ("zone", "inside")),
    *(("One Folded", [("uv.omt_worst", {"figure": kind, "share": 12.0})]) for kind in ("AREA", "SHEAR", "FOLDS")),
    ("One", [("object.omt_strain", {"of": "KEY", "shape_key": "Smile"}), ("object.omt_strain", {"of": "KEY"})]),
    ("One Bare", [("object.omt_landmarks_suggest", {"most": 6, "prefix": "At "})]),
    ("One Two", [("object.omt_match", {"transfer": {*ALL_KINDS, "ATTRIBUTES"}, "domain": "SPHERE",
                                       "use_polish": False})]),
    ("Flat Band", [("object.omt_match", {"domain": "DISK", "transfer": {"UV", "GROUPS"}})]),
    ("One", [("object.omt_remesh", {**MESHED, "levels": 2, "use_preserve_sharp": True, "sharp_angle": 0.6}),
             ("object.omt_compare", {})]),
    ("One", [("object.omt_remesh", {**MESHED, "use_preserve_seams": False, "use_preserve_materials": False,
                                    "hide_original": False, "density": "GAUSSIAN", "amount": 3.0})]),
    ("Two", [("object.omt_remesh", {**MESHED, "use_modifiers": True, "density": "WEIGHTS", "weight_group": "painted",
                                    "weight_factor": 5.0})]),
    ("One", [("uv.omt_unwrap", {**DRAFT, "pack": False, "max_shear": 0.0}), ("uv.omt_stack", {"mirrored": False})]),
    ("Two One", [("uv.omt_unwrap", {**DRAFT, "balance": 0.7, "pack_around": True, "margin": 11, "texture_size": 256})]),
    ("Flat", [("uv.omt_unwrap", {"boundary": "RECTANGLE", "aspect": 1.7, "quality": "DRAFT"}),
              ("uv.omt_unwrap", {"boundary": "DISK", "centre_group": "second", "kind": "CONFORMAL"})]),
    (f"{EDITED}Smooth", [("uv.omt_remedy", {"action": "APPLY_LEVEL"})]),
    ("One", [("uv.omt_remedy", {"action": "APPLY_LEVEL"})]),
    (f"{EDITED}Folded One", [("uv.omt_remedy", {"action": kind}) for kind in ("MERGE", "DISSOLVE", "NORMALS")]),
    ("Lines One Folded", [("uv.omt_queue", {})]),
    ("One Bare", [("object.omt_flow", {"rotate": (0.04, 0.0, 0.06), "path": "RADIUS", "radius": 0.9, "samples": 2}),
                 ("object.omt_distance", {})]),
    (f"{EDITED}Flat", [("uv.omt_flow", {"start": (0.4, 0.6), "move": (-0.05, 0.04), "radius": 0.2}),
                       ("uv.omt_rectify", {})]),
    ("One Two", [("object.omt_similar", {"index": "//commands/index.npz", "top": 2})]),
    *(("Two One", [("object.omt_volume", {"tets": 150, "domain": "BODY", "body": "Two", "result": kind, "axis": "Y",
                                          "place": 0.3, "seed": 4, "points": 30, "shells": 2})])
      for kind in ("SLICE", "ATTRIBUTE", "SHELLS", "POINTS")),
]  # fmt: skip
# Words of commands; those that begin with @ are files.
COMMANDS = (
    "measure @rare.blend --object One --object Two --json --regions zone --texture-size 300",
    "measure @rare.blend --object One --beltrami --shape-key Smile",
    "measure @rare.blend --object One --beltrami --shape-key Smile --json",
    "measure @rare.blend --object Flat --object Folded",
    "compare @rare.blend @rare.blend --object One --beltrami --shape-key Smile --json",
    "compare @in.blend @other.blend",
    "compare @in.blend @other.blend @plain.obj --json",
    "diagram @in.blend -o @made.obj --domain square --json",
    "diagram @two.blend -o @made.png --size 32",
    "test-texture @in.blend -o @made.png --kind circles --size 48",
    "test-texture @in.blend -o @made.png --kind shear --size 48",
    "remesh @in.blend -o @made.obj --faces 60 --levels 2 --no-attributes",
    "remesh @rare.blend -o @out.blend --object One --edge 0.5 --sharp 40 --no-seams --no-materials --density painted",
    "unwrap @rare.blend -o @out.blend --object Flat --object Smooth --keep-free painted --subdivision 1",
    "unwrap @rare.blend -o @out.blend --object Flat --boundary disk --centre second --subdivision off",
    "unwrap @rare.blend -o @out.blend --object One --no-pack --margin 9 --uv-layer Other --balance 0.6",
    "unwrap @rare.blend -o @made.obj --object One --scene Scene --texture-size 128 --margin 7 --quality draft",
    "magnify @regions.blend -o @out.blend --source mesh --region region=2 --region second=0.5 --quality draft",
    "magnify @regions.blend -o @out.blend --source uv --boundary free --region region=2 --region second=0.5",
    "magnify @in.blend -o @out.blend --source uv --weights region --factor 2 --image @image.png --image-output "
    "@made.png --image-size 24 --detail @image.png:0.2,0.3,0.5,0.6 --quality draft",
    "magnify @rare.blend -o @out.blend --object Flat --source uv --weights painted --factor 3 --boundary disk",
    "match @in.blend @other.blend -o @out.blend --landmarks @pairs.json --transfer uv,groups --features 0",
    "flow @rare.blend -o @out.blend --handles @handles.json --object One --object Two --inside Two --frames 2",
    "volume @in.blend -o @made.vtu --tets 150",
    "volume @in.blend -o @made.npz --tets 150 --domain cube",
    "partition @rare.blend -o @out.blend --cells 5 --object One --write mesh --capacity painted --relax 1",
    "partition @in.blend -o @out.blend --cells 4 --write materials --seed 5",
    "sphere @rare.blend -o @out.blend --object One --object Two --method flow --pole pole --quality draft",
    "sphere @in.blend -o @out.blend --image @image.png --image-out @made.png --projection lambert --quality draft",
    "refine @rare.blend -o @out.blend --object Flat --keep-boundary --balance 0.3",
    "weights @rare.blend -o @out.blend --object Two --kind mean --low 0.1 --high 0.6",
    "queue @rare.blend -o @out.blend --object Flat --object Lines --quality draft --boundary square",
    "distances @index.npz -o @far.csv --labels @classes.csv --knn 1",
    "distances @index.npz -o @far.csv --curvature 0.9",
    "distances @index.npz -o @far.csv --curvature 0.9 --jobs 1",
    "block @asked.json -o @block.npy",
    "average @mixed -o @out.blend --scaled --report @report.json",
)


def _dressed() -> None:
    """Two bodies with keys, sets of faces, attributes and materials, one turned and scaled unevenly, the other smooth;
    one without UVs, a nearly flat patch, one with folded UVs, and lines alone."""
    one, two = dressed_bodies.bodies()
    one.name, two.name = "One", "Two"
    for k, obj in enumerate((one, two)):
        obj.vertex_groups[0].name = "painted"
        x, y, z = np.array([v.co[:] for v in obj.data.vertices]).T
        ends = {f"LM_{number}": [end] for number, end in enumerate((x.argmax(), x.argmin(), y.argmax(), z.argmax()))}
        for name, chosen in {"second": np.argsort(z)[:4], "pole": [z.argmax()], "meridian": [3], **ends}.items():
            obj.vertex_groups.new(name=name).add([int(v) for v in chosen], 0.9, "REPLACE")
        mesh, count = obj.data, len(obj.data.polygons)
        for name, kind, values in (
            ("zone", "INT", np.arange(count) % 3), ("inside", "BOOLEAN", np.arange(count) % 4 > 1),
            (".sculpt_face_set", "INT", 1 + np.arange(count) % 5),
        ):  # fmt: skip
            mesh.attributes.new(name, kind, "FACE").data.foreach_set("value", values)
        for name in ("skin", "cloth"):
            mesh.materials.append(bpy.data.materials.get(name) or bpy.data.materials.new(name))
        mesh.polygons.foreach_set("material_index", np.arange(count) // 3 % 2)
        for vertex in mesh.vertices:
            vertex.select = vertex.index % 9 == k
    one.shape_key_add(name="Basis")
    for name, scale in (("Smile", 0.2), ("Frown", -0.15)):
        key = one.shape_key_add(name=name, from_mix=False)
        for k, point in enumerate(key.data):
            point.co.z += scale * np.sin(1.0 + k)
    keys = one.data.shape_keys.key_blocks
    keys["Frown"].relative_key, keys["Smile"].value, keys["Smile"].slider_max = keys["Smile"], 0.3, 1.5
    one.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.6, 4, "Y") @ Matrix.Diagonal((1, 2, 0.7, 1))
    two.modifiers.new("Smooth", "SUBSURF").levels = 1
    two.scale = (1.2, 0.8, 1.0)


def _others() -> None:
    V, F = blob(1, seed=4)
    bare = scenes.add(V * [1.0, 0.8, 1.4], F, "Bare")
    bare.location.y = 5.0
    flat = scenes.bump(7, 6, 0.25, "Flat")
    flat.location.y = -4.0
    for name, chosen in (("painted", [17, 18, 25, 26]), ("second", [36])):
        flat.vertex_groups.new(name=name).add(chosen, 1.0, "REPLACE")
    scenes.set_uv(flat, (0.1 + 0.7 * scenes.seen_from_above(flat)).astype(np.float32))
    folded = scenes.bump(5, 4, 0.5, "Folded")
    folded.location.y = -7.0
    uv = scenes.seen_from_above(folded)
    scenes.set_uv(folded, (0.2 + 0.5 * uv + 0.2 * np.sin(7 * uv[:, ::-1])).astype(np.float32))
    twin_scenes.band("Band", 9.0)
    twin_scenes.smooth("Smooth", 12.0)
    lines = scenes.add([(0, 0, 0), (1, 0, 0)], [], "Lines", edges=[(0, 1)])
    lines.location.y = 9.0
    rng = np.random.default_rng(8)
    for name, size in (("painting", (20, 12)), ("detail", (9, 14))):
        image = bpy.data.images.new(name, *size)
        image.pixels.foreach_set(rng.random(4 * size[0] * size[1]).astype(np.float32))
        image.pack()
        image.use_fake_user = True


def prepare(folder: Path, run) -> None:
    """Files of `front_runs`, and rare.blend with objects that it has not; run: a command, words."""
    front_runs.prepare(folder, run)
    there = folder / "commands"
    scenes.open_empty()
    _dressed()
    _others()
    scenes.select([])
    for path in (folder / "rare.blend", there / "rare.blend"):
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    scenes.open_empty()
    obj = command_runs.body("in")
    obj.vertex_groups.new(name="second").add([3, 4, 5, 6], 0.6, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(there / "regions.blend"))
    (there / "pairs.json").write_text(json.dumps([[3, 5], [9, [0.3, 0.4, 0.5]], [20, 21], [30, 33]]))
    (there / "classes.csv").write_text("a.blend,cat,me\nb.blend,dog,you\n")
    asked = {"index": str(there / "index.npz"), "block": [0, 1, 1, 2], "curvature": 0.7}
    (there / "asked.json").write_text(json.dumps(asked))
    # Of one mesh, and of another that has to be matched.
    (there / "mixed").mkdir()
    for name, place in (("a.blend", 0.0), ("b.blend", 0.4)):
        scenes.open_empty()
        V, F = blob(1, seed=1)
        obj = scenes.add(V * [1, 1.3, 0.8 + place], F if not place else F[::-1], name)
        for k, vertex in enumerate((3, 17, 30, 41)):
            obj.vertex_groups.new(name=f"LM_{k}").add([vertex], 1.0, "REPLACE")
        bpy.ops.wm.save_as_mainfile(filepath=str(there / "mixed" / name))


def _word(value) -> str:
    return " ".join(sorted(value)) if isinstance(value, set) else str(value)


def operated(folder: Path, capfd) -> Iterator[tuple[str, object]]:
    """What operators report and leave, one after the other."""
    state = importlib.import_module("omt_uv.session.last_run").state
    for objects, operators in SEQUENCES:
        bpy.ops.wm.open_mainfile(filepath=str(folder / "rare.blend"))
        chosen = [bpy.data.objects[name] for name in objects.removeprefix(EDITED).split()]
        (scenes.edit(*chosen) if objects.startswith(EDITED) else scenes.select(chosen))
        told: list[object] = []
        for name, arguments in operators:
            try:
                told += twin_scenes.told(capfd, name, arguments)
            except TypeError as error:
                raise AssertionError((name, arguments)) from error
            told.append(front_runs.rows_of(state.summary) if state.summary else [])
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        names = " ".join(f"{name} {sorted(map(_word, arguments.values()))}" for name, arguments in operators)
        yield f"{objects} {names}", [told, front_runs.left()]


def picked(folder: Path, capfd) -> Iterator[tuple[str, object]]:
    """Globes that are turned by vertices picked one after the other, and by a group alone."""
    for name, more in (("PICKED", {}), ("GROUPS", {"pole_group": "pole"})):
        bpy.ops.wm.open_mainfile(filepath=str(folder / "rare.blend"))
        obj = bpy.data.objects["One"]
        scenes.edit(obj)
        edit = bmesh.from_edit_mesh(obj.data)
        edit.verts.ensure_lookup_table()
        edit.select_history.clear()
        for k in (4, 11, 20):
            edit.select_history.add(edit.verts[k])
        told = twin_scenes.told(capfd, "uv.omt_sphere", {**DRAFT, "orientation": name, **more})
        bpy.ops.object.mode_set(mode="OBJECT")
        yield f"uv.omt_sphere {name}", [told, front_runs.left()]


def dragged(folder: Path) -> Iterator[tuple[str, object]]:
    """Where drags take vertices and UVs, and that these are back where it is let be."""
    for name, objects in (("object.omt_flow", "One Two"), ("uv.omt_flow", "Flat One")):
        bpy.ops.wm.open_mainfile(filepath=str(folder / "rare.blend"))
        scenes.select([bpy.data.objects[one] for one in objects.split()])
        operator = scenes.stand_in(name, radius=0.4)
        operator.begin_drag(bpy.context)
        found = []
        for shift in ((0.1, 0.05, 0.02), (-0.04, 0.08, 0.1), (0.0, 0.0, 0.0)):
            if name == "uv.omt_flow":
                operator._drag.to(np.array([0.4, 0.5]), np.array([0.4, 0.5]) + shift[:2])
            else:
                operator._drag.to(np.array(shift))
            found.append(front_runs.left())
        operator._drag.restore()
        yield f"{name} dragged", [*found, front_runs.left()]


def commanded(there: Path, run, capfd) -> Iterator[tuple[str, object]]:
    """What commands print, write and leave."""
    given = set(there.iterdir())
    for line in COMMANDS:
        for path in set(there.iterdir()) - given:
            if path.is_file():
                path.unlink()
        words = [f"{there}/{word[1:]}" if word.startswith("@") else word for word in line.split()]
        scenes.open_empty()
        capfd.readouterr()
        status = run(*words)
        told = [status, list(capfd.readouterr())]
        for path in sorted(set(there.iterdir()) - given):
            told.append(path.name)
            if path.suffix == ".png":
                told.append(scenes.pixels_of(path))
            elif path.suffix == ".npy":
                told.append(np.load(path))
            elif path.suffix == ".npz":
                told += [[name, values] for name, values in sorted(np.load(path).items())]
            elif path.suffix == ".vtu":
                told.append(path.read_text())
            elif path.suffix in front_runs.TEXTS:
                told.append(front_runs.text_of(path))
        if status == 0 and (there / "out.blend").exists():
            bpy.ops.wm.open_mainfile(filepath=str(there / "out.blend"))
            told.append(front_runs.left())
        yield line, told


def told(folder: Path, run, capfd) -> Iterator[tuple[str, object]]:
    """Names of runs, and what each told and left; run: a command, words."""
    yield from operated(folder, capfd)
    yield from picked(folder, capfd)
    yield from dragged(folder)
    yield from commanded(folder / "commands", run, capfd)
