"""A batch is its components side by side, each moved as a whole."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.remeshing.components.component_batch import batched
from omt_uv.solver.remeshing.components.components import split_components

NONE = np.zeros((0, 2), np.int64)


def some_components():
    (P, Q), (V, F) = meshes.icosphere(1), meshes.grid(3, 2)
    return split_components(
        np.concatenate([P, V - 2, 0.5 * P]), np.concatenate([Q, F + len(P), Q + len(P) + len(V)]), NONE
    )


def test_areas_faces_and_euler_characteristics_add_up():
    components = some_components().components
    batch = batched(components)
    assert len(components) == 3 and batch.members == tuple(components)
    np.testing.assert_allclose(batch.area, np.concatenate([c.area for c in components]), rtol=1e-12)
    np.testing.assert_array_equal(batch.faces, np.concatenate([c.faces for c in components]))
    assert batch.euler == sum(c.euler for c in components) == 5
    assert len(batch.boundary_edges) == sum(len(c.boundary_edges) for c in components)


def test_the_shift_leads_back():
    components = some_components().components
    batch = batched(components)
    corners = batch.vertices[batch.triangles] - batch.shift[:, None]
    expected = np.concatenate([c.vertices[c.triangles] for c in components])
    np.testing.assert_allclose(corners, expected, atol=1e-14)


def test_boxes_do_not_overlap():
    batch = batched(some_components().components)
    first = np.cumsum([0] + [len(c.vertices) for c in batch.members])
    boxes = np.split(batch.vertices, first[1:-1])
    extent = max(np.ptp(box, axis=0).max() for box in boxes)
    for i, one in enumerate(boxes):
        for other in boxes[:i]:
            gap = np.maximum(one.min(axis=0) - other.max(axis=0), other.min(axis=0) - one.max(axis=0)).max()
            assert gap > extent


def test_batches_of_eight_lie_about_the_origin():
    """Coordinates are as short as they can be: digits are lost far from it."""
    (V, F) = meshes.icosphere(1)
    alone = split_components(
        np.concatenate([V + 5 * k for k in range(8)]), np.concatenate([F + k * len(V) for k in range(8)]), NONE
    )
    batch = batched(alone.components)
    extent = max(np.ptp(p.vertices, axis=0).max() for p in alone.components)
    low, high = batch.vertices.min(axis=0), batch.vertices.max(axis=0)
    # Boxes begin at the places of a grid that is about 0.
    np.testing.assert_allclose(low, -1.5 * extent, rtol=0.1)
    np.testing.assert_allclose(high, 2.5 * extent, rtol=0.1)
