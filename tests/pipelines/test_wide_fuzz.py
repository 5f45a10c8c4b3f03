"""Meshes of all kinds through the whole path, judged by a program of somebody else: no fold and no overlap is unsaid.

OMT_UV_FUZZ=20000 takes more of them than `make test` does, OMT_UV_FUZZ_FIRST=N begins later, OMT_UV_FUZZ_LOG=FILE
keeps a line of each.
"""

from __future__ import annotations

import importlib.util
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from broken_meshes import arrays, check_error
from wide_meshes import wide_case

from omt_uv.pipelines.gate import gate
from omt_uv.pipelines.layout import Refusal, UnwrapJob
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.solver.errors import MarginError
from omt_uv.solver.maps.distortion import NEGLIGIBLE_AREA
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.progress import drain

SHARED = Path(__file__).resolve().parents[3] / "shared"
# Cases that come in parts.
SPLIT = 20
JUDGE = Path(os.environ.get("OMT_UV_JUDGE", SHARED / "tools" / "judge_uv.py"))
FIRST, CASES = int(os.environ.get("OMT_UV_FUZZ_FIRST", "0")), int(os.environ.get("OMT_UV_FUZZ", "33"))
CHUNK = 33
# Overlap that the judge's samples tell from none.
SEEN = 1e-3
# What the judge takes for a fold besides: an area below single precision.
FLAT = 1e-12


def load_judge():
    """The module of the judge; None where there is none."""
    if not JUDGE.exists():
        return None
    spec = importlib.util.spec_from_file_location("judge_uv", JUDGE)
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


@pytest.fixture(scope="module")
def judge():
    return load_judge()


def judged(judge, surface, faces, uv):
    """Folds and overlap of UVs (c,2) float32, of triangles that have an area."""
    corner = surface.triangles[faces[surface.triangle_face]]
    F, UV = surface.corner_vertex[corner], uv[corner].astype(float)
    area = face_areas(surface.positions, F)
    real = area > NEGLIGIBLE_AREA * area.sum()
    F, UV = F[real], UV[real]
    if not len(F):
        return 0, 0.0
    _, chart = judge.chart_of_face(F, UV)
    signed = judge.signed_area(UV)
    turned = np.bincount(chart, signed)
    if not signed.any():
        # All lie in points: nothing folds, and nothing covers anything.
        return 0, 0.0
    folds = int(((signed * turned[chart] <= 0) & (np.abs(signed) > FLAT * np.abs(signed).sum())).sum())
    return folds, judge.overlap_share(UV, samples=40_000)


def split_case(seed):
    """A case whose polygons fall into groups with vertices of their own, as importers leave them, without seams."""
    kind, surface, faces, settings = wide_case(seed)
    rng, size = np.random.default_rng(seed), np.diff(surface.face_start)
    group = np.repeat(rng.integers(0, rng.choice([2, 8, 1_000_000]), len(size)), size)
    own, vertex = np.unique(np.stack([group, surface.corner_vertex], axis=1), axis=0, return_inverse=True)
    none = np.zeros((0, 2), np.int64)
    surface = replace(
        surface, positions=surface.positions[own[:, 1]], corner_vertex=vertex.ravel(), seams=none, sharp=none
    )
    return kind, surface, faces, replace(settings, seams="auto")


def outcome(judge, seed, case=wide_case):
    """A word for what became of a case, with folds and overlap; what must not be raises."""
    kind, surface, faces, settings = case(seed)
    before = arrays(surface)
    chosen = np.ones(len(surface.face_start) - 1, bool) if faces is None else faces
    try:
        layout = drain(lay_out([UnwrapJob(surface, faces)], settings))
    except MarginError as error:
        assert "Lower the margin" in str(error)
        return kind, "MarginError", 0, 0.0
    except Refusal as refusal:
        check_error(refusal.error, surface)
        return kind, type(refusal.error).__name__, 0, 0.0
    finally:
        same = all(np.array_equal(a, b, equal_nan=True) for a, b in zip(before, arrays(surface), strict=True))
        assert same, "the input was changed"
    uv = np.zeros((len(surface.corner_vertex), 2), np.float32)
    uv[layout.corners[0]] = layout.uv[0]
    assert np.isfinite(uv).all()
    mapped = np.isin(np.arange(len(uv)), layout.corners[0])
    face = np.repeat(np.arange(len(chosen)), np.diff(surface.face_start))
    lost = chosen & (np.bincount(face, ~mapped, len(chosen)) > 0)
    assert not lost.any(), f"faces {np.flatnonzero(lost)[:10]} have no UVs, {layout.warnings}"
    # Blender holds no such numbers that their squares are none.
    used = surface.positions[np.isfinite(surface.positions).all(axis=1)]
    surface = replace(surface, positions=surface.positions / (np.abs(used).max() or 1.0))
    told = gate([Reading(surface, chosen, uv, None)]).warnings()
    folds, overlap = (0, 0.0) if judge is None else judged(judge, surface, chosen, uv)
    assert not folds or any("folded" in text for text in told), f"{folds} folds unsaid, {told}"
    assert overlap < SEEN or any("under several faces" in text for text in told), f"overlap {overlap} unsaid, {told}"
    return kind, "told" if told else "clean", folds, overlap


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("first", range(FIRST, FIRST + CASES, CHUNK))
def test_no_fold_and_no_overlap_is_unsaid(judge, first):
    for seed in range(first, min(first + CHUNK, FIRST + CASES)):
        try:
            found = outcome(judge, seed)
        except Exception as error:
            error.add_note(f"case {seed}, {wide_case(seed)[0]}, {wide_case(seed)[3]}")
            raise
        if "OMT_UV_FUZZ_LOG" in os.environ:
            with open(os.environ["OMT_UV_FUZZ_LOG"], "a") as log:
                print(seed, *found, file=log)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_parts_that_are_joined_for_the_map_hide_no_fold_and_no_overlap(judge):
    for seed in range(SPLIT):
        try:
            outcome(judge, seed, split_case)
        except Exception as error:
            error.add_note(f"case {seed}, {split_case(seed)[0]}, {split_case(seed)[3]}")
            raise


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("seed", [22_001_935])
def test_what_ended_in_a_defect_once_is_a_layout_or_a_refusal_by_name(judge, seed):
    """Places near the greatest number: the plane that seams mirror in was nowhere."""
    assert outcome(judge, seed)[1] in ("clean", "told", "NonFiniteError")
