"""What is measured of a surface against plain formulas, vertex by vertex and edge by edge."""

from __future__ import annotations

import itertools
import re
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis import seam_costs
from omt_uv.solver.analysis.curvature import mean_curvature
from omt_uv.solver.analysis.facing import ahead, salient_weights, towards
from omt_uv.solver.analysis.feature_edges import edge_union, fold_angles, sharp_edges, value_jumps
from omt_uv.solver.analysis.heat_means import HeatMeans
from omt_uv.solver.analysis.joint_density import joint_density, shares_of
from omt_uv.solver.analysis.occlusion import hidden_sides, looks_out
from omt_uv.solver.analysis.order_of_places import order_of_places
from omt_uv.solver.analysis.saliency import curvature_means, saliency, saliency_of, unit_size
from omt_uv.solver.errors import ShareError
from omt_uv.solver.mesh.topology import halfedges, pair_keys, pair_up


def folded():
    """Four triangles about vertex 0, which are neither alike nor flat, and one that stands apart."""
    V = np.array(
        [[0, 0, 0.3], [2, 0, 0], [0, 1, 0.2], [-1, 0, 0], [0.3, -3, -1], [5, 5, 5], [6, 5, 5], [5, 7, 6]], float
    )
    return V, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [5, 6, 7]])


def dihedral(V, F):
    """Angle between normals by the edge, below 0 where hollow: every pair of triangles with two vertices in common."""
    found = {}
    for i, one in enumerate(F):
        for other in F[i + 1 :]:
            common = set(one) & set(other)
            if len(common) == 2:
                n, k = (np.cross(V[f[1]] - V[f[0]], V[f[2]] - V[f[0]]) for f in (one, other))
                n, k = n / np.linalg.norm(n), k / np.linalg.norm(k)
                far = V[next(v for v in other if v not in common)] - V[min(common)]
                found[tuple(sorted(common))] = -np.sign(n @ far) * np.arctan2(np.linalg.norm(np.cross(n, k)), n @ k)
    return found


