"""Which ways a refinement takes before and after its stages, with these written in advance."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.errors import MeshError
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import refine as refinement
from omt_uv.solver.refinement.refine import RefinementOptions, refine

V, F = meshes.bumpy(3, 3)
UV = V[:, :2].copy()


@dataclass
class Result:
    """What stages found: as in `ContinuationResult`."""

    w: np.ndarray
    steps: int = 3
    residual: float = 0.5
    area_weight: float = 9.0
    energy: float = 7.0
    status: str = "converged"
    overlap: bool = False
    warnings: tuple = ("stages",)
    multiplier: float = 0.25
    asked: dict = field(default_factory=dict)


@pytest.fixture
def refined(monkeypatch):
    """A refinement whose symmetry, stages and errors are written; the names of what was done, and its result."""

    def run(
        *,
        symmetric=None,
        relaxed=None,
        embedded=None,
        error=0.001,
        notched=None,
        tense=False,
        crossing_start=True,
        crowded=False,
        **given,
    ):
        calls, errors = [], [error, *(notched or [])]
        initial = SimpleNamespace(
            uv=UV, may_cross=crossing_start, warnings=("initial",), motion="motion", with_barrier=False
        )
        monkeypatch.setattr(refinement, "_start", lambda mesh, faces, boundary, loop: (initial, mesh.uv @ [1, 1j]))
        monkeypatch.setattr(refinement, "find_symmetry", lambda *_: "known" if symmetric is not None else None)

        def next_to_image(faces, may_cross, known, w, by_triangle, boundary, loop):
            calls.append("image")
            return ("symmetry", w) if symmetric and known else (None, w)

        monkeypatch.setattr(refinement, "_next_to_image", next_to_image)

        def to_image(name, value):
            def taking(*words):
                calls.append(name)
                found = ("symmetry" if value else None, 2 * words[2])
                return worked(found) if name == "relaxed" else found

            return taking

        monkeypatch.setattr(refinement, "_relaxed_to_image", to_image("relaxed", relaxed))
        monkeypatch.setattr(refinement, "_embedded_to_image", to_image("embedded", embedded))
        monkeypatch.setattr(refinement, "halved", lambda faces, symmetry: faces)
        monkeypatch.setattr(refinement, "assembly_of", lambda *_: "assembly")

        @dataclass(frozen=True)
        class Problem:
            loop: object
            with_barrier: bool = True
            initial: object = None
            mirrored: bool = False

        monkeypatch.setattr(
            refinement,
            "_map_problem",
            lambda half, assembly, initial, loop, boundary, smoother, loose: Problem("loop", True, initial),
        )
        monkeypatch.setattr(
            refinement,
            "_mirrored",
            lambda problem, symmetry, w, count: refinement.replace(problem, mirrored=symmetry is not None),
        )

        def moved(problem, w, pins):
            calls.append(f"pins {len(pins.vertices)}")
            return worked((problem, w))

        monkeypatch.setattr(refinement, "move_pins", moved)
        monkeypatch.setattr(refinement, "_may_be_tense", lambda *_: tense)

        def smoothed(problem, by_triangle, w, weight):
            calls.append(f"smoothed {weight:g}")
            return worked(w)

        monkeypatch.setattr(refinement, "_smoothed_if_tense", smoothed)

        def stages(problem, w, balance, quality, warm=False, multiplier=0.0, ahead=False):
            initial = "notched" if problem.initial.warnings == ("notches",) else "plain"
            calls.append((initial, problem.loop, problem.with_barrier, problem.mirrored, warm, multiplier, ahead))
            scale = 1 if initial == "plain" else 10
            return worked(Result(w * scale))

        monkeypatch.setattr(refinement, "minimise_in_stages", stages)
        monkeypatch.setattr(
            refinement,
            "area_error",
            lambda faces, w: errors[min(sum(isinstance(c, tuple) for c in calls), len(errors)) - 1],
        )

        def notch(initial, triangles, loop):
            calls.append("notch")
            return SimpleNamespace(warnings=("notches",), may_cross=True) if notched is not None else None

        monkeypatch.setattr(refinement, "notched_disk", notch)
        monkeypatch.setattr(refinement, "is_crowded", lambda *_: crowded)

        def placed(w, given, faces, pins, area):
            calls.append(f"placed {0 if pins is None else len(pins.vertices)} {area is None}")
            return w

        monkeypatch.setattr(refinement, "placed_like", placed)
        pins = given.pop("pins", None)
        found = drain(refine(V, F, UV, RefinementOptions(**given), pins=pins))
        return found, calls

    return run


def stages(calls):
    return [c for c in calls if isinstance(c, tuple)]


PLAIN = ("plain", "loop", True, False, False, 0.0, False)


def test_a_refinement_goes_by_stages_and_lies_as_it_did(refined):
    found, calls = refined()
    assert calls == ["image", PLAIN, "placed 0 False"]
    assert found.uv == pytest.approx(UV) and (found.iterations, found.residual, found.area_weight) == (3, 0.5, 9.0)
    assert (found.energy, found.status, found.overlap, found.multiplier) == (7.0, "converged", False, 0.25)
    assert found.area_error == 0.001 and found.warnings == ("initial", "stages")


@pytest.mark.parametrize(
    ("warm", "prolonged", "boundary"), [(True, False, "free"), (False, True, "free"), (False, True, "disk")]
)
def test_starts_are_told_to_the_stages(warm, prolonged, boundary, refined):
    _, calls = refined(warm_start=warm, prolonged=prolonged, boundary=boundary, multiplier=0.5)
    assert stages(calls) == [("plain", "loop", True, False, warm, 0.5, prolonged and boundary == "free")]
    assert ("placed 0 False" in calls) == (boundary == "free")


def test_a_boundary_that_may_cross_has_nothing_to_keep_it(refined):
    assert stages(refined(crossing=True)[1]) == [("plain", None, False, False, False, 0.0, False)]


@pytest.mark.parametrize(
    ("given", "steps", "mirrored", "warm"),
    [
        ({"symmetric": True}, ["image"], True, False),
        ({"symmetric": False, "relaxed": True}, ["image", "embedded", "relaxed"], True, True),
        ({"symmetric": False, "relaxed": True, "embedded": True}, ["image", "embedded"], True, False),
        ({"symmetric": False}, ["image", "embedded", "relaxed"], False, False),
        ({"symmetric": False, "embedded": True, "boundary": "disk"}, ["image", "relaxed"], False, False),
        ({"symmetric": False, "embedded": True, "warm_start": True}, ["image", "relaxed"], False, True),
        ({"symmetric": True, "pins": (np.array([0]), np.zeros((1, 2)))}, ["image"], False, False),
    ],
)
def test_symmetry_is_sought_in_the_map_then_anew_then_in_one_that_is_relaxed(given, steps, mirrored, warm, refined):
    _, calls = refined(**given)
    assert [c for c in calls if c in ("image", "relaxed", "embedded")] == steps
    assert [(c[3], c[4]) for c in stages(calls)] == [(mirrored, warm)]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_pins_are_moved_where_there_are_several_and_are_there_to_the_bit(count, refined):
    places = np.arange(2.0 * count).reshape(-1, 2) / 7
    found, calls = refined(pins=(np.arange(count), places), tense=True)
    assert np.array_equal(found.uv[:count], places)
    assert (f"pins {count}" in calls) == (count > 1) and ("smoothed 30" in calls) == (count == 1)
    assert ("placed 1 True" in calls) == (count == 1)


def test_tense_starts_are_smoothed_by_the_first_weight(refined):
    assert "smoothed 30" in refined(tense=True)[1] and "smoothed 100" in refined(tense=True, quality="draft")[1]
    assert not [c for c in refined()[1] if "smoothed" in c]


@pytest.mark.parametrize(
    ("error", "quality", "balance", "boundary", "tried"),
    [
        (0.0161, "standard", 0.0, "disk", True),
        (0.0159, "standard", 0.0, "disk", False),
        (0.0051, "exact", 0.0, "disk", True),
        (0.0049, "exact", 0.0, "disk", False),
        (0.5, "standard", 0.1, "disk", False),
        (0.5, "standard", 0.0, "square", False),
        (0.5, "standard", 0.0, "free", False),
    ],
)
def test_disks_without_room_are_tried_with_notches(error, quality, balance, boundary, tried, refined):
    _, calls = refined(error=error, quality=quality, balance=balance, boundary=boundary)
    assert ("notch" in calls) == tried and len(stages(calls)) == 1


@pytest.mark.parametrize("notched", [[0.5], None])
def test_crowded_disks_have_notches_at_once(notched, refined):
    found, calls = refined(error=0.5, notched=notched, boundary="disk", crowded=True)
    assert [c[0] for c in stages(calls)] == ["notched" if notched else "plain"] and calls.count("notch") == 1
    assert found.warnings == ("notches" if notched else "initial", "stages")
    assert "notch" not in refined(boundary="disk", crowded=True, balance=0.5)[1]


@pytest.mark.parametrize(("error", "better"), [(0.49, True), (0.5, False), (0.51, False)])
def test_notches_are_kept_where_they_bring_areas_nearer(error, better, refined):
    found, calls = refined(error=0.5, notched=[error], boundary="disk")
    assert [c[0] for c in stages(calls)] == ["plain", "notched"] and stages(calls)[1][4:] == (False, 0.0, False)
    assert found.uv == pytest.approx(UV * (10 if better else 1))
    assert found.warnings == ("notches" if better else "initial", "stages")


@pytest.mark.parametrize("bad", [{"boundary": "oval"}, {"balance": -0.1}, {"balance": 1.1}])
def test_options_have_to_be_sound(bad):
    with pytest.raises(ValueError, match="must"):
        RefinementOptions(**bad)


def test_pins_need_a_free_boundary_and_targets_are_scaled_to_the_surface():
    with pytest.raises(ValueError, match="free boundary"):
        next(refine(V, F, UV, RefinementOptions(boundary="disk"), pins=(np.array([0]), np.zeros((1, 2)))))
    area = face_areas(V, F)
    assert refinement._targets(area, None) is area
    found = refinement._targets(area, np.arange(1.0, len(F) + 1))
    assert found.sum() == pytest.approx(area.sum()) and found / found[0] == pytest.approx(np.arange(1.0, len(F) + 1))
    with pytest.raises(MeshError, match="A density is not positive and finite"):
        refinement._targets(area, np.zeros(len(F)))


@pytest.mark.parametrize(
    ("ratio", "count", "quality", "boundary", "tense"),
    [
        (1.01, 1001, "standard", "free", True),
        (1.01, 1000, "standard", "free", False),
        (1 + 5e-7, 1001, "standard", "free", False),
        (1.01, 1001, "standard", "disk", False),
        (1.01, 1001, "draft", "free", "draft" not in refinement.UNSMOOTHED),
    ],
)
def test_only_large_uneven_targets_are_smoothed(ratio, count, quality, boundary, tense):
    faces = SimpleNamespace(ratio=np.array([1.0, ratio, 1.0]), triangles=np.zeros((count, 3)))
    options = RefinementOptions(boundary=boundary, quality=quality)
    assert refinement._may_be_tense(faces, options) == tense
    assert not refinement._may_be_tense(faces, replace(options, warm_start=True))


@pytest.mark.parametrize("boundary", ["square", "rectangle", "free", "disk"])
@pytest.mark.parametrize("far", [True, False])
@pytest.mark.parametrize("quads", [True, False])
def test_initial_maps_are_told_of_quads_and_of_areas_far_off(quads, far, boundary, monkeypatch):
    monkeypatch.setattr(refinement, "corners_of_quads", lambda faces: "corners")
    found = refinement._start_options(boundary, SimpleNamespace(quads="quads" if quads else None), far)
    if boundary in ("square", "rectangle"):
        assert found == ({"quads": "corners"} if quads else {})
    else:
        assert found == ({"relaxed": np.inf} if far else {})


@pytest.mark.parametrize("n", [2000, 2001])
@pytest.mark.parametrize("change", [None, "polygon", "region", "pins", "balance"])
def test_sweeps_follow_steps_of_large_meshes_with_a_region(change, n):
    faces = SimpleNamespace(
        polygon=np.zeros(1) if change == "polygon" else None, region=None if change == "region" else np.zeros(1)
    )
    mesh = SimpleNamespace(vertices=np.zeros((n, 3)), triangles=F, pins="pins" if change == "pins" else None)
    balance = 0.5 if change == "balance" else 0.0
    found = refinement._smoother(mesh, faces, RefinementOptions(boundary="disk", balance=balance))
    assert (found is not None) == (n == 2001 and change is None)
    assert refinement._is_loose(mesh, faces, balance) == (n == 2001 and change is None)
    assert refinement._smoother(mesh, faces, RefinementOptions(balance=balance)) is None


def test_elements_triangle_by_triangle_are_those_of_no_polygons():
    mesh = SimpleNamespace(vertices=V, triangles=F)
    plain = elements(V, F, face_areas(V, F))
    asked = refinement._AreasAsked(face_areas(V, F), None, None)
    assert asked.by_triangle(mesh, plain) is plain
