"""Bodies with long limbs on the sphere: where a conformal map squeezes most, and faces end as slivers."""

import numpy as np
import pytest
from sphere_shapes import creature

from omt_uv.solver.globe.pole_vertices import CONES, POLES, move_vertices_onto
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.multilevel import multilevel_start
from omt_uv.solver.sphere.newton import project_faces
from omt_uv.solver.sphere.sphere_map import sphere_map

BODIES = {"six limbs": creature(5, 20, 3), "thin limbs": creature(6, 14, 2), "one limb": creature(6, 24, 3, 1)}


@pytest.mark.parametrize("name", BODIES)
def test_no_face_reaches_around_the_sphere(name):
    V, F = BODIES[name]
    p, _ = drain(multilevel_start(V, F, face_areas(V, F)))
    assert signed_volumes(p, F).min() > 0
    assert project_faces(p, F).least_cosine.min() > 0


@pytest.mark.parametrize("name", BODIES)
def test_limbs_get_their_areas_and_poles_their_vertices(name):
    V, F = BODIES[name]
    found = drain(sphere_map(V, F)).positions
    assert signed_volumes(found, F).min() > 0
    share = face_areas(V, F) / face_areas(V, F).sum()
    area = spherical_areas(found, F) / (4 * np.pi)
    np.testing.assert_allclose(area.sum(), 1, rtol=1e-9)
    # Eight faces around a thin limb have little room to trade.
    assert np.abs(area - share).sum() <= 0.025
    rng = np.random.default_rng(0)
    for targets in (POLES, CONES):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        placed, vertices = move_vertices_onto(found @ (turn * np.linalg.det(turn)).T, F, targets)
        assert signed_volumes(placed, F).min() > 0
        np.testing.assert_array_equal(placed[vertices], targets)
        assert (vertices >= 0).all() and len(set(vertices)) == len(targets)
