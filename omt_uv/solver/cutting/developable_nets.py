"""Cut bodies with flat or developable sides to nets, through all their corners: they unroll without distortion.

A cube, a cylinder, a bracket: what curvature there is sits on vertices of hard edges, and a cut through all of these,
along the hard edges where it can, leaves none. On smooth bodies no cut does that, see `protrusions`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..analysis.feature_edges import fold_angles
from ..maps.contacts import lies_apart
from ..maps.development import developed
from ..maps.overlap import overlap_exceeds
from ..mesh.geometry import as_points, face_areas
from .component import CutComponent
from .cut_graph import cut_classes, greedy_arcs
from .hard_surface import CURVED, net_factors, rounded_corners

# An edge at which the normal turns by more is hard. Prisms with 4, 5, 6 and 8 sides are clear of it.
HARD = np.radians(52)
# On bodies with rounded edges, one at which it turns by more: the bands that are bevels, not the flat sides.
BENT = np.radians(5)
# A fold belongs to a bevel if its radius is at most that share of the side of a square with the area of the body.
TIGHT = 0.05
# A vertex with less curvature, in radians, is flat. Those of hard edges that are many, and have much of it together
# alone, as around a cap of thousands of sides, are flat if they have less than this share of their mean.
FLAT = 1e-3
FLATTER = 0.1
# Vertices off the hard edges may count as corners if they have so much curvature, in radians, as the tip of a cone has,
# and are so many at most.
SPIKE = 0.75
MOST_SPIKES = 4
# Curvature that may be left, in radians, summed without sign.
MOST_LEFT = 0.3
# A net is worth its seams up to this many times the side of a square with the area of the surface.
LONGEST = 5.0
# Nets that lie on themselves are drawn anew so many times, on components of so many triangles at most, with costs whose
# logarithms vary by so much. What is covered twice by more than a share of the area counts: few samples see what is
# much, as it is on most nets of large bodies, and more of them what is less; less than the last share is rounding.
NETS = 24
MOST_TRIANGLES = 20_000
VARIED = 0.5
MUCH = 2e-2
COVERED = ((500, MUCH), (2_500, 4e-3), (10_000, 1e-3))
# Edges within flat or developable sides count so many times, which leaves these in one component.
ACROSS = 1.5
# A net to more corners whose slits are longer, next to the side of a square with the area of the surface, is a comb.
TEETH = 12
LONG_TEETH = 1.0
# One to as many corners that are hardly curved winds if they turn by less than this share of what they do in all.
WINDS = 0.5


@dataclass(frozen=True)
class Net:
    """A cut (e,) bool that unrolls a component through its corners tips (k,), the shortest by the cost (e,) of edges,
    which may lay the component on itself; held (k,) : the curvature at each corner, in radians, or at
    least so much around it."""

    component: CutComponent
    cut: np.ndarray
    tips: np.ndarray
    cost: np.ndarray
    held: np.ndarray

    @property
    def length(self) -> float:
        """Of all edges of the cut."""
        return float(self.component.length[self.cut].sum())

    @property
    def most(self) -> float:
        """The length up to which a net is worth its seams."""
        return LONGEST * float(np.sqrt(face_areas(self.component.positions, self.component.triangles).sum()))

    def up_to(self, length: float) -> Net | None:
        """This net, spread out, if it is at most so long; None otherwise."""
        # Nets that do not lie on themselves are looked for where one of them may be taken.
        found = self.spread_out() if self.length <= length else self
        return found if found.length <= length else None

    @property
    def has_teeth(self) -> bool:
        """Whether this net goes to so many vertices that it may be a comb."""
        return len(self.tips) > TEETH

    def is_comb(self, needed: float) -> bool:
        """Whether this net is a slit at every segment of a band, as along the bevel of an end: to many vertices, and
        long beyond the length that is needed anyway. Around the corners of a lid slits are short."""
        side = float(np.sqrt(face_areas(self.component.positions, self.component.triangles).sum()))
        return self.has_teeth and self.length - needed > LONG_TEETH * side

    @property
    def winds(self) -> bool:
        """Whether this net goes to so many corners that are hardly curved, to either side: along a border of cloth."""
        slight = self.held[np.abs(self.held) < CURVED]
        return len(slight) > TEETH and bool(abs(slight.sum()) < WINDS * np.abs(slight).sum())

    def spread_out(self) -> Net:
        """This net or, where the component laid flat along it lies on itself, the shortest of some others along which
        it does not."""
        component, cost = self.component, self.cost
        if len(component.triangles) > MOST_TRIANGLES or not _covers_itself(component, self.cut):
            return self
        random = np.random.default_rng(0)
        varied = [cost * np.exp(VARIED * random.standard_normal(len(cost))) for _ in range(NETS)]
        cuts = [greedy_arcs(replace(component, cost=one), self.tips) for one in varied]
        cuts.sort(key=lambda cut: cost[cut].sum())
        return replace(self, cut=next((cut for cut in cuts if not _covers_itself(component, cut)), self.cut))


def net(component: CutComponent) -> Net | None:
    """The shortest net of a component.

    None if it has none, or if seams would pass through vertices to be kept free of them.
    """
    signed, area = defects(component), face_areas(component.positions, component.triangles)
    curvature = np.abs(signed)
    fold = np.abs(fold_angles(component.positions, component.triangles, component.pair))
    folded = fold > HARD
    hard = np.zeros(component.vertex_count, dtype=bool)
    hard[component.ends[folded]] = True
    spike = ~hard & (curvature > SPIKE)
    corner = (hard & (curvature > _flat(curvature[hard]))) | spike
    tips, enter = np.flatnonzero(corner), np.zeros(len(fold))
    if component.vertex_count - len(component.pair) + len(component.triangles) == 2:
        # The wall of a coin shall not become flaps: it is left at no less than what an edge around it costs. Walls of
        # holes are left by the shortest way: whole they would lie on what is around them.
        least = np.full(component.vertex_count, np.inf)
        np.minimum.at(least, component.ends[folded].ravel(), np.repeat(component.cost[folded], 2))
        enter = np.where(hard[component.ends].all(axis=1), least[component.ends].min(axis=1), 0.0)
    if spike.sum() > MOST_SPIKES or curvature[~corner].sum() > MOST_LEFT:
        found = rounded_corners(component, signed, area)
        folded, enter = fold > BENT, np.zeros(len(fold))
        tips = np.zeros(0, np.int64) if found is None else found
        signed = np.full(len(signed), CURVED)
    # A closed surface needs a cut of two edges at least.
    if len(tips) < 3 or (component.avoid[tips] > 0).any():
        return None
    cost = np.where(folded, component.cost, ACROSS * component.cost + enter) * net_factors(component, folded)
    return Net(component, greedy_arcs(replace(component, cost=cost), tips), tips, cost, signed[tips])


def tight_edges(component: CutComponent, fold: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of bevels: with folds (e,) of a radius that is small for the body, however many they are."""
    _, polygon = np.unique(component.polygons, return_inverse=True)
    area = np.bincount(polygon.ravel(), face_areas(component.positions, component.triangles))
    width = area[polygon.ravel()[component.pair // 3]].min(axis=1) / np.maximum(component.length, 1e-30)
    return (fold > BENT) & (width < TIGHT * np.sqrt(area.sum()) * fold)


def _covers_itself(component: CutComponent, cut: np.ndarray) -> bool:
    """Whether the component covers itself where it is laid flat, open along the cut (e,) bool."""
    corners = cut_classes(component, cut)
    positions = np.zeros((int(corners.max()) + 1, 3))
    positions[corners.ravel()] = component.positions[component.triangles.ravel()]
    flat, gap = developed(positions, corners, across_long=True)
    # What is not quite flat is laid somewhere else by its map.
    if gap.max() > FLAT * np.abs(flat).max() or lies_apart(flat, corners):
        return False
    return overlap_exceeds(as_points(flat)[corners], COVERED)


def defects(component: CutComponent) -> np.ndarray:
    """Curvature (n,) of the vertices, in radians, 0 on the boundary."""
    return np.where(component.on_boundary(), 0.0, component.curvature)


def _flat(curvature: np.ndarray) -> float:
    """The curvature below which a vertex of hard edges is flat, of all of theirs (k,)."""
    little = curvature[curvature <= FLAT]
    return FLATTER * little.mean() if little.sum() > MOST_LEFT else FLAT
