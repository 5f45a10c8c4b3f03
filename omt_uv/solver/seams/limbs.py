"""Take limbs off a chart whose map leaves most of a texture empty, where it is narrow.

A body with limbs in one piece is a star, and a square around a star is empty for the most part: its texels are twice as
large as they had to be. An artist takes off a head or an arm, at the neck: a cut that is short beside what it parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ..analysis.symmetry_plane import MirrorImages
from ..linalg.minimum_cut import capacities
from ..maps.upright import turn_upright
from ..mesh.charts import Chart, part_of_chart
from ..mesh.geometry import below_one, cotangent_laplacian, edge_lengths, face_areas
from ..mesh.topology import pair_keys
from ..packing.pack_square import pack
from ..packing.turning import in_smallest_box
from ..progress import drain
from ..revolution.profile import harmonic_between
from .options import COMPACT
from .parting import (
    LEAST_PART,
    PolygonGraph,
    lies_on_its_image,
    minimum_cut,
    with_images,
)

# Charts that have not this share of a surface stay in one piece, but for bands.
MUCH = 0.25
# A chart that is longer than a square of the whole area by so many times, if its width is at most that share of its
# length or whatever it is, is a band, cut across in so many times as long pieces, at most so many. A narrow one with
# less than this share of the area is one from COMPACT on: all others would be small for its sake.
LONG_AND_NARROW = 1.8
SMALL = 0.4
NARROW = 1 / 3
LONG = 3.0
PIECE = 1.2
MOST_PIECES = 12
# A cut across a long chart is looked for within this share of a piece of where pieces of the same length would end.
NEAR_CUT = 0.2
# At the ends of that it costs so much more.
OFF = 0.1
# One that bends is as wide in so many stretches of it, but for that share of it at both ends, up to a factor.
AS_WIDE = 1.5
STRETCHES = 16
ENDS = 0.2
# What is up in space, (3,); None where nobody knows.
Up = Sequence[float] | None
# A chart sprawls where the whole surface fills less of the square around that chart; cuts are made where the pieces
# fill so many times as much once they are packed, which is tried where their boxes promise so many times as much.
SPRAWLING = 0.34
FULLER = 1.3
HOPEFUL = 1.25
# What fills as much needs no further cut; one that is made fills more by this factor at least.
FULL = 0.45
LITTLE = 1.05
# A neck costs at most that share of the side of a square with the area of the smaller part, what has mean costs being
# as long as it is; and a part has this share of the chart at least.
NECK = 0.5
LEAST_LIMB = 0.05
MOST_CUTS = 8
# A neck along the mirror plane costs so many times as much: a head that is cut in halves there is cut through its face.
HALVES = 6.0
# So many tips of a piece, and lengths around each, are looked at; necks are looked for within that share of the side of
# a square with the area of the smaller part.
TIPS = 8
LEVELS = 24
NEAR = 0.25
# Boxes of pieces lie beside one another with that much between them.
BETWEEN = 1.15


def pieces_of_chart(
    chart: Chart, uv: np.ndarray, cost: np.ndarray, up: Up, whole: float, images: MirrorImages | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The piece (m,) of every triangle of a chart with map uv (n,2) that `may_come_apart`, and the edges (k,2) of the
    surface in between; one piece where others would fill a texture little better.

    whole : the area of all that goes into the texture; cost, images : see `parting.parted`; up (3,) : see `sprawls`
    """
    if len(chart.patches):
        graph = PolygonGraph.of(chart)
        if graph.pieces(np.ones(len(graph.joined), dtype=bool)).any():
            # What hangs together by filled holes alone has no narrow place.
            return np.zeros(len(chart.triangles), np.int64), np.zeros((0, 2), np.int64)
    count = _count_of_band(chart, uv, whole)
    return in_pieces(chart, uv, cost, count) if count > 1 else without_limbs(chart, uv, cost, up, images)


def may_come_apart(chart: Chart, uv: np.ndarray, up: Up, whole: float) -> bool:
    """Whether `pieces_of_chart` looks for pieces at all, which needs no costs: these may take longer than all else."""
    share = face_areas(chart.vertices, chart.triangles).sum() / whole
    return _count_of_band(chart, uv, whole) > 1 or bool(share > MUCH and sprawls(chart, uv, up, whole))


