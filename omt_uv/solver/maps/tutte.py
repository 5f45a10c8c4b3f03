"""Embed a disk in the plane by mean value weights, its boundary convex (Tutte 1963, Floater 2003).

Any positive weights do. Where they squeeze a vertex, its neighbours let it go (Yoshizawa, Belyaev, Seidel 2004).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags

from ..errors import FoldedUVError, PrecisionError
from ..linalg.nested_dissection import LARGE, mesh_order
from ..linalg.sparse import Factor, solve_general
from ..mesh.geometry import angles_from_lengths, halfedge_lengths, lengths
from ..mesh.topology import graph_components, halfedges, twins
from .energy import Elements, energies_of, squared

# Rounds at most in which weights are evened, and the share of its energy that one has to win for another one: each
# takes a third of the time of a Newton step.
ROUNDS = 12
WORTHWHILE = 0.3
# The same where a transport, or the map of a coarser mesh, would be the start otherwise, which take longer.
WELCOME = 0.1

# Sides that are shorter than this share of the mean get so much of a convex boundary: faces between vertices that
# nearly coincide would fold by rounding.
LEAST_STEP = 1e-4
NO_QUADS = np.zeros((0, 4), np.int64)


def mean_value_weights(length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Floater's mean value weights of every halfedge, seen from its tail and from its head, (m,3) each.

    length (m,3) are the sides of the triangles. Tangents are bounded, so that needles keep positive,
    finite weights.
    """
    angle = angles_from_lengths(length)
    tangent = np.clip(np.tan(np.minimum(angle, 0.999 * np.pi) / 2), 1e-6, 1e3)
    # Halfedge k runs from vertex k to k + 1; the angle at vertex k lies opposite to halfedge k + 1.
    at_tail, at_head = tangent[:, [1, 2, 0]], tangent[:, [2, 0, 1]]
    safe = np.maximum(length, 1e-12 * length.max())
    return at_tail / safe, at_head / safe


def tutte(
    positions: np.ndarray,
    triangles: np.ndarray,
    loop: np.ndarray,
    boundary: np.ndarray,
    equal: bool = False,
    order: np.ndarray | None = None,
) -> np.ndarray:
    """Mean value embedding (n,2) of a disk mesh (n,3), (m,3) with its loop (b,) at points boundary (b,2).

    boundary (b,2k) : several give as many side by side, (n,2k); equal : with the weights of equilateral triangles in
    place of the mesh's own; order (n,) : see `nested_dissection.mesh_order`
    """
    n = len(positions)
    inside = np.ones(n, dtype=bool)
    inside[loop] = False
    if order is None and n >= LARGE:
        order = mesh_order(positions, triangles)
    inner = np.flatnonzero(inside) if order is None else order[inside[order]]
    uv = np.zeros((n, boundary.shape[1]))
    uv[loop] = boundary
    if len(inner):
        rows = _weights(positions, triangles, equal)[inner]
        total = np.asarray(rows.sum(axis=1)).ravel()
        rows = csr_matrix((rows.data / np.repeat(total, np.diff(rows.indptr)), rows.indices, rows.indptr), rows.shape)
        matrix = csr_matrix((np.ones(len(inner)), (np.arange(len(inner)),) * 2)) - rows[:, inner]
        as_they_come = "mmd" if order is None else "natural"
        uv[inner] = solve_general(matrix.tocsc(), rows[:, loop] @ boundary, as_they_come)
    return uv


