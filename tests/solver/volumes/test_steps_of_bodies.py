"""Steps of maps of bodies: against dense equations and plain loops, and when they are halved, taken back and ended."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import done, told
from tetrahedra import grid_of_tets, volumes

from omt_uv.solver.errors import HandleError, TetrahedraError
from omt_uv.solver.progress import drain
from omt_uv.solver.volumes import body_map, envelope, paper_flow, registration, shells, tet_exact, tet_newton, transfer
from omt_uv.solver.volumes.domains import BallDomain, HeldDomain
from omt_uv.solver.volumes.meshing import TetMesh
from omt_uv.solver.volumes.tet_mesh import boundary_vertices, stiffness, vertex_volumes


def ball_of_tets(n=2, noise=0.02):
    """A grid of tetrahedra with volume 1, its places in the unit ball, and its boundary."""
    points, tets = grid_of_tets(n, noise)
    points /= np.cbrt(volumes(points, tets).sum())
    middle = points - points.mean(axis=0)
    far = np.linalg.norm(middle, axis=1)
    positions = middle * (np.abs(middle).max(axis=1) / np.maximum(far, 1e-30))[:, None]
    edge = boundary_vertices(tets)
    positions /= np.linalg.norm(positions[edge], axis=1).max()
    domain = BallDomain(edge)
    return points, tets, domain.retract(positions), domain


# ---- a round of exact volumes --------------------------------------------------------------------------------


@pytest.mark.parametrize("slide", [True, False])
@pytest.mark.parametrize("damping", [1e-3, 1.0])
def test_a_round_solves_damped_least_squares_of_relative_errors(slide, damping, monkeypatch):
    points, tets, positions, domain = ball_of_tets()
    both = tet_exact._both(tets, points, positions)
    n, m, taken = len(points), len(tets), []
    monkeypatch.setattr(tet_exact, "RESIDUAL", 1e-13)
    monkeypatch.setattr(tet_exact, "ITERATIONS", 9999)
    monkeypatch.setattr(
        tet_exact, "_without_inversion", lambda both, domain, moves, better: taken.append((moves, better))
    )
    assert tet_exact._round(both, domain, damping, slide) == (None, False)
    ((moves, better),) = taken
    # Tetrahedron by tetrahedron: derivatives of the shares by finite differences.
    size, off, h = volumes(positions, tets).sum(), both.there - both.here, 1e-6
    weight = np.array(
        [
            1 / np.sqrt(max(v, 0.05 / m) * max(abs(d) / max(v, 0.05 / m) / np.abs(off).sum(), 0.25))
            for v, d in zip(both.here, off, strict=True)
        ]
    )
    places = [positions, points] if slide else [positions]
    columns, strain = [], []
    for k, at in enumerate(places):
        for v in range(n):
            for axis in range(3):
                step = np.zeros((n, 3))
                step[v, axis] = h
                change = (volumes(at + step, tets) - volumes(at - step, tets)) / (2 * h)
                columns.append(weight * change / size if k == 0 else -weight * change)
        b = np.zeros((m, 4, 3))
        stiff = np.zeros((n, n))
        for t, tet in enumerate(tets):
            b[t] = np.linalg.inv(np.column_stack([at[tet], np.ones(4)]))[:3].T
            stiff[np.ix_(tet, tet)] += (both.here[t] + 3 / m) * b[t] @ b[t].T
        strain.append(np.kron(stiff, np.eye(3)))
    matrix = np.array(columns).T
    whole = np.zeros((matrix.shape[1],) * 2)
    for k, block in enumerate(strain):
        whole[3 * n * k : 3 * n * (k + 1), 3 * n * k : 3 * n * (k + 1)] = block
    free = []
    for k in range(len(places)):
        for v in range(n):
            rows = 3 * n * k + 3 * v + np.arange(3)
            if v not in domain.boundary:
                axes = np.eye(3)
            elif k == 0:
                out = positions[v] / np.linalg.norm(positions[v])
                axes = np.linalg.svd(out[None])[2][1:].T
            else:
                continue
            for axis in axes.T:
                one = np.zeros(matrix.shape[1])
                one[rows] = axis
                free.append(one)
    free = np.array(free).T
    system = free.T @ (matrix.T @ matrix + damping * whole) @ free
    x = free @ np.linalg.solve(system, -free.T @ (matrix.T @ (weight * off)))
    np.testing.assert_allclose(moves.ravel(), x, atol=1e-6 * np.abs(x).max())
    # It is better where the weighted squares fall, and as foreseen where they fall by 70 % of what the model says.
    now, foreseen = np.square(weight * off).sum(), np.square(weight * off + matrix @ x).sum()

    def fallen(part):
        return SimpleNamespace(off=off * np.sqrt((now - part * (now - foreseen)) / now))

    assert better(fallen(1e-3)) and not better(fallen(-1e-3))
    for part, good in ((0.699, False), (0.701, True), (1.0, True), (0.1, False)):
        monkeypatch.setattr(tet_exact, "_without_inversion", lambda *_, part=part: fallen(part))
        assert tet_exact._round(both, domain, damping, slide)[1] == good


def test_what_is_lost_is_halved_until_a_tenth_is_left():
    """A tetrahedron whose tip comes down on its base: a twentieth too far, and not."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    both = tet_exact._both(np.array([[0, 1, 2, 3]]), points, points)
    domain = SimpleNamespace(retract=lambda x: x)
    for down in (0.89, 0.91, 1.5, 1.9, 4.0):
        moves = np.zeros((2, 4, 3))
        moves[1, 3, 2] = -down
        found = tet_exact._without_inversion(both, domain, moves, lambda trial: True)
        while down >= 0.9:
            down /= 2
        assert found.points[3, 2] == pytest.approx(1 - down)


