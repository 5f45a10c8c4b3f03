"""What outlines, live maps and magnifications decide: which outline is one, which step comes next, what is told."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing import live_map
from omt_uv.solver.editing import magnify as magnifying
from omt_uv.solver.editing.live_map import LiveMap
from omt_uv.solver.editing.outline import _on_sides, _turns, recognise_outline
from omt_uv.solver.editing.uv_islands import _labels, _welded
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.topology import boundary_edges, boundary_loops

# ---- outlines -----------------------------------------------------------------------------------------------


def polygon(corners, between=4):
    """A closed polygon with vertices in between on its sides, complex."""
    corners = np.asarray(corners, complex)
    t = np.arange(between + 1) / (between + 1)
    return np.concatenate([a + t * (b - a) for a, b in zip(corners, np.roll(corners, -1), strict=True)])


def kind(points):
    return recognise_outline(points, np.arange(len(points))).kind


@pytest.mark.parametrize(("off", "found"), [(9e-4, "circle"), (1.1e-3, "free")])
def test_circles_are_round_to_two_thousandths(off, found):
    points = np.exp(2j * np.pi * np.arange(24) / 24)
    points *= 1 + off * (-1.0) ** np.arange(24)
    assert kind(points) == found


@pytest.mark.parametrize(("count", "found"), [(11, "free"), (12, "circle")])
def test_circles_have_a_dozen_vertices(count, found):
    assert kind(np.exp(2j * np.pi * np.arange(count) / count)) == found


@pytest.mark.parametrize(("order", "found"), [(1, "circle"), (-1, "free"), (2, "free")])
def test_circles_go_round_once_to_the_left(order, found):
    assert kind(3 + 5 * np.exp(2j * np.pi * order * np.arange(25) / 25)) == found


@pytest.mark.parametrize(("out", "found"), [(4e-3, "sides"), (6e-3, "free")])
def test_sides_are_straight_to_a_two_hundredth_of_the_size(out, found):
    points = polygon([0, 1, 1 + 1j, 1j], between=99)
    # A side that is bent like an arc turns by little at every vertex.
    t = np.arange(100) / 100
    points[:100] -= 1j * out / np.sqrt(2) * 4 * t * (1 - t)
    points = points - points.mean()
    size = np.abs(points).max()
    assert kind(points * (0.5**0.5 / size)) == found


@pytest.mark.parametrize(("turn", "found"), [(0.019, 3), (0.021, 4)])
def test_a_corner_turns_by_a_fiftieth_of_a_radian(turn, found):
    points = polygon([0, 10, 10 + 10j, 10j], 4)
    points[2] -= 1j * np.tan(turn / 2) * 2
    corner = np.abs(_turns(points)) >= 0.02
    assert corner[2] == (found == 4)


@pytest.mark.parametrize(("between", "found"), [(2, "sides"), (1, "free")])
def test_of_more_than_four_corners_most_vertices_lie_on_sides(between, found):
    # Of a star of ten corners two thirds, or a half.
    star = np.exp(2j * np.pi * np.arange(10) / 10) * np.where(np.arange(10) % 2, 1.0, 2.0)
    assert kind(polygon(star, between)) == found
    # Up to four corners need none.
    assert kind(polygon([0, 1, 1 + 1j, 1j], 0)) == "sides" and kind(polygon([0, 1, 1j], 0)) == "sides"


@pytest.mark.parametrize("shift", [0, 3, 7])
def test_vertices_slide_along_their_sides_and_corners_stay(shift):
    points = polygon([0, 4, 4 + 2j, 2j], 3)
    rng = np.random.default_rng(2)
    corner = np.arange(16) % 4 == 0
    moved = points + np.where(corner, 0, 1e-3 * (rng.standard_normal(16) + 1j * rng.standard_normal(16)))
    w = np.concatenate([[1 + 1j, 2 + 1j], np.roll(moved, shift)])
    loop, corner = 2 + np.arange(16), np.roll(corner, shift)
    found = _on_sides(w, loop, corner)
    sides = np.roll(np.repeat([1, 1j, -1, -1j], 4), shift)
    straight = np.roll(points, shift)
    for k in range(16):
        v = 2 + k
        if corner[k]:
            assert found.w[v] == w[v]
        else:
            # The nearest point of the side.
            want = straight[k] + ((w[v] - straight[k]) * np.conj(sides[k])).real * sides[k]
            assert found.w[v] == pytest.approx(want)
    assert np.array_equal(found.w[:2], w[:2]) and found.kind == "sides" and found.centre == 0
    # Those between corners slide along their sides alone, corners stay, and all else is free.
    assert found.motion.axis[loop[~corner]] == pytest.approx(sides[~corner])
    assert found.motion.free[loop].tolist() == [[False, False] if c else [True, False] for c in corner.tolist()]
    assert found.motion.free[:2].all() and (found.motion.axis[:2] == 1).all()


# ---- islands ------------------------------------------------------------------------------------------------


def test_corners_are_welded_by_their_vertex_and_place_and_those_nowhere_are_alone():
    V, Q = meshes.quad_grid(2, 2)
    surface = meshes.polygon_surface(V, Q)
    corner = np.array(Q).ravel()
    uv = V[corner, :2].copy()
    welded, origin = _welded(surface, uv)
    assert len(origin) == 9 and np.array_equal(origin[welded.corner_vertex], corner)
    assert np.array_equal(welded.positions, surface.positions[origin]) and not len(welded.seams)
    uv[4:8] += [5, 0]
    uv[0] = np.nan
    uv[3] = [np.inf, 0]
    welded, origin = _welded(surface, uv)
    assert np.array_equal(origin[welded.corner_vertex], corner)
    assert (welded.corner_vertex == welded.corner_vertex[0]).sum() == 1
    # Four of the second quad apart, of which vertex 2 is nobody else's, and both that are nowhere.
    together = {(v, *p) for k, (v, p) in enumerate(zip(corner.tolist(), uv.tolist(), strict=True)) if k not in (0, 3)}
    assert len(origin) == len({(v, round(a, 6), round(b, 6)) for v, a, b in together}) + 2


@pytest.mark.parametrize("parted", [False, True])
def test_polygons_hang_together_by_their_sides(parted):
    V, Q = meshes.quad_grid(3, 1)
    surface = meshes.polygon_surface(V, Q)
    uv = V[np.array(Q).ravel(), :2].copy()
    uv[8:] += [parted, 0]
    found = _labels(_welded(surface, uv)[0])
    assert found[0] == found[1] and (found[1] == found[2]) == (not parted)


# ---- live maps ----------------------------------------------------------------------------------------------


class Steps:
    """Newton's method with steps that are written in advance."""

    def __init__(self, monkeypatch, steps, crossing=()):
        self.steps, self.asked, self.crossing = list(steps), [], list(crossing)
        monkeypatch.setattr(live_map, "newton_step", self.step)
        monkeypatch.setattr(live_map.MapProblem, "boundary_crosses", lambda *_: self.crosses())

    def crosses(self):
        return self.crossing.pop(0) if self.crossing else False

    def step(self, problem, w, value, pressure=1.0):
        share, decrement = self.steps.pop(0)
        self.asked.append((problem.area_weight, pressure, len(problem.terms)))
        return SimpleNamespace(share=share, decrement=decrement * value, w=w * (1 + 1e-6), energy=value)


