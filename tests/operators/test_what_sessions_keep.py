"""What every operator leaves of a session that holds much: all of it, to the last value, but what the operator is for;
and undo, which leaves all."""

from __future__ import annotations

import bpy

import pytest
import scenes
import whole_file

# UVs are those of the active layer.
UVS = ("meshes/?/attributes/UVMap", "meshes/?/uv_layers/1/*")
HALVES = ("meshes/Halves/attributes/UVMap", "meshes/Halves/uv_layers/0/*")
PLACES = ("meshes/A/attributes/position", "meshes/A/vertices/*/co", "meshes/A/vertices/*/normal",
          "meshes/A/vertices/*/undeformed_co", "meshes/A/polygons/*/normal", "meshes/A/polygons/*/center",
          "meshes/A/polygons/*/area", "objects/A/bound_box", "objects/A/dimensions")  # fmt: skip
# A new object and its mesh, and what holds them; that it is selected and active in place of the old one.
NEW = ("*/A_*", "collections/*/objects*", "collections/*/collection_objects*", "scenes/*/objects*")
DRAFT = {"quality": "DRAFT"}
OPEN = {**DRAFT, "max_shear": 0.0}
# Operator, the objects that are selected, arguments, and what it may change, as patterns of paths.
RUNS: list[tuple[str, str, dict, tuple[str, ...]]] = [
    ("uv.omt_unwrap", "AB", OPEN, UVS),
    ("uv.omt_refine", "AB", DRAFT, UVS),
    ("uv.omt_magnify", "AB", {**DRAFT, "weight_group": "region", "factor": 1.5, "source": "UV"}, UVS),
    ("uv.omt_sphere", "AB", DRAFT, UVS),
    ("uv.omt_density_set", "AB", {"density": 40.0}, UVS),
    ("uv.omt_stack", "H", {}, HALVES),
    ("uv.omt_symmetrize", "H", {}, HALVES),
    ("uv.omt_rectify", "H", {}, HALVES),
    ("uv.omt_flow", "A", {"start": (0.5, 0.5), "move": (0.1, 0.0), "radius": 0.5}, UVS),
    ("uv.omt_seams", "AB", {"max_shear": 0.0}, ("meshes/?/edges/*/use_seam", "meshes/?/attributes/*uv_seam")),
    ("object.omt_weights", "AB", {"kind": "GAUSSIAN", "weight_group": "region"},
     ("meshes/?/vertices/*/groups*", "objects/?/active group")),
    ("mesh.omt_partition", "AB", {"cells": 4, "relax": 0}, ("meshes/?/attributes/.sculpt_face_set",)),
    ("mesh.omt_partition", "AB", {"cells": 4, "relax": 0, "write": "SEAMS"},
     ("meshes/?/edges/*/use_seam", "meshes/?/attributes/*uv_seam")),
    ("uv.omt_attributes", "AB", {}, ("meshes/?/attributes/OMT*",)),
    ("uv.omt_measure", "AB", {}, ()),
    ("uv.omt_density_get", "AB", {}, ()),
    ("uv.omt_regions", "AB", {}, ()),
    ("object.omt_remesh", "A", {"target_vertices": 90, "use_preserve_seams": False, "use_preserve_materials": False,
                                "hide_original": False}, NEW),
]  # fmt: skip


@pytest.fixture(scope="module")
def rich(package, tmp_path_factory):
    scenes.open_empty()
    whole_file.make()
    path = tmp_path_factory.mktemp("rich") / "in.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def begin(rich, selected: str) -> dict[str, str]:
    bpy.ops.wm.open_mainfile(filepath=str(rich))
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj.name[0] in selected)
    bpy.context.view_layer.objects.active = next(o for o in bpy.context.selected_objects if o.name[0] == selected[0])
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push()
    return whole_file.told()


@pytest.mark.parametrize(("name", "selected", "given", "may"), RUNS, ids=[f"{n} {list(g)[-1:]}" for n, _, g, _ in RUNS])
def test_all_that_an_operator_is_not_for_stays_and_undo_gives_back_all(rich, name, selected, given, may):
    before = begin(rich, selected)
    module, operator = name.split(".")
    assert getattr(getattr(bpy.ops, module), operator)("EXEC_DEFAULT", True, **given) == {"FINISHED"}
    after = whole_file.told()
    found = whole_file.changed(before, after, may)
    assert not found, found[:40]
    assert not whole_file.idle(before, after, may)
    touched = " ".join(path.split("/")[1][:1] for path in whole_file.changed(before, after))
    assert not may or all(letter in touched for letter in selected), touched
    if may:
        bpy.ops.ed.undo()
        found = whole_file.changed(before, whole_file.told())
        assert not found, found[:40]
