"""Find a map of few vertices, well begun: from landmarks that flow to their places, and from functional maps.

A flow goes the short way, which around a limb may be the wrong way round, and then no descent leads out of it.
Functional maps know no ways, but fold: what they find guides maps without folds, from the flow and from what
untangles it in the domain (`sphere.untangle`). All are polished on the coarse mesh, and the one that distorts less is
carried to all vertices.

Maps of two surfaces to the sphere may differ by more than a rotation, though one is the other bent: another start has
the sphere bent before, by a smooth flow that follows functional maps. Of both, the better one is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.geometry import face_areas, vertex_areas
from ..mesh.spherical_geometry import signed_volumes
from ..progress import Progress, Steps, part_of
from .carriers import InPlace
from .coarse_meshes import FewVertices, coarse_mesh, far_vertices, on_coarse, straightened
from .domains import SPHERE, Case
from .functional_maps import refined_correspondence
from .landmark_flow import Drawn, draw_landmarks, follow_points, put_landmarks
from .surface_newton import STRICT, Deformation, Features, deformation, in_space, minimise_on, without_folds

# Vertices of the coarse mesh, and Newton steps on it.
COARSE = 500
COARSE_STEPS = 60
TOLERANCE = 1e-3
# Vertices whose correspondence functional maps find.
SAMPLES = 1000
# Energy, on surfaces of area 1, below which nothing else is tried.
GOOD_ENERGY = 0.04
# Distortion of all faces below which the sphere is not bent.
GOOD_DISTORTION = 0.02
# Rounds of functional maps, and steps that relax what was untangled.
ROUNDS = 2
RELAXING_STEPS = 5
# Guides: their weight, Newton steps, and distances, on surfaces of area 1, beyond which they pull little: from far away
# one after the other, and from near.
GUIDE_WEIGHT = 30.0
GUIDED_STEPS = 30
FAR = (0.3, 0.1, 0.05)
NEAR = (0.1,)
# Energy over area of a face that counts half: a few faces that are stuck say little about a map.
SATURATION = 0.5


@dataclass(frozen=True)
class _Trial:
    """A polished map of the coarse mesh: its places, the landmarks (l,) bool that are met, its energy, the distortion
    by which it is compared, its steps."""

    placed: InPlace
    met: np.ndarray
    energy: float
    distortion: float
    steps: int


def coarse_start(case: Case) -> Steps[Drawn]:
    """Where all vertices lie in the domain to begin with, without folds, and which landmarks are met there."""
    if case.pair.domain != SPHERE:
        return (yield from _begun(case, _few(case)))
    mesh = _few(case)
    drawn = yield from part_of(_begun(case, mesh), 0.0, 0.4)
    if _distortion(case, drawn) < GOOD_DISTORTION and drawn.met.all():
        return drawn
    samples, places = yield from part_of(_sampled(case, mesh, mesh.domain), 0.4, 0.1)
    few = len(mesh.chosen)
    bent = yield from part_of(_bent(case, samples[:few], places[:few]), 0.5, 0.1)
    other = yield from part_of(_begun(bent, _few(bent)), 0.6, 0.4)
    guide = case.carrier.place(places).positions

    def rank(found: Drawn) -> tuple[int, float]:
        """How good a map is: landmarks that are not met; what it distorts, and how far it is from functional maps."""
        there = case.carrier.place(found.placed.domain[samples]).positions
        off = float(np.linalg.norm(there - guide, axis=1).mean())
        return int((~found.met).sum()), _distortion(case, found) * off

    return replace(min((drawn, other), key=rank), steps=drawn.steps + other.steps)


def _few(case: Case) -> FewVertices:
    """The coarse mesh of a case, or the mesh itself where it is small."""
    pair = case.pair
    mesh = _whole(case)
    if len(pair.vertices) >= 2 * COARSE:
        mesh = coarse_mesh(pair.vertices, case.aligned, pair.landmarks, pair.loop, COARSE) or mesh
    return mesh


def _begun(case: Case, mesh: FewVertices) -> Steps[Drawn]:
    """What the coarse mesh finds, carried to all vertices, and which landmarks are met."""
    flow = yield from part_of(_flowed(case, mesh), 0.0, 0.2)
    best = yield from part_of(_polished(case, mesh, flow.placed.domain, flow.met), 0.2, 0.2)
    if case.pair.domain == SPHERE:
        best = yield from part_of(_improved(case, mesh, flow, best), 0.4, 0.4)
    moved = mesh.carried(best.placed.domain, case.aligned)
    return (yield from _finished(case, moved, best.met, flow.steps + best.steps))


def _bent(case: Case, samples: np.ndarray, places: np.ndarray) -> Steps[Case]:
    """The case with the source's map to the sphere bent, without folds, towards places (s,3) of vertices (s,)."""
    moved = yield from part_of(follow_points(case.aligned, samples, places), 0.0, 0.8)
    placed = yield from part_of(_unfolded(case, moved, np.zeros(len(moved), bool)), 0.8, 0.2)
    return replace(case, aligned=placed.domain)


