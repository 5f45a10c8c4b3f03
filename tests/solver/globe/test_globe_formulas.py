"""Globes against plain ways: arcs walked in small steps, corners found by barycentric coordinates, slopes measured."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import icosphere
from sphere_shapes import random_sphere

from omt_uv.solver.globe import exact_areas, pole_vertices, rotation, unfolding
from omt_uv.solver.globe.projections import (
    EQUIRECT,
    LAMBERT,
    OCTAHEDRAL,
    PROJECTIONS,
    SINUSOIDAL,
    octahedral_to_plane,
    to_plane,
    wrap_octahedral,
)
from omt_uv.solver.globe.unfolding import Polygons, brought_into_square, unfold
from omt_uv.solver.mesh.geometry import signed_areas


def triangle_polygons(F):
    m = len(F)
    return Polygons(F.ravel(), np.repeat(np.arange(m), 3), np.arange(3 * m).reshape(m, 3))


def unit(x):
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def test_corners_around_a_target_are_those_of_the_faces_that_hold_it():
    P, F = random_sphere(200)
    for target in unit(np.random.default_rng(1).normal(size=(20, 3))):
        shares = np.array([np.linalg.solve(P[f].T, target) for f in F])
        held = np.unique(F[(shares >= 0).all(axis=1)])
        found = pole_vertices._corners_around(P, F, target)
        assert sorted(found) == held.tolist() and len(held) == 3
        away = np.linalg.norm(P[found] - target, axis=1)
        assert (np.diff(away) >= 0).all()
    # The nearest one comes first.
    assert pole_vertices._corners_around(P, F, P[7])[0] == 7


def test_the_smooth_step_falls_from_one_to_nothing_and_its_slope_is_its_own():
    r = np.linspace(0, 2, 401)
    value, slope = pole_vertices._smooth_step(r, 0.5, 1.25)
    assert (value[r <= 0.5] == 1).all() and np.abs(value[r >= 1.25]).max() < 1e-12
    assert (np.diff(value) <= 0).all() and value[np.isclose(r, 0.875)] == pytest.approx(0.5)
    h = 1e-6
    ends = (pole_vertices._smooth_step(r + s * h, 0.5, 1.25) for s in (1, -1))
    (after, _), (before, _) = ends
    np.testing.assert_allclose(slope, (after - before) / (2 * h), atol=1e-6)
    # And its second derivative has no jump: 0 at both ends.
    for end in (0.5, 1.25):
        bend = [pole_vertices._smooth_step(np.array([end + s * 1e-4]), 0.5, 1.25)[1][0] for s in (1, -1)]
        assert max(map(abs, bend)) < 1e-5


def test_the_least_distance_of_targets():
    targets = unit(np.random.default_rng(0).normal(size=(12, 3)))
    pairs = [np.arccos(a @ b) for i, a in enumerate(targets) for b in targets[:i]]
    assert pole_vertices._separation(targets) == pytest.approx(min(pairs))
    assert pole_vertices._separation(pole_vertices.POLES) == pytest.approx(np.pi)
    assert pole_vertices._separation(pole_vertices.CONES) == pytest.approx(np.pi / 2)


def test_vertices_put_onto_a_target_leave_those_that_were_put_before(monkeypatch):
    """Where no push is possible one of the corners around is put there, and nothing is turned over."""
    monkeypatch.setattr(pole_vertices, "REACHES", ())
    P, F = random_sphere(300, 3)
    found, vertices = pole_vertices.move_vertices_onto(P, F, pole_vertices.CONES)
    assert (vertices >= 0).all() and len(set(vertices)) == 4
    np.testing.assert_array_equal(found[vertices], pole_vertices.CONES)
    assert (np.einsum("md,md->m", found[F[:, 0]], np.cross(found[F[:, 1]], found[F[:, 2]])) > 0).all()
    for vertex, target in zip(vertices, pole_vertices.CONES, strict=True):
        assert vertex in pole_vertices._corners_around(P, F, target)


@pytest.mark.parametrize("start", [[0, 0, -1.0], [0, 0, 1.0], [1, 0, 0.0], [-0.6, 0, 0.8], [0, 1e-9, -1]])
@pytest.mark.parametrize("turn", range(3))
def test_the_shortest_rotation_turns_by_the_angle_between(start, turn):
    start, end = unit(np.roll(start, turn)), np.roll([0, 0, 1.0], turn)
    R = rotation._shortest_rotation(start, end)
    np.testing.assert_allclose(R @ start, end, atol=1e-8)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-8)
    assert np.linalg.det(R) == pytest.approx(1)
    # Half of the trace less one half is the cosine of the angle.
    assert (np.trace(R) - 1) / 2 == pytest.approx(start @ end, abs=1e-8)


def walked(p, q, steps=3000):
    """Where the octahedral images of arcs (k,3) to (k,3) end, gone along in small steps: of the copy of before and of
    those beyond its four sides always the one that goes on."""
    sign, offset = np.ones(len(p)), np.zeros((len(p), 2))
    before, rows = octahedral_to_plane(p), np.arange(len(p))
    for t in np.linspace(0, 1, steps)[1:]:
        square = octahedral_to_plane(unit(p + t * (q - p)))
        signs, offsets = [sign], [offset]
        for centre in ([1, 0], [0, 1], [-1, 0], [0, -1]):
            signs.append(-sign)
            offsets.append(2 * sign[:, None] * centre + offset)
        images = np.stack([a[:, None] * square + b for a, b in zip(signs, offsets, strict=True)])
        best = np.linalg.norm(images - before, axis=2).argmin(axis=0)
        before, sign, offset = images[best, rows], np.stack(signs)[best, rows], np.stack(offsets)[best, rows]
    return before


def test_copies_along_arcs_are_those_that_the_arc_leads_to():
    rng = np.random.default_rng(0)
    p, q = unit(rng.normal(size=(2, 60, 3)) - [0, 0, 0.6])
    q = unit(p + 0.9 * (q - p))
    sign, offset = unfolding._copies_along_arcs(p, q)
    found = sign[:, None] * octahedral_to_plane(q) + offset
    np.testing.assert_allclose(found, walked(p, q), atol=1e-9)
    # Some cross no side, some one, and some two.
    assert (sign < 0).any() and ((sign > 0) & offset.any(axis=1)).any() and (~offset.any(axis=1)).any()
    # Whatever copy it is, it stands for the same point of the square.
    np.testing.assert_allclose(wrap_octahedral(found), octahedral_to_plane(q), atol=1e-9)


@pytest.mark.parametrize("projection", [EQUIRECT, LAMBERT])
def test_faces_beside_the_square_are_brought_back_by_whole_turns(projection):
    P, F = random_sphere(200)
    polygons = triangle_polygons(F)
    whole, _ = unfold(P, polygons, projection)
    np.testing.assert_allclose(brought_into_square(whole, polygons).corners(), whole.corners(), atol=1e-12)
    turns = np.random.default_rng(0).integers(-1, 2, len(F))
    offset = whole.offset.copy()
    offset[:, 0] += turns[polygons.polygon]
    moved = type(whole)(**{**vars(whole), "offset": offset})
    back = brought_into_square(moved, polygons).corners()
    np.testing.assert_allclose((back - whole.corners()) % 1, 0, atol=1e-9)
    u = back[:, 0].reshape(-1, 3)
    assert (u.mean(axis=1) >= 0).all() and (u.min(axis=1) < 1).all()


def test_corners_that_stand_for_a_pole_are_the_nearest_of_the_face_that_holds_it():
    P, F = random_sphere(100, 2)
    found = unfolding._pole_corners(P, triangle_polygons(F))
    assert found.sum() == 2
    for corner in np.flatnonzero(found):
        face = F[corner // 3]
        height = P[face, 2]
        pole = np.array([0, 0, np.sign(height.sum())])
        assert (np.linalg.solve(P[face].T, pole) > 0).all()
        assert F.ravel()[corner] == face[np.linalg.norm(P[face] - pole, axis=1).argmin()]


def test_the_first_usable_corner_of_every_polygon():
    polygon = np.array([0, 0, 0, 1, 1, 1, 2, 2])
    usable = np.array([False, True, True, False, False, False, True, False])
    assert unfolding._first_usable(polygon, usable).tolist() == [1, 3, 6]


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_steps_of_exact_areas_are_those_of_least_squares(projection):
    """The damped step solves the normal equations of the measured Jacobian, and the energy is the sum of squares."""
    P, F = random_sphere(40)
    polygons = triangle_polygons(F)
    unfolded, _ = unfold(P, polygons, projection)
    shares = np.random.default_rng(0).uniform(0.5, 1.5, len(F))
    shares /= shares.sum()
    metric = exact_areas._sphere_metric(unfolded, projection)
    problem = exact_areas._AreaProblem(unfolded, polygons, shares, metric, projection != OCTAHEDRAL)
    uv = unfolded.uv + 1e-3 * ~unfolded.fixed * np.random.default_rng(1).normal(size=unfolded.uv.shape)

    def areas(uv):
        return signed_areas(unfolded.with_points(uv).corners(), polygons.triangles)

    np.testing.assert_allclose(problem.residual(uv), (areas(uv) / areas(uv).sum() - shares) / np.sqrt(shares))
    away = 1e-5 * (metric * (uv - unfolded.uv) ** 2).sum()
    assert problem.energy(uv) == pytest.approx((problem.residual(uv) ** 2).sum() + away)
    free, h = np.flatnonzero(~unfolded.fixed.ravel()), 1e-6
    total = areas(uv).sum()
    J = np.zeros((len(F), len(free)))
    for column, k in enumerate(free):
        step = np.zeros(uv.size)
        step[k] = h
        ends = (areas(uv + s * step.reshape(-1, 2)) for s in (1, -1))
        # The whole area is taken as it is, as Gauss and Newton do with what changes little.
        J[:, column] = (next(ends) - next(ends)) / (2 * h) / total / np.sqrt(shares)
    scale = metric.ravel()[free]
    for damping in (1e-3, 1.0):
        normal = J.T @ J + np.diag((1e-5 + damping) * scale)
        slope = J.T @ problem.residual(uv) + 1e-5 * scale * (uv - unfolded.uv).ravel()[free]
        found = problem.step(uv, damping, problem.order).ravel()
        np.testing.assert_allclose(found[free], -np.linalg.solve(normal, slope), atol=1e-7)
        assert not found[unfolded.fixed.ravel()].any()


def test_faces_near_a_pole_take_the_area_of_their_image():
    """By a fine subdivision of the spherical triangle, laid out point by point."""
    P, F = icosphere(2)
    P = unit(P @ np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0].T)
    flipped = np.linalg.det(P[F[0]]) < 0
    F = F[:, ::-1] if flipped else F
    polygons = triangle_polygons(F)
    unfolded, points = unfold(P, polygons, EQUIRECT)
    # Straight triangles are made useless, so that all take their images' areas.
    flat = unfolded.with_points(0 * unfolded.uv)
    found = exact_areas.equirectangular_areas(points, flat, polygons)
    n = 40
    i, j = np.divmod(np.arange(n * n), n)
    inside = i + j < n
    shares = np.stack([i + 1 / 3, j + 1 / 3], axis=1)[inside] / n
    shares = np.concatenate([shares, (np.stack([i + 2 / 3, j + 2 / 3], axis=1) / n)[i + j < n - 1]])
    cells = np.column_stack([shares, 1 - shares.sum(axis=1)])
    for t in np.flatnonzero((found > 0) & (np.abs(points[F][..., 2]).max(axis=1) < 0.97))[::17]:
        a, b, c = points[F[t]]
        at = cells @ points[F[t]]
        # Solid angle of a cell of a flat triangle, times what the projection makes of it.
        solid = abs(np.linalg.det([a, b, c])) / 2 / n**2 / np.linalg.norm(at, axis=1) ** 3
        cosine = np.hypot(at[:, 0], at[:, 1]) / np.linalg.norm(at, axis=1)
        assert found[t] == pytest.approx((solid / cosine).sum() / (2 * np.pi**2), rel=0.02)


def test_pictures_without_a_pinch_are_as_wide_as_the_parallel():
    points = unit(np.random.default_rng(0).normal(size=(200, 3)))
    flat, even = to_plane(points, SINUSOIDAL), to_plane(points, EQUIRECT)
    latitude = np.arcsin(points[:, 2])
    np.testing.assert_allclose(flat[:, 1], even[:, 1])
    np.testing.assert_allclose(flat[:, 0] - 0.5, (even[:, 0] - 0.5) * np.cos(latitude), atol=1e-12)


@pytest.mark.parametrize("n", [1, 2, 4, 7])
def test_centres_of_equal_triangles_are_one_in_each(n):
    """All triangles between three neighbours of the grid, n cuts a side."""
    grid = [(i, j) for i in range(n + 1) for j in range(n + 1 - i)]
    cells = []
    for i, j in grid:
        for corners in ([(i, j), (i + 1, j), (i, j + 1)], [(i, j), (i - 1, j), (i, j - 1)]):
            if all(corner in grid for corner in corners):
                cells.append(np.mean(corners, axis=0) / n)
    found = exact_areas._grid_cells(n)
    assert len(found) == len(cells) == n * n
    np.testing.assert_allclose(found.sum(axis=1), 1)
    assert sorted(map(tuple, found[:, :2].round(9))) == sorted(map(tuple, np.round(cells, 9)))


@pytest.mark.parametrize(("low", "turn"), [(1.0, -1), (np.nextafter(1.0, 0), 0), (0.0, 0), (-0.25, 0), (-1.0, 1)])
def test_a_face_that_begins_where_the_square_ends_is_brought_back(low, turn):
    """Its middle is what counts on the left, and its least corner on the right."""
    u = low + np.array([0.0, 0.5, 1.0])
    corners = np.column_stack([u, [0.5, 0.6, 0.5]])
    whole = unfolding.Unfolding(
        uv=corners,
        index=np.arange(3),
        sign=np.ones(3),
        offset=np.zeros((3, 2)),
        fixed=np.zeros((3, 2), bool),
        poles=np.zeros(3, bool),
        missed=0,
    )
    back = brought_into_square(whole, triangle_polygons(np.array([[0, 1, 2]]))).corners()
    np.testing.assert_array_equal(back, corners + [turn, 0])
