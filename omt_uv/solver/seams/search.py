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
from ..linalg.sparse import solve_spd
from ..mesh.surface import Surface
from ..progress import Progress, Steps, part_of
from .coarse_surface import CoarseSurface, coarse_surface
from .cut_tree import EXCHANGE, Cut, Task, cut_along
from .fine_paths import FineMirror, carried, with_line
from .growth import EVEN, grow
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
# What is searched again is harder than it seemed: on a coarse surface of so many times the vertices.
FINER = 1.5
# A cut grows on where this share of its spread is asked for, at least.
NEARLY_THERE = 0.6
# The least spread that is asked for: what is flat once it is cut has none but by rounding.
FLAT = 1e-9
# A closed surface is grounded through this share of its area, so that its Laplacian has an inverse.
GROUND = 1e-6
# Where the time of a search goes, roughly: growth ends at this share of it.
GROWN = 0.5


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
    share (f,) : of the spread that cuts left which were found before, that is asked for now; None for a first search
    memory : what was found for parts, by their fingerprints; shared by the searches of a surface
    """

    spread: np.ndarray
    surface: Surface
    costs: Callable[[], SeamCosts]
    density: np.ndarray | None = None
    further: bool = False
    options: SearchOptions = field(default_factory=SearchOptions)
    share: np.ndarray | None = None
    memory: dict[tuple[bytes, ...], Found] = field(default_factory=dict)

    def wants(self, polygons: np.ndarray, marked: bool) -> bool:
        """Whether a component of these polygons (m,) is searched, some of whose boundary is marked as a seam or not."""
        polygons = polygons[polygons >= 0]
        return (self.further or not marked) and bool(np.isfinite(self.spread[polygons]).any())

    def __call__(self, component: CutComponent, base: np.ndarray) -> Steps[np.ndarray]:
        """Seams of a component that is a disk, a sphere, or a disk once the edges `base` (e,) bool are cut: with these,
        or such as are symmetric where the component is."""
        yield Progress("Seams", 0.0)
        name, polygons = fingerprint(component), component.polygons[component.polygons >= 0]
        share = 1.0 if self.share is None else float(self.share[polygons].min())
        if self.share is not None and name in self.memory:
            self.memory[name] = yield from self._again(self._with_costs(component), self.memory[name], share)
            return self.memory[name].edges
        bound = float(self.spread[polygons].min())
        bounded = bool(component.on_boundary().any())
        if bounded:
            coarse, model = self._modelled(component)
            if self.share is not None:
                # Nothing was cut of it before, since it was predicted to shear less than it does.
                bound = min(bound, share * model.spread)
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
        best = yield from part_of(self._best(component, base, bound, mirror, plain), 0.0, 0.9)
        if best is None:
            return base
        self.memory[name] = best.carried(component)
        return self.memory[name].edges

    def _best(
        self,
        component: CutComponent,
        base: np.ndarray,
        bound: float,
        mirror: FineMirror | None,
        plain: tuple[CoarseSurface, ScaleModel] | None,
    ) -> Steps[_CoarseCut | None]:
        """The best cut, a symmetric one where that is not much dearer; the other arguments are those of `_searched`."""
        line = mirror
        if mirror is not None and mirror.exact:
            best = yield from part_of(self._searched(component, base, bound, mirror, None), 0.0, 0.4)
            if best is not None:
                return best
            # Where the plane runs between the vertices, there is hardly a symmetric cut without a line along it.
            line = with_line(component, mirror)
        if line is not None:
            best = yield from part_of(self._searched(component, base, bound, line, None), 0.4, 0.2)
            # One trial says what others cost, about.
            once = replace(self, options=replace(self.options, trials=1))
            other = yield from part_of(once._searched(component, base, bound, None, plain), 0.6, 0.1)
            if best is not None and (other is None or best.score <= self._worth_of_symmetry() * other.score):
                return best
        return (yield from part_of(self._searched(component, base, bound, None, plain), 0.7, 0.3))

    def _searched(
        self,
        component: CutComponent,
        base: np.ndarray,
        bound: float,
        mirror: FineMirror | None,
        plain: tuple[CoarseSurface, ScaleModel] | None,
    ) -> Steps[_CoarseCut | None]:
        """The best cut on several coarse surfaces, where there is a mirror a symmetric one, None if that cannot be.

        plain : the first of the surfaces, where it is known
        """
        # What is small has one coarse surface, itself.
        best, trials = None, self.options.trials if component.vertex_count > self.options.vertices else 1
        # Where a search ends hangs on the coarse surface: of several, the one on which most has grown is improved.
        for k in range(trials):
            known = plain if k == 0 else None
            coarse, model = self._modelled(component, mirror, k) if known is None else known
            growing = self._grown_on(component, base, bound, mirror, coarse, model)
            found = yield from part_of(growing, GROWN * k / trials, GROWN / trials)
            if found is not None and (best is None or found.score < best.score * (1 - EVEN)):
                best = found
        if best is None:
            return None
        cut = yield from self._improved(best.task, best.cut)
        return replace(best, cut=cut)

    def _again(self, component: CutComponent, found: Found, share: float) -> Steps[Found]:
        """A cut that leaves a share of the spread that another has left: that one grown on, or where much is missing or
        its coarse surface is too coarse for that, one on finer surfaces."""
        best = None
        if share >= NEARLY_THERE:
            best = yield from part_of(self._grown_further(component, found, share), 0.0, GROWN / 2)
        if best is None or best.cut.spread > best.task.bound:
            best = yield from part_of(self._grown_finer(component, found, share), GROWN / 2, GROWN / 2)
        cut = yield from self._improved(best.task, best.cut)
        return replace(best, cut=cut).carried(component)

    def _grown_further(self, component: CutComponent, found: Found, share: float) -> Steps[_CoarseCut]:
        """A cut grown on from where it was, or anew on the same surface where that is better."""
        coarse = found.coarse
        model = ScaleModel.of(coarse, self._log_density(component, coarse))
        setting = _Setting.of(component, coarse, found.base, found.mirror, model, self._tip_factor(component))
        task = setting.task(0.0, found.root)
        cut = cut_along(task, found.steps)
        task = replace(task, bound=max(share * cut.spread, FLAT))
        cuts = []
        for k, begin in enumerate((cut, None)):
            grown = yield from part_of(self._grown(task, begin), k / 2, 0.5)
            cuts.append(_CoarseCut(setting, task, trimmed(task, rerouted(task, grown)), found.base, found.mirror))
        return min(cuts, key=lambda one: one.score)

    def _grown_finer(self, component: CutComponent, found: Found, share: float) -> Steps[_CoarseCut]:
        """A cut grown anew on finer surfaces, the best of several."""
        best, trials = None, max(self.options.trials - 1, 1)
        before = component.positions[np.unique(component.ends[found.edges])]
        for k in range(trials):
            coarse, model = self._modelled(component, found.mirror, k, FINER)
            cut = np.unique(cKDTree(coarse.positions).query(before)[1])
            cut = cut[~coarse.boundary[cut]]
            bound = max(share * model.cut(cut[:1]).spread_cut(cut[1:]), FLAT)
            growing = self._grown_on(component, found.base, bound, found.mirror, coarse, model)
            other = yield from part_of(growing, k / trials, 1 / trials)
            if other is not None and (best is None or other.score < best.score * (1 - EVEN)):
                best = other
        if best is None:
            return (yield from self._grown_finer(component, replace(found, mirror=None), share))
        return best

    def _grown_on(
        self,
        component: CutComponent,
        base: np.ndarray,
        bound: float,
        mirror: FineMirror | None,
        coarse: CoarseSurface,
        model: ScaleModel,
    ) -> Steps[_CoarseCut | None]:
        """A cut grown on a coarse surface; None where symmetric ones cannot get along the plane of the mirror."""
        setting = _Setting.of(component, coarse, base, mirror, model, self._tip_factor(component))
        task = setting.task(bound, setting.extremity())
        if mirror is not None and not task.graph.is_whole():
            return None
        cut = yield from self._grown(task)
        if setting.is_closed:
            task = setting.task(bound, _hub(task.graph, cut.steps))
            cut = cut_along(task, cut.steps)
        return _CoarseCut(setting, task, trimmed(task, rerouted(task, cut)), base, mirror)

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

    def _grown(self, task: Task, cut: Cut | None = None) -> Steps[Cut]:
        """The cut of arcs that pay most, one after another, from a cut on or from nothing."""
        cut = cut_along(task, np.zeros(0, np.int64)) if cut is None else cut
        begin = max(cut.spread, task.bound)
        for count in range(self.options.arcs):
            grown = grow(task, cut, 1)
            if grown is cut:
                break
            cut = grown
            # What is flat once it is cut has no spread at all.
            done = np.log(begin / max(cut.spread, task.bound)) / max(np.log(begin / task.bound), 1e-9)
            yield Progress(f"Seams, cut {count + 1}", min(max(done, 0.0), 1.0))
        return cut

    def _modelled(
        self, component: CutComponent, mirror: FineMirror | None = None, trial: int = 0, finer: float = 1.0
    ) -> tuple[CoarseSurface, ScaleModel]:
        """One of the coarse surfaces of a component, whose mirror plane stays a line, and its model."""
        line, count = None if mirror is None else mirror.plane, round(finer * self.options.vertices)
        coarse = coarse_surface(component.positions, component.triangles, count, line, trial)
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
class Found:
    """What was cut of a part.

    Attributes
    ----------
    edges (e,) bool : that were cut; base (e,) bool : those of them that made a disk of it first
    mirror : if the others are symmetric
    coarse, steps (k,), root : where and along what they were found, and where on a closed surface they begin
    """

    edges: np.ndarray
    base: np.ndarray
    mirror: FineMirror | None
    coarse: CoarseSurface
    steps: np.ndarray
    root: int


@dataclass(frozen=True)
class _CoarseCut:
    """A cut that was found for a task, beside edges `base` (e,) bool."""

    setting: _Setting
    task: Task
    cut: Cut
    base: np.ndarray
    mirror: FineMirror | None

    @property
    def score(self) -> float:
        """What it costs; less is better. One that misses the bound costs what reaching it would."""
        return self.cut.cost * max(self.cut.spread / self.task.bound, 1.0) ** EXCHANGE

    def carried(self, component: CutComponent) -> Found:
        """The same, led along the edges of the component."""
        start, coarse = component.on_boundary(), self.setting.coarse
        start[component.ends[self.base].ravel()] = True
        if self.setting.is_closed:
            start[coarse.kept[self.task.graph.boundary]] = True
        edges = carried(component, coarse, self.task.graph, self.cut.steps, start, self.mirror)
        root = int(np.argmax(self.task.graph.boundary))
        return Found(self.base | edges, self.base, self.mirror, coarse, self.cut.steps, root)


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
            plane, side = mirror.plane[coarse.kept], mirror.side[coarse.kept]
            image = np.arange(len(plane))
            # Images are on the other side, or a cut would meet them where nothing but they are cut.
            for here, there in ((side & ~plane, ~side & ~plane), (~side & ~plane, side & ~plane)):
                if there.any():
                    at = component.positions[mirror.image[coarse.kept[here]]]
                    image[here] = np.flatnonzero(there)[cKDTree(coarse.positions[there]).query(at)[1]]
            # Nothing else is its own image, or a path there would count once and have none.
            other = ~plane & (image == np.arange(len(image)))
            mirrored = Mirrored(image, (side & ~other) | plane)
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

    def extremity(self) -> int:
        """The vertex at which a closed surface is opened: a sharp one, in the mirror plane if there is one."""
        model, area = self.model, self.coarse.area
        load = self.coarse.curvature - self.coarse.curvature.sum() * area
        scale = solve_spd(model.laplacian + GROUND * diags(area), load)
        worth = np.abs(scale) * self.tip_factor / self.factor
        if self.mirrored is not None:
            worth[self.mirrored.image != np.arange(len(worth))] = -1
        return int(np.argmax(worth >= worth.max() * (1 - EVEN)))

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
