"""Materials of an OBJ file get its name, and never take that of somebody else's."""

from __future__ import annotations

import bpy

import pytest
import scenes

from omt_uv.files.obj_materials import place_materials


def made_in(folder, materials=b"newmtl a\n"):
    made = folder / "tmp.obj"
    made.write_bytes(b"# mtllib tmp.mtl\nmtllib tmp.mtl\nv 0 0 0\n")
    if materials is not None:
        made.with_suffix(".mtl").write_bytes(materials)
    return made


def test_materials_take_the_name_of_their_file(tmp_path):
    made, companions = made_in(tmp_path), {}
    assert place_materials(made, tmp_path / "out.obj", companions) == []
    assert companions == {tmp_path / "tmp.mtl": tmp_path / "out.mtl"}
    assert made.read_bytes() == b"# mtllib tmp.mtl\nmtllib out.mtl\nv 0 0 0\n"


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
@pytest.mark.parametrize("name", ["out", "tmp", r"a\1b (c)"])
def test_the_line_that_names_materials_is_renamed_and_no_other(tmp_path, name, end):
    """Neither a remark, nor an object or a group of that name."""
    made, companions = made_in(tmp_path), {}
    (tmp_path / "to").mkdir()
    lines = [b"# tmp.mtl", b"mtllib tmp.mtl.mtl", b"o tmp.mtl", b"mtllib tmp.mtl", b"g mtllib tmp.mtl", b"v 0 0 0"]
    made.write_bytes(end.join(lines))
    assert place_materials(made, tmp_path / "to" / f"{name}.obj", companions) == []
    lines[3] = f"mtllib {name}.mtl".encode()
    assert made.read_bytes() == end.join(lines)


def test_what_others_have_written_stays_and_what_is_the_same_is_taken(tmp_path):
    (tmp_path / "out.mtl").write_bytes(b"newmtl other\n")
    (tmp_path / "out_1.mtl").write_bytes(b"newmtl third\n")
    made, companions = made_in(tmp_path), {}
    (told,) = place_materials(made, tmp_path / "out.obj", companions)
    assert told.startswith("out.mtl holds other materials") and "out_2.mtl has these" in told
    assert companions == {tmp_path / "tmp.mtl": tmp_path / "out_2.mtl"}
    (tmp_path / "out_1.mtl").write_bytes(b"newmtl a\n")
    made = made_in(tmp_path)
    (told,) = place_materials(made, tmp_path / "out.obj", companions)
    assert "out_1.mtl has these" in told
    (tmp_path / "out.mtl").write_bytes(b"newmtl a\n")
    assert place_materials(made_in(tmp_path), tmp_path / "out.obj", companions) == []
    assert (tmp_path / "out_1.mtl").read_bytes() == b"newmtl a\n"


def test_without_materials_nothing_is_named(tmp_path):
    made, companions = made_in(tmp_path, None), {}
    before = made.read_bytes()
    assert place_materials(made, tmp_path / "out.obj", companions) == [] and not companions
    assert made.read_bytes() == before


@pytest.mark.parametrize("index", [[0, 0, 1, 2], [2, 0, 1, 0], [1, 0, 2, 2], [0, 3, 0, 1]])
def test_faces_keep_their_order_and_their_materials(package, tmp_path, index):
    """The exporter sorts faces by material; the third slot is empty, and the fourth the first once more."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    one, other = scenes.bump(2, 2, name="One of two"), scenes.bump(1, 2, name="Other")
    red, blue = (bpy.data.materials.new(name) for name in ("Red paint", "Blue"))
    for material in (red, blue, None, red):
        one.data.materials.append(material)
    one.data.polygons.foreach_set("material_index", index)
    for slot in (1, 3):
        one.data.polygons[slot].use_smooth = False
    other.data.materials.append(blue)
    faces = [[vertex for polygon in obj.data.polygons for vertex in polygon.vertices] for obj in (one, other)]
    assert package("files.export").export(tmp_path / "out.obj", ".obj", [one, other], False) == []
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(tmp_path / "out.obj"), forward_axis="Y", up_axis="Z")
    one, other = (bpy.data.objects[name] for name in ("One_of_two", "Other"))
    assert faces == [[vertex for polygon in obj.data.polygons for vertex in polygon.vertices] for obj in (one, other)]
    # Blender's importer makes a material of none.
    names = ["Red_paint", "Blue", "Material", "Red_paint"]
    there = [one.material_slots[polygon.material_index].material.name for polygon in one.data.polygons]
    assert there == [names[k] for k in index] and [slot.name for slot in other.material_slots] == ["Blue"]
