"""Outlines that touch themselves: neighbours, or a map that covers itself."""

import hard_meshes
import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.contacts import covering_contacts, covers_itself, crossings, lies_apart, loop_edges, turns
from omt_uv.solver.maps.overlap import overlap_share
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain

STEPS = [1, 1j, -1, -1j]


def path_of_squares(directions):
    """Unit squares (k,) complex along a path, each joined to the one before alone: a map (n,) and triangles (m,3)."""
    cells = np.concatenate([[0], np.cumsum(np.array(STEPS)[directions])])
    corner = np.array([0, 1, 1 + 1j, 1j])
    vertex = np.arange(4 * len(cells)).reshape(-1, 4)
    w = (cells[:, None] + corner).ravel()
    for k, d in enumerate(directions):  # the side that two squares share, of the square before and of the next
        one, other = [(1, 2), (2, 3), (3, 0), (0, 1)][d], [(0, 3), (1, 0), (2, 1), (3, 2)][d]
        vertex[k + 1, other] = vertex[k, one]
    used, vertex = np.unique(vertex, return_inverse=True)
    vertex = vertex.reshape(-1, 4)
    return cells, w[used], np.concatenate([vertex[:, [0, 1, 2]], vertex[:, [0, 2, 3]]])


@pytest.mark.parametrize("turn", [1, np.exp(0.3j)], ids=["straight", "turned"])
def test_a_path_of_squares_covers_itself_where_it_comes_by_twice(turn):
    rng = np.random.default_rng(0)
    seen = []
    for _ in range(300):
        directions = [0]
        while len(directions) < 12:
            directions.append(int(rng.choice([d for d in range(4) if (d + 2) % 4 != directions[-1]])))
        cells, w, F = path_of_squares(directions[: rng.integers(3, 12)])
        (loop,) = boundary_loops(F)
        twice = len(np.unique(np.round(cells, 6))) < len(cells)
        assert covers_itself(turn * w, loop) == twice
        seen.append(twice)
    assert 50 < sum(seen) < 250


def test_only_what_certainly_lies_apart_does():
    V, F = meshes.grid(3, 3)
    w = V[:, :2] @ [1, 1j]
    assert lies_apart(w, F) and not lies_apart(w.conj(), F)
    _, around, triangles = path_of_squares([0, 0, 1, 1, 2, 2, 3, 3, 3])
    assert not lies_apart(around, triangles)
    # Two parts have two outlines, and may lie on each other.
    assert not lies_apart(np.concatenate([w, w + 10]), np.concatenate([F, F + len(w)]))


def test_more_than_a_full_turn_around_a_vertex_is_two_turns_of_the_outline():
    _, w, F = path_of_squares([0, 1, 2, 3])
    assert turns(w, *loop_edges(boundary_loops(F)[0])) == 2
    _, w, F = path_of_squares([0, 1, 2])
    assert turns(w, *loop_edges(boundary_loops(F)[0])) == 1


@pytest.mark.parametrize("angle, covers", [(0.4, True), (0.01, True), (1e-4, False), (-0.4, False)])
def test_corners_at_one_place_cover_each_other_where_their_sectors_do(angle, covers):
    """Two triangles with a corner at 0; the second begins so much before the end of the first."""
    first, second = np.exp(1j * np.array([0, 1.0])), np.exp(1j * (np.array([1.0, 2.0]) - angle))
    w = np.array([0, *first, 0, *second])
    tail, head = np.arange(6), np.array([1, 2, 0, 4, 5, 3])
    found = covering_contacts(w, tail, head, np.array([0, 3]), np.array([3, 0]), 1e-9)
    assert (found == covers).all()


@pytest.mark.parametrize("turn", [1, np.exp(0.7j)])
def test_the_two_sides_of_a_slit_are_neighbours(turn):
    V, F = meshes.hinge(height=0)
    w, (loop,) = V[:, :2] @ [turn, 1j * turn], boundary_loops(F)
    assert not len(crossings(w, loop)) and not covers_itself(w, loop)


@pytest.mark.parametrize("make", [hard_meshes.sponge, lambda: hard_meshes.voxel_blob(6)], ids=["sponge", "voxels"])
def test_maps_of_bodies_of_cubes_cover_nothing_twice(make):
    V, quads = make()
    result = drain(unwrap(meshes.polygon_surface(V, quads.tolist()), options=UnwrapOptions(quality="draft")))
    for chart, chart_map in zip(result.charts, result.maps, strict=True):
        assert overlap_share(chart_map.uv[chart.triangles], samples=20_000) == 0
        assert chart_map.folds == 0


@pytest.mark.parametrize("depth", [0.0, 0.25])
@pytest.mark.parametrize("off, touches", [(0.0, True), (1.0, True), (-1.0, True), (1.001, False), (-1.001, False)])
def test_a_vertex_is_on_an_edge_within_the_depth_and_no_farther(depth, off, touches):
    """The tip of a triangle next to the middle of a side of a square, of the same outline order, all numbers exact."""
    square = np.array([0, 4, 4 + 4j, 4j])
    tip = 2 + 1j * depth * off
    # It points up into the square, from below.
    triangle = np.array([1 - 2j, 3 - 2j, tip])
    w = np.concatenate([square, triangle])
    tail, head = np.arange(7), np.array([1, 2, 3, 0, 5, 6, 4])
    found = covering_contacts(w, tail, head, np.array([6]), np.array([0]), depth)
    assert found.shape == (1,) and not found[0]
    # The same tip, with its triangle above the side, lies on the square.
    w[4:6] = [3 + 2j, 1 + 2j]
    found = covering_contacts(w, tail, head, np.array([6]), np.array([0]), depth)
    assert found[0] == (touches if depth else True)
