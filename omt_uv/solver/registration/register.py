"""Match two surfaces: a bijective map from one onto the other that meets landmarks and distorts little.

Both are mapped to a common domain with areas kept, one domain is turned onto the other, and deformed within the domain
until the landmarks meet (Su 2015, section 4.3, with a barrier energy instead of a harmonic map, which can fold where
landmarks are hard). The map between the domains is one between the surfaces, and is polished there: its own distortion
from surface to surface is minimised, landmarks held, and no step folds it in the domain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import LandmarkError, ZeroAreaFaceError
from ..linalg.nested_dissection import mesh_order
from ..maps.energy import elements
from ..mesh.closest_point import ClosestPoint
from ..mesh.geometry import face_areas, halfedge_lengths, vertex_areas, vertex_normals
from ..mesh.point_location import locate
from ..progress import Progress, Steps, part_of
from ..refinement.hessian_blocks import Assembly
from .alignment import moebius_of_pairs, rotation_by_search, rotation_of_pairs, turn_by_search
from .carriers import DiskCarrier, InPlace, SphereCarrier, TargetCarrier
from .coarse_polish import coarse_polish
from .descriptors import descriptors
from .domains import AUTO, DOMAINS, SPHERE, FilledSurface, checked, domain_map, filled, kind_of
from .landmark_flow import Drawn, draw_landmarks, put_landmarks
from .landmarks import Landmarks, SplitSurface, check_handedness, check_landmarks, no_landmarks, split_at
from .surface_newton import STRICT, Deformation, Features, in_space, minimise_on

# Area weight of the energy, in the domain and on the surface.
AREA_WEIGHT = 1.0
# Weight of the features, by default.
FEATURE_WEIGHT = 0.05
# Newton steps of the polish at most.
POLISHING_STEPS = 60
# And after landmarks that had no room were put into their places.
AGAIN_STEPS = 10
# Distance over the extent below which a landmark is met.
MET = 1e-6
# Where the time goes, roughly, as start and width.
SOURCE_MAP = (0.0, 0.25)
TARGET_MAP = (0.25, 0.25)
DRAWING = (0.5, 0.15)
POLISHING = (0.65, 0.35)


@dataclass(frozen=True)
class RegistrationOptions:
    """How two surfaces are matched.

    domain : "sphere", which closes all holes; "disk", which keeps the longest boundary; "auto": a disk where both have
        a boundary
    balance : of the maps to the domain, 0 for exact areas to 1 for the least shear
    mirrored : match the mirror image of the source
    polish : whether the map is optimised on the surfaces, too
    features : weight of the shape's features in the polish, next to the distortion; 0 for none
    strict : refuse where a landmark cannot be met, instead of naming it

    Raises
    ------
    ValueError : a domain that is none of these, a balance outside of [0, 1]
    """

    domain: str = AUTO
    balance: float = 0.5
    mirrored: bool = False
    polish: bool = True
    strict: bool = False
    features: float = FEATURE_WEIGHT

    def __post_init__(self):
        if self.domain not in DOMAINS:
            raise ValueError(f"domain must be one of {', '.join(DOMAINS)}, not {self.domain!r}")
        if not 0 <= self.balance <= 1:
            raise ValueError(f"balance must lie in [0, 1], not {self.balance}")


@dataclass(frozen=True)
class OnSurface:
    """Points on a surface: triangle (n,), barycentric coordinates (n,3), and which (n,) bool lie where a hole was
    closed, and were moved to the nearest point of the surface."""

    faces: np.ndarray
    barycentric: np.ndarray
    beside: np.ndarray

    def positions(self, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Where they are (n,3), on a surface of vertices (k,3) and triangles (m,3)."""
        return np.einsum("nc,ncd->nd", self.barycentric, vertices[triangles[self.faces]])


@dataclass(frozen=True)
class Registration:
    """A map of a source onto a target and back.

    forward: where the source's vertices lie on the target; backward: where the target's lie on the source
    domain: "sphere" or "disk"; source_domain (n,d), target_domain (k,d): both surfaces there, as they lie over one
    another; flipped: share of the source's area whose orientation the map turns; stretches (m,2): singular values of
    the map of every triangle of the source, the greater first, in units in which both surfaces have the same area
    residuals (l,): how far landmarks are from their places, over the target's extent; met (l,) bool
    steps: Newton steps in the domain and on the surfaces; error: of the alignment; warnings
    """

    forward: OnSurface
    backward: OnSurface
    domain: str
    source_domain: np.ndarray
    target_domain: np.ndarray
    flipped: float
    stretches: np.ndarray
    residuals: np.ndarray
    met: np.ndarray
    steps: tuple[int, int]
    error: float
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Pair:
    """Both surfaces, ready: the source with holes filled, landmarks as vertices, renumbered; all in units of extent 1
    and of equal area. order (n,): vertex of `split` that each vertex was."""

    source: FilledSurface
    target: FilledSurface
    split: SplitSurface
    order: np.ndarray
    vertices: np.ndarray
    triangles: np.ndarray
    landmarks: np.ndarray
    targets: tuple[np.ndarray, np.ndarray]
    loop: np.ndarray
    domain: str


