"""Layouts as images, drawn checkers, and power diagrams as meshes."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("kind", ["AREA", "SHEAR", "NORMALS"])
def test_the_layout_becomes_an_image(kind):
    obj = scenes.bump()
    assert "Unwrap the mesh first" in scenes.error_of(bpy.ops.uv.omt_layout_image)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.5))
    state = scenes.state(obj)
    assert bpy.ops.uv.omt_layout_image(kind=kind, size=64) == {"FINISHED"}
    shown = np.array(bpy.data.images["OMT UV Layout"].pixels[:]).reshape(64, 64, 4)[..., :3]
    assert 0.1 < (shown < 0.99).any(axis=2).mean() < 0.5 and scenes.state(obj) == state


def test_drawn_checkers_are_put_on_and_taken_off():
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    for kind in ("CIRCLES", "WORLD"):
        assert bpy.ops.uv.omt_checker(kind=kind, size=256) == {"FINISHED"}
        node = obj.material_slots[0].material.node_tree.nodes.active
        assert node.image.size[0] == 256 and node.image.packed_file is not None
    bpy.ops.uv.omt_checker_remove()
    assert not obj.material_slots


def test_a_diagram_is_a_mesh_beside_its_object():
    obj = scenes.bump()
    state = scenes.state(obj)
    assert bpy.ops.object.omt_diagram(domain="SQUARE") == {"FINISHED"}
    made = bpy.data.objects["Bump_cells"]
    assert len(made.data.polygons) == len(obj.data.vertices) and scenes.state(obj) == state
    area = sum(p.area for p in made.data.polygons)
    assert area == pytest.approx(1, abs=1e-4)
    assert "not closed" in scenes.error_of(bpy.ops.object.omt_diagram, domain="SPHERE")


@pytest.mark.parametrize("active", ["A", "B"])
@pytest.mark.parametrize("made_first", ["A", "B"])
def test_the_diagram_of_several_is_that_of_the_active_one(active, made_first):
    counts = {"A": (4, 3), "B": (5, 4)}
    for name in sorted(counts, reverse=made_first == "B"):
        scenes.bump(*counts[name], name=name, offset=2.0 * (name == "B"))
    scenes.select([obj for obj in bpy.data.objects if obj.name != active] + [bpy.data.objects[active]])
    before = set(bpy.data.objects)
    assert bpy.ops.object.omt_diagram(domain="SQUARE") == {"FINISHED"}
    (made,) = set(bpy.data.objects) - before
    assert made.name == f"{active}_cells" and len(made.data.polygons) == len(bpy.data.objects[active].data.vertices)
