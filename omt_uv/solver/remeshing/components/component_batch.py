"""Many small parts as one, moved apart: the solvers take as long for one part as for a hundred of them."""

from __future__ import annotations

import numpy as np

from .components import Part

# Boxes of the parts lie on a grid with so many times the extent of the largest from one to the next: farther apart than
# what is opposite to a vertex on its own part.
APART = 3.0


def piled(parts: list[Part]) -> Part:
    """One part of several components: the parts next to each other, `shift` of each triangle how far it was moved."""
    corner = np.array([p.vertices.min(axis=0) for p in parts])
    extent = max(float(np.ptp(p.vertices, axis=0).max()) for p in parts)
    side = int(np.ceil(len(parts) ** (1 / 3)))
    k = np.arange(len(parts))
    place = np.stack([k % side, k // side % side, k // side**2], axis=1)
    shift = APART * extent * (place - (side - 1) / 2) - corner
    first = np.cumsum([0] + [len(p.vertices) for p in parts])[:-1]
    pairs = list(zip(parts, first, strict=True))
    return Part(
        vertices=np.concatenate([p.vertices + s for p, s in zip(parts, shift, strict=True)]),
        triangles=np.concatenate([p.triangles + b for p, b in pairs]),
        faces=np.concatenate([p.faces for p in parts]),
        within=np.concatenate([p.within for p in parts]),
        features=np.concatenate([p.features + b for p, b in pairs]),
        # Both halves of a key are vertices.
        slits=np.sort(np.concatenate([p.slits + (b << 32 | b) for p, b in pairs])),
        shift=np.repeat(shift, [len(p.triangles) for p in parts], axis=0),
        members=tuple(parts),
    )
