"""Maps between surfaces: bijective, landmarks met, the same both ways, and right where the truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from meshes import bumpy, cube, grid, hinge, icosphere, subdivide, torus
from sphere_shapes import blob, random_rotation

from omt_uv.solver.errors import (
    HandednessError,
    LandmarkError,
    OrientationError,
    SeveralComponentsError,
    TopologyMismatchError,
)
from omt_uv.solver.progress import drain
from omt_uv.solver.registration import RegistrationOptions, vertex_landmarks
from omt_uv.solver.registration import register as registering
from omt_uv.solver.registration.domains import domain_map, filled
from omt_uv.solver.registration.register import register
from omt_uv.solver.registration.results import stretches

TETRAHEDRON = (
    np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]),
    np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]),
)


def shape():
    """A lopsided body without symmetry, and vertices spread over it."""
    V, F = blob(3, seed=1)
    V = V * [1.0, 1.3, 0.8] + 0.15 * V[:, [1]] ** 2 * [1, 0, 0.5]
    chosen = np.unique([V[:, 0].argmax(), V[:, 0].argmin(), V[:, 1].argmax(), V[:, 1].argmin(), V[:, 2].argmax()])
    return V, F, chosen


def renumbered(V, F, seed=0):
    """The same surface with other numbers, and the new number of each vertex."""
    name = np.random.default_rng(seed).permutation(len(V))
    return V[np.argsort(name)], name[F], name


def match(source, target, pairs=None, **options):
    landmarks = None if pairs is None else vertex_landmarks((pairs[0], source[1]), (pairs[1], target[1]))
    return drain(register(source, target, landmarks, RegistrationOptions(**options)))


@pytest.mark.parametrize("with_landmarks", [True, False])
def test_a_body_is_matched_with_itself(with_landmarks):
    V, F, chosen = shape()
    W, G, name = renumbered(V, F)
    W = 3 * W @ random_rotation(2).T + [5, 0, 1]
    found = match((V, F), (W, G), (chosen, name[chosen]) if with_landmarks else None)
    there = found.forward.positions(W, G)
    assert np.linalg.norm(there - W[name], axis=1).max() < 0.02 * np.ptp(W, axis=0).max()
    assert found.flipped == 0 and found.met.all() and found.domain == "sphere"
    assert np.abs(found.stretches - 1).max() < 0.2


def test_there_and_back_again():
    V, F, chosen = shape()
    W = V * [1.2, 0.9, 1.0]
    W, G, name = renumbered(W, F)
    found = match((V, F), (W, G), (chosen, name[chosen]))
    back = found.backward.positions(V, F)
    again = np.einsum("nc,ncd->nd", found.forward.barycentric, back[G[found.forward.faces]])
    assert np.linalg.norm(again - V, axis=1).mean() < 0.02
    assert found.residuals.max() < 1e-6 and found.flipped == 0
    assert len(found.residuals) == len(found.met) == len(chosen)


def test_maps_that_are_known_are_taken():
    V, F, chosen = shape()
    W, G, name = renumbered(V * [1.2, 0.9, 1.0], F)
    landmarks = vertex_landmarks((chosen, F), (name[chosen], G))
    # One within a triangle, which is no vertex of the map.
    landmarks.source_barycentric[0] = landmarks.target_barycentric[0] = np.array([0.5, 0.3, 0.2])
    maps = tuple(drain(domain_map(filled(each, "sphere", ""), "sphere", 0.5)) for each in ((V, F), (W, G)))
    found = drain(register((V, F), (W, G), landmarks, maps=maps))
    fresh = drain(register((V, F), (W, G), landmarks))
    assert found.flipped == 0 and found.met.all()
    away = found.forward.positions(W, G) - fresh.forward.positions(W, G)
    assert np.linalg.norm(away, axis=1).max() < 0.01
    assert np.allclose(found.target_domain, maps[1])
    mirrored = drain(register((V * [-1, 1, 1], F[:, [0, 2, 1]]), (V, F), None, RegistrationOptions(mirrored=True),
                              (maps[0] * [-1, 1, 1], maps[0])))  # fmt: skip
    assert np.linalg.norm(mirrored.forward.positions(V, F) - V, axis=1).max() < 0.02
    with pytest.raises(ValueError, match="3 rows"):
        drain(register((V, F), (W, G), maps=(maps[0][:3], None)))


def test_landmarks_far_from_where_they_would_go_are_met():
    V, F, chosen = shape()
    moved = np.array([F[np.flatnonzero((v == F).any(axis=1))[0]][F[np.flatnonzero((v == F).any(axis=1))[0]] != v][0]
                      for v in chosen])  # fmt: skip
    found = match((V, F), (V, F), (chosen, moved))
    there = found.forward.positions(V, F)
    assert np.abs(there[chosen] - V[moved]).max() < 1e-9 and found.flipped == 0


def test_a_landmark_within_a_triangle_is_met_there():
    V, F, chosen = shape()
    landmarks = vertex_landmarks((chosen, F), (chosen, F))
    inside = np.array([0.5, 0.3, 0.2])
    landmarks.source_barycentric[0] = landmarks.target_barycentric[0] = inside
    found = drain(register((V, F), (V, F), landmarks))
    assert found.met.all() and len(found.forward.faces) == len(V) and found.backward.faces.max() < len(F)


def test_a_mirror_image_is_matched_mirrored():
    V, F, chosen = shape()
    W, G = V * [-1, 1, 1], F[:, [0, 2, 1]]
    found = match((V, F), (W, G), (chosen, chosen), mirrored=True)
    assert np.linalg.norm(found.forward.positions(W, G) - W, axis=1).max() < 0.02
    back = found.backward.positions(V, F)
    assert np.linalg.norm(back - V, axis=1).max() < 0.02
    with pytest.raises(HandednessError, match="The landmarks of the source are a mirror image"):
        match((V, F), (W, G), (chosen, chosen))


def test_open_surfaces_meet_in_the_disk():
    V, F = bumpy(14, 14)
    V = V + 0.2 * np.sin(3 * V[:, [1]]) * [0, 0, 1]
    chosen = np.array([20, 60, 110, 150])
    found = match((V, F), (V, F), (chosen, chosen))
    assert found.domain == "disk" and found.flipped == 0 and found.met.all()
    assert np.linalg.norm(found.forward.positions(V, F) - V, axis=1).mean() < 0.02


def test_a_hole_is_closed_for_the_sphere():
    V, F, chosen = shape()
    hole = np.flatnonzero((F == 3).any(axis=1))
    W, G = V, np.delete(F, hole, axis=0)
    used = np.unique(G)
    name = np.full(len(V), -1)
    name[used] = np.arange(len(used))
    W, G = W[used], name[G]
    found = match((W, G), (V, F), (name[chosen], chosen))
    assert found.domain == "sphere" and found.flipped == 0
    back = match((V, F), (W, G), (chosen, name[chosen]))
    assert back.forward.faces.max() < len(G) and back.forward.beside[3] and "closed holes" in back.warnings[0]


def test_stretches_are_singular_values():
    V, F = icosphere(1)
    found = stretches(V, 2 * V @ random_rotation(1).T, F)
    assert np.allclose(found, 2)
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert np.allclose(stretches(flat, flat * [3, 0.5, 1], np.array([[0, 1, 2]])), [[3, 0.5]])


def test_bad_input_is_named():
    V, F, chosen = shape()
    disk = bumpy(6, 6)
    with pytest.raises(TopologyMismatchError, match="handle"):
        match((V, F), torus())
    with pytest.raises(TopologyMismatchError, match="closed"):
        match((V, F), disk, domain="disk")
    with pytest.raises(SeveralComponentsError, match="2 parts"):
        match((np.concatenate([V, V + 5]), np.concatenate([F, F + len(V)])), (V, F))
    with pytest.raises(OrientationError, match="Neighbouring faces of the source have opposite"):
        match((V, np.concatenate([F[:5, ::-1], F[5:]])), (V, F))
    with pytest.raises(LandmarkError, match="2 landmarks on the source and 1"):
        match((V, F), (V, F), (chosen[:2], chosen[:1]))
    with pytest.raises(LandmarkError, match="same point of the target"):
        match((V, F), (V, F), (chosen[:2], chosen[[0, 0]]))
    with pytest.raises(ValueError, match="domain"):
        RegistrationOptions(domain="torus")


def test_how_far_landmarks_are_off_is_a_share_of_the_target_however_long_the_source_is(monkeypatch):
    V, F, chosen = shape()
    W, G, name = renumbered(V * [2.0, 0.9, 1.0], F)
    polished = registering._polished

    def shifted(case, *rest):
        placed, steps = yield from polished(case, *rest)
        moved = placed.positions.copy()
        extent = np.ptp(case.pair.target.vertices, axis=0).max()
        moved[case.pair.landmarks] = case.targets.positions + [1e-3 * extent, 0, 0]
        return replace(placed, positions=moved), steps

    monkeypatch.setattr(registering, "_polished", shifted)
    found = match((V, F), (W, G), (chosen, name[chosen]))
    np.testing.assert_allclose(found.residuals, 1e-3, rtol=1e-6)


@pytest.mark.parametrize(
    "source, target",
    [(icosphere(2), grid(6, 6)), (subdivide(*cube()), TETRAHEDRON), (blob(3, seed=1), hinge())],
    ids=["square", "tetrahedron", "hinge"],
)
def test_what_corresponds_to_few_places_or_to_straight_edges_is_matched(source, target):
    # Functional maps of bodies without a shape of their own may put all vertices in a few places, and faces whose
    # corners lie along an edge have no area.
    (V, F), (W, G) = source, target
    with np.errstate(divide="raise", invalid="raise", over="raise"):
        found = match((np.asarray(V, float), F), (W, G))
    assert found.flipped == 0
    assert all(np.isfinite(x).all() for x in (found.stretches, found.forward.positions(W, G)))
