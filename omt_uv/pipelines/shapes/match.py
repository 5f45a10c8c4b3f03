"""Match one object's surface with another's, and carry over what is asked; the one path of operator and command."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...solver.errors import EmptyMeshError, MeshError, plural
from ...solver.mesh.geometry import face_areas, halfedge_lengths
from ...solver.mesh.surface import Surface
from ...solver.mesh.topology import graph_components, halfedges, triangle_parts
from ...solver.progress import Progress, Steps, part_of
from ...solver.registration.charts.chart_maps import register_charts
from ...solver.registration.domains import CHARTS
from ...solver.registration.landmarks import Landmarks
from ...solver.registration.register import register
from ...solver.registration.results import Registration, RegistrationOptions
from ...solver.strain.figures import MatchFigures, match_figures
from .landmark_pairs import Pairs, landmarks_on

# Share of the time that the match itself takes.
MATCHING = 0.95
# Vertices of the matched part that carry another part, the nearest ones.
CARRIERS = 60


@dataclass(frozen=True)
class MatchJob:
    """What to match: surfaces with positions in one space, pairs of landmarks, how, and what else must be kept apart:
    jumps (s,2) edges of the source across which values of corners and faces jump."""

    source: Surface
    target: Surface
    pairs: Pairs
    options: RegistrationOptions
    jumps: np.ndarray


@dataclass(frozen=True)
class MatchResult:
    """A match of two surfaces.

    wrapped (n,3): the source's vertices on the target; source_faces (k,) and source_barycentric (k,3): triangle of the
    source's surface and coordinates of every vertex of the target; parts: of source and target that were matched;
    found: of these; landmarks: names; figures: see `strain.figures`; intersections: pairs of faces of a wrapped source
    that pass through one another and did not before, None where nothing was wrapped; warnings
    """

    wrapped: np.ndarray
    source_faces: np.ndarray
    source_barycentric: np.ndarray
    parts: tuple[MatchedPart, MatchedPart]
    found: Registration
    landmarks: Landmarks
    figures: MatchFigures
    warnings: tuple[str, ...]
    intersections: int | None = None

    @cached_property
    def fit(self) -> float:
        """Distance of the wrapped part from the target, see `distance_from`."""
        source, target = self.parts
        return distance_from((target.vertices, target.triangles), self.wrapped[source.used], source.triangles)

    def report(self) -> dict:
        """Figures for a JSON file."""
        # In a file of pairs they have numbers alone.
        names = [*self.landmarks.names, *map(str, range(len(self.landmarks.names), len(self.landmarks)))]
        stretch = self.found.stretches
        return {
            "domain": self.found.domain,
            "flipped_area": self.found.flipped,
            "landmarks": dict(zip(names, self.found.residuals.tolist(), strict=True)),
            "met": int(self.found.met.sum()),
            "stretch_99": np.percentile(stretch, 99, axis=0).tolist() if len(stretch) else [],
            "curvature_difference": {
                "mean": self.figures.mean_curvature,
                "histogram": self.figures.curvature.round(6).tolist(),
            },
            "area_distortion": {"mean": self.figures.mean_area, "histogram": self.figures.area.round(6).tolist()},
            "fit_rms": self.fit,
            **({} if self.intersections is None else {"intersections": self.intersections}),
            "steps": list(self.found.steps),
            "warnings": list(self.warnings),
        }


@dataclass(frozen=True)
class MatchedPart:
    """The largest part of a surface: its vertices (k,) and triangles (m,) there, and both as arrays of their own."""

    used: np.ndarray
    rows: np.ndarray
    vertices: np.ndarray
    triangles: np.ndarray
    rest: np.ndarray


def match_surfaces(job: MatchJob) -> Steps[MatchResult]:
    """Match the largest part of a source with that of a target; other parts go along with what is nearest.

    Raises
    ------
    PairsError : see `landmark_pairs.landmarks_on`
    MeshError : see `registration.register`; elements are those of the surface that the message names
    """
    yield Progress("Reading", 0.0)
    source, target = largest_part(job.source, "source"), largest_part(job.target, "target")
    own, other = (source.vertices, source.triangles), (target.vertices, target.triangles)
    landmarks = landmarks_on(_renamed(job.pairs, source, target), own, other)
    if job.options.domain == CHARTS:
        cut = (*own, _seams(job.source, source)), (*other, _seams(job.target, target))
        steps = register_charts(*cut, landmarks, job.options)
    else:
        steps = register(own, other, landmarks, job.options)
    found = yield from part_of(steps, 0.0, MATCHING)
    yield Progress("Figures", MATCHING)
    wrapped = job.source.positions.copy()
    wrapped[source.used] = found.forward.positions(*other)
    _carry_parts(wrapped, job.source, source)
    faces, barycentric = _back(job.target, source, target, found)
    image = (found.forward.faces, found.forward.barycentric)
    warnings = list(found.warnings)
    for surface, part, name in ((job.source, source, "source"), (job.target, target, "target")):
        if len(part.rest):
            count = _count_parts(surface) - 1
            warnings.append(
                f"{plural(count, '1 smaller part', '{} smaller parts')} of the {name} went along with the largest"
            )
    return MatchResult(
        wrapped=wrapped,
        source_faces=faces,
        source_barycentric=barycentric,
        parts=(source, target),
        found=found,
        landmarks=landmarks,
        figures=match_figures(own, other, image, wrapped[source.used]),
        warnings=tuple(warnings),
    )


def _renamed(pairs: Pairs, source: MatchedPart, target: MatchedPart) -> Pairs:
    """The pairs with vertices numbered as in the parts; one that is elsewhere gets a number that is in none."""
    sides = []
    for points, part in ((pairs.source, source), (pairs.target, target)):
        number = np.full(max(int(part.used.max()) + 1, *(p.vertex + 1 for p in points), 1), len(part.used))
        number[part.used] = np.arange(len(part.used))
        sides.append(tuple(type(p)(p.name, int(number[p.vertex]) if p.vertex >= 0 else -1, p.position) for p in points))
    return Pairs(*sides)


def largest_part(surface: Surface, name: str) -> MatchedPart:
    """The part of a surface that has the most area."""
    triangles = surface.corner_vertex[surface.triangles]
    if not len(triangles):
        raise EmptyMeshError(f"The {name} has no faces", "Choose a mesh with faces")
    if not np.isfinite(surface.positions[triangles]).all():
        raise MeshError(f"Coordinates of the {name} are not finite numbers", "Clear or fix its scale")
    part = triangle_parts(triangles, len(surface.positions))
    area = np.bincount(part, face_areas(surface.positions, triangles))
    rows = np.flatnonzero(part == area.argmax())
    used, inverse = np.unique(triangles[rows], return_inverse=True)
    rest = np.setdiff1d(np.unique(triangles), used)
    return MatchedPart(used, rows, surface.positions[used], inverse.reshape(-1, 3).astype(np.int64), rest)


def _seams(surface: Surface, part: MatchedPart) -> np.ndarray:
    """The seams (s,2) of a surface that lie on its part, as vertices of that."""
    number = np.full(len(surface.positions), -1)
    number[part.used] = np.arange(len(part.used))
    seams = number[surface.seams]
    return seams[(seams >= 0).all(axis=1)]


def _count_parts(surface: Surface) -> int:
    triangles = surface.corner_vertex[surface.triangles]
    return len(np.unique(triangle_parts(triangles, len(surface.positions))))


def _back(
    surface: Surface, source: MatchedPart, target: MatchedPart, found: Registration
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (k,) of the source's surface and coordinates (k,3) of all vertices of the target."""
    from scipy.spatial import cKDTree

    near = cKDTree(target.vertices).query(surface.positions)[1]
    near[target.used] = np.arange(len(target.used))
    return source.rows[found.backward.faces][near], found.backward.barycentric[near]


