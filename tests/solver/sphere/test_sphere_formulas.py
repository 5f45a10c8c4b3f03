"""Maps to the sphere against plain ways: collapses by hand, dense Newton steps, flows by differences, small steps."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sphere_shapes import blob, random_sphere

from omt_uv.solver.maps.energy import derivatives_of, elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import normalized, spherical_areas
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.hessian_blocks import Assembly
from omt_uv.solver.refinement.projected_newton import SHIFT
from omt_uv.solver.sphere import coarsen, moser_flow, multilevel, newton, refine, stream_functions
from omt_uv.solver.sphere import sphere_map as sphere_maps


def neighbours(F, v):
    return set(F[(v == F).any(axis=1)].ravel().tolist()) - {v}


# ---- collapses ----------------------------------------------------------------------------------------------


def test_shapes_are_areas_over_squared_sides():
    p = np.random.default_rng(0).normal(size=(3, 20, 3))
    for (a, b, c), found in zip(p.transpose(1, 0, 2), coarsen._shape(*p), strict=True):
        sides = ((b - a) @ (b - a)) + ((c - b) @ (c - b)) + ((a - c) @ (a - c))
        assert found == pytest.approx(4 * np.sqrt(3) * np.linalg.norm(np.cross(b - a, c - a)) / 2 / sides)
    even = np.array([[[0, 0, 0]], [[1, 0, 0]], [[0.5, np.sqrt(0.75), 0]]])
    assert coarsen._shape(*even) == pytest.approx(1)
    assert coarsen._shape(*np.zeros((3, 1, 3))) == 0


def test_the_worst_shape_is_that_of_the_fan_around_the_parent():
    V, F = blob(1)
    parent = np.array([min(neighbours(F, v)) if v % 3 else -1 for v in range(len(V))])
    found = coarsen._worst_shape(V, F, parent)
    for v, p in enumerate(parent):
        fan = [np.where(f == v, p, f) for f in F if v in f and p not in f] if p >= 0 else []
        shapes = [coarsen._shape(*(V[g[k]][None] for k in range(3)))[0] for g in fan]
        assert found[v] == pytest.approx(max(min(shapes, default=1.0), 1e-4))


def test_values_spread_to_neighbours_as_their_least():
    _, F = meshes.icosphere(1)
    value = np.random.default_rng(0).permutation(F.max() + 1)
    tail, head = F.ravel(), np.roll(F, -1, axis=1).ravel()
    found = coarsen._least_around(value, tail, head)
    assert found.tolist() == [min(value[[v, *neighbours(F, v)]]) for v in range(len(value))]


@pytest.mark.parametrize("seed", range(3))
def test_vertices_go_where_a_sphere_stays_one_and_where_it_costs_least(seed):
    """Just two common neighbours, disjoint surroundings, and of the neighbours that will do the cheapest."""
    V, F = blob(2, seed=seed)
    removed, parent = coarsen._choose(V, F, np.random.default_rng(seed))
    assert len(removed) > 5
    closed = [neighbours(F, v) | {v} for v in removed]
    for k, one in enumerate(closed):
        assert not any(one & other for other in closed[:k])
    degree = np.array([len(neighbours(F, v)) for v in range(len(V))])

    def price(v, w):
        return np.linalg.norm(V[v] - V[w]) * (1 + max(degree[v] + degree[w] - 4 - 9, 0))

    for v, p in zip(removed, parent, strict=True):
        good = [w for w in neighbours(F, v) if len(neighbours(F, v) & neighbours(F, w)) == 2]
        assert p in good and price(v, p) == pytest.approx(min(price(v, w) for w in good))


def test_a_collapse_hands_the_mass_on_by_half_to_areas_and_by_half_evenly():
    V, F = blob(2)
    mass = np.random.default_rng(0).uniform(0.5, 2, len(F))
    removed, parent = coarsen._choose(V, F, np.random.default_rng(0))
    step, faces, after = coarsen._collapse(V, F, mass, removed, parent)
    assert after.sum() == pytest.approx(mass.sum()) and (after > 0).all()
    for k, (v, p) in enumerate(zip(removed, parent, strict=True)):
        star = (v == F).any(axis=1)
        own = step.owner == k
        assert sorted(map(sorted, step.star[own].tolist())) == sorted(map(sorted, F[star].tolist()))
        assert (step.star[own, 0] == v).all() and step.mass[own].sum() == pytest.approx(mass[star].sum())
        holes = {frozenset(f) for f in np.where(F[star] == v, p, F[star]).tolist() if len(set(f)) == 3}
        rows = [t for t, f in enumerate(faces.tolist()) if frozenset(f) in holes]
        area = face_areas(V, faces[rows])
        expected = mass[star].sum() * (0.5 * area / area.sum() + 0.5 / len(rows))
        np.testing.assert_allclose(after[rows], expected)
    # All sides are still met by a face on either side.
    assert (twins(faces) >= 0).all() and not np.isin(removed, faces).any()


# ---- Newton -------------------------------------------------------------------------------------------------


def problem_of(count=40):
    P, F = random_sphere(count)
    V = P * [1, 0.8, 1.2]
    target = np.random.default_rng(0).uniform(0.5, 1.5, len(F))
    target *= 4 * np.pi / target.sum()
    faces = elements(V, F, target)
    return newton.SphereProblem(faces, target, faces.ratio, Assembly(F, len(P)), 3.0), P, F


def test_projected_corners_change_as_differences_say():
    P, F = random_sphere(30)
    face, h = newton.project_faces(P, F), 1e-6
    move = np.random.default_rng(0).normal(size=P.shape)
    move -= np.einsum("nd,nd->n", move, P)[:, None] * P
    # In frames that turn along with the faces: what is a turn about the middle does not count, only the determinants.
    ends = [newton.project_faces(normalized(P + s * h * move), F).corner for s in (1, -1)]

    def area(z):
        return ((z[:, 1] - z[:, 0]).conj() * (z[:, 2] - z[:, 0])).imag / 2

    change = face.change(move[F])
    slope = (area(face.corner + h * change) - area(face.corner - h * change)) / (2 * h)
    np.testing.assert_allclose(slope, (area(ends[0]) - area(ends[1])) / (2 * h), atol=1e-7)
    middle = normalized(P[F].sum(axis=1))
    np.testing.assert_array_equal(newton.projected_corners(P, F), face.corner)
    np.testing.assert_allclose(face.least_cosine, np.einsum("mkd,md->mk", P[F], middle).min(axis=1))


@pytest.mark.parametrize("pressure", [0.0, 1.0])
def test_newtons_direction_solves_the_dense_equations(pressure):
    """The squares of all rows, as differences along every tangent, and how great circles bend."""
    problem, P, F = problem_of()
    n, axes = len(P), newton.tangents(P)
    face = newton.project_faces(P, F)
    local = derivatives_of(problem.faces, *newton.derivatives(problem.faces, face.corner), 3.0, pressure)
    fixed = np.zeros(n, bool)
    fixed[[2, 9]] = True
    direction, slope = newton.newton_direction(problem.faces, problem.assembly, P, face, local, fixed)
    rows, gradient = np.zeros((4 * len(F), 2 * n)), np.zeros(2 * n)
    for v in range(n):
        for a in range(2):
            move = np.zeros((n, 3))
            move[v] = axes[v, a]
            change = face.change(move[F])
            rows[:, 2 * v + a] = np.einsum("mrk,mk->mr", local.rows, change).real.ravel()
            gradient[2 * v + a] = np.einsum("mk,mk->", local.gradient.conj(), change).real
    # By differences of the energy, too, where nothing is softened.
    h, k = 1e-6, 17
    ends = [problem.energy(newton.retract(P, axes, s * h * np.eye(2 * n)[k].reshape(n, 2))) for s in (1, -1)]
    assert gradient[k] == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-4)
    scale = (rows**2).sum() / (2 * n)
    # The pull along the radius, of what moves along a great circle.
    radial = np.zeros(n)
    for v in range(n):
        move = np.zeros((n, 3))
        move[v] = P[v]
        radial[v] = np.einsum("mk,mk->", local.gradient.conj(), face.change(move[F])).real
    held = np.repeat(fixed, 2)
    rows[:, held] = 0
    gradient[held] = 0
    bend = np.where(fixed, 1, np.maximum(-radial, 0))
    matrix = rows.T @ rows + np.diag(np.repeat(bend, 2) + SHIFT * scale)
    expected = -np.linalg.solve(matrix, gradient)
    np.testing.assert_allclose(direction.ravel(), expected, atol=1e-7 * np.abs(expected).max())
    assert slope == pytest.approx(expected @ gradient) and slope < 0


def test_errors_are_those_of_areas():
    problem, P, F = problem_of()
    ratio = spherical_areas(P, F) / problem.target
    share = problem.target / problem.target.sum()
    expected = max(share @ abs(ratio - 1), np.sqrt(share @ (ratio - 1) ** 2))
    assert problem.area_error(P) == pytest.approx(expected)
    error = np.abs(problem.projected_areas(P) / problem.faces.ratio - 1)
    assert problem.projected_area_error(P) == pytest.approx(share @ error)
    # Targets that are as much smaller as the projections are leave no error where the areas are right.
    right = newton.SphereProblem(problem.faces, spherical_areas(P, F), problem.ratio * ratio, problem.assembly, 1.0)
    nearer = refine.with_projected_targets(right, P, 7.0)
    assert nearer.projected_area_error(P) < 1e-12 and nearer.area_weight == 7.0


# ---- flows --------------------------------------------------------------------------------------------------


def bumps():
    basis = stream_functions.bump_basis(30)
    P, F = random_sphere(120)
    return basis, P, F, stream_functions.bump_pairs(P, basis), 0.05 * np.random.default_rng(1).normal(size=30)


def stream(x, basis, coefficients):
    """The stream function at unit vectors (n,3): Wendland's bumps."""
    r = np.linalg.norm(x[:, None] - basis.centres, axis=2) / basis.radius
    return (np.maximum(1 - r, 0) ** 4 * (4 * r + 1)) @ coefficients


