"""What is written is counted in every format, what a format leaves out is named, and pictures keep their pixels."""

from __future__ import annotations

from itertools import product

import bpy

import numpy as np
import pytest
import scenes

FORMATS = (".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx")


def written(package, tmp_path, suffix, *objects):
    path = tmp_path / f"made{suffix}"
    package("files.export").export(path, suffix, list(objects), False)
    return path


def patch(name, more=0):
    """A patch of triangles with UVs, and so many more of them."""
    y, x = np.mgrid[0:4, 0:4]
    a = (y[:-1, :-1] * 4 + x[:-1, :-1]).ravel()
    faces = np.concatenate([np.column_stack([a, a + 1, a + 5]), np.column_stack([a, a + 5, a + 4])])
    points = np.column_stack([x.ravel(), y.ravel(), 0.3 * np.sin(x.ravel() * y.ravel())])
    obj = scenes.add(points, faces[: 12 + more], name)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.2))
    return obj


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_face_that_is_missing_is_seen(package, tmp_path, suffix):
    """A file of one face less than the mesh is none of it; that of the mesh itself, or of more, is."""
    less, same, more = (patch(f"Patch {k}", k) for k in (1, 2, 3))
    check, error = package("files.read_back").check, package("files.verified").FileError
    for obj, whole in ((same, True), (more, True), (less, False)):
        path = written(package, tmp_path, suffix, obj)
        if whole:
            check(path, suffix, [same])
        else:
            with pytest.raises(error, match="instead of"):
                check(path, suffix, [same])
        path.unlink()


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb", ".gltf", ".fbx"])
def test_uvs_that_are_missing_are_seen(package, tmp_path, suffix):
    obj, bare = patch("Patch"), patch("Bare")
    bare.data.uv_layers.remove(bare.data.uv_layers[0])
    with pytest.raises(package("files.verified").FileError, match="uv corners"):
        package("files.read_back").check(written(package, tmp_path, suffix, bare), suffix, [obj])


@pytest.mark.parametrize("suffix", FORMATS)
def test_modifiers_are_lost_but_those_of_rigs(package, suffix):
    """A rig goes where rigs go; what changes the shape goes nowhere."""
    losses, obj = package("files.losses").losses, patch("Patch")

    def named():
        return " ".join(losses(suffix, [obj]))

    assert "modifiers" not in named()
    obj.modifiers.new("Rig", "ARMATURE")
    assert "modifiers" not in named()
    for count, kind in enumerate(("SUBSURF", "SOLIDIFY"), 1):
        obj.modifiers.new(kind, kind)
        assert "modifiers (1)" in named(), count


def layered(domains=("CORNER", "CORNER")):
    """A patch with two UV maps, two colours, attributes of vertices and of faces, a seam and a crease."""
    obj = patch("Layered")
    mesh = obj.data
    mesh.uv_layers.new(name="Second")
    for name, domain in zip(("One", "Two"), domains, strict=True):
        mesh.color_attributes.new(name, "FLOAT_COLOR", domain)
    mesh.color_attributes.active_color = mesh.color_attributes["Two"]
    mesh.attributes.new("of_vertices", "FLOAT", "POINT")
    mesh.attributes.new("of_faces", "INT", "FACE")
    mesh.edges[2].use_seam = True
    mesh.attributes.new("crease_edge", "FLOAT", "EDGE").data[2].value = 0.5
    return obj


