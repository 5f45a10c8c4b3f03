"""Small formulas of the solver against plain loops, and bounds that a number has to keep, each on either side."""

from __future__ import annotations

import ctypes
from pathlib import Path
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver import blas_threads
from omt_uv.solver.analysis.seam_costs import SeamPreferences, seam_costs
from omt_uv.solver.errors import NonFiniteError
from omt_uv.solver.maps.contacts import touches_itself
from omt_uv.solver.maps.tutte import mean_value_weights
from omt_uv.solver.mesh.closed_surface import closed_surface
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.registration import register
from omt_uv.solver.remeshing.relaxation.voronoi_cells import _circumcentre


def test_mean_value_weights_are_those_of_floater():
    """tan(angle / 2) over the length of the edge, of the angles at both of its ends."""
    V, F = meshes.random_disk(40, 2)
    length = np.linalg.norm(V[F] - V[np.roll(F, -1, axis=1)], axis=2)
    at_tail, at_head = mean_value_weights(length)
    for t, face in enumerate(F):
        for k in range(3):
            a, b, c = V[face[k]], V[face[(k + 1) % 3]], V[face[(k + 2) % 3]]
            edge = np.linalg.norm(b - a)
            for found, at, one, other in ((at_tail, a, b, c), (at_head, b, a, c)):
                u, v = (one - at) / np.linalg.norm(one - at), (other - at) / np.linalg.norm(other - at)
                assert found[t, k] == pytest.approx(np.tan(np.arccos(u @ v) / 2) / edge, rel=1e-9)


def test_mean_value_weights_of_needles_are_positive_and_finite():
    length = np.array([[1.0, 1.0, 2.0], [1.0, 1.0, 0.0], [1.0, 2.0, 1.0], [1.0, 1.0, 1e-14]])
    for weights in mean_value_weights(length):
        assert np.isfinite(weights).all() and (weights > 0).all()


@pytest.mark.parametrize(("gap", "touching"), [(1.01e-6, False), (0.99e-6, True), (0.0, True)])
def test_vertices_touch_within_a_millionth_of_the_mean_edge(gap, touching):
    """A square with a slit from one side to the middle, whose ends on the side are so far apart."""
    square = [[0.0, 0], [2, 0], [2, 2], [1 + gap / 2, 2], [1, 1], [1 - gap / 2, 2], [0, 2]]
    uv = np.array(square)
    mean = np.linalg.norm(uv - np.roll(uv, -1, axis=0), axis=1).mean()
    uv[3, 0], uv[5, 0] = 1 + gap * mean / 2, 1 - gap * mean / 2
    assert touches_itself(uv, np.arange(7)) == touching


@pytest.mark.parametrize(("factor", "least", "most"), [(0.01, 0.2, 1.0), (100.0, 1.0, 6.0)])
def test_costs_of_seams_stay_between_a_fifth_and_six_times_the_neutral_one(factor, least, most):
    V, F = meshes.head(20)
    every = dict.fromkeys(("hidden", "crease", "sharp", "underside", "back", "front", "salient", "mirror"), factor)
    cost = seam_costs(triangle_surface(V, F), SeamPreferences(**every, loops=1.0)).cost
    assert cost.min() == least if least < 1 else cost.max() == most
    assert (cost >= least).all() and (cost <= most).all()


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_one_coordinate_that_is_nowhere_is_enough(axis, value):
    V, F = meshes.icosphere(1)
    V = V.copy()
    V[7, axis] = value
    with pytest.raises(NonFiniteError, match="Coordinates are not finite") as caught:
        closed_surface(V, F)
    assert caught.value.elements.tolist() == [7]


def test_circumcentres_are_as_far_from_all_corners_and_triangles_without_area_have_none():
    rng = np.random.default_rng(3)
    p = np.concatenate([rng.random((30, 3, 3)), np.zeros((1, 3, 3)), np.ones((1, 3, 3))])
    square = ((p[:, [1, 2, 0]] - p[:, [2, 0, 1]]) ** 2).sum(axis=2).T
    w, double = _circumcentre(square)
    assert np.isfinite(w).all() and w.sum(axis=0) == pytest.approx(1.0)
    for k in range(30):
        assert double[k] == pytest.approx(np.linalg.norm(np.cross(p[k, 1] - p[k, 0], p[k, 2] - p[k, 0])))
        unbounded = square[:, k] * (square[:, k].sum() - 2 * square[:, k])
        if (np.abs(unbounded / unbounded.sum() - 0.5) < 1.5).all():
            away = np.linalg.norm(p[k] - w[:, k] @ p[k], axis=1)
            assert away == pytest.approx(np.full(3, away.mean()))
    assert w[:, 30] == pytest.approx(np.full(3, 1 / 3)) and double[30] == 0


@pytest.mark.parametrize("missing", ["get", "set", None])
def test_a_library_counts_threads_by_both_of_its_functions(monkeypatch, missing):
    there = {f"openblas_{k}_num_threads": SimpleNamespace() for k in ("get", "set") if k != missing}
    monkeypatch.setattr(ctypes, "CDLL", lambda _: SimpleNamespace(**there))
    monkeypatch.setattr(blas_threads, "PREFIXES", ("",))
    monkeypatch.setattr(blas_threads, "SUFFIXES", ("",))
    found = blas_threads._opened(Path("any"))
    assert (found is None) == (missing is not None)


def test_landmarks_within_faces_of_the_same_sphere_leave_nothing_between_them():
    """A point of a flat face lies below the sphere, and is lifted onto it before it is compared."""
    P, F = meshes.icosphere(1)
    faces = np.array([3, 20, 41, 66])
    barycentric = np.array([[0.5, 0.3, 0.2], [0.2, 0.6, 0.2], [1 / 3, 1 / 3, 1 / 3], [0.1, 0.1, 0.8]])
    places = np.einsum("kc,kcd->kd", barycentric, P[F[faces]])
    places /= np.linalg.norm(places, axis=1)[:, None]
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    pair = SimpleNamespace(
        target=SimpleNamespace(triangles=F),
        targets=(faces, barycentric),
        landmarks=np.arange(4),
        domain=register.SPHERE,
    )
    found, error = register._aligned(pair, np.concatenate([places, P]) @ turn.T, P, [])
    assert found[4:] == pytest.approx(P, abs=1e-9) and error == pytest.approx(0, abs=1e-9)
