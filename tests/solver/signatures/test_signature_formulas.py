"""Signatures against plain ways: votes counted, costs of pairs one by one, agreements by sampled functions, halves."""

from __future__ import annotations

from collections import Counter

import meshes
import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from sphere_shapes import blob, random_rotation

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import fibonacci_sphere
from omt_uv.solver.registration.alignment import rotation_grid
from omt_uv.solver.signatures import harmonics, marked, membrane, signature, surroundings, wasserstein
from omt_uv.solver.signatures.embedding import classes_of_nearest, classical_scaling
from omt_uv.solver.signatures.signature import CURVATURE, Signature


def some(count=60, seed=0, floor=0.0):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) + [0.5, 0, 0]
    return Signature(points / np.linalg.norm(points, axis=1, keepdims=True), rng.uniform(-1, 1, count), floor)


def on_disk(count=30, seed=0):
    rng = np.random.default_rng(seed)
    return Signature(0.7 * rng.uniform(-1, 1, (count, 2)), rng.uniform(-1, 1, count))


# ---- distances ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_places_have_the_distances_of_what_they_come_from(dimensions):
    places = np.random.default_rng(0).normal(size=(9, dimensions)) * [3, 2, 1][:dimensions]
    away = np.linalg.norm(places[:, None] - places, axis=2)
    found = classical_scaling(away, dimensions)
    np.testing.assert_allclose(np.linalg.norm(found[:, None] - found, axis=2), away, atol=1e-9)
    assert (found[np.abs(found).argmax(axis=0), np.arange(dimensions)] > 0).all()
    np.testing.assert_allclose(found.mean(axis=0), 0, atol=1e-12)
    assert (np.diff((found**2).sum(axis=0)) <= 0).all()
    # In fewer dimensions what is left out is the least.
    if dimensions == 3:
        np.testing.assert_allclose(classical_scaling(away), found[:, :2], atol=1e-9)


@pytest.mark.parametrize("count", [1, 3, 5])
def test_the_nearest_vote(count):
    rng = np.random.default_rng(count)
    away = rng.random((12, 12))
    away[rng.random((12, 12)) < 0.3] = np.nan
    classes = [str(k) for k in rng.integers(0, 3, 12)]
    found = classes_of_nearest(away, classes, count)
    for k, told in enumerate(found):
        order = sorted((away[k, j], j) for j in range(12) if j != k and np.isfinite(away[k, j]))[:count]
        votes = Counter(classes[j] for _, j in order)
        most = [name for name, votes_of in votes.items() if votes_of == max(votes.values())]
        # Of several the one of the nearest.
        if order:
            assert told == next(classes[j] for _, j in order if classes[j] in most)


@pytest.mark.parametrize("curvature", [0.0, CURVATURE, 2.0])
def test_costs_are_squared_angles_and_differences_of_curvature(curvature):
    a, b = some(12), some(9, 1)
    cost = signature.pair_costs(a, b, curvature)
    for i, j in np.ndindex(12, 9):
        angle = np.arccos(np.clip(a.points[i] @ b.points[j], -1, 1))
        expected = angle**2 + curvature * (a.curvature[i] - b.curvature[j]) ** 2
        assert cost[i, j] == pytest.approx(expected, rel=1e-5, abs=1e-9)
    a, b = on_disk(12), on_disk(9, 1)
    cost = signature.pair_costs(a, b, curvature)
    for i, j in np.ndindex(12, 9):
        square = ((a.points[i] - b.points[j]) ** 2).sum() + curvature * (a.curvature[i] - b.curvature[j]) ** 2
        assert cost[i, j] == pytest.approx(square)


def test_disks_are_compared_as_they_lie_or_mirrored():
    a, b = on_disk(), on_disk(30, 1)

    def least(x):
        cost = signature.pair_costs(x, b)
        return cost[linear_sum_assignment(cost)].mean()

    mirrored = Signature(a.points * [1, -1], a.curvature)
    square, matrix = wasserstein._least_on_disk(a, b, CURVATURE)
    assert square == pytest.approx(min(least(a), least(mirrored)))
    square, matrix = wasserstein._least_on_disk(mirrored, a, CURVATURE)
    assert square == pytest.approx(0, abs=1e-12) and np.diag(matrix).tolist() == [1, -1, 1]


