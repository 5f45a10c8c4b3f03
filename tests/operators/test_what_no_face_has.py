"""Vertices that no face has, far from all others, change nothing of what operators say, write and make, whatever they
work on."""

from __future__ import annotations

import bpy

import front_runs
import numpy as np
import operator_states
import pytest
import scenes
import twin_scenes

# Of what flows a loose vertex is a part, and has its share in the diagonal; and what asks for bodies without them.
LEFT_OUT = {"object.omt_flow", "object.omt_volume"}
# What takes longest is called once.
ONCE = {"uv.omt_unwrap", "uv.omt_magnify", "uv.omt_sphere", "object.omt_remesh", "object.omt_match", "uv.omt_refine"}
FAR = ((31.0, -22.0, 17.0), (-40.0, 5.0, 28.0))
FIRST = {name: k for k, (name, *_) in reversed([*enumerate(front_runs.OPERATORS)])}
RUNS = {f"{name.partition('.')[2]} of {objects} {k}": (name, objects, given)
        for k, (name, objects, given) in enumerate(front_runs.OPERATORS)
        if name not in LEFT_OUT and (name not in ONCE or k == FIRST[name])}  # fmt: skip


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    there = tmp_path_factory.mktemp("no_face")
    twin_scenes.prepare(there)
    return there


def with_loose_vertices(obj: bpy.types.Object) -> None:
    """Put vertices behind those of an object, at no face."""
    n = len(obj.data.vertices)
    obj.data.vertices.add(len(FAR))
    for k, place in enumerate(FAR):
        obj.data.vertices[n + k].co = place


def after(package, capfd, folder, run: str, loose: bool) -> tuple[dict, list, dict]:
    """What an operator leaves in all meshes, of their first vertices, says, and shows."""
    name, objects, given = RUNS[run]
    twin_scenes.begin(folder, objects)
    count = {obj.name: len(obj.data.vertices) for obj in bpy.data.objects}
    if loose:
        for word in objects.split():
            with_loose_vertices(bpy.data.objects[word])
    last_run = package("session.last_run")
    last_run.forget()
    why, lines = twin_scenes.told(capfd, name, given)
    rows = last_run.state.summary.rows if last_run.state.summary else ()
    found = {obj.name: _told(obj, count.get(obj.name)) for obj in bpy.data.objects if obj.type == "MESH"}
    return found, [why, *lines], {key: value for key, value in rows if key != "Time"}


def _told(obj: bpy.types.Object, n: int | None) -> dict:
    mesh = obj.data
    n = len(mesh.vertices) if n is None else n
    found = {layer.name: scenes.uv_of(obj, layer.name) for layer in mesh.uv_layers}
    found |= {f"place {key.name}": np.array([v.co[:] for v in key.data[:n]]) for key in _keys(mesh)}
    found["places"] = np.array([v.co[:] for v in mesh.vertices[:n]])
    found["edges"] = np.array([[*e.vertices, e.use_seam, e.use_edge_sharp] for e in mesh.edges])
    found["materials"] = np.array([p.material_index for p in mesh.polygons])
    found["corners"] = np.array([loop.vertex_index for loop in mesh.loops])
    for group in obj.vertex_groups:
        held = [[g.weight for g in v.groups if g.group == group.index] for v in mesh.vertices[:n]]
        found[f"group {group.name}"] = np.array([w[0] if w else -1 for w in held])
    for own in mesh.attributes:
        if own.data_type in ("FLOAT", "INT") and not own.name.startswith("."):
            values = np.zeros(len(own.data), np.float32 if own.data_type == "FLOAT" else np.int32)
            own.data.foreach_get("value", values)
            found[f"attribute {own.name}"] = values[:n] if own.domain == "POINT" else values
    return found


def _keys(mesh: bpy.types.Mesh):
    return mesh.shape_keys.key_blocks if mesh.shape_keys else ()


@pytest.mark.parametrize("run", RUNS)
def test_vertices_of_no_face_change_nothing(package, capfd, folder, monkeypatch, run):
    operator_states.with_few_samples(package, monkeypatch)
    (mine, lines, rows), (others, told, shown) = (after(package, capfd, folder, run, loose) for loose in (False, True))
    assert told == lines and shown == rows
    assert others.keys() == mine.keys()
    for name, before in mine.items():
        assert others[name].keys() == before.keys(), name
        for key, value in before.items():
            assert others[name][key].shape == value.shape, (name, key)
            np.testing.assert_allclose(others[name][key], value, rtol=1e-4, atol=1e-5, err_msg=f"{name} {key}")