def evened_tutte(
    positions: np.ndarray,
    loop: np.ndarray,
    uv: np.ndarray,
    faces: Elements,
    area_weight: float,
    most: float = np.inf,
    order: np.ndarray | None = None,
    patient: Callable[[], bool] = lambda: False,
) -> np.ndarray | None:
    """An embedding (n,2) of a disk mesh (n,3) of less energy than one by `tutte`, uv (n,2), with its boundary, the loop
    (b,); None where that does not come down to `most`.

    faces : elements of the mesh, with the areas it is to have; area_weight : in the energy that counts; order (n,) :
        see `nested_dissection.mesh_order`; patient : says, once `most` is near and rounds win little, whether to go on

    In every round the pull of a vertex on its neighbours is divided by how much the map has to be stretched there:
    first by lengths (Yoshizawa, Belyaev, Seidel 2004, A fast and simple stretch-minimizing mesh parameterization), then
    by the mean of lengths and areas, since the former draws slivers and the latter alone is slow. The map of the least
    energy is taken.
    """
    n, triangles = len(positions), faces.triangles
    order = mesh_order(positions, triangles) if order is None else order
    inner = order[~np.isin(order, loop)]
    rows = _weights(positions, triangles)[inner]
    means = _Means(rows[:, inner], rows[:, loop])
    best, least, uv = uv, np.inf, uv.copy()
    for k in range(ROUNDS):
        a, b = faces.derivatives(uv @ [1, 1j])
        scale = np.sqrt((faces.area @ faces.ratio) / float(faces.area @ faces.sums(np.abs(squared(a) - squared(b)))))
        a, b = scale * a, scale * b
        before, value = least, float(energies_of(faces, a, b, area_weight).sum())
        if value < least:
            best, least = uv.copy(), value
        if not len(inner) or not _goes_on(k, value, before, most, patient):
            break
        kept = 1 / np.sqrt(_stretch(faces, a, b, n))
        if k:
            kept = np.sqrt(kept * np.sqrt(_growth(faces, a, b, n)))
        for part, columns in ((means.inside, inner), (means.outside, loop)):
            part.data *= kept[columns][part.indices]
        try:
            uv[inner] = means.of(uv[loop])
        except PrecisionError:
            break
    return best if least <= most else None


def _goes_on(k: int, value: float, before: float, most: float, patient: Callable[[], bool]) -> bool:
    """Whether weights are evened once more after k rounds that left the energy `value`, which one less had `before`."""
    won = value / before
    # Lengths are evened by themselves once: only what comes after foretells what more will win.
    comes_down = k < ROUNDS - 1 and (k < 2 or value * won ** (ROUNDS - 1 - k) <= most)
    return comes_down and (won < 1 - WORTHWHILE or (value > most and won < 1 - WELCOME and patient()))


class _Means:
    """Vertices each of which is the mean of its neighbours, by weights (k,k) of those inside and (k,b) of a boundary:
    their values may change from one time to the next."""

    def __init__(self, inside: csr_matrix, outside: csr_matrix):
        inside.sort_indices()
        self.inside, self.outside, count = inside, outside, inside.shape[0]
        self._row = np.repeat(np.arange(count), np.diff(inside.indptr))
        # Where each entry, and each of the diagonal, is by columns.
        number = csr_matrix((np.arange(1.0, inside.nnz + 1), inside.indices, inside.indptr), inside.shape)
        self._pattern = csc_matrix(number + diags(np.arange(inside.nnz + 1.0, inside.nnz + count + 1)))
        self._place = self._pattern.data.astype(np.int64) - 1

    def of(self, boundary: np.ndarray) -> np.ndarray:
        """The places (k,2) of the vertices inside a boundary (b,2). Raises PrecisionError."""
        inside, outside, pattern = self.inside, self.outside, self._pattern
        total = 1 / (inside @ np.ones(inside.shape[1]) + outside @ np.ones(outside.shape[1]))
        values = np.concatenate([-inside.data * total[self._row], np.ones(len(total))])[self._place]
        matrix = csc_matrix((values, pattern.indices, pattern.indptr), shape=pattern.shape)
        return Factor(matrix, "natural", spd=False).solve(total[:, None] * (outside @ boundary))


def _stretch(faces: Elements, a: np.ndarray, b: np.ndarray, n: int) -> np.ndarray:
    """Mean squares (n,), over the stars of vertices, of the stretch from the map with these derivatives (m,) complex
    to the surface (Sander, Snyder, Gortler, Hoppe 2001), as large as its targets."""
    outer, inner = squared(a), squared(b)
    return _of_stars(faces, faces.of_triangles(faces.ratio) * (outer + inner) / (outer - inner) ** 2, n)


def _growth(faces: Elements, a: np.ndarray, b: np.ndarray, n: int) -> np.ndarray:
    """Means (n,) over the stars of vertices of areas in the map over those they are to have."""
    return _of_stars(faces, (squared(a) - squared(b)) / faces.of_triangles(faces.ratio), n)


def _of_stars(faces: Elements, values: np.ndarray, n: int) -> np.ndarray:
    flat, area = faces.triangles.ravel(), faces.triangle_areas
    return np.bincount(flat, np.repeat(area * values, 3), n) / np.bincount(flat, np.repeat(area, 3), n)