def test_what_is_told_has_the_floor_taken_off():
    a, b = (wasserstein.Prepared(some(5, floor=f), some(5), np.zeros((1, 2))) for f in (0.3, 0.1))
    floor = np.sqrt((0.3**2 + 0.1**2) / 2)
    found = wasserstein._told(a, b, 0.25, np.eye(3))
    assert found.raw == pytest.approx(0.5) and found.floor == pytest.approx(floor)
    assert found.distance == pytest.approx(np.sqrt(0.25 - floor**2))
    assert wasserstein._told(a, b, 0.01, np.eye(3)).distance == 0


def test_the_foremost_cost_hardly_more_than_the_best():
    tried = [(2.0, "d"), (1.05, "b"), (1.0, "a"), (1.08, "c")]
    assert wasserstein._foremost(tried) == [(1.0, "a"), (1.05, "b")]
    assert wasserstein._foremost([(1.2, "b"), (1.0, "a")]) == [(1.0, "a")]


def test_rotations_apart_are_the_best_of_their_surroundings():
    rotations = np.array([random_rotation(k) for k in range(40)])
    score = np.random.default_rng(0).random(40)
    found = wasserstein._apart(rotations, score, 40)
    chosen = []
    for k in np.argsort(-score):
        angles = [np.arccos(np.clip((np.trace(rotations[k] @ rotations[j].T) - 1) / 2, -1, 1)) for j in chosen]
        if all(angle >= 0.35 for angle in angles):
            chosen.append(k)
    assert found.tolist() == chosen
    near = np.array([np.eye(3), random_rotation(0), np.eye(3)])
    assert wasserstein._apart(near, np.array([1.0, 3, 2]), 3).tolist() == [1, 2]
    assert wasserstein._apart(rotations, score, 2).tolist() == chosen[:2]


def test_few_points_are_means_of_those_nearest_to_a_coarser_lattice():
    count = 500
    s = Signature(fibonacci_sphere(count), np.linspace(-1, 1, count), 0.2)
    few = wasserstein._fewer(s)
    coarse = fibonacci_sphere(200)
    owner = (s.points @ coarse.T).argmax(axis=1)
    for k in range(0, 200, 13):
        mean = s.points[owner == k].mean(axis=0)
        np.testing.assert_allclose(few.points[k], mean / np.linalg.norm(mean), atol=1e-9)
        assert few.curvature[k] == pytest.approx(s.curvature[owner == k].mean())
    assert few.floor == 0.2 and wasserstein._fewer(some(20)).points.shape == (20, 3)


# ---- harmonics ----------------------------------------------------------------------------------------------


def test_harmonics_of_low_degree_by_their_formulas():
    p = fibonacci_sphere(50)
    x, y, z = p.T
    found = harmonics.harmonics(p, 2)
    np.testing.assert_allclose(found[0][:, 0], np.sqrt(1 / (4 * np.pi)))
    np.testing.assert_allclose(found[1], np.sqrt(3 / (4 * np.pi)) * np.column_stack([y, z, x]), atol=1e-12)
    part = np.column_stack([x * y, y * z, (3 * z**2 - 1) / np.sqrt(12), x * z, (x**2 - y**2) / 2])
    np.testing.assert_allclose(found[2], np.sqrt(15 / (4 * np.pi)) * part, atol=1e-12)


def values_at(coefficients, points):
    """Functions of coefficients (s,c) of all degrees from 1."""
    return np.concatenate(harmonics.harmonics(points)[1:], axis=1) @ coefficients


def test_agreements_are_inner_products_of_the_turned_functions():
    rng = np.random.default_rng(0)
    size = sum(2 * d + 1 for d in range(1, 9 + 1))
    source, targets = rng.normal(size=(size, 2)), rng.normal(size=(3, size, 2))
    found = wasserstein._agreements(source, targets)
    at, grid = fibonacci_sphere(3000), rotation_grid()
    for r in (0, 77, 1234):
        for k, sign in enumerate((1, -1)):
            # What lies at x comes to lie at R x, and at -R x after an inversion.
            turned = values_at(source, sign * at @ grid[r])
            for t, target in enumerate(targets):
                expected = (turned * values_at(target, at)).sum(axis=1).mean() * 4 * np.pi
                assert found[k, t, r] == pytest.approx(expected, abs=0.02 * np.abs(found).max())


