"""What is refused of objects, by what is wrong with them, beside what just goes."""

from __future__ import annotations

import types

import bpy

import numpy as np
import pytest
import scenes


def refused(kind, words, function, *arguments):
    """A function refuses with an error of a kind that says so."""
    with pytest.raises(Exception, match=words) as caught:
        function(*arguments)
    assert type(caught.value).__name__ == kind


def layered(count):
    obj = scenes.bump()
    for k in range(count):
        obj.data.uv_layers.new(name=f"UV {k}")
    return obj


def test_a_mesh_takes_eight_uv_layers(package):
    module = package("blender.mesh")
    obj = layered(7)
    assert module.target_layer(obj, "one more") == "one more" and len(obj.data.uv_layers) == 8
    refused("TargetError", "another UV layer|8", module.target_layer, obj, "too many")
    assert module.target_layer(obj, "UV 3") == "UV 3" == obj.data.uv_layers.active.name


def test_regions_of_an_attribute_are_few(package):
    module = package("blender.measuring.region_labels")
    obj = scenes.bump(40, 30)
    attribute = obj.data.attributes.new("part", "INT", "FACE")
    reading = package("blender.mesh").read(obj)
    for count, good in ((module.MOST_VALUES, True), (module.MOST_VALUES + 1, False)):
        attribute = obj.data.attributes["part"]
        attribute.data.foreach_set("value", (np.arange(1200) % count).astype(np.int32))
        if good:
            assert len(module._values([(obj, reading)], "part")) == count
        else:
            refused("RegionError", f"{count} different values", module._values, [(obj, reading)], "part")


def test_faces_without_a_material_are_a_region_of_their_own(package):
    module = package("blender.measuring.region_labels")
    obj = scenes.bump()
    reading = package("blender.mesh").read(obj)
    assert module._materials([(obj, reading)]) == []
    obj.data.materials.append(bpy.data.materials.new("red"))
    obj.data.materials.append(None)
    for face in obj.data.polygons:
        face.material_index = face.index % 2
    names = [getattr(row, "name", row[0] if isinstance(row, tuple) else row) for row in
             module._materials([(obj, reading)])]  # fmt: skip
    assert sorted(names) == ["no material", "red"]


def test_a_match_refuses_what_has_no_faces_or_no_height_or_no_room(package):
    module = package("blender.shapes.match_objects")
    refused("EmptyMeshError", "no faces", module.read_carrier, scenes.add([(0, 0, 0), (1, 0, 0)], [], "Line"))
    obj = scenes.bump()
    found = module.read_carrier(obj)
    assert len(found.surface.triangles) == 96 and np.allclose(found.stretch, np.eye(3))
    obj.scale.z = 0
    bpy.context.view_layer.update()
    refused("MatchError", "scale of the object is zero", module.read_carrier, obj)
    source = module.read_carrier(layered(3))
    for there, good in ((5, True), (6, False)):
        other = scenes.bump()
        for k in range(there):
            other.data.uv_layers.new(name=f"own {k}")
        if good:
            module.check_room(other, source.attributes, {"uv"})
        else:
            refused("MatchError", "more than 8 UV maps", module.check_room, other, source.attributes, {"uv"})
            module.check_room(other, source.attributes, {"groups"})
    locked = scenes.bump()
    locked.vertex_groups.new(name="mine")
    module.check_room(locked, source.attributes, {"uv", "groups"})


def test_a_shape_key_that_is_not_there_is_named(package):
    module = package("blender.shapes.strain")
    obj = scenes.bump()
    reading = package("blender.mesh").read(obj)
    refused("StrainError", "no shape key 'Smile'", module.strain_rows, obj, reading, "Smile")
    refused("StrainError", "UV map", module.strain_rows, obj, reading)
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Smile").data[20].co.z += 0.3
    rows = module.strain_rows(obj, reading, "Smile")
    assert rows[0].name == "all" and rows[0].greatest > 0.01


@pytest.mark.parametrize(("scale", "good"), [(1e-8, True), (0.0, False)])
def test_a_body_of_no_width_does_not_flow(package, scale, good):
    module = package("blender.volumes.bodies")
    obj = scenes.bump()
    obj.scale.x = scale
    bpy.context.view_layer.update()
    if good:
        assert np.allclose(module._matrix(obj), np.diag([scale, 1, 1, 1]))
    else:
        refused("NonFiniteError", "cannot be undone", module._matrix, obj)


