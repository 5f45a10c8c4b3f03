"""Measures and neighbourhoods of triangles against plain formulas, face by face and edge by edge."""

from __future__ import annotations

from collections import Counter, defaultdict

import meshes
import numpy as np
import pytest

from omt_uv.solver import errors
from omt_uv.solver.mesh import geometry, topology
from omt_uv.solver.mesh.charts import Chart, check_disk, sound_disks


def disk():
    V, F = meshes.bumpy(4, 3)
    return V + 0.05 * np.random.default_rng(0).normal(size=V.shape), F


MESHES = {
    "disk": disk,
    "one": meshes.single_triangle,
    "torus": meshes.torus,
    "ball": lambda: meshes.icosphere(1),
    "cube": meshes.cube,
}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]()


def sides_of(V, f):
    return [float(np.linalg.norm(V[f[(k + 1) % 3]] - V[f[k]])) for k in range(3)]


def test_measures_face_by_face(mesh):
    V, F = mesh
    length = geometry.halfedge_lengths(V, F).reshape(-1, 3)
    angles, cotangents = geometry.angles_from_lengths(length), geometry.cotangents_from_lengths(length)
    areas, normals, least = geometry.face_areas(V, F), geometry.face_normals(V, F), geometry.least_angles(V, F)
    first, second = geometry.plane_axes(V[F])
    around = np.zeros(len(V))
    for t, f in enumerate(F):
        a, b, c = side = sides_of(V, f)
        assert length[t] == pytest.approx(side)
        # The angle opposite to halfedge k, which lies at vertex k + 2.
        opposite = [np.arccos((y * y + z * z - x * x) / (2 * y * z)) for x, y, z in ((a, b, c), (b, c, a), (c, a, b))]
        assert angles[t] == pytest.approx(opposite) and least[t] == pytest.approx(min(opposite))
        assert cotangents[t] == pytest.approx(1 / np.tan(opposite), abs=1e-9)
        for k in range(3):
            around[f[(k + 2) % 3]] += opposite[k]
        s = (a + b + c) / 2
        assert areas[t] == pytest.approx(np.sqrt(s * (s - a) * (s - b) * (s - c)))
        normal = np.cross(V[f[1]] - V[f[0]], V[f[2]] - V[f[0]])
        assert normals[t] == pytest.approx(normal / np.linalg.norm(normal))
        assert first[t] == pytest.approx((V[f[1]] - V[f[0]]) / a)
        assert np.cross(first[t], second[t]) == pytest.approx(normals[t])
    boundary = topology.boundary_edges(F)[:, 0]
    flat = np.where(np.isin(np.arange(len(V)), boundary), np.pi, 2 * np.pi)
    assert geometry.angle_defects(F, angles, boundary, len(V)) == pytest.approx(flat - around)
    density = np.random.default_rng(0).uniform(0.5, 2, len(F))
    for weight in (None, density):
        share = areas if weight is None else areas * weight
        expected = [share[(v == F).any(axis=1)].sum() / 3 for v in range(len(V))]
        assert geometry.vertex_areas(V, F, weight) == pytest.approx(expected)
    plane = V[:, :2] * [1, -1]
    signed = [np.linalg.det(np.stack([plane[f[1]] - plane[f[0]], plane[f[2]] - plane[f[0]]])) / 2 for f in F]
    assert geometry.signed_areas(plane, F) == pytest.approx(signed)
    edges = np.array([[0, 2], [1, 0]])
    assert geometry.edge_lengths(V, edges) == pytest.approx([np.linalg.norm(V[0] - V[2]), np.linalg.norm(V[1] - V[0])])


def test_the_laplacian_is_that_of_half_cotangents(mesh):
    V, F = mesh
    n = len(V)
    expected = np.zeros((n, n))
    for f in F:
        for k in range(3):
            i, j, o = f[k], f[(k + 1) % 3], f[(k + 2) % 3]
            u, v = V[i] - V[o], V[j] - V[o]
            w = 0.5 * (u @ v) / np.linalg.norm(np.cross(u, v))
            expected[[i, j], [j, i]] -= w
            expected[[i, j], [i, j]] += w
    np.testing.assert_allclose(geometry.cotangent_laplacian(V, F).toarray(), expected, atol=1e-9)
    # Linear functions of a flat surface have none inside; bounds are of what each triangle adds.
    length = geometry.halfedge_lengths(V, F).reshape(-1, 3)
    bounded = geometry.laplacian_from_lengths(length, F, n, 0.2, 0.4).toarray()
    single = Counter(frozenset((f[k], f[(k + 1) % 3])) for f in F for k in range(3))
    for (i, j), count in ((tuple(e), c) for e, c in single.items()):
        assert 0.2 * count - 1e-12 <= -bounded[i, j] <= 0.4 * count + 1e-12
    np.testing.assert_allclose(bounded.sum(axis=1), 0, atol=1e-12)


