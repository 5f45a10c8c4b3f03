"""Pieces of divisions against loops over polygons and their corners: what is clipped, counted, named and joined."""

from __future__ import annotations

import itertools
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.measuring.diagrams import Diagram
from omt_uv.solver.errors import CountError
from omt_uv.solver.partition import cells, cut_mesh, division, sites
from omt_uv.solver.partition.clipping import CellPieces, clip, whole_triangles
from omt_uv.solver.partition.face_labels import _joined, follow_faces


def plain_clip(points, labels, heights, label):
    """What is left of a polygon where heights are negative, and labels of its sides."""
    found = []
    for k in range(len(points)):
        a, b, s, t = points[k], points[(k + 1) % len(points)], heights[k], heights[(k + 1) % len(points)]
        if s < 0:
            found.append((a, labels[k]))
        if (s < 0) != (t < 0):
            # From a point that is left on, the new side begins where this one ends.
            found.append((a + s / (s - t) * (b - a), label if s < 0 else labels[k]))
    return found


@pytest.mark.parametrize("seed", range(6))
def test_polygons_are_clipped_side_by_side(seed):
    rng = np.random.default_rng(seed)
    pieces, plain = whole_triangles(30), [([np.array(c) for c in ((1.0, 0), (0, 1.0), (0, 0))], [-1, -2, -3])] * 30
    rows = np.arange(30)
    for turn in range(4):
        values = rng.standard_normal((len(rows), 3)) - 0.5
        label = 10 * turn + np.arange(len(rows))
        pieces, left = clip(pieces, values, label)
        clipped = []
        for k, (points, labels) in enumerate(plain):
            at = [values[k] @ [p[0], p[1], 1 - p[0] - p[1]] for p in points]
            clipped.append(plain_clip(points, labels, at, label[k]) if min(at) < 0 else [])
        assert left.tolist() == [k for k, found in enumerate(clipped) if found]
        plain = [([p for p, _ in clipped[k]], [n for _, n in clipped[k]]) for k in left]
        rows = rows[left]
        for k, (points, labels) in enumerate(plain):
            assert pieces.count[k] == len(points) and pieces.label[k, : len(points)].tolist() == labels
            assert pieces.points[k, : len(points)] == pytest.approx(np.array(points))
    area, middle = pieces.moments()
    for k, (points, _) in enumerate(plain):
        p, q = np.array(points), np.roll(points, -1, axis=0)
        cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        assert area[k] == pytest.approx(cross.sum() / 2, abs=1e-15)
        if area[k] > 1e-6:
            want = ((p + q) * cross[:, None]).sum(axis=0) / (3 * cross.sum())
            assert middle[k] == pytest.approx(want)
    assert pieces.used().sum(axis=1).tolist() == pieces.count.tolist()


def test_thin_pieces_have_the_mean_of_their_points_as_middle():
    line = CellPieces(np.array([[[0.2, 0.2], [0.4, 0.4], [0.6, 0.6], [9, 9]]]), np.array([3]), np.zeros((1, 4), int))
    area, middle = line.moments()
    assert area[0] == pytest.approx(0, abs=1e-15) and middle[0] == pytest.approx([0.4, 0.4])
    assert line.following()[0, :3].tolist() == [[0.4, 0.4], [0.6, 0.6], [0.2, 0.2]]


def test_points_at_corners_have_the_values_of_these_to_the_bit():
    values = np.array([[0.1, -0.3, 0.7], [-1e-20, 1.0, 1.0], [0.0, 0.0, -1e-300]])
    pieces, rows = clip(whole_triangles(3), values, np.array([4, 5, 6]))
    assert rows.tolist() == [0, 1, 2]
    corners = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
    for k, value in enumerate(values):
        own = pieces.points[k, : pieces.count[k]].tolist()
        # Where a value is 0 or next to it a side may be cut at the corner itself.
        assert all(corners[c] in own for c in range(3) if value[c] < 0) and all(
            value[c] < 1 for c in range(3) if corners[c] in own
        )


@pytest.mark.parametrize("seed", range(4))
def test_cells_are_where_their_values_are_least(seed):
    rng = np.random.default_rng(seed)
    size = [3, 1, 4]
    face, site = np.repeat([2, 5, 6], size), np.array([0, 3, 7, 2, 1, 3, 4, 9])
    value = rng.standard_normal((8, 3))
    found, rows = cells._clipped(value, face, site)
    assert (np.diff(rows) > 0).all()
    for f in (2, 5, 6):
        mine = [k for k, r in enumerate(rows) if face[r] == f]
        area, middle = (x[mine] for x in found.moments())
        assert area.sum() == pytest.approx(0.5)
        for k, m in zip(mine, middle, strict=True):
            at = value[face == f] @ [m[0], m[1], 1 - m.sum()]
            assert at.argmin() == rows[k] - np.flatnonzero(face == f)[0]
            labels = set(found.label[k, : found.count[k]].tolist()) - {-1, -2, -3}
            assert labels <= set(site[face == f].tolist()) - {site[rows[k]]}


