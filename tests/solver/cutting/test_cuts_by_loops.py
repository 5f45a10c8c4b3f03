"""Pieces of what cuts surfaces, against walks over edges, triangles and sides."""

from __future__ import annotations

from collections import defaultdict
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from short_cuts import component_of, gluing_of

from omt_uv.solver.cutting import component as components
from omt_uv.solver.cutting import crease_sides, cut_graph, cuts, gluing_facts, handle_partition, hole_filling
from omt_uv.solver.cutting import symmetric_cut as symmetric
from omt_uv.solver.maps.overlap import part_covered
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops


def bumpy_ring(major=9, minor=6):
    V, F = meshes.torus(major, minor)
    return V + 0.05 * np.random.default_rng(0).normal(size=V.shape), F


def at_place(component, V):
    """The vertex of the component at each of V."""
    return np.array([int(np.linalg.norm(component.positions - p, axis=1).argmin()) for p in V])


def test_edges_above_lead_to_the_vertices_before():
    component = component_of(*meshes.bumpy(4, 3))
    before = np.full(component.vertex_count, -9999)
    for v in range(1, component.vertex_count):
        beside = component.ends[(component.ends == v).any(axis=1)].ravel()
        if len(beside):
            before[v] = beside[beside != v].min()
    found = cut_graph._edge_above(component, before)
    for v, edge in enumerate(found):
        if before[v] < 0:
            assert edge == -1
        else:
            assert set(component.ends[edge].tolist()) == {v, int(before[v])}


def test_ancestors_are_all_that_lie_before():
    rng = np.random.default_rng(0)
    before = np.array([-9999] + [int(rng.integers(0, k)) for k in range(1, 40)])
    before[7] = -9999
    for some in ([39], [12, 31], [0], []):
        expected = set()
        for v in some:
            while v >= 0:
                expected.add(v)
                v = before[v]
        assert cut_graph._ancestors(before, np.array(some, int)).tolist() == sorted(expected)


