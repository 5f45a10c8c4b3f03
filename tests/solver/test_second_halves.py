"""The second half of a condition, and each end of a range: loops that go on, and what ends them."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import told

from omt_uv.solver.cutting import component as cut_component
from omt_uv.solver.globe import exact_areas
from omt_uv.solver.mesh.charts import triangle_rows
from omt_uv.solver.partition import cells as partition_cells
from omt_uv.solver.refinement import batch_refine


@pytest.mark.parametrize(
    "ends",
    [
        [1] * 9,
        list(range(1, 31)),
        # Seven are few, and go on to their end together.
        [1] * 23 + [9] * 7,
        [1] * 22 + [9] * 8,
        [1] * 11 + [2] * 19,
        [1] * 12 + [2] * 18,
        [1] * 13 + [2] * 17,
    ],
)
def test_charts_that_are_left_are_put_together_anew_once_enough_are_done(ends, monkeypatch):
    """How many steps each chart takes."""
    count, ends = len(ends), np.array(ends)
    V, F = meshes.grid(2, 2)
    made, at = [], [0]

    class Continuation:
        def __init__(self, *_):
            self.live, self.solved = np.ones(count, bool), np.ones(count, bool)

    class Active:
        def __init__(self, union, faces, order, live, symmetry):
            made.append(int(live.sum()))

        def step(self, w, continuation):
            at[0] += 1
            continuation.live = ends > at[0]

    monkeypatch.setattr(batch_refine, "BatchContinuation", Continuation)
    monkeypatch.setattr(batch_refine, "_ActiveCharts", Active)
    monkeypatch.setattr(batch_refine, "_measured", lambda union, faces, w, continuation: "measured")
    charts = [(V / 4, F)] * count
    found, fractions = told(batch_refine.refine_batch(charts, "draft", 0.0))
    expected, live, k = [], count, 0
    while live:
        began = live
        expected.append(began)
        while True:
            k += 1
            live = int((ends > k).sum())
            if live == 0 or (live <= 0.6 * began and live >= 8):
                break
    assert found == "measured" and made == expected and at[0] == k
    assert fractions == pytest.approx([0, *(1 - (ends > j).mean() for j in range(1, k + 1))])


@pytest.mark.parametrize(
    ("energies", "rounds", "kept"),
    [
        # Damping begins at 0.01, falls to a tenth and grows five times; it is settled once that is 1e-5 or less, and
        # a round gains less than a fiftieth.
        ([90, 80, 70, 69.9, 60], 4, 69.9),
        ([90, 80, 70, 60, 59, 58], 5, 59),
        ([99.9, 99.8, 99.7, 99.6, 99], 4, 99.6),
        ([101, 90, 89.9, 89.8, 89.7, 89.6, 80], 6, 89.6),
        ([90, 80, 70, 68.59, 68.58, 60], 5, 68.58),
        ([90, 80, 70, 68.61, 60], 4, 68.61),
        ([101] * 14, 14, 100),
        ([100] * 14, 14, 100),
    ],
)
def test_areas_are_made_exact_until_little_is_gained_undamped(energies, rounds, kept):
    values, damping = iter([100, *energies]), []

    class Problem:
        order = None

        def energy(self, uv):
            return next(values)

        def step(self, uv, damp, order):
            damping.append(damp)
            return 1

        def within(self, uv):
            return uv

    (uv, count), fractions = told(exact_areas._levenberg_marquardt(Problem(), 0, 0.25))
    expected, damp, best, taken = [], 0.01, 100, 0
    for value in energies[:rounds]:
        expected.append(damp)
        if value < best:
            best, damp, taken = value, damp / 10, taken + 1
        else:
            damp *= 5
    assert count == rounds and damping == pytest.approx(expected) and best == kept and uv == taken
    assert fractions == pytest.approx(0.25 + np.arange(rounds) / 14 / 3)


def test_what_has_no_size_is_as_large_as_it_is():
    component = SimpleNamespace(positions=np.full((3, 3), 7.0), cost=np.array([2.0, np.inf]))
    place, cost = cut_component._relative(component)
    assert not place.any() and cost.tolist() == [2, -1]
    component.positions = np.array([[1.0, 2, 3], [5, 2, 3], [1, 4, 3]])
    place, cost = cut_component._relative(component)
    assert place.tolist() == [[0, 0, 0], [1, 0, 0], [0, 0.5, 0]] and cost.tolist() == [0.5, -1]


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4, 5], [5, 0, 3, 1, 4, 2], [2, 1, 0, 5, 4, 3]])
def test_triangles_of_a_chart_are_found_in_whatever_order_they_are(order):
    """Three quads: corners 0 to 3, 4 to 7 and 8 to 11."""
    triangles = np.array([[4 * q + np.array(t) for t in ((0, 1, 2), (0, 2, 3))] for q in range(3)]).reshape(-1, 3)
    face = np.repeat([0, 1, 2], 2)
    surface = SimpleNamespace(triangles=triangles[order], triangle_face=face[order])
    chosen = [3, 0, 2]
    chart = SimpleNamespace(corners=np.roll(triangles[chosen], 1, axis=1), faces=face[chosen])
    found = triangle_rows(surface, chart)
    assert [order[k] for k in found] == chosen
    # Triangles that are said to be of other faces are found all the same.
    chart.faces = np.array([2, 2, 2])
    assert [order[k] for k in triangle_rows(surface, chart)] == chosen
    empty = SimpleNamespace(corners=np.zeros((0, 3), int), faces=np.zeros(0, int))
    assert not len(triangle_rows(surface, empty))


@pytest.mark.parametrize(
    ("area", "better"),
    [([1.0, 2.0], True), ([0.5, 2.5], False), ([0.0, 3.0], False), ([-0.1, 2.0], False), ([1.2, 1.8], True)],
)
def test_cells_are_better_where_they_are_nearer_to_their_areas_and_none_is_lost(area, better, monkeypatch):
    """They are to be 1 and 2, and were 1.25 and 1.75: as far off as they may be."""
    area = np.array(area)
    monkeypatch.setattr(partition_cells, "geodesic_cells", lambda *_: SimpleNamespace(area=area))
    problem = SimpleNamespace(mesh=None, mass=None, part=None, asked=np.array([1.0, 2.0]))
    dual = partition_cells.GeodesicDual(problem, None, None, np.ones(2))
    dual._within_windows = lambda weights, trial: ("grown", trial)
    found = dual.near(None, SimpleNamespace(area=np.array([1.25, 1.75])))
    assert dual.diagrams == 1
    assert found is None if not better else found[0] == "grown" and found[1].area is area