def _carry_parts(wrapped: np.ndarray, surface: Surface, part: MatchedPart) -> None:
    """Move smaller parts as the nearest vertices of the largest move: the similarity that fits them best."""
    if not len(part.rest):
        return
    from scipy.spatial import cKDTree

    triangles = surface.corner_vertex[surface.triangles]
    label = graph_components(*halfedges(triangles), len(surface.positions))[1]
    tree = cKDTree(part.vertices)
    for number in np.unique(label[part.rest]).tolist():
        mine = part.rest[label[part.rest] == number]
        distance = tree.query(surface.positions[mine])[0]
        centre = surface.positions[mine].mean(axis=0)
        near = tree.query(centre, k=min(CARRIERS, len(part.used)))[1]
        near = np.union1d(near, tree.query(surface.positions[mine[distance.argsort()[:CARRIERS]]])[1])
        before, after = part.vertices[near], wrapped[part.used[near]]
        middle, there = before.mean(axis=0), after.mean(axis=0)
        left, value, right = np.linalg.svd((after - there).T @ (before - middle))
        sign = np.array([1, 1, np.sign(np.linalg.det(left) * np.linalg.det(right))])
        scale = float((value * sign).sum() / max(float(((before - middle) ** 2).sum()), 1e-300))
        wrapped[mine] = scale * (surface.positions[mine] - middle) @ ((left * sign) @ right).T + there


def distance_from(target: tuple[np.ndarray, np.ndarray], wrapped: np.ndarray, triangles: np.ndarray) -> float:
    """Root mean square distance of the wrapped surface (n,3), (m,3) from the target, over the target's diagonal.

    Measured at the middles of the wrapped triangles, by area; its vertices lie on the target.
    """
    from ...solver.mesh.closest_point import ClosestPoint
    from ...solver.mesh.geometry import face_normals

    vertices, faces = target
    middle, area = wrapped[triangles].mean(axis=1), face_areas(wrapped, triangles)
    closest = ClosestPoint(vertices, faces, float(np.median(halfedge_lengths(vertices, faces))))
    normals = face_normals(wrapped, triangles)
    found = closest.closer(middle, normals, closest(middle, normals))
    square = ((found.points - middle) ** 2).sum(axis=1)
    return float(np.sqrt(area @ square / max(float(area.sum()), 1e-300)) / np.linalg.norm(np.ptp(vertices, axis=0)))
