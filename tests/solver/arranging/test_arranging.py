"""Equal surfaces are found by their motion, halves by their plane; grids of quads become rectangles."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.arranging.congruence import matching, mirrored_match
from omt_uv.solver.arranging.halves import halves, symmetric_map
from omt_uv.solver.arranging.quad_grid import rectangle
from omt_uv.solver.arranging.stacks import stacks
from omt_uv.solver.errors import GridError, MeshError
from omt_uv.solver.mesh.geometry import face_areas


def grid(columns, rows, seed=0):
    """A curved grid: positions, quads, triangles."""
    rng = np.random.default_rng(seed)
    x, y = (np.cumsum(rng.uniform(0.5, 1.5, k + 1)) for k in (columns, rows))
    X, Y = np.meshgrid(x, y)
    V = np.stack([X, Y, np.sin(X / 2) * np.cos(Y / 3)], axis=-1).reshape(-1, 3)
    k = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    quads = np.stack([k, k + 1, k + columns + 2, k + columns + 1], axis=1)
    return V, quads, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def turn(seed, mirror=False):
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    Q[:, 0] *= np.sign(np.linalg.det(Q)) * (-1 if mirror else 1)
    return Q


@pytest.mark.parametrize("mirror", [False, True])
def test_a_motion_is_found_whatever_the_order_of_the_vertices(mirror):
    V, _, F = grid(5, 4)
    order = np.random.default_rng(1).permutation(len(V))
    place = np.argsort(order)
    found = matching(V, F, (V @ turn(2, mirror) + [3, 1, -7])[order], place[F])
    assert found.mirrored == mirror and (found.vertices == place).all()


def test_other_shapes_and_other_faces_are_no_match():
    V, _, F = grid(5, 4)
    assert matching(V, F, V * [1, 1, 1.2], F) is None
    assert matching(V, F, grid(5, 4, 3)[0], F) is None
    assert matching(V, F, V[:-1], F) is None


def test_symmetric_shapes_have_many_motions_and_one_is_found():
    angle = np.arange(12) * np.pi / 6
    V = np.vstack([[0, 0, 0.5], np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])])
    F = np.stack([np.zeros(12, int), 1 + np.arange(12), 1 + (np.arange(12) + 1) % 12], axis=1)
    found = matching(V, F, V @ turn(4), F)
    moved = V[found.vertices]
    assert np.allclose(np.linalg.norm(moved[F[:, 1]] - moved[F[:, 2]], axis=1), 2 * np.sin(np.pi / 12))


def test_equal_islands_lie_on_one_another():
    V, _, F = grid(4, 3)
    other = grid(4, 3, 9)[0]
    uv = [V[:, :2], other[:, :2] + 20, V[:, 1::-1] + 7, V[:, :2] - 5]
    jobs = [(V, F, uv[0]), (other, F, uv[1]), (V @ turn(1), F, uv[2]), (V @ turn(2, True), F, uv[3])]
    done = stacks(jobs)
    assert done.stack.tolist() == [0, 1, 0, 0] and done.moved == 2
    assert all(np.allclose(done.uv[k], uv[0]) for k in (2, 3)) and (done.uv[1] == uv[1]).all()
    assert stacks(jobs, mirrored=False).stack.tolist() == [0, 1, 0, 3]


@pytest.mark.parametrize("mirrored", [False, True])
def test_whatever_numbers_its_vertices_have_an_island_lies_on_the_first(mirrored):
    V, _, F = grid(4, 3)
    order = np.random.default_rng(0).permutation(len(V))
    renumbered = np.argsort(order)[F]
    assert (order[order] != np.arange(len(V))).any()
    done = stacks([(V, F, V[:, :2]), (V[order] @ turn(2, mirrored) + 4, renumbered, V[order][:, :2] + 9)])
    np.testing.assert_allclose(done.uv[1], V[order][:, :2], atol=1e-12)


@pytest.mark.parametrize("stacked", [False, True])
def test_the_halves_of_a_pair(stacked):
    V, _, F = grid(4, 3)
    left = V * [-1, 1, 1]
    uv, where = V[:, :2] / 9, np.random.default_rng(0).uniform(size=(len(V), 2)) + 3
    normal = np.array([1.0, 0, 0])
    assert (mirrored_match(V, F, left, F, normal, 0.0) == np.arange(len(V))).all()
    done = halves([(left, F[:, ::-1], where), (V, F, uv)], normal, 0.0, stacked)
    assert done.partner.tolist() == [1, 0] and (done.uv[1] == uv).all()
    if stacked:
        assert np.allclose(done.uv[0], uv)
    else:
        assert np.allclose(np.diff(done.uv[0], axis=0), np.diff(uv, axis=0) * [-1, 1])
        assert np.allclose(done.uv[0].min(0) + done.uv[0].max(0), where.min(0) + where.max(0))


def test_an_island_across_the_plane_becomes_its_own_image():
    x = np.linspace(-1, 1, 7)
    X, Y = np.meshgrid(x, np.linspace(0, 1, 4))
    V = np.stack([X, Y, X**2], axis=-1).reshape(-1, 3)
    _, _, F = grid(6, 3)
    w = (V[:, :2] @ [1, 1j]) * np.exp(0.4j) + 0.02 * np.random.default_rng(0).normal(size=len(V))
    uv = np.column_stack([w.real, w.imag])
    image = mirrored_match(V, F, V, F, np.array([1.0, 0, 0]), 0.0)
    mean = symmetric_map(F, uv, image)
    lengths = np.linalg.norm(mean[F[:, 0]] - mean[F[:, 1]], axis=1)
    assert np.allclose(lengths, np.linalg.norm(mean[image[F[:, 0]]] - mean[image[F[:, 1]]], axis=1))
    assert np.abs(mean - uv).max() < 0.1
    done = halves([(V, F, uv)], np.array([1.0, 0, 0]), 0.0, True)
    assert np.allclose(done.uv[0], done.uv[0][image])
    with pytest.raises(MeshError, match="image"):
        halves([(grid(4, 3)[0], grid(4, 3)[2], grid(4, 3)[0][:, :2])], np.array([1.0, 0, 0]), 0.0, False)


@pytest.mark.parametrize(("columns", "rows"), [(7, 1), (1, 5), (6, 4), (1, 1)])
def test_a_grid_becomes_a_rectangle_whose_rows_and_columns_have_their_areas(columns, rows):
    V, quads, F = grid(columns, rows)
    areas = face_areas(V, F).reshape(2, -1).sum(0)
    order = np.random.default_rng(5).permutation(len(quads))
    shift = np.random.default_rng(6).integers(0, 4, len(quads))
    shuffled = quads[np.arange(len(quads))[:, None], (np.arange(4) + shift[:, None]) % 4][order]
    found = rectangle(V, shuffled, areas[order])
    uv = found.uv
    assert found.columns * found.rows == columns * rows and np.prod(np.ptp(uv, axis=0)) == pytest.approx(areas.sum())
    corners = uv[quads]
    d1, d2 = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    mapped = np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / 2
    table, asked = mapped.reshape(rows, columns), areas.reshape(rows, columns)
    for axis in (0, 1):
        assert np.allclose(table.sum(axis), asked.sum(axis))
    if min(columns, rows) == 1:
        assert np.allclose(mapped, areas)
    # Sides are straight: as many different coordinates as lines.
    assert sorted(len(np.unique(uv[:, k].round(9))) for k in (0, 1)) == sorted((columns + 1, rows + 1))


def test_what_is_no_grid_is_refused():
    V, quads, _ = grid(3, 3)
    for chosen in (quads[:-1], quads[[0, 1, 2, 3, 5, 6, 7, 8]]):
        used, local = np.unique(chosen, return_inverse=True)
        with pytest.raises(GridError, match="The quads of an island are not in rows and"):
            rectangle(V[used], local.reshape(-1, 4), np.ones(len(chosen)))
    ring = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]])
    with pytest.raises(GridError, match="ring"):
        rectangle(np.random.default_rng(0).normal(size=(6, 3)), ring, np.ones(3))


@pytest.mark.parametrize(("wide", "tall"), [([1.0, 3.0], [0.5]), ([0.2, 0.7, 1.1], [2.0, 1.0]), ([4.0], [0.1, 5.0])])
def test_a_grid_that_is_a_rectangle_stays_as_it_is(wide, tall):
    """Every side as long as it was: the proportions are those of the lengths along both ways."""
    x, y = np.concatenate([[0], np.cumsum(wide)]), np.concatenate([[0], np.cumsum(tall)])
    V = np.array([[a, b, 0.0] for b in y for a in x])
    n = len(x)
    quads = np.array([[n * r + c, n * r + c + 1, n * r + c + n + 1, n * r + c + n]
                      for r in range(len(tall)) for c in range(len(wide))])  # fmt: skip
    found = rectangle(V, quads, np.array([a * b for b in tall for a in wide]))
    for one in (quads, np.roll(quads, 1, axis=1)):
        before = np.linalg.norm(V[one[:, 0]] - V[one[:, 1]], axis=1)
        after = np.linalg.norm(found.uv[one[:, 0]] - found.uv[one[:, 1]], axis=1)
        np.testing.assert_allclose(after, before, rtol=1e-9)
    assert sorted((found.columns, found.rows)) == sorted((len(wide), len(tall)))


@pytest.mark.parametrize("far", [0.0, 1e4])
def test_hundreds_of_islands_find_their_images_among_those_nearby(far, monkeypatch):
    """Every triangle of a surface that is its own mirror image: each has one partner, and few are compared."""
    points, _, faces = grid(12, 8)
    points = points - [0, 0, points[:, 2].min() + 0.1]
    corners = np.concatenate([points[faces], (points * [1, 1, -1])[faces][:, ::-1]]) + [0, 0, far]
    uv = np.random.default_rng(0).random((len(corners), 3, 2))
    calls = []

    def counted(*arguments):
        calls.append(0)
        return mirrored_match(*arguments)

    monkeypatch.setattr("omt_uv.solver.arranging.halves.mirrored_match", counted)
    islands = [(v, np.array([[0, 1, 2]]), place) for v, place in zip(corners, uv, strict=True)]
    found = halves(islands, np.array([0, 0, 1.0]), far, True)
    half = len(faces)
    np.testing.assert_array_equal(found.partner, np.roll(np.arange(2 * half), half))
    assert len(calls) < 2 * half
    for k in range(half):
        np.testing.assert_array_equal(found.uv[k], found.uv[k + half][::-1])


def test_hundreds_of_islands_are_compared_with_those_of_their_area(monkeypatch):
    """Triangles that all differ, and a turned copy of each: it lies on that one, and hardly any other is looked at."""
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(300, 3, 3))
    calls = []

    def counted(*arguments):
        calls.append(0)
        return matching(*arguments)

    monkeypatch.setattr("omt_uv.solver.arranging.stacks.matching", counted)
    islands = [(v, np.array([[0, 1, 2]]), rng.random((3, 2))) for v in [*corners, *(corners @ turn(5).T + 3)]]
    found = stacks(islands)
    np.testing.assert_array_equal(found.stack, np.tile(np.arange(300), 2))
    assert found.moved == 300 <= len(calls) < 900
    for k in range(300):
        np.testing.assert_array_equal(found.uv[k + 300], found.uv[k])