# ---- Newton's steps ------------------------------------------------------------------------------------------


class Energy:
    """(x - 1)^2 of every coordinate, or what is told in its place."""

    def __init__(self, values=None):
        self.values = None if values is None else iter(values)

    def value(self, points):
        return float(np.square(points - 1).sum()) if self.values is None else next(self.values)

    def derivatives(self, points, frames):
        return 2 * (points - 1), None


def problem_of(energy, monkeypatch, direction):
    assembly = SimpleNamespace(vector=lambda slope, frames: slope.ravel(), spread=lambda x, frames: x.reshape(-1, 3))
    domain = SimpleNamespace(frames=lambda points: None, retract=lambda points: points)
    monkeypatch.setattr(tet_newton, "tet_energy", lambda shape, size, weight, eps: energy)
    monkeypatch.setattr(tet_newton, "_solved", lambda *_: direction)
    return SimpleNamespace(assembly=assembly, domain=domain)


@pytest.mark.parametrize(("factor", "share"), [(0.5, 1.0), (0.9, 1.0), (1.0, 0.5), (1.5, 0.5), (2.5, 0.25)])
def test_steps_are_halved_until_the_energy_falls(factor, share, monkeypatch):
    """From 0, the least energy is at 1: twice as far it is what it was."""
    points = np.zeros((2, 3))
    problem = problem_of(Energy(), monkeypatch, np.full(6, 2 * factor))
    found, fall = tet_newton._step(problem, None, points, tet_newton._Terms(1.0, 1.0))
    assert np.allclose(found, 2 * factor * share) and fall == pytest.approx(2 * 2 * factor)


@pytest.mark.parametrize(("beyond", "taken"), [(-1e-9, True), (1e-9, False)])
def test_a_step_is_taken_where_it_keeps_a_ten_thousandth_of_its_promise(beyond, taken, monkeypatch):
    fall = 2.0 * 6
    values = [7.0, 7.0 - 1e-4 * fall + beyond, *([7.0] * 20)]
    problem = problem_of(Energy(values), monkeypatch, np.ones(6))
    found, promised = tet_newton._step(problem, None, np.zeros((2, 3)), tet_newton._Terms(1.0, 1.0))
    assert (found == 1).all() == taken and promised == (pytest.approx(fall / 7.0) if taken else 0.0)
    assert taken or (found == 0).all()


