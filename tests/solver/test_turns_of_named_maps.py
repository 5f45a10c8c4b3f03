"""Maps by name, diagrams of transport, poles that are made vertices, and first meshes, with their steps written in
advance."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import told, worked

from omt_uv.pipelines.measuring import diagrams
from omt_uv.solver.canonical import named_maps
from omt_uv.solver.canonical.markers import ChartMarkers
from omt_uv.solver.canonical.named_maps import NamedMap, NamedProblem
from omt_uv.solver.errors import BoundaryError, PrecisionError
from omt_uv.solver.globe import pole_vertices
from omt_uv.solver.mesh.spherical_geometry import normalized
from omt_uv.solver.remeshing.initial import initial_mesh

V, F = meshes.grid(2, 2)
OUTLINE = np.array([0, 1, 2, 5, 8, 7, 6, 3])


# ---- maps by name -------------------------------------------------------------------------------------------


@pytest.fixture
def turned(monkeypatch):
    """Markers that move maps by 100, and by 1000 in a disk."""
    monkeypatch.setattr(ChartMarkers, "turned", lambda self, uv: uv + 100)
    monkeypatch.setattr(ChartMarkers, "in_disk", lambda self, uv, loop: uv + 1000)


@pytest.mark.parametrize("folds", [0, 1, 3])
def test_a_free_conformal_map_tells_of_faces_that_it_turns_over(folds, turned, monkeypatch):
    monkeypatch.setattr(named_maps, "boundary_first", lambda *_: SimpleNamespace(uv=V[:, :2]))
    monkeypatch.setattr(named_maps, "count_folds", lambda *_: folds)
    found, _ = told(named_maps.conformal_map(NamedProblem(V, F, np.ones(8))))
    assert np.array_equal(found.uv, V[:, :2] + 100) and len(found.warnings) == (folds > 0)
    assert not folds or ("turns a face over" if folds == 1 else "turns 3 faces over") in found.warnings[0]


def test_a_conformal_map_to_the_disk_is_turned_within_it(turned, monkeypatch):
    monkeypatch.setattr(named_maps, "conformal_disk", lambda *_: worked(SimpleNamespace(uv=V[:, :2], straightened=4)))
    found, _ = told(named_maps.conformal_map(NamedProblem(V, F, np.ones(8), "disk")))
    assert np.array_equal(found.uv, V[:, :2] + 1000) and found.untangled == 4 and found.warnings == ()


@pytest.mark.parametrize(
    ("aspect", "stretched"), [(0.0, False), (0.5, False), (0.5004, False), (0.501, True), (2.0, True)]
)
def test_a_conformal_map_to_a_rectangle_is_about_its_middle_and_stretched_where_that_is_asked_for(
    aspect, stretched, monkeypatch
):
    uv = V[:, :2] * [1, 0.5]
    monkeypatch.setattr(
        named_maps, "conformal_rectangle", lambda *_: worked(SimpleNamespace(uv=uv, aspect=0.5, straightened=0))
    )
    found, _ = told(named_maps.conformal_map(NamedProblem(V, F, np.ones(8), "rectangle", OUTLINE[::2], aspect)))
    assert found.uv == pytest.approx((uv - [0.5, 0.25]) * [1, aspect / 0.5 if stretched else 1])
    assert len(found.warnings) == stretched and (not stretched or "aspect 0.5; it was stretched" in found.warnings[0])


@pytest.mark.parametrize("balance", [0.0, 0.25])
@pytest.mark.parametrize("folds", [0, 3])
@pytest.mark.parametrize("cornered", [False, True])
def test_a_polar_map_puts_every_vertex_into_the_middle_of_its_cell(cornered, folds, balance, turned, monkeypatch):
    asked, left = [], [folds, 1]
    first = NamedMap(V[:, :2] * [4, 1], "conformal", warnings=("first",))
    monkeypatch.setattr(named_maps, "conformal_map", lambda disk: worked(first))
    cells = SimpleNamespace(cells=SimpleNamespace(centroid="centroids"), site_weights=np.arange(9.0))

    def transport(sites, mass, domain):
        asked.append((sites, mass, domain))
        return worked(cells)

    def diagram(sites, weights, domain):
        asked.append(weights)
        return SimpleNamespace(centroid="balanced")

    def centroids(centroid, domain, loop, corners, warnings):
        asked.append(centroid)
        return V[:, :2]

    monkeypatch.setattr(named_maps, "transport", transport)
    monkeypatch.setattr(named_maps, "power_diagram", diagram)
    monkeypatch.setattr(named_maps, "centroid_map", centroids)
    monkeypatch.setattr(named_maps, "count_folds", lambda *_: left.pop(0) if len(left) > 1 else (1 if folds else 0))
    monkeypatch.setattr(named_maps, "untangle", lambda uv, *_: (uv + 10, "told"))
    target = np.arange(1.0, 9.0)
    problem = NamedProblem(V, F, target, "rectangle" if cornered else "disk", OUTLINE[::2] if cornered else None)
    found, fractions = told(named_maps.polar_map(problem, balance))
    sites, mass, domain = asked[0]
    want = [sum(target[k] / 3 for k in range(8) if v in F[k]) for v in range(9)]
    assert mass == pytest.approx(want)
    if cornered:
        # A rectangle of area 1, and everything just inside of it.
        assert (domain.width, domain.height) == pytest.approx((2.0, 0.5))
        assert sites == pytest.approx(first.uv / 2 * (1 - 1e-9))
    else:
        assert sites is first.uv
    assert asked[-1] == ("balanced" if balance else "centroids")
    assert not balance or asked[1] == pytest.approx(0.75 * np.arange(9.0))
    moved = 10 * (folds > 0) + 100 * (not cornered)
    assert np.array_equal(found.uv, V[:, :2] + moved) and found.untangled == max(folds - 1, 0)
    assert found.warnings == (("first", "told") if folds else ("first",)) and found.conformal == "conformal"
    assert found.sites is sites and found.cells is cells and (np.diff(fractions) >= 0).all() and fractions[-1] == 1


def test_a_polar_map_has_a_convex_domain():
    with pytest.raises(BoundaryError, match="A polar factorisation needs a convex domain"):
        told(named_maps.polar_map(NamedProblem(V, F, np.ones(8))))


# ---- diagrams -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("domain", ["disk", "square", "rectangle"])
def test_diagrams_are_those_of_the_largest_chart_in_its_domain(domain, monkeypatch):
    asked = {}

    def chart(shift, triangles):
        return SimpleNamespace(vertices=V + shift, triangles=triangles, disk=triangles)

    charts = SimpleNamespace(charts=[chart(5, F[:2]), chart([3, 4, 5], F), chart(7, F[:3])], warnings=("cut", "both"))
    monkeypatch.setattr(
        diagrams, "disk_charts", lambda surface, faces, fill_holes: worked(charts if not fill_holes else None)
    )
    monkeypatch.setattr(diagrams, "rectangle_corners", lambda *_: "of a rectangle")
    monkeypatch.setattr(diagrams, "sharpest_corners", lambda *_: "sharpest")

    def polar(problem):
        asked["problem"] = problem
        cells = SimpleNamespace(site_weights="weights", residual=0.5, iterations=6)
        return worked(SimpleNamespace(cells=cells, sites="sites", uv=V[:, :2] * [4, 3], warnings=("both", "map")))

    def planar(sites, weights, shape):
        asked["shape"] = (sites, weights, shape)
        return "cells"

    monkeypatch.setattr(diagrams, "polar_map", polar)
    monkeypatch.setattr(diagrams, "planar_cells", planar)
    found, fractions = told(diagrams.diagram(None, None, domain))
    problem = asked["problem"]
    assert problem.vertices.mean(axis=0) == pytest.approx([0, 0, 0]) and len(problem.triangles) == 8
    assert problem.target == pytest.approx(np.full(8, 1 / 8)) and problem.boundary == domain
    assert problem.corners == {"disk": None, "square": "sharpest", "rectangle": "of a rectangle"}[domain]
    assert problem.aspect == (1.0 if domain == "square" else 0.0)
    sites, weights, shape = asked["shape"]
    assert (sites, weights) == ("sites", "weights")
    assert domain == "disk" or (shape.width, shape.height) == (4.0, 3.0)
    assert (
        found.cells == "cells"
        and found.shares.sum() == pytest.approx(1)
        and (found.residual, found.iterations) == (0.5, 6)
    )
    assert found.warnings == ("cut", "both", "map")
    assert fractions == pytest.approx([0, 0.2, 0.2, 1.0])


def test_diagrams_of_the_sphere_are_of_what_is_chosen(monkeypatch):
    P, T = meshes.icosphere(0)
    surface = meshes.polygon_surface(np.concatenate([P[:1] * 9, P]), (T + 1).tolist())
    asked = {}

    def conformal(vertices, triangles):
        asked["closed"] = vertices, triangles
        return worked(SimpleNamespace(triangles=T, sites="sites"))

    def transport(sites, mass, hull):
        asked["mass"] = mass
        cells = SimpleNamespace(hull="hull")
        return worked(SimpleNamespace(site_weights="weights", cells=cells, residual=0.25, iterations=3))

    monkeypatch.setattr(diagrams, "conformal_sphere", conformal)
    monkeypatch.setattr(diagrams, "sphere_transport", transport)
    monkeypatch.setattr(diagrams, "spherical_cell_polygons", lambda *words: words)
    found, fractions = told(diagrams.diagram(surface, None, "sphere"))
    assert asked["closed"][0].shape == (12, 3) and found.cells == ("sites", "weights", "hull")
    assert found.shares == pytest.approx(np.full(12, 1 / 12)) and (found.residual, found.iterations) == (0.25, 3)
    assert asked["mass"] == pytest.approx(found.shares * asked["mass"].sum()) and fractions == pytest.approx(
        [0, 0.4, 0.4, 1.0]
    )


# ---- poles --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("fails", "chosen"), [((), 3), ((3,), 5), ((3, 5), -1)])
@pytest.mark.parametrize("folds", [False, True])
def test_the_first_vertex_whose_faces_can_be_straightened_is_put_onto_the_pole(folds, fails, chosen, monkeypatch):
    P, T = meshes.icosphere(1)
    target, tried = normalized(P[[3]] + 0.2)[0], []

    def straighten(points, triangles, moved, area, free):
        (vertex,) = np.flatnonzero((moved != points).any(axis=1))
        tried.append((int(vertex), bool(free[vertex]), bool(free[7]), bool(free.any())))
        assert np.array_equal(moved[vertex], target) and (area >= 0).all()
        if vertex not in fails:
            return worked(moved + 0.0 if not folds else -moved)
        return worked(None)

    monkeypatch.setattr(pole_vertices, "straighten_around", straighten)
    monkeypatch.setattr(
        pole_vertices, "signed_volumes", lambda p, t: np.where((p[t] * P[t]).sum((1, 2)) > 0, 1.0, -1.0)
    )
    points, vertex = pole_vertices._put_and_straighten(P, T, target, np.array([3, 5]), np.array([7, -1]))
    if folds:
        # What turns over a face that lay rightly is no use.
        assert vertex == -1 and points is P
    else:
        assert vertex == chosen and (chosen < 0) == (points is P)
        assert chosen < 0 or np.array_equal(points[chosen], target)
    # Neither the vertex itself nor what was put before may move.
    assert [t[0] for t in tried] == ([3, 5] if folds or fails else [3]) and all(
        t[1:] == (False, False, True) for t in tried
    )


# ---- first meshes -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vertices", [True, False])
@pytest.mark.parametrize("state", ["good", "no map", "crowded"])
def test_first_meshes_by_way_of_the_sphere(state, vertices, monkeypatch):
    asked, given_up = [], []
    pair = SimpleNamespace(pair=lambda strategy: (strategy, "places"), warnings=("map",))
    component = SimpleNamespace(vertices=V, triangles=F, area=np.full(8, 0.25), to_reopen="edges")
    maps = SimpleNamespace(
        component=component,
        of_sphere=lambda density: worked(None if state == "no map" else pair),
        give_up=given_up.append,
    )

    def sample(v, t, one, other, count):
        asked.append((one, other, count))
        if state == "crowded":
            raise PrecisionError("too thin")
        return SimpleNamespace(points=np.zeros((count, 3)), triangles=np.zeros((5, 3), int))

    monkeypatch.setattr(initial_mesh, "sample_sphere", sample)
    monkeypatch.setattr(initial_mesh, "edge_length", lambda measure, boundary, count: (measure, boundary, count))
    monkeypatch.setattr(initial_mesh, "WorkingMesh", lambda *words: words)
    options = SimpleNamespace(counts_vertices=vertices, strategy="strategy", delaunay="delaunay")
    least = initial_mesh.INITIAL_VERTICES
    for count in (3, 10 * least):
        found, _ = told(initial_mesh._by_sphere(maps, count, np.full(8, 2.0), options))
        n = count if vertices else max(count // 2 + 2, 4)
        if state != "good":
            assert found is None
            continue
        assert asked[-1] == ("strategy", "places", max(n, least))
        points, _, fixed, locked, delaunay = found.mesh
        assert (
            len(points) == len(fixed) == max(n, least)
            and not fixed.any()
            and len(locked) == 0
            and delaunay == "delaunay"
        )
        assert found.size == (4.0, 0.0, n) and (found.vertex_count, found.line_spacing, found.reopened_copies) == (
            n,
            1.0,
            0,
        )
        assert found.warnings == ("map",) and found.to_reopen == "edges"
    assert given_up == (["too thin"] * 2 if state == "crowded" else [])


@pytest.mark.parametrize("vertices", [True, False])
@pytest.mark.parametrize("first", [5, 500])
def test_first_meshes_by_collapses(first, vertices, monkeypatch):
    component = SimpleNamespace(area=np.full(8, 0.25), to_reopen="edges", euler=-2)
    maps = SimpleNamespace(component=component, warnings=("maps",))
    monkeypatch.setattr(initial_mesh, "initial_vertex_count", lambda component: first)
    monkeypatch.setattr(initial_mesh, "edge_length", lambda measure, boundary, count: (measure, boundary, count))
    monkeypatch.setattr(initial_mesh, "decimated", lambda component, count, density, size: (count, size))
    found = initial_mesh._by_decimation(maps, 100, np.full(8, 2.0), SimpleNamespace(counts_vertices=vertices))
    n = 100 if vertices else 48
    at = max(n, first)
    assert found.mesh == (at, (4.0, 0.0, at)) and found.size == (4.0, 0.0, n) and found.vertex_count == n
    assert (found.line_spacing, found.reopened_copies, found.to_reopen, found.warnings) == (1.0, 0, "edges", ("maps",))


@pytest.mark.parametrize("fails", [None, 0, 1])
def test_first_meshes_by_charts_are_stitched_unless_one_has_no_map(fails, monkeypatch):
    asked = []
    boundary = SimpleNamespace(samples=np.arange(4))
    from dataclasses import dataclass

    @dataclass(frozen=True)
    class Plan:
        network: object
        samples: object
        vertex_count: int = 40
        initial_vertex_count: int = 60
        warnings: tuple = ("plan",)

    network = SimpleNamespace(sides=["a", "b"], arcs=None, loops=["one", "other"])
    made = Plan(network, SimpleNamespace(points=np.zeros((10, 3))))
    charts = [SimpleNamespace(triangles=np.zeros((2, 3))), SimpleNamespace(triangles=np.zeros((6, 3)))]
    maps = SimpleNamespace(component=SimpleNamespace(triangles=np.zeros((8, 3))), charts=charts)

    def mesh(maps, k, loop, boundary, count, density, options):
        asked.append((k, loop, count))
        return worked((None, ()) if k == fails else (f"mesh {k}", (f"told {k}",)))

    def inner(charts, boundaries, density, left):
        asked.append(left)
        return np.array([7, 9])

    monkeypatch.setattr(initial_mesh, "plan_samples", lambda *_: made)
    monkeypatch.setattr(initial_mesh, "chart_boundary", lambda *_: boundary)
    monkeypatch.setattr(initial_mesh, "_inner_counts", inner)
    monkeypatch.setattr(initial_mesh, "_chart_mesh", mesh)
    monkeypatch.setattr(initial_mesh, "stitch", lambda points, boundaries, meshes: ("points", meshes))
    monkeypatch.setattr(
        initial_mesh, "_stitched", lambda maps, plan, points, triangles, told, delaunay: (triangles, told)
    )
    monkeypatch.setattr(initial_mesh, "_by_decimation_between_lines", lambda maps, plan, *_: plan.warnings)
    options = SimpleNamespace(any_mesh_will_do=False, delaunay=True)
    found, fractions = told(initial_mesh._by_charts(maps, 40, None, None, options, 1.0))
    # Of the sixty at first ten are there on lines.
    assert asked[:2] == [50, (0, "one", 7)] and fractions[:3] == pytest.approx([0, 0, 0.25])
    if fails is None:
        assert found == (["mesh 0", "mesh 1"], ("told 0", "told 1")) and fractions[3:] == pytest.approx([0.25, 1.0])
    else:
        assert found == ("plan", initial_mesh.NO_MAPS)
    options.any_mesh_will_do = True
    assert told(initial_mesh._by_charts(maps, 40, None, None, options, 1.0))[0] == ("plan",)
