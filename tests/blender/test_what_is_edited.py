"""Whatever reads a mesh in Edit Mode reads it as it is there, and not as it was when that was entered."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np
import pytest
import scenes

GROUP = "painted"


@pytest.fixture
def edited():
    """An object in Edit Mode in which a vertex, a UV, a weight, a seam and the selection have changed since."""
    obj = scenes.bump(3, 2)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    obj.vertex_groups.new(name=GROUP).add([0, 1], 0.25, "REPLACE")
    scenes.edit(obj)

    def change():
        edit = bmesh.from_edit_mesh(obj.data)
        edit.verts.ensure_lookup_table()
        edit.faces.ensure_lookup_table()
        edit.edges.ensure_lookup_table()
        edit.verts[4].co.z += 2.0
        edit.faces[1].loops[0][edit.loops.layers.uv.active].uv.x += 3.0
        edit.verts[1][edit.verts.layers.deform.active][0] = 0.75
        edit.edges[0].seam = True
        for face in edit.faces:
            face.select_set(False)
        edit.faces[2].select_set(True)
        bmesh.update_edit_mesh(obj.data)

    return obj, change


# What reads an object: module, and what is asked of what is read.
READERS = {
    "positions of a reading": ("mesh", lambda m, obj: m.read(obj).surface.positions),
    "UVs of a reading": ("mesh", lambda m, obj: m.read(obj).uv),
    "faces of a reading": ("mesh", lambda m, obj: m.read(obj).faces),
    "mark of UVs": ("fingerprint", lambda m, obj: np.frombuffer(m.uv_mark(obj), np.uint8)),
    "fingerprint": ("fingerprint", lambda m, obj: np.frombuffer(m.fingerprint(obj), np.uint8)),
    "weights": ("vertex_groups", lambda m, obj: m.group_weights(obj, GROUP)),
    "selected vertices": ("vertex_groups", lambda m, obj: m.selected_vertices(obj)),
    "a body": ("volumes.bodies", lambda m, obj: m.read_body(obj).positions),
    "positions of a body": ("volumes.bodies", lambda m, obj: m.read_positions(obj)),
    "members": ("volumes.bodies", lambda m, obj: m.members(obj, GROUP)),
}


@pytest.mark.parametrize("name", READERS)
def test_it_is_read_as_it_is_and_as_object_mode_has_it(package, edited, name):
    obj, change = edited
    module, asked = READERS[name]
    before = np.array(asked(package(f"blender.{module}"), obj))
    meshes = len(bpy.data.meshes)
    change()
    after = np.array(asked(package(f"blender.{module}"), obj))
    assert (before != after).any() and len(bpy.data.meshes) == meshes
    scenes.leave_edit()
    if name not in ("fingerprint", "faces of a reading"):
        np.testing.assert_array_equal(asked(package(f"blender.{module}"), obj), after)
    # In Object Mode all faces are worked on.
    assert name != "faces of a reading" or after.tolist() == [p.select for p in obj.data.polygons]
