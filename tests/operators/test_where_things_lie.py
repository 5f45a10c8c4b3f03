"""What operators make or move lies where it belongs in the world, however the object stands, also mirrored."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
from bodies import limbed
from mathutils.bvhtree import BVHTree

# Operators that move positions, and those that make new objects on the surface or in it.
MOVING = {
    "mesh": {"result": "MESH"},
    "key": {},
    "kept": {"keep_group": "low", "result": "MESH"},
}
MAKING = {
    "cells": ("mesh.omt_partition", {"cells": 3, "relax": 1, "write": "MESH"}),
    "points": ("mesh.omt_partition", {"cells": 12, "relax": 1, "write": "POINTS"}),
    "tets": ("object.omt_volume", {"tets": 150}),
    "new mesh": ("object.omt_remesh", {"target_vertices": 150}),
}
STANDS = {"sheared": ((1.4, 0.8, 1.1), (1.0, 1.7, 0.6)), "mirrored": ((-1.2, 0.9, 1.1), (1.0, 1.0, 1.0))}


def standing(stand, applied):
    """A body with a chosen vertex and a kept group, under a parent, or where that is applied to its mesh."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    V, F = limbed(2)
    obj = scenes.add(V, F, "Body")
    own, of_parent = STANDS[stand]
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.scale, parent.rotation_euler, parent.location = of_parent, (0.3, 0.5, -0.4), (1, 2, 0)
    obj.parent, obj.scale, obj.rotation_euler, obj.location = parent, own, (0.9, -0.2, 0.6), (0, 0, 1)
    bpy.context.view_layer.update()
    if applied:
        matrix = obj.matrix_world.copy()
        obj.parent = None
        obj.matrix_world = np.eye(4).tolist()
        obj.data.transform(matrix)
        if matrix.determinant() < 0:
            obj.data.flip_normals()
        obj.data.update()
    far = V[:, 2].argsort()
    for vertex in obj.data.vertices:
        vertex.select = bool(vertex.index == far[-1])
    low = obj.vertex_groups.new(name="low")
    low.add(far[: len(far) // 4].tolist(), 1.0, "REPLACE")
    # What belongs by less than half does not count.
    low.add(far[-5:].tolist(), 0.4, "REPLACE")
    for edge in obj.data.edges:
        edge.select = False
    bpy.context.view_layer.update()
    scenes.select([obj])
    return obj


def points_of(obj):
    """Points (n,3) in the world, as the last shape key has them."""
    data = obj.data.shape_keys.key_blocks[-1].data if obj.data.shape_keys else obj.data.vertices
    own = np.array([v.co[:] for v in data])
    matrix = np.array(obj.matrix_world)
    return own @ matrix[:3, :3].T + matrix[:3, 3]


def normals_of(obj):
    """Normals (n,3) in the world: the attribute of points, those of faces of meshes."""
    matrix = np.array(obj.matrix_world)[:3, :3]
    if obj.data.polygons:
        own = np.array([p.normal[:] for p in obj.data.polygons])
    else:
        own = np.array([item.vector[:] for item in obj.data.attributes["normal"].data])
    found = own @ np.linalg.inv(matrix)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def middles_of(obj):
    """What its normals are at, (n,3) in the world."""
    points = points_of(obj)
    if not obj.data.polygons:
        return points
    return np.array([points[list(p.vertices)].mean(axis=0) for p in obj.data.polygons])


@pytest.mark.parametrize("stand", STANDS)
@pytest.mark.parametrize("kind", MOVING)
def test_what_moves_lies_where_a_mesh_without_a_transform_has_it(kind, stand):
    results = []
    for applied in (False, True):
        obj = standing(stand, applied)
        before = points_of(obj)
        assert bpy.ops.object.omt_flow(move=(0.1, 0.3, -0.2), **MOVING[kind]) == {"FINISHED"}
        results.append((before, points_of(obj)))
    (before, one), (_, other) = results
    assert np.abs(one - before).max() > 0.1
    np.testing.assert_allclose(one, other, atol=2e-4)
    if kind == "kept":
        stays = np.isclose(one, before, atol=1e-6).all(axis=1)
        # A quarter, and not those that belong to the group by less than half.
        assert stays.sum() == len(before) // 4


# Operators that measure, what they write, and whether one object is measured or two.
MEASURING = {
    "key": ("object.omt_strain", {"of": "KEY"}, "OMT Strain", False),
    "UVs": ("object.omt_strain", {"of": "UV"}, "OMT Strain", False),
    "pose": ("object.omt_strain", {"of": "OBJECT"}, "OMT Strain", True),
    "distance": ("object.omt_distance", {}, "OMT Distance", True),
}


def pose_and_key(stand, applied):
    """A body with a key and UVs, and a pose of it that stands elsewhere; or both with their transforms applied."""
    obj = standing(stand, False)
    bpy.ops.object.mode_set(mode="OBJECT")
    points = np.array([v.co[:] for v in obj.data.vertices])
    bent = points + np.stack([0.2 * points[:, 2] ** 2, 0.1 * points[:, 0], 0 * points[:, 0]], axis=1)
    other = scenes.add(1.1 * bent, [p.vertices[:] for p in obj.data.polygons], "Pose")
    other.scale, other.rotation_euler, other.location = (0.8, 1.2, 1.1), (0.2, 0.1, 0.7), (1.5, 2.5, 0.5)
    obj.shape_key_add(name="Basis")
    for item, place in zip(obj.shape_key_add(name="Bent").data, bent.tolist(), strict=True):
        item.co = place
    obj.active_shape_key_index = 1
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    bpy.context.view_layer.update()
    for each in (obj, other) if applied else ():
        matrix = each.matrix_world.copy()
        each.parent = None
        each.matrix_world = np.eye(4).tolist()
        # Corners stay in their order: lengths are all that is measured.
        each.data.transform(matrix, shape_keys=True)
        each.data.update()
    bpy.context.view_layer.update()
    return obj, other


@pytest.mark.parametrize("stand", STANDS)
@pytest.mark.parametrize("kind", MEASURING)
def test_what_is_measured_is_what_a_mesh_without_a_transform_has(package, monkeypatch, kind, stand):
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 500)
    operator, arguments, attribute, both = MEASURING[kind]
    module, verb = operator.split(".")
    found = []
    for applied in (False, True):
        obj, other = pose_and_key(stand, applied)
        scenes.select([other, obj] if both else [obj])
        assert getattr(getattr(bpy.ops, module), verb)(**arguments) == {"FINISHED"}
        items = obj.data.attributes[attribute].data
        values = np.zeros(len(items), np.float32)
        items.foreach_get("value", values)
        found.append(values)
    assert np.ptp(found[0]) > 0.05
    np.testing.assert_allclose(*found, atol=2e-4)


@pytest.mark.parametrize("stand", STANDS)
@pytest.mark.parametrize("name", MAKING)
def test_what_is_made_lies_on_the_body_and_looks_where_it_does(name, stand):
    operator, arguments = MAKING[name]
    module, verb = operator.split(".")
    obj = standing(stand, False)
    points = points_of(obj)
    size = np.ptp(points, axis=0)
    tree = BVHTree.FromPolygons(points.tolist(), [p.vertices[:] for p in obj.data.polygons])
    outward = normals_of(obj)
    assert getattr(getattr(bpy.ops, module), verb)(**arguments) == {"FINISHED"}
    (made,) = (o for o in bpy.data.objects if o.type == "MESH" and o.name != "Body")
    if name != "points":
        np.testing.assert_allclose(points_of(made).min(axis=0), points.min(axis=0), atol=0.05 * size.max())
        np.testing.assert_allclose(points_of(made).max(axis=0), points.max(axis=0), atol=0.05 * size.max())
    if name == "tets":
        return
    away, alike = [], []
    for middle, normal in zip(middles_of(made).tolist(), normals_of(made), strict=True):
        _, _, face, distance = tree.find_nearest(middle)
        away.append(distance)
        alike.append(normal @ outward[face])
    assert max(away) < 0.04 * size.max() and np.mean(np.array(alike) > 0.7) > 0.95, (max(away), np.mean(alike))
