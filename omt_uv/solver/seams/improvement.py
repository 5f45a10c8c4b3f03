"""Make a cut shorter at the same spread: take some of it back, grow it anew, and keep what is better.

Greedy growth leaves arcs that later ones have made needless, and forks where they happened to be near. A large
neighbourhood search (Shaw 1998) takes back the leaf that is worth least, or some at random, and grows others.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..mesh.topology import graph_components
from .cut_tree import Cut, Removal, Task, are_in, cut_along, leaves, stretches
from .growth import grow
from .path_graph import path_to

# Shares of a leaf that may be taken off its end.
PARTS = (1.0, 0.5, 0.25, 0.1)
# Share of the leaves that is taken back at random.
RANDOM_SHARE = 0.4
# A better cut has a score lower by this share.
BETTER = 1e-3
# Arcs that replace those taken back, at most.
MOST_REGROWN = 12


def improved(task: Task, cut: Cut, trials: int) -> Iterator[Cut]:
    """Cuts within the bound, each as good as the one before or better, one for each of so many trials."""
    rng = np.random.default_rng(0)
    in_vain, (found, order) = 0, _leaves_by_worth(task, cut)
    # Few leaves make few sets, and most sets grow back: what they come to is found once.
    regrown: dict[bytes, Cut] = {}
    finished: dict[bytes, Cut] = {}
    for _ in range(trials):
        if not found:
            return
        left = np.setdiff1d(cut.steps, np.concatenate(_taken_back(found, order, in_vain, rng)))
        if left.tobytes() not in regrown:
            grown = grow(task, cut_along(task, left), MOST_REGROWN)
            name = grown.steps.tobytes()
            if name not in finished:
                finished[name] = trimmed(task, rerouted(task, grown))
            regrown[left.tobytes()] = finished[name]
        other = regrown[left.tobytes()]
        within = other.spread <= max(task.bound, cut.spread)
        better = within and other.score(task.bound) < cut.score(task.bound) * (1 - BETTER)
        in_vain += 1
        if better:
            cut, in_vain, (found, order) = other, 0, _leaves_by_worth(task, other)
        yield cut


def _leaves_by_worth(task: Task, cut: Cut) -> tuple[list[np.ndarray], np.ndarray]:
    """The leaves of a cut, and their numbers (k,), those first that are worth least for their length."""
    found = leaves(task.graph, cut.steps)
    if not found:
        return found, np.zeros(0, np.int64)
    without = Removal.of(task, cut)
    worth = [without.losses(leaf)[-1] / task.graph.cost[leaf].sum() for leaf in found]
    return found, np.argsort(worth, kind="stable")


def _taken_back(found: list[np.ndarray], order: np.ndarray, in_vain: int, rng: np.random.Generator) -> list[np.ndarray]:
    """The leaf that is worth least, or, where those were in vain, some."""
    if in_vain < len(found):
        return [found[order[in_vain]]]
    return [found[k] for k in np.flatnonzero(rng.random(len(found)) < RANDOM_SHARE)] or [found[order[0]]]


def trimmed(task: Task, cut: Cut) -> Cut:
    """The cut with the ends of its leaves taken off where the bound leaves room, those first that lose least."""
    while True:
        without, room = Removal.of(task, cut), task.bound - cut.spread
        shorter = []
        for leaf in leaves(task.graph, cut.steps):
            losses, cost = without.losses(leaf), np.cumsum(task.graph.cost[leaf])
            for part in PARTS:
                count = max(int(part * len(leaf)), 1)
                if losses[count - 1] <= room:
                    shorter.append((losses[count - 1] / cost[count - 1], leaf[:count]))
        if not shorter:
            return cut
        gone = min(shorter, key=lambda pair: pair[0])[1]
        cut = cut_along(task, np.setdiff1d(cut.steps, gone))


def rerouted(task: Task, cut: Cut) -> Cut:
    """The cut with stretches replaced by the cheapest that join the same parts, where that is better."""
    count = len(task.graph.cost)
    for stretch in stretches(task.graph, cut.steps):
        left = are_in(cut.steps, count)
        if not left[stretch].all():
            continue
        left[stretch] = False
        rest = np.flatnonzero(left)
        path = _bridge(task, stretch, rest)
        steps = stretch if path is None else task.graph.steps_of(path)
        if set(steps.tolist()) == set(stretch.tolist()):
            continue
        other = cut_along(task, np.concatenate([rest, steps]))
        if other.score(task.bound) < cut.score(task.bound) * (1 - BETTER) and task.graph.is_open(other.steps):
            cut = other
    return cut


def _bridge(task: Task, stretch: np.ndarray, rest: np.ndarray) -> np.ndarray | None:
    """Vertices (k,) of the cheapest path between the two parts of a cut that a stretch joins; None if not two."""
    graph = task.graph
    n = len(graph.boundary)
    boundary = np.flatnonzero(graph.boundary)
    a, b = graph.ends[rest].T
    label = graph_components(np.concatenate([a, boundary]), np.concatenate([b, np.full(len(boundary), n)]), n + 1)[1]
    used = np.zeros(n, dtype=bool)
    used[a] = used[b] = used[boundary] = True
    touched = graph.ends[stretch].ravel()
    parts = np.flatnonzero(are_in(label[touched[used[touched]]], n + 1))
    if len(parts) != 2:
        return None
    one, other = (np.flatnonzero(used & (label[:n] == part)) for part in parts)
    cost, before = graph.paths_from(one)
    nearest = other[np.argmin(cost[other])]
    return path_to(before, int(nearest)) if np.isfinite(cost[nearest]) else None