def test_triangles_that_are_none_have_extended_angles():
    length = np.array([[3.0, 1, 1], [1, 3, 1], [2, 1, 1], [1, 1, 1e-12]])
    found = geometry.angles_from_lengths(length)
    np.testing.assert_allclose(found[:3], [[np.pi, 0, 0], [0, np.pi, 0], [np.pi, 0, 0]], atol=1e-7)
    np.testing.assert_allclose(found[3], [np.pi / 2, np.pi / 2, 0], atol=1e-6)
    assert not geometry.cotangents_from_lengths(length[:3]).any()
    flat = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], float), np.array([[0, 1, 2]])
    assert not geometry.face_normals(*flat).any() and not geometry.vertex_normals(*flat).any()
    assert geometry.unit(np.array([[0, 0, 0], [0, 0, 2.0]])).tolist() == [[0, 0, 0], [0, 0, 1]]


def test_vertex_normals_are_weighed_by_areas(mesh):
    V, F = mesh
    total = np.zeros_like(V)
    for f in F:
        total[f] += np.cross(V[f[1]] - V[f[0]], V[f[2]] - V[f[0]])
    np.testing.assert_allclose(
        geometry.vertex_normals(V, F), total / np.linalg.norm(total, axis=1)[:, None], atol=1e-12
    )


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_nearest_rotation_is_nearer_than_others(mirrored):
    rng = np.random.default_rng(0)
    for d in (2, 3):
        M = rng.normal(size=(20, d, d))
        R = geometry.nearest_rotations(M, mirrored)
        np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.tile(np.eye(d), (20, 1, 1)), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(-1 if mirrored else 1)
        for _ in range(50):
            Q = np.linalg.qr(rng.normal(size=(20, d, d)))[0]
            Q[np.sign(np.linalg.det(Q)) != (-1 if mirrored else 1), 0] *= -1
            assert (np.linalg.norm(M - R, axis=(1, 2)) <= np.linalg.norm(M - Q, axis=(1, 2)) + 1e-12).all()


def test_affine_images_are_those_of_each_cluster_alone():
    rng = np.random.default_rng(0)
    before = rng.normal(size=(30, 3))
    owner, weight = np.arange(30) % 2, rng.uniform(0.5, 2, 30)
    maps, shift = rng.normal(size=(2, 3, 3)) + 2 * np.eye(3), rng.normal(size=(2, 3))
    after = np.einsum("kij,kj->ki", maps[owner], before) + shift[owner]
    # Softened by a thousandth towards the rotation.
    found = geometry.affine_images(before, after, owner, weight)
    assert np.abs(found - after).max() < 0.02 * np.abs(after).max()
    one = geometry.affine_images(before[owner == 1], after[owner == 1], owner[owner == 1] * 0, weight[owner == 1])
    np.testing.assert_allclose(one, found[owner == 1], atol=2e-3)
    moved = geometry.affine_images(before, before + [1, 2, 3], owner, weight)
    np.testing.assert_allclose(moved, before + [1, 2, 3], atol=1e-9)


