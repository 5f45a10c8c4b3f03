"""Measure how far a UV map is from keeping areas and angles, per face and for a whole mesh (Floater, Hormann 2005).

All area figures compare *shares*: a face's share of the UV area with its share of the surface, so that one scale for
the whole mesh does not count. All angle figures come from the singular values s1 >= s2 of the face's Jacobian.

A face is a polygon where it is said which polygon every triangle belongs to, a triangle otherwise. Then its area on the
surface is that of `mesh.polygon_areas`, in the map the sum over its triangles, and the shear of a quad is the mean over
both its triangulations, by area: no figure of a quad that is convex in the map knows which diagonal cuts it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import EmptyMeshError, NonFiniteError, ZeroAreaFaceError
from ..mesh.geometry import as_complex, bounds, cross2, cross3, extents, face_areas, lengths, part_by_part
from ..mesh.polygon_areas import BOTH, polygon_areas, quads
from ..mesh.topology import distinct, graph_components, halfedges, order_of_pairs, pair_keys
from .energy import AT_ONCE
from .overlap import overlap_share

SHEAR_CAP = 1e6  # a face squashed onto a line must not drown the mean of all others
RATIO_FLOOR = 1e-12  # likewise for the octaves of a face without UV area
VANISHED = 1e-2  # a triangle of a quad with so small a share of its area counts as turned over
NEGLIGIBLE_AREA = 1e-14  # share of the surface below which a face has no meaningful Jacobian
WELD = 1e-7  # corners of one vertex closer than this, relative to the UV extent, are one UV vertex


@dataclass(frozen=True)
class Distortion:
    """Figures of one UV map; every figure but the counts is independent of its scale, rotation and mirror image.

    faces, charts : how many were measured; a chart is connected by edges with equal UVs at both ends
    folds : faces with a triangle whose orientation differs from most of their chart's area, or without UV area
    area_l1 : share of the UV area that is in the wrong place times two, sum |UV share - surface share|; 0 is exact
    area_sd : area-weighted standard deviation of the ratio of the shares; 0 is exact
    area_p99, area_max : |log2 ratio| in octaves that 99 % of the surface stays under; the largest without folds
    angle_mean, angle_p99 : area-weighted mean and 99th percentile of s1/s2 over triangles that are not turned; 1 is
        conformal
    seed_area, seed_angle : mean of r + 1/r over faces without folds, and of s1/s2 + s2/s1; 2 is exact
        (Dominitz & Tannenbaum 2010, Tables 2 and 1); None where every face is folded
    overlap : share of the UV area that is covered more than once; None where it was not asked for
    uv_min, uv_max : corners of the bounding box
    finite : always True, as anything else is an error
    skipped_zero_area_faces : faces without area in 3D, left out of everything above
    """

    faces: int
    charts: int
    folds: int
    area_l1: float
    area_sd: float
    area_p99: float
    area_max: float
    angle_mean: float
    angle_p99: float
    seed_area: float | None
    seed_angle: float | None
    overlap: float | None
    uv_min: tuple[float, float]
    uv_max: tuple[float, float]
    finite: bool
    skipped_zero_area_faces: int


@dataclass(frozen=True)
class _FaceFigures:
    """Per measured face: share of the surface, UV share / surface share (negative where folded), s1/s2 of what is not
    turned, whether all, and whether nothing of it is; the number of charts."""

    weight: np.ndarray
    ratio: np.ndarray
    shear: np.ndarray
    folded: np.ndarray
    turned: np.ndarray
    charts: int


@dataclass(frozen=True)
class _Triangles:
    """Triangles of the surface and the map: V (n,3), F (m,3), uv (m,3,2), and the areas (m,) that they are to have."""

    V: np.ndarray
    F: np.ndarray
    uv: np.ndarray
    target: np.ndarray


def distortion(V, F, uv, *, overlap: bool = True, density=None, polygons=None) -> Distortion:
    """Area error, shear, folds and overlap of a UV map.

    Parameters
    ----------
    V : (n,3) positions
    F : (m,3) vertex indices of the triangles
    uv : (m,3,2) UV of every triangle corner
    overlap : also sample the overlap, which is most of the cost (100,000 faces: 0.2 of 0.3 seconds)
    density : (m,) > 0, how many times its area every face is meant to have; then "share of the surface" above is its
        share of area times density
    polygons : (m,) the polygon of every triangle, any numbers; None where each is its own. Figures are of polygons

    Raises
    ------
    EmptyMeshError : no faces
    NonFiniteError : a position or UV is NaN or infinite, or the area of all faces is beyond the greatest number
    ZeroAreaFaceError : no face has an area in 3D
    """
    V, F, uv, polygons = _checked(V, F, uv, polygons)
    area, real = _surface_area(V, F, polygons)
    polygons = _counted(polygons)
    target = area if density is None else area * np.asarray(density, float)
    measured = _Triangles(V, *(_of_real(x, real) for x in (F, uv, target)))
    del F, target, area
    faces = _measure_faces(measured, None if polygons is None else _of_real(polygons, real))
    w, ratio, good = faces.weight, faces.ratio, ~faces.folded
    octaves = np.abs(np.log2(np.maximum(ratio, RATIO_FLOOR)))
    r_good, sheared = ratio[good], ~faces.turned
    w_sheared, s_sheared = w[sheared], faces.shear[sheared]
    any_sheared = bool(sheared.any())
    low, high = bounds(measured.uv.reshape(-1, 2))
    return Distortion(
        faces=len(w),
        charts=faces.charts,
        folds=int(faces.folded.sum()),
        area_l1=float(np.abs(ratio * w - w).sum()),
        area_sd=float(np.sqrt(w @ (ratio - 1) ** 2)),
        area_p99=_weighted_quantile(octaves, w, 0.99),
        area_max=float(octaves[good].max(initial=0.0)),
        angle_mean=float(w_sheared @ s_sheared / w_sheared.sum()) if any_sheared else 0.0,
        angle_p99=_weighted_quantile(s_sheared, w_sheared, 0.99) if any_sheared else 0.0,
        seed_area=float((r_good + 1 / r_good).mean()) if len(r_good) else None,
        seed_angle=float((s_sheared + 1 / s_sheared).mean()) if any_sheared else None,
        overlap=overlap_share(measured.uv) if overlap else None,
        uv_min=tuple(low.tolist()),
        uv_max=tuple(high.tolist()),
        finite=True,
        skipped_zero_area_faces=int((~real).sum()) if polygons is None else len(np.unique(polygons[~real])),
    )


def face_distortion(V, F, uv, polygons=None) -> tuple[np.ndarray, np.ndarray]:
    """Signed octaves (m,) and shear s1/s2 (m,) of every face, for colours; arguments and errors as for `distortion`.

    Octaves are log2 of UV share over surface share: positive where the face has too much texture. A folded face has
    log2 of RATIO_FLOOR (about -40), a face without area in 3D has 0 and shear 1. With polygons (m,), every triangle has
    the values of its polygon.
    """
    V, F, uv, polygons = _checked(V, F, uv, polygons)
    area, real = _surface_area(V, F, polygons)
    polygons = _counted(polygons)
    of = np.arange(real.sum()) if polygons is None else np.unique(polygons[real], return_inverse=True)[1].ravel()
    faces = _measure_faces(_Triangles(V, F[real], uv[real], area[real]), None if polygons is None else of)
    octaves, shear = np.zeros(len(F)), np.ones(len(F))
    octaves[real] = np.log2(np.where(faces.folded, RATIO_FLOOR, np.maximum(faces.ratio, RATIO_FLOOR)))[of]
    shear[real] = faces.shear[of]
    return octaves, shear


def _checked(V, F, uv, polygons):
    """Positions, triangles, UVs and polygons, if any, as arrays; raises what `distortion` raises."""
    V, F, uv = np.asarray(V, float), np.asarray(F, np.int64), np.asarray(uv, float)
    if uv.shape != (*F.shape, 2) or F.ndim != 2 or F.shape[1] != 3:
        raise ValueError(f"expected F (m,3) and uv (m,3,2), got {F.shape} and {uv.shape}")
    if polygons is not None and np.shape(polygons) != (len(F),):
        raise ValueError(f"expected polygons ({len(F)},), got {np.shape(polygons)}")
    polygons = None if polygons is None else np.asarray(polygons)
    if not len(F):
        raise EmptyMeshError("There are no faces to measure")
    finite, mapped = np.isfinite(V), np.isfinite(uv)
    if not finite.all():
        bad_vertex = np.flatnonzero(~finite.all(1))
        bad_vertex = bad_vertex[np.isin(bad_vertex, F)]
        if len(bad_vertex):
            raise NonFiniteError("A position is not a finite number", "", "vertex", bad_vertex)
    if not mapped.all():
        bad_face = _names(polygons, ~mapped.all((1, 2)))
        raise NonFiniteError("A UV is not a finite number", "Unwrap these faces anew first", "face", bad_face)
    return V, F, uv, polygons


def _of_real(values: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Values (m, ...) of those triangles (m,) bool; of a large mesh a copy takes as much memory as the map."""
    return values if real.all() else values[real]