def test_a_cotree_crosses_the_longest_arcs_that_it_may():
    component = component_of(*bumpy_ring())
    rng = np.random.default_rng(1)
    arc, allowed = rng.random(len(component.pair)), rng.random(len(component.pair)) < 0.9
    found = cut_graph._spanning_cotree(component, allowed, arc)
    parent = np.arange(len(component.triangles))

    def root(x):
        while parent[x] != x:
            x = parent[x]
        return x

    expected = np.zeros(len(arc), bool)
    for edge in sorted(np.flatnonzero(allowed), key=lambda e: -arc[e]):
        one, other = (root(h // 3) for h in component.pair[edge])
        if one != other:
            parent[one], expected[edge] = other, True
    np.testing.assert_array_equal(found, expected)


def test_edges_are_found_by_their_ends_either_way_around():
    component = component_of(*meshes.bumpy(4, 4))
    edges = np.random.default_rng(0).permutation(len(component.ends))[:7]
    a, b = component.ends[edges].T
    for one, other in ((a, b), (b, a)):
        np.testing.assert_array_equal(
            cut_graph._edges_between(component.ends, one, other, component.vertex_count), edges
        )


def test_a_stretch_is_one_while_it_is_cut_and_nothing_branches_off_inside():
    component = component_of(*meshes.grid(6, 6))
    cut = np.zeros(len(component.pair), bool)
    middle = np.flatnonzero(np.abs(component.positions[component.ends][:, :, 1] - 0.5).max(axis=1) < 1e-9)
    cut[middle] = True
    assert cut_graph._is_stretch(component, cut, middle)
    less = cut.copy()
    less[middle[0]] = False
    assert not cut_graph._is_stretch(component, less, middle)
    inner = next(v for v in np.unique(component.ends[middle]) if abs(component.positions[v, 0] - 0.5) < 1e-9)
    branch = [e for e in np.flatnonzero((component.ends == inner).any(axis=1)) if e not in middle]
    more = cut.copy()
    more[branch[0]] = True
    assert not cut_graph._is_stretch(component, more, middle)
    around = np.zeros(len(cut), bool)
    assert cut_graph._touches(component, middle, None) and not cut_graph._touches(component, middle, around)
    around[branch[0]] = True
    assert cut_graph._touches(component, middle, around)


@pytest.mark.parametrize("longest, found", [(1.3, True), (0.9, False)])
def test_the_shortest_bridge_joins_both_boundaries(longest, found):
    V, F = meshes.grid(8, 2, width=4.0, height=1.0)
    component = component_of(V, F)
    loop = boundary_loops(F)[0]
    none = np.zeros(len(component.pair), bool)
    assert cut_graph._shortest_bridge(component, none, np.zeros(0, int), 9.0) is None
    # With a tip inside there are two boundaries, and the nearer side is half as far.
    inner = next(v for v in range(len(V)) if v not in loop and abs(V[v, 0] - 2) < 1e-9)
    tip = at_place(component, V)[[inner]]
    path = cut_graph._shortest_bridge(component, none, tip, 0.5 * longest)
    assert (path is not None) == found
    if found:
        assert component.length[path].sum() == pytest.approx(0.5) and tip[0] in component.ends[path]


def test_one_edge_of_a_cut_is_shortened_where_another_way_is_shorter():
    V, F = bumpy_ring()
    component = component_of(V, F)
    cut = cut_graph.greedy_arcs(component, np.array([0]))
    tried = set()
    found = cut_graph.shorten(component, cut, np.zeros(0, int), tried=tried)
    assert component.cost[found].sum() <= component.cost[cut].sum() and cut_graph.is_disk(component, found)
    assert tried
    again = cut_graph.shorten(component, found, np.zeros(0, int), tried=tried)
    np.testing.assert_array_equal(again, found)
    nowhere = cut_graph.shorten(component, cut, np.zeros(0, int), around=np.zeros(len(cut), bool))
    np.testing.assert_array_equal(nowhere, cut)


def test_what_is_open_is_joined_to_none():
    V, F = meshes.bumpy(3, 2)
    gluing = gluing_of(V, F)
    joined = set(gluing.first.tolist()) | set(gluing.second.tolist())
    expected = [h for h in range(3 * len(F)) if h not in joined]
    assert np.flatnonzero(gluing_facts._open(gluing)).tolist() == expected
    assert components._open_halfedges(3 * len(F), gluing.first, gluing.second).tolist() == expected


def test_components_are_compared_at_the_origin_in_their_own_size():
    component = component_of(*meshes.bumpy(3, 3))
    component.cost[2] = np.inf
    p, cost = components._relative(component)
    q = component.positions - component.positions.min(axis=0)
    np.testing.assert_allclose(p, q / q.max())
    np.testing.assert_allclose(np.delete(cost, 2), np.delete(component.cost, 2) / q.max())
    assert cost[2] == -1 and p.min() == 0 and p.max() == 1


@pytest.mark.parametrize("off, same", [(0.9e-5, True), (1.2e-5, False)])
def test_copies_are_known_within_a_hundred_thousandth(off, same):
    component = component_of(*meshes.bumpy(3, 3))
    known = components.Copies()
    known.tell(component, "found")
    moved = SimpleNamespace(**vars(component))
    moved.positions = component.positions + 3
    moved.positions[5, 2] += off * np.ptp(component.positions, axis=0).max()
    assert (known.of(moved) == "found") == same


def test_polygons_of_long_outline_are_ribbons():
    # A square and a strip side by side.
    for width, ribbons in ((0.06, False), (30.0, True)):
        V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1 + width, 0, 0], [1 + width, 1, 0.0]])
        F = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
        component = component_of(V, F)
        side = np.array([int(component.positions[t][:, 0].mean() > 1) for t in component.triangles])
        border = side[component.pair[:, 0] // 3] != side[component.pair[:, 1] // 3]
        assert border.sum() == 1 and crease_sides._ribbons(component, side, border) == ribbons


def test_groups_without_a_hole_are_disks():
    V, F = meshes.annulus(12, 2)
    component = component_of(V, F)
    none = np.zeros(len(component.pair), bool)
    one = np.zeros(len(F), int)
    assert crease_sides._disks(component, none, one, 1).tolist() == [False]
    half = (component.positions[component.triangles].mean(axis=1)[:, 0] > component.positions[:, 0].mean()).astype(int)
    border = half[component.pair[:, 0] // 3] != half[component.pair[:, 1] // 3]
    assert crease_sides._disks(component, border, half, 2).tolist() == [True, True]


def test_rows_of_two_groups_and_of_the_smaller():
    group, total = np.array([0, 1, 2, 1, 0]), np.array([5.0, 2.0, 9.0])
    both, part = crease_sides._rows(group, total, 0, 1)
    assert both.tolist() == [True, True, False, True, True] and part.tolist() == [False, True, False, True, False]
    assert crease_sides._rows(group, total, 1, 2)[1].tolist() == [False, True, False, True, False]


def test_a_part_that_is_covered_is_told_by_its_share():
    flat = np.array([0, 1, 1 + 1j, 1j, 0.2 + 0.1j, 0.9 + 0.1j, 0.2 + 0.8j, 5, 6, 5 + 1j]).astype(complex)
    corners = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9]])
    assert part_covered(flat, corners, np.array([2])) == 1
    assert part_covered(flat, corners, np.array([3])) == 0
    share = 0.245 / (0.245 + 0.5)
    assert part_covered(flat, corners, np.array([2, 3])) == pytest.approx(share)