def _improved(case: Case, mesh: FewVertices, flow: Drawn, best: _Trial) -> Steps[_Trial]:
    """The best of a map that a flow began and of those that functional maps guide, again as long as that helps."""
    for k in range(ROUNDS):
        if best.energy < GOOD_ENERGY and best.met.all():
            return best
        places = yield from part_of(_corresponding(case, mesh, best.placed.domain), k / ROUNDS, 0.3 / ROUNDS)
        guide = case.carrier.place(places).positions
        starts: list[tuple[np.ndarray, np.ndarray, tuple[float, ...]]] = [(flow.placed.domain, flow.met, FAR)]
        held = np.zeros(len(places), bool)
        held[mesh.landmarks] = True
        straight = yield from straightened(mesh.domain, mesh.triangles, places, held)
        if (signed_volumes(straight, mesh.triangles) > 0).all():
            relaxed = yield from _relaxed(case, mesh, straight)
            starts += [(start, np.ones(len(best.met), bool), NEAR) for start in (straight, relaxed)]
        tried = [best]
        for start, met, widths in starts:
            guided = yield from _guided(case, mesh, (start, met), guide, widths)
            found = yield from _polished(case, mesh, guided, met)
            tried.append(replace(found, steps=found.steps + best.steps))
        before, best = best, min(tried, key=lambda trial: (int((~trial.met).sum()), trial.distortion))
        if best is before:
            return best
    return best


def _guided(case: Case, mesh: FewVertices, begun: tuple, guide: np.ndarray, widths) -> Steps[np.ndarray]:
    """Places (k,d) that are drawn towards points of the target (k,3), as far as nothing folds.

    begun : places (k,d) to start from, and which landmarks (l,) bool are met there
    """
    domain, met = begun
    reference = case.pair.vertices[mesh.chosen]
    area = vertex_areas(reference, mesh.triangles)
    share = GUIDE_WEIGHT * area / area.sum()
    carrier = case.carrier.sliding(mesh.loop)
    for width in widths:
        features = Features(guide / width, case.pair.target.vertices / width, share)
        problem = deformation(reference, mesh.triangles, carrier, features, domain)
        placed = carrier.place(domain)
        placed.put(mesh.landmarks[met], case.targets, met)
        problem.held[mesh.landmarks[met]] = True
        placed, _ = yield from minimise_on(problem, placed, GUIDED_STEPS, TOLERANCE, "Polishing")
        domain = placed.domain
    return domain


def _relaxed(case: Case, mesh: FewVertices, places: np.ndarray) -> Steps[np.ndarray]:
    """Places (k,d) after a few Newton steps within the domain: what was only just straightened would be stuck."""
    carrier = case.domain_carrier(mesh.loop)
    problem = deformation(in_space(mesh.domain), mesh.triangles, carrier)
    problem.held[mesh.landmarks] = True
    placed, _ = yield from minimise_on(problem, carrier.place(places), RELAXING_STEPS, STRICT, "Polishing")
    return placed.domain


def _whole(case: Case) -> FewVertices:
    """All vertices, as they are."""
    pair = case.pair
    return FewVertices(np.arange(len(pair.vertices)), pair.triangles, case.aligned, pair.landmarks, pair.loop)


def _flowed(case: Case, mesh: FewVertices) -> Steps[Drawn]:
    """The coarse mesh in the domain, with its landmarks drawn to their places."""
    carrier = case.domain_carrier(mesh.loop)
    start = carrier.place(mesh.domain)
    if not len(mesh.landmarks):
        return Drawn(start, np.zeros(0, bool), 0)
    problem = deformation(start.positions, mesh.triangles, carrier)
    return (yield from draw_landmarks(problem, start, mesh.landmarks, case.flat_targets()))


