"""Pairs say the truth: offsets lead from points of the mesh to points of the surface, and weights are one a vertex."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.remeshing.fitting.closest_pairs import DENSE, DENSER, PLACES, Pairing
from omt_uv.solver.remeshing.relaxation.surface_samples import area_samples


@pytest.fixture
def setting():
    V, F = meshes.icosphere(4)
    index = ClosestPoint(V, F, 0.2)
    P, Q = meshes.icosphere(2)
    pairing = Pairing(index, area_samples(index, 6 * len(P), np.ones(len(F))))
    return index, pairing, P, Q, pairing(P, Q, index(P, vertex_normals(P, Q)).points)


def test_offsets_lead_to_the_surface(setting):
    index, pairing, P, Q, pairs = setting
    places = np.einsum("kc,kcj->kj", pairs.barycentric, P[Q[pairs.faces]])
    ends = places + pairs.offset
    np.testing.assert_allclose(ends[: pairs.sample_count], pairing.samples.points, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(pairs.offset, axis=1), pairs.distance)
    assert np.abs(np.linalg.norm(ends, axis=1) - 1).max() < 0.005
    # The chords of a sphere's edges are about this far from it.
    assert 0.5 < pairs.distance.max() / (1 - np.linalg.norm(P[Q].mean(axis=1), axis=1).min()) < 1.5


def test_weights_are_one_a_vertex(setting):
    index, pairing, P, Q, pairs = setting
    assert pairs.weight.sum() == pytest.approx(len(P))
    assert pairs.weight[: pairs.sample_count].sum() == pytest.approx(len(P) / 2)
    assert len(pairs.faces) == pairs.sample_count + pairs.place_count + len(P)
    assert pairs.place_count == len(PLACES) * len(Q)


def test_the_largest_distance_of_every_face_is_that_of_its_pairs(setting):
    *_, Q, pairs = setting
    largest = pairs.largest_distance(len(Q))
    for face in (0, 7, 100):
        assert largest[face] == pairs.distance[pairs.faces == face].max()
    assert pairs.rms == pytest.approx(np.sqrt(np.average(pairs.distance**2, weights=pairs.weight)))


def test_rows_name_the_pairs_of_faces_and_vertices(setting):
    *_, P, Q, pairs = setting
    faces, vertices = np.array([3, 50]), np.array([0, 9])
    rows = pairs.rows(np.array([2]), faces, vertices, len(Q))
    assert rows[0] == 2 and set(pairs.faces[rows[1:-2]]) == {3, 50} and len(rows) == 1 + 2 * len(PLACES) + 2
    on = P[vertices] + pairs.offset[rows[-2:]]
    assert np.abs(np.linalg.norm(on, axis=1) - 1).max() < 0.005


@pytest.mark.parametrize("places", [PLACES, DENSE, DENSER])
def test_other_places_of_a_triangle_begin_at_what_is_closest_to_the_nearest_of_those_there_are(setting, places):
    """Triangle by triangle, and place by place within."""
    _, pairing, _, Q, _ = setting
    known = pairing.surface_faces.reshape(len(Q), -1)
    found = pairing.surface_faces_for(places).reshape(len(Q), len(places))
    for k, place in enumerate(places):
        nearest = min(range(len(PLACES)), key=lambda r, at=place: np.linalg.norm(PLACES[r] - at))
        np.testing.assert_array_equal(found[:, k], known[:, nearest])


def test_places_are_inside_of_their_triangle():
    for places in (PLACES, DENSE, DENSER):
        np.testing.assert_allclose(places.sum(axis=1), 1)
        assert places.min() > 0 and len(np.unique(np.round(places, 9), axis=0)) == len(places)
