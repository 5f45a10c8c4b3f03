"""object.omt_similar as users call it: the nearest objects, duplicates, what cannot be compared, a library's files."""

from __future__ import annotations

from types import SimpleNamespace

import bpy

import pytest
import scenes
from mathutils import Vector


def body(name, scale, subdivisions=3, turned=0.0):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions, rotation=(turned, 1, 0))
    obj = bpy.context.object
    obj.name = name
    for vertex in obj.data.vertices:
        vertex.co.x *= scale * (1.5 if vertex.co.x > 0 else 1)
    return obj


def selected():
    return {obj.name for obj in bpy.context.selected_objects}


def test_duplicates_of_any_triangles_and_place_are_selected_and_what_has_handles_is_named():
    others = [body("Long", 3), body("Turned", 2, turned=1), body("Round", 1)]
    others[1].scale = (3, 3, 3)
    bpy.ops.mesh.primitive_torus_add(major_segments=8, minor_segments=6)
    own = body("Own", 2, 4)
    before = [tuple(v.co) for v in own.data.vertices]
    assert bpy.ops.object.omt_similar() == {"FINISHED"}
    assert selected() == {"Own", "Turned"} and bpy.context.view_layer.objects.active == own
    assert [tuple(v.co) for v in own.data.vertices] == before
    assert bpy.ops.object.omt_similar(select="NOTHING") == {"FINISHED"} and selected() == {"Own", "Turned"}
    bpy.data.objects.remove(others[1])
    assert bpy.ops.object.omt_similar(select="NEAREST") == {"FINISHED"} and selected() in (
        {"Own", "Long"},
        {"Own", "Round"},
    )


@pytest.mark.parametrize("floor, least", [(0.0, 1e-6), (1e-9, 1e-6), (1e-6, 1e-6), (0.25, 0.25)])
@pytest.mark.parametrize("bound", [1.5, 2.0])
def test_duplicates_are_those_within_so_many_times_what_triangles_alone_make(package, monkeypatch, floor, least, bound):
    """The bound counts as within; where triangles make no difference, one of a millionth is none."""
    for name in ("At", "Beyond", "Far"):
        body(name, 1, 1)
    body("Own", 1, 1)
    raw = {"At": bound * least, "Beyond": bound * least * (1 + 1e-9), "Far": 1.0}

    def alike(*_):
        yield from ()
        # What is told has the floor taken off, and says nothing of that.
        return [(name, SimpleNamespace(raw=raw[name], floor=floor, distance=0.5 * raw[name])) for name in raw], ["told"]

    monkeypatch.setattr(package("pipelines.shapes.distance"), "alike", alike)
    assert bpy.ops.object.omt_similar(bound=bound) == {"FINISHED"}
    assert selected() == {"Own", "At"}
    for top in (1, 2, 3, 5):
        assert bpy.ops.object.omt_similar(bound=bound, top=top, select="NOTHING") == {"FINISHED"}
        told = [name for name, _ in package("session.last_run").state.summary.rows if name in raw]
        assert told == ["At", "Beyond", "Far"][:top]
    assert bpy.ops.object.omt_similar(bound=bound, select="NEAREST") == {"FINISHED"}
    assert selected() == {"Own", "At"}


def test_a_library_is_searched_and_what_is_none_is_refused(package, tmp_path):
    module = package("pipelines.shapes.signature_index")
    own = body("Own", 2)
    from omt_uv.solver.progress import drain

    made = drain(package("pipelines.shapes.distance").signature_of([package("blender.mesh").read(own).surface], 100))
    (tmp_path / "i.npz").write_bytes(module.index_of({"a/own.obj": ("", made)}).bytes())
    assert bpy.ops.object.omt_similar(index=str(tmp_path / "i.npz")) == {"FINISHED"}
    assert selected() == {"Own"}
    assert package("session.last_run").state.summary.rows[0] == ("a/own.obj", "0.000")
    (tmp_path / "i.npz").write_bytes(b"no index")
    assert "is no index" in scenes.error_of(bpy.ops.object.omt_similar, index=str(tmp_path / "i.npz"))


def test_one_object_alone_has_nothing_like_it():
    body("Own", 2)
    assert "no other mesh" in scenes.error_of(bpy.ops.object.omt_similar)
    bpy.context.view_layer.objects.active = None
    assert "No mesh" in scenes.error_of(bpy.ops.object.omt_similar)


def marked(obj, centre, start):
    """Landmarks of an object: a vertex group of the vertex that is highest along one way, an empty along another."""
    places = [v.co.copy() for v in obj.data.vertices]
    top = max(range(len(places)), key=lambda k: places[k].dot(centre))
    obj.vertex_groups.new(name="LM_1").add([top], 1.0, "REPLACE")
    empty = bpy.data.objects.new("LM_2", None)
    empty["omt_landmark"] = "LM_2"
    bpy.context.collection.objects.link(empty)
    empty.parent = obj
    empty.location = max(places, key=lambda place: place.dot(start))


def test_markers_compare_what_is_around_them_alone(package, tmp_path):
    """The far side of a body plays no part, and whoever has no markers is named."""
    bodies = [body("Own", 1), body("Tailed", 1), body("Bare", 1), body("Flat", 1)]
    for vertex in bodies[1].data.vertices:
        vertex.co.x *= 3 if vertex.co.x < -0.3 else 1
    for vertex in bodies[3].data.vertices:
        vertex.co.x *= 0.4 if vertex.co.x > 0 else 1
    for obj in (bodies[0], bodies[1], bodies[3]):
        marked(obj, Vector((1, 0, 0)), Vector((0.2, 1, 0)))
    bpy.context.view_layer.objects.active = bodies[0]
    names = {"centre_group": "LM_1", "start_group": "LM_2"}
    assert bpy.ops.object.omt_similar(**names) == {"FINISHED"}
    assert selected() == {"Own", "Tailed"}
    rows = package("session.last_run").state.summary.rows
    assert [name for name, _ in rows[:2]] == ["Tailed", "Flat"]
    assert bpy.ops.object.omt_similar(select="NOTHING") == {"FINISHED"}
    assert "Name both" in scenes.error_of(bpy.ops.object.omt_similar, centre_group="LM_1")
    assert "LM_9" in scenes.error_of(bpy.ops.object.omt_similar, centre_group="LM_9", start_group="LM_2")
    module = package("pipelines.shapes.signature_index")
    from omt_uv.solver.progress import drain

    own = package("blender.mesh").read(bodies[0]).surface
    markers = package("blender.shapes.landmarks").disk_markers([bodies[0]], [own.positions], ("LM_1", "LM_2"))
    made = drain(package("pipelines.shapes.distance").signature_of([own], 100, markers))
    (tmp_path / "i.npz").write_bytes(module.index_of({"own.obj": ("", made)}).bytes())
    assert bpy.ops.object.omt_similar(index=str(tmp_path / "i.npz"), **names) == {"FINISHED"}
    assert package("session.last_run").state.summary.rows[0] == ("own.obj", "0.000")
    assert "with markers" in scenes.error_of(bpy.ops.object.omt_similar, index=str(tmp_path / "i.npz"))
