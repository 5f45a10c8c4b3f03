"""Pieces of refinement against loops over vertices, edges and faces, and dense equations."""

from __future__ import annotations

from itertools import combinations

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.maps.energy import Elements, elements, energies
from omt_uv.solver.maps.mirror_symmetry import mirror_symmetry
from omt_uv.solver.maps.polygon_elements import polygon_elements
from omt_uv.solver.mesh.geometry import face_areas, hat_gradients, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.refinement import (
    batch_refine,
    boundary_barrier,
    initial_maps,
    mesh_hierarchy,
    mirrored_motion,
    vertex_sweeps,
)
from omt_uv.solver.refinement import pins as pinning
from omt_uv.solver.refinement.projected_newton import fold_shares


def disks():
    """Four disks of unit extent: bumpy, flat, nearly flat, a triangle."""
    V, F = meshes.bumpy(4, 3)
    flat, G = meshes.grid(3, 5)
    nearly = flat + [0, 0, 0.02] * np.random.default_rng(0).random((len(flat), 1))
    return [(V, F), (flat, G), (nearly, G), (V[F[0]], np.array([[0, 1, 2]]))]


def crossing(a, b):
    return (a.conjugate() * b).imag


def test_a_union_knows_whose_everything_is():
    charts = disks()
    union = batch_refine._union(charts, None)
    begin = 0
    for k, (V, F) in enumerate(charts):
        own = union.of_vertex == k
        np.testing.assert_array_equal(np.flatnonzero(own), begin + np.arange(len(V)))
        np.testing.assert_array_equal(union.positions[own], V)
        np.testing.assert_array_equal(union.triangles[union.of_face == k] - begin, F)
        edges = union.boundary[union.of_boundary == k] - begin
        loop = boundary_loops(F)[0]
        assert {tuple(e) for e in edges.tolist()} == set(zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True))
        np.testing.assert_array_equal(edges[:, 1], np.roll(edges[:, 0], -1))
        begin += len(V)
    assert union.count == 4 and union.polygon is None
    values = np.arange(len(union.triangles), dtype=float)
    np.testing.assert_allclose(union.sums(values), [values[union.of_face == k].sum() for k in range(4)])


def test_polygons_of_disks_are_told_apart():
    given = [np.array([5, 5, 2]), np.array([2, 2, 9, 5]), np.array([9])]
    found = batch_refine._numbered(given)
    names = [(k, p) for k, x in enumerate(given) for p in x.tolist()]
    assert all((found[i] == found[j]) == (names[i] == names[j]) for i, j in combinations(range(len(names)), 2))
    assert sorted(set(found.tolist())) == list(range(len(set(names))))


def test_maps_side_by_side_keep_their_shapes_and_touch_nothing():
    union = batch_refine._union(disks(), None)
    w = union.positions[:, :2] @ [3, 1j] + 7
    found = batch_refine._side_by_side(union, w)
    boxes = []
    for k in range(4):
        before, after = w[union.of_vertex == k], found[union.of_vertex == k]
        scale = (after[1] - after[0]) / (before[1] - before[0])
        np.testing.assert_allclose(after - after[0], scale * (before - before[0]), atol=1e-12)
        low, high = after.real.min() + 1j * after.imag.min(), after.real.max() + 1j * after.imag.max()
        assert max((high - low).real, (high - low).imag) == pytest.approx(1)
        boxes.append((low, high))
    for (low, high), (low2, high2) in combinations(boxes, 2):
        assert max((low2 - high).real, (low2 - high).imag, (low - high2).real, (low - high2).imag) > 0.5