def test_cells_need_slots_and_attributes_of_their_kind(package):
    module = package("blender.shapes.cell_faces")
    obj = scenes.bump()
    for write in ("face_sets", "attribute", "materials", "seams"):
        module.check_cells(obj, write)
    obj.data.attributes.new(module.CELL_ATTRIBUTE, "FLOAT", "FACE")
    refused("TargetError", "another attribute", module.check_cells, obj, "attribute")
    module.check_cells(obj, "face_sets")
    obj.data.attributes.remove(obj.data.attributes[module.CELL_ATTRIBUTE])
    obj.data.attributes.new(module.CELL_ATTRIBUTE, "INT", "POINT")
    refused("TargetError", "another attribute", module.check_cells, obj, "attribute")


def test_values_of_faces_are_written_to_no_linked_mesh(package, tmp_path):
    module = package("blender.measuring.face_attributes")
    scenes.bump(name="Far")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "far.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "far.blend"), link=True) as (_, data):
        data.objects = ["Far"]
    refused("AttributeTargetError", "Make it local", module.write_face_values, data.objects[0], {})


def test_an_image_of_no_pixels_or_another_number_of_channels_is_named(package):
    module = package("files.images")
    image = bpy.data.images.new("Picture", 4, 2)
    assert module.pixels_of(image).shape == (2, 4, 4)
    missing = bpy.data.images.new("Gone", 4, 2)
    missing.source, missing.filepath = "FILE", "//nowhere.png"
    missing.reload()
    refused("ImageError", "'Gone' has no pixels", module.pixels_of, missing)
    grey = types.SimpleNamespace(name="Grey", size=(4, 2), channels=1)
    refused("ImageError", "'Grey' has 1 channels. Convert it to RGBA", module.pixels_of, grey)


def test_what_an_operator_needs_is_told_and_nothing_is_done(package):
    first = scenes.bump()
    other = first.copy()
    bpy.context.collection.objects.link(other)
    scenes.select([first, other])
    assert "share their mesh" in scenes.error_of(bpy.ops.object.omt_match)
    scenes.select([first])
    assert "Select two mesh objects" in scenes.error_of(bpy.ops.object.omt_match)
    assert "has no UV map" in scenes.error_of(bpy.ops.object.omt_strain, of="UV")


def test_an_image_is_whole_only_with_its_end_and_its_size(package, tmp_path):
    module = package("files.images")
    image = bpy.data.images.new("Picture", 4, 2)
    image.filepath_raw, image.file_format = str(tmp_path / "one.png"), "PNG"
    image.save()
    module.check_whole(tmp_path / "one.png")
    module.check_whole(tmp_path / "one.png", (4, 2))
    refused("RuntimeError", "cannot be read again", module.check_whole, tmp_path / "one.png", (2, 4))
    refused("RuntimeError", "nothing was written", module.check_whole, tmp_path / "none.png")
    data = (tmp_path / "one.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(data[:-1])
    refused("RuntimeError", "end of the picture is missing", module.check_whole, tmp_path / "cut.png")
    (tmp_path / "noise.jpg").write_bytes(bytes(range(200)))
    refused("RuntimeError", "cannot be read again", module.check_whole, tmp_path / "noise.jpg")
    assert [i.name for i in bpy.data.images] == ["Picture"]


def test_landmarks_of_a_body_are_its_groups_of_that_name_that_have_vertices(package):
    module = package("blender.volumes.tet_objects")
    obj = scenes.bump()
    for name, vertices in (("LM_nose", [3]), ("LM_none", []), ("other", [4]), ("LM_ears", [5, 9])):
        obj.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
    found = module.read_volume_body(obj).landmarks
    assert {name: rows.tolist() for name, rows in found.items()} == {"LM_nose": [3], "LM_ears": [5, 9]}


def test_an_object_that_is_nowhere_is_refused_by_its_transformation(package):
    obj = scenes.bump()
    obj.scale.x = np.nan
    bpy.context.view_layer.update()
    refused("NonFiniteError", "transformation of the object is not finite", package("blender.mesh").read, obj)
