"""What is told of cells that are not as they should be."""

import numpy as np
import pytest
from meshes import polygon_surface

from omt_uv.pipelines.shapes.partition import _borders, partition_surface
from omt_uv.settings import PartitionSettings
from omt_uv.solver.progress import drain

CORNER = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])


def told(second, cells):
    """Warnings about two triangles apart, one of them with sides `second` times as long."""
    surface = polygon_surface(np.concatenate([CORNER, second * CORNER + 9]), [[0, 1, 2], [3, 4, 5]])
    return drain(partition_surface(surface, None, None, PartitionSettings(cells, 0, "attribute", 0))).warnings


@pytest.mark.parametrize(("second", "words"), [(2.0, "300 %"), (1.02, "4 %")])
def test_how_unequal_parts_are_is_told_in_two_digits_or_whole_percent(second, words):
    (warning,) = told(second, 2)
    assert warning.endswith(f"differ by up to {words}")


def test_cells_without_a_face_are_counted_and_named():
    *_, warning = told(1.0, 4)
    assert "cells (" in warning and ") are without a face" in warning


def test_borders_are_the_edges_between_different_cells():
    """Of cell 0 as of any other; faces that are in no cell have none."""
    quads = [[5 * r + c, 5 * r + c + 1, 5 * r + c + 6, 5 * r + c + 5] for r in range(3) for c in range(4)]
    points = np.array([[c, r, 0.0] for r in range(4) for c in range(5)])
    cell = np.array([0, 0, 1, -1, 0, 2, 1, -1, 2, 2, 2, 0])
    sides = {}
    for k, ring in enumerate(quads):
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            sides.setdefault(frozenset((a, b)), []).append(cell[k])
    expected = {edge for edge, (one, *other) in sides.items() if other and one != other[0] and min(one, other[0]) >= 0}
    found = _borders(polygon_surface(points, quads), cell)
    assert {frozenset(edge) for edge in found.tolist()} == expected and len(found) == len(expected)