def test_first_maps_have_the_areas_of_their_charts_and_unroll_what_is_flat():
    charts = disks()
    union = batch_refine._union(charts, None)
    area = face_areas(union.positions, union.triangles)
    w = batch_refine._initial_maps(union, area)
    signed = signed_areas(np.column_stack([w.real, w.imag]), union.triangles)
    for k, (V, F) in enumerate(charts):
        mine = signed[union.of_face == k]
        assert (mine > 0).all() and mine.sum() == pytest.approx(area[union.of_face == k].sum())
        # Alone it is what it is among the others.
        alone = batch_refine._union([(V, F)], None)
        np.testing.assert_allclose(
            batch_refine._initial_maps(alone, face_areas(V, F)), w[union.of_vertex == k], atol=1e-9
        )
    for k in (1, 3):
        V, F = charts[k]
        z = w[union.of_vertex == k]
        for a, b in combinations(range(len(V)), 2):
            assert abs(z[a] - z[b]) == pytest.approx(np.linalg.norm(V[a] - V[b]), abs=1e-9)


def test_charts_are_isometric_where_no_face_is_sheared_or_of_another_size():
    V, F = meshes.grid(3, 2)
    union = batch_refine._union([(V, F)] * 3, None)
    faces = elements(union.positions, union.triangles, face_areas(union.positions, union.triangles))
    w = union.positions[:, :2] @ [1, 1j]
    w[union.of_vertex == 0] *= 2 * np.exp(0.3j)
    w[union.of_vertex == 1] = w[union.of_vertex == 1].real * 1.01 + 1j * w[union.of_vertex == 1].imag
    z = w[union.of_vertex == 2]
    w[union.of_vertex == 2] = z + 0.01 * z**2
    assert batch_refine._isometric(union, faces, w).tolist() == [True, False, False]


@pytest.mark.parametrize("seed", range(2))
def test_a_barrier_is_the_sum_over_vertices_near_edges(seed):
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * np.arange(24) / 24
    w = np.exp(1j * turn) * (1 + 0.6 * np.cos(2 * turn)) + 0.02 * rng.normal(size=24)
    loop = np.arange(24)
    barrier = boundary_barrier.make_barrier(w, loop, 3.0)
    edge = [abs(w[(k + 1) % 24] - w[k]) for k in range(24)]
    short = [min(e, np.mean(edge)) for e in edge]
    np.testing.assert_allclose(barrier.edge_reach, [0.5 * e for e in short])
    np.testing.assert_allclose(barrier.vertex_reach, [0.5 * min(short[k - 1], short[k]) for k in range(24)])
    moved, total, pairs = w * [[1.0, 0.25][seed]] + 0.0, 0.0, 0
    for v in range(24):
        for e in range(24):
            a, b = moved[e], moved[(e + 1) % 24]
            if v in (e, (e + 1) % 24):
                continue
            share = min(max(((moved[v] - a) * (b - a).conjugate()).real / abs(b - a) ** 2, 0), 1)
            reach, distance = min(barrier.vertex_reach[v], barrier.edge_reach[e]), abs(moved[v] - a - share * (b - a))
            if distance < reach:
                total, pairs = total + 3.0 * (reach / distance - 1) ** 2, pairs + 1
    assert barrier.energy(moved) == pytest.approx(total) and (pairs > 0) == (seed == 1)


@pytest.mark.parametrize("seed", range(3))
def test_contact_is_the_first_time_at_which_a_point_is_on_a_moving_segment(seed):
    rng = np.random.default_rng(seed)
    p, dp, e, de = rng.normal(size=(4, 40)) + 1j * rng.normal(size=(4, 40))
    de[::4] = 0
    found = boundary_barrier._contact_times(p, dp, e, de)
    t = np.linspace(0, 1 / 0.8, 40001)
    for k in range(40):
        at, edge = p[k] + t * dp[k], e[k] + t * de[k]
        side = crossing(edge, at)
        share = (at * edge.conj()).real / np.abs(edge) ** 2
        hit = np.flatnonzero((side[1:] * side[:-1] <= 0) & (share[1:] >= 0) & (share[1:] <= 1))
        if np.isfinite(found[k]) != bool(len(hit)):
            # Only next to an end of the segment, or of the time, may a search of points differ.
            at, edge = p[k] + found[k] * dp[k], e[k] + found[k] * de[k]
            assert min(abs(at), abs(at - edge), abs(found[k] - t[-1])) < 1e-3
        elif len(hit):
            assert found[k] == pytest.approx(t[hit[0]], abs=1e-3)
    assert 3 <= np.isfinite(found).sum() < 40


