"""Match two surfaces: a bijective map from one onto the other that meets landmarks and distorts little.

Both are mapped to a common domain with areas kept, one domain is turned onto the other, and deformed within the domain
until the landmarks meet (Su 2015, section 4.3, with a barrier energy instead of a harmonic map, which can fold where
landmarks are hard). The map between the domains is one between the surfaces, and is polished there: its own distortion
from surface to surface is minimised, landmarks held, and no step folds it in the domain.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import plural
from ..mesh.closest_point import ClosestPoint
from ..mesh.geometry import face_areas, halfedge_lengths, vertex_areas, vertex_normals
from ..mesh.point_location import locate
from ..mesh.spherical_geometry import normalized
from ..progress import Progress, Steps, part_of
from .alignment import moebius_of_pairs, rotation_by_search, rotation_of_pairs, turn_by_search
from .carriers import InPlace, TargetCarrier
from .coarse_start import coarse_start
from .domains import CHARTS, SPHERE, Case, FilledSurface, Pair, checked, domain_map, prepared
from .gathering import gathered
from .landmark_flow import Drawn, put_landmarks
from .landmarks import Landmarks, check_handedness, no_landmarks, reflected
from .results import MET, OnSurface, Registration, RegistrationOptions, stretches, with_missed
from .surface_newton import STRICT, Features, deformation, minimise_on

# Newton steps of the polish at most.
POLISHING_STEPS = 60
# And after landmarks that had no room were put into their places.
AGAIN_STEPS = 10
# Where the time goes, roughly, as start and width.
SOURCE_MAP = (0.0, 0.25)
TARGET_MAP = (0.25, 0.25)
STARTING = (0.5, 0.25)
POLISHING = (0.75, 0.2)
GATHERING = (0.95, 0.05)


def register(
    source: tuple[np.ndarray, np.ndarray],
    target: tuple[np.ndarray, np.ndarray],
    landmarks: Landmarks | None = None,
    options: RegistrationOptions | None = None,
    maps: tuple[np.ndarray | None, np.ndarray | None] = (None, None),
) -> Steps[Registration]:
    """Match a source, vertices (n,3) and triangles (m,3), with a target (k,3), (l,3).

    Parameters
    ----------
    landmarks : pairs of points that are to meet; without any, the rotation of the domains is searched for
    options : see `RegistrationOptions`
    maps : of the source (n,d) and of the target (k,d) to the domain, where they are known, as `domains.domain_map`
        makes them of `domains.filled` surfaces: what is matched with many is mapped once

    Raises
    ------
    ValueError : a map has not as many rows as its surface has vertices
    MeshError : what is no manifold surface of one part; TopologyMismatchError: handles, or one closed and one open in
        a disk; LandmarkError: landmarks that coincide, are mirrored, or, if strict, cannot be met

    References
    ----------
    Su 2015, section 4.3; Degener, Meseth, Klein 2003 (energy); Smith, Schaefer 2015 (barrier); Kabsch 1976.
    """
    options, landmarks = options or RegistrationOptions(), landmarks or no_landmarks()
    if options.domain == CHARTS:
        raise ValueError("charts have a match of their own: registration.charts.register_charts")
    yield Progress("Checking", 0.0)
    (vertices, triangles), (others, other_triangles) = _as_arrays(*source), _as_arrays(*target)
    checked(vertices, triangles, "source")
    checked(others, other_triangles, "target")
    if options.mirrored:
        vertices, triangles, landmarks = reflected(vertices, triangles, landmarks)
    pair = prepared((vertices, triangles), (others, other_triangles), landmarks, options.domain)
    source_map, target_map = yield from _domain_maps(pair, landmarks, options, maps)
    aligned, error = _aligned(pair, source_map[pair.order], target_map, landmarks)
    carrier = TargetCarrier(pair.target.vertices, pair.target.triangles, target_map, pair.loop)
    case = Case(pair, aligned, carrier, _features(pair, options.features))
    drawn = yield from part_of(coarse_start(case), *STARTING)
    placed, steps = yield from part_of(_polished(case, drawn, options.polish), *POLISHING)
    if options.closeness is not None:
        placed = yield from part_of(gathered(case, placed, options.closeness), *GATHERING)
    found = _registration(case, placed, (drawn.steps, steps), error)
    if options.mirrored:
        backward = found.backward
        found = replace(found, backward=replace(backward, barycentric=backward.barycentric[:, [0, 2, 1]]))
    return with_missed(found, landmarks, options.strict)


def _domain_maps(pair: Pair, landmarks: Landmarks, options: RegistrationOptions, known) -> Steps:
    """The maps of both to the domain, (n,d) with landmarks as vertices and (k,d); those that are known as they are."""
    sides = (pair.source, pair.target)
    for places, surface, name in zip(known, sides, ("source", "target"), strict=True):
        if places is not None and len(places) != len(surface.vertices):
            raise ValueError(f"the map of the {name} has {len(places)} rows, and its surface {len(surface.vertices)}")
    if known[0] is None:
        first = replace(pair.source, vertices=pair.split.vertices, triangles=pair.split.triangles)
        source_map = yield from part_of(domain_map(first, pair.domain, options.balance), *SOURCE_MAP)
    else:
        places = known[0] * ([-1] + [1] * (known[0].shape[1] - 1) if options.mirrored else 1)
        new = pair.split.landmarks >= len(places)
        corners = pair.source.triangles[landmarks.source_faces[new]]
        added = np.zeros((len(pair.split.vertices) - len(places), places.shape[1]))
        inside = np.einsum("kc,kcd->kd", landmarks.source_barycentric[new], places[corners])
        added[pair.split.landmarks[new] - len(places)] = normalized(inside) if pair.domain == SPHERE else inside
        source_map = np.concatenate([places, added])
    target_map = known[1]
    if target_map is None:
        target_map = yield from part_of(domain_map(pair.target, pair.domain, options.balance), *TARGET_MAP)
    return source_map, target_map


def _as_arrays(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(vertices, float), np.asarray(triangles, np.int64)


def _aligned(pair: Pair, source_map: np.ndarray, target_map: np.ndarray, landmarks: Landmarks):
    """The source's map (n,d), turned onto that of the target, and how far landmarks or functions are apart there."""
    corners = pair.target.triangles[pair.targets[0]]
    places = np.einsum("kc,kcd->kd", pair.targets[1], target_map[corners])
    points = source_map[pair.landmarks]
    if pair.domain == SPHERE:
        places = places / np.maximum(np.linalg.norm(places, axis=1, keepdims=True), 1e-300)
        check_handedness(landmarks, points, places)
        if len(points) >= 2:
            found = rotation_of_pairs(points, places)
        else:
            found = rotation_by_search((source_map, pair.described[0]), (target_map, pair.described[1]))
        return source_map @ found.rotation.T, found.error
    if len(points):
        moebius = moebius_of_pairs(points @ [1, 1j], places @ [1, 1j])
    else:
        moebius = turn_by_search((source_map, pair.described[0]), (target_map, pair.described[1]))
    moved = moebius(source_map @ [1, 1j])
    return np.column_stack([moved.real, moved.imag]), 0.0


