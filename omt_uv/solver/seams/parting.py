"""Part a chart where its map would lie on itself: what is in each other's way becomes islands of their own.

A map that may cross itself says what the seams alone are worth. Where it keeps a bound that its like without overlap
misses, further seams help little, since room is missing; the shortest cut between the parts that cover each other, by
its cost, is a minimum cut of the polygons (Boykov, Kolmogorov 2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..analysis.symmetry_plane import MirrorImages
from ..cutting.crease_sides import COVERED, SHARED
from ..cutting.developable_nets import HARD
from ..linalg.minimum_cut import capacities, least_cut
from ..maps.development import developed
from ..maps.overlap import cover_pairs, covered_share
from ..mesh.charts import Chart
from ..mesh.geometry import cross3, edge_lengths, face_areas, unit
from ..mesh.topology import boundary_edges, graph_components, halfedges, pair_keys, pair_up, paired
from .growth import ranks
from .path_graph import path_to

# Points of a triangle that are looked at, as shares of its corners: its middle, and between that and each corner.
POINTS = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / np.array([[3], [6], [6], [6]])
# Of charts of few triangles so many in each are, at least, in rows: slivers can cover little, and be in the way.
FEW = 1000
ROWS = 12
# Parts that cover less than this share of the chart between them are left to lie beside each other, but for those that
# cover most.
LEAST_COVER = 3e-3
# What is taken off has this share of the chart at least.
LEAST_PART = 0.03
# Slits at once at most, the first time: small ones far from a seam cost more than they are worth.
MOST_SLITS = 4
# What has less than this share of what is to be slit comes last, however near it is.
LITTLE = 0.05
# Each half of a chart has this share of it at least.
LEAST_HALF = 0.25
# Pairs of parts that are cut from one another at most.
MOST_CUTS = 12
# The image of a part whose vertices have none ends within this share of the side of a square with its area of where
# that of its outline lies.
NEAR_IMAGE = 0.2
# A cut lies on its own image within so many of its edges.
BESIDE = 2.0
# Rounds in which crumbs between a cut and its mirror image join what is beside them.
MOST_CRUMBS = 3
# Polygons whose normals turn by less, in radians, are of one side, which is flat if they all do about.
TURNED = np.radians(5)
FLAT = 0.999
# Sides of fewer edges unroll with what is beside them; bodies of few polygons have no others.
LEAST_OUTLINE = 6
# Flat sides of less than this share of the chart stay with what is beside them; where the others have less than this
# share of it, it is no body of flat sides.
LEAST_SIDE = 0.05
MOSTLY = 0.4
# An outline is sharp with this share of it.
MOSTLY_SHARP = 0.5


@dataclass(frozen=True)
class PolygonGraph:
    """Polygons of a chart: of each triangle (m,), their areas (p,), and the edges between two of them (e,2), with the
    vertices (e,2) of these."""

    polygon: np.ndarray
    area: np.ndarray
    joined: np.ndarray
    ends: np.ndarray

    @staticmethod
    def of(chart: Chart, glued: bool = False) -> PolygonGraph:
        """The polygons of a chart; glued: joined across its seams, too, the ends being vertices of the surface."""
        triangles = chart.vertex_ids[chart.triangles] if glued else chart.triangles
        return PolygonGraph.of_triangles(triangles, chart.faces, face_areas(chart.vertices, chart.triangles))

    @staticmethod
    def of_triangles(triangles: np.ndarray, owner: np.ndarray, area: np.ndarray) -> PolygonGraph:
        """The polygons that triangles (m,3) with areas (m,) are of, by their numbers (m,)."""
        _, polygon = np.unique(owner, return_inverse=True)
        polygon = polygon.ravel()
        tail, head = halfedges(triangles)
        one, other = pair_up(pair_keys(tail, head))
        joined = polygon[np.stack([one, other], axis=1) // 3]
        between = joined[:, 0] != joined[:, 1]
        ends = np.stack([tail[one], head[one]], axis=1)
        return PolygonGraph(polygon, np.bincount(polygon, area), joined[between], ends[between])

    def pieces(self, kept: np.ndarray) -> np.ndarray:
        """The piece (p,) that each polygon is in, joined by the edges that are kept (e,) bool."""
        return graph_components(self.joined[kept, 0], self.joined[kept, 1], len(self.area))[1]

    def around(self, side: np.ndarray) -> np.ndarray:
        """The edges (e,) bool between polygons on a side (p,) bool and others."""
        return side[self.joined[:, 0]] != side[self.joined[:, 1]]

    def places(self, chart: Chart, uv: np.ndarray) -> np.ndarray:
        """The middle (p,k) of the triangles of each polygon in a map uv (n,2) of the chart, or of values (n,k)."""
        middle = np.stack([np.bincount(self.polygon, x) for x in uv[chart.triangles].mean(axis=1).T], axis=1)
        return middle / np.bincount(self.polygon)[:, None]

    def prices(self, chart: Chart, cost: np.ndarray) -> np.ndarray:
        """What cutting each edge (e,) costs; cost (n,) : at the vertices of the chart, per length."""
        return cost[self.ends].mean(axis=1) * edge_lengths(chart.vertices, self.ends)

    def smaller(self, side: np.ndarray) -> float:
        """The area of a side (p,) bool or of all else, whichever is less."""
        return min(float(self.area[side].sum()), float(self.area[~side].sum()))

    def steps(self, chart: Chart) -> csr_matrix:
        """The lengths of the edges as a matrix (p,p), none of them 0."""
        return self.matrix(edge_lengths(chart.vertices, self.ends) + 1e-300)

    def matrix(self, weight: np.ndarray) -> csr_matrix:
        """A weight (e,) > 0 for each edge as a matrix (p,p); the sum where two polygons share several."""
        rows, columns = np.concatenate([self.joined, self.joined[:, ::-1]]).T
        return csr_matrix((np.tile(weight, 2), (rows, columns)), shape=(len(self.area),) * 2)


def parted(chart: Chart, uv: np.ndarray, cost: np.ndarray, images: MirrorImages | None = None) -> np.ndarray:
    """Edges (k,2) of the surface along which a chart comes apart where its map uv (n,2) lies on itself.

    cost (n,): of a cut through its vertices, per length; images: of the vertices of the surface, which the cuts then
    have, too, as near as can be. No edges where it does not, or is in one piece all the same.
    """
    graph = PolygonGraph.of(chart)
    pairs = _covering(chart, uv, graph)
    capacity = capacities(graph.prices(chart, cost))
    steps = graph.steps(chart)
    cut, sides = np.zeros(len(graph.joined), dtype=bool), list[np.ndarray]()
    for one, other in pairs[:MOST_CUTS]:
        part = graph.pieces(~cut)
        if part[one[0]] == part[other[0]]:
            side = minimum_cut(graph, capacity, *_enlarged(graph, steps, one, other))
            cut |= graph.around(side)
            sides.append(side)
    if images is not None:
        cut = with_images(chart, graph, cut, images, sides, capacity)
    return chart.vertex_ids[graph.ends[cut]]


def halves(chart: Chart, cost: np.ndarray) -> np.ndarray:
    """Edges (k,2) of the surface along which what a chart covers comes apart in two, between what lies farthest from
    one another, across its seams, too.

    cost (v,): of a cut through the vertices of the surface, per length. No edges where it has one polygon.
    """
    graph, positions = PolygonGraph.of(chart, glued=True), _of_surface(chart)
    length = edge_lengths(positions, graph.ends)
    steps, ends = graph.matrix(length + 1e-300), [0]
    for _ in range(2):
        far = dijkstra(steps, indices=ends[-1])
        ends.append(int(np.where(np.isfinite(far), far, -1).argmax()))
    if ends[1] == ends[2]:
        return np.zeros((0, 2), np.int64)
    grown = _enlarged(graph, steps, np.array(ends[1:2]), np.array(ends[2:]), LEAST_HALF)
    side = minimum_cut(graph, capacities(cost[graph.ends].mean(axis=1) * length), *grown)
    return graph.ends[graph.around(side)]


def with_images(
    chart: Chart,
    graph: PolygonGraph,
    cut: np.ndarray,
    images: MirrorImages,
    sides: list[np.ndarray],
    capacity: np.ndarray,
) -> np.ndarray:
    """The cut (e,) bool around `sides` (p,) bool with its mirror image, if that is one, and crumbs between both can be
    left out; else as it is. Where vertices have no exact images, that of a side ends where it is cheap nearby."""
    parts, ends = int(graph.pieces(~cut).max()), chart.vertex_ids[graph.ends]
    image = images.exact[ends[cut]]
    if images.are_exact and len(image) and (image >= 0).all():
        mine, theirs = pair_keys(*ends.T), pair_keys(*image.T)
        alike = np.isin(mine, theirs)
        if np.isin(theirs, mine).all():
            both = _without_crumbs(chart, graph, cut, cut | alike)
            if graph.pieces(~both).max() > parts or np.array_equal(alike, cut):
                return both
    room = np.where(cut, 1, capacity)
    there = [_image_of(chart, graph, side, images.nearest, room) for side in sides]
    both = np.any([cut, *(graph.around(side) for side in there)], axis=0)
    both = _without_crumbs(chart, graph, cut, both)
    # An image takes off as much as what it is of, or it is none.
    return both if parts < graph.pieces(~both).max() <= 2 * parts else cut


def _image_of(
    chart: Chart, graph: PolygonGraph, side: np.ndarray, nearest: np.ndarray, capacity: np.ndarray
) -> np.ndarray:
    """The polygons (p,) bool that are about the mirror image of those of a side (p,) bool, within the cheapest cut near
    its outline; itself where that is its own image, about. nearest (n,): to the images of vertices of the surface."""
    count, corner = np.bincount(graph.polygon, minlength=len(side)), chart.vertex_ids[chart.triangles]
    inside = np.bincount(corner.ravel(), np.repeat(side[graph.polygon], 3).astype(float), len(nearest))
    inside = inside / np.maximum(np.bincount(corner.ravel(), minlength=len(nearest)), 1)
    there = np.bincount(graph.polygon, inside[nearest[corner]].mean(axis=1), len(side)) > 0.5 * count
    other = float(graph.area[there != side].sum())
    whole = float(graph.area.sum())
    if min(other, whole - other) < min(LEAST_PART * whole, graph.smaller(side)) or not graph.around(there).any():
        return side
    beside = np.unique(graph.joined[graph.around(there)])
    far = dijkstra(graph.steps(chart), indices=beside, min_only=True)
    inner = far > NEAR_IMAGE * np.sqrt(graph.smaller(there))
    if not (inner & there).any() or not (inner & ~there).any():
        return side
    return minimum_cut(graph, capacity, np.flatnonzero(inner & there), np.flatnonzero(inner & ~there))


def lies_on_its_image(chart: Chart, ends: np.ndarray, images: MirrorImages) -> bool:
    """Whether most vertices of a cut along edges of a chart (e,2) have images beside it, where these are not exact."""
    cut = np.unique(ends)
    there = _images_in(chart, images.nearest)[cut]
    far = cKDTree(chart.vertices[cut]).query(chart.vertices[there])[0]
    return bool(((there >= 0) & (far <= BESIDE * edge_lengths(chart.vertices, ends).mean())).mean() > 0.5)


def _without_crumbs(chart: Chart, graph: PolygonGraph, cut: np.ndarray, both: np.ndarray) -> np.ndarray:
    """A cut with its image `both` (e,) bool, without crumbs between them; `cut` (e,) bool where some stay."""
    length, both = edge_lengths(chart.vertices, graph.ends), both.copy()
    # What comes off by itself, a horn, is none, nor is its image.
    smallest = np.bincount(graph.pieces(~cut), graph.area).min()
    least = min(LEAST_PART * graph.area.sum(), smallest) / 2
    for _ in range(MOST_CRUMBS):
        piece = graph.pieces(~both)
        crumb = np.bincount(piece, graph.area) < least
        if not crumb.any():
            return both
        # Each joins the piece that it has most of an outline with.
        one, other = np.concatenate([piece[graph.joined[both]], piece[graph.joined[both]][:, ::-1]]).T
        shared = csr_matrix((np.tile(length[both], 2), (one, other)), shape=(len(crumb),) * 2)
        shared.sum_duplicates()
        joins = np.asarray(shared.argmax(axis=1)).ravel()
        one, other = piece[graph.joined].T
        both &= ~((crumb[one] & (joins[one] == other)) | (crumb[other] & (joins[other] == one)))
    return cut


def flat_sides(chart: Chart, sharp: bool = False) -> np.ndarray:
    """Edges (k,2) of the surface around the large flat sides of a chart; none where these are not most of it.

    What is between them are bands, as the teeth of a gear, that unroll: only flat sides with much of an outline hold
    them back. sharp : only those whose outline is so for the most part
    """
    graph = PolygonGraph.of(chart, glued=True)
    corners = chart.vertices[chart.triangles]
    vector = 0.5 * cross3(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    count = len(graph.area)
    whole = np.stack([np.bincount(graph.polygon, x, count) for x in vector.T], axis=1)
    normal = unit(whole)
    cosine = np.einsum("ed,ed->e", *normal[graph.joined.T])
    near = cosine > np.cos(TURNED)
    side = graph.pieces(near)
    area = np.bincount(side, graph.area)
    size = np.linalg.norm(np.stack([np.bincount(side, x) for x in whole.T], axis=1), axis=1)
    one, other = side[graph.joined.T]
    outline = np.bincount(np.concatenate([one[one != other], other[one != other]]), minlength=len(area))
    flat = (size >= FLAT * area) & (area >= LEAST_SIDE * graph.area.sum()) & (outline >= LEAST_OUTLINE)
    if area[flat].sum() < MOSTLY * graph.area.sum():
        return np.zeros((0, 2), np.int64)
    unfolded = _unfolded(chart, graph, side, flat)
    if sharp:
        in_sharp = _in_sharp_outlines(chart, graph, near | unfolded, cosine < np.cos(HARD))
        flat &= np.bincount(side, in_sharp, len(area)) > 0
        if area[flat].sum() < MOSTLY * graph.area.sum():
            return np.zeros((0, 2), np.int64)
    return graph.ends[(one != other) & (flat[one] | flat[other]) & ~unfolded]


def _in_sharp_outlines(chart: Chart, graph: PolygonGraph, kept: np.ndarray, sharp: np.ndarray) -> np.ndarray:
    """Polygons (p,) bool in pieces joined across edges that are kept (e,) bool, where most of the outline is of sharp
    edges (e,) bool."""
    piece = graph.pieces(kept)
    pair = piece[graph.joined]
    length = np.where(pair[:, 0] != pair[:, 1], edge_lengths(_of_surface(chart), graph.ends), 0.0)
    outline, hard = (np.bincount(pair.ravel(), np.repeat(x, 2), len(piece)) for x in (length, length * sharp))
    return (hard > MOSTLY_SHARP * outline)[piece]


def _of_surface(chart: Chart) -> np.ndarray:
    """Positions (n,3) of the vertices of the surface that are in a chart, zeros for others."""
    inner, positions = chart.vertex_ids >= 0, np.zeros((int(chart.vertex_ids.max()) + 1, 3))
    positions[chart.vertex_ids[inner]] = chart.vertices[inner]
    return positions


def _unfolded(chart: Chart, graph: PolygonGraph, side: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """Edges (e,) bool in the lines across which sides (p,) of polygons that are flat (s,) bool unfold beside one
    another, as those of a blade do; the longest lines first."""
    positions = _of_surface(chart)
    pair = np.sort(side[graph.joined], axis=1)
    length = np.where(pair[:, 0] != pair[:, 1], edge_lengths(positions, graph.ends), 0.0)
    outline = np.bincount(pair.ravel(), np.repeat(length, 2), len(flat))
    line = np.flatnonzero((length > 0) & flat[pair].all(axis=1))
    keys, of_line = np.unique(pair_keys(*pair[line].T), return_inverse=True)
    shared, group = np.bincount(of_line.ravel(), length[line], len(keys)), np.arange(len(flat))
    corners, of_corner = chart.vertex_ids[chart.triangles], side[graph.polygon]
    kept, unfolded = np.zeros((0, 2), np.int64), np.zeros(len(pair), dtype=bool)
    for k in np.argsort(-shared, kind="stable"):
        sides = paired(keys[k : k + 1])[0]
        one, other = group[sides]
        if one == other or shared[k] < SHARED * outline[sides].min():
            continue
        # Every side has vertices of its own, but for those on the lines across which it stays with another.
        edges = line[of_line.ravel() == k]
        trial = np.concatenate([kept, sides * len(positions) + np.unique(graph.ends[edges])[:, None]])
        rows = np.isin(group[of_corner], (one, other))
        if _lies_flat(positions, corners[rows], of_corner[rows], trial):
            kept, group, unfolded[edges] = trial, np.where(group == other, one, group), True
    return unfolded


def _lies_flat(positions: np.ndarray, triangles: np.ndarray, side: np.ndarray, same: np.ndarray) -> bool:
    """Whether flat sides (m,) of triangles (m,3) unfold beside one another, whose vertices side * n + vertex are the
    same in pairs (k,2) and others are not."""
    nodes, index = np.unique(side[:, None] * len(positions) + triangles, return_inverse=True)
    here = np.isin(same, nodes).all(axis=1)
    one, other = np.searchsorted(nodes, same[here]).T
    label = graph_components(one, other, len(nodes))[1]
    first = np.unique(label, return_index=True)[1]
    faces = label[index.reshape(-1, 3)]
    flat, _ = developed(positions[nodes[first] % len(positions)], faces)
    return covered_share(flat, faces) <= COVERED


def slits(
    chart: Chart,
    steep: np.ndarray,
    least: float,
    cost: np.ndarray,
    barred: np.ndarray,
    images: MirrorImages | None = None,
    rounds: int = 1,
) -> np.ndarray:
    """Edges (k,2) of the surface from the boundary of a chart into what shears too much, first into the parts that are
    large for the length of their slit.

    steep (m,) bool : triangles that do; least : area of what is to be slit at least; barred (n,) bool : vertices that
    no slit passes through, unless there is not as much to be slit elsewhere; cost, images : see `parted`; rounds :
    which time it is
    """
    graph = PolygonGraph.of(chart)
    bad, free = np.zeros(len(graph.area), dtype=bool), ~barred
    bad[graph.polygon[steep & free[chart.triangles].all(axis=1)]] = True
    if graph.area[bad].sum() < least:
        free[:] = bad[graph.polygon[steep]] = True
    piece = graph.pieces(bad[graph.joined].all(axis=1))
    size = np.bincount(piece, np.where(bad, graph.area, 0.0))
    open_ = free[graph.ends].all(axis=1)
    n, ends, price = len(chart.vertices), graph.ends[open_], graph.prices(chart, cost)[open_] + 1e-300
    ways = csr_matrix((np.tile(price, 2), np.concatenate([ends, ends[:, ::-1]]).T), shape=(n, n))
    start, found = np.unique(boundary_edges(chart.triangles)), []
    reach = dijkstra(ways, indices=start, min_only=True)[chart.triangles[steep]]
    length = np.full(len(size), 1e-300)
    np.maximum.at(length, piece[graph.polygon[steep]], np.where(np.isfinite(reach), reach, 0.0).max(axis=1))
    worth = np.where(size >= LITTLE * least, size / length, 0.0)
    order = np.lexsort((-ranks(size), -ranks(worth)))
    enough = int(np.searchsorted(np.cumsum(size[order]), least)) + 1
    # One more every time, at least: the same slits would be in vain again.
    chosen = order[: min(max(enough, rounds), rounds * MOST_SLITS)]
    known, image_here = pair_keys(*ends.T), _images_in(chart, None if images is None else images.exact)
    for k in chosen[bad[np.unique(piece, return_index=True)[1]][chosen]]:
        around = np.unique(chart.triangles[steep & (piece[graph.polygon] == k)])
        far, before, _ = dijkstra(ways, indices=start, min_only=True, return_predecessors=True)
        end = around[np.argmax(np.where(np.isfinite(far[around]), far[around], 0.0))]
        path = path_to(before, int(end))
        edges = np.stack([path[:-1], path[1:]], axis=1)
        there = image_here[edges]
        apart = len(np.intersect1d(path, there)) == 0
        if len(edges) and apart and np.isin(pair_keys(*there.T), known).all():
            edges = np.concatenate([edges, there])
        found.append(edges)
        start = np.union1d(start, edges)
    return chart.vertex_ids[np.concatenate(found)] if found else np.zeros((0, 2), np.int64)


def _images_in(chart: Chart, image: np.ndarray | None) -> np.ndarray:
    """The mirror image (n,) of every vertex of a chart in it, -1 where there is none."""
    if image is None:
        return np.full(len(chart.vertices), -1)
    at = np.full(len(image), -1)
    inner = chart.vertex_ids >= 0
    at[chart.vertex_ids[inner]] = np.flatnonzero(inner)
    there = np.where(inner, image[chart.vertex_ids], -1)
    return np.where(there >= 0, at[there], -1)


def _covering(chart: Chart, uv: np.ndarray, graph: PolygonGraph) -> list[tuple[np.ndarray, np.ndarray]]:
    """Polygons (a,) and (b,) of pieces that cover each other, those first that do so most."""
    corners = uv[chart.triangles]
    points = POINTS if len(corners) > FEW else _in_rows(ROWS)
    point, over = cover_pairs(corners, np.einsum("kc,mcd->mkd", points, corners).reshape(-1, 2))
    below = graph.polygon[point // len(points)]
    above = graph.polygon[over]
    share = face_areas(chart.vertices, chart.triangles)[point // len(points)] / (len(points) * graph.area.sum())
    share, below, above = (x[below != above] for x in (share, below, above))
    covered = np.zeros(len(graph.area), dtype=bool)
    covered[below] = covered[above] = True
    piece = graph.pieces(covered[graph.joined].all(axis=1))
    a, b = np.sort(np.stack([piece[below], piece[above]]), axis=0)
    key, index = np.unique(pair_keys(a, b), return_inverse=True)
    # Every pair is seen from both sides.
    total = np.bincount(index.ravel(), share, len(key)) / 2
    found = paired(key)
    apart = found[:, 0] != found[:, 1]
    large = apart & (total >= min(LEAST_COVER, total.max(where=apart, initial=0.0)))
    order = np.argsort(-total[large], kind="stable")
    members = [np.flatnonzero(covered & (piece == k)) for k in found[large][order].ravel()]
    return list(zip(members[::2], members[1::2], strict=True))


def _in_rows(rows: int) -> np.ndarray:
    """Points (k,3) of a triangle, as shares of its corners, in so many rows."""
    a, b = np.divmod(np.arange(rows**2), rows)
    inside = a + b < rows
    return np.stack([a + 1 / 3, b + 1 / 3, rows - a - b - 2 / 3], axis=1)[inside] / rows


def _enlarged(
    graph: PolygonGraph, steps: csr_matrix, one: np.ndarray, other: np.ndarray, share: float = LEAST_PART
) -> tuple[np.ndarray, np.ndarray]:
    """Both pieces with what lies around them, with that share of the area: as large as an island should be at least."""
    far = np.stack([dijkstra(steps, indices=piece, min_only=True) for piece in (one, other)])
    nearer = np.argmin(far, axis=0)
    grown = []
    for k, piece in enumerate((one, other)):
        around = np.flatnonzero((nearer == k) & np.isfinite(far[k]))
        around = around[np.argsort(far[k][around], kind="stable")]
        enough = np.cumsum(graph.area[around]) <= share * graph.area.sum()
        grown.append(np.union1d(piece, around[enough]))
    return grown[0], np.setdiff1d(grown[1], grown[0])


def minimum_cut(graph: PolygonGraph, capacity: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Which polygons (p,) bool are on the side of `one` (a,) of the cheapest cut between these and `other` (b,)."""
    return least_cut(graph.joined, capacity, len(graph.area), one, other)
