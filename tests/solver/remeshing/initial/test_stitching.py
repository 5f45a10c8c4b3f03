"""Charts stitched along their samples have the topology of the surface, and no two edges with the same ends."""

from __future__ import annotations

import numpy as np
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
