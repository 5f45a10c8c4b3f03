"""What a map of the inside is good for: shells, samples, transfer, registration."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import limbed

from omt_uv.solver.errors import HandleError
from omt_uv.solver.flows.enclosed_volume import component_volumes
from omt_uv.solver.progress import drain
from omt_uv.solver.volumes.body_map import into_body, volume_map
from omt_uv.solver.volumes.registration import registered
from omt_uv.solver.volumes.sampling import ball_index, interior_points, sampled_field
from omt_uv.solver.volumes.shells import icosphere, level_surface, shell_surfaces
from omt_uv.solver.volumes.slices import dilation, plane_slice
from omt_uv.solver.volumes.tet_mesh import tet_volumes, turned_right
from omt_uv.solver.volumes.transfer import TetLocation


@pytest.fixture(scope="module")
def body():
    V, F = limbed(2)
    return drain(volume_map(V, F, count=2000))


def test_shells_hold_equal_volumes_and_look_outwards(body):
    whole = tet_volumes(body.points, body.tets).sum()
    shells = shell_surfaces(body.points, body.positions, body.tets, 3)
    for shell, share in zip(shells, (0.25, 0.5, 0.75), strict=True):
        volume = component_volumes(shell.vertices, shell.triangles)[0]
        assert volume.sum() == pytest.approx(share * whole, rel=1e-4)


def test_a_level_surface_of_a_linear_function_is_flat(body):
    flat = level_surface(body.points, body.tets, body.points[:, 2], 0.1)
    np.testing.assert_allclose(flat.vertices[:, 2], 0.1, atol=1e-9)
    corner = flat.vertices[flat.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert (normal[:, 2] > -1e-12).all() and normal[:, 2].sum() > 1


def test_points_are_found_and_fields_are_carried(body):
    locate = TetLocation(body.positions, body.tets)
    rng = np.random.default_rng(0)
    weights = rng.dirichlet(np.ones(4), 200)
    owner = rng.integers(len(body.tets), size=200)
    points = np.einsum("ka,kai->ki", weights, body.positions[body.tets[owner]])
    found, there = locate(points)
    np.testing.assert_allclose(np.einsum("ka,kai->ki", there, body.positions[body.tets[found]]), points, atol=1e-9)
    np.testing.assert_allclose(locate.values(body.positions[:50], body.points), body.points[:50], atol=1e-6)
    assert locate(np.zeros((0, 3)))[0].shape == (0,)


def test_places_correspond_and_points_are_evenly_dense(body):
    places = ball_index(1, 4)
    assert places.shape == (4 * 80, 3)
    np.testing.assert_allclose(
        np.unique(np.linalg.norm(places, axis=1).round(9)) ** 3, np.arange(1, 8, 2) / 8, atol=1e-6
    )
    field = body.positions[:, 0]
    np.testing.assert_allclose(sampled_field(body.positions, body.tets, field, places), places[:, 0], atol=0.02)
    cloud = interior_points(body.points, body.positions, body.tets, 3000)
    inside, _ = TetLocation(body.points, body.tets)(cloud)
    volume = tet_volumes(body.points, body.tets)
    # Halves of the body get halves of the points.
    for axis in range(3):
        low = body.points[body.tets].mean(axis=1)[:, axis] < np.median(body.points[:, axis])
        assert low[inside].mean() == pytest.approx(volume[low].sum() / volume.sum(), abs=0.02)
    again = interior_points(body.points, body.positions, body.tets, 3000, seed=1)
    assert not np.array_equal(again, cloud)


def test_spheres_of_an_index_look_outwards():
    vertices, triangles = icosphere(2)
    assert len(triangles) == 320 and (np.linalg.det(vertices[triangles]) > 0).all()


def test_landmarks_are_led_to_their_goals_without_a_change_of_volume(body):
    rng = np.random.default_rng(0)
    landmarks = rng.normal(size=(6, 3))
    landmarks *= 0.6 / np.linalg.norm(landmarks, axis=1)[:, None]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    goals = (landmarks + 0.06 * rng.normal(size=(6, 3))) @ turn.T
    found = drain(registered(body.positions, landmarks, goals))
    assert found.after < 1e-6 < found.before and np.linalg.norm(found.positions, axis=1).max() < 1 + 1e-9
    assert found.before == pytest.approx(np.linalg.norm(landmarks @ found.rotation.T - goals, axis=1).mean(), rel=1e-6)
    before, after = (tet_volumes(p, body.tets) for p in (body.positions, found.positions))
    # Of coarse tetrahedra; it falls with their size.
    assert np.abs(after / after.sum() - before / before.sum()).sum() < 0.12
    same = drain(registered(body.positions, landmarks, landmarks @ turn.T))
    np.testing.assert_allclose(same.positions, body.positions @ turn.T, atol=1e-9)
    with pytest.raises(HandleError, match="three"):
        drain(registered(body.positions, landmarks[:2], goals[:2]))


def test_a_body_in_itself_stays_and_slices_show_its_dilation(body):
    same = drain(into_body(body, body))
    np.testing.assert_allclose(same.positions, body.points, atol=1e-6)
    assert same.inverted == 0 and same.shares < 1e-6 and same.domain == "body"
    cut = plane_slice(body.points, body.positions, body.tets, np.array([0.0, 0, 1]), 0.1)
    np.testing.assert_allclose(cut.vertices[:, 2], 0.1, atol=1e-9)
    assert len(cut.dilation) == len(cut.triangles) and np.abs(cut.dilation).mean() < 0.6
    assert np.abs(dilation(body.points, 3 * body.points, body.tets)).max() < 1e-9


def test_tetrahedra_the_wrong_way_are_turned_and_no_others():
    points = np.random.default_rng(0).normal(size=(5, 3))
    tets = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    volume = tet_volumes(points, tets)
    tets = np.where((volume < 0)[:, None], tets[:, [0, 2, 1, 3]], tets)
    np.testing.assert_array_equal(turned_right(points, tets), tets)
    turned = turned_right(points, tets[:, [0, 1, 3, 2]])
    np.testing.assert_array_equal(np.sort(turned, axis=1), np.sort(tets, axis=1))
    np.testing.assert_allclose(tet_volumes(points, turned), np.abs(volume))


def test_what_is_the_right_way_as_a_whole_is_not_turned_for_the_sake_of_slivers():
    body = np.random.default_rng(1).normal(size=(6, 3))
    tets = np.array([[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]])
    volume = tet_volumes(body, tets)
    tets = np.where((volume < 0)[:, None], tets[:, [0, 2, 1, 3]], tets)
    smallest = np.abs(volume).argmin()
    tets[smallest] = tets[smallest, [0, 2, 1, 3]]
    np.testing.assert_array_equal(turned_right(body, tets), tets)
    again = turned_right(body, tets[:, [0, 2, 1, 3]])
    np.testing.assert_allclose(tet_volumes(body, again), tet_volumes(body, tets))
