"""Bodies in one field, and UVs that are pushed; handles from files."""

from __future__ import annotations

import json

import numpy as np
import pytest
from bodies import icosphere

from omt_uv.pipelines.volumes.flow import FlowBody, FlowJob, UVPlaces, flow_bodies, flow_uvs
from omt_uv.pipelines.volumes.handle_file import HandleFileError, euler_matrix, handles_of, read_handle_file
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.progress import drain


def two_bodies():
    """A ball in a larger one, as an eye in a head."""
    V, F = icosphere(3)
    return FlowBody("head", V, F), FlowBody("eye", 0.3 * V + [0.5, 0, 0], F, np.zeros(len(V), bool))


def test_what_is_inside_flows_along():
    head, eye = two_bodies()
    near = np.flatnonzero(head.positions[:, 0] > 0.95)
    handle = FlowHandle(head.positions[near], head.positions[near] + [0.2, 0.1, 0], near)
    found = drain(flow_bodies(FlowJob((head, eye), ((0, handle),))))
    (shapes,) = found.frames
    assert found.volume < 1e-9 and found.missed < 1e-3 and found.intersecting == 0
    np.testing.assert_allclose(shapes[0][near], handle.end)
    shift = shapes[1].mean(axis=0) - eye.positions.mean(axis=0)
    assert shift[0] > 0.03 and found.report().keys() >= {"volume_change", "steps"}
    assert (np.linalg.norm(shapes[1] - shapes[0].mean(axis=0), axis=1) < 1.2).all()


@pytest.mark.parametrize("owner", [0, 1, -1])
def test_a_handle_moves_the_vertices_of_its_own_body(owner):
    """They are met to the bit; one of no body takes what is there along, and is met by none."""
    bodies = two_bodies()
    body = bodies[max(owner, 0)]
    near = body.positions[:, 2].argsort()[-5:]
    handle = FlowHandle(body.positions[near], body.positions[near] + [0.0, 0.02, 0.04], near)
    found = drain(flow_bodies(FlowJob(bodies, ((owner, handle),))))
    (shapes,) = found.frames
    exact = [np.array_equal(shape[near], handle.end) for shape in shapes]
    assert exact == [owner == k for k in range(2)]
    np.testing.assert_allclose(shapes[max(owner, 0)][near], handle.end, atol=0.01)


def test_faces_that_newly_meet_are_told_of_their_body():
    """A spike through the other side, which is held."""
    V, F = icosphere(2)
    ball = FlowBody("ball", V, F, polygons=np.arange(len(F)) // 2)
    tip = V[:, 2].argmax(keepdims=True)
    handle = FlowHandle(V[tip], np.array([[0.07, 0.05, -2.0]]), tip)
    rest = np.setdiff1d(np.arange(len(V)), tip)
    held = FlowHandle(V[rest], V[rest], rest)
    plain = FlowBody("far", V + [3, 0, 0], F)
    found = drain(flow_bodies(FlowJob((plain, ball), ((1, handle), (1, held)), FlowOptions(radius=0.003))))
    assert found.intersecting and len(found.crossing[1]) and not len(found.crossing[0])
    assert found.crossing[1].max() < len(F) // 2
    assert found.report()["new_intersections_faces"][1] == found.crossing[1].tolist()
    assert any("pass through one another" in text for text in found.warnings)


def test_a_region_stays():
    head, eye = two_bodies()
    low = FlowBody("low", head.positions, head.triangles, head.positions[:, 2] < -0.5)
    top = np.flatnonzero(head.positions[:, 2] > 0.95)
    handle = FlowHandle(head.positions[top], head.positions[top] + [0.3, 0, 0], top)
    found = drain(flow_bodies(FlowJob((low,), ((0, handle),), frames=2)))
    for (shape,) in found.frames:
        assert np.abs(shape[low.stays] - low.positions[low.stays]).max() < 5e-3
    np.testing.assert_array_equal(found.frames[-1][0][low.stays], low.positions[low.stays])


@pytest.mark.parametrize("keeping", [(0,), (1,), (2,), (0, 2), (1, 2)], ids=str)
def test_of_several_bodies_each_keeps_its_own_region(keeping):
    """Those that keep none, and what of them is not kept, go along with what is moved."""
    V, F = icosphere(1)
    sizes, bodies = (1.0, 0.6, 0.8), []
    for k, size in enumerate(sizes):
        # The bodies differ in their numbers of vertices, too.
        more = np.zeros((k, 3)) + [0.1, 0.2, 0.3 * k]
        positions = np.concatenate([size * V + [2.5 * k, 0, 0], more])
        stays = np.zeros(len(positions), bool)
        stays[: len(V)] = V[:, 2] < -0.5
        bodies.append(FlowBody("abc"[k], positions, F, stays if k in keeping else None))
    handles = []
    for k, body in enumerate(bodies):
        top = np.flatnonzero(V[:, 2] > 0.8)
        handles.append((k, FlowHandle(body.positions[top], body.positions[top] + [0.0, 0.15, 0.0], top)))
    (shapes,) = drain(flow_bodies(FlowJob(tuple(bodies), tuple(handles)))).frames
    for k, (body, shape) in enumerate(zip(bodies, shapes, strict=True)):
        low = np.flatnonzero(V[:, 2] < -0.5)
        same = np.array_equal(shape[low], body.positions[low])
        assert same == (k in keeping), k
        np.testing.assert_array_equal(shape[handles[k][1].vertices], handles[k][1].end)


def test_uvs_keep_their_areas_and_pins():
    x = np.linspace(0, 1, 41)
    uv = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    corners = np.concatenate([uv, uv])
    pinned = np.zeros(len(corners), bool)
    pinned[0] = True
    moved = drain(
        flow_uvs(
            UVPlaces.of(corners, pinned), np.array([[0.5, 0.5]]), np.array([[0.6, 0.5]]), FlowOptions(0.2, diagonal=1.0)
        )
    )
    np.testing.assert_array_equal(moved.uv[: len(uv)], moved.uv[len(uv) :])
    np.testing.assert_array_equal(moved.uv[0], uv[0])
    grid = moved.uv[: len(uv)].reshape(41, 41, 2)
    a, b = grid[1:, 1:] - grid[:-1, :-1], grid[:-1, 1:] - grid[1:, :-1]
    area = 0.5 * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]) * 40**2
    assert np.abs(area - 1).max() < 0.02 and np.abs(grid - uv.reshape(41, 41, 2)).max() > 0.08


