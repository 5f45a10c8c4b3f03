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
from ..linalg.symmetric_sweeps import sweeping_solver
from ..maps.energy import Elements, area_error
from ..maps.mirror_symmetry import MirrorSymmetry
from ..maps.polygon_elements import BOTH, polygon_elements, polygon_mesh
from ..maps.similarity import fit_similarity
from ..mesh.geometry import face_areas, signed_areas
from ..mesh.topology import boundary_edges, boundary_loops
from ..progress import Progress, Steps, part_of
from ..refinement.continuation import ContinuationResult, MapProblem, minimise_in_stages
from ..refinement.continuation_rules import QUALITIES, Quality
from ..refinement.elimination_order import Renumbered, renumbered
from ..refinement.hessian_blocks import assembly_of
from ..refinement.mirrored_motion import MirroredMotion, find_symmetry, halved, symmetric_start
from .outline import Outline, centroid, free_motion, recognise_outline
from .refine_island import meets_itself

OUTLINES = ("own", "free")
# Greatest step of a magnification, in the logarithm of the share.
LARGEST_STEP = np.log(2)
# How far, over the extent, sides may move to become mirror images of each other: less than anyone sees.
KEPT = 1e-5


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
    polygons: np.ndarray | None = None,
) -> Steps[Magnification]:
    """Change the areas of a map uv (n,2), triangles (m,3), by a density (m,), without folds.

    Parameters
    ----------
    region : (m,) in [0, 1], weights of a region whose share is to be exact. What lies outside of it keeps its place,
        as well as it can, where the outline is free
    polygons : (m,) polygon of every triangle, whose area counts as a whole; by default each is its own. Triangles of
        one polygon have one density and one weight. Where polygons and densities are their own mirror image the
        result is, too
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
    if polygons is not None:
        polygons = with_concave_quads_apart(uv, triangles, polygons)
    mesh = renumbered(np.column_stack([flat, np.zeros(len(flat))]), triangles, flat, None, polygons)
    settings = QUALITIES[quality]
    settings = replace(settings, area_error=settings.area_error / stricter)
    try:
        goal = _Goal(density, region, polygons)
        found, outline, error = yield from _magnified(mesh, goal, boundary, settings)
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
    polygons: np.ndarray | None = None,
) -> Steps[RegionMagnification]:
    """Give a region of weights (m,) in [0, 1] `factor` times its share of a map uv (n,2), in steps of at most 2.

    Each step shears the map before it as little as it can. Steps are a flow: what it has done twice by 2 is what it
    does once by 4.

    exact : False for the factor between weight 1 and weight 0, see `region_density.target_density`
    polygons : see `magnify_map`

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
    stricter = max(1.0, np.sqrt(count / 2))
    options = {"boundary": boundary, "quality": quality, "stricter": stricter, "polygons": polygons}
    done, texts = 0, list(whole.warnings)
    for k in range(count):
        area = np.abs(signed_areas(uv, triangles))
        # From what the region has to what it is to have: errors of the share do not add up.
        rest = whole.share_before * factor ** ((k + 1) / count) / region_share(weights, area)
        density = exact_density(weights, area, rest).density if exact else whole.density ** (1 / count)
        job = magnify_map(uv, triangles, normalised_density(density, area), region=weights, **options)
        step = yield from part_of(job, k / count, 1 / count)
        uv, done = step.uv, done + step.iterations
        texts += [text for text in step.warnings if text not in texts]
    error = share_error(uv, triangles, before * whole.density, polygons)
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


def share_error(uv: np.ndarray, triangles: np.ndarray, asked: np.ndarray, polygons: np.ndarray | None) -> float:
    """Sum of the differences of polygons' shares of the area from what is asked for (m,), in any unit."""
    has, target = (x / x.sum() for x in (np.abs(signed_areas(uv, triangles)), asked))
    return float(np.abs(by_polygon(has - target, polygons)).sum())


def by_polygon(values: np.ndarray, polygons: np.ndarray | None) -> np.ndarray:
    """Values of triangles (m,) summed over their polygons, (p,)."""
    return values if polygons is None else np.bincount(np.unique(polygons, return_inverse=True)[1].ravel(), values)


