"""Find the arcs along which disk charts meet, and sample them, so that neighbouring charts share the samples.

An arc is a chain of edges between two nodes: a cut, a boundary, or a feature. Every chart's boundary is a cycle of
arcs, and every arc occurs in it forwards once and, unless it is a boundary of the surface, backwards once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.charts import Chart
from ...mesh.topology import boundary_loops, pair_keys, paired

# A boundary or a feature that turns by more than this, radians, has a corner there.
CORNER = np.radians(50.0)
# Distance of corners from each other and from the ends of an arc at least, in edges.
CLOSEST = 0.6
# Share of an arc over which a corner is looked for at most.
MAX_REACH = 1 / 8


@dataclass(frozen=True)
class Arc:
    """Vertices (k,) of the component in order, both ends included; kept: no mere cut between charts, but a boundary or
    feature, whose samples stay."""

    vertices: np.ndarray
    kept: bool


@dataclass(frozen=True)
class ChartSide:
    """An arc as a chart sees it: number of the arc, whether it runs backwards, and its first place in the loop."""

    arc: int
    backwards: bool
    start: int


@dataclass(frozen=True)
class ArcNetwork:
    """All arcs, and per chart its boundary loop of chart vertices, starting at a node, and its sides in order."""

    arcs: list[Arc]
    loops: list[np.ndarray]
    sides: list[list[ChartSide]]

    def along(self, keys: np.ndarray) -> list[int]:
        """The arcs along edges with the keys (k,), as those of boundaries."""
        return [k for k, arc in enumerate(self.arcs) if np.isin(pair_keys(*arc.vertices[:2, None]), keys)[0]]


def find_arcs(
    positions: np.ndarray,
    charts: list[Chart],
    kept_edges: np.ndarray,
    to_reopen: np.ndarray,
    size: np.ndarray | None = None,
) -> ArcNetwork:
    """Find the arcs of the boundaries of charts of one component, positions (n,3).

    kept_edges: sorted keys of the edges on boundaries and features; to_reopen: of those among them that no other kind
    continues; with `size` (n,), the edge length at every vertex, kept arcs end at corners, too
    """
    loops = [boundary_loops(chart.disk)[0] for chart in charts]
    ids = [chart.vertex_ids[loop] for chart, loop in zip(charts, loops, strict=True)]
    keys = [pair_keys(i, np.roll(i, -1)) for i in ids]
    node = _nodes(len(positions), np.unique(np.concatenate(keys)), kept_edges, to_reopen)
    rings = [i for i in ids if not node[i].any()]
    for i in rings:
        node[i.min()] = True
    found = _network(loops, ids, keys, node, kept_edges)
    if size is None:
        return found
    corners = [_corners(positions, arc.vertices, size) for arc in found.arcs if arc.kept]
    at = np.concatenate([np.zeros(0, np.int64), *corners])
    node[at] = True
    for i in rings:
        # A ring with a corner needs no other place to start from.
        node[i.min()] = i.min() in at or not node[i].sum() > 1
    return _network(loops, ids, keys, node, kept_edges)


def _network(loops: list[np.ndarray], ids: list[np.ndarray], keys: list[np.ndarray], node, kept_edges) -> ArcNetwork:
    arcs: list[Arc] = []
    number: dict[int, int] = {}
    sides: list[list[ChartSide]] = []
    turned = []
    for loop, i, key in zip(loops, ids, keys, strict=True):
        first = int(np.flatnonzero(node[i])[0])
        i, key = np.roll(i, -first), np.roll(key, -first)
        turned.append(np.roll(loop, -first))
        starts = np.flatnonzero(node[i])
        labels = np.minimum.reduceat(key, starts)
        ends = np.append(starts[1:], len(i))
        closed = np.append(i, i[0])
        mine = []
        for start, end, label in zip(starts, ends, labels, strict=True):
            again = int(label) in number
            if not again:
                number[int(label)] = len(arcs)
                arcs.append(Arc(closed[start : end + 1], bool(np.isin(key[start : start + 1], kept_edges)[0])))
            mine.append(ChartSide(number[int(label)], again, int(start)))
        sides.append(mine)
    return ArcNetwork(arcs, turned, sides)


def _nodes(n: int, keys: np.ndarray, kept_edges: np.ndarray, to_reopen: np.ndarray) -> np.ndarray:
    """Vertices (n,) bool where arcs end: branches, ends, and changes of kind."""
    ends = paired(keys).T.ravel()
    degree = np.bincount(ends, minlength=n)
    kept, open_ = (np.bincount(ends, np.tile(np.isin(keys, kind), 2), n) for kind in (kept_edges, to_reopen))
    return (degree > 0) & ((degree != 2) | (kept == 1) | (open_ == 1))


def _corners(positions: np.ndarray, vertices: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Vertices of an arc (k,) where it turns by more than CORNER between half an edge before and half an edge after.

    At this scale a scan's frayed boundary has few corners, and a true one is not lost to a bevel. On a square a quarter
    of the boundary would see two corners at once from anywhere: MAX_REACH is less.
    """
    p = positions[vertices]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    reach = np.minimum(size[vertices] / 2, s[-1] * MAX_REACH)
    if vertices[0] == vertices[-1]:
        s_long, p_long = np.concatenate([s[:-1] - s[-1], s, s[1:] + s[-1]]), np.concatenate([p[:-1], p, p[1:]])
    else:
        s_long, p_long = s, p
    before, after = (
        np.stack([np.interp(s + d, s_long, p_long[:, k]) for k in range(3)], axis=1) for d in (-reach, reach)
    )
    u, v = p - before, after - p
    length = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
    cosine = np.einsum("ij,ij->i", u, v) / np.maximum(length, 1e-300)
    inner = (s > 0) & (s < s[-1]) if vertices[0] != vertices[-1] else s < s[-1]
    at = np.flatnonzero((cosine < np.cos(CORNER)) & (length > 0) & inner)
    spaced_faces = CLOSEST * size[vertices]
    if vertices[0] == vertices[-1]:
        spaced_faces = np.minimum(spaced_faces, s[-1] / 4)
    else:
        at = at[np.minimum(s[at], s[-1] - s[at]) > spaced_faces[at]]
    near = np.abs(s[at][:, None] - s[at]) < spaced_faces[at][:, None]
    sharper = (cosine[at] < cosine[at][:, None]) | ((cosine[at] == cosine[at][:, None]) & (at < at[:, None]))
    return vertices[at[~(near & sharper).any(axis=1)]]


