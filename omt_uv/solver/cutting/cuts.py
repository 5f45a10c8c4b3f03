"""Cut every component of a surface into a disk, along short paths where they are least seen.

Boundaries are joined by shortest paths, handles are opened along short loops, and a surface that has to be cut
anyway is cut to the extremities that would be distorted most, or, where its sides are flat, to a net.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..analysis.seam_costs import SeamCosts
from ..errors import MERGING, TURN_OUTSIDE, plural
from ..mesh.gluing import Gluing, components, corner_classes, groups, oriented
from ..mesh.repair import Repaired, coincident_boundary_vertices, repaired_gluing
from ..mesh.surface import Surface, chosen_triangles
from ..progress import Steps, drain, part_of
from ..quads.diagonals import cut_along_shorter
from .component import Copies, CutComponent, SideFinder, Topology, classify, make_component
from .crease_sides import hard_borders
from .cut_graph import greedy_arcs, path_to, shorten
from .developable_nets import Net, net
from .gluing_facts import TurningLines, cost_factors, in_unit_box, to_search, total_curvature, turning_lines
from .handle_partition import partition_pairs, wall_pairs
from .hole_filling import MANY, LevelParts, around_pockets, fill_holes, level_parts, sieved
from .protrusions import BEARABLE, edge_distance, farthest, first_tips, log_scale, outline_spread, peak, spread
from .steiner_points import MOST_ENDS, branching_tree
from .symmetric_cut import outlined_cut, symmetric_cut, symmetric_halves

# Tips that a surface is cut open through.
MOST_EXTREMITIES = 8
# Vertices from which loops through handles are tried.
ROOT_TRIALS = 4
# A component with less curvature than this within, in radians and summed without sign, is not searched for seams.
CURVED = 0.2
# Symmetric cuts may cost so many times what others do, and leave so many times their distortion in the mean square,
# where this is not below what nobody sees, a tenth of all lengths; in an outline, where all cuts distort more, so many.
DEARER = 1.5
STEEPER = 1.1
STEEPER_OUTLINED = 1.5
UNSEEN = 0.1**2
# A net may be so many times as long as another cut, and as long as `developable_nets.Net.most` says anyway.
LONGER = 1.5


class SeamFinder(SideFinder, Protocol):
    """What finds the seams of components, beyond what makes them disks; see `seams.search.SeamSearch`."""

    @property
    def is_again(self) -> bool:
        """Whether this is no first search: what was cut before, nets too, has missed its bound."""

    @property
    def stays_whole(self) -> bool:
        """Whether bodies of hard sides do not come apart along these."""

    @property
    def costs(self) -> Callable[[], SeamCosts]:
        """Gives what seams cost, when that is known to be needed."""

    def priced(self, component: CutComponent) -> CutComponent:
        """The component with what it costs to cut its edges, also for a disk."""

    def __call__(self, component: CutComponent, base: np.ndarray) -> Steps[np.ndarray]:
        """Edges (e,) bool to cut, of a component that is a disk, or a disk once the edges `base` (e,) bool are cut:
        with these, or others in their place."""


@dataclass(frozen=True)
class ComponentCut:
    """How one component was cut: its triangles, boundaries and handles (crosscaps where one_sided) before, the
    length of the cut, and the vertices of the surface (k,) that it was led through."""

    triangles: int
    boundaries: int
    handles: int
    one_sided: bool
    length: float
    extremities: np.ndarray


@dataclass(frozen=True)
class Cuts:
    """Edges (k,2) of the surface to add to its seams, their length, and the components that were cut.

    torn (t,2): edges where more than two faces meet, which no map can join, among the edges.
    """

    edges: np.ndarray
    length: float
    components: tuple[ComponentCut, ...]
    torn: np.ndarray
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class CutSurface:
    """The surface and its gluing, cut into disks and all looking to the same side, and the cuts.

    Surface and gluing are those given, or with the triangles that fill holes; extent: size of a box around them.
    """

    surface: Surface
    gluing: Gluing
    cuts: Cuts
    extent: float


def cut(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    avoid: np.ndarray | None = None,
    fill: bool = False,
    sieve: int | None = MANY,
    extremities: int = MOST_EXTREMITIES,
    search: SeamFinder | None = None,
) -> Cuts:
    """Find edges to mark as seams so that every component of the polygons `faces` (f,) bool is a disk; disks stay.

    Parameters
    ----------
    avoid : (n,) in [0,1], vertices to keep free of seams
    fill : take holes for filled, all boundaries but the longest of every component
    sieve : without `fill`, take holes for filled where a component has more than so many, and take those with many
        handles apart, see `handle_partition.partition_pairs`; None: nowhere
    extremities : tips that a surface is cut open through, at most, where it has no net
    search : finds the seams of components, disks too, that have no net

    Raises
    ------
    EmptyMeshError, NonFiniteError : see `charts.strict_charts`; everything else is repaired and said in the warnings
    """
    surface = cut_along_shorter(surface)
    faces, triangles, owner = chosen_triangles(surface, faces)
    repaired = repaired_gluing(surface, faces, triangles, owner)
    options: dict[str, Any] = {
        "avoid": avoid,
        "fill": fill,
        "sieve": sieve,
        "extremities": extremities,
        "search": search,
    }
    return drain(cut_gluing(surface, repaired, **options)).cuts


def cut_gluing(
    surface: Surface,
    repaired: Repaired,
    *,
    avoid: np.ndarray | None = None,
    fill: bool = False,
    sieve: int | None = None,
    extremities: int = MOST_EXTREMITIES,
    search: SeamFinder | None = None,
    outline: bool = False,
) -> Steps[CutSurface]:
    """A repaired gluing cut into disks; see `cut`. outline : they are to fill an outline"""
    vertex_count = len(surface.positions)
    positions, unit = in_unit_box(surface, repaired.gluing)
    gluing, one_sided = oriented(repaired.gluing, positions)
    twisted = one_sided
    component_of, classes = components(gluing), corner_classes(gluing)
    is_disk = classify(gluing, classes, component_of, one_sided).is_disk
    if is_disk.all() and (
        search is None or (total_curvature(gluing, classes, component_of, positions) <= CURVED).all()
    ):
        return _uncut(surface, gluing, repaired, component_of, unit)
    gone = np.zeros(len(gluing.first), dtype=bool)
    if sieve is not None:
        gone = partition_pairs(gluing, positions, one_sided)
    crowded = bool(gone.any())
    if search is not None:
        comes_apart = avoid is None and not search.stays_whole
        if comes_apart:
            gone |= wall_pairs(surface, gluing, positions, gone, search)
            gone |= hard_borders(surface, gluing, positions, gone, search)
        gone |= around_pockets(surface, gluing, positions, gone, search, comes_apart)
    gluing, parting = gluing.without(gone), np.stack(gluing.ends(gluing.first[gone]), axis=1)
    apart = positions[parting[:, 0]] - positions[parting[:, 1]]
    holes, sieves, level = 0, not fill, None
    if sieve is not None and search is not None:
        level = level_parts(gluing, positions)
    if fill or sieve is not None:
        costs = None if search is None else search.costs
        filled = fill_holes(surface, gluing, one_sided, None if fill else sieve, level, costs)
        surface, gluing, holes = filled.surface, filled.gluing, filled.holes
        one_sided = np.append(one_sided, np.zeros(len(gluing.triangles) - len(one_sided), dtype=bool))
        positions, unit = in_unit_box(surface, gluing)
    keep_free = np.ones(len(positions))
    keep_free[:vertex_count] = 0
    if avoid is not None:
        keep_free[:vertex_count] = np.clip(np.asarray(avoid, float), 0, 1)
    cutter = _Cutter(surface, gluing, positions, keep_free, extremities, search, outline)
    gone, report, touching = yield from cutter.cut(one_sided, unit, sieves, level)
    edges = np.stack(gluing.ends(gluing.first[gone]), axis=1)
    edges = edges[(edges < vertex_count).all(axis=1)]
    # What could not be oriented can be, now that it is cut.
    gluing, _ = oriented(gluing.without(gone), positions)
    length = sum(p.length for p in report) + unit * float(np.linalg.norm(apart, axis=1).sum())
    edges = np.concatenate([edges, parting, repaired.torn]).astype(np.int64)
    turned = gluing.triangles[: len(twisted), 1] != repaired.gluing.triangles[:, 1]
    backwards, mirrored = (len(np.unique(repaired.gluing.owner[turned & k])) for k in (~twisted, twisted))
    warnings = (*repaired.warnings, *_warnings(crowded, backwards, mirrored, holes * sieves, touching))
    cuts = Cuts(edges=edges, length=length, components=tuple(report), torn=repaired.torn, warnings=warnings)
    return CutSurface(surface=surface, gluing=gluing, cuts=cuts, extent=unit)


def uncut(surface: Surface, repaired: Repaired) -> CutSurface | None:
    """A repaired gluing, its faces turned to one side, with no cuts but where it was torn; None if it has one side."""
    positions, unit = in_unit_box(surface, repaired.gluing)
    gluing, one_sided = oriented(repaired.gluing, positions)
    return None if one_sided.any() else _uncut(surface, gluing, repaired, components(gluing), unit)


def _uncut(surface: Surface, gluing: Gluing, repaired: Repaired, component_of: np.ndarray, unit: float) -> CutSurface:
    """What `cut_gluing` returns where all components (m,) are disks."""
    turned = gluing.triangles[:, 1] != repaired.gluing.triangles[:, 1]
    every = np.ones(int(component_of.max()) + 1, dtype=bool)
    touching = coincident_boundary_vertices(surface, gluing, component_of, every)
    backwards = len(np.unique(repaired.gluing.owner[turned]))
    warnings = (*repaired.warnings, *_warnings(False, backwards, 0, 0, touching))
    edges = repaired.torn.astype(np.int64)
    cuts = Cuts(edges=edges, length=0.0, components=(), torn=repaired.torn, warnings=warnings)
    return CutSurface(surface=surface, gluing=gluing, cuts=cuts, extent=unit)


def _warnings(crowded: bool, backwards: int, mirrored: int, holes: int, touching: int) -> Iterator[str]:
    """Warnings, from whether crowded parts came apart, and the numbers of faces turned over on surfaces of two sides
    and of one, of holes of sieves, and of coincident vertices."""
    if crowded:
        yield "A part with many handles was taken apart, along the hard edges of its holes or into clusters"
    if backwards:
        yield _turned_warning(backwards)
    if mirrored:
        who = plural(mirrored, "a face looks", "{} faces look")
        yield f"Where a surface has one side only, {who} to the other side of the map; the texture is mirrored there"
    if holes:
        yield sieved(holes)
    if touching:
        yield f"{touching} boundary vertices lie on one another; {MERGING} joins the parts there"


@dataclass(frozen=True)
class _Cutter:
    """Cuts the components of a gluing, positions (n,3) in a unit box, clear of the vertices `avoid` (n,) in [0,1]."""

    surface: Surface
    gluing: Gluing
    positions: np.ndarray
    avoid: np.ndarray
    extremities: int
    search: SeamFinder | None
    outline: bool

    def cut(
        self, one_sided: np.ndarray, unit: float, sieves: bool, level: LevelParts | None
    ) -> Steps[tuple[np.ndarray, list, int]]:
        """Pairs (p,) bool to cut so that every component is a disk, what was done to each that was cut, and how many
        vertices a weld would join.

        sieves : what has been filled are sieves, which are cut to extremities as closed components are, disks too,
        but for those that are `level`
        """
        component_of = components(self.gluing)
        whole = classify(self.gluing, corner_classes(self.gluing), component_of, one_sided)
        gone = turning_lines(self.gluing, component_of, one_sided)
        lines = TurningLines.of(self.gluing, gone, component_of, self.positions)
        left = self.gluing.without(gone)
        corner_class = corner_classes(left)
        topology = classify(left, corner_class, component_of, one_sided & ~lines.opened[component_of])
        factor = cost_factors(self.surface, left)
        members = groups(component_of)
        order, start = _by_component(component_of[left.first // 3], len(members))
        number = np.flatnonzero(~gone)
        report = []
        # A mesh may hold the same component many times: rivets, teeth, leaves.
        known = Copies(), Copies()  # Of parts that are not searched, and of others.
        patched = np.zeros(len(members), dtype=bool)
        patched[component_of[self.gluing.owner < 0]] = True
        if level is not None:
            patched[component_of[np.flatnonzero(level.triangles)]] = False
        searched = self._to_search(component_of, corner_class, members)
        chosen_ones = np.flatnonzero(~whole.is_disk | (patched & sieves) | searched)
        for count, k in enumerate(chosen_ones):
            pairs = order[start[k] : start[k + 1]]
            component = make_component(left, self.positions, corner_class, members[k], pairs, self.avoid, factor)
            found = known[int(searched[k])].of(component)
            if found is None:
                finding = self._best_cut(component, topology, k, bool(patched[k]) and not sieves, bool(searched[k]))
                found = yield from part_of(finding, count / len(chosen_ones), 1 / len(chosen_ones))
                known[int(searched[k])].tell(component, found)
            chosen, tips = found
            gone[number[component.gluing_pair[chosen]]] = True
            if chosen.any() or not whole.is_disk[k]:
                report.append(
                    ComponentCut(
                        triangles=len(component.triangles),
                        boundaries=int(whole.boundaries[k]),
                        handles=int(whole.handles[k]),
                        one_sided=bool(whole.one_sided[k]),
                        length=float(component.length[chosen].sum() + lines.length[k]) * unit,
                        extremities=component.vertex_ids[tips],
                    )
                )
        return gone, report, coincident_boundary_vertices(self.surface, self.gluing, component_of, whole.is_disk)

    def _to_search(self, component_of: np.ndarray, corner_class: np.ndarray, members: list[np.ndarray]) -> np.ndarray:
        """Components (k,) bool whose seams are to be searched."""
        if self.search is None:
            return np.zeros(len(members), dtype=bool)
        curved = total_curvature(self.gluing, corner_class, component_of, self.positions) > CURVED
        return to_search(self.surface, self.gluing, component_of, members, self.search, curved)

    def _best_cut(
        self, component: CutComponent, topology: Topology, k: int, filled: bool, searched: bool
    ) -> Steps[tuple[np.ndarray, np.ndarray]]:
        """The net of component k, if it has one that is not much longer than other cuts; else those."""
        again = searched and self.search is not None and self.search.is_again
        unrolled = net(component) if (self.extremities or searched) and not (filled or again) else None
        found = None if unrolled is None else unrolled.up_to(unrolled.most)
        if found is not None and not (searched and self._is_torn(found, component, topology, k)):
            return found.cut, found.tips
        if searched and self.search is not None:
            return (yield from self._search_component(component, topology, k, self.search))
        other = cut_component(component, topology, k, self.extremities, self.outline)
        found = None if unrolled is None else unrolled.up_to(LONGER * component.length[other[0]].sum())
        return other if found is None else (found.cut, found.tips)

    @staticmethod
    def _is_torn(found: Net, component: CutComponent, topology: Topology, k: int) -> bool:
        """Whether a net of component k is slit at every segment of a band, or winds along a border."""
        return found.winds or (topology.boundaries[k] > 0 and found.is_comb(_needed(component, topology, k)))

    def _search_component(
        self, component: CutComponent, topology: Topology, k: int, search: SeamFinder
    ) -> Steps[tuple[np.ndarray, np.ndarray]]:
        """Seams that are searched, with what has to be cut for a disk; and their tips."""
        base = np.zeros(len(component.pair), dtype=bool)
        closed = topology.boundaries[k] == 0 and topology.handles[k] == 0
        if not (closed or topology.is_disk[k]):
            priced = search.priced(component)
            # Each is the cheapest near where it began: the shortest can turn out cheaper.
            cuts = [cut_component(one, topology, k, 0)[0] for one in (priced, component)]
            base = min(cuts, key=lambda cut: float(priced.cost[cut].sum()))
        chosen = yield from search(component, base)
        # A slit of a single edge would not open anything.
        if closed and chosen.sum() < 2:
            return cut_component(component, topology, k, self.extremities)
        return chosen, _tips(component, chosen)


def _needed(component: CutComponent, topology: Topology, k: int) -> float:
    """The length of what has to be cut for a disk anyway."""
    return 0.0 if topology.is_disk[k] else float(component.length[cut_component(component, topology, k, 0)[0]].sum())


def _tips(component: CutComponent, chosen: np.ndarray) -> np.ndarray:
    """Vertices (t,) inside the component at which edges (e,) bool end."""
    degree = np.bincount(component.ends[chosen].ravel(), minlength=component.vertex_count)
    return np.flatnonzero((degree == 1) & ~component.on_boundary())


def _turned_warning(count: int) -> str:
    who = plural(count, "A face looks", "{} faces look")
    return (
        f"{who} to the other side than the faces around; mapped with them, so that the texture is mirrored there. "
        f"{TURN_OUTSIDE}"
    )


def _by_component(component_of: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Items in the order of their components (p,), and where each of these begins, (count+1,)."""
    order = np.argsort(component_of, kind="stable")
    return order, np.searchsorted(component_of[order], np.arange(count + 1))


