"""Fill a surface that is open, has crossing faces or other damage with tetrahedra, by fTetWild where it is installed.

What is inside is where the surface winds around a point more than half (Hu, Schneider, Wang, Zorin, Panozzo 2020). The
boundary of the tetrahedra is a surface of its own, within a thousandth of the diagonal of what there was.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..counts import BYTES_PER_ELEMENT, check_memory
from ..errors import LibraryError, NonFiniteError, TetrahedraError
from ..flows.enclosed_volume import corner_volumes
from .meshing import GROWTH, TetMesh, without_chords
from .tet_mesh import boundary_triangles, tet_volumes, turned_right

# What is enclosed is at least this share of the box around, where holes make the sum of volumes meaningless.
LEAST_SHARE = 0.05
# Edges of tetrahedra at least and at most, as shares of the diagonal.
FINEST = 0.005
COARSEST = 0.2
# What fTetWild writes beside its result.
TRACKED = "__tracked_surface.stl"
# Volume of a regular tetrahedron with edges of length 1.
REGULAR = 2**0.5 / 12


@dataclass(frozen=True)
class FilledBody:
    """Vertices (n,3) and triangles (m,3) of a closed surface near the one that was given, and tetrahedra whose first
    points are those vertices."""

    vertices: np.ndarray
    triangles: np.ndarray
    mesh: TetMesh


def filled(vertices: np.ndarray, triangles: np.ndarray, count: int = 40_000) -> FilledBody:
    """About `count` tetrahedra within a surface (n,3), (m,3) that need be neither closed nor free of crossings.

    Raises
    ------
    CountError : more than this machine has memory for
    LibraryError : fTetWild is not installed
    NonFiniteError : coordinates are not finite
    TetrahedraError : nothing is inside

    References
    ----------
    Hu, Schneider, Wang, Zorin, Panozzo 2020
    """
    check_memory(count, BYTES_PER_ELEMENT, "A body of about {} tetrahedra")
    wrong = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(wrong):
        raise NonFiniteError("Coordinates are not finite numbers", kind="vertex", elements=wrong)
    used = vertices[triangles]
    low, box = used.min(axis=(0, 1)), np.ptp(used, axis=(0, 1))
    size = float(np.linalg.norm(box)) or 1.0
    scaled = (np.asarray(vertices, float) - low) / size
    volume = max(abs(float(corner_volumes(scaled, triangles).sum())) / 6, LEAST_SHARE * float((box / size).prod()))
    edge = float(np.clip(np.cbrt(GROWTH * volume / (REGULAR * max(count, 1))), FINEST, COARSEST))
    points, tets = _tetwild(scaled, triangles, edge)
    if not len(tets):
        raise TetrahedraError("The surface encloses nothing: fTetWild finds no tetrahedra inside")
    points, tets, boundary = _boundary_first(points, tets)
    points, tets = without_chords(points, tets, boundary)
    return FilledBody(points[: boundary.max() + 1] * size + low, boundary, TetMesh(points * size + low, tets))


def _tetwild(points: np.ndarray, triangles: np.ndarray, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) and tetrahedra (m,4) of positive volume with edges of about a length, by fTetWild."""
    try:
        import pytetwild
    except ImportError as error:
        raise LibraryError(
            "Tetrahedra of broken surfaces need the library fTetWild, which is not installed",
            "Install it: python -m pip install pytetwild pyvista",
        ) from error
    faces = np.ascontiguousarray(triangles, np.int32)
    # It leaves its surface in the folder that one is in.
    left = Path(TRACKED)
    mine = not left.exists()
    try:
        # One thread: the same tetrahedra each time.
        found, tets = pytetwild.tetrahedralize(
            np.ascontiguousarray(points, float), faces, edge_length_abs=edge, num_threads=1
        )
    except RuntimeError as error:
        raise TetrahedraError(f"fTetWild: {str(error).strip() or 'failed'}") from error
    finally:
        if mine:
            left.unlink(missing_ok=True)
    found, tets = np.asarray(found, float), np.asarray(tets, np.int64)
    tets = turned_right(found, tets)
    return found, tets[tet_volumes(found, tets) > 0]


def _boundary_first(points: np.ndarray, tets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n,3) that are used, tetrahedra (m,4), and the triangles (k,3) of their boundary, whose vertices come
    first."""
    boundary = boundary_triangles(tets)
    outer = np.unique(boundary)
    inner = np.setdiff1d(np.unique(tets), outer)
    order = np.concatenate([outer, inner])
    number = np.full(len(points), -1, np.int64)
    number[order] = np.arange(len(order))
    return points[order], number[tets], number[boundary]
