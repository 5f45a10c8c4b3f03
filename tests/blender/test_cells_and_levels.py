"""Cells of partitions as each of what they can be written to, in both modes; levels of subdivision; what a live session
looks at."""

from __future__ import annotations

from colorsys import hsv_to_rgb
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture
def obj():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return scenes.bump(3, 2)


def integers(mesh, name):
    if mesh.is_editmode:
        bpy.ops.object.mode_set(mode="OBJECT")
    values = np.zeros(len(mesh.polygons), np.int32)
    mesh.attributes[name].data.foreach_get("value", values)
    return values.tolist()


CELLS = np.array([1, -1, 0, 2, -1, 1])


@pytest.mark.parametrize("edit", [False, True])
@pytest.mark.parametrize("there", [False, True])
@pytest.mark.parametrize(("write", "first", "other"), [("face_sets", 1, 1), ("attribute", 0, -1)])
def test_cells_are_numbers_of_faces_and_others_keep_theirs(write, first, other, there, edit, obj, package):
    module = package("blender.shapes.cell_faces")
    name = module.FACE_SETS if write == "face_sets" else module.CELL_ATTRIBUTE
    if there:
        values = np.arange(10, 16, dtype=np.int32)
        obj.data.attributes.new(name, "INT", "FACE").data.foreach_set("value", values)
        obj.data.update()
    if edit:
        scenes.edit(obj)
    module.write_cells(obj, SimpleNamespace(cell=CELLS), write)
    want = [c + first if c >= 0 else 10 + k if there else other for k, c in enumerate(CELLS.tolist())]
    assert integers(obj.data, name) == want


@pytest.mark.parametrize("edit", [False, True])
@pytest.mark.parametrize("slots", [0, 2])
def test_cells_are_materials_behind_those_that_there_are(slots, edit, obj, package):
    module = package("blender.shapes.cell_faces")
    for k in range(slots):
        obj.data.materials.append(bpy.data.materials.new(f"Old {k}"))
    obj.data.polygons[1].material_index = min(slots, 1)
    if edit:
        scenes.edit(obj)
    module.write_cells(obj, SimpleNamespace(cell=CELLS), "materials")
    if edit:
        bpy.ops.object.mode_set(mode="OBJECT")
    index = [p.material_index for p in obj.data.polygons]
    assert index == [slots + c if c >= 0 else min(slots, 1) * (k == 1) for k, c in enumerate(CELLS.tolist())]
    names = [m.name for m in obj.data.materials]
    assert names == [f"Old {k}" for k in range(slots)] + [f"{obj.name} {k}" for k in (1, 2, 3)]
    for k, material in enumerate(list(obj.data.materials)[slots:]):
        # Hues a golden section apart.
        want = hsv_to_rgb((0.6180339887 * k) % 1, 0.45 + 0.15 * (k % 3), 0.9 - 0.12 * (k % 2))
        assert list(material.diffuse_color) == pytest.approx([*want, 1.0], abs=1e-6)


def test_numbers_of_materials_have_as_many_digits_as_the_last(obj, package):
    package("blender.shapes.cell_faces").write_cells(
        obj, SimpleNamespace(cell=np.array([0, 9, 1, 2, 3, 4])), "materials"
    )
    names = [m.name for m in obj.data.materials]
    assert names[0] == f"{obj.name} 01" and names[-1] == f"{obj.name} 10"


def test_cells_are_seams_between_them(obj, package):
    borders = np.array([[0, 1], [5, 1]])
    package("blender.shapes.cell_faces").write_cells(obj, SimpleNamespace(cell=CELLS, borders=borders), "seams")
    marked = {tuple(sorted(e.vertices)) for e in obj.data.edges if e.use_seam}
    assert marked == {(0, 1), (1, 5)}


