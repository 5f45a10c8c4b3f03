"""Cut a component that is its own mirror image into a disk that is one, too.

Such a disk is two halves joined along one line of edges in the plane: all other edges in the plane have to be cut, and
each half, open along its cuts, is a disk. So the cuts of a half are a tree that joins its boundaries and the tips, and
meets the line that stays at its ends alone: what leaves the plane off the line does not come back to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..mesh.mirror import find_mirror
from ..mesh.topology import graph_components, halfedges, pair_keys
from .component import CutComponent
from .cut_graph import MOST_STRETCHES, SWEEPS, is_disk, stretches
from .protrusions import disk_spread, edge_distance, log_scale, outline_spread, peak, spread

# Parts of the line that are tried uncut, at most.
MOST_PARTS = 8
# Tips on the line count so many times as much; cuts that spread a map so many times as much do as well.
ABOUT = 1.1
# Predicted spreads of maps onto a disk tell two cuts apart where one is more than so many times the other.
DOUBTFUL = 2.0


@dataclass(frozen=True)
class SymmetricHalf:
    """One half of a component in its mirror plane, with the plane; its edges are those of the component that are there.

    Attributes
    ----------
    component : whose edges cost what they and their images do on average
    image (n,), side (n,) bool : mirror image of every vertex; whether it is in the half
    edges (k,) : of the component that can be cut, in the half or across the plane; image_edge (k,) : their images
    ends (k,2) : of the edges, twice the same where they are across the plane, across (k,) bool
    line (k,) bool, on_line (n,) bool : edges in the plane that stay uncut, all but some beside an end; vertices there
    line_ends (n,) bool : the vertices of boundaries at which the line ends; none where it is closed
    held (k,) bool : the other edges in the plane, which every cut takes
    boundary (b,2) : edges of the boundary of the component, in the half, by their ends
    """

    component: CutComponent
    image: np.ndarray
    side: np.ndarray
    edges: np.ndarray
    image_edge: np.ndarray
    ends: np.ndarray
    across: np.ndarray
    line: np.ndarray
    on_line: np.ndarray
    line_ends: np.ndarray
    held: np.ndarray
    boundary: np.ndarray

    def whole(self, chosen: np.ndarray) -> np.ndarray:
        """Edges (e,) bool of the component: those chosen (k,) bool of the half and their images."""
        found = np.zeros(len(self.component.pair), dtype=bool)
        found[self.edges[chosen]] = found[self.image_edge[chosen]] = True
        return found

    def groups(self, chosen: np.ndarray, tips: np.ndarray) -> np.ndarray:
        """Which vertices (n,) are joined by the boundary and the edges chosen (k,) bool; tips (t,) are there, too, all
        others -1. Number 0 is what the line ends at, where anything is."""
        ends = np.concatenate([self.boundary, self.ends[chosen | self.held]])
        label = graph_components(ends[:, 0], ends[:, 1], len(self.image))[1]
        there = np.zeros(len(label), dtype=bool)
        there[ends] = True
        # A line that is closed ends where it is cut first.
        begun = self.on_line.copy()
        begun[self.ends[chosen & self.across]] = True
        roots = label[self.line_ends] if self.line_ends.any() else label[there & begun][:1]
        there[tips] = True
        label = np.where(np.isin(label, roots), -1, label) + 1
        label[~there] = -1
        return label

    def joined(self, chosen: np.ndarray, tips: np.ndarray) -> np.ndarray | None:
        """The edges chosen (k,) bool and cheap paths that join all boundaries and tips (t,) to one tree; None where
        there are none."""
        group, chosen, n = self.groups(chosen, tips), chosen.copy(), len(self.image)
        matrix = self._onwards()
        place = np.flatnonzero(group >= 0)
        while (group[place] > 0).any():
            start = np.flatnonzero(group == 0)
            # A closed surface is cut from anywhere in the plane.
            start = start if len(start) else np.array([n])
            distance, before, _ = dijkstra(matrix, indices=start, min_only=True, return_predecessors=True)
            left = place[group[place] > 0]
            nearest = int(left[np.argmin(distance[left])])
            if not np.isfinite(distance[nearest]):
                return None
            path = np.array(list(_backwards(before, nearest)))
            chosen |= np.isin(pair_keys(*self.ends.T), pair_keys(path[:-1], path[1:]))
            if path[-1] == n:
                path = path[:-1]
                first = self.across & (self.ends[:, 0] == path[-1])
                chosen |= first & ~self.on_line[path[-1]]
            group[group == group[nearest]] = 0
            group[path] = 0
            place = np.union1d(place, path)
        return chosen

    def peak(self, scale: np.ndarray, chosen: np.ndarray, tips: np.ndarray) -> int:
        """The vertex of the half that is worth a cut most, by a scale (n,) and how far it is from the edges chosen (k,)
        bool and the tips (t,) that there are, of those to which a path may lead."""
        start = np.zeros(len(self.image) + 1, dtype=bool)
        start[self.boundary] = start[self.ends[chosen | self.held]] = start[tips] = True
        onwards = dijkstra(self._onwards(), indices=np.flatnonzero(start), min_only=True)[:-1]
        far = edge_distance(self.component, np.flatnonzero(start | np.append(start[self.image], False)))
        return self.best(np.where(np.isfinite(onwards), scale * far * self.component.tip_factor(), 0))

    def best(self, worth: np.ndarray) -> int:
        """The vertex of the half that is worth (n,) most; of about as many one on the line, which needs one cut."""
        return peak(np.where(self.side, worth, 0) * np.where(self.on_line, ABOUT, 1.0))

    def _onwards(self) -> csr_matrix:
        """Costs (n+1,n+1) of the edges of the half, and of their images, in the directions in which a path may go that
        comes from the boundary, not onto the line; and, from vertex n, of crossing the plane anywhere."""
        n, cost = len(self.image), self.component.cost[self.edges]
        inner = ~self.across
        tail, head = np.concatenate([self.ends[inner], self.ends[inner][:, ::-1]]).T
        both = np.tile(np.where(self.line, cost, 2 * cost)[inner], 2)
        allowed = np.tile(self.line[inner], 2) | ~self.on_line[head]
        at = np.flatnonzero(self.on_line)
        crossing = self.across & ~self.on_line[self.ends[:, 0]]
        # A sparse graph takes a zero for no edge.
        least = 1e-9 * float(cost.min())
        tail = np.concatenate([tail[allowed], np.full(len(at) + crossing.sum(), n)])
        head = np.concatenate([head[allowed], at, self.ends[crossing, 0]])
        both = np.concatenate([both[allowed], np.full(len(at), least), cost[crossing]])
        return csr_matrix((both, (tail, head)), shape=(n + 1, n + 1))

    def shortened(self, chosen: np.ndarray, tips: np.ndarray, sweeps: int = SWEEPS) -> np.ndarray:
        """Edges chosen (k,) bool with every stretch between two branchings replaced by the cheapest paths that do the
        same."""
        of = np.full(len(self.component.pair), -1)
        of[self.edges] = np.arange(len(self.edges))
        for _ in range(sweeps):
            before = self.cost(chosen)
            for stretch in stretches(self.component, self.whole(chosen), self.both(tips))[:MOST_STRETCHES]:
                own = of[stretch[of[stretch] >= 0]]
                rest = chosen.copy()
                rest[own] = False
                if not len(own) or not chosen[own].all():
                    continue
                again = self.joined(rest, tips)
                if again is not None and self.cost(again) < self.cost(chosen) * (1 - 1e-9) and self.opens(again):
                    chosen = again
            if self.cost(chosen) >= before * (1 - 1e-3):
                break
        return chosen

    def turned(self, chosen: np.ndarray, tips: np.ndarray) -> np.ndarray:
        """The cheapest of the edges chosen (k,) bool and such in which another part of the line, between two of the
        tips (t,) on it, stays uncut: a path along the back may be shorter, and one along the belly near to the legs."""
        line = self.ends[self.line]
        last = self.line_ends.copy()
        last[tips] = True
        size = len(self.image)
        place = np.where(last[line], size + np.arange(line.size).reshape(-1, 2), line)
        part = graph_components(place[:, 0], place[:, 1], size + line.size)[1][place[:, 0]]
        parts = np.unique(part)
        if not 1 < len(parts) <= MOST_PARTS:
            return chosen
        best = chosen
        for k in parts:
            begin = self.held.copy()
            begin[np.flatnonzero(self.line)[part != k]] = True
            found = self.joined(begin, tips)
            if found is not None:
                found = self.shortened(found, tips, 1)
                best = found if self.cost(found) < self.cost(best) and self.opens(found) else best
        return best

    def both(self, tips: np.ndarray) -> np.ndarray:
        """Tips (t,) and their images."""
        return np.union1d(tips, self.image[tips])

    def cost(self, chosen: np.ndarray) -> float:
        """Of cutting the edges chosen (k,) bool, and their images."""
        return float(self.component.cost[self.whole(chosen)].sum())

    def opens(self, chosen: np.ndarray) -> bool:
        """Whether the component, open along the edges chosen (k,) bool, is a disk."""
        return is_disk(self.component, self.whole(chosen))


def _backwards(before: np.ndarray, vertex: int) -> Iterator[int]:
    while vertex >= 0:
        yield vertex
        vertex = int(before[vertex])


def symmetric_halves(component: CutComponent) -> list[SymmetricHalf]:
    """A half of a component that is its own mirror image for every piece of the plane that may stay uncut, the
    costliest first; none if it is none, or if the plane crosses polygons in several places between boundaries."""
    if (component.polygons < 0).any():
        return []
    found: list[SymmetricHalf] = []

    def accepted(image: np.ndarray) -> bool:
        found.extend(_halves(component, image))
        return bool(found)

    find_mirror(component.positions, component.triangles, component.polygons, accepted=accepted)
    return found


def _halves(component: CutComponent, image: np.ndarray) -> list[SymmetricHalf]:
    """The half of a component with mirror images (n,), for every piece of the plane."""
    plane = image == np.arange(len(image))
    apart = component.positions - component.positions[image]
    normal = apart[np.argmax((apart**2).sum(axis=1))]
    side = plane | (apart @ normal > 0)
    keys, mirrored = pair_keys(*component.ends.T), pair_keys(*image[component.ends].T)
    order = np.argsort(keys)
    image_edge = order[np.minimum(np.searchsorted(keys[order], mirrored), len(keys) - 1)]
    cost = (component.cost + component.cost[image_edge]) / 2
    cost[keys[image_edge] != mirrored] = np.inf
    inside = side[component.ends].all(axis=1)
    across = (image_edge == np.arange(len(keys))) & ~inside
    edges = np.flatnonzero(np.isfinite(cost) & (inside | across))
    boundary = np.column_stack([ends[component.boundary] for ends in halfedges(component.triangles)])
    in_plane = plane[component.ends[edges]].all(axis=1)
    ends = np.where(side[component.ends[edges]], component.ends[edges], image[component.ends[edges]])
    return [
        SymmetricHalf(
            component=replace(component, cost=cost),
            image=image,
            side=side,
            edges=edges,
            image_edge=image_edge[edges],
            ends=ends,
            across=across[edges],
            line=line.edges,
            on_line=line.vertices,
            line_ends=line.ends & side,
            held=in_plane & ~line.edges,
            boundary=boundary[side[boundary].all(axis=1)],
        )
        for line in _Line.all_of(component, edges, image, boundary)[:MOST_PARTS]
    ]


@dataclass(frozen=True)
class _Line:
    """A piece of the plane between boundaries: edges (k,) bool, vertices (n,) bool, and those at its ends (n,) bool."""

    edges: np.ndarray
    vertices: np.ndarray
    ends: np.ndarray

    @staticmethod
    def all_of(component: CutComponent, edges: np.ndarray, image: np.ndarray, boundary: np.ndarray) -> list[_Line]:
        """The pieces of edges (k,) in the plane of mirror images (n,), the costliest first, or the one that crosses
        polygons, which no cut does; none where several cross some."""
        n, plane = len(image), image == np.arange(len(image))
        ends, at_boundary = component.ends[edges], np.zeros(len(image), dtype=bool)
        at_boundary[boundary] = True
        in_plane = plane[ends].all(axis=1)
        tail, head = halfedges(component.triangles)
        owner = np.unique(component.polygons, return_inverse=True)[1]
        polygon = n + np.repeat(owner, 3)
        # What the plane crosses: polygons, through vertices in it and through edges that are their own images.
        normal = component.positions - component.positions[image]
        above = normal @ normal[np.argmax((normal**2).sum(axis=1))]
        up, down = (
            np.bincount(owner, ((sign * above > 0) & ~plane)[component.triangles].any(axis=1)) for sign in (1, -1)
        )
        crossed = ((up > 0) & (down > 0))[polygon - n]
        through = crossed & plane[tail]
        over = np.flatnonzero(crossed & (image[tail] == head) & ~plane[tail])
        number = n + int(owner.max()) + 1 + np.unique(np.minimum(tail, head)[over], return_inverse=True)[1]
        links = [ends[in_plane], np.column_stack([tail, polygon])[through], np.column_stack([number, polygon[over]])]
        place = np.concatenate(links)
        if not len(place):
            return []
        size = int(place.max()) + 1
        # Pieces end at the boundary: every link has a place of its own there.
        open_end = place[:, 0] < n
        own = np.arange(size, size + place.size).reshape(-1, 2)
        cut = (place < n) & at_boundary[np.minimum(place, n - 1)]
        place = np.where(cut, own, place)
        label = graph_components(place[:, 0], place[:, 1], size + place.size)[1][place[:, 0]]
        of_edge, of_polygon = label[: in_plane.sum()], np.unique(label[in_plane.sum() :])
        if len(of_polygon) > 1:
            return []
        cost = np.bincount(of_edge, component.cost[edges[in_plane]], 1)
        pieces = of_polygon if len(of_polygon) else np.argsort(-cost, kind="stable")[: len(np.unique(of_edge))]
        # At a boundary that the plane crosses amid an edge.
        border = over[np.isin(over, component.boundary)]
        found = []
        for piece in pieces:
            chosen, vertices = np.zeros(len(edges), dtype=bool), np.zeros(n, dtype=bool)
            chosen[in_plane] = of_edge == piece
            vertices[np.concatenate(links)[(label == piece) & open_end][:, 0]] = True
            vertices[ends[chosen]] = True
            last = vertices & at_boundary
            last[tail[border]] = last[head[border]] = True
            found.append(_Line(chosen, vertices, last))
        return found


def symmetric_cut(half: SymmetricHalf, extremities: int, bearable: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Edges (e,) bool that cut a component into a disk, symmetrically, and the tips (t,) they reach; None where there
    are none, as where a half has handles.

    extremities : tips that the cut reaches, at most, until its spread is `bearable`
    """
    component, begun = half.component, _begun(half)
    while begun is not None:
        chosen, tips = begun
        full = len(tips) >= extremities
        scale = np.zeros(0) if full else log_scale(component, half.whole(chosen))
        if full or spread(component, scale) <= bearable:
            chosen = half.shortened(half.turned(chosen, tips), tips)
            # Shorter cuts may leave more.
            scale = np.zeros(0) if full else log_scale(component, half.whole(chosen))
            if full or spread(component, scale) <= bearable:
                return (half.whole(chosen), half.both(tips)) if half.opens(chosen) else None
        begun = _continued(half, chosen, tips, scale)
    return None


