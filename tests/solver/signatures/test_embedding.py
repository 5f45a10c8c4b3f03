"""Places in the plane have the distances that they are made of, and neighbours tell classes."""

import numpy as np

from omt_uv.solver.signatures.embedding import classes_of_nearest, classical_scaling


def test_points_of_the_plane_come_back_but_for_a_rotation():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(30, 2))
    away = np.linalg.norm(points[:, None] - points, axis=2)
    found = classical_scaling(away)
    assert np.allclose(np.linalg.norm(found[:, None] - found, axis=2), away)
    assert np.allclose(classical_scaling(away, 4)[:, 2:], 0, atol=1e-6)


def test_most_of_the_nearest_tell_the_class_and_the_nearest_where_they_are_level():
    away = np.array([[0, 1, 2, 3], [1, 0, 2, 3], [2, 2, 0, 1], [3, 3, 1, 0.0]])
    assert classes_of_nearest(away, list("aabb"), 1) == list("aabb")
    assert classes_of_nearest(away, list("aabb"), 2) == list("aabb")
    away[0, 1] = np.nan
    assert classes_of_nearest(away, list("abcd"), 1)[0] == "c"