@pytest.mark.parametrize(
    ("kind", "domain", "refused"), [("INT", "FACE", False), ("FLOAT", "FACE", True), ("INT", "POINT", True)]
)
@pytest.mark.parametrize("write", ["face_sets", "attribute", "materials", "seams", "mesh"])
def test_attributes_of_another_kind_are_in_the_way_of_those_alone_that_need_them(
    write, kind, domain, refused, obj, package
):
    module = package("blender.shapes.cell_faces")
    for name in (module.FACE_SETS, module.CELL_ATTRIBUTE):
        obj.data.attributes.new(name, kind, domain)
    if refused and write in ("face_sets", "attribute"):
        with pytest.raises(package("blender.mesh").TargetError, match="another attribute"):
            module.check_cells(obj, write)
    else:
        module.check_cells(obj, write)


@pytest.mark.parametrize("more", [0, 1])
def test_slots_of_materials_have_an_end(more, obj, package, monkeypatch):
    module = package("blender.shapes.cell_faces")
    monkeypatch.setattr(module, "MOST_MATERIALS", 3)
    for _ in range(2 + more):
        obj.data.materials.append(None)
    module.check_cells(obj, "attribute")
    if more:
        with pytest.raises(package("blender.mesh").TargetError, match="has 3 material slots already"):
            module.check_cells(obj, "materials")
    else:
        module.check_cells(obj, "materials")


@pytest.mark.parametrize("edit", [False, True])
def test_what_a_mesh_carries_is_read_in_both_modes_and_leaves_nothing_behind(edit, obj, package):
    obj.data.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", np.arange(12, dtype=np.float32))
    group = obj.vertex_groups.new(name="G")
    group.add([3, 4], 0.5, "REPLACE")
    if edit:
        scenes.edit(obj)
    count = len(bpy.data.meshes)
    found = package("blender.shapes.cell_objects").read_carried(obj)
    (heat,) = [layer.values.ravel().tolist() for layer in found.layers if layer.name == "heat"]
    assert (
        heat == list(range(12))
        and len(bpy.data.meshes) == count
        and "G" in [g if isinstance(g, str) else g.name for g in found.groups]
    )
    assert np.flatnonzero(found.weights.sum(axis=1)).tolist() == [3, 4]


def test_points_stand_on_the_object_with_normals_across_its_surface(obj, package):
    obj.scale = (2, 1, 0.5)
    bpy.context.view_layer.update()
    positions = np.array([[2, 0, 0], [0, 1, 0.5]])
    normals = np.array([[0.6, 0.8, 0], [0, 0, 1.0]])
    points = SimpleNamespace(positions=positions, normals=normals, radii=np.array([0.5, 0.25]))
    new = package("blender.shapes.cell_objects").new_points(obj, SimpleNamespace(points=points))
    assert np.array([v.co for v in new.data.vertices]) == pytest.approx(positions / [2, 1, 0.5])
    found = np.zeros(6, np.float32)
    new.data.attributes["normal"].data.foreach_get("vector", found)
    want = normals * [2, 1, 0.5]
    assert found.reshape(-1, 3) == pytest.approx(want / np.linalg.norm(want, axis=1, keepdims=True), abs=1e-6)
    radii = np.zeros(2, np.float32)
    new.data.attributes["radius"].data.foreach_get("value", radii)
    assert radii.tolist() == [0.5, 0.25] and new.name == obj.name + "_points" and new.matrix_world == obj.matrix_world


# ---- levels -------------------------------------------------------------------------------------------------


def subdivided(obj, **given):
    modifier = obj.modifiers.new("Sub", "SUBSURF")
    for name, value in given.items():
        setattr(modifier, name, value)
    return modifier


@pytest.mark.parametrize(
    ("viewport", "rendered", "levels"), [(True, True, 3), (True, False, 2), (False, True, 3), (False, False, 0)]
)
def test_levels_are_those_of_the_render_or_of_the_viewport(viewport, rendered, levels, obj, package):
    module = package("blender.subdivision")
    subdivided(obj, levels=2, render_levels=3, show_viewport=viewport, show_render=rendered)
    found = module.modifier_of(obj, obj.data)
    assert (found is None) == (levels == 0) and (found is None or found.levels == levels)


