"""Quantise a surface with a boundary for comparison, where markers leave nothing open: points of the conformal disk.

A marker p inside goes to 0 and one q of the boundary to 1 (Su 2015, section 2.6.3), so that no rotation is looked for:
faces are compared as faces, nose upon nose. On a closed body, or away from the boundary, the boundary is the circle
around p through q: a whole head is compared by its face.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import diags

from ..analysis.curvature import mean_curvature
from ..canonical.markers import ChartMarkers
from ..conformal.disk_map import conformal_disk
from ..counts import BYTES_PER_ELEMENT, check_memory
from ..errors import LandmarkError, NotADiskError
from ..linalg.sparse import solve_spd
from ..mesh.closest_point import subdivision_centroids
from ..mesh.geometry import cotangent_laplacian, face_areas, vertex_areas
from ..mesh.topology import boundary_loops
from ..progress import Steps
from .membrane import with_membranes
from .signature import FINE, POINTS, SMOOTHING, SQUASH, Signature, pair_costs, sound_parts
from .surroundings import surroundings

# Triangles are cut into as many squared at most.
FINEST = 8
REMEDY = "Mark one vertex inside, and one of the boundary around it, or one as far from it as what is compared"


def marked_signature(
    positions: np.ndarray, triangles: np.ndarray, centre: int, start: int, count: int = POINTS
) -> Steps[Signature]:
    """The signature of a mesh (n,3), (m,3) with markers: of the part with the vertex `centre`, whose boundary with the
    vertex `start` becomes the circle; other holes are filled. Of a start on no boundary, of what is as near to the
    centre, along the surface, as the start is.

    Raises
    ------
    EmptyMeshError, NonFiniteError : nothing, or coordinates that are no numbers
    LandmarkError : a centre on the boundary or of no face, a start on another part, at the same place, or beyond which
        nothing is
    NotADiskError : handles
    PrecisionError : the map leaves double precision
    CountError : more points than this machine has memory for

    References
    ----------
    Su 2015, sections 2.6.3 and 4.4

    >>> import numpy as np
    >>> from omt_uv.solver.progress import drain
    >>> from omt_uv.solver.signatures.marked import marked_signature
    >>> roof = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 0.5]])
    >>> found = drain(marked_signature(roof, np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]), 4, 0, 50))
    >>> found.points.shape
    (50, 2)
    """
    check_memory(count, BYTES_PER_ELEMENT, "A signature of {} points")
    vertices, faces, centre, start = _outlined(positions, triangles, centre, start)
    found = yield from conformal_disk(vertices, faces)
    loop = boundary_loops(faces)[0]
    uv = ChartMarkers(centre=centre, start=start).in_disk(found.uv, loop)
    mass = vertex_areas(vertices, faces)
    # One implicit step of diffusion, as wide as the other signature's smoothing on a surface of this area.
    unit = mass.sum() / np.pi
    spread = diags(mass) + SMOOTHING**2 / 2 * unit * cotangent_laplacian(vertices, faces)
    bend = np.tanh(solve_spd(spread.tocsc(), mean_curvature(vertices, faces)) * np.sqrt(unit) / SQUASH)
    values, area = np.column_stack([uv, bend]), face_areas(vertices, faces)
    places, weights = _pieces(values, faces, area, FINE * count)
    one, other = (_quantised(places * side, weights, count) for side in ([1, 1, 1], [1, -1, 1]))
    other = Signature(other.points * [1, -1], other.curvature)
    cost = pair_costs(one, other)
    return Signature(one.points, one.curvature, float(np.sqrt(cost[linear_sum_assignment(cost)].mean())))


def _outlined(
    positions: np.ndarray, triangles: np.ndarray, centre: int, start: int
) -> tuple[np.ndarray, np.ndarray, int, int]:
    """What markers mark, with all its holes filled but that of the start, or what lies around the centre as far as the
    start where this is on no boundary; and both markers in it."""
    vertices, faces, inner, outer = _part_of(positions, triangles, centre, start)
    loops = boundary_loops(faces)
    if any(inner in loop for loop in loops):
        raise LandmarkError("The marker of the centre lies on the boundary", REMEDY, "vertex", [centre])
    if not any(outer in loop for loop in loops):
        places, around, old = surroundings(vertices, faces, inner, outer)
        if outer not in old:
            cause = "The surface as far from the marker of the centre as that of the start does not reach to this"
            raise LandmarkError(cause, REMEDY, "vertex", [start])
        inner, outer = (int(np.flatnonzero(old == k)[0]) for k in (inner, outer))
        vertices, faces, inner, outer = _part_of(places, around, inner, outer)
        loops = boundary_loops(faces)
    own = [loop for loop in loops if outer in loop]
    if not own:
        cause = "Nothing is farther from the marker of the centre than that of the start"
        raise LandmarkError(cause, REMEDY, "vertex", [start])
    vertices, faces = with_membranes(vertices, faces, [loop for loop in loops if loop is not own[0]])
    edges = (3 * len(faces) + len(own[0])) // 2
    if len(vertices) - edges + len(faces) != 1:
        raise NotADiskError("The surface has handles", "Only what is a disk without its other holes has markers")
    return vertices, faces, inner, outer


def _part_of(
    positions: np.ndarray, triangles: np.ndarray, centre: int, start: int
) -> tuple[np.ndarray, np.ndarray, int, int]:
    """The part of a mesh that the markers are on, and both in it. Raises LandmarkError."""
    part = next((part for part in sound_parts(positions, triangles) if (part.vertex_ids == centre).any()), None)
    if part is None:
        raise LandmarkError("The marker of the centre is on no face", REMEDY, "vertex", [centre])
    # A vertex where the boundary meets itself is several ones by now: the first counts.
    places = [np.flatnonzero(part.vertex_ids == vertex) for vertex in (centre, start)]
    if not len(places[1]):
        raise LandmarkError("The marker of the start is on another part than the centre", REMEDY, "vertex", [start])
    return part.vertices, part.triangles, int(places[0][0]), int(places[1][0])


def _pieces(values: np.ndarray, faces: np.ndarray, area: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m,3) cut alike into `count` pieces or more, if they are not too few: values (k,c) in the middles, and
    shares of the area (k,)."""
    cuts = min(FINEST, int(np.ceil(np.sqrt(count / len(faces)))))
    shares = subdivision_centroids(cuts)
    places = np.einsum("kc,mcd->mkd", shares, values[faces]).reshape(-1, values.shape[1])
    return places, np.repeat(area / area.sum() / len(shares), len(shares))


def _quantised(values: np.ndarray, weights: np.ndarray, count: int) -> Signature:
    """Means of as many groups of the same mass: places and curvature (k,3) with weights (k,)."""
    groups = _halved(values[:, :2], np.arange(len(values)), weights, count)
    mean = np.array([share @ values[rows] / share.sum() for rows, share in groups])
    return Signature(mean[:, :2], mean[:, 2])


def _halved(at: np.ndarray, rows: np.ndarray, weights: np.ndarray, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows (r,) of places (k,2) with weights (r,) in `count` groups of the same weight; rows in between are in both."""
    if count == 1:
        return [(rows, weights)]
    along = at[rows, np.ptp(at[rows], axis=0).argmax()]
    order = np.argsort(along, kind="stable")
    rows, weights = rows[order], weights[order]
    total = np.cumsum(weights)
    low = count // 2
    goal = total[-1] * low / count
    cut = min(int(np.searchsorted(total, goal)), len(rows) - 1)
    first, second = weights[: cut + 1].copy(), weights[cut:].copy()
    second[0] = total[cut] - goal
    first[-1] -= second[0]
    return [
        *_halved(at, rows[: cut + 1], first, low),
        *_halved(at, rows[cut:], second, count - low),
    ]