def test_velocities_are_the_turned_gradient_of_the_stream_function():
    basis, P, _, pairs, c = bumps()
    found, h = stream_functions.velocity(P, basis, pairs, c), 1e-5
    gradient = np.stack([(stream(P + h * e, basis, c) - stream(P - h * e, basis, c)) / (2 * h) for e in np.eye(3)], 1)
    # Along the sphere alone: what points outwards turns nothing.
    np.testing.assert_allclose(found, np.cross(gradient, P), atol=1e-6)
    assert np.abs((found * P).sum(axis=1)).max() < 1e-12


def test_the_best_flow_is_that_of_dense_least_squares():
    basis, P, _, pairs, _ = bumps()
    rng = np.random.default_rng(0)
    mass, target = rng.uniform(0.5, 2, len(P)), rng.normal(size=P.shape)
    flows = np.stack([stream_functions.velocity(P, basis, pairs, e).ravel() for e in np.eye(30)], axis=1)
    weight = np.repeat(mass, 3)
    energy = flows.T @ (weight[:, None] * flows)
    diagonal = energy.diagonal()
    ridge = 1e-2 * diagonal + 1e-12 * diagonal.max()
    expected = np.linalg.solve(energy + np.diag(ridge), flows.T @ (weight * target.ravel()))
    np.testing.assert_allclose(stream_functions.best_flow(P, mass, target, basis, pairs), expected, rtol=1e-8)


