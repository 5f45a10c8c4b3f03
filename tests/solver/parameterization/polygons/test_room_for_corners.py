"""How far around reflex corners vertices may move."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.parameterization.polygons import convexity


def rings(reflex, triangles, n):
    """The same, vertex by vertex."""
    free = set(reflex.ravel().tolist())
    for _ in range(4):
        more = set(free)
        for t in triangles.tolist():
            if free & set(t):
                more |= set(t)
        beside = {v: set() for v in more}
        for t in triangles.tolist():
            for a in t:
                if a in more:
                    beside[a] |= more & set(t)
        left, largest = set(more), 0
        while left:
            part, todo = set(), [left.pop()]
            while todo:
                v = todo.pop()
                part.add(v)
                todo += beside[v] - part
                part |= beside[v]
            left -= part
            largest = max(largest, len(part))
        if largest > convexity.LARGEST:
            break
        free = more
        if len(free) > convexity.ROOM * len(reflex):
            break
    return free


@pytest.mark.parametrize(
    ("count", "room", "largest"), [(1, 50, 800), (1, 20, 800), (3, 50, 800), (1, 50, 40), (5, 9, 60), (2, 1, 9)]
)
def test_rings_are_added_until_there_is_room_or_a_patch_is_too_large(count, room, largest, monkeypatch):
    monkeypatch.setattr(convexity, "ROOM", room)
    monkeypatch.setattr(convexity, "LARGEST", largest)
    V, F = meshes.bumpy(22, 22)
    reflex = F[np.random.default_rng(count).choice(len(F), count, replace=False)]
    found = np.flatnonzero(convexity._around(reflex, F, len(V)))
    assert set(found.tolist()) == rings(reflex, F, len(V))