def _names(polygons: np.ndarray | None, chosen: np.ndarray) -> np.ndarray:
    """Numbers of the faces of chosen triangles (m,) bool."""
    return np.flatnonzero(chosen) if polygons is None else np.unique(polygons[chosen])


def _counted(polygons: np.ndarray | None) -> np.ndarray | None:
    """Polygons (m,) counted from 0; None where each triangle is a polygon of its own."""
    if polygons is None:
        return None
    found, counted = distinct(polygons)
    return None if len(found) == len(polygons) else counted


def _surface_area(V, F, polygons):
    """3D areas (m,), summing to those of the polygons (m,), and which triangles belong to faces with an area (m,)."""
    counted = _counted(polygons)
    area = polygon_areas(V, F, counted)
    whole = area if counted is None else np.bincount(counted, area)
    every = np.ones(len(F), bool)
    if not np.isfinite(whole.sum()):
        text = "The area of the faces is no finite number"
        raise NonFiniteError(text, "Scale them down", "face", _names(polygons, every))
    real = whole > NEGLIGIBLE_AREA * whole.sum()
    if not real.any():
        raise ZeroAreaFaceError("No face has an area", "", "face", _names(polygons, every))
    return area, real if counted is None else real[counted]


def _measure_faces(mesh: _Triangles, polygons) -> _FaceFigures:
    """Figures of the faces of a map: of its triangles, or of polygons (m,)."""
    uv = mesh.uv
    charts, chart = uv_charts(mesh.F, uv)
    uv_area = part_by_part(lambda some: 0.5 * cross2(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0]), uv)
    mirrored = (np.bincount(chart, uv_area, charts) < 0)[chart]
    del chart
    signed = np.where(mirrored, -uv_area, uv_area)
    if polygons is not None:
        del uv_area
        counted = distinct(polygons)[1].astype(np.int32)
        return _measure_polygons(mesh, signed, mirrored, counted, charts)
    weight = mesh.target / mesh.target.sum()
    ratio = signed / max(np.abs(uv_area).sum(), np.finfo(float).tiny) / weight
    return _FaceFigures(
        weight=weight,
        ratio=ratio,
        shear=shear_of(mesh.V, mesh.F, uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]),
        folded=ratio <= 0,
        turned=ratio <= 0,
        charts=charts,
    )