def test_heavy_vertices_hold_more_than_the_mean():
    V, F = meshes.random_disk(60, 2)
    density = np.random.default_rng(0).uniform(0.2, 3, len(V))
    area, hold = face_areas(V, F), []
    for v in range(len(V)):
        hold.append(density[v] * sum(area[k] for k in range(len(F)) if v in F[k]))
    np.testing.assert_array_equal(mesh_hierarchy._heavy(V, F, density), hold > np.mean(hold))


def stars_of(F, chosen):
    """v, after, before of the faces around the chosen vertices, by vertex, as a round of collapses has them."""
    star, corner = vertex_sweeps.stars(F, chosen)
    return np.take_along_axis(F[star], corner, 1).T


@pytest.mark.parametrize("flat", [True, False])
def test_collapses_go_where_no_face_turns_over_and_the_worst_is_best(flat):
    V, F = meshes.random_disk(50, 3, height=0.2)
    uv = V[:, :2].copy() if flat else None
    rank = np.random.default_rng(1).permutation(len(V))
    chosen = vertex_sweeps.independent_set(F, rank)
    v, after, before = stars_of(F, chosen)
    loop = boundary_loops(F)[0]
    ahead = np.full(len(V), -1)
    ahead[loop] = np.roll(loop, -1)
    into, good = mesh_hierarchy._best_collapses(V, uv, v, after, before, ahead)

    def shape(p):
        sides = sum(((p[i] - p[i - 1]) ** 2).sum() for i in range(3))
        return 2 * np.sqrt(3) * np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0])) / sides

    for x in set(v.tolist()):
        faces = [(a, b) for y, a, b in zip(v, after, before, strict=True) if y == x]
        whole = sum(np.cross(V[a] - V[x], V[b] - V[x]) for a, b in faces)
        scores = {}
        for goal, _ in faces:
            new = [(goal, a, b) for a, b in faces if goal not in (a, b)]
            if not new or (ahead[x] >= 0 and goal != ahead[x]) or (ahead[x] < 0 and ahead[goal] >= 0):
                continue
            if any(np.cross(V[a] - V[g], V[b] - V[g]) @ whole <= 0 for g, a, b in new):
                continue
            if flat:
                sides = [uv[[g, a, b]] for g, a, b in new]
                if any((t[1] - t[0])[0] * (t[2] - t[0])[1] <= (t[1] - t[0])[1] * (t[2] - t[0])[0] for t in sides):
                    continue
            worst = min(shape(V[[g, a, b]]) for g, a, b in new)
            if worst >= min(0.15, min(shape(V[[x, a, b]]) for a, b in faces) / 2):
                scores[goal] = worst
        rows = v == x
        assert good[rows].all() == bool(scores) and len(set(good[rows].tolist())) == 1
        if scores:
            (goal,) = set(into[rows].tolist())
            assert scores[goal] > max(scores.values()) - 1 / 20


def ahead_of(V, F):
    """The next vertex of the boundary (n,), -1 for those inside."""
    loop, ahead = boundary_loops(F)[0], np.full(len(V), -1)
    ahead[loop] = np.roll(loop, -1)
    return ahead


