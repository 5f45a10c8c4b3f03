"""Stages of growing area weight: how they end, and what does not change the way."""

from dataclasses import dataclass, replace
from itertools import product
from types import SimpleNamespace

import meshes
import numpy as np
import polygons
import pytest

from omt_uv.solver.maps.distortion import face_distortion
from omt_uv.solver.maps.energy import area_error, elements
from omt_uv.solver.maps.polygon_elements import polygon_elements
from omt_uv.solver.maps.tutte import tutte
from omt_uv.solver.maps.untangle import arc_length_boundary
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import continuation
from omt_uv.solver.refinement.boundary_barrier import CLOSE_REACH, REACH
from omt_uv.solver.refinement.continuation import (
    MapProblem,
    StageLimits,
    StageResult,
    as_far_as_apart,
    is_through,
    minimise,
    minimise_in_stages,
    rescaled,
    set_apart,
)
from omt_uv.solver.refinement.continuation_rules import (
    AHEAD,
    NEAR,
    QUALITIES,
    SQUEEZED,
    SQUEEZED_WEIGHT,
    UNSQUEEZED,
    planned_weights,
)
from omt_uv.solver.refinement.hessian_blocks import Assembly, assembly_of
from omt_uv.solver.refinement.projected_newton import FreeMotion, NewtonStep


@dataclass(frozen=True)
class Parabola:
    """Energy 1 + x^2, whose Newton steps are exact; areas are right at x = 0 alone."""

    shares: tuple[float, ...] = (1.0,)

    def energy(self, w):
        return 1 + float(w @ w)

    def area_error(self, w):
        return float(np.abs(w).max())

    def step(self, w, value, pressure):
        share = self.shares[0]
        after = w * (1 - share)
        return NewtonStep(after, self.energy(after), float(w @ w), share)


def test_an_exact_step_is_the_only_one_but_for_the_proof():
    stage = drain(minimise(Parabola(), np.ones(3), StageLimits(0.1, 50)))
    assert stage.status == "converged" and stage.steps == 2 and not stage.w.any()


def test_a_stage_that_passes_needs_no_proof():
    """One full step that has kept its promise is enough on the way; one that was cut short is not."""
    passing = StageLimits(np.inf, 50, passing=True)
    assert drain(minimise(Parabola(), np.ones(3), passing)).steps == 1
    assert drain(minimise(Parabola((0.5,)), np.ones(3), passing)).steps > 1
    # A promise of many times what is left tells of the way to go, and of nothing else.
    assert drain(minimise(Parabola(), 2 * np.ones(3), passing)).steps > 1


@dataclass(frozen=True)
class Settling(Parabola):
    """Halves what it is away at every step, as promised; the shear is what `sheared` says of it."""

    def step(self, w, value, pressure):
        after = w / 2
        return NewtonStep(after, self.energy(after), value - self.energy(after), 1.0)


def test_a_brisk_stage_ends_once_two_steps_kept_their_promise_and_shear_stays():
    """The areas are at their goal from the first step on; the second one changes the shear by a fortieth."""

    def sheared(w):
        return 1 + 0.1 * float(np.abs(w).max())

    def steps(**how):
        limits = StageLimits(10.0, 50, tolerance=1e-9, loose_tolerance=1e-9, shear=sheared, **how)
        return drain(minimise(Settling(), np.ones(3), limits)).steps

    assert steps(brisk=True) == 2 < steps()


def test_a_brisk_stage_does_not_end_far_from_its_end():
    """The shear never changes, and areas are at their goal; what a step promises is three times what it leaves."""
    limits = StageLimits(1e3, 50, tolerance=1e-9, loose_tolerance=1e-9, shear=lambda w: 1.0, brisk=True)
    assert drain(minimise(Settling(), 1e3 * np.ones(3), limits)).steps > 2


def test_a_stage_ends_when_its_steps_are_used_up_or_help_no_more():
    assert drain(minimise(Parabola((0.01,)), np.ones(3), StageLimits(0.1, 5))).status == "steps"
    stalled = drain(minimise(Parabola((0.0,)), np.ones(3), StageLimits(0.1, 50)))
    assert stalled.status == "stalled" and stalled.w.all()


