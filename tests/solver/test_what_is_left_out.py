"""What is looked through: what a rule leaves out and what it keeps, with pieces that are written in advance."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.solver.analysis import symmetry_plane
from omt_uv.solver.cutting import symmetric_cut
from omt_uv.solver.editing import magnify
from omt_uv.solver.remeshing.initial import initial_mesh


def a_cut(score, free, number, tips=3):
    return score, free, np.arange(4) == number, np.arange(tips)


@pytest.mark.parametrize(
    ("score", "spread", "free", "taken"),
    [
        (0.99 * symmetric_cut.DOUBTFUL, 1.0, 1.0, 1),
        # What is predicted to be far worse is not looked at, though it would be better.
        (1.01 * symmetric_cut.DOUBTFUL, 1.0, 1.0, 0),
        (1.0, 0.99 * symmetric_cut.ABOUT * 4, 1.0, 1),
        (1.0, 1.01 * symmetric_cut.ABOUT * 4, 1.0, 0),
        (1.0, 1.01 * 4 / symmetric_cut.ABOUT, 3.0, 0),
        (1.0, 0.99 * 4 / symmetric_cut.ABOUT, 3.0, 1),
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

        def compared(self, normals, offsets):
            return np.zeros(len(normals))

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