@pytest.mark.parametrize("inverted", [[0], [2, 1, 0], [3] * 9])
def test_untangling_is_softened_where_no_step_helps(inverted, monkeypatch):
    counts, asked = iter([*inverted, *([inverted[-1]] * 99)]), []
    falls = iter([1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0])

    def step(problem, shape, points, terms):
        asked.append((terms.eps, terms.weight, shape.weight.tolist()))
        return points + 1, next(falls)

    points, tets = grid_of_tets(1)
    weight = np.arange(1.0, 7) / 21
    problem = SimpleNamespace(tets=tets, coarse=tet_newton.RestShape(tets, None, weight))
    monkeypatch.setattr(tet_newton, "inverted", lambda points, tets: next(counts))
    monkeypatch.setattr(tet_newton, "_step", step)
    found, fractions = told(tet_newton._untangling(problem, points, 7, 0.3))
    steps = min(len(inverted) - 1 if inverted[-1] == 0 else 7, 7)
    assert np.allclose(found, points + steps) and fractions == pytest.approx(np.arange(steps) / 7)
    eps = [0.3, 0.225, 0.16875, 0.3, 0.3, 0.225, 0.16875][:steps]
    assert [a[0] for a in asked] == pytest.approx(eps) and all(a[1] == 1.0 for a in asked)
    assert all(np.allclose(a[2], (weight + 1 / 6) / 2) for a in asked)


def test_untangling_goes_no_farther_down_than_to_its_least(monkeypatch):
    asked = []
    monkeypatch.setattr(tet_newton, "inverted", lambda points, tets: 1)
    monkeypatch.setattr(
        tet_newton, "_step", lambda problem, shape, points, terms: (points, asked.append(terms.eps) or 1.0)
    )
    points, tets = grid_of_tets(1)
    problem = SimpleNamespace(tets=tets, coarse=tet_newton.RestShape(tets, None, np.full(6, 1 / 6)))
    drain(tet_newton._untangling(problem, points, 30, 0.3))
    assert asked == pytest.approx([max(0.3 * 0.75**k, 0.002) for k in range(30)])


@pytest.mark.parametrize(
    ("left", "rounds", "ends"),
    [
        ([0], 1, True),
        ([5, 4, 0], 3, True),
        # Four rounds in a row with no fewer.
        ([5, 5, 5, 5, 5, 0], 5, False),
        ([5, 6, 5, 7, 4, 4, 4, 4, 4, 0], 9, False),
        ([5, 5, 5, 5, 4, 0], 6, True),
        (list(range(40, 0, -1)), 24, False),
    ],
)
def test_edges_are_split_while_that_leaves_fewer_inverted(left, rounds, ends, monkeypatch):
    asked, at = [], [0]

    def untangling(problem, positions, most, eps):
        asked.append((most, eps, len(problem.domain.boundary)))
        at[0] += 1
        return done(positions)

    def volumes_of(points, tets):
        count = left[min(at[0], len(left)) - 1]
        return np.where(np.arange(len(tets)) < count, -1.0, 1.0)

    def split(mesh, positions, wrong):
        assert int(wrong.sum()) == left[at[0] - 1]
        return TetMesh(mesh.points + 1, mesh.tets), positions + 1

    mesh = TetMesh(np.zeros((5, 3)), np.zeros((99, 4), int))
    monkeypatch.setattr(tet_newton, "tet_problem", lambda points, tets, domain: SimpleNamespace(domain=domain))
    monkeypatch.setattr(tet_newton, "_untangling", untangling)
    monkeypatch.setattr(tet_newton, "tet_volumes", volumes_of)
    monkeypatch.setattr(tet_newton, "split_inside", split)
    steps = tet_newton.unlocked(mesh, np.zeros((5, 3)), 3)
    if ends:
        (found, positions), fractions = told(steps)
        assert (found.points == rounds - 1).all() and (positions == rounds - 1).all()
        assert fractions == pytest.approx(np.arange(rounds) / 24)
    else:
        with pytest.raises(TetrahedraError):
            told(steps)
    assert asked == [(20, 0.3 if k == 0 else pytest.approx(0.024), 3) for k in range(rounds)]


