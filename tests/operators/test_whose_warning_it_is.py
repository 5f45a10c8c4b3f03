"""Of several objects in one run one alone gives a reason for a warning: it is the one that is named."""

from __future__ import annotations

import bpy

import bmesh
import meshes
import numpy as np
import pytest
import scenes

NAMES = ("First", "Second", "Third")


def bodies():
    """Three bodies that differ, all of them selected."""
    objects = []
    V, F = meshes.icosphere(1)
    for k, name in enumerate(NAMES):
        points = V * [1, 1, 1 + 0.1 * k]
        points[:, 2] += 0.2 * np.sin(3 * V[:, 0] + k)
        obj = scenes.add((1 + 0.25 * k) * points + [4 * k, 0, 0], F, name)
        objects.append(obj)
    scenes.select(objects)
    return objects


def fin(obj):
    """A face that stands on an edge, where three meet then."""
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    mesh.edges.ensure_lookup_table()
    edge = mesh.edges[0]
    middle = 1.6 * (edge.verts[0].co + edge.verts[1].co) / 2
    mesh.faces.new([*edge.verts, mesh.verts.new(middle)])
    mesh.to_mesh(obj.data)
    mesh.free()


def turned(obj):
    for face in (3, 40):
        obj.data.polygons[face].flip()


def texts(obj):
    obj.data.attributes.new("words", "STRING", "POINT")


def displaced(obj):
    obj.modifiers.new("Wave", "DISPLACE")


def thin(obj):
    """So slender that cells are torn where they follow faces."""
    mesh = bmesh.new()
    mesh.from_mesh(obj.data)
    bmesh.ops.delete(mesh, geom=mesh.faces[12:], context="FACES")
    mesh.to_mesh(obj.data)
    mesh.free()


RUNS = {
    "unwrap a fin": ("uv.omt_unwrap", {"quality": "DRAFT", "max_shear": 0.0}, fin),
    "unwrap faces turned over": ("uv.omt_unwrap", {"quality": "DRAFT", "max_shear": 0.0}, turned),
    "unwrap before a modifier": ("uv.omt_unwrap", {"quality": "DRAFT", "max_shear": 0.0}, displaced),
    "seams of a fin": ("uv.omt_seams", {"max_shear": 0.0}, fin),
    "seams of faces turned over": ("uv.omt_seams", {"max_shear": 0.0}, turned),
    "remesh texts": ("object.omt_remesh", {"target_vertices": 20}, texts),
    "remesh faces turned over": ("object.omt_remesh", {"target_vertices": 20}, turned),
    "cells of few faces": ("mesh.omt_partition", {"cells": 30, "relax": 0, "write": "FACE_SETS"}, thin),
}


def called(name, given):
    group, _, function = name.partition(".")
    return getattr(getattr(bpy.ops, group), function)(**given)


@pytest.mark.parametrize("run", RUNS)
def test_a_warning_names_the_object_that_gives_the_reason(package, capfd, run):
    name, given, change = RUNS[run]
    scenes.open_empty()
    # The active one, which is the last of these, comes first.
    change(bodies()[1])
    capfd.readouterr()
    assert called(name, given) == {"FINISHED"}
    told = [line for line in capfd.readouterr().out.splitlines() if line.startswith("Warning: ")]
    named = [[other for other in NAMES if other in line] for line in told]
    assert [NAMES[1]] in named and all(names in ([], [NAMES[1]]) for names in named), told
