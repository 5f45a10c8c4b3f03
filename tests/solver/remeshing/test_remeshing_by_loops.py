"""Pieces of remeshing against loops over vertices, edges, samples and arcs, and dense equations."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas, vertex_normals
from omt_uv.solver.mesh.topology import pair_keys, twins
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.fitting import hausdorff_peaks, least_squares
from omt_uv.solver.remeshing.initial import arc_network, boundary_samples, disk_samples, sample_plan
from omt_uv.solver.remeshing.relaxation import cvt, vertex_balance, voronoi_cells
from omt_uv.solver.remeshing.relaxation.surface_carrier import SurfaceCarrier


def working(V, F, locked=(), fixed=()):
    on = np.zeros(len(V), bool)
    on[list(fixed)] = True
    return WorkingMesh(V, F, fixed=on, locked=np.array(locked, np.int64))


def halfedges_of(F):
    return F.ravel(), np.roll(F, -1, axis=1).ravel()


def sizes(p):
    return 0.3 + 0.1 * p[:, 0]


@pytest.mark.parametrize("seed", range(2))
def test_surpluses_are_means_around_of_about_the_same_length(seed, monkeypatch):
    V, F = meshes.random_disk(40, seed, height=0.2)
    measure = np.random.default_rng(seed).uniform(0.5, 2, len(V))
    solve, asked = vertex_balance.solve_conjugate_gradients, []
    monkeypatch.setattr(
        vertex_balance, "solve_conjugate_gradients", lambda a, b, least: (asked.append(least), solve(a, b, least))[1]
    )
    found = vertex_balance._surplus(working(V, F), measure, sizes)
    tail, head = halfedges_of(F)
    twin = twins(F)
    cells = np.ones(len(V))
    cells[tail[twin < 0]] = 0.5
    surplus = cells - measure * cells.sum() / measure.sum()
    system = np.eye(len(V))
    for k in range(len(tail)):
        if twin[k] > k:
            a, b = tail[k], head[k]
            one, other = sizes(V[[a]])[0], sizes(V[[b]])[0]
            w = 64 / 1.5 * (min(one, other) / max(one, other)) ** 4
            system[a, a] += w
            system[b, b] += w
            system[a, b] -= w
            system[b, a] -= w
    left = surplus.copy()
    for _ in range(3):
        left = left - np.linalg.solve(system, left)
    np.testing.assert_allclose(found, surplus - left, atol=0.02 * np.abs(surplus).max())
    assert asked == [0.01] * 3


@pytest.mark.parametrize("excess, balanced", [([0.011, -5.0, 0.0], True), ([0.007, -9.0, 0.0061], False)])
def test_vertices_are_balanced_below_a_share_of_them_all(excess, balanced):
    assert vertex_balance._is_balanced(np.array(excess), 0.004) == balanced


def test_the_measure_of_those_gone_is_shared_by_their_neighbours():
    V, F = meshes.bumpy(3, 3)
    measure = np.random.default_rng(0).random(len(V))
    origin = np.array([k for k in range(len(V)) if k not in (5, 6)])
    found = vertex_balance._inherited(working(V, F), SimpleNamespace(origin=origin), measure)
    tail, head = halfedges_of(F)
    expected = measure.copy()
    for v in (5, 6):
        around = [b for a, b in zip(tail.tolist(), head.tolist(), strict=True) if a == v]
        for u in around:
            expected[u] += measure[v] / len(around)
    np.testing.assert_allclose(found, expected[origin])


@pytest.mark.parametrize("collapse", [True, False])
def test_edges_come_by_what_they_leave_of_missing_neighbours_and_length(collapse):
    V, F = meshes.random_disk(40, 1, height=0.1)
    amount = np.random.default_rng(0).uniform(0, 0.3, len(V))
    amount[::4] = 0
    locked = pair_keys(F[5:6, 0], F[5:6, 1])
    mesh = working(V, F, locked)
    found = vertex_balance._best_edges(mesh, amount, collapse)
    tail, head = halfedges_of(F)
    twin = mesh.twin
    expected = [
        h
        for h in range(len(tail))
        if twin[h] > h and amount[tail[h]] > 0 and pair_keys(tail[[h]], head[[h]])[0] not in locked
    ]
    assert sorted(found.tolist()) == expected
    excess = np.bincount(tail, minlength=len(V)) - 6
    excess[tail[twin < 0]] += 3
    length = {h: np.linalg.norm(V[tail[h]] - V[head[h]]) for h in expected}
    mean = np.mean(list(length.values()))

    def cost(h):
        a, b = excess[tail[h]], excess[head[h]]
        far = excess[F[h // 3, (h % 3 + 2) % 3]] + excess[F[twin[h] // 3, (twin[h] % 3 + 2) % 3]]
        size = 3 * length[h] / mean
        return (a + b + 2) ** 2 - a * a - b * b - 2 * far + size if collapse else 2 * far - size

    from scipy.spatial import cKDTree

    group = np.zeros(len(V), int)
    order = cKDTree(V).indices
    group[order] = np.floor(np.cumsum(amount[order]))
    ranks = {h: sum(cost(g) < cost(h) for g in expected if group[tail[g]] == group[tail[h]]) for h in expected}
    assert (np.diff([ranks[h] for h in found.tolist()]) >= 0).all()
    assert [cost(h) for h in found.tolist() if group[tail[h]] == 0] == sorted(
        cost(h) for h in expected if group[tail[h]] == 0
    )


def test_steps_go_along_the_surface_and_no_farther_than_a_share_of_the_sides_around():
    V, F = meshes.random_disk(30, 0)
    rng = np.random.default_rng(0)
    step, normal = 0.2 * rng.normal(size=V.shape), vertex_normals(V, F)
    fixed = np.arange(len(V)) % 5 == 0
    along = cvt._tangential(step, normal, fixed)
    for v in range(len(V)):
        np.testing.assert_allclose(along[v], 0 if fixed[v] else step[v] - (step[v] @ normal[v]) * normal[v], atol=1e-12)
    step[3] *= 1e-3
    shortest = voronoi_cells.voronoi_cells(V, F, np.ones(len(V))).shortest
    expected = [min(np.linalg.norm(V[F[t, k]] - V[F[t, k - 1]]) for k in range(3)) for t in range(len(F))]
    np.testing.assert_allclose(shortest, expected)
    found, mean = cvt._bounded(step, shortest, F)
    total = []
    for v in range(len(V)):
        most = min(0.4 * shortest[t] for t in range(len(F)) if v in F[t])
        size = np.linalg.norm(step[v])
        np.testing.assert_allclose(found[v], step[v] * min(1, most / size), atol=1e-12)
    for t in range(len(F)):
        total += [np.linalg.norm(found[v]) / shortest[t] for v in F[t]]
    assert mean == pytest.approx(np.mean(total))


def test_cells_are_corrected_by_the_share_in_which_samples_are_trusted():
    rng = np.random.default_rng(0)
    n, points = 6, rng.normal(size=(6, 3))
    share = np.array([0, 0.3, 1, 0, 0.5, 1.0])
    mass, centroid, crest, far = rng.random(n), rng.normal(size=(n, 3)), rng.random(n), rng.normal(size=(n, 3))
    cells = voronoi_cells.VoronoiCells(rng.random(n), rng.normal(size=(n, 3)), 7.0, rng.random(4))
    found = cvt.SampleCorrection(share, mass, centroid, crest, far).correct(points, cells)
    energy = 7.0
    for v in range(n):
        b = share[v]
        assert found.mass[v] == pytest.approx((1 - b) * cells.mass[v] + b * mass[v] + crest[v])
        moment = (1 - b) * cells.moment[v] + b * mass[v] * (centroid[v] - points[v]) + crest[v] * (far[v] - points[v])
        np.testing.assert_allclose(found.moment[v], moment)
        energy += crest[v] * ((far[v] - points[v]) ** 2).sum()
    assert found.energy == pytest.approx(energy) and found.shortest is cells.shortest


def test_samples_are_trusted_where_they_see_more_than_the_mesh_covers():
    V, F = meshes.bumpy(4, 4)
    n, covered = len(V), vertex_areas(V, F)
    rng = np.random.default_rng(0)
    area = covered * rng.uniform(0.9, 1.6, n)
    seen = SimpleNamespace(area=area, mass=area.copy(), moment=rng.normal(size=(n, 3)))
    seen.mass[3] = 0
    crest = SimpleNamespace(mass=rng.random(n), moment=rng.normal(size=(n, 3)))
    carrier = SimpleNamespace(nearest_sums=lambda *_: (seen, crest))
    found = cvt._sample_correction(V, F, None, carrier)
    tail, head = halfedges_of(F)
    for v in range(n):
        around = head[tail == v]
        ratio = (area[around].sum() + 2 * area[v]) / (covered[around].sum() + 2 * covered[v])
        expected = min(max((ratio - 1.1) / 0.2, 0), 1) if v != 3 else 0
        assert found.share[v] == pytest.approx(expected, abs=1e-9)
    assert 0 < found.share.mean() < 1
    np.testing.assert_allclose(found.crest_mass, 4 * crest.mass)
    np.testing.assert_allclose(found.crest_centroid - V, crest.moment / crest.mass[:, None])
    np.testing.assert_allclose((found.centroid - V)[4], seen.moment[4] / seen.mass[4])


def test_circumcentres_are_as_far_from_all_corners():
    p = np.random.default_rng(0).normal(size=(30, 3, 3))
    square = np.stack([((p[:, (k + 1) % 3] - p[:, (k + 2) % 3]) ** 2).sum(axis=1) for k in range(3)])
    w, double = voronoi_cells._circumcentre(square)
    np.testing.assert_allclose(w.sum(axis=0), 1)
    np.testing.assert_allclose(double, 2 * face_areas(p.reshape(-1, 3), np.arange(90).reshape(30, 3)))
    raw = square * (square.sum(axis=0) - 2 * square)
    some = (np.abs(raw / raw.sum(axis=0) - 0.5) < 1.5).all(axis=0)
    centre = np.einsum("kt,tkd->td", w, p)
    far = np.linalg.norm(p - centre[:, None], axis=2)[some]
    np.testing.assert_allclose(far, far[:, :1] * np.ones(3))
    assert some.sum() > 15
    w, double = voronoi_cells._circumcentre(np.array([[4.0], [1.0], [1.0]]))
    np.testing.assert_allclose(w[:, 0], 1 / 3)
    assert double[0] == 0


def carrier_of():
    V, F = meshes.bumpy(6, 6)
    density = np.where(V[F].mean(axis=1)[:, 0] > 0.5, 2.0, 1.0)
    return SurfaceCarrier(ClosestPoint(V, F, 0.2), density, 20), V, F


def test_sums_are_of_the_samples_nearest_by_place_and_normal():
    carrier, V, F = carrier_of()
    points, normals = V[::7], vertex_normals(V, F)[::7]
    samples, scale = carrier._samples, carrier.index.normal_scale
    near, area, mass, moment = [], np.zeros(len(points)), np.zeros(len(points)), np.zeros(points.shape)
    for k in range(len(samples.points)):
        off = ((points - samples.points[k]) ** 2).sum(axis=1) + scale**2 * ((normals - samples.normals[k]) ** 2).sum(
            axis=1
        )
        near.append(int(off.argmin()))
        heavy = samples.area[k] * carrier.density[samples.faces[k]] ** 2
        area[near[-1]] += samples.area[k]
        mass[near[-1]] += heavy
        moment[near[-1]] += heavy * (samples.points[k] - points[near[-1]])
    found, _ = carrier.nearest_sums(points, normals)
    np.testing.assert_allclose(found.area, area)
    np.testing.assert_allclose(found.mass, mass)
    np.testing.assert_allclose(found.moment, moment, atol=1e-12)
    np.testing.assert_allclose(carrier.measure, samples.area * carrier.density[samples.faces])
    size = np.where(np.arange(len(points)) % 2, 0.2, 0.1)
    target = 0.2 / np.sqrt(carrier.density[samples.faces])
    chosen = carrier.nearest(points, normals, size)
    for k in range(len(samples.points)):
        off = ((points - samples.points[k]) ** 2).sum(axis=1) + scale**2 * ((normals - samples.normals[k]) ** 2).sum(
            axis=1
        )
        off = off + (2 * scale * (np.log(size) - np.log(target[k]))) ** 2
        assert off[chosen[k]] == pytest.approx(off.min())


def test_the_largest_of_the_triangles_around_and_what_that_leaves_of_centroids():
    V, F = meshes.bumpy(3, 3)
    values = np.random.default_rng(0).random(len(F))
    found = least_squares._largest_around(F, values, len(V))
    np.testing.assert_allclose(found, [max(values[t] for t in range(len(F)) if v in F[t]) for v in range(len(V))])
    pairs = SimpleNamespace(largest_distance=lambda m: values[:m])
    share = least_squares._eased(F, pairs, 0.5, len(V))
    expected = [max(1 / (1 + (x / 0.5 / 6.0) ** 2), 0.05) for x in found]
    np.testing.assert_allclose(share, expected)


def test_entries_of_pairs_are_summed_by_triangle():
    rng, m, q = np.random.default_rng(0), 5, 3
    faces = np.concatenate([rng.integers(0, m, 20), np.repeat(np.arange(m), q), rng.integers(0, m, 7)])
    bary = rng.dirichlet(np.ones(3), len(faces))
    bary[20 : 20 + m * q] = np.tile(bary[:q], (m, 1))
    pairs = SimpleNamespace(faces=faces, barycentric=bary, sample_count=20, place_count=m * q)
    entries = rng.normal(size=(2, len(faces)))
    expected = np.zeros((2, 2, 6, m))
    for k in range(20 + m * q):
        products = [bary[k, i] * bary[k, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
        expected[0, :, :, faces[k]] += np.outer(entries[:, k], products)
        expected[1, :, :3, faces[k]] += np.outer(entries[:, k], bary[k])
    for found, sums in zip((least_squares._corner_products, np.ascontiguousarray), expected, strict=True):
        found = least_squares._sums_by_triangle(m, pairs, entries, found)
        np.testing.assert_allclose(found, sums[:, : len(found[0])])


def test_the_highest_come_first_and_so_many_edges_apart():
    V, F = meshes.grid(8, 8)
    largest = np.random.default_rng(0).random(len(F))
    state = SimpleNamespace(points=V, triangles=F)
    found = hausdorff_peaks._highest(state, largest, largest > 0.3, 3, 0.5)
    assert found[0] == largest.argmax() and (np.diff(largest[found]) <= 0).all() and (largest[found] > 0.3).all()
    few = hausdorff_peaks._highest(state, largest, largest > 0.3, 3, 2.5 / len(V))
    assert few.tolist() == found[:3].tolist()


def test_arcs_end_at_branches_at_ends_and_where_their_kind_changes():
    # 0-1-2-3 kept, 3-4-5 not, 5-6 to be reopened, 2-7 branches off; 8-9-10-8 is a ring.
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [2, 7], [8, 9], [9, 10], [8, 10]])
    keys = np.sort(pair_keys(*edges.T))
    kept, opened = pair_keys(*edges[:3].T), pair_keys(*edges[5:6].T)
    found = arc_network._nodes(12, keys, np.sort(kept), opened)
    assert np.flatnonzero(found).tolist() == [0, 2, 3, 5, 6, 7]


@pytest.mark.parametrize("angle, corner", [(0.9, True), (1.1, False)])
def test_arcs_have_corners_where_they_turn_by_enough(angle, corner):
    turn = arc_network.CORNER * (2 - angle) * 1.0
    one = np.stack([np.linspace(-1, 0, 21), np.zeros(21), np.zeros(21)], axis=1)
    other = np.linspace(0, 1, 21)[1:, None] * [np.cos(turn), np.sin(turn), 0]
    p = np.concatenate([one, other])
    found = arc_network._corners(p, np.arange(41), np.full(41, 0.3))
    assert found.tolist() == ([20] if corner else [])


def test_samples_of_arcs_are_evenly_apart_in_local_lengths():
    line = np.stack([np.linspace(0, 3, 31), np.zeros(31), np.zeros(31)], axis=1)
    size = np.where(np.arange(31) < 15, 0.25, 0.5)
    for kept, spacing, longer, count in ((False, 1.0, -1, 9), (True, 1.5, -1, 6), (False, 1.0, 0, 10)):
        arcs = [arc_network.Arc(np.arange(31), kept)]
        found = arc_network.sample_arcs(line, arcs, size, longer, spacing)
        local = (size[1:] + size[:-1]) / 2
        length = np.concatenate([[0], np.cumsum(0.1 / local)]) / (spacing if kept else 1)
        assert round(length[-1]) + (longer == 0) == count == len(found.along[0]) - 1
        x = np.sort(found.points[:, 0])
        np.testing.assert_allclose(np.interp(x, line[:, 0], length), np.linspace(0, length[-1], count + 1), atol=1e-9)
        assert found.fixed.all() == kept and found.fixed.any() == kept
        places = line[found.edge[0], 0] + 0.1 * found.share[0]
        np.testing.assert_allclose(places, x, atol=1e-9)
        np.testing.assert_allclose(found.points[found.along[0], 0], x, atol=1e-9)


def test_arcs_between_one_pair_of_nodes_have_samples_between_them():
    p = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [2, 0, 0], [2, 1, 0.0]])
    arcs = [arc_network.Arc(np.array(v), False) for v in ([0, 2, 1], [0, 3, 1], [1, 4, 5, 1], [0, 1])]
    found = arc_network.sample_arcs(p, arcs, np.full(6, 50.0))
    assert [len(x) - 1 for x in found.along] == [2, 2, 3, 2]
    lone = arc_network.sample_arcs(p, arcs[:1], np.full(6, 50.0))
    assert [len(x) - 1 for x in lone.along] == [1]


def ring(n=40):
    turn = 2 * np.pi * np.arange(n + 1) / n
    return np.stack([2 * np.cos(turn), np.sin(turn), 0 * turn], axis=1)


def test_curves_are_walked_by_length_and_their_means_lie_between():
    p = ring()
    curve = boundary_samples._Curve(p, np.ones(41))
    step = np.linalg.norm(np.diff(p, axis=0), axis=1)
    for k in (0, 7, 39):
        np.testing.assert_allclose(
            curve.at(np.array([step[:k].sum() + 0.3 * step[k]]))[0], p[k] + 0.3 * (p[k + 1] - p[k])
        )
        np.testing.assert_allclose(curve.at(step[:k].sum() + step.sum()), p[k], atol=1e-9)
    straight = np.array([[0, 0, 0], [10, 0, 0], [10, 1, 0], [0, 1, 0], [0, 0, 0.0]])
    means = boundary_samples._Curve(straight, np.ones(5)).means(np.array([2.0, 3.0, 5.0, 11.5, 16.0]))
    np.testing.assert_allclose(means[1], [(2.5 + 4) / 2, 0, 0], atol=1e-9)


def test_samples_settle_evenly_between_those_that_stay():
    curve = boundary_samples._Curve(ring(), np.ones(41))
    where = np.sort(np.random.default_rng(0).uniform(0, 40, 12))
    free = boundary_samples._settled(curve, where, np.zeros(12, bool))
    step = np.linalg.norm(np.roll(free, -1, axis=0) - free, axis=1)
    assert np.ptp(step) < 0.02 * step.mean()
    pinned = np.isin(np.arange(12), [3, 8])
    some = boundary_samples._settled(curve, where, pinned)
    length = np.interp(where, np.arange(41), curve.length)
    np.testing.assert_allclose(some[pinned], curve.at(length[pinned]), atol=1e-12)
    step = np.linalg.norm(np.roll(some, -1, axis=0) - some, axis=1)
    for part in (step[3:8], np.concatenate([step[8:], step[:3]])):
        assert np.ptp(part) < 0.05 * part.mean()


@pytest.mark.parametrize("count", [1, 7, 50])
def test_lattices_fill_the_disk_but_a_margin(count):
    found = disk_samples._lattice(count)
    assert found.shape == (count, 2) and np.linalg.norm(found, axis=1).max() < 1
    if count == 50:
        far = np.linalg.norm(found[:, None] - found, axis=2) + 9 * np.eye(50)
        near = far.min(axis=1)
        # Triangles of one size, as many as fill the disk of what is left.
        assert np.ptp(near) < 1e-9
        pitch = np.sqrt(np.pi / (50 * np.sqrt(3) / 2)) * (1 - 0.5 / np.sqrt(50))
        assert near[0] == pytest.approx(pitch)
        assert np.abs(found.mean(axis=0)).max() < 0.1


def test_lengths_of_edges_count_by_the_density_at_their_ends():
    V, F = meshes.bumpy(3, 3)
    keys = pair_keys(F[:4, 0], F[:4, 1])
    density = np.random.default_rng(0).uniform(0.5, 3, len(V))
    found = sample_plan._weighted_length(V, keys, density)
    expected = sum(np.linalg.norm(V[a] - V[b]) * np.sqrt((density[a] + density[b]) / 2) for a, b in F[:4, :2].tolist())
    assert found == pytest.approx(expected)
