"""Regions of the benchmarks: their share of the surface, and figures that know what an exact map is."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from benchmarks import regions
from omt_uv.solver.analysis.density import from_vertices
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas


def test_a_ball_covers_its_share():
    V, F = meshes.icosphere(4)
    weights = regions.ball(V, F)
    assert weights.min() == 0 and weights.max() == 1
    area = vertex_areas(V, F)
    assert area[weights > 0.5].sum() / area.sum() == pytest.approx(regions.SHARE, rel=0.05)


def test_areas_are_those_of_the_solver():
    V, F = meshes.random_disk()
    np.testing.assert_allclose(regions.areas(V[F]), face_areas(V, F), rtol=1e-12)


def test_a_flat_mesh_laid_out_as_it_is_misses_nothing():
    V, F = meshes.grid(12, 12)
    weights = from_vertices(regions.ball(V, F), F)
    found = regions.figures(V, F, V[F][:, :, :2], np.ones(len(F)), weights)
    assert max(found.area_l1, found.region, found.context, found.overlap) < 1e-9 and found.folds == 0
    assert regions.missed_by(found, error=0.0, ratio=1.0) == {"missed goals": ""}
    assert regions.missed_by(found, error=0.1, ratio=2.0, cascade=0.1) == {"missed goals": "share, cascade, time"}