def released_vertices(
    triangles: np.ndarray,
    loop: np.ndarray,
    side: np.ndarray,
    corner: np.ndarray,
    n: int,
    quads: np.ndarray = NO_QUADS,
) -> np.ndarray:
    """Vertices (b,) bool of a boundary loop (b,) to take off the sides of a rectangle.

    No inner edge runs along a side then, nor any diagonal of the quads (q,4): whichever way a quad is drawn, it has
    three corners on that side. A cover of these edges: the vertices with most of them first.

    Parameters
    ----------
    side, corner : (b,) the side of every vertex, and bool which are corners; n : how many vertices there are

    Raises
    ------
    FoldedUVError : an edge joins two corners
    """
    position = np.full(n, -1)
    position[loop] = np.arange(len(loop))
    tail, head = halfedges(triangles)
    inner = (twins(triangles) >= 0) & (tail < head)
    ends = np.concatenate([np.column_stack([tail[inner], head[inner]]), quads[:, ::2], quads[:, 1::2]])
    ends = ends[(position[ends] >= 0).all(axis=1)]
    i, j = (position[np.unique(np.sort(ends, axis=1), axis=0)]).T
    # A corner belongs to the side it starts and to the one before.
    sides = np.stack([side, np.where(corner, (side - 1) % 4, side)])
    same = (sides[:, None, i] == sides[None, :, j]).any((0, 1))
    i, j = i[same], j[same]
    released = np.zeros(len(loop), bool)
    while len(i):
        count = np.bincount(np.concatenate([i, j]), minlength=len(loop)) * ~corner
        if not count.any():
            raise FoldedUVError("Two corners of the square are joined by an edge within the chart")
        released[count.argmax()] = True
        left = ~(released[i] | released[j])
        i, j = i[left], j[left]
    return released


def arcs_of_parts(triangles: np.ndarray, loop: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Parts (k,) of a disk mesh (m,3) that one inner edge each cuts off from the rest, its boundary loop (b,) on a
    circle: the least shares of the circle that they take, and their shares of the area (m,) of the triangles.

    A part with the share a of a disk lies between its edge and an arc of at least the angle t with t - sin t = 2 pi a,
    which is greater than (12 pi a)^(1/3): small parts take far more of the circle than of the area.
    """
    on_loop = np.zeros(int(triangles.max()) + 1, bool)
    on_loop[loop] = True
    (tail, head), other = halfedges(triangles), twins(triangles)
    across = on_loop[tail] & on_loop[head]
    inner, cut = np.flatnonzero((other >= 0) & ~across), np.flatnonzero((other >= 0) & across)
    count, part = graph_components(inner // 3, other[inner] // 3, len(triangles))
    share = np.bincount(part, area, count) / area.sum()
    # What hangs together without the largest hangs on it by one edge.
    rest = share.argmax()
    one, side = part[cut // 3], part[other[cut] // 3]
    apart = (one != rest) & (side != rest)
    number, hanging = graph_components(one[apart], side[apart], count)
    share[rest] = 0
    share = np.bincount(hanging, share, number)
    share = share[share > 0]
    return np.cbrt(12 * np.pi * share) / (2 * np.pi), share


def _weights(positions: np.ndarray, triangles: np.ndarray, equal: bool = False) -> csr_matrix:
    """Mean value weights (n,n) of a disk mesh (n,3), (m,3): in row i those of the neighbours of vertex i; equal: see
    `tutte`."""
    n = len(positions)
    length = np.ones((len(triangles), 3)) if equal else halfedge_lengths(positions, triangles).reshape(-1, 3)
    at_tail, at_head = mean_value_weights(length)
    tail, head = halfedges(triangles)
    rows, columns = np.concatenate([tail, head]), np.concatenate([head, tail])
    return csr_matrix((np.concatenate([at_tail.ravel(), at_head.ravel()]), (rows, columns)), shape=(n, n))


def arc_length_parameters(positions: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Share of the boundary's length before each vertex of the loop, (b,) in [0, 1); no two are at the same place."""
    step = lengths(positions[np.roll(loop, -1)] - positions[loop])
    step = np.maximum(step, LEAST_STEP * step.mean())
    return np.concatenate([[0.0], np.cumsum(step)[:-1]]) / step.sum()
