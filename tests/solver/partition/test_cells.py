"""Cells on the triangles of a plane are those of the plane's power diagram, and change as Newton's method believes."""

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.partition import cells
from omt_uv.solver.partition.cells import DivisionProblem, GeodesicDual, geodesic_cells
from omt_uv.solver.partition.clipping import clip, whole_triangles
from omt_uv.solver.partition.polar_coordinates import WindowMesh, polar_coordinates
from omt_uv.solver.partition.sites import Sites, inner
from omt_uv.solver.transport.convex_domain import ConvexPolygon
from omt_uv.solver.transport.power_diagram import power_diagram

SQUARE = ConvexPolygon(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]))


def flat(columns, count, seed=0):
    """A square, sites on it, their windows as wide as all, and its masses."""
    V, F = meshes.grid(columns, columns)
    rng = np.random.default_rng(seed)
    sites = Sites(rng.integers(len(F), size=count), inner(rng.dirichlet(np.ones(3), count)))
    mesh = WindowMesh(V, F)
    return V, F, sites, polar_coordinates(mesh, sites, np.full(count, 5.0), np.arange(count)), face_areas(V, F)


@pytest.mark.parametrize("columns", [1, 3, 12])
@pytest.mark.parametrize("spread", [0.0, 0.01])
def test_areas_are_those_of_the_power_diagram_of_the_plane(columns, spread):
    V, F, sites, pairs, mass = flat(columns, 40)
    weights = spread * np.random.default_rng(1).standard_normal(40)
    cells = geodesic_cells(pairs, weights, mass)
    expected = power_diagram(sites.positions(V, F)[:, :2] - 0.5, -weights, SQUARE).area
    assert np.allclose(cells.area, np.maximum(expected, 0), atol=1e-9)
    assert np.isclose(cells.part.sum(), 1)


def test_the_derivative_is_that_of_the_areas():
    V, F, sites, pairs, mass = flat(7, 15)
    mass = mass * np.random.default_rng(3).uniform(0.5, 2, len(mass))
    cells = geodesic_cells(pairs, np.zeros(15), mass)
    change = np.random.default_rng(2).standard_normal(15)
    step = 1e-7
    found = (geodesic_cells(pairs, step * change, mass).area - geodesic_cells(pairs, -step * change, mass).area) / (
        2 * step
    )
    i, j = cells.side.T
    expected = np.zeros(15)
    np.add.at(expected, i, cells.conductance * (change[j] - change[i]))
    np.add.at(expected, j, cells.conductance * (change[i] - change[j]))
    assert np.allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_sites_at_one_point_do_not_share_it_twice():
    V, F, sites, _, mass = flat(4, 2)
    same = Sites(sites.triangle[[0, 0]], sites.barycentric[[0, 0]])
    pairs = polar_coordinates(WindowMesh(V, F), same, np.full(2, 5.0), np.arange(2))
    assert np.allclose(np.sort(geodesic_cells(pairs, np.zeros(2), mass).area), [0, 1])


def test_windows_grow_with_their_cells():
    V, F, sites, _, mass = flat(12, 4)
    mesh, radius = WindowMesh(V, F), np.full(4, 0.1)
    problem = DivisionProblem(mesh, mass, np.zeros(len(F), np.int64), np.full(4, 0.25))
    dual = GeodesicDual(problem, sites, polar_coordinates(mesh, sites, radius, np.arange(4)), radius)
    assert np.isclose(dual.cells(np.zeros(4)).area.sum(), 1) and dual.radius.min() > 0.2
    assert dual.diagrams > 1


def test_halves_of_a_triangle():
    values = np.array([[-1.0, 1, 1], [-1, -1, 1], [1, 1, 1], [-1, -1, -1]])
    pieces, rows = clip(whole_triangles(4), values, np.arange(4))
    area, _ = pieces.moments()
    assert rows.tolist() == [0, 1, 3] and np.allclose(area, [1 / 8, 3 / 8, 1 / 2])
    assert [sorted(label[:n].tolist()) for label, n in zip(pieces.label, pieces.count, strict=True)] == [
        [-3, -1, 0],
        [-3, -2, -1, 1],
        [-3, -2, -1],
    ]


def test_sides_between_cells_that_tell_no_difference_conduct_nothing():
    """Where two sites are as near all over a face their side has no slope: no infinity, and no number that is none."""
    squared = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [4.0, 2.0, 3.0]])
    pairs = SimpleNamespace(face=np.array([0, 0, 0]), site=np.array([0, 1, 2]), squared=squared)
    side = np.array([[0, 1], [1, 0], [0, 2], [2, 1]])
    i, j, found = cells._against(pairs, np.zeros(3), side, np.array([2.0, 0.0, 6.0, 12.0]), np.arange(3))
    assert (i.tolist(), j.tolist()) == ([0, 1, 0, 2], [1, 0, 2, 1])
    assert found == pytest.approx([0, 0, 6 / (2 * 3), 12 / (2 * 3)])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("parts", [1, 2, 3])
def test_the_direction_mends_the_areas_of_every_part_and_keeps_one_weight_of_each(parts, seed):
    """Areas of cells change by the Laplacian of the direction: that is what they lack, on each part by itself."""
    V, F, *_ = flat(5, 1)
    m, rng = len(F), np.random.default_rng(seed)
    V, F = (
        np.concatenate([V + [2 * k, 0, 0] for k in range(parts)]),
        np.concatenate([F + k * len(V) for k in range(parts)]),
    )
    n = 7 * parts
    sites = Sites(np.repeat(m * np.arange(parts), 7) + rng.integers(m, size=n), inner(rng.dirichlet(np.ones(3), n)))
    # In no order of their parts.
    order = rng.permutation(n)
    sites = Sites(sites.triangle[order], sites.barycentric[order])
    mesh, radius, part = WindowMesh(V, F), np.full(n, 5.0), np.repeat(np.arange(parts), m)
    asked = np.full(n, 1 / 7)
    problem = DivisionProblem(mesh, face_areas(V, F), part, asked)
    dual = GeodesicDual(problem, sites, polar_coordinates(mesh, sites, radius, np.arange(n)), radius)
    found = dual.cells(np.zeros(n))
    direction = dual.direction(found, asked)
    (i, j), flow = found.side.T, np.zeros(n)
    np.add.at(flow, i, found.conductance * (direction[i] - direction[j]))
    np.add.at(flow, j, found.conductance * (direction[j] - direction[i]))
    has = found.area > 0
    np.testing.assert_allclose(flow[has], (found.area - asked)[has], atol=1e-9)
    for k in range(parts):
        own = direction[part[sites.triangle] == k]
        assert np.count_nonzero(own == 0) == 1 + np.count_nonzero(~has[part[sites.triangle] == k])