def live(**given):
    V, F = meshes.bumpy(4, 4)
    return LiveMap(V, F, V[:, :2] * [1.0, 0.8], **given)


def test_a_live_map_rests_where_a_step_promises_little_or_helps_nothing(monkeypatch):
    steps = Steps(monkeypatch, [(1.0, 1.0), (1.0, 1.01 * 1e-3), (1.0, 0.99 * 1e-3)])
    mine = live()
    rests = []
    for _ in range(3):
        mine.follow(0.0, seconds=0.0)
        rests.append(mine.at_rest)
    assert rests == [False, False, True]
    # At rest it takes no step; for another balance it does.
    mine.follow(0.0, seconds=0.0)
    assert len(steps.asked) == 3 and {a[0] for a in steps.asked} == {500.0}
    steps.steps = [(0.0, 1.0), (0.0, 1.0)]
    mine.follow(1.0, seconds=0.0)
    # What helps nothing is tried once more with all of the Hessian.
    assert mine.at_rest and [a[1] for a in steps.asked[3:]] == [live_map.FIRST_PRESSURE, 1.0]
    assert steps.asked[-1][0] == pytest.approx(1e-2)


def test_a_live_map_takes_as_many_steps_as_it_has_time_for(monkeypatch):
    steps = Steps(monkeypatch, [(1.0, 1.0)] * 50)
    times = iter(np.arange(100.0))
    monkeypatch.setattr(live_map.time, "perf_counter", lambda: next(times))
    live().follow(0.0, seconds=3.0)
    assert len(steps.asked) == 3


