"""Join charts again that came apart for want of room, where what they have in common is no neck and the bound holds.

What covers itself in a map comes apart by a minimum cut, several parts at once, and every part is mapped with what
room it has then. Some of it was not needed: across a flank or between two shoulder blades nobody would have cut. Limbs
are another matter, since those hang on a neck: a short line for what it takes off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..analysis.symmetry_plane import MirrorImages
from ..errors import MeshError
from ..mesh.charts import Chart
from ..mesh.geometry import edge_lengths
from ..mesh.topology import edge_runs, pair_keys, paired
from ..progress import Steps, part_of
from ..seams.limbs import may_come_apart
from .chart_indices import outline
from .shear_search import UNSHEARED, Round, ShearSearch

# A border is a neck where it is no longer than this share of the side of a square with the area of the smaller chart.
NECK = 0.8
# And none is worth a map that is shorter than this share of the side of a square with the area of all.
SHORT = 0.05
# What two charts shear as a mean has to leave so much of the logarithm of the bound.
SHEARED = 0.95
# Cuts have to become shorter by this share of the border, since the rest of it may have to be cut again.
SAVED = 0.5
# So many joints are tried at most, and no more vertices are mapped for them than this, or than all charts have.
MOST_TRIALS = 6
MOST_MAPPED = 60_000


@dataclass(frozen=True)
class Border:
    """Edges (e,2) of the surface that two charts, by their numbers, have in common and that hang together; their
    length, and that over the side of a square with the area of the smaller chart."""

    charts: frozenset[int]
    edges: np.ndarray
    length: float
    width: float


def rejoined(
    search: ShearSearch, begun: Round, last: Round, cut: Callable[[Round, np.ndarray, float], Steps[Round | None]]
) -> Steps[Round]:
    """A round within the bound with charts joined, the widest border first, and with it that of their mirror images,
    where they keep the bound, seams get shorter, and what comes of it would not be cut in pieces.

    begun : the round that this one came of: what parts its charts stays; cut : a round cut along edges (e,2) alone, and
    what they need to be disks; as it is where that is longer than so much, None where the end was asked for
    """
    between, tried = _between(begun.charts)[0], set[bytes]()
    left = max(MOST_MAPPED, sum(len(chart.vertices) for chart in last.charts))
    for trial in range(MOST_TRIALS):
        if last.excess or last.searched or len(last.charts) < 2:
            break
        borders = _borders(search, last, between)
        chosen = [one for one in borders if _key(one) not in tried and _may_join(last, one)]
        if not chosen:
            break
        both = _with_image(max(chosen, key=lambda one: one.width), borders, last.charts, search.images)
        tried |= {_key(one) for one in both}
        among = [last.charts[k] for k in frozenset().union(*(one.charts for one in both))]
        size = sum(len(chart.vertices) for chart in among)
        if size > left:
            break
        most, mapped = last.cuts.length - SAVED * sum(one.length for one in both), False
        for kept in _ways(last.cuts.edges, np.concatenate([pair_keys(*one.edges.T) for one in both]), among):
            try:
                new = yield from part_of(cut(last, kept, most), trial / MOST_TRIALS, 1 / MOST_TRIALS)
            except MeshError:
                # The charts that there are have maps.
                continue
            if new is None:
                return last
            mapped |= new is not last
            if _is_sound(search, last, new):
                last = new
                break
        # However many ways there were, so that whether the first will do does not decide which joints are tried.
        left -= size * mapped
    return last


def _ways(edges: np.ndarray, gone: np.ndarray, charts: list[Chart]) -> list[np.ndarray]:
    """Edges (e,2) without those with keys `gone` (g,), across which charts join: first without what was cut between or
    within these and hung on nothing else, too, since a slit amid a chart is a hole in its map; then with that."""
    key, count = np.unique(np.concatenate([outline(chart) for chart in charts]), return_counts=True)
    outer, inner = key[count == 1], np.setdiff1d(key[count > 1], gone)
    run = edge_runs(paired(np.concatenate([outer, inner])))
    # What is closed has no outline: the most that hangs together is what opens it.
    anchored = run[: len(outer)] if len(outer) else np.bincount(run).argmax(keepdims=True) if len(run) else run
    floating = inner[~np.isin(run[len(outer) :], anchored)]
    keys = pair_keys(*edges.T)
    return [edges[~np.isin(keys, each)] for each in (np.union1d(gone, floating), gone)[len(floating) == 0 :]]


def _key(border: Border) -> bytes:
    """Equal for the same edges, whatever their charts are numbered."""
    return np.sort(pair_keys(*border.edges.T)).tobytes()


def _borders(search: ShearSearch, last: Round, between: np.ndarray) -> list[Border]:
    """The longest border of every two charts that share what was cut, but for edges with keys `between` (k,)."""
    key, charts = _between(last.charts)
    cut = np.isin(key, pair_keys(*last.cuts.edges.T)) & ~np.isin(key, between)
    key, charts = key[cut], charts[cut]
    edges, pair = paired(key), np.unique(pair_keys(*charts.T), return_inverse=True)[1].ravel()
    # Runs of edges that hang together, of every two charts by themselves.
    run = edge_runs(pair[:, None] * len(search.surface.positions) + edges)
    length, side = np.bincount(run, edge_lengths(search.surface.positions, edges)), np.sqrt(last.area)
    found = dict[frozenset[int], Border]()
    for k in np.argsort(-length, kind="stable"):
        two = frozenset(charts[run == k][0].tolist())
        if two not in found:
            found[two] = Border(two, edges[run == k], float(length[k]), float(length[k] / side[list(two)].min()))
    return list(found.values())


def _between(charts: list[Chart]) -> tuple[np.ndarray, np.ndarray]:
    """Keys (k,) of the edges between two charts, and the numbers of these (k,2), the lower first."""
    outlines = [outline(chart) for chart in charts]
    key, owner = np.concatenate(outlines), np.repeat(np.arange(len(outlines)), [len(one) for one in outlines])
    order = np.lexsort((owner, key))
    key, owner = key[order], owner[order]
    both = np.flatnonzero((key[1:] == key[:-1]) & (owner[1:] != owner[:-1]))
    return key[both], np.stack([owner[both], owner[both + 1]], axis=1)


def _may_join(last: Round, border: Border) -> bool:
    """Whether a border is no neck, and the charts beside it are sheared, but not so much that together they would miss
    the bound."""
    two = list(border.charts)
    if border.width <= NECK or border.length <= SHORT * np.sqrt(last.area.sum()) or last.mean[two].min() <= UNSHEARED:
        return False
    shear = last.area[two] @ np.log(last.mean[two]) / last.area[two].sum()
    return bool(shear <= SHEARED * np.log(last.bound))


def _with_image(
    border: Border, borders: list[Border], charts: list[Chart], images: MirrorImages | None
) -> list[Border]:
    """The border, and that of the mirror images of its charts where there is another."""
    if images is None:
        return [border]
    of_charts, count = [chart.vertex_ids[chart.triangles].ravel() for chart in charts], len(images.nearest)
    owner = np.repeat(np.arange(len(charts)), [len(one) for one in of_charts])
    at = csr_matrix((np.ones(len(owner)), (owner, np.concatenate(of_charts))), shape=(len(charts), count))
    # The chart with most corners where the images of those of another are.
    there = [at @ np.bincount(images.nearest[of_charts[k]], minlength=count) for k in border.charts]
    image = frozenset(int(np.argmax(one)) for one in there)
    return [border, *(one for one in borders if one.charts == image and image != border.charts)]


def _is_sound(search: ShearSearch, last: Round, new: Round) -> bool:
    """Whether a new round has fewer charts than the last, and those that are new keep the bound and stay whole."""
    axes = search.shear.preferences.axes
    up, whole = None if axes is None else axes.up, float(last.area.sum()) + search.shear.beside
    before = {np.sort(chart.faces).tobytes() for chart in last.charts}
    changed = [k for k, chart in enumerate(new.charts) if np.sort(chart.faces).tobytes() not in before]
    return len(new.charts) < len(last.charts) and all(
        new.maps[k].failure is None
        and new.pressing[k] <= new.bound
        and not may_come_apart(new.charts[k], new.maps[k].uv, up, whole)
        for k in changed
    )