def test_a_step_of_runge_and_kutta_is_the_flow_to_fourth_order():
    """Half the velocity leaves a thirty-second of the error in one step."""
    basis, P, _, pairs, c = bumps()

    def exact(scale):
        def slope(_, y):
            x = normalized(y.reshape(-1, 3))
            return stream_functions.velocity(x, basis, pairs, scale * c).ravel()

        return normalized(solve_ivp(slope, (0, 1), P.ravel(), rtol=1e-10, atol=1e-12).y[:, -1].reshape(-1, 3))

    off = [np.abs(stream_functions.advect(P, basis, pairs, s * c) - exact(s)).max() for s in (1.0, 0.5)]
    assert off[0] < 1e-3 and off[1] < off[0] / 16


def test_fluxes_are_those_of_least_energy_with_what_every_face_gains():
    """Among all that pass from face to face as they are asked to: by Lagrange's equations of Raviart and Thomas."""
    P, F = random_sphere(12)
    gain = np.random.default_rng(0).normal(size=len(F))
    gain -= gain.mean()
    found = moser_flow.edge_fluxes(P, F, gain)
    np.testing.assert_allclose(found.sum(axis=1), gain, atol=1e-10)
    twin = twins(F)
    for h in range(3 * len(F)):
        # Halfedge h lies opposite to corner h + 2.
        one, other = (found[x // 3, (x % 3 + 2) % 3] for x in (h, twin[h]))
        assert one == pytest.approx(-other, abs=1e-10)
    # Energy of a flux: its field in a face is sum F_k (x - p_k) / (2 area); integrated by the middles of the sides.
    p = P[F]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2

    def energy(flux):
        field = sum(flux[:, k, None, None] * ((p + np.roll(p, -1, axis=1)) / 2 - p[:, k : k + 1]) for k in range(3))
        return ((field / (2 * area[:, None, None])) ** 2).sum(axis=(1, 2)) @ area / 3

    # Around every vertex a little more may flow in a circle.
    for v in range(len(P)):
        around = np.zeros_like(found)
        for t, k in np.argwhere(v == F):
            around[t, (k + 2) % 3] += 1
            around[t, (k + 1) % 3] -= 1
        slope = (energy(found + 1e-3 * around) - energy(found - 1e-3 * around)) / 2e-3
        assert slope == pytest.approx(0, abs=1e-8 * energy(found))


def test_points_go_as_the_differential_equation_says():
    """In barycentric coordinates, face after face, by small steps."""
    P, F = random_sphere(12)
    rng = np.random.default_rng(0)
    first, last = rng.uniform(0.2, 2, (2, len(F)))
    first *= last.sum() / first.sum()
    flux = moser_flow.edge_fluxes(P, F, first - last)
    start, begin = np.arange(len(F)), rng.dirichlet([3, 3, 3], len(F))
    face, weights, rounds, stuck = drain(moser_flow.advect_points(F, flux, first, last, start, begin))
    assert stuck == 0 and rounds > 1
    twin, steps, crossed = twins(F), 800, 0
    for point in range(len(F)):
        f, w = point, begin[point].copy()
        for t in (np.arange(steps) + 0.5) / steps:
            gain = first[f] - last[f]
            w = w + (w * gain - flux[f]) / (2 * (first[f] - t * gain)) / steps
            k = int(w.argmin())
            if w[k] < 0:
                h = 3 * f + (k + 1) % 3
                g = int(twin[h])
                beyond = np.zeros(3)
                beyond[g % 3], beyond[(g + 1) % 3] = w[(k + 2) % 3], w[(k + 1) % 3]
                f, w, crossed = g // 3, beyond / beyond.sum(), crossed + 1
        at, expected = (x @ P[F[y]] for x, y in ((weights[point], face[point]), (w, f)))
        assert np.linalg.norm(at - expected) < 1e-2
    assert crossed >= 3


def test_samples_lie_on_the_lines_that_halve_angles():
    P, F = random_sphere(30)
    cell = moser_flow._corner_samples(P, F)
    np.testing.assert_allclose(cell.sum(axis=1), 1)
    for corner, share in enumerate(cell):
        t, k = divmod(corner, 3)
        assert share[k] == moser_flow.CORNER_SHARE
        at = share @ P[F[t]] - P[F[t, k]]
        sides = [normalized((P[F[t, (k + j) % 3]] - P[F[t, k]])[None])[0] for j in (1, 2)]
        np.testing.assert_allclose(*(at @ side for side in sides))


def test_weights_of_samples_put_their_mean_at_the_vertex():
    P, F = random_sphere(30)
    every = np.repeat(np.arange(len(F)), 3)
    at = moser_flow._on_sphere(P, F, every, moser_flow._corner_samples(P, F))
    weight = moser_flow._mean_value_weights(P, F, at)
    assert (weight > 0).all()
    mean = np.stack([np.bincount(F.ravel(), weight * x) for x in at.T], axis=1)
    np.testing.assert_allclose(normalized(mean), P, atol=1e-9)


def test_triangles_as_they_were_given_stay_where_areas_are_not_much_farther_off():
    P, F = random_sphere(60)
    surface, area = SimpleNamespace(triangles=F), spherical_areas(P, F)
    target = area * np.where(np.arange(len(F)) % 2, 1.2, 0.8)
    share = target / target.sum()
    allowed = np.sqrt(share @ (area / area.sum() / share - 1) ** 2) / 1.5
    assert sphere_maps._as_given(P, surface, 5 * target, 1.001 * allowed)
    assert not sphere_maps._as_given(P, surface, target, 0.999 * allowed)
    assert sphere_maps._as_given(P, surface, area, 1e-9)
    # Nor may a few be off by much of their areas, though all others have theirs.
    target = area * np.where(np.arange(len(F)), 1, 1.5)
    share = target / target.sum()
    off = np.abs(area / area.sum() - share).sum()
    assert not sphere_maps._as_given(P, surface, target, off)
    # No triangle may be turned over.
    folded = P.copy()
    folded[0] = -folded[0]
    assert not sphere_maps._as_given(folded, surface, area, 100.0)


@pytest.mark.parametrize("turned", [False, True])
def test_the_coarsest_mesh_is_a_regular_tetrahedron_with_its_outside_out(turned):
    triangles = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    triangles = triangles[:, ::-1] if turned else triangles
    found = multilevel._tetrahedron(SimpleNamespace(triangles=triangles))
    np.testing.assert_allclose(found @ found.T, np.where(np.eye(4), 1, -1 / 3), atol=1e-12)
    assert (np.linalg.det(found[triangles]) > 0).all()
