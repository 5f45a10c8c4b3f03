"""Remesh a surface once or as a series of levels of detail; the one path of operator and command line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from ..settings import DEFAULT_HIGH, DEFAULT_LOW, RemeshSettings
from ..solver.analysis.density import (
    checked_density,
    from_vertices,
    gaussian_curvature_density,
    mean_curvature_density,
    painted_density,
)
from ..solver.analysis.feature_edges import edge_union, resolved_features
from ..solver.analysis.occlusion import hidden_sides, looks_out
from ..solver.analysis.vertex_scores import scaled_vertex_areas, soft_weights, vertex_score
from ..solver.contact.self_intersections import intersecting_pairs
from ..solver.counts import check_vertices, real
from ..solver.errors import CountError, DensityError, MeshError, plural, reaching
from ..solver.mesh.geometry import face_areas
from ..solver.mesh.gluing import Gluing, orientations
from ..solver.mesh.repair import repaired_gluing
from ..solver.mesh.surface import Surface, chosen_triangles
from ..solver.mesh.topology import graph_components, halfedges
from ..solver.progress import Progress, Steps, part_of
from ..solver.remeshing import Remesh, RemeshOptions, RemeshSource, remesh
from ..solver.transfer.correspondence import Correspondence, correspond

# Share of the work on one level that its mesh takes; the rest is where it lies on the surface.
REMESHING = 0.95
ODD = " joined the wrong way round to others that look outwards, too"
NO_EDGES = np.zeros((0, 2), np.int64)


@dataclass(frozen=True)
class RemeshJob:
    """A surface and what the new mesh shall follow.

    features (e,2): vertex pairs of edges to keep; jumps (s,2): edges across which values jump, kept or not;
    values (m,): weights of the vertex group, or the attribute, per triangle of the surface; warnings: what was mended;
    kept (m,) bool: triangles whose sides the new mesh is to have turned back, see `Oriented`
    """

    surface: Surface
    features: np.ndarray
    jumps: np.ndarray
    values: np.ndarray | None = None
    warnings: tuple[str, ...] = ()
    kept: np.ndarray | None = None


@dataclass(frozen=True)
class LevelOfDetail:
    """A new mesh: positions (k,3), triangles (t,3), and where it lies on the old one.

    back (t,) bool: triangles to be turned over once they carry what they carry, see `Oriented`
    """

    positions: np.ndarray
    triangles: np.ndarray
    correspondence: Correspondence
    found: Remesh
    back: np.ndarray


@dataclass(frozen=True)
class Series:
    """New meshes, the finest first, and warnings."""

    levels: list[LevelOfDetail]
    warnings: list[str]


def remesh_series(job: RemeshJob, settings: RemeshSettings) -> Steps[Series]:
    """Remesh a surface as often as the settings say, each time from the surface itself and with the same maps of it.

    Raises
    ------
    MeshError : CountError, DensityError, WeightError and those of `solver.remeshing.remesh`; elements are vertices,
        edges and polygons of the surface
    """
    surface = job.surface
    chosen_triangles(surface, None)
    triangles = surface.corner_vertex[surface.triangles]
    count_of, counts = _counts(surface, triangles, settings)
    sources: dict[bytes, RemeshSource] = {}
    with _located(surface, ""):
        density = density_of(job, triangles, settings)
    levels: list[LevelOfDetail] = []
    warnings = list(job.warnings)
    for k, count in enumerate(counts):
        name = f"LOD{k}: " if len(counts) > 1 else ""
        features, joined = _features(job, triangles, density, count if count_of == "vertices" else count // 2)
        # As a rule all levels can show the same features, and then one set of maps serves them all.
        source = sources.setdefault(features.tobytes(), RemeshSource(surface.positions, triangles, features))
        options = RemeshOptions(
            count_of=count_of,
            preserve_boundary=settings.preserve_boundary,
            strategy=settings.strategy,
            grading=settings.grading,
        )
        steps = _level(job, source, count, options, density)
        with _located(surface, name):
            level = yield from part_of(steps, k / len(counts), 1 / len(counts))
        levels.append(level)
        crossing = _crossings(level.positions, level.triangles, surface.positions, triangles)
        warnings += [name + text for text in (*joined, *level.found.warnings, *crossing)]
        if level.correspondence.extended:
            warnings.append(f"{name}{reaching(level.correspondence.extended)}")
    return Series(levels, warnings)


def _crossings(
    positions: np.ndarray, triangles: np.ndarray, old_positions: np.ndarray, old_triangles: np.ndarray
) -> tuple[str, ...]:
    """A warning where faces of a new mesh (n,3), (m,3) pass through one another, and none of the old one does."""
    pairs = intersecting_pairs(positions, triangles)
    if not len(pairs) or len(intersecting_pairs(old_positions, old_triangles)):
        return ()
    who = plural(len(np.unique(pairs)), "1 face of the new mesh passes", "{} faces of the new mesh pass")
    return (
        f"{who} through others, as none does in the old one: parts are thinner than the new triangles. Ask for more",
    )


def _counts(surface: Surface, triangles: np.ndarray, settings: RemeshSettings) -> tuple[str, list[int]]:
    """What is counted, and the count of every level."""
    first, count_of = settings.count, settings.count_of
    if not 0 < first < np.inf:
        raise CountError(f"A remesh with {count_of} {real(first):g} is none", "Give a number above 0")
    if not 0 < settings.ratio < 1 and settings.levels > 1:
        raise CountError(f"Levels cannot each have {settings.ratio:g} times the count", "Give a ratio between 0 and 1")
    if count_of == "edge":
        # A triangle with three edges of length L has the area sqrt(3) L^2 / 4; faces are even in number where closed.
        area = face_areas(surface.positions, triangles).sum()
        # Floats of Python overflow to infinity without a word, which is too many as well.
        faces = float(area) / (3**0.5 / 4) / real(first) / real(first)
        check_vertices(faces / 2)
        first, count_of = 2 * max(round(faces / 2), 1), "faces"
    check_vertices(real(first) if count_of == "vertices" else real(first) / 2)
    last = settings.levels - 1
    if last > 0 and round(first * settings.ratio ** real(last)) < 1:
        raise CountError(
            f"The last of {real(settings.levels):g} levels would have no {count_of}",
            "Ask for fewer levels, or give a ratio nearer to 1",
        )
    counts = [round(first * settings.ratio**k) for k in range(max(settings.levels, 1))]
    if count_of == "faces":
        counts = [counts[0], *(c + c % 2 for c in counts[1:])]
    return count_of, counts


def _features(
    job: RemeshJob, triangles: np.ndarray, density: np.ndarray | None, vertex_count: int
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The features (e,2) that a mesh of so many vertices can show, and a warning about others."""
    area = face_areas(job.surface.positions, triangles)
    if not len(job.features) or not area.sum() > 0:
        return job.features, ()
    sample_density = np.ones(len(area)) if density is None else density
    # Every vertex has the area of two equilateral triangles.
    size = np.sqrt(area @ sample_density / (max(vertex_count, 1) * np.sqrt(3) / 2) / sample_density)
    features, joined = resolved_features(job.surface.positions, triangles, job.features, size)
    text = plural(joined, "1 region is", "{} regions between features are")
    return features, (f"{text} too small for triangles of this size and not kept apart",) if joined else ()