def test_halfedges_and_edges(mesh):
    _, F = mesh
    tail, head = topology.halfedges(F)
    assert [(int(a), int(b)) for a, b in zip(tail, head, strict=True)] == [
        (f[k], f[(k + 1) % 3]) for f in F.tolist() for k in range(3)
    ]
    place = {(a, b): h for h, (a, b) in enumerate(zip(tail.tolist(), head.tolist(), strict=True))}
    twin = topology.twins(F)
    assert twin.tolist() == [place.get((b, a), -1) for a, b in zip(tail.tolist(), head.tolist(), strict=True)]
    assert topology.boundary_edges(F).tolist() == [[a, b] for a, b in place if (b, a) not in place]
    on = {v for a, b in place if (b, a) not in place for v in (a, b)}
    assert set(np.flatnonzero(topology.on_boundary(F, int(F.max()) + 1))) == on
    h, opposite = topology.across_edges(F, twin)
    assert len(h) == (twin >= 0).sum() // 2 and (twin[h] > h).all()
    for k, (mine, theirs) in zip(h, opposite, strict=True):
        for halfedge, corner in ((k, mine), (twin[k], theirs)):
            (other,) = set(F[halfedge // 3].tolist()) - {tail[halfedge], head[halfedge]}
            assert corner == other
    near = topology.vertices_around(F, np.arange(len(F)) == len(F) - 1, int(F.max()) + 1, 1)
    ring = set(F[-1].tolist())
    assert set(np.flatnonzero(near)) == {v for f in F.tolist() if set(f) & ring for v in f}


def test_pairs_and_rows_by_dictionaries():
    rng = np.random.default_rng(0)
    for many in (50, 40_000):
        a, b = rng.integers(0, many // 2, (2, many))
        keys = topology.pair_keys(a, b)
        np.testing.assert_array_equal(topology.paired(keys), np.sort(np.stack([a, b], axis=1), axis=1))
        np.testing.assert_array_equal(topology.order_of_pairs(keys), np.argsort(keys, kind="stable"))
        places = defaultdict(list)
        for k, key in enumerate(keys.tolist()):
            places[key].append(k)
        first, second = topology.pair_up(keys)
        expected = sorted(tuple(p) for p in places.values() if len(p) == 2)
        assert sorted(zip(first.tolist(), second.tolist(), strict=True)) == expected
    large = np.array([0, 2**31 - 1, 2**31 - 1])
    np.testing.assert_array_equal(
        topology.paired(topology.pair_keys(large, large[::-1])), [[0, 2**31 - 1], [2**31 - 1] * 2, [0, 2**31 - 1]]
    )
    for most in (3, 2**40):
        rows = rng.integers(0, most, (60, 3))
        rows[30:] = rows[rng.integers(0, 30, 30)]
        label = topology.row_labels(rows)
        assert (label.min(), label.max()) == (0, len(np.unique(rows, axis=0)) - 1)
        same = (rows[:, None] == rows).all(axis=2)
        np.testing.assert_array_equal(label[:, None] == label, same)


@pytest.mark.parametrize("n", [5, 3000])
def test_components_and_loops(n):
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, n, (2, n // 2))
    count, label = topology.graph_components(a, b, n)
    group = list(range(n))
    for x, y in zip(a, b, strict=True):
        if group[x] != group[y]:
            old, new = group[y], group[x]
            group = [new if g == old else g for g in group]
    assert count == len(set(group)) == label.max() + 1
    assert len({(g, k) for g, k in zip(group, label.tolist(), strict=True)}) == count


def test_fans_close_loops_and_looking_out():
    V, F = meshes.polar(lambda t: t, lambda t: 0 * t, 2, 7)
    (loop,) = topology.boundary_loops(F)
    W, G = topology.with_fans(V, F, [loop])
    assert not len(topology.boundary_edges(G)) and len(W) == len(V) + 1 and len(G) == len(F) + 7
    np.testing.assert_allclose(W[-1], V[loop].mean(axis=0))
    assert topology.with_fans(V, F, [])[0] is V
    bow = np.array([[0, 1, 2], [0, 3, 4], [0, 5, 6], [0, 6, 7]])
    split, was = topology.split_fans(bow, 8)
    assert was[split].tolist() == bow.tolist() and len(was) == 10 and len(set(split[:, 0])) == 3
    assert split[2, 0] == split[3, 0] and split[0].tolist() == [0, 1, 2]


def chart_of(V, F):
    n = len(V)
    return Chart(
        vertices=V,
        triangles=F,
        corners=np.arange(F.size).reshape(-1, 3),
        faces=np.arange(len(F)),
        vertex_ids=np.arange(n),
    )


def holed(handles=0, holes=1):
    """A torus, or a ball, with some holes."""
    V, F = meshes.torus() if handles else meshes.icosphere(2)
    gone = []
    for f in range(len(F)):
        if len(gone) < holes and not any(set(F[f]) & set(F[g]) for g in gone):
            gone.append(f)
    return V, np.delete(F, gone, axis=0)


@pytest.mark.parametrize(
    ("handles", "holes", "kind", "words"),
    [
        (0, 0, errors.NotADiskError, "closed sphere"),
        (1, 0, errors.NotADiskError, "genus 1"),
        (0, 1, None, ""),
        (1, 1, errors.NotADiskError, "has a handle"),
        (0, 2, errors.SeveralBoundariesError, "has 2 boundaries"),
        (0, 3, errors.SeveralBoundariesError, "has 3 boundaries"),
        (1, 3, errors.SeveralBoundariesError, "has 3 boundaries"),
    ],
)
def test_what_is_no_disk_is_said(handles, holes, kind, words):
    chart = chart_of(*holed(handles, holes))
    good = chart_of(*holed(0, 1))
    assert sound_disks([good, chart, good]).tolist() == [True, kind is None, True]
    if kind is None:
        check_disk(chart)
    else:
        with pytest.raises(kind, match=words):
            check_disk(chart)
