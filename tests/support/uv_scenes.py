"""Meshes with UVs to refine, in Blender."""

from __future__ import annotations

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
