"""Refusals of operators and commands that hardly anything meets, and what they leave out."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes


def test_bodies_on_which_nothing_stands_out_get_no_landmarks(monkeypatch, package):
    first, second = scenes.bump(name="A"), scenes.bump(name="B", offset=3)
    scenes.select([first, second])
    suggestions = package("solver.registration.suggestions")
    found = [np.zeros(0, int)]
    monkeypatch.setattr(
        suggestions, "suggest_landmarks", lambda *_: SimpleNamespace(source=found[0], target=found[0][::-1])
    )
    assert "Nothing stands out" in scenes.error_of(bpy.ops.object.omt_landmarks_suggest)
    assert not first.children and not second.children
    found[0] = np.array([3, 8])
    assert bpy.ops.object.omt_landmarks_suggest() == {"FINISHED"}
    for obj, rows in ((first, (3, 8)), (second, (8, 3))):
        places = [tuple(e.matrix_world.translation) for e in sorted(obj.children, key=lambda e: e.name)]
        assert places == [pytest.approx(tuple(obj.data.vertices[k].co), abs=1e-6) for k in rows]


@pytest.mark.parametrize("box", [(0.1, 0.2, 0.4, 0.6), (0.1, 0.2, 0.1, 0.6), (0.1, 0.2, 0.4, 0.2), (0.0,) * 4])
@pytest.mark.parametrize("there", [True, False])
def test_a_detail_has_a_box_or_that_of_the_region(monkeypatch, package, box, there):
    detail, images = package("pipelines.regions.detail"), package("files.images")
    operator = scenes.stand_in("uv.omt_magnify", detail="it", detail_box=box, image_size=6, margin=0.25)
    asked = []
    monkeypatch.setattr(detail, "box_of", lambda regions: ((0.0, 0.0), (0.5, 1.0)) if there else None)
    monkeypatch.setattr(detail, "detailed_picture", lambda *given: asked.append(given))
    monkeypatch.setattr(images, "named", lambda name: name)
    monkeypatch.setattr(images, "pixels_of", lambda image: np.zeros((2, 2, 4)))
    picture, own = np.zeros((5, 3, 4)), box[2] > box[0] and box[3] > box[1]
    if not own and not there:
        with pytest.raises(package("blender.vertex_groups").GroupError, match="Detail Image"):
            operator._detailed(picture, "regions", "result")
        return
    operator._detailed(picture, "regions", "result")
    ((_, regions, result, insets, size, margin),) = asked
    assert (regions, result, size, margin) == ("regions", "result", (10, 6), 0.25)
    (inset,) = insets
    low, high = (box[:2], box[2:]) if own else ((0.0, 0.0), (0.5, 1.0))
    assert [*vars(inset).values()][1:3] == [pytest.approx(low), pytest.approx(high)]
    operator.detail = ""
    operator._detailed(picture, "regions", "result")
    assert asked[1][3] == []


@pytest.mark.parametrize("name", ["it.npy", "it", "it.npz.txt"])
def test_a_signature_is_an_npz(package, name):
    command, common = package("commands.shapes.signature"), package("commands.common")
    with pytest.raises(common.CommandError, match=f"{name}: a signature is an .npz. Name one."):
        command.run(SimpleNamespace(output=Path(name), input=Path("in.obj")))


def test_only_meshes_are_told_of_in_a_report(package):
    mesh = scenes.cube()
    mesh.scale = (2, 1, 0.5)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    bpy.context.view_layer.update()
    context = SimpleNamespace(mode="OBJECT", selected_objects=[camera, mesh, camera, mesh])
    lines = [x for x in package("operators.report").report_text(context).splitlines() if x.startswith("mesh ")]
    told = "8 vertices, 12 edges, 6 faces, 0 UV maps, scale 2, 1, 0.5"
    assert lines == [f"mesh 1: {told}", f"mesh 2: {told}"]


@pytest.mark.parametrize(
    "names", [("A",), ("A", "A.001"), ("A", "A: B"), ("A: B", "A", "A: B: C"), ("Left", "Leftover")]
)
def test_names_are_left_out_of_a_report_whole(package, names):
    """Also where one begins as another does."""
    report, last_run = package("operators.report"), package("session.last_run")
    for name in names:
        scenes.cube(name).name = name
    for name in names:
        assert report._nameless(f"{name}: It has holes: two.") == "It has holes: two."
        last_run.keep(last_run.Summary("Unwrap", (("Shear", "1.1"),), (last_run.Notice(f"{name}: It is bent."),), ()))
        last_run.state.error = f"{name}: It is closed."
        lines = report.report_text(bpy.context).splitlines()
        assert "  warning: It is bent." in lines and "last error: It is closed." in lines
        assert "  Shear: 1.1" in lines and "last run: Unwrap" in lines
    assert report._nameless("No mesh is selected.") == "No mesh is selected."
    last_run.forget()
    last_run.state.error = ""


@pytest.mark.parametrize(("selected", "touched"), [([], [2]), ([1], [2]), ([], [])])
def test_objects_of_which_nothing_is_touched_are_left_out_in_edit_mode(package, monkeypatch, selected, touched):
    live, mesh = package("operators.live"), package("blender.mesh")
    one, other = scenes.bump(name="A"), scenes.bump(name="B", offset=3)
    count = len(one.data.polygons)
    scenes.edit(one, other, faces=[])
    reading = mesh.read(one)

    def read(obj):
        faces = np.isin(np.arange(count), selected if obj == one else [])
        return type(reading)(**(vars(reading) | {"faces": faces}))

    monkeypatch.setattr(mesh, "read", read)
    monkeypatch.setattr(mesh, "touched_faces", lambda obj: np.isin(np.arange(count), touched if obj == other else []))
    monkeypatch.setattr(live, "read_objects", lambda context: "all")
    found = live._read_touched(bpy.context)
    expected = {one.name: selected, other.name: touched}
    if not selected and not touched:
        assert found == "all"
        return
    assert {obj.name: np.flatnonzero(r.faces).tolist() for obj, r in found} == {k: v for k, v in expected.items() if v}


def test_new_objects_stand_beside_the_old_one_where_that_is_of_this_file(package):
    mesh, linked = package("blender.mesh"), []

    def collection(name, library=None):
        return SimpleNamespace(
            name=name, library=library, objects=SimpleNamespace(link=lambda obj: linked.append(name))
        )

    own = [collection("a"), collection("b", "library"), collection("c")]
    mesh.link_beside("new", SimpleNamespace(users_collection=own))
    assert linked == ["a", "c"]
    obj = bpy.data.objects.new("alone", None)
    mesh.link_beside(obj, SimpleNamespace(users_collection=own[1:2]))
    assert linked == ["a", "c"] and obj.name in bpy.context.scene.collection.objects


def test_edges_that_are_none_are_not_selected(package):
    mesh, obj = package("blender.mesh"), scenes.cube()
    scenes.edit(obj, faces=[])
    # 0 and 7 are opposite corners.
    mesh._select_bmesh(obj.data, "edge", np.array([[0, 1], [0, 7], [2, 3]]))
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = {frozenset(e.vertices) for e in obj.data.edges if e.select}
    assert chosen == {frozenset((0, 1)), frozenset((2, 3))}


@pytest.mark.parametrize("library", [True, False])
def test_levels_stand_below_a_collection_of_this_file(package, monkeypatch, library):
    """Collections of a library are passed over, and the scene's own is the last that is left."""
    remesh = package("blender.remesh_objects")
    source = scenes.cube("it")
    names = [scenes.cube(f"level {k}").name for k in range(2)]
    home = bpy.data.collections.new("home")
    bpy.context.scene.collection.children.link(home)
    others = [SimpleNamespace(library="a file")] + ([] if library else [home])

    class Source:
        name, users_collection = source.name, others

    given = {}
    monkeypatch.setattr(remesh, "SOURCE", "told")
    monkeypatch.setattr(remesh, "bpy", SimpleNamespace(data=_Data(given), context=bpy.context, types=bpy.types))
    remesh.mark_source([Source], names)
    made = bpy.data.collections["it LODs"]
    assert made.name in (bpy.context.scene.collection if library else home).children
    assert {obj.name for obj in made.objects} == set(names) and set(given) == set(names)
    assert all(obj.users_collection == (made,) for obj in made.objects)