def register(
    source: tuple[np.ndarray, np.ndarray],
    target: tuple[np.ndarray, np.ndarray],
    landmarks: Landmarks | None = None,
    options: RegistrationOptions | None = None,
) -> Steps[Registration]:
    """Match a source, vertices (n,3) and triangles (m,3), with a target (k,3), (l,3).

    Parameters
    ----------
    landmarks : pairs of points that are to meet; without any, the rotation of the domains is searched for
    options : see `RegistrationOptions`

    Raises
    ------
    MeshError : what is no manifold surface of one part; TopologyMismatchError: handles, or one closed and one open in
        a disk; LandmarkError: landmarks that coincide, are mirrored, or, if strict, cannot be met

    References
    ----------
    Su 2015, section 4.3; Degener, Meseth, Klein 2003 (energy); Smith, Schaefer 2015 (barrier); Kabsch 1976.
    """
    options, landmarks = options or RegistrationOptions(), landmarks or no_landmarks()
    yield Progress("Checking", 0.0)
    (vertices, triangles), (others, other_triangles) = _as_arrays(*source), _as_arrays(*target)
    checked(vertices, triangles, "source")
    checked(others, other_triangles, "target")
    if options.mirrored:
        vertices, triangles, landmarks = _reflected(vertices, triangles, landmarks)
    pair = _prepared((vertices, triangles), (others, other_triangles), landmarks, options.domain)
    first = replace(pair.source, vertices=pair.split.vertices, triangles=pair.split.triangles)
    source_map = yield from part_of(domain_map(first, pair.domain, options.balance), *SOURCE_MAP)
    target_map = yield from part_of(domain_map(pair.target, pair.domain, options.balance), *TARGET_MAP)
    aligned, error = _aligned(pair, source_map, target_map, landmarks)
    drawn = yield from part_of(_drawn(pair, aligned[pair.order], target_map), *DRAWING)
    placed, steps = yield from part_of(_polished(pair, drawn, target_map, options.polish, options.features), *POLISHING)
    found = _registration(pair, placed, target_map, (drawn.steps, steps), error)
    if options.mirrored:
        backward = found.backward
        found = replace(found, backward=replace(backward, barycentric=backward.barycentric[:, [0, 2, 1]]))
    missed = [landmarks.name(k) for k in np.flatnonzero(~found.met).tolist()]
    text = f"Landmarks {', '.join(missed)} cannot be met without a fold" if missed else ""
    if missed and options.strict:
        raise LandmarkError(text, "Move them, or leave them out")
    return replace(found, warnings=(*found.warnings, text)) if missed else found


