"""What lower functions of the solver find on a mesh is what they find on the same mesh told in another way.

As `api/test_invariance.py` for maps, and `api/test_invariant_figures.py` for scores. Each function stands with what it
finds numbers of, and the power of the size by which these grow.
"""

from __future__ import annotations

import functools
from itertools import product

import numpy as np
import pytest
from told_otherwise import WAYS, body, patch

from omt_uv.solver.analysis.density import graded_density
from omt_uv.solver.analysis.feature_edges import sharp_edges
from omt_uv.solver.analysis.vertex_scores import distance
from omt_uv.solver.conformal.boundary_first import boundary_first
from omt_uv.solver.conformal.disk_map import boundary_turns, sharpest_corners
from omt_uv.solver.contact.proximity import close_pairs, triangle_distances
from omt_uv.solver.contact.self_intersections import intersecting_pairs
from omt_uv.solver.flows.enclosed_volume import component_volumes, corner_volumes
from omt_uv.solver.maps.development import developed
from omt_uv.solver.maps.distortion import face_distortion
from omt_uv.solver.maps.energy import elements, energies, energy, gradient
from omt_uv.solver.maps.tutte import tutte
from omt_uv.solver.maps.untangle import arc_length_boundary, map_energy
from omt_uv.solver.mesh.closest_point import spread_points
from omt_uv.solver.mesh.geometry import cotangent_laplacian, face_areas, hat_gradients, least_angles
from omt_uv.solver.mesh.polygon_areas import polygon_areas
from omt_uv.solver.mesh.topology import boundary_loops, vertices_around
from omt_uv.solver.quads.diagonals import longer_diagonals, shorter_diagonals
from omt_uv.solver.refinement.initial_maps import inner_curvature, least_squares_conformal
from omt_uv.solver.registration.functional_maps import descriptors
from omt_uv.solver.registration.results import stretches
from omt_uv.solver.sphere.conformal import magnified_vertices


def disk():
    """The patch, its quads cut along one diagonal."""
    V, F = patch()
    return V, np.concatenate([F[:, [0, 1, 2]], F[:, [0, 2, 3]]])


def crossed():
    """The body, and another one that sticks through it."""
    V, F = body()
    return np.concatenate([V, 0.6 * V[:, [1, 2, 0]] + [0.9, 0.3, 0.2]]), np.concatenate([F, F + len(V)])


def size(V, F):
    return np.sqrt(face_areas(V, F).sum())


def far(V, F):
    """Distances (n,) of vertices from the middle of the mesh."""
    return np.linalg.norm(V - V[F].mean((0, 1)), axis=1)


def loop(F):
    return boundary_loops(F)[0]


def flat(V, F):
    """A sheared map (n,2) of the disk, that hangs on lengths alone."""
    return tutte(V, F, loop(F), arc_length_boundary(V, loop(F), 1.0))


def about_middle(V, F):
    """The lowest and the highest vertex by their distance from the middle."""
    d = far(V, F)
    return np.array([d.argmin(), d.argmax()])


def as_elements(V, F):
    return elements(V, F, face_areas(V, F) * (1 + far(V, F)[F].mean(axis=1) / size(V, F)))


def slopes(V, F):
    """How long the slope of the energy is at every vertex, whichever way the map is turned."""
    return np.abs(gradient(as_elements(V, F), size(V, F) * flat(V, F) @ [1, 1j], 10.0))


def at(V, rows):
    """Numbers (n,) that are 1 for some vertices."""
    found = np.zeros(len(V))
    found[rows] = 1
    return found


def of_pairs(pairs, count):
    """How many pairs (k,2) each of so many elements is in."""
    return np.bincount(pairs.ravel(), minlength=count).astype(float)


def close_ones(V, F):
    """How many pairs of a vertex and a triangle, and of edges, are closer than a fiftieth of the size."""
    reach = 0.02 * size(V, F)
    found = close_pairs(V, F, reach)
    near = np.linalg.norm(found.offsets(V)[0], axis=1) < reach
    return [near[: found.points].sum(), near[found.points :].sum()]


