"""Pack islands into the unit square with xatlas: one scale for all, a margin in pixels, no overlap.

xatlas decides only where islands go. It stretches every chart to whole texels, and its own quarter turns
mirror charts, so neither is taken over: islands are turned here and moved by a translation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..errors import UserError

# Extent that the largest island has for xatlas, which drops faces of meshes with small units.
EXTENT = 100.0
# xatlas ignores triangles of less than half of this area, at that extent, and leaves their vertices where they may.
LEAST_AREA = 4e-7
# Islands below this share of the largest are shown to xatlas in this size: it drops smaller ones.
SPECK = 1e-4
# Texels along a side; rasterising finer costs more than the space it saves.
MAX_RASTER = 2048
# Texels of the widest gap; wider ones are made by rasterising coarser.
MAX_GAP = 31
# How often the raster is made coarser until the margins fit; a few times are enough where they do at all.
ATTEMPTS = 8
# Rectangles whose areas differ by this share are equally large.
EQUAL = 1e-6
# Atlases up to so many times as wide as high are square enough.
OBLONG = 1.05
# How often a larger scale is tried in a square for others: each halves the range of scales, and costs a packing.
TRIALS = 5
REMEDY = "Lower the margin or raise the texture size"


class PackingError(UserError):
    """The packer cannot be loaded or failed."""


class MarginError(PackingError):
    """The margins leave no room for the islands."""


@dataclass(frozen=True)
class Packing:
    """Islands (n_i,2) in the unit square, `scale` from input to UV length, the packer's name, used area share."""

    islands: list[np.ndarray]
    scale: float
    packer: str
    coverage: float


def pack(
    islands: Sequence[np.ndarray], triangles: Sequence[np.ndarray], margin: float = 4, texture_size: int = 1024
) -> Packing:
    """Place islands in the unit square without overlap, all scaled by the same factor and never mirrored.

    Parameters
    ----------
    islands : (n_i,2) positions in one common unit of length
    triangles : (m_i,3) vertex indices; vertices that none uses come to lie in the middle of their island
    margin : least distance between islands and to the border, in pixels
    texture_size : pixels along a side of the unit square

    Raises
    ------
    MarginError : the margins alone fill the texture
    PackingError : xatlas cannot be imported or fails
    """
    if 2 * margin >= texture_size:
        raise MarginError(f"A margin of {margin:g} pixels fills a texture of {texture_size} pixels. {REMEDY}.")
    # What no triangle uses, as the centres of filled holes, is not placed.
    used = [np.unique(t) for t in triangles]
    points = [p[u] for p, u in zip(islands, used, strict=True)]
    faces = [np.searchsorted(u, t) for u, t in zip(used, triangles, strict=True)]
    packing = _pack(points, faces, margin, texture_size)
    placed = [_spread(p, u, len(whole)) for p, u, whole in zip(packing.islands, used, islands, strict=True)]
    return replace(packing, islands=placed)


def _spread(points: np.ndarray, rows: np.ndarray, count: int) -> np.ndarray:
    """Points (k,2) in rows (k,) of (count,2), and their middle in all others."""
    result = np.tile(points.mean(axis=0), (count, 1))
    result[rows] = points
    return result


def _pack(islands: list[np.ndarray], triangles: list[np.ndarray], margin: float, texture_size: int) -> Packing:
    """Pack islands all of whose vertices are used; see `pack`."""
    turned = [turn_upright(p) for p in islands]
    inner = texture_size - 2 * margin
    if len(islands) == 1:
        return _alone(turned[0], triangles[0], inner / texture_size)
    raster = float(min(texture_size, MAX_RASTER))
    # xatlas grows every island by the padding, so two stay twice as far apart; shrinking them from whole
    # texels back to scale can move each outline by half a texel, and never together.
    padding = int(np.ceil(0.5 * min(margin * raster / inner, MAX_GAP) + 0.5))
    # The margin is kept as long as the gap, in an atlas this wide, is at least `margin` pixels.
    widest = (2 * padding - 1) * inner / margin if margin > 0 else np.inf
    for _ in range(ATTEMPTS):
        placed, scale = _place(turned, triangles, max(int(raster), 1), padding)
        size = max(_extent(placed))
        if size <= widest:
            break
        raster *= 0.95 * widest / size
    else:
        raise MarginError(f"No room for {len(islands)} islands with a margin of {margin:g} pixels. {REMEDY}.")
    side = int(min(widest, max(size, MAX_RASTER)))
    placed, scale = _squarer(turned, triangles, placed, scale, side, padding)
    low = np.min([p.min(axis=0) for p in placed], axis=0)
    fit = inner / max(_extent(placed))
    origin = margin / texture_size
    result = [(p - low) * (fit / texture_size) + origin for p in placed]
    return Packing(result, scale * fit / texture_size, "xatlas", covered_area(result, triangles))


