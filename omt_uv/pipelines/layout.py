"""Lay out islands of several surfaces: jobs, packing, and the way back to the corners of each surface.

What unwrapping, refinement, magnification, globes and live maps share. Warnings of a layout are pairs of surface
index and text; index -1 stands for the layout as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ..errors import UserError
from ..settings import Settings
from ..solver.analysis.density import Target
from ..solver.analysis.facing import Z_UP, SceneAxes
from ..solver.canonical.markers import MapMarkers
from ..solver.errors import MeshError
from ..solver.maps.overlap import overlap_share
from ..solver.mesh.charts import Chart
from ..solver.mesh.surface import Surface
from ..solver.packing.pack_square import Packing, pack, stack
from ..solver.packing.single_precision import without_rounded_folds
from ..solver.parameterization.chart_indices import CornerPins
from ..solver.parameterization.unwrap import SurfaceMap
from ..solver.progress import Steps, part_of
from ..solver.subdivision.modifier import SubdivisionModifier
from .reading import Reading

T = TypeVar("T")

# More new overlap than this, as a share of the UV area, is said: less is rounding.
OVERLAP = 1e-4
# Share of the time of a run after which its islands are packed.
PACKING_FROM = 0.8
# Where up is, unless a surface says otherwise.


class Refusal(UserError):
    """A surface that has no valid map: its index and the error."""

    def __init__(self, index: int, error: MeshError):
        super().__init__(str(error))
        self.index, self.error = index, error


def in_turn(runs: Sequence[Steps[T]]) -> Steps[list[T]]:
    """The results of solvers, one for each surface, that run one after the other.

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why it has none
    """
    found = []
    for index, steps in enumerate(runs):
        try:
            found.append((yield from part_of(steps, index / len(runs), 1 / len(runs))))
        except MeshError as error:
            raise Refusal(index, error) from error
    return found


@dataclass(frozen=True)
class UnwrapJob:
    """A surface to unwrap.

    faces : its polygons (f,) bool to unwrap, all by default; pins : corners that stay; avoid : vertices (n,) in [0,1]
        to keep free of cuts; target : density and region of its triangles, their own areas by default. Targets of
        several surfaces are relative to each other; subdivision : the modifier on whose surface areas shall be right
    axes : how the surface stands in the scene; uv : UVs (c,2) that its corners have, if any
    markers : vertices that fix the turn and the corners of its maps; was_split : see `Reading`
    """

    surface: Surface
    faces: np.ndarray | None = None
    pins: CornerPins | None = None
    avoid: np.ndarray | None = None
    target: Target | None = None
    subdivision: SubdivisionModifier | None = None
    axes: SceneAxes = Z_UP
    uv: np.ndarray | None = None
    markers: MapMarkers | None = None
    was_split: bool = False

    @property
    def chosen(self) -> np.ndarray:
        """Which polygons (f,) bool of the surface are unwrapped."""
        return np.ones(len(self.surface.face_start) - 1, dtype=bool) if self.faces is None else self.faces

    @staticmethod
    def of(
        reading: Reading,
        subdivision: SubdivisionModifier | None,
        avoid: np.ndarray | None = None,
        markers: MapMarkers | None = None,
    ) -> UnwrapJob:
        """The job to unwrap what was read, for the areas of the surface of a modifier, or for its own."""
        r = reading
        return UnwrapJob(
            surface=r.surface,
            faces=r.faces,
            pins=r.pins,
            avoid=avoid,
            subdivision=subdivision,
            axes=r.axes,
            uv=r.uv,
            markers=markers,
            was_split=r.was_split,
        )


@dataclass(frozen=True)
class Layout:
    """Corners (k,) and their UVs (k,2) of each surface, the maps with their reports, the packing and warnings."""

    corners: list[np.ndarray]
    uv: list[np.ndarray]
    maps: list[SurfaceMap]
    packing: Packing
    warnings: list[tuple[int, str]]


@dataclass(frozen=True)
class PlacedIsland:
    """An island of surface `owner`: its chart, and the UVs (n,2) of its vertices now and, if it had any, before."""

    owner: int
    chart: Chart
    uv: np.ndarray
    before: np.ndarray | None = None


def pack_islands(
    islands: Sequence[np.ndarray],
    triangles: Sequence[np.ndarray],
    settings: Settings,
    around: Sequence[tuple[np.ndarray, np.ndarray]] = (),
    turnable: np.ndarray | None = None,
) -> Steps[Packing]:
    """Pack islands (n_i,2) with triangles (m_i,3) into the UDIM tile of the settings, all by one scale.

    around : points and triangles of islands that stay where they are, in UV space; turnable (k,) bool : islands
        that may be turned by any angle where the settings allow that, all by default

    Raises
    ------
    MarginError : the margins leave no room
    """
    if not islands:
        return Packing([], 0.0, "none", 0.0)
    origin = np.array(settings.tile_origin, dtype=float)
    if settings.pack:
        staying = [(points - origin, index) for points, index in around]
        given = (islands, triangles, settings.margin, settings.texture_size, staying)
        if settings.turn_to_fit:
            from ..solver.packing.turning import pack_turned

            packed = yield from pack_turned(*given, turnable)
        else:
            packed = yield from pack(*given)
    else:
        packed = stack(islands)
    return replace(packed, islands=[uv + origin for uv in packed.islands])


def corner_uvs(surface_count: int, islands: Sequence[PlacedIsland]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Corners (k,) of every surface that lie on its islands, each once and in order, and their UVs (k,2)."""
    of_surface: list[list[PlacedIsland]] = [[] for _ in range(surface_count)]
    for island in islands:
        of_surface[island.owner].append(island)
    corners, uv = [], []
    for mine in of_surface:
        every = np.concatenate([np.zeros(0, np.int64), *(i.chart.corners.ravel() for i in mine)])
        values = np.concatenate([np.zeros((0, 2)), *(i.uv[i.chart.triangles.ravel()] for i in mine)])
        unique, first = np.unique(every, return_index=True)
        corners.append(unique)
        uv.append(values[first])
    return corners, uv


def in_single_precision(islands: Sequence[PlacedIsland]) -> list[PlacedIsland]:
    """The islands with UVs that fold no triangle when they are rounded to single precision, as Blender keeps them."""
    if not islands:
        return []
    first = np.cumsum([0, *(len(i.uv) for i in islands)])
    triangles = [i.chart.triangles + k for i, k in zip(islands, first, strict=False)]
    uv = without_rounded_folds(np.concatenate([i.uv for i in islands]), np.concatenate(triangles))
    return [replace(i, uv=uv[a:b]) for i, a, b in zip(islands, first, first[1:], strict=False)]


def grown_together(islands: Sequence[PlacedIsland]) -> str:
    """A warning if islands that lay apart cover each other now, or an empty text."""
    if len(islands) < 2:
        return ""
    before = overlap_share(np.concatenate([i.before[i.chart.triangles] for i in islands if i.before is not None]))
    after = overlap_share(np.concatenate([i.uv[i.chart.triangles] for i in islands]))
    more = after - before
    return "" if more < OVERLAP else f"Islands grew into each other, by {100 * more:.1f} % of the UV area; pack them"
