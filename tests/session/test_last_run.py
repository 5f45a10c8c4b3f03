"""Figures of the last run: those of the active UVs, and none where there is nothing to measure."""

from __future__ import annotations

import pytest
import scenes


@pytest.mark.parametrize("value, text", [(0.0123, "0.01 s"), (9.994, "9.99 s"), (10.0, "10 s"), (123.4, "123 s")])
def test_seconds(package, value, text):
    assert package("session.last_run").seconds(value) == text


def test_figures_do_not_depend_on_the_scale_of_the_uvs_but_the_texel_density_does(package):
    figures, read = package("session.last_run").figures, package("blender.mesh").read
    obj = scenes.bump()
    assert figures([read(obj)], 1024, 1.0) == ()
    uv = scenes.seen_from_above(obj, 0.4)
    scenes.set_uv(obj, uv)
    first = dict(figures([read(obj)], 1024, 1.0))
    scenes.set_uv(obj, uv / 2)
    second = dict(figures([read(obj)], 1024, 1.0))
    density = [float(rows.pop("Texel density").split()[0]) for rows in (first, second)]
    assert first == second and first["Folded faces"] == "0" and first["Islands"] == "1"
    assert density[0] == pytest.approx(2 * density[1], rel=1e-3)
