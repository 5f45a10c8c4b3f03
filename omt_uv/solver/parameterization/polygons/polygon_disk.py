"""Cut the polygons of a chart for its map: quads along their shorter diagonal, others into fans about their centres.

Which way an importer, or a modeller, has cut them then plays no part, and a cap of thousands of sides is a fan of good
triangles instead of slivers. Polygons that are not convex stay as they are.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...canonical.embeddings import mean_value_sites
from ...conformal.boundary_first import FlatDisk, boundary_first
from ...errors import PrecisionError
from ...linalg.nested_dissection import mesh_order
from ...maps.polygon_elements import polygon_mesh
from ...maps.untangle import is_one_to_one
from ...mesh.charts import Chart
from ...mesh.geometry import cross2, cross3, face_areas, signed_areas
from ...mesh.polygon_areas import polygon_fans
from ...mesh.topology import boundary_loops, distinct
from ...quads.diagonals import shorter_diagonals
from ...refinement.initial_maps import is_far
from ...transport.convex_domain import Disk, Domain, Rectangle

# Triangles of a polygon that is cut by its ears, at most: that takes the square of them.
MOST_TRIANGLES = 500
# Area over the sum of the squares of the sides, of an ear that is flat.
FLAT = 1e-9


@dataclass(frozen=True)
class PolygonDisk:
    """A chart as it is mapped.

    vertices (n+k,3): those of the chart, then the centres of fans; triangles (t,3), those of patches over holes last;
    polygons (t,): whose triangle each is, negative for patches.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    polygons: np.ndarray


@dataclass(frozen=True)
class DiskMesh:
    """A disk that is to be mapped, and to what.

    Attributes
    ----------
    vertices (n,3), triangles (m,3) : in a unit box, with one boundary loop
    target (m,) : areas of the triangles in the map
    loop (b,) : the boundary
    boundary : "free", "disk", "square" or "rectangle"
    corners (4,) : boundary vertices that go into the corners of a square or rectangle; None in another boundary
    region (m,) : weights in [0, 1] of a region whose share is to be exact, or None
    polygons (m,) : of every triangle, or None where each is its own
    buried : double precision has no embedding of it; maps of coarser meshes shall free its faces first
    """

    vertices: np.ndarray
    triangles: np.ndarray
    target: np.ndarray
    loop: np.ndarray
    boundary: str = "free"
    corners: np.ndarray | None = None
    region: np.ndarray | None = None
    polygons: np.ndarray | None = None
    aspect: float = 1.0
    buried: bool = False

    @property
    def domain(self) -> Domain:
        """Where the transport goes: the rectangle if the map is to fill one, the disk otherwise."""
        root = np.sqrt(self.aspect)
        return Disk() if self.corners is None else Rectangle(float(1 / root), float(root))

    @cached_property
    def embedded(self) -> np.ndarray:
        """A mean value map (n,2) to the unit disk."""
        return mean_value_sites(self.vertices, self.triangles, self.loop, None, Disk(), self.order)

    @cached_property
    def order(self) -> np.ndarray:
        """In which vertices (n,) are eliminated."""
        return mesh_order(self.vertices, self.triangles)

    @cached_property
    def is_far(self) -> bool:
        """Whether the target is far from the areas of the triangles."""
        return is_far(self.target, face_areas(self.vertices, self.triangles))

    @cached_property
    def flat(self) -> FlatDisk | None:
        """The disk flattened with the boundary as it comes; None where double precision has no such map."""
        try:
            return boundary_first(self.vertices, self.triangles, self.loop, self.order)
        except PrecisionError:
            return None

    @cached_property
    def spread(self) -> float:
        """Mean square of the log scale of the flat disk; about as much shear energy is left where areas are exact."""
        mass = np.bincount(self.triangles.ravel(), np.repeat(self.target / 3, 3), len(self.vertices))
        return np.inf if self.flat is None else self.flat.spread(mass)

    @cached_property
    def bent(self) -> np.ndarray | None:
        """The flat disk (n,2), bent until it does not cover itself; None where double precision has no such map."""
        with suppress(PrecisionError):
            if self.flat is not None:
                return self.flat.bent_until(lambda uv: is_one_to_one(uv, self.triangles, self.loop))
        return None


