"""Costs, corners, borders and arcs of cuts against plain walks over edges, vertices and spanning trees."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import meshes
import numpy as np
import pytest
from short_cuts import component_of, gluing_of

from omt_uv.solver.cutting import component as components
from omt_uv.solver.cutting import crease_sides, cut_graph, developable_nets, hard_surface
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.gluing import corner_classes
from omt_uv.solver.mesh.topology import pair_keys


def bumpy_ring(major=10, minor=7):
    V, F = meshes.torus(major, minor)
    return V + 0.05 * np.random.default_rng(0).normal(size=V.shape), F


def block():
    """A bent strip of quads with hard edges and a reflex one: an L drawn out, without its ends."""
    profile = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)], float)
    n = len(profile)
    V = np.concatenate([np.insert(profile, 1, y, axis=1) for y in (0.0, 1.0, 2.0)])
    around = [(r * n, k, (k + 1) % n) for r in range(2) for k in range(n)]
    quads = [(r + a, r + b, r + n + b, r + n + a) for r, a, b in around]
    return V, np.array([[a, b, c] for a, b, c, d in quads] + [[a, c, d] for a, b, c, d in quads])


BODIES = {
    "ring": bumpy_ring,
    "block": block,
    "ball": lambda: meshes.icosphere(1),
    "disk": lambda: meshes.bumpy(5, 4),
    "cube": meshes.cube,
}


@pytest.fixture(params=BODIES)
def body(request):
    return component_of(*BODIES[request.param]())


def normals(component):
    p = component.positions[component.triangles]
    n = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def folds(component):
    """The angle at every inner edge, negative in a hollow, edge by edge."""
    n, found = normals(component), []
    for f, s in component.pair:
        one, other = f // 3, s // 3
        angle = np.arccos(np.clip(n[one] @ n[other], -1, 1))
        # The corner across the edge lies above the other face in a hollow.
        tip = component.positions[component.triangles[other, (s % 3 + 2) % 3]]
        above = (tip - component.positions[component.triangles[one, f % 3]]) @ n[one]
        found.append(-angle if above > 0 else angle)
    return np.array(found)


def test_edges_cost_their_length_and_less_where_they_hide(body):
    """Half way between smooth and a right angle, a fold costs half of what it saves; in a hollow it saves more."""
    fold, p = folds(body), body.positions
    hiding = components._hiding(p, body.triangles, body.pair)
    for k, (a, b) in enumerate(body.ends):
        assert body.length[k] == pytest.approx(np.linalg.norm(p[a] - p[b]))
        assert {a, b} == {body.triangles.ravel()[h] for h in (body.pair[k, 0], cut_next(body.pair[k, 0]))}
        share = min(max((abs(fold[k]) - np.pi / 6) / (np.pi / 2 - np.pi / 6), 0), 1)
        least = 0.75 if fold[k] < 0 else 0.85
        assert hiding[k] == pytest.approx(1 - share * (1 - least))


def cut_next(h):
    return h + 1 - 3 * (h % 3 == 2)


def test_costs_are_products_of_what_makes_edges_dear_or_cheap():
    V, F = block()
    polygon = np.arange(len(F)) % (len(F) // 2)
    plain, gluing = component_of(V, F), gluing_of(V, F)
    rng = np.random.default_rng(0)
    avoid, factor = rng.random(len(V)), rng.uniform(0.2, 1, len(gluing.first))
    everything = np.arange(len(F)), np.arange(len(factor))
    body = components.make_component(gluing, V, corner_classes(gluing), *everything, avoid, factor)
    hiding = components._hiding(body.positions, body.triangles, body.pair)
    dear = 1 + (10.0 - 1) * avoid[body.vertex_ids][body.ends].mean(axis=1)
    np.testing.assert_allclose(body.cost, body.length * hiding * factor[body.gluing_pair] * dear, rtol=2e-6)
    np.testing.assert_allclose(body.tip_factor(), 1 - 0.999 * avoid[body.vertex_ids])
    np.testing.assert_array_equal(body.positions, V[body.vertex_ids])
    assert (plain.tip_factor() == 1).all() and len(np.unique(polygon)) == len(F) // 2
    # The diagonals of quads are never cut.
    quads = replace(gluing, owner=polygon, side=~np.isin(pair_keys(*gluing.ends(np.arange(3 * len(F)))), diagonals(F)))
    body = components.make_component(quads, V, corner_classes(quads), *everything, 0 * avoid, np.ones(len(factor)))
    inner = polygon[body.members[body.pair[:, 0] // 3]] == polygon[body.members[body.pair[:, 1] // 3]]
    np.testing.assert_array_equal(np.isinf(body.cost), inner)
    assert (
        inner.sum() == len(F) // 2
        and components.edge_graph(body, np.arange(len(inner)), body.ends, len(V)).nnz == 2 * (~inner).sum()
    )


def diagonals(F):
    """Keys of the edges that two triangles of one quad share, of quads as `block` has them."""
    half = len(F) // 2
    return pair_keys(F[:half, 0], F[:half, 2])


def test_defects_are_what_angles_miss_of_a_turn(body):
    total = np.zeros(body.vertex_count)
    for f in body.triangles:
        for k in range(3):
            u, v = (body.positions[f[(k + j) % 3]] - body.positions[f[k]] for j in (1, 2))
            total[f[k]] += np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v))
    edges = {frozenset(e) for e in body.ends.tolist()}
    around = [pair for f in body.triangles for pair in zip(f, np.roll(f, -1), strict=True)]
    outer = {v for pair in around for v in pair if frozenset(pair) not in edges}
    assert set(np.flatnonzero(body.on_boundary())) == outer
    expected = np.where(np.isin(np.arange(len(total)), list(outer)), 0, 2 * np.pi - total)
    np.testing.assert_allclose(developable_nets.defects(body), expected, atol=1e-9)


def shortest(cost, ends, n, start):
    """Distances (n,) from the vertices `start` by Bellman and Ford."""
    far = np.full(n, np.inf)
    far[start] = 0
    for _ in range(n):
        for (a, b), c in zip(ends, cost, strict=True):
            far[a], far[b] = min(far[a], far[b] + c), min(far[b], far[a] + c)
    return far


def test_greedy_arcs_are_the_shortest_of_all_that_leave_a_disk():
    """The loops that close a forest of shortest paths, no system of as many of these being shorter (brute force)."""
    body = component_of(*bumpy_ring(5, 4))
    root = 0
    found = cut_graph.greedy_arcs(body, np.array([root]))
    far = shortest(body.cost, body.ends, body.vertex_count, [root])
    arc = far[body.ends].sum(axis=1) + body.cost
    # Edges on the forest close nothing.
    forest = np.isclose(np.abs(np.diff(far[body.ends], axis=1)[:, 0]), body.cost)
    best = np.inf
    for pair in combinations(np.flatnonzero(~forest), 2):
        cut = forest.copy()
        cut[list(pair)] = True
        if cut_graph.is_disk(body, cut):
            best = min(best, arc[list(pair)].sum())
    closing = np.flatnonzero(found & ~forest)
    assert arc[closing].sum() == pytest.approx(best) and len(closing) == 2
    # And what is cut are the ways from these to the root, no more.
    ways = np.zeros_like(found)
    for v in body.ends[closing].ravel():
        while v != root:
            k = next(
                k for k in np.flatnonzero(forest) if v in body.ends[k] and far[body.ends[k]].min() < far[v] - 1e-12
            )
            ways[k], v = True, body.ends[k][far[body.ends[k]].argmin()]
    np.testing.assert_array_equal(found & forest, ways)


def test_paths_are_shortest_and_end_where_they_are_asked_to(body):
    far = shortest(body.cost, body.ends, body.vertex_count, [1, 2])
    for end in np.flatnonzero(np.isfinite(far))[3::5]:
        if end in (1, 2):
            continue
        path = cut_graph.path_to(body, np.array([1, 2]), end)
        assert body.cost[path].sum() == pytest.approx(far[end])
        degree = np.bincount(body.ends[path].ravel(), minlength=body.vertex_count)
        assert degree[end] == 1 and degree[[1, 2]].sum() == 1 and degree.max() <= 2


def test_a_cut_is_a_disk_just_where_euler_and_one_loop_say_so(body):
    rng = np.random.default_rng(0)
    for share in (0.0, 0.2, 0.5):
        cut = rng.random(len(body.pair)) < share
        corners = cut_graph.cut_classes(body, cut)
        once = [e for e, c in counted(corners).items() if c == 1]
        loops = loops_of(once)
        euler = len(np.unique(corners)) - len(counted(corners)) + len(corners)
        assert cut_graph.is_disk(body, cut) == (euler == 1 and loops == 1)
    roots = np.zeros(0, np.int64) if len(body.boundary) else np.array([0, 1])
    whole = cut_graph.greedy_arcs(body, roots)
    assert cut_graph.is_disk(body, whole) or len(roots) == 0


def counted(corners):
    edges = {}
    for f in corners:
        for a, b in zip(f, np.roll(f, -1), strict=True):
            edges[frozenset((a, b))] = edges.get(frozenset((a, b)), 0) + 1
    return edges


def loops_of(edges):
    groups = []
    for edge in edges:
        touching = [g for g in groups if g & edge]
        groups = [g for g in groups if not g & edge] + [frozenset().union(edge, *touching)]
    return len(groups)


def test_stretches_run_between_tips_branchings_and_the_boundary():
    body = component_of(*meshes.bumpy(6, 6))
    cut = np.random.default_rng(1).random(len(body.pair)) < 0.25
    tips = np.array([20])
    degree = np.bincount(body.ends[cut].ravel(), minlength=body.vertex_count)
    node = (degree != 2) | body.on_boundary() | (np.arange(body.vertex_count) == 20)
    parts = cut_graph.stretches(body, cut, tips)
    owner = {k: i for i, part in enumerate(parts) for k in part}
    assert sorted(owner) == np.flatnonzero(cut).tolist()
    for k in owner:
        for other in owner:
            shared = set(body.ends[k]) & set(body.ends[other])
            if k != other and any(not node[v] for v in shared):
                assert owner[k] == owner[other]
    for part in parts:
        inner = [v for v in np.unique(body.ends[part]) if not node[v]]
        # A path has one vertex less inside than edges, a ring as many.
        assert len(inner) in (len(part) - 1, len(part))


def test_factors_of_nets_by_where_edges_stand():
    body = component_of(*block())
    fold = np.abs(folds(body)) > 0.9
    found = hard_surface.net_factors(body, fold)
    p = body.positions
    y = p[body.ends, 1].mean(axis=1)
    reflex = reflex_corners(body, fold)
    for k, (a, b) in enumerate(body.ends):
        d = p[b] - p[a]
        behind = (y.max() - y[k]) / (y.max() - y.min())
        expected = 1 + 0.01 * abs(d[2]) / np.linalg.norm(d) + 0.004 * behind
        beside = fold[k] and any((t, v) in reflex for t in body.pair[k] // 3 for v in (a, b))
        assert found[k] == pytest.approx(expected * (0.5 if beside else 1))


def test_edges_beside_a_reflex_corner_are_found():
    """Two triangles of a level L, and a wall under each of its sides."""
    profile = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)], float)
    n = len(profile)
    V = np.concatenate([np.column_stack([profile, np.zeros(n)]), np.column_stack([profile, -np.ones(n)])])
    top = [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]]
    walls = [t for k in range(n) for t in ([(k + 1) % n, k, k + n], [(k + 1) % n, k + n, (k + 1) % n + n])]
    body = component_of(V, np.array(top + walls))
    fold = np.abs(folds(body)) > 0.9
    reflex = reflex_corners(body, fold)
    assert {tuple(body.positions[v][:2] * 3) for _, v in reflex} and len({v for _, v in reflex}) == 1
    expected = [bool(fold[k]) and any((t, v) in reflex for t in body.pair[k] // 3 for v in body.ends[k])
                for k in range(len(fold))]  # fmt: skip
    assert sum(expected) == 3 or sum(expected) == 2
    np.testing.assert_array_equal(hard_surface._beside_reflex(body, fold), expected)


def reflex_corners(body, fold):
    """Pairs of a triangle and a vertex, of sides between folded edges with more than half a turn there."""
    side = sides(body, ~fold)
    angle = {}
    for t, f in enumerate(body.triangles):
        for k in range(3):
            u, v = (body.positions[f[(k + j) % 3]] - body.positions[f[k]] for j in (1, 2))
            key = side[t], f[k]
            angle[key] = angle.get(key, 0) + np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v))
    return {(t, v) for t, f in enumerate(body.triangles) for v in f if angle[side[t], v] > hard_surface.REFLEX}


def steps_from(start, edges, length):
    """How far along edges every vertex of these is from the nearest of a start, by going on until nothing is nearer."""
    far = {int(v): np.inf for ends in edges.values() for v in ends} | dict.fromkeys(map(int, start), 0.0)
    for _ in far:
        for k, (tail, head) in edges.items():
            for u, v in ((tail, head), (head, tail)):
                far[int(v)] = min(far[int(v)], far[int(u)] + length[k])
    return far


def sides(body, joined):
    """A number for every triangle, the same where the edges `joined` (e,) join them, by a walk."""
    label = np.arange(len(body.triangles))
    for _ in label:
        for k in np.flatnonzero(joined):
            one, other = body.pair[k] // 3
            label[[one, other]] = label[[one, other]].min()
    return label


@pytest.mark.parametrize("seed", range(3))
def test_figures_of_sides_are_sums_over_them(body, seed):
    """Curvature within sides, disks among them, chains of borders, and edges that touch no other."""
    rng = np.random.default_rng(seed)
    # Few sides: those of the nearest of some points.
    middle = body.positions[body.triangles].mean(axis=1)
    seeds = middle[rng.choice(len(middle), 4, replace=False)]
    near = ((middle[:, None] - seeds) ** 2).sum(axis=2).argmin(axis=1)
    border = near[body.pair[:, 0] // 3] != near[body.pair[:, 1] // 3]
    label = np.unique(sides(body, ~border), return_inverse=True)[1]
    count = int(label.max()) + 1
    border = label[body.pair[:, 0] // 3] != label[body.pair[:, 1] // 3]
    curvature = np.abs(developable_nets.defects(body))
    on_border = set(body.ends[border].ravel().tolist())
    found = crease_sides._inner_curvature(body, label, border, curvature, count)
    for s in range(count):
        inner = set(body.triangles[label == s].ravel().tolist()) - on_border
        assert found[s] == pytest.approx(sum(curvature[list(inner)]), abs=1e-12)
    corners = cut_graph.cut_classes(body, border)
    disks = crease_sides._disks(body, border, label, count)
    for s in range(count):
        own = corners[label == s]
        assert disks[s] == (len(np.unique(own)) - len(counted(own)) + len(own) == 1)
    if not border.any():
        return
    chain, pair, length, turned = crease_sides._chains(body, label, border, curvature)
    assert ((chain >= 0) == border).all()
    for c in range(len(pair)):
        edges = np.flatnonzero(chain == c)
        for k in edges:
            assert sorted(label[body.pair[k] // 3]) == pair[c].tolist()
        assert length[c] == pytest.approx(body.length[edges].sum())
        # They hang together, and no further edge between the same sides touches them.
        own = {frozenset(e) for e in body.ends[edges].tolist()}
        assert loops_of(own) == 1
        others = [
            k for k in np.flatnonzero(border & (chain != c)) if sorted(label[body.pair[k] // 3]) == pair[c].tolist()
        ]
        assert not set(body.ends[others].ravel()) & set(body.ends[edges].ravel())
        twice, times = np.unique(body.ends[edges], return_counts=True)
        beside = set(body.ends[[k for k in np.flatnonzero(border) if chain[k] != c]].ravel().tolist())
        alone = [v for v, t in zip(twice, times, strict=True) if t == 2 and v not in beside]
        # What is near its ends belongs to the corners there.
        far = steps_from(set(twice) - set(alone), {k: body.ends[k] for k in edges}, body.length)
        alone = [v for v in alone if far[v] > crease_sides.CORNER * length[c]]
        assert turned[c] == pytest.approx(curvature[alone].sum(), abs=1e-12)


def test_tight_folds_are_those_of_a_small_radius():
    body = component_of(*block())
    fold = np.abs(folds(body))
    area = face_areas(body.positions, body.triangles)
    whole = np.sqrt(area.sum())
    polygon = {q: area[body.polygons == q].sum() for q in np.unique(body.polygons)}
    found = developable_nets.tight_edges(body, fold)
    for k, (f, s) in enumerate(body.pair):
        narrow = min(polygon[body.polygons[h // 3]] for h in (f, s)) / body.length[k]
        # An arc of a radius that turns by the fold is as wide as their product.
        assert found[k] == (fold[k] > developable_nets.BENT and narrow / fold[k] < 0.05 * whole)


def test_boxes_of_places_that_are_turned():
    places = np.random.default_rng(0).normal(size=(30, 2)) @ [1, 1j]
    wide, high = crease_sides._boxes(places)
    for k in range(12):
        turned = places * np.exp(0.5j * np.pi * k / 12)
        assert wide[k] == pytest.approx(np.ptp(turned.real)) and high[k] == pytest.approx(np.ptp(turned.imag))


def test_what_is_laid_out_keeps_its_lengths_and_tells_where_it_does_not_close():
    V, F = meshes.bumpy(6, 5, height=0.0)
    body = component_of(V, F)
    rows = body.positions[body.triangles].mean(axis=1)[:, 0] < 0.4
    flat, corners, gap = crease_sides._laid_out(body, np.zeros(len(body.pair), bool), rows)
    assert gap < 1e-12 and len(corners) == rows.sum()
    for k in range(3):
        there = np.abs(flat[corners[:, k]] - flat[corners[:, k - 1]])
        own = np.linalg.norm(
            body.positions[body.triangles[rows, k]] - body.positions[body.triangles[rows, k - 1]], axis=1
        )
        np.testing.assert_allclose(there, own, atol=1e-12)
    ball = component_of(*meshes.icosphere(1))
    assert crease_sides._laid_out(ball, np.zeros(len(ball.pair), bool), np.ones(len(ball.triangles), bool))[2] > 0.01


@pytest.mark.parametrize("seed", range(3))
def test_distances_along_edges_are_those_of_going_on(seed):
    rng = np.random.default_rng(seed)
    ends = np.array([e for e in rng.integers(0, 14, (20, 2)) if e[0] != e[1]])
    ends = np.unique(np.sort(ends, axis=1), axis=0)
    length = rng.random(len(ends))
    start = np.zeros(14, bool)
    start[rng.integers(0, 14, 2)] = True
    far = steps_from(np.flatnonzero(start), dict(enumerate(ends)), length)
    found = cut_graph.distance_from(start, ends, length)
    np.testing.assert_allclose(found, [far.get(v, np.inf) for v in range(14)])
    assert np.isinf(cut_graph.distance_from(np.zeros(14, bool), ends, length)).all()
    # What has no length is an edge all the same.
    assert (cut_graph.distance_from(start, ends, 0 * length)[np.isfinite(found)] < 1e-290).all()
