"""Tell the front of a body from its back: the front is where a face has its eyes, nose and mouth.

The most salient parts near the mirror plane of a head or a body lie to its front. Ears, on the sides, count little, and
what lies to both sides of the plane cancels out. What stands high counts, too: a beast has its head above its feet and
its rump. Where that says little, the front is where the scene is seen from: artists model what looks at them in the
front view.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..errors import WeightError
from ..mesh.geometry import face_areas, unit, vertex_areas, vertex_normals
from .occlusion import in_view
from .symmetry_plane import SymmetryPlane
from .vertex_scores import soft_weights

# Shares of the area with less saliency than what is looked at, and than what counts fully.
SALIENT = (0.9, 0.99)
# How far off the middle, over the size, salient parts lie of a body that clearly has a front, and of one that has none.
CLEAR = 0.06
NONE = 0.02
# How far off the middle, over the size, salient parts would have to lie to speak against the front view.
FRONT_VIEW = 0.045
# Share of the area that stands high, and what its place counts next to that of salient parts.
HIGH = 0.25
HEAD = 0.4
# How far ahead of the middle, over the size, high parts lie of a body that holds its head up and ahead, and of others;
# and the shares of the area below where such a head begins, and where all is head.
BEAST = (0.06, 0.11)
NECK = (0.5, 0.75)
# Certainty that a body without a mirror plane has at most.
UNSURE = 0.5
# A mirror plane whose normal rises more than this sine is no upright one: what was told to be up is not.
LEANING = 0.3
# A head is higher than deep. One that lies is lower than this share of its depth, its face is by this factor more
# salient than what it shows to all sides, and on a face no body rests on a flat place with this share of its hull.
LOW = 0.9
MORE_SALIENT = 1.2
RESTING = 0.05
# A figure stands on two legs: nothing lies between them on its mirror plane, from one end on over a share of its length
# between these, and it is more than twice as long as deep.
LEGS = (0.15, 0.7)
LONG = 0.5
# A beast stands on flat feet, or hooves, with a gap between that is shorter, and has none where it looks to.
HOOVES = (0.1, 0.7)
WHOLE = 0.05
# Certainty that a figure looks at who sees it in the front view, where what stands out does not tell otherwise.
FIGURE = 0.8
# The feet of a beast are its lowest share. Its head is ahead of them, with such a share of its area, and so many times
# as much as is behind them.
FEET = 0.12
OVERHANG = (0.1, 4.0)
# A figure's head is its highest share, and has its face on the side that shows so many times as much as the other.
CROWN = 0.18
FACE = 3.0
# How far what is flat may lean, and be off what is below, in radians.
FLAT = np.pi / 18
TILTED = np.pi / 5
# How far the rotations of axes to one another are off whole numbers.
WHOLE_TURN = 1e-6


@dataclass(frozen=True)
class SceneAxes:
    """How a surface stands in the scene.

    Attributes
    ----------
    up (3,) : the direction of its positions that is up
    viewer (3,) : the one from which the front view is seen
    """

    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    viewer: tuple[float, float, float] = (0.0, -1.0, 0.0)

    @property
    def frame(self) -> np.ndarray:
        """What positions (n,3) are to be multiplied by to stand as `Y_UP` does; 0 and 1 alone where that will do."""
        up = unit(np.array(self.up, float))
        viewer = unit(np.array(self.viewer, float) - (up @ self.viewer) * up)
        rotation = np.column_stack([np.cross(up, viewer), up, viewer])
        # Matrices of objects are in single precision.
        whole = np.rint(rotation)
        return whole if np.abs(rotation - whole).max() < WHOLE_TURN else rotation

    def turned_by(self, rotation: np.ndarray) -> SceneAxes:
        """The axes of positions (n,3) that were multiplied by a rotation (3,3)."""
        x, y, z = (np.array([self.up, self.viewer], float) @ rotation).T.tolist()
        return SceneAxes((x[0], y[0], z[0]), (x[1], y[1], z[1]))


Z_UP = SceneAxes()
# Of files whose coordinates are taken as they are, in formats in which Y is up by custom, and of `SceneAxes.frame`.
Y_UP = SceneAxes(up=(0.0, 1.0, 0.0), viewer=(0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Facing:
    """Where a body looks to.

    Attributes
    ----------
    front (3,) : unit vector, 0 where there is no telling
    up (3,) : unit vector, 0 where it is not known
    certainty : in [0, 1], of the front
    beast : in [0, 1], whether its head is all that has a face, held up and ahead, as beasts do
    """

    front: np.ndarray
    up: np.ndarray
    certainty: float
    beast: float = 0.0


def facing(
    positions: np.ndarray,
    triangles: np.ndarray,
    saliency: np.ndarray,
    plane: SymmetryPlane | None,
    axes: SceneAxes | None = None,
) -> Facing:
    """Where a body of unit size (n,3), (m,3) with saliency (n,) looks to; of the plane the normal alone counts.

    axes : how it stands in the scene, if that is known. A mirror plane that is not upright speaks against it.
    """
    up, viewer = (np.zeros(3),) * 2 if axes is None else (unit(np.array(v, float)) for v in (axes.up, axes.viewer))
    if plane is None and axes is None:
        return Facing(np.zeros(3), up, 0.0)
    if plane is not None and abs(plane.normal @ up) > LEANING:
        up = viewer = np.zeros(3)
    near = area = vertex_areas(positions, triangles)
    if plane is not None:
        near = area * _near(positions, area, plane)
    high = np.zeros(3)
    if up.any():
        # Feet and tails are salient, too.
        below = _below(positions, area, up)
        near, high = near * below, _off_the_middle(positions, area, below)
    eyes = near * salient_weights(saliency, area, SALIENT)
    off = FRONT_VIEW * viewer + HEAD * high
    if eyes.sum() > 0:
        off = off + eyes @ positions / eyes.sum() - near @ positions / near.sum()
    if plane is not None:
        off -= (off @ plane.normal) * plane.normal
    if up.any():
        off -= (off @ up) * up
    certainty = float(np.clip((np.linalg.norm(off) - NONE) / (CLEAR - NONE), 0, 1 if plane is not None else UNSURE))
    if plane is not None and up.any():
        told = _told_by_shape(positions, triangles, saliency, plane, SceneAxes(tuple(up), tuple(viewer)), off)
        certainty, off = (certainty, off) if told is None else (max(certainty, FIGURE), told)
    front = unit(off) if certainty else np.zeros(3)
    return Facing(front, up, certainty, float(np.clip((high @ front - BEAST[0]) / (BEAST[1] - BEAST[0]), 0, 1)))


def _told_by_shape(
    positions: np.ndarray,
    triangles: np.ndarray,
    saliency: np.ndarray,
    plane: SymmetryPlane,
    axes: SceneAxes,
    off: np.ndarray,
) -> np.ndarray | None:
    """Where (3,) a body that stands looks to by how it stands: a beast where it overhangs its feet, a figure where its
    head has a face, and what is higher than deep to who sees it, if what stands out, off (3,), speaks not against it.
    None where that does not tell."""
    up, viewer = np.array(axes.up), np.array(axes.viewer)
    used = positions[triangles].reshape(-1, 3)
    there = unit(np.cross(up, plane.normal))
    there = there if there @ viewer >= 0 else -there
    height, depth = np.ptp(used @ up), np.ptp(used @ there)
    if depth > height:
        ahead_of = _overhangs(positions, triangles, plane, there, up)
        return ahead_of * there if ahead_of else None
    seen = there @ viewer > 1 - LEANING and off @ there >= 0
    if depth < LONG * height and _legs(positions, triangles, plane, -up, LEGS) > 0:
        here, behind = _salient_views(
            positions, triangles, saliency, plane, np.stack([there, -there]), _on_top(positions, triangles, up)
        )
        if behind > FACE * here:
            return -there
        return there if here > FACE * behind or seen else None
    return there if depth < LOW * height and seen else None


def _overhangs(
    positions: np.ndarray, triangles: np.ndarray, plane: SymmetryPlane, ahead: np.ndarray, up: np.ndarray
) -> int:
    """Whether a body on legs has much more before its feet than behind these along a direction (3,): 1; the other way
    round: -1; neither, or no legs: 0. Heads are ahead of forefeet, rumps are above hind feet."""
    if _legs(positions, triangles, plane, -up, HOOVES) <= 0:
        return 0
    area, along, height = vertex_areas(positions, triangles), positions @ ahead, positions @ up
    used = area > 0
    feet = along[used & (height < height[used].min() + FEET * np.ptp(height[used]))]
    before, behind = (area[beyond].sum() / area.sum() for beyond in (along > feet.max(), along < feet.min()))
    least, most = sorted((before, behind))
    if most < max(OVERHANG[0], OVERHANG[1] * least):
        return 0
    return 1 if before > behind else -1


def _on_top(positions: np.ndarray, triangles: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Triangles (m,) bool that are in the highest part of a body."""
    height = (positions @ up)[triangles]
    return height.min(axis=1) >= height.max() - CROWN * np.ptp(height)