@pytest.mark.parametrize("flat", [True, False])
def test_a_round_of_collapses_keeps_areas_masses_and_the_way_back(flat):
    V, F = meshes.random_disk(80, 4, height=0.0)
    uv = V[:, :2].copy()
    mass = np.random.default_rng(0).uniform(0.5, 2, (len(F), 2))
    rank = np.random.default_rng(1).permutation(len(V))
    triangles, handed, removal = mesh_hierarchy._round(V, F, uv if flat else None, mass, rank, ahead_of(V, F))
    np.testing.assert_allclose(handed.sum(axis=0), mass.sum(axis=0))
    assert not np.isin(triangles, removal.vertex).any() and len(removal.vertex) > 10
    assert (signed_areas(uv, triangles) > 0).all()
    np.testing.assert_allclose(removal.share.sum(axis=1), 1)
    for k, v in enumerate(removal.vertex.tolist()):
        rows = removal.row == k
        expected = {tuple(np.roll(f, -f.tolist().index(v))[1:].tolist()) for f in F if v in f}
        assert set(zip(removal.after[rows].tolist(), removal.before[rows].tolist(), strict=True)) == expected
        assert removal.mass[rows].sum() == pytest.approx(mass[(v == F).any(axis=1), 0].sum())
        # On a flat disk every inner vertex returns to where it was.
        if not removal.on_boundary[k]:
            np.testing.assert_allclose(removal.share[k] @ uv[removal.corner[k]], uv[v], atol=1e-9)
            if (removal.share[k] >= 0).all():
                assert signed_areas(uv, removal.corner[k][None])[0] > 0
    w = uv @ [1, 1j]
    back = w.copy()
    back[removal.vertex] = mesh_hierarchy._returned(removal, np.where(np.isin(np.arange(len(V)), removal.vertex), 0, w))
    inner = ~removal.on_boundary & (removal.share.min(axis=1) > 0.05)
    assert inner.any() and (signed_areas(np.column_stack([back.real, back.imag]), F) > 0).all()


def test_the_share_of_a_chord_is_by_lengths_of_the_boundary():
    V, F = meshes.grid(4, 2)
    V[2, 0] += 0.05
    rank = np.full(len(V), -1)
    rank[2] = 1
    _, _, removal = mesh_hierarchy._round(V, F, V[:, :2].copy(), np.ones((len(F), 1)), rank, ahead_of(V, F))
    loop = boundary_loops(F)[0]
    at = loop.tolist().index(2)
    before, ahead = loop[at - 1], loop[at + 1]
    assert removal.vertex.tolist() == [2] and removal.into.tolist() == [ahead] and removal.on_boundary.all()
    assert removal.corner.tolist() == [[ahead, before, before]]
    past, forth = np.linalg.norm(V[2] - V[before]), np.linalg.norm(V[2] - V[ahead])
    np.testing.assert_allclose(removal.share, [[past / (past + forth), forth / (past + forth), 0]])


def test_independent_sets_take_high_ranks_first_and_none_below_zero():
    V, F = meshes.random_disk(70, 1)
    rank = np.random.default_rng(5).permutation(len(V)) - 10
    chosen = vertex_sweeps.independent_set(F, rank)
    assert not chosen[rank < 0].any() and (chosen[F].sum(axis=1) <= 1).all()
    # Whoever beats all neighbours is chosen.
    for v in range(len(V)):
        around = set(F[(v == F).any(axis=1)].ravel().tolist()) - {v}
        if rank[v] >= 0 and all(rank[v] > rank[u] for u in around):
            assert chosen[v]
        if rank[v] >= 0 and not chosen[v] and not any(chosen[u] for u in around):
            assert any(rank[u] > rank[v] for u in around)


def test_stars_are_the_faces_around_vertices_turned_to_begin_there():
    V, F = meshes.random_disk(40, 1)
    chosen = vertex_sweeps.independent_set(F, np.arange(len(V)))
    star, corner = vertex_sweeps.stars(F, chosen)
    found = np.take_along_axis(F[star], corner, 1)
    assert (np.diff(found[:, 0]) >= 0).all()
    for k, face in zip(star, found, strict=True):
        assert any(np.array_equal(np.roll(F[k], -s), face) for s in range(3)) and chosen[face[0]]
    assert len(star) == sum(bool(chosen[f].any()) for f in F)
    faces = elements(V, F, face_areas(V, F) * np.linspace(0.5, 2, len(F)))
    some = vertex_sweeps.take_faces(faces, star, corner)
    w = V[:, :2] @ [1.1, 1j]
    np.testing.assert_allclose(energies(some, w, 3.0), energies(faces, w, 3.0)[star])
    part = vertex_sweeps._rows(some, slice(3, 9))
    np.testing.assert_allclose(energies(part, w, 3.0), energies(faces, w, 3.0)[star[3:9]])


