"""Pieces of the search for seams: coarse surfaces, arcs, rehearsals, parts; against loops, and what they decide."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.mesh.charts import Chart
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.seams import coarse_cut, coarse_surface, cut_tree, growth, parting, path_graph, rehearsal
from omt_uv.solver.seams.coarse_cut import CoarseCut
from omt_uv.solver.seams.options import SearchOptions
from omt_uv.solver.seams.search import SeamSearch


def shrinking(seed=0):
    V, F = meshes.icosphere(1)
    V = V + 0.1 * np.random.default_rng(seed).normal(size=V.shape)
    kind = (np.arange(len(V)) % 5 == 0).astype(int)
    return coarse_surface._ShrinkingMesh(V, F, kind, len(V), 0), V, F, kind


@pytest.mark.parametrize("seed", range(2))
def test_vertices_go_to_the_nearest_of_their_kind_and_edges_at_many_faces_are_dear(seed):
    mesh, V, F, kind = shrinking(seed)
    parent, price = mesh._parents(*halfedges(F))
    degree = np.bincount(F.ravel())
    for v in range(len(V)):
        around = sorted(set(F[(v == F).any(axis=1)].ravel().tolist()) - {v})
        prices = {
            u: np.linalg.norm(V[u] - V[v]) * (1 + max(degree[u] + degree[v] - 13, 0))
            for u in around
            if kind[u] == kind[v]
        }
        if prices:
            assert parent[v] == min(prices, key=prices.get) and price[v] == pytest.approx(min(prices.values()))
        else:
            assert parent[v] == -1 and np.isinf(price[v])


@pytest.mark.parametrize("seed", range(2))
def test_fans_fill_stars_from_where_their_vertices_go(seed):
    mesh, V, F, _ = shrinking(seed)
    parent, _ = mesh._parents(*halfedges(F))
    fans, n = mesh._fans(parent), len(V)
    for v in range(n):
        star = [np.roll(f, -f.tolist().index(v)) for f in F if v in f]
        u = parent[v]
        new = [(u, a, b) for _, a, b in star if u >= 0 and u not in (a, b)]
        shape, bend, turned, keys = 1.0, 0.0, False, []
        for _, a, b in new:
            one, other = np.cross(V[a] - V[v], V[b] - V[v]), np.cross(V[a] - V[u], V[b] - V[u])
            squares = sum(((p - q) ** 2).sum() for p, q in ((V[a], V[u]), (V[b], V[a]), (V[u], V[b])))
            shape = min(shape, 2 * np.sqrt(3) * np.linalg.norm(other) / squares)
            cosine = one @ other / np.linalg.norm(one) / np.linalg.norm(other)
            bend, turned = max(bend, 1 - cosine), turned or cosine < 0.2
        assert fans.shape[v] == pytest.approx(max(shape, 1e-4)) and fans.bend[v] == pytest.approx(bend)
        assert fans.turned[v] == turned
        # New edges are those to what is around and no neighbour of the parent in the star.
        if u >= 0:
            beside = {x for f in star if u in f for x in f} | {v, u}
            keys = sorted(min(u, x) * n + max(u, x) for x in {int(y) for f in star for y in f} - beside)
        assert sorted(fans.key[fans.owner == v].tolist()) == keys


@pytest.mark.parametrize("seed", range(3))
def test_vertices_are_let_go_with_the_last_that_names_them(seed):
    rng = np.random.default_rng(seed)
    vertices, when, needed = rng.integers(0, 6, 15), rng.integers(0, 9, 15), rng.integers(1, 4, 6)
    expected = [(v, max(when[vertices == v])) for v in range(6) if (vertices == v).sum() == needed[v]]
    found = cut_tree._with_the_last(vertices, when, needed)
    assert list(zip(*(x.tolist() for x in found), strict=True)) == [(v, int(w)) for v, w in expected]


def test_paths_are_counted_from_the_cut_on_with_their_images():
    image = np.array([0, 5, 2, 6, 4, 1, 3, 7])
    path = np.array([3, 4, 1, 7])
    new, count = growth._from_cut_on(path, image)
    assert new.tolist() == [1, 5, 4, 3, 6] and count.tolist() == [5, 3, 2]


def cut_of(cost, spread):
    return cut_tree.Cut(np.zeros(1, int), np.zeros(0, int), spread, cost)


def coarse_cut_of(cost, spread, bound=1.0, base=0.0, **task):
    setting = SimpleNamespace(base_cost=base, coarse=SimpleNamespace(boundary=np.zeros(1, bool)))
    return CoarseCut(setting, cut_tree.Task(None, None, bound, None), cut_of(cost, spread), np.zeros(1, bool), None)


@pytest.mark.parametrize("spread, factor", [(0.25, 0.5**0.3), (0.5, 0.5**0.3), (1.0, 1.0), (4.0, 4**0.3)])
def test_cuts_are_compared_at_one_spread(spread, factor):
    assert cut_of(3.0, spread).score(1.0) == pytest.approx(3 * factor)
    assert coarse_cut_of(3.0, spread, base=2.0).score == pytest.approx(2 + 3 * max(factor, 1.0))


def test_the_first_of_even_cuts_is_the_best_and_stuck_is_far_from_its_bound():
    cuts = [coarse_cut_of(c, 1.0) for c in (3.0, 2.0, 2.0 * (1 - 1e-13), 2.5)]
    assert coarse_cut.best_of(cuts) is cuts[1]
    assert not coarse_cut_of(1, 2.0 * 0.999).is_stuck and not coarse_cut_of(1, 2.0).is_stuck
    assert coarse_cut_of(1, 2.0 * 1.001).is_stuck


def test_steps_across_edges_are_as_long_as_over_both_triangles_laid_flat():
    V, F = meshes.random_disk(40, 1)
    ends, length = path_graph._across(V, F, twins(F))
    found, expected = sorted((*sorted(e), x) for e, x in zip(ends.tolist(), length.tolist(), strict=True)), []
    for i in range(len(F)):
        for j in range(i):
            shared = sorted(set(F[i].tolist()) & set(F[j].tolist()))
            if len(shared) != 2:
                continue
            p, q = (next(v for v in F[k].tolist() if v not in shared) for k in (i, j))
            a, b = V[shared[0]], V[shared[1]]
            x = (b - a) / np.linalg.norm(b - a)
            along = [(V[v] - a) @ x for v in (p, q)]
            away = [np.linalg.norm((V[v] - a) - t * x) for v, t in zip((p, q), along, strict=True)]
            crossing = along[0] + (along[1] - along[0]) * away[0] / sum(away)
            if 0 < crossing < np.linalg.norm(b - a):
                expected.append((*sorted((p, q)), np.hypot(along[1] - along[0], sum(away))))
    np.testing.assert_allclose(found, sorted(expected))
    assert len(found) > 5


def test_points_in_rows_are_the_middles_of_equal_parts():
    found = parting._in_rows(4)
    assert found.shape == (10, 3) and (found > 0).all()
    np.testing.assert_allclose(found.sum(axis=1), 1)
    np.testing.assert_allclose(found.mean(axis=0), 1 / 3)
    assert len(np.unique(np.round(found, 9), axis=0)) == 10


def chart_of(V, F, faces):
    return Chart(V, F, np.arange(F.size).reshape(-1, 3), np.array(faces), np.arange(len(V)))


def test_outlines_are_sharp_by_most_of_their_length():
    V, F = meshes.grid(3, 1, width=3.0)
    chart = chart_of(V, F, [0, 1, 2, 0, 1, 2])
    graph = parting.PolygonGraph.of(chart)
    kept = np.zeros(len(graph.joined), bool)
    assert len(kept) == 2
    sharp = np.array([set(pair.tolist()) == {0, 1} for pair in graph.joined])
    found = parting._in_sharp_outlines(chart, graph, kept, sharp)
    # The middle one has a half, which is not most.
    assert found.tolist() == [True, False, False]
    assert parting._in_sharp_outlines(chart, graph, kept, ~kept).all()


def test_positions_of_a_chart_are_found_by_the_vertices_of_the_surface():
    V, F = meshes.single_triangle()
    chart = Chart(V, F, F, np.array([0]), np.array([4, -1, 2]))
    found = parting._of_surface(chart)
    np.testing.assert_allclose(found, [[0] * 3, [0] * 3, V[2], [0] * 3, V[0]])


def test_crumbs_between_a_cut_and_its_image_join_what_they_share_most_of():
    # A strip of a hundred squares, of which one lies between two cuts, one of them twice as long.
    V, F = meshes.grid(100, 1, width=100.0)
    V = V.copy()
    faces = np.tile(np.arange(100), 2)
    chart = chart_of(V, F, faces)
    graph = parting.PolygonGraph.of(chart)
    one, other = (np.array([set(p.tolist()) == {k, k + 1} for p in graph.joined]) for k in (49, 50))
    found = parting._without_crumbs(chart, graph, one, one | other)
    assert found.sum() == 1 and (found & (one | other)).any()
    far = np.array([set(p.tolist()) == {70, 71} for p in graph.joined])
    np.testing.assert_array_equal(parting._without_crumbs(chart, graph, one, one | far), one | far)


# What a search and a rehearsal decide.


def search_of(**given):
    fields = {
        "spread": np.array([1.0, np.inf, np.inf]),
        "surface": SimpleNamespace(positions=np.zeros((4, 3))),
        "costs": lambda: SimpleNamespace(
            of=lambda a, b: 1.0 + a + b,
            plane=None,
            in_face=np.array([True, False, False, True]),
            within_face=np.array([True, False, False, False]),
        ),
    }
    return SeamSearch(**fields | given)


@pytest.mark.parametrize(
    "polygons, marked, further, wants",
    [
        ([0, 1], False, False, True),
        ([1, 2], False, False, False),
        ([1, -1], False, False, False),
        ([0], True, False, False),
        ([0], True, True, True),
        ([2], True, True, False),
    ],
)
def test_components_are_searched_where_a_spread_is_asked_for_and_nothing_is_marked(polygons, marked, further, wants):
    assert search_of(further=further).wants(np.array(polygons), marked) == wants


def test_a_search_is_again_once_a_share_is_asked_for():
    assert not search_of().is_again and search_of(share=np.ones(3)).is_again


def test_costs_of_artists_count_at_edges_of_the_surface_alone():
    component = component_of(*meshes.grid(2, 1))
    before = component.cost.copy()
    found = search_of().priced(component)
    ends = component.vertex_ids[component.ends]
    for k, (a, b) in enumerate(ends.tolist()):
        assert found.cost[k] == pytest.approx(before[k] * (1 + a + b if max(a, b) < 4 else 1))
    np.testing.assert_array_equal(component.cost, before)
    tips = search_of()._tip_factor(component)
    np.testing.assert_allclose(tips, np.where(np.isin(component.vertex_ids, [0, 3]), 0.3, 1.0))
    # Within a face that had holes, which were filled, hardly any is worth its way.
    polygons = np.r_[component.polygons[:-1], -1]
    tips = search_of()._tip_factor(replace(component, polygons=polygons))
    np.testing.assert_allclose(tips, np.array([0.03, 1.0, 1.0, 0.3, 1.0, 1.0])[component.vertex_ids])


@pytest.mark.parametrize("residual, worth", [(None, 1.5), (0.0, 1.5), (99.0, 1.0)])
def test_seams_of_what_is_symmetric_may_cost_more(residual, worth):
    plane = None if residual is None else SimpleNamespace(residual=residual)
    assert search_of(costs=lambda: SimpleNamespace(plane=plane))._worth_of_symmetry() == worth


@pytest.mark.parametrize("vertices, finer, trials", [(10, 1.0, 1), (5, 1.0, 3), (5, 1.5, 3), (5, 2.0, 1)])
def test_what_is_small_is_searched_on_itself_alone(vertices, finer, trials):
    options = SearchOptions(vertices=vertices, trials=3)
    assert search_of(options=options)._trials(SimpleNamespace(vertex_count=10), finer) == trials


def test_densities_of_a_coarse_surface_are_half_logarithms_about_their_mean():
    component = component_of(*meshes.grid(3, 2))
    density = np.random.default_rng(0).uniform(0.5, 2, len(component.triangles))
    coarse = SimpleNamespace(kept=np.array([0, 3, 5]))
    assert search_of()._log_density(component, coarse) is None
    found = search_of(density=density)._log_density(component, coarse)
    at = [
        np.mean(
            [0.5 * np.log(density[p]) for p, t in zip(component.polygons, component.triangles, strict=True) if v in t]
        )
        for v in range(component.vertex_count)
    ]
    np.testing.assert_allclose(found, (np.array(at) - np.mean(at))[[0, 3, 5]])


def rehearsed(values):
    """A rehearsal that tells these squares of log(shear) by the cost of a cut."""
    told = rehearsal.Rehearsal(None, None, None, {})
    asked = []

    def of(found):
        asked.append(found.cut.cost)
        return values[found.cut.cost]
        yield

    object.__setattr__(told, "of", of)
    return told, asked


def test_prices_are_those_of_what_keeps_what_is_asked_for():
    one = coarse_cut_of(3.0, 1.0, base=2.0)
    assert rehearsal._price(one, 0.5, 0.4) == pytest.approx(5 * 0.5**0.9)
    assert rehearsal._price(one, 0.3, 0.4) == pytest.approx(5 * 0.4**0.9)


@pytest.mark.parametrize(
    "values, best, asked",
    [
        ({1.0: 0.4, 1.5: 0.1, 2.0: 0.1}, 1.0, [1.0]),  # the cheapest keeps it, and the next would be dearer
        ({1.0: 0.9, 1.5: 0.4, 2.0: 0.4}, 1.5, [1.0, 1.5]),
        ({1.0: 0.45, 1.5: 0.4, 2.0: 0.4}, 1.0, [1.0]),
        ({1.0: None, 1.5: 0.4, 2.0: 0.1}, "score", [1.0, 1.5]),
    ],
)
def test_the_cut_is_best_that_costs_least_for_what_it_shears(values, best, asked):
    cuts = [coarse_cut_of(c, s) for c, s in ((2.0, 1.0), (1.0, 9.0), (1.5, 8.0))]
    told, heard = rehearsed(values)
    found = drain(told.best_of(cuts, 0.4))
    assert found is (coarse_cut.best_of(cuts) if best == "score" else next(c for c in cuts if c.cut.cost == best))
    assert heard == asked
    alone, heard = rehearsed(values)
    assert drain(alone.best_of(cuts[:1], 0.4)) is cuts[0] and heard == []


def test_seams_close_no_loops_with_their_images_and_the_boundary_is_one_vertex():
    boundary = np.zeros(8, bool)
    boundary[[0, 7]] = True
    seams = np.array([[0, 1], [1, 2], [2, 3]])
    more = np.array([[3, 4], [4, 1], [3, 7], [5, 6], [2, 1]])
    found = {tuple(e) for e in rehearsal._without_loops(seams, more, boundary).tolist()}
    assert {(0, 1), (1, 2), (2, 3), (5, 6)} <= found
    # One of the two that would close the loop over 4 goes, and the way back to the boundary.
    assert len(found & {(3, 4), (1, 4)}) == 1 and (3, 7) not in found


def test_halves_end_in_the_plane_and_have_half_of_the_area():
    V, F = meshes.two_bumps(6)
    plane = np.abs(V[:, 0] - 0.5) < 1e-9
    half = F[(V[F][:, :, 0] <= 0.5 + 1e-9).all(axis=1)]
    assert coarse_surface.is_half(V, F, half, plane)
    assert not coarse_surface.is_half(V, F, half, np.zeros(len(V), bool))
    assert not coarse_surface.is_half(V, F, half[2:], plane)
    assert not coarse_surface.is_half(V, F, F, plane)
    height, normal = V[:, 0] - 0.5, np.array([1.0, 0, 0])
    seams = np.array([half[0][:2]])
    found = rehearsal._doubled(V, half, seams, plane, height, normal)
    assert face_areas(found.positions, found.triangles).sum() == pytest.approx(face_areas(V, F).sum())
    assert len(found.positions) == len(V) and len(found.seams) == (1 if plane[seams[0]].all() else 2)
    for v, p in zip(found.vertex, found.positions, strict=True):
        assert np.allclose(p, V[v]) or np.allclose(p, [1 - V[v, 0], V[v, 1], V[v, 2]])
    normals = np.cross(
        *(found.positions[found.triangles[:, k]] - found.positions[found.triangles[:, 0]] for k in (1, 2))
    )
    assert (normals[:, 2] > 0).all() or (normals[:, 2] < 0).all()


def test_ways_between_vertices_are_the_shortest():
    V, F = meshes.bumpy(4, 4)
    n = len(V)
    far = np.full((n, n), np.inf)
    np.fill_diagonal(far, 0)
    for a, b in zip(*halfedges(F), strict=True):
        far[a, b] = far[b, a] = np.linalg.norm(V[a] - V[b])
    for k in range(n):
        far = np.minimum(far, far[:, [k]] + far[[k]])
    for one, other in ((0, n - 1), (3, 20)):
        found = rehearsal._ways(V, F, np.array([[one, other]]))
        assert np.linalg.norm(V[found[:, 0]] - V[found[:, 1]], axis=1).sum() == pytest.approx(far[one, other])
        assert {one, other} == {v for v in found.ravel().tolist() if found.ravel().tolist().count(v) == 1}
    assert len(rehearsal._ways(V, F, np.zeros((0, 2), int))) == 0
