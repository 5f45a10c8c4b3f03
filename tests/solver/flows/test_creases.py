"""Faces that a flow brings into one another are taken apart on the way, piece by piece."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from bodies import icosphere

from omt_uv.solver.contact.new_crossings import NewCrossings, new_intersections
from omt_uv.solver.contact.self_intersections import FaceCrossings
from omt_uv.solver.flows import creases
from omt_uv.solver.flows.creases import FlowRegion, march, regions_around
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.integration import FlowStep
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.progress import drain


def passing():
    """A coarse ball, and two of its vertices that pass closely by one another: flat faces fold, whatever the steps."""
    V, F = icosphere(3)
    V = V * [1.0, 0.6, 0.15]
    one = np.square(V - [0.05, 0, 0.15]).sum(axis=1).argmin(keepdims=True)
    other = np.square(V - [-0.05, 0.1, -0.15]).sum(axis=1).argmin(keepdims=True)
    return V, F, (FlowHandle(V[one], V[one] - [0, 0, 0.6], one), FlowHandle(V[other], V[other] + [0.3, 0, 0.3], other))


def test_what_folds_on_a_coarse_mesh_is_taken_apart():
    V, F, handles = passing()
    faces = FaceCrossings(F)
    for tolerance in (5e-5, 1e-7):
        plain = drain(flow(V, handles, FlowOptions(mend=False, tolerance=tolerance), F)).positions
        assert len(new_intersections(V, plain, faces)) > 5
    found = drain(flow(V, handles, None, F, frames=2))
    assert not len(found.intersecting) and not len(new_intersections(V, found.positions, faces))
    assert not len(new_intersections(V, found.frames[0], faces))
    for handle in handles:
        np.testing.assert_array_equal(found.positions[handle.vertices], handle.end)
    assert np.abs(found.volumes).max() < 1e-9


def test_a_region_is_around_what_meets_and_near_to_it():
    V, F = icosphere(4)
    pairs, mended = np.array([[0, 1]]), np.zeros(len(V), bool)
    mended[V[:, 2].argmax()] = mended[V[:, 2].argmin()] = True
    (region,) = regions_around((V, V), F, pairs, mended, np.ones(len(V), bool))
    assert np.isin(F[:2], region.rows).all() and len(region.rows) < len(V) / 2
    assert region.crossings.faces.triangles.max() < len(region.rows)
    still = drain(march(region, [[FlowStep(0.5, (np.zeros_like,) * 3)]] * 2, None))
    np.testing.assert_array_equal(still[-1], V[region.rows])
    assert isinstance(region, FlowRegion)


def test_what_met_before_is_looked_for_once():
    V, F = icosphere(3)
    before, faces = np.concatenate([V, 0.9 * V + [1.2, 0.1, 0]]), FaceCrossings(np.concatenate([F, F + len(V)]))
    known = NewCrossings(before, faces)
    for _ in range(2):
        assert not len(known.pairs(before))


def test_what_touched_before_is_no_new_intersection():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, 0], [0.2, 0.3, 1], [0.3, 0.2, 1]], float)
    F = np.array([[0, 1, 2], [3, 4, 5]])
    known = NewCrossings(V, FaceCrossings(F))
    after = np.concatenate([V[:3], V[3:] - [0, 0, 0.1]])
    pairs = known.pairs(after)
    assert len(pairs) == 1 and not len(known.apart(pairs))
    lifted = NewCrossings(V + np.repeat([[0.0], [0.01]], 3, axis=0) * [0, 0, 1], FaceCrossings(F))
    assert len(lifted.apart(lifted.pairs(after))) == 1


def test_regions_that_have_nothing_to_do_with_one_another_are_apart():
    V, F = icosphere(4)
    far = np.square(V[F].mean(axis=1) + V[F[0]].mean(axis=0)).sum(axis=1).argmin()
    pairs = np.array([[0, 1], [far, np.flatnonzero((F[far][0] == F).any(axis=1))[0]]])
    found = regions_around((V, V), F, pairs, np.zeros(len(V), bool), np.ones(len(V), bool))
    assert len(found) == 2 and not np.intersect1d(found[0].rows, found[1].rows).size


@pytest.mark.parametrize("seeds", [[220], [220, 221], [0, 440]])
@pytest.mark.parametrize("stretch", [0.0, 2.0])
def test_what_is_near_is_around_or_within_reach_of_one_of_about_its_size(seeds, stretch):
    """Before or after the move; the size of a seed is the mean side at its corners, sizes are rounded to octaves."""
    V, F = meshes.grid(20, 20)
    V = V * [1 + 3 * stretch, 1, 1] + 0.1 * stretch * V[:, :1] ** 2
    after = V + np.array([0.4, 0, 0]) * (V[:, 1:2] > 0.7)
    chosen = np.zeros(len(V), bool)
    chosen[seeds] = True
    size = {}
    for v in seeds:
        sides = [np.linalg.norm(V[f[k]] - V[f[k - 1]]) for f in F if v in f for k in range(3) if v in (f[k], f[k - 1])]
        size[v] = np.mean(sides)
    octave = {v: int(np.round(np.log2(s / max(size.values())))) for v, s in size.items()}
    near = chosen.copy()
    near[F[[k for k, f in enumerate(F) if chosen[f].any()]]] = True
    for at in (V, after):
        for v in seeds:
            reach = 5 * np.mean([size[w] for w in seeds if octave[w] == octave[v]])
            near |= np.linalg.norm(at - at[v], axis=1) < reach
    assert np.array_equal(creases._near((V, after), F, chosen), near)
    assert chosen.sum() < near.sum() < len(V)


@pytest.mark.parametrize("seed", range(6))
def test_how_faces_are_numbered_does_not_decide_which_crossings_are_new(seed):
    """A line along which two plates meet moves on from face to face; of a pair, either may come first by then."""
    V, F = meshes.grid(6, 6)
    plate = np.column_stack([V[:, :2], np.zeros(len(V))])
    wall = np.column_stack([np.full(len(V), 0.43), V[:, 0], V[:, 1] - 0.52])
    before, faces = np.concatenate([plate, wall]), np.concatenate([F, F + len(V)])
    after = before + np.where(np.arange(len(before))[:, None] < len(V), 0.0, [0.08, 0.0, 0.0])
    order = np.random.default_rng(seed).permutation(len(faces))
    plain, other = (new_intersections(before, after, FaceCrossings(of)) for of in (faces, faces[order]))
    assert len(FaceCrossings(faces).pairs(after)) > 5
    assert {frozenset(pair) for pair in order[other].tolist()} == {frozenset(pair) for pair in plain.tolist()}
