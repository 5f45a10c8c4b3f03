"""Match surfaces of any topology that seams cut into disks alike, chart by chart.

Arcs of seams go onto their counterparts by length, so that charts agree wherever they meet. Within a chart the map is
that of Su 2015, algorithm 7: both charts to the disk with areas kept, a harmonic map between the disks of given
outline (Tutte 1963: no folds), landmarks drawn to their places, and the polish on the surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...errors import LandmarkError, PrecisionError
from ...linalg.nested_dissection import mesh_order
from ...linalg.sparse import solve_spd
from ...mesh.charts import Chart, strict_charts
from ...mesh.geometry import LEAST_STIFFNESS, face_areas, halfedge_lengths, laplacian_from_lengths, signed_areas
from ...mesh.point_location import locate
from ...mesh.surface import triangle_surface
from ...mesh.topology import boundary_loops, on_boundary, twins
from ...progress import Progress, Steps, part_of
from ..alignment import rotation_of_pairs
from ..carriers import DiskCarrier, InPlace, TargetCarrier
from ..domains import CHARTS, DISK, FilledSurface, domain_map
from ..landmark_flow import Drawn, draw_landmarks, put_landmarks
from ..landmarks import Landmarks, SplitSurface, check_landmarks, no_landmarks, points_of, reflected, split_at
from ..results import MET, OnSurface, Registration, RegistrationOptions, stretches, with_missed
from ..surface_newton import STRICT, deformation, flat, in_space, minimise_on
from .seam_arcs import SeamArcs, corresponding_arcs, seam_arcs

# Newton steps of the polish.
POLISHING_STEPS = 60
# A landmark with a coordinate this near to 1 is at a vertex.
AT_VERTEX = 1 - 1e-9
# Landmarks that tell how a surface is turned.
FEWEST_TURNING = 3


@dataclass(frozen=True)
class _Side:
    """A surface, triangles (m,3), cut into charts: of every chart the triangles (t,) of the surface that its own are,
    of every triangle its chart (m,), the arcs of the seams, and the vertices (s,) on these."""

    vertices: np.ndarray
    triangles: np.ndarray
    charts: list[Chart]
    rows: list[np.ndarray]
    chart_of: np.ndarray
    arcs: SeamArcs
    on_seams: np.ndarray


@dataclass(frozen=True)
class _Matched:
    """A chart on another: where its vertices (n,) lie there, and the other's (k,) on it, as triangles of the charts and
    coordinates; both in the disk; folded and whole area; stretches (t,2) of its triangles, and Newton steps."""

    forward: tuple[np.ndarray, np.ndarray]
    backward: tuple[np.ndarray, np.ndarray]
    domains: tuple[np.ndarray, np.ndarray]
    areas: tuple[float, float]
    stretches: np.ndarray
    steps: tuple[int, int]


@dataclass(frozen=True)
class _Job:
    """Both surfaces, the arc of the target for each of the source's (a,), and the landmarks, with the chart (l,) of
    each, -1 where it is a corner of seams."""

    source: _Side
    target: _Side
    image: np.ndarray
    landmarks: Landmarks
    owner: np.ndarray

    def arcs(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """The arcs (a,) around the k-th chart, and those of the target (a,) that they go onto."""
        mine = np.flatnonzero(self.source.arcs.chart == k)
        return mine, self.image[mine]

    def counterpart(self, k: int) -> int:
        """The chart of the target that the k-th one goes onto."""
        return int(self.target.arcs.chart[self.arcs(k)[1][0]])


@dataclass(frozen=True)
class _Placed:
    """A chart with landmarks as vertices, the number (n,) of each vertex there, and where they lie on the carrier."""

    split: SplitSurface
    place: np.ndarray
    placed: InPlace
    carrier: TargetCarrier


def register_charts(
    source: tuple[np.ndarray, np.ndarray, np.ndarray],
    target: tuple[np.ndarray, np.ndarray, np.ndarray],
    landmarks: Landmarks | None = None,
    options: RegistrationOptions | None = None,
) -> Steps[Registration]:
    """Match a source, vertices (n,3), triangles (m,3) and seams (s,2), with a target (k,3), (l,3), (r,2).

    The seams cut both into disks, as many and joined alike; which is which, places tell: turned by the landmarks where
    there are three or more. Landmarks on seams are corners of theirs.

    Raises
    ------
    MeshError : charts that are no disks; TopologyMismatchError: seams that differ; LandmarkError: landmarks in charts
        that do not correspond

    References
    ----------
    Su 2015, section 4.3; Tutte 1963.
    """
    options, landmarks = options or RegistrationOptions(domain=CHARTS), landmarks or no_landmarks()
    yield Progress("Checking", 0.0)
    vertices, triangles, seams = np.asarray(source[0], float), np.asarray(source[1], np.int64), source[2]
    if options.mirrored:
        vertices, triangles, landmarks = reflected(vertices, triangles, landmarks)
    job = _prepared((vertices, triangles, seams), target, landmarks)
    count = len(job.source.charts)
    matched = []
    for k in range(count):
        matched.append((yield from part_of(_matched(job, k, options), k / count, 1 / count)))
    found = _joined(job, matched)
    if options.mirrored:
        backward = found.backward
        found = replace(found, backward=replace(backward, barycentric=backward.barycentric[:, [0, 2, 1]]))
    return with_missed(found, landmarks, options.strict)


def _prepared(source, target, landmarks: Landmarks) -> _Job:
    """Both surfaces cut along their seams, and which arcs and charts correspond."""
    at = [_at_vertices(source[1], landmarks.source_faces, landmarks.source_barycentric)]
    at.append(_at_vertices(np.asarray(target[1]), landmarks.target_faces, landmarks.target_barycentric))
    first, second = _side(source, at[0], "source"), _side(target, at[1], "target")
    points = points_of(landmarks, (first.vertices, first.triangles), (second.vertices, second.triangles))
    check_landmarks(landmarks, *points)
    arcs, size = first.arcs, [np.sqrt(face_areas(side.vertices, side.triangles).sum()) for side in (first, second)]
    middle = [side.arcs.points.mean(axis=(0, 1)) for side in (first, second)]
    arcs = replace(arcs, points=(arcs.points - middle[0]) * (size[1] / size[0]) + middle[1])
    if len(landmarks) >= FEWEST_TURNING:
        turn = rotation_of_pairs(*(side - side.mean(axis=0) for side in points)).rotation
        arcs = replace(arcs, points=(arcs.points - middle[1]) @ turn.T + middle[1])
    both = (at[0] >= 0) & (at[1] >= 0)
    image = corresponding_arcs(arcs, second.arcs, np.stack([at[0][both], at[1][both]], axis=1))
    corner = np.isin(at[0], arcs.corners) & both
    owner = np.where(corner, -1, first.chart_of[landmarks.source_faces])
    there = np.zeros(len(first.charts), np.int64)
    there[arcs.chart] = second.arcs.chart[image]
    wrong = np.flatnonzero((owner >= 0) & (there[owner] != second.chart_of[landmarks.target_faces]))
    on_seam = np.isin(at[0], first.on_seams) != np.isin(at[1], second.on_seams)
    wrong = np.union1d(wrong, np.flatnonzero(on_seam))
    if len(wrong):
        names = ", ".join(landmarks.name(k) for k in wrong.tolist())
        raise LandmarkError(f"Landmarks {names} lie in charts that do not correspond")
    return _Job(first, second, image, landmarks, owner)


def _at_vertices(triangles: np.ndarray, faces: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """The vertex (k,) that each point, coordinates (k,3) in triangles (k,), is at, -1 for none."""
    corner = triangles[faces, barycentric.argmax(axis=1)]
    return np.where(barycentric.max(axis=1, initial=0) >= AT_VERTEX, corner, -1)


def _side(surface: tuple[np.ndarray, np.ndarray, np.ndarray], marked: np.ndarray, name: str) -> _Side:
    """A surface (n,3), (m,3), cut along its seams (s,2), with corners at marked vertices (k,), too, -1 for none."""
    vertices, triangles, seams = np.asarray(surface[0], float), np.asarray(surface[1], np.int64), surface[2]
    charts = strict_charts(triangle_surface(vertices, triangles, seams))
    rows = [chart.corners[:, 0] // 3 for chart in charts]
    charts = [replace(chart, triangles=_turned(chart)) for chart in charts]
    chart_of = np.zeros(len(triangles), np.int64)
    for k, row in enumerate(rows):
        chart_of[row] = k
    arcs = seam_arcs(charts, marked[marked >= 0], name)
    around = [chart.vertex_ids[on_boundary(chart.triangles, len(chart.vertices))] for chart in charts]
    return _Side(vertices, triangles, charts, rows, chart_of, arcs, np.unique(np.concatenate(around)))


def _turned(chart: Chart) -> np.ndarray:
    """Triangles (t,3) of a chart, each beginning with the first corner of the surface's triangle."""
    return np.take_along_axis(chart.triangles, np.argsort(chart.corners % 3, axis=1), axis=1)


