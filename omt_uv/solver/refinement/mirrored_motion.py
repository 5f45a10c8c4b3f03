"""Refine a map of a mirror-symmetric mesh as what it is, solving for one vertex of every pair, or of every four."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ..maps.energy import Elements, has_folds, squared
from ..maps.local_untangle import inner_folds_straightened
from ..maps.mirror_symmetry import MirrorSymmetry, mirror_symmetry, orbits
from ..maps.polygon_elements import polygon_mesh, restricted
from ..mesh.mirror import find_mirror
from ..mesh.topology import boundary_edges, row_labels
from .hessian_blocks import corners_of_quads, lone_triangles
from .projected_newton import Motion

# How far, over its extent, an initial map may be from its mirror image: farther, it is no map of a symmetric chart.
FAR = 0.3
# Sine of the angle up to which a direction lies along the axis; and how far points may leave the square.
ALONG = 1e-6
# Share of the triangles that may be folded in the mean of an initial map and its image, to be straightened, in so many
# rounds.
FEW = 0.01
ROUNDS = 5
# Relative difference of the targets of mirror images up to which they are symmetric.
SAME_TARGET = 1e-4
# The same of areas and shapes of polygons up to which one stands for its image, too.
ALIKE = 1e-5


class MirroredMotion:
    """A motion of the vertices that represent pairs; their images follow, and vertices on the axis stay on it."""

    def __init__(self, motion: Motion, symmetry: MirrorSymmetry, w: np.ndarray):
        self.motion, self.symmetry = motion, symmetry
        self._inside = symmetry.on_axis & motion.free.all(axis=1) & (symmetry.line != 0)
        line = np.where(symmetry.on_axis, symmetry.line, 1)[:, None]
        along = (np.abs((self.frame(w)[:, None] * [1, 1j] * line.conj()).imag) < ALONG) & (line != 0)
        self.free = motion.free & ~symmetry.follows[:, None] & (along | ~symmetry.on_axis[:, None])

    def frame(self, w):
        """First axis (n,) of every vertex: that of the motion, or that of the mirror for free vertices upon it."""
        return np.where(self._inside, self.symmetry.line, self.motion.frame(w))

    def bend(self, w, gradient):
        """Second derivative (n,) of the energy from the bending of curves; `gradient` by the representatives."""
        return self.motion.bend(w, gradient)

    def move(self, w, step):
        """The symmetric map (n,) complex after a step (n,) of the representatives."""
        return self.symmetry.spread(self.motion.move(w, step * self.frame(w) / self.motion.frame(w)))


def find_symmetry(
    vertices: np.ndarray, triangles: np.ndarray, polygons: np.ndarray | None, faces: Elements
) -> MirrorSymmetry | None:
    """The mirror symmetry of a mesh (n,3), (m,3) whose polygons (m,) have symmetric targets, too; None without one."""
    n, owner, target = len(vertices), _given_polygons(triangles, polygons, faces), faces.area * faces.ratio
    pairs = np.unique(np.concatenate([(n * owner[of][:, None] + cells).ravel() for cells, of in _cells(faces)]))
    asked = [np.bincount(owner, x) for x in ([target] if faces.region is None else [target, target * faces.region])]
    around = [np.bincount(pairs % n, values[pairs // n], n) for values in asked]
    # What is no longer needed takes as much memory as the search.
    del pairs, asked, owner, target

    def accepted(image: np.ndarray) -> bool:
        return all((np.abs(x - x[image]) <= SAME_TARGET * around[0]).all() for x in around)

    first = find_mirror(vertices, triangles, polygons, accepted=accepted)
    if first is None:
        return None
    second = find_mirror(vertices, triangles, polygons, across=first, accepted=accepted)
    return mirror_symmetry(np.array([m.image for m in (first, second) if m is not None]))


def _cells(faces: Elements) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Corners (k,3) of the triangles that are none of a quad's, and (q,4) of the quads, and the polygon of each."""
    lone, quads, count = lone_triangles(faces), corners_of_quads(faces), len(faces.area)
    yield faces.triangles[:lone], faces.owner[:lone]
    yield quads, np.arange(count - len(quads), count)