def _extent(islands) -> np.ndarray:
    """Width and height (2,) of what islands (n_i,2) take together."""
    return np.max([p.max(axis=0) for p in islands], axis=0) - np.min([p.min(axis=0) for p in islands], axis=0)


def _squarer(islands, triangles, placed, scale: float, side: int, padding: int) -> tuple[list[np.ndarray], float]:
    """Islands placed anew in a square of `side` texels, as large as they fit, if they fit larger than `placed`.

    Left to choose a scale, xatlas fills a rectangle of any shape, at times a tenth of the square around it.
    """
    narrow, wide = sorted(_extent(placed))
    best = placed, scale
    longest = max(float(np.ptp(p, axis=0).max()) for p in islands)
    fits = scale * side / wide
    # What has more room to be moved in also fits a little better.
    fails = min(1.1 * fits * np.sqrt(wide / narrow), side / longest)
    for _ in range(TRIALS if wide > OBLONG * narrow else 0):
        density = np.sqrt(fits * fails)
        try:
            found = _place(islands, triangles, side, padding, density)
        except PackingError:  # they do not fit
            fails = density
            continue
        fits = density
        if found[1] / max(_extent(found[0])) > best[1] / max(_extent(best[0])):
            best = found
    return best


def _alone(points: np.ndarray, triangles: np.ndarray, width: float) -> Packing:
    """One island (n,2) as large as a square of this width in the middle of the unit square allows, at its lower left.

    There is nothing to arrange, and xatlas keeps Blender waiting.
    """
    low = points.min(axis=0)
    scale = width / float((points - low).max())
    placed = [(points - low) * scale + (1 - width) / 2]
    return Packing(placed, scale, "none", covered_area(placed, [triangles]))


def stack(islands: Sequence[np.ndarray]) -> Packing:
    """Islands centred one upon the other, all at the scale at which the largest fits the unit square."""
    size = max(float(np.ptp(p, axis=0).max()) for p in islands)
    centred = [(p - 0.5 * (p.min(axis=0) + p.max(axis=0))) / size + 0.5 for p in islands]
    return Packing([np.clip(p, 0, 1) for p in centred], 1 / size, "none", float("nan"))


def turn_upright(points: np.ndarray) -> np.ndarray:
    """Points (n,2) turned so that their smallest enclosing rectangle is upright, its long side along v.

    Of several as small it is the one whose long side is the shortest.
    """
    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:
        return points
    edge = np.roll(hull, -1, axis=0) - hull
    # One side of the smallest enclosing rectangle lies on an edge of the convex hull (Freeman & Shapira 1975).
    direction = edge / np.linalg.norm(edge, axis=1)[:, None]
    normal = np.column_stack([-direction[:, 1], direction[:, 0]])
    sides = _widths(hull, direction), _widths(hull, normal)
    # All three rectangles of a triangle have the same area: rounding shall not choose, and the shortest fits best.
    equal = sides[0] * sides[1] <= (1 + EQUAL) * (sides[0] * sides[1]).min()
    best = np.argmin(np.where(equal, np.maximum(*sides), np.inf))
    c, s = direction[best]
    if sides[0][best] > sides[1][best]:
        c, s = -s, c
    return points @ np.array([[c, -s], [s, c]])