def _level(
    job: RemeshJob, source: RemeshSource, count: int, options: RemeshOptions, density: np.ndarray | None
) -> Steps[LevelOfDetail]:
    """One remesh of so many vertices or faces, and where it lies on the surface."""
    positions, triangles = source.vertices, source.triangles
    found = yield from part_of(remesh(source, count, options, density), 0.0, REMESHING)
    yield Progress("Attributes", REMESHING)
    seams = edge_union(source.features, job.jumps)
    at = correspond(positions, triangles, seams, found.vertices, found.triangles, found.faces, found.barycentric)
    back = np.zeros(len(found.triangles), bool) if job.kept is None else job.kept[at.face_triangle]
    return LevelOfDetail(found.vertices, found.triangles, at, found, back)


@contextmanager
def _located(surface: Surface, name: str) -> Iterator[None]:
    """Errors say the level's name, and polygons of the surface instead of triangles."""
    try:
        yield
    except MeshError as error:
        elements = error.elements
        if error.kind == "face":
            elements = np.unique(surface.triangle_face[elements])
        raise type(error)(name + error.cause, error.remedy, error.kind, elements) from error


@dataclass(frozen=True)
class Oriented:
    """A surface whose triangles look to one side, and what was turned over for that.

    kept (m,) bool : triangles that are turned back in the new mesh, since their part looks outwards then
    joints (e,2) : edges between these and their neighbours
    wrong, odd : words about the faces that were wound wrongly, and about those that are turned back; empty for none
    """

    surface: Surface
    kept: np.ndarray
    joints: np.ndarray
    wrong: str = ""
    odd: str = ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What becomes of these faces in a new mesh."""
        said = (self.wrong, "turned over in the new mesh"), (self.odd, "sides stay as they are")
        return tuple(f"{found}; {done}" for found, done in said if found)


def oriented(surface: Surface) -> Oriented:
    """The surface with triangles turned over that look to another side than their neighbours.

    Most were wound wrongly. But two parts may both look outwards where they are joined the wrong way round, as by
    Blender's Skin modifier at the root of a finger: one of them is inside out as soon as all faces agree.
    """
    given = surface.corner_vertex[surface.triangles]
    tail, head = halfedges(given)
    none = np.zeros(len(given), bool)
    if len(np.unique(tail * len(surface.positions) + head)) == len(tail):
        return Oriented(surface, none, NO_EDGES)
    faces = np.ones(len(surface.face_start) - 1, dtype=bool)
    gluing = repaired_gluing(surface, faces, surface.triangles, surface.triangle_face).gluing
    turned, _ = orientations(gluing, face_areas(surface.positions, given))
    if not turned.any():
        return Oriented(surface, none, NO_EDGES)
    triangles = np.where(turned[:, None], surface.triangles[:, [0, 2, 1]], surface.triangles)
    kept = _sides_back(surface.positions, given, gluing, turned)
    between = kept[gluing.first // 3] != kept[gluing.second // 3]
    joints = np.stack([end[between] for end in gluing.ends(gluing.first)], axis=1)
    wrong, odd = (len(np.unique(surface.triangle_face[those])) for those in (turned != kept, turned & kept))
    return Oriented(
        surface=replace(surface, triangles=triangles),
        kept=kept,
        joints=joints,
        wrong=plural(wrong, "A face looks to another side than its neighbours", "{} faces look to another side")
        if wrong
        else "",
        odd=plural(odd, "A face is", "{} faces are") + ODD if odd else "",
    )


def _sides_back(positions: np.ndarray, given: np.ndarray, gluing: Gluing, turned: np.ndarray) -> np.ndarray:
    """Triangles (m,) bool that are to have another side than their neighbours once those `turned` (m,) of the given
    ones (m,3) are: where parts on both sides of a joint look outwards as given."""
    first, second = gluing.first // 3, gluing.second // 3
    same = turned[first] == turned[second]
    _, part = graph_components(first[same], second[same], len(given))
    pieces, piece = graph_components(first, second, len(given))
    hidden, area = hidden_sides(positions, given), face_areas(positions, given)
    out, inside = (looks_out(sides, area, part)[part] for sides in (hidden, hidden[::-1]))
    odd = np.bincount(piece[out & turned], minlength=pieces) * np.bincount(piece[out & ~turned], minlength=pieces) > 0
    return odd[piece] & np.where(turned, out, inside)


def density_of(job: RemeshJob, triangles: np.ndarray, settings: RemeshSettings) -> np.ndarray | None:
    """Samples per area (m,) up to a factor that the settings ask for, None where it is the same everywhere."""
    return None if settings.density == "uniform" else _DENSITIES[settings.density](job, triangles, settings)


def _curvature(job: RemeshJob, triangles: np.ndarray, settings: RemeshSettings) -> np.ndarray:
    """Density (m,) by mean curvature."""
    return mean_curvature_density(job.surface.positions, triangles, settings.amount)


def _gaussian(job: RemeshJob, triangles: np.ndarray, settings: RemeshSettings) -> np.ndarray:
    """Density (m,) by Gaussian curvature."""
    return gaussian_curvature_density(job.surface.positions, triangles, settings.amount)


def _saliency(job: RemeshJob, triangles: np.ndarray, settings: RemeshSettings) -> np.ndarray:
    """Density (m,) by saliency, up to the factor of the settings."""
    positions = job.surface.positions
    area = scaled_vertex_areas(positions, triangles)
    weights = soft_weights(vertex_score("saliency", positions, triangles), area, DEFAULT_LOW, DEFAULT_HIGH)
    return painted_density(from_vertices(weights, triangles), settings.factor)


def _painted(job: RemeshJob, triangles: np.ndarray, settings: RemeshSettings) -> np.ndarray:
    """Density (m,) by the weights of a vertex group, up to the factor of the settings."""
    return painted_density(_values(job), settings.factor)


def _attribute(job: RemeshJob, triangles: np.ndarray, settings: RemeshSettings) -> np.ndarray:
    """Density (m,) that an attribute holds."""
    return checked_density(_values(job))


def _values(job: RemeshJob) -> np.ndarray:
    """The values (m,) of the job; raises DensityError if it has none."""
    if job.values is None:
        raise DensityError("There is nothing to read the density from", "Name a vertex group or an attribute")
    return job.values


_DENSITIES: dict[str, Callable[[RemeshJob, np.ndarray, RemeshSettings], np.ndarray]] = {
    "curvature": _curvature,
    "gaussian": _gaussian,
    "saliency": _saliency,
    "weights": _painted,
    "attribute": _attribute,
}
