"""Arcs partition the boundaries of charts; samples on them are shared, and a whole number of equal edges apart."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.topology import pair_keys
from omt_uv.solver.remeshing.initial import arc_network
from omt_uv.solver.remeshing.initial.arc_network import Arc, chart_boundary, find_arcs, sample_arcs
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource

NONE = np.zeros(0, np.int64)


def networks():
    for name in ("torus", "annulus", "grid"):
        maps = RemeshSource(*getattr(meshes, name)()).maps[0]
        component = maps.component
        size = np.full(len(component.vertices), 0.1)
        yield maps, find_arcs(component.vertices, maps.charts, component.boundary_edges, NONE, size)


@pytest.mark.parametrize("case", range(3))
def test_every_arc_is_a_side_once_forwards_and_once_backwards_unless_on_the_boundary(case):
    maps, network = list(networks())[case]
    sides = [side for of_chart in network.sides for side in of_chart]
    on_boundary = set(network.along(maps.component.boundary_edges))
    for k, arc in enumerate(network.arcs):
        ways = sorted(side.backwards for side in sides if side.arc == k)
        assert ways == ([False] if k in on_boundary else [False, True])
        assert arc.kept == (k in on_boundary)
    edges = np.concatenate([pair_keys(a.vertices[:-1], a.vertices[1:]) for a in network.arcs])
    assert len(np.unique(edges)) == len(edges)
    assert sum(len(loop) for loop in network.loops) == sum(len(network.arcs[s.arc].vertices) - 1 for s in sides)


@pytest.mark.parametrize("case", range(3))
def test_samples_lie_on_their_arcs_at_equal_distances(case):
    maps, network = list(networks())[case]
    V = maps.component.vertices
    samples = sample_arcs(V, network.arcs, np.full(len(V), 0.1))
    for k, arc in enumerate(network.arcs):
        p = V[arc.vertices]
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
        edge, share = samples.edge[k], samples.share[k]
        at = s[edge] + share * (s[edge + 1] - s[edge])
        np.testing.assert_allclose(np.diff(at), s[-1] / (len(at) - 1), rtol=1e-9)
        places = p[edge] + share[:, None] * (p[edge + 1] - p[edge])
        np.testing.assert_allclose(samples.points[samples.along[k]], places, atol=1e-12)
    used = np.unique(np.concatenate(samples.along))
    np.testing.assert_array_equal(used, np.arange(len(samples.points)))


@pytest.mark.parametrize("apart", [1.0, 1.7, 4.0])
@pytest.mark.parametrize("case", range(3))
def test_lines_that_are_kept_are_sampled_farther_apart_and_cuts_are_not(case, apart):
    maps, network = list(networks())[case]
    V = maps.component.vertices
    plain = sample_arcs(V, network.arcs, np.full(len(V), 0.1))
    found = sample_arcs(V, network.arcs, np.full(len(V), 0.1), line_spacing=apart)
    assert {arc.kept for arc in network.arcs} == ({False} if case == 0 else {True} if case == 2 else {False, True})
    for k, arc in enumerate(network.arcs):
        before, after = len(plain.along[k]) - 1, len(found.along[k]) - 1
        length = np.linalg.norm(np.diff(V[arc.vertices], axis=0), axis=1).sum() / 0.1
        assert after == before if not arc.kept else after == max(round(length / apart), 3 * _returns(arc), 1)
        np.testing.assert_array_equal(found.fixed[found.along[k][1:-1]], arc.kept)


def _returns(arc):
    """Whether an arc ends where it begins."""
    return bool(arc.vertices[0] == arc.vertices[-1])


def test_a_square_has_its_corners():
    maps, network = list(networks())[2]
    V = maps.component.vertices
    ends = np.unique([a.vertices[[0, -1]] for a in network.arcs])
    assert len(network.arcs) == len(ends) == 4
    assert (np.abs(V[ends][:, :2]).max(axis=1) == np.abs(V[:, :2]).max()).all()
    samples = sample_arcs(V, network.arcs, np.full(len(V), 0.26))
    assert samples.fixed.all() and len(samples.points) == 16
    assert len(sample_arcs(V, network.arcs, np.full(len(V), 0.26), longer=2).points) == 17
    assert len(sample_arcs(V, network.arcs, np.full(len(V), 0.26), line_spacing=2.0).points) == 8


@pytest.mark.parametrize("kept", [(), (0,), (1,), (0, 2), (0, 1, 2)])
def test_places_where_arcs_meet_stay_just_where_one_of_them_does(kept):
    """Three arcs in a row, from vertex to vertex of a line."""
    V = np.column_stack([np.arange(10.0), np.zeros(10), np.zeros(10)])
    arcs = [Arc(np.arange(3 * k, 3 * k + 4), k in kept) for k in range(3)]
    samples = sample_arcs(V, arcs, np.full(10, 1.0))
    ends = {
        round(float(samples.points[samples.along[k][j]][0])): samples.along[k][j] for k in range(3) for j in (0, -1)
    }
    assert ends.keys() == {0, 3, 6, 9}
    for place, sample in ends.items():
        assert samples.fixed[sample] == any(place in (3 * k, 3 * k + 3) for k in kept)
    for k in range(3):
        assert (samples.fixed[samples.along[k][1:-1]] == (k in kept)).all()


def test_samples_around_a_chart_come_in_order_of_its_loop():
    for maps, network in networks():
        V = maps.component.vertices
        samples = sample_arcs(V, network.arcs, np.full(len(V), 0.1))
        for sides, loop, chart in zip(network.sides, network.loops, maps.charts, strict=True):
            found = chart_boundary(sides, samples, network.arcs)
            assert (np.diff(found.place) > 0).all() and found.place[0] == 0 and found.place[-1] < len(loop)
            k = found.place.astype(int)
            a, b = (V[chart.vertex_ids[loop[i % len(loop)]]] for i in (k, k + 1))
            on = a + (found.place - k)[:, None] * (b - a)
            np.testing.assert_allclose(samples.points[found.samples], on, atol=1e-9)


def bend(at, angle, total=10.0):
    """A line that turns by an angle at a distance from its start: positions (n,3), and distances (n,)."""
    s = np.unique(np.append(np.linspace(0, total, 201), at))
    beyond = np.maximum(s - at, 0)
    along, across = np.minimum(s, at) + beyond * np.cos(angle), beyond * np.sin(angle)
    return np.column_stack([along, across, 0 * s]), s


@pytest.mark.parametrize("degrees, told", [(0, False), (49, False), (51, True), (90, True)])
def test_a_corner_turns_by_more_than_fifty_degrees(degrees, told):
    p, s = bend(4.0, np.radians(degrees))
    found = arc_network._corners(p, np.arange(len(p)), np.ones(len(p)))
    assert s[found].tolist() == [4.0] * told


@pytest.mark.parametrize("at", [0.05, 0.2, 0.4, 0.55, 0.65, 1.0, 5.0])
def test_no_corner_is_near_either_end_of_a_line(at):
    """Nearer than 0.6 of an edge, whichever end it begins at."""
    for size in (1.0, 0.5):
        p, s = bend(at, np.pi / 2)
        ahead = s[arc_network._corners(p, np.arange(len(p)), np.full(len(p), size))]
        back = s[arc_network._corners(p, np.arange(len(p))[::-1], np.full(len(p), size))]
        for found in (ahead, back):
            assert (np.minimum(found, s[-1] - found) > 0.6 * size).all()
            if at > 0.6 * size:
                assert found.tolist() == [at]
