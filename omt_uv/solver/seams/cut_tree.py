"""A cut on the path graph, what it costs and what spread of the log scale it leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.topology import graph_components
from .path_graph import PathGraph
from .predicted_scale import ScaleModel, prefix_energies

# A cut that leaves half the spread is a fifth longer, as a rule: cuts at different spreads are compared by this power.
EXCHANGE = 0.3


@dataclass(frozen=True)
class Task:
    """Where to cut: the steps, the log scale, the spread of it that is to be reached, and the factor (n,) on what cuts
    are worth that end at a vertex."""

    graph: PathGraph
    model: ScaleModel
    bound: float
    tip_factor: np.ndarray


@dataclass(frozen=True)
class Cut:
    """Steps (k,) of a cut, its vertices (c,) off the boundary, its spread, and what it costs."""

    steps: np.ndarray
    vertices: np.ndarray
    spread: float
    cost: float

    def score(self, bound: float) -> float:
        """The cost that a cut of this kind would have at a spread of `bound`; less is better."""
        return self.cost * (max(self.spread, bound / 2) / bound) ** EXCHANGE


def cut_along(task: Task, steps: np.ndarray) -> Cut:
    """The cut along steps (k,)."""
    steps = np.flatnonzero(are_in(steps, len(task.graph.cost)))
    vertices = task.graph.vertices_of(steps)
    cost = float(task.graph.cost[steps].sum())
    return Cut(steps=steps, vertices=vertices, spread=task.model.spread_cut(vertices), cost=cost)


@dataclass(frozen=True)
class Removal:
    """What a cut loses where parts of it are taken back.

    Attributes
    ----------
    graph : of the task
    place (n,) : of the vertices of the cut among themselves; steps (n,) : of it that end at a vertex
    held (n,) : vertices of its steps that hold a vertex, themselves or as an image
    inverse (c,c), force (c,) : of Green's function between these, and what holds them
    """

    graph: PathGraph
    place: np.ndarray
    steps: np.ndarray
    held: np.ndarray
    inverse: np.ndarray
    force: np.ndarray

    @staticmethod
    def of(task: Task, cut: Cut) -> Removal:
        """Of a cut for a task."""
        graph, plate = task.graph, task.model.plate
        n = len(graph.boundary)
        place = np.zeros(n, np.int64)
        place[cut.vertices] = np.arange(len(cut.vertices))
        steps = np.bincount(graph.ends[cut.steps].ravel(), minlength=n)
        inverse = np.linalg.inv(plate.between(cut.vertices))
        own = np.flatnonzero(steps)
        held = np.bincount(_with_images(graph, own), minlength=n)
        return Removal(graph, place, steps, held, inverse, inverse @ plate.value[cut.vertices])

    def losses(self, gone: np.ndarray) -> np.ndarray:
        """The spread that is left once the first of the steps (k,) is taken back, once the first two are, and so on,
        over what is left now (k,): all by one factor. Infinite where rounding leaves no digits of it."""
        ends, when = self.graph.ends[gone].ravel(), np.repeat(np.arange(len(gone)), 2)
        # A vertex is let go with the last of its steps, and held no more with the last of those that hold it.
        let_go, when = _with_the_last(ends, when, self.steps)
        image = self.graph.image[let_go]
        moved = image != let_go
        free, when = _with_the_last(
            np.concatenate([let_go, image[moved]]), np.concatenate([when, when[moved]]), self.held
        )
        inner = ~self.graph.boundary[free]
        free, when = self.place[free[inner]], when[inner]
        order = np.argsort(when, kind="stable")
        free, when = free[order], when[order]
        if not len(free):
            return np.zeros(len(gone))
        total = np.concatenate([[0.0], prefix_energies(self.inverse[free[:, None], free], self.force[free])])
        return total[np.searchsorted(when, np.arange(len(gone)), side="right")]


def _with_the_last(vertices: np.ndarray, when: np.ndarray, needed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (k,) that are named (m,) as often as is needed (n,), and when (k,) that is so: with the last."""
    count, last = np.bincount(vertices, minlength=len(needed)), np.zeros(len(needed), np.int64)
    np.maximum.at(last, vertices, when)
    enough = np.flatnonzero((needed == count) & (count > 0))
    return enough, last[enough]


def are_in(numbers: np.ndarray, count: int) -> np.ndarray:
    """Which of so many numbers from 0 (count,) bool are among these (k,)."""
    among = np.zeros(count, dtype=bool)
    among[numbers] = True
    return among


def _with_images(graph: PathGraph, vertices: np.ndarray) -> np.ndarray:
    """Vertices (k,) and the images of those that have another."""
    image = graph.image[vertices]
    return np.concatenate([vertices, image[image != vertices]])


def stretches(graph: PathGraph, steps: np.ndarray) -> list[np.ndarray]:
    """Steps (k,) in paths between tips, branchings and the boundary, the most expensive first."""
    return _by_stretch(graph, steps)[0]


def leaves(graph: PathGraph, steps: np.ndarray) -> list[np.ndarray]:
    """The stretches of steps (k,) that end in a tip, each from the tip on."""
    paths, degree = _by_stretch(graph, steps)
    depth = graph.depth(steps)
    found = []
    for path in paths:
        ends = graph.ends[path]
        if ((degree[ends] == 1) & ~graph.boundary[ends]).any():
            found.append(path[np.argsort(-depth[ends].max(axis=1), kind="stable")])
    return found


def between_nodes(ends: np.ndarray, node: np.ndarray) -> np.ndarray:
    """The stretch (k,) that each of the steps with these ends (k,2) is in, joined through vertices that are no nodes
    (n,) bool; some numbers are those of none."""
    n, k = len(node), len(ends)
    # Each step has a place of its own for its ends at nodes.
    place = np.where(node[ends], n + np.arange(2 * k).reshape(k, 2), ends)
    return graph_components(place[:, 0], place[:, 1], n + 2 * k)[1][place[:, 0]]


def _by_stretch(graph: PathGraph, steps: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Stretches, and how many steps meet at every vertex (n,)."""
    ends = graph.ends[steps]
    degree = np.bincount(ends.ravel(), minlength=len(graph.boundary))
    node = (degree != 2) | graph.boundary
    # Where a path leaves the mirror plane, its mirror image branches off.
    leaving = graph.in_plane[ends[:, 0]] != graph.in_plane[ends[:, 1]]
    node[ends[leaving][graph.in_plane[ends[leaving]]]] = True
    label = between_nodes(ends, node)
    total = np.bincount(label, graph.cost[steps])
    order = np.argsort(-total, kind="stable")[: np.count_nonzero(np.bincount(label))]
    return [steps[label == c] for c in order], degree