def _widths(hull: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Widths (k,) of a convex polygon (h,2), counterclockwise, along unit vectors (k,2), in h + k steps or so."""
    edge = np.roll(hull, -1, axis=0) - hull
    angle = np.unwrap(np.arctan2(edge[:, 1], edge[:, 0]))
    # A vertex is the farthest between the edges before and after it; rounding may mean its neighbours.
    ahead = np.arctan2(direction[:, 1], direction[:, 0])[:, None] + np.array([0.5, -0.5]) * np.pi
    found = np.searchsorted(angle, angle[0] + (ahead - angle[0]) % (2 * np.pi))
    near = (found[:, :, None] + [-1, 0, 1]) % len(hull)
    reach = np.einsum("ksnd,kd->ksn", hull[near], direction)
    return reach[:, 0].max(axis=1) - reach[:, 1].min(axis=1)


def _place(islands, triangles, raster: int, padding: int, density: float = 0.0) -> tuple[list[np.ndarray], float]:
    """Islands in texels, and texels per unit of length.

    density : how many these shall be, in a square of `raster` texels; raises a PackingError where islands do not fit
        that. By default the atlas is roughly as large as such a square, and of any shape
    """
    try:
        import xatlas
    except ImportError as error:
        raise PackingError(f"xatlas cannot be imported: {error}") from error

    extent = max(float(np.ptp(p, axis=0).max()) for p in islands)
    own = np.array([np.ptp(p, axis=0) for p in islands])
    own *= np.maximum(1, SPECK * extent / own.max(axis=1))[:, None]
    meshes = [
        _for_xatlas(p, t, float(size.max()) * EXTENT / extent)
        for p, size, t in zip(islands, own, triangles, strict=True)
    ]
    atlas = xatlas.Atlas()
    # xatlas keeps pointers to these arrays until generate(); `meshes` keeps them alive.
    for uv, index in meshes:
        atlas.add_uv_mesh(uv, index)
    options = xatlas.PackOptions()
    options.resolution, options.padding = raster, padding
    options.texels_per_unit = density * extent / EXTENT
    options.rotate_charts = options.rotate_charts_to_axis = False
    try:
        atlas.generate(pack_options=options)
    except RuntimeError as error:
        raise PackingError(f"xatlas failed: {error}") from error
    if atlas.atlas_count != 1:
        raise PackingError(f"xatlas made {atlas.atlas_count} atlases instead of one")

    low, size = np.empty((len(islands), 2)), np.empty((len(islands), 2))
    for k in range(len(islands)):
        texel = atlas.get_mesh(k)[2][np.unique(meshes[k][1])] * [atlas.width, atlas.height]
        low[k], size[k] = texel.min(axis=0), np.ptp(texel, axis=0)
    if not (np.isfinite(low).all() and (size > 0).all()):
        raise PackingError("xatlas left an island unplaced")
    scale = float((size / own).min())
    centre = low + 0.5 * size
    return [
        (p - 0.5 * (p.min(axis=0) + p.max(axis=0))) * scale + c for p, c in zip(islands, centre, strict=True)
    ], scale


def _for_xatlas(points: np.ndarray, triangles: np.ndarray, extent: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,2) from 0 to the extent, and the triangles (m,3) that still have an area in single precision.

    Vertices of others, slivers of a cap of thousands of sides and of no width in a texture, xatlas places elsewhere.
    """
    points = points - points.min(axis=0)
    points = np.ascontiguousarray(points * (extent / points.max()), np.float32)
    a, b, c = (points[triangles[:, k]].astype(float) for k in range(3))
    double_area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    kept = double_area * np.sign(double_area.sum()) > LEAST_AREA
    return points, np.ascontiguousarray(triangles[kept] if kept.any() else triangles, np.uint32)


def covered_area(islands: Sequence[np.ndarray], triangles: Sequence[np.ndarray]) -> float:
    """Share of the unit square that islands (n_i,2) without overlap cover."""
    total = 0.0
    for uv, index in zip(islands, triangles, strict=True):
        a, b, c = (uv[index[:, k]] for k in range(3))
        total += 0.5 * float(np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum())
    return total
