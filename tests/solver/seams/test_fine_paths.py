"""Paths on edges: what is carried from a coarse surface hangs on the boundary and closes no loop."""

import meshes
import numpy as np
import pytest
import short_cuts
from scipy.spatial import cKDTree

from omt_uv.solver.analysis.seam_costs import seam_costs
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.mesh.geometry import unit
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_edges, boundary_loops, graph_components
from omt_uv.solver.seams import coarse_cut
from omt_uv.solver.seams.coarse_surface import coarsening
from omt_uv.solver.seams.fine_paths import FineGraph, FineMirror, carried, with_line
from omt_uv.solver.seams.path_graph import Mirrored, path_graph, path_to
from omt_uv.solver.seams.search import SeamSearch


@pytest.mark.parametrize("spread", [0.3, 0.05])
def test_what_is_carried_is_a_forest_that_hangs_on_the_boundary(monkeypatch, spread):
    V, F = meshes.cap(14, 28, 0.9)
    seen = []

    def watched(component, coarse, graph, steps, start, *rest):
        seen.append((component, start, carried(component, coarse, graph, steps, start, *rest)))
        return seen[-1][-1]

    monkeypatch.setattr(coarse_cut, "carried", watched)
    surface = triangle_surface(V, F)
    edges = cut(surface, search=SeamSearch(np.full(len(F), spread), surface, lambda: seam_costs(surface))).edges
    ((component, start, chosen),) = seen
    assert start.sum() == len(boundary_loops(F)[0]) and chosen.sum() == len(edges) > 0
    # With all of the boundary as one vertex: connected, and an edge for every other vertex.
    ends = np.where(start, 0, 1 + np.arange(len(start)))[component.ends[chosen]]
    vertices = np.unique(ends)
    label = graph_components(*ends.T, len(start) + 1)[1]
    assert len(vertices) == chosen.sum() + 1 and (label[vertices] == label[0]).all()


