"""Surfaces for the examples, so that they need no files."""

from __future__ import annotations

import numpy as np


def hill(count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and quads of a square with a hill in the middle."""
    x, y = np.meshgrid(np.linspace(-1, 1, count + 1), np.linspace(-1, 1, count + 1))
    vertices = np.column_stack([x.ravel(), y.ravel(), np.exp(-4 * (x**2 + y**2)).ravel()])
    corner = ((count + 1) * np.arange(count)[:, None] + np.arange(count)).ravel()
    return vertices, np.column_stack([corner, corner + 1, corner + count + 2, corner + count + 1])


def pear(count: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of a closed, pear-shaped body."""
    polar, turn = np.meshgrid(np.pi * np.arange(1, count) / count, np.pi * np.arange(2 * count) / count, indexing="ij")
    radius = 1 + 0.4 * np.cos(polar)
    ring = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    vertices = np.concatenate([(radius[..., None] * ring).reshape(-1, 3), [[0, 0, 1.4], [0, 0, -0.6]]])
    k, after = np.arange(2 * count), np.roll(np.arange(2 * count), -1)
    rows = 2 * count * np.arange(count - 2)[:, None]
    a, b, c, d = ((rows + q).ravel() for q in (k, after, k + 2 * count, after + 2 * count))
    top, bottom, last = len(vertices) - 2, len(vertices) - 1, 2 * count * (count - 2)
    caps = [np.column_stack([k, after, 0 * k + top]), np.column_stack([last + after, last + k, 0 * k + bottom])]
    return vertices, np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d]), *caps])