def standing(
    positions: np.ndarray,
    triangles: np.ndarray,
    saliency: np.ndarray,
    plane: SymmetryPlane | None,
    axes: SceneAxes | None,
) -> SceneAxes | None:
    """How a body of unit size (n,3), (m,3) with saliency (n,) stands: as was told, but for heads that lie on their back
    or their face, and for what has legs and does not stand on these. Files do not say what is up, and of two that most
    have one is taken for the other.
    """
    if plane is None or axes is None:
        return axes
    up, viewer = (unit(np.array(v, float)) for v in (axes.up, axes.viewer))
    if abs(plane.normal @ viewer) > LEANING:
        return axes
    viewer = unit(viewer - (plane.normal @ viewer) * plane.normal)
    on_its_side = abs(plane.normal @ up) > LEANING
    up = np.cross(viewer, plane.normal) if on_its_side else up
    up = unit(up - (up @ plane.normal) * plane.normal - (up @ viewer) * viewer)
    # Set up, its head or its feet are where the viewer was.
    legs = _stands_on(positions, triangles, plane, viewer, up)
    if legs:
        return SceneAxes(tuple(-legs * viewer), axes.up if on_its_side else tuple(legs * up))
    used = positions[triangles].reshape(-1, 3)
    if on_its_side or np.ptp(used @ up) > LOW * np.ptp(used @ viewer):
        return axes
    above, below, *around = _salient_views(positions, triangles, saliency, plane, np.array([up, -up, viewer, -viewer]))
    if above > max(below, MORE_SALIENT * max(around)):
        return SceneAxes(tuple(-viewer), tuple(up))
    if below > MORE_SALIENT * max(around) and _flat_share(used, -up, viewer) < RESTING:
        return SceneAxes(tuple(viewer), tuple(-up))
    return axes


