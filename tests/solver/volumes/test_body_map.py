"""Insides of bodies in ball and cube: nothing inverted, volumes around vertices right, and bad input named."""

from __future__ import annotations

import itertools
import sys

import numpy as np
import pytest
from bodies import bowl, icosphere, limbed

from omt_uv.solver.errors import LibraryError, NotASphereError, OpenSurfaceError, SelfIntersectionError
from omt_uv.solver.progress import drain
from omt_uv.solver.volumes.body_map import harmonic, volume_map
from omt_uv.solver.volumes.domains import BallDomain, CubeDomain, cube_points
from omt_uv.solver.volumes.meshing import TetMesh, split_inside, tetrahedra, without_chords
from omt_uv.solver.volumes.paper_flow import paper_flow
from omt_uv.solver.volumes.tet_energy import REGULAR, TetAssembly, rest_shape, signed_svd, tet_energy
from omt_uv.solver.volumes.tet_exact import exact_volumes
from omt_uv.solver.volumes.tet_mesh import (
    FACES,
    gradients,
    graph_laplacian,
    share_error,
    stiffness,
    tet_volumes,
    vertex_share_error,
    vertex_volumes,
    volume_gradients,
)
from omt_uv.solver.volumes.tet_newton import inverted, tet_problem, unlocked, untangled


@pytest.fixture(scope="module")
def body():
    V, F = limbed(2)
    return V, F, drain(volume_map(V, F, count=2000))


def few_tets():
    """Three tetrahedra of positive volume, and positions near them."""
    rng = np.random.default_rng(0)
    T = np.array([[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]])
    X = np.zeros((6, 3))
    X[1:4] = REGULAR.T
    # Regular ones: each the mirror image of the one before.
    for k in (4, 5):
        X[k] = 2 * X[k - 3 : k].mean(axis=0) - X[k - 4]
    turned = tet_volumes(X, T) < 0
    T[turned] = T[turned][:, [1, 0, 2, 3]]
    return X, T, X + 0.02 * rng.normal(size=X.shape)


@pytest.mark.parametrize("eps", [0.0, 0.3])
def test_the_derivatives_are_those_of_the_energy(eps):
    X, T, Y = few_tets()
    energy = tet_energy(rest_shape(X, T, 1e-9), tet_volumes(X, T).sum(), 2.0, eps)
    axes, h = np.tile(np.eye(3), (6, 1, 1)), 1e-6
    slope, blocks = energy.derivatives(Y, axes)
    units = np.eye(18).reshape(18, 6, 3)
    numeric = [(energy.value(Y + h * u) - energy.value(Y - h * u)) / (2 * h) for u in units]
    np.testing.assert_allclose(slope.ravel(), numeric, atol=1e-6 * np.abs(slope).max())
    matrix = TetAssembly(T, np.arange(18).reshape(6, 3)).matrix(blocks).toarray()
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-9)
    assert np.linalg.eigvalsh(matrix).min() > -1e-9
    change = [(energy.derivatives(Y + h * u, axes)[0] - energy.derivatives(Y - h * u, axes)[0]).ravel() for u in units]
    more = matrix - np.array(change) / (2 * h)
    # Of tetrahedra, negative eigenvalues count by their size, so that what is more is positive, and small here.
    assert np.linalg.eigvalsh(more + more.T).min() > -1e-5 * np.abs(matrix).max()
    assert np.abs(more).max() < (0.02 if eps == 0.3 else 0.2) * np.abs(matrix).max()


def test_measures_of_tetrahedra_fit_together():
    X, T, Y = few_tets()
    np.testing.assert_allclose(vertex_volumes(X, T).sum(), tet_volumes(X, T).sum())
    np.testing.assert_allclose(
        np.einsum("mai,maj->mij", X[T], gradients(X, T)), np.tile(np.eye(3), (3, 1, 1)), atol=1e-9
    )
    h = 1e-6
    numeric = (tet_volumes(X + h * (Y - X), T) - tet_volumes(X - h * (Y - X), T)) / (2 * h)
    np.testing.assert_allclose(numeric, np.einsum("mai,mai->m", volume_gradients(X, T), (Y - X)[T]), atol=1e-8)
    L = graph_laplacian(T, stiffness(X, T), 6)
    np.testing.assert_allclose(L @ X[:, 0] @ X[:, 0], tet_volumes(X, T).sum())
    assert share_error(X, T, tet_volumes(X, T)) == 0 == round(vertex_share_error(2 * X, T, tet_volumes(X, T)), 12)
    U, s, V = signed_svd(np.diag([1.0, 2, -3])[None])
    np.testing.assert_allclose(U @ (s[:, :, None] * V.swapaxes(1, 2)), np.diag([1.0, 2, -3])[None], atol=1e-12)
    assert s[0, 2] < 0 and np.linalg.det(U) > 0


