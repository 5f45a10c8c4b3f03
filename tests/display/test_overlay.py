"""Colours, histograms and texel density: they tell what `measure` tells, and leave nothing behind."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

ATTRIBUTE = "OMT UV Distortion"


@pytest.fixture
def patch(package):
    obj = scenes.bump(12, 10)
    scenes.set_uv(obj, scenes.seen_from_above(obj) * [1.0, 0.5])
    yield obj
    if bpy.context.mode == "EDIT_MESH":
        scenes.leave_edit()
    bpy.ops.uv.omt_overlay(show="NONE")


def colours(obj):
    scenes.leave_edit() if obj.mode == "EDIT" else None
    values = np.zeros(4 * len(obj.data.loops), np.float32)
    obj.data.color_attributes[ATTRIBUTE].data.foreach_get("color_srgb", values)
    return values.reshape(-1, 4)


@pytest.mark.parametrize("kind", ["AREA", "SHEAR"])
def test_both_modes_show_the_same(patch, kind):
    assert bpy.ops.uv.omt_overlay(show=kind) == {"FINISHED"}
    first = colours(patch)
    bpy.ops.uv.omt_overlay(show="NONE")
    scenes.edit(patch)
    assert bpy.ops.uv.omt_overlay(show=kind) == {"FINISHED"}
    np.testing.assert_allclose(colours(patch), first, atol=1 / 128)


def test_blue_has_too_little_and_red_too_much(package):
    rgb = package("display.colormaps").area_colours(np.array([-2.0, -1, 0, 1, 2]))
    assert (rgb[:2, 2] > rgb[:2, 0]).all()
    assert (rgb[3:, 0] > rgb[3:, 2]).all()
    assert rgb[2].min() > 0.9
    light = package("display.colormaps").shear_colours(np.array([1, 1.5, 2, 3, 4, 9.0])) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light)[:-1] > 0).all()  # viridis grows lighter, also in print


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_nothing_is_left_of_the_colours(patch, mode):
    own = patch.data.color_attributes.new("Mine", "BYTE_COLOR", "CORNER")
    patch.data.color_attributes.new("Other", "FLOAT_COLOR", "POINT")
    own.data.foreach_set("color_srgb", np.random.default_rng(1).random(4 * len(patch.data.loops)))
    patch.data.color_attributes.active_color = patch.data.color_attributes["Other"]
    if mode == "EDIT":
        scenes.edit(patch)
    before, keys = scenes.state(patch), set(patch.data.keys())
    for kind in ("AREA", "SHEAR", "AREA"):
        bpy.ops.uv.omt_overlay(show=kind)
        assert scenes.state(patch, leave_out=[ATTRIBUTE]) == before
    bpy.ops.uv.omt_overlay(show="NONE")
    assert scenes.state(patch) == before
    assert set(patch.data.keys()) == keys
    assert patch.data.color_attributes.active_color.name == "Other"


def test_colours_follow_the_uvs(patch, package):
    bpy.ops.uv.omt_overlay(show="AREA")
    before = colours(patch)
    bpy.ops.uv.omt_unwrap()
    after = colours(patch)
    assert np.ptp(after[:, :3], axis=1).mean() < 0.3 * np.ptp(before[:, :3], axis=1).mean()  # pale: as due


def test_undo_takes_the_colours_away(patch, package):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.uv.omt_overlay("EXEC_DEFAULT", True, show="AREA")
    assert package("display.overlay").kind() == "AREA"
    bpy.ops.ed.undo()
    assert package("display.overlay").kind() == "NONE"
    assert ATTRIBUTE not in bpy.data.objects["Bump"].data.color_attributes


def test_another_file_starts_without_colours(patch, package):
    bpy.ops.uv.omt_overlay(show="AREA")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert package("display.overlay").kind() == "NONE"
    assert not [f for f in bpy.app.handlers.undo_post if "omt" in f.__module__]


def test_unregistering_stops_the_drawing(patch, package):
    bpy.ops.uv.omt_overlay(show="AREA")
    package("display.overlay").forget()
    assert package("display.overlay").kind() == "NONE"


def test_the_histogram_counts_all_of_the_surface(patch, package):
    picture = package("display.histogram").histogram([package("blender.mesh").read(patch)])
    assert picture.min() >= 0 and picture.max() <= 1
    assert bpy.ops.uv.omt_histogram() == {"FINISHED"}
    image = bpy.data.images["OMT UV Histogram"]
    assert tuple(image.size) == picture.shape[1::-1]
    assert bpy.ops.uv.omt_histogram() == {"FINISHED"}  # drawn again into the same image
    assert len(bpy.data.images) == 1


def test_text_is_drawn_where_it_is_asked_for(package):
    images = package("display.canvas")
    paper = np.ones((40, 200, 3))
    images.write(paper, "Area 12", 100, 30, 20, align="middle")
    rows, columns = np.nonzero(paper[..., 0] < 0.5)
    assert rows.min() >= 10 and rows.max() <= 31
    assert abs((columns.min() + columns.max()) / 2 - 100) < 3
    images.write(paper, "beyond", 190, 5, 20)  # what does not fit is cut off
    assert not [c for c in bpy.data.curves if c.name.startswith("OMT")]


@pytest.mark.parametrize("shown", [["written"] * 3, ["written", "AREA", "written"], ["AREA", "AREA", "SHEAR"]])
def test_what_is_shown_again_is_listened_for_once_and_taken_back_whole(patch, package, shown):
    overlay, read_objects = package("display.overlay"), package("operators.base").read_objects
    for what in shown:
        if what == "written":
            overlay.show_written(bpy.context)
        else:
            overlay.show(bpy.context, read_objects(bpy.context), what)
    for kind, function in overlay._handlers():
        assert list(kind).count(function) == 1
    overlay.hide(bpy.context)
    assert not any(function in kind for kind, function in overlay._handlers())


def test_no_uvs_is_one_message(package):
    scenes.bump()
    for operator in (bpy.ops.uv.omt_overlay, bpy.ops.uv.omt_histogram, bpy.ops.uv.omt_density_get):
        assert "Unwrap the mesh first" in scenes.error_of(operator)


# ---- texel density --------------------------------------------------------------------------------------------


def densities(obj, size=1024):
    """Pixels per metre of every polygon."""
    space, uv = scenes.areas(obj)
    return size * np.sqrt(np.abs(uv) / space)


def two_islands():
    obj = scenes.add([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (3, 0, 0), (5, 0, 0), (5, 2, 0), (3, 2, 0)],
                     [(0, 1, 2, 3), (4, 5, 6, 7)])  # fmt: skip
    scenes.set_uv(obj, [(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1), (0.5, 0.5), (1, 0.5), (1, 1), (0.5, 1)])
    return obj


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_every_island_gets_the_density_about_its_middle(mode):
    obj = two_islands()
    before = scenes.uv_of(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    assert bpy.ops.uv.omt_density_set(density=77.0, unit="M", texture_size=1024) == {"FINISHED"}
    if mode == "EDIT":
        scenes.leave_edit()
    np.testing.assert_allclose(densities(obj), 77.0, rtol=1e-5)
    after = scenes.uv_of(obj)
    for island in (slice(0, 4), slice(4, 8)):
        np.testing.assert_allclose(after[island].mean(0), before[island].mean(0), atol=1e-6)


def test_all_together_keeps_the_differences():
    obj = two_islands()
    ratio = densities(obj)
    assert bpy.ops.uv.omt_density_set(density=200.0, unit="M", texture_size=1024, scope="ALL") == {"FINISHED"}
    np.testing.assert_allclose(densities(obj) / ratio, (densities(obj) / ratio)[0], rtol=1e-5)
    assert bpy.ops.uv.omt_density_get(texture_size=1024, unit="M") == {"FINISHED"}
    target = bpy.context.window_manager.operator_properties_last("uv.omt_density_set")
    assert target.density == pytest.approx(200.0, rel=1e-5)


def test_density_is_per_metre_whatever_the_units():
    obj = two_islands()
    obj.scale = (2, 2, 2)
    bpy.context.scene.unit_settings.scale_length = 0.01
    bpy.context.view_layer.update()
    bpy.ops.uv.omt_density_set(density=5000.0, unit="M", texture_size=2048)
    np.testing.assert_allclose(densities(obj, 2048), 50.0, rtol=1e-5)


def test_density_leaves_other_faces_alone():
    obj = two_islands()
    before = scenes.uv_of(obj)
    scenes.edit(obj, faces=[1])
    bpy.ops.uv.omt_density_set(density=10.0, unit="M")
    scenes.leave_edit()
    after = scenes.uv_of(obj)
    assert (after[:4] == before[:4]).all()
    assert (after[4:] != before[4:]).all()


def test_a_udim_tile_is_the_unit_square_moved():
    obj = scenes.bump()
    bpy.ops.uv.omt_unwrap()
    home = scenes.uv_of(obj)
    bpy.ops.uv.omt_unwrap(tile=1013)
    np.testing.assert_allclose(scenes.uv_of(obj), home + [2, 1], atol=1e-6)
    bpy.ops.uv.omt_refine(pack=True, tile=1002)
    assert (np.floor(scenes.uv_of(obj)) == [1, 0]).all()


def test_the_command_writes_the_histogram_and_packs_into_a_tile(package, tmp_path, capfd):
    obj = scenes.bump()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"), check_existing=False)
    main = package("cli").main
    out, picture = tmp_path / "out.blend", tmp_path / "h.png"
    assert main(["unwrap", str(tmp_path / "in.blend"), "-o", str(out), "--udim", "1022"]) == 0
    assert main(["measure", str(out), "--histogram", str(picture)]) == 0
    assert picture.read_bytes()[:4] == b"\x89PNG"
    obj = bpy.data.objects["Bump"]
    assert (np.floor(scenes.uv_of(obj)) == [1, 2]).all()
    capfd.readouterr()
    assert main(["measure", str(out), "--histogram", str(tmp_path / "h.gif")]) != 0
    assert ".png" in capfd.readouterr().err


@pytest.mark.parametrize(("unit", "metres"), [("CM", 0.01), ("M", 1.0), ("IN", 0.0254)])
def test_densities_are_counted_for_the_unit_that_was_chosen(unit, metres):
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    bpy.ops.uv.omt_density_set(density=8.0, unit=unit, texture_size=1024)
    bpy.ops.uv.omt_density_get(texture_size=1024, unit="M")
    target = bpy.context.window_manager.operator_properties_last("uv.omt_density_set")
    assert target.density == pytest.approx(8.0 / metres, rel=1e-4) and target.unit == "M"


@pytest.mark.parametrize("size", [(4, 6), (8, 8)], ids=str)
def test_pictures_for_panels_stand_upright(package, size):
    """Blender's rows begin at the bottom, ours at the top; as images, and as what panels show."""
    canvas = package("display.canvas")
    picture = np.random.default_rng(0).random((*size, 4)).astype(np.float32)
    picture[..., 3] = 1.0
    image = canvas.show("Upright", picture[..., :3].astype(float))
    canvas.set_preview(image, picture)
    assert tuple(image.size) == tuple(image.preview.image_size) == size[::-1]
    found = np.array(image.preview.image_pixels_float[:]).reshape(*size, 4)
    np.testing.assert_allclose(found[::-1], picture, atol=1 / 128)
    np.testing.assert_allclose(np.array(image.pixels[:]).reshape(*size, 4)[::-1], picture, atol=1 / 128)