def cut_component(
    component: CutComponent, topology: Topology, k: int, extremities: int, outline: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e,) bool that cut the component, number k of the topology, into a disk, and the tips (t,) they reach;
    symmetric ones where it is its own mirror image, and an outline that is given is not distorted more by them."""
    found = _plain_cut(component, topology, k, extremities)
    halves = symmetric_halves(component)
    if not halves:
        return found
    left = max(spread(component, log_scale(component, found[0])), UNSEEN) if extremities else np.inf
    if outline:
        symmetric = outlined_cut(halves, extremities, min(BEARABLE, STEEPER_OUTLINED * left))
    else:
        symmetric = symmetric_cut(halves[0], extremities, min(BEARABLE, STEEPER * left))
    if symmetric is None:
        return found
    steeper = 1.0
    if outline:
        steeper = outline_spread(component, symmetric[0]) / outline_spread(component, found[0])
        if steeper > STEEPER_OUTLINED:
            return found
    elif extremities:
        steeper = spread(component, log_scale(component, symmetric[0])) / left
    dearer = component.cost[symmetric[0]].sum() / component.cost[found[0]].sum()
    return found if dearer * np.sqrt(max(steeper, 1.0)) > DEARER else symmetric


def _plain_cut(component: CutComponent, topology: Topology, k: int, extremities: int) -> tuple[np.ndarray, np.ndarray]:
    """What `cut_component` finds where nothing is to be symmetric."""
    closed = topology.boundaries[k] == 0
    tips = first_tips(component) if closed and topology.handles[k] == 0 else np.zeros(0, dtype=np.int64)
    if closed and len(tips) == 0:
        chosen = _best_root(component)
    else:
        chosen = greedy_arcs(component, tips)
    tried: set[bytes] = set()
    if topology.handles[k]:
        chosen = shorten(component, chosen, tips, tried=tried)
    while len(tips) < extremities:
        scale = log_scale(component, chosen)
        if spread(component, scale) <= BEARABLE:
            break
        # A tip is worth its cut where much distortion is far from the boundary.
        far = edge_distance(component, _cut_vertices(component, chosen))
        tips = np.append(tips, peak(scale * far * component.tip_factor()))
        path = path_to(component, _cut_vertices(component, chosen), tips[-1])
        tried.clear()
        chosen = shorten(component, chosen | path, tips, around=path, tried=tried)
    chosen = shorten(component, chosen, tips, tried=tried)
    if extremities and topology.handles[k] == 0 and 2 < len(tips) + topology.boundaries[k] <= MOST_ENDS:
        chosen = min(chosen, branching_tree(component, tips), key=lambda edges: component.cost[edges].sum())
    return chosen, tips


def _cut_vertices(component: CutComponent, chosen: np.ndarray) -> np.ndarray:
    start = component.on_boundary()
    start[component.ends[chosen].ravel()] = True
    return np.flatnonzero(start)


def _best_root(component: CutComponent) -> np.ndarray:
    """Shortest of the greedy systems of loops from a few roots, spread evenly: edges (e,) bool."""
    roots = farthest(component, np.array([0]), ROOT_TRIALS)[1:]
    systems = [greedy_arcs(component, np.array([root])) for root in roots]
    return min(systems, key=lambda edges: component.cost[edges].sum())
