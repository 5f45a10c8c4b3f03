"""object.omt_volume: tetrahedra, shells, points, slices and attributes; undo and bad input."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from bodies import icosphere, limbed

from omt_uv.solver.flows.enclosed_volume import component_volumes


def body(name="Body"):
    obj = scenes.add(*limbed(2), name)
    obj.scale = (2, 2, 2)
    bpy.context.view_layer.update()
    return obj


def arrays(obj):
    mesh = obj.data
    points = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    return points.reshape(-1, 3).astype(float), np.array([p.vertices[:] for p in mesh.polygons])


def test_every_result_is_made(package):
    obj = body()
    V, F = limbed(2)
    whole = 8 * component_volumes(V, F)[0][0]
    few = {"tets": 1200}
    before = scenes.state(obj) if hasattr(scenes, "state") else None
    assert bpy.ops.object.omt_volume(result="SHELLS", shells=1, **few) == {"FINISHED"}
    shell = bpy.data.objects["Body Shell 1"]
    assert component_volumes(*arrays(shell))[0].sum() == pytest.approx(whole / 2, rel=1e-3)
    assert bpy.context.view_layer.objects.active == shell
    scenes.select([obj])
    assert bpy.ops.object.omt_volume(result="POINTS", points=500, **few) == {"FINISHED"}
    assert len(bpy.data.objects["Body Points"].data.vertices) == 500
    scenes.select([obj])
    assert bpy.ops.object.omt_volume(result="SLICE", axis="Z", **few) == {"FINISHED"}
    cut = bpy.data.objects["Body Slice"].data
    # Red where it grows, blue where it shrinks.
    logs, colours = np.zeros(len(cut.polygons), np.float32), np.zeros(4 * len(cut.loops), np.float32)
    cut.attributes["OMT Dilation"].data.foreach_get("value", logs)
    cut.color_attributes[0].data.foreach_get("color", colours)
    red, _, blue, _ = colours.reshape(-1, 3, 4)[:, 0].T
    assert (np.sign(red - blue) == np.sign(logs))[np.abs(logs) > 0.01].all() and np.abs(logs).max() > 0.1
    scenes.select([obj])
    assert bpy.ops.object.omt_volume(result="TETS", **few) == {"FINISHED"}
    tets = bpy.data.objects["Body Tetrahedra"].data
    places = np.zeros(3 * len(tets.vertices), np.float32)
    tets.attributes["OMT Ball"].data.foreach_get("vector", places)
    radius = np.linalg.norm(places.reshape(-1, 3), axis=1)
    np.testing.assert_allclose(radius[: len(V)], 1, atol=1e-6)
    assert radius.max() < 1 + 1e-6 and len(tets.polygons) > 2000
    assert "OMT Ball" not in obj.data.attributes and before == (scenes.state(obj) if before else None)


def test_what_is_made_has_the_materials_and_a_slice_lies_where_it_shall():
    obj = body()
    obj.location = (5, 0, 0)
    obj.data.materials.append(bpy.data.materials.new("Paint"))
    bpy.context.view_layer.update()
    assert bpy.ops.object.omt_volume(result="SLICE", axis="X", place=0.25, tets=200) == {"FINISHED"}
    made = bpy.data.objects["Body Slice"]
    assert len(made.data.vertices) > 3
    x = 5 + 2 * np.array([v.co.x for v in obj.data.vertices])
    np.testing.assert_allclose([v.co.x for v in made.data.vertices], x.min() + 0.25 * np.ptp(x), atol=1e-4)
    assert [m.name for m in made.data.materials] == ["Paint"]


def test_the_attribute_is_undone_in_one_step():
    obj = body()
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.object.omt_volume(result="ATTRIBUTE", tets=1000, domain="CUBE") == {"FINISHED"}
    assert "OMT Ball" in obj.data.attributes
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert "OMT Ball" not in bpy.data.objects["Body"].data.attributes


def test_bad_bodies_are_named_and_nothing_is_made(monkeypatch):
    V, F = icosphere(2)
    scenes.add(V, F[1:], "Open")
    count = len(bpy.data.objects)
    assert "Open: The surface is not closed" in scenes.error_of(bpy.ops.object.omt_volume, tets=500)
    pushed = V.copy()
    pushed[V[:, 2].argmax()] = [0.1, 0.2, -1.5]
    scenes.select([scenes.add(pushed, F, "Pushed")])
    assert "pass through one another" in scenes.error_of(bpy.ops.object.omt_volume, tets=500)
    assert "no mesh ''" in scenes.error_of(bpy.ops.object.omt_volume, domain="BODY")
    monkeypatch.setitem(sys.modules, "tetgen", None)
    scenes.select([scenes.add(V, F, "Ball")])
    assert "pip install tetgen" in scenes.error_of(bpy.ops.object.omt_volume, tets=500)
    assert len(bpy.data.objects) == count + 2


def test_faces_that_are_wrong_are_those_of_the_mesh_and_are_selected():
    """Of a mesh of quads its triangles are others, and there are more of them."""
    cube = scenes.cube()
    mesh = cube.data
    points, faces = [tuple(v.co) for v in mesh.vertices], [tuple(p.vertices) for p in mesh.polygons]
    obj = scenes.add(points, [*faces, faces[3][:3], faces[3][:3]], "Twice")
    scenes.select([obj])
    told = scenes.error_of(bpy.ops.object.omt_volume, tets=100)
    assert "Traceback" not in told and "(3 faces: 3, 6, 7)" in told, told
    assert [p.index for p in obj.data.polygons if p.select] == [3, 6, 7]


@pytest.mark.parametrize("library", ["TETGEN", "TETWILD"])
@pytest.mark.parametrize(
    "there", [(), ("tetgen",), ("pytetwild",), ("pyvista",), ("pytetwild", "pyvista"), ("tetgen", "pyvista")]
)
def test_a_library_is_missing_as_long_as_one_of_its_packages_is(package, monkeypatch, library, there):
    """What is named is all that pip shall install."""
    module = package("operators.volumes.volume")
    find = lambda name: object() if name in there else None  # noqa: E731
    monkeypatch.setattr(module, "importlib", SimpleNamespace(util=SimpleNamespace(find_spec=find)))
    needed = module.PACKAGES[library]
    assert module.missing(library) == ("" if set(needed) <= set(there) else " ".join(needed))
