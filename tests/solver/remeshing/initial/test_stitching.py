"""Charts stitched along their samples have the topology of the surface, and no two edges with the same ends."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.remeshing.initial.arc_network import ChartBoundary
from omt_uv.solver.remeshing.initial.disk_samples import ChartMesh
from omt_uv.solver.remeshing.initial.stitching import stitch

PLACE = np.arange(4.0)
# The four corners of a square; a disk above it and one below make a sphere.
SQUARE = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
ABOVE, BELOW = ChartBoundary(np.arange(4), PLACE), ChartBoundary(np.array([3, 2, 1, 0]), PLACE)


def fan(apex):
    return ChartMesh(np.array([apex]), np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))


def test_two_disks_make_a_sphere():
    points, triangles = stitch(SQUARE, [ABOVE, BELOW], [fan([0.0, 0, 1]), fan([0.0, 0, -1])])
    assert topology(triangles) == (2, 0)
    np.testing.assert_array_equal(points[:4], SQUARE)
    np.testing.assert_array_equal(points[4:], [[0, 0, 1], [0, 0, -1]])


def test_an_edge_that_both_charts_have_is_split():
    """Both cut the square along the same diagonal."""
    flat = ChartMesh(np.zeros((0, 3)), np.array([[0, 1, 2], [0, 2, 3]]))
    turned = ChartMesh(np.zeros((0, 3)), np.array([[1, 2, 3], [1, 3, 0]]))
    points, triangles = stitch(SQUARE, [ABOVE, BELOW], [flat, turned])
    assert topology(triangles) == (2, 0) and len(points) > 4
    np.testing.assert_array_equal(points[:4], SQUARE)


def triangulated(corners, rng):
    """Triangles of a convex polygon of corners (k,), cut at random."""
    if len(corners) < 3:
        return []
    k = int(rng.integers(1, len(corners) - 1))
    here = (corners[0], corners[k], corners[-1])
    return [here, *triangulated(corners[: k + 1], rng), *triangulated(corners[k:], rng)]


# Samples around a chart, and the topology of the closed surface that it is glued to: arcs that are met both ways.
GLUED = {
    "torus": ([0, 1, 2, 0, 3, 4, 0, 2, 1, 0, 4, 3], (0, 0)),
    "sphere": ([0, 1, 2, 3, 2, 1], (2, 0)),
    "two handles": ([0, 1, 2, 0, 3, 4, 0, 2, 1, 0, 4, 3, 0, 5, 6, 0, 7, 8, 0, 6, 5, 0, 8, 7], (-2, 0)),
}


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("name", GLUED)
def test_a_chart_that_is_glued_to_itself_has_no_edge_from_a_sample_to_itself_nor_two_of_one(name, seed):
    samples, expected = GLUED[name]
    rng, k = np.random.default_rng(seed), len(samples)
    chart = ChartMesh(np.zeros((0, 3)), np.array(triangulated(list(range(k)), rng)))
    shared = rng.standard_normal((max(samples) + 1, 3))
    points, triangles = stitch(shared, [ChartBoundary(np.array(samples), np.arange(k + 1.0))], [chart])
    assert (triangles != triangles[:, [1, 2, 0]]).all() and topology(triangles) == expected
    np.testing.assert_array_equal(points[: len(shared)], shared)
    assert np.isfinite(points).all() and len(np.unique(triangles)) == len(points)