@pytest.mark.parametrize("domains", [("CORNER", "CORNER"), ("CORNER", "POINT"), ("POINT", "CORNER")])
@pytest.mark.parametrize("suffix", FORMATS)
def test_layers_and_marks_that_a_format_does_not_hold_are_named(package, tmp_path, suffix, domains):
    """They were lost without a word: what is named is what is not there when the file is read again."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = layered(domains)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    obj = bpy.data.objects["Layered"]
    told = " ".join(package("files.saving").save_uvs(tmp_path / f"out{suffix}", [obj], tmp_path / "in.blend"))
    (again,) = package("files.meshes").load(tmp_path / f"out{suffix}")
    mesh = again.data
    there = {
        "UV maps beside the one written": len(mesh.uv_layers) > 1,
        "colours beside the active ones": len(mesh.color_attributes) > 1 or "One_r" in mesh.attributes,
        "attributes": {"of_vertices", "of_faces"} <= set(mesh.attributes.keys()),
        "seams": any(edge.use_seam for edge in mesh.edges),
        "creases": "crease_edge" in mesh.attributes,
    }
    assert {kind: f"{kind} (1)" in told for kind in there} == {kind: not found for kind, found in there.items()}
    # An object that has none of them loses none.
    bare = package("files.losses").losses(suffix, [patch("Bare")])
    assert not any(f"{kind} (" in line for kind in there for line in bare)


@pytest.mark.parametrize("suffix", FORMATS)
def test_objects_that_a_format_does_not_hold_are_named(package, tmp_path, suffix):
    """Whatever is no mesh: curves and all else were left out of .obj and .ply without a word."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = patch("Patch")
    made = {
        "CURVE": bpy.data.curves.new("Curve", "CURVE"),
        "FONT": bpy.data.curves.new("Text", "FONT"),
        "META": bpy.data.metaballs.new("Meta"),
        "LATTICE": bpy.data.lattices.new("Lattice"),
        "SPEAKER": bpy.data.speakers.new("Speaker"),
        "VOLUME": bpy.data.volumes.new("Volume"),
    }
    made["CURVE"].bevel_depth = 0.1
    line = made["CURVE"].splines.new("POLY")
    line.points.add(1)
    line.points[1].co = (1, 0, 0, 1)
    made["FONT"].body = "A"
    made["META"].elements.new()
    made |= {kind: bpy.data.lights.new(kind, kind) for kind in ("AREA", "POINT", "SPOT", "SUN")}
    for name, data in made.items():
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    told = " ".join(package("files.saving").save_uvs(tmp_path / f"out{suffix}", [obj], tmp_path / "in.blend"))
    package("files.meshes").load(tmp_path / f"out{suffix}")
    shapes = {obj.name.split(".")[0] for obj in bpy.data.objects if obj.type == "MESH"}
    assert ("curves and texts (2)" in told) == (not {"CURVE", "FONT"} <= shapes)
    assert ("metaballs (1)" in told) == ("META" not in shapes)
    for word in ("lattices (1)", "speakers (1)", "volumes (1)"):
        assert word in told
    lights = {obj.data.type for obj in bpy.data.objects if obj.type == "LIGHT"}
    assert ("lights (4)" in told) == (not lights)
    # An FBX file holds them, though Blender reads them as points.
    assert ("area lights (1)" in told) == (bool(lights) and "AREA" not in lights and suffix != ".fbx")


@pytest.mark.parametrize("which", ["first", "second", "both"])
@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb", ".gltf"])
def test_colours_of_any_object_go_along(package, tmp_path, suffix, which):
    objects = [patch("First"), patch("Second")]
    for name, obj in zip(("first", "second"), objects, strict=True):
        # It shows no colours, which is no reason to leave them out.
        obj.data.materials.append(bpy.data.materials.new("Plain"))
        if which in (name, "both"):
            colour = obj.data.color_attributes.new("Colour", "BYTE_COLOR", "POINT")
            colour.data.foreach_set("color", np.tile([1.0, 0.0, 0.0, 1.0], len(obj.data.vertices)))
            obj.data.color_attributes.active_color = colour
            obj.data.color_attributes.render_color_index = 0
    path = written(package, tmp_path, suffix, *objects)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    readers = {".obj": bpy.ops.wm.obj_import, ".ply": bpy.ops.wm.ply_import}
    readers.get(suffix, bpy.ops.import_scene.gltf)(filepath=str(path))
    colours = [np.array([d.color[:] for d in mesh.color_attributes[0].data]) for mesh in bpy.data.meshes
               if mesh.color_attributes]  # fmt: skip
    red = sum(int(((c[:, 0] > 0.9) & (c[:, 1] < 0.1)).sum() > 0) for c in colours)
    # A PLY file is one mesh.
    assert red == (2 if which == "both" and suffix != ".ply" else 1)


