"""Cells, seams and shape keys written to meshes: in both modes alike, beside what is there."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes


def faces_of(obj, name):
    if obj.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    return [x.value for x in obj.data.attributes[name].data]


@pytest.mark.parametrize("edit", [False, True])
@pytest.mark.parametrize("there", [False, True])
def test_numbers_of_cells_are_written_to_their_faces_and_others_keep_theirs(package, edit, there):
    cells = package("blender.shapes.cell_faces")
    obj = scenes.cube()
    if there:
        old = obj.data.attributes.new("numbers", "INT", "FACE")
        old.data.foreach_set("value", np.arange(10, 16, dtype=np.int32))
    if edit:
        scenes.edit(obj, faces=[])
    cells._write_integers(obj.data, "numbers", np.array([1, 4]), np.array([7, 9]), -3)
    expected = np.arange(10, 16) if there else np.full(6, -3)
    expected[[1, 4]] = [7, 9]
    assert faces_of(obj, "numbers") == expected.tolist()


@pytest.mark.parametrize("edit", [False, True])
@pytest.mark.parametrize("slots", [0, 2])
def test_each_cell_has_a_material_behind_those_that_are_there(package, edit, slots):
    cells = package("blender.shapes.cell_faces")
    obj = scenes.cube()
    for k in range(slots):
        obj.data.materials.append(bpy.data.materials.new(f"old {k}"))
    if edit:
        scenes.edit(obj, faces=[])
    cells._write_materials(obj, np.array([0, 2, 5]), np.array([10, 0, 1]))
    if edit:
        bpy.ops.object.mode_set(mode="OBJECT")
    names = [material.name for material in obj.data.materials]
    assert len(names) == slots + 11 and names[slots : slots + 2] == ["Cube 01", "Cube 02"] and names[-1] == "Cube 11"
    index = [polygon.material_index for polygon in obj.data.polygons]
    assert index == [slots + 10, 0, slots, 0, 0, slots + 1]
    colours = [tuple(m.diffuse_color) for m in obj.data.materials[slots:]]
    assert len(set(colours)) == 11 and all(c[3] == 1 for c in colours)
    for one, other in pairwise(colours):
        assert max(abs(a - b) for a, b in zip(one, other, strict=True)) > 0.1


@pytest.mark.parametrize(("write", "name", "plus", "other"), [("face_sets", ".sculpt_face_set", 1, 1),
                                                              ("attribute", "omt_cell", 0, -1)])  # fmt: skip
def test_cells_become_face_sets_or_an_attribute(package, write, name, plus, other):
    cells = package("blender.shapes.cell_faces")
    obj = scenes.cube()
    partition = SimpleNamespace(cell=np.array([2, -1, 0, 1, -1, 2]), borders=None)
    cells.write_cells(obj, partition, write)
    (made,) = (n for n in obj.data.attributes.keys() if n in (cells.FACE_SETS, cells.CELL_ATTRIBUTE))  # noqa: SIM118
    assert made == {"face_sets": cells.FACE_SETS, "attribute": cells.CELL_ATTRIBUTE}[write]
    assert faces_of(obj, made) == [2 + plus, other, plus, 1 + plus, other, 2 + plus] and name


def test_seams_are_marked_beside_those_that_are(package):
    objects = package("blender.shapes.match_objects")
    obj = scenes.cube()
    before = {frozenset(e.vertices) for e in obj.data.edges if e.use_seam}
    free = [frozenset(e.vertices) for e in obj.data.edges if not e.use_seam]
    edges = np.array([sorted(free[0], reverse=True), sorted(free[1])])
    for seam in ([False, False], [True, False], [True, True]):
        attributes = SimpleNamespace(marks=SimpleNamespace(edges=edges, seam=np.array(seam)))
        objects._write_seams(obj.data, attributes)
        expected = before | {e for e, s in zip(free[:2], seam, strict=True) if s}
        assert {frozenset(e.vertices) for e in obj.data.edges if e.use_seam} == expected


@dataclass
class Key:
    name: str
    offsets: np.ndarray
    relative_to: int = 0
    settings: dict = field(default_factory=dict)


@pytest.mark.parametrize("there", [False, True])
def test_shape_keys_are_relative_to_that_of_the_object(package, there):
    objects = package("blender.shapes.match_objects")
    obj = scenes.cube()
    if there:
        for name in ("Own", "Smile"):
            obj.shape_key_add(name=name, from_mix=False)
    base = np.array([v.co[:] for v in obj.data.vertices])
    rng = np.random.default_rng(0)
    keys = [Key("Basis", np.zeros((8, 3))), Key("Smile", rng.normal(size=(8, 3)), 0, {"value": 0.25, "mute": True}),
            Key("Wide", rng.normal(size=(8, 3)), 1)]  # fmt: skip
    inverse = np.diag([2.0, 1, 0.5])
    assert objects._write_keys(obj, SimpleNamespace(keys=keys[:1]), inverse) == []
    assert (obj.data.shape_keys is not None) == there
    assert objects._write_keys(obj, SimpleNamespace(keys=keys), inverse) == ["Smile", "Wide"]
    blocks = obj.data.shape_keys.key_blocks
    assert list(blocks.keys()) == ["Own" if there else "Basis", "Smile", "Wide"]
    for key in keys[1:]:
        found = np.array([x.co[:] for x in blocks[key.name].data])
        np.testing.assert_allclose(found, base + key.offsets @ inverse.T, atol=1e-6)
    assert blocks["Smile"].value == 0.25 and blocks["Smile"].mute and not blocks["Wide"].mute
    assert blocks["Smile"].relative_key == blocks[0] and blocks["Wide"].relative_key == blocks["Smile"]


@pytest.mark.parametrize("width, data_type", [((), "FLOAT"), ((3,), "FLOAT_VECTOR")])
def test_a_layer_that_is_there_is_written_and_none_beside_it(package, width, data_type):
    write, attributes = package("blender.write_attributes"), package("pipelines.attributes")
    mesh = scenes.cube().data
    for of in (1.0, 2.0):
        values = np.full((8, *width), of, np.float32)
        write.write_layer(mesh, attributes.Layer("mine", "POINT", data_type, values))
        assert [a.name for a in mesh.attributes if a.name.startswith("mine")] == ["mine"]
        found = np.zeros(values.size, np.float32)
        mesh.attributes["mine"].data.foreach_get("vector" if width else "value", found)
        assert (found == of).all()