def test_what_would_cross_is_not_taken_and_guarded_from_then_on(monkeypatch):
    steps = Steps(monkeypatch, [(1.0, 1.0)] * 3, crossing=[False, True])
    mine = live()
    before = mine.uv
    mine.follow(0.0, seconds=0.0)
    assert not np.array_equal(mine._w, mine._given)
    w = mine._w
    mine.follow(0.0, seconds=0.0)
    assert mine._w is w and not mine.at_rest
    mine.follow(0.0, seconds=0.0)
    assert [a[2] for a in steps.asked] == [0, 0, 1] and mine._w is not w
    assert mine.uv == pytest.approx(before, abs=1e-4)


@pytest.mark.parametrize("soft", [False, True])
def test_pins_that_are_pulled_end_the_rest(soft, monkeypatch):
    V, _ = meshes.bumpy(4, 4)
    places = V[[7, 2], :2] * [1.0, 0.8]
    Steps(monkeypatch, [(1.0, 0.0)] * 9)
    mine = live(pins=(np.array([7, 2]), places), soft=soft)
    assert mine._stiffness == (1.0 if soft else 1e6)
    mine.follow(0.0, places, seconds=0.0)
    assert mine.at_rest
    mine.follow(0.0, places, seconds=0.0)
    assert mine.at_rest and len(mine._pins.places) == 2
    mine._pull(mine._pins, places + [[0, 0], [0, 1e-3]])
    assert not mine.at_rest


@pytest.mark.parametrize("parts", [False, True])
def test_large_islands_are_solved_by_parts_that_are_ready(parts, monkeypatch):
    asked, solved = [], []

    def solve(matrix, b, w, axes):
        solved.append((matrix.shape, axes().shape))
        return b

    ready = SimpleNamespace(solve=solve, factor=None)

    def schwarz(vertices, triangles):
        asked.append((vertices.shape[1], vertices.dtype.kind, triangles.dtype.kind, len(triangles)))
        return ready if parts else None

    made = []
    monkeypatch.setattr(live_map, "schwarz_solver", schwarz)
    given = live_map.assembly_of

    def assembly(faces, n, solver):
        made.append(solver)
        return given(faces, n, solver)

    monkeypatch.setattr(live_map, "assembly_of", assembly)
    live()
    assert asked == [(3, "f", "i", 32)]
    # Before anything is followed.
    assert solved == ([((50, 50), (25, 2))] if parts else [])
    assert (made[0] is ready) == parts


# ---- magnification ------------------------------------------------------------------------------------------


def test_errors_of_shares_are_summed_over_polygons():
    V, F = meshes.grid(2, 2)
    rng = np.random.default_rng(1)
    uv, asked = V[:, :2] + 0.1 * rng.standard_normal((9, 2)), rng.random(8)
    polygons = np.array([3, 3, 3, 5, 5, 9, 9, 9])
    has = np.abs(signed_areas(uv, F))
    off = has / has.sum() - asked / asked.sum()
    assert magnifying.share_error(uv, F, asked, None) == pytest.approx(np.abs(off).sum())
    want = sum(abs(off[polygons == p].sum()) for p in (3, 5, 9))
    assert magnifying.share_error(uv, F, asked, polygons) == pytest.approx(want)