def outlined_cut(
    halves: list[SymmetricHalf], extremities: int, bearable: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """As `symmetric_cut`, for a map onto a round disk: of all pieces that may stay uncut, and all numbers of tips, the
    cut that spreads it least, and of about equal ones the one that leaves least where it is free."""
    found = sorted((cut for half in halves for cut in _outlined(half, extremities, bearable)), key=lambda cut: cut[0])
    if not found:
        return None
    component, best = halves[0].component, found[0]
    others = [cut for cut in found[1:] if cut[0] <= DOUBTFUL * best[0] and (cut[2] != best[2]).any()]
    if others:
        # What is predicted is not told apart so closely; the map is.
        spreads = [disk_spread(component, cut[2]) for cut in (best, others[0])]
        near = [cut for cut, s in zip((best, others[0]), spreads, strict=True) if s <= ABOUT * min(spreads)]
        best = min(near, key=lambda cut: cut[1])
    return best[2:]


def _outlined(
    half: SymmetricHalf, extremities: int, bearable: float
) -> Iterator[tuple[float, float, np.ndarray, np.ndarray]]:
    """Symmetric cuts (e,) bool with more and more tips (t,), until what they spread a free map is `bearable`: what they
    are predicted to spread one onto a disk, and a free one, the cut, and the tips."""
    component, begun = half.component, _begun(half)
    while begun is not None:
        chosen, tips = begun
        short = half.shortened(half.turned(chosen, tips), tips)
        if half.opens(short):
            cut = half.whole(short)
            yield outline_spread(component, cut), spread(component, log_scale(component, cut)), cut, half.both(tips)
        scale = log_scale(component, half.whole(chosen))
        if len(tips) >= extremities or spread(component, scale) <= bearable:
            return
        begun = _continued(half, chosen, tips, scale)


def _begun(half: SymmetricHalf) -> tuple[np.ndarray, np.ndarray] | None:
    """The edges (k,) bool of a half with which a cut begins, and its tips (t,): of a closed one the first."""
    component, chosen = half.component, np.zeros(len(half.edges), dtype=bool)
    closed = not len(component.boundary) and not half.held.any()
    tips = np.zeros(0, np.int64)
    if closed:
        scale = log_scale(component, half.whole(chosen))
        tips = np.array([half.best(scale * component.tip_factor())])
    joined = half.joined(chosen, tips)
    while joined is not None and closed and _is_point(component, half.both(tips)):
        tips = np.append(tips, half.peak(np.ones(component.vertex_count), joined, tips))
        joined = half.joined(joined, tips)
    return None if joined is None else (joined | half.held, tips)


def _continued(
    half: SymmetricHalf, chosen: np.ndarray, tips: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """The edges chosen (k,) bool with a path to one tip more, where a scale (n,) is greatest; None if there is none."""
    tips = np.append(tips, half.peak(scale, chosen, tips))
    joined = half.joined(chosen, tips)
    return None if joined is None else (half.shortened(joined, tips, 1), tips)


def _is_point(component: CutComponent, tips: np.ndarray) -> bool:
    """Whether tips (t,) are one vertex or two neighbours: a slit of a single edge would not open anything."""
    return len(tips) == 1 or (len(tips) == 2 and bool((np.sort(component.ends, axis=1) == tips).all(axis=1).any()))
