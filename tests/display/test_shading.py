"""Views that show textures while a checker is on have their own colours back after it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest


class Space(SimpleNamespace):
    """A 3D View as far as its shading goes."""

    def as_pointer(self):
        return id(self)


def view(kind="SOLID", colour="MATERIAL"):
    return Space(shading=SimpleNamespace(type=kind, color_type=colour))


@pytest.fixture
def shading(package):
    module = package("display.shading")
    yield module
    module._before.clear()


def window(*spaces):
    areas = [SimpleNamespace(type="VIEW_3D", spaces=SimpleNamespace(active=space)) for space in spaces]
    other = SimpleNamespace(type="IMAGE_EDITOR", spaces=SimpleNamespace(active=None))
    return SimpleNamespace(
        window_manager=SimpleNamespace(windows=[SimpleNamespace(screen=SimpleNamespace(areas=[other, *areas]))])
    )


def test_every_view_has_its_own_colours_back_however_often_it_is_asked_for(shading):
    colours = ["MATERIAL", "OBJECT", "TEXTURE", "VERTEX"]
    views = [*(view(colour=colour) for colour in colours), view("RENDERED")]
    context = window(*views)
    for _ in range(2):
        shading.show_textures(context)
        assert [v.shading.color_type for v in views] == 4 * ["TEXTURE"] + ["MATERIAL"]
    shading.hide_textures(context)
    assert [v.shading.color_type for v in views] == [*colours, "MATERIAL"]


def test_what_was_chosen_meanwhile_and_views_of_later_stay_as_they_are(shading):
    first, late = view(), view(colour="TEXTURE")
    shading.show_textures(window(first))
    first.shading.color_type = "RANDOM"
    shading.hide_textures(window(first, late))
    assert (first.shading.color_type, late.shading.color_type) == ("RANDOM", "TEXTURE")
    # Nothing is remembered of an earlier time.
    first.shading.color_type = "TEXTURE"
    shading.hide_textures(window(first))
    assert first.shading.color_type == "TEXTURE"


@pytest.mark.parametrize("shown", [["AREA"], ["AREA", "SHEAR"], ["SHEAR", "AREA", "SHEAR"]])
def test_colours_of_distortion_give_every_view_its_own_shading_back(package, monkeypatch, shown):
    """However often others are shown meanwhile; a view that was set to something else by hand stays so."""
    import bpy

    import scenes

    overlay = package("display.overlay")
    obj = scenes.bump(2, 2)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    before = [("SOLID", "MATERIAL"), ("SOLID", "VERTEX"), ("RENDERED", "OBJECT"), ("WIREFRAME", "TEXTURE")]
    views = [view(*kind) for kind in before]
    later = view("SOLID", "OBJECT")
    monkeypatch.setattr(overlay, "view_spaces", lambda _: views)
    try:
        for kind in shown:
            assert bpy.ops.uv.omt_overlay(show=kind) == {"FINISHED"}
            assert {(v.shading.type, v.shading.color_type) for v in views} == {("SOLID", "VERTEX")}
        views[2].shading.type = "MATERIAL"
        views.append(later)
    finally:
        bpy.ops.uv.omt_overlay(show="NONE")
    found = [(v.shading.type, v.shading.color_type) for v in views]
    assert found == [*before[:2], ("MATERIAL", "VERTEX"), before[3], ("SOLID", "OBJECT")]