def _as_arrays(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(vertices, float), np.asarray(triangles, np.int64)


def _reflected(vertices: np.ndarray, triangles: np.ndarray, landmarks: Landmarks):
    """The mirror image of a surface (n,3), (m,3) that looks outside, and the landmarks on it."""
    turned = landmarks.source_barycentric[:, [0, 2, 1]]
    return vertices * [-1, 1, 1], triangles[:, [0, 2, 1]], replace(landmarks, source_barycentric=turned)


def _prepared(source, target, landmarks: Landmarks, domain: str) -> _Pair:
    """Holes filled, landmarks made vertices, sizes alike, vertices in the order of elimination."""
    domain = kind_of(source[1], target[1], domain)
    first, second = filled(source, domain, "source"), filled(target, domain, "target")
    sizes = [np.sqrt(face_areas(surface.vertices, surface.triangles).sum()) for surface in (first, second)]
    if not min(sizes) > 0:
        raise ZeroAreaFaceError("A surface has no area", "Give meshes whose faces are no lines and no points")
    first = replace(first, vertices=(first.vertices - first.vertices.mean(axis=0)) / sizes[0])
    second = replace(second, vertices=(second.vertices - second.vertices.mean(axis=0)) / sizes[1])
    points = [
        np.einsum("kc,kcd->kd", weights, surface.vertices[surface.triangles[faces]])
        for surface, faces, weights in (
            (first, landmarks.source_faces, landmarks.source_barycentric),
            (second, landmarks.target_faces, landmarks.target_barycentric),
        )
    ]
    check_landmarks(landmarks, *points)
    split = split_at(first.vertices, first.triangles, landmarks.source_faces, landmarks.source_barycentric)
    order = mesh_order(split.vertices, split.triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return _Pair(
        source=first,
        target=second,
        split=split,
        order=order,
        vertices=split.vertices[order],
        triangles=place[split.triangles],
        landmarks=place[split.landmarks],
        targets=(landmarks.target_faces, landmarks.target_barycentric),
        loop=place[first.loop],
        domain=domain,
    )


def _aligned(pair: _Pair, source_map: np.ndarray, target_map: np.ndarray, landmarks: Landmarks):
    """The source's map (n,d), turned onto that of the target, and how far landmarks or functions are apart there."""
    corners = pair.target.triangles[pair.targets[0]]
    places = np.einsum("kc,kcd->kd", pair.targets[1], target_map[corners])
    points = source_map[pair.split.landmarks]
    if pair.domain == SPHERE:
        places = places / np.maximum(np.linalg.norm(places, axis=1, keepdims=True), 1e-300)
        check_handedness(landmarks, points, places)
        if len(points) >= 2:
            found = rotation_of_pairs(points, places)
        else:
            found = rotation_by_search(*_functions(pair, source_map, target_map))
        return source_map @ found.rotation.T, found.error
    if len(points):
        moebius = moebius_of_pairs(points @ [1, 1j], places @ [1, 1j])
    else:
        moebius = turn_by_search(*_functions(pair, source_map, target_map))
    moved = moebius(source_map @ [1, 1j])
    return np.column_stack([moved.real, moved.imag]), 0.0


def _functions(pair: _Pair, source_map: np.ndarray, target_map: np.ndarray):
    """Of both surfaces the map (n,d) and functions (n,c) there."""
    first = descriptors(pair.split.vertices, pair.split.triangles)
    second = descriptors(pair.target.vertices, pair.target.triangles)
    return (source_map, first), (target_map, second)


def _drawn(pair: _Pair, aligned: np.ndarray, target_map: np.ndarray) -> Steps[Drawn]:
    """The source's map (n,d), deformed within the domain until the landmarks meet."""
    carrier = SphereCarrier() if pair.domain == SPHERE else DiskCarrier(pair.loop)
    start = carrier.place(aligned)
    if not len(pair.landmarks):
        return Drawn(start, np.zeros(0, bool), 0)
    targets = TargetCarrier(pair.target.vertices, pair.target.triangles, target_map).at(*pair.targets)
    flat = in_space(targets.domain)
    problem = _deformation(pair, start.positions, carrier)
    return (yield from draw_landmarks(problem, start, pair.landmarks, replace(targets, positions=flat)))


def _deformation(pair: _Pair, reference: np.ndarray, carrier) -> Deformation:
    """The energy of maps of shapes (n,3) to the carrier, no vertex held."""
    area = face_areas(reference, pair.triangles)
    faces = elements(reference, pair.triangles, np.maximum(area, 1e-12 * area.mean()))
    assembly = Assembly(pair.triangles, len(reference))
    return Deformation(faces, assembly, carrier, np.zeros(len(reference), bool), AREA_WEIGHT)


def _polished(
    pair: _Pair, drawn: Drawn, target_map: np.ndarray, polish: bool, features: float
) -> Steps[tuple[InPlace, int]]:
    """The map (n) to the target, of the least distortion that keeps the landmarks, and the steps taken."""
    carrier = TargetCarrier(pair.target.vertices, pair.target.triangles, target_map, pair.loop)
    placed = carrier.place(drawn.placed.domain)
    targets = carrier.at(*pair.targets)
    for part, place in zip(vars(placed).values(), vars(targets).values(), strict=True):
        part[pair.landmarks[drawn.met]] = place[drawn.met]
    if not polish:
        return placed, 0
    start = in_space(drawn.placed.domain)
    problem = replace(_deformation(pair, pair.vertices, carrier), within=_deformation(pair, start, carrier).faces)
    problem.held[pair.landmarks[drawn.met]] = True
    if features > 0:
        problem = replace(problem, features=_features(pair, features))
    placed, few = yield from part_of(coarse_polish(problem, pair.vertices, placed, pair.loop), 0.0, 0.3)
    polishing = minimise_on(problem, placed, POLISHING_STEPS, STRICT, "Polishing")
    placed, steps = yield from part_of(polishing, 0.3, 0.7)
    if not drawn.met.all():
        # What had no room in the domain may have it now.
        placed, _ = put_landmarks(problem, placed, pair.landmarks, targets)
        problem.held[pair.landmarks] = True
        placed, more = yield from minimise_on(problem, placed, AGAIN_STEPS, STRICT, "Polishing")
        steps += more
    return placed, few + steps


def _features(pair: _Pair, weight: float) -> Features:
    """Functions of both surfaces that the map is to keep."""
    values = descriptors(pair.vertices, pair.triangles)
    target = descriptors(pair.target.vertices, pair.target.triangles)
    area = vertex_areas(pair.vertices, pair.triangles)
    return Features(values[:, :-1], target[:, :-1], weight * area / area.sum())


def _registration(pair: _Pair, placed: InPlace, target_map: np.ndarray, steps: tuple[int, int], error: float):
    """What was found, in the numbers of the surfaces that were given."""
    back = np.empty(len(pair.order), np.int64)
    back[pair.order] = np.arange(len(pair.order))
    triangles = pair.triangles
    carrier = TargetCarrier(pair.target.vertices, pair.target.triangles, target_map)
    folded = carrier.folded(placed, triangles)
    area = face_areas(pair.vertices, triangles)
    own = back[: pair.source.own]
    forward = _on(pair.target, placed.faces[own], placed.barycentric[own])
    faces, weights = locate(placed.domain, triangles, target_map[: pair.target.own])
    weights = np.einsum("nc,ncd->nd", weights, pair.split.corners[faces])
    backward = _on(pair.source, pair.split.parent[faces], weights)
    target = carrier.at(*pair.targets).positions
    extent = float(np.ptp(pair.target.vertices, axis=0).max())
    residuals = np.linalg.norm(placed.positions[pair.landmarks] - target, axis=1) / extent
    warnings = []
    for surface, found, name in ((pair.target, forward, "source"), (pair.source, backward, "target")):
        if surface.holes and found.beside.any():
            warnings.append(f"{int(found.beside.sum())} vertices of the {name} fall into closed holes")
    return Registration(
        forward=forward,
        backward=backward,
        domain=pair.domain,
        source_domain=placed.domain[own],
        target_domain=target_map[: pair.target.own],
        flipped=float(area[folded].sum() / area.sum()),
        stretches=stretches(pair.vertices, placed.positions, triangles)[: pair.source.count],
        residuals=residuals,
        met=residuals <= MET,
        steps=steps,
        error=error,
        warnings=tuple(warnings),
    )


def _on(surface: FilledSurface, faces: np.ndarray, barycentric: np.ndarray) -> OnSurface:
    """Points (n,), (n,3) on the surface itself: those on fillings go to the nearest point of it."""
    beside = faces >= surface.count
    if beside.any():
        faces, barycentric = faces.copy(), barycentric.copy()
        triangles = surface.triangles[: surface.count]
        points = np.einsum("nc,ncd->nd", barycentric[beside], surface.vertices[surface.triangles[faces[beside]]])
        spacing = float(np.median(halfedge_lengths(surface.vertices, triangles)))
        normals = vertex_normals(surface.vertices, surface.triangles)[surface.triangles[faces[beside], 0]]
        found = ClosestPoint(surface.vertices, triangles, spacing)(points, normals)
        faces[beside], barycentric[beside] = found.faces, found.barycentric
    return OnSurface(faces, barycentric, beside)


def stretches(reference: np.ndarray, positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Singular values (m,2), the greater first, of the map of every triangle (m,3) from (n,3) to (n,3)."""
    p, q = reference[triangles], positions[triangles]
    first, second = p[:, 1:] - p[:, :1], q[:, 1:] - q[:, :1]
    before = np.einsum("mid,mjd->mij", first, first)
    after = np.einsum("mid,mjd->mij", second, second)
    # The metric of the image in an orthonormal frame of the reference, by its Cholesky factor.
    a = np.sqrt(np.maximum(before[:, 0, 0], 1e-300))
    b = before[:, 0, 1] / a
    c = np.sqrt(np.maximum(before[:, 1, 1] - b * b, 1e-18 * a * a))
    xx = after[:, 0, 0] / a**2
    xy = (after[:, 0, 1] - b * after[:, 0, 0] / a) / (a * c)
    yy = (after[:, 1, 1] - 2 * b * after[:, 0, 1] / a + b**2 * after[:, 0, 0] / a**2) / c**2
    mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return np.sqrt(np.maximum(np.column_stack([mean + half, mean - half]), 0))
