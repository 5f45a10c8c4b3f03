"""Flat islands that are not their own mirror images."""

import numpy as np
from scipy.spatial import cKDTree

FAN = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])


def corner(width, height, angle=0.0):
    """An L of four triangles: not its own mirror image."""
    points = np.array([[0, 0], [1, 0], [1, 0.3], [0.25, 0.3], [0.25, 1], [0, 1]]) * [width, height]
    return points @ rotation(angle).T


def rotation(angle):
    """The matrix (2,2) that turns columns counterclockwise."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def corners(count, seed=0, unit=1.0):
    """So many of them, of sizes and turns that chance has drawn."""
    rng = np.random.default_rng(seed)
    return [unit * corner(*rng.uniform(1, 10, 2), rng.uniform(0, 7)) for _ in range(count)]


def outline(points, samples=200):
    """Points (k,2) along a closed polygon (n,2)."""
    t = np.linspace(0, 1, samples)[:, None, None]
    return (points * (1 - t) + np.roll(points, -1, axis=0) * t).reshape(-1, 2)


def least_distance(islands):
    """Between the outlines of any two."""
    trees = [cKDTree(outline(p)) for p in islands]
    return min(a.query(b.data)[0].min() for i, a in enumerate(trees) for b in trees[:i])
