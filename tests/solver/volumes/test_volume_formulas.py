"""Tetrahedra, shells, slices, domains and samples against plain formulas."""

from __future__ import annotations

import itertools
import warnings

import numpy as np
import pytest
from scipy.spatial import Delaunay

from omt_uv.solver.flows.enclosed_volume import corner_volumes
from omt_uv.solver.volumes import tet_mesh
from omt_uv.solver.volumes.domains import BallDomain, CubeDomain, HeldDomain, cube_points, on_cube
from omt_uv.solver.volumes.envelope import _boundary_first
from omt_uv.solver.volumes.sampling import ball_index, interior_points
from omt_uv.solver.volumes.shells import icosphere, level_surface, shell_surfaces
from omt_uv.solver.volumes.slices import dilation, plane_slice
from omt_uv.solver.volumes.tet_energy import REGULAR, rest_shape, tet_energy
from omt_uv.solver.volumes.transfer import TetLocation


def ball(count=60, seed=0):
    """Points of a ball, and tetrahedra of positive volume that fill it."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points *= (rng.uniform(0, 1, count) ** (1 / 3) / np.linalg.norm(points, axis=1))[:, None]
    tets = Delaunay(points).simplices.astype(np.int64)
    volume = tet_mesh.tet_volumes(points, tets)
    tets[volume < 0] = tets[volume < 0][:, [1, 0, 2, 3]]
    return points, tets[np.abs(volume) > 1e-6]


def test_measures_tetrahedron_by_tetrahedron():
    points, tets = ball()
    volume = tet_mesh.tet_volumes(points, tets)
    gradient, slope = tet_mesh.gradients(points, tets), tet_mesh.volume_gradients(points, tets)
    stiffness = tet_mesh.stiffness(points, tets)
    around = np.zeros(len(points))
    for t, corners in enumerate(tets):
        p = points[corners]
        plain = np.linalg.det(p[1:] - p[0]) / 6
        assert volume[t] == pytest.approx(plain)
        around[corners] += plain / 4
        for a in range(4):
            # 1 at its own vertex, 0 at the others.
            value = (p - p[a]) @ gradient[t, a] + 1
            np.testing.assert_allclose(value, np.arange(4) == a, atol=1e-7)
            moved = points.copy()
            moved[corners[a]] += [1e-6, 0, 0]
            along = (tet_mesh.tet_volumes(moved, tets[t : t + 1])[0] - plain) / 1e-6
            assert slope[t, a, 0] == pytest.approx(along, abs=1e-8)
        for e, (i, j) in enumerate(tet_mesh.EDGES):
            k, m = sorted(set(range(4)) - {i, j})
            # l cot(theta) / 6 of the opposite edge.
            n1 = np.cross(p[m] - p[k], p[i] - p[k])
            n2 = np.cross(p[m] - p[k], p[j] - p[k])
            cotangent = (n1 @ n2) / np.linalg.norm(np.cross(n1, n2))
            expected = np.linalg.norm(p[m] - p[k]) * cotangent / 6
            assert stiffness[t, e] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert tet_mesh.vertex_volumes(points, tets) == pytest.approx(around)
    faces = [tuple(sorted(f)) for c in tets.tolist() for f in itertools.combinations(c, 3)]
    outer = {f for f in faces if faces.count(f) == 1}
    boundary = tet_mesh.boundary_triangles(tets)
    assert {tuple(sorted(f)) for f in boundary.tolist()} == outer and len(boundary) == len(outer)
    assert corner_volumes(points, boundary).sum() / 6 == pytest.approx(volume.sum())
    assert tet_mesh.boundary_vertices(tets).tolist() == sorted({v for f in outer for v in f})
    weights = np.random.default_rng(0).uniform(1, 2, (len(tets), 6))
    matrix = np.zeros((len(points),) * 2)
    for c, w in zip(tets, weights, strict=True):
        for (i, j), x in zip(tet_mesh.EDGES, w, strict=True):
            matrix[c[i], c[j]] -= x
            matrix[c[j], c[i]] -= x
    matrix -= np.diag(matrix.sum(axis=1))
    np.testing.assert_allclose(tet_mesh.graph_laplacian(tets, weights, len(points)).toarray(), matrix, atol=1e-12)
    target = volume * np.random.default_rng(1).uniform(0.5, 2, len(volume))
    share, asked = volume / volume.sum(), target / target.sum()
    assert tet_mesh.share_error(points, tets, target) == pytest.approx(np.abs(share - asked).sum())
    mine, theirs = (np.bincount(tets.ravel(), np.repeat(x / 4, 4)) for x in (share, asked))
    assert tet_mesh.vertex_share_error(points, tets, target) == pytest.approx(np.abs(mine - theirs).sum())
    assert tet_mesh.share_error(points, tets, 7 * volume) == pytest.approx(0, abs=1e-12)


def test_the_energy_is_its_formula():
    points, tets = ball(25)
    whole = tet_mesh.tet_volumes(points, tets).sum()
    at = points * [1.2, 0.9, 1.1] + 0.01 * np.sin(7 * points[:, [1, 2, 0]])
    for weight, eps in itertools.product((1.0, 5.0), (0.0, 0.3)):
        shape = rest_shape(points, tets, 1e-9)
        found = tet_energy(shape, whole, weight, eps)
        total = 0.0
        for t, F in enumerate(found.jacobians(at)):
            d = np.linalg.det(F)
            chi = (d + np.sqrt(d * d + eps * eps)) / 2
            shear = (F**2).sum() / (3 * chi ** (2 / 3)) - 1
            total += shape.weight[t] * (shear + weight * ((d * d + 1) / (2 * chi) - 1))
        assert found.value(at) == pytest.approx(total)
    assert shape.weight.sum() == pytest.approx(1)
    inverted = at.copy()
    inverted[tets[0, 0]] = 3 * at[tets[0, 1:]].mean(axis=0) - 2 * at[tets[0, 0]]
    assert found.value(inverted) > total and tet_energy(shape, whole, 1.0).value(inverted) == np.inf
    # Of what is regular and right nothing is asked.
    one = tet_energy(rest_shape(np.vstack([np.zeros(3), REGULAR.T]), np.array([[0, 1, 2, 3]]), 1.0), 1.0, 3.0)
    size = np.cbrt(1 / (np.linalg.det(REGULAR) / 6))
    assert one.value(size * np.vstack([np.zeros(3), REGULAR.T])) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("value", [-0.3, 0.05, 0.4])
def test_level_surfaces_part_what_is_below_from_what_is_above(value):
    points, tets = ball()
    function = points @ [1.0, 2.0, -0.5] + 0.3
    found = level_surface(points, tets, function, value)
    normal = np.array([1.0, 2.0, -0.5])
    assert found.value == value and (found.vertices @ normal + 0.3) == pytest.approx(value)
    corner = found.vertices[found.triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2
    assert (area @ normal > -1e-12).all()
    # As large as the section of all tetrahedra, each by its own polygon.
    total = 0.0
    for c in tets:
        p, f = points[c], function[c]
        cut = [
            p[i] + (value - f[i]) / (f[j] - f[i]) * (p[j] - p[i])
            for i, j in tet_mesh.EDGES
            if (f[i] > value) != (f[j] > value)
        ]
        if cut:
            q = np.array(cut) - np.mean(cut, axis=0)
            x = q[np.linalg.norm(q, axis=1).argmax()]
            x = x / np.linalg.norm(x)
            y = np.cross(normal / np.linalg.norm(normal), x)
            z = q @ x + 1j * (q @ y)
            z = z[np.argsort(np.angle(z))]
            total += (z.conj() * np.roll(z, -1)).imag.sum() / 2
    assert np.linalg.norm(area.sum(axis=0)) == pytest.approx(total)


def test_shells_of_a_ball_have_radii_of_equal_volumes():
    vertices, faces = icosphere(2)
    points = np.concatenate([np.zeros((1, 3)), *(r * vertices for r in (0.25, 0.5, 0.75, 1))])
    tets = Delaunay(points).simplices.astype(np.int64)
    volume = tet_mesh.tet_volumes(points, tets)
    tets = np.where((volume < 0)[:, None], tets[:, [1, 0, 2, 3]], tets)[np.abs(volume) > 1e-9]
    whole = tet_mesh.tet_volumes(points, tets).sum()
    shells = shell_surfaces(points, points, tets, 4)
    for k, shell in enumerate(shells):
        assert corner_volumes(shell.vertices, shell.triangles).sum() / 6 == pytest.approx((k + 1) / 5 * whole, rel=1e-4)
        assert shell.value == pytest.approx(np.cbrt((k + 1) / 5), abs=0.03)
    for levels in (0, 1, 2):
        V, F = icosphere(levels)
        assert (len(V), len(F)) == (10 * 4**levels + 2, 20 * 4**levels)
        assert np.linalg.norm(V, axis=1) == pytest.approx(1) and (np.linalg.det(V[F]) > 0).all()
    places = ball_index(1, 3).reshape(3, 80, 3)
    assert np.linalg.norm(places, axis=2) == pytest.approx(np.cbrt([[1 / 6], [3 / 6], [5 / 6]]) * np.ones(80))
    np.testing.assert_allclose(places[0] / np.linalg.norm(places[0], axis=1)[:, None], places[2] / np.cbrt(5 / 6))
    cloud = interior_points(points, points, tets, 2000)
    radius = np.sort(np.linalg.norm(cloud, axis=1)) ** 3
    assert np.abs(radius - (np.arange(2000) + 0.5) / 2000).max() < 0.06
    assert np.abs(cloud.mean(axis=0)).max() < 0.02
    assert np.array_equal(cloud, interior_points(points, points, tets, 2000, 0))


def test_a_slice_is_coloured_by_what_the_map_does_there():
    points, tets = ball()
    there = points * [1.0, 1.0, 2.0] + np.where(points[:, :1] > 0, 0.5, 0.0) * points
    here, after = tet_mesh.tet_volumes(points, tets), np.abs(tet_mesh.tet_volumes(there, tets))
    found = dilation(points, there, tets)
    positive = tet_mesh.tet_volumes(there, tets) > 0
    plain = np.log2(after / tet_mesh.tet_volumes(there, tets).sum() / (here / here.sum()))
    assert found[positive] == pytest.approx(
        np.maximum(plain, np.log2(1e-3 / len(tets) / (here / here.sum())))[positive]
    )
    cut = plane_slice(points, there, tets, np.array([0.0, 0.0, 1.0]), 0.1)
    middle = cut.vertices[cut.triangles].mean(axis=1)
    for m, value in zip(middle, cut.dilation, strict=True):
        inside = [
            t
            for t, c in enumerate(tets)
            if (np.linalg.solve(np.vstack([points[c].T, np.ones(4)]), np.append(m, 1)) > -1e-7).all()
        ]
        assert any(value == pytest.approx(found[t]) for t in inside)


def test_points_outside_belong_to_what_is_nearest():
    points, tets = ball()
    locate = TetLocation(points, tets)
    far = 1.5 * points[tet_mesh.boundary_vertices(tets)]
    values = locate.values(far, points)
    owner, weights = locate(far)
    assert weights.sum(axis=1) == pytest.approx(1) and (weights.min(axis=1) < 0).all()
    assert (np.linalg.norm(values, axis=1) <= 1 + 1e-9).all()
    np.testing.assert_allclose(np.einsum("ka,kai->ki", weights, points[tets[owner]]), far, atol=1e-9)
    constant = locate.values(far, np.full(len(points), 3.0))
    assert constant == pytest.approx(3)


def test_what_the_domains_do():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(6, 3))
    edge = np.array([0, 2, 5])
    slope = rng.normal(size=(6, 3))
    sphere = BallDomain(edge)
    back = sphere.retract(points)
    assert np.linalg.norm(back[edge], axis=1) == pytest.approx(1)
    np.testing.assert_array_equal(back[[1, 3, 4]], points[[1, 3, 4]])
    np.testing.assert_allclose(back[edge] * np.linalg.norm(points[edge], axis=1)[:, None], points[edge])
    frames = sphere.frames(back)
    np.testing.assert_allclose(frames[edge][:, :, 2], back[edge], atol=1e-12)
    assert np.linalg.det(frames) == pytest.approx(1)
    # Where a point of the boundary is off the sphere, its axes are those of where it belongs.
    np.testing.assert_allclose(sphere.frames(points)[edge], frames[edge], atol=1e-12)
    assert sphere.bending(slope, back) == pytest.approx(np.maximum(-(slope * back)[edge].sum(axis=1), 0))
    assert sphere.start(back) is back
    side = np.array([0, 1, 2])
    cube = CubeDomain(edge, side)
    frames = cube.frames(points)
    for k, v in enumerate(edge):
        assert frames[v][:, 2].tolist() == np.eye(3)[side[k]].tolist()
        assert np.linalg.det(frames[v]) == pytest.approx(1)
    wide = cube.retract(3 * points)
    assert (
        np.abs(wide[edge]).max() == 1
        and np.array_equal(wide[1], 3 * points[1])
        and not cube.bending(slope, points).any()
    )
    held = HeldDomain(edge)
    assert held.retract(points) is points and not held.bending(slope, points).any() and held.sliding == 0
    np.testing.assert_array_equal(held.frames(points), np.tile(np.eye(3), (6, 1, 1)))
    unit = points / np.linalg.norm(points, axis=1)[:, None]
    cubed = cube_points(unit)
    assert np.abs(cubed).max(axis=1) == pytest.approx(1) and (np.sign(cubed) == np.sign(unit)).all()
    for p, q in zip(unit, cubed, strict=True):
        axis = np.abs(p).argmax()
        for k in range(3):
            expected = np.sign(p[k]) if k == axis else 4 / np.pi * np.arctan(p[k] / abs(p[axis]))
            assert q[k] == pytest.approx(expected)
    corner = np.array([[1.0, 1, 1]]) / 3**0.5
    np.testing.assert_allclose(
        on_cube(np.concatenate([corner, 0.5 * np.eye(3), np.zeros((1, 3))])),
        [[1, 1, 1], [0.5, 0, 0], [0, 0.5, 0], [0, 0, 0.5], [0, 0, 0]],
        atol=1e-12,
    )


def test_the_boundary_comes_first_and_nothing_is_lost():
    points, tets = ball()
    points = np.concatenate([[[9.0, 9, 9]], points])
    found, renamed, boundary = _boundary_first(points, tets + 1)
    assert len(found) == len(points) - 1 and np.unique(boundary).tolist() == list(range(boundary.max() + 1))
    np.testing.assert_array_equal(found[renamed], points[tets + 1])
    np.testing.assert_array_equal(found[boundary], points[tet_mesh.boundary_triangles(tets + 1)])


def test_shares_of_inverted_tetrahedra_are_negative():
    points, tets = ball()
    there = points.copy()
    there[tets[3, 0]] *= -3
    volume = tet_mesh.tet_volumes(there, tets)
    assert (volume < 0).any()
    target = np.arange(1.0, len(tets) + 1)
    expected = sum(abs(v / sum(volume) - t / sum(target)) for v, t in zip(volume, target, strict=True))
    assert tet_mesh.share_error(there, tets, target) == pytest.approx(expected)


def test_flat_and_inverted_tetrahedra_have_a_dilation_on_either_side():
    """A body that a library filled may have some: what has no share there is as far out as what has least in a map."""
    points, tets = ball()
    flat = points.copy()
    flat[tets[0, 3]] = flat[tets[0, 0]]
    flat[tets[5, 0]] *= -3
    volume = tet_mesh.tet_volumes(flat, tets)
    assert (volume == 0).any() and (volume < 0).any()
    for here, there in ((flat, points), (points, flat), (flat, flat)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = dilation(here, there, tets)
        assert np.isfinite(found).all()
        wrong = tet_mesh.tet_volumes(here, tets) <= 0
        share = tet_mesh.tet_volumes(there, tets) / tet_mesh.tet_volumes(there, tets).sum()
        assert found[wrong] == pytest.approx(np.log2(np.maximum(1e3 * len(tets) * share[wrong], 1)))


@pytest.mark.parametrize("thin", [1.0, 1e-4, 1e-8, 1e-12])
@pytest.mark.parametrize("seed", range(3))
def test_slivers_that_a_map_keeps_have_no_dilation_and_whatever_has_a_share_there_has_its_own(thin, seed):
    """Shares in the map are what logarithms make of those in the body, however small these are. In the map a share
    below the least is taken for that, and not for more than it was."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    rng, tets = np.random.default_rng(seed), np.arange(80).reshape(20, 4)
    size = thin ** rng.random(20)
    flat, plain = (np.concatenate([corner * [1, 1, s] for s in sizes]) for sizes in (size, rng.uniform(0.5, 2, 20)))
    here, there = (tet_mesh.tet_volumes(p, tets) / tet_mesh.tet_volumes(p, tets).sum() for p in (flat, plain))
    assert dilation(flat, flat, tets) == pytest.approx(0, abs=1e-9)
    assert dilation(flat, 7 * flat[:, [1, 2, 0]] + 3, tets) == pytest.approx(0, abs=1e-2)
    assert (here * 2.0 ** dilation(flat, plain, tets)) == pytest.approx(there, rel=1e-9)
    assert (there * 2.0 ** dilation(plain, flat, tets)) == pytest.approx(np.maximum(here, 1e-3 / 20), rel=1e-9)
