"""Pack islands that may lie any way: all in their smallest boxes, and large ones at the angle that packs closest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull

from ..progress import Steps, part_of
from .outline_raster import island_areas
from .pack_square import Packing, pack

# Islands with this share of the area are large: so many angles within a quarter turn are tried of them; and of one
# alone, which is placed at once, so many.
LARGE = 0.2
ANGLES = 8
ANGLES_ALONE = 64
# What trying them takes of the time, roughly.
TRYING = 0.8


def pack_turned(
    islands: Sequence[np.ndarray],
    triangles: Sequence[np.ndarray],
    margin: float = 4,
    texture_size: int = 1024,
    around: Sequence[tuple[np.ndarray, np.ndarray]] = (),
    turnable: np.ndarray | None = None,
) -> Steps[Packing]:
    """Place islands in the unit square without overlap, turned as they pack closest.

    turnable (k,) bool : islands that may be turned, all by default; all else, and errors: see `pack_square.pack`
    """
    areas = island_areas(islands, triangles)
    may = areas > 0 if turnable is None else turnable & (areas > 0)
    boxed = [in_smallest_box(uv, t) if k else uv for uv, t, k in zip(islands, triangles, may, strict=True)]
    large = may & (areas >= LARGE * areas.sum())
    best, most = boxed, 0.0
    count = (ANGLES_ALONE if len(islands) == 1 else ANGLES) if large.any() else 0
    for k, angle in enumerate(np.linspace(0, np.pi / 2, count, endpoint=False)):
        turned = [_turned(uv, angle) if is_large else uv for uv, is_large in zip(boxed, large, strict=True)]
        trying = pack(turned, triangles, margin, texture_size, around, roughly=True, any_side=may)
        scale = (yield from part_of(trying, TRYING * k / count, TRYING / count)).scale
        if scale > most:
            best, most = turned, scale
    begin = TRYING if count else 0.0
    return (yield from part_of(pack(best, triangles, margin, texture_size, around, any_side=may), begin, 1 - begin))


def in_smallest_box(uv: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A map (n,2) turned so that the box around its triangles (m,3) is smallest: along a side of their convex hull.

    The box lies on its longer side, and the middle of the hull below its own: however the map lay before.
    """
    points = uv[np.unique(triangles)]
    # Joggled, since slivers have no hull in double precision.
    hull = points[ConvexHull(points, qhull_options="QJ").vertices]
    side = np.roll(hull, -1, axis=0) - hull
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    across = np.stack([-side[:, 1], side[:, 0]], axis=1)
    extents = [np.ptp(hull @ direction.T, axis=0) for direction in (side, across)]
    best = int(np.argmin(extents[0] * extents[1]))
    axes = np.stack([side[best], across[best]], axis=1)
    if extents[0][best] < extents[1][best]:
        axes = np.stack([across[best], -side[best]], axis=1)
    height = (hull @ axes)[:, 1]
    return uv @ (axes if height.mean() <= 0.5 * (height.min() + height.max()) else -axes)


def _turned(uv: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return uv @ np.array([[cos, sin], [-sin, cos]])
