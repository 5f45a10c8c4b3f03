"""Coarsening of closed meshes: spheres on every level, masses kept, rounds independent."""

from __future__ import annotations

import numpy as np
import pytest
from sphere_shapes import SHAPES

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import signed_volumes
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.coarsen import collapse_to_tetrahedron
from omt_uv.solver.sphere.multilevel import multilevel_start


@pytest.mark.parametrize("name", SHAPES)
def test_coarse_to_fine_never_folds(name):
    V, F = SHAPES[name]
    area = face_areas(V, F)
    for level in (levels := collapse_to_tetrahedron(V, F, area)):
        assert len(level.triangles) == 2 * len(level.vertices) - 4 and (twins(level.triangles) >= 0).all()
        np.testing.assert_allclose(level.mass.sum(), area.sum())
        assert len(level.mass) == len(level.triangles) and level.mass.min() > 0
    assert len(levels[-1].vertices) == 4
    p, _ = drain(multilevel_start(V, F, area))
    assert (signed_volumes(p, F) > 0).all()
