"""The first mesh of a closed part without maps: its own triangles, long edges halved and short ones collapsed.

It needs no cut, lies on the surface from the beginning, and does not fold, of whatever topology and however thin.
"""

from __future__ import annotations

import numpy as np

from .bisection import bisected
from .closest import ClosestPoint
from .counts import EdgeSize, StuckError, adjust_count
from .draft import Draft
from .embedded_flips import make_delaunay_embedded
from .parts import Part
from .topology import twins

# Edges up to so many times as long as wanted need not be halved.
LONGEST = 1.3


def simplified(part: Part, count: int, density: np.ndarray, at_vertices: np.ndarray, size: float) -> Draft:
    """A mesh of a closed part with `count` vertices, or a few more where no edge collapses any more.

    density (m,) of the part's triangles and at_vertices (n,), of mean 1; size: edge length at density 1
    """
    fine = bisected(part, LONGEST * size / np.sqrt(at_vertices))
    triangles, none = fine.triangles.copy(), np.zeros(0, np.int64)
    make_delaunay_embedded(fine.vertices, triangles, twins(triangles), none)
    draft = Draft(fine.vertices, triangles, np.zeros(len(fine.vertices), dtype=bool), none)
    wanted = EdgeSize(ClosestPoint(part.vertices, part.triangles, size), density, size)
    try:
        return adjust_count(draft, count, wanted)
    except StuckError as error:
        return error.draft
