"""Describe a component of a surface that is to be cut: its edges, what they cost, and its topology."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components

from ..analysis.feature_edges import fold_angles
from ..mesh.geometry import (
    LEAST_STIFFNESS,
    angle_defects,
    angles_from_lengths,
    edge_lengths,
    halfedge_lengths,
    laplacian_from_lengths,
)
from ..mesh.gluing import Gluing, groups
from ..mesh.topology import first_places, graph_components, halfedges, pair_keys
from ..quads.recombination import with_shorter_diagonals
from .component_order import SAME_PLACE, Outlined, in_order, motion

# Cost of a cut per length. A sharp edge or a fold hides a cut, most of all in a hollow; an edge at a full right
# angle counts as these shares of its length. Shares near 1 keep cuts short: their length is bounded by them.
CREASE = 0.85
HOLLOW = 0.75
# Cost of cutting an edge that the user marked as a seam, as a share of its length.
SEAM = 0.3
# The same of an edge marked sharp, where the artist breaks the shading, and of one whose faces look to opposite sides.
SHARP = 0.5
# Angles up to this one, in radians, occur within a smooth surface and hide nothing.
SMOOTH = np.pi / 6
# Edges between vertices that are to be kept free of seams count as so many times their length.
AVOIDED = 10.0
# The same of edges of the triangles that fill a hole: cut them only if there is no other way.
HOLE = 1000.0
# Equal costs are told apart by this share of noise, the same for a mesh wherever it is and however large.
NOISE = 1e-6
# A cut ends at a vertex to be avoided as if what it reached were so much smaller.
AVOIDED_TIP = 0.999
# Vertices of copies are off by no more than this, over the size, and those whose extents differ by more than the second
# share are not compared.
SAME = 1e-5
COARSE = 1e-3


@dataclass(frozen=True)
class CutComponent:
    """A connected manifold with or without boundary, in arrays of its own.

    Attributes
    ----------
    positions (n,3) : in a unit box
    triangles (m,3)
    pair (e,2) : the two halfedges of every inner edge; gluing_pair (e,) : its number among the pairs of the gluing
    ends (e,2), length (e,), cost (e,) : of the inner edges; the cost of diagonals of polygons is infinite
    boundary (b,) : halfedges
    members (m,) : triangles of the gluing; polygons (m,) : that own them; vertex_ids (n,) : vertices of the surface
    avoid (n,) : in [0,1]
    """

    positions: np.ndarray
    triangles: np.ndarray
    pair: np.ndarray
    gluing_pair: np.ndarray
    ends: np.ndarray
    length: np.ndarray
    cost: np.ndarray
    boundary: np.ndarray
    members: np.ndarray
    polygons: np.ndarray
    vertex_ids: np.ndarray
    avoid: np.ndarray

    @property
    def vertex_count(self) -> int:
        """Number n of vertices."""
        return len(self.positions)

    @cached_property
    def graph(self) -> csr_matrix:
        """The cost of all inner edges as `edge_graph` gives it; a cut asks for it again and again."""
        return edge_graph(self, np.arange(len(self.pair)), self.ends, self.vertex_count)

    @cached_property
    def laplacian(self) -> csr_matrix:
        """The Laplacian (n,n) of the surface without cuts: inside of any cut it is that of what is cut open."""
        length = halfedge_lengths(self.positions, self.triangles).reshape(-1, 3)
        return laplacian_from_lengths(length, self.triangles, self.vertex_count, LEAST_STIFFNESS)

    @cached_property
    def curvature(self) -> np.ndarray:
        """Angle defects (n,) of the surface without cuts."""
        angles = angles_from_lengths(halfedge_lengths(self.positions, self.triangles).reshape(-1, 3))
        return angle_defects(self.triangles, angles, np.flatnonzero(self.on_boundary()), self.vertex_count)

    def tip_factor(self) -> np.ndarray:
        """Factor (n,) > 0 by which a cut would rather end at a vertex: small where cuts are to be avoided."""
        return 1 - AVOIDED_TIP * self.avoid

    @property
    def is_disk(self) -> bool:
        """Whether it is one, with a boundary all around."""
        edges = len(self.pair) + len(self.boundary)
        return self.vertex_count - edges + len(self.triangles) == 1 and len(self.boundary) > 0

    def on_boundary(self) -> np.ndarray:
        """Boundary vertices (n,) bool."""
        tail, head = halfedges(self.triangles)
        on_boundary = np.zeros(self.vertex_count, dtype=bool)
        on_boundary[tail[self.boundary]] = on_boundary[head[self.boundary]] = True
        return on_boundary


@dataclass(frozen=True)
class Topology:
    """Topology of the components of a gluing, (k,) each: number of boundaries, of handles, and orientability.

    A component that cannot be oriented has crosscaps in the place of handles.
    """

    boundaries: np.ndarray
    handles: np.ndarray
    one_sided: np.ndarray

    @property
    def is_disk(self) -> np.ndarray:
        """Which components are disks, (k,) bool: one boundary, and neither handles nor crosscaps."""
        return (self.boundaries == 1) & (self.handles == 0)


def classify(gluing: Gluing, corner_class: np.ndarray, component_of: np.ndarray, one_sided: np.ndarray) -> Topology:
    """Topology of every component, by its Euler characteristic and a count of its boundary loops.

    corner_class (c,) : vertices as classes of corners; component_of (m,), one_sided (m,) bool : of the triangles
    """
    k = int(component_of.max()) + 1
    tail, head = halfedges(corner_class[gluing.triangles])
    boundary = _open_halfedges(len(tail), gluing.first, gluing.second)
    vertices, where = first_places(corner_class[gluing.triangles])
    n = np.bincount(component_of[where // 3], minlength=k)
    m = np.bincount(component_of, minlength=k)
    b = np.bincount(component_of[boundary // 3], minlength=k)
    a, z = np.searchsorted(vertices, tail[boundary]), np.searchsorted(vertices, head[boundary])
    graph = coo_matrix((np.ones(len(boundary)), (a, z)), shape=(len(vertices),) * 2)
    loop = connected_components(graph, directed=False)[1][a]
    first = first_places(loop)[1]
    boundaries = np.bincount(component_of[boundary[first] // 3], minlength=k)
    euler = n - (3 * m + b) // 2 + m
    sided = np.zeros(k, dtype=bool)
    sided[component_of[one_sided]] = True
    missing = 2 - euler - boundaries
    return Topology(boundaries=boundaries, handles=np.where(sided, missing, missing // 2), one_sided=sided)


def _open_halfedges(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    open_ = np.ones(count, dtype=bool)
    open_[first] = open_[second] = False
    return np.flatnonzero(open_)


def make_component(
    gluing: Gluing,
    positions: np.ndarray,
    corner_class: np.ndarray,
    members: np.ndarray,
    pairs: np.ndarray,
    avoid: np.ndarray,
    factor: np.ndarray,
) -> CutComponent:
    """The component of the triangles `members` (m,), in ascending order, and the pairs (e,) between them.

    Its arrays are in the order of `component_order.in_order`.

    Parameters
    ----------
    positions : (n,3) of the surface, in a unit box
    corner_class : (c,) vertices as classes of corners
    avoid : (n,) in [0,1], vertices of the surface to keep free of cuts
    factor : (p,) on the cost of cutting each pair, see `gluing_facts.cost_factors`
    """
    corners = gluing.triangles[members]
    _, index, inverse = np.unique(corner_class[corners], return_index=True, return_inverse=True)
    vertex_ids = gluing.vertex[corners.ravel()[index]]
    pair = np.stack([gluing.first[pairs], gluing.second[pairs]], axis=1)
    pair = 3 * np.searchsorted(members, pair // 3) + pair % 3
    given = inverse.reshape(-1, 3).astype(np.int64)
    order = in_order(positions[vertex_ids], given, pair)
    triangles, pair = order.triangles, order.pair
    members, pairs, vertex_ids = members[order.rows], pairs[order.pairs], vertex_ids[order.vertices]
    filled = (gluing.owner[members[pair // 3]] < 0).any(axis=1)
    diagonal = ~gluing.side[gluing.first[pairs]] & ~filled
    tail, head = halfedges(triangles)
    ends = np.stack([tail[pair[:, 0]], head[pair[:, 0]]], axis=1)
    p = positions[vertex_ids]
    length = edge_lengths(p, ends)
    # An edge without length still costs something: sparse graphs take a zero for no edge.
    floor = 1e-9 * max(float(length.mean()) if len(length) else 1.0, 1e-30)
    noise = 1 + NOISE * np.random.default_rng(0).random(len(pair))
    cost = (length + floor) * _hiding(p, triangles, pair) * noise
    cost *= factor[pairs] * (1 + (AVOIDED - 1) * avoid[vertex_ids][ends].mean(axis=1))
    cost[filled] *= HOLE
    cost[diagonal] = np.inf
    return CutComponent(
        positions=p,
        triangles=triangles,
        pair=pair,
        gluing_pair=pairs,
        ends=ends,
        length=length,
        cost=cost,
        boundary=_open_halfedges(3 * len(triangles), pair[:, 0], pair[:, 1]),
        members=members,
        polygons=gluing.owner[members],
        vertex_ids=vertex_ids,
        avoid=avoid[vertex_ids],
    )


def with_quads(component: CutComponent, diagonal: np.ndarray) -> CutComponent:
    """A component with quads in the place of the triangles beside diagonals (e,) bool, cut along the shorter ones."""
    rows = np.flatnonzero(diagonal)
    one, other = component.pair[rows].T // 3
    triangles, place = with_shorter_diagonals(component.positions, component.triangles, component.pair[rows])
    pair, cost, polygons = place[component.pair], component.cost.copy(), component.polygons.copy()
    cost[rows], polygons[other] = np.inf, polygons[one]
    tail, head = halfedges(triangles)
    ends = np.stack([tail[pair[:, 0]], head[pair[:, 0]]], axis=1)
    return replace(
        component,
        triangles=triangles,
        pair=pair,
        ends=ends,
        length=edge_lengths(component.positions, ends),
        cost=cost,
        boundary=place[component.boundary],
        polygons=polygons,
    )


def _hiding(positions: np.ndarray, triangles: np.ndarray, pair: np.ndarray) -> np.ndarray:
    """Factor (e,) that makes creased and hollow edges cheaper, by the angle between the faces of an edge."""
    fold = fold_angles(positions, triangles, pair)
    share = np.clip((np.abs(fold) - SMOOTH) / (np.pi / 2 - SMOOTH), 0, 1)
    return 1 - share * np.where(fold < 0, 1 - HOLLOW, 1 - CREASE)


def edge_graph(component: CutComponent, edges: np.ndarray, ends: np.ndarray, n: int) -> csr_matrix:
    """Symmetric graph (n,n) of the cost of edges (k,) between the vertices `ends` (k,2); diagonals are no edges.

    No two edges have the same ends (`repair.repaired_gluing` sees to it): a sparse matrix would add them up.
    """
    keep = np.isfinite(component.cost[edges])
    (a, b), cost = ends[keep].T, component.cost[edges[keep]]
    return csr_matrix((np.concatenate([cost, cost]), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n))


def boundary_vertices(component: CutComponent) -> list[np.ndarray]:
    """Vertices of every boundary, in no order."""
    tail, head = halfedges(component.triangles)
    a, b = tail[component.boundary], head[component.boundary]
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(component.vertex_count, component.vertex_count))
    boundary = np.unique(a)
    label = connected_components(graph, directed=False)[1][boundary]
    return [boundary[group] for group in groups(label)] if len(boundary) else []


def fingerprint(component: CutComponent) -> tuple[bytes, ...]:
    """Equal for the same component, and for some of its copies, and almost surely for no others."""
    rounded = [np.round(x * 1e6) for x in _relative(component)]
    return tuple(a.tobytes() for a in (component.triangles, component.pair, *rounded))


@dataclass(frozen=True)
class Copies:
    """What was found for components, told again for copies that are moved but not turned.

    Far from the origin single precision moves vertices of copies by more than any digits that a name could have.
    """

    found: dict[tuple[bytes, ...], list[tuple[list[np.ndarray], Any]]] = field(default_factory=dict)

    def of(self, component: CutComponent) -> Any:
        """What was found for a copy of a component; None where none was told."""
        mine = _relative(component)
        for theirs, found in self.found.get(self._name(component, mine), []):
            if all(np.abs(a - b).max(initial=0.0) <= SAME for a, b in zip(mine, theirs, strict=True)):
                return found
        return None

    def tell(self, component: CutComponent, found: Any) -> None:
        """Keep what was found for a component."""
        mine = _relative(component)
        self.found.setdefault(self._name(component, mine), []).append((mine, found))

    def _name(self, component: CutComponent, mine: list[np.ndarray]) -> tuple[bytes, ...]:
        # Thousands of parts with the same edges, and shapes of their own, are not compared with one another.
        shape = np.concatenate([np.ptp(mine[0], axis=0), [mine[0].mean(), np.linalg.norm(mine[0])]])
        return component.triangles.tobytes(), component.pair.tobytes(), np.round(shape / COARSE).tobytes()


@dataclass(frozen=True)
class TurnedCopies:
    """Components with edges (e,) bool that were found for each, for others that are equal but for a motion, a mirrored
    one, too: wheels, screws, both hands."""

    known: dict[tuple[int, ...], list[tuple[CutComponent, Outlined, np.ndarray]]] = field(default_factory=dict)

    def tell(self, component: CutComponent, edges: np.ndarray) -> None:
        """Keep what was found for a component that is no copy."""
        mine = _outlined(component)
        self.known.setdefault(self._name(mine), []).append((component, mine, edges))

    def found_for(self, component: CutComponent) -> np.ndarray | None:
        """What was found for a component that this one is a copy of; None where there is none."""
        copy = self.of(component)
        return None if copy is None else self.moved(copy[1], copy[2])

    def of(self, component: CutComponent) -> tuple[CutComponent, np.ndarray, np.ndarray] | None:
        """A component that this one is a copy of, what was found for it, and its edge (e,) for each of the copy, -1 for
        diagonals; None where there is none, or what it costs to cut the copy is something else."""
        mine = _outlined(component)
        for other, its, edges in self._like(mine):
            found = motion(its, mine)
            if found is None:
                continue
            there, here = pair_keys(*other.ends.T), pair_keys(*found[0][component.ends].T)
            order = np.argsort(there)
            edge = order[np.minimum(np.searchsorted(there[order], here), len(order) - 1)]
            edge = np.where((there[edge] == here) & np.isfinite(component.cost), edge, -1)
            inner = edge >= 0
            size = float(np.ptp(component.positions, axis=0).max())
            dearer = np.abs(component.cost[inner] - other.cost[edge[inner]]).max(initial=0.0) > SAME * size
            if not dearer and np.array_equal(component.avoid, other.avoid[found[0]]):
                return other, edges, edge
        return None

    def _like(self, mine: Outlined) -> Iterator[tuple[CutComponent, Outlined, np.ndarray]]:
        # Of thousands that are nearly alike hardly any is worth the search for a motion.
        if known := self.known.get(self._name(mine)):
            off = np.abs(np.stack([its.distances for _, its, _ in known]) - mine.distances).max(axis=1)
            yield from (known[k] for k in np.flatnonzero(off <= 2 * SAME_PLACE * mine.distances[-1]))

    def _name(self, outlined: Outlined) -> tuple[int, ...]:
        # Thousands of leaves of as many vertices are not compared with one another.
        size = float(np.linalg.norm(outlined.vertices - outlined.vertices.mean(axis=0)))
        return len(outlined.vertices), len(outlined.sides), round(float(np.log(max(size, 1e-300))) / COARSE)

    @staticmethod
    def moved(edges: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Those of the edges (e,) bool of a component that a copy has, by their numbers (k,) there."""
        return edges[edge] & (edge >= 0)


