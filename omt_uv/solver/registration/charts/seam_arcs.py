"""Divide seams into arcs, from corner to corner, and find which arc of one surface is which of another.

Arcs, each once for either side, with the next one around their chart and the other side, are a combinatorial map
(Lando, Zvonkin 2004): where one of them goes, all others follow. Of all ways to do so, the one that changes the shape
least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import TopologyMismatchError
from ...mesh.charts import Chart
from ...mesh.topology import boundary_loops

# Points of an arc that are compared.
SAMPLES = 9


@dataclass(frozen=True)
class SeamArcs:
    """Arcs of charts, the chart on the left of each.

    paths: vertices of the chart along each, both corners included; chart (a,); following (a,): the next one around the
    chart; other (a,): the same arc from the other side, -1 on a boundary; points (a,SAMPLES,3): evenly along each;
    corners (a,): vertex of the surface that each begins at
    """

    paths: tuple[np.ndarray, ...]
    chart: np.ndarray
    following: np.ndarray
    other: np.ndarray
    points: np.ndarray
    corners: np.ndarray


def seam_arcs(charts: list[Chart], marked: np.ndarray, name: str) -> SeamArcs:
    """The arcs of charts, each a disk, of a surface; marked (k,): vertices that are corners if they lie on a seam.

    Other corners are where seams branch or end, and where they meet the boundary. Raises TopologyMismatchError where
    a seam has none.
    """
    loops = [boundary_loops(chart.triangles)[0] for chart in charts]
    ids = [chart.vertex_ids[loop] for chart, loop in zip(charts, loops, strict=True)]
    is_corner = _corners(np.concatenate([[0], *ids]).max() + 1, ids, marked)
    paths: list[np.ndarray] = []
    owner, following, names = [], [], []
    for k, (loop, at) in enumerate(zip(loops, ids, strict=True)):
        first = np.flatnonzero(is_corner[at])
        if not len(first):
            raise TopologyMismatchError(
                f"A seam of the {name} closes upon itself without a corner",
                "Set a landmark on it on both surfaces, or let another seam end there",
                "vertex",
                at,
            )
        begin, ends = len(paths), np.append(first[1:], first[0] + len(loop))
        for start, end in zip(first.tolist(), ends.tolist(), strict=True):
            path = loop[np.arange(start, end + 1) % len(loop)]
            paths.append(path)
            names.append(tuple(charts[k].vertex_ids[path].tolist()))
            owner.append(k)
        following += [*range(begin + 1, len(paths)), begin]
    place = {path: k for k, path in enumerate(names)}
    return SeamArcs(
        paths=tuple(paths),
        chart=np.array(owner),
        following=np.array(following),
        other=np.array([place.get(path[::-1], -1) for path in names]),
        points=np.array([_along(charts[k].vertices[path]) for k, path in zip(owner, paths, strict=True)]),
        corners=np.array([path[0] for path in names]),
    )


def _corners(n: int, loops: list[np.ndarray], marked: np.ndarray) -> np.ndarray:
    """Which vertices (n,) bool have another number of seams and boundaries than two, or are marked."""
    ends = np.concatenate([np.stack([at, np.roll(at, -1)], axis=1) for at in loops])
    edges = np.unique(np.sort(ends, axis=1), axis=0)
    found = np.bincount(edges.ravel(), minlength=n) != 2
    found[marked[marked < n]] = True
    return found


def _along(points: np.ndarray) -> np.ndarray:
    """Points (SAMPLES,3) evenly along a line of points (k,3)."""
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    at = np.linspace(0, length[-1], SAMPLES)
    return np.column_stack([np.interp(at, length, points[:, d]) for d in range(3)])


def corresponding_arcs(source: SeamArcs, target: SeamArcs, pairs: np.ndarray) -> np.ndarray:
    """The arc (a,) of the target for each arc of the source, of surfaces that lie and are as large alike.

    pairs (k,2): vertices of both that correspond; where they are corners they shall meet. Raises
    TopologyMismatchError where no way fits.
    """
    ways = [] if len(source.chart) != len(target.chart) else [_from_first(source, target, a) for a in
                                                             range(len(target.chart))]  # fmt: skip
    partner = np.full(max(int(source.corners.max()), int(pairs.max(initial=0))) + 1, -1)
    partner[pairs[:, 0]] = pairs[:, 1]
    goal = partner[source.corners]
    fitting = [
        way for way in ways if way is not None and ((goal < 0) | (target.corners[way] == goal)).all()
    ]  # fmt: skip
    if not fitting:
        counts = [(int(arcs.chart.max(initial=-1)) + 1, len(arcs.chart)) for arcs in (source, target)]
        raise TopologyMismatchError(
            f"Seams do not cut both alike: the source into {counts[0][0]} charts with {counts[0][1]} sides, "
            f"the target into {counts[1][0]} with {counts[1][1]}",
            "Mark the same seams on both, and landmarks on both or neither of them",
        )
    return min(fitting, key=lambda way: float(((source.points - target.points[way]) ** 2).sum()))


def _from_first(source: SeamArcs, target: SeamArcs, image: int) -> np.ndarray | None:
    """Where all arcs (a,) go if the first one goes to that of the target, None where that contradicts itself."""
    found = np.full(len(source.chart), -1)
    found[0] = image
    left = [0]
    while left:
        arc = left.pop()
        for mine, theirs in ((source.following, target.following), (source.other, target.other)):
            there, goal = int(mine[arc]), int(theirs[found[arc]])
            if (there < 0) != (goal < 0):
                return None
            if there >= 0 and found[there] < 0:
                found[there] = goal
                left.append(there)
            elif there >= 0 and found[there] != goal:
                return None
    return found if len(np.unique(found)) == len(found) and found.min() >= 0 else None