def test_bands_join_what_is_blunt_and_large_sides_stay_apart():
    # 0 and 1 are large, 2 is a band with blunt edges to both, 3 hangs on by a hard edge, 4 and 5 are strips of a wall.
    pair = np.array([[0, 2], [1, 2], [0, 1], [0, 3], [4, 5], [0, 4], [0, 5]])
    length = np.array([3.0, 2.0, 1.0, 1.0, 2.0, 1.0, 1.0])
    blunt = np.array([3.0, 2.0, 1.0, 0.0, 2.0, 0.0, 0.0])
    large = np.array([True, True, False, False, False, False])
    area = np.array([9.0, 9.0, 0.5, 0.5, 1.0, 1.0])
    group = crease_sides._with_bands(pair, length, blunt, large, area)
    assert group[2] == group[0] != group[1] and group[4] == group[5] and len({*group[[0, 1, 3, 4]].tolist()}) == 4
    # Ribbons that meet at their ends alone stay apart: the square of what they share is less than either.
    area[4:] = 5.0
    group = crease_sides._with_bands(pair, length, blunt, large, area)
    assert group[4] != group[5]


def test_steps_across_creases_are_longer():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [1, 1, 1], [0.0, 1, 1]])
    F = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 5], [3, 4, 5]])
    gluing = gluing_of(V, F)
    found = handle_partition._steps(gluing, V)
    centre = V[F].mean(axis=1)
    for step, f, s in zip(found, gluing.first // 3, gluing.second // 3, strict=True):
        factor = 4 if {int(f), int(s)} == {1, 2} else 1
        assert step == pytest.approx(factor * np.linalg.norm(centre[f] - centre[s]))


def test_centres_are_far_apart_and_each_triangle_goes_to_the_nearest():
    V, F = meshes.grid(12, 1, width=12.0)
    gluing = gluing_of(V, F)
    steps = handle_partition._steps(gluing, V)
    m = len(F)
    far = np.full((m, m), np.inf)
    np.fill_diagonal(far, 0)
    for step, f, s in zip(steps, gluing.first // 3, gluing.second // 3, strict=True):
        far[f, s] = far[s, f] = step
    for k in range(m):
        far = np.minimum(far, far[:, [k]] + far[[k]])
    found = handle_partition._nearest_centres(gluing, steps, np.ones(m, bool))
    centres = np.unique(found)
    assert len(centres) == 4
    for t in range(m):
        assert far[t, found[t]] == pytest.approx(far[t, centres].min())
    # The first two are as far from each other as anything is from the first triangle.
    assert far[0].argmax() in centres or np.isclose(far[0, centres].max(), far[0].max())
    some = np.arange(m) < m // 2
    assert ((handle_partition._nearest_centres(gluing, steps, some) >= 0) == some).all()


def two_holes():
    """A plate of 7 by 5 squares with a hole of one square and one of two, and their numbers of edges."""
    V, F = meshes.grid(7, 5, width=7.0, height=5.0)
    middle = V[F].mean(axis=1)
    gone = ((np.abs(middle[:, 0] - 1.5) < 0.5) & (np.abs(middle[:, 1] - 2.5) < 0.5)) | (
        (np.abs(middle[:, 0] - 4.5) < 0.5) & (np.abs(middle[:, 1] - 3) < 1)
    )
    used, F = np.unique(F[~gone], return_inverse=True)
    return V[used], F.reshape(-1, 3)


def test_holes_are_all_loops_but_the_longest_and_fans_close_them():
    V, F = two_holes()
    gluing, surface = gluing_of(V, F), triangle_surface(V, F)
    none = np.zeros(len(F), bool)
    boundary, loop = hole_filling.hole_boundaries(V, gluing, none)
    assert sorted(np.bincount(loop).tolist()) == [4, 6]
    filled = hole_filling.fill_holes(surface, gluing, none)
    assert filled.holes == 2 and len(filled.surface.positions) == len(V) + 2
    for k in range(2):
        a, _ = gluing.ends(boundary[loop == k])
        np.testing.assert_allclose(filled.surface.positions[len(V) + k], V[a].mean(axis=0))
    T = filled.gluing.vertex[filled.gluing.triangles]
    assert face_areas(filled.surface.positions, T).sum() == pytest.approx(35)
    assert (filled.gluing.owner[len(F) :] == -1).all() and len(T) == len(F) + 10
    # Every pair joins two sides of one edge, that run against each other.
    ends = [filled.gluing.ends(h) for h in (filled.gluing.first, filled.gluing.second)]
    np.testing.assert_array_equal(ends[0][0], ends[1][1])
    np.testing.assert_array_equal(ends[0][1], ends[1][0])
    joined = np.concatenate([filled.gluing.first, filled.gluing.second])
    assert len(np.unique(joined)) == len(joined) == 3 * len(T) - 24
    assert hole_filling.fill_holes(surface, gluing, ~none).holes == 0


def test_edges_of_what_fills_a_hole_cost_so_many_times_as_much_and_others_the_same(monkeypatch):
    V, F = two_holes()
    filled = hole_filling.fill_holes(triangle_surface(V, F), gluing_of(V, F), np.zeros(len(F), bool))
    gluing, place = filled.gluing, filled.surface.positions
    everything = np.arange(len(gluing.triangles)), np.arange(len(gluing.first))
    given = (gluing, place, gluing.vertex, *everything, np.zeros(len(place)), np.ones(len(gluing.first)))
    found = []
    for cost in (1.0, components.HOLE):
        monkeypatch.setattr(components, "HOLE", cost)
        found.append(components.make_component(*given))
    one, other = found
    # Ends of fans are the new vertices; every other edge is between two that were there.
    new = (np.linalg.norm(one.positions[:, None] - place[None, len(V) :], axis=2) < 1e-9).any(axis=1)
    fans = new[one.ends].any(axis=1)
    assert fans.sum() == 10 and (other.cost[fans] / one.cost[fans]).tolist() == pytest.approx([components.HOLE] * 10)
    # Those on the boundary of a hole are of what fills it, too.
    times = np.isclose(other.cost, components.HOLE * one.cost)
    assert ((other.cost == one.cost) ^ times).all() and times.sum() == 20 and (~times).sum() > 20


@pytest.mark.parametrize("sieve, filled", [(0, 2), (1, 2), (2, 0)])
def test_sieves_have_more_holes_than_are_allowed(sieve, filled):
    V, F = two_holes()
    boundary, loop = hole_filling.hole_boundaries(V, gluing_of(V, F), np.zeros(len(F), bool), sieve)
    assert len(np.unique(loop)) == filled


def test_level_parts_look_one_way_and_are_not_quite_flat():
    V, F = meshes.grid(6, 6)
    for height, level in ((0.0, False), (0.02, True), (2.0, False)):
        bent = V.copy()
        bent[:, 2] = height * np.sin(5 * V[:, 0]) * np.sin(4 * V[:, 1])
        found = hole_filling.level_parts(gluing_of(bent, F), bent).triangles
        assert found.shape == (len(F),) and (found == level).all()


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("share, filled", [(0.9, 1), (1.1, 0)])
def test_holes_of_what_looks_one_way_are_small_by_the_area_of_a_disk_that_is_as_long_around(share, filled, size):
    radius = np.sqrt(share * hole_filling.SMALL / (1 + share * hole_filling.SMALL))
    V, F = meshes.annulus(60, 6)
    angle, out = np.arctan2(V[:, 1], V[:, 0]), np.linalg.norm(V[:, :2], axis=1)
    out = radius + (1 - radius) * (out - out.min()) / np.ptp(out)
    V = size * np.column_stack([out * np.cos(angle), out * np.sin(angle), 0.05 * np.sin(3 * angle) * out**2])
    gluing = gluing_of(V, F)
    level = hole_filling.level_parts(gluing, V)
    assert level.parts.all()
    found = hole_filling.hole_boundaries(V, gluing, np.zeros(len(F), bool), 32, level)
    assert len(np.unique(found[1])) == filled


def test_tips_are_ends_inside():
    V, F = meshes.grid(4, 4)
    component = component_of(V, F)
    at = at_place(component, V)
    chosen = np.zeros(len(component.pair), bool)
    for a, b in ((2, 7), (7, 12)):
        chosen[[k for k, e in enumerate(component.ends.tolist()) if set(e) == {at[a], at[b]}]] = True
    assert chosen.sum() == 2 and cuts._tips(component, chosen).tolist() == [at[12]]


def test_items_stand_by_component():
    of = np.array([2, 0, 1, 0, 2, 2])
    order, start = cuts._by_component(of, 4)
    assert order.tolist() == [1, 3, 2, 0, 4, 5] and start.tolist() == [0, 2, 3, 6, 6]


@pytest.mark.parametrize(
    "given, words",
    [
        ((True, 0, 0, 0, 0), ["many handles"]),
        ((False, 1, 0, 0, 0), ["A face looks to the other side than"]),
        ((False, 3, 0, 0, 0), ["3 faces look to the other side than"]),
        ((False, 0, 1, 0, 0), ["one side only, a face looks"]),
        ((False, 0, 2, 0, 0), ["one side only, 2 faces look"]),
        ((False, 0, 0, 5, 0), ["5 holes are filled"]),
        ((False, 0, 0, 1, 0), ["A hole is filled"]),
        ((False, 0, 0, 0, 4), ["4 boundary vertices lie"]),
        ((False, 0, 0, 0, 0), []),
        ((True, 1, 1, 1, 1), ["many handles", "A face", "one side", "A hole", "1 boundary"]),
    ],
)
def test_each_thing_that_was_done_has_its_warning(given, words):
    found = list(cuts._warnings(*given))
    assert len(found) == len(words) and all(word in text for word, text in zip(words, found, strict=True))


def test_ways_back_are_all_that_lie_before():
    before = np.array([-9999, 0, 1, 1, 3])
    assert list(symmetric._backwards(before, 4)) == [4, 3, 1, 0]


def test_halves_may_be_crossed_anywhere_in_the_plane_and_paths_never_come_onto_the_line():
    V, F = meshes.two_bumps(6)
    component = component_of(V, F)
    (half, *_) = symmetric.symmetric_halves(component)
    n = component.vertex_count
    plane = np.flatnonzero(half.image == np.arange(n))
    assert len(plane) == 7 and half.on_line[plane].sum() == 7 and half.line.sum() == 6
    assert (half.side | half.side[half.image]).all() and (half.side & half.side[half.image]).sum() == 7
    onwards = half._onwards().toarray()
    expected = np.zeros((n + 1, n + 1))
    for k, (a, b) in enumerate(half.ends.tolist()):
        cost = component.cost[half.edges[k]]
        if half.across[k]:
            continue
        for x, y in ((a, b), (b, a)):
            if half.line[k]:
                expected[x, y] = cost
            elif not half.on_line[y]:
                expected[x, y] = 2 * cost
    expected[n, plane] = 1e-9 * component.cost[half.edges].min()
    np.testing.assert_allclose(onwards, expected)
    chosen = np.zeros(len(half.edges), bool)
    chosen[:3] = True
    both = np.flatnonzero(half.whole(chosen)).tolist()
    assert both == sorted({*half.edges[:3].tolist(), *half.image_edge[:3].tolist()})
    assert half.cost(chosen) == pytest.approx(component.cost[both].sum())


def test_a_unit_box_holds_what_is_used():
    V = np.array([[10, 10, 10], [14, 10, 10], [10, 12, 10], [99, 99, 99.0]])
    F = np.array([[0, 1, 2]])
    positions, unit = gluing_facts.in_unit_box(triangle_surface(V, F), gluing_of(V, F))
    assert unit == 4
    np.testing.assert_allclose(positions, [[0, 0, 0], [1, 0, 0], [0, 0.5, 0], [0, 0, 0]])


def test_borders_are_hard_where_sides_differ_by_their_lengths():
    sums = defaultdict(float)
    component = component_of(*meshes.cube())
    side = np.array(
        [int(np.abs(np.cross(*np.diff(component.positions[t], axis=0))).argmax()) for t in component.triangles]
    )
    border = side[component.pair[:, 0] // 3] != side[component.pair[:, 1] // 3]
    chain, pair, length, _ = crease_sides._chains(component, side, border, np.zeros(component.vertex_count))
    for e in np.flatnonzero(border):
        sums[int(chain[e])] += component.length[e]
        assert set(pair[chain[e]].tolist()) == set(side[component.pair[e] // 3].tolist())
    np.testing.assert_allclose(length, [sums[k] for k in range(len(length))])
    assert (chain[~border] == -1).all()