def polygon_disk(vertices: np.ndarray, chart: Chart) -> PolygonDisk:
    """The chart, with its vertices at (n,3), cut for its map."""
    if len(distinct(chart.faces)[0]) == len(chart.faces):
        # Triangles alone are there as they were.
        numbers = np.arange(len(chart.faces)), -1 - np.arange(len(chart.patches))
        return PolygonDisk(vertices, chart.disk, np.concatenate(numbers))
    faces = _numbered(chart.faces)
    cut = polygon_mesh(chart.triangles, faces, most=len(faces))
    quads = shorter_diagonals(vertices, cut.quads, chart.disk)
    own = faces[cut.rows[: len(cut.triangles)]]
    of_quads = faces[cut.rows[len(cut.triangles) :]].reshape(-1, 2)[:, 0]
    centres, fans, of_fans = polygon_fans(vertices, cut.triangles, own)
    kept = ~np.isin(own, of_fans)
    halves = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    polygons = [own[kept], np.repeat(of_quads, 2), of_fans, -1 - np.arange(len(chart.patches))]
    corners = [cut.triangles[kept], halves, fans, chart.patches]
    return PolygonDisk(
        vertices=np.concatenate([vertices, centres]) if len(centres) else vertices,
        triangles=np.concatenate(corners, dtype=chart.triangles.dtype, casting="same_kind"),
        polygons=np.concatenate(polygons, dtype=chart.faces.dtype, casting="same_kind"),
    )


def of_polygon_disk(values: np.ndarray, vertices: np.ndarray, chart: Chart, disk: PolygonDisk, patch: float):
    """Values (m,) per area of a chart's triangles as those (t,) of the disk: one a polygon, `patch` over holes."""
    faces = _numbered(chart.faces)
    area = face_areas(vertices, chart.triangles)
    mean = np.bincount(faces, area * values) / np.bincount(faces, area)
    return np.where(disk.polygons >= 0, mean[disk.polygons], patch)


def with_centres(uv: np.ndarray, triangles: np.ndarray, count: int) -> np.ndarray:
    """A map (n,2) of a chart's vertices with the centres of its fans, `count` vertices in all, in the middle of each.

    triangles (t,3): those of the disk
    """
    n = len(uv)
    corner = triangles[(triangles >= n).any(axis=1)]
    centre = corner.max(axis=1, initial=0) - n
    others = [corner[corner < n].reshape(-1, 2)[:, k] for k in range(2)]
    total = sum(np.column_stack([np.bincount(centre, uv[o, k], count - n) for k in range(2)]) for o in others)
    return np.concatenate([uv, total / np.maximum(2 * np.bincount(centre, minlength=count - n), 1)[:, None]])


def with_fans(chart: Chart, uv: np.ndarray) -> tuple[Chart, np.ndarray, np.ndarray]:
    """The chart with its convex polygons of five sides and more as fans about centres, as they were mapped; a map
    (n+k,2) of it with the centres of uv (n,2) amid their corners; and the triangle (t,) of the chart whose place each
    takes.

    Those whose fan would fold in the map stay as they are. Triangles of fans have no corners of the surface, -1.
    """
    owner, n = _numbered(chart.faces), len(uv)
    centres, fans, of_fans = polygon_fans(chart.vertices, chart.triangles, owner)
    if not len(fans):
        return chart, uv, np.arange(len(chart.triangles))
    placed = with_centres(uv, fans, n + len(centres))
    bad = np.unique(of_fans[signed_areas(placed, fans) <= 0])
    sound = ~np.isin(of_fans, bad)
    used, place = np.unique(fans[sound, 2], return_inverse=True)
    fans, of_fans = np.column_stack([fans[sound, :2], n + place.ravel()]), of_fans[sound]
    kept = np.flatnonzero(~np.isin(owner, of_fans))
    _, first = np.unique(owner, return_index=True)
    rows = np.concatenate([kept, first[of_fans]])
    return (
        replace(
            chart,
            vertices=np.concatenate([chart.vertices, centres[used - n]]),
            vertex_ids=np.append(chart.vertex_ids, np.full(len(used), -1)),
            triangles=np.concatenate([chart.triangles[kept], fans]),
            corners=np.concatenate([chart.corners[kept], np.full(fans.shape, -1)]),
            faces=chart.faces[rows],
        ),
        np.concatenate([uv, placed[used]]),
        rows,
    )