VERTICES = {
    "laplacian of distances": (disk, lambda V, F: cotangent_laplacian(V, F) @ far(V, F), 1),
    "laplacian of a body": (body, lambda V, F: cotangent_laplacian(V, F) @ far(V, F), 1),
    "distance from two": (body, lambda V, F: distance(V, F, about_middle(V, F)), 1),
    "distance in a disk": (disk, lambda V, F: distance(V, F, about_middle(V, F)[1:]), 1),
    "descriptors": (body, descriptors, 0),
    "turns of the boundary": (disk, lambda V, F: np.bincount(loop(F), boundary_turns(V, F, loop(F)), len(V)), 0),
    "sharpest corners": (disk, lambda V, F: at(V, sharpest_corners(V, F, loop(F))), 0),
    "around": (body, lambda V, F: at(V, vertices_around(F, (far(V, F).argmax() == F).any(1), len(V), 2)), 0),
    "slopes": (disk, slopes, -1),
    "log scale": (disk, lambda V, F: np.exp(boundary_first(V, F, loop(F)).log_scale), None),
    "sharp edges": (body, lambda V, F: of_pairs(sharp_edges(V, F, np.radians(12)), len(V)), 0),
    "magnified": (body, lambda V, F: at(V, magnified_vertices(V, F)), 0),
    "ends of crossing pairs": (crossed, lambda V, F: np.bincount(
        F[np.unique(intersecting_pairs(V, F))].ravel(), minlength=len(V)).astype(float), 0),
}  # fmt: skip
FACES = {
    "least angles": (disk, least_angles, 0),
    "graded density": (body, lambda V, F: graded_density(
        1 + (far(V, F)[F].mean(axis=1) > np.median(far(V, F))) * 20.0, V, F, 0.3, 400), 0),
    "volumes at corners": (body, lambda V, F: corner_volumes(V - V[F].mean((0, 1)), F).reshape(len(F), -1).sum(1), 3),
    "areas of elements": (disk, lambda V, F: as_elements(V, F).area, 0),
    "ratios of elements": (disk, lambda V, F: as_elements(V, F).ratio, 0),
    "weights of elements": (disk, lambda V, F: as_elements(V, F).weight, 0),
    "areas of hats": (disk, lambda V, F: hat_gradients(V, F)[0], 2),
    "energies": (disk, lambda V, F: energies(as_elements(V, F), flat(V, F) @ [1, 1j] * size(V, F), 3.0), 0),
    "octaves": (disk, lambda V, F: face_distortion(V, F, flat(V, F)[F], np.arange(len(F)))[0], 0),
    "shear": (disk, lambda V, F: face_distortion(V, F, flat(V, F)[F], np.arange(len(F)))[1], 0),
    "stretches": (body, lambda V, F: np.sort(stretches(V, V * [1, 1, 1] + 0.2 * far(V, F)[:, None]
                                                       * (V - V[F].mean((0, 1))) / size(V, F), F), axis=-1), 0),
    "crossing pairs": (crossed, lambda V, F: of_pairs(intersecting_pairs(V, F), len(F)), 0),
    "polygon areas": (disk, polygon_areas, 2),
}  # fmt: skip
NUMBERS = {
    "volumes of parts": (crossed, lambda V, F: np.sort(component_volumes(V, F)[0]), 3),
    "inner curvature": (disk, lambda V, F: inner_curvature(V, F, loop(F)), 0),
    "energy of a map": (disk, lambda V, F: map_energy(flat(V, F), V, F), 0),
    "energy": (disk, lambda V, F: energy(as_elements(V, F), flat(V, F) @ [1, 1j] * size(V, F), 7.0), 0),
    "points apart": (body, lambda V, F: len(spread_points(V, F, 0.15 * size(V, F))[0]) > len(F), 0),
    "pairs that are close": (crossed, close_ones, 0),
    "distances of triangles": (crossed, lambda V, F: np.sort(triangle_distances(
        V, F, np.column_stack([np.arange(len(F) // 2), np.arange(len(F) // 2) + len(F) // 2])))[-1] > 0, 0),
}  # fmt: skip
PLACES = {
    "mean value map": (disk, flat, 0),
    "equal weights": (disk, lambda V, F: tutte(V, F, loop(F), arc_length_boundary(V, loop(F), 1.0), equal=True), 0),
    "boundary first": (disk, lambda V, F: boundary_first(V, F, loop(F)).uv, 1),
    "least squares": (disk, lambda V, F: _as_places(
        least_squares_conformal(V, F, *about_middle(V, F)[:, None])), 1),
    "developed": (lambda: (disk()[0] * [1, 1, 0], disk()[1]), lambda V, F: _as_places(developed(V, F)[0]), 1),
}  # fmt: skip


def _as_places(w):
    return np.column_stack([w.real, w.imag]) if np.iscomplexobj(w) else w


@functools.cache
def as_it_is(name):
    mesh, function, _ = {**VERTICES, **FACES, **NUMBERS, **PLACES}[name]
    return mesh(), np.asarray(function(*mesh()), float)


def vertex_of(told, F, n):
    """The vertex (n,) that each of a mesh told otherwise is."""
    found = np.empty(n, np.int64)
    found[np.roll(told.faces, -told.rolled, axis=1)] = F[told.order]
    return found


def compared(found, expected, tolerance):
    """Numbers, of any scale where that is open, the same to a share of the greatest."""
    assert np.abs(found - expected).max() <= tolerance * np.abs(expected).max()


def both(name, table, way):
    """What a function finds on a mesh and on the same one told otherwise, scaled back, with how it was told."""
    (V, F), expected = as_it_is(name)
    told, (_, function, power) = way(V, F), table[name]
    found = np.asarray(function(told.vertices, told.faces), float)
    if power is None:
        # Up to the scale of all.
        return told, F, found / np.abs(found).max(), expected / np.abs(expected).max()
    return told, F, found / told.size**power, expected


def pairs_of(table):
    return pytest.mark.parametrize(("name", "way"), list(product(table, WAYS)), ids=lambda x: getattr(x, "__name__", x))


@pairs_of(VERTICES)
def test_numbers_of_vertices(name, way):
    told, F, found, expected = both(name, VERTICES, way)
    assert np.ptp(expected) > 0
    compared(found, expected[vertex_of(told, F, len(expected))], 1e-6)


@pairs_of(FACES)
def test_numbers_of_faces(name, way):
    told, _, found, expected = both(name, FACES, way)
    assert np.ptp(expected) > 0
    compared(found, expected[told.order], 1e-6)


@pairs_of(NUMBERS)
def test_numbers_of_meshes(name, way):
    _, _, found, expected = both(name, NUMBERS, way)
    compared(found, expected, 1e-6)


@pairs_of(PLACES)
def test_places_up_to_a_motion(name, way):
    told, F, found, expected = both(name, PLACES, way)
    back = np.empty_like(found)
    back[vertex_of(told, F, len(found))] = found
    lengths = [np.linalg.norm(x[F] - x[np.roll(F, 1, axis=1)], axis=2) for x in (back, expected)]
    lengths = [x / x.max() for x in lengths] if PLACES[name][2] is None else lengths
    compared(*lengths, 1e-6)


@pytest.mark.parametrize("begin", range(4))
def test_diagonals_are_the_shorter_ones_of_quads_wherever_they_begin(begin):
    V, Q = patch()
    V = V + 0.01 * np.random.default_rng(0).normal(size=V.shape)
    quads = np.roll(Q, begin, axis=1)
    F = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    one, two = (np.linalg.norm(V[quads[:, k]] - V[quads[:, k + 2]], axis=1) for k in (0, 1))
    assert np.array_equal(longer_diagonals(V, quads, F), two < one)
    cut = shorter_diagonals(V, quads, F)
    assert np.array_equal(np.sort(cut, axis=1), np.sort(Q, axis=1))
    np.testing.assert_array_equal(np.linalg.norm(V[cut[:, 0]] - V[cut[:, 2]], axis=1), np.minimum(one, two))