def test_small_rotations_do_to_harmonics_what_their_matrices_say():
    at = fibonacci_sphere(40)
    levels = harmonics.small_matrices()
    assert len(levels) == 5
    for level, (rotations, blocks) in enumerate(levels):
        np.testing.assert_array_equal(rotations[0], np.eye(3))
        angle = np.arccos(np.clip((np.trace(rotations, axis1=1, axis2=2) - 1) / 2, -1, 1))
        assert angle.max() <= 0.2 * 0.5**level * (1 + 1e-9) and angle[1:].min() > 0
        before, after = harmonics.harmonics(at)[1:], harmonics.harmonics(at @ rotations[5].T)[1:]
        for D, y, turned in zip(blocks, before, after, strict=True):
            np.testing.assert_allclose(y @ D[5].T, turned, atol=1e-8)


def test_spectra_are_the_powers_of_degrees():
    size = sum(2 * d + 1 for d in range(1, 9 + 1))
    coefficients = np.random.default_rng(0).normal(size=(size, 2))
    found = wasserstein.spectrum(coefficients).reshape(9, 2)
    degree = wasserstein._degrees()
    for d in range(1, 9 + 1):
        assert (degree == d).sum() == 2 * d + 1
        np.testing.assert_allclose(found[d - 1], np.linalg.norm(coefficients[degree == d], axis=0))
    at = 0
    for part in harmonics.by_degree(coefficients):
        np.testing.assert_array_equal(part, coefficients[at : at + len(part)])
        at += len(part)
    assert at == size


def test_coefficients_are_those_of_smoothed_densities():
    """By the integrals of the harmonics with a density of bumps, over another lattice; turned with the points."""
    s = some(200)
    found = wasserstein._coefficients(s)
    at = fibonacci_sphere(4000)
    kernel = np.exp((at @ s.points.T - 1) / 0.25**2) * 2 / (0.25**2 * len(s.points))
    values = np.stack([np.log(kernel.sum(axis=1) + 0.05), kernel @ s.curvature], axis=1)
    expected = np.concatenate(harmonics.harmonics(at)[1:], axis=1).T @ values * 4 * np.pi / len(at)
    low = wasserstein._degrees() <= 4
    np.testing.assert_allclose(found[low], expected[low], atol=0.03 * np.abs(expected).max())


# ---- markers, membranes, surroundings -----------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 3, 7, 16])
def test_halves_of_halves_have_the_same_weight_and_share_what_lies_between(count):
    rng = np.random.default_rng(count)
    at, weights = rng.random((90, 2)) * [2, 1], rng.uniform(0.5, 2, 90)
    groups = marked._halved(at, np.arange(90), weights, count)
    assert len(groups) == count
    whole = np.zeros(90)
    for rows, share in groups:
        assert share.sum() == pytest.approx(weights.sum() / count) and (share > -1e-12).all()
        np.add.at(whole, rows, share)
    np.testing.assert_allclose(whole, weights)
    values = np.column_stack([at, rng.normal(size=90)])
    found = marked._quantised(values, weights, count)
    for k, (rows, share) in enumerate(groups):
        np.testing.assert_allclose(found.points[k], share @ at[rows] / share.sum())
        assert found.curvature[k] == pytest.approx(share @ values[rows, 2] / share.sum())
    if count == 2:
        # Halved across the longer side.
        (one, _), (other, _) = groups
        assert at[one, 0].max() <= at[other, 0].min() + 1e-12


def test_pieces_of_triangles_lie_in_them_by_their_areas():
    V, F = meshes.bumpy(4, 3)
    area = face_areas(V, F)
    places, weights = marked._pieces(V, F, area, 300)
    assert 300 <= len(places) <= 300 + 4 * len(F) * 4 and weights.sum() == pytest.approx(1)
    per = len(places) // len(F)
    np.testing.assert_allclose(places.reshape(len(F), per, 3).mean(axis=1), V[F].mean(axis=1), atol=1e-12)
    np.testing.assert_allclose(weights.reshape(len(F), per).sum(axis=1), area / area.sum())
    assert len(marked._pieces(V, F, area, 10**9)[0]) == len(F) * 8**2