def test_lots_of_polygons_are_stacked_and_sides_between_sites_are_as_long_as_they_are():
    one = whole_triangles(1)
    two = CellPieces(np.array([[[0, 0], [1, 0], [1, 1], [0, 0.5]]]), np.array([4]), np.array([[7, -1, 8, -2]]))
    both = cells._stacked([one, two])
    assert both.count.tolist() == [3, 4] and both.points.shape == (2, 4, 2)
    assert both.label.tolist() == [[-1, -2, -3, 0], [7, -1, 8, -2]]
    side, length = cells._sides(both, np.array([5.0, 3.0]))
    assert side.tolist() == [[1, 7], [1, 8]] and length == pytest.approx([2 * 3 * 1, 2 * 3 * np.hypot(1, 0.5)])


@pytest.mark.parametrize("mass", [[1, 1, 1], [5, 3, 2], [100, 1, 1, 1], [1e-9, 1], [0.6, 0.6, 0.6, 7]])
@pytest.mark.parametrize("more", [0, 1, 3, 20])
def test_parts_get_cells_in_proportion_and_one_at_least(mass, more):
    mass = np.array(mass, float)
    count = len(mass) + more
    found = sites.allot(mass, count)
    assert found.sum() == count and found.min() >= 1
    share = mass / mass.sum() * count
    # None has more than one too many while another lacks one.
    assert ((found <= np.ceil(share)) | (found == 1)).all()
    assert (found >= np.minimum(np.floor(share) - (share < 1).sum(), share)).all()
    with pytest.raises(CountError, match=f"{len(mass) - 1} cells are fewer than the {len(mass)} separate parts"):
        sites.allot(mass, len(mass) - 1)


def test_sites_keep_off_the_sides_and_parts_are_numbered():
    found = sites.inner(np.array([[1.0, 0, 0], [0.5, 0.5, -0.1], [0.3, 0.3, 0.4]]))
    want = [
        np.maximum(row, 1e-3) / np.maximum(row, 1e-3).sum() for row in ([1.0, 0, 0], [0.5, 0.5, -0.1], [0.3, 0.3, 0.4])
    ]
    assert found == pytest.approx(np.array(want))
    F = np.array([[5, 6, 7], [0, 1, 2], [7, 6, 8], [2, 1, 3]])
    assert sites.parts(F, 9).tolist() == [1, 0, 1, 0]


@pytest.mark.parametrize(("count", "groups"), [(1, 1), (2, 2), (3, 3), (5, 5)])
def test_samples_are_halved_across_the_longest_extent(count, groups):
    features = np.random.default_rng(1).random((40, 2)) * [10, 1]
    found = sites._halved(features, np.arange(40), count)
    assert len(found) == groups and sorted(np.concatenate(found).tolist()) == list(range(40))
    assert max(map(len, found)) - min(map(len, found)) <= 1
    for left, right in itertools.pairwise(found):
        assert features[left, 0].max() <= features[right, 0].min()


# ---- cut meshes ---------------------------------------------------------------------------------------------


def test_what_is_behind_in_a_row_is_the_last_of_it_for_the_first():
    assert cut_mesh._behind(np.array([0, 0, 0, 2, 5, 5])).tolist() == [2, 0, 1, 3, 5, 4]


def test_points_have_one_name_on_both_sides_of_edges_and_corners():
    triangles = np.array([[0, 1, 2], [1, 0, 3]])
    # Corner 1 of both; a point of cells 4 and 6 on the edge 0-1 from both; one of cells 4, 6, 8 inside the first.
    rows = [
        (0, 4, (-2, -1)),
        (1, 4, (-3, -1)),
        (0, 4, (-1, 6)),
        (1, 6, (-1, 4)),
        (0, 6, (-1, 4)),
        (0, 4, (6, 8)),
        (0, 8, (4, 6)),
        (1, 8, (4, 6)),
        (0, 4, (-3, -2)),
        (0, 4, (-3, 6)),
    ]
    face, cell, side = (np.array(x) for x in zip(*rows, strict=True))
    name = cut_mesh._named(triangles, face, cell, np.sort(side, axis=1)).tolist()
    assert name[0] == name[1] and name[2] == name[3] == name[4] and name[5] == name[6]
    assert len(set(name)) == 6 and name[7] not in name[:7]


def test_pieces_hang_together_by_edges_of_one_cell():
    _, quads = meshes.quad_grid(3, 2)
    cell = np.array([0, 1, 0, 0, 1, 0])
    count, label = cut_mesh.face_pieces(np.array(quads).ravel(), np.arange(0, 25, 4), cell)
    assert count == 3 and label[0] == label[3] and label[1] == label[4] and label[2] == label[5]
    mesh = SimpleNamespace(corner_vertex=np.array(quads).ravel(), face_start=np.arange(0, 25, 4), cell=cell)
    assert cut_mesh.CellMesh.torn(mesh).tolist() == [0]
    tail, head, polygon = cut_mesh.polygon_edges(np.array([4, 5, 6, 7, 8, 9, 1]), np.array([0, 3, 7]))
    assert head.tolist() == [5, 6, 4, 8, 9, 1, 7] and polygon.tolist() == [0] * 3 + [1] * 4 and tail[0] == 4


