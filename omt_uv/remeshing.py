"""One surface to new meshes that lie on it, a single one or a series; the one path of operator and command line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .settings import RemeshSettings
from .solver.charts import Surface, chosen_triangles
from .solver.errors import CountError, MeshError
from .solver.features import all_edges
from .solver.geometry import face_areas
from .solver.progress import Progress, Steps, part_of
from .solver.remesh import Remesh, remesh
from .solver.transfer import Footprint, footprint


@dataclass(frozen=True)
class Job:
    """A surface and what the new mesh shall follow.

    features (e,2): vertex pairs of edges to keep; jumps (s,2): edges across which values jump, kept or not;
    """

    surface: Surface
    features: np.ndarray
    jumps: np.ndarray


@dataclass(frozen=True)
class Level:
    """A new mesh: positions (k,3), triangles (t,3), and where it lies on the old one."""

    positions: np.ndarray
    triangles: np.ndarray
    footprint: Footprint
    found: Remesh


@dataclass(frozen=True)
class Series:
    """New meshes, the finest first, and warnings."""

    levels: list[Level]
    warnings: list[str]


def remesh_series(job: Job, settings: RemeshSettings) -> Steps[Series]:
    """Remesh a surface as often as the settings say, each time from the surface itself.

    Raises
    ------
    MeshError : CountError and those of `solver.remesh.remesh`; elements are vertices, edges and polygons of the
        surface
    """
    surface = job.surface
    chosen_triangles(surface, None)
    triangles = surface.corner_vertex[surface.triangles]
    count_of, counts = _counts(surface, triangles, settings)
    levels: list[Level] = []
    warnings: list[str] = []
    for k, count in enumerate(counts):
        steps = _level(job, triangles, count_of, count, settings)
        level = yield from part_of(_located(steps, surface), k / len(counts), 1 / len(counts))
        levels.append(level)
        name = f"LOD{k}: " if len(counts) > 1 else ""
        warnings += [name + text for text in level.found.warnings]
        if level.footprint.extended:
            warnings.append(f"{name}{level.footprint.extended} faces reach across a seam; UVs are continued there")
    return Series(levels, warnings)


def _counts(surface: Surface, triangles: np.ndarray, settings: RemeshSettings) -> tuple[str, list[int]]:
    """What is counted, and the count of every level."""
    first, count_of = settings.count, settings.count_of
    if not (np.isfinite(first) and first > 0):
        raise CountError(f"A remesh with {count_of} {first:g} is none", "Give a number above 0")
    if not 0 < settings.ratio < 1 and settings.levels > 1:
        raise CountError(f"Levels cannot each have {settings.ratio:g} times the count", "Give a ratio between 0 and 1")
    if count_of == "edge":
        # A triangle with three edges of length L has the area sqrt(3) L^2 / 4; faces are even in number where closed.
        area = face_areas(surface.positions, triangles).sum()
        first, count_of = 2 * max(round(area / (np.sqrt(3) / 2 * first**2)), 1), "faces"
    counts = [round(first * settings.ratio**k) for k in range(max(settings.levels, 1))]
    if count_of == "faces":
        counts = [counts[0], *(c + c % 2 for c in counts[1:])]
    return count_of, counts


def _level(job: Job, triangles: np.ndarray, count_of: str, count: int, settings: RemeshSettings) -> Steps[Level]:
    positions = job.surface.positions
    steps = remesh(
        positions,
        triangles,
        count,
        count_of=count_of,
        features=job.features if len(job.features) else None,
        preserve_boundary=settings.preserve_boundary,
        strategy=settings.strategy,
        seed=settings.seed,
    )
    found = yield from part_of(steps, 0.0, 0.95)
    yield Progress("Attributes", 0.95)
    seams = all_edges(job.features, job.jumps)
    at = footprint(positions, triangles, seams, found.vertices, found.triangles, found.faces, found.barycentric)
    return Level(found.vertices, found.triangles, at, found)


def _located(steps: Steps[Level], surface: Surface) -> Steps[Level]:
    """The level; errors name polygons of the surface instead of its triangles."""
    try:
        return (yield from steps)
    except MeshError as error:
        if error.kind != "face":
            raise
        polygons = np.unique(surface.triangle_face[error.elements])
        raise type(error)(error.cause, error.remedy, "face", polygons) from error
