"""Unwrap, refine, magnify, remesh, map to the sphere and measure, each by one plain function on arrays.

Every function drains the generator of the same name in `steps`; `progress` is called with every `Progress` on the way,
and may raise to stop it. Nothing that is passed in is changed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ..maps import distortion as figures
from ..maps.distortion import Distortion
from ..progress import Progress, drain
from ..remeshing import Remesh
from ..sphere.sphere_map import SphereMap
from . import steps
from .arrays import Faces, polygon_surface, to_corners
from .results import MagnifiedUVs, UVs

Callback: TypeAlias = Callable[[Progress], None] | None


def unwrap(
    vertices: np.ndarray, faces: Faces, *, seams=(), density=None, pins=None, progress: Callback = None, **options
) -> UVs:
    """Unwrap a surface so that every face has its share of the UV area, no face folds, and the shear is the least.

    Conformal map by discrete Yamabe flow, optimal transport of its areas, refinement by Newton's method.

    Parameters
    ----------
    vertices : (n,3) positions
    faces : (m,k) vertex indices, counter-clockwise, or a list of polygons
    seams : (s,2) pairs of vertices, edges to cut; what they leave closed is cut open along short paths
    density : (m,) > 0, how many times its area every face asks for; 1 by default
    pins : ((c,) bool, UVs in the shape of the result): corners that keep their places, with a free boundary
    progress : called with every `Progress`
    **options : fields of `UnwrapOptions`: boundary "free" (default), "disk" or "square"; quality "draft", "standard"
        or "exact"; balance from 0, exact areas, to 1, least shear; cuts "auto" or "existing", which
        refuses what the seams do not cut into disks; fill_holes; max_shear, to cut further until the mean is below

    Returns
    -------
    UVs : in units of the surface, islands side by side where nothing is pinned; `figures.area_l1` is the area error,
        `figures.angle_mean` the shear, `figures.folds` is 0 unless a warning says why not

    Raises
    ------
    MeshError : what is wrong with the mesh, with the indices of the elements
    ValueError, TypeError : arrays of wrong shapes, options that do not exist

    References
    ----------
    Su et al. 2016 (transport), Springborn 2020 (conformal map), Degener, Meseth, Klein 2003 (area term).

    Examples
    --------
    >>> import numpy as np
    >>> from omt_uv import solver as omt
    >>> x, y = np.meshgrid(np.arange(7.0), np.arange(7.0))
    >>> vertices = np.column_stack([x.ravel(), y.ravel(), np.sin(x.ravel())])
    >>> corner = (7 * np.arange(6)[:, None] + np.arange(6)).ravel()
    >>> faces = np.column_stack([corner, corner + 1, corner + 8, corner + 7])
    >>> result = omt.unwrap(vertices, faces)
    >>> result.uv.shape, result.figures.folds, bool(result.figures.area_l1 < 0.01)
    ((36, 4, 2), 0, True)
    """
    run = steps.unwrap(vertices, faces, seams=seams, density=density, pins=pins, **options)
    return drain(run, progress)


def refine(
    vertices: np.ndarray,
    faces: Faces,
    uv: np.ndarray,
    *,
    balance: float = 0.0,
    quality: str = "standard",
    progress: Callback = None,
) -> UVs:
    """Give the faces of existing UVs their areas, whatever unwrapped them; every island keeps its place.

    Parameters
    ----------
    vertices, faces : as for `unwrap`
    uv : (m,k,2) or (c,2), UVs of every corner; islands are what is joined by equal UVs
    balance : from 0, exact areas, to 1, least shear
    quality : "draft", "standard" or "exact"
    progress : called with every `Progress`

    Returns
    -------
    UVs : all islands at one texel density, with the UV area that they had together

    Raises
    ------
    FoldedUVError : UVs that are folded beyond repair; unwrap anew

    Examples
    --------
    >>> import numpy as np
    >>> from omt_uv import solver as omt
    >>> vertices = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 0.5, 0.5]])
    >>> faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    >>> before = vertices[faces][:, :, :2] ** 2
    >>> bool(omt.refine(vertices, faces, before).figures.area_l1 < omt.distortion(vertices, faces, before).area_l1)
    True
    """
    return drain(steps.refine(vertices, faces, uv, balance=balance, quality=quality), progress)


def magnify(
    vertices: np.ndarray,
    faces: Faces,
    uv: np.ndarray,
    weights: np.ndarray,
    factor: float = 4.0,
    *,
    progress: Callback = None,
    **options,
) -> MagnifiedUVs:
    """Give a painted region `factor` times its share of the UV area, in every island that it touches.

    Parameters
    ----------
    vertices, faces, uv : as for `refine`
    weights : (n,) in [0, 1], the region: 1 inside, 0 outside, between them a smooth step
    factor : how many times its share the region gets
    progress : called with every `Progress`
    **options : exact (True; False for the factor between weight 1 and 0), boundary "own" (circles and straight sides
        stay) or "free", quality

    Raises
    ------
    WeightError, ShareError : weights that mark no region, a share that no map has
    FoldedUVError : UVs with folds

    References
    ----------
    Zhao et al. 2013, area preserving mappings for focus and context.

    Examples
    --------
    >>> import numpy as np
    >>> from omt_uv import solver as omt
    >>> x, y = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 13))
    >>> vertices = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    >>> corner = (13 * np.arange(12)[:, None] + np.arange(12)).ravel()
    >>> faces = np.column_stack([corner, corner + 1, corner + 14, corner + 13])
    >>> weights = np.clip(1.5 - 3 * np.hypot(x, y).ravel(), 0, 1)
    >>> result = omt.magnify(vertices, faces, vertices[faces][:, :, :2], weights, factor=3)
    >>> round(result.share_after / result.share_before, 1)
    3.0
    """
    return drain(steps.magnify(vertices, faces, uv, weights, factor, **options), progress)


def sphere_map(vertices: np.ndarray, faces: Faces, *, progress: Callback = None, **options) -> SphereMap:
    """Map a closed surface of genus 0 to the unit sphere, every face with its share of 4 pi.

    Parameters
    ----------
    vertices, faces : as for `unwrap`, closed, without handles
    progress : called with every `Progress`
    **options : density (m,) of the faces; balance; quality; method "newton", optimal transport, or "flow", that of
        Dominitz and Tannenbaum

    Returns
    -------
    SphereMap : `positions` (n,3), unit vectors

    Raises
    ------
    NotASphereError : the surface is open, or has handles or several components

    References
    ----------
    Cui et al. 2019 (transport), Dominitz, Tannenbaum 2010 (flow).

    Examples
    --------
    >>> import numpy as np
    >>> from omt_uv import solver as omt
    >>> vertices = np.array([[2, 0, 0], [0, 1, 0], [0, 0, 1], [-2, 0, 0], [0, -1, 0], [0, 0, -1]], float)
    >>> faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    >>> np.allclose(np.linalg.norm(omt.sphere_map(vertices, faces).positions, axis=1), 1)
    True
    """
    return drain(steps.sphere_map(vertices, faces, **options), progress)


def remesh(vertices: np.ndarray, faces: Faces, count: int, *, progress: Callback = None, **options) -> Remesh:
    """Remesh a surface with `count` vertices, its triangles equilateral as far as can be.

    Parameters
    ----------
    vertices, faces : as for `unwrap`
    count : vertices of the new mesh, or faces with count_of="faces"
    progress : called with every `Progress`
    **options : density (m,) of the faces; features (e,2) pairs of vertices, edges to keep; others are fields of
        `RemeshOptions`

    Returns
    -------
    Remesh : `vertices` (count,3) and `triangles` (t,3); `faces` and `barycentric` say where each vertex lies

    Raises
    ------
    CountError : fewer than the topology, boundaries and features take, or more than this machine has memory for

    References
    ----------
    B. Gu 2018, Geometric Compression Based on Ricci Flow and Monge-Ampere Equation.

    Examples
    --------
    >>> import numpy as np
    >>> from omt_uv import solver as omt
    >>> x, y = np.meshgrid(np.arange(6.0), np.arange(6.0))
    >>> vertices = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    >>> corner = (6 * np.arange(5)[:, None] + np.arange(5)).ravel()
    >>> faces = np.column_stack([corner, corner + 1, corner + 7, corner + 6])
    >>> omt.remesh(vertices, faces, 100).vertices.shape
    (100, 3)
    """
    return drain(steps.remesh(vertices, faces, count, **options), progress)


def distortion(vertices: np.ndarray, faces: Faces, uv: np.ndarray, *, overlap: bool = True) -> Distortion:
    """Measure the area error, shear, folds and overlap of UVs, face by face: polygons, however they are cut.

    Parameters
    ----------
    vertices, faces : as for `unwrap`
    uv : (m,k,2) or (c,2), UVs of every corner
    overlap : also sample the overlap, which is most of the cost

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : nothing that could be measured

    Examples
    --------
    >>> import numpy as np
    >>> from omt_uv import solver as omt
    >>> vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    >>> stretched = np.array([[[0, 0], [2, 0], [2, 1], [0, 1]]], float)
    >>> round(omt.distortion(vertices, np.array([[0, 1, 2, 3]]), stretched).angle_mean, 6)
    2.0
    """
    surface = polygon_surface(vertices, faces)
    corner_uv = to_corners(uv, surface)
    triangles = surface.corner_vertex[surface.triangles]
    return figures.distortion(
        surface.positions, triangles, corner_uv[surface.triangles], overlap=overlap, polygons=surface.triangle_face
    )
