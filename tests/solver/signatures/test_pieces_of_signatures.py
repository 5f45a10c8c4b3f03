"""Pieces of signatures and of divisions one by one: membranes, agreements, refinements, windows, masses of parts."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omt_uv.solver.errors import EmptyMeshError, LandmarkError
from omt_uv.solver.partition import division, spacing
from omt_uv.solver.partition.polar_coordinates import WindowMesh, polar_coordinates
from omt_uv.solver.partition.sites import Sites
from omt_uv.solver.signatures import harmonics, membrane, wasserstein
from omt_uv.solver.signatures.signature import Signature, closed_part

# ---- membranes -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [4, 5, 12, 60, 200])
def test_rings_have_ever_fewer_points_towards_the_centre(count):
    outer = np.sort(np.random.default_rng(count).random(count - 1)) * 2 * np.pi
    radii, angles = membrane._rings(outer)
    assert angles[0].tolist() == [0, *outer] and radii[0] == 1 and radii[-1] == 0 and angles[-1].tolist() == [0]
    edge, radius, k = 2 * np.pi / count, 1.0, 0
    while True:
        k += 1
        # Triangles are equilateral, and grow by a quarter of their distance from the boundary.
        step = edge + 0.25 * (1 - radius)
        radius -= np.sqrt(3) / 2 * step
        if radius < step / 2:
            break
        assert radii[k] == pytest.approx(radius)
        sectors = max(int(np.ceil(2 * np.pi * radius / step)), 3)
        turn = 0.5 if k % 2 else 0.0
        assert angles[k] == pytest.approx(2 * np.pi * (np.arange(sectors) + turn) / sectors)
    assert len(radii) == len(angles) == k + 1


@pytest.mark.parametrize("count", [3, 4, 7, 40])
def test_membranes_are_flat_where_their_outline_is_and_lie_as_it_lies(count):
    rng = np.random.default_rng(count)
    angle = np.sort(rng.random(count)) * 2 * np.pi
    flat = np.column_stack([2 * np.cos(angle), np.sin(angle), 0 * angle])
    bent = flat + np.column_stack([0 * angle, 0 * angle, np.sin(3 * angle)])
    inner, faces = membrane._membrane(flat)
    assert np.abs(inner[:, 2]).max() < 1e-12 and set(np.unique(faces)) == set(range(count + len(inner)))
    turn, shift = Rotation.from_rotvec([0.3, -0.4, 1.1]).as_matrix(), np.array([3.0, -2, 5])
    own, faces = membrane._membrane(bent)
    moved, again = membrane._membrane(7 * bent @ turn.T + shift)
    np.testing.assert_allclose(moved, 7 * own @ turn.T + shift, atol=1e-9)
    np.testing.assert_array_equal(again, faces)
    # Nothing is beyond the outline.
    assert (own.min(axis=0) >= bent.min(axis=0) - 1e-9).all() and (own.max(axis=0) <= bent.max(axis=0) + 1e-9).all()
    if count == 3:
        length = [np.linalg.norm(bent[k] - bent[(k + 1) % 3]) for k in range(3)]
        middle = sum(length[k] * (bent[k] + bent[(k + 1) % 3]) / 2 for k in range(3)) / sum(length)
        assert own.tolist() == [pytest.approx(middle)] and faces.tolist() == [[0, 1, 3], [1, 2, 3], [2, 0, 3]]


@pytest.mark.parametrize("short", [0.0, 0.005, 0.02])
def test_edges_of_a_membrane_are_a_hundredth_of_the_mean_at_least(short, monkeypatch):
    outline = np.array([[0.0, 0, 0], [short, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    asked = []
    monkeypatch.setattr(
        membrane, "_rings", lambda outer: asked.append(outer) or ([1.0, 0.0], [np.arange(5.0), np.zeros(1)])
    )
    membrane._membrane(outline)
    length = np.array([short, 1 - short, 1, 1, 1])
    share = np.maximum(length, 0.01 * length.mean())
    assert asked[0] == pytest.approx(2 * np.pi * np.cumsum(share[:-1]) / share.sum())
    # All of no length are as long as each other.
    membrane._membrane(np.zeros((5, 3)))
    assert asked[1] == pytest.approx(2 * np.pi * np.arange(1, 5) / 5)


# ---- agreements ----------------------------------------------------------------------------------------------


def test_matrices_of_rotations_turn_functions():
    rng = np.random.default_rng(0)
    rotations = Rotation.random(3, random_state=1).as_matrix()
    at = harmonics.fibonacci_sphere(80)
    inverse = [np.linalg.pinv(part) for part in harmonics.harmonics(at)]
    points = rng.normal(size=(9, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    plain = harmonics.harmonics(points)
    for degree, matrices in enumerate(harmonics._matrices(rotations, at, inverse)):
        for rotation, matrix in zip(rotations, matrices, strict=True):
            turned = harmonics.harmonics(points @ rotation.T)[degree]
            np.testing.assert_allclose(turned, plain[degree] @ matrix.T, atol=1e-9)
            np.testing.assert_allclose(matrix @ matrix.T, np.eye(2 * degree + 1), atol=1e-9)


def test_agreements_are_refined_by_small_rotations():
    rng = np.random.default_rng(2)
    size = sum(2 * degree + 1 for degree in range(1, 9 + 1))
    source, target = rng.normal(size=(2, size, 2))
    grid, picked = harmonics.rotation_grid(), np.array([5, 100, 700])
    rotations, score = harmonics.refined_agreement(source, target, grid[picked], picked)
    at = harmonics.fibonacci_sphere(80)
    inverse = [np.linalg.pinv(part) for part in harmonics.harmonics(at)]

    def agreement(rotation):
        total = 0.0
        first = 0
        for matrix in harmonics._matrices(rotation[None], at, inverse)[1:]:
            rows = slice(first, first + len(matrix[0]))
            total += np.sum(target[rows] * (matrix[0] @ source[rows]))
            first = rows.stop
        return total

    for rotation, value, k in zip(rotations, score, picked, strict=True):
        assert agreement(rotation) == pytest.approx(value, rel=1e-3)
        assert value >= agreement(grid[k]) - 1e-3 and np.linalg.det(rotation) == pytest.approx(1)
    sizes = [2 * np.arccos((np.trace(r[1:].mean(axis=0)) - 1) / 2) for r, _ in harmonics.small_matrices()]
    assert (np.diff(sizes) < 0).all()


@pytest.mark.parametrize(("last", "least"), [(0.5, 0.5), (1.9, 1.9), (2.1, 2.0)])
def test_the_foremost_starts_are_refined_on_few_points_then_on_all_and_the_best_once_more(last, least, monkeypatch):
    """Starts are numbers, and costs those of the table; on all points the second becomes the first."""
    few = {0: 3.0, 1: 2.9, 2: 2.8, 3: 3.2, 4: 9.0, 5: 9.0}
    full = {102: 2.4, 101: 2.0, 100: 2.2}
    asked = []

    def refined(a, b, start, curvature, rounds):
        asked.append((a, b, start, rounds))
        if a == "few":
            return few[start], start, start + 100
        return (full[start] if rounds == 1 else last), start, start + 1000

    monkeypatch.setattr(wasserstein, "_refined", refined)
    monkeypatch.setattr(wasserstein, "starts", lambda *_: np.arange(9))
    a = SimpleNamespace(full=SimpleNamespace(on_disk=False), few="few")
    square, rotation = wasserstein._least(a, a, 0.1)
    assert square == least and rotation == (1101 if last < 2 else 101)
    assert [x[2] for x in asked] == [0, 1, 2, 3, 4, 5, 102, 101, 1101]
    assert [x[3] for x in asked] == [1] * 8 + [2]
    disk = SimpleNamespace(full=SimpleNamespace(on_disk=True), few="few")
    with pytest.raises(LandmarkError, match="One shape has markers and the other has none"):
        wasserstein._least(a, disk, 0.1)
    monkeypatch.setattr(wasserstein, "_least_on_disk", lambda *given: given)
    assert wasserstein._least(disk, disk, 0.1) == (disk.full, disk.full, 0.1)


@pytest.mark.parametrize(("means", "kept", "asked"), [([3, 2, 1], 1, 3), ([3, 2, 2.5], 2, 3), ([3, 3 - 5e-10, 1], 3, 2),
                                                      ([3, 3 - 2e-9, 1], 1, 3)])  # fmt: skip
@pytest.mark.parametrize("mirrored", [False, True])
def test_assignments_and_rotations_are_taken_in_turn_while_they_gain(means, kept, asked, mirrored, monkeypatch):
    costs, turned = iter(means), []
    points = np.eye(3)
    s = Signature(points, np.zeros(3))

    def pair_costs(one, other, curvature):
        turned.append(one.points)
        return next(costs) + 9.0 * (1 - np.eye(3))

    rotations = [np.diag([1, 1, -1 if mirrored else 1]) * (k + 1.0) for k in range(4)]
    monkeypatch.setattr(wasserstein, "pair_costs", pair_costs)
    given = []

    def rotation_of_pairs(a, b, is_mirrored):
        given.append(is_mirrored)
        return SimpleNamespace(rotation=rotations[len(given)])

    monkeypatch.setattr(wasserstein, "rotation_of_pairs", rotation_of_pairs)
    best, found, onward = wasserstein._refined(s, s, rotations[0], 0.1, 3)
    assert best == kept and len(turned) == asked and given == [mirrored] * len(given)
    assert np.array_equal(found, rotations[means.index(kept)])
    assert np.array_equal(onward, rotations[len(given)]) and len(given) == sum(
        1 for k in range(asked) if k == 0 or means[k] < min(means[:k]) - 1e-9
    )
    for k, places in enumerate(turned):
        np.testing.assert_array_equal(places, points @ rotations[k].T)


def test_disks_are_what_their_density_and_curvature_are_at_even_places():
    rng = np.random.default_rng(0)
    s = Signature(rng.uniform(-0.6, 0.6, (20, 2)), rng.normal(size=20))
    found = wasserstein._values_on_disk(s)
    assert found.shape == (99, 2)
    for k in (0, 1, 50, 98):
        ring, angle = np.sqrt((k + 0.5) / 99), np.pi * (1 + np.sqrt(5)) * (k + 0.5)
        place = ring * np.array([np.cos(angle), np.sin(angle)])
        kernel = np.exp(-((s.points - place) ** 2).sum(axis=1) / (2 * 0.2**2)) / (2 * 0.2**2 * 20)
        assert found[k] == pytest.approx([np.log(kernel.sum() + 0.05), kernel @ s.curvature])


# ---- divisions -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.3, 0.8, 5.0])
def test_windows_of_a_plane_have_the_triangles_with_a_corner_in_reach(radius):
    V, F = meshes.random_disk()
    V = V * [1, 1, 0]
    mesh = WindowMesh(V, F)
    sites = Sites(np.array([3, 40]), np.array([[0.2, 0.3, 0.5], [0.6, 0.2, 0.2]]))
    pairs = polar_coordinates(mesh, sites, np.array([radius, radius]), np.arange(2))
    places = sites.positions(V, F)
    assert (np.diff(pairs.face * 2 + pairs.site) > 0).all()
    for k, place in enumerate(places):
        mine = pairs.site == k
        far = np.linalg.norm(V - place, axis=1)
        inside = {t for t in range(len(F)) if (far[F[t]] <= radius).any()} | {int(sites.triangle[k])}
        found = set(pairs.face[mine].tolist())
        assert found <= inside and {t for t in inside if (far[F[t]] <= 0.9 * radius).any()} <= found
        for row in np.flatnonzero(mine):
            t = pairs.face[row]
            # Near its end a window may lack what the straight way leads over.
            assert (pairs.squared[row] >= far[F[t]] ** 2 - 1e-9).all()
            np.testing.assert_allclose(np.linalg.norm(pairs.log[row], axis=1) ** 2, pairs.squared[row], atol=1e-9)
            if far[F[t]].max() < 0.5 * radius:
                np.testing.assert_allclose(pairs.squared[row], far[F[t]] ** 2, atol=1e-9)
                turn = pairs.log[row] @ pairs.log[row].T
                np.testing.assert_allclose(turn, (V[F[t]] - place) @ (V[F[t]] - place).T, atol=1e-9)
            assert pairs.nearest[row] == pairs.squared[row].min() and pairs.farthest[row] == pairs.squared[row].max()
            around = {int(u) for v in F[t] for u in np.flatnonzero((v == F).any(axis=1))}
            assert pairs.last[row] == bool(around - found)


@pytest.mark.parametrize(("small", "sound"), [(1.01e-12, True), (0.99e-12, False)])
def test_parts_without_mass_are_counted_with_the_first_that_has_one(small, sound):
    part, mass = np.array([2, 0, 1, 1, 3]), np.array([0.5, small, 0.25, 0.25, 0.0])
    found = division._with_mass(part, mass)
    assert found.tolist() == ([2, 0, 1, 1, 0] if sound else [1, 0, 0, 0, 0])


def test_what_is_divided_has_mass():
    V, F = meshes.grid(3, 3)
    problem, counts = division._problem(V, F, 4, np.full(len(F), 2.0))
    whole, _ = division._problem(V, F, 4, None)
    assert problem.mass == pytest.approx(2 * whole.mass) and counts.tolist() == [4]
    assert problem.asked == pytest.approx(np.full(4, problem.mass.sum() / 4))
    with pytest.raises(EmptyMeshError, match="The faces have no area to divide"):
        division._problem(0 * V, F, 4, None)


@pytest.mark.parametrize("even", [True, False])
def test_first_windows_are_those_of_round_cells_of_the_density_there(even, monkeypatch):
    V, F = meshes.grid(6, 6)
    mesh = WindowMesh(V, F)
    density = np.linspace(0.5, 2, len(F))
    density[7] = 1e-9
    mass = mesh.areas * density
    sites = Sites(np.array([0, 7, 20]), np.full((3, 3), 1 / 3))
    asked, calls = np.array([0.2, 0.3, 0.4]) * mass.sum(), []
    monkeypatch.setattr(
        division, "polar_coordinates", lambda mesh, sites, radius, chosen: calls.append(radius) or "pairs"
    )
    monkeypatch.setattr(
        division, "spaced", lambda mesh, sites, pairs, size, radius: calls.append(size) or ("sites", "far")
    )
    monkeypatch.setattr(division, "GeodesicDual", lambda *given: given)
    problem = division.DivisionProblem(mesh, mass, np.zeros(len(F), int), asked)
    found = division._dual(problem, sites, even)
    usual = mass.sum() / mesh.areas.sum()
    size = [np.sqrt(a / max(density[t], 1e-3 * usual) / np.pi) for a, t in zip(asked, sites.triangle, strict=True)]
    side = [np.linalg.norm(V[np.roll(F[t], -1)] - V[F[t]], axis=1).max() for t in sites.triangle]
    assert calls[0] == pytest.approx(np.maximum(2.2 * np.array(size), side))
    assert found[1:3] == (("sites", "far") if even else (sites, "pairs")) and (len(calls) == 2) == even
    assert not even or calls[1] == pytest.approx(size)


def test_sites_of_a_plane_are_as_far_apart_as_the_nearest(monkeypatch):
    V, F = meshes.random_disk()
    V = V * [1, 1, 0]
    mesh, k = WindowMesh(V, F), 9
    chosen = np.random.default_rng(0).choice(len(F), k, replace=False)
    sites = Sites(chosen, np.full((k, 3), 1 / 3))
    whole = SimpleNamespace(sites=sites, asked=np.ones(k))
    area = mesh.areas.sum() / k
    whole.pairs = SimpleNamespace(site=np.arange(k), face=chosen)
    monkeypatch.setattr(spacing, "_areas", lambda mesh, division: np.full(k, 4 * area))
    whole.cells = SimpleNamespace(pair=np.arange(k))
    places = sites.positions(V, F)
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 99 * np.eye(k)
    np.testing.assert_allclose(spacing.site_distances(mesh, whole), apart.min(axis=1), atol=1e-9)
    # Nobody sees anybody in windows that are too small.
    monkeypatch.setattr(spacing, "_areas", lambda mesh, division: np.full(k, 1e-9 * area))
    assert np.isinf(spacing.site_distances(mesh, whole)).sum() >= k - 2


@pytest.mark.parametrize("scale", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("swapped", [False, True])
def test_the_part_that_is_compared_is_that_of_most_area_not_of_most_faces(scale, swapped):
    many, few = meshes.icosphere(2), meshes.icosphere(0)
    parts = [many, (scale * few[0] + 9, few[1])]
    (V, F), (W, G) = parts[::-1] if swapped else parts
    vertices, faces = closed_part(np.concatenate([V, W]), np.concatenate([F, G + len(V)]))
    assert len(faces) == (len(few[1]) if scale > 1 else len(many[1])) and len(vertices) == len(faces) // 2 + 2