def _polished(case: Case, mesh: FewVertices, domain: np.ndarray, met: np.ndarray) -> Steps[_Trial]:
    """The coarse mesh from places in the domain (k,d), of least distortion on the target."""
    reference = case.pair.vertices[mesh.chosen]
    carrier = case.carrier.sliding(mesh.loop)
    features = on_coarse(case.features, mesh, reference)
    problem = deformation(reference, mesh.triangles, carrier, features, domain)
    placed = carrier.place(domain)
    placed.put(mesh.landmarks[met], case.targets, met)
    problem.held[mesh.landmarks[met]] = True
    placed, steps = yield from minimise_on(problem, placed, COARSE_STEPS, TOLERANCE, "Polishing")
    if not met.all():
        placed, met = put_landmarks(problem, placed, mesh.landmarks, case.targets)
    distortion = _saturated(problem.energies(placed), face_areas(reference, mesh.triangles))
    return _Trial(placed, met, replace(problem, within=None).energy(placed), distortion, steps)


def _saturated(each: np.ndarray, area: np.ndarray) -> float:
    """The sum of energies of faces (m,), none of which counts more than its area (m,) allows."""
    half, has_area = SATURATION * area, np.isfinite(each)
    return float((each[has_area] / (1 + each[has_area] / half[has_area])).sum() + half[~has_area].sum())


def _distortion(case: Case, drawn: Drawn) -> float:
    """That of the map which places of all vertices in the domain make of the surfaces."""
    pair = case.pair
    problem = deformation(pair.vertices, pair.triangles, case.carrier)
    placed = case.carrier.place(drawn.placed.domain)
    return _saturated(problem.energies(placed), face_areas(pair.vertices, pair.triangles))


def _corresponding(case: Case, mesh: FewVertices, start: np.ndarray) -> Steps[np.ndarray]:
    """Places (k,3) of the coarse mesh on the sphere where functional maps have them, from a start; they may fold."""
    _, places = yield from _sampled(case, mesh, start)
    # The coarse mesh's vertices are the first of the samples, sorted.
    places = places[np.argsort(np.argsort(mesh.chosen))]
    places[mesh.landmarks] = case.targets.domain
    return places


def _sampled(case: Case, mesh: FewVertices, start: np.ndarray) -> Steps[tuple[np.ndarray, np.ndarray]]:
    """Vertices (s,), those of the coarse mesh and more, and places (s,3) on the sphere that functional maps find."""
    yield Progress("Functional maps", 0.0)
    pair, target = case.pair, case.pair.target
    samples = far_vertices(pair.vertices, mesh.chosen, np.zeros(0, np.int64), SAMPLES)
    source, other = pair.spectra
    yield Progress("Functional maps", 0.6)
    corners = target.triangles[pair.targets[0]]
    landmarks = (source[pair.landmarks], np.einsum("kc,kcf->kf", pair.targets[1], other[corners]))
    near = cKDTree(case.carrier.domain).query(mesh.carried(start, case.aligned[samples]))[1]
    return samples, case.carrier.domain[refined_correspondence(source[samples], other, near, landmarks)]


def _finished(case: Case, moved: np.ndarray, met: np.ndarray, steps: int) -> Steps[Drawn]:
    """All vertices at places (n,d) in the domain, straightened; landmarks that are not there drawn to theirs."""
    pair = case.pair
    held = np.zeros(len(moved), bool)
    held[pair.landmarks] = True
    placed = yield from part_of(_unfolded(case, moved, held), 0.8, 0.1)
    problem = _within(case)
    if not len(pair.landmarks):
        return Drawn(placed, met, steps)
    targets = case.flat_targets()
    placed, met = put_landmarks(problem, placed, pair.landmarks, targets)
    if met.all():
        return Drawn(placed, met, steps)
    drawn = yield from part_of(draw_landmarks(problem, placed, pair.landmarks, targets), 0.9, 0.1)
    return replace(drawn, steps=drawn.steps + steps)


def _within(case: Case) -> Deformation:
    """How the aligned mesh is deformed within the domain."""
    carrier = case.domain_carrier(case.pair.loop)
    return deformation(carrier.place(case.aligned).positions, case.pair.triangles, carrier)


def _unfolded(case: Case, moved: np.ndarray, held: np.ndarray) -> Steps[InPlace]:
    """Places (n,d) in the domain without the folds, straightened, or else where they were; held (n,) bool stay."""
    moved = yield from straightened(case.aligned, case.pair.triangles, moved, held)
    carrier = case.domain_carrier(case.pair.loop)
    return without_folds(_within(case), carrier.place(case.aligned), carrier.place(moved))