def test_modifiers_are_read_with_all_that_they_say(obj, package):
    module = package("blender.subdivision")
    assert module.modifier_of(obj, obj.data) is None
    modifier = subdivided(obj)
    for name, value, read, wants in (
        ("boundary_smooth", "PRESERVE_CORNERS", "keep_corners", True),
        ("boundary_smooth", "ALL", "keep_corners", False),
        ("subdivision_type", "SIMPLE", "simple", True),
        ("subdivision_type", "CATMULL_CLARK", "simple", False),
        ("use_limit_surface", False, "limit", False),
        ("use_limit_surface", True, "limit", True),
        ("uv_smooth", "SMOOTH_ALL", "uv_smooth", "SMOOTH_ALL"),
    ):
        setattr(modifier, name, value)
        assert getattr(module.modifier_of(obj, obj.data), read) == wants
    crease = obj.data.attributes.new("crease_edge", "FLOAT", "EDGE")
    crease.data[4].value = 0.5
    corner = obj.data.attributes.new("crease_vert", "FLOAT", "POINT")
    corner.data[2].value = 1.0
    found = module.modifier_of(obj, obj.data)
    assert found.ends.tolist() == [list(obj.data.edges[4].vertices)] and found.sharpness.tolist() == [2.5]
    assert found.corner_sharpness[2] == 10 and found.corner_sharpness.sum() == 10
    modifier.use_creases = False
    assert not len(module.modifier_of(obj, obj.data).ends)


@pytest.mark.parametrize("reason", ["", "none", "keys", "shared", "before", "behind"])
def test_a_level_is_applied_but_for_keys_shared_meshes_and_modifiers_before(reason, obj, package):
    module = package("blender.subdivision")
    if reason == "before":
        obj.modifiers.new("First", "TRIANGULATE")
    if reason != "none":
        subdivided(obj)
    if reason == "behind":
        obj.modifiers.new("Last", "TRIANGULATE")
    if reason == "keys":
        obj.shape_key_add(name="Basis")
    if reason == "shared":
        bpy.data.objects.new("Other", obj.data)
    words = {"keys": "shape keys takes no level", "shared": "other objects share its mesh", "before": "come before Sub"}
    said = module.why_not_applied([scenes.bump(name="Plain"), obj])
    assert (said == "") == (reason not in words) and words.get(reason, "") in said
    assert not said or said.startswith(f"{obj.name}: ")


@pytest.mark.parametrize("edit", [False, True])
def test_a_level_that_is_applied_is_one_less_to_come(edit, obj, package):
    module = package("blender.subdivision")
    assert module.apply_level(obj) == 0 and len(obj.data.polygons) == 6
    modifier = subdivided(obj, levels=2, render_levels=1, use_limit_surface=True, subdivision_type="SIMPLE")
    if edit:
        scenes.edit(obj)
    assert module.apply_level(obj) == 1
    assert obj.mode == ("EDIT" if edit else "OBJECT")
    if edit:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert len(obj.data.polygons) == 24 and [m.name for m in obj.modifiers] == ["Sub"]
    assert (modifier.levels, modifier.render_levels) == (1, 0)
    # A simple level keeps the vertices there were.
    assert {tuple(np.round(v.co, 5)) for v in scenes.bump(3, 2).data.vertices} <= {
        tuple(np.round(v.co, 5)) for v in obj.data.vertices
    }


@pytest.mark.parametrize("levels", [0, 1, 3])
@pytest.mark.parametrize("own", [False, True])
def test_readings_get_levels_with_the_settings_they_have(own, levels, obj, package):
    if own:
        subdivided(obj, levels=2, render_levels=2, uv_smooth="SMOOTH_ALL")
    reading = package("blender.mesh").read(obj)
    found = package("blender.subdivision").with_levels(reading, levels).subdivision
    assert (found is None) == (levels == 0)
    if levels:
        assert found.levels == levels and found.uv_smooth == ("SMOOTH_ALL" if own else "PRESERVE_BOUNDARIES")