@dataclass(frozen=True)
class ArcSamples:
    """Samples on arcs: positions (s,3), fixed (s,) bool; per arc the samples (p+1,) along it, both ends included, and
    where they are: the edge of the arc and the share along it, (p+1,) each."""

    points: np.ndarray
    fixed: np.ndarray
    along: list[np.ndarray]
    edge: list[np.ndarray]
    share: list[np.ndarray]


def sample_arcs(
    positions: np.ndarray, arcs: list[Arc], size: np.ndarray, longer: int = -1, line_spacing: float = 1.0
) -> ArcSamples:
    """Sample arcs about `size` (n,), an edge length at every vertex, apart: a whole number of equal edges on every arc.

    Arcs that begin and end at one node get two samples more, and several arcs between the same two one. The arc number
    `longer` gets one edge more. On kept arcs samples are `line_spacing` times as far apart.
    """
    edge_counts, places = [], []
    for arc in arcs:
        p = positions[arc.vertices]
        local = (size[arc.vertices][1:] + size[arc.vertices][:-1]) / 2
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1) / local)])
        length /= line_spacing if arc.kept else 1.0
        places.append(length)
        edge_counts.append(max(1, round(float(length[-1]))))
    ends = np.sort([[a.vertices[0], a.vertices[-1]] for a in arcs], axis=1)
    _, pair, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    least = np.where(ends[:, 0] == ends[:, 1], 3, np.where(count[pair.ravel()] > 1, 2, 1))
    nodes = np.unique(ends)
    points, fixed = [positions[nodes]], [np.zeros(len(nodes), dtype=bool)]
    along: list[np.ndarray] = []
    edges, shares = [], []
    total = len(nodes)
    for arc, length, p, q in zip(arcs, places, edge_counts, least, strict=True):
        p = max(p, int(q)) + (len(along) == longer)
        s = np.arange(p + 1) / p * length[-1]
        edge = np.clip(np.searchsorted(length, s, side="right") - 1, 0, len(length) - 2)
        share = np.clip((s - length[edge]) / np.maximum(length[edge + 1] - length[edge], 1e-300), 0, 1)
        a, b = positions[arc.vertices[edge]], positions[arc.vertices[edge + 1]]
        first, last = np.searchsorted(nodes, arc.vertices[[0, -1]])
        along.append(np.concatenate([[first], total + np.arange(p - 1), [last]]))
        edges.append(edge)
        shares.append(share)
        points.append((a + share[:, None] * (b - a))[1:-1])
        fixed.append(np.full(p - 1, arc.kept))
        if arc.kept:
            fixed[0][[first, last]] = True
        total += p - 1
    return ArcSamples(points=np.concatenate(points), fixed=np.concatenate(fixed), along=along, edge=edges, share=shares)


@dataclass(frozen=True)
class ChartBoundary:
    """Samples around a chart in order: their numbers (b,), and the place of each in the boundary loop, (b,) real."""

    samples: np.ndarray
    place: np.ndarray


def chart_boundary(sides: list[ChartSide], samples: ArcSamples, arcs: list[Arc]) -> ChartBoundary:
    """Chain the samples of a chart's sides, each node once."""
    numbers, places = [], []
    for side in sides:
        place = samples.edge[side.arc] + samples.share[side.arc]
        along = samples.along[side.arc]
        if side.backwards:
            place, along = len(arcs[side.arc].vertices) - 1 - place[::-1], along[::-1]
        numbers.append(along[:-1])
        places.append(side.start + place[:-1])
    return ChartBoundary(np.concatenate(numbers), np.concatenate(places))
