"""The two images of a chart: one keeps angles, the other areas, both without folds on the whole disk."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import PrecisionError, TransportError
from omt_uv.solver.mesh.geometry import face_areas, halfedge_lengths, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial import disk_images
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


def raises(error):
    """A solver that fails at once."""

    def fail(*_, **__):
        raise error
        yield

    return fail


def test_what_replaces_a_map_that_fails_is_said_and_folds_nothing(monkeypatch):
    V, F = meshes.bumpy(8, 8, height=0.8)
    plain = drain(conformal_image(V, F))
    lengths = halfedge_lengths(plain.uv, F)
    for least, mild in [(lengths.min() / 2, False), (2 * lengths.min(), True), (2 * lengths.max(), True)]:
        monkeypatch.setattr(disk_images, "SITE_RESOLUTION", least)
        found = drain(conformal_image(V, F))
        assert any("too close together" in text for text in found.warnings) == mild
        assert (found.uv != plain.uv).any() == mild and signed_areas(found.uv, F).min() > 0
    monkeypatch.setattr(disk_images, "conformal_disk", raises(PrecisionError("Lost digits")))
    found = drain(conformal_image(V, F))
    assert "Lost digits" in found.warnings[0] and signed_areas(found.uv, F).min() > 0
    np.testing.assert_allclose(np.linalg.norm(found.uv[boundary_loops(F)[0]], axis=1), 1)
    monkeypatch.setattr(disk_images, "transport", raises(TransportError("No cells")))
    found = drain(preserving_image(V, F, plain.uv, np.ones(len(F))))
    assert "No cells" in found.warnings[0]
    np.testing.assert_array_equal(found.uv, plain.uv)