def _stands_on(
    positions: np.ndarray, triangles: np.ndarray, plane: SymmetryPlane, ahead: np.ndarray, up: np.ndarray
) -> int:
    """Whether what a body that lies would stand on, two legs or four, is ahead (3,): 1; behind: -1; or nowhere: 0."""
    used = positions[triangles].reshape(-1, 3)
    if np.ptp(used @ up) < LONG * np.ptp(used @ ahead):
        return _legs(positions, triangles, plane, ahead, LEGS)
    legs = _legs(positions, triangles, plane, ahead, HOOVES)
    if not legs or max(_gaps(positions, triangles, plane, up)) >= WHOLE:
        return 0
    return legs if _flat_share(used, legs * ahead, up) >= RESTING else 0


def _legs(
    positions: np.ndarray, triangles: np.ndarray, plane: SymmetryPlane, ahead: np.ndarray, gap: tuple[float, float]
) -> int:
    """Whether legs of a body, with a gap between them of such a share of its length, are ahead (3,): 1; behind: -1; or
    whether it has none along there: 0."""
    behind, before = _gaps(positions, triangles, plane, ahead)
    least, most = sorted((behind, before))
    if not (gap[0] <= most <= gap[1] and least < gap[0]):
        return 0
    return 1 if before > behind else -1


def _gaps(positions: np.ndarray, triangles: np.ndarray, plane: SymmetryPlane, ahead: np.ndarray) -> tuple[float, float]:
    """Shares of the length of a body along a direction (3,) from its rear and front ends on with nothing on its mirror
    plane."""
    height = _depth(positions, vertex_areas(positions, triangles), plane)[triangles]
    along = (positions @ ahead)[triangles]
    across = (height.min(axis=1) <= 0) & (height.max(axis=1) >= 0)
    low, high = along.min(), along.max()
    if not across.any() or high <= low:
        return 1.0, 1.0
    return float((along[across].min() - low) / (high - low)), float((high - along[across].max()) / (high - low))