def test_handle_files_say_what_goes_where(tmp_path):
    V, F = icosphere(1)
    bodies = (FlowBody("A", V, F), FlowBody("B", V + 5, F))
    path = tmp_path / "h.json"
    path.write_text(
        json.dumps(
            {
                "handles": [
                    {"group": "tip", "move": [0, 0, 1], "rotate": [0, 0, 90]},
                    {"vertices": [3, 1], "object": "B", "move": [1, 0, 0]},
                    {"from": [0, 0, 0], "to": [1, 1, 1]},
                ],
                "keep": "feet",
            }
        )
    )
    file = read_handle_file(path)
    found = handles_of(file, bodies, lambda k, name: np.array([0, 5]) if (k, name) == (0, "tip") else None)
    assert [owner for owner, _ in found] == [0, 1, -1] and file.keep == ("feet",)
    tip, pair, free = (handle for _, handle in found)
    np.testing.assert_allclose(tip.end.mean(axis=0), tip.start.mean(axis=0) + [0, 0, 1])
    np.testing.assert_array_equal(pair.vertices, [1, 3])
    np.testing.assert_allclose(free.end, [[1, 1, 1]])
    np.testing.assert_allclose(euler_matrix(np.radians([0, 0, 90])) @ [1, 0, 0], [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense", "is no JSON"),
        ("{}", "no list of handles"),
        ('{"handles": []}', "no list of handles"),
        ('[{"grup": "a"}]', "'grup'"),
        ('[{"group": "none"}]', "has no vertices"),
        ('[{"vertices": [0]}, {"group": "none"}]', "handle 1 has no vertices"),
        ('[{"from": [0, 0, 0], "to": [0, 0, 1]}, {"vertices": [0], "object": "B"}]', "handle 1 has no vertices"),
        ('[{"vertices": [99]}]', "vertices 0 to 41"),
        ('[{"vertices": ["a"]}]', "no list of numbers"),
        ('[{"vertices": [1.5]}]', "no list of numbers"),
        ('[{"vertices": [1e30]}]', "no list of numbers"),
        ('[{"vertices": [0], "move": [0, 1]}]', "no list of points"),
        ('[{"from": "x", "to": [0, 0, 0]}]', "no list of points"),
    ],
)
def test_handle_files_that_say_nothing_are_refused(tmp_path, text, words):
    path = tmp_path / "h.json"
    path.write_text(text)
    V, F = icosphere(1)
    with pytest.raises(HandleFileError, match=words):
        handles_of(read_handle_file(path), (FlowBody("A", V, F),), lambda k, name: None)
    with pytest.raises(HandleFileError, match="cannot be read"):
        read_handle_file(tmp_path / "none.json")
