"""Landmarks of objects: empties and vertex groups whose names begin alike, each with its place."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture
def landmarks(package):
    return package("blender.shapes.landmarks")


def weighted(obj, name, weights):
    group = obj.vertex_groups.new(name=name)
    for k, weight in weights.items():
        group.add([k], weight, "REPLACE")


def middle(obj, weights):
    """The vertex nearest to the weighted mean, one by one."""
    place = {k: np.array(obj.data.vertices[k].co) for k in weights}
    mean = sum(w * place[k] for k, w in weights.items()) / sum(weights.values())
    return min(weights, key=lambda k: float(np.linalg.norm(place[k] - mean)))


def test_a_vertex_group_lies_at_the_vertex_nearest_to_its_weighted_mean(landmarks):
    obj = scenes.bump(6, 6)
    rng = np.random.default_rng(1)
    every = {f"LM_{n}": dict(zip(rng.permutation(49)[:n].tolist(), rng.uniform(0.1, 1, n).tolist(), strict=True))
             for n in (1, 2, 5, 12, 30, 49)}  # fmt: skip
    for name, weights in every.items():
        weighted(obj, name, weights)
    weighted(obj, "other", {0: 1.0})
    found = landmarks.read_landmarks(obj, "LM_")
    assert {point.name: point.vertex for point in found} == {name: middle(obj, w) for name, w in every.items()}
    assert all(point.position is None for point in found)


def test_vertices_without_weight_are_no_members(landmarks):
    obj = scenes.bump(6, 6)
    weighted(obj, "LM_a", {0: 0.0, 48: 0.5, 47: 0.0})
    weighted(obj, "LM_b", {0: 0.0})
    assert [(point.name, point.vertex) for point in landmarks.read_landmarks(obj, "LM_")] == [("LM_a", 48)]


def test_a_landmark_is_put_once_and_moved_then(landmarks):
    obj = scenes.bump()
    obj.location = (1.0, 2.0, 3.0)
    bpy.context.view_layer.update()
    first = landmarks.put_landmark(obj, "LM_1", (0.5, 0.25, 0.0))
    assert landmarks.put_landmark(obj, "LM_1", (1.5, 2.25, 3.125)) is first
    other = landmarks.put_landmark(obj, "LM_10", (1.0, 2.0, 3.0))
    bpy.context.view_layer.update()
    assert first is not other and [e.parent for e in (first, other)] == [obj, obj]
    np.testing.assert_allclose(first.matrix_world.translation, (1.5, 2.25, 3.125), atol=1e-6)
    assert first.empty_display_size == pytest.approx(landmarks.SIZE * max(obj.dimensions))
    found = {point.name: point.position for point in landmarks.read_landmarks(obj, "LM_")}
    np.testing.assert_allclose(found["LM_1"], (0.5, 0.25, 0.125), atol=1e-6)
    np.testing.assert_allclose(found["LM_10"], (0.0, 0.0, 0.0), atol=1e-6)
    assert landmarks.free_name([obj], "LM_") == "LM_2"
    assert landmarks.remove_landmarks(obj, "LM_") == 2 and not list(obj.children)
    assert landmarks.free_name([obj], "LM_") == "LM_1"


def test_landmarks_of_another_prefix_are_let_be(landmarks):
    """What picks or suggests them marks them; that one is marked does not say whose it is."""
    obj = scenes.bump()
    for name in ("LM_1", "LM_2", "ear 1"):
        landmarks.put_landmark(obj, name, (0.5, 0.25, 0.0))
    bpy.context.view_layer.update()
    assert [point.name for point in landmarks.read_landmarks(obj, "ear ")] == ["ear 1"]
    assert landmarks.free_name([obj], "ear ") == "ear 2"
    assert landmarks.remove_landmarks(obj, "LM_") == 2 and [child.name for child in obj.children] == ["ear 1"]
