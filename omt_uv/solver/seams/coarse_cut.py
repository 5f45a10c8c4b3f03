"""What a search cuts: a coarse surface with what cuts on it cost and are worth, a cut that was found on it, and the
edges of the component that it was carried to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..cutting.component import CutComponent
from ..linalg.sparse import solve_spd
from .coarse_surface import CoarseSurface, Mirrored
from .cut_tree import EXCHANGE, Cut, Task
from .fine_paths import FineMirror, carried
from .growth import EVEN
from .path_graph import PathGraph, path_graph
from .predicted_scale import ScaleModel

# A closed surface is grounded through this share of its area, so that its Laplacian has an inverse.
GROUND = 1e-6
# A cut that has more than so many times the spread asked for has no arcs left to grow: symmetric ones, mostly.
STUCK = 2.0


@dataclass(frozen=True)
class Found:
    """What was cut of a part.

    Attributes
    ----------
    edges (e,) bool : that were cut; base (e,) bool : those of them that made a disk of it first
    mirror : if the others are symmetric
    coarse, steps (k,), root : where and along what they were found, and where on a closed surface they begin
    rehearsed : the square of log(shear) of a map of the coarse surface that is cut so; None where there is none
    polygons (k,) : of the part
    gave_up : no longer cut seemed to be worth what it costs, though that is more than was asked for
    is_stuck : it was asked for more, and hardly anything was left to grow
    is_copy : it was found for another part, which this one is a copy of, and is not gone on from
    """

    edges: np.ndarray
    base: np.ndarray
    mirror: FineMirror | None
    coarse: CoarseSurface
    steps: np.ndarray
    root: int
    polygons: np.ndarray
    rehearsed: float | None = None
    gave_up: bool = False
    is_stuck: bool = False
    is_copy: bool = False


@dataclass(frozen=True)
class CoarseCut:
    """A cut that was found for a task, beside edges `base` (e,) bool."""

    setting: Setting
    task: Task
    cut: Cut
    base: np.ndarray
    mirror: FineMirror | None

    @property
    def score(self) -> float:
        """What it costs, with what is cut beside it; less is better. One that misses the bound costs what reaching it
        would."""
        return self.setting.base_cost + self.cut.cost * max(self.cut.spread / self.task.bound, 1.0) ** EXCHANGE

    @property
    def is_stuck(self) -> bool:
        """Whether it is far from its bound, and nothing more can be cut."""
        return self.cut.spread > STUCK * self.task.bound

    def carried(self, component: CutComponent, straighter: bool = False) -> Found:
        """The same, led along the edges of the component; straighter: with fewer turns."""
        start, coarse = component.on_boundary(), self.setting.coarse
        start[component.ends[self.base].ravel()] = True
        if self.setting.is_closed:
            start[coarse.kept[self.task.graph.boundary]] = True
        edges = carried(component, coarse, self.task.graph, self.cut.steps, start, self.mirror, straighter)
        root = int(np.argmax(self.task.graph.boundary))
        polygons = component.polygons[component.polygons >= 0]
        return Found(self.base | edges, self.base, self.mirror, coarse, self.cut.steps, root, polygons)


@dataclass(frozen=True)
class Setting:
    """A coarse surface to be cut, from the vertices `start` (n,) bool on: its boundary, or what is cut already, which
    has its cost, too."""

    coarse: CoarseSurface
    model: ScaleModel
    factor: np.ndarray
    tip_factor: np.ndarray
    start: np.ndarray
    mirrored: Mirrored | None
    base_cost: float

    @staticmethod
    def of(component: CutComponent, coarse: CoarseSurface, base, mirror, model, tip_factor) -> Setting:
        tree = cKDTree(coarse.positions)
        mirrored = coarse.images
        if mirror is not None and mirrored is None:
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
        return Setting(
            coarse=coarse,
            model=model,
            factor=_cost_factor(component)[coarse.kept],
            tip_factor=tip_factor[coarse.kept],
            start=start,
            mirrored=mirrored,
            base_cost=float(component.cost[base].sum() / coarse.size),
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


def best_of(cuts: Sequence[CoarseCut]) -> CoarseCut:
    """The cut of the least score, the first of those that are even."""
    least = min(cut.score for cut in cuts)
    return next(cut for cut in cuts if cut.score <= least * (1 + EVEN))


def hub(graph: PathGraph, steps: np.ndarray) -> int:
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


def spread_along(coarse: CoarseSurface, model: ScaleModel, ends: np.ndarray) -> float:
    """The spread that a coarse surface is predicted to have, cut along edges with these ends (k,2,3)."""
    cut = np.unique(cKDTree(coarse.positions).query(ends.reshape(-1, 3))[1])
    cut = cut[~coarse.boundary[cut]]
    return float(model.cut(cut[:1]).spread_cut(cut[1:]))
