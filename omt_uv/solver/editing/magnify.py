"""Magnify a map that exists, by a density in its own domain: the map itself is the planar surface (Zhao et al. 2013).

The outline stays what it is if it is a circle or has straight sides, and its vertices slide along it; else it is
free, as when a surface is unwrapped. Outside of the region content stays where it was as far as room is left, since the
start is the given map and the energy is least where nothing moves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..analysis.density import area_error_warnings, normalised_density, region_share
from ..analysis.region_density import RegionDensity, exact_density, target_density
from ..errors import FoldedUVError, MeshError
from ..linalg.additive_schwarz import schwarz_solver
from ..maps.energy import Elements, area_error, elements
from ..maps.similarity import fit_similarity
from ..mesh.geometry import face_areas, signed_areas
from ..mesh.topology import boundary_edges, boundary_loops
from ..progress import Progress, Steps, part_of
from ..refinement.continuation import ContinuationResult, MapProblem, minimise_in_stages
from ..refinement.continuation_rules import QUALITIES
from ..refinement.elimination_order import Renumbered, renumbered
from ..refinement.hessian_blocks import Assembly
from .outline import Outline, centroid, free_motion, recognise_outline
from .refine_island import meets_itself

OUTLINES = ("own", "free")
# Greatest step of a magnification, in the logarithm of the share.
LARGEST_STEP = np.log(2)


@dataclass(frozen=True)
class Magnification:
    """A magnified map, and how it came about.

    Attributes
    ----------
    uv : (n,2)
    outline : "circle", "sides" or "free", or the shape that the map was made to fill
    iterations, residual, status, warnings : see `refine.Refinement`
    area_error : share of the area that is in the wrong place, against the density
    """

    uv: np.ndarray
    outline: str
    iterations: int
    residual: float
    status: str
    area_error: float
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class RegionMagnification(Magnification):
    """A map with a magnified region; target: what that was to get."""

    target: RegionDensity


def magnify_map(
    uv: np.ndarray,
    triangles: np.ndarray,
    density: np.ndarray,
    *,
    region: np.ndarray | None = None,
    boundary: str = "own",
    quality: str = "standard",
    stricter: float = 1.0,
) -> Steps[Magnification]:
    """Change the areas of a map uv (n,2), triangles (m,3), by a density (m,), without folds.

    Parameters
    ----------
    region : (m,) in [0, 1], weights of a region whose share is to be exact. What lies outside of it keeps its place,
        as well as it can, where the outline is free
    boundary : "own" keeps a circle and straight sides; "free"
    quality : "draft", "standard" or "exact"; stricter: the area error is to be so many times smaller

    Raises
    ------
    FoldedUVError : faces of the map are folded or have no area
    """
    if boundary not in OUTLINES:
        raise ValueError(f"boundary must be one of {', '.join(OUTLINES)}, not {boundary!r}")
    yield Progress("Magnification", 0.0)
    refuse_folds(uv, triangles)
    area = np.abs(signed_areas(uv, triangles))
    size = np.sqrt(area.sum())
    middle = (area @ uv[triangles].mean(axis=1)) / area.sum()
    flat = (uv - middle) / size
    mesh = renumbered(np.column_stack([flat, np.zeros(len(flat))]), triangles, flat, None)
    settings = QUALITIES[quality]
    settings = replace(settings, area_error=settings.area_error / stricter)
    try:
        found, outline, error = yield from _magnified(mesh, density, region, boundary, settings)
    except MeshError as problem:
        raise mesh.original_error(problem) from problem
    return Magnification(
        uv=mesh.original(found.w) * size + middle,
        outline=outline.kind,
        iterations=found.steps,
        residual=found.residual,
        status=found.status,
        area_error=error,
        warnings=found.warnings,
    )


def magnify_region(
    uv: np.ndarray,
    triangles: np.ndarray,
    weights: np.ndarray,
    factor: float,
    *,
    exact: bool = True,
    boundary: str = "own",
    quality: str = "standard",
) -> Steps[RegionMagnification]:
    """Give a region of weights (m,) in [0, 1] `factor` times its share of a map uv (n,2), in steps of at most 2.

    Each step shears the map before it as little as it can. Steps are a flow: what it has done twice by 2 is what it
    does once by 4.

    exact : False for the factor between weight 1 and weight 0, see `region_density.target_density`

    Raises
    ------
    FoldedUVError : see `magnify_map`
    WeightError, ShareError : see `region_density.target_density`
    """
    refuse_folds(uv, triangles)
    before = np.abs(signed_areas(uv, triangles))
    whole = target_density(weights, before, factor, exact)
    count = max(1, int(np.ceil(abs(np.log(factor)) / LARGEST_STEP - 1e-9)))
    # The areas of a step follow from those before it, so that their errors add up.
    options = {"region": weights, "boundary": boundary, "quality": quality, "stricter": max(1.0, np.sqrt(count / 2))}
    done, texts = 0, list(whole.warnings)
    for k in range(count):
        area = np.abs(signed_areas(uv, triangles))
        # From what the region has to what it is to have: errors of the share do not add up.
        rest = whole.share_before * factor ** ((k + 1) / count) / region_share(weights, area)
        density = exact_density(weights, area, rest).density if exact else whole.density ** (1 / count)
        job = magnify_map(uv, triangles, normalised_density(density, area), **options)
        step = yield from part_of(job, k / count, 1 / count)
        uv, done = step.uv, done + step.iterations
        texts += [text for text in step.warnings if text not in texts]
    has, target = (x / x.sum() for x in (np.abs(signed_areas(uv, triangles)), before * whole.density))
    error = float(np.abs(has - target).sum())
    texts += area_error_warnings(error, count * QUALITIES[quality].area_error)
    return RegionMagnification(
        uv=uv,
        outline=step.outline,
        iterations=done,
        residual=step.residual,
        status=step.status,
        area_error=error,
        warnings=tuple(texts),
        target=whole,
    )


def refuse_folds(uv: np.ndarray, triangles: np.ndarray) -> None:
    """Raise FoldedUVError with the triangles of a map uv (n,2) that are folded, or have no area."""
    if not np.isfinite(uv).all():
        wrong = np.flatnonzero(~np.isfinite(uv[triangles]).all(axis=(1, 2)))
        raise FoldedUVError("The UVs to magnify are not finite", kind="face", elements=wrong)
    signed = signed_areas(uv, triangles)
    folded = np.flatnonzero(~(signed * (1 if signed.sum() >= 0 else -1) > 0))
    if len(folded):
        raise FoldedUVError(
            "The UVs to magnify fold, or have no area", "Unwrap or refine these faces first", "face", folded
        )


def _magnified(
    mesh: Renumbered, density, region, boundary: str, settings
) -> Steps[tuple[ContinuationResult, Outline, float]]:
    given = mesh.uv @ [1, 1j]
    outline = recognise_outline(given, _outer(given, mesh.triangles))
    if boundary == "free":
        outline = Outline(kind="free", motion=free_motion(len(given)), w=given, centre=0j)
    # The surface is the map as it is on its exact outline: nothing is sheared there.
    flat = np.column_stack([outline.w.real, outline.w.imag, np.zeros(len(given))])
    faces = elements(flat, mesh.triangles, face_areas(flat, mesh.triangles) * density, region)
    edges = boundary_edges(mesh.triangles)
    if outline.kind != "free":
        # Holes are free all the same.
        edges = edges[~np.isin(edges[:, 0], _outer(given, mesh.triangles))]
    guard = edges if len(edges) and not meets_itself(outline.w, edges) else None
    assembly = Assembly(mesh.triangles, len(given), schwarz_solver(mesh.vertices, mesh.triangles))
    task = MapProblem(faces, assembly, outline.motion, guard, False, outline.kind != "free")
    found = yield from minimise_in_stages(task, outline.w, 0.0, settings)
    error = area_error(faces, found.w)
    return replace(found, w=_placed_like_outside(found.w, given, outline, faces, region)), outline, error


def _outer(w: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The boundary loop (b,) around everything."""
    loops = boundary_loops(triangles)
    return max(loops, key=lambda loop: centroid(w[loop])[1])


