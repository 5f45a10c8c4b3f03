"""Blender's packer behind our interface: one scale, no overlap, inside, as far apart as asked for."""

from __future__ import annotations

import numpy as np
import pytest


def squares():
    """Islands of one square each: corners (4,2) and triangles (2,3)."""
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    return [size * points + 5 for size in (1.0, 2.0, 0.5)], [np.array([[0, 1, 2], [0, 2, 3]])] * 3


def test_islands_keep_their_shape_and_their_distance(package):
    islands, triangles = squares()
    packed = package("blender.uv_packer").pack(islands, triangles, 8, 256)
    for before, after in zip(islands, packed.islands, strict=True):
        lengths = [np.linalg.norm(x - np.roll(x, 1, axis=0), axis=1) for x in (before, after)]
        assert lengths[1] == pytest.approx(packed.scale * lengths[0], rel=1e-4)
    points = np.concatenate(packed.islands)
    assert points.min() >= 0 and points.max() <= 1
    assert packed.coverage == pytest.approx(packed.scale**2 * (1 + 4 + 0.25), rel=1e-3)
    boxes = np.array([[p.min(axis=0), p.max(axis=0)] for p in packed.islands])
    for k in range(3):
        for j in range(k):
            gap = np.maximum(boxes[k][0] - boxes[j][1], boxes[j][0] - boxes[k][1]).max()
            assert gap > 0.9 * 8 / 256


def test_margins_without_room_are_refused(package):
    with pytest.raises(package("xatlas.packing").PackingError):
        package("blender.uv_packer").pack(*squares(), 128, 256)