def _matched(job: _Job, k: int, options: RegistrationOptions) -> Steps[_Matched]:
    """The k-th chart of the source on its counterpart."""
    number = job.counterpart(k)
    chart, other = job.source.charts[k], job.target.charts[number]
    chosen = np.flatnonzero(job.owner == k)
    at = _row_of(job.source.rows[k], job.landmarks.source_faces[chosen])
    split = split_at(chart.vertices, chart.triangles, at, job.landmarks.source_barycentric[chosen])
    split, place = _in_order(without_chords(split))
    mesh_map = yield from part_of(domain_map(_as_disk(split.vertices, split.triangles), DISK, options.balance), 0, 0.25)
    whole = _as_disk(other.vertices, other.triangles)
    other_map = yield from part_of(domain_map(whole, DISK, options.balance), 0.25, 0.25)
    carrier = TargetCarrier(other.vertices, other.triangles, other_map)
    outline, faces, weights = _along(job.source, job.target, job.arcs(k), (chart, other))
    outline, on_outline = place[outline], carrier.at(faces, weights)
    start = _harmonic(mesh_map, split.triangles, outline, on_outline.domain)
    at = _row_of(job.target.rows[number], job.landmarks.target_faces[chosen])
    targets = carrier.at(at, job.landmarks.target_barycentric[chosen])
    drawn = yield from part_of(_drawn(mesh_map, split, start, outline, targets), 0.5, 0.15)
    placed = carrier.place(drawn.placed.domain)
    placed.put(outline, on_outline, np.ones(len(outline), bool))
    placed.put(split.landmarks[drawn.met], targets, drawn.met)
    steps = 0
    if options.polish:
        problem = deformation(split.vertices, split.triangles, carrier, within=placed.domain)
        problem.held[outline] = problem.held[split.landmarks[drawn.met]] = True
        polishing = minimise_on(problem, placed, POLISHING_STEPS, STRICT, "Polishing")
        placed, steps = yield from part_of(polishing, 0.65, 0.35)
        if not drawn.met.all():
            placed, _ = put_landmarks(problem, placed, split.landmarks, targets)
    return _found(job, k, _Placed(split, place, placed, carrier), (drawn.steps, steps))


