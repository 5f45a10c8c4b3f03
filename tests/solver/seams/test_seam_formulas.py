"""Parts, necks and paths of seams against plain ways: all cuts of a small chart, walks along paths, measured boxes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.sparse import csr_matrix
from short_cuts import component_of

from omt_uv.solver.analysis.symmetry_plane import MirrorImages
from omt_uv.solver.linalg.minimum_cut import capacities
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops, twins
from omt_uv.solver.seams import fine_paths, growth, limbs, parting, path_graph, predicted_scale
from omt_uv.solver.seams.coarse_surface import CoarseSurface, coarsening
from omt_uv.solver.seams.parting import PolygonGraph

UP = (0.0, 0.0, 1.0)


def patch(columns=4, rows=3, quads=True):
    """A bumpy chart of quads, shaken, and a map of it."""
    V, F = meshes.bumpy(columns, rows)
    V = V + 0.03 * np.random.default_rng(0).normal(size=V.shape)
    surface = triangle_surface(V, F)
    if quads:
        polygons = polygons_of(F)
        surface = meshes.polygon_surface(V, polygons)
    (chart,) = strict_charts(surface)
    return surface, chart, chart.vertices[:, :2] * [2, 1]


def polygons_of(F):
    """Quads of triangles that come in pairs with a common diagonal, as polygons."""
    found = []
    half = {}
    for t, f in enumerate(F.tolist()):
        for a, b, c in (f, f[1:] + f[:1], f[2:] + f[:2]):
            half.setdefault(frozenset((a, b)), []).append((t, a, b, c))
    used = set()
    for pair in sorted(half.values(), key=lambda p: -max(np.linalg.norm(np.subtract(p[0][1], p[0][2])), 0)):
        if len(pair) == 2 and not used & {pair[0][0], pair[1][0]} and abs(pair[0][1] - pair[0][2]) not in (1,):
            (t, a, b, c), (s, _, _, d) = pair
            if s == t + 1 or t == s + 1:
                used |= {t, s}
                found.append([a, d, b, c])
    return found + [f for t, f in enumerate(F.tolist()) if t not in used]


def shared_edges(chart):
    """Of every two polygons the vertices (a, b) of the edges between them."""
    edges = {}
    for face, f in zip(chart.faces, chart.triangles, strict=True):
        for a, b in zip(f, np.roll(f, -1), strict=True):
            edges.setdefault(frozenset((int(a), int(b))), []).append(int(face))
    return {e: tuple(sorted(p)) for e, p in edges.items() if len(p) == 2 and p[0] != p[1]}


def test_the_graph_of_polygons_is_that_of_their_shared_edges():
    _, chart, uv = patch()
    graph = PolygonGraph.of(chart)
    names = np.unique(chart.faces)
    found = {frozenset(e): tuple(sorted(names[p])) for e, p in zip(graph.ends.tolist(), graph.joined, strict=True)}
    assert found == shared_edges(chart) and len(graph.ends) == len(found)
    area, middle = face_areas(chart.vertices, chart.triangles), uv[chart.triangles].mean(axis=1)
    cost = np.random.default_rng(0).uniform(1, 2, len(uv))
    places, prices = graph.places(chart, uv), graph.prices(chart, cost)
    for k, name in enumerate(names):
        own = chart.faces == name
        assert graph.area[k] == pytest.approx(area[own].sum())
        np.testing.assert_allclose(places[k], middle[own].mean(axis=0))
    for (a, b), price in zip(graph.ends, prices, strict=True):
        assert price == pytest.approx((cost[a] + cost[b]) / 2 * np.linalg.norm(chart.vertices[a] - chart.vertices[b]))
    matrix = graph.matrix(prices).toarray()
    np.testing.assert_array_equal(matrix, matrix.T)
    for i, j in zip(*np.nonzero(matrix), strict=True):
        between = (np.sort(graph.joined, axis=1) == sorted((i, j))).all(axis=1)
        assert matrix[i, j] == pytest.approx(prices[between].sum())
    kept = np.random.default_rng(1).random(len(prices)) < 0.6
    label = np.arange(len(names))
    for _ in label:
        for i, j in graph.joined[kept]:
            label[[i, j]] = label[[i, j]].min()
    piece = graph.pieces(kept)
    np.testing.assert_array_equal(piece[:, None] == piece, label[:, None] == label)


def test_glued_the_polygons_are_neighbours_across_seams():
    V, F = meshes.icosphere(1)
    seams = np.array([[F[0, 0], F[0, 1]], [F[0, 1], F[0, 2]]])
    (chart,) = strict_charts(triangle_surface(V, F, seams))
    graph, glued = PolygonGraph.of(chart), PolygonGraph.of(chart, glued=True)
    assert len(glued.joined) == 3 * len(F) // 2 == len(graph.joined) + len(seams)
    for (i, j), ends in zip(glued.joined, glued.ends, strict=True):
        assert set(ends) == set(F[chart.faces[i]]) & set(F[chart.faces[j]])


def test_the_minimum_cut_is_the_cheapest_of_all():
    _, chart, _ = patch(3, 3)
    graph = PolygonGraph.of(chart)
    count = len(graph.area)
    assert count <= 18
    rng = np.random.default_rng(0)
    for _ in range(3):
        capacity = capacities(rng.uniform(0.1, 3, len(graph.joined)))
        one, other = np.array([0, 1]), np.array([count - 1])
        side = parting.minimum_cut(graph, capacity, one, other)
        assert side[one].all() and not side[other].any()
        free = np.setdiff1d(np.arange(count), [0, 1, count - 1])[:12]
        best = np.inf
        for choice in product([False, True], repeat=len(free)):
            # What is left of the polygons is where the cut has it.
            trial = side.copy()
            trial[free] = choice
            best = min(best, capacity[trial[graph.joined[:, 0]] != trial[graph.joined[:, 1]]].sum())
        assert capacity[side[graph.joined[:, 0]] != side[graph.joined[:, 1]]].sum() == best


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0])
def test_bands_are_told_by_how_long_they_are(turn):
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])

    def pieces(length, width, share=0.4):
        x, y = np.meshgrid(np.linspace(0, length, 41), np.linspace(0, width, 11))
        return limbs.pieces_of_band(np.column_stack([x.ravel(), y.ravel()]) @ rotation + 3, 1.0, share)

    assert pieces(1.79, 0.3) == 1 and pieces(1.81, 0.3) == 2
    # What is little of the surface is not to make the rest small.
    assert pieces(1.39, 0.3, 0.39) == 1 and pieces(1.41, 0.3, 0.39) == 2
    assert pieces(2.4001, 0.3) == 3 and pieces(2.399, 0.3) == 2
    # What is wider than a third of its length has to be longer.
    assert pieces(2.9, 1.2) == 1 and pieces(3.01, 1.2) == 3
    assert pieces(100, 1) == 12


@pytest.mark.parametrize("count", [2, 3, 5])
def test_long_charts_are_cut_across_in_about_equal_pieces(count):
    V, F = meshes.grid(30, 3, width=10.0, height=1.0)
    (chart,) = strict_charts(triangle_surface(V, F))
    uv = chart.vertices[:, :2]
    piece, edges = limbs.in_pieces(chart, uv, np.ones(len(uv)), count)
    assert len(np.unique(piece)) == count
    area = np.bincount(piece, face_areas(chart.vertices, chart.triangles))
    assert np.abs(area / area.mean() - 1).max() <= 2 * 0.2 + 0.05
    # The shortest way across is straight: three sides for each.
    assert len(edges) == 3 * (count - 1)
    for k in range(count):
        middle = chart.vertices[chart.triangles[piece == k]].mean(axis=1)[:, 0]
        others = chart.vertices[chart.triangles[piece != k]].mean(axis=1)[:, 0]
        assert not ((others > middle.min()) & (others < middle.max())).any()


def test_pieces_that_cover_each_other_are_found_with_what_they_cover():
    """A ring that goes around 1.4 times lies on itself with its first and last 0.4 turns."""
    V, F = meshes.grid(42, 2, width=1.4, height=1.0)
    (chart,) = strict_charts(triangle_surface(V, F))
    turn, radius = chart.vertices[:, 0], 2 + chart.vertices[:, 1]
    uv = np.column_stack([radius * np.cos(2 * np.pi * turn), radius * np.sin(2 * np.pi * turn)])
    graph = PolygonGraph.of(chart)
    ((one, other),) = parting._covering(chart, uv, graph)
    middle = np.bincount(graph.polygon, turn[chart.triangles].mean(axis=1)) / np.bincount(graph.polygon)
    first, last = sorted((one, other), key=lambda part: middle[part].mean())
    assert set(first) == set(np.flatnonzero(middle < 0.4)) and set(last) == set(np.flatnonzero(middle > 1))
    steps = graph.matrix(np.ones(len(graph.joined)))
    a, b = parting._enlarged(graph, steps, first[:1], last[:1])
    assert not set(a) & set(b) and first[0] in a and last[0] in b
    least = 0.03 * graph.area.sum()
    for part in (a, b):
        assert least - graph.area.max() <= graph.area[part].sum() <= least + graph.area.max()


def test_images_within_a_chart_are_those_of_the_surface():
    surface, chart, _ = patch()
    n = len(surface.positions)
    image = np.random.default_rng(0).permutation(n)
    image[3] = -1
    ids = np.where(np.arange(len(chart.vertex_ids)) == 5, -1, chart.vertex_ids)
    found = parting._images_in(replace(chart, vertex_ids=ids), image)
    for v, w in enumerate(found):
        there = image[ids[v]] if ids[v] >= 0 else -1
        at = np.flatnonzero(ids == there)
        assert w == (at[0] if there >= 0 and len(at) else -1)
    assert (parting._images_in(chart, None) == -1).all()


def body_of(chart, uv, cost=None):
    return limbs._Body.of(chart, uv, np.ones(len(uv)) if cost is None else cost, UP)


def test_boxes_of_pieces_are_measured():
    """Of a map that lies upright already: its pieces' extents, one beside another."""
    V, F = meshes.grid(8, 4, width=8.0, height=4.0)
    V = V[:, [0, 2, 1]] * [1, -1, 1]
    (chart,) = strict_charts(triangle_surface(V, F))
    uv = chart.vertices[:, [0, 2]]
    body = body_of(chart, uv)
    whole = body.boxes(np.zeros(len(body.graph.joined), bool))
    assert whole.area == pytest.approx(32) and whole.longest == pytest.approx(8)
    assert whole.filled == pytest.approx(0.5) and whole.room == pytest.approx(32 / (np.sqrt(32) * 8))
    left = body.places[:, 0] < 2
    cut = left[body.graph.joined[:, 0]] != left[body.graph.joined[:, 1]]
    parts = body.boxes(cut)
    assert parts.area == pytest.approx(1.15 * 32) and parts.longest == pytest.approx(6)
    assert parts.filled == pytest.approx(32 / max(1.15 * 32, 36))
    # The cut is 4 long, and costs as much next to the square's side; costs are relative.
    for cost in (1.0, 7.0):
        assert body_of(chart, uv, np.full(len(uv), cost)).cost(cut) == pytest.approx(1 + 4 / np.sqrt(32))
    assert body.price.sum() == pytest.approx(
        np.linalg.norm(np.diff(chart.vertices[body.graph.ends], axis=1)[:, 0], axis=1).sum()
    )
    middle = np.linalg.norm(np.diff(body.places[body.graph.joined], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(body.steps, middle)


@pytest.mark.parametrize("crumb", [False, True])
def test_necks_that_leave_a_crumb_beside_the_limb_are_none(crumb, monkeypatch):
    """As a cut may that goes round a polygon, or the image of one that comes too near to it."""
    V, F = meshes.grid(24, 4, width=24.0, height=4.0)
    (chart,) = strict_charts(triangle_surface(V, F))
    body = body_of(chart, chart.vertices[:, :2])
    side = body.places[:, 0] < 9
    if crumb:
        side[np.argmin(np.linalg.norm(body.places - [18, 2], axis=1))] = True
    monkeypatch.setattr(limbs._Body, "_narrowest", lambda self, *_: side)
    monkeypatch.setattr(limbs, "NECK", 10.0)
    found = list(body.necks(np.zeros(len(body.graph.joined), bool), None))
    assert len(found) == (0 if crumb else limbs.TIPS)
    for neck in found:
        np.testing.assert_array_equal(neck, side[body.graph.joined[:, 0]] != side[body.graph.joined[:, 1]])


def test_the_narrowest_level_is_the_shortest_for_what_it_takes_off():
    """Of a bar with a neck: the cut is there, and the side it gives is that of the tip."""
    V, F = meshes.grid(20, 6, width=20.0, height=6.0)
    cell = V[F].mean(axis=1)
    F = F[(np.abs(cell[:, 0] - 7.5) > 1) | (np.abs(cell[:, 1] - 3) < 1)]
    used, F = np.unique(F, return_inverse=True)
    (chart,) = strict_charts(triangle_surface(V[used], F.reshape(-1, 3)))
    body = body_of(chart, chart.vertices[:, :2])
    here, inner = np.ones(len(body.graph.area), bool), np.ones(len(body.graph.joined), bool)
    far = np.linalg.norm(body.places - [0, 3], axis=1)
    side = body._narrowest(here, inner, far)
    assert side[far.argmin()] and not side[far.argmax()]
    cut = side[body.graph.joined[:, 0]] != side[body.graph.joined[:, 1]]
    assert body.price[cut].sum() == pytest.approx(2)
    # Tips are each as far from those before as can be, along the body.
    tips = list(body._from_tips(here, inner))
    assert len(tips) == 8
    steps = body.graph.matrix(body.steps).toarray()
    first, second = (t.argmin() for t in tips[:2])
    along = floyd(steps)
    assert along[first, second] == pytest.approx(along[first].max())
    for t in tips:
        np.testing.assert_allclose(t, along[t.argmin()], atol=1e-9)


def floyd(steps):
    """Lengths (n,n) of all shortest paths."""
    far = np.where(steps > 0, steps, np.inf)
    np.fill_diagonal(far, 0)
    for k in range(len(far)):
        far = np.minimum(far, far[:, k : k + 1] + far[k])
    return far


def test_a_cut_is_its_own_image_by_most_of_its_edges():
    surface, chart, uv = patch()
    body = body_of(chart, uv)
    n = len(surface.positions)
    cut = np.zeros(len(body.graph.joined), bool)
    assert not body.is_own_image(cut, MirrorImages.of(np.arange(n)))
    cut[:7] = True
    ids = chart.vertex_ids[body.graph.ends[cut]]
    keys = {frozenset(e) for e in ids.tolist()}
    told = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        image = np.arange(n)
        gone = rng.choice(np.unique(ids), rng.integers(1, 5), replace=False)
        image[gone] = rng.choice([-1, (gone[0] + 1) % n], len(gone))
        alike = [(image[e] >= 0).all() and frozenset(image[e].tolist()) in keys for e in ids]
        told.append(np.mean(alike) > 0.5)
        assert body.is_own_image(cut, MirrorImages.of(image)) == told[-1]
    assert 5 < sum(told) < 35


# ---- paths over a coarse surface ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def coarse():
    V, F = meshes.bumpy(7, 6)
    V = V + 0.02 * np.random.default_rng(0).normal(size=V.shape)
    (chart,) = strict_charts(triangle_surface(V, F))
    return coarsening(chart.vertices, chart.triangles, 1000).ended(1000)


def test_steps_go_along_edges_and_straight_across_them(coarse):
    """Corners across an edge are joined by the straight line in the unfolded pair, where it crosses the edge."""
    V, F = coarse.positions, coarse.triangles
    factor = np.random.default_rng(1).uniform(1, 2, len(V))
    graph = path_graph.path_graph(coarse, factor, coarse.boundary)
    expected = {}
    for f in F:
        for a, b in zip(f, np.roll(f, -1), strict=True):
            expected[frozenset((int(a), int(b)))] = np.linalg.norm(V[a] - V[b])
    twin = twins(F)
    for h in np.flatnonzero(twin > np.arange(len(twin))):
        a, b, c = (F.ravel()[3 * (h // 3) + (h % 3 + k) % 3] for k in range(3))
        d = F.ravel()[3 * (twin[h] // 3) + (twin[h] % 3 + 2) % 3]
        z, w = unfolded(V[a], V[b], V[c]), np.conj(unfolded(V[a], V[b], V[d]))
        crossing = z.real + (w.real - z.real) * z.imag / (z.imag - w.imag)
        if 0 < crossing < np.linalg.norm(V[b] - V[a]):
            expected.setdefault(frozenset((int(c), int(d))), abs(z - w))
    assert {frozenset(e) for e in graph.ends.tolist()} == set(expected)
    for (a, b), cost in zip(graph.ends, graph.cost, strict=True):
        length = expected[frozenset((a, b))]
        assert cost == pytest.approx(length * (factor[a] + factor[b]) / 2 / coarse.size, rel=1e-6)
        assert graph.matrix[a, b] == graph.matrix[b, a] == cost
        assert graph.steps_of(np.array([a, b]))[0] == graph.steps_of(np.array([b, a]))[0]
        assert set(graph.ends[graph.steps_of(np.array([a, b]))[0]]) == {a, b}


def unfolded(a, b, c):
    """Where c lies in the plane of a, b and c, with a at 0 and b on the real axis, above."""
    axis = (b - a) / np.linalg.norm(b - a)
    x = (c - a) @ axis
    return x + 1j * np.linalg.norm(c - a - x * axis)


def test_paths_and_depths_are_shortest(coarse):
    graph = path_graph.path_graph(coarse, np.ones(len(coarse.positions)), coarse.boundary)
    far = floyd(graph.matrix.toarray())
    cost, before = graph.paths_from(np.array([0, 5]))
    np.testing.assert_allclose(cost, far[[0, 5]].min(axis=0))
    path = path_graph.path_to(before, int(cost.argmax()))
    assert path[0] == cost.argmax() and path[-1] in (0, 5)
    assert graph.cost[graph.steps_of(path)].sum() == pytest.approx(cost.max())
    # Depth goes along the steps of a cut alone, from the boundary.
    start = np.flatnonzero(coarse.boundary)
    cost, before = graph.paths_from(start)
    tip = int(cost.argmax())
    path = path_graph.path_to(before, tip)
    steps = graph.steps_of(path)
    depth = graph.depth(steps)
    np.testing.assert_allclose(depth[path], cost[path])
    assert np.isinf(depth[np.setdiff1d(np.arange(len(depth)), np.append(path, start))]).all()
    assert graph.vertices_of(steps).tolist() == sorted(set(path) - set(start.tolist()))
    assert graph.is_open(steps)


@pytest.fixture
def row(monkeypatch):
    """A row of vertices from a tip to the cut, where a path may end at the first three."""
    cost = np.arange(6.0)[::-1]
    monkeypatch.setattr(growth, "_tips", lambda *_: np.array([0]))
    monkeypatch.setattr(growth, "path_to", lambda before, tip: np.arange(6))
    return SimpleNamespace(
        boundary=cost == 0, ends=np.zeros((0, 2), int), image=np.arange(6), paths_from=lambda _: (cost, np.arange(1, 7))
    )


@pytest.mark.parametrize("off", [1e-12, -1e-12, 1e-8, -1e-8, 1e-3, -1e-3])
def test_of_ends_that_are_worth_the_same_the_farthest_is_taken_and_rounding_does_not_choose(off, row):
    # What a cut from each on lowers the spread by, that nearest to the cut first: the second and third are worth more.
    falls = np.array([0.1, 0.2, 3 * (1 + 2 * off), 4 * (1 + off), 5])
    task = SimpleNamespace(graph=row, tip_factor=np.ones(6))
    cut = SimpleNamespace(steps=np.zeros(0, int), spread=9.0)
    (arc,) = growth._arcs(task, cut, SimpleNamespace(spread=9.0, falls=lambda _: falls))
    assert arc.path[0] == (2 if off == 1e-3 else 0)


def test_a_path_ends_where_it_is_worth_most_by_what_is_to_be_kept_free_there(row):
    """At the tip as anywhere: what is to be kept free beyond the end of a path is of no matter."""
    taken = set()
    for seed in range(30):
        rng = np.random.default_rng(seed)
        free, falls = rng.uniform(0.1, 1, 6), np.cumsum(rng.uniform(0.5, 1, 5))
        cut = SimpleNamespace(steps=np.zeros(0, int), spread=9.0)
        model = SimpleNamespace(spread=9.0, falls=lambda _, falls=falls: falls)
        (arc,) = growth._arcs(SimpleNamespace(graph=row, tip_factor=free), cut, model)
        worth = [free[k] * falls[4 - k] / (5 - k) for k in range(3)]
        assert arc.path[0] == np.argmax(worth) and arc.worth == pytest.approx(max(worth))
        taken.add(int(arc.path[0]))
    assert taken == {0, 1, 2}


@pytest.mark.parametrize("barred", [1, 3, 4])
def test_a_path_may_end_where_it_leaves_what_is_to_be_kept_free(barred, row):
    """However near to the cut that is."""
    free = np.where(np.arange(6) < barred, 0.01, 1.0)
    cut, falls = SimpleNamespace(steps=np.zeros(0, int), spread=9.0), np.arange(1.0, 6)
    task = SimpleNamespace(graph=row, tip_factor=free)
    (arc,) = growth._arcs(task, cut, SimpleNamespace(spread=9.0, falls=lambda _: falls))
    assert arc.path[0] == barred and arc.worth == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(4))
def test_extremities_are_peaks_off_the_cut_that_are_worth_most(seed):
    """On a row of vertices, some of which are cut, and some to be kept free."""
    rng, n = np.random.default_rng(seed), 120
    gain, scale, free, cost = rng.random(n), rng.normal(size=n), rng.uniform(0.01, 1, n), rng.uniform(0.5, 2, n)
    cost[rng.random(n) < 0.2], cost[:3] = 0, np.inf
    ends = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    task = SimpleNamespace(graph=SimpleNamespace(ends=ends), tip_factor=free)
    found = growth._tips(task, SimpleNamespace(gain=lambda _: gain, scale=scale), cost)
    peaks = set()
    for height in (np.where(cost > 0, gain, 0), np.where(cost > 0, np.abs(scale), 0)):
        padded = np.concatenate([[0], height, [0]])
        peaks |= {k for k in range(n) if height[k] > 0 and height[k] >= max(padded[k], padded[k + 2])}
    worth = {k: gain[k] * free[k] / cost[k] for k in peaks if 0 < cost[k] < np.inf}
    assert len(worth) > growth.MOST_TIPS
    assert found.tolist() == sorted(worth, key=worth.__getitem__, reverse=True)[: growth.MOST_TIPS]


def test_arcs_are_worth_what_the_spread_falls_for_their_cost(coarse):
    """By the model cut anew, for every arc that is offered; and those come first that are worth most."""
    from omt_uv.solver.seams.cut_tree import Task, cut_along

    model = predicted_scale.ScaleModel.of(coarse)
    graph = path_graph.path_graph(coarse, np.ones(len(coarse.positions)), coarse.boundary)
    tips = np.random.default_rng(0).uniform(0.2, 1, len(coarse.positions))
    task = Task(graph, model, 0.2 * model.spread, tips)
    cut = cut_along(task, np.zeros(0, np.int64))
    arcs = growth._arcs(task, cut, model)
    assert arcs
    cost, _ = graph.paths_from(np.flatnonzero(graph.boundary))
    for arc in arcs:
        fall = model.spread - model.cut(arc.path[:-1]).spread
        assert arc.worth == pytest.approx(tips[arc.path[0]] * fall / cost[arc.path[0]], rel=1e-4)
    worth = [arc.worth for arc in arcs]
    assert all(a >= b * (1 - 2 * 1e-6) for a, b in pairwise(worth))
    grown = growth.grow(task, cut, 20)
    assert (
        grown.spread <= task.bound
        or growth._arcs(task, grown, model.cut(grown.vertices))[0].worth < 0.02 * grown.spread
    )
    # One arc more leaves just what it was promised to.
    (one, *_) = growth.grown_by_one(task, cut, 1)
    assert one.spread == pytest.approx(model.cut(one.vertices).spread, rel=1e-4)
    assert one.cost == pytest.approx(graph.cost[one.steps].sum())


def test_a_plate_answers_as_its_dense_equations(coarse):
    """Stress, scale and spread by a dense solve of the bilaplacian with what is cut held at 0."""
    n = len(coarse.positions)
    density = 0.3 * np.random.default_rng(0).normal(size=n)
    model = predicted_scale.ScaleModel.of(coarse, density)
    L = model.laplacian.toarray()
    area = coarse.area * np.exp(2 * density)
    area /= area.sum()
    load = np.where(coarse.boundary, 0, coarse.curvature + L @ density)
    np.testing.assert_allclose(model.load, load, atol=1e-12)
    area = np.maximum(area, 1e-3 * area.mean())
    plate = L.T @ np.diag(1 / area) @ L
    cut = np.flatnonzero(~coarse.boundary)[3:6]
    for held in (np.zeros(0, int), cut):
        free = np.setdiff1d(np.flatnonzero(~coarse.boundary), held)
        stress = np.zeros(n)
        stress[free] = np.linalg.solve(plate[np.ix_(free, free)], load[free])
        found = model.cut(held)
        np.testing.assert_allclose(found.plate.value, stress, atol=1e-5 * np.abs(stress).max())
        assert found.spread == pytest.approx(load @ stress, rel=1e-5)
        assert model.spread_cut(held) == pytest.approx(load @ stress, rel=1e-5)
        np.testing.assert_allclose(found.scale, L @ stress / area, atol=1e-4 * np.abs(L @ stress / area).max())
    for v in free[:5]:
        assert model.gain(np.array([v]))[0] == pytest.approx(model.spread - model.cut(np.array([v])).spread, rel=1e-5)


def test_inverses_are_symmetric_and_nothing_elsewhere():
    A = np.random.default_rng(0).normal(size=(5, 5))
    A = A @ A.T + np.eye(5)
    free = np.array([0, 2, 3, 6, 7])
    found = predicted_scale._inverse(csr_matrix(A), free, 8)
    np.testing.assert_allclose(found[np.ix_(free, free)], np.linalg.inv(A), rtol=1e-10)
    assert not found[[1, 4, 5]].any() and not found[:, [1, 4, 5]].any()


@pytest.mark.parametrize("share", [0.3, 0.7, 1.0])
def test_a_forest_joins_all_that_can_be_joined_to_its_start_once(share):
    component = component_of(*meshes.icosphere(1))
    chosen = np.random.default_rng(0).random(len(component.pair)) < share
    start = np.isin(np.arange(component.vertex_count), [3, 4, 17])
    found = fine_paths._forest(component, chosen, start)
    assert (chosen | ~found).all()

    def reached(edges):
        group = set(np.flatnonzero(start).tolist())
        for _ in range(component.vertex_count):
            group |= {int(v) for e in component.ends[edges] for v in e if group & set(e.tolist())}
        return group

    assert reached(found) == reached(chosen)
    # So many edges join so many vertices without a loop.
    assert found.sum() == len(reached(chosen)) - start.sum()
    assert set(component.ends[found].ravel().tolist()) <= reached(chosen)


def test_what_covers_is_parted_by_what_is_covered_nowhere():
    """Also where that is one polygon: a ring whose first and last faces lie on one another."""
    V, F = meshes.grid(13, 1, width=13 / 12, height=1.0)
    (chart,) = strict_charts(triangle_surface(V, F))
    column = np.floor(12 * chart.vertices[chart.triangles][:, :, 0].mean(axis=1)).astype(int)
    chart = replace(chart, faces=np.clip(column, 0, 1) + (column == 12))
    turn, radius = 2 * np.pi * chart.vertices[:, 0], 2 + chart.vertices[:, 1]
    uv = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    ((one, other),) = parting._covering(chart, uv, PolygonGraph.of(chart))
    assert sorted([one.tolist(), other.tolist()]) == [[0], [2]]


def test_a_step_of_one_half_costs_what_it_and_its_image_cost_without_a_mirror():
    """Both are cut; what lies in the plane is cut once, and from one side to the other there is no step."""
    V, F = meshes.grid(6, 5)
    middle = V[:, 0].max() / 2
    place = {tuple(p): k for k, p in enumerate(np.round(V, 6).tolist())}
    image = np.array([place[tuple(p)] for p in np.round(V * [-1, 1, 1] + [2 * middle, 0, 0], 6).tolist()])
    F = F[V[F].mean(axis=1)[:, 0] < middle]
    F = np.concatenate([F, image[F][:, ::-1]])
    V[:, 2] = np.cos(3 * (V[:, 0] - middle)) * V[:, 1] + 0.2 * V[:, 1] ** 2
    boundary = np.zeros(len(V), bool)
    boundary[np.concatenate(boundary_loops(F))] = True
    surface = CoarseSurface(np.arange(len(V)), V, F, np.zeros(len(V)), np.full(len(V), 1 / len(V)), boundary, 2.0)
    side = V[:, 0] <= middle + 1e-9
    factor = 1 + surface.positions[:, 1]
    whole = path_graph.path_graph(surface, factor, surface.boundary)
    half = path_graph.path_graph(surface, factor, surface.boundary, path_graph.Mirrored(image, side))
    cost = {frozenset(ends): c for ends, c in zip(whole.ends.tolist(), whole.cost, strict=True)}
    in_plane = 0
    for ends, found in zip(half.ends, half.cost, strict=True):
        both = {frozenset(ends.tolist()), frozenset(image[ends].tolist())}
        in_plane += len(both) == 1
        assert side[ends].all() and found == pytest.approx(sum(cost[step] for step in both), rel=1e-6)
    assert 4 <= in_plane < len(half.ends) / 2
