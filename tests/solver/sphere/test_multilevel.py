"""Bodies with long limbs on the sphere: where a conformal map squeezes most, and faces end as slivers."""

import numpy as np
import pytest

from omt_uv.solver.globe.pole_vertices import CONES, POLES, move_vertices_onto
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.multilevel import multilevel_start
from omt_uv.solver.sphere.newton import project_faces
from omt_uv.solver.sphere.sphere_map import sphere_map


def creature(body=3, length=12, width=1, limbs=6):
    """The surface of a block of unit cubes with straight limbs, two triangles for each square."""
    size = body + 2 * length + 2
    solid = np.zeros((size,) * 3, bool)
    middle = slice(size // 2 - body // 2, size // 2 - body // 2 + body)
    solid[middle, middle, middle] = True
    thin = slice(size // 2 - width // 2, size // 2 - width // 2 + width)
    for limb in range(limbs):
        place = [thin, thin, thin]
        place[limb % 3] = (
            slice(middle.stop, middle.stop + length) if limb < 3 else slice(middle.start - length, middle.start)
        )
        solid[tuple(place)] = True
    squares = []
    for axis in range(3):
        u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
        for side in (0, 1):
            neighbour = np.roll(solid, -1 if side else 1, axis=axis)
            base = np.argwhere(solid & ~neighbour) + side * np.eye(3, dtype=int)[axis]
            square = np.stack([base, base + u, base + u + v, base + v], axis=1)
            squares.append(square if side else square[:, ::-1])
    corners = np.concatenate(squares)
    V, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    quads = index.reshape(-1, 4)
    return V.astype(float), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


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
