"""Meshes with UVs to refine, in Blender."""

from __future__ import annotations

import bpy

import numpy as np
import scenes


def plain(name="Bump", **options):
    """A bump with the UVs seen from above, in the unit square."""
    obj = scenes.bump(name=name, **options)
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.5, (0.1, 0.2)))
    return obj


def ring():
    """A bumpy ring of quads, seen from above: an island with two boundaries."""
    t, r = 2 * np.pi * np.arange(24) / 24, np.linspace(0.5, 1.5, 6)
    x, y = np.outer(r, np.cos(t)).ravel(), np.outer(r, np.sin(t)).ravel()
    k = np.arange(5 * 24)
    after = k - k % 24 + (k + 1) % 24
    obj = scenes.add(
        np.stack([x, y, 0.5 * np.sin(3 * x)], axis=1), np.stack([k, after, after + 24, k + 24], axis=1)[:, ::-1]
    )
    scenes.set_uv(obj, scenes.seen_from_above(obj, 0.3, (0.5, 0.5)))
    return obj


def patches():
    """Two equal patches on the two sides of x = 0, each an island seen from above."""
    obj = scenes.bump(5, 4)
    points = np.array([v.co for v in obj.data.vertices]) + [0.3, 0, 0]
    faces = np.array([p.vertices for p in obj.data.polygons])
    bpy.data.objects.remove(obj)
    both = np.concatenate([points, points * [-1, 1, 1]])
    obj = scenes.add(both, np.concatenate([faces, faces + len(points)]), "Patches")
    uv = scenes.seen_from_above(obj)
    scenes.set_uv(obj, uv * 0.1 + np.repeat([[0, 0], [0.5, 0.5]], len(uv) // 2, axis=0))
    return obj