def _given_polygons(triangles: np.ndarray, polygons: np.ndarray | None, faces: Elements) -> np.ndarray:
    """A number for the polygon of the mesh (m,3), (m,) to which each polygon of its elements (p,) belongs: long ones
    that are not convex count triangle by triangle, and are cut as they come."""
    count, lone = len(faces.area), lone_triangles(faces)
    own = np.arange(count)
    if polygons is None or faces.polygon is None or faces.alone is None or not faces.alone[:lone].any():
        return own
    given = polygons[polygon_mesh(triangles, polygons).rows[:lone]]
    own[faces.polygon[:lone]] = count + np.unique(given, return_inverse=True)[1].ravel()
    return np.unique(own, return_inverse=True)[1].ravel()


def halved(faces: Elements, symmetry: MirrorSymmetry | None) -> Elements:
    """The polygons that stand for their images, too: energies, areas and slopes of symmetric maps are those of all.

    Polygons of several triangles that are no quads stay as they are, and so do those whose images differ.
    """
    if symmetry is None:
        return faces
    count = len(faces.area)
    found = np.array([_image_polygons(faces, image) for image in orbits(symmetry.images)])
    alike = (found >= 0).all(axis=0) & _alike(faces, np.maximum(found, 0))
    crossed = _cut_otherwise(faces, found, symmetry)
    if faces.quads is not None:
        # Only one of both diagonals is inside.
        alike[count - len(crossed) :] &= ~crossed | faces.quads.convex
    # All that stand for one another, or none of them.
    alike &= alike[np.maximum(found, 0)].all(axis=0)
    found = np.where(alike, found, np.arange(count))
    # The one with most corners that no other vertex represents; of several, the first.
    rank = np.arange(count) - count * np.bincount(faces.owner, (~symmetry.follows)[faces.triangles].sum(axis=1), count)
    kept = np.take_along_axis(found, rank[found].argmin(axis=0)[None], axis=0)[0] == np.arange(count)
    times = (len(found) / (found == found[0]).sum(axis=0))[kept]
    half = restricted(faces, kept, np.arange(len(symmetry.representative)))
    if half.quads is not None:
        half = replace(
            half,
            quads=replace(half.quads, crossed=(crossed & alike[count - len(crossed) :])[kept[count - len(crossed) :]]),
        )
    return replace(half, area=half.area * times, weight=half.weight * times)


def _image_polygons(faces: Elements, image: np.ndarray) -> np.ndarray:
    """The polygon (p,) that is the image of each triangle and quad, for the images (n,) of vertices; -1 for others."""
    count, lone, quads = len(faces.area), lone_triangles(faces), corners_of_quads(faces)
    single = np.arange(lone) if faces.alone is None else np.flatnonzero(faces.alone[:lone])
    found = np.full(count, -1)
    for cells, own in ((faces.triangles[single], faces.owner[single]), (quads, np.arange(count - len(quads), count))):
        label = row_labels(np.sort(np.concatenate([cells, image[cells]]), axis=1))
        of, to = label[: len(cells)], label[len(cells) :]
        place = np.full(label.max(initial=-1) + 1, -1)
        # Two polygons with the same corners are none's image.
        place[of] = np.where(np.bincount(of)[of] == 1, own, -1)
        found[own] = place[to]
    return found


def _alike(faces: Elements, found: np.ndarray) -> np.ndarray:
    """Polygons (p,) bool that are as large as all their images (k,p), ask for as much, and have their shape."""
    squares = (squared(faces.gradient)).sum(axis=1), (squared(faces.gradient) ** 2).sum(axis=1)
    values = [faces.area, faces.ratio, *(np.bincount(faces.owner, x, len(faces.area)) for x in squares)]
    values += [] if faces.region is None else [1 + faces.region]
    return np.all([(np.abs(x[found] - x) <= ALIKE * x).all(axis=0) for x in values], axis=0)


def _cut_otherwise(faces: Elements, found: np.ndarray, symmetry: MirrorSymmetry) -> np.ndarray:
    """Quads (q,) bool of which an image, among the polygons (k,p), is cut along the other diagonal."""
    quads = corners_of_quads(faces)
    first = len(faces.area) - len(quads)
    own = np.sort(quads[:, [0, 2]], axis=1)
    other = np.zeros(len(quads), bool)
    for image, polygon in zip(orbits(symmetry.images), found[:, first:], strict=True):
        elsewhere = (polygon >= 0) & (polygon != found[0, first:])
        other |= elsewhere & (np.sort(image[own], axis=1) != own[np.maximum(polygon - first, 0)]).any(axis=1)
    return other


