"""Folds of carried UVs: opened where they are, nothing else moved, and no fold opened that was meant."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps import local_untangle
from omt_uv.solver.maps.local_untangle import straighten_folds
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.topology import boundary_loops


def flat(columns=12, rows=10):
    V, F = meshes.bumpy(columns, rows, height=0.0)
    return V[:, :2], F


def corners(uv, F):
    return uv[F].reshape(-1, 2)


def areas(values):
    return signed_areas(values, np.arange(len(values)).reshape(-1, 3))


def test_a_sound_map_keeps_every_bit():
    uv, F = flat()
    values = corners(uv, F)
    new, left = straighten_folds(F, values, np.ones(len(F)))
    assert left == 0
    assert new.tobytes() == values.tobytes()


@pytest.mark.parametrize("scale, offset", [(1.0, 0.0), (1e-5, 0.0), (1e3, 1e4)])
@pytest.mark.parametrize("mirrored", [1, -1])
def test_folds_are_opened_and_the_rest_stays(scale, offset, mirrored):
    uv, F = flat()
    wrong = uv.copy()
    middle = np.argsort(np.linalg.norm(uv - uv.mean(axis=0), axis=1))[0]
    wrong[middle] += 2.2 * (uv[F[0]].max(axis=0) - uv[F[0]].min(axis=0))
    wrong = wrong * [mirrored * scale, scale] + offset
    values = corners(wrong, F)
    assert (mirrored * areas(values) <= 0).any()
    new, left = straighten_folds(F, values, np.full(len(F), mirrored))
    assert left == 0
    assert (mirrored * areas(new) > 0).all()
    far = np.linalg.norm(uv - uv[middle], axis=1) > 0.6
    assert (new[far[F.ravel()]] == values[far[F.ravel()]]).all()


def test_a_corner_of_the_outline_that_is_folded_in_is_pushed_open():
    uv, F = flat()
    a, b = boundary_loops(F)[0][:2]
    out = np.array([uv[b, 1] - uv[a, 1], uv[a, 0] - uv[b, 0]])
    F = np.concatenate([F, [[b, a, len(uv)]]])
    # The tip is on the wrong side of its base, inside of the map.
    wrong = np.concatenate([uv, [(uv[a] + uv[b]) / 2 - 0.4 * out]])
    new, left = straighten_folds(F, corners(wrong, F), np.ones(len(F)))
    assert left == 0
    assert (areas(new) > 0).all()


def test_a_map_that_folds_along_a_line_of_symmetry_is_left_alone():
    """Both halves of a face on one half of the texture: an island that is connected, and folded on purpose."""
    uv, F = flat()
    centre = uv[F].mean(axis=1)[:, 0] > np.median(np.unique(uv[:, 0]))
    folded = np.stack([np.abs(uv[:, 0] - np.median(np.unique(uv[:, 0]))), uv[:, 1]], axis=1)
    values = corners(folded, F)
    new, left = straighten_folds(F, values, np.where(centre, 1, -1))
    assert left == 0
    assert (new == values).all()


def test_uvs_without_extent_are_left_alone():
    _, F = flat()
    values = np.zeros((F.size, 2))
    new, left = straighten_folds(F, values, np.zeros(len(F)))
    assert left == 0
    assert (new == values).all()


def test_steps_to_an_area_are_the_least_that_lead_there():
    """Areas are quadratic, so that central differences give their gradients exactly."""
    rng = np.random.default_rng(0)
    corners, side, missing = rng.normal(size=(20, 3, 2)), rng.choice([-1.0, 1.0], 20), rng.uniform(0.1, 1, 20)
    found = local_untangle._area_steps(corners, side, missing)
    area = lambda p: side * signed_areas(p.reshape(-1, 2), np.arange(60).reshape(-1, 3))  # noqa: E731
    for k in range(20):
        gradient = np.zeros(6)
        for c in range(6):
            step = np.zeros((20, 6))
            step[k, c] = 0.5
            gradient[c] = (area(corners + step.reshape(20, 3, 2)) - area(corners - step.reshape(20, 3, 2)))[k]
        np.testing.assert_allclose(found[k].ravel(), missing[k] * gradient / (gradient @ gradient), rtol=1e-10)
    # A face without an outline has no direction, and is no division by zero.
    assert not local_untangle._area_steps(np.zeros((1, 3, 2)), np.ones(1), np.ones(1)).any()


@pytest.mark.parametrize("apart", [0.0, 1e-9, 2e-8])
def test_corners_whose_vertex_did_not_move_keep_every_bit_also_where_they_are_a_little_apart(apart):
    """Corners of a vertex are joined to look for folds, and not otherwise."""
    uv, F = flat()
    wrong = uv.copy()
    middle = np.argsort(np.linalg.norm(uv - uv.mean(axis=0), axis=1))[0]
    wrong[middle] += 2.2 * (uv[F[0]].max(axis=0) - uv[F[0]].min(axis=0))
    values = corners(wrong, F)
    values = values + apart * np.random.default_rng(0).uniform(-0.5, 0.5, values.shape)
    new, left = straighten_folds(F, values, np.ones(len(F)))
    moved = np.abs(new - values).max(axis=1) > 1e-6
    assert left == 0 and moved.any() and not moved.all()
    assert new[~moved].tobytes() == values[~moved].tobytes()
