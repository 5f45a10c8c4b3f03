"""The last look at UVs that were written: where islands may lie on one another, and where UVs come from others."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
import uv_scenes

# Words of a command, whether only overlap inside of islands counts, and whether there were UVs that may have had some.
COMMANDS = [
    (["unwrap"], False, False),
    (["unwrap", "--no-pack"], True, False),
    (["refine"], False, True),
    (["magnify", "--source", "uv", "--weights", "Region", "--factor", "2"], False, True),
    (["magnify", "--source", "mesh", "--weights", "Region", "--factor", "2"], False, False),
    (["stack"], True, True),
    (["symmetrize", "--halves", "stacked"], True, True),
    (["rectify"], True, True),
]


@pytest.fixture(scope="module")
def patch_file(tmp_path_factory, package):
    """Two patches beside one another, with UVs and a painted group."""
    scenes.open_empty()
    obj = uv_scenes.patches()
    group = obj.vertex_groups.new(name="Region")
    for k in range(10):
        group.add([k], 1.0, "REPLACE")
    path = tmp_path_factory.mktemp("look") / "in.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.mark.parametrize(
    ("words", "apart", "existed"), COMMANDS, ids=lambda x: "-".join(x) if isinstance(x, list) else ""
)
@pytest.mark.parametrize("before", [2, 1])
def test_folds_and_overlap_are_told_as_before_where_they_were(
    words, apart, existed, before, patch_file, run, package, tmp_path, monkeypatch
):
    module, looked = package("pipelines.gate"), []

    def gate(readings, apart=False):
        looked.append(apart)
        # What was written is looked at first.
        return module.Gate(40, 2 if len(looked) == 1 else before, 0.0)

    monkeypatch.setattr(module, "gate", gate)
    given = [words[0], patch_file, "-o", tmp_path / "out.blend", *words[1:]]
    status, _, err = run(*given)
    assert status == 0, err
    assert looked == [apart] * (1 + existed)
    assert "2 faces are folded in the UVs" in err and ("in the UVs, as before" in err) == (existed and before == 2)
    (tmp_path / "out.blend").unlink()
    looked.clear()
    status, _, err = run(*given, "--strict")
    assert status != 0 and "2 faces are folded in the UVs. Nothing was written, as --strict asks." in err
    assert not (tmp_path / "out.blend").exists()


@pytest.mark.parametrize(
    ("name", "options", "apart"),
    [
        ("uv.omt_unwrap", {"pack": True}, False),
        ("uv.omt_unwrap", {"pack": False}, True),
        ("uv.omt_refine", {}, False),
        ("uv.omt_sphere", {}, True),
    ],
)
def test_operators_look_as_their_settings_say(name, options, apart, package, monkeypatch):
    module, looked = package("pipelines.gate"), []

    def gate(readings, apart=False):
        looked.append(apart)
        return module.Gate(40, 2, 0.0)

    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = scenes.cube() if "sphere" in name else scenes.bump(4, 3)
    scenes.set_uv(obj, scenes.seen_from_above(obj) if "sphere" not in name else np.zeros((24, 2)))
    monkeypatch.setattr(module, "gate", gate)
    group, operator = name.split(".")
    assert getattr(getattr(bpy.ops, group), operator)(**options) == {"FINISHED"}
    assert looked == [apart]
    notices = package("session.last_run").state.summary.notices
    assert any("2 faces are folded in the UVs" in notice.text for notice in notices)