def _row_of(rows: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The triangle (k,) of a chart that is each of the surface's triangles (k,), of those (t,) that it has."""
    order = np.argsort(rows)
    return order[np.searchsorted(rows, faces, sorter=order)]


def _as_disk(vertices: np.ndarray, triangles: np.ndarray) -> FilledSurface:
    """A disk (n,3), (m,3) as it is."""
    return FilledSurface(vertices, triangles, len(vertices), len(triangles), 0, boundary_loops(triangles)[0])


def without_chords(split: SplitSurface) -> SplitSurface:
    """The same with a vertex in the middle of every edge that is not on the boundary, but ends there twice.

    Both ends may come to lie on one edge of the other chart, which would leave no area to what is between.
    """
    vertices, triangles, parent, corners = split.vertices, split.triangles, split.parent, split.corners
    while True:
        n, m = len(vertices), len(triangles)
        outline, twin = on_boundary(triangles, n), twins(triangles)
        tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
        marked = outline[tail] & outline[head] & (twin >= 0)
        if not marked.any():
            return replace(split, vertices=vertices, triangles=triangles, parent=parent, corners=corners)
        # Of each triangle one edge at a time: the one that its neighbour chooses, too.
        key = np.where(marked, np.minimum(np.arange(3 * m), twin), 3 * m).reshape(-1, 3)
        best = 3 * np.arange(m) + key.argmin(axis=1)
        chosen = np.zeros(3 * m, bool)
        chosen[best] = True
        first = np.flatnonzero(chosen & marked & chosen[twin] & (np.arange(3 * m) < twin))
        both = np.concatenate([first, twin[first]])
        middle = np.tile(n + np.arange(len(first)), 2)
        vertices = np.concatenate([vertices, (vertices[tail[first]] + vertices[head[first]]) / 2])
        face, corner = both // 3, both % 3
        after = (corner + 1) % 3
        place = (corners[face, corner] + corners[face, after]) / 2
        more, there = triangles[face], corners[face]
        row = np.arange(len(both))
        more[row, corner], there[row, corner] = middle, place
        triangles, corners = triangles.copy(), corners.copy()
        triangles[face, after], corners[face, after] = middle, place
        triangles, corners = np.concatenate([triangles, more]), np.concatenate([corners, there])
        parent = np.concatenate([parent, parent[face]])


def _in_order(split: SplitSurface) -> tuple[SplitSurface, np.ndarray]:
    """The same with vertices in the order of elimination, and the new number (n,) of each."""
    order = mesh_order(split.vertices, split.triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return replace(
        split, vertices=split.vertices[order], triangles=place[split.triangles], landmarks=place[split.landmarks]
    ), place


def _along(first: _Side, second: _Side, arcs: tuple[np.ndarray, np.ndarray], charts: tuple[Chart, Chart]):
    """The vertices (r,) around a chart, and where they are on another: its triangles (r,) and coordinates (r,3).

    arcs : those of the first chart (a,), and those of the second that they go onto (a,)
    """
    mine, other = charts
    n = len(other.vertices)
    tail, head = other.triangles.ravel(), other.triangles[:, [1, 2, 0]].ravel()
    edges = tail * n + head
    order = np.argsort(edges)
    outline, halfedges, along = [], [], []
    for a, b in zip(*(side.tolist() for side in arcs), strict=True):
        path, there = first.arcs.paths[a], second.arcs.paths[b]
        at, length = _fractions(mine.vertices[path])[:-1], _fractions(other.vertices[there])
        piece = np.clip(np.searchsorted(length, at, side="right") - 1, 0, len(there) - 2)
        outline.append(path[:-1])
        along.append((at - length[piece]) / (length[piece + 1] - length[piece]))
        halfedges.append(order[np.searchsorted(edges, there[piece] * n + there[piece + 1], sorter=order)])
    halfedge, share = np.concatenate(halfedges), np.concatenate(along)
    weights = np.zeros((len(halfedge), 3))
    row = np.arange(len(halfedge))
    weights[row, halfedge % 3], weights[row, (halfedge + 1) % 3] = 1 - share, share
    return np.concatenate(outline), halfedge // 3, weights


def _fractions(points: np.ndarray) -> np.ndarray:
    """How far along a line of points (k,3) each is, (k,) from 0 to 1."""
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return length / length[-1]


def _harmonic(uv: np.ndarray, triangles: np.ndarray, outline: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The harmonic map (n,2) of a disk (n,2), (m,3), its outline (r,) at places (r,2) around a convex outline."""
    n = len(uv)
    length = halfedge_lengths(in_space(uv), triangles).reshape(-1, 3)
    # What is not positive could fold.
    stiffness = laplacian_from_lengths(length, triangles, n, least=LEAST_STIFFNESS)
    found = np.zeros((n, 2))
    found[outline] = places
    free = np.setdiff1d(np.arange(n), outline)
    if len(free):
        found[free] = solve_spd(stiffness[free][:, free], -(stiffness[free][:, outline] @ places))
    if not (signed_areas(found, triangles) > 0).all():
        raise PrecisionError("The harmonic map of a chart is folded by rounding: seams cut it to a long thin strip")
    return found


def _drawn(
    uv: np.ndarray, split: SplitSurface, start: np.ndarray, outline: np.ndarray, targets: InPlace
) -> Steps[Drawn]:
    """The chart, of shape (n,2), from places (n,2) in the disk with its landmarks drawn to theirs."""
    carrier = DiskCarrier(np.zeros(0, np.int64))
    placed = carrier.place(start)
    if not len(split.landmarks):
        return Drawn(placed, np.zeros(0, bool), 0)
    problem = deformation(in_space(uv), split.triangles, carrier)
    problem.held[outline] = True
    return (yield from draw_landmarks(problem, placed, split.landmarks, flat(targets)))


def _found(job: _Job, k: int, result: _Placed, steps: tuple[int, int]) -> _Matched:
    """What was found, in the numbers of both charts."""
    chart, other = job.source.charts[k], job.target.charts[job.counterpart(k)]
    split, placed, carrier = result.split, result.placed, result.carrier
    own = result.place[: len(chart.vertices)]
    faces, weights = locate(placed.domain, split.triangles, carrier.domain)
    weights = np.einsum("nc,ncd->nd", weights, split.corners[faces])
    faces = split.parent[faces]
    mine, there = job.arcs(k)
    outline, outline_faces, outline_weights = _along(job.target, job.source, (there, mine), (other, chart))
    faces[outline], weights[outline] = outline_faces, outline_weights
    area = face_areas(split.vertices, split.triangles)
    folded = carrier.folded(placed, split.triangles)
    return _Matched(
        forward=(placed.faces[own], placed.barycentric[own]),
        backward=(faces, weights),
        domains=(placed.domain[own], carrier.domain),
        areas=(float(area[folded].sum()), float(area.sum())),
        stretches=stretches(split.vertices, placed.positions, split.triangles)[: len(chart.triangles)],
        steps=steps,
    )


def _joined(job: _Job, matched: list[_Matched]) -> Registration:
    """The charts' matches as one of the surfaces."""
    source, target = job.source, job.target
    forward, there = _empty(len(source.vertices)), np.zeros((len(source.vertices), 2))
    backward, back = _empty(len(target.vertices)), np.zeros((len(target.vertices), 2))
    ratios = np.zeros((len(source.triangles), 2))
    for k, found in enumerate(matched):
        number = job.counterpart(k)
        ids, others = source.charts[k].vertex_ids, target.charts[number].vertex_ids
        forward.faces[ids], forward.barycentric[ids] = target.rows[number][found.forward[0]], found.forward[1]
        backward.faces[others], backward.barycentric[others] = source.rows[k][found.backward[0]], found.backward[1]
        there[ids], back[others] = found.domains
        ratios[source.rows[k]] = found.stretches
    points = forward.positions(target.vertices, target.triangles)
    mine, places = points_of(job.landmarks, (points, source.triangles), (target.vertices, target.triangles))
    residuals = np.linalg.norm(mine - places, axis=1) / float(np.ptp(target.vertices, axis=0).max())
    sizes = [np.sqrt(face_areas(side.vertices, side.triangles).sum()) for side in (source, target)]
    return Registration(
        forward=forward,
        backward=backward,
        domain=CHARTS,
        source_domain=there,
        target_domain=back,
        flipped=sum(found.areas[0] for found in matched) / sum(found.areas[1] for found in matched),
        stretches=ratios * sizes[0] / sizes[1],
        residuals=residuals,
        met=residuals <= MET,
        steps=(sum(found.steps[0] for found in matched), sum(found.steps[1] for found in matched)),
        error=0.0,
        warnings=(),
    )


def _empty(n: int) -> OnSurface:
    """Points (n,) to be set."""
    return OnSurface(np.zeros(n, np.int64), np.zeros((n, 3)), np.zeros(n, bool))
