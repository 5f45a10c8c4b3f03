"""A flow: handles are met, volumes and areas stay, nothing passes through anything, and the way back leads back."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere, limbed

from omt_uv.solver.contact.new_crossings import new_intersections
from omt_uv.solver.contact.self_intersections import FaceCrossings, intersecting_pairs
from omt_uv.solver.errors import EmptyMeshError, HandleError, NonFiniteError
from omt_uv.solver.flows import flow_map
from omt_uv.solver.flows.creases import without_new_intersections
from omt_uv.solver.flows.domain import ball_domain, mesh_domain
from omt_uv.solver.flows.enclosed_volume import EnclosedParts, component_volumes, restore_volumes, vertex_normals
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.integration import carried, planned_steps
from omt_uv.solver.flows.options import BLEND, PATHS, RADIUS, STRAIGHT, FlowOptions
from omt_uv.solver.progress import Progress, drain


def pulled(V, amount, count=6, seed=0):
    """Handles of one vertex each that go `amount` of the diagonal any way."""
    rng = np.random.default_rng(seed)
    rows = rng.choice(len(V), count, replace=False)
    way = rng.normal(size=(count, 3))
    way *= amount * np.linalg.norm(np.ptp(V, axis=0)) / np.linalg.norm(way, axis=1)[:, None]
    return tuple(FlowHandle(V[[r]], V[[r]] + w, np.array([r])) for r, w in zip(rows, way, strict=True))


@pytest.mark.parametrize("path", PATHS)
def test_handles_are_met_and_volume_stays_on_every_path(path):
    V, F = limbed(3)
    handles = pulled(V, 0.1)
    found = drain(flow(V, handles, FlowOptions(path=path), F))
    for handle in handles:
        np.testing.assert_array_equal(found.positions[handle.vertices], handle.end)
    assert found.missed < 1e-9 and not found.warnings and not len(found.intersecting)
    before, after = component_volumes(V, F)[0], component_volumes(found.positions, F)[0]
    np.testing.assert_allclose(after, before, rtol=1e-9)
    assert np.abs(found.drift).max() < 5e-3


def test_what_flat_faces_lose_falls_with_the_square_of_their_size():
    """The flow itself keeps the volume: what drifts is of the faces."""
    drift = []
    for levels in (2, 3, 4):
        V, F = icosphere(levels)
        handle = FlowHandle(np.array([[0.0, 0, 0.9]]), np.array([[0.1, 0.2, 1.3]]))
        drift.append(abs(drain(flow(V, (handle,), FlowOptions(tolerance=1e-8, mend=False), F)).drift[0]))
    assert drift[1] < 0.4 * drift[0] and drift[2] < 0.4 * drift[1]


def test_the_way_back_leads_back():
    V, F = limbed(3)
    options = FlowOptions(diagonal=float(np.linalg.norm(np.ptp(V, axis=0))))
    handles = pulled(V, 0.25)
    there = drain(flow(V, handles, options)).positions
    back = drain(flow(there, tuple(FlowHandle(h.end, h.start, h.vertices) for h in handles), options)).positions
    assert np.abs(back - V).max() < 1e-4 * options.diagonal


def test_crossing_paths_are_no_contradiction():
    """Two handles that change places go around one another, as nothing else could."""
    V, F = icosphere(3)
    a, b = np.array([[-0.3, 0.05, 0.0]]), np.array([[0.3, -0.05, 0.0]])
    inner = np.concatenate([V, a, b])
    handles = (FlowHandle(a, np.array([[0.0, 0.3, 0]])), FlowHandle(b, np.array([[-0.3, 0.05, 0.0]])))
    found = drain(flow(inner, handles, FlowOptions(radius=0.1)))
    assert found.missed < 1e-9
    np.testing.assert_allclose(found.positions[-1], [-0.3, 0.05, 0], atol=1e-6)


def test_what_stays_stays_and_frames_lead_to_the_end():
    V, F = icosphere(3)
    low = np.flatnonzero(V[:, 2] < -0.7)
    top = np.flatnonzero(V[:, 2] > 0.9)
    handles = (FlowHandle(V[top], V[top] + [0, 0, 0.3], top), FlowHandle(V[low], V[low], low))
    found = drain(flow(V, handles, None, F, frames=3))
    assert len(found.frames) == 3
    np.testing.assert_array_equal(found.frames[-1], found.positions)
    np.testing.assert_array_equal(found.positions[low], V[low])
    heights = [frame[top, 2].mean() for frame in found.frames]
    np.testing.assert_allclose(np.diff(heights), 0.1, atol=1e-2)
    np.testing.assert_allclose(component_volumes(found.positions, F)[0], component_volumes(V, F)[0], rtol=1e-9)


def test_what_no_handle_comes_near_to_stays_to_the_bit():
    rng = np.random.default_rng(0)
    points = rng.uniform(size=(2000, 2))
    handle = FlowHandle(np.array([[0.2, 0.2]]), np.array([[0.3, 0.25]]))
    found = drain(flow(points, (handle,), FlowOptions(radius=0.03))).positions
    far = np.linalg.norm(points - [0.25, 0.22], axis=1) > 0.4
    np.testing.assert_array_equal(found[far], points[far])
    assert (found[~far] != points[~far]).any()


def test_areas_stay_in_the_plane():
    x = np.linspace(0, 1, 81)
    grid = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1)
    handles = (
        FlowHandle(np.array([[0.5, 0.5]]), np.array([[0.62, 0.58]])),
        FlowHandle(np.array([[0.2, 0.2]]), np.array([[0.2, 0.2]])),
    )
    moved = drain(flow(grid.reshape(-1, 2), handles, FlowOptions(radius=0.3))).positions.reshape(grid.shape)
    d = moved[1:, 1:] - moved[:-1, :-1], moved[:-1, 1:] - moved[1:, :-1]
    area = 0.5 * (d[0][..., 0] * d[1][..., 1] - d[0][..., 1] * d[1][..., 0])
    assert np.abs(area * 80**2 - 1).max() < 2e-3
    np.testing.assert_allclose(moved[16, 16], [0.2, 0.2], atol=1e-6)


def test_nothing_leaves_a_ball_and_little_a_mesh():
    V, F = icosphere(3)
    handle = FlowHandle(np.array([[0.5, 0.0, 0.0]]), np.array([[0.8, 0.1, 0.0]]))
    free = drain(flow(0.95 * V, (handle,), FlowOptions()))
    assert np.linalg.norm(free.positions, axis=1).max() > 1.02
    held = drain(flow(0.95 * V, (handle,), FlowOptions(), F, ball_domain(np.zeros(3), 1.0)))
    assert np.linalg.norm(held.positions, axis=1).max() < 1 + 1e-3
    walled = drain(flow(0.95 * V, (handle,), FlowOptions(), F, mesh_domain(V, F)))
    assert np.linalg.norm(walled.positions, axis=1).max() < 1.01
    disk = ball_domain(np.zeros(2), 1.0, 60)
    np.testing.assert_allclose(np.linalg.norm(disk.points, axis=1), 1.0)
    np.testing.assert_allclose(disk.held(np.array([[3.0, 0]])), [[1.0, 0]])
    with pytest.raises(NonFiniteError, match="The ball has no finite middle and radius"):
        ball_domain(np.zeros(3), np.nan)
    with pytest.raises(HandleError, match="no faces"):
        mesh_domain(np.zeros((3, 3)), np.array([[0, 1, 2]]))


def test_bad_input_is_refused_by_name():
    V, F = icosphere(1)
    handle = FlowHandle(V[:1], V[:1] + 0.1)
    bad = V.copy()
    bad[7] = np.nan
    for points, handles, error in [
        (V, (), HandleError),
        (bad, (handle,), NonFiniteError),
        (V[:0], (handle,), EmptyMeshError),
        (np.zeros((5, 3)), (handle,), EmptyMeshError),
    ]:
        with pytest.raises(error):
            drain(flow(points, handles))
    with pytest.raises(ValueError, match="radius"):
        drain(flow(V, (handle,), FlowOptions(radius=0.0)))
    with pytest.raises(HandleError, match=r"tear|too close"):
        pair = (FlowHandle(V[:1], V[1:2]), FlowHandle(V[1:2], V[1:2]))
        drain(flow(V, pair, FlowOptions(path="straight")))
    first = next(flow(V, (handle,)))
    assert isinstance(first, Progress)


def test_faces_in_a_crease_are_taken_apart():
    V, F = icosphere(3)
    assert not len(new_intersections(V, V, FaceCrossings(F)))
    V = V * [1, 1, 0.02]
    after = V.copy()
    after[V[:, 2].argmax()] -= [0.02, 0.013, 0.05]
    pairs = new_intersections(V, after, FaceCrossings(F))
    assert len(pairs)
    mended, left = without_new_intersections(V, after, FaceCrossings(F), np.ones(len(V), bool))
    assert not len(left) and np.abs(mended - after).max() < 0.2
    fixed, left = without_new_intersections(V, after, FaceCrossings(F), np.zeros(len(V), bool))
    assert len(left) == len(pairs)
    np.testing.assert_array_equal(fixed, after)


def test_parts_that_met_before_may_meet_a_face_farther_on():
    V, F = icosphere(3)
    half = len(V)
    before, faces = np.concatenate([V, 0.9 * V + [1.2, 0.1, 0]]), np.concatenate([F, F + half])
    shift = np.where(np.arange(2 * half)[:, None] < half, 0.0, [0.02, 0.03, 0.01])
    assert len(intersecting_pairs(before + shift, faces))
    assert not len(new_intersections(before, before + shift, FaceCrossings(faces)))
    apart = before + np.where(np.arange(2 * half)[:, None] < half, 0.0, [2.0, 0, 0])
    assert len(new_intersections(apart, before, FaceCrossings(faces))) == len(intersecting_pairs(before, faces))


def test_volumes_are_given_back_part_by_part():
    V, F = icosphere(2)
    two, faces = np.concatenate([V, V + [3, 0, 0]]), np.concatenate([F, F + len(V)])
    squeezed = two * [1, 1, 0.95]
    squeezed[len(V) :, 1] *= 0.9
    parts = EnclosedParts.of(faces, len(two))
    restored, change = restore_volumes(two, squeezed, parts, np.ones(len(two), bool))
    assert change.shape == (2,) and np.abs(change).max() < 1e-12
    _, change = restore_volumes(two, squeezed, parts, np.zeros(len(two), bool))
    np.testing.assert_allclose(change, [-0.05, 0.95 * 0.9 - 1], atol=1e-9)
    np.testing.assert_allclose(vertex_normals(V, F).sum(axis=0), 0, atol=1e-12)


def test_steps_end_at_every_knot():
    from omt_uv.solver.flows.kernel import conditions, interpolated_field

    start = np.zeros((1, 3))
    given = conditions(start, np.zeros((0, 3)), np.zeros((0, 3)))
    field = interpolated_field(given, np.array([1.0, 0, 0]), 4.0)
    plan = planned_steps(lambda j, t: field, np.array([0, 0.3, 1.0]), start, 1e-6)
    np.testing.assert_allclose([sum(step.length for step in steps) for steps in plan], [0.3, 0.7])
    whole = carried(start, plan[0] + plan[1])
    np.testing.assert_allclose(carried(carried(start, plan[0]), plan[1]), whole)


def test_blends_are_radius_paths_at_the_corners_of_the_box_and_straight_in_its_middle():
    """Wherever the body stands and however large it is."""
    V, _ = icosphere(2)
    corners = np.array([[-1.0, -1, -1], [1, 1, 1]])
    found = {}
    for kind in (RADIUS, STRAIGHT, BLEND):
        points = 3.0 * np.concatenate([V, corners]) + [5.0, 0, 0]
        outer = FlowHandle(points[[-1]], 3.0 * np.array([[1.0, 1, -1]]) + [5.0, 0, 0], np.array([len(V) + 1]))
        found[kind] = _way((outer,), points, kind)
    np.testing.assert_allclose(found[BLEND], found[RADIUS], atol=1e-9)
    assert len(found[STRAIGHT]) == 2 and len(found[RADIUS]) == 9


def _way(handles, points, kind):
    """The way of handles in the units of a flow."""
    size = np.linalg.norm(np.ptp(points, axis=0))
    return flow_map._way(points / size, handles, FlowOptions(path=kind, samples=8), None, size).path


def test_what_a_flow_has_missed_and_changed_is_told_from_a_thousandth_on():
    """Whichever way a volume has changed, and each by itself."""
    none = np.zeros(2)
    assert flow_map._warnings(0.0, none, 0) == () == flow_map._warnings(1e-3, np.array([1e-3, -1e-3]), 0)
    (missed,) = flow_map._warnings(1.1e-3, none, 0)
    assert "by up to 0.11 % of the diagonal" in missed
    for volumes in ([1.1e-3, 0], [0, -1.1e-3]):
        (changed,) = flow_map._warnings(0.0, np.array(volumes), 0)
        assert "changes by 0.11 %" in changed
    (one,), (two,) = (flow_map._warnings(0.0, none, k) for k in (1, 2))
    assert one.startswith("A pair of faces passes") and two.startswith("2 pairs of faces pass")
    assert len(flow_map._warnings(1.0, np.ones(1), 1)) == 3
