"""What vertices have in a PLY file, and how many there are; what is welded of what a format had to split."""

from __future__ import annotations

import argparse
from itertools import product

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture(autouse=True)
def blender(package):
    """An empty file, with OMT UV registered."""
    scenes.open_empty()


def fans(uvs):
    """Triangles that have one vertex in common and nothing else, each with a UV of its own there."""
    points, faces = [(0.0, 0.0, 0.0)], []
    for k in range(len(uvs)):
        turn = 2 * np.pi * k / len(uvs)
        faces.append((0, len(points), len(points) + 1))
        points += [(np.cos(turn), np.sin(turn), 0.3 * k), (np.cos(turn + 0.4), np.sin(turn + 0.4), 0.1)]
    obj = scenes.add(points, faces)
    corners = scenes.seen_from_above(obj, 0.3, (0.5, 0.5))
    for k, place in enumerate(uvs):
        corners[3 * k] = place
    scenes.set_uv(obj, corners)
    return obj, corners


A, B, C = (0.1, 0.2), (0.3, 0.4), (0.5, 0.6)


@pytest.mark.parametrize("uvs", [(A, A, A), (A, B, B), (A, B, C), (B, A, B, A), (A, B, C, B, A), (A, C, C, C)], ids=len)
def test_a_vertex_is_split_into_as_many_as_it_has_uvs(package, uvs):
    obj, corners = fans(uvs)
    mesh = obj.data.copy()
    package("files.export")._cut_uv_seams(mesh)
    assert len(mesh.vertices) == len(obj.data.vertices) + len(set(uvs)) - 1
    vertex = np.array([loop.vertex_index for loop in mesh.loops])
    found = np.array([[mesh.attributes[name].data[v].value for name in "st"] for v in vertex])
    np.testing.assert_allclose(found, corners, atol=1e-7)


KINDS = ("FLOAT", "FLOAT_COLOR", "INT")


@pytest.mark.parametrize(("kind", "active", "lacking"), list(product(KINDS, (True, False), (True, False))))
def test_attributes_that_some_lack_are_made_and_colours_left_out_but_for_those_that_are_shown(
    package, kind, active, lacking
):
    """The colour that is shown is written by itself."""
    meshes = [scenes.bump(1, 1, name=name).data for name in "AB"]
    meshes[0].attributes.new("first", "FLOAT_COLOR", "POINT")
    for mesh in meshes[: 1 if lacking else 2]:
        mesh.attributes.new("mine", kind, "POINT")
    is_colour = kind == "FLOAT_COLOR"
    meshes[0].attributes.active_color_name = "mine" if active and is_colour else "first"
    if not lacking and is_colour:
        meshes[1].attributes.active_color_name = "mine" if active else ""
    told = package("files.export")._with_like_attributes(meshes)
    named = [name for name in ("first", "mine") for text in told if f"named {name};" in text]
    # Of the two colours the one that is not shown is left out where the other mesh lacks it.
    expected = ["first"] if is_colour and active else []
    expected += ["mine"] if is_colour and lacking and not active else []
    assert named == expected
    there = [("mine" in mesh.attributes) for mesh in meshes]
    assert there == [("mine" not in expected)] + [("mine" not in expected) and (not lacking or not is_colour)]


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj", ".ply", ".blend"])
def test_vertices_are_as_many_as_the_mesh_had_in_every_format(package, suffix, tmp_path):
    obj = scenes.cube()
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.5))
    path = tmp_path / f"cube{suffix}"
    if suffix == ".gltf":
        scenes.export_gltf(path, export_format="GLTF_SEPARATE")
    else:
        package("files.saving").save(path, [obj])
    options = argparse.Namespace(input=path, output=None, object=[], scene="", skip_linked=False, strict=False, told=[])
    ((_, reading),) = package("commands.selection").read_file(options)
    assert len(np.unique(reading.surface.corner_vertex)) == 8
    assert bpy.context.mode == "OBJECT"
