"""Markers of a globe: vertex groups by name, or vertices in the order in which they were picked."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np
import pytest
import scenes
from globe_scenes import ball


def test_groups_become_markers_of_the_objects_that_have_them(package):
    markers = package("blender.markers")
    first, second = ball("A"), ball("B")
    first.vertex_groups.new(name="north").add([5], 0.5, "REPLACE")
    found, none = markers.group_markers([first, second], "north")
    assert none is None and np.flatnonzero(found.pole).tolist() == [5] and found.pole[5] == 0.5
    assert found.meridian is None and markers.group_markers([first], "") == [None]
    with pytest.raises(package("blender.vertex_groups").GroupError, match="south"):
        markers.group_markers([first, second], "north", "south")


@pytest.mark.parametrize("picks", [(), (7,), (7, 2), (7, 2, 30), (9, 7, 2, 30)])
def test_picked_vertices_keep_their_order(package, picks):
    """Two are enough, of more than three those picked last are taken."""
    markers, obj = package("blender.markers"), ball()
    scenes.edit(obj, faces=[])
    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
    mesh = bmesh.from_edit_mesh(obj.data)
    mesh.verts.ensure_lookup_table()
    for index in picks:
        mesh.verts[index].select = True
        mesh.select_history.add(mesh.verts[index])
    if len(picks) < 2:
        with pytest.raises(package("solver.globe.rotation").MarkerError, match="one after the other"):
            markers.picked_markers(obj)
    else:
        found = markers.picked_markers(obj)
        marks = [int(np.argmax(x)) for x in (found.pole, found.meridian, found.side) if x is not None]
        assert tuple(marks) == picks[-3:]
    scenes.leave_edit()


def test_densities_go_from_one_to_the_factor(package):
    obj = ball()
    obj.vertex_groups.new(name="face").add([v.index for v in obj.data.vertices if v.co.z > 0], 1.0, "REPLACE")
    pairs = [(obj, package("blender.mesh").read(obj))]
    (density,) = package("blender.markers").globe_densities(pairs, "face", 4.0)
    assert density.min() == 1 and density.max() == pytest.approx(4)
    assert package("blender.markers").globe_densities(pairs, "", 4.0) == [None]


@pytest.mark.parametrize("painted", [(), (0,), (1,), (0, 1)], ids=str)
@pytest.mark.parametrize("all_over", [None, 0, 1])
def test_what_is_not_painted_or_all_over_has_no_density_where_another_has(package, painted, all_over):
    pairs = []
    for k in range(2):
        obj = ball()
        group = obj.vertex_groups.new(name="face")
        chosen = [v.index for v in obj.data.vertices if k == all_over or (v.co.z > 0 and k in painted)]
        group.add(chosen, 1.0, "REPLACE")
        pairs.append((obj, package("blender.mesh").read(obj)))
    has_both = [k in painted and k != all_over for k in range(2)]
    densities = package("blender.markers").globe_densities
    if any(has_both):
        assert [density is not None for density in densities(pairs, "face", 4.0)] == has_both
        return
    words = "No object has both" if all_over is not None else "All weights are zero"
    with pytest.raises(package("solver.errors").WeightError, match=words):
        densities(pairs, "face", 4.0)
    if all_over is not None:
        with pytest.raises(package("solver.errors").UniformWeightsError):
            densities([pairs[all_over]], "face", 4.0)
