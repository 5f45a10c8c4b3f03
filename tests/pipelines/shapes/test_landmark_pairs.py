"""Landmarks of two objects: paired by name, or read from a file, whole or refused by name."""

from __future__ import annotations

import json

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.shapes import landmark_pairs
from omt_uv.pipelines.shapes.landmark_pairs import LandmarkPoint, PairsError, pairs_of, read_pairs


def point(name, vertex=0):
    return LandmarkPoint(name, vertex=vertex)


def test_pairs_come_in_the_order_of_the_source():
    found = pairs_of([point("b", 1), point("a", 2)], [point("a", 3), point("b", 4)], ("one", "two"))
    assert [p.vertex for p in found.source] == [1, 2] and [p.vertex for p in found.target] == [4, 3]


@pytest.mark.parametrize("side", [0, 1])
def test_what_is_there_twice_or_alone_is_told_with_its_object(side):
    both = [[point("a")], [point("a")]]
    both[side].append(point("b"))
    with pytest.raises(PairsError, match="Landmarks b are on") as told:
        pairs_of(*both, ("one", "two"))
    assert f"on {('one', 'two')[side]} alone. Add them to {('two', 'one')[side]}" in str(told.value)
    both[side].append(point("b"))
    with pytest.raises(PairsError, match=f"{('one', 'two')[side]} has more than one landmark b"):
        pairs_of(*both, ("one", "two"))


def test_files_have_vertices_and_positions(tmp_path):
    path = tmp_path / "pairs.json"
    path.write_text(json.dumps([[3, [0, 1, 2.5]], [[1, 1, 1], 4]]))
    found = read_pairs(path)
    assert [p.name for p in found.source] == [p.name for p in found.target] == ["0", "1"]
    assert found.source[0].vertex == 3 and found.source[1].position == (1.0, 1.0, 1.0)
    assert found.target[0].position == (0.0, 1.0, 2.5) and found.target[1].vertex == 4


@pytest.mark.parametrize("rows", [[[1, 2, 3]], [[1]], [[]], [1], [[1, [0, 1]]], [[1, [0, 1, 2, 3]]], [[1, "abc"]], 7])
def test_files_of_anything_else_are_refused_by_name(rows, tmp_path):
    path = tmp_path / "pairs.json"
    path.write_text(json.dumps(rows))
    with pytest.raises(PairsError, match="pairs"):
        read_pairs(path)


def test_rows_before_the_one_that_is_none_are_counted(tmp_path):
    path = tmp_path / "pairs.json"
    path.write_text(json.dumps([[1, 2], [3, 4], [5, 6, 7]]))
    with pytest.raises(PairsError, match=r"pair [23] is none"):
        read_pairs(path)


@pytest.mark.parametrize("text", [None, "{", "\xff"])
def test_a_file_of_pairs_that_cannot_be_read_is_named(tmp_path, text):
    path = tmp_path / "pairs.json"
    if text is not None:
        path.write_bytes(text.encode("latin-1"))
    with pytest.raises(landmark_pairs.PairsError, match="pairs"):
        landmark_pairs.read_pairs(path)


@pytest.mark.parametrize("seed", range(5))
def test_vertices_of_no_face_attract_no_landmarks(seed):
    """Wherever they are: landmarks float about a thin wall, each nearest to the side that it is on."""
    rng = np.random.default_rng(seed)
    V, F = meshes.bumpy(6, 6, height=0.1)
    wall = np.concatenate([V, V - [0, 0, 0.02]]), np.concatenate([F, F[:, ::-1] + len(V)])
    place = wall[0][rng.integers(len(wall[0]), size=12)] + 0.03 * rng.normal(size=(12, 3))
    points = tuple(LandmarkPoint(str(k), position=tuple(p)) for k, p in enumerate(place.tolist()))
    faces, weights = landmark_pairs._located(points, *wall)
    # Loose vertices where the landmarks are, before all others.
    loose = np.concatenate([place, wall[0]]), wall[1] + len(place)
    np.testing.assert_array_equal(landmark_pairs._located(points, *loose)[0], faces)
    np.testing.assert_allclose(landmark_pairs._located(points, *loose)[1], weights, atol=1e-12)


@pytest.mark.parametrize(("vertex", "there"), [(0, True), (2, True), (3, False), (4, False)])
def test_landmarks_are_at_vertices_of_faces(vertex, there):
    """The fourth vertex has no face, and there is no fifth one."""
    V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]]), np.array([[0, 1, 2]])
    point = landmark_pairs.LandmarkPoint("nose", vertex)
    if there:
        faces, weights = landmark_pairs._located((point,), V, F)
        assert faces.tolist() == [0] and weights[0] == pytest.approx(np.eye(3)[vertex])
    else:
        with pytest.raises(landmark_pairs.PairsError, match="nose"):
            landmark_pairs._located((point,), V, F)
