"""What is looked through: what a rule leaves out and what it keeps, with pieces that are written in advance."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.solver.analysis import symmetry_plane
from omt_uv.solver.arranging import halves
from omt_uv.solver.cutting import symmetric_cut
from omt_uv.solver.editing import magnify, magnify_regions
from omt_uv.solver.errors import TopologyMismatchError
from omt_uv.solver.registration.charts import seam_arcs
from omt_uv.solver.remeshing.initial import initial_mesh
from omt_uv.solver.sphere import multilevel
from omt_uv.solver.subdivision import cage_refinement


def a_cut(score, free, number, tips=3):
    return score, free, np.arange(4) == number, np.arange(tips)


@pytest.mark.parametrize(
    ("score", "spread", "free", "taken"),
    [
        (0.99 * 2.0, 1.0, 1.0, 1),
        # What is predicted to be far worse is not looked at, though it would be better.
        (1.01 * 2.0, 1.0, 1.0, 0),
        (1.0, 0.99 * 1.1 * 4, 1.0, 1),
        (1.0, 1.01 * 1.1 * 4, 1.0, 0),
        (1.0, 1.01 * 4 / 1.1, 3.0, 0),
        (1.0, 0.99 * 4 / 1.1, 3.0, 1),
    ],
)
def test_of_two_cuts_about_as_good_the_one_that_leaves_less_is_taken(monkeypatch, score, spread, free, taken):
    cuts = {"a": [a_cut(1.0, 2.0, 0)], "b": [a_cut(1.0, 2.0, 0), a_cut(score, free, 1)]}
    spreads = {0: 4.0, 1: spread}
    monkeypatch.setattr(symmetric_cut, "_outlined", lambda half, extremities, bearable: iter(cuts[half.name]))
    monkeypatch.setattr(symmetric_cut, "disk_spread", lambda component, cut: spreads[int(cut.argmax())])
    halves = [SimpleNamespace(component=None, name=name) for name in "ab"]
    cut, tips = symmetric_cut.outlined_cut(halves, 3, 1.0)
    assert int(cut.argmax()) == taken and tips.tolist() == [0, 1, 2]
    assert int(symmetric_cut.outlined_cut(halves[:1], 3, 1.0)[0].argmax()) == 0
    cuts["a"] = []
    assert symmetric_cut.outlined_cut(halves[:1], 3, 1.0) is None


@pytest.mark.parametrize(("flat", "normal"), [([], 0), ([0], 1), ([0, 1], 2), ([0, 1, 2], None)])
def test_planes_in_which_a_body_lies_are_no_mirrors(monkeypatch, flat, normal):
    """Of three planes each is better than the next one."""

    class Samples:
        points = np.eye(3) - 1 / 3
        few, many = "few", "many"

        def __init__(self, *mesh):
            pass

        def compared(self, normals, offsets, beyond=np.inf):
            return np.zeros(len(normals)), np.ones(len(normals), dtype=bool)

        def is_flat(self, normal, offset, residual):
            return int(normal.argmax()) in flat

    def refined(samples, normal, offset, points, rounds):
        return normal, offset, (1 + int(normal.argmax())) * symmetry_plane.EVEN * 1.5

    monkeypatch.setattr(symmetry_plane, "_Samples", Samples)
    monkeypatch.setattr(symmetry_plane, "_refined", refined)
    monkeypatch.setattr(symmetry_plane, "_chosen", lambda *of: [0, 1, 2])
    monkeypatch.setattr(symmetry_plane, "own_axes", lambda points: None)
    monkeypatch.setattr(symmetry_plane, "_between_pairs", lambda points, plane: plane)
    found = symmetry_plane._near_plane(np.eye(3), np.arange(3)[None], 9.0, np.zeros(3))
    assert (found is None) == (normal is None)
    assert found is None or int(np.abs(found.normal).argmax()) == normal


def test_a_warning_of_several_steps_is_told_once(monkeypatch):
    uv, triangles = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]])
    warnings = [("first", "often"), ("often",), ("often", "last")]

    def step(uv, triangles, density, **options):
        k = seen.append(options) or len(seen) - 1
        found = SimpleNamespace(uv=uv, iterations=k + 2, warnings=warnings[k], outline=k, residual=0.0, status="")
        return done(found, 0.0, 0.5)

    seen = []
    monkeypatch.setattr(magnify, "magnify_map", step)
    monkeypatch.setattr(magnify, "share_error", lambda *of: 0.0)
    found, fractions = told(magnify.magnify_region(uv, triangles, np.array([1.0, 0.0]), 1 / 8))
    assert found.warnings == ("first", "often", "last") and found.iterations == 2 + 3 + 4
    assert fractions == pytest.approx([0, 1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6])
    assert [s["stricter"] for s in seen] == pytest.approx([np.sqrt(1.5)] * 3)


def test_edges_of_lines_that_are_kept_are_locked_and_no_others(monkeypatch):
    arcs = [SimpleNamespace(kept=k) for k in (True, False, True)]
    samples = SimpleNamespace(
        along=[np.array(a) for a in ([0, 1], [1, 2], [2, 3, 0])], fixed=np.array([0, 1, 0, 1]) > 0
    )
    plan = SimpleNamespace(network=SimpleNamespace(arcs=arcs, along=lambda edges: edges), samples=samples)
    maps = SimpleNamespace(component=SimpleNamespace(to_reopen=[1]), warnings=("of maps",))
    plan.warnings = ("of the plan",)
    monkeypatch.setattr(
        initial_mesh, "_of_plan", lambda maps, plan, mesh, to_reopen, warnings: (mesh, to_reopen, warnings)
    )
    points = np.arange(15.0).reshape(5, 3)
    mesh, to_reopen, warnings = initial_mesh._stitched(
        maps, plan, points, np.array([[0, 1, 2], [2, 3, 4]]), ("of a chart",), True
    )
    # Fixed ones come first: 1, 3, and then 0, 2, 4.
    new = {1: 0, 3: 1, 0: 2, 2: 3, 4: 4}
    assert mesh.points[[new[k] for k in range(5)]].tolist() == points.tolist()
    assert mesh.triangles.tolist() == [[new[k] for k in t] for t in ([0, 1, 2], [2, 3, 4])]
    assert mesh.fixed.tolist() == [True, True, False, False, False]

    def keys(*pairs):
        return sorted((min(new[a], new[b]) << 32) | max(new[a], new[b]) for a, b in pairs)

    assert mesh.locked.tolist() == keys((0, 1), (2, 3), (3, 0)) and to_reopen.tolist() == keys((1, 2))
    assert warnings == ("of maps", "of the plan", "of a chart")


def test_arcs_go_where_corners_meet_and_of_such_ways_the_nearest(monkeypatch):
    """Four arcs around: any may be the first, one way is none, and one takes a corner to the wrong place."""
    source = SimpleNamespace(chart=np.zeros(4, int), corners=np.array([5, 6, 7, 8]), points=np.zeros((4, 3, 3)))
    far = np.array([1.0, 2.0, 3.0, 4.0])
    target = SimpleNamespace(chart=np.zeros(4, int), corners=np.array([0, 1, 2, 3]), points=np.zeros((4, 3, 3)))
    target.points += far[:, None, None]
    ways = {0: None, 1: np.array([1, 1, 1, 1]), 2: np.array([3, 2, 2, 2]), 3: np.array([3, 3, 1, 2])}
    monkeypatch.setattr(seam_arcs, "_from_first", lambda source, target, image: ways[image])
    found = seam_arcs.corresponding_arcs
    assert found(source, target, np.zeros((0, 2), int)).tolist() == ways[1].tolist()
    # The corner 5 has to meet 3, and so the nearest way is none; 9 is no corner, and 6 meets either.
    assert found(source, target, np.array([[5, 3], [9, 0]])).tolist() == ways[2].tolist()
    assert found(source, target, np.array([[6, 3]])).tolist() == ways[3].tolist()
    with pytest.raises(TopologyMismatchError):
        found(source, target, np.array([[8, 0]]))


@pytest.mark.parametrize("sizes", [[9, 8, 7], [10**6, 10**5, 10**4, 1000, 100, 9], [10**6], [10**6, 10**5]])
def test_levels_are_tried_again_from_the_first_that_is_small_on(sizes, monkeypatch):
    levels = [SimpleNamespace(vertices=range(n)) for n in sizes]
    small = [k for k, n in enumerate(sizes) if n <= 1200]
    few = small[0] if small else len(sizes) - 1
    given = []
    monkeypatch.setattr(multilevel, "collapse_to_tetrahedron", lambda *mesh: levels)
    monkeypatch.setattr(multilevel, "_best_of_attempts", lambda some: given.append(some) or done((0, 5), 0.0))
    monkeypatch.setattr(
        multilevel, "_prolonged", lambda level, positions: given.append(level) or done((positions + 1, 10), 0.0)
    )
    found, fractions = told(multilevel.multilevel_start(None, None, None))
    assert found == (few, 5 + 10 * few) and given == [levels[few:], *levels[:few][::-1]]
    assert all(0 <= f <= 1 for f in fractions)


def test_outlines_that_come_to_cross_get_one_barrier_each(monkeypatch):
    @dataclass(frozen=True)
    class Problem:
        counted: np.ndarray
        barriers: tuple = ()
        elements = SimpleNamespace(quads=[0, 0])
        unknowns = np.zeros((2, 3))

        def dets(self, w):
            return np.ones(4)

        def energy(self, w, eps):
            return 100.0 - 10 * w[0].real

    a, b, c = (np.array([k, k + 1]) for k in range(3))
    # What crosses itself at the start is nobody's to keep apart; b does in the first step and in the third.
    crossed = {0: [a], 1: [a, b], 2: [a, b], 3: [a, b, c], 4: [a]}
    places, drawn = iter([1, 2, 3, 4]), []

    def searched(problem, w, eps, before):
        k = next(places, None)
        return (None if k is None else np.array([k + 0j])), 50.0

    def drawn_in(problem, w, loops, strength, energy):
        drawn.append([loop.tolist() for loop in loops])
        return w

    monkeypatch.setattr(
        cage_refinement, "crossings", lambda w, loop: [1] * any(loop is x for x in crossed[int(w[0].real)])
    )
    monkeypatch.setattr(cage_refinement, "_searched", searched)
    monkeypatch.setattr(cage_refinement, "_drawn_in", drawn_in)
    monkeypatch.setattr(cage_refinement, "make_barrier", lambda w, loop, strength: tuple(loop))
    monkeypatch.setattr(cage_refinement, "STEPS", 9)
    problem = Problem(np.arange(4))
    found, fractions = told(cage_refinement._descended(problem, np.array([0j]), np.zeros(4, bool), [a, b, c]))
    assert drawn == [[b.tolist()], [c.tolist()]]
    assert found.uv.tolist() == [[4.0, 0.0]] and found.iterations == 4 and found.folds == 0
    assert fractions == pytest.approx(np.arange(5) / 9)


def test_an_island_is_the_image_of_one_at_most(monkeypatch):
    """Two islands lie on each other on one side, and one on the other."""
    places = [np.array([[1.0, 0, 0], [2, 0, 0], [1, 1, 0]]) * [side, 1, 1] for side in (1, 1, -1)]
    faces = np.array([[0, 1, 2]])
    sides = [np.sign(V[0, 0]) for V in places]
    monkeypatch.setattr(
        halves, "mirrored_match", lambda V, F, W, G, normal, at: np.arange(3) if V[0, 0] * W[0, 0] < 0 else None
    )
    found = halves.halves([(V, faces, V[:, :2] + k) for k, V in enumerate(places)], np.eye(3)[0], 0.0, True)
    assert sides == [1, 1, -1] and found.partner.tolist() == [2, -1, 0]
    assert found.uv[2].tolist() == found.uv[0].tolist() == places[0][:, :2].tolist()


def test_a_warning_of_several_steps_for_several_regions_is_told_once(monkeypatch):
    uv, triangles = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]])
    warnings = [("first", "often"), ("often",), ("often", "last")]

    def step(uv, triangles, density, **options):
        k = seen.append(options) or len(seen) - 1
        more = warnings[min(k, 2)]
        found = SimpleNamespace(uv=uv, iterations=k + 2, warnings=more, outline=k, residual=0.0, status="")
        return done(found, 0.0, 0.5)

    seen = []
    monkeypatch.setattr(magnify_regions, "magnify_map", step)
    monkeypatch.setattr(magnify_regions, "share_error", lambda *of: 0.0)
    one = magnify_regions.magnify_regions(uv, triangles, np.array([[1.0, 0.0]]), [1 / 8], exact=False)
    found, fractions = told(one)
    assert found.warnings == ("first", "often", "last")[: len(seen) + 1]
    assert len(seen) >= 3 and found.iterations == sum(range(2, 2 + len(seen)))
    assert (np.diff(fractions) >= 0).all() and fractions[-1] < 1