def test_a_step_to_where_it_is_forbidden_is_not_taken():
    stage = drain(minimise(Parabola(), np.ones(3), StageLimits(0.1, 50), 0, lambda w: not w.any()))
    assert stage.status == "crossed" and stage.w.all() and not stage.ahead.any()


def problem_of(V, F, target=None, region=None):
    loop = boundary_loops(F)[0]
    area = face_areas(V, F)
    target = area if target is None else target * (area.sum() / target.sum())
    problem = MapProblem(
        elements(V, F, target, region), Assembly(F, len(V)), FreeMotion(np.zeros(len(V), bool)), loop, False
    )
    w = tutte(V, F, loop, arc_length_boundary(V, loop, np.sqrt(area.sum() / np.pi))) @ [1, 1j]
    return problem, w


def ramp(turns):
    """A strip that winds around an axis so many times, flat but where it would lie on itself: vertices and triangles,
    and a map in which it winds less than once."""
    V, F = meshes.bumpy(60, 3, height=0.0)
    along, across = V[:, 0] / V[:, 0].max(), 1.5 - 0.5 * V[:, 1] / V[:, 1].max()
    angle = 2 * np.pi * turns * along
    V = np.column_stack([across * np.cos(angle), across * np.sin(angle), 0.01 * along])
    return V, F, 1.3 * across * np.exp(1.8j * np.pi * along)


def test_what_would_cross_goes_most_of_the_way_to_there():
    V, F, w = ramp(1.3)
    problem, _ = problem_of(V, F)
    newton = problem.newton_problem(w, 1.0, False)
    stage = drain(minimise(newton, w, StageLimits(0.0, 50), 0, problem.boundary_crosses))
    assert stage.status == "crossed" and problem.boundary_crosses(stage.ahead)
    near = as_far_as_apart(problem, newton, stage)
    assert not problem.boundary_crosses(near) and newton.energy(near) < stage.energy
    far = (near - stage.w) @ (stage.ahead - stage.w).conj() / np.linalg.norm(stage.ahead - stage.w) ** 2
    np.testing.assert_allclose(near, stage.w + far * (stage.ahead - stage.w))
    touching = stage.w + far / 0.8 * (stage.ahead - stage.w)
    assert 0 < far.real < 1 and problem.boundary_crosses(touching + 1e-6 * (stage.ahead - stage.w))
    # Where nothing is won on the way, nothing moves.
    np.testing.assert_array_equal(as_far_as_apart(problem, newton, replace(stage, energy=0.0)), stage.w)


@pytest.fixture(scope="module")
def bumpy():
    return problem_of(*meshes.bumpy(10, 10))


def test_targets_follow_the_area_of_the_map(bumpy):
    problem, w = bumpy
    faces = rescaled(problem, 3 * w).faces
    assert faces.area @ faces.ratio == pytest.approx(faces.areas(3 * w).sum())
    np.testing.assert_allclose(faces.ratio / problem.faces.ratio, faces.ratio[0] / problem.faces.ratio[0])


@pytest.mark.parametrize("name", ["draft", "standard", "exact"])
def test_the_areas_of_every_quality_are_reached(bumpy, name):
    problem, w = bumpy
    found = drain(minimise_in_stages(problem, w, 0.0, QUALITIES[name]))
    assert found.status == "converged" and area_error(problem.faces, found.w) <= QUALITIES[name].area_error
    assert found.area_weight in QUALITIES[name].area_weights and not found.warnings and not found.overlap


def test_a_turn_of_the_start_turns_the_result(bumpy):
    problem, w = bumpy
    plain, turned = (drain(minimise_in_stages(problem, c * w, 0.0, QUALITIES["standard"])) for c in (1, 0.6 + 0.8j))
    np.testing.assert_allclose(turned.w, (0.6 + 0.8j) * plain.w, atol=1e-6)
    assert turned.steps == plain.steps


