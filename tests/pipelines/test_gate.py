"""The last gate: folds and overlap of stored UVs, next to a judge of its own where there is one."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest

from omt_uv.pipelines.gate import Gate, gate
from omt_uv.pipelines.reading import Reading
from omt_uv.solver.mesh.surface import Surface

SHARED = Path(__file__).resolve().parents[3] / "shared"
JUDGE = Path(os.environ.get("OMT_UV_JUDGE", SHARED / "tools" / "judge_uv.py"))


def reading(n=14, uv=None, scale=1.0):
    """A bumpy square of n x n quads whose UVs (v,2) are those of its vertices."""
    y, x = np.mgrid[0 : n + 1, 0 : n + 1] / n
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], 1)
    loops = 4 * np.arange(n * n)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    plane = np.stack([x, y], -1).reshape(-1, 2)
    surface = Surface(
        positions=scale * np.column_stack([plane, 0.2 * np.sin(5 * plane).sum(1)]),
        corner_vertex=quads.ravel(),
        face_start=np.arange(0, 4 * n * n + 1, 4),
        triangles=loops.reshape(-1, 3),
        triangle_face=np.repeat(np.arange(n * n), 2),
        seams=np.zeros((0, 2), np.int64),
        sharp=np.zeros((0, 2), np.int64),
    )
    uv = plane if uv is None else uv(plane)
    return Reading(surface, np.ones(n * n, bool), uv.astype(np.float32)[quads.ravel()], None, None)


def warped(strength, seed):
    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(3, 2))
    return lambda p: p + strength * np.outer(np.sin(4 * p @ a + c[0]), b)


@pytest.mark.parametrize("strength, seed", [(0.0, 0), (0.05, 1), (0.2, 2), (0.6, 3), (1.5, 4)])
def test_figures_are_those_of_the_judge(strength, seed):
    if not JUDGE.exists():
        pytest.skip(f"no judge at {JUDGE}: set OMT_UV_JUDGE to judge_uv.py")
    spec = importlib.util.spec_from_file_location("judge_uv", JUDGE)
    judge = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(judge)
    one = reading(uv=warped(strength, seed))
    corner = one.surface.triangles
    F, uv = one.surface.corner_vertex[corner], one.uv[corner].astype(float)
    figures = judge.judge(one.surface.positions, F, uv)
    found = gate([one])
    assert found.overlap == pytest.approx(figures["overlap"], abs=1e-4)
    # The judge counts triangles, a gate polygons.
    assert found.folds <= figures["folds"] <= 2 * found.folds


def test_objects_share_a_texture_and_islands_may_be_looked_at_apart():
    twice = [reading(), reading(5, scale=3.0)]
    assert gate(twice).overlap == pytest.approx(1, abs=0.01)
    assert gate(twice, apart=True) == Gate(faces=14 * 14 + 25, folds=0, overlap=0.0)
    beside = [reading(), reading(5, uv=lambda p: p + [1, 0])]
    assert gate(beside).overlap == 0


def test_polygons_that_are_not_chosen_and_meshes_without_uvs_do_not_count():
    one = reading(uv=lambda p: np.where(p > 0.5, 1 - p, p))
    assert gate([one]).folds > 0 and gate([one]).overlap > 0.5
    quarter = (one.surface.positions[one.surface.corner_vertex.reshape(-1, 4), :2] < 0.49).all((1, 2))
    one = Reading(one.surface, quarter, one.uv, None, None)
    assert gate([one]) == Gate(faces=int(quarter.sum()), folds=0, overlap=0.0)
    assert gate([Reading(one.surface, quarter, None, None, None)]) == Gate(0, 0, 0.0)


def test_warnings_count_and_tell_what_was_there_before():
    assert Gate(9, 0, 5e-5).warnings() == ()
    one, two = Gate(9, 1, 0.0).warnings(), Gate(9, 3, 0.25).warnings(Gate(9, 3, 0.1))
    assert one == ("1 face is folded in the UVs",)
    assert two == ("3 faces are folded in the UVs, as before", "25 % of the UV area is under several faces")


@pytest.mark.parametrize("folds, old_folds", [(1, 0), (3, 2), (2, 2), (2, 5)])
@pytest.mark.parametrize("overlap, old_overlap", [(0.3, 0.1), (0.3, 0.3), (0.1, 0.3)])
def test_only_what_has_not_grown_is_as_before(folds, old_folds, overlap, old_overlap):
    told = Gate(9, folds, overlap).warnings(Gate(9, old_folds, old_overlap))
    assert [text.endswith(", as before") for text in told] == [folds <= old_folds, overlap <= old_overlap]
    assert told[0].startswith("1 face is" if folds == 1 else f"{folds} faces are")
    assert not any("before" in text for text in Gate(9, folds, overlap).warnings())


@pytest.mark.parametrize("overlap, told", [(0.0, False), (5e-5, False), (2e-4, True), (0.3, True)])
def test_overlap_is_told_from_a_ten_thousandth_on(overlap, told):
    assert any("under several faces" in text for text in Gate(100, 0, overlap).warnings()) == told
    # Of what was there before, only what is new by so much counts as new.
    old = Gate(100, 0, 0.1)
    assert (Gate(100, 0, 0.1 + overlap).warnings(old) == old.warnings(old)) == (not told or overlap == 0)
