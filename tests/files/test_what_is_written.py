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


@pytest.mark.parametrize("which", ["first", "second", "both"])
@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_colours_of_any_object_go_along(package, tmp_path, suffix, which):
    objects = [patch("First"), patch("Second")]
    for name, obj in zip(("first", "second"), objects, strict=True):
        if which in (name, "both"):
            colour = obj.data.color_attributes.new("Colour", "BYTE_COLOR", "POINT")
            colour.data.foreach_set("color", np.tile([1.0, 0.0, 0.0, 1.0], len(obj.data.vertices)))
            obj.data.color_attributes.active_color = colour
            obj.data.color_attributes.render_color_index = 0
    path = written(package, tmp_path, suffix, *objects)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    {".obj": bpy.ops.wm.obj_import, ".ply": bpy.ops.wm.ply_import, ".glb": bpy.ops.import_scene.gltf}[suffix](
        filepath=str(path)
    )
    colours = [np.array([d.color[:] for d in mesh.color_attributes[0].data]) for mesh in bpy.data.meshes
               if mesh.color_attributes]  # fmt: skip
    red = sum(int(((c[:, 0] > 0.9) & (c[:, 1] < 0.1)).sum() > 0) for c in colours)
    assert red >= 1


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