def test_a_warm_start_begins_with_the_second_weight(bumpy):
    problem, w = bumpy
    near = drain(minimise_in_stages(problem, w, 0.0, QUALITIES["standard"])).w
    again = drain(minimise_in_stages(problem, near, 0.0, QUALITIES["standard"], warm_start=True))
    assert again.area_weight == 2 * QUALITIES["standard"].area_weights[1] and again.steps < 10


def test_polygons_of_a_finer_mesh_begin_with_no_more_weight_than_leaves_them_what_they_may_be_off():
    V, Q, _ = polygons.wavy_quads(20, 16)
    F, face = polygons.cut(Q)
    problem, w = problem_of(V, F)
    faces = polygon_elements(V, F, face_areas(V, F), face)
    problem = replace(problem, faces=faces, assembly=assembly_of(faces, len(V)))
    standard = QUALITIES["standard"]
    near = drain(minimise_in_stages(problem, w, 0.0, standard)).w
    again = drain(minimise_in_stages(problem, near, 0.0, standard, prolonged=True))
    assert standard.area_weights[0] <= again.area_weight < standard.area_weights[1]
    assert area_error(faces, again.w) <= standard.area_error


def test_a_multiplier_gives_a_region_its_share():
    V, F = meshes.bumpy(10, 10)
    region = (np.linalg.norm(V[F].mean(axis=1)[:, :2] - 0.5, axis=1) < 0.2).astype(float)
    problem, w = problem_of(V, F, face_areas(V, F) * (1 + 4 * region), region)
    found = drain(minimise_in_stages(problem, w, 0.0, QUALITIES["standard"]))
    has, target = problem.faces.areas(found.w), problem.faces.area * problem.faces.ratio
    assert found.multiplier > 0
    assert region @ has / has.sum() == pytest.approx(region @ target / target.sum(), rel=0.003)


def test_a_boundary_that_may_not_move_has_no_barrier(bumpy):
    problem, w = bumpy
    with pytest.raises(ValueError, match="may not move"):
        replace(problem, loop=None).barrier(w)
    assert not replace(problem, loop=None).boundary_crosses(w)


@pytest.mark.parametrize("balance", [0.0, 1e-9, 0.5, 1.0])
@pytest.mark.parametrize("status", ["converged", "stalled", "steps", "crossed"])
@pytest.mark.parametrize("share", [0.5, 0.999, 1.0, 2.0])
def test_a_stage_on_the_way_was_the_last_where_nothing_is_traded_and_nothing_is_left(balance, status, share):
    for quality in QUALITIES.values():
        stage = StageResult(np.zeros(3), 3, share * quality.loose_tolerance, 1.0, status)
        assert is_through(stage, balance, quality) == (balance == 0 and status == "converged" and share < 1)


@pytest.mark.parametrize("quality", QUALITIES.values(), ids=list(QUALITIES))
@pytest.mark.parametrize("balance", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("warm", "prolonged"), [(False, False), (False, True), (True, False), (True, True)])
def test_the_first_stage_goes_by_how_good_the_start_is(quality, balance, warm, prolonged):
    """A start that is near the end begins at the second weight, one that is squeezed, and sheared, at a weight before
    the first; only then there is a stage to take back. No map is made: energies at the first two weights are given, and
    that of the shear alone, at weight 0."""
    planned = planned_weights(balance, quality)
    shears = (UNSQUEEZED, 1.01 * UNSQUEEZED)
    for first, share, shear in product((SQUEEZED / 2, SQUEEZED, 2 * SQUEEZED), (AHEAD / 2, AHEAD, 1.0), shears):

        def problem_at(w, weight, is_barrier, first=first, share=share, shear=shear):
            assert w == "start" and weight in (0.0, *planned[:2]) and not is_barrier
            if weight == 0:
                return SimpleNamespace(energy=lambda w: shear)
            return SimpleNamespace(energy=lambda w: first if weight == planned[0] else share * first)

        problem = SimpleNamespace(newton_problem=problem_at, faces=SimpleNamespace(polygon=None))
        weights, before = continuation._first_weights(problem, "start", balance, quality, (warm, prolonged))
        if warm and len(planned) > 1:
            assert (weights, before) == ([NEAR * w for w in planned[1:]], False)
        elif first > SQUEEZED and planned[0] > SQUEEZED_WEIGHT and shear > UNSQUEEZED:
            assert (weights, before) == ([SQUEEZED_WEIGHT, *planned], True)
        else:
            ahead = prolonged and balance == 0 and len(planned) > 1 and share < AHEAD
            assert (weights, before) == (planned[1:] if ahead else planned, False)