# ---- live sessions ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("corner", ["first", "last"])
@pytest.mark.parametrize(("far", "noticed"), [(0.0, False), (0.4, False), (3.0, True)])
def test_a_live_session_notices_uvs_that_somebody_else_moved(far, noticed, corner, obj, package):
    module = package("session.live")
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    live = module.Session(bpy.context, [(obj, package("blender.mesh").read(obj))])
    try:
        live.follow(0.3)
        live.follow(0.3)
        uv = scenes.uv_of(obj)
        size = np.ptp(uv)
        uv[0 if corner == "first" else -1] += far * module.MOVED * size
        scenes.set_uv(obj, uv)
        if noticed:
            with pytest.raises(package("session.run").Disturbed, match="UVs were changed"):
                live.follow(0.3)
        else:
            live.follow(0.3)
    finally:
        live.close()


# ---- files of handles ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("handle", "said"),
    [
        ({"from": [[0, 0]], "to": [[0, 0, 1]]}, "h.json: handle 1: 'from' is no list of points"),
        ({"from": [[0, 0, 0]], "to": "x"}, "h.json: handle 1: 'to' is no list of points"),
        ({"from": [[0, 0, 0]], "to": [[0, 0, float("inf")]]}, "h.json: handle 1: 'to' is no list of points [x, y, z]"),
        ({"vertices": [3, 99]}, "h.json: handle 1: Body has vertices 0 to 3, not 99"),
        ({"vertices": [-1]}, "h.json: handle 1: Body has vertices 0 to 3"),
        ({"vertices": "x"}, "h.json: handle 1: vertices are no list of numbers"),
        ({"vertices": [1], "move": [1]}, "h.json: handle 1: 'move' is no list of points"),
        ({"vertices": [1], "rotate": "x"}, "h.json: handle 1: 'rotate' is no list of points"),
        ({"vertices": []}, "h.json: handle 1 has no vertices. Name a vertex group that there is"),
        ({"group": "none"}, "h.json: handle 1 has no vertices"),
        ({"vertices": [1], "object": "Other"}, "h.json: handle 1 has no vertices"),
    ],
)
def test_handles_that_are_none_are_named_by_their_file_and_number(handle, said, package):
    module, flow = package("pipelines.volumes.handle_file"), package("pipelines.volumes.flow")
    from pathlib import Path

    body = flow.FlowBody("Body", np.eye(4, 3), np.array([[0, 1, 2]]))
    file = module.HandleFile(Path("h.json"), ({"vertices": [0], "move": [0, 0, 1]}, handle), ())
    with pytest.raises(module.HandleFileError) as caught:
        module.handles_of(file, [body], lambda b, name: None)
    assert said in str(caught.value)


def test_handles_are_of_the_bodies_that_they_name(package):
    module, flow = package("pipelines.volumes.handle_file"), package("pipelines.volumes.flow")
    from pathlib import Path

    bodies = [flow.FlowBody(name, np.eye(4, 3) * k, np.array([[0, 1, 2]])) for k, name in enumerate("AB", 1)]
    members = lambda b, name: np.array([b]) if name == "g" else None  # noqa: E731
    handles = ({"vertices": [2, 0, 2], "object": "B"}, {"group": "g"}, {"from": [0, 0, 1], "to": [[0, 0, 2]]})
    found = module.handles_of(module.HandleFile(Path("h.json"), handles, ()), bodies, members)
    assert [b for b, _ in found] == [1, 0, 1, -1] and [h.name for _, h in found] == ["number 0"] + ["number 1"] * 2 + [
        "number 2"
    ]
    assert found[0][1].vertices.tolist() == [0, 2] and np.array_equal(found[0][1].start, 2 * np.eye(4, 3)[[0, 2]])
    assert found[1][1].vertices.tolist() == [0] and found[2][1].vertices.tolist() == [1]
    assert found[3][1].vertices is None and found[3][1].end.tolist() == [[0, 0, 2]]
