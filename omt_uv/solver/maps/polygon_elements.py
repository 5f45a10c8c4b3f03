"""Make elements of polygons: one area each, whichever way it is cut, and shear without a diagonal.

In space a quad has the mean area of both its triangulations, a flat dart its own, and its shear is the mean over both,
each triangle by its area; other polygons have the area that `mesh.polygon_areas` gives them. Both triangulations of a
quad need all four triangles positive in the map, so that only quads that are convex, on the surface and in the map,
have it; others are measured on the triangulation given until they have become convex (`with_convex_quads`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..mesh.geometry import cross3, face_areas, hat_areas, kept_hats, kept_sizes, part_by_part
from ..mesh.polygon_areas import BOTH, polygon_areas, quad_areas, quad_corners, triangle_pairs
from ..mesh.topology import distinct
from .energy import AT_ONCE, Elements, Quads, elements, energies

# Triangles of a polygon with one area, at most: a row of the Hessian joins all its corners, and long rows fill it.
MOST_TRIANGLES = 8
# Share of a quad's area that each of its four triangles needs on the surface for both triangulations to count.
CONVEX = 0.03
# Share of what it has there that each needs in the map for that. Below it corners are reflex, and opened
# (`polygons.polygon_corners`): quads between two bounds would be neither, and sheared without a word.
OPEN = 0.02


@dataclass(frozen=True)
class PolygonMesh:
    """Triangles that are polygons of their own, or make one with others, and quads apart.

    triangles (k,3) and polygon (k,) of each, from 0 on; quads (q,4), their given diagonal from the first to the third
    corner; their polygons follow the others'. rows (m,): where triangles of the mesh are: those of `triangles`, then
    two of each quad.
    """

    triangles: np.ndarray
    polygon: np.ndarray
    quads: np.ndarray
    rows: np.ndarray

    @property
    def count(self) -> int:
        """Polygons."""
        return int(self.polygon.max(initial=-1)) + 1 + len(self.quads)

    def every_triangle(self) -> np.ndarray:
        """All triangles (m,3), int32, whose shear may be measured: four of each quad come last."""
        given, four = (x.astype(np.int32, copy=False) for x in (self.triangles, self.quads))
        return np.concatenate([given, four[:, BOTH].reshape(-1, 3)])

    def of_polygons(self) -> np.ndarray:
        """The polygon (m,), int32, of each of `every_triangle`."""
        of_quads = np.arange(self.count - len(self.quads), self.count, dtype=np.int32)
        return np.concatenate([self.polygon.astype(np.int32), np.repeat(of_quads, 4)])

    def given(self, values: np.ndarray) -> np.ndarray:
        """Values (m,) of the triangles of the mesh summed over the polygons, (p,)."""
        first = self.count - len(self.quads)
        owner = np.concatenate([self.polygon, np.repeat(first + np.arange(len(self.quads)), 2)])
        return np.bincount(owner, values[self.rows], self.count)


def polygon_mesh(triangles: np.ndarray, faces: np.ndarray, most: int = MOST_TRIANGLES) -> PolygonMesh:
    """The polygons of triangles (m,3) that belong to the faces (m,), any numbers.

    Two triangles of a face that share a side are a quad. A face of more than `most` triangles counts triangle
    by triangle.
    """
    owner = np.unique(faces, return_inverse=True)[1].ravel()
    sides = np.bincount(owner)
    order = np.argsort(owner, kind="stable")
    first, second = triangle_pairs(owner)
    corners, joined = quad_corners(triangles, first, second)
    is_quad = np.zeros(len(sides), bool)
    is_quad[owner[first[joined]]] = True
    rest = order[~is_quad[owner[order]]]
    # Long polygons and two triangles that share no side: each triangle for itself.
    long = (sides > most) | ((sides == 2) & ~is_quad)
    label = np.where(long[owner[rest]], len(sides) + rest, owner[rest])
    polygon = np.unique(label, return_inverse=True)[1].ravel()
    both = np.column_stack([first, second])[joined].ravel()
    return PolygonMesh(triangles[rest], polygon, triangles.ravel()[corners[joined]], np.concatenate([rest, both]))


def polygon_elements(
    positions: np.ndarray,
    triangles: np.ndarray,
    target: np.ndarray,
    faces: np.ndarray | None = None,
    region: np.ndarray | None = None,
) -> Elements:
    """Elements of a surface (n,3), (m,3) whose polygons, the faces (m,) of the triangles, shall have their targets.

    Parameters
    ----------
    target : (m,) UV area asked for by each triangle; a polygon asks for their sum
    faces : (m,) polygon of every triangle, None where each is its own
    region : (m,) in [0, 1]
    """
    if faces is None or len(distinct(faces)[0]) == len(faces):
        return elements(positions, triangles, target, region)
    mesh = polygon_mesh(triangles, faces)
    every, polygon = mesh.every_triangle(), mesh.of_polygons()
    area, hats = kept_hats(positions, every)
    q = len(mesh.quads)
    share = np.ones(len(every))
    share[len(every) - 4 * q :] = 0.5
    whole = np.bincount(polygon, share * area, mesh.count)
    whole[: len(whole) - q] *= _bent(positions, triangles, faces, mesh)[: len(whole) - q]
    whole[len(whole) - q :] *= _dented(positions, mesh.quads)
    given = mesh.given(hat_areas(positions, triangles))
    # Per area of the triangulation given, so that a density of 1 asks for a polygon's own area.
    asked = mesh.given(target) * whole / given
    weight = np.maximum(whole / whole.sum(), asked / asked.sum())
    inside = None if region is None else mesh.given(region * hat_areas(positions, triangles)) / given
    lone = area[: len(every) - 4 * q] / whole[polygon[: len(every) - 4 * q]]
    size = kept_sizes(hats, area[len(every) - 4 * q :].reshape(q, 4), whole[len(whole) - q :])
    return Elements(
        triangles=every,
        area=whole / whole.sum(),
        hats=hats,
        ratio=asked / whole,
        weight=weight / weight.sum(),
        region=inside,
        polygon=polygon,
        lone=lone,
        quads=Quads(size, _convex(positions, mesh.quads)),
    )


def _bent(positions, triangles, faces, mesh: PolygonMesh) -> np.ndarray:
    """Areas (p,) of polygons over those of their triangles on the surface: not 1 where the corners are in no plane."""
    sums = mesh.given(face_areas(positions, triangles))
    own = mesh.given(polygon_areas(positions, triangles, faces))
    return np.divide(own, sums, out=np.ones(len(sums)), where=sums > 0)


def _dented(positions, quads: np.ndarray) -> np.ndarray:
    """Areas (q,) of quads (q,4) over the means of both triangulations: not 1 of flat darts."""

    def means(some):
        return face_areas(positions, some[:, BOTH].reshape(-1, 3)).reshape(-1, 4).sum(axis=1) / 2

    mean = part_by_part(means, quads)
    return np.divide(quad_areas(positions, quads), mean, out=np.ones(len(quads)), where=mean > 0)


def with_convex_quads(faces: Elements, w: np.ndarray) -> Elements:
    """The elements with both triangulations of the quads that are convex on the surface and in the map w (n,) complex.

    The areas of polygons and their targets do not change by that.
    """
    if faces.quads is None:
        return faces

    def areas(some):
        a, b, c = w[some].T
        return ((b - a).conj() * (c - a)).imag

    four = faces.triangles[len(faces.triangles) - 4 * len(faces.quads.convex) :]
    return with_convex_quads_of(faces, part_by_part(areas, four).reshape(-1, 4))


def with_convex_quads_of(faces: Elements, area: np.ndarray) -> Elements:
    """As `with_convex_quads`, from the areas (q,4) of the four triangles of every quad in the map, in any unit."""
    if faces.quads is None or not len(faces.quads.convex):
        return faces
    whole = area[:, :2].sum(axis=1)
    both = faces.quads.convex & (area > OPEN * faces.quads.size[:] * whole[:, None]).all(axis=1)
    if faces.quads.crossed is not None:
        both |= faces.quads.crossed
    last = np.zeros(len(both), bool) if faces.quads.both is None else faces.quads.both
    return faces if np.array_equal(both, last) else replace(faces, quads=replace(faces.quads, both=both))


def restricted(faces: Elements, kept: np.ndarray, place: np.ndarray) -> Elements:
    """The elements of the polygons `kept` (p,) bool alone, vertex k as vertex place[k]."""
    region = None if faces.region is None else faces.region[kept]
    here = faces.of_triangles(kept)
    quads, lone = faces.quads, faces.lone
    if quads is not None:
        quads = quads.of(kept[len(kept) - len(quads.convex) :])
    return Elements(
        triangles=place[faces.triangles[here]],
        area=faces.area[kept],
        hats=faces.gradient_at(here),
        ratio=faces.ratio[kept],
        weight=faces.weight[kept],
        region=region,
        polygon=None if faces.polygon is None else (np.cumsum(kept) - 1)[faces.polygon[here]],
        lone=None if lone is None else lone[here[: len(lone)]],
        quads=quads,
    )


def in_turn(faces: Elements, count: int) -> Iterator[tuple[Elements, slice, np.ndarray | slice, slice]]:
    """The elements of `count` polygons after the others, and where they come from: these polygons, and the rows of
    their lone triangles and quads among all lone triangles and all quads."""
    four = 0 if faces.quads is None else len(faces.quads.convex)
    first, single, none = len(faces.triangles) - 4 * four, len(faces.area) - four, slice(0, 0)
    for begin in range(0, single, count):
        here = slice(begin, min(begin + count, single))
        if faces.polygon is None:
            yield _slice_of(faces, here, here), here, here, none
            continue
        some = np.zeros(len(faces.area), bool)
        some[here] = True
        rows = np.flatnonzero(some[faces.polygon[:first]])
        yield restricted(faces, some, np.arange(int(faces.triangles.max()) + 1)), here, rows, none
    for begin in range(0, four, count):
        end = min(begin + count, four)
        here = slice(single + begin, single + end)
        yield _slice_of(faces, here, slice(first + 4 * begin, first + 4 * end)), here, none, slice(begin, end)


def energy_in_turn(faces: Elements, w: np.ndarray, area_weight: float | np.ndarray) -> float:
    """`energy.energy`, to the bit, of some polygons after the others: all at once take more memory than the mesh.

    area_weight : one, or (p,) of the polygons
    """
    if len(faces.triangles) <= 4 * AT_ONCE:
        return float(energies(faces, w, area_weight).sum())
    value = np.empty(len(faces.area))
    for some, here, _, _ in in_turn(faces, AT_ONCE):
        value[here] = energies(some, w, area_weight[here] if isinstance(area_weight, np.ndarray) else area_weight)
    return float(value.sum())


def _slice_of(faces: Elements, here: slice, rows: slice) -> Elements:
    """The elements of some triangles that are polygons of their own, or of some quads, that follow each other."""
    lone, quads = here == rows, faces.quads
    if not lone and quads is not None:
        quads = quads.of(slice(here.start - len(faces.area), (here.stop - len(faces.area)) or None))
    return Elements(
        triangles=faces.triangles[rows],
        area=faces.area[here],
        hats=faces.gradient_at(rows),
        ratio=faces.ratio[here],
        weight=faces.weight[here],
        polygon=None if lone else np.repeat(np.arange(here.stop - here.start), 4),
        lone=None if lone or faces.lone is None else faces.lone[:0],
        quads=None if lone else quads,
    )


def _convex(positions: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Quads (q,4) whose four triangles look to the quad's own side, and have an area, (q,) bool."""

    def convex(some):
        p = positions[some[:, BOTH]]
        normal = cross3(p[:, :, 1] - p[:, :, 0], p[:, :, 2] - p[:, :, 0])
        own = normal[:, :2].sum(axis=1)
        return (np.einsum("qtd,qd->qt", normal, own) > CONVEX * (own**2).sum(axis=1)[:, None]).all(axis=1)

    return part_by_part(convex, quads)
