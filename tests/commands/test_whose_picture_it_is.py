"""Of several objects each is shown in a preview as itself: with its own faces, its own UVs as they are written, and its
own cells."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

RUNS = {
    "unwrap": "--quality draft --max-shear 0",
    "refine": "--quality draft",
    "partition": "--cells 4 --relax 0 --write attribute",
}


@pytest.mark.parametrize("order", [(2, 0, 1)], ids=str)
@pytest.mark.parametrize("command", RUNS)
def test_every_object_is_shown_as_itself(package, monkeypatch, tmp_path, command, order):
    scenes.open_empty()
    sizes = [(3, 3), (5, 4), (2, 6)]
    for k, which in enumerate(order):
        obj = scenes.bump(*sizes[which], name=f"Object {k}", offset=2.0 * k)
        scenes.set_uv(obj, scenes.seen_from_above(obj) * [0.3, 0.5])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    module, shown = package("display.preview"), []

    def drawn(objects, *more, preview=module.preview):
        shown.extend(objects)
        return preview(objects, *more)

    monkeypatch.setattr(module, "preview", drawn)
    words = [command, tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--preview", tmp_path / "p.png"]
    assert package("cli").main([*map(str, words), *RUNS[command].split()]) == 0
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG") and len(shown) == 3
    found = sorted(shown, key=lambda item: item.reading.surface.positions[:, 0].min())
    for k, item in enumerate(found):
        obj = bpy.data.objects[f"Object {k}"]
        points = np.array([vertex.co[:] for vertex in obj.data.vertices])
        np.testing.assert_allclose(item.reading.surface.positions, points, atol=1e-6)
        np.testing.assert_array_equal(np.asarray(item.reading.uv, np.float32), scenes.uv_of(obj))
        if command == "partition":
            cells = np.zeros(len(obj.data.polygons), np.int32)
            name = package("settings").CELL_ATTRIBUTE
            obj.data.attributes[name].data.foreach_get("value", cells)
            np.testing.assert_array_equal(item.cells, cells)
        else:
            assert item.cells is None
