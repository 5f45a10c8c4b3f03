"""Saliency by what defines it: nothing where curvature is the same everywhere, most where it is not."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.saliency import saliency, unit_size
from omt_uv.solver.mesh.geometry import face_areas


def test_saliency_finds_a_bump_and_nothing_on_spheres_and_planes():
    V, F, r = meshes.single_bump()
    s = saliency(V, F)
    assert s[r < 0.03].min() > 10 * s[r > 0.3].max() and (s >= 0).all()
    assert not saliency(*meshes.icosphere(3)).any()
    assert not saliency(*meshes.grid(20, 20)).any()


def test_unit_size_is_that_of_a_sphere_in_its_box():
    """A sphere is 2 sqrt(3) times its spread across the diagonal of its box; place and size do not count."""
    V, F = meshes.icosphere(3)
    scaled = unit_size(V, F)
    assert np.linalg.norm(scaled, axis=1) == pytest.approx(np.full(len(V), 1 / (2 * np.sqrt(3))), rel=1e-2)
    np.testing.assert_allclose(unit_size(1e6 * V + 1e7, F), scaled, atol=1e-7)
    centre = scaled[F].mean(axis=1)
    np.testing.assert_allclose(face_areas(scaled, F) @ centre, 0, atol=1e-12)
