"""Search the seams of a component on its coarse surface, and carry them to its edges.

Arcs are grown one by one, each where it takes most of the predicted distortion for its length (`growth`), taken back
and grown anew (`improvement`), and only then led along edges (`fine_paths`). No map is made.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..analysis.seam_costs import SeamCosts
from ..analysis.symmetry_plane import NEAR
from ..cutting.component import CutComponent, fingerprint
from ..mesh.geometry import face_areas
from ..mesh.surface import Surface
from ..mesh.topology import halfedges
from ..progress import Progress, Steps, part_of
from .coarse_surface import CoarseSurface, coarse_surface
from .cut_tree import EXCHANGE, Cut, Task, cut_along
from .fine_paths import FineMirror, carried, with_line
from .growth import grow
from .improvement import improved, rerouted, trimmed
from .options import SearchOptions
from .path_graph import Mirrored, PathGraph, path_graph
from .predicted_scale import ScaleModel
from .symmetric_base import symmetric_base

# Share of the vertices that have an image in a component with a mirror plane.
MIRRORED_SHARE = 0.97
# Distance of a vertex from where its image belongs, or from the plane, over the extent; and that of scans.
EXACT = 1e-4
NEARLY = 0.03
# Seams of what is nearly its own image are symmetric unless that makes them cost so many times what others do: of a
# body, and, with all between, of one that is hardly a mirror image any more.
DEARER = (1.5, 1.0)
# A vertex is in a face if it is so with more than this certainty, and cuts that end there are worth so much less.
IN_FACE = 0.5
BARRED = 0.3
# What maps have shown is compared with what was predicted over so many rings, where that is so much of its mean at
# least, and counts so many times more or less at most.
SMOOTHED = 3
LEAST_PREDICTED = 0.05
MOST_WEIGHT = 4.0
# Where the time of a search goes, roughly: growth ends at this share of it.
GROWN = 0.5


@dataclass(frozen=True)
class Measured:
    """What maps along seams that were found before have shown, of every polygon.

    Attributes
    ----------
    spread (f,) : square of the logarithm of the shear
    share (f,) : of what it is in the mean, that is asked for now
    """

    spread: np.ndarray
    share: np.ndarray


@dataclass(frozen=True)
class SeamSearch:
    """A search for seams, to be called with each component; yields progress and returns edges (e,) bool to cut.

    Attributes
    ----------
    spread (f,) : to be reached, of every polygon, see `predicted_scale.ScaleModel`; infinite where nothing is searched
    surface : whose components they are
    costs : gives what cutting its edges costs, when that is known to be needed
    density (f,) : area that polygons ask for, over their own; None for 1
    further : components whose seams were marked by hand are searched, too
    options : see `SearchOptions`
    measured : see `Measured`, for parts that were searched before
    memory : of what was found for parts, bare, by their fingerprints; shared by the searches of a surface
    """

    spread: np.ndarray
    surface: Surface
    costs: Callable[[], SeamCosts]
    density: np.ndarray | None = None
    further: bool = False
    options: SearchOptions = field(default_factory=SearchOptions)
    measured: Measured | None = None
    memory: dict[tuple[bytes, ...], _FoundCut] = field(default_factory=dict)

    def wants(self, polygons: np.ndarray, marked: bool) -> bool:
        """Whether a component of these polygons (m,) is searched, some of whose boundary is marked as a seam or not."""
        polygons = polygons[polygons >= 0]
        return (self.further or not marked) and bool(np.isfinite(self.spread[polygons]).any())

    def __call__(self, component: CutComponent, base: np.ndarray) -> Steps[np.ndarray]:
        """Seams of a component that is a disk, a sphere, or a disk once the edges `base` (e,) bool are cut: with these,
        or such as are symmetric where the component is."""
        yield Progress("Seams", 0.0)
        name = fingerprint(component)
        if self.measured is not None and name in self.memory:
            found = yield from self._again(component, self.memory[name], self.measured)
            self.memory[name] = found.bare()
            return found.edges
        bound = float(self.spread[component.polygons[component.polygons >= 0]].min())
        bounded = bool(component.on_boundary().any())
        if bounded:
            coarse, model = self._modelled(component)
            if model.spread <= bound and not base.any():
                return base
        component = self._with_costs(component)
        mirror = self._mirror(component)
        if mirror is not None and base.any():
            symmetric = symmetric_base(component, mirror)
            base, mirror = (base, None) if symmetric is None else (symmetric, mirror)
        if bounded and model.spread <= bound:
            return base
        plain = (coarse, model) if bounded else None
        # Where the plane runs between the vertices, there is hardly a symmetric cut without a line along it.
        line = None if mirror is None else mirror if not mirror.exact else with_line(component, mirror)
        first = None if line is mirror else mirror
        found = yield from part_of(self._searched(component, base, bound, first, plain), 0.0, 0.5)
        if line is not None and found.mirror is None:
            mirrored = yield from part_of(self._searched(component, base, bound, line, plain), 0.5, 0.5)
            found = mirrored if mirrored.score <= self._worth_of_symmetry() * found.score else found
        found = found.carried(component)
        self.memory[name] = found.bare()
        return found.edges

    def _searched(
        self,
        component: CutComponent,
        base: np.ndarray,
        bound: float,
        mirror: FineMirror | None,
        plain: tuple[CoarseSurface, ScaleModel] | None,
    ) -> Steps[_FoundCut]:
        """The best cut, symmetric where there is a mirror; plain : what is known of the coarse surface without one."""
        coarse, model = plain if mirror is None and plain is not None else self._modelled(component, mirror)
        setting = _Setting.of(component, coarse, base, mirror, model, self._tip_factor(component))
        task = setting.task(bound, setting.extremity())
        if mirror is not None and not task.graph.is_whole():
            mirror, setting = None, replace(setting, mirrored=None)
            task = setting.task(bound, setting.extremity())
        cut = yield from self._grown(task)
        if setting.is_closed:
            task = setting.task(bound, _hub(task.graph, cut.steps))
            cut = cut_along(task, cut.steps)
        cut = yield from self._improved(task, cut)
        return _FoundCut(setting, task, cut, base, mirror, base)

    def _again(self, component: CutComponent, found: _FoundCut, measured: Measured) -> Steps[_FoundCut]:
        """A cut for what maps along the one before have shown: where they shear more than was predicted, it counts."""
        real = component.polygons >= 0
        polygons, n = component.polygons[real], component.vertex_count
        area = face_areas(component.positions, component.triangles[real])
        at = np.repeat(area * measured.spread[polygons], 3)
        spread = np.bincount(component.triangles[real].ravel(), at, n)
        setting = found.setting.reweighted(
            found, component.positions, spread, self._log_density(component, found.coarse)
        )
        root = int(np.flatnonzero(found.task.graph.boundary)[0]) if setting.is_closed else 0
        task = setting.task(0.0, root)
        share = float(measured.share[polygons].min())
        task = replace(task, bound=share * task.model.spread_cut(found.cut.vertices))
        cut = yield from self._grown(task)
        cut = yield from self._improved(task, cut)
        return _FoundCut(setting, task, cut, found.base, found.mirror, found.base).carried(self._with_costs(component))

    def _improved(self, task: Task, cut: Cut) -> Steps[Cut]:
        """The cut made shorter."""
        cut = trimmed(task, rerouted(task, cut))
        for k, better in enumerate(improved(task, cut, self.options.rounds)):
            cut = better
            yield Progress("Seams", GROWN + (0.9 - GROWN) * (k + 1) / self.options.rounds)
        return cut

    def _worth_of_symmetry(self) -> float:
        """How many times as much symmetric seams may cost."""
        plane = self.costs().plane
        return float(np.interp(0.0 if plane is None else plane.residual, [0, NEAR], DEARER))

    def _grown(self, task: Task) -> Steps[Cut]:
        """The cut of arcs that pay most, one after another."""
        cut = cut_along(task, np.zeros(0, np.int64))
        begin = max(cut.spread, task.bound)
        for count in range(self.options.arcs):
            grown = grow(task, cut, 1)
            if grown is cut:
                break
            cut = grown
            # What is flat once it is cut has no spread at all.
            done = np.log(begin / max(cut.spread, task.bound)) / max(np.log(begin / task.bound), 1e-9)
            yield Progress(f"Seams, cut {count + 1}", GROWN * min(max(done, 0.0), 1.0))
        return cut

    def _modelled(self, component: CutComponent, mirror: FineMirror | None = None) -> tuple[CoarseSurface, ScaleModel]:
        """The coarse surface of a component, whose mirror plane stays a line, and its model."""
        line = None if mirror is None else mirror.plane
        coarse = coarse_surface(component.positions, component.triangles, self.options.vertices, line)
        return coarse, ScaleModel.of(coarse, self._log_density(component, coarse))

    def _with_costs(self, component: CutComponent) -> CutComponent:
        """The component with the costs of where an artist would cut; what fills holes costs as before."""
        known = len(self.surface.positions)
        ends = component.vertex_ids[component.ends]
        real = (ends < known).all(axis=1)
        cost = component.cost.copy()
        cost[real] *= self.costs().of(*ends[real].T)
        return replace(component, cost=cost)

    def _mirror(self, component: CutComponent) -> FineMirror | None:
        """The mirror image of the component in itself, if its vertices have one, and some are in the plane."""
        plane = self.costs().plane
        real = component.vertex_ids < len(self.surface.positions)
        if plane is None or not self.options.symmetric:
            return None
        points, own = component.positions, self.surface.positions[component.vertex_ids[real]]
        scale = np.ptp(points, axis=0).max() / max(np.ptp(own, axis=0).max(), 1e-300)
        height = points @ plane.normal
        height = height - np.mean(height[real] - scale * (own @ plane.normal - plane.offset))
        distance, image = cKDTree(points).query(points - 2 * height[:, None] * plane.normal)
        in_plane = (image == np.arange(len(image))) & (np.abs(height) <= EXACT)
        mirror = FineMirror(image, height, in_plane, exact=True)
        if np.mean(distance <= EXACT) >= MIRRORED_SHARE and in_plane.any():
            return mirror
        return with_line(component, mirror) if np.mean(distance <= NEARLY) >= MIRRORED_SHARE else None

    def _tip_factor(self, component: CutComponent) -> np.ndarray:
        """Factor (n,) on what cuts are worth that end at a vertex: less on a face."""
        face = np.zeros(component.vertex_count)
        real = component.vertex_ids < len(self.surface.positions)
        face[real] = self.costs().face[component.vertex_ids[real]]
        return component.tip_factor() * np.where(face > IN_FACE, BARRED, 1.0)

    def _log_density(self, component: CutComponent, coarse: CoarseSurface) -> np.ndarray | None:
        """Half the logarithm of the density at the vertices (c,) of the coarse surface."""
        if self.density is None:
            return None
        real = component.polygons >= 0
        value = np.repeat(0.5 * np.log(self.density[component.polygons[real]]), 3)
        vertices, n = component.triangles[real].ravel(), component.vertex_count
        total = np.bincount(vertices, value, n) / np.maximum(np.bincount(vertices, minlength=n), 1)
        return (total - total.mean())[coarse.kept]


@dataclass(frozen=True)
class _FoundCut:
    """A cut that was found for a task, beside edges `base` (e,) bool, and the edges (e,) bool that it runs along."""

    setting: _Setting
    task: Task
    cut: Cut
    base: np.ndarray
    mirror: FineMirror | None
    edges: np.ndarray

    def bare(self) -> _FoundCut:
        """What a further search has to know of it."""
        left = self.task.model.cut(self.cut.vertices).bare()
        return replace(self, setting=replace(self.setting, model=left), task=replace(self.task, model=left))

    @property
    def coarse(self) -> CoarseSurface:
        """The surface that was searched."""
        return self.setting.coarse

    @property
    def score(self) -> float:
        """What it costs; less is better. One that misses the bound costs what reaching it would."""
        return self.cut.cost * max(self.cut.spread / self.task.bound, 1.0) ** EXCHANGE

    def carried(self, component: CutComponent) -> _FoundCut:
        """The same, led along the edges of the component."""
        start = component.on_boundary()
        start[component.ends[self.base].ravel()] = True
        if self.setting.is_closed:
            start[self.coarse.kept[self.task.graph.boundary]] = True
        edges = carried(component, self.coarse, self.task.graph, self.cut.steps, start, self.mirror)
        return replace(self, edges=self.base | edges)


@dataclass(frozen=True)
class _Setting:
    """A coarse surface to be cut, from the vertices `start` (n,) bool on: its boundary, or what is cut already."""

    coarse: CoarseSurface
    model: ScaleModel
    factor: np.ndarray
    tip_factor: np.ndarray
    start: np.ndarray
    mirrored: Mirrored | None

    @staticmethod
    def of(component: CutComponent, coarse: CoarseSurface, base, mirror, model, tip_factor) -> _Setting:
        tree = cKDTree(coarse.positions)
        mirrored = None
        if mirror is not None:
            image = tree.query(component.positions[mirror.image[coarse.kept]])[1]
            plane = mirror.plane[coarse.kept]
            image[plane] = np.flatnonzero(plane)
            # Nothing else is its own image, or a path there would count once and have none.
            other = ~plane & (image == np.arange(len(image)))
            mirrored = Mirrored(image, (mirror.side[coarse.kept] & ~other) | plane)
        start = coarse.boundary.copy()
        if base.any():
            start[tree.query(component.positions[np.unique(component.ends[base])])[1]] = True
        return _Setting(
            coarse=coarse,
            model=model,
            factor=_cost_factor(component)[coarse.kept],
            tip_factor=tip_factor[coarse.kept],
            start=start,
            mirrored=mirrored,
        )

    @property
    def is_closed(self) -> bool:
        """Whether there is nowhere for cuts to begin, so that they need a root."""
        return not self.start.any()

    def reweighted(
        self, found: _FoundCut, positions: np.ndarray, spread: np.ndarray, log_density: np.ndarray | None
    ) -> _Setting:
        """The same, where what is left counts as much as maps have shown; spread (n,): times the area, at positions."""
        n = len(self.coarse.positions)
        shown = np.bincount(cKDTree(self.coarse.positions).query(positions)[1], spread, n)
        rest = found.task.model.rest()
        tail, head = halfedges(self.coarse.triangles)
        near = csr_matrix((np.ones(len(tail)), (tail, head)), shape=(n, n))
        near = diags(1 / np.maximum(near.sum(axis=1).A1, 1)) @ near
        area = np.maximum(self.coarse.area, 1e-12)
        predicted = rest**2 / area
        for _ in range(SMOOTHED):
            shown, predicted = (0.5 * (x + near @ x) for x in (shown, predicted))
        predicted = np.maximum(predicted, LEAST_PREDICTED * predicted.sum() * area)
        weight = shown / shown.sum() * predicted.sum() / predicted
        weight = np.clip(weight, 1 / MOST_WEIGHT, MOST_WEIGHT)
        return replace(self, model=ScaleModel.of(self.coarse, log_density, weight))

    def extremity(self) -> int:
        """The vertex at which a closed surface is opened: a sharp one, in the mirror plane if there is one."""
        scale = self.model.membrane.green @ (self.coarse.curvature - self.coarse.curvature.sum() * self.coarse.area)
        worth = np.abs(scale) * self.tip_factor / self.factor
        if self.mirrored is not None:
            worth[self.mirrored.image != np.arange(len(worth))] = -1
        return int(np.argmax(worth))

    def task(self, bound: float, root: int) -> Task:
        """The search for a spread within a bound; root: where cuts of a closed surface begin."""
        start = self.start.copy()
        if self.is_closed:
            start[root] = True
        more = np.flatnonzero(start & ~self.coarse.boundary)
        graph = path_graph(self.coarse, self.factor, start, self.mirrored)
        # One alone first: before it, a closed surface is held nowhere.
        return Task(graph, self.model.cut(more[:1]).cut(more[1:]), bound, self.tip_factor)


def _hub(graph: PathGraph, steps: np.ndarray) -> int:
    """The vertex of a cut where most of it meets, and of those in its middle: a root that is no tip."""
    vertices, degree = np.unique(graph.ends[steps], return_counts=True)
    if len(vertices) == 0:
        return int(np.flatnonzero(graph.boundary)[0])
    n = len(graph.boundary)
    tree = csr_matrix((graph.cost[steps], graph.ends[steps].T), shape=(n, n))
    reach = dijkstra(tree, directed=False, indices=vertices)[:, vertices].max(axis=1)
    if graph.in_plane.any():
        degree = np.where(graph.in_plane[vertices], degree, 0)
    return int(vertices[np.lexsort((reach, -degree))[0]])


def _cost_factor(component: CutComponent) -> np.ndarray:
    """Cost of a cut per length (n,) at every vertex, along the cheapest of its edges rather than the others."""
    inner = np.isfinite(component.cost)
    n = component.vertex_count
    ends = component.ends[inner]
    length = np.repeat(component.length[inner], 2)
    ease = np.repeat(component.length[inner] ** 2 / np.maximum(component.cost[inner], 1e-300), 2)
    total = np.bincount(ends.ravel(), length, n)
    return np.where(total > 0, total / np.maximum(np.bincount(ends.ravel(), ease, n), 1e-300), 1.0)