def test_a_path_around_a_tip_takes_no_short_cut_around_the_limb():
    # Up on the one side of a finger, and down on the other one.
    V, F = _finger()
    component = _component(V, F)
    start = component.on_boundary()
    coarse = coarsening(component.positions, component.triangles, len(V), None).ended(len(V))
    graph = path_graph(coarse, np.ones(len(V)), start[coarse.kept])
    around = np.concatenate([_meridian(V, 0), _meridian(V, np.pi)[::-1]])
    way = _places(component, coarse, V, around[: -len(around) // 6])
    chosen = carried(component, coarse, graph, graph.steps_of(way), start, None)
    assert set(coarse.kept[way].tolist()) <= set(np.unique(component.ends[chosen]).tolist())


@pytest.mark.parametrize("factor", [1.0, 1e-2, 1e-4])
def test_a_path_is_led_along_edges_however_little_a_cut_costs_there(factor):
    # The reach is measured in costs: where these are small, ways of edges lie beyond it, and seams were lost.
    V, F = _finger()
    component = _component(V, F)
    start = component.on_boundary()
    coarse = coarsening(component.positions, component.triangles, len(V), None).ended(len(V) // 6)
    graph = path_graph(coarse, np.full(len(coarse.kept), factor), start[coarse.kept])
    before = graph.paths_from(np.flatnonzero(graph.boundary))[1]
    way = path_to(before, int(np.argmax(coarse.positions[:, 2])))
    chosen = carried(component, coarse, graph, graph.steps_of(way), start, None)
    assert coarse.kept[way[0]] in component.ends[chosen]
    assert start[component.ends[chosen]].any()


def test_a_line_along_a_mirror_plane_that_is_none_of_edges_is_cut_all_the_same():
    V, F = _finger()
    component = _component(V, F)
    start = component.on_boundary()
    coarse = coarsening(component.positions, component.triangles, len(V), None).ended(len(V))
    image = cKDTree(component.positions).query(component.positions * [1, -1, 1] + [0, 2 * _middle(component), 0])[1]
    plane = np.zeros(len(V), dtype=bool)
    height = component.positions[:, 1] - _middle(component)
    graph = path_graph(coarse, np.ones(len(V)), start[coarse.kept], Mirrored(image, height >= -1e-9))
    way = _places(component, coarse, V, _meridian(V, 0))
    assert graph.in_plane[way].all()
    # Of the line every other vertex is missing, and all on the other side.
    plane[coarse.kept[way[::2]]] = True
    mirror = FineMirror(image, height, np.array([0.0, 1, 0]), plane, exact=False)
    chosen = carried(component, coarse, graph, graph.steps_of(way), start, mirror)
    assert component.length[chosen].sum() > 0.9 * np.linalg.norm(np.diff(coarse.positions[way], axis=0), axis=1).sum()


def _slanting(columns=40, rows=24):
    """A bent grid, and a path of coarse edges over it that runs between its rows and its diagonals."""
    V, F = meshes.bumpy(columns, rows, 0.1, 1.0)
    component = _component(V, F)
    start = component.on_boundary()
    coarse = coarsening(component.positions, component.triangles, 80, None).ended(80)
    graph = path_graph(coarse, np.ones(len(coarse.kept)), start[coarse.kept])
    low, high = component.positions.min(axis=0), component.positions.max(axis=0)
    tip = int(cKDTree(coarse.positions).query(low + (high - low) * [0.5, 0.6, 0])[1])
    way = path_to(graph.paths_from(np.flatnonzero(graph.boundary))[1], tip)
    return component, coarse, graph, way, start


def test_a_path_that_is_carried_is_straight():
    component, coarse, graph, way, start = _slanting()
    chosen = carried(component, coarse, graph, graph.steps_of(way), start, None)
    ends = component.ends[chosen]
    degree = np.bincount(ends.ravel(), minlength=component.vertex_count)
    assert degree[coarse.kept[way[0]]] == 1 and (degree <= 2).all()
    inner = np.flatnonzero(degree == 2)
    beside = [
        component.positions[np.setdiff1d(ends[(ends == v).any(axis=1)], v)] - component.positions[v] for v in inner
    ]
    turns = [np.degrees(np.arccos(-np.clip(unit(pair)[0] @ unit(pair)[1], -1, 1))) for pair in beside]
    assert max(turns) < 60


def test_steps_along_the_sides_of_quads_are_fewer_where_that_is_asked_for():
    n = 12
    V, _ = meshes.bumpy(n, n, 0.15, 1.0)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.column_stack([corner, corner + 1, corner + n + 2, corner + n + 1])
    component = _component_of(meshes.polygon_surface(V, quads.tolist()))
    start = component.on_boundary()
    coarse = coarsening(component.positions, component.triangles, len(V), None).ended(len(V))
    graph = path_graph(coarse, np.ones(len(V)), start[coarse.kept])
    # From the lower side inwards, up and to the right by turns.
    stairs = np.cumsum([3] + [n + 1, n + 1] + [1, n + 1] * 3)
    way = _places(component, coarse, V, stairs)[::-1]
    lengths, turns = [], []
    for straighter in (False, True):
        chosen = carried(component, coarse, graph, graph.steps_of(way), start, None, straighter)
        assert coarse.kept[way[0]] in component.ends[chosen] and start[component.ends[chosen]].any()
        ends = component.ends[chosen]
        along = unit(component.positions[ends[:, 1]] - component.positions[ends[:, 0]])
        meeting = [np.flatnonzero((ends == v).any(axis=1)) for v in np.unique(ends)]
        lengths.append(component.length[chosen].sum())
        turns.append(sum(abs(along[one] @ along[other]) < 0.5 for one, other in (m for m in meeting if len(m) == 2)))
    assert turns[0] >= 5 and turns[1] <= turns[0] / 2 and lengths[1] <= 1.01 * lengths[0]


def test_a_straighter_path_stays_near_the_one_that_was_found_and_off_what_is_blocked():
    component, coarse, _, way, _ = _slanting()
    graph = FineGraph.of(component)
    path = graph.path(
        component.on_boundary(), int(coarse.kept[way[0]]), coarse.kept[way], 0.1, np.ones(component.vertex_count, bool)
    )
    free = np.zeros(component.vertex_count, dtype=bool)
    spacing = 3 * float(np.median(component.length))
    straight = graph.straightened(path, free, spacing)
    assert straight[0] == path[0] and straight[-1] == path[-1] and graph.joined(straight)
    far = cKDTree(component.positions[straight]).query(component.positions[path])[0]
    assert far.max() <= spacing
    np.testing.assert_array_equal(graph.straightened(path, free, 0.0), path)
    blocked = free.copy()
    blocked[np.setdiff1d(straight, path)] = True
    assert not blocked[graph.straightened(path, blocked, spacing)].any()


def _finger():
    """A closed finger of eight sides, open at its root."""
    return meshes.polar(lambda t: 0.1 * np.sqrt(t * (2 - t)), lambda t: 1 - t, 40, 8)


def _middle(component):
    return component.positions[:, 1].min() / 2 + component.positions[:, 1].max() / 2


def _places(component, coarse, V, vertices):
    """Coarse vertices at vertices (k,) of a mesh, in their order."""
    scale = np.ptp(component.positions, axis=0).max() / np.ptp(V, axis=0).max()
    low = component.positions.min(axis=0) - scale * V.min(axis=0)
    way = cKDTree(coarse.positions).query(scale * V[vertices] + low)[1]
    return way[np.concatenate([[True], way[1:] != way[:-1]])]


def _component(V, F):
    """The one component of a disk, as searches get it."""
    return _component_of(triangle_surface(V, F))


def _component_of(surface):
    seen = []

    class Watching(SeamSearch):
        def __call__(self, component, base):
            seen.append(component)
            yield from ()
            return base

    cut(surface, search=Watching(np.full(len(surface.face_start) - 1, 1.0), surface, lambda: seam_costs(surface)))
    return seen[0]


def _meridian(V, angle):
    """Vertices of a finger from its root to its tip, at an angle around it."""
    axis = np.array([np.cos(angle), np.sin(angle)])
    there = np.flatnonzero(V[:, :2] @ axis >= np.linalg.norm(V[:, :2], axis=1) * (1 - 1e-9))
    return there[np.argsort(V[there, 2])]


@pytest.mark.parametrize("seed", range(4))
def test_a_line_along_a_plane_ends_where_that_crosses_the_boundary(seed):
    V, F = meshes.random_disk(300, seed)
    component = short_cuts.component_of(V, F)
    height = component.positions[:, 0] - 0.5
    mirror = FineMirror(np.arange(len(V)), height, np.array([1.0, 0, 0]), np.zeros(len(V), dtype=bool), exact=False)
    line = with_line(component, mirror).plane
    ends = boundary_edges(component.triangles)
    crossing = ends[height[ends].prod(axis=1) <= 0]
    assert len(crossing) >= 2 and line[crossing].any(axis=1).all()
    # Between them it is one path: nothing crosses the plane but beside it.
    inner = component.ends[line[component.ends].all(axis=1)]
    ends = np.concatenate([inner, ends[line[ends].all(axis=1)]])
    label = graph_components(*ends.T, len(V))[1]
    assert len(np.unique(label[line])) == 1