def _salient_views(
    positions: np.ndarray,
    triangles: np.ndarray,
    saliency: np.ndarray,
    plane: SymmetryPlane,
    directions: np.ndarray,
    part: np.ndarray | None = None,
) -> list[float]:
    """How salient (d,) what a body, or a part (m,) bool of it, shows in the middle of its views from directions (d,3)
    within its mirror plane is: a face, and no outline of a crown or a neck."""
    part = np.ones(len(triangles), bool) if part is None else part
    area, areas = vertex_areas(positions, triangles[part]), face_areas(positions, triangles) * part
    near = _near(positions, vertex_areas(positions, triangles), plane)
    eyes = near * salient_weights(saliency, area, SALIENT)
    found = []
    for direction, shown in zip(directions, in_view(positions, triangles, directions), strict=True):
        across = (positions @ np.cross(direction, plane.normal))[triangles].mean(axis=1)
        weight = areas * shown
        if not weight.any():
            found.append(0.0)
            continue
        off = across - weight @ across / weight.sum()
        weight = weight * np.exp(-0.5 * off**2 * weight.sum() / max(weight @ off**2, np.finfo(float).tiny))
        total = weight @ near[triangles].mean(axis=1)
        found.append(float(weight @ eyes[triangles].mean(axis=1) / max(total, np.finfo(float).tiny)))
    return found


def _flat_share(points: np.ndarray, direction: np.ndarray, ahead: np.ndarray) -> float:
    """The share of the area of the convex hull of points (k,3) that is flat and about across a direction (3,), to which
    it may lean towards what is ahead (3,) or away from that."""
    try:
        hull = ConvexHull(points)
    except QhullError:  # Flat as a whole.
        return 1.0
    area, normal = face_areas(hull.points, hull.simplices), hull.equations[:, :3]
    lean = np.linspace(-TILTED, TILTED, 15)[:, None]
    directions = np.cos(lean) * direction + np.sin(lean) * ahead
    return float(((normal @ directions.T > np.cos(FLAT)).T @ area).max() / area.sum())


def _near(positions: np.ndarray, area: np.ndarray, plane: SymmetryPlane) -> np.ndarray:
    """How near vertices (n,3) with areas (n,) are to a plane through their middle, (n,) in [0, 1]."""
    depth = _depth(positions, area, plane)
    return np.exp(-0.5 * depth**2 * area.sum() / (area @ depth**2))


def _depth(positions: np.ndarray, area: np.ndarray, plane: SymmetryPlane) -> np.ndarray:
    """How far off a plane through their middle vertices (n,3) with areas (n,) lie, (n,): of it the normal counts."""
    return (positions - area @ positions / area.sum()) @ plane.normal


def with_a_face(positions: np.ndarray, triangles: np.ndarray, seen: Facing) -> np.ndarray:
    """How far the vertices (n,) of a surface (n,3), (m,3) are on a part that has a face, in [0, 1]: all of a body, and
    of a beast its head."""
    if not seen.beast:
        return np.ones(len(positions))
    head = np.clip(
        (_below(positions, vertex_areas(positions, triangles), seen.up) - NECK[0]) / (NECK[1] - NECK[0]), 0, 1
    )
    return 1 - seen.beast * (1 - head)


def _below(positions: np.ndarray, area: np.ndarray, up: np.ndarray) -> np.ndarray:
    """The share (n,) of the areas (n,) of vertices (n,3) that is below each."""
    order = np.argsort(positions @ up, kind="stable")
    below = np.empty(len(order))
    below[order] = np.cumsum(area[order]) / area.sum()
    return below


def _off_the_middle(positions: np.ndarray, area: np.ndarray, below: np.ndarray) -> np.ndarray:
    """From the middle of vertices (n,3) with areas (n,) to that of what stands high among them; below: see `_below`."""
    high = area * np.clip((below - 1) / HIGH + 1, 0, 1)
    return high @ positions / max(high.sum(), np.finfo(float).tiny) - area @ positions / area.sum()


def towards(positions: np.ndarray, triangles: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """How far the vertices (n,) of a surface (n,3), (m,3) look and lie towards a direction (3,), in [-1, 1].

    The mean of the cosine of the normal and of `ahead`.
    """
    return 0.5 * (vertex_normals(positions, triangles) @ direction + ahead(positions, triangles, direction))


def ahead(positions: np.ndarray, triangles: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """How far the vertices (n,) of a surface (n,3), (m,3) lie along a direction (3,): 0 in the middle, 1 and -1 where
    they lie farthest."""
    area = vertex_areas(positions, triangles)
    along = (positions - area @ positions / area.sum()) @ direction
    used = area > 0
    ends = [max(float((sign * along[used]).max()), np.finfo(float).tiny) for sign in (1, -1)]
    return np.clip(along / np.where(along > 0, *ends), -1, 1)


def salient_weights(saliency: np.ndarray, area: np.ndarray, shares: tuple[float, float]) -> np.ndarray:
    """`soft_weights` (n,) of a saliency (n,) over areas (n,), 0 where it is the same everywhere."""
    try:
        return soft_weights(saliency, area, *shares)
    except WeightError:
        return np.zeros(len(saliency))
