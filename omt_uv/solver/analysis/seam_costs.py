"""Say where an artist would cut: a cost per length for every edge, low where a seam is hidden, high where it is seen.

What speaks for an edge or against it is a reason in [0, 1], and each has a factor: that of an edge of which it holds
fully. The factors of an edge multiply, within bounds, so that no seam becomes much longer than it has to be.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ZeroAreaFaceError
from ..mesh.geometry import halfedge_lengths, unit, vertex_areas
from ..mesh.gluing import polygon_sides
from ..mesh.surface import Surface, chosen_triangles, degenerate_triangles
from ..mesh.topology import graph_components, halfedges, pair_keys, pair_up, paired
from .facing import Facing, SceneAxes, ahead, facing, salient_weights, standing, towards, with_a_face
from .feature_edges import fold_angles
from .occlusion import hidden_sides, outside_out, vertex_occlusion
from .order_of_places import order_of_places
from .saliency import curvature_means, saliency_of, unit_size
from .symmetry_plane import NEAR, SymmetryPlane, symmetry_plane

# Bounds of the product of all factors.
LEAST = 0.2
MOST = 6.0
# Occlusion where an edge begins to be hidden, and where it is.
HIDDEN = (0.05, 0.5)
# Occlusion where an edge is not to be seen from the front any more, and where nothing of it is.
BURIED = (0.5, 0.9)
# Angles between faces that are smooth, and sharp, in radians.
SHARP = (np.pi / 6, np.pi / 2)
# Curvature of a valley, negative and over the size, where it begins and where it is a crease; a sphere has 3.5.
CREASE = (4.0, 20.0)
# The scale at which valleys are looked for, in the units of saliency.
CREASE_SCALE = 4.0
# How far a vertex looks and lies to a side, where the side begins, and where it is nothing else.
SIDE = (0.1, 0.6)
# Shares of the area with less saliency than what stands out, and than what counts fully.
SALIENT = (0.5, 0.95)
# Distance from the mirror plane, over the size, at which a seam no longer lies on it.
ON_PLANE = 0.02
# A mirror plane that is level, by the cosine of its normal and what is up, has to be so exact.
LEVEL = 0.95
CHANCE = NEAR / 2
# A vertex is in a face if it is so with more than this certainty.
IN_FACE = 0.5
# A part of several may have a face of its own if it has this share of the area, and lies across the mirror plane: its
# middle is off that by no more than this share of what its vertices are.
LARGE = 0.02
ACROSS = 0.1
# It has one with more certainty than the front view alone gives.
FACED = 0.7
# Triangles that pair up to quads across their longest sides, of all: so many come from quads and not by chance.
PAIRED = 0.9
EQUAL = 1 - 1e-6


@dataclass(frozen=True)
class SeamPreferences:
    """Cost of a cut along an edge of which something holds fully, over that of any edge; 1 does not care.

    Attributes
    ----------
    hidden : other parts of the surface hide it, and it is on no front
    crease : it lies in a valley, but on no front; sharp : its faces meet at a right angle or sharper
    underside, back : it looks down, or away from where the body looks to
    front, salient : it looks to where the body does; it stands out, and is not hidden
    mirror : it lies in the mirror plane, but on no front
    loops : it is a side of quads on both sides
    axes : how the surface stands in the scene; None where nobody knows
    """

    hidden: float = 0.5
    crease: float = 0.7
    sharp: float = 0.6
    underside: float = 0.75
    back: float = 0.75
    front: float = 6.0
    salient: float = 2.0
    mirror: float = 0.7
    loops: float = 0.85
    axes: SceneAxes | None = None


@dataclass(frozen=True)
class SeamCosts:
    """What cutting the edges of a surface costs, and why.

    Attributes
    ----------
    edges (e,2) : of polygons, the smaller vertex first, in ascending order
    cost (e,) : per length, between LEAST and MOST; 1 is neutral
    reasons : (e,) in [0, 1] for everything that has a factor, by its name in `SeamPreferences`
    vertex_cost (n,) : mean over the edges at a vertex, 1 where there is none
    face (n,) : in [0, 1], 1 on the front of a body that has one, and within it: seams should not end there
    within (n,) : in [0, 1], 1 in a mouth, a nostril or a socket, which no seam reaches but across the face
    plane : in which the surface is its own mirror image; facing : where it looks to
    axes : how it stands, see `facing.standing`
    """

    edges: np.ndarray
    cost: np.ndarray
    reasons: dict[str, np.ndarray]
    vertex_cost: np.ndarray
    face: np.ndarray
    within: np.ndarray
    plane: SymmetryPlane | None
    facing: Facing
    axes: SceneAxes | None

    @property
    def in_face(self) -> np.ndarray:
        """Vertices (n,) bool that are in a face."""
        return self.face > IN_FACE

    @property
    def within_face(self) -> np.ndarray:
        """Vertices (n,) bool that are deep in a face."""
        return self.within > IN_FACE

    def of(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Costs (k,) of the edges between vertices a (k,) and b (k,); the mean of its ends where there is no edge."""
        keys = pair_keys(*self.edges.T)
        asked = pair_keys(a, b)
        at = np.minimum(np.searchsorted(keys, asked), len(keys) - 1)
        return np.where(keys[at] == asked, self.cost[at], (self.vertex_cost[a] + self.vertex_cost[b]) / 2)


