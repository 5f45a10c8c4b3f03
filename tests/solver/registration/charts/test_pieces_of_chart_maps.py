"""Pieces of maps of charts onto one another: edges between boundaries, places along arcs, vertices, harmonic maps."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.registration.charts import chart_maps
from omt_uv.solver.registration.landmarks import SplitSurface


def split_of(V, F):
    return SplitSurface(V, F, np.array([1, 4]), np.arange(len(F)), np.tile(np.eye(3), (len(F), 1, 1)))


def chords(F):
    """Inner edges both of whose ends are on the boundary."""
    sides = {}
    for t in F.tolist():
        for a, b in zip(t, t[1:] + t[:1], strict=True):
            sides.setdefault(frozenset((a, b)), []).append(t)
    outer = {v for e, of in sides.items() if len(of) == 1 for v in e}
    return [e for e, of in sides.items() if len(of) == 2 and e <= outer]


@pytest.mark.parametrize("kind", ["fan", "strip", "ears"])
def test_no_edge_within_a_chart_ends_twice_on_its_boundary(kind):
    if kind == "strip":
        V, F = meshes.grid(6, 1)
    else:
        n = 9
        angle = 2 * np.pi * np.arange(n) / n
        V = np.column_stack([np.cos(angle), np.sin(angle), 0.2 * np.cos(2 * angle)])
        F = np.array([[0, k, k + 1] for k in range(1, n - 1)])
        if kind == "ears":
            F = np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6], [6, 7, 8], [0, 2, 4], [4, 6, 8], [0, 4, 8]])
    assert chords(F)
    found = chart_maps.without_chords(split_of(V, F))
    assert not chords(found.triangles) and found.landmarks.tolist() == [1, 4]
    np.testing.assert_array_equal(found.vertices[: len(V)], V)
    # Every triangle lies in its parent, and together they cover it.
    area = face_areas(V, F)
    np.testing.assert_allclose(np.bincount(found.parent, face_areas(found.vertices, found.triangles)), area)
    for t, p, own in zip(found.triangles, found.parent, found.corners, strict=True):
        np.testing.assert_allclose(own @ V[F[p]], found.vertices[t], atol=1e-12)
    normal = np.cross(*(V[F][:, k] - V[F][:, 0] for k in (1, 2)))
    new = np.cross(*(found.vertices[found.triangles][:, k] - found.vertices[found.triangles][:, 0] for k in (1, 2)))
    assert (np.einsum("ti,ti->t", new, normal[found.parent]) > 0).all()
    assert np.array_equal(boundary_loops(found.triangles)[0].size, boundary_loops(F)[0].size)
    assert chart_maps.without_chords(found).triangles is found.triangles


def test_vertices_are_put_into_the_order_of_their_elimination():
    V, F = meshes.bumpy(4, 4)
    found, place = chart_maps._in_order(split_of(V, F))
    assert sorted(place.tolist()) == list(range(len(V)))
    np.testing.assert_array_equal(found.vertices[place], V)
    np.testing.assert_array_equal(found.vertices[found.triangles], V[F])
    assert found.landmarks.tolist() == place[[1, 4]].tolist()


@pytest.mark.parametrize(("most", "at"), [(1 - 0.9e-9, True), (1 - 1.1e-9, False), (1.0, True), (0.5, False)])
def test_points_all_but_at_a_vertex_are_there(most, at):
    triangles = np.array([[4, 5, 6], [6, 7, 8]])
    weights = np.array([[0.0, most, 1 - most], [1 - most, 0, most]])
    found = chart_maps._at_vertices(triangles, np.array([0, 1]), weights)
    assert found.tolist() == ([5, 8] if at else [-1, -1])
    assert chart_maps._at_vertices(triangles, np.zeros(0, int), np.zeros((0, 3))).tolist() == []


def test_rows_of_a_chart_are_those_of_the_surface():
    rows = np.array([7, 3, 9, 4])
    assert chart_maps._row_of(rows, np.array([9, 7, 7, 4])).tolist() == [2, 0, 0, 3]


def test_triangles_of_a_chart_begin_where_those_of_the_surface_do():
    chart = SimpleNamespace(
        corners=np.array([[4, 5, 3], [6, 7, 8], [11, 9, 10]]), triangles=np.array([[1, 2, 0], [3, 4, 5], [8, 6, 7]])
    )
    assert chart_maps._turned(chart).tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]


def test_vertices_around_a_chart_are_as_far_along_the_arcs_of_the_other_one():
    """Both are squares with four arcs; the other one is turned by one arc, and has other vertices."""
    rng = np.random.default_rng(0)

    def square(count, begin):
        V, F = meshes.grid(count, count)
        loop = boundary_loops(F)[0]
        corner = [int(np.abs(V[:, :2] - c).sum(axis=1).argmin()) for c in ((V[:, 0].min(), V[:, 1].min()),)]
        loop = np.roll(loop, -int(np.flatnonzero(loop == corner[0])[0]))
        loop = np.append(loop, loop[0])
        paths = [loop[k * count : (k + 1) * count + 1] for k in range(4)]
        V = V + 0.01 * rng.normal(size=V.shape)
        return SimpleNamespace(vertices=V, triangles=F), SimpleNamespace(arcs=SimpleNamespace(paths=paths))

    mine, first = square(5, 0)
    other, second = square(3, 1)
    images = np.array([1, 2, 3, 0])
    outline, faces, weights = chart_maps._along(first, second, (np.arange(4), images), (mine, other))
    assert sorted(outline.tolist()) == sorted(boundary_loops(mine.triangles)[0].tolist())
    places = np.einsum("kc,kcd->kd", weights, other.vertices[other.triangles[faces]])
    at = 0
    for a, b in enumerate(images):
        path, there = mine.vertices[first.arcs.paths[a]], other.vertices[second.arcs.paths[b]]
        far = np.append(0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
        along = np.append(0, np.cumsum(np.linalg.norm(np.diff(there, axis=0), axis=1)))
        for share in far[:-1] / far[-1]:
            expected = [np.interp(share, along / along[-1], there[:, d]) for d in range(3)]
            assert places[at] == pytest.approx(expected, abs=1e-12)
            at += 1
    assert at == len(outline) and weights.min() >= 0 and weights.sum(axis=1) == pytest.approx(np.ones(at))
    assert ((weights > 1e-12).sum(axis=1) <= 2).all()


def test_harmonic_maps_are_means_of_neighbours_and_have_no_folds():
    V, F = meshes.bumpy(6, 6)
    uv, loop = V[:, :2], boundary_loops(F)[0]
    angle = 2 * np.pi * np.arange(len(loop)) / len(loop)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    found = chart_maps._harmonic(uv, F, loop, circle)
    np.testing.assert_array_equal(found[loop], circle)
    total, count = np.zeros((len(V), 2)), np.zeros(len(V))
    for t in F.tolist():
        for k in range(3):
            a, b, c = t[k], t[(k + 1) % 3], t[(k + 2) % 3]
            u, v = uv[a] - uv[c], uv[b] - uv[c]
            weight = max((u @ v) / abs(u[0] * v[1] - u[1] * v[0]) / 2, chart_maps.LEAST_STIFFNESS)
            for one, to in ((a, b), (b, a)):
                total[one] += weight * found[to]
                count[one] += weight
    inner = np.setdiff1d(np.arange(len(V)), loop)
    np.testing.assert_allclose(found[inner], (total / count[:, None])[inner], atol=1e-9)
    with pytest.raises(PrecisionError, match="folded"):
        chart_maps._harmonic(uv, F, loop, circle[::-1])
