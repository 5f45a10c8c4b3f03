"""Slopes and Newton's steps of every energy against differences of the energy itself."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from bodies import icosphere
from scipy.sparse import identity, vstack
from sphere_shapes import random_sphere

from omt_uv.solver.contact import barrier
from omt_uv.solver.contact.new_crossings import NewCrossings
from omt_uv.solver.contact.self_intersections import FaceCrossings
from omt_uv.solver.globe import exact_areas
from omt_uv.solver.globe.projections import EQUIRECT, PROJECTIONS
from omt_uv.solver.globe.unfolding import Polygons, unfold
from omt_uv.solver.maps.contacts import crossings
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.spherical_geometry import normalized
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.refinement.boundary_barrier import BoundaryBarrier, make_barrier
from omt_uv.solver.refinement.hessian_blocks import Assembly
from omt_uv.solver.refinement.pins import PinEnergy, Pins
from omt_uv.solver.registration import surface_newton
from omt_uv.solver.registration.carriers import DiskCarrier, SphereCarrier, TargetCarrier
from omt_uv.solver.sphere import newton, untangle
from omt_uv.solver.subdivision import cage_refinement
from omt_uv.solver.subdivision.cage_symmetry import without_symmetry
from omt_uv.solver.subdivision.catmull_clark import cage_of, straight_boundary, subdivide
from omt_uv.solver.volumes import tet_newton
from omt_uv.solver.volumes.domains import BallDomain, CubeDomain, HeldDomain
from omt_uv.solver.volumes.tet_energy import tet_energy
from omt_uv.solver.volumes.tet_mesh import boundary_vertices, tet_volumes

H = 1e-6


def slope_of(energy, at, way, h=H):
    """The derivative of an energy along a way."""
    return (energy(at + h * way) - energy(at - h * way)) / (2 * h)


def bend_of(energy, at, way, h=1e-4):
    """The second one."""
    return (energy(at + h * way) - 2 * energy(at) + energy(at - h * way)) / h**2


def directions(shape, count=6, seed=0):
    rng = np.random.default_rng(seed)
    return [rng.normal(size=(*shape, 2)) @ [1, 1j] for _ in range(count)]


def fork():
    """A boundary that is near to itself in three ways: a vertex beside an edge, before an end, and two that face."""
    w = np.array([0, 4, 4 + 2j, 3 + 0.4j, 2 + 2j, 1.2 + 0.1j, 0.9 + 2.1j, 2.05 + 2.12j, 2 + 4j, -1 + 4j])
    return 0.7 * w * np.exp(0.3j) + 2, np.arange(len(w))


@pytest.mark.parametrize("scale", [1.0, 1e-3, 100.0])
def test_of_the_barrier_of_a_boundary(scale):
    w, loop = fork()
    w = scale * w
    near = make_barrier(w, loop, 1.0)
    found = BoundaryBarrier(near.tail, near.head, 3 * near.vertex_reach, 3 * near.edge_reach, 2.5)
    gradient, vertices, rows = found.derivatives(w)
    assert found.energy(w) > 0 and np.isfinite(rows).all()
    for v in directions(w.shape):
        numeric = slope_of(found.energy, w, v, H * scale)
        assert numeric == pytest.approx((gradient.conj() * v).real.sum(), rel=1e-4)
        bound = ((rows * v[vertices]).sum(axis=1).real ** 2).sum()
        # Its Hessian is made convex: no less than the energy's own.
        assert bound >= bend_of(found.energy, w, v, 1e-4 * scale) * (1 - 1e-3)
    # Twice as strong is twice as much.
    stronger = BoundaryBarrier(near.tail, near.head, 3 * near.vertex_reach, 3 * near.edge_reach, 5.0)
    assert stronger.energy(w) == pytest.approx(2 * found.energy(w))
    np.testing.assert_allclose(stronger.derivatives(w)[0], 2 * gradient)


def test_the_barrier_of_one_pair_by_its_formula():
    """A vertex above an edge, beside its end, and on its line."""
    tail, head = np.array([0, 2]), np.array([1, 3])
    reach = np.array([1.0, 1.0])
    for vertex, expected in ((0.3 + 0.5j, 0.5), (1.3 + 0.4j, 0.5), (-0.6, 0.6), (0.5 + 0.9j, 0.9), (0.5 + 1.0j, 1.0)):
        w = np.array([0, 1, vertex, vertex + 50j])
        found = BoundaryBarrier(tail, head, reach, reach, 3.0)
        ends = [abs(p - q) for p in (0, 1) for q in (vertex,)]
        # The vertex to the edge, and the edge's first vertex to what begins at the vertex.
        pairs = [expected, ends[0] if vertex.imag >= 0 else np.inf]
        plain = sum(3.0 * max(1 / d - 1, 0) ** 2 for d in pairs)
        assert found.energy(w) == pytest.approx(plain)


def test_steps_are_limited_by_the_first_contact_alone():
    tail, head = np.array([0, 2]), np.array([1, 3])
    for way, first in ((-1j, 0.5), (-2j, 0.25), (1j, np.inf), (-0.4j, 1.25), (-0.3j, np.inf), (1 - 1j, 0.5)):
        w = np.array([0, 2, 0.5 + 0.5j, 0.5 + 9j])
        step = np.array([0, 0, way, 0])
        found = BoundaryBarrier(tail, head, np.ones(2), np.ones(2), 1.0).limit(w, step)
        # A step may go at most 0.8 of the way to a contact, and what is beyond all of it does not count.
        assert found == pytest.approx(0.8 * first) or (found >= 1 and 0.8 * first >= 1)
        if found < 1:
            assert not len(crossings(w + found * step, np.array([[0, 1], [2, 3]])))


def test_of_pins():
    w = directions((5,))[0]
    found = PinEnergy(Pins(np.array([0, 4]), np.array([1.0, 2j])), 3.0, 2.0)
    assert found.energy(w) == pytest.approx(3 / 4 * (abs(w[0] - 1) ** 2 + abs(w[4] - 2j) ** 2))
    gradient, vertices, rows = found.derivatives(w)
    for v in directions(w.shape):
        assert slope_of(found.energy, w, v) == pytest.approx((gradient.conj() * v).real.sum(), rel=1e-6)
        bound = ((rows * v[vertices]).sum(axis=1).real ** 2).sum()
        assert bend_of(found.energy, w, v) == pytest.approx(bound, rel=1e-4)


@pytest.mark.parametrize("held", [False, True])
def test_of_what_keeps_faces_apart(held):
    """Where Newton's method for two balls that press ends, the energy is level in all ways that are left."""
    V = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], float)
    F = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    V, F = np.concatenate([V, V + [2.04, 0.05, 0.02]]), np.concatenate([F, F + len(V)])
    rng = np.random.default_rng(0)
    goal = V + np.where(np.arange(len(V)) < len(V) // 2, 0.08, -0.08)[:, None] * [1, 0, 0]
    mass = np.where(held & (V[:, 0] > 2.5), 50.0, 1.0) * rng.uniform(1, 2, len(V))
    problem, at = barrier._Problem(goal, mass, NewCrossings(V, FaceCrossings(F)), 0.6), V
    one = np.zeros(len(V), int)

    def energy(x):
        return float(problem.energies(x, problem.near(x), one)[0])

    for _ in range(25):
        way, share = problem.step(at, problem.near(at)), 1.0
        while not energy(at + share * way) < energy(at) and share > 1e-4:
            share /= 2
        at = at + (share if share > 1e-4 else 0) * way
    near = problem.near(at)
    assert len(near.share) and energy(at) < energy(V)
    pushed = mass.max() * np.abs(at - goal).max()
    for _ in range(6):
        v = rng.normal(size=V.shape)
        assert abs(slope_of(energy, at, v, 1e-7)) < 1e-3 * pushed
    # Whole is the sum over the groups, each by its formula.
    group = near.groups(len(V))
    away = 0.5 * (mass * ((at - goal) ** 2).sum(axis=1)).sum()
    d = near.share
    held_apart = -1e-3 * ((d - 1) ** 2 * np.log(d)).sum()
    assert problem.energies(at, near, group).sum() == pytest.approx(away + held_apart)
    length = np.linalg.norm(near.pairs.offsets(at)[0], axis=1)
    assert d == pytest.approx(length / near.reach) and (length < 0.1 * 0.6).all()


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_of_areas_of_an_unfolded_globe(projection):
    """With a great damping the step is the slope, over the damping and the metric."""
    P, F = random_sphere(150)
    m = len(F)
    polygons = Polygons(F.ravel(), np.repeat(np.arange(m), 3), np.arange(3 * m).reshape(m, 3))
    unfolded, _ = unfold(P, polygons, projection)
    metric = exact_areas._sphere_metric(unfolded, projection)
    shares = np.random.default_rng(0).uniform(0.5, 1.5, m)
    shares /= shares.sum()
    problem = exact_areas._AreaProblem(unfolded, polygons, shares, metric, projection == EQUIRECT)
    uv = unfolded.uv + 1e-3 * np.random.default_rng(1).normal(size=unfolded.uv.shape) * ~unfolded.fixed
    damping = 1e9
    step = problem.step(uv, damping, problem.order)
    slope = -2 * step * damping * metric
    assert not step[unfolded.fixed].any()
    total = signed_areas(unfolded.with_points(uv).corners(), polygons.triangles).sum()

    def energy(points):
        """With the whole area as it was, which the step takes for a constant."""
        areas = signed_areas(unfolded.with_points(points).corners(), polygons.triangles)
        pull = 1e-5 * (metric * (points - unfolded.uv) ** 2).sum()
        return ((areas / total - shares) ** 2 / shares).sum() + pull

    assert problem.energy(uv) == pytest.approx(energy(uv))
    rng = np.random.default_rng(2)
    for _ in range(4):
        v = rng.normal(size=uv.shape) * ~unfolded.fixed
        assert slope_of(energy, uv, v, 1e-7) == pytest.approx((slope * v).sum(), rel=1e-4)


@pytest.mark.parametrize("eps", [1e-3, 0.3])
def test_of_untangling_on_the_sphere(eps):
    P, F = random_sphere(60)
    rng = np.random.default_rng(0)
    p = normalized(P + 0.4 * rng.normal(size=P.shape))
    faces = elements(P, F, face_areas(P, F))

    def energy(x):
        return untangle._energy(faces, *newton.derivatives(faces, newton.project_faces(x, F).corner), eps)

    face = newton.project_faces(p, F)
    local = untangle._local(faces, *newton.derivatives(faces, face.corner), eps)
    axes = newton.tangents(p)
    fixed = np.arange(len(P)) < 3
    way, slope = newton.newton_direction(faces, Assembly(F, len(P)), p, face, local, fixed)
    assert not way[fixed].any() and slope < 0
    ahead, back = (energy(newton.retract(p, axes, h * way)) for h in (1e-7, -1e-7))
    assert (ahead - back) / 2e-7 == pytest.approx(slope, rel=1e-3)
    det = np.linspace(-2, 2, 41)
    chi, first, second = untangle._chi(det, eps)
    assert chi == pytest.approx((det + np.sqrt(det**2 + eps**2)) / 2, rel=1e-6, abs=1e-12) and (chi > 0).all()
    assert first == pytest.approx((untangle._chi(det + H, eps)[0] - untangle._chi(det - H, eps)[0]) / (2 * H), abs=1e-6)
    assert second == pytest.approx(
        (untangle._chi(det + H, eps)[1] - untangle._chi(det - H, eps)[1]) / (2 * H), abs=1e-3
    )


@pytest.mark.parametrize("eps", [0.0, 0.1])
@pytest.mark.parametrize("barred", [False, True])
def test_of_the_map_of_a_cage(eps, barred, monkeypatch):
    k = 3
    corner = np.arange((k + 1) * k).reshape(k, k + 1)[:, :-1].ravel()
    quads = np.column_stack([corner, corner + 1, corner + k + 2, corner + k + 1])
    y, x = np.divmod(np.arange((k + 1) ** 2), k + 1)
    w = (x + 1j * y) / k + 0.03 * directions((len(x),))[0]
    positions = np.column_stack([x, y, np.sin(x) + y**2 / 3]) / k
    cage = cage_of(quads.ravel(), np.arange(0, 4 * len(quads) + 1, 4), len(x))
    surface, mapping = subdivide(cage, 1), subdivide(straight_boundary(cage), 1)
    triangles = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    corners = (surface.matrix @ positions)[surface.quads]
    scale = np.random.default_rng(0).uniform(0.5, 2, len(corners) + len(triangles))
    asked = cage_refinement.subdivided_elements(corners, mapping.quads, positions[triangles], triangles, scale)
    matrix = vstack([mapping.matrix, identity(len(x))]).tocsr()
    fixed = np.arange(len(x)) == 0
    loop = boundary_loops(triangles)[0]
    near = make_barrier(w, loop, 0.3)
    bars = (BoundaryBarrier(near.tail, near.head, 3 * near.vertex_reach, 3 * near.edge_reach, 0.3),) if barred else ()
    problem = cage_refinement._CageProblem(
        asked,
        np.ones(len(asked.faces.triangles), bool),
        np.zeros(len(asked.faces.triangles), bool),
        matrix,
        without_symmetry(len(x)).unknowns(fixed),
        Assembly(asked.faces.triangles[4 * len(mapping.quads) :], matrix.shape[0], None, mapping.quads),
        7.0,
        bars,
    )
    if not eps:
        assert problem.dets(w).min() > 0
    way, promised = problem.newton(w, eps)
    assert way[0] == 0 and promised > 0
    assert slope_of(lambda z: problem.energy(z, eps), w, way, 1e-7) == pytest.approx(-promised, rel=1e-4)
    det = np.linspace(-1, 1, 21)
    if eps:
        chi, first, second = cage_refinement._chi(det, eps)
        after, before = cage_refinement._chi(det + H, eps), cage_refinement._chi(det - H, eps)
        assert first == pytest.approx((after[0] - before[0]) / (2 * H), abs=1e-6)
        assert second == pytest.approx((after[1] - before[1]) / (2 * H), abs=1e-4)
    bent = bend_of(lambda z: problem.energy(z, eps), w, way / np.abs(way).max(), 1e-4)
    assert promised / np.abs(way).max() ** 2 > 0.5 * bent
    # Barriers add the squares of their rows to the equations, and nothing else.
    solved, systems = cage_refinement.splu, []
    monkeypatch.setattr(cage_refinement, "splu", lambda A, **given: systems.append(A.toarray()) or solved(A, **given))
    problem.newton(w, eps), replace(problem, barriers=()).newton(w, eps)
    rows = [cage_refinement.linear_forms(*bar.derivatives(w)[1:], len(w)) @ problem.unknowns for bar in bars]
    added = sum((part.T @ part).toarray() for part in rows)
    np.testing.assert_allclose(systems[0] - systems[1], added, atol=1e-6 * np.abs(systems[1]).max())


def carried(kind):
    """A mesh, a carrier, places on it, and the domain where it is a surface."""
    rng = np.random.default_rng(0)
    if kind == "sphere":
        P, F = random_sphere(80)
        return P * [1, 1.4, 0.8], F, (carrier := SphereCarrier()), carrier.place(normalized(P + 0.05 * P[:, [1, 2, 0]]))
    V, F = meshes.bumpy(6, 6)
    loop = boundary_loops(F)[0]
    flat = V[:, :2] - 0.5
    if kind == "disk":
        uv = flat * (np.abs(flat).max(axis=1) / np.maximum(np.linalg.norm(flat, axis=1), 1e-9))[:, None] * 2
        return V, F, (carrier := DiskCarrier(loop)), carrier.place(uv)
    inside = flat * 0.8 + 0.01 * rng.normal(size=flat.shape)
    carrier = TargetCarrier(V, F, flat)
    return V, F, carrier, carrier.place(inside)


@pytest.mark.parametrize("features", [False, True])
@pytest.mark.parametrize("kind", ["sphere", "disk", "surface"])
def test_of_maps_from_surface_to_surface(kind, features):
    V, F, carrier, placed = carried(kind)
    rng = np.random.default_rng(3)
    more, within = None, None
    if kind == "surface" and features:
        share = rng.uniform(0.5, 2, len(V)) / len(V)
        more = surface_newton.Features(rng.normal(size=(len(V), 2)), 3 * V[:, [0, 2]], share)
        within = placed.domain + 0.01 * rng.normal(size=placed.domain.shape)
    elif features:
        pytest.skip("of a surface alone")
    problem = surface_newton.deformation(V, F, carrier, more, within)
    way, slope, until = surface_newton._direction(problem, placed)
    assert slope < 0 and until.shape == (len(F),)
    h = 1e-6
    ahead, back = (problem.energy(carrier.move(placed, sign * h * way)) for sign in (1, -1))
    assert (ahead - back) / (2 * h) == pytest.approx(slope, rel=2e-2 if kind == "surface" else 1e-4)
    # Vertices that are held do not move, and tell nothing of the slope.
    held = np.arange(len(V)) % 5 == 0
    still = SimpleNamespace(**{**vars(problem), "held": held, "surface": carrier})
    assert not surface_newton._direction(still, placed)[0][held].any()
    if more is not None:
        off = more.differences(placed, F)
        square = (off**2).sum(axis=1)
        assert more.energy(placed, F) == pytest.approx(0.5 * (share * square / (1 + square)).sum())
        without = surface_newton.deformation(V, F, carrier, None, None).energy(placed)
        assert problem.energy(placed) > without + more.energy(placed, F)
        # Their pull is the slope of their energy, within the faces that places lie in.
        pull, forms = more.rows(placed, carrier)
        walk = rng.normal(size=pull.shape)
        across = np.cross(*np.moveaxis(V[F[placed.faces]][:, 1:] - V[F[placed.faces]][:, :1], 1, 0))
        across = normalized(across)
        walk -= (walk * across).sum(axis=1, keepdims=True) * across
        step = 1e-4 * np.ptp(V, axis=0).max() / len(V)
        ahead, back = (carrier.move(placed, sign * step * walk) for sign in (1, -1))
        same = (ahead.faces == placed.faces) & (back.faces == placed.faces)
        own = replace(more, share=np.where(same, more.share, 0))
        numeric = (own.energy(ahead, F) - own.energy(back, F)) / (2 * step)
        assert same.mean() > 0.8 and (pull * walk)[same].sum() == pytest.approx(numeric, rel=1e-3)
        # The squares of the forms are what is left of its bend where residuals are held: convex, and of the same slope.
        square = np.einsum("ncd,nc->nd", forms, off * np.sqrt(share)[:, None] / (1 + square)[:, None])
        np.testing.assert_allclose(square, pull, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("domain", ["ball", "cube", "held"])
@pytest.mark.parametrize("eps", [0.0, 0.2])
def test_of_maps_of_tetrahedra(domain, eps):
    """The direction that conjugate gradients find descends as its slope says, along what the domain lets move."""
    V, F = icosphere(1)
    points = np.concatenate([V, 0.4 * V[:12], [[0.02, 0.01, 0.0]]])
    from scipy.spatial import Delaunay

    tets = Delaunay(points).simplices
    volume = tet_volumes(points, tets)
    tets[volume < 0] = tets[volume < 0][:, [1, 0, 2, 3]]
    tets = tets[np.abs(volume) > 1e-6]
    edge = boundary_vertices(tets)
    rng = np.random.default_rng(0)
    if domain == "ball":
        space = BallDomain(edge)
        start = normalized(points[edge])
    elif domain == "cube":
        side = np.abs(points[edge]).argmax(axis=1)
        space, start = CubeDomain(edge, side), 0.5 * points[edge]
    else:
        space, start = HeldDomain(edge), points[edge]
    at = points + 0.02 * rng.normal(size=points.shape)
    at[edge] = start
    problem = tet_newton.tet_problem(points, tets, space)
    energy = tet_energy(problem.fine, 1.3, 5.0, eps)
    if eps == 0 and not np.isfinite(energy.value(at)):
        at[len(V) :] = points[len(V) :]
    frames = space.frames(at)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (len(at), 1, 1)), atol=1e-12)
    slope, blocks = energy.derivatives(at, frames)
    gradient = problem.assembly.vector(slope, frames)
    way = problem.assembly.spread(tet_newton._solved(problem, blocks, slope, at, gradient), frames)
    if not np.isfinite(energy.value(at)):
        pytest.skip("inverted")
    expected = (slope * way).sum()
    assert expected < 0
    along = slope_of(energy.value, at, way, 1e-7)
    assert along == pytest.approx(expected, rel=1e-4)
    if domain == "held":
        assert not way[edge].any()
    elif domain == "cube":
        assert np.abs(way[edge, side]).max() < 1e-12
    else:
        assert np.abs(np.einsum("bi,bi->b", way[edge], at[edge])).max() < 1e-9
        bent = energy.value(space.retract(at + 1e-4 * way)) - energy.value(at)
        assert bent < 0