def cut_as_mapped(chart: Chart, uv: np.ndarray) -> Chart:
    """The chart with polygons that are folded in the map uv (n,2) cut otherwise, where they are not folded then.

    Quads along the other diagonal, polygons of more sides by their ears.
    """
    folded = signed_areas(uv, chart.triangles) <= 0
    if not folded.any():
        return chart
    rows = np.flatnonzero(np.isin(chart.faces, chart.faces[folded]))
    cut = polygon_mesh(chart.triangles[rows], chart.faces[rows], most=MOST_TRIANGLES)
    pairs = rows[cut.rows[len(cut.triangles) :]].reshape(-1, 2)
    other = cut.quads[:, [[0, 1, 3], [1, 2, 3]]]
    better = (signed_areas(uv, other.reshape(-1, 3)).reshape(-1, 2) > 0).all(axis=1)
    triangles = chart.triangles.copy()
    triangles[pairs[better]] = other[better]
    several = rows[cut.rows[: len(cut.triangles)]]
    for mine in np.split(several, np.flatnonzero(np.diff(cut.polygon)) + 1):
        if len(mine) > 2:
            triangles[mine] = _by_ears(chart.triangles[mine], uv, chart.vertices)
    return replace(chart, triangles=triangles, corners=_corners_of(chart, triangles, rows))


def _corners_of(chart: Chart, triangles: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Corners (m,3) of new triangles (m,3) of a chart's polygons, of which those of `rows` (r,) alone are new."""
    corners, n = chart.corners.copy(), np.int64(len(chart.vertices))
    face = np.repeat(_numbered(chart.faces[rows]), 3) * n
    key, first = np.unique(face + chart.triangles[rows].ravel(), return_index=True)
    found = first[np.searchsorted(key, face + triangles[rows].ravel())]
    corners[rows] = chart.corners[rows].ravel()[found].reshape(-1, 3)
    return corners


def _by_ears(triangles: np.ndarray, uv: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Triangles (t,3) of a polygon that have an area in the map uv (n,2) and at (n,3); as they are if none are found.

    An ear is a corner whose triangle is inside of the polygon. All polygons have two (Meisters, Polygons have ears,
    American Mathematical Monthly 82, 1975); the roundest one is cut off first.
    """
    vertices, place = np.unique(triangles, return_inverse=True)
    loops = boundary_loops(place.reshape(-1, 3))
    if len(loops) != 1 or len(loops[0]) != len(triangles) + 2:
        return triangles
    left, found = vertices[loops[0]], []
    p = positions[left]
    normal = cross3(p - p[0], np.roll(p, -1, axis=0) - p[0]).sum(axis=0)
    while len(left) > 2:
        ears = np.column_stack([np.roll(left, 1), left, np.roll(left, -1)])
        flat, solid = uv[ears], positions[ears]
        area = cross2(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])
        height = cross3(solid[:, 1] - solid[:, 0], solid[:, 2] - solid[:, 0]) @ normal / np.linalg.norm(normal)
        value = np.minimum(_roundness(flat, area), _roundness(solid, height))
        # What is inside of a triangle of neighbours has a reflex corner among it.
        reflex = left[area <= 0]
        sides = [cross2(flat[:, k - 2] - flat[:, k], uv[reflex][:, None] - flat[:, k]) >= 0 for k in range(3)]
        inside = np.logical_and.reduce(sides) & (reflex[:, None, None] != ears).all(axis=2)
        value[inside.any(axis=0)] = 0
        best = value.argmax()
        if not value[best] > FLAT:
            return triangles
        found.append(ears[best])
        left = np.delete(left, best) if len(left) > 3 else left[:0]
    return np.array(found)


def _roundness(corners: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Areas (k,) of triangles with corners (k,3,d) over the sums of the squares of their sides."""
    squares = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=(1, 2))
    return area / np.maximum(squares, np.finfo(float).tiny)


def _numbered(faces: np.ndarray) -> np.ndarray:
    """Faces (m,) by numbers from 0 in the order in which they come, whatever they are called."""
    _, first, label = np.unique(faces, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[label.ravel()]