def boundary_triangles(tets):
    """Triangles (k,3) that belong to one of tetrahedra (m,4) alone."""
    every = tets[:, FACES].reshape(-1, 3)
    _, inverse, count = np.unique(np.sort(every, axis=1), axis=0, return_inverse=True, return_counts=True)
    return every[count[inverse.ravel()] == 1]


def test_the_surface_is_kept_and_no_edge_leads_through_the_inside():
    V, F = limbed(2)
    mesh = tetrahedra(V, F, 1500)
    np.testing.assert_array_equal(mesh.points[: len(V)], V)
    assert {frozenset(f) for f in boundary_triangles(mesh.tets).tolist()} == {frozenset(f) for f in F.tolist()}
    assert (tet_volumes(mesh.points, mesh.tets) > 0).all()
    again, tets = without_chords(mesh.points, mesh.tets, F)
    assert len(again) == len(mesh.points) and len(tets) == len(mesh.tets)


def test_a_ball_map_inverts_nothing_and_volumes_are_right(body):
    V, F, found = body
    assert found.inverted == 0 and (tet_volumes(found.positions, found.tets) > 0).all()
    assert found.around_vertices < 0.01 and found.shares < 0.01
    np.testing.assert_array_equal(found.points[: len(V)], V)
    radius = np.linalg.norm(found.positions, axis=1)
    np.testing.assert_allclose(radius[: len(V)], 1.0)
    assert radius[len(V) :].max() < 1 and not found.warnings


def test_a_cube_is_filled_to_its_sides():
    V, F = icosphere(2)
    found = drain(volume_map(V, F, domain="cube", count=2500))
    assert found.inverted == 0 and found.shares < 0.03
    np.testing.assert_allclose(np.abs(found.positions[: len(V)]).max(axis=1), 1.0)
    assert np.abs(found.positions).max() <= 1
    np.testing.assert_allclose(cube_points(np.array([[0.0, 0, -1], [1, 1, 1]]) / [[1], [3**0.5]])[1], [1, 1, 1])
    axes = CubeDomain(np.arange(2), np.array([0, 2])).frames(np.zeros((3, 3)))
    np.testing.assert_allclose(np.abs(axes[:2, :, 2]), [[1, 0, 0], [0, 0, 1]])


def test_the_flow_of_the_paper_brings_volumes_nearer(body):
    V, F, found = body
    start = harmonic(tetrahedra(V, F, 2000), found.positions[: len(V)])
    mesh = tetrahedra(V, F, 2000)
    flowed = drain(paper_flow(mesh.points, mesh.tets, start, BallDomain(np.arange(len(V))), 20, keep=(0, 20)))
    assert flowed.errors[-1] < 0.6 * flowed.errors[0] and len(flowed.kept) == 2
    np.testing.assert_array_equal(flowed.kept[-1], flowed.positions)
    whole = drain(volume_map(V, F, method="flow", mesh=mesh))
    assert whole.inverted == inverted(whole.positions, whole.tets) and (not whole.inverted or whole.warnings)


def test_volumes_of_tetrahedra_come_right_where_points_inside_may_move(body):
    V, F, found = body
    edge = BallDomain(np.arange(len(V)))
    rng = np.random.default_rng(0)
    moved = found.positions.copy()
    moved[len(V) :] += 0.005 * rng.normal(size=moved[len(V) :].shape)
    assert inverted(moved, found.tets) == 0
    rest = tet_volumes(found.points, found.tets)
    still = drain(exact_volumes(found.points, found.tets, moved, edge, 0.02, slide=False))
    both = drain(exact_volumes(found.points, found.tets, moved, edge, 0.02))
    np.testing.assert_array_equal(still.points, found.points)
    np.testing.assert_array_equal(both.points[: len(V)], V)
    errors = [share_error(x.positions, found.tets, tet_volumes(x.points, found.tets)) for x in (still, both)]
    assert errors[1] < errors[0] < share_error(moved, found.tets, rest)
    assert inverted(both.points, found.tets) == inverted(both.positions, found.tets) == 0


def test_what_is_tangled_is_untangled(body):
    V, F, found = body
    rng = np.random.default_rng(0)
    mixed = found.positions.copy()
    mixed[len(V) :] += 0.04 * rng.normal(size=mixed[len(V) :].shape)
    assert inverted(mixed, found.tets) > 10
    free = drain(untangled(tet_problem(found.points, found.tets, BallDomain(np.arange(len(V)))), mixed))
    assert inverted(free, found.tets) == 0