@pytest.mark.parametrize("has", [(1, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, 1), (1, 1, 1)])
def test_vertices_of_a_ply_keep_their_own_values_where_objects_lack_some(package, tmp_path, has):
    """Blender's exporter gave those of one object to the vertices of another, and wrote beyond its memory."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    objects, expected, places = [], [], []
    for k, there in enumerate(has):
        obj = patch(f"Patch {k}")
        for vertex in obj.data.vertices:
            vertex.co.x += 10 * k
        values = 100 * k + np.arange(len(obj.data.vertices)) + 1.0
        if there:
            obj.data.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", values)
        else:
            # Their UVs are attributes of vertices on the way, too.
            obj.data.uv_layers.remove(obj.data.uv_layers[0])
        objects.append(obj)
        expected += list(values * there)
        places += [tuple(vertex.co) for vertex in obj.data.vertices]
    path = tmp_path / "made.ply"
    assert package("files.export").export(path, ".ply", objects, False) == []
    assert all(("heat" in obj.data.attributes) == bool(there) for obj, there in zip(objects, has, strict=True))
    (obj,) = package("files.meshes").load(path)
    np.testing.assert_allclose([tuple(v.co) for v in obj.data.vertices][: len(places)], places, atol=1e-6)
    found = np.zeros(len(obj.data.vertices), np.float32)
    obj.data.attributes["heat"].data.foreach_get("value", found)
    assert found[: len(expected)].tolist() == expected


def test_attributes_of_several_kinds_and_colours_that_some_lack_are_left_out_of_a_ply_by_name(package, tmp_path):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    objects = [patch(f"Patch {k}") for k in range(3)]
    for k, obj in enumerate(objects):
        obj.data.attributes.new("kind", ("FLOAT", "INT", "FLOAT")[k], "POINT")
        for name in ("Shown", "Other") if k != 1 else ("Shown",):
            obj.data.color_attributes.new(name, "FLOAT_COLOR", "POINT")
        obj.data.color_attributes.active_color = obj.data.color_attributes["Shown"]
    told = package("files.export").export(tmp_path / "made.ply", ".ply", objects, False)
    assert sorted(line.split(" named ")[1].split(";")[0] for line in told) == ["Other", "kind"]
    assert all("kind" in obj.data.attributes for obj in objects)
    (obj,) = package("files.meshes").load(tmp_path / "made.ply")
    assert not any(name.startswith(("kind", "Other")) for name in set(obj.data.attributes.keys()))
    assert len(obj.data.color_attributes) == 1


KINDS_OF_ALPHA = list(product((False, True), ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")))


@pytest.mark.parametrize(("floats", "alpha"), KINDS_OF_ALPHA)
def test_packed_pictures_keep_their_pixels(package, tmp_path, alpha, floats):
    """Written into a .blend and read from it again, whatever alpha means in the picture they are like."""
    images = package("files.images")
    like = bpy.data.images.new("like", 6, 4, alpha=True, float_buffer=floats)
    like.alpha_mode = alpha
    pixels = np.random.default_rng(3).uniform(0.1, 0.9, (4, 6, 4)).astype(np.float32)
    if floats:
        # No colour is above its alpha where they are multiplied.
        pixels[..., :3] *= pixels[..., 3:]
    made = images.packed_image("made", pixels, like)
    made.use_fake_user = True
    name = made.name
    # What says that colours are multiplied by alpha, or are not, says it of the pixels that there are.
    kinds = {"STRAIGHT": "PREMUL"} if floats else {"PREMUL": "STRAIGHT"}
    assert made.alpha_mode == kinds.get(alpha, alpha)
    assert np.abs(images.pixels_of(made) - pixels).max() < (1e-6 if floats else 0.003)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    again = images.pixels_of(bpy.data.images[name])
    visible = slice(None) if alpha != "NONE" else slice(3)
    assert np.abs(again - pixels)[..., visible].max() < (2e-3 if floats else 0.012)


def test_a_picture_read_as_premultiplied_is_written_as_bright_as_it_looks(package, tmp_path):
    """Blender divides its bytes by alpha when it reads them: a copy that said so, too, was divided once more."""
    images = package("files.images")
    colours = np.random.default_rng(3).uniform(0.1, 0.9, (4, 6, 4)).astype(np.float32)
    file = bpy.data.images.new("file", 6, 4, alpha=True)
    multiplied = colours.copy()
    multiplied[..., :3] *= colours[..., 3:]
    file.pixels.foreach_set(multiplied.ravel())
    file.filepath_raw, file.file_format = str(tmp_path / "file.png"), "PNG"
    file.save()
    seen = bpy.data.images.load(str(tmp_path / "file.png"), check_existing=False)
    seen.alpha_mode = "PREMUL"
    before = images.pixels_of(seen)
    assert np.abs(before - colours).max() < 0.03 and images.has_straight_alpha(seen)
    made = images.packed_image("made", before, seen)
    made.use_fake_user = True
    images.save(tmp_path / "saved.png", before, seen)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    for again in (bpy.data.images["made"], images.load(tmp_path / "saved.png")):
        assert np.abs(images.pixels_of(again) - before).max() < 0.013


def test_a_blend_holds_every_mesh_bit_by_bit_or_is_refused_by_the_name_of_the_one_that_it_has_not(package, tmp_path):
    """One that is missing altogether, too."""
    check, one, two = package("files.read_back").check_blend, patch("One"), patch("Two")
    path = tmp_path / "a.blend"
    bpy.data.libraries.write(str(path), {one, two}, fake_user=True)
    libraries = len(bpy.data.libraries)
    check(path, [one, two])
    two.data.uv_layers[0].uv[0].vector.x += 1e-3
    with pytest.raises(package("errors").UserError, match=f"does not hold {two.data.name} as it is"):
        check(path, [one, two])
    three = patch("Three")
    with pytest.raises(package("errors").UserError, match=f"does not hold {three.data.name} as it is"):
        check(path, [one, three])
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(package("errors").UserError, match="cannot be read again"):
        check(path, [one])
    # What was linked for a look is gone.
    assert len(bpy.data.libraries) == libraries and not any(mesh.library for mesh in bpy.data.meshes)


def test_several_ply_files_are_written_one_after_the_other(package, tmp_path):
    """What was cut for the first one is gone from the view layer when the second is written."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = patch("Patch")
    for k in range(3):
        before = set(bpy.data.objects), set(bpy.data.meshes)
        assert package("files.export").export(tmp_path / f"{k}.ply", ".ply", [obj], False) == []
        assert [x.name for x in bpy.context.view_layer.objects] == ["Patch"]
        assert (set(bpy.data.objects), set(bpy.data.meshes)) == before
    assert len({(tmp_path / f"{k}.ply").read_bytes() for k in range(3)}) == 1


