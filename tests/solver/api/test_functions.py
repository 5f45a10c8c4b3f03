"""The front door: arrays in, frozen results out, the same as step by step, and its examples are true."""

from __future__ import annotations

import dataclasses
import doctest

import meshes
import numpy as np
import pytest

from omt_uv import solver as omt
from omt_uv.solver.api import arrays, functions, results


@pytest.mark.parametrize("module", [functions, arrays])
def test_examples_in_docstrings(module):
    found = doctest.testmod(module)
    assert found.attempted > 0 and found.failed == 0


def bowl(count=8):
    x, y = np.meshgrid(np.linspace(-1, 1, count + 1), np.linspace(-1, 1, count + 1))
    V = np.column_stack([x.ravel(), y.ravel(), (x**2 + 0.5 * y**2).ravel()])
    corner = ((count + 1) * np.arange(count)[:, None] + np.arange(count)).ravel()
    return V, np.column_stack([corner, corner + 1, corner + count + 2, corner + count + 1])


def test_every_function_is_a_generator_too_and_both_return_the_same():
    V, F = bowl()
    assert {"unwrap", "refine", "magnify", "remesh", "sphere_map"} <= set(vars(omt.steps))
    steps, seen = omt.steps.unwrap(V, F), []
    result = omt.drain(steps, seen.append)
    np.testing.assert_array_equal(result.uv, omt.unwrap(V, F).uv)
    assert all(0 <= p.fraction <= 1 for p in seen)


def test_progress_may_stop_it():
    class Enough(Exception):
        pass

    def stop(progress):
        raise Enough

    with pytest.raises(Enough):
        omt.unwrap(*bowl(), progress=stop)


def test_a_list_of_polygons_has_the_uvs_of_the_array_corner_by_corner():
    V, F = bowl()
    array, listed = omt.unwrap(V, F), omt.unwrap(V, F.tolist())
    np.testing.assert_array_equal(array.uv.reshape(-1, 2), listed.uv)


def test_nothing_that_goes_in_is_changed():
    V, F = bowl()
    uv = V[F][:, :, :2].copy()
    before = V.copy(), F.copy(), uv.copy()
    omt.refine(V, F, uv)
    omt.magnify(V, F, uv, np.clip(1 - 2 * V[:, 2], 0, 1), 1.5)
    omt.distortion(V, F, uv)
    for a, b in zip(before, (V, F, uv), strict=True):
        np.testing.assert_array_equal(a, b)


def test_islands_lie_side_by_side_at_one_texel_density():
    V, F = bowl()
    W, G = np.concatenate([V, 0.5 * V + 4, V + 9]), np.concatenate([F, F + len(V), F + 2 * len(V)])
    result = omt.unwrap(W, G)
    assert result.figures.charts == 3 and result.figures.overlap == 0 and result.figures.area_l1 < 0.01


def test_the_area_asked_for_is_that_of_the_figures():
    V, F = bowl()
    density = np.where(np.arange(len(F)) % 8 < 4, 1.0, 2.0)
    assert omt.unwrap(V, F, density=density).figures.area_l1 < 0.01
    assert omt.distortion(V, F, omt.unwrap(V, F, density=density).uv).area_l1 > 0.2


def test_pinned_corners_keep_their_places():
    V, F = bowl()
    places = np.zeros((*F.shape, 2))
    pinned = np.zeros(F.size, bool)
    for vertex, place in ((0, (0.0, 0.0)), (len(V) - 1, (1.0, 1.0))):
        places[vertex == F] = place
        pinned |= (vertex == F).ravel()
    result = omt.unwrap(V, F, pins=(pinned, places))
    np.testing.assert_allclose(result.uv.reshape(-1, 2)[pinned], places.reshape(-1, 2)[pinned], atol=1e-12)


def test_closed_surfaces():
    V, F = meshes.icosphere(2)
    assert len(omt.unwrap(V, F).seams)
    found = omt.sphere_map(V, F, density=np.ones(len(F)))
    np.testing.assert_allclose(np.linalg.norm(found.positions, axis=1), 1)
    assert len(omt.remesh(V, F, 80, count_of="faces").triangles) == 80


@pytest.mark.parametrize(
    ("V", "F", "words"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], "shape"),
        (np.zeros((3, 3)), [[0, 1, 3]], "not among"),
        (np.zeros((3, 3)), [[0, 1]], "three corners"),
    ],
)
def test_arrays_of_wrong_shapes_are_refused(V, F, words):
    with pytest.raises(ValueError, match=words):
        omt.unwrap(V, F)


def test_uvs_of_another_mesh_are_refused():
    V, F = bowl()
    with pytest.raises(ValueError, match="corners"):
        omt.distortion(V, F, V[F][:-1, :, :2])


def test_bad_meshes_are_refused_by_name_with_their_elements():
    V, F = bowl()
    V[5, 2] = np.nan
    with pytest.raises(omt.MeshError) as caught:
        omt.unwrap(V, F)
    assert caught.value.kind == "vertex" and caught.value.elements.tolist() == [5]


def test_results_are_frozen():
    for cls in (results.UVs, results.MagnifiedUVs):
        assert cls.__dataclass_params__.frozen and dataclasses.is_dataclass(cls)