def one_set(seed=1):
    V, F = meshes.random_disk(50, seed)
    faces = elements(V, F, face_areas(V, F) * np.random.default_rng(seed).uniform(0.4, 2, len(F)))
    w = V[:, :2] @ [1, 1j]
    vertex, row, star = next(iter(vertex_sweeps._sets(faces, len(V))))
    return faces, w, vertex, row, star


def test_faces_around_moving_corners_have_the_energies_of_the_moved_map():
    faces, w, vertex, row, star = one_set()
    around = vertex_sweeps._around(star, w)
    step = 0.02 * np.exp(1j * np.arange(len(vertex)))
    moved = w.copy()
    moved[vertex] += step
    np.testing.assert_allclose(around.energies(5.0), energies(star, w, 5.0))
    np.testing.assert_allclose(around.moved(step[row]).energies(5.0), energies(star, moved, 5.0), rtol=1e-9)
    far = w.copy()
    far[vertex] += 3
    found = around.moved(np.full(len(row), 3 + 0j)).energies(5.0)
    np.testing.assert_array_equal(np.isinf(found), np.isinf(energies(star, far, 5.0)))
    some, rows = vertex_sweeps._star_of(np.array([0, 2]), row, around, len(vertex))
    np.testing.assert_allclose(some.det, around.det[np.isin(row, [0, 2])])
    np.testing.assert_array_equal(rows, np.where(row[np.isin(row, [0, 2])] == 0, 0, 1))


def test_steps_of_single_vertices_are_halved_until_each_ones_energy_falls():
    faces, w, vertex, row, star = one_set()
    around, k = vertex_sweeps._around(star, w), len(vertex)
    value = np.bincount(row, around.energies(5.0), k)
    step = np.where(np.arange(k) % 2, 8, 1) * vertex_sweeps._directions(row, around, 5.0, k)
    step[3] *= -1
    step[1] = 0
    moved, after = vertex_sweeps._searched(row, around, step, 5.0, value)
    halved = set()
    for x in range(k):
        for halving in range(5):
            trial = w.copy()
            trial[vertex[x]] += step[x] / 2**halving
            new = energies(star, trial, 5.0)[row == x].sum()
            if new < value[x]:
                break
        if x == 1 or not new < value[x]:
            assert moved[x] == 0 and after[x] == value[x]
        else:
            halved.add(halving)
            assert moved[x] == pytest.approx(step[x] / 2**halving) and after[x] == pytest.approx(new)
    assert len(halved) > 1 and moved[3] == 0


def test_what_is_fixed_stays_and_nobodys_energy_rises():
    faces, w, vertex, row, star = one_set()
    fixed = np.arange(len(vertex)) % 2 == 0
    after = w.copy()
    vertex_sweeps.relax(vertex, row, star, after, 5.0, 2, fixed)
    moved = np.flatnonzero(after != w)
    assert set(moved) <= set(vertex[~fixed]) and len(moved) > len(vertex) / 4
    before, now = (np.bincount(row, energies(star, x, 5.0), len(vertex)) for x in (w, after))
    assert (now <= before).all()


@pytest.mark.parametrize("at", [0.0, 0.3, 1.0, 1.5, 2.75, 3.999])
def test_places_on_the_square_and_back(at):
    x, y = initial_maps._on_square(np.array([at]))[0]
    side, t = int(at), at % 1
    expected = [(-1 + 2 * t, -1), (1, -1 + 2 * t), (1 - 2 * t, 1), (-1, 1 - 2 * t)][side]
    assert (x, y) == pytest.approx(expected)
    assert initial_maps._perimeter(np.array([[x, y]]) * 0.9)[0] == pytest.approx(at, abs=0.11)
    assert initial_maps._perimeter(np.array([[x, y]]))[0] == pytest.approx(at, abs=1e-9)


