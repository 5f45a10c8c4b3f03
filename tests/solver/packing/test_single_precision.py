"""Rounding to single precision folds nothing, and moves nothing that it would not fold."""

from __future__ import annotations

import numpy as np

from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.packing import single_precision
from omt_uv.solver.packing.single_precision import without_rounded_folds


def polygon(sides, radius=0.16, centre=(0.61, 0.37)):
    """A polygon of many sides cut into ears over ears, as Blender cuts it: half of its triangles are slivers."""
    turn = 2 * np.pi * np.arange(sides) / sides
    uv = np.asarray(centre) + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    left, triangles = np.arange(sides), []
    while len(left) > 2:
        even = np.arange(0, len(left) - 1, 2)
        triangles.append(np.column_stack([left[even], left[even + 1], np.roll(left, -2)[even]]))
        left = np.delete(left, even + 1)
    faces = np.concatenate(triangles)
    return uv, faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]


def folds(uv, faces):
    return int((signed_areas(uv.astype(np.float32).astype(float), faces) <= 0).sum())


def test_slivers_of_a_long_polygon_stay_open_when_they_are_rounded():
    uv, faces = polygon(14000)
    assert folds(uv, faces) > 50
    found = without_rounded_folds(uv, faces)
    assert folds(found, faces) == 0
    assert np.abs(found - uv).max() < 8 * np.spacing(np.float32(0.8))


def test_mirrored_triangles_stay_mirrored():
    uv, faces = polygon(14000)
    found = without_rounded_folds(uv, faces[:, ::-1])
    assert (signed_areas(found.astype(np.float32).astype(float), faces) > 0).all()


def test_what_rounding_does_not_fold_keeps_every_bit():
    uv, faces = polygon(60)
    assert without_rounded_folds(uv, faces) is uv
    both = np.concatenate([uv + [2.0, 0.0], polygon(14000)[0]])
    found = without_rounded_folds(both, np.concatenate([faces, polygon(14000)[1] + len(uv)]))
    assert (found[: len(uv)] == both[: len(uv)]).all()


def test_triangles_without_area_are_left_alone():
    uv = np.array([[0, 0], [0.3, 0.3], [0.6, 0.6], [0.3, 0.1]])
    faces = np.array([[0, 1, 2], [0, 3, 1]])
    assert (without_rounded_folds(uv, faces) == uv).all()


def test_vertices_that_move_at_once_share_no_triangle():
    triangles = np.array([[k, k + 1, k + 2] for k in range(40)])
    for seed, vertices in enumerate([np.arange(42), np.arange(5, 30), np.array([7]), np.array([3, 4])]):
        found = single_precision._apart(vertices, triangles, 42, np.random.default_rng(seed))
        assert len(found) and np.isin(found, vertices).all() and len(np.unique(found)) == len(found)
        assert (np.isin(triangles, found).sum(axis=1) <= 1).all()


def test_a_vertex_is_moved_only_where_fewer_of_its_faces_fold():
    """However much more room there is beside it."""
    moves = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        near = (0.6 + 2.0**-24 * rng.integers(-3, 4, (9, 2))).astype(np.float32).astype(float)
        faces = np.array([[0, *rng.choice(np.arange(1, 9), 2, replace=False)] for _ in range(6)])
        side, moving = rng.choice([-1.0, 1.0], 6), np.zeros(1, np.int64)
        place = single_precision._bettered(near, faces, side, moving, np.zeros(6, np.int64), 3 * np.arange(6))
        moved = near.copy()
        moved[0] = place
        before, after = ((signed_areas(uv, faces) * side <= 0).sum() for uv in (near, moved))
        assert after < before or np.array_equal(moved, near)
        moves += after < before
    assert 5 < moves < 40
