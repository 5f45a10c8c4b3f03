"""Saliency by what defines it: nothing where curvature is the same everywhere, most where it is not."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.saliency import _suppressed, saliency, unit_size
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


@pytest.mark.parametrize("off", [0.0, 1e-15, -1e-15, 1e-12])
def test_of_peaks_that_are_as_high_rounding_chooses_none(off):
    """As those of a body with mirror images: none of them makes the other less."""
    V, F = meshes.grid(8, 8)
    away = [np.linalg.norm(V[:, :2] - p, axis=1) for p in ([0.25, 0.25], [0.75, 0.75])]
    value = sum(np.maximum(0, 1 - 4 * a) for a in away)
    other = np.where(value == 1, 1 + off * (away[0] < 0.1), value)
    np.testing.assert_allclose(_suppressed(2 * other, F), _suppressed(2 * value, F), atol=1e-9)
    assert _suppressed(2 * other, F).max() == pytest.approx(1.0)


@pytest.mark.parametrize("off", [0.0, 1e-14, -1e-14])
def test_the_more_other_peaks_there_are_the_less_is_left_of_all_of_them(off):
    """Peaks are vertices that no neighbour is above; two beside each other that are as high are both, or rounding would
    choose one."""
    V, F = meshes.grid(12, 12)
    value = np.full(len(V), 0.1)
    value[[20, 22, 60, 61, 110]] = 0.3, 1.0, 0.8, 0.8 + off, 0.01
    value[100] = 0.6
    # Lower ones than all around are none.
    found = _suppressed(2 * value, F)
    ends = np.concatenate([F[:, [k, (k + 1) % 3]] for k in range(3)])
    ends = np.concatenate([ends, ends[:, ::-1]])
    flat = [v for v in range(len(V)) if (value[ends[ends[:, 0] == v, 1]] <= value[v] + 1e-12).all() and value[v] < 1]
    assert {20, 60, 61, 100} <= set(flat) and 110 not in flat
    np.testing.assert_allclose(found, value * (1 - value[flat].mean()) ** 2, atol=1e-12)
