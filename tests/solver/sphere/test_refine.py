"""Refinement on the sphere: folds straightened, rotations kept, one map from any start."""

from __future__ import annotations

import numpy as np
from sphere_shapes import blob

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import normalized, signed_volumes
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.multilevel import multilevel_start
from omt_uv.solver.sphere.refine import sphere_refine
from omt_uv.solver.sphere.sphere_map import sphere_map


def test_both_starts_lead_to_the_same_shear():
    V, F = blob(2)
    area = face_areas(V, F)
    found = drain(sphere_map(V, F, quality="exact"))
    start, _ = drain(multilevel_start(V, F, area))
    other = drain(sphere_refine(V, F, start, area, quality="exact"))
    u, _, v = np.linalg.svd(found.positions.T @ other.positions)
    assert np.abs(found.positions @ u @ v - other.positions).max() < 0.05


def test_folds_are_straightened():
    V, F = blob()
    p = normalized(V)
    rng = np.random.default_rng(0)
    tangled = normalized(p + 0.05 * rng.normal(size=p.shape) * (rng.random((len(p), 1)) < 0.1))
    assert not (signed_volumes(tangled, F) > 0).all()
    found = drain(sphere_refine(V, F, tangled, face_areas(V, F)))
    assert found.untangling > 0 and (signed_volumes(found.positions, F) > 0).all()