def test_corners_go_to_the_nearest_vertices_and_order_stays():
    s = np.array([0.2, 0.9, 1.4, 1.9, 2.5, 2.95, 3.1, 3.6])
    snapped, corner = initial_maps._snap_corners(s)
    nearest = [int(np.abs((s - k + 2) % 4 - 2).argmin()) for k in range(4)]
    assert np.flatnonzero(corner).tolist() == sorted(nearest)
    np.testing.assert_allclose(snapped[nearest], range(4))
    others = ~corner
    np.testing.assert_allclose(snapped[others], s[others])
    ring = np.roll(snapped, -snapped.argmin())
    assert (np.diff(ring) > 0).all()
    # All at one corner: spread evenly.
    crowded, corner = initial_maps._snap_corners(np.linspace(0, 0.01, 8))
    assert corner.sum() == 4 and sorted(np.floor(crowded + 1e-9).tolist()) == [0, 0, 1, 1, 2, 2, 3, 3]
    with pytest.raises(FoldedUVError, match="A chart with fewer than four boundary vertices"):
        initial_maps._snap_corners(np.arange(3.0))


def test_outlines_have_their_centroid_in_the_middle():
    outline = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]], float) + [5, -2]
    parts = [((2, 0.5), 4.0), ((0.5, 2), 2.0)]
    middle = sum(np.array(c) * a for c, a in parts) / 6 + [5, -2]
    np.testing.assert_allclose(initial_maps._middle(outline), middle)
    np.testing.assert_allclose(initial_maps._middle(outline[::-1]), middle)
    eight = np.array([[0, 0], [2, 2], [0, 2], [2, 0.0]])
    np.testing.assert_allclose(initial_maps._middle(eight), [1, 1])


def test_curvature_is_what_angles_lack_of_a_turn_inside():
    V, F = meshes.random_disk(60, 0)
    loop = boundary_loops(F)[0]
    total = 0.0
    for v in set(range(len(V))) - set(loop.tolist()):
        angle = 0.0
        for f in F[(v == F).any(axis=1)]:
            a, b = (V[u] - V[v] for u in f if u != v)
            angle += np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
        total += abs(2 * np.pi - angle)
    assert initial_maps.inner_curvature(V, F, loop) == pytest.approx(total) and total > 0.5
    assert initial_maps.is_curved(V, F, loop)
    V[:, 2] *= 0.01
    assert not initial_maps.is_curved(V, F, loop)


def test_the_farthest_of_each_boundary_from_its_first():
    union = batch_refine._union(disks(), None)
    first, far = initial_maps.farthest_from_first(union.positions, union.boundary, union.of_boundary)
    for k in range(4):
        loop = union.boundary[union.of_boundary == k, 0]
        away = np.linalg.norm(union.positions[loop] - union.positions[loop[0]], axis=1)
        assert first[k] == loop[0] and far[k] == loop[np.flatnonzero(away >= away.max() * (1 - 1e-6))[0]]


def test_conformal_maps_are_least_squares_with_two_places_given():
    V, F = meshes.bumpy(4, 3)
    n, area = len(V), face_areas(V, F)
    found = initial_maps.least_squares_conformal(V, F, np.array([0]), np.array([n - 1]))
    _, gradient = hat_gradients(V, F)
    matrix = np.zeros((len(F), n), complex)
    for t, f in enumerate(F):
        matrix[t, f] += np.sqrt(area[t]) * gradient[t]
    free = np.arange(1, n - 1)
    at = np.linalg.norm(V[n - 1] - V[0])
    expected = np.zeros(n, complex)
    expected[n - 1] = at
    expected[free] = -np.linalg.lstsq(matrix[:, free], matrix[:, n - 1] * at, rcond=None)[0]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("share, refused", [(0.04, True), (0.06, False)])
def test_maps_need_some_orientation(share, refused):
    # Many equal triangles, of which a half and a little more lie one way.
    up = round(1000 * (1 + share) / 2)
    uv = np.array([[0, 0], [1, 0], [0, 1.0]])
    F = np.array([[0, 1, 2]] * up + [[0, 2, 1]] * (1000 - up))
    if refused:
        with pytest.raises(FoldedUVError) as error:
            initial_maps.check_initial_map(uv, F)
        np.testing.assert_array_equal(error.value.elements, np.arange(up, 1000))
    else:
        initial_maps.check_initial_map(uv, F)