@pytest.mark.parametrize("levels", [1, 3])
def test_levels_know_which_object_of_a_group_they_were_made_of(package, levels):
    """Names come level by level, each for every object of the group in turn."""
    remesh = package("blender.remesh_objects")
    group = [scenes.cube(f"it {k}") for k in range(2)]
    names = [scenes.cube(f"{level} of {k}").name for level in range(levels) for k in range(2)]
    remesh.mark_source(group, names)
    for name in names:
        assert bpy.data.objects[name][remesh.SOURCE] == group[int(name[-1])], name


@pytest.mark.parametrize("room", ["display.overlay", "display.colour_bar", "session.last_run", "session.queue"])
def test_every_room_forgets_when_the_add_on_goes(package, monkeypatch, room):
    gone, registration = [], package("registration")
    # Keys and presets stay for other tests.
    monkeypatch.setattr(package("panels.keymap"), "unregister", lambda: None)
    monkeypatch.setattr(registration, "unregister_folder", lambda: None)
    monkeypatch.setattr(package(room), "forget", lambda: gone.append(room))
    registration._clear(None)
    assert gone == [room]


class _Data:
    """`bpy.data`, whose objects keep what is told of them, first of all, elsewhere."""

    def __init__(self, given):
        self.collections, self.objects = bpy.data.collections, self
        self.given = given

    def __getitem__(self, name):
        if name in self.given:
            return bpy.data.objects[name]
        return _Told(self.given, name)


class _Told:
    """An object of which one thing is told."""

    def __init__(self, given, name):
        self.given, self.name = given, name

    def __setitem__(self, key, value):
        self.given[self.name] = value
