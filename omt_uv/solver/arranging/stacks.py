"""Put islands of equal shape on one another, so that they share their part of the texture."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import face_areas
from .congruence import matching

# Digits of a surface's area by which equal islands are looked for, relative to all.
DIGITS = 4


@dataclass(frozen=True)
class Stacks:
    """uv: of every island (n_i,2); stack (k,): number of the one that it lies on, its own where it is the first."""

    uv: list[np.ndarray]
    stack: np.ndarray

    @property
    def moved(self) -> int:
        """How many islands lie on another one now."""
        return int((self.stack != np.arange(len(self.stack))).sum())


def stacks(islands: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], mirrored: bool = True) -> Stacks:
    """Islands on the first one of the same shape in space, vertex on vertex.

    Parameters
    ----------
    islands : positions (n_i,3), triangles (m_i,3) and UVs (n_i,2) of each
    mirrored : whether those that are the mirror image of another one count as equal

    Examples
    --------
    >>> import numpy as np
    >>> V, F = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])
    >>> found = stacks([(V, F, V[:, :2]), (V + 7, F, V[:, :2] + 3)])
    >>> found.stack.tolist(), found.uv[1].tolist() == V[:, :2].tolist()
    ([0, 0], True)
    """
    areas = np.array([face_areas(V, F).sum() for V, F, _ in islands])
    slack = float(areas.max(initial=0.0)) * 10.0**-DIGITS
    uv, stack = [np.array(place, float) for *_, place in islands], np.arange(len(islands))
    # The first one of each shape by its sizes, and in the order of areas: thousands of others need no look.
    firsts: dict[tuple[int, int], list[tuple[float, int]]] = {}
    for k, (V, F, _) in enumerate(islands):
        alike = firsts.setdefault((len(V), len(F)), [])
        begin, end = bisect_left(alike, (areas[k] - slack, -1)), bisect_left(alike, (areas[k] + slack, len(islands)))
        for first in sorted(island for _, island in alike[begin:end]):
            W, G, _ = islands[first]
            found = matching(V, F, W, G)
            if found is not None and (mirrored or not found.mirrored):
                uv[k], stack[k] = uv[first][found.vertices], first
                break
        else:
            insort(alike, (float(areas[k]), k))
    return Stacks(uv, stack)