def symmetric_start(
    symmetry: MirrorSymmetry,
    w: np.ndarray,
    faces: Elements,
    boundary: str,
    loop: np.ndarray,
    crosses: Callable[[np.ndarray], bool] | None = None,
) -> tuple[MirrorSymmetry, np.ndarray] | None:
    """The symmetry with the axis of a map w (n,) complex, and a symmetric map next to it: its mean with its image, or
    one half with its image, which is sound but along the axis.

    None where all are far, have folds, cross themselves though w does not, or leave the square; `faces` say what a fold
    is. loop (b,): vertices of the boundary, which stay on their circle or square.
    """
    centred = w - w.mean() if boundary == "free" else w
    turn = (centred[symmetry.images[0]] * centred).sum()
    if not abs(turn) > 0:
        return None
    phase = turn / abs(turn)
    if boundary == "square":
        # Across the middles of sides, or the corners: other axes are none of the square's.
        phase = 1j ** round(2 * np.angle(turn) / np.pi)
    if boundary == "rectangle":
        phase = 1.0 if turn.real > 0 else -1.0
    found = mirror_symmetry(symmetry.images, phase)
    mean = found.averaged(centred)
    if np.abs(mean - centred).max() > FAR * np.abs(centred).max():
        return None
    watched = crosses is not None and not crosses(w)
    for candidate in _next_to(found, centred, mean, boundary):
        start = _on_outline(found, candidate, w, boundary, loop)
        start = None if start is None else _straightened(found, start, faces)
        if start is None or has_folds(faces, start):
            continue
        if crosses is None or not watched or not crosses(start):
            return mirror_symmetry(symmetry.images, phase, start), start
    return None


def _next_to(symmetry: MirrorSymmetry, w: np.ndarray, mean: np.ndarray, boundary: str) -> Iterator[np.ndarray]:
    """Symmetric maps (n,) complex next to w, whose mean with its image is known: that, and both halves."""
    yield mean
    if boundary == "free" and len(symmetry.images) == 1:
        side = (mean * np.sqrt(np.conj(symmetry.phase))).imag
        image = symmetry.phase * w[symmetry.images[0]].conj()
        for sign in (1, -1):
            yield symmetry.spread(np.where(sign * side > 0, w, np.where(side == 0, mean, image)))


def _on_outline(
    symmetry: MirrorSymmetry, start: np.ndarray, w: np.ndarray, boundary: str, loop: np.ndarray
) -> np.ndarray | None:
    """A symmetric map (n,) with its boundary on the circle of w (n,); None where it leaves the square of that."""
    if boundary == "disk":
        start = start.copy()
        start[loop] *= np.abs(w[loop]) / np.abs(start[loop])
        return symmetry.spread(start)
    if boundary == "free":
        return start
    off = np.abs(_from_sides(start[loop], w[loop]) - _from_sides(w[loop], w[loop])).max()
    return start if off <= ALONG else None


def _straightened(symmetry: MirrorSymmetry, w: np.ndarray, faces: Elements) -> np.ndarray:
    """A symmetric map w (n,) complex whose folds, if they are few, are straightened where they are; averaging makes
    some where a map varies fast."""
    part = faces.part
    triangles = faces.triangles if part is None else faces.triangles[part > 0]
    outline = np.zeros(len(w), bool)
    outline[boundary_edges(triangles)] = True
    for _ in range(ROUNDS):
        a, b = faces.derivatives(w)
        folds = faces.folded(squared(a) - squared(b)).sum()
        if not 0 < folds <= FEW * len(triangles):
            break
        straight = inner_folds_straightened(np.column_stack([w.real, w.imag]), triangles, outline)
        w = symmetry.averaged(straight @ [1, 1j])
    return w


def _from_sides(w: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Sizes (b,) of the rectangles about 0 on which points lie, over that of the outline (b,) complex."""
    return np.maximum(np.abs(w.real) / np.abs(outline.real).max(), np.abs(w.imag) / np.abs(outline.imag).max())