@pytest.mark.parametrize(
    ("falls", "steps"), [([0.021] * 99, 5), ([0.019] * 99, 2), ([0.5, 0.5, 0.019], 3), ([0.019, 0.5, 0.5, 0.5], 4)]
)
def test_stages_end_where_little_is_promised(falls, steps, monkeypatch):
    falls, asked = iter(falls), []

    def step(problem, shape, points, terms):
        asked.append((shape, terms.weight, terms.eps))
        return points + 1, next(falls)

    monkeypatch.setattr(tet_newton, "_step", step)
    points, tets = grid_of_tets(1)
    problem = SimpleNamespace(tets=tets, fine="fine")
    (found, count), fractions = told(tet_newton.refined(problem, points, ((2.0, 2), (7.0, 3))))
    assert count == len(asked) == steps and np.allclose(found, points + steps)
    assert asked == sorted(asked, key=lambda a: a[1]) and asked[0] == ("fine", 2.0, 0.0) and asked[-1][1] == 7.0
    assert fractions == pytest.approx(np.arange(steps) / 5)


@pytest.mark.parametrize("kind", ["ball", "held"])
def test_unknowns_are_those_along_the_boundary_and_three_of_every_point_inside(kind):
    points, tets, positions, domain = ball_of_tets()
    domain = domain if kind == "ball" else HeldDomain(domain.boundary)
    problem = tet_newton.tet_problem(points, tets, domain)
    unknown, b, free = problem.assembly.unknown, len(domain.boundary), domain.sliding
    assert problem.count == len(points) and problem.share == pytest.approx(volumes(points, tets))
    assert unknown[domain.boundary, :free].ravel().tolist() == list(range(free * b))
    assert (unknown[domain.boundary, free:] == -1).all()
    inside = np.setdiff1d(np.arange(len(points)), domain.boundary)
    assert unknown[inside].ravel().tolist() == list(range(free * b, free * b + 3 * len(inside)))
    for shape, least in ((problem.coarse, 0.1), (problem.fine, 0.01)):
        share = volumes(points, tets)
        asked = np.maximum(share, least * share.mean())
        assert shape.weight == pytest.approx(asked / asked.sum())


def test_what_bends_the_boundary_is_added_to_what_slides_along_it(monkeypatch):
    points, tets, positions, domain = ball_of_tets()
    problem = tet_newton.tet_problem(points, tets, domain)
    energy = tet_newton.tet_energy(problem.fine, float(volumes(positions, tets).sum()), 3.0)
    frames = domain.frames(positions)
    slope, blocks = energy.derivatives(positions, frames)
    gradient = problem.assembly.vector(slope, frames)
    monkeypatch.setattr(tet_newton, "RESIDUAL", 1e-12)
    found = tet_newton._solved(problem, blocks, slope, positions, gradient)
    matrix = problem.assembly.matrix(blocks).toarray()
    for k, v in enumerate(domain.boundary):
        inwards = max(-float(slope[v] @ positions[v]), 0.0)
        for axis in range(2):
            matrix[2 * k + axis, 2 * k + axis] += inwards
    np.testing.assert_allclose(found, np.linalg.solve(matrix, -gradient), atol=1e-8 * np.abs(found).max())


# ---- what goes with them -------------------------------------------------------------------------------------


@pytest.mark.parametrize("shared", [0.02, 0.2, 0.45])
def test_shells_are_found_by_halving(shared):
    points, tets, positions, _ = ball_of_tets(3, 0.0)
    radius = np.linalg.norm(positions, axis=1)
    found = shells._enclosing(points, tets, radius, shared)
    below, above = (
        shells._enclosed(shells.level_surface(points, tets, radius, found.value + d)) for d in (-2e-6, 2e-6)
    )
    assert below < shared < above


