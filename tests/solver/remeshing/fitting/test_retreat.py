"""Where a fit lets faces pass through one another, vertices go back to where they were before; elsewhere they stay."""

from __future__ import annotations

import bodies
import numpy as np
import pytest

from omt_uv import solver as omt
from omt_uv.solver.contact.self_intersections import intersecting_pairs
from omt_uv.solver.remeshing import remesh_component
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.fitting import retreat
from omt_uv.solver.remeshing.fitting.retreat import retreated


def test_most_thin_bodies_that_the_fit_alone_lets_pass_through_themselves_do_not(monkeypatch):
    """Which of them do hangs on where vertices lie, which rounding decides: by several meshes."""
    meeting = []

    def measured(before, fitted, *surface):
        found = retreated(before, fitted, *surface)
        meeting.append([len(intersecting_pairs(mesh.points, mesh.triangles)) for mesh in (fitted, found)])
        # Where that was enough, much of it is where the fit brought it.
        assert meeting[-1][1] or (found.points == fitted.points).all(axis=1).mean() > 0.3
        return found

    monkeypatch.setattr(remesh_component, "retreated", measured)
    for thick in (0.05, 0.07):
        for count in range(80, 150, 4):
            omt.remesh(*bodies.bowl(14, 30, thick), count)
    fitted, found = np.array(meeting).T
    assert (found <= fitted).all() and found.sum() < 0.7 * fitted.sum()
    assert (fitted > 0).sum() >= 15 and (found > 0).sum() <= 0.7 * (fitted > 0).sum()


def mesh_of(points, triangles):
    none = np.zeros(len(points), bool)
    return WorkingMesh(points, triangles, none, np.zeros((0, 2), np.int64))


def layers(seed, apart=0.3):
    """Two layers, one above the other, that the fit has moved at random, so that they meet in places."""
    y, x = np.mgrid[0:7, 0:7].astype(float)
    at = np.arange(42).reshape(6, 7)[:, :6].ravel()
    F = np.concatenate([np.column_stack([at, at + 1, at + 8]), np.column_stack([at, at + 8, at + 7])])
    flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(49)])
    V, T = np.concatenate([flat, flat + [0.2, 0.1, apart]]), np.concatenate([F, F + 49])
    moved = V + [0, 0, 0.16] * np.random.default_rng(seed).normal(size=V.shape)
    return V, moved, T


@pytest.mark.parametrize("seed", range(4))
def test_vertices_are_where_they_were_or_where_they_were_brought_and_fewer_faces_intersect(seed):
    V, moved, T = layers(seed)
    before = len(intersecting_pairs(moved, T))
    found = retreated(mesh_of(V, T), mesh_of(moved, T), V, T)
    assert before > 0 == len(intersecting_pairs(found.points, T))
    old, new = (found.points == V).all(axis=1), (found.points == moved).all(axis=1)
    assert (old | new).all() and old.any() and new.any()
    # Those of faces that meet go back, in any case.
    meeting = np.unique(T[intersecting_pairs(moved, T)])
    assert old[meeting].all()


def test_what_does_not_meet_stays_as_does_the_mesh_of_what_met_before():
    V, moved, T = layers(0)
    fitted = mesh_of(moved, T)
    assert retreated(mesh_of(V, T), fitted, moved, T) is fitted
    calm = mesh_of(V + [0, 0, 0.01] * np.sin(np.arange(294)).reshape(-1, 3), T)
    assert retreated(mesh_of(V, T), calm, V, T) is calm


def test_as_few_faces_intersect_as_in_any_round():
    """Where those before intersect as well, there is nothing to go back to."""
    V, moved, T = layers(1)
    crossed = V + [0, 0, -0.6] * (np.arange(98)[:, None] > 48)
    crossed[60:70, 2] = 0.3
    found = retreated(mesh_of(crossed, T), mesh_of(moved, T), V, T)
    assert len(intersecting_pairs(found.points, T)) <= len(intersecting_pairs(moved, T))


@pytest.mark.parametrize(
    "counts", [(5, 3, 4, 4), (5, 4, 2, 3, 1, 3), (5, 6, 7), (5, 3, 3), (5, 2, 0, 9), (4, 3, 1, 2, 2)]
)
def test_of_all_rounds_the_first_with_fewest_meetings_is_kept(monkeypatch, counts):
    """However many faces meet from round to round; none is looked at once nothing meets."""
    V, moved, T = layers(0)
    seen = []

    class Counted:
        def __init__(self, triangles):
            assert triangles is T

        def pairs(self, points):
            seen.append(points)
            count = counts[min(len(seen), len(counts)) - 1]
            # More and more of them, so that every round takes more back.
            return np.arange(2 * count).reshape(-1, 2) + len(seen)

    monkeypatch.setattr(retreat, "FaceCrossings", Counted)
    found = retreat.retreated(mesh_of(V, T), mesh_of(moved, T), V, T)
    best = counts.index(min(counts))
    assert found.points is seen[best] if best else found.points is moved
    rounds = counts.index(0) if 0 in counts else retreat.ROUNDS
    assert len(seen) == 1 + rounds