@pytest.mark.parametrize("outer, inner", [(5, 3), (9, 4), (8, 8), (4, 7), (6, 1)])
def test_strips_between_rings_cover_them_once(outer, inner):
    rng = np.random.default_rng(outer)
    rings = [np.sort(rng.uniform(0, 2 * np.pi, k)) for k in (outer, inner)]
    if inner == 1:
        rings[1] = np.zeros(1)
    # Evenly enough that chords do not cut through the inner ring.
    rings = [np.sort((2 * np.pi * (np.arange(len(r)) + 0.3 * np.sin(r)) / len(r)) % (2 * np.pi)) for r in rings]
    faces = membrane._strip(*rings)
    radius = [1.0, 0.0 if inner == 1 else 0.4]
    at = np.concatenate([r * np.exp(1j * a) for r, a in zip(radius, rings, strict=True)])
    z = at[faces]
    area = ((z[:, 1] - z[:, 0]).conj() * (z[:, 2] - z[:, 0])).imag / 2
    polygons = [(np.conj(r * np.exp(1j * a)) * np.roll(r * np.exp(1j * a), -1)).imag.sum() / 2
                for r, a in zip(radius, rings, strict=True)]  # fmt: skip
    assert len(faces) == outer + (inner if inner > 1 else 0)
    assert (area > -1e-9).all() and area.sum() == pytest.approx(polygons[0] - polygons[1])


def clipped_area(corners, values):
    """Area of a triangle where linear values at its corners are negative, by clipping (Sutherland, Hodgman)."""
    kept = []
    for k in range(3):
        a, b, u, v = corners[k], corners[(k + 1) % 3], values[k], values[(k + 1) % 3]
        if u <= 0:
            kept.append(a)
        if (u < 0 < v) or (v < 0 < u):
            kept.append(a + u / (u - v) * (b - a))
    total = np.zeros(3)
    for k in range(1, len(kept) - 1):
        total += np.cross(kept[k] - kept[0], kept[k + 1] - kept[0])
    return np.linalg.norm(total) / 2


@pytest.mark.parametrize("seed", range(3))
def test_what_is_below_is_clipped_triangle_by_triangle(seed):
    V, F = blob(2, seed=seed)
    value = V @ np.random.default_rng(seed).normal(size=3)
    # Some vertices lie on the level itself.
    value[np.abs(value) < 0.05] = 0
    P, T, old = surroundings._below(V, F, value)
    expected = sum(clipped_area(V[f], value[f]) for f in F if (value[f] < 0).any())
    assert face_areas(P, T).sum() == pytest.approx(expected)
    np.testing.assert_array_equal(P[old >= 0], V[old[old >= 0]])
    assert set(old[old >= 0]) >= set(np.flatnonzero(value < 0)) and (value[old[old >= 0]] <= 0).all()
    before = np.einsum("md,md->m", P[T[:, 0]], np.cross(P[T[:, 1]], P[T[:, 2]]))
    assert (before[face_areas(P, T) > 1e-9] > 0).all()


def test_distances_in_the_plane_are_straight():
    V, F = meshes.grid(12, 12)
    V = np.column_stack([V[:, :2], np.zeros(len(V))])
    centre, start = 84, 86
    found = surroundings._distances(V, F, centre, start)
    near = np.isfinite(found)
    straight = np.linalg.norm(V - V[centre], axis=1)
    # Paths go along triangles that are developed one by one, with what rounding off windows leaves.
    np.testing.assert_allclose(found[near], straight[near], atol=0.01)
    assert near[straight <= straight[start]].all()


@pytest.mark.parametrize("marked_ones", [False, True])
def test_shapes_that_are_turned_are_looked_for_by_spectra_and_marked_ones_as_they_lie(monkeypatch, marked_ones):
    asked = []
    agreeing = wasserstein._agreeing
    monkeypatch.setattr(wasserstein, "_agreeing", lambda *given: asked.append(given) or agreeing(*given))
    library = [(on_disk if marked_ones else some)(seed=seed) for seed in range(3)]
    for k in (0, 2):
        found = wasserstein.nearest(library[k], library, 2)
        assert found[0][0] == k and len(found) == 2 and found[0][1].raw < 1e-6 < found[1][1].raw
    assert len(asked) == (0 if marked_ones else 2)
