"""Turn islands as an artist lays them: edges along the axes, and up in the world up in the map.

The direction of an island's edges is the one, up to quarter turns, in which most length of polygon sides lies. Up in
the map is the mean gradient of the height over the island; what was opened along its belly has its back upright.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.charts import Chart
from ..mesh.geometry import cross3, dot3, face_normals, part_by_part, signed_areas
from ..mesh.topology import halfedges, pair_keys, pair_up

# Directions of edges, up to quarter turns, are counted in so many bins of half a degree.
BINS = 180
# Edges that differ from a direction by so many bins at most lie along it: 1.5 degrees.
NEAR = 3
# Share of the length of all sides along one direction that makes it the direction of an island. Directions without
# any order put 0.04 there, three families of parallel edges 0.33, hand-made grids 0.5 and more.
DOMINANT = 0.3
# Share of the outline along one direction from which on the outline alone decides: squares, nets. With less it does
# where it is clearer than all sides are, among which are the diagonals of what came in triangles.
STRAIGHT = 0.5
# Edges that fold by more, in radians, are creases; these and the outline have a direction with this share along it.
CREASE = np.radians(10)
CREASED = 0.25
# Heights have a direction in the map where their gradients add up to this share of what they would in parallel, ...
PARALLEL = 0.1
# ... and are this steep in the mean, next to an upright wall.
STEEP = 0.1
# What rises from two sides does so that much more, squared, across its ridge than along it.
RIDGED = 3.0
# One end of a ridge is higher where heights and places along it have this correlation.
HIGHER = 0.02
# Level directions say how an island lies where their gradients are so many times as parallel as those of the height.
TELLING = 1.25
# The axes of what is its own mirror image are told where one is longer by so much, next to both, squared.
UNEVEN = 0.1
QUARTER = np.pi / 2


@dataclass(frozen=True)
class _Islands:
    """Islands in arrays of their own: points (n,3), uv (n,2), triangles (m,3), polygons (m,) and owner (m,), of `count`
    islands; no two share a vertex or a polygon."""

    points: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray
    polygons: np.ndarray
    owner: np.ndarray
    count: int


def turn_upright(
    charts: Sequence[Chart],
    maps: Sequence[np.ndarray],
    up: Sequence[Sequence[float]],
    viewers: Sequence[Sequence[float]] | None = None,
) -> list[np.ndarray]:
    """Maps (n_i,2) of charts, each turned about the origin so that it lies straight, with `up` (3,) upwards.

    Where most of the heights cancel, the ridge that the island rises to from two sides is upright, its higher end up;
    where there is none, or the island lies level, away from the viewer and to his right stand for `up`; viewers: the
    direction (3,) to that of each, by default along an axis of space. An island without a direction of
    edges is turned until its mean `up` is upright; one without either keeps its turn up to quarters.
    """
    if not maps:
        return []
    seen = None if viewers is None else np.asarray(viewers, dtype=float)
    angle = upright_angles(_together(charts, maps), np.asarray(up, dtype=float), seen)
    c, s = np.cos(angle), np.sin(angle)
    turns = np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)
    return [uv @ turn for uv, turn in zip(maps, turns, strict=True)]


def upright_angles(islands: _Islands, up: np.ndarray, viewers: np.ndarray | None = None) -> np.ndarray:
    """Angle (k,) by which to turn each island counterclockwise, for its direction `up` (k,3) in space and those to the
    viewers (k,3)."""
    share, edges = _edge_directions(islands)
    upward = _upward(islands, up, viewers)
    defined = np.isfinite(upward)
    straight = share >= DOMINANT
    # From the edges' direction to the vertical, by the number of quarters that leaves up nearest to it.
    snapped = QUARTER - edges
    error = np.where(defined, upward, QUARTER) + snapped - QUARTER
    snapped = snapped - QUARTER * np.round(error / QUARTER)
    free = np.where(defined, QUARTER - upward, 0.0)
    return np.where(straight, np.where(defined, snapped, -_least_turn(edges)), free)


def _least_turn(direction: np.ndarray) -> np.ndarray:
    """Directions (k,) up to quarter turns, as the angle nearest to 0."""
    return direction - QUARTER * np.round(direction / QUARTER)


def _together(charts: Sequence[Chart], maps: Sequence[np.ndarray]) -> _Islands:
    sizes = np.array([len(c.triangles) for c in charts])
    first_vertex = np.cumsum([0, *(len(c.vertices) for c in charts)])[:-1]
    owner = np.repeat(np.arange(len(charts)), sizes)
    polygons = np.concatenate([c.faces for c in charts])
    # Charts of several surfaces may have polygons of the same number.
    _, polygons = np.unique(owner * (int(polygons.max(initial=0)) + 1) + polygons, return_inverse=True)
    return _Islands(
        points=np.concatenate([c.vertices for c in charts]),
        uv=np.concatenate(list(maps)),
        triangles=np.concatenate([c.triangles for c in charts]) + first_vertex[owner][:, None],
        polygons=polygons,
        owner=owner,
        count=len(charts),
    )


def _edge_directions(islands: _Islands) -> tuple[np.ndarray, np.ndarray]:
    """Share (k,) of the length of sides along one direction up to quarter turns, and that direction (k,).

    Sides are those of the outline where it is straight enough or straighter, else those of all polygons; where neither
    have a direction those of the outline and creases: long polygons of machined parts came in triangles of any shape.
    """
    tail, head = halfedges(islands.triangles)
    face = np.repeat(islands.polygons, 3)
    first, second = pair_up(pair_keys(tail, head))
    outline = np.ones(len(tail), dtype=bool)
    outline[first] = outline[second] = False
    side = outline.copy()
    side[first] = face[first] != face[second]
    (share, direction), (straight, along) = (_main_direction(islands, tail, head, x) for x in (side, outline))
    own = straight >= np.minimum(np.maximum(share, DOMINANT), STRAIGHT)
    share, direction = np.where(own, straight, share), np.where(own, along, direction)
    askew = share < DOMINANT
    if not askew.any():
        return share, direction
    normal, creased = face_normals(islands.points, islands.triangles), outline.copy()
    creased[first] = dot3(normal[first // 3], normal[second // 3]) < np.cos(CREASE)
    folded, crease = _main_direction(islands, tail, head, creased)
    bent = askew & (folded >= CREASED)
    return np.where(bent, DOMINANT, share), np.where(bent, crease, direction)


def _main_direction(islands: _Islands, tail, head, side: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share (k,) of the length of the halfedges `side` (3m,) bool along one direction, and that direction (k,)."""
    owner = np.repeat(islands.owner, 3)[side]
    along = islands.uv[head[side]] - islands.uv[tail[side]]
    length = np.hypot(*along.T)
    angle = np.mod(np.arctan2(along[:, 1], along[:, 0]), QUARTER)
    cell = np.minimum((angle * (BINS / QUARTER)).astype(np.int64), BINS - 1)
    counts = np.bincount(owner * BINS + cell, length, islands.count * BINS).reshape(-1, BINS)
    total = np.maximum(counts.sum(axis=1), np.finfo(float).tiny)
    near = np.sum([np.roll(counts, shift, axis=1) for shift in range(-NEAR, NEAR + 1)], axis=0)
    # Of bins with the same edges around them the one that has most itself.
    best = np.argmax(near + 1e-6 * counts, axis=1)
    share = near[np.arange(islands.count), best] / total
    # The mean of four times the angle, of the edges near the best bin.
    off = np.abs(np.mod(cell - best[owner] + BINS // 2, BINS) - BINS // 2)
    weight = np.where(off <= NEAR, length, 0.0)
    x, y = (np.bincount(owner, weight * f(4 * angle), islands.count) for f in (np.cos, np.sin))
    return share, np.arctan2(y, x) / 4


def _upward(islands: _Islands, up: np.ndarray, viewers: np.ndarray | None) -> np.ndarray:
    """Direction (k,) in the map in which the islands rise in space; nan for those that do not rise anywhere."""
    area = signed_areas(islands.uv, islands.triangles)
    whole = np.maximum(np.bincount(islands.owner, np.abs(area), islands.count), np.finfo(float).tiny)
    upward, level = np.full(islands.count, np.nan), []
    # A wall rises by 1 per length where the map is as large as the surface.
    for k, axis in enumerate((up, *_level(up, viewers))):
        given = (islands.triangles, islands.owner, area)
        rises = part_by_part(lambda *some, axis=axis: _rises(islands, axis, *some), *given)
        rise, height = rises[:, :2], rises[:, 2]
        total = np.stack([np.bincount(islands.owner, rise[:, d], islands.count) for d in range(2)], axis=1)
        size = np.bincount(islands.owner, np.hypot(*rise.T), islands.count)
        steep = size >= STEEP * whole
        parallel = np.hypot(*total.T) / np.maximum(size, np.finfo(float).tiny)
        sure = (parallel >= PARALLEL) & steep
        upward = np.where(np.isnan(upward) & sure, np.arctan2(total[:, 1], total[:, 0]), upward)
        if k == 0:
            ridge = np.where(steep, _along_ridge(islands, area, height, rise), np.nan)
            # Level directions tell more of what rises from two sides.
            rising = np.where(sure, parallel, np.where(np.isfinite(ridge), 0.0, np.inf))
            upward = np.where(np.isnan(upward), ridge, upward)
        else:
            level.append((total, parallel))
    totals, parallels = (np.stack(part, axis=-1) for part in zip(*level, strict=True))
    told = parallels.max(axis=1) > TELLING * rising
    return np.where(told, _straightened(upward, totals), upward)


def _straightened(upward: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Directions (k,) along the axes of what is its own mirror image, by the sums (k,2,2) of the gradients of two level
    directions of space: those across its plane and along it are at right angles, in the map as in space. Where neither
    is much greater than the other, any two are, and a direction stays as it is."""
    xx, xy, yy = ((level[:, i] * level[:, j]).sum(axis=1) for i, j in ((0, 0), (0, 1), (1, 1)))
    mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    turn = _least_turn(0.5 * np.arctan2(2 * xy, xx - yy) - upward)
    return upward + np.where(half > UNEVEN * mean, turn, 0.0)


def _rises(
    islands: _Islands, axis: np.ndarray, triangles: np.ndarray, owner: np.ndarray, area: np.ndarray
) -> np.ndarray:
    """Gradients in the map of the heights along `axis` (k,3) of the islands `owner` (m,), times the areas (m,) of
    triangles (m,3), and the mean heights of these: (m,3)."""
    corner = islands.uv[triangles]
    # Gradient times area, from the heights at the corners and the sides across from them, turned.
    side = 0.5 * (corner[:, [2, 0, 1]] - corner[:, [1, 2, 0]])
    normal = np.stack([-side[..., 1], side[..., 0]], axis=-1)
    height = np.einsum("mkd,md->mk", islands.points[triangles], axis[owner])
    rise = np.einsum("mk,mkd->md", height, normal) * np.sign(area)[:, None]
    return np.column_stack([rise, height.mean(axis=1)])


def _along_ridge(islands: _Islands, area: np.ndarray, height: np.ndarray, rise: np.ndarray) -> np.ndarray:
    """Direction (k,) in the map of the ridge that islands rise to from two sides, towards its higher end; nan for those
    that rise from all sides. area, height (m,), rise (m,2) : the gradient of the height times the area, of triangles"""
    size = np.maximum(np.abs(area), np.finfo(float).tiny)

    def total(value: np.ndarray) -> np.ndarray:
        return np.bincount(islands.owner, value, islands.count)

    xx, xy, yy = (total(rise[:, i] * rise[:, j] / size) for i, j in ((0, 0), (0, 1), (1, 1)))
    across = 0.5 * np.arctan2(2 * xy, xx - yy)
    mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    ridge = np.stack([-np.sin(across), np.cos(across)], axis=1)
    place = np.einsum("md,md->m", islands.uv[islands.triangles].mean(axis=1), ridge[islands.owner])
    whole = np.maximum(total(size), np.finfo(float).tiny)
    place, height = (x - (total(size * x) / whole)[islands.owner] for x in (place, height))
    higher = total(size * place * height)
    spread = np.sqrt(total(size * place**2)) * np.sqrt(total(size * height**2))
    ridge *= np.where(higher < 0, -1, 1)[:, None]
    found = (mean + half >= RIDGED * (mean - half)) & (np.abs(higher) >= HIGHER * spread)
    return np.where(found, np.arctan2(ridge[:, 1], ridge[:, 0]), np.nan)


def _level(up: np.ndarray, viewers: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Two level directions (k,3) each, away from the viewer and to the right, as seen from above with `up` (k,3)."""
    away = np.eye(3)[np.where(np.abs(up[:, 1]) < np.abs(up).max(axis=1), 1, 2)] if viewers is None else -viewers
    right = cross3(away, up)
    size = np.linalg.norm(right, axis=1, keepdims=True)
    right /= np.where(size > 0, size, 1)
    return cross3(up, right), right
