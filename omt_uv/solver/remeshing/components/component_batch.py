"""Batch many small components as one, moved apart: the solvers take as long for one of them as for a hundred."""

from __future__ import annotations

import numpy as np

from .components import Component

# Boxes lie on a grid with a pitch of so many extents of the largest component: farther apart than what is opposite to a
# vertex on its own component.
PITCH = 3.0


def batched(components: list[Component]) -> Component:
    """One `Component` of all components (c,), next to each other on a cubic grid.

    Its `shift` (m,3) says of every triangle how far it was moved, its `members` are the components.
    """
    corner = np.array([p.vertices.min(axis=0) for p in components])
    extent = max(float(np.ptp(p.vertices, axis=0).max()) for p in components)
    side = int(np.ceil(len(components) ** (1 / 3)))
    k = np.arange(len(components))
    place = np.stack([k % side, k // side % side, k // side**2], axis=1)
    shift = PITCH * extent * (place - (side - 1) / 2) - corner
    first = np.cumsum([0] + [len(p.vertices) for p in components])[:-1]
    pairs = list(zip(components, first, strict=True))
    return Component(
        vertices=np.concatenate([p.vertices + s for p, s in zip(components, shift, strict=True)]),
        triangles=np.concatenate([p.triangles + b for p, b in pairs]),
        faces=np.concatenate([p.faces for p in components]),
        input_barycentric=np.concatenate([p.input_barycentric for p in components]),
        features=np.concatenate([p.features + b for p, b in pairs]),
        # Both halves of a key are vertices.
        to_reopen=np.sort(np.concatenate([p.to_reopen + (b << 32 | b) for p, b in pairs])),
        shift=np.repeat(shift, [len(p.triangles) for p in components], axis=0),
        members=tuple(components),
    )
