"""The first mesh of a part without maps: its own triangles, long edges halved and short ones collapsed.

It needs no cut, lies on the surface from the beginning, and does not fold, of whatever topology and however thin.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.closest_point import ClosestPoint
from ...mesh.topology import pair_keys, twins
from ..components.components import Part
from ..edits.delaunay_flips import make_delaunay_embedded
from ..edits.long_edges import bisected
from ..edits.vertex_count import EdgeSize, StuckError, adjust_count
from ..edits.working_mesh import Draft
from .arc_network import Arc, ArcSamples
from .feature_lines import Lined, only_between, with_samples, without_short

# Edges up to so many times as long as wanted need not be halved, and shorter ones than so many collapse before.
LONGEST, SHORTEST = 1.3, 0.3
# Needles may take many halvings: no more than so many times as many as there are to be vertices.
MOST = 3


def simplified(part: Part, count: int, density: np.ndarray, size: float) -> Draft:
    """A mesh of a closed part with `count` vertices, or a few more where no edge collapses any more.

    density (m,) of the part's triangles, of mean 1; size: edge length at density 1
    """
    none = np.zeros((0, 2), np.int64)
    mesh = Lined(part.vertices, part.triangles, none, none, none.ravel())
    return _brought_to(part, mesh, count, _wanted(part, density, size))[0]


def simplified_between(
    part: Part, arcs: list[Arc], samples: ArcSamples, count: int, density: np.ndarray, size: float
) -> tuple[Draft, np.ndarray]:
    """The same with the samples of held arcs fixed and edges between them locked; and the sorted keys of slits."""
    cut, vertex = with_samples(part, arcs, samples)
    mesh = only_between(cut, vertex[samples.fixed])
    mesh.points[mesh.vertices] = samples.points[samples.fixed]
    return _brought_to(part, mesh, count, _wanted(part, density, size))


def _wanted(part: Part, density: np.ndarray, size: float) -> EdgeSize:
    return EdgeSize(ClosestPoint(part.vertices, part.triangles, size), density, size)


def _brought_to(part: Part, mesh: Lined, count: int, wanted: EdgeSize) -> tuple[Draft, np.ndarray]:
    # Needles would be halved again and again.
    mesh = without_short(mesh, lambda points: SHORTEST * wanted(points))
    fine = bisected(_as_part(part, mesh), LONGEST * wanted(mesh.points), MOST * count)
    draft, slits = _draft(only_between(fine, mesh.vertices))
    try:
        return adjust_count(draft, count, wanted), slits
    except StuckError as error:
        return error.draft, slits


def _as_part(part: Part, mesh: Lined) -> Part:
    """The mesh with lines as features; where its triangles lie in the input is of no interest any more."""
    m = len(mesh.triangles)
    slits = np.sort(pair_keys(*mesh.slits.T))
    nowhere = {"faces": np.zeros(m, np.int64), "within": np.zeros((m, 3, 3)), "shift": np.zeros((m, 3))}
    return replace(
        part, vertices=mesh.points, triangles=mesh.triangles, features=mesh.lines, slits=slits, members=(), **nowhere
    )


def _draft(mesh: Lined) -> tuple[Draft, np.ndarray]:
    """The mesh, Delaunay, with all vertices on lines fixed, and its slits; those that stay come first."""
    fixed = np.zeros(len(mesh.points), dtype=bool)
    fixed[mesh.lines] = fixed[mesh.vertices] = True
    order = np.argsort(~fixed, kind="stable")
    number = np.argsort(order, kind="stable")
    triangles, points = number[mesh.triangles], mesh.points[order]
    locked, slits = (np.sort(pair_keys(*number[pairs].T)) for pairs in (mesh.lines, mesh.slits))
    make_delaunay_embedded(points, triangles, twins(triangles), locked)
    return Draft(points, triangles, fixed[order], locked), slits
