"""Sample a surface: points that stand for its area, its crests, and its tips."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import scipy.sparse as sp

from ...linalg.nested_dissection import LARGE
from ...linalg.sparse import solve_conjugate_gradients, solve_spd
from ...mesh.closest_point import ClosestPoint, closest_on_triangles, spread_points
from ...mesh.geometry import cotangent_laplacian, face_areas, of_corners, unit
from ...mesh.topology import row_labels

# Normals are smoothed over this share of an edge of the new mesh.
BLUR = 0.2
# Where they then cancel by more than this there is a crest or a hollow that is sharp at this scale.
BLUNT = 0.03
# Distance of the samples of crests, in edges of the new mesh.
PITCH = 0.4
# Those within cubes with this edge are merged, in edges of the new mesh: twice as large ones make edges 1 % less even.
MERGED = 0.2
# Length of a vertex's mean normal below which it is a tip, or lies on an edge.
POINTED = 0.9
# Share of the largest weight below which a sample of a crest is left out.
NEGLIGIBLE = 0.01


@dataclass(frozen=True)
class SurfaceSamples:
    """Points (s,3) of a surface with its normals (s,3), the area each stands for (s,) and its triangle (s,)."""

    points: np.ndarray
    normals: np.ndarray
    area: np.ndarray
    faces: np.ndarray


def area_samples(index: ClosestPoint, count: int, density: np.ndarray) -> SurfaceSamples:
    """Sample a surface about `count` times, at most twice as often, by its area times the density (m,), of mean 1.

    The areas that the samples stand for sum to the surface's where there are no more than twice as many.
    """
    area = face_areas(index.vertices, index.triangles)
    spacing = np.sqrt(2 * area.sum() / (count * density.max()))
    owner, points = spread_points(index.vertices, index.triangles, spacing)
    share = area[owner] / np.bincount(owner, minlength=len(area))[owner]
    if len(owner) > 2 * count:
        # A few of them stand for all, as often as their measure is large.
        measure = np.cumsum(share * density[owner])
        pick = np.searchsorted(measure, (np.arange(count) + 0.5) / count * measure[-1])
        owner, points = owner[pick], points[pick]
        share = measure[-1] / count / density[owner]
    return SurfaceSamples(points=points, normals=index.normals[owner], area=share, faces=owner)


def tip_samples(index: ClosestPoint, most: int) -> SurfaceSamples:
    """The vertices around which the normals differ most, `most` at the most, each with a quarter of the mean area.

    Few as they are, samples spread over the area would miss the points that stick out.
    """
    V, T = index.vertices, index.triangles
    area, corner, n = face_areas(V, T), T.ravel(), len(V)
    total = np.bincount(corner, np.repeat(area, 3), n)
    sums = [np.bincount(corner, np.repeat(area * index.normals[:, k], 3), n) for k in range(3)]
    normal = np.stack(sums, axis=1) / np.maximum(total, 1e-300)[:, None]
    length = np.sqrt(np.einsum("ni,ni->n", normal, normal))
    tips = np.argsort(length, kind="stable")[:most]
    tips = tips[(length[tips] < POINTED) & (total[tips] > 0)]
    face = np.empty(n, np.int64)
    face[corner] = np.repeat(np.arange(len(T)), 3)
    weight = np.full(len(tips), area.sum() / (4 * most))
    return SurfaceSamples(
        points=V[tips],
        normals=normal[tips] / np.maximum(length[tips], 1e-300)[:, None],
        area=weight,
        faces=face[tips],
    )


def join_samples(a: SurfaceSamples, b: SurfaceSamples) -> SurfaceSamples:
    """All samples of both."""
    return SurfaceSamples(*(np.concatenate([getattr(a, f.name), getattr(b, f.name)]) for f in fields(SurfaceSamples)))


def select_samples(samples: SurfaceSamples, rows: np.ndarray) -> SurfaceSamples:
    """Those of the samples in these rows (k,)."""
    return SurfaceSamples(*(getattr(samples, f.name)[rows] for f in fields(SurfaceSamples)))


def sharpness(index: ClosestPoint) -> np.ndarray:
    """How much the normals around every vertex cancel, (n,) in [0,1]: 1 - |normal after a little diffusion|.

    The diffusion is one implicit step of the heat equation along the surface, so that the two sides of a thin plate
    do not see each other but around its edge.
    """
    V, T = index.vertices, index.triangles
    corner, n, third = T.ravel(), len(V), face_areas(V, T) / 3
    mass = np.bincount(corner, np.repeat(third, 3), n)
    right = [np.bincount(corner, np.repeat(third * index.normals[:, k], 3), n) for k in range(3)]
    diffusion = (BLUR * index.spacing) ** 2 * cotangent_laplacian(V, T)
    system = sp.diags(mass + 1e-9 * mass.mean()) + diffusion
    if n < LARGE:
        normal = solve_spd(system.tocsc(), np.stack(right, axis=1))
    else:
        # So little diffusion leaves the system near its diagonal: factors take five times as long.
        normal = np.stack([solve_conjugate_gradients(system.tocsr(), one) for one in right], axis=1)
    return np.clip(1 - np.sqrt(np.einsum("ni,ni->n", normal, normal)), 0, 1)


def crest_samples(index: ClosestPoint) -> SurfaceSamples:
    """Sample crests and hollows; the area of a sample is weighed by how sharp the surface is there."""
    V, T = index.vertices, index.triangles
    sharp = np.maximum(sharpness(index) - BLUNT, 0)
    mine = np.flatnonzero(of_corners(np.maximum, sharp[T]) > 0)
    if len(mine) == 0:
        return SurfaceSamples(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), mine)
    place, points = spread_points(V, T[mine], PITCH * index.spacing)
    share = (face_areas(V, T[mine]) / np.bincount(place, minlength=len(mine)))[place]
    faces = mine[place]
    corners = T.take(faces, axis=0)
    bary = closest_on_triangles(points, *(V.take(corner, axis=0) for corner in corners.T))
    weight = share * np.einsum("sk,sk->s", bary, sharp[corners])
    kept = weight > NEGLIGIBLE * weight.max()
    samples = SurfaceSamples(points[kept], index.normals[faces[kept]], weight[kept], faces[kept])
    return merged_samples(samples, MERGED * index.spacing)


def merged_samples(samples: SurfaceSamples, edge: float) -> SurfaceSamples:
    """One sample in the place of all in a cube with this edge that look about the same way: their mean by area.

    Where a surface is finer than the new mesh, each of its triangles has a sample.
    """
    cubes = np.floor((samples.points - samples.points.min(axis=0)) / edge)
    label = row_labels(np.column_stack([cubes, np.rint(samples.normals) + 1]))
    area = np.bincount(label, samples.area)

    def mean(rows):
        return np.stack([np.bincount(label, samples.area * column) for column in rows.T], axis=1) / area[:, None]

    face = np.empty(len(area), np.int64)
    order = np.argsort(samples.area, kind="stable")
    # Of several that are written to one place the last one stays: the largest.
    face[label[order]] = samples.faces[order]
    return SurfaceSamples(points=mean(samples.points), normals=unit(mean(samples.normals)), area=area, faces=face)