@pytest.mark.parametrize("mirrored", [1, -1])
def test_folds_and_faces_without_area_are_named(mirrored):
    V, F = meshes.grid(2, 2)
    uv = V[:, :2] * [mirrored, 1]
    magnifying.refuse_folds(uv, F)
    folded = uv.copy()
    folded[4] = uv[0] - 0.1 * (uv[8] - uv[0])
    signed = signed_areas(folded, F) * mirrored
    with pytest.raises(magnifying.FoldedUVError) as caught:
        magnifying.refuse_folds(folded, F)
    assert caught.value.elements.tolist() == np.flatnonzero(signed <= 0).tolist() and (signed < 0).any()
    flat = uv.copy()
    first = next(k for k in range(8) if 4 in F[k])
    flat[4] = np.mean([uv[v] for v in F[first] if v != 4], axis=0)
    with pytest.raises(magnifying.FoldedUVError) as caught:
        magnifying.refuse_folds(flat, F)
    none = np.flatnonzero(signed_areas(flat, F) * mirrored <= 0).tolist()
    assert caught.value.elements.tolist() == none and first in none
    flat[4] = np.nan
    with pytest.raises(magnifying.FoldedUVError, match="not finite") as caught:
        magnifying.refuse_folds(flat, F)
    assert caught.value.elements.tolist() == [k for k in range(8) if 4 in F[k]]


@pytest.mark.parametrize("quarters", [False, True])
@pytest.mark.parametrize("turn", [0.1, 1.5, 3.0])
def test_what_is_placed_like_outside_has_area_middle_and_turn(turn, quarters):
    V, F = meshes.grid(4, 3)
    given = V[:, :2] * [2, 1] + [5, 7]
    w = (given @ [1, 1j]) * 0.3 * np.exp(1j * turn) + 2
    uv = np.column_stack([w.real, w.imag])
    found = magnifying.placed_like_outside(uv, given, F, np.ones(len(F)), quarters)
    assert signed_areas(found, F).sum() == pytest.approx(signed_areas(given, F).sum())
    area = signed_areas(given, F)
    middle = [area @ x[F].mean(axis=1) / area.sum() for x in (found, given)]
    assert middle[0] == pytest.approx(middle[1])
    left = np.round(turn / (np.pi / 2)) * np.pi / 2 if quarters else turn
    z = (found - middle[0]) @ [1, 1j] / ((given - middle[1]) @ [1, 1j] + 1e-30)
    assert np.angle(z[np.abs((given - middle[1]) @ [1, 1j]) > 0.1]) == pytest.approx(turn - left, abs=1e-9)


def test_what_is_not_calm_does_not_count_for_the_turn():
    V, F = meshes.grid(6, 2, 3.0, 1.0)
    # Faces of many sizes: what counts is how much of the surface is calm.
    V[:, 0] = V[:, 0] ** 2 / 3
    given = V[:, :2] + [4, 1]
    calm = np.random.default_rng(3).random(len(F)) * (V[F].mean(axis=1)[:, 0] < 1.4)
    uv = given.copy()
    right = given[:, 0] > 5.6
    uv[right, 1] += 0.5 * (given[right, 0] - 5.6)
    found = magnifying.placed_like_outside(uv, given, F, calm, False)
    area, now = signed_areas(given, F), signed_areas(uv, F)
    size = np.sqrt(area.sum() / now.sum())
    old = size * (uv - now @ uv[F].mean(axis=1) / now.sum()) @ [1, 1j]
    new = (given - area @ given[F].mean(axis=1) / area.sum()) @ [1, 1j]
    pull = sum(area[k] * calm[k] * new[v] * np.conj(old[v]) for k in range(len(F)) for v in F[k])
    want = old * pull / abs(pull)
    assert (found - area @ given[F].mean(axis=1) / area.sum()) @ [1, 1j] == pytest.approx(want)


def test_concave_quads_are_apart():
    V = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [0.5, 0.5], [3, 0], [3, 2]])
    F = np.array([[4, 1, 2], [4, 2, 3], [1, 5, 6], [1, 6, 2]])
    # The first quad is concave at 4; the second is a square.
    V[4] = [1.4, 1.4]
    found = magnifying.with_concave_quads_apart(V, F, np.array([7, 7, 2, 2]))
    assert found[2] == found[3] and len(set(found.tolist())) == 3
    V[4] = [0.0, 0.0]
    found = magnifying.with_concave_quads_apart(V, F, np.array([7, 7, 2, 2]))
    assert found[0] == found[1] and len(set(found.tolist())) == 2


def test_the_outer_boundary_is_the_one_around_the_most():
    V, F = meshes.annulus(12, 2)
    w = V[:, :2] @ [1, 1j]
    loop = magnifying._outer(w, F)
    assert np.abs(w[loop]).min() == pytest.approx(np.abs(w).max()) and len(boundary_loops(F)) == 2
    assert len(boundary_edges(F)) == 24