@pytest.mark.parametrize("seed", range(5))
def test_lesser_pieces_go_to_their_neighbours_ring_by_ring(seed):
    rng = np.random.default_rng(seed)
    _, quads = meshes.quad_grid(5, 4)
    label, mass = rng.integers(0, 3, 20), rng.random(20) + 0.1
    found = _joined(label, mass, np.array(quads).ravel(), np.arange(0, 81, 4))
    beside = [{j for j in range(20) if len(set(quads[i]) & set(quads[j])) == 2} for i in range(20)]

    def pieces(of):
        left, made = set(range(20)), []
        while left:
            piece, grow = set(), {min(left)}
            while grow:
                piece |= grow
                grow = {j for i in grow for j in beside[i] if of[j] == of[i]} - piece
            made.append(piece)
            left -= piece
        return made

    largest = {}
    for piece in pieces(label):
        c, weight = int(label[min(piece)]), sum(mass[i] for i in piece)
        if weight > largest.get(c, (0.0, None))[0]:
            largest[c] = weight, piece
    # The main piece of each stays, and all hang together with these.
    for c, (_, piece) in largest.items():
        assert all(found[i] == c for i in piece)
    assert len(pieces(found)) == len(largest)


def test_polygons_have_the_cell_with_their_greatest_share():
    _, quads = meshes.quad_grid(2, 1)
    pairs = SimpleNamespace(face=np.array([0, 0, 1, 2, 2, 3]), site=np.array([0, 1, 1, 1, 2, 2]))
    found = follow_faces(
        SimpleNamespace(
            cells=SimpleNamespace(pair=np.arange(6), part=np.array([0.3, 0.2, 0.2, 0.1, 0.4, 0.0])),
            pairs=pairs,
            asked=np.array([0.3, 0.5, 0.4, 0.1]),
        ),
        np.array([0, 0, 1, 1]),
        np.array(quads).ravel(),
        np.array([0, 4, 8]),
    )
    # The first has 0.4 of cell 1, the second 0.4 of cell 2; cells 0 and 3 get none.
    assert found.cell.tolist() == [1, 2] and found.empty.tolist() == [0, 3] and found.torn.tolist() == []
    assert found.mass == pytest.approx([0, 0.7, 0.5, 0])


# ---- diagrams -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("flat", [True, False])
def test_the_mesh_of_a_diagram_has_equal_points_once_and_cells_with_an_area(flat):
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    points = np.concatenate([square, square[[1, 0]], square + [1, 0], square[:0]])
    points = points if flat else np.column_stack([points, np.ones(len(points))])
    found = Diagram(SimpleNamespace(points=points, start=np.array([0, 4, 6, 10, 10])), np.ones(4), 0.25, 7)
    positions, polygons = found.mesh()
    assert len(positions) == 6 and [len(p) for p in polygons] == [4, 4]
    space = np.column_stack([square, np.full(4, 0.0 if flat else 1.0)])
    assert positions[polygons[0]] == pytest.approx(space) and positions[polygons[1]] == pytest.approx(space + [1, 0, 0])
    assert found.report() == {"cells": 4, "residual": 0.25, "iterations": 7}


@pytest.mark.parametrize(("count", "relax"), [(3, 0), (3, 1), (4, 3)])
def test_divisions_move_their_sites_as_often_as_they_are_asked(count, relax, monkeypatch):
    calls = []

    def dual(problem, found, even):
        calls.append(("dual", even))
        return SimpleNamespace(cells=lambda weights: "cells", sites=found, pairs="pairs")

    def solve(dual, weights, cells, asked, tolerance):
        calls.append(("solve", tolerance))
        return iter_done(SimpleNamespace(iterations=5, cells="solved"))

    def iter_done(value):
        return value
        yield

    monkeypatch.setattr(division, "_dual", dual)
    monkeypatch.setattr(division, "solve_dual", solve)
    monkeypatch.setattr(division, "karcher_means", lambda s, pairs, c: calls.append(("means", c)))
    monkeypatch.setattr(division, "_scaled", lambda dual, found, steps, area: (steps, area))
    V, F = meshes.grid(3, 3, 2.0, 1.0)
    from omt_uv.solver.progress import drain

    steps, area = drain(division.divide(V, F, count, options=division.DivisionOptions(relax=relax, tolerance=1e-5)))
    want = []
    for k in range(relax + 1):
        want.append(("dual", 0 < k == relax))
        if k < min(relax, 1):
            want.append(("means", "cells"))
        else:
            want.append(("solve", 1e-5 if k == relax else 0.1))
            want += [("means", "solved")] * (k < relax)
    assert calls == want and steps == 5 * sum(c[0] == "solve" for c in want) and area == 4.0
    with pytest.raises(CountError, match="cells are none"):
        drain(division.divide(V, F, 0))
