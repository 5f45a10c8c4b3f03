"""Grow a cut: the path to an extremity, or part of it, that saves most for its length, again and again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from .cut_tree import Cut, Task, cut_along
from .path_graph import path_to
from .predicted_scale import ScaleModel

# Extremities that paths are tried to.
MOST_TIPS = 12
# An arc that costs as much as a side of a square of the same area is to lower the spread by this share, at least.
LEAST_WORTH = 0.015
# Cuts end when they cost so many sides.
MOST_COST = 14.0
# A cut ends where it is worth more than this share of what it takes, rather than in what is to be kept free.
BARRED = 0.05
# Relative difference up to which two are worth the same.
EVEN = 1e-6
# Shares of the way to an extremity at which a path may end.
STOPS = np.array([1.0, 0.8, 0.6])


@dataclass(frozen=True)
class _Arc:
    """A path to be added: its vertices (k,) from tip to cut, and by how much the spread falls for a unit of cost."""

    path: np.ndarray
    worth: float


def grow(task: Task, cut: Cut, most: int) -> Cut:
    """The cut with arcs added until the spread is within the bound; at most so many, each where it pays most."""
    for grown in islice(growing(task, cut), most):
        cut = grown
    return cut


def growing(task: Task, cut: Cut) -> Iterator[Cut]:
    """The cut with one arc more after another, each where it pays most, until the spread is within the bound."""
    model, held = task.model, np.zeros(0, np.int64)
    while cut.spread > task.bound and cut.cost <= MOST_COST:
        if len(held) > 1:
            # What was cut before stays held: of a long cut, all at once would take most of the time.
            new = np.setdiff1d(cut.vertices, held)
            model, held = model.cut(new, task.model.plate.own(new)), cut.vertices
        else:
            model, held = task.model.cut(cut.vertices), cut.vertices
        found = _arcs(task, cut, model)
        if not found or (found[0].worth < LEAST_WORTH * cut.spread and len(cut.steps)):
            return
        cut = _with_arc(task, cut, found[0])
        yield cut


def grown_by_one(task: Task, cut: Cut, most: int) -> list[Cut]:
    """The cut with one arc more, for so many arcs at most, to different extremities, that are worth most."""
    arcs = _arcs(task, cut, task.model.cut(cut.vertices))[:most]
    return [_with_arc(task, cut, arc) for arc in arcs]


def _with_arc(task: Task, cut: Cut, arc: _Arc) -> Cut:
    return cut_along(task, np.concatenate([cut.steps, task.graph.steps_of(arc.path)]))


def _arcs(task: Task, cut: Cut, model: ScaleModel) -> list[_Arc]:
    """The best arc to each of the extremities, those first that are worth most."""
    graph = task.graph
    # Not from images: a path there would hang on nothing where these are not quite on the other side.
    reached = graph.boundary.copy()
    reached[graph.ends[cut.steps]] = True
    start = np.flatnonzero(reached)
    cost, before = graph.paths_from(start)
    found = []
    for tip in _tips(task, model, cost):
        path, best = path_to(before, int(tip)), None
        reach = cost[path]
        # From the first vertex that is near enough, or where a cut may end as anywhere; the last is on the cut already.
        begins = set((reach <= STOPS[:, None] * reach[0] + 1e-12).argmax(axis=1).tolist())
        begins.add(int(np.argmax(task.tip_factor[path] > BARRED)))
        new, count = _from_cut_on(path, graph.image)
        if not len(new):
            continue
        fall = cut.spread - model.spread + model.falls(new)
        for begin in sorted(begins - {len(path) - 1}):
            worth = task.tip_factor[path[begin]] * fall[count[begin] - 1] / cost[path[begin]]
            if worth > 0 and (best is None or worth > best.worth * (1 + EVEN)):
                best = _Arc(path[begin:], worth)
        found += [] if best is None else [best]
    return [found[k] for k in np.argsort(-ranks(np.array([arc.worth for arc in found])), kind="stable")]


def ranks(worth: np.ndarray) -> np.ndarray:
    """Numbers (k,) in the order of what is worth so much (k,) >= 0: where two are worth the same, rounding does not
    choose between them."""
    return np.round(np.log(np.maximum(worth, 1e-300)) / EVEN)


def _from_cut_on(path: np.ndarray, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v,) off the cut of a path (k,) that ends on it, each with its image (n,), those near the cut first; and
    how many of them (k-1,) are on the path from each of its vertices on."""
    onwards = path[-2::-1]
    both = np.empty((len(onwards), 2), np.int64)
    both[:, 0], both[:, 1] = onwards, image[onwards]
    apart = both[:, 0] != both[:, 1]
    kept = np.ones(both.shape, dtype=bool)
    kept[:, 1] = apart
    return both[kept], np.cumsum(1 + apart)[::-1]


def _tips(task: Task, model: ScaleModel, cost: np.ndarray) -> np.ndarray:
    """Extremities (k,): peaks of what is left of the scale, and of what a cut of one vertex would save, that can be
    reached; those of most gain for their cost."""
    graph, gain = task.graph, model.gain(np.arange(len(cost)))
    peak = np.zeros(len(gain), dtype=bool)
    for height in (gain, np.abs(model.scale)):
        # What is cut has nothing to save, but by rounding, and holds the rest.
        height = np.where(cost > 0, height, 0.0)
        around = np.zeros(len(gain))
        np.maximum.at(around, graph.ends[:, 0], height[graph.ends[:, 1]])
        np.maximum.at(around, graph.ends[:, 1], height[graph.ends[:, 0]])
        peak |= (height >= around) & (height > 0)
    peaks = np.flatnonzero(peak & np.isfinite(cost) & (cost > 0))
    worth = gain[peaks] * task.tip_factor[peaks] / cost[peaks]
    return peaks[np.argsort(-ranks(worth), kind="stable")[:MOST_TIPS]]