def test_fields_between_tetrahedra_are_those_of_the_nearest_and_blocks_do_not_matter(monkeypatch):
    points, tets, _, _ = ball_of_tets(3)
    rng = np.random.default_rng(0)
    field = rng.normal(size=(len(points), 2))
    asked = rng.uniform(-0.2, 1.2, (70, 3))
    locate = transfer.TetLocation(points, tets)
    whole, (owner, weights) = locate.values(asked, field), locate(asked)
    monkeypatch.setattr(transfer, "BLOCK", 32)
    np.testing.assert_array_equal(locate.values(asked, field), whole)
    outside = 0
    for p, o, w, found in zip(asked, owner, weights, whole, strict=True):
        every = np.array([np.linalg.solve(np.vstack([points[t].T, np.ones(4)]), [*p, 1]) for t in tets])
        least = every.min(axis=1)
        outside += least.max() < -1e-9
        assert w == pytest.approx(every[o], abs=1e-9) and least[o] >= min(least.max(), 0) - 1e-9
        w = np.maximum(w, 0) / np.maximum(w, 0).sum()
        assert found == pytest.approx(w @ field[tets[o]])
    assert 0 < outside < 70


def test_points_that_no_near_centre_has_are_looked_for_farther_away(monkeypatch):
    points, tets, _, _ = ball_of_tets(2)
    asked = points[tets].mean(axis=1) * 0.3 + points[tets[:, 0]] * 0.7
    monkeypatch.setattr(transfer, "NEAREST", 1)
    _, weights = transfer.TetLocation(points, tets)(asked)
    assert weights.min() > -1e-9
    monkeypatch.setattr(transfer, "MORE", 1)
    _, weights = transfer.TetLocation(points, tets)(asked)
    assert weights.min() < -1e-3


@pytest.mark.parametrize("far", [0.0, 0.5, 0.969, 0.971, 1.0, 2.0])
def test_landmarks_near_the_wall_are_pulled_in(far):
    found = registration._inner(np.array([[0.6 * far, 0, 0.8 * far]]))
    assert np.linalg.norm(found) == pytest.approx(min(far, 0.97))
    assert found[0, 1] == 0 and found[0, 0] * 0.8 == pytest.approx(found[0, 2] * 0.6)


@pytest.mark.parametrize(("apart", "flows"), [(0.9e-12, False), (1.1e-12, True), (0.1, True)])
def test_landmarks_that_meet_are_left_where_they_are(apart, flows, monkeypatch):
    landmarks = np.array([[0, 0.5, 0], [0, 0, 0.5], [0, -0.5, 0.1]])
    goals = landmarks + [apart, 0, 0]
    asked = []

    def flow(points, handles, options, domain):
        asked.append((points, handles, options))
        return done(SimpleNamespace(positions=points + 1))

    monkeypatch.setattr(registration, "nearest_rotations", lambda matrix: np.eye(3))
    monkeypatch.setattr(registration, "flow", flow)
    positions = np.arange(6.0).reshape(2, 3)
    found = drain(registration.registered(positions, landmarks, goals))
    assert bool(asked) == flows and (found.positions == positions + flows).all()
    assert found.before == pytest.approx(apart, rel=1e-9, abs=0)
    if flows:
        ((points, handles, options),) = asked
        assert np.array_equal(points, np.concatenate([positions, landmarks])) and options.radius == 0.25
        assert [h.name for h in handles] == ["landmark 0", "landmark 1", "landmark 2"]
    with pytest.raises(HandleError, match="A registration needs three landmarks or more,"):
        drain(registration.registered(positions, landmarks, goals[:2]))