def test_edges_inside_are_split_in_their_middle_and_the_surface_stays(body):
    V, _, found = body
    asked = np.random.default_rng(0).random(len(found.tets)) < 0.2
    finer, positions = split_inside(TetMesh(found.points, found.tets), found.positions, asked)
    assert (
        len(finer.tets) > len(found.tets) and inverted(finer.points, finer.tets) == inverted(positions, finer.tets) == 0
    )
    assert np.array_equal(finer.points[: len(found.points)], found.points)
    keys = [np.unique(np.sort(boundary_triangles(tets), axis=1), axis=0) for tets in (finer.tets, found.tets)]
    assert np.array_equal(*keys)
    for places in ((finer.points, found.points), (positions, found.positions)):
        assert np.isclose(*(tet_volumes(x, mesh.tets).sum() for x, mesh in zip(places, (finer, found), strict=True)))


def test_the_edge_inside_that_is_split_is_the_longest_in_the_body_and_at_its_places_together(body):
    _, _, found = body
    places = np.concatenate([found.points, found.positions * [1, 1, 4]], axis=1)
    surface = {tuple(e) for e in np.sort(boundary_triangles(found.tets)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)).tolist()}

    def length(edge):
        way = places[edge[0]] - places[edge[1]]
        return np.linalg.norm(way[:3]) + np.linalg.norm(way[3:])

    for t in np.random.default_rng(0).permutation(len(found.tets))[:12]:
        inside = set(itertools.combinations(np.sort(found.tets[t]).tolist(), 2)) - surface
        finer, positions = split_inside(
            TetMesh(found.points, found.tets), places[:, 3:], np.arange(len(found.tets)) == t
        )
        assert len(finer.points) == len(found.points) + bool(inside)
        if inside:
            middle = places[list(max(inside, key=length))].mean(axis=0)
            np.testing.assert_allclose(np.append(finer.points[-1], positions[-1]), middle, atol=1e-12)


def test_what_has_no_room_is_given_some(body):
    V, _, found = body
    crowded = found.positions.copy()
    # All points inside at one place: most tetrahedra have no volume, and the boundary may not give way.
    crowded[len(V) :] = 0.0
    mesh, positions = drain(unlocked(TetMesh(found.points, found.tets), crowded, len(V)))
    assert inverted(positions, mesh.tets) == inverted(mesh.points, mesh.tets) == 0
    assert np.array_equal(positions[: len(V)], found.positions[: len(V)])


@pytest.mark.parametrize("domain", ["ball", "cube"])
def test_a_body_with_a_thin_wall_is_mapped(domain):
    V, F = bowl(5, 12, 0.15)
    found = drain(volume_map(V, F, domain, count=1000))
    assert found.inverted == inverted(found.points, found.tets) == 0
    assert any("off in sum" in told for told in found.warnings) == (found.shares > 0.02)
    assert np.array_equal(found.points[: len(V)], V)


def test_bad_input_is_named_and_has_a_remedy(monkeypatch):
    V, F = icosphere(2)
    with pytest.raises(OpenSurfaceError, match="The surface is not closed"):
        drain(volume_map(V, F[1:]))
    a, b = np.meshgrid(np.arange(12), np.arange(8), indexing="ij")
    corner = lambda i, j: (i % 12) * 8 + j % 8  # noqa: E731
    quads = np.stack([corner(a, b), corner(a + 1, b), corner(a + 1, b + 1), corner(a, b + 1)], axis=-1).reshape(-1, 4)
    u, v = 2 * np.pi * a.ravel() / 12, 2 * np.pi * b.ravel() / 8
    torus = np.stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)], axis=1)
    with pytest.raises(NotASphereError, match="handle"):
        drain(volume_map(torus, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])))
    pushed = V.copy()
    pushed[V[:, 2].argmax()] = [0.1, 0.2, -1.5]
    with pytest.raises(SelfIntersectionError) as caught:
        drain(volume_map(pushed, F))
    assert caught.value.kind == "face" and len(caught.value.elements)
    with pytest.raises(ValueError, match="ball"):
        drain(volume_map(V, F, domain="egg"))
    monkeypatch.setitem(sys.modules, "tetgen", None)
    with pytest.raises(LibraryError, match="pip install tetgen"):
        drain(volume_map(V, F))


def test_the_inside_is_where_the_body_is_in_its_units():
    V, F = icosphere(2)
    V = 7 * V * [1, 1, 1.5] + [40, -30, 5]
    found = drain(volume_map(V, F, count=300))
    inner = found.points[len(V) :]
    np.testing.assert_array_equal(found.points[: len(V)], V)
    assert len(inner) and (np.linalg.norm((inner - [40, -30, 5]) / [7, 7, 10.5], axis=1) < 1).all()
    p = V[F]
    volumes = tet_volumes(found.points, found.tets)
    assert (volumes > 0).all()
    assert volumes.sum() == pytest.approx(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6, rel=1e-6)
