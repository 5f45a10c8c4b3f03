"""What is drawn over the UV editor is what was shown last, whatever has been drawn before it."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes


class DrawnBatch:
    """What a batch of the graphics card holds, and a list that it is noted in where it is drawn."""

    def __init__(self, noted, shader, kind, content):
        self._noted, self._row = noted, (kind, {name: np.array(values) for name, values in content.items()})

    def draw(self, _shader):
        self._noted.append(self._row)


@pytest.fixture
def drawn(package, monkeypatch):
    """What is drawn now, by kind."""
    overlay, noted = package("display.overlay"), []
    shader = SimpleNamespace(bind=lambda: None, uniform_float=lambda *_: None)
    card = SimpleNamespace(
        shader=SimpleNamespace(from_builtin=lambda _: shader), state=SimpleNamespace(blend_set=lambda _: None)
    )
    monkeypatch.setitem(sys.modules, "gpu", card)
    batch = SimpleNamespace(batch_for_shader=lambda *given: DrawnBatch(noted, *given))
    monkeypatch.setitem(sys.modules, "gpu_extras.batch", batch)
    monkeypatch.setattr(overlay, "_shows_uvs", lambda _: True)

    def draw():
        noted.clear()
        overlay._draw()
        return dict(noted)

    yield draw
    if bpy.context.mode == "EDIT_MESH":
        scenes.leave_edit()
    overlay.hide(bpy.context)


def moved(one, _other):
    scenes.set_uv(one, scenes.uv_of(one)[::-1] * [0.5, 0.25])


def another(one, other):
    scenes.select([other])


def both(one, other):
    scenes.select([one, other])


def other_layer(one, _other):
    one.data.uv_layers.active = one.data.uv_layers.new(name="More")
    scenes.set_uv(one, 0.3 + 0.1 * scenes.seen_from_above(one), "More")


@pytest.mark.parametrize("edited", [False, True])
@pytest.mark.parametrize("change", [moved, another, both, other_layer])
@pytest.mark.parametrize("kinds", [("AREA", "AREA"), ("SHEAR", "AREA")], ids=str)
def test_what_is_drawn_is_as_if_nothing_had_been_drawn_before(package, drawn, kinds, change, edited):
    one, other = scenes.bump(4, 3, name="One"), scenes.bump(3, 5, name="Two", offset=3.0)
    for obj in (one, other):
        scenes.set_uv(obj, scenes.seen_from_above(obj) * [1.0, 0.5])
    scenes.select([one])
    bpy.ops.uv.omt_overlay(show=kinds[0])
    before = drawn()
    assert drawn().keys() == before.keys() == {"TRIS", "LINES"}
    change(one, other)
    if edited:
        scenes.edit(bpy.context.view_layer.objects.active)
    bpy.ops.uv.omt_overlay(show=kinds[1])
    found = drawn()
    package("display.overlay").forget()
    bpy.ops.uv.omt_overlay(show=kinds[1])
    expected = drawn()
    assert found.keys() == expected.keys()
    for kind, content in expected.items():
        for name, values in content.items():
            np.testing.assert_array_equal(found[kind][name], values, err_msg=f"{kind} {name}")
    scenes.leave_edit() if edited else None
    bpy.ops.uv.omt_overlay(show=kinds[1])
    there, lines = drawn(), before["LINES"]["pos"]
    assert there["LINES"]["pos"].shape != lines.shape or np.abs(there["LINES"]["pos"] - lines).max() > 1e-3
