"""Refusals of functions that others call: told by their cause and their elements, beside a neighbour that goes."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from sphere_shapes import blob

from omt_uv.solver import errors
from omt_uv.solver.arranging.halves import symmetric_map
from omt_uv.solver.arranging.quad_grid import rectangle
from omt_uv.solver.editing.magnify import magnify_map
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.editing.uv_islands import uv_islands
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.landmarks import vertex_landmarks
from omt_uv.solver.registration.results import with_missed
from omt_uv.solver.signatures.surroundings import surroundings
from omt_uv.solver.volumes.body_map import DOMAINS, METHODS, volume_map


def strip(count, twisted):
    """A band of quads (f,4) that closes, after half a turn or without one: positions and triangles."""
    i = np.arange(count)
    a = 2 * np.pi * i / count
    half = a / 2 if twisted else 0 * a
    side = np.stack([np.cos(half) * np.cos(a), np.cos(half) * np.sin(a), np.sin(half)], axis=1)
    if not twisted:
        side = np.tile([0.0, 0, 1], (count, 1))
    middle = 3 * np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
    V = np.concatenate([middle - 0.5 * side, middle + 0.5 * side])
    low, high, after = i, i + count, (i + 1) % count
    next_low, next_high = after, after + count
    if twisted:
        next_low, next_high = np.where(after == 0, count, next_low), np.where(after == 0, 0, next_high)
    return V, np.concatenate([np.column_stack([low, next_low, next_high]), np.column_stack([low, next_high, high])])


@pytest.mark.parametrize("twisted", [False, True])
def test_an_island_of_one_side_is_refused_by_its_faces(twisted):
    V, F = strip(12, twisted)
    uv = V[F][:, :, :2].reshape(-1, 2)
    if twisted:
        with pytest.raises(errors.OrientationError, match="one side") as caught:
            uv_islands(triangle_surface(V, F), uv)
        assert caught.value.kind == "face" and set(caught.value.elements) <= set(range(len(F)))
    else:
        assert len(uv_islands(triangle_surface(V, F), uv).islands) == 1


def test_islands_of_uvs_that_are_none_or_of_three_faces_at_an_edge_are_refused():
    V, F = meshes.grid(3, 3)
    uv = V[F.ravel(), :2].copy()
    assert len(uv_islands(triangle_surface(V, F), uv).islands) == 1
    bad = uv.copy()
    bad[3 * 7 + 1, 0] = np.nan
    with pytest.raises(errors.FoldedUVError, match="not finite") as caught:
        uv_islands(triangle_surface(V, F), bad)
    assert caught.value.kind == "face" and caught.value.elements.tolist() == [7]
    a, b, _ = F[4]
    W, G = np.concatenate([V, [[0.4, 0.4, 1.0]]]), np.concatenate([F, [[a, b, len(V)]]])
    tail = {tuple(sorted(e)) for e in np.stack([F, np.roll(F, -1, axis=1)], axis=2).reshape(-1, 2).tolist()}
    assert tuple(sorted((a, b))) in tail
    with pytest.raises(errors.NonManifoldEdgeError, match="edge") as caught:
        uv_islands(triangle_surface(W, G), W[G.ravel(), :2])
    assert caught.value.kind == "edge" and sorted(caught.value.elements[0]) == sorted([a, b])


def test_a_symmetric_map_that_folds_is_refused():
    V, F = meshes.grid(4, 2)
    mirror = np.array([np.argmin(np.linalg.norm(V - [1 - x, y, z], axis=1)) for x, y, z in V])
    assert np.allclose(np.ptp(symmetric_map(F, V[:, :2], mirror), axis=0), [1, 1])
    mixed = V[:, :2].copy()
    mixed[[5, 8]] = mixed[[8, 5]]
    with pytest.raises(errors.FoldedUVError, match="An island that should be its own mirror image"):
        symmetric_map(F, mixed, mirror)


def test_quads_that_are_not_in_rows_are_no_grid():
    V, quads = meshes.quad_grid(3, 2)
    quads = np.array(quads)
    assert rectangle(V, quads, np.ones(6)).columns * rectangle(V, quads, np.ones(6)).rows == 6
    for chosen in ([0, 1, 3], [0, 5]):
        with pytest.raises(errors.GridError, match="rows"):
            rectangle(V, quads[chosen], np.ones(len(chosen)))


def test_no_way_from_marker_to_marker_is_told_by_the_second():
    V, F = blob(1)
    W, G = np.concatenate([V, V + [5, 0, 0]]), np.concatenate([F, F + len(V)])
    assert surroundings(W, G, 0, 7) is not None
    with pytest.raises(errors.LandmarkError, match="No way leads") as caught:
        surroundings(W, G, 0, len(V) + 3)
    assert caught.value.kind == "vertex" and list(caught.value.elements) == [len(V) + 3]


@pytest.mark.parametrize("fault", ["domain", "method"])
def test_what_is_no_domain_or_method_of_a_body_is_refused(fault):
    V, F = blob(1)
    given = {"domain": "ball", "method": "newton"} | {fault: "none"}
    with pytest.raises(ValueError, match=", ".join(DOMAINS) + ".*" + ", ".join(METHODS)):
        drain(volume_map(V, F, count=100, **given))


def test_handles_that_tear_or_lie_on_one_another_are_refused():
    V, F = blob(2)
    near = V[3] + 1e-13
    one, other = (
        FlowHandle(p[None], p[None] + w, np.array([3])) for p, w in ((V[3], [0.1, 0, 0]), (near, [-0.1, 0, 0]))
    )
    drain(flow(V, (one,), FlowOptions(), F))
    with pytest.raises(errors.HandleError, match="Handles are at one place and go to different"):
        drain(flow(V, (one, other), FlowOptions(), F))


def test_what_is_folded_is_refused_where_it_is():
    V, F = meshes.bumpy(6, 6)
    uv = V[:, :2].copy()
    assert drain(refine_island(V, F, uv)).uv.shape == uv.shape
    mirrored = uv * [-1, 1]
    assert drain(refine_island(V, F, mirrored)).uv.shape == uv.shape
    folded = uv.copy()
    folded[24] = folded[0] - 0.5
    with pytest.raises(errors.MeshError) as caught:
        drain(magnify_map(folded, F, np.ones(len(F))))
    assert caught.value.kind == "face" and set(caught.value.elements) <= set(np.flatnonzero((F == 24).any(axis=1)))
    with pytest.raises(ValueError, match="boundary must be one of own, free"):
        drain(magnify_map(uv, F, np.ones(len(F)), boundary="disk"))


@pytest.mark.parametrize("strict", [False, True])
def test_landmarks_that_are_missed_are_named(strict):
    from omt_uv.solver.registration.results import OnSurface, Registration

    V, F = blob(1)
    at = np.array([0, 5, 9])
    marks = vertex_landmarks((at, F), (at, F), ("eye", "nose", "chin"))
    nothing = OnSurface(np.zeros(0, int), np.zeros((0, 3)), np.zeros(0, bool))
    for met, missed in (([True] * 3, ""), ([True, False, False], "'nose', 'chin'")):
        found = Registration(nothing, nothing, "sphere", V, V, 0.0, V, np.zeros(3), np.array(met), (1, 1), 0.0, ("a",))
        if strict and missed:
            with pytest.raises(errors.LandmarkError, match=missed):
                with_missed(found, marks, strict)
        else:
            told = with_missed(found, marks, strict).warnings
            assert told[0] == "a" and len(told) == 1 + bool(missed) and missed in told[-1]
