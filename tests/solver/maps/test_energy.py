"""The energy: least where a map keeps angles and areas, invariant under motions, and its derivatives are its own."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.energy import (
    area_error,
    eager_bend,
    elements,
    energies,
    energy,
    face_derivatives,
    gradient,
    missing_tilt,
    sum_at_vertices,
    target_error,
    tilted,
)
from omt_uv.solver.mesh.geometry import face_areas


def flat(n=6):
    V, F = meshes.grid(n, n)
    return V, F, V[:, 0] + 1j * V[:, 1]


def shaken(seed=0):
    """Faces of a bumpy surface, and a map of it without folds."""
    V, F = meshes.bumpy(6, 6)
    w = V[:, 0] + 1j * V[:, 1] + 0.02 * np.random.default_rng(seed).normal(size=(len(V), 2)) @ [1, 1j]
    return elements(V, F, face_areas(V, F)), w


def test_an_isometry_has_no_energy():
    V, F, w = flat()
    faces = elements(V, F, face_areas(V, F))
    assert energy(faces, w, 3.0) == pytest.approx(0, abs=1e-12)
    assert np.abs(gradient(faces, w, 3.0)).max() < 1e-12
    assert area_error(faces, w) < 1e-12 and target_error(faces, w) < 1e-12


def test_shear_and_area_are_two_terms():
    V, F, w = flat()
    faces = elements(V, F, face_areas(V, F))
    # A conformal map twice as large: r = 4; one that keeps areas: s1 / s2 = 4.
    assert energy(faces, 2 * w, 5.0) == pytest.approx(5 * ((4 + 1 / 4) / 2 - 1))
    assert energy(faces, 2 * w.real + 0.5j * w.imag, 5.0) == pytest.approx((4 + 1 / 4) / 2 - 1)


def test_folds_are_infinite():
    V, F, w = flat()
    faces = elements(V, F, face_areas(V, F))
    assert energy(faces, w.conj(), 1.0) == np.inf
    w = w.copy()
    w[len(V) // 2] += 0.5
    each = energies(faces, w, 1.0)
    np.testing.assert_array_equal(np.isinf(each), faces.areas(w) <= 0)


def test_motions_change_nothing():
    faces, w = shaken()
    moved = np.exp(0.7j) * w + 3 - 2j
    assert energy(faces, moved, 2.0) == pytest.approx(energy(faces, w, 2.0), rel=1e-12)
    np.testing.assert_allclose(gradient(faces, moved, 2.0), np.exp(0.7j) * gradient(faces, w, 2.0), rtol=1e-9)
    assert gradient(faces, w, 2.0).sum() == pytest.approx(0, abs=1e-10)


def test_areas_are_those_of_the_map():
    V, F, w = flat()
    faces = elements(V, F, face_areas(V, F))
    np.testing.assert_allclose(faces.areas((2 + 1j) * w) / faces.area, 5)
    assert faces.area.sum() == pytest.approx(1) and faces.weight.sum() == pytest.approx(1)


def test_the_gradient_is_that_of_the_energy():
    faces, w = shaken()
    direction = np.random.default_rng(1).normal(size=(len(w), 2)) @ [1, 1j]
    h = 1e-6
    slope = (energy(faces, w + h * direction, 2.0) - energy(faces, w - h * direction, 2.0)) / (2 * h)
    assert (gradient(faces, w, 2.0).conj() @ direction).real == pytest.approx(slope, rel=1e-6)


def test_the_hessian_bounds_the_curvature_from_above():
    """Projected face by face it has no less curvature along any direction than the energy has."""
    faces, w = shaken()
    rows = face_derivatives(faces, w, 2.0).rows
    for seed in range(5):
        direction = np.random.default_rng(seed).normal(size=(len(w), 2)) @ [1, 1j]
        h = 1e-4
        values = [energy(faces, w + t * direction, 2.0) for t in (-h, 0, h)]
        curvature = (values[0] - 2 * values[1] + values[2]) / h**2
        form = (np.einsum("mri,mi->mr", rows, direction[faces.triangles])).real
        assert (form**2).sum() >= curvature * (1 - 1e-3)


def test_sums_at_vertices():
    faces, w = shaken()
    corner = np.random.default_rng(0).normal(size=(*faces.triangles.shape, 2)) @ [1, 1j]
    assert sum_at_vertices(faces, corner, len(w)).sum() == pytest.approx(corner.sum())


def test_a_tilt_keeps_the_sum_and_is_what_is_missing():
    V, F, w = flat()
    region = np.clip(np.random.default_rng(0).random(len(F)), 0, 1)
    faces = elements(V, F, face_areas(V, F), region)
    changed = tilted(faces, 0.01)
    assert changed.area @ changed.ratio == pytest.approx(faces.area @ faces.ratio)
    logarithm = np.log(changed.ratio / faces.ratio) - 0.01 * region
    assert np.ptp(logarithm) < 1e-12
    assert missing_tilt(faces, w) == pytest.approx(0, abs=1e-12)
    assert missing_tilt(changed, w) == pytest.approx(0.01, rel=0.05)


def test_an_eager_bend_takes_the_step_of_the_logarithm():
    r = np.array([1e-3, 0.1, 0.9, 1.0, 1.00001, 5.0, 100.0])
    slope = (1 - r**-2) / 2
    np.testing.assert_allclose(slope / eager_bend(r, 1.0), r * np.log(r), rtol=1e-3, atol=1e-12)
    np.testing.assert_allclose(eager_bend(r, 0.0), r**-3)
    between = np.sqrt(eager_bend(r, 0.0) * eager_bend(r, 1.0))
    np.testing.assert_allclose(eager_bend(r, 0.5), between)
