"""Search the seams of a component on its coarse surface, and carry them to its edges.

Arcs are grown one by one, each where it takes most of the predicted distortion for its length (`growth`), taken back
and grown anew (`improvement`), and only then led along edges (`fine_paths`). No map is made.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..cutting.component import CutComponent
from ..mesh.mirror import find_mirror
from ..progress import Progress, Steps
from .coarse_surface import CoarseSurface, coarse_surface
from .cut_tree import Task, cut_along
from .fine_paths import FineMirror, carried
from .growth import grow
from .improvement import improved, rerouted, trimmed
from .options import SearchOptions
from .path_graph import Mirrored, path_graph
from .predicted_scale import ScaleModel

# Vertices are on a side of a mirror plane if they are farther from it than this share of the extent.
IN_PLANE = 1e-4
# Where the time of a search goes, roughly: growth ends at this share of it.
GROWN = 0.5


@dataclass(frozen=True)
class SeamSearch:
    """A search for seams, to be called with each component; yields progress and returns edges (e,) bool to cut."""

    options: SearchOptions

    def __call__(self, component: CutComponent, base: np.ndarray) -> Steps[np.ndarray]:
        """Seams of a component that is a disk, a sphere, or a disk once the edges `base` (e,) bool are cut."""
        yield Progress("Seams", 0.0)
        mirror = _mirror(component) if self.options.symmetric and not base.any() else None
        coarse = coarse_surface(
            component.positions,
            component.triangles,
            self.options.vertices,
            None if mirror is None else mirror.image == np.arange(component.vertex_count),
        )
        task = _task(component, coarse, base, mirror, self.options.spread)
        cut = cut_along(task, np.zeros(0, np.int64))
        begin = max(cut.spread, task.bound)
        for count in range(self.options.arcs):
            grown = grow(task, cut, 1)
            if grown is cut:
                break
            cut = grown
            done = np.log(begin / cut.spread) / max(np.log(begin / task.bound), 1e-9)
            yield Progress(f"Seams, cut {count + 1}", GROWN * min(max(done, 0.0), 1.0))
        cut = trimmed(task, rerouted(task, cut))
        for k, better in enumerate(improved(task, cut, self.options.rounds)):
            cut = better
            yield Progress("Seams", GROWN + (0.9 - GROWN) * (k + 1) / self.options.rounds)
        start = component.on_boundary()
        start[component.ends[base].ravel()] = True
        start[coarse.kept[task.graph.boundary & ~coarse.boundary]] |= not base.any()
        return carried(component, coarse, task.graph, cut.steps, start, mirror)


def _mirror(component: CutComponent) -> FineMirror | None:
    """The mirror image of the component in itself, if it has one and there are vertices in the plane."""
    found = find_mirror(component.positions, component.triangles, component.polygons)
    if found is None or (component.avoid != component.avoid[found.image]).any():
        return None
    height = component.positions @ found.normal
    height = height - (height + height[found.image]).mean() / 2
    return FineMirror(found.image, height >= -IN_PLANE) if (found.image == np.arange(len(height))).any() else None


def _task(
    component: CutComponent, coarse: CoarseSurface, base: np.ndarray, mirror: FineMirror | None, bound: float
) -> Task:
    """The search on the coarse surface: cuts begin at its boundary, at the edges `base`, or at the root of a sphere."""
    n = len(coarse.kept)
    tree = cKDTree(coarse.positions)
    mirrored, image = None, np.arange(n)
    if mirror is not None:
        image = tree.query(component.positions[mirror.image[coarse.kept]])[1]
        mirrored = Mirrored(image, mirror.side[coarse.kept])
    model = ScaleModel.of(coarse)
    factor = _cost_factor(component)[coarse.kept]
    start = coarse.boundary.copy()
    if base.any():
        start[tree.query(component.positions[np.unique(component.ends[base])])[1]] = True
    elif not start.any():
        start[_root(component, coarse, model, image, mirrored)] = True
    more = np.flatnonzero(start & ~coarse.boundary)
    return Task(path_graph(coarse, factor, start, mirrored), model.cut(more), bound)


def _root(component: CutComponent, coarse: CoarseSurface, model: ScaleModel, image, mirrored) -> int:
    """The vertex at which a closed surface is opened: its sharpest extremity, in the mirror plane if there is one."""
    scale = model.green @ (coarse.curvature - coarse.curvature.sum() * coarse.area)
    worth = np.abs(scale) * component.tip_factor()[coarse.kept] / _cost_factor(component)[coarse.kept]
    if mirrored is not None:
        worth[image != np.arange(len(image))] = -1
    return int(np.argmax(worth))


def _cost_factor(component: CutComponent) -> np.ndarray:
    """Cost of a cut per length (n,) at every vertex, along the cheapest of its edges rather than the others."""
    inner = np.isfinite(component.cost)
    n = component.vertex_count
    ends = component.ends[inner]
    length = np.repeat(component.length[inner], 2)
    ease = np.repeat(component.length[inner] ** 2 / np.maximum(component.cost[inner], 1e-300), 2)
    total = np.bincount(ends.ravel(), length, n)
    return np.where(total > 0, total / np.maximum(np.bincount(ends.ravel(), ease, n), 1e-300), 1.0)