def placed_like_outside(
    uv: np.ndarray, given: np.ndarray, triangles: np.ndarray, calm: np.ndarray, quarters: bool
) -> np.ndarray:
    """A map uv (n,2) turned, moved and scaled to lie as the given one does, with its area; both are unmirrored.

    calm (m,) : how much each triangle counts for that; quarters : only quarter turns
    """
    w, aim = uv @ [1, 1j], given @ [1, 1j]
    area = signed_areas(given, triangles)
    w = w * np.sqrt(area.sum() / signed_areas(uv, triangles).sum())
    centre, goal = (
        (a @ x[triangles].mean(axis=1)) / a.sum() for x, a in ((w, signed_areas(uv, triangles)), (aim, area))
    )
    mass = np.bincount(triangles.ravel(), np.repeat(area * calm, 3), len(w))
    similarity = fit_similarity(w, aim, mass, rigid=True, about=(centre, goal))
    placed = (similarity.in_quarter_turns() if quarters else similarity)(w)
    return np.column_stack([placed.real, placed.imag])


def _placed_like_outside(w: np.ndarray, given: np.ndarray, outline: Outline, faces: Elements, region) -> np.ndarray:
    """The map turned, and with a free outline moved and scaled, so that what is not magnified lies as it did."""
    if outline.kind == "sides":
        return w
    calm = faces.area if region is None else faces.area * (1 - region)
    mass = np.bincount(faces.triangles.ravel(), np.repeat(calm / calm.sum(), 3) / 3, len(w))
    if outline.kind == "free":
        w = w * np.sqrt(abs(faces.areas(given).sum()) / faces.areas(w).sum())
    about = (0j, outline.centre) if outline.kind == "circle" else None
    return fit_similarity(w, given, mass, rigid=True, about=about)(w)
