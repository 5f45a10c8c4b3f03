"""The tab is opened once: as soon as the sidebar has tabs, in the largest view, and never again."""

from __future__ import annotations

import types

import bpy

import pytest


class Region:
    """A sidebar that has tabs from its third look on, as Blender's has after it was drawn."""

    type, looks, category = "UI", 0, "Item"

    @property
    def active_panel_category(self):
        return self.category

    @active_panel_category.setter
    def active_panel_category(self, name):
        self.looks += 1
        if self.looks < 3:
            raise AttributeError("read-only")
        self.category = name


def area(kind, size):
    space = types.SimpleNamespace(show_region_ui=False)
    spaces = types.SimpleNamespace(active=space)
    return types.SimpleNamespace(
        type=kind, width=size, height=size, spaces=spaces, regions=[Region()], tag_redraw=lambda: None
    )


@pytest.fixture
def screen(package, monkeypatch):
    """A window with two views and another editor, and preferences of a new extension."""
    areas = [area("VIEW_3D", 100), area("VIEW_3D", 300), area("IMAGE_EDITOR", 900)]
    window = types.SimpleNamespace(screen=types.SimpleNamespace(areas=areas))
    preferences = types.SimpleNamespace(tab_was_shown=False)
    context = types.SimpleNamespace(
        window_manager=types.SimpleNamespace(windows=[window]), preferences=types.SimpleNamespace(is_dirty=False)
    )
    fake = types.SimpleNamespace(context=context, app=types.SimpleNamespace(version=(5, 2, 0)))
    monkeypatch.setattr(package("panels.welcome"), "bpy", fake)
    monkeypatch.setattr(package("panels.preferences"), "bpy", fake)
    monkeypatch.setattr(package("panels.preferences"), "get", lambda _context: preferences)
    return areas, preferences, fake


def test_the_largest_view_opens_at_the_tab_once(package, screen):
    areas, preferences, fake = screen
    show_once, looks = package("panels.preferences").show_once, iter(range(9))
    assert show_once(looks) and show_once(looks)
    assert not preferences.tab_was_shown
    assert show_once(looks) is None
    assert areas[1].regions[0].category == "OMT" and areas[1].spaces.active.show_region_ui
    assert not areas[0].spaces.active.show_region_ui
    assert preferences.tab_was_shown and fake.context.preferences.is_dirty


def test_where_there_is_no_view_the_next_session_looks_again(package, screen):
    areas, preferences, _ = screen
    del areas[:2]
    looks = iter(range(2))
    show_once = package("panels.preferences").show_once
    assert show_once(looks) and show_once(looks) and show_once(looks) is None
    assert not preferences.tab_was_shown


def test_versions_that_cannot_be_told_keep_their_sidebar(package, screen):
    areas, _, fake = screen
    fake.app.version = (4, 5, 0)
    assert package("panels.welcome").show_tab()
    assert not any(each.spaces.active.show_region_ui for each in areas)


def test_it_is_a_preference_that_is_kept(package):
    prop = package("panels.preferences").OMTUVPreferences.bl_rna.properties["tab_was_shown"]
    assert prop.is_hidden and not prop.default and bpy.app.background