class SideFinder(Protocol):
    """What is searched for seams, and what was found before of where it comes apart along hard edges."""

    @property
    def as_drawn(self) -> bool:
        """Whether creases count whether a body swells or not, and those that are diagonals of quads it was triangulated
        from."""

    @property
    def borders(self) -> tuple[TurnedCopies, TurnedCopies]:
        """Components and where they come apart, not as drawn and as drawn, which are added to."""

    @property
    def asked(self) -> float:
        """The square of log(shear) that maps may have; 0 where nobody asks."""

    @property
    def pockets(self) -> Callable[[], np.ndarray]:
        """Gives the edges (k,2) of the surface around pockets of faces, when those are needed."""

    @property
    def pocketed(self) -> np.ndarray:
        """Those (k,2) that are cut whatever lies beside them."""

    def wants(self, polygons: np.ndarray, marked: bool) -> bool:
        """Whether to search a component of these polygons (m,), some of whose boundary is marked as a seam or not."""


def _outlined(component: CutComponent) -> Outlined:
    """The vertices of a component, and its edges that may be cut, from both sides, and around it."""
    ends, (tail, head) = component.ends[np.isfinite(component.cost)], halfedges(component.triangles)
    border = np.column_stack([tail[component.boundary], head[component.boundary]])
    return Outlined(component.positions, np.concatenate([ends, ends[:, ::-1], border]))


def _relative(component: CutComponent) -> list[np.ndarray]:
    """Positions and costs of a component of size 1 at the origin, -1 where these are infinite."""
    p = component.positions - component.positions.min(axis=0)
    size = float(p.max()) or 1.0
    return [p / size, np.where(np.isfinite(component.cost), component.cost / size, -1)]


def lone_edges(component: CutComponent, cut: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of a cut (e,) bool that touch no other of it, nor the boundary: these open nothing."""
    ends = component.ends[cut]
    label = graph_components(ends[:, 0], ends[:, 1], component.vertex_count)[1][ends[:, 0]]
    lone = np.zeros(len(cut), dtype=bool)
    lone[cut] = (np.bincount(label)[label] == 1) & ~component.on_boundary()[ends].any(axis=1)
    return lone