@pytest.mark.parametrize("height, refused", [(1e-12, True), (4e-12, False)])
def test_maps_need_an_area(height, refused):
    uv, F = np.array([[0, 0], [1, 0], [0, height]]), np.array([[0, 1, 2]])
    if refused:
        with pytest.raises(FoldedUVError, match="no area"):
            initial_maps.check_initial_map(uv, F)
    else:
        initial_maps.check_initial_map(uv, F)


@pytest.mark.parametrize("seed", range(2))
def test_first_folds_are_the_first_roots_of_each_face(seed):
    a, b, da, db = np.random.default_rng(seed).normal(size=(4, 60)) + 1j * np.random.default_rng(seed + 9).normal(
        size=(4, 60)
    )
    a = a * 2 * np.maximum(1, np.abs(b) / np.abs(a))
    da[::5] = 0.1 * a[::5]
    db[::5] = 0
    found = fold_shares(a, b, da, db)
    for k in range(60):
        poly = [
            abs(da[k]) ** 2 - abs(db[k]) ** 2,
            2 * ((a[k].conjugate() * da[k]).real - (b[k].conjugate() * db[k]).real),
            abs(a[k]) ** 2 - abs(b[k]) ** 2,
        ]
        roots = [r.real for r in np.roots(poly) if abs(r.imag) < 1e-9 and r.real > 0]
        assert found[k] == pytest.approx(min(roots, default=np.inf))
    assert 5 < np.isfinite(found).sum() < 60


def test_pins_draw_with_a_force_that_grows_with_their_distance():
    pins = pinning.check_pins([4, 1], [[2, 0], [0, 3]], 6)
    assert pins.vertices.tolist() == [1, 4] and pins.places.tolist() == [3j, 2]
    term = pinning.PinEnergy(pins, 7.0, 2.0)
    w = np.arange(6) * (1 + 0.5j)
    assert term.energy(w) == pytest.approx(7 * (abs(w[1] - 3j) ** 2 + abs(w[4] - 2) ** 2) / 4)
    slope, vertices, rows = term.derivatives(w)
    step = np.random.default_rng(0).normal(size=6) + 1j * np.random.default_rng(1).normal(size=6)
    bent = sum((row * step[v]).real ** 2 for (v,), (row,) in zip(vertices.tolist(), rows.tolist(), strict=True))
    assert term.energy(w + step) == pytest.approx(term.energy(w) + (slope.conj() * step).real.sum() + bent / 2)
    assert term.limit(w, step) == np.inf


@pytest.mark.parametrize("area", [None, 5.0])
def test_what_is_placed_like_another_map_keeps_its_shape(area):
    V, F = meshes.bumpy(5, 4)
    faces = elements(V, F, face_areas(V, F))
    given = V[:, :2] @ [2, 2j] * np.exp(0.7j) + (3 - 1j)
    w = V[:, :2] @ [0.1, 0.1j] - 8
    found = pinning.placed_like(w, given, faces, area=area)
    size = abs(faces.areas(given).sum()) if area is None else area
    assert faces.areas(found).sum() == pytest.approx(size)
    if area is None:
        np.testing.assert_allclose(found, given, atol=1e-9)
    else:
        turn = (found[1] - found[0]) / (given[1] - given[0])
        assert np.angle(turn) == pytest.approx(0, abs=1e-9)
    pins = pinning.Pins(np.array([3]), np.array([10 + 10j]))
    pinned = pinning.placed_like(w, given, faces, pins, area)
    assert pinned[3] == pytest.approx(10 + 10j)
    np.testing.assert_allclose(pinned - pinned[3], found - found[3], atol=1e-9)


def mirrored():
    """A flat grid of quads about x = 0, its elements, and the images of its vertices."""
    V, F = meshes.grid(4, 2)
    V[:, 0] -= 0.5
    corner = (np.arange(2)[:, None] * 5 + np.arange(4)).ravel()
    quads = np.column_stack([corner, corner + 1, corner + 6, corner + 5])
    F = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    image = np.array([int(np.abs(V - p * [-1, 1, 1]).sum(axis=1).argmin()) for p in V])
    return V, F, np.tile(np.arange(8), 2), quads, image


