"""Pieces of maps of bodies, against loops over tetrahedra and finite differences, and what they decide."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from tetrahedra import grid_of_tets, volumes

from omt_uv.solver.errors import TetrahedraError
from omt_uv.solver.volumes import body_map, meshing, paper_flow, shells, tet_exact, tet_newton
from omt_uv.solver.volumes.meshing import TetMesh
from omt_uv.solver.volumes.tet_mesh import boundary_triangles


def test_boxes_and_outsides():
    points, tets = grid_of_tets(1)
    surface = SimpleNamespace(vertices=np.full((4, 3), 9.0), extent=2.0)
    given = points * 3 + 1
    found = body_map._in_box(TetMesh(given, tets), given[:4], surface)
    middle = (given[:4].min(axis=0) + given[:4].max(axis=0)) / 2
    np.testing.assert_allclose(found.points[:4], 9)
    np.testing.assert_allclose(found.points[4:], (given[4:] - middle) / 2)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    assert body_map._outwards(corners, faces).tolist() == faces.tolist()
    assert body_map._outwards(corners, faces[:, ::-1]).tolist() == faces.tolist()
    rng = np.random.default_rng(0)
    sphere = rng.normal(size=(30, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    np.testing.assert_allclose(body_map._aligned(sphere @ turn, sphere), sphere, atol=1e-9)


@pytest.mark.parametrize("volume", [0.05, 0.3])
def test_level_surfaces_enclose_the_volume_asked_for(volume):
    points, tets = grid_of_tets(4)
    radius = np.linalg.norm(points - 0.5, axis=1)
    shell = shells._enclosing(points, tets, radius, volume)
    p = shell.vertices[shell.triangles]
    enclosed = np.einsum("ti,ti->t", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6
    assert shells._enclosed(shell) == pytest.approx(enclosed)
    assert enclosed == pytest.approx(volume, rel=0.02)


def test_rows_of_volumes_are_their_derivatives():
    points, tets = grid_of_tets(2, 0.05)
    weight = np.random.default_rng(0).random(len(tets))
    found = tet_exact._volume_rows(points, tets, weight)
    step = np.random.default_rng(1).normal(size=points.shape)
    h = 1e-6
    expected = weight * (volumes(points + h * step, tets) - volumes(points - h * step, tets)) / (2 * h)
    np.testing.assert_allclose(found @ step.ravel(), expected, atol=1e-8)


def test_strain_is_the_squared_gradient_by_shares():
    points, tets = grid_of_tets(2, 0.05)
    share = np.random.default_rng(0).random(len(tets))
    share /= share.sum()
    f = np.random.default_rng(1).normal(size=len(points))
    expected = 0.0
    for k, tet in enumerate(tets):
        slope = np.linalg.solve(np.column_stack([points[tet], np.ones(4)]), f[tet])[:3]
        expected += slope @ slope * (share[k] + 3 / len(tets))
    matrix = tet_exact._strain(points, tets, share)
    assert f @ (matrix @ f) == pytest.approx(expected)


@pytest.mark.parametrize("moves", [1, 2])
def test_moves_are_halved_around_what_would_be_lost_until_it_is_better(moves):
    points, tets = grid_of_tets(2)
    points = points - 0.5
    positions = points * 1.3
    both = tet_exact._both(tets, points, positions)
    assert both.there.sum() == pytest.approx(1)
    np.testing.assert_allclose(both.here, volumes(points, tets))
    np.testing.assert_allclose(both.there, volumes(positions, tets) / volumes(positions, tets).sum())
    move = np.zeros((moves, *points.shape))
    inner = int(np.linalg.norm(points, axis=1).argmin())
    move[:, inner] = [0.7, 0.0, 0.0]
    move[:, 0] = [-0.01, 0, 0]
    domain = SimpleNamespace(retract=lambda x: x)
    found = tet_exact._without_inversion(both, domain, move, lambda trial: True)
    assert (found.here > 0.1 * both.here).all() and (found.there > 0.1 * both.there).all()
    gone = found.positions - positions
    assert 0 < gone[inner, 0] < 0.7 and gone[0, 0] in (-0.01, pytest.approx(-0.01 / 2), pytest.approx(-0.01))
    assert (found.points is points) == (moves == 1)
    sizes = []

    def better(trial):
        sizes.append(np.abs(trial.positions - positions).max())
        return len(sizes) == 4

    small = np.zeros((1, *points.shape))
    small[:, 0] = [-0.01, 0, 0]
    tet_exact._without_inversion(both, domain, small, better)
    np.testing.assert_allclose(sizes, 0.01 / 2.0 ** np.arange(4))
    assert tet_exact._without_inversion(both, domain, small, lambda trial: False) is None


def test_what_stays_inverted_is_refused_and_counted():
    points, tets = grid_of_tets(1)
    tet_newton._without_inverted(points, tets)
    with pytest.raises(TetrahedraError, match="1 of 6 tetrahedra stays inverted"):
        tet_newton._without_inverted(points, np.concatenate([tets[:5], tets[5:, [0, 2, 1, 3]]]))
    with pytest.raises(TetrahedraError, match="2 of 6 tetrahedra stay inverted"):
        tet_newton._without_inverted(points, np.concatenate([tets[:4], tets[4:, [0, 2, 1, 3]]]))


def test_velocities_are_slopes_averaged_by_inverse_distances():
    points, tets = grid_of_tets(2, 0.05)
    rng = np.random.default_rng(0)
    potential = rng.normal(size=len(points))
    found = paper_flow._velocity(points, tets, potential)
    total, weight = np.zeros(points.shape), np.zeros(len(points))
    for tet in tets:
        slope = np.linalg.solve(np.column_stack([points[tet], np.ones(4)]), potential[tet])[:3]
        for v in tet:
            w = 1 / np.linalg.norm(points[v] - points[tet].mean(axis=0))
            total[v] += w * slope
            weight[v] += w
    np.testing.assert_allclose(found, total / weight[:, None], atol=1e-9)
    # A linear function has the same slope everywhere, and flat tetrahedra say nothing.
    slope = np.array([1.0, -2.0, 0.5])
    flat = np.concatenate([points, points[tets[0]].mean(axis=0, keepdims=True)])
    more = np.concatenate([tets, [[*tets[0][:3], len(points)]]])
    flat[-1] = flat[tets[0][:3]].mean(axis=0)
    np.testing.assert_allclose(
        paper_flow._velocity(flat, more, flat @ slope)[:-1], np.tile(slope, (len(points), 1)), atol=1e-9
    )


def test_what_has_no_chords_is_not_split(monkeypatch):
    points, tets = grid_of_tets(2)
    faces = boundary_triangles(tets)
    found, split = meshing.without_chords(points, tets, faces)
    n, edges = len(points), {frozenset(e) for t in split.tolist() for e in combinations(t, 2)}
    on, outer = set(np.unique(faces).tolist()), {frozenset(e) for t in faces.tolist() for e in combinations(t, 2)}
    assert not {e for e in edges if e <= on} - outer and len(found) > n
    np.testing.assert_array_equal(found[:n], points)
    assert volumes(found, split).min() > 0 and volumes(found, split).sum() == pytest.approx(1)

    def never(*_):
        raise AssertionError("nothing is to be split")

    monkeypatch.setattr(meshing, "_split", never)
    again, same = meshing.without_chords(found, split, faces)
    assert again is found and same is split
