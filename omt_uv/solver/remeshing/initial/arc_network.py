"""The lines along which disk charts meet, and samples on them that neighbouring charts share.

An arc is a chain of edges between two nodes: a cut, a boundary, or a feature. Every chart's boundary is a cycle of
arcs, and every arc occurs in it forwards once and, unless it is a boundary of the surface, backwards once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.charts import Chart
from ...mesh.topology import boundary_loops, pair_keys

# A boundary or a feature that turns by more than this, radians, has a corner there.
CORNER = np.radians(50.0)
# Corners are at least so many edges apart, and from the ends of an arc.
CLOSEST = 0.6


@dataclass(frozen=True)
class Arc:
    """Part vertices (k,) in order, both ends included; keys of its edges; held: no mere cut but a line to keep."""

    vertices: np.ndarray
    held: bool


@dataclass(frozen=True)
class Side:
    """An arc as a chart sees it: number of the arc, whether it runs backwards, and its first place in the loop."""

    arc: int
    backwards: bool
    start: int


@dataclass(frozen=True)
class Network:
    """All arcs, and per chart its boundary loop of chart vertices, starting at a node, and its sides in order."""

    arcs: list[Arc]
    loops: list[np.ndarray]
    sides: list[list[Side]]


def network(
    positions: np.ndarray, charts: list[Chart], held: np.ndarray, slits: np.ndarray, size: np.ndarray | None = None
) -> Network:
    """Arcs of the boundaries of charts of one part, positions (n,3); held: sorted keys of the edges to keep, slits: of
    those among them that arcs hold alone.

    With `size` (n,), the edge length at every vertex, held arcs end at corners too.
    """
    loops = [boundary_loops(chart.disk)[0] for chart in charts]
    ids = [chart.vertex_ids[loop] for chart, loop in zip(charts, loops, strict=True)]
    keys = [pair_keys(i, np.roll(i, -1)) for i in ids]
    node = _nodes(len(positions), np.unique(np.concatenate(keys)), held, slits)
    rings = [i for i in ids if not node[i].any()]
    for i in rings:
        node[i.min()] = True
    found = _network(loops, ids, keys, node, held)
    if size is None:
        return found
    corners = [_corners(positions, arc.vertices, size) for arc in found.arcs if arc.held]
    at = np.concatenate([np.zeros(0, np.int64), *corners])
    node[at] = True
    for i in rings:
        # A ring with a corner needs no other place to start from.
        node[i.min()] = i.min() in at or not node[i].sum() > 1
    return _network(loops, ids, keys, node, held)


def _network(loops: list[np.ndarray], ids: list[np.ndarray], keys: list[np.ndarray], node, held) -> Network:
    arcs: list[Arc] = []
    number: dict[int, int] = {}
    sides: list[list[Side]] = []
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
                arcs.append(Arc(closed[start : end + 1], bool(_among(key[start : start + 1], held)[0])))
            mine.append(Side(number[int(label)], again, int(start)))
        sides.append(mine)
    return Network(arcs, turned, sides)


def _nodes(n: int, keys: np.ndarray, held: np.ndarray, slits: np.ndarray) -> np.ndarray:
    """Vertices (n,) bool where arcs end: branches, ends, and changes of kind."""
    ends = np.concatenate([keys >> 32, keys & 0xFFFFFFFF])
    degree = np.bincount(ends, minlength=n)
    kept, open_ = (np.bincount(ends, np.tile(_among(keys, kind), 2), n) for kind in (held, slits))
    return (degree > 0) & ((degree != 2) | (kept == 1) | (open_ == 1))


def _corners(positions: np.ndarray, vertices: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Vertices of an arc (k,) where it turns by more than CORNER between half an edge before and half an edge after.

    At this scale a scan's frayed boundary has few corners, and a true one is not lost to a bevel. An eighth of the arc
    is the most: on a square a quarter would see two corners at once from anywhere.
    """
    p = positions[vertices]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    reach = np.minimum(size[vertices] / 2, s[-1] / 8)
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
    apart = CLOSEST * size[vertices]
    if vertices[0] == vertices[-1]:
        apart = np.minimum(apart, s[-1] / 4)
    else:
        at = at[np.minimum(s[at], s[-1] - s[at]) > apart[at]]
    near = np.abs(s[at][:, None] - s[at]) < apart[at][:, None]
    sharper = (cosine[at] < cosine[at][:, None]) | ((cosine[at] == cosine[at][:, None]) & (at < at[:, None]))
    return vertices[at[~(near & sharper).any(axis=1)]]


def _among(keys: np.ndarray, ordered: np.ndarray) -> np.ndarray:
    return np.isin(keys, ordered)


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
    positions: np.ndarray, arcs: list[Arc], size: np.ndarray, longer: int = -1, stretch: float = 1.0
) -> ArcSamples:
    """Samples about `size` (n,), an edge length at every vertex, apart: a whole number of equal pieces on every arc.

    Arcs that begin and end at one node get two samples more, and several arcs between the same two one. The arc number
    `longer` gets one piece more. On held arcs samples are `stretch` times as far apart.
    """
    pieces, places = [], []
    for arc in arcs:
        p = positions[arc.vertices]
        local = (size[arc.vertices][1:] + size[arc.vertices][:-1]) / 2
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1) / local)])
        length /= stretch if arc.held else 1.0
        places.append(length)
        pieces.append(max(1, round(float(length[-1]))))
    ends = np.sort([[a.vertices[0], a.vertices[-1]] for a in arcs], axis=1)
    _, pair, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    least = np.where(ends[:, 0] == ends[:, 1], 3, np.where(count[pair.ravel()] > 1, 2, 1))
    nodes = np.unique(ends)
    points, fixed = [positions[nodes]], [np.zeros(len(nodes), dtype=bool)]
    along: list[np.ndarray] = []
    edges, shares = [], []
    total = len(nodes)
    for arc, length, p, q in zip(arcs, places, pieces, least, strict=True):
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
        fixed.append(np.full(p - 1, arc.held))
        if arc.held:
            fixed[0][[first, last]] = True
        total += p - 1
    return ArcSamples(np.concatenate(points), np.concatenate(fixed), along, edges, shares)


@dataclass(frozen=True)
class Border:
    """Samples around a chart in order: their numbers (b,), and the place of each in the boundary loop, (b,) real."""

    samples: np.ndarray
    place: np.ndarray


def border(sides: list[Side], samples: ArcSamples, arcs: list[Arc]) -> Border:
    """The samples of a chart's sides, each node once."""
    numbers, places = [], []
    for side in sides:
        place = samples.edge[side.arc] + samples.share[side.arc]
        along = samples.along[side.arc]
        if side.backwards:
            place, along = len(arcs[side.arc].vertices) - 1 - place[::-1], along[::-1]
        numbers.append(along[:-1])
        places.append(side.start + place[:-1])
    return Border(np.concatenate(numbers), np.concatenate(places))
