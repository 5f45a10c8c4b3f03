"""The two images of a chart: one keeps angles, the other areas, both without folds on the whole disk."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial.disk_images import conformal_image, preserving_image


def test_one_keeps_angles_and_the_other_areas():
    V, F = meshes.bumpy(24, 24, height=0.8)
    conformal = drain(conformal_image(V, F))
    density = np.where(V[F].mean(axis=1)[:, 0] > 0.5, 3.0, 1.0)
    preserving = drain(preserving_image(V, F, conformal.uv, density))
    assert conformal.warnings == preserving.warnings == ()
    mass = face_areas(V, F) * density
    error = []
    for uv in (conformal.uv, preserving.uv):
        area = signed_areas(uv, F)
        np.testing.assert_allclose(np.linalg.norm(uv[boundary_loops(F)[0]], axis=1), 1)
        assert area.min() > 0 and area.sum() == pytest.approx(np.pi, rel=0.01)
        error.append(np.abs(area / area.sum() - mass / mass.sum()).sum())
    assert error[1] < 0.3 * error[0]