def _polished(case: Case, drawn: Drawn, polish: bool) -> Steps[tuple[InPlace, int]]:
    """The map (n) to the target, of the least distortion that keeps the landmarks, and the steps taken."""
    pair, carrier = case.pair, case.carrier
    placed = carrier.place(drawn.placed.domain)
    placed.put(pair.landmarks[drawn.met], case.targets, drawn.met)
    if not polish:
        return placed, 0
    problem = deformation(pair.vertices, pair.triangles, carrier, case.features, drawn.placed.domain)
    problem.held[pair.landmarks[drawn.met]] = True
    placed, steps = yield from part_of(minimise_on(problem, placed, POLISHING_STEPS, STRICT, "Polishing"), 0.0, 0.9)
    if not drawn.met.all():
        # What had no room in the domain may have it now.
        placed, _ = put_landmarks(problem, placed, pair.landmarks, case.targets)
        problem.held[pair.landmarks] = True
        placed, more = yield from minimise_on(problem, placed, AGAIN_STEPS, STRICT, "Polishing")
        steps += more
    return placed, steps


def _features(pair: Pair, weight: float) -> Features | None:
    """Functions of both surfaces that the map is to keep."""
    if weight <= 0:
        return None
    values, target = pair.described
    area = vertex_areas(pair.vertices, pair.triangles)
    return Features(values[:, :-1], target[:, :-1], weight * area / area.sum())


def _registration(case: Case, placed: InPlace, steps: tuple[int, int], error: float) -> Registration:
    """What was found, in the numbers of the surfaces that were given."""
    pair, target_map = case.pair, case.carrier.domain
    back = np.empty(len(pair.order), np.int64)
    back[pair.order] = np.arange(len(pair.order))
    triangles = pair.triangles
    folded = case.carrier.folded(placed, triangles)
    area = face_areas(pair.vertices, triangles)
    own = back[: pair.source.own]
    forward = _on(pair.target, placed.faces[own], placed.barycentric[own])
    faces, weights = locate(placed.domain, triangles, target_map[: pair.target.own])
    weights = np.einsum("nc,ncd->nd", weights, pair.split.corners[faces])
    backward = _on(pair.source, pair.split.parent[faces], weights)
    target = case.targets.positions
    extent = float(np.ptp(pair.target.vertices, axis=0).max())
    residuals = np.linalg.norm(placed.positions[pair.landmarks] - target, axis=1) / extent
    warnings = []
    for surface, found, name in ((pair.target, forward, "source"), (pair.source, backward, "target")):
        if surface.holes and found.beside.any():
            who = plural(int(found.beside.sum()), f"A vertex of the {name} falls", f"{{}} vertices of the {name} fall")
            warnings.append(f"{who} into closed holes")
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