def seam_costs(
    surface: Surface, preferences: SeamPreferences | None = None, faces: np.ndarray | None = None
) -> SeamCosts:
    """Costs of the edges of the polygons `faces` (f,) bool of a surface, by default all.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : nothing to cut, not anywhere, or without any area
    """
    preferences = preferences or SeamPreferences()
    _, corners, owner = chosen_triangles(surface, faces)
    # Vertices of no triangle may be anywhere, and nowhere.
    used, triangles = np.unique(surface.corner_vertex[corners], return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    if degenerate_triangles(surface.positions[used], triangles).all():
        raise ZeroAreaFaceError("No face has an area", kind="face", elements=np.unique(owner))
    side = polygon_sides(surface.face_start, corners)
    used, triangles = _in_order(surface.positions, used, triangles)
    space, keys = surface.positions[used], np.unique(pair_keys(*(ends[side] for ends in halfedges(triangles))))
    edges = paired(keys)
    positions = unit_size(space, triangles)
    axes = preferences.axes
    left = None if axes is None else np.cross(axes.up, axes.viewer)
    plane = symmetry_plane(positions, triangles, owner, side=left)
    if plane is not None and axes is not None and _is_chance(plane, axes):
        plane = None
    seen, axes, at_vertices = _vertex_reasons(positions, triangles, plane, axes)
    if plane is not None:
        _symmetrise(positions, triangles, plane, at_vertices)
        plane = _among_all(plane.carried(positions, space), used, len(surface.positions))
    in_face, within_face = at_vertices.pop("face"), at_vertices.pop("within")
    reasons = {name: reason[edges].mean(axis=1) for name, reason in at_vertices.items()}
    reasons["sharp"] = _sharp(positions, triangles, keys)
    reasons["loops"] = _sides_of_quads(positions, triangles, owner, keys)
    cost = np.ones(len(edges))
    for name, reason in reasons.items():
        cost *= getattr(preferences, name) ** reason
    cost = np.clip(cost, LEAST, MOST)
    ends, n = np.sort(used[edges], axis=1), len(surface.positions)
    ascending = np.lexsort(ends.T[::-1])
    ends, cost = ends[ascending], cost[ascending]
    reasons = {name: reason[ascending] for name, reason in reasons.items()}
    count = np.bincount(ends.ravel(), minlength=n)
    total = np.bincount(ends.ravel(), np.repeat(cost, 2), n)
    vertex_cost = np.where(count > 0, total / np.maximum(count, 1), 1.0)
    face, within = np.zeros(n), np.zeros(n)
    face[used], within[used] = in_face, within_face
    return SeamCosts(ends, cost, reasons, vertex_cost, face, within, plane, seen, axes)


def _is_chance(plane: SymmetryPlane, axes: SceneAxes) -> bool:
    """Whether a body is alike above and below, and not quite: no symmetry that anyone would see in it."""
    return plane.residual > CHANCE and abs(float(plane.normal @ unit(np.array(axes.up, float)))) > LEVEL


def _in_order(positions: np.ndarray, used: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices `used` (u,) in the order of their places, and triangles (m,3) of these."""
    order = order_of_places(positions[used], triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return used[order], place[triangles]


def _among_all(plane: SymmetryPlane, used: np.ndarray, n: int) -> SymmetryPlane:
    """The plane of vertices `used` (u,) with images among all n vertices: others are their own."""
    if plane.image is None:
        return plane
    image = np.arange(n)
    image[used] = used[plane.image]
    return replace(plane, image=image)


def _vertex_reasons(
    positions: np.ndarray, triangles: np.ndarray, plane: SymmetryPlane | None, axes: SceneAxes | None
) -> tuple[Facing, SceneAxes | None, dict[str, np.ndarray]]:
    """Where a surface of unit size looks to, how it stands, and what speaks for and against its vertices, (n,) each in
    [0, 1]."""
    n, area = len(positions), vertex_areas(positions, triangles)
    sides = hidden_sides(positions, triangles)
    # The front of a body that is inside out is its front all the same.
    triangles = outside_out(positions, triangles, sides)
    means = curvature_means(positions, triangles)
    saliency = saliency_of(means, triangles)
    axes = standing(positions, triangles, saliency, plane, axes)
    seen = facing(positions, triangles, saliency, plane, axes)
    occlusion = vertex_occlusion(positions, triangles, sides)
    forwards, far_ahead, backwards = _looks(positions, triangles, seen)
    for part, corners in _middle_parts(positions, triangles, plane):
        own = facing(unit_size(positions[part], corners), corners, saliency[part], plane, axes)
        if own.certainty > max(seen.certainty, FACED):
            for look, here in zip((forwards, far_ahead, backwards), _looks(positions[part], corners, own), strict=True):
                look[part] = here
    below = towards(positions, triangles, -seen.up)
    # Sockets and nostrils are hidden from most sides, but not from the front, from where a face is looked at.
    front = _step(forwards, SIDE) * (1 - _step(occlusion, BURIED))
    face = np.maximum(front, _step(far_ahead, SIDE))
    hidden = _step(occlusion, HIDDEN) * (1 - front)
    reasons = {
        "hidden": hidden,
        "crease": _step(-means[CREASE_SCALE], CREASE) * (1 - front),
        "underside": _step(below, SIDE),
        "back": _step(backwards, SIDE),
        "front": front,
        "salient": salient_weights(saliency, area, SALIENT) * (1 - hidden),
        "mirror": np.zeros(n),
        # Within, too: whoever cuts in a mouth has come across the lips.
        "face": face,
        "within": face * (occlusion > BURIED[0]),
    }
    return seen, axes, reasons


def _looks(positions: np.ndarray, triangles: np.ndarray, seen: Facing) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far vertices (n,) of a surface (n,3), (m,3) look and lie to where it has a face, lie there, and look back."""
    there = towards(positions, triangles, seen.front)
    sure = seen.certainty * with_a_face(positions, triangles, seen)
    return sure * there, sure * ahead(positions, triangles, seen.front), -seen.certainty * there


def _middle_parts(
    positions: np.ndarray, triangles: np.ndarray, plane: SymmetryPlane | None
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The vertices (k,) and triangles (l,3) of these of the large parts of a surface (n,3), (m,3) of several that lie
    across its mirror plane, as the head of a body with clothes and hair: that has a face though all of it has none."""
    if plane is None:
        return
    part = graph_components(*halfedges(triangles), len(positions))[1]
    area, height = vertex_areas(positions, triangles), plane.distance(positions)
    share = np.bincount(part, area) / area.sum()
    if np.count_nonzero(share) == 1:
        return
    off = np.abs(np.bincount(part, area * height)) / np.maximum(np.bincount(part, area * np.abs(height)), 1e-300)
    for k in np.flatnonzero((share >= LARGE) & (off <= ACROSS)):
        vertices = np.flatnonzero(part == k)
        inside = triangles[part[triangles[:, 0]] == k]
        yield vertices, np.searchsorted(vertices, inside)


def _symmetrise(
    positions: np.ndarray, triangles: np.ndarray, plane: SymmetryPlane, reasons: dict[str, np.ndarray]
) -> None:
    """Give vertices (n,3) of a surface of unit size and those nearest to their images the same reasons, and say which
    are on the plane and may be cut there."""
    image, far = plane.nearest_images(positions, triangles)
    image = np.where(far <= NEAR, image, np.arange(len(image)))
    for name, reason in reasons.items():
        reasons[name] = (reason + reason[image]) / 2
    reasons["mirror"] = np.exp(-0.5 * (plane.distance(positions) / ON_PLANE) ** 2) * (1 - reasons["front"])


def _step(value: np.ndarray, ends: tuple[float, float]) -> np.ndarray:
    """0 below the one end, 1 above the other, and smooth between."""
    t = np.clip((value - ends[0]) / (ends[1] - ends[0]), 0, 1)
    return t * t * (3 - 2 * t)


def _sharp(positions: np.ndarray, triangles: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """How sharp the edges with these keys (e,) are, (e,) in [0, 1]; 0 where there are not two faces."""
    every = pair_keys(*halfedges(triangles))
    first, second = pair_up(every)
    sharp = _step(np.abs(fold_angles(positions, triangles, np.stack([first, second], axis=1))), SHARP)
    result = np.zeros(len(keys))
    side = np.isin(every[first], keys)
    result[np.searchsorted(keys, every[first][side])] = sharp[side]
    return result


def _sides_of_quads(positions: np.ndarray, triangles: np.ndarray, owner: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Edges (e,) with quads on all sides, 1 or 0; quads that were cut into triangles are recognised."""
    every = pair_keys(*halfedges(triangles))
    sizes = np.bincount(owner)[owner]
    if (sizes == 1).all():
        first, second = pair_up(every)
        length = halfedge_lengths(positions, triangles).reshape(-1, 3)
        longest = length >= EQUAL * length.max(axis=1, keepdims=True)
        # Of two sides that are equally long rounding would choose.
        longest = (longest & (longest.sum(axis=1) == 1)[:, None]).ravel()
        pairs = longest[first] & longest[second]
        from_quads = 2 * pairs.sum() >= PAIRED * len(triangles)
        return (~np.isin(keys, every[first[pairs]])).astype(float) if from_quads else np.zeros(len(keys))
    return (~np.isin(keys, every[np.repeat(sizes != 2, 3)])).astype(float)