def test_the_flow_of_the_paper_step_by_step():
    """One step at a time, with dense matrices and vertex by vertex."""
    points, tets, positions, domain = ball_of_tets(2, 0.05)
    found = drain(paper_flow.paper_flow(points, tets, positions, domain, steps=2, keep=(0, 1, 2)))
    rest = vertex_volumes(points, tets)
    at, before = positions, None
    for k in range(2):
        now = vertex_volumes(at, tets)
        ratio = rest / rest.sum() / np.maximum(now / now.sum(), 1e-3 / len(points))
        before = ratio if before is None else before
        weights = stiffness(at, tets)
        weights = np.maximum(weights, 1e-3 * np.abs(weights).mean())
        matrix = np.zeros((len(points),) * 2)
        for tet, own in zip(tets, weights, strict=True):
            for (i, j), w in zip([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)], own, strict=True):
                a, b = tet[i], tet[j]
                matrix[a, a] += w
                matrix[b, b] += w
                matrix[a, b] -= w
                matrix[b, a] -= w
        source = -(before - 1) / ratio * now
        matrix += 1e-9 * np.diag(matrix).mean() * np.eye(len(points))
        potential = np.linalg.solve(matrix, source - source.mean())
        assert np.array_equal(found.kept[k], at) or np.allclose(found.kept[k], at, atol=1e-9)
        at = domain.retract(at + paper_flow._velocity(at, tets, potential) / 2)
    np.testing.assert_allclose(found.positions, at, atol=1e-8)
    assert len(found.kept) == 3 and len(found.errors) == 3 and found.kept[2] is found.positions


@pytest.mark.parametrize("negative", [0, 3])
def test_points_inside_are_means_of_their_neighbours_with_positive_weights(negative, monkeypatch):
    points, tets, positions, domain = ball_of_tets(3)
    order = np.concatenate([domain.boundary, np.setdiff1d(np.arange(len(points)), domain.boundary)])
    number = np.argsort(order)
    mesh, b = TetMesh(points[order], number[tets]), len(domain.boundary)
    weights = np.random.default_rng(1).uniform(0.5, 1.5, (len(tets), 6))
    weights[: negative * 10] *= -1e-5
    monkeypatch.setattr(body_map, "stiffness", lambda points, tets: weights)
    found = body_map.harmonic(mesh, positions[domain.boundary])
    used = np.maximum(weights, 1e-3 * np.abs(weights).mean())
    total, count = np.zeros((len(points), 3)), np.zeros(len(points))
    for tet, own in zip(mesh.tets, used, strict=True):
        for (i, j), w in zip([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)], own, strict=True):
            for one, other in ((tet[i], tet[j]), (tet[j], tet[i])):
                total[one] += w * found[other]
                count[one] += w
    np.testing.assert_allclose(found[:b], positions[domain.boundary])
    np.testing.assert_allclose(found[b:], (total / count[:, None])[b:], atol=1e-9)


@pytest.mark.parametrize(("count", "edge"), [(1, 0.2), (100, None), (1000, None), (10**8, 0.005)])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_edges_are_as_long_as_so_many_tetrahedra_take(count, edge, scale, monkeypatch):
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    F = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    asked = []

    def tetwild(points, triangles, edge):
        asked.append((points, edge))
        return points, np.array([[0, 1, 2, 3]])

    monkeypatch.setattr(envelope, "_tetwild", tetwild)
    found = envelope.filled(scale * V + 5, F, count)
    size = np.sqrt(3)
    points, length = asked[0]
    assert points == pytest.approx(V / size)
    if edge is None:
        regular = 2**0.5 / 12
        edge = np.clip(np.cbrt(1.8 * (1 / 6) / size**3 / (regular * count)), 0.005, 0.2)
    assert length == pytest.approx(edge)
    assert found.mesh.points == pytest.approx(scale * V + 5) and found.vertices == pytest.approx(scale * V + 5)
    # Where volumes cancel, a twentieth of the box is taken to be inside.
    envelope.filled(V, np.concatenate([F, F[:, ::-1]]), 300)
    assert asked[-1][1] == pytest.approx(np.cbrt(1.8 * 0.05 / size**3 / (2**0.5 / 12 * 300)))