def test_images_of_polygons_have_the_images_of_their_corners():
    V, F, polygons, quads, image = mirrored()
    faces = polygon_elements(V, F, face_areas(V, F), polygons)
    found = mirrored_motion._image_polygons(faces, image)
    corners = [set(q.tolist()) for q in mirrored_motion.corners_of_quads(faces)]
    for k, own in enumerate(corners):
        assert corners[found[k]] == {int(image[v]) for v in own}
    single = elements(V, F, face_areas(V, F))
    found = mirrored_motion._image_polygons(single, image)
    corners = [set(f.tolist()) for f in F]
    for k, own in enumerate(corners):
        there = {int(image[v]) for v in own}
        assert found[k] == (corners.index(there) if there in corners else -1)
    # All diagonals run one way: each quad is cut otherwise than its image.
    symmetry = mirror_symmetry(image[None])
    both = np.array([mirrored_motion._image_polygons(faces, x) for x in (np.arange(len(V)), image)])
    assert mirrored_motion._cut_otherwise(faces, both, symmetry).all()
    assert not mirrored_motion._cut_otherwise(faces, both[:1].repeat(2, axis=0), symmetry).any()


@pytest.mark.parametrize("name", ["area", "ratio", "region", "gradient"])
@pytest.mark.parametrize("off, alike", [(1e-6, True), (1e-3, False)])
def test_polygons_are_alike_within_a_hundred_thousandth(name, off, alike):
    area, triangles = np.full(4, 0.25), np.arange(12).reshape(4, 3)
    gradient = np.tile(np.array([1.0, 1j, -1 - 1j]), (4, 1))
    values = {"area": area, "ratio": np.ones(4), "gradient": gradient, "region": np.full(4, 0.5)}
    values[name] = values[name].copy()
    values[name][1] *= 1 + off
    faces = Elements(triangles, values["area"], values["gradient"], values["ratio"], area, values["region"])
    found = mirrored_motion._alike(faces, np.array([[0, 1, 2, 3], [1, 0, 3, 2]]))
    assert found.tolist() == [alike, alike, True, True]


def test_points_leave_a_rectangle_by_the_larger_coordinate():
    outline = np.array([2 + 1j, -2 + 1j, -2 - 1j, 2 - 1j])
    found = mirrored_motion._from_sides(np.array([1 + 1j, 2 + 0j, 0.5 - 0.25j, -3 + 2j]), outline)
    np.testing.assert_allclose(found, [1, 1, 0.25, 2])


def test_symmetric_starts_stay_on_their_circle_and_their_square():
    V, F, _, _, image = mirrored()
    symmetry = mirror_symmetry(image[None], -1.0)
    w = V[:, :2] @ [1, 1j] - 0.5j
    loop = boundary_loops(F)[0]
    off = w * 1.2
    found = mirrored_motion._on_outline(symmetry, off, w, "disk", loop)
    np.testing.assert_allclose(np.abs(found[loop]), np.abs(w[loop]))
    np.testing.assert_allclose(np.angle(found[loop]), np.angle(w[loop]))
    assert mirrored_motion._on_outline(symmetry, off, w, "free", loop) is off
    assert mirrored_motion._on_outline(symmetry, off, w, "square", loop) is None
    assert mirrored_motion._on_outline(symmetry, w, w, "square", loop) is w
    starts = list(mirrored_motion._next_to(symmetry, w, symmetry.averaged(w), "square"))
    assert len(starts) == 1
    bent = w + 0.1 * np.abs(w.real) * (w.real > 0)
    mean, right, left = mirrored_motion._next_to(symmetry, bent, symmetry.averaged(bent), "free")
    for half in (right, left):
        np.testing.assert_allclose(half, symmetry.averaged(half), atol=1e-12)
        kept = np.abs(half - bent) < 1e-12
        one = {int(np.sign(x)) for x in bent[kept].real if abs(x) > 1e-9}
        assert len(one) <= 1 or np.allclose(mean, bent)
    assert np.abs(right - left).max() > 0.01