@pytest.mark.parametrize("floats", [False, True])
@pytest.mark.parametrize("suffix", [".png", ".exr", ".hdr", ".tif", ".jpg", ".tga", ".bmp"])
def test_nothing_of_a_picture_that_was_saved_stays_in_the_session(package, tmp_path, suffix, floats, monkeypatch):
    images = package("files.images")
    like = bpy.data.images.new("like", 6, 4, alpha=True, float_buffer=floats)
    pixels = np.random.default_rng(3).uniform(0.1, 0.9, (4, 6, 4)).astype(np.float32)

    def blocks():
        every = (getattr(bpy.data, name) for name in dir(bpy.data))
        return {block.name_full for them in every if isinstance(them, bpy.types.bpy_prop_collection) for block in them}

    def full(path, size):
        raise RuntimeError("nothing was written. Is the disk full?")

    before, scene = blocks(), bpy.context.scene
    images.save(tmp_path / f"made{suffix}", pixels, like)
    assert blocks() == before
    monkeypatch.setattr(images, "check_whole", full)
    with pytest.raises(images.ImageError, match="Is the disk full"):
        images.save(tmp_path / f"again{suffix}", pixels, like)
    monkeypatch.undo()
    assert blocks() == before and bpy.context.scene == scene
    again = images.pixels_of(images.load(tmp_path / f"made{suffix}"))
    assert again.shape == (4, 6, 4)


@pytest.mark.parametrize("before", ["nothing", "attributes of these names"])
def test_corners_of_a_ply_keep_their_uvs_where_faces_touch_at_a_vertex_alone(package, tmp_path, before):
    """There is no edge to cut along, and a vertex of a PLY file has one UV; what was named s and t gives way."""
    points = [[0, 0, 0], [1, 0, 0.2], [0.5, 1, 0], [-1, 0, 0.1], [-0.5, -1, 0], [1, -1, 0.3]]
    faces = [[0, 1, 2], [0, 3, 4], [0, 4, 5]]
    obj = scenes.add(points, faces, "Touching")
    uv = np.random.default_rng(5).uniform(0, 1, (9, 2)).astype(np.float32)
    # The last two share an edge, and go on across it.
    uv[6], uv[7] = uv[3], uv[5]
    scenes.set_uv(obj, uv)
    if before != "nothing":
        for name in "st":
            obj.data.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", np.full(6, 9.0, np.float32))
    path = written(package, tmp_path, ".ply", obj)
    data = path.read_bytes()
    mesh, found = package("files.in_place.ply").read_uv(data)
    assert len(mesh.positions) == 7 and len(mesh.face_start) - 1 == 3
    place = {tuple(np.round(points[v], 4).tolist()): v for v in range(6)}
    for k in range(3):
        corners = slice(mesh.face_start[k], mesh.face_start[k + 1])
        vertex = [place[tuple(np.round(p, 4).tolist())] for p in mesh.positions[mesh.corner_vertex[corners]]]
        there = {v: tuple(x) for v, x in zip(vertex, np.asarray(found)[corners].tolist(), strict=True)}
        here = {v: tuple(x) for v, x in zip(faces[k], uv[3 * k : 3 * k + 3].tolist(), strict=True)}
        assert there == here