def cut_open(height):
    """A square of squares with a slit from one side to its middle and a low bump: vertices, triangles and its outline,
    laid flat from above, where the sides of the slit lie on one another."""
    n = 12
    V, F = meshes.grid(n, n)
    V[:, 2] = height * np.maximum(0, 1 - ((V[:, 0] - 0.75) ** 2 + (V[:, 1] - 0.25) ** 2) / 0.04)
    row = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)[n // 2]
    (chart,) = strict_charts(triangle_surface(V, F, np.stack([row[n // 2 : -1], row[n // 2 + 1 :]], axis=1)))
    return chart.vertices, chart.triangles


@pytest.mark.parametrize("height", [0.005, 0.02])
def test_the_sides_of_a_slit_that_lie_on_one_another_neither_cross_nor_open(height):
    V, F = cut_open(height)
    loop, area = boundary_loops(F)[0], face_areas(V, F)
    w = V[:, 0] + 1j * V[:, 1]
    problem = MapProblem(
        elements(V, F, area), Assembly(F, len(V)), FreeMotion(np.zeros(len(V), bool)), loop, with_barrier=False
    )
    found = drain(minimise_in_stages(problem, w, 0.0, QUALITIES["standard"]))
    assert found.status == "converged" and not found.overlap and not problem.boundary_crosses(found.w)
    # With a barrier that reaches as far as elsewhere it is 1.03.
    assert face_distortion(V, F, np.stack([found.w.real, found.w.imag], axis=1)[F])[1] @ area / area.sum() < 1.006


def test_what_would_fold_or_cross_is_not_set_apart():
    V, F = cut_open(0.02)
    problem, _ = problem_of(V, F)
    w = V[:, 0] + 1j * V[:, 1]
    newton = problem.newton_problem(w, 30.0, False)
    stage = drain(minimise(newton, w, StageLimits(0.0, 50), 0, problem.boundary_crosses))
    assert stage.status == "crossed"
    closer, moved = set_apart(problem, newton, stage)
    # Only what touched is nearer to each other than a barrier elsewhere lets it be.
    touching = moved != stage.w
    assert touching.any() and not problem.boundary_crosses(moved)
    np.testing.assert_array_equal(closer.contact_reach, np.where(touching, CLOSE_REACH, REACH))
    barrier = closer.barrier(moved)
    edge = np.abs(np.diff(moved[np.stack([barrier.tail, barrier.head])], axis=0))[0]
    far = ~touching[barrier.tail] & ~touching[barrier.head]
    assert far.any() and (barrier.edge_reach <= np.where(far, REACH, CLOSE_REACH) * edge * (1 + 1e-12)).all()
    assert (barrier.edge_reach[far] > CLOSE_REACH * edge[far]).all()
    folded = SimpleNamespace(energy=lambda w: np.inf)
    same, near = set_apart(problem, folded, stage)
    assert same.contact_reach == REACH and np.array_equal(near, stage.w)
    # What does not touch goes most of the way to there, as ever.
    V, F, w = ramp(1.3)
    problem, _ = problem_of(V, F)
    newton = problem.newton_problem(w, 1.0, False)
    stage = drain(minimise(newton, w, StageLimits(0.0, 50), 0, problem.boundary_crosses))
    same, near = set_apart(problem, newton, stage)
    assert same is problem and np.array_equal(near, as_far_as_apart(problem, newton, stage))
