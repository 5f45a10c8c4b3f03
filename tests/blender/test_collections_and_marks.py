"""New objects stand in the collections of what they are made of, and edges carry the marks that they are given."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("linked", [0, 1, 2])
def test_a_new_body_stands_where_the_old_one_does(package, linked):
    """One that stands nowhere, as a library's, gives the scene's own collection."""
    obj = scenes.cube()
    material = bpy.data.materials.new("red")
    obj.data.materials.append(material)
    for collection in list(obj.users_collection):
        collection.objects.unlink(obj)
    chosen = [bpy.data.collections.new(f"C{k}") for k in range(linked)]
    for collection in chosen:
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(obj)
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    new = package("blender.volumes.tet_objects")._added("New", obj, points, np.array([[0, 1, 2]]))
    assert set(new.users_collection) == set(chosen or [bpy.context.scene.collection])
    assert list(new.data.materials) == [material] and len(new.data.vertices) == 3


@pytest.mark.parametrize("seam", ["none", "some", "all"])
@pytest.mark.parametrize("sharp", ["none", "some", "all"])
def test_edges_carry_their_seams_creases_and_sharp_marks(package, seam, sharp):
    obj = scenes.bump(3, 3)
    mesh = obj.data
    order = np.random.default_rng(0).permutation(len(mesh.edges))
    edges = np.array([tuple(mesh.edges[k].vertices) for k in order.tolist()])[:, ::-1]
    flags = {
        "none": np.zeros(len(edges), bool),
        "some": np.arange(len(edges)) % 3 == 0,
        "all": np.ones(len(edges), bool),
    }
    crease = np.where(np.arange(len(edges)) % 4 == 1, 0.5, 0.0)
    marks = package("pipelines.attributes").Marks(edges, flags[seam], flags[sharp], crease)
    package("blender.write_attributes")._write_marks(mesh, marks)
    assert [mesh.edges[k].use_seam for k in order.tolist()] == flags[seam].tolist()
    assert [mesh.edges[k].use_edge_sharp for k in order.tolist()] == flags[sharp].tolist()
    found = [mesh.attributes["crease_edge"].data[k].value for k in order.tolist()]
    np.testing.assert_allclose(found, crease)