@pytest.mark.parametrize("turn", [(90, 0, 0), (0, 90, 0), (0, 0, 90), (90, 90, 0), (30, -50, 110)])
@pytest.mark.parametrize("suffix", FORMATS)
def test_an_object_stands_where_it_stood_however_it_is_turned(package, tmp_path, suffix, turn):
    """Formats have axes of their own: what is turned for them is turned back."""
    # All of its vertices are in use.
    obj = patch("Patch", 6)
    obj.rotation_euler = np.radians(turn)
    obj.location = (1, 2, -3)
    bpy.context.view_layer.update()

    def places(one):
        local = np.array([v.co[:] for v in one.data.vertices])
        matrix = np.array(one.matrix_world)
        return np.unique(np.round(local @ matrix[:3, :3].T + matrix[:3, 3], 4) + 0.0, axis=0)

    before = places(obj)
    path = written(package, tmp_path, suffix, obj)
    (found,) = package("files.meshes").load(path)
    after = places(found)
    assert after.shape == before.shape or suffix == ".stl"
    distance = np.linalg.norm(before[:, None] - after, axis=2)
    assert max(distance.min(axis=0).max(), distance.min(axis=1).max()) < 3e-4


# How far a channel may be off in a file, of formats that hold more or less than a byte of it.
OFF = {".png": 0.003, ".exr": 0.003, ".hdr": 0.012, ".tif": 0.003, ".tiff": 0.003, ".jpg": 0.1, ".jpeg": 0.1}


@pytest.mark.parametrize("floats", [False, True])
@pytest.mark.parametrize("opaque", [False, True])
@pytest.mark.parametrize("suffix", [".png", ".exr", ".hdr", ".tif", ".tiff", ".jpg", ".jpeg", ".tga", ".bmp"])
def test_a_picture_that_was_saved_has_its_colours_and_its_alpha_where_the_format_has_any(
    package, tmp_path, suffix, opaque, floats
):
    images = package("files.images")
    like = bpy.data.images.new("like", 8, 6, alpha=True, float_buffer=floats)
    x, y = np.meshgrid(np.linspace(0.3, 0.7, 8), np.linspace(0.35, 0.65, 6))
    pixels = np.stack([x, y, 1 - x, 0.5 + 0.4 * y], axis=2).astype(np.float32)
    if opaque:
        pixels[..., 3] = 1
    if floats:
        pixels[..., :3] *= pixels[..., 3:]
    images.save(tmp_path / f"made{suffix}", pixels, like)
    saved = images.load(tmp_path / f"made{suffix}")
    found, off = images.pixels_of(saved), OFF.get(suffix, 0.006)
    # Where Blender writes bytes by itself a BMP has alpha, too.
    has_alpha = images.FORMATS[suffix] in images.WITH_ALPHA or (suffix == ".bmp" and not floats)
    assert np.abs(found[..., 3] - (pixels[..., 3] if has_alpha else 1)).max() < off
    if opaque and saved.is_float == floats:
        assert np.abs(found - pixels).max() < off
    # Upright, and red before blue.
    assert (np.diff(found[2, :, 0]) > 0).all() and (np.diff(found[2, :, 2]) < 0).all()
    assert (np.diff(found[:, 3, 1]) > 0).all()


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 0.95])
def test_a_file_that_ends_early_is_seen_whatever_it_says_it_holds(package, tmp_path, suffix, share):
    obj = patch("Patch")
    path = written(package, tmp_path, suffix, obj)
    package("files.read_back").check(path, suffix, [obj])
    ends = next(tmp_path.glob("*.bin"), path)
    ends.write_bytes(ends.read_bytes()[: int(share * ends.stat().st_size)])
    with pytest.raises(package("errors").UserError, match="Is the disk full"):
        package("files.read_back").check(path, suffix, [obj])