def _measure_polygons(mesh: _Triangles, signed, mirrored, polygons, charts: int) -> _FaceFigures:
    """Figures of polygons (m,), counted from 0, from the UV areas (m,) of the triangles, and those mirrored (m,)."""
    target = np.bincount(polygons, mesh.target)
    has = np.bincount(polygons, signed)
    weight = target / target.sum()
    ratio = has / max(np.abs(has).sum(), np.finfo(float).tiny) / weight
    area = face_areas(mesh.V, mesh.F)
    back = (signed <= 0) & (area > NEGLIGIBLE_AREA * area.sum())
    shear, turned = _shear_of_polygons(mesh, polygons, mirrored)
    return _FaceFigures(
        weight=weight,
        ratio=ratio,
        shear=shear,
        folded=(np.bincount(polygons, back) > 0) | (ratio <= 0),
        turned=turned,
        charts=charts,
    )


def _shear_of_polygons(mesh: _Triangles, polygons, mirrored) -> tuple[np.ndarray, np.ndarray]:
    """s1/s2 (p,) of polygons (m,), the mean by area over triangles that are not turned, and whether all are (p,) bool.

    Of a quad the four triangles of both diagonals count, of other polygons those given. Where all are turned, the mean
    is over all of them.
    """
    square = quads(mesh.F, polygons).astype(np.int32)
    alone = np.ones(len(mesh.F), bool)
    alone[square[:, :2] // 3] = False
    lone, count = int(alone.sum()), int(polygons.max()) + 1
    single = (3 * np.flatnonzero(alone)[:, None] + np.arange(3)).astype(np.int32)
    corner = np.concatenate([single, square[:, BOTH].reshape(-1, 3)])
    del alone, square
    area = part_by_part(lambda some: face_areas(mesh.V, mesh.F.ravel()[some]), corner)
    real = area > NEGLIGIBLE_AREA * area.sum()
    corner, area, given = _of_real(corner, real), _of_real(area, real), int(real[:lone].sum())
    has, shear = np.empty(len(area)), np.empty(len(area))
    for begin in range(0, len(area), AT_ONCE):
        here = slice(begin, begin + AT_ONCE)
        has[here], shear[here] = _double_areas_and_shear(mesh, corner[here])
    of = corner[:, 0] // 3
    del corner
    has *= np.where(mirrored[of], -1, 1)
    of = polygons[of]
    # A triangle that is about to turn over says no more of its quad than one that has.
    covered = max(float(np.abs(has).sum()), float(np.finfo(float).tiny))
    forward = np.empty(len(area), bool)
    for here, least in ((slice(given), 0), (slice(given, None), VANISHED)):
        forward[here] = has[here] > least * area[here] * covered / area.sum()
    del has
    turned = np.bincount(of, forward, count) == 0
    area[~(forward | turned[of])] = 0
    total = np.bincount(of, area, count)
    area *= shear
    return np.divide(np.bincount(of, area, count), total, out=np.ones(count), where=total > 0), turned


def _double_areas_and_shear(mesh: _Triangles, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twice the signed UV areas of triangles of these corners (k,3) of a mesh, and their shear s1/s2: (k,) each."""
    F, uv = mesh.F.ravel()[corner], mesh.uv.reshape(-1, 2)[corner]
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return cross2(a, b), shear_of(mesh.V, F, a, b)


def shear_of(V, F, a, b):
    """s1/s2 (m,) of the maps that send the edges 01 and 02 of the faces to `a` and `b` (m,2), capped."""
    return part_by_part(lambda *some: _shear_of(V, *some), F, a, b)


def _shear_of(V, F, a, b):
    """`shear_of` of all faces at once."""
    e, f = V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]
    base = lengths(e)
    along = np.einsum("ij,ij->i", e, f) / base
    height = lengths(cross3(e, f)) / base
    J0 = a / base[:, None]
    J1 = (b - J0 * along[:, None]) / height[:, None]
    # (s1 +- s2)^2 = |J|^2 +- 2 det, so neither value suffers from cancellation as the roots of J^T J would
    square = (J0**2 + J1**2).sum(1)
    det = np.abs(cross2(J0, J1))
    s1 = (np.sqrt(square + 2 * det) + np.sqrt(np.maximum(square - 2 * det, 0))) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        shear = s1**2 / det
    return np.minimum(np.where(det > 0, shear, SHEAR_CAP), SHEAR_CAP)


def uv_charts(F, uv):
    """Number of charts and chart (m,) of every face: faces are joined by edges with equal UVs at both ends."""
    T = F if _is_one_to_a_vertex(F, uv) else _welded_corners(F, uv)
    edge = pair_keys(*halfedges(T))
    order = order_of_pairs(edge)
    edge = edge[order]
    same = edge[1:] == edge[:-1]
    del edge
    face = (order // 3).astype(np.int32)
    del order
    return graph_components(face[1:][same], face[:-1][same], len(F))


def _is_one_to_a_vertex(F, uv) -> bool:
    """Whether all corners of a vertex have the same UVs (m,3,2)."""
    flat, corner = F.ravel(), as_complex(uv.reshape(-1, 2))
    of = np.empty(int(flat.max(initial=-1)) + 1, complex)
    of[flat] = corner
    return bool((of[flat] == corner).all())


def _welded_corners(F, uv):
    """A number (m,3) for each place of a vertex in UVs (m,3,2): the same for corners that lie on one another."""
    corner = uv.reshape(-1, 2)
    extent = extents(corner).max() + np.finfo(float).tiny
    u, v = np.round(corner / extent / WELD).T
    order = np.lexsort((v, u, F.ravel()))
    rows = np.stack([F.ravel()[order], u[order], v[order]])
    index = np.empty(F.size, np.int64)
    index[order] = np.concatenate([[0], np.cumsum((rows[:, 1:] != rows[:, :-1]).any(0))])
    return index.reshape(-1, 3)


def _weighted_quantile(values, weights, q):
    """The least of the values (m,) that a share q of the weights (m,) does not exceed."""
    order = np.argsort(values)
    total = np.cumsum(weights[order]) / weights.sum()
    return float(values[order][min(np.searchsorted(total, q), len(values) - 1)])
