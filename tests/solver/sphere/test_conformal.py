"""Conformal maps to the sphere: angles kept, mass centred, one map in any pose."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from sphere_shapes import SHAPES, blob

from omt_uv.solver import errors
from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.mesh.geometry import angles_from_lengths, halfedge_lengths, vertex_areas
from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere import conformal
from omt_uv.solver.sphere.conformal import conformal_sphere


@pytest.mark.parametrize("name", SHAPES)
def test_conformal(name):
    V, F = SHAPES[name]
    found = drain(conformal_sphere(V, F))
    p = found.positions
    assert found.residual <= 1e-9 and found.iterations <= 15
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(spherical_areas(p, F).sum(), 4 * np.pi, rtol=1e-12)
    assert (signed_volumes(p, F) > 0).all()
    p = found.sites
    mass = vertex_areas(V, F)
    np.testing.assert_allclose(mass @ p / mass.sum(), 0, atol=1e-9)


def test_conformal_keeps_angles():
    V, F = blob(4)
    p = drain(conformal_sphere(V, F)).positions
    before, after = (angles_from_lengths(halfedge_lengths(x, F).reshape(-1, 3)) for x in (V, p))
    assert np.degrees(np.abs(before - after)).mean() < 2


def test_conformal_is_one_map_in_any_pose():
    V, F = blob()
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    p, q = (drain(conformal_sphere(x, F)).positions for x in (V, 1e-3 * V @ turn.T + 1e3))
    u, _, v = np.linalg.svd(q.T @ p)
    np.testing.assert_allclose(q @ u @ v, p, atol=1e-6)


def _without_face(V, F):
    return V, F[1:]


def _two(V, F):
    return np.concatenate([V, V + 9]), np.concatenate([F, F + len(V)])


def _kissing(V, F):
    """Two copies that share vertex 0."""
    second = np.where(F == 0, 0, F + len(V) - 1)
    return np.concatenate([V, 2 * V[0] - V[1:]]), np.concatenate([F, second[:, ::-1]])


def _turned(V, F):
    F = F.copy()
    F[3] = F[3, ::-1]
    return V, F


def _not_finite(V, F):
    V = V.copy()
    V[5] = np.nan
    return V, F


BAD = {
    "open": (_without_face, errors.NotASphereError, 3),
    "parts": (_two, errors.NotASphereError, 80),
    "kissing": (_kissing, errors.NotASphereError, 1),
    "turned": (_turned, errors.OrientationError, 3),
    "nan": (_not_finite, errors.NonFiniteError, 1),
    "loose": (lambda V, F: (np.concatenate([V, [[0, 0, 9.0]]]), F), errors.NotASphereError, 1),
    "double": (lambda V, F: (V, np.concatenate([F, F[:1, ::-1]])), errors.DuplicateFaceError, 2),
    "handle": (lambda V, F: meshes.torus(), errors.NotASphereError, 0),
    "empty": (lambda V, F: (V, F[:0]), errors.EmptyMeshError, 0),
}


@pytest.mark.parametrize("name", BAD)
def test_refusals(name):
    spoil, kind, count = BAD[name]
    with pytest.raises(kind) as caught:
        drain(conformal_sphere(*spoil(*meshes.icosphere(1))))
    assert len(caught.value.elements) == count and caught.value.remedy


def test_faces_without_area_get_a_little():
    V, F = meshes.icosphere(1)
    V = V.copy()
    a, b = F[7, :2]
    V[a] = V[b]
    p = drain(conformal_sphere(V, F)).positions
    assert (spherical_areas(p, F) > 0).all()


@pytest.mark.parametrize("seed", range(4))
def test_the_equator_halves_the_mass_wherever_and_however_large_the_plane_lies(seed):
    rng = np.random.default_rng(seed)
    z, mass, infinite = rng.normal(size=60) + 1j * rng.normal(size=60), rng.random(60), int(rng.integers(60))
    positions = conformal._halved_by_equator(z, infinite, mass)
    np.testing.assert_allclose(np.linalg.norm(positions, axis=1), 1, atol=1e-14)
    assert positions[infinite].tolist() == [0, 0, 1]
    finite = np.arange(60) != infinite
    above = mass[finite & (positions[:, 2] > 1e-12)].sum()
    assert abs(above - mass[finite].sum() / 2) <= mass.max()
    moved = conformal._halved_by_equator(1e-3 * z + 1e3 - 2e3j, infinite, mass)
    np.testing.assert_allclose(moved, positions, atol=1e-9)


@pytest.mark.parametrize("share, gathered", [(0.49, False), (0.51, True)])
def test_half_of_a_surface_in_a_point_is_refused_and_less_is_not(share, gathered):
    z, mass = np.append(np.zeros(10), np.arange(1, 12)).astype(complex), np.ones(21)
    mass[:10] *= share / mass[:10].sum()
    mass[10:20] *= (1 - share) / mass[10:20].sum()
    if gathered:
        with pytest.raises(errors.PrecisionError, match="half of the surface"):
            conformal._halved_by_equator(z, 20, mass)
    else:
        assert np.isfinite(conformal._halved_by_equator(z, 20, mass)).all()


@pytest.mark.parametrize("failing", range(7))
def test_the_first_candidate_that_can_be_goes_to_infinity(failing, monkeypatch):
    """All of them as it is, and then all where the curvature is even."""
    as_it_is, even = (SimpleNamespace(triangles=np.array([[0, 1, 4]])) for _ in range(2))
    asked = []

    def flattened(tri, vertex):
        asked.append((tri is even, vertex))
        if len(asked) <= failing:
            raise PrecisionError(f"the {len(asked)}th")
        yield from ()
        return "flat"

    def evened(tri, n):
        assert tri is as_it_is and n == 5
        yield from ()
        return even

    monkeypatch.setattr(conformal, "flatten_punctured_sphere", flattened)
    monkeypatch.setattr(conformal, "with_even_curvature", evened)
    order = [(late, vertex) for late in (False, True) for vertex in (4, 0, 1)]
    if failing == len(order):
        with pytest.raises(PrecisionError, match="the 6th"):
            drain(conformal._flatten(as_it_is, np.array([4, 0, 1])))
    else:
        assert drain(conformal._flatten(as_it_is, np.array([4, 0, 1]))) == (order[failing][1], "flat")
        assert asked == order[: failing + 1]
