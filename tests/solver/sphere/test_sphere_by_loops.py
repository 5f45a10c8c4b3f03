"""Pieces of maps to the sphere, against loops over faces, places and formulas at single points."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from sphere_shapes import random_rotation

from omt_uv.solver.errors import FoldedUVError, PrecisionError, TransportError
from omt_uv.solver.mesh.spherical_geometry import normalized, signed_volumes, triple_products
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere import (
    conformal,
    dominitz_tannenbaum,
    moser_flow,
    multilevel,
    newton,
    sphere_map,
    stream_functions,
    symmetry,
)


@pytest.mark.parametrize("seed", range(3))
def test_medians_have_half_of_the_weight_below(seed):
    rng = np.random.default_rng(seed)
    value, weight = rng.normal(size=15), rng.random(15)
    total = 0.0
    for x, w in sorted(zip(value, weight, strict=True)):
        total += w
        if total >= weight.sum() / 2:
            assert conformal._median(value, weight) == x
            break


def test_steps_of_runge_and_kutta_are_of_fourth_order():
    axis = np.array([0.0, 0.6, 0.8])

    def velocity(p):
        return np.cross(axis, p)

    points = normalized(np.random.default_rng(0).normal(size=(20, 3)))
    errors = []
    for time in (0.2, 0.1):
        slopes = stream_functions.runge_kutta_slopes(velocity, points, time)
        k1 = velocity(points)
        k2 = velocity(normalized(points + time / 2 * k1))
        k3 = velocity(normalized(points + time / 2 * k2))
        np.testing.assert_allclose(slopes, k1 + 2 * k2 + 2 * k3 + velocity(normalized(points + time * k3)))
        c, s = np.cos(time), np.sin(time)
        exact = points * c + np.cross(axis, points) * s + (points @ axis)[:, None] * axis * (1 - c)
        errors.append(np.abs(normalized(points + time / 6 * slopes) - exact).max())
    assert errors[1] < errors[0] / 4 and errors[0] < 0.01


def test_slopes_of_bumps_are_their_derivatives():
    rng = np.random.default_rng(0)
    y = normalized(rng.normal(size=(30, 3)))
    x = normalized(y + 0.4 * rng.normal(size=(30, 3)))
    radius, h = 1.3, 1e-6

    def bump(square):
        r = np.sqrt(square) / radius
        return np.maximum(1 - r, 0) ** 4 * (4 * r + 1)

    square = ((x - y) ** 2).sum(axis=1)
    # |x - y|^2 = 2 - 2 <x, y>.
    expected = (bump(square - 2 * h) - bump(square + 2 * h)) / (2 * h)
    np.testing.assert_allclose(stream_functions._slope(x, y, radius), expected, rtol=1e-4, atol=1e-6)


def test_costs_are_means_of_half_squared_distances():
    rng = np.random.default_rng(0)
    p, q, weight = normalized(rng.normal(size=(9, 3))), normalized(rng.normal(size=(9, 3))), rng.random(9)
    expected = (weight * ((p - q) ** 2).sum(axis=1) / 2).sum() / weight.sum()
    assert dominitz_tannenbaum.transport_cost(p, q, weight) == pytest.approx(expected)


@pytest.mark.parametrize(
    "cheaper, folds, halvings",
    [
        ([True], [0], 0),
        ([False, True], [0, 0], 1),
        ([True, True], [1, 0], 1),
        ([False] * 6, [0] * 6, None),
    ],
)
def test_the_longest_time_is_taken_that_lowers_the_cost_and_folds_no_more(cheaper, folds, halvings, monkeypatch):
    V, F = meshes.icosphere(1)
    V = normalized(V)
    times = []

    def advect(points, basis, pairs, amount):
        times.append(float(amount[0]))
        moved = points.copy()
        if folds[len(times) - 1]:
            moved[0] = -moved[0]
        return moved

    costs = iter([1.0, *(0.5 if x else 1.5 for x in cheaper)])
    monkeypatch.setattr(dominitz_tannenbaum, "advect", advect)
    monkeypatch.setattr(dominitz_tannenbaum, "velocity", lambda *_: np.full((len(V), 3), 2.0))
    monkeypatch.setattr(dominitz_tannenbaum, "longest_motion", lambda basis: 1.0)
    monkeypatch.setattr(dominitz_tannenbaum, "transport_cost", lambda *_: next(costs))
    found = dominitz_tannenbaum._line_search(V, V, F, np.ones(len(V)), None, None, np.ones(1))
    first = 0.9 / np.sqrt(12)
    np.testing.assert_allclose(times, first / 2.0 ** np.arange(len(times)))
    assert (found is V) == (halvings is None) and len(times) == (6 if halvings is None else halvings + 1)


def test_points_on_a_side_enter_the_next_face_with_their_weights():
    V, F = meshes.icosphere(0)
    twin, rng = twins(F), np.random.default_rng(0)
    tail, head = halfedges(F)
    face, weights = rng.integers(0, len(F), 12), rng.random((12, 3))
    k = rng.integers(0, 3, 12)
    weights[np.arange(12), k] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    before = np.einsum("pk,pkd->pd", weights, V[F[face]])
    h = 3 * face + (k + 1) % 3
    old = face.copy()
    points = np.arange(12)[::-1]
    moser_flow._enter_next_face(F, twin, face, weights, points, k[points])
    np.testing.assert_allclose(np.einsum("pk,pkd->pd", weights, V[F[face]]), before, atol=1e-12)
    assert (face != old).all()
    for p in range(12):
        assert {tail[h[p]], head[h[p]]} <= set(F[face[p]].tolist())


def star(n=7):
    """A vertex that comes back amid a ring of others on the sphere, its parent among them."""
    turn = 2 * np.pi * np.arange(n) / n
    ring = normalized(np.column_stack([0.3 * np.cos(turn), 0.25 * np.sin(turn), np.ones(n)]))
    faces = np.array([[n, k, (k + 1) % n] for k in range(n)])
    return ring, faces


def test_vertices_come_back_where_the_smallest_face_around_is_largest():
    ring, faces = star()
    positions = np.concatenate([ring, np.zeros((1, 3))])
    step = SimpleNamespace(
        removed=np.array([7]), parent=np.array([0]), owner=np.zeros(7, int), star=faces, mass=np.ones(7)
    )
    (found,) = multilevel._best_places(step, positions)
    assert np.linalg.norm(found) == pytest.approx(1)
    a, b = ring[faces[:, 1]], ring[faces[:, 2]]

    def least(p):
        return min(triple_products(np.tile(p, (7, 1)), a, b))

    assert least(found) > 0
    tried = []
    for target in (
        a.sum(axis=0),
        np.cross(a[[0, 6]], b[[0, 6]] - a[[0, 6]])
        / np.linalg.norm(np.cross(a[[0, 6]], b[[0, 6]] - a[[0, 6]]), axis=1)[:, None],
    ):
        target = target if target.ndim == 1 else target.sum(axis=0)
        way = target - (target @ ring[0]) * ring[0]
        way /= np.linalg.norm(way)
        width = np.linalg.norm(ring - ring[0], axis=1).max()
        tried += [ring[0] + share * width * way for share in multilevel.TRIED_DISTANCES]
    assert least(found) == pytest.approx(max(least(p / np.linalg.norm(p)) for p in tried))
    level = SimpleNamespace(vertices=positions, kept=np.arange(7), rounds=[step], triangles=faces)
    back = multilevel._reinserted(level, ring)
    np.testing.assert_allclose(back[:7], ring)
    np.testing.assert_allclose(back[7], found)
    with pytest.raises(PrecisionError, match="Faces are too small for double precision on"):
        multilevel._reinserted(SimpleNamespace(**{**vars(level), "triangles": faces[:, ::-1]}), ring)


def test_tangents_are_the_nearest_directions():
    rng = np.random.default_rng(0)
    at, vectors = normalized(rng.normal(size=(9, 3))), rng.normal(size=(9, 3))
    found = multilevel._tangent(vectors, at)
    np.testing.assert_allclose((found * at).sum(axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)
    assert ((found * vectors).sum(axis=1) > 0).all()


def test_corners_are_seen_from_the_middle_of_their_triangle():
    p = normalized(np.random.default_rng(0).normal(size=(8, 3, 3)) + [3, 0, 0])
    axes, corners, up, size = newton._projected(p)
    for t in range(8):
        total = p[t].sum(axis=0)
        assert size[t, 0] == pytest.approx(np.linalg.norm(total))
        np.testing.assert_allclose(up[t], total / size[t, 0])
        np.testing.assert_allclose(axes[t] @ axes[t].T, np.eye(2), atol=1e-12)
        np.testing.assert_allclose(axes[t] @ up[t], 0, atol=1e-12)
        np.testing.assert_allclose(
            np.cross(axes[t, 0], axes[t, 1]), -up[t] if np.cross(axes[t, 0], axes[t, 1]) @ up[t] < 0 else up[t]
        )
        np.testing.assert_allclose(
            corners[t], [(q - p[t, 0]) @ axes[t, 0] + 1j * ((q - p[t, 0]) @ axes[t, 1]) for q in p[t]]
        )
        assert corners[t, 1].imag == pytest.approx(0, abs=1e-12) and corners[t, 1].real > 0


@pytest.mark.parametrize("seed", range(2))
def test_planes_of_images_are_found_and_others_at_right_angles(seed):
    rng = np.random.default_rng(seed)
    turn = random_rotation(seed)
    half = normalized(rng.normal(size=(20, 3)))
    p = np.concatenate([half, half * [-1, 1, 1]]) @ turn.T
    image = np.roll(np.arange(40), 20)
    normal = symmetry._plane(p, image)
    np.testing.assert_allclose(np.abs(normal @ turn[:, 0]), 1)
    np.testing.assert_allclose(p @ symmetry._reflection(normal), p[image], atol=1e-9)
    across = normalized((turn[:, 0] + 0.1 * turn[:, 1])[None])[0]
    other = symmetry._plane(p, image, across)
    assert other @ across == pytest.approx(0, abs=1e-9) and np.linalg.norm(other) == pytest.approx(1)


@pytest.mark.parametrize(
    "found, method, flows",
    [
        ("it", "newton", False),
        ("it", "flow", True),
        ("it", "moser", True),
        (None, "flow", False),
    ],
)
def test_only_the_flows_flow_and_only_from_a_conformal_map(found, method, flows, monkeypatch):
    def flow_map(*_):
        return "flow"
        yield

    monkeypatch.setattr(sphere_map, "flow_map", flow_map)
    given = None if found is None else SimpleNamespace(positions=None)
    assert drain(sphere_map._flow(given, SimpleNamespace(triangles=None), None, method)) == ("flow" if flows else None)
    sphere_map._check_method(method)
    with pytest.raises(ValueError, match="newton, flow, moser, not 'other'"):
        sphere_map._check_method("other")


def test_moser_s_flow_comes_out_as_it_is():
    found = SimpleNamespace(positions="conformal", sites="sites")
    new = sphere_map._unrefined(SimpleNamespace(moser="moser", positions="other"), found, ["said"])
    assert (new.positions, new.conformal, new.sites, new.status) == ("moser", "conformal", "sites", "moser")
    assert new.warnings == ("said",) and new.iterations == 0 and new.residual == 0.0 and new.flow.moser == "moser"


@pytest.mark.parametrize("fails", [None, TransportError, FoldedUVError])
def test_a_start_that_fails_is_said_and_left(fails, monkeypatch):
    def start():
        if fails is TransportError:
            raise fails("No transport")
        return "start"
        yield

    def refined(surface, positions, target, options):
        assert positions == "start"
        if fails is FoldedUVError:
            raise fails("Folds")
        return "refined"
        yield

    monkeypatch.setattr(sphere_map, "_refined", refined)
    warnings = []
    found = drain(sphere_map._refined_start(None, start(), None, warnings, {}))
    assert found == (None if fails else "refined") and len(warnings) == bool(fails)
    assert not fails or warnings[0].endswith("; the map was built from coarse to fine instead")


def test_targets_are_areas_times_densities():
    V, F = meshes.icosphere(0)
    surface = SimpleNamespace(vertices=V, triangles=F)
    area = sphere_map._target(surface, None)
    density = np.linspace(1, 2, len(F))
    np.testing.assert_allclose(sphere_map._target(surface, density), area * density)
    assert signed_volumes(normalized(V), F).min() > 0
    with pytest.raises(Exception, match="ensity"):
        sphere_map._target(surface, -density)