@pytest.mark.parametrize("noise", [0.0, 1e-9, -1e-9])
@pytest.mark.parametrize("seed", range(3))
def test_needles_between_two_faces_fold_as_these_do(noise, seed):
    """A point on the long side of a face, as where a mesh was mended: of what rounding makes of it nothing is told."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.3, 2.5)
    up = np.array([0.0, -np.cos(angle), np.sin(angle)])
    # Two faces meet at the first side, one whole, the other with a point on it; and with another one beside that.
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.3, 0, 0], [0.6, 0, 0], 0.5 * up + [0.5, 0, 0]])
    V[3:5] += noise * rng.normal(size=(2, 3))
    F = np.array([[0, 1, 2], [1, 0, 3], [1, 3, 4], [3, 0, 5], [4, 3, 5], [1, 4, 5]])
    tail, head = halfedges(F)
    pair = np.column_stack(pair_up(pair_keys(tail, head)))
    found = dict(
        zip(
            map(frozenset, np.stack([tail, head], axis=1)[pair[:, 0]].tolist()),
            np.abs(fold_angles(V, F, pair)),
            strict=True,
        )
    )
    flat = [{0, 1}, {1, 3}, {3, 5}, {4, 5}]
    assert [found[frozenset(e)] for e in flat] == pytest.approx([0] * 4, abs=1e-6)
    folds = [found[frozenset(e)] for e in ({0, 3}, {3, 4}, {1, 4})]
    assert folds == pytest.approx([angle] * 3, abs=1e-6)


@pytest.mark.parametrize("mesh", [folded, lambda: meshes.bumpy(5, 4), meshes.cube], ids=["few", "bumpy", "cube"])
def test_fold_angles_are_those_between_the_normals(mesh):
    V, F = mesh()
    expected = dihedral(V, F)
    tail, head = halfedges(F)
    pair = np.column_stack(pair_up(pair_keys(tail, head)))
    edges = [tuple(sorted((tail[i], head[i]))) for i, _ in pair]
    assert set(edges) == set(expected)
    assert fold_angles(V, F, pair) == pytest.approx([expected[e] for e in edges], abs=1e-7)
    assert fold_angles(V, F, pair[:, ::-1]) == pytest.approx([expected[e] for e in edges], abs=1e-7)
    for angle in (0.05, 0.4, 1.0):
        sharp = {tuple(sorted(e)) for e in sharp_edges(V, F, angle).tolist()}
        assert sharp == {e for e, fold in expected.items() if abs(fold) > angle}


def test_a_fold_beside_a_face_without_area_has_no_angle():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0]], float)
    F = np.array([[0, 1, 2], [1, 0, 3]])
    tail, head = halfedges(F)
    assert fold_angles(V, F, np.column_stack(pair_up(pair_keys(tail, head)))).tolist() == [0.0]


@pytest.mark.parametrize("over", list(itertools.product([False, True], repeat=3)))
def test_values_jump_where_corners_of_an_edge_differ_whichever_way_faces_look(over):
    F = np.array([[0, 1, 2], [2, 1, 3], [3, 1, 4]])
    values = np.zeros((9, 2))
    values[[3, 8]] = [[0, 0.2], [0.1, 0]]
    corners = np.arange(9).reshape(3, 3)
    F, corners = (np.where(np.array(over)[:, None], x[:, ::-1], x) for x in (F, corners))
    for tolerance, jumps in ((0.05, {(1, 2)}), (0.15, {(1, 2)}), (0.25, set())):
        assert {tuple(sorted(e)) for e in value_jumps(F, corners, values, tolerance).tolist()} == jumps
    assert edge_union(np.array([[3, 1], [2, 5]]), np.array([[1, 3]]), np.zeros((0, 2), int)).tolist() == [
        [1, 3],
        [2, 5],
    ]
    assert edge_union().tolist() == []


def test_how_far_ahead_vertices_lie():
    V, F = folded()
    V[-1] = [50, 50, 50]
    F = F[:4]
    corner = V[F]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2
    direction = np.array([0.6, 0.0, 0.8])
    along = (V - area @ corner.mean(axis=1) / area.sum()) @ direction
    ends = along[:5].max(), -along[:5].min()
    expected = np.clip(np.where(along > 0, along / ends[0], along / ends[1]), -1, 1)
    assert ahead(V, F, direction) == pytest.approx(expected)
    # What no face uses may lie farther: it is as far ahead as anything is.
    assert ahead(V, F, direction)[-1] == 1 and ahead(V, F, -direction)[-1] == -1
    normal = np.zeros((8, 3))
    for f in F:
        normal[f] += np.cross(V[f[1]] - V[f[0]], V[f[2]] - V[f[0]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    assert towards(V, F, direction) == pytest.approx((normal @ direction + expected) / 2)
    assert not salient_weights(np.ones(4), np.ones(4), (0.5, 0.9)).any()


def test_parts_look_out_where_their_backs_are_hidden_by_more_than_their_fronts():
    hidden = np.array([[0.1, 0.3, 0.9, 0.5], [0.9, 0.5, 0.2, 0.5]])
    area, part = np.array([1.0, 3.0, 2.0, 1.0]), np.array([0, 0, 1, 2])
    assert looks_out(hidden, area, part).tolist() == [True, False, False]
    assert looks_out(hidden[::-1], area, part).tolist() == [False, True, False]
    V, F = meshes.icosphere(2)
    sides = hidden_sides(V, F)
    assert sides[0].max() < 0.02 and sides[1].min() > 0.9
    assert looks_out(sides, np.ones(len(F)), np.zeros(len(F), int)).all()


def test_saliency_by_its_formula():
    V, F = meshes.head(14)
    means = curvature_means(unit_size(V, F), F)
    heat = HeatMeans(unit_size(V, F), F, 0.018)
    for scale, mean in means.items():
        own = next(iter(heat.means(mean_curvature(unit_size(V, F), F), np.array([0.003 * scale]))))
        assert mean == pytest.approx(own, abs=1e-9)
    total = np.zeros(len(V))
    for s in (2.0, 3.0, 4.0, 5.0, 6.0):
        x = np.abs(means[s] - means[2 * s])
        if x.max() <= 0.25:
            continue
        x /= x.max()
        near = [set(F[(v == F).any(axis=1)].ravel()) - {v} for v in range(len(V))]
        peaks = [v for v in range(len(V)) if all(x[v] >= x[u] * (1 - 1e-9) for u in near[v]) and 1e-3 < x[v] < 1 - 1e-9]
        total += x * (1 - (x[peaks].mean() if peaks else 0)) ** 2
    assert total.any()
    assert saliency_of(means, F) == pytest.approx(total)
    assert saliency(V, F) == pytest.approx(total)


@pytest.mark.parametrize("factors", [[4.0], [0.2, 3.0], [5.0, 5.0]])
def test_the_factors_that_are_named_are_nearly_as_far_as_it_goes(factors):
    """Disjoint regions of weight 1 may have everything but nothing more: their shares sum to less than 1."""
    regions, area = np.eye(2, 5)[: len(factors)], np.array([1.0, 2, 1, 1, 1])
    before = shares_of(regions, area)
    most = 1 / (before @ factors)
    if most > 1:
        found = joint_density(regions, area, factors)
        assert shares_of(regions, area * found.density) == pytest.approx(before * factors)
    over = [f * 3 for f in factors]
    with pytest.raises(ShareError) as error:
        joint_density(regions, area, over)
    named = [float(x) for x in re.search(r"such as ([\d., ]+), or", str(error.value))[1].split(",")]
    way = [(n - 1) / (o - 1) for n, o in zip(named, over, strict=True) if o != 1]
    # On the way from 1 to what was asked: as far as shares that sum to 1, less what is safe.
    end = (1 - before.sum()) / (before @ over - before.sum())
    assert min(way) == pytest.approx(max(way), rel=0.01) and 0.8 * end < way[0] < end


def test_vertices_in_one_place_are_ordered_by_the_mean_middle_of_their_triangles():
    """A star whose triangles all have a corner of their own in the middle, one of them two triangles."""
    angle = np.arange(7) * 2 * np.pi / 7
    outer = np.column_stack([np.cos(angle), np.sin(angle) * 1.7, 0.3 * angle])
    V = np.concatenate([outer, np.tile([[0.1, 0.2, 0.3]], (6, 1))])
    own = [7, 7, 8, 9, 10, 11, 12]
    F = np.array([[own[k], k, (k + 1) % 7] for k in range(7)])
    order = order_of_places(V, F)
    middle = [V[F[(v == F).any(axis=1)]].mean(axis=(0, 1)) for v in range(7, 13)]
    expected = 7 + np.lexsort(np.transpose(middle))
    for stretched in (1.0, 1e3):
        order = order_of_places(V * stretched, F)
        got = order[order >= 7]
        assert np.array_equal(got, expected) or _in_own_axes(V, F, got)


def _in_own_axes(V, F, got):
    """Whether vertices come in the order of the middles of their triangles along the axes of the whole."""
    p = V - V.mean(axis=0)
    _, axes = np.linalg.eigh(p.T @ p)
    middle = np.array([V[F[(v == F).any(axis=1)]].mean(axis=(0, 1)) for v in range(7, 13)]) @ axes
    signs = np.array(np.meshgrid([1, -1], [1, -1], [1, -1])).reshape(3, -1).T
    return any(np.array_equal(got, 7 + np.lexsort((middle * s).T)) for s in signs)


def smooth(value, low, high):
    t = min(max((value - low) / (high - low), 0.0), 1.0)
    return t * t * (3 - 2 * t)


def test_reasons_of_vertices_are_steps_between_their_bounds(monkeypatch):
    """Vertex by vertex, on either side of every bound and between the two."""
    V, F = meshes.icosphere(2)
    n, rng = len(V), np.random.default_rng(3)
    occlusion, forwards, below, within = rng.random(n), *rng.uniform(-0.2, 1, (3, n))
    curvature, sure = rng.uniform(-30, 5, n), 0.8
    seen = SimpleNamespace(front=np.array([1.0, 0, 0]), up=np.array([0, 0, 1.0]), certainty=0.9)
    fixed = {
        "hidden_sides": lambda *_: None,
        "outside_out": lambda _, triangles, __: triangles,
        "curvature_means": lambda *_: {4.0: curvature},
        "saliency_of": lambda *_: None,
        "facing": lambda *_: seen,
        "vertex_occlusion": lambda *_: occlusion,
        "with_a_face": lambda *_: sure,
        "towards": lambda *of: forwards if of[2][0] > 0 else below,
        "ahead": lambda *_: within,
        "salient_weights": lambda *_: np.ones(n),
    }
    for name, what in fixed.items():
        monkeypatch.setattr(seam_costs, name, what)
    *_, reasons = seam_costs._vertex_reasons(V, F, None, None)
    for v in range(n):
        front = smooth(0.9 * sure * forwards[v], 0.1, 0.6) * (1 - smooth(occlusion[v], 0.5, 0.9))
        hidden = smooth(occlusion[v], 0.05, 0.5) * (1 - front)
        face = max(front, smooth(0.9 * sure * within[v], 0.1, 0.6))
        expected = {
            "hidden": hidden,
            "crease": smooth(-curvature[v], 4, 20) * (1 - front),
            "underside": smooth(below[v], 0.1, 0.6),
            "back": smooth(-0.9 * forwards[v], 0.1, 0.6),
            "front": front,
            "salient": 1 - hidden,
            "mirror": 0,
            "face": face,
            "within": face * (occlusion[v] > 0.5),
        }
        assert {name: reason[v] for name, reason in reasons.items()} == pytest.approx(expected, abs=1e-12)