def _count_of_band(chart: Chart, uv: np.ndarray, whole: float) -> int:
    return pieces_of_band(uv, np.sqrt(whole), face_areas(chart.vertices, chart.triangles).sum() / whole)


def pieces_of_band(uv: np.ndarray, side: float, share: float = 1.0) -> int:
    """In how many pieces a chart with map uv (n,2) is to be cut across, next to a square with such a side, of which it
    fills a share: 1 where it is no band."""
    centred = uv - uv.mean(axis=0)
    width, length = np.sort(np.ptp(centred @ np.linalg.eigh(centred.T @ centred)[1], axis=0))
    narrow = COMPACT if share < SMALL else LONG_AND_NARROW
    longest = (narrow if width <= NARROW * length else LONG) * side
    return min(int(np.ceil(length / (PIECE * side))), MOST_PIECES) if length > longest else 1


def in_pieces(chart: Chart, uv: np.ndarray, cost: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The piece (m,) of every triangle where a long chart with map uv (n,2) is cut across in `count` of about the same
    length, and the edges (k,2) of the surface in between; cost (n,) : see `parted`."""
    graph = PolygonGraph.of(chart)
    middle, share = below_one(graph.places(chart, uv))[0], graph.area / graph.area.sum()
    middle -= share @ middle
    along = middle @ np.linalg.eigh(middle.T @ (share[:, None] * middle))[1][:, 1]
    cut = _across(graph, along, graph.prices(chart, cost), count)
    return graph.pieces(~cut)[graph.polygon], chart.vertex_ids[graph.ends[cut]]


def _across(graph: PolygonGraph, along: np.ndarray, price: np.ndarray, count: int) -> np.ndarray:
    """The cheapest edges (e,) bool that part polygons, which are so far (p,) along a band, in `count` pieces about as
    long as each other; price (e,) : what edges cost"""
    along = (along - along.min()) / max(np.ptp(along), 1e-300)
    cut = np.zeros(len(graph.joined), dtype=bool)
    for k in range(1, count):
        before, after = along * count < k - NEAR_CUT, along * count > k + NEAR_CUT
        if before.any() and after.any():
            # Of cuts that cost the same the one where the pieces are as long.
            off = np.abs(along[graph.joined].mean(axis=1) * count - k) / NEAR_CUT
            capacity = capacities(price * (1 + OFF * np.minimum(off, 1)))
            side = minimum_cut(graph, capacity, np.flatnonzero(before), np.flatnonzero(after))
            cut |= graph.around(side)
    return cut


def sprawls(chart: Chart, uv: np.ndarray, up: Up, whole: float) -> bool:
    """Whether the map uv (n,2) of a chart, turned so that `up` (3,) of space is up, leaves most of a square empty that
    holds all, of an area `whole`; where nobody knows what is up, turned so that a box around it is smallest."""
    return bool(whole < SPRAWLING * np.ptp(_laid([chart], [uv], up)[0], axis=0).max() ** 2)


def without_limbs(
    chart: Chart, uv: np.ndarray, cost: np.ndarray, up: Up, images: MirrorImages | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The piece (m,) of every triangle of a chart with map uv (n,2) without its limbs, and the edges (k,2) of the
    surface in between; one piece where the pieces would fill a square little better.

    cost, images : see `parting.parted`; up (3,) : see `sprawls`
    """
    body = _Body.of(chart, uv, cost, up, images)
    cut = body.across_bent_band(cost)
    if cut.any():
        return body.graph.pieces(~cut)[body.graph.polygon], chart.vertex_ids[body.graph.ends[cut]]
    whole = cut
    boxes = body.boxes(cut)
    cuts, shares = [cut], [boxes.filled]
    while len(cuts) <= MOST_CUTS and shares[-1] < FULL:
        necks = [cut | neck for neck in body.necks(cut, images)]
        if images is not None:
            # What was symmetric stays so, as long as it can.
            alike = [neck for neck in necks if body.is_own_image(neck, images)]
            necks = alike if alike or body.is_own_image(cut, images) else necks
        left = [body.boxes(neck) for neck in necks]
        # A short neck that does as much as a longer one is the better.
        best = max(range(len(necks)), key=lambda k: left[k].room / body.cost(necks[k]), default=-1)
        if best < 0 or left[best].room < LITTLE * boxes.room:
            break
        cut, boxes = necks[best], left[best]
        cuts.append(cut)
        shares.append(boxes.filled)
    # Of a star every arm but one has to go before anything is gained; then few more cuts are worth their seams.
    cut = next(cut for cut, share in zip(cuts, shares, strict=True) if LITTLE * share >= max(shares))
    if max(shares) < HOPEFUL * shares[0] or body.packed(cut) < FULLER * body.packed(whole):
        cut = whole
    return body.graph.pieces(~cut)[body.graph.polygon], chart.vertex_ids[body.graph.ends[cut]]


def _laid(charts: Sequence[Chart], maps: Sequence[np.ndarray], up: Up) -> list[np.ndarray]:
    """Maps (n_i,2) of charts turned upright, or, without an `up`, as the smallest box around each lies."""
    if up is not None:
        return turn_upright(charts, maps, [up] * len(charts))
    return [in_smallest_box(uv, chart.triangles) for chart, uv in zip(charts, maps, strict=True)]


@dataclass(frozen=True)
class _Boxes:
    """Boxes of pieces with an area `whole`: the area of all, beside one another, and the longest side."""

    whole: float
    area: float
    longest: float

    @property
    def filled(self) -> float:
        """What the pieces fill of a square around them, about."""
        return self.whole / max(self.area, self.longest**2)

    @property
    def room(self) -> float:
        """The same, but better for every box that is smaller, also where another one is as long as before."""
        return self.whole / (np.sqrt(self.area) * self.longest)


@dataclass(frozen=True)
class _Body:
    """A chart with its map uv (n,2) and its polygons, the places (p,2) of these in the map; price (e,) of the edges
    between them, whose mean is their length, and the same as capacity (e,) and as length (e,) in the map.

    known_boxes, known_sides : what was found of pieces, by their polygons
    """

    chart: Chart
    uv: np.ndarray
    up: Up
    graph: PolygonGraph
    places: np.ndarray
    price: np.ndarray
    capacity: np.ndarray
    steps: np.ndarray
    known_boxes: dict[bytes, np.ndarray] = field(default_factory=dict)
    known_sides: dict[bytes, list[np.ndarray]] = field(default_factory=dict)

    @staticmethod
    def of(chart: Chart, uv: np.ndarray, cost: np.ndarray, up: Up, images: MirrorImages | None = None) -> _Body:
        """images: see `parting.parted`; what lies in the mirror plane is dear: it is the middle of one picture."""
        graph = PolygonGraph.of(chart)
        places, price = graph.places(chart, uv), graph.prices(chart, cost)
        if images is not None:
            price = np.where(images.in_plane[chart.vertex_ids[graph.ends]].all(axis=1), HALVES * price, price)
        alike = edge_lengths(chart.vertices, graph.ends).sum() / max(price.sum(), 1e-300)
        steps = np.linalg.norm(np.diff(places[graph.joined], axis=1)[:, 0], axis=1) + 1e-300
        return _Body(chart, uv, up, graph, places, alike * price, capacities(price), steps)

    @property
    def whole(self) -> float:
        """The area of the chart."""
        return float(self.graph.area.sum())

    def cost(self, cut: np.ndarray) -> float:
        """Of a cut (e,) bool, next to the side of a square with the area of the chart, and of that square's side."""
        return 1 + float(self.price[cut].sum() / np.sqrt(self.whole))

    def is_own_image(self, cut: np.ndarray, images: MirrorImages) -> bool:
        """Whether a cut (e,) bool is its own mirror image, for the most part: the nearest image of an image may be
        another vertex."""
        ends = self.chart.vertex_ids[self.graph.ends[cut]]
        if not len(ends):
            return False
        if not images.are_exact:
            return lies_on_its_image(self.chart, self.graph.ends[cut], images)
        image = images.exact[ends]
        return bool(((image >= 0).all(axis=1) & np.isin(pair_keys(*image.T), pair_keys(*ends.T))).mean() > 0.5)

    def pieces(self, cut: np.ndarray) -> tuple[list[Chart], list[np.ndarray]]:
        """The pieces that a cut (e,) bool leaves, and their maps, upright."""
        piece = self.graph.pieces(~cut)
        return self._upright([piece == k for k in range(int(piece.max()) + 1)])

    def _upright(self, pieces: Sequence[np.ndarray]) -> tuple[list[Chart], list[np.ndarray]]:
        """Charts of pieces of polygons (p,) bool, and their maps, upright."""
        found = [part_of_chart(self.chart, here[self.graph.polygon]) for here in pieces]
        charts = [part for part, _ in found]
        return charts, _laid(charts, [self.uv[used] for _, used in found], self.up)

    def _box(self, here: np.ndarray) -> np.ndarray:
        """The sides (2,) of the box of a piece of polygons (p,) bool: few of those that a cut leaves are new."""
        piece = np.packbits(here).tobytes()
        if piece not in self.known_boxes:
            self.known_boxes[piece] = np.ptp(self._upright([here])[1][0], axis=0)
        return self.known_boxes[piece]

    def boxes(self, cut: np.ndarray) -> _Boxes:
        """The boxes of all pieces that a cut (e,) bool leaves."""
        piece = self.graph.pieces(~cut)
        sides = np.array([self._box(piece == k) for k in range(int(piece.max()) + 1)])
        between = BETWEEN if len(sides) > 1 else 1.0
        return _Boxes(self.whole, between * float(sides.prod(axis=1).sum()), float(sides.max()))

    def packed(self, cut: np.ndarray) -> float:
        """What the pieces that a cut (e,) bool leaves fill of a square when they are packed."""
        charts, maps = self.pieces(cut)
        return drain(pack(maps, [chart.triangles for chart in charts], roughly=True)).coverage

    def across_bent_band(self, cost: np.ndarray) -> np.ndarray:
        """Edges (e,) bool across a chart in pieces about as long as each other, if it is a band that bends: as wide
        everywhere, and longer than a square with its area; cost (n,) : see `parting.parted`."""
        nothing = np.zeros(len(self.steps), dtype=bool)
        at_vertex = self._from_end_to_end()
        along = self.graph.places(self.chart, at_vertex[:, None])[:, 0]
        order = np.argsort(along, kind="stable")
        within = np.empty(len(order))
        within[order] = np.cumsum(self.graph.area[order]) / self.whole
        begin, end = np.interp([ENDS, 1 - ENDS], within[order], along[order])
        level = np.linspace(begin, end, STRETCHES + 1)
        # Where a band is wider, what is harmonic rises less, and every stretch of it has more area for that, too;
        # between both ends it conducts as much as it is wide, over its length.
        of_corners = at_vertex[self.chart.triangles]
        low, high = of_corners.min(axis=1), of_corners.max(axis=1)
        share = np.clip((level[:, None] - low) / np.maximum(high - low, 1e-300), 0, 1)
        width = np.sqrt(np.diff(share @ face_areas(self.chart.vertices, self.chart.triangles)))
        flow = float(at_vertex @ (cotangent_laplacian(self.uv, self.chart.disk) @ at_vertex))
        long = 1 / np.sqrt(max((1 - ENDS) * flow, 1e-300))
        if width.max() > AS_WIDE * width.min() or long <= LONG_AND_NARROW:
            return nothing
        price = self.graph.prices(self.chart, cost)
        cut = _across(self.graph, within, price, min(int(np.ceil(long / PIECE)), MOST_PIECES))
        return cut if self.packed(cut) >= FULLER * self.packed(nothing) else nothing

    def _from_end_to_end(self) -> np.ndarray:
        """How far vertices (n,) are from one end to the other: harmonic between those around two tips as far from each
        other as can be."""
        every = np.ones(len(self.graph.area), dtype=bool)
        far = next(self._from_tips(every, np.ones(len(self.steps), dtype=bool)))
        other = dijkstra(self.graph.matrix(self.steps), indices=int(np.argmax(far)))
        ends = list[np.ndarray]()
        for distance in (far, other):
            order = np.argsort(distance, kind="stable")
            end = order[: 1 + np.searchsorted(np.cumsum(self.graph.area[order]), ENDS / 2 * self.whole)]
            ends.append(np.unique(self.chart.triangles[np.isin(self.graph.polygon, end)]))
        # Across holes that are filled, too: the vertices in there hang on nothing else.
        return harmonic_between(self.uv, self.chart.disk, *ends)

    def necks(self, cut: np.ndarray, images: MirrorImages | None) -> Iterator[np.ndarray]:
        """Edges (e,) bool across necks of the pieces that a cut (e,) bool leaves; images: see `parting.parted`."""
        piece = self.graph.pieces(~cut)
        size = np.bincount(piece, self.graph.area)
        for k in np.flatnonzero(size > 2 * LEAST_LIMB * self.whole):
            here = piece == k
            inner = ~cut & here[self.graph.joined[:, 0]]
            for side in self._sides(here, inner):
                neck = inner & (side[self.graph.joined[:, 0]] != side[self.graph.joined[:, 1]])
                smaller = min(float(self.graph.area[side].sum()), float(self.graph.area[here & ~side].sum()))
                if self.price[neck].sum() > NECK * np.sqrt(smaller):
                    continue
                both = neck
                if images is not None:
                    room = np.where(cut, 1, self.capacity)
                    both = with_images(self.chart, self.graph, neck, images, [side], room)
                parts = np.bincount(self.graph.pieces(~(cut | both)), self.graph.area)
                if parts.min() >= LEAST_PART * self.whole:
                    yield both

    def _sides(self, here: np.ndarray, inner: np.ndarray) -> list[np.ndarray]:
        """The sides (p,) bool of the narrowest cuts through a piece of polygons (p,) bool, joined by edges `inner` (e,)
        bool, one for every tip that has one."""
        piece = np.packbits(here).tobytes()
        if piece not in self.known_sides:
            found = (self._narrowest(here, inner, far) for far in self._from_tips(here, inner))
            self.known_sides[piece] = [side for side in found if side is not None]
        return self.known_sides[piece]

    def _from_tips(self, here: np.ndarray, inner: np.ndarray) -> Iterator[np.ndarray]:
        """Distances (p,) in the map of polygons `here` (p,) bool, joined by edges `inner` (e,) bool, from the tips of
        what they are: each is as far from those before as can be."""
        steps = self.graph.matrix(np.where(inner, self.steps, 0.0))
        steps.eliminate_zeros()
        centre = self.graph.area[here] @ self.places[here] / self.graph.area[here].sum()
        middle = np.argmin(np.where(here, np.linalg.norm(self.places - centre, axis=1), np.inf))
        nearest = dijkstra(steps, indices=middle)
        for k in range(TIPS):
            tip = int(np.argmax(np.where(here & np.isfinite(nearest), nearest, -1.0)))
            far = dijkstra(steps, indices=tip)
            nearest = far if k == 0 else np.minimum(nearest, far)
            yield far

    def _narrowest(self, here: np.ndarray, inner: np.ndarray, far: np.ndarray) -> np.ndarray | None:
        """The side (p,) bool of the polygons `here` (p,) bool of the shortest cut for what it takes off that is about
        as far (p,) everywhere from a tip; None where there is none."""
        area = np.where(here, self.graph.area, 0.0)
        order = np.argsort(np.where(here, far, np.inf), kind="stable")[: int(here.sum())]
        within, whole = np.cumsum(area[order]), float(area.sum())
        off = np.linspace(LEAST_LIMB * self.whole, whole - LEAST_LIMB * self.whole, LEVELS)
        level = np.interp(off, within, far[order])
        low, high = np.sort(far[self.graph.joined[inner]], axis=1).T
        across = ((low <= level[:, None]) & (high > level[:, None])) @ self.price[inner]
        smaller = np.sqrt(np.minimum(off, whole - off))
        best = int(np.argmin(across / smaller))
        near = here & (far <= level[best] - NEAR * smaller[best])
        beyond = here & (far >= level[best] + NEAR * smaller[best])
        if not near.any() or not beyond.any():
            return None
        side = minimum_cut(self.graph, np.where(inner, self.capacity, 1), np.flatnonzero(near), np.flatnonzero(beyond))
        return side & here