def with_concave_quads_apart(uv: np.ndarray, triangles: np.ndarray, polygons: np.ndarray) -> np.ndarray:
    """Polygons (m,) of triangles; those of quads that are concave in a map uv (n,2) without folds become their own.

    Such a quad has one triangulation only, and its area would not be the mean of two.
    """
    mesh = polygon_mesh(triangles, polygons)
    four = signed_areas(uv, mesh.quads[:, BOTH].reshape(-1, 3)).reshape(-1, 4)
    concave = (np.sign(four) != np.sign(four[:, :1])).any(axis=1)
    rows = mesh.rows[len(mesh.triangles) :].reshape(-1, 2)[concave].ravel()
    apart = np.unique(polygons, return_inverse=True)[1].ravel()
    apart[rows] = len(triangles) + rows
    return apart


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


@dataclass(frozen=True)
class _Goal:
    """Density (m,), weights of a region (m,) and polygons (m,) of the triangles of a map."""

    density: np.ndarray
    region: np.ndarray | None
    polygons: np.ndarray | None


def _magnified(
    mesh: Renumbered, goal: _Goal, boundary: str, settings: Quality
) -> Steps[tuple[ContinuationResult, Outline, float]]:
    """What was found, the outline it has, and its area error."""
    given = mesh.uv @ [1, 1j]
    loop = _outer(given, mesh.triangles)
    outline = recognise_outline(given, loop)
    if boundary == "free":
        outline = Outline(kind="free", motion=free_motion(len(given)), w=given, centre=0j)
    # The surface is the map as it is on its exact outline: nothing is sheared there.
    flat = np.column_stack([outline.w.real, outline.w.imag, np.zeros(len(given))])
    target = face_areas(flat, mesh.triangles) * goal.density
    faces = polygon_elements(flat, mesh.triangles, target, goal.polygons, goal.region)
    symmetric = _symmetric(flat, mesh.triangles, goal, faces, outline, loop)
    symmetry, start, shift = (None, outline.w, 0j) if symmetric is None else symmetric
    edges = boundary_edges(mesh.triangles)
    if outline.kind != "free":
        # Holes are free all the same.
        edges = edges[~np.isin(edges[:, 0], loop)]
    half = halved(faces, symmetry)
    task = MapProblem(
        faces=half,
        assembly=assembly_of(half, len(given), sweeping_solver(mesh.vertices, mesh.triangles), symmetry),
        motion=outline.motion if symmetry is None else MirroredMotion(outline.motion, symmetry, start),
        loop=edges if len(edges) and not meets_itself(start, edges) else None,
        with_barrier=False,
        scale_free=outline.kind != "free",
        symmetry=symmetry,
        count=len(faces.area),
    )
    found = yield from minimise_in_stages(task, start, 0.0, settings)
    error = area_error(faces, found.w)
    placed = _placed_like_outside(found.w + shift, given, outline, faces)
    return replace(found, w=placed), outline, error


def _symmetric(
    flat: np.ndarray, triangles: np.ndarray, goal: _Goal, faces: Elements, outline: Outline, loop: np.ndarray
) -> tuple[MirrorSymmetry, np.ndarray, complex] | None:
    """The symmetry of a plane (n,3), the symmetric map next to it, about the axis, and what has to be added to it.

    None where there is none, or where it would move the outline, with the vertices loop (b,), that is to be kept.
    """
    symmetry = find_symmetry(flat, triangles, goal.polygons, faces)
    boundary = "disk" if outline.kind == "circle" else "free"
    found = None if symmetry is None else symmetric_start(symmetry, outline.w, faces, boundary, loop)
    if found is None:
        return None
    shift = 0j if boundary == "disk" else complex(outline.w.mean())
    moved = np.abs(found[1] + shift - outline.w)[loop].max()
    if outline.kind == "sides" and moved > KEPT * np.ptp(flat, axis=0).max():
        return None
    return (*found, shift)


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


def _placed_like_outside(w: np.ndarray, given: np.ndarray, outline: Outline, faces: Elements) -> np.ndarray:
    """The map turned, and with a free outline moved and scaled, so that what is not magnified lies as it did."""
    if outline.kind == "sides":
        return w
    calm = faces.triangle_areas if faces.region is None else faces.triangle_areas * faces.of_triangles(1 - faces.region)
    mass = np.bincount(faces.triangles.ravel(), np.repeat(calm / calm.sum(), 3) / 3, len(w))
    if outline.kind == "free":
        w = w * np.sqrt(abs(faces.areas(given).sum()) / faces.areas(w).sum())
    about = (0j, outline.centre) if outline.kind == "circle" else None
    return fit_similarity(w, given, mass, rigid=True, about=about)(w)
