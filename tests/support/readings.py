"""Triangle meshes as the pipelines read them, without Blender."""

from __future__ import annotations

import numpy as np

from omt_uv.pipelines.reading import Reading
from omt_uv.solver.mesh.surface import triangle_surface


def reading(V, F, uv=None, faces=None, pinned=None):
    """A mesh (n,3), (m,3) with UVs (3m,2) of its corners, or (n,2) of its vertices; all faces are chosen by default."""
    if uv is not None and len(uv) == len(V):
        uv = uv[F.ravel()]
    surface = triangle_surface(V, F)
    chosen = np.ones(len(F), bool) if faces is None else faces
    if uv is None:
        return Reading(surface, chosen, None, None)
    pinned = np.zeros(F.size, bool) if pinned is None else pinned
    return Reading(surface, chosen, np.asarray(uv, np.float32), pinned)


def together(*parts):
    """Several meshes (V, F) as one, without a vertex in common."""
    starts = np.cumsum([0, *(len(V) for V, _ in parts)])
    V = np.concatenate([V for V, _ in parts])
    return V, np.concatenate([F + start for (_, F), start in zip(parts, starts, strict=False)])
