"""Refine many small islands side by side: what Newton's method does with one of them takes no longer with hundreds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import MeshError, positive_density
from ..maps.similarity import fit_similarity
from ..maps.untangle import count_folds
from ..mesh.geometry import bounding_box, face_areas, signed_areas
from ..mesh.topology import boundary_loops, euler_characteristic
from ..progress import Steps
from ..refinement.batch_refine import BatchMaps, refine_batch
from ..refinement.refine import Refinement


@dataclass(frozen=True)
class GivenIsland:
    """An island without pins: vertices (n,3), triangles (m,3), uv (n,2), the polygon (m,) of every triangle, and the
    density (m,) of the area that each asks for, None where that is its own."""

    vertices: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray
    polygons: np.ndarray
    density: np.ndarray | None = None


def refine_together(
    islands: Sequence[GivenIsland], *, balance: float = 0.0, quality: str = "standard"
) -> Steps[list[Refinement | None]]:
    """Refine small islands as `refine_island` does, all at once; None for each that has to go alone: one with folds, or
    that is no disk, or whose boundary needs to be kept from crossing itself.

    Every map is looked for anew, and lies as the given one does: in its place, as large, turned and mirrored alike.

    References
    ----------
    See `refine.refine`.
    """
    found: list[Refinement | None] = [None] * len(islands)
    chosen = [k for k, island in enumerate(islands) if _is_sound_disk(island)]
    if not chosen:
        return found
    some = [islands[k] for k in chosen]
    try:
        density = None
        if any(island.density is not None for island in some):
            density = positive_density(np.concatenate([_density(island) for island in some]))
        meshes = [(_in_unit_box(island.vertices), island.triangles) for island in some]
        polygons = [island.polygons for island in some]
        maps = yield from refine_batch(meshes, quality, balance, density, polygons=polygons)
    except MeshError:
        return found  # the one with the error has it alone, too, and says so
    begin = np.cumsum([0, *(len(island.vertices) for island in some)])
    w = maps.uv @ [1, 1j]
    for k, island in enumerate(some):
        if maps.solved[k]:
            found[chosen[k]] = _refinement(maps, k, _lying_like(w[begin[k] : begin[k + 1]], island))
    return found


def _is_sound_disk(island: GivenIsland) -> bool:
    """Whether an island is a disk whose map has no folds."""
    area = float(signed_areas(island.uv, island.triangles).sum())
    if not np.isfinite(area) or area == 0 or count_folds(island.uv * [np.sign(area), 1], island.triangles):
        return False
    loops = boundary_loops(island.triangles)
    sides = sum(map(len, loops))
    return len(loops) == 1 and euler_characteristic(len(island.vertices), len(island.triangles), sides) == 1


def _density(island: GivenIsland) -> np.ndarray:
    return np.ones(len(island.triangles)) if island.density is None else island.density


def _in_unit_box(vertices: np.ndarray) -> np.ndarray:
    middle, extent = bounding_box(vertices)
    return (vertices - middle) / extent


def _lying_like(w: np.ndarray, island: GivenIsland) -> np.ndarray:
    """The map w (n,) as UVs (n,2) that lie as those of the island do."""
    covered = signed_areas(island.uv, island.triangles).sum()
    mirror = np.array([np.sign(covered), 1.0])
    area, corners = face_areas(island.vertices, island.triangles), island.triangles.ravel()
    mass = np.bincount(corners, np.repeat(area, 3), len(w))
    now = signed_areas(np.column_stack([w.real, w.imag]), island.triangles).sum()
    w = w * np.sqrt(abs(covered) / now)
    w = fit_similarity(w, (island.uv * mirror) @ [1, 1j], mass / mass.sum(), rigid=True)(w)
    return np.column_stack([w.real, w.imag]) * mirror


def _refinement(maps: BatchMaps, k: int, uv: np.ndarray) -> Refinement:
    return Refinement(
        uv=uv,
        iterations=int(maps.steps[k]),
        residual=float(maps.residual[k]),
        area_error=float(maps.area_l1[k]),
        area_weight=float(maps.area_weight[k]),
        energy=float(maps.energy[k]),
        status="converged",
        overlap=False,
        warnings=(),
        multiplier=0.0,
    )
