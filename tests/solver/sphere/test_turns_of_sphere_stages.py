"""Stages of maps to the sphere, their symmetric ways and those from coarse to fine, with steps written in advance."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import told, worked

from omt_uv.solver.errors import FoldedUVError, PrecisionError
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.continuation import StageResult
from omt_uv.solver.refinement.continuation_rules import QUALITIES, Quality
from omt_uv.solver.sphere import multilevel
from omt_uv.solver.sphere import refine as spheres

V, F = meshes.icosphere(0)
QUALITY = Quality(area_error=0.01, area_weights=(30.0, 500.0), greatest_weight=1e4, max_steps=60, tolerance=3e-2)


# ---- stages -------------------------------------------------------------------------------------------------


@pytest.fixture
def staged(monkeypatch):
    """Stages that end as they are written: status, steps, area error, and that of projections."""

    def run(ends, *, balance=0.0, energy=1.0, quality=QUALITY):
        asked = []
        problem = SimpleNamespace(area_error=lambda p: ends[len(asked) - 1][2])

        def projected(problem, p, weight):
            return SimpleNamespace(
                weight=weight, energy=lambda p: energy, projected_area_error=lambda p: ends[len(asked) - 1][3]
            )

        def minimise(current, p, limits, k):
            asked.append((current.weight, limits, k))
            status, steps, *_ = ends[len(asked) - 1]
            return worked(StageResult(p + 1, steps, 0.5, 7.0, status))

        monkeypatch.setattr(spheres, "with_projected_targets", projected)
        monkeypatch.setattr(spheres, "with_both_diagonals", lambda problem, p: problem)
        monkeypatch.setattr(spheres, "minimise", minimise)
        found = drain(spheres._stages(problem, np.zeros((2, 3)), balance, quality))
        return found, asked

    return run


def test_stages_have_the_planned_weights_and_limits(staged):
    found, asked = staged([("converged", 3, 0.5, 0.5), ("converged", 4, 0.01, 0.0)])
    assert [a[0] for a in asked] == [30, 500] and [a[2] for a in asked] == [0, 1]
    assert [a[1].area_error for a in asked] == [np.inf, 0.01] and [a[1].max_steps for a in asked] == [40, 40]
    assert [a[1].foreseeing for a in asked] == [False, True] and [a[1].passing for a in asked] == [True, False]
    assert (found.iterations, found.area_weight, found.area_error, found.energy) == (7, 500, 0.01, 7.0)
    assert (found.status, found.residual, found.untangling) == ("converged", 0.5, 0) and found.positions[0, 0] == 2


@pytest.mark.parametrize(
    "quality, energy, passing",
    [("standard", 1.0, True), ("standard", 51.0, False), ("exact", 1.0, False), ("draft", 1.0, False)],
)
def test_stages_on_the_way_pass_where_areas_need_not_be_exact(quality, energy, passing, staged):
    ends = [("converged", 1, 0.5, 0.5)] * 3 + [("converged", 1, 0.0, 0.0)] * 3
    _, asked = staged(ends, energy=energy, quality=QUALITIES[quality])
    assert any(a[1].passing for a in asked) == passing and not asked[-1][1].passing


def test_what_is_squeezed_is_relaxed_first(staged):
    ends = [("converged", 1, 0.5, 0.5), ("converged", 1, 0.5, 0.5), ("converged", 1, 0.01, 0.0)]
    assert [a[0] for a in staged(ends, energy=51.0)[1]] == [1, 30, 500]
    assert [a[0] for a in staged(ends[1:], energy=49.0)[1]] == [30, 500]


def test_stages_end_with_their_steps_or_where_they_stall(staged):
    found, asked = staged([("steps", 30, 0.5, 0.5)] * 9)
    assert found.iterations == 60 and [a[1].max_steps for a in asked] == [40, 30]
    assert len(staged([("stalled", 3, 0.5, 0.5)] * 9)[1]) == 1
    # With a balance a stage may take all that are left.
    _, asked = staged([("converged", 3, 0.5, 0.5)] * 9, balance=0.1)
    assert [a[1].max_steps for a in asked] == [60, 57] and not any(a[1].foreseeing for a in asked)


@pytest.mark.parametrize(
    ("error", "projected", "growth"),
    # Where projections are right, and it came nearer by enough, they are made anew; else weights grow with the excess.
    [(0.02, 0.0049, 1.0), (0.02, 0.0051, 4.0), (0.0101, 0.0051, None), (0.2, 0.0051, None), (0.45, 0.0049, None)],
)
def test_weights_grow_with_what_is_left_or_projections_are_made_anew(error, projected, growth, staged):
    ends = [("converged", 1, 0.5, 0.5), ("converged", 1, error, projected), ("converged", 1, 0.01, 0.0)]
    found = [a[0] for a in staged(ends)[1]]
    if growth is None:
        growth = float(np.clip((error / 0.01) ** 2, 2.0, 10.0))
    assert found[:2] == [30, 500] and found[2] == pytest.approx(500 * growth)


# ---- symmetry -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    positions: np.ndarray
    area_error: float
    name: str
    untangling: int = 0


@pytest.mark.parametrize(
    ("symmetric", "error", "free", "balance", "name"),
    [
        (False, 0.0, 0.1, 0.0, "free"),
        (True, 0.0079, 0.1, 0.0, "symmetric"),
        (True, 0.0079, 0.0001, 0.0, "symmetric"),
        (True, 0.0081, 0.0081, 0.0, "free or symmetric"),
        (True, 0.5, 0.001, 0.0, "free"),
        (True, 0.5, 0.001, 0.3, "symmetric"),
        (None, 0.0, 0.1, 0.0, "free"),
    ],
)
def test_symmetric_maps_are_taken_where_they_have_their_areas_or_others_have_not_either(
    symmetric, error, free, balance, name, monkeypatch
):
    monkeypatch.setattr(spheres, "untangle_on_sphere", lambda faces, assembly, p: worked((p, 4)))
    found = SimpleNamespace(images="images") if symmetric is not None else None
    monkeypatch.setattr(spheres, "find_symmetry", lambda *_: found)
    ours = Found(V, error, "symmetric") if symmetric else None
    monkeypatch.setattr(spheres, "_symmetric", lambda *_: worked((ours, 5)))
    monkeypatch.setattr(spheres, "_stages", lambda problem, p, balance, settings: worked(Found(V, free, "free")))
    area = np.full(len(F), 1.0)
    result, fractions = told(spheres.sphere_refine(V, F, V, area, balance=balance))
    if name == "free or symmetric":
        name = "symmetric" if error <= 1.25 * free else "free"
    assert result.name == name and result.untangling == 4 + (5 if symmetric is not None else 0)
    assert fractions[0] == 0 and fractions[-1] == 1


def test_starts_that_stay_folded_are_refused(monkeypatch):
    monkeypatch.setattr(spheres, "untangle_on_sphere", lambda faces, assembly, p: worked((-p, 4)))
    with pytest.raises(FoldedUVError, match="Folds of the transport map could not be"):
        drain(spheres.sphere_refine(V, F, V, np.ones(len(F))))
    with pytest.raises(ValueError, match="balance"):
        next(spheres.sphere_refine(V, F, V, np.ones(len(F)), balance=1.5))


@pytest.mark.parametrize("state", ["none", "folded", "good"])
def test_symmetric_starts_are_averaged_straightened_and_averaged_again(state, monkeypatch):
    calls = []
    averaged = lambda p: (calls.append("averaged"), -p if state == "folded" else p)[1]  # noqa: E731
    symmetry = SimpleNamespace(averaged=averaged)
    monkeypatch.setattr(
        spheres, "symmetric_map", lambda images, start: None if state == "none" else (symmetry, 2 * start)
    )
    monkeypatch.setattr(
        spheres, "untangle_on_sphere", lambda faces, assembly, p: (calls.append("straight"), worked((p, 6)))[1]
    )
    monkeypatch.setattr(
        spheres,
        "_stages",
        lambda problem, p, balance, settings: worked((problem.symmetry is symmetry, np.linalg.norm(p[0]))),
    )

    @dataclass(frozen=True)
    class Problem:
        symmetry: object = None

    by_triangle = SimpleNamespace(faces=SimpleNamespace(triangles=F), assembly=None)
    found, steps = drain(spheres._symmetric(Problem(), by_triangle, "images", V, 0.0, QUALITIES["standard"]))
    if state == "none":
        assert (found, steps, calls) == (None, 0, [])
    else:
        assert calls == ["straight", "averaged"] and steps == 6
        assert found is None if state == "folded" else (found[0], round(found[1], 9)) == (True, 1.0)


@pytest.mark.parametrize("regular", [False, True])
def test_what_is_relaxed_has_its_faces_or_equilateral_ones(regular, monkeypatch):
    asked = []

    def stages(problem, p, balance, settings):
        asked.append(problem)
        return worked(SimpleNamespace(positions=p, iterations=9))

    monkeypatch.setattr(spheres, "_stages", stages)
    target = np.arange(1.0, len(F) + 1)
    positions, steps = drain(spheres.relax(V * [1, 2, 3], F, V, target, regular))
    assert np.array_equal(positions, V) and steps == 9
    problem = asked[0]
    want = np.ones(len(F)) if regular else target
    # By the areas that are asked for, whichever order vertices have.
    assert np.sort(problem.target) == pytest.approx(np.sort(want * 4 * np.pi / want.sum()))
    assert problem.ratio is problem.faces.ratio or np.array_equal(problem.ratio, problem.faces.ratio)
    if regular:
        # Triangles of one shape and size.
        assert problem.faces.ratio == pytest.approx(np.full(len(F), 4 / np.sqrt(3)))


# ---- coarse to fine -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cosines", "best", "attempts"),
    [
        ([0.31], 0, 1),
        ([0.29, 0.3], 1, 2),
        ([0.1, 0.2, 0.15] + [0.0] * 5, 1, 8),
        ([None, 0.2] + [0.1] * 6, 1, 8),
        ([None, 0.5], 1, 2),
    ],
)
def test_ways_to_the_tetrahedron_are_tried_until_no_face_reaches_around(cosines, best, attempts, monkeypatch):
    tried, asked = [], []

    def way(levels, regular):
        tried.append((levels, regular))
        cosine = cosines[len(tried) - 1]
        return worked(PrecisionError("no") if cosine is None else (len(tried) - 1, 10))

    def collapse(vertices, triangles, mass, attempt=0):
        asked.append(attempt)
        return f"way {attempt}"

    monkeypatch.setattr(multilevel, "_from_tetrahedron", way)
    monkeypatch.setattr(multilevel, "collapse_to_tetrahedron", collapse)
    monkeypatch.setattr(
        multilevel,
        "project_faces",
        lambda positions, triangles: SimpleNamespace(least_cosine=np.array([0.9, cosines[positions]])),
    )
    level = SimpleNamespace(vertices=V, triangles=F, mass=None)
    positions, steps = drain(multilevel._best_of_attempts([level]))
    assert positions == best and len(tried) == attempts and asked == list(range(1, attempts))
    assert steps == 10 * sum(c is not None for c in cosines[:attempts])
    assert [r for _, r in tried] == [100 * (k % 2) for k in range(attempts)]
    assert tried[0][0] == [level] and [w for w, _ in tried[1:]] == [f"way {k}" for k in range(1, attempts)]


def test_where_no_way_leads_the_last_error_is_raised(monkeypatch):
    count = iter(range(99))
    monkeypatch.setattr(multilevel, "_from_tetrahedron", lambda *_: worked(PrecisionError(f"no {next(count)}")))
    monkeypatch.setattr(multilevel, "collapse_to_tetrahedron", lambda *_: None)
    with pytest.raises(PrecisionError, match=f"no {8 - 1}"):
        drain(multilevel._best_of_attempts([SimpleNamespace(vertices=V, triangles=F, mass=None)]))


@pytest.mark.parametrize(("sizes", "few"), [((3000, 1300, 1200, 9), 2), ((3000, 1300), 1), ((9,), 0)])
def test_small_levels_are_tried_again_and_large_ones_come_once(sizes, few, monkeypatch):
    levels = [SimpleNamespace(vertices=np.zeros((n, 3))) for n in sizes]
    asked = []
    monkeypatch.setattr(multilevel, "collapse_to_tetrahedron", lambda *_: levels)

    def attempts(some):
        asked.append([len(level.vertices) for level in some])
        return worked(("start", 5))

    def prolonged(level, positions):
        asked.append(len(level.vertices))
        return worked((positions, 1))

    monkeypatch.setattr(multilevel, "_best_of_attempts", attempts)
    monkeypatch.setattr(multilevel, "_prolonged", prolonged)
    (positions, steps), _ = told(multilevel.multilevel_start(V, F, None))
    assert asked == [list(sizes[few:]), *reversed(sizes[:few])] and (positions, steps) == ("start", 5 + few)
