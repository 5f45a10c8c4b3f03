"""Insides of bodies, by way of the ball into one another; and files of tetrahedra."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from types import SimpleNamespace

import numpy as np
import pytest
from bodies import icosphere, limbed

from omt_uv.pipelines.volumes import volume
from omt_uv.pipelines.volumes.volume import VolumeBody, VolumeSettings, mapped_volume
from omt_uv.pipelines.volumes.vtu import vtu_text
from omt_uv.solver.errors import HandleError
from omt_uv.solver.progress import drain


def test_a_body_goes_into_another_with_its_landmarks():
    V, F = icosphere(2)
    W, G = limbed(2)
    rows = {f"LM_{k}": np.array([r]) for k, r in enumerate((0, 30, 60, 90))}
    one, other = VolumeBody("one", V, F, rows), VolumeBody("other", W, G, rows)
    settings = VolumeSettings("body", count=1200)
    told = []
    found = drain(mapped_volume(one, settings, other), lambda progress: told.append(progress.fraction))
    # A bar goes on to its end, and hardly ever back.
    assert min(told) >= 0 and max(told) <= 1 and told[-1] > 0.9 and np.diff(told).min() > -0.02
    assert found.map.domain == "body" and len(found.map.positions) == len(found.map.points)
    for (row,) in rows.values():
        assert np.linalg.norm(found.map.positions[row] - W[row]) < 0.25
    assert (np.linalg.norm(found.map.positions, axis=1) <= np.linalg.norm(W, axis=1).max() + 1e-6).all()
    report = found.report()
    assert found.map.inverted == 0 and found.map.shares < 0.03 and not found.map.warnings
    assert report["tetrahedra"] == len(found.map.tets) and sum(report["log2_dilation_histogram"]) > 0
    with pytest.raises(HandleError, match="no other body"):
        drain(mapped_volume(one, settings))


@pytest.mark.parametrize("count", range(6))
def test_three_landmarks_of_one_name_turn_a_body_and_fewer_do_not(monkeypatch, count):
    """Each is the middle of its vertices; those of one body alone do not count."""
    V, F = icosphere(1)
    one = SimpleNamespace(positions=V, points=V, tets=np.array([[0, 1, 2, 3]]))
    other = SimpleNamespace(positions=2 * V, points=V, tets=one.tets)
    names = [f"LM_{k}" for k in range(count)]
    first = {name: np.array([k, k + 7]) for k, name in enumerate(names)} | {"mine": np.array([3])}
    second = {name: np.array([k + 1]) for k, name in reversed(list(enumerate(names)))} | {"yours": np.array([5])}
    asked = []

    def steps(found):
        return found
        yield

    def registered(positions, mine, theirs):
        asked.append((mine, theirs))
        return steps(SimpleNamespace(positions=positions[:, [1, 2, 0]]))

    bodies = iter([one, other])
    monkeypatch.setattr(volume, "_mapped", lambda body, domain, settings: steps((body, next(bodies))))
    monkeypatch.setattr(volume, "registered", registered)
    monkeypatch.setattr(volume, "into_body", lambda first, second, placed: steps(first))
    monkeypatch.setattr(volume, "TetLocation", lambda *_: SimpleNamespace(values=lambda _points, places: places))
    given = VolumeBody("one", V, F, first), VolumeSettings("body"), VolumeBody("other", V, F, second)
    found = drain(mapped_volume(*given))
    # Places in the ball are those of the ball as it was turned.
    np.testing.assert_array_equal(found.ball, V[:, [1, 2, 0]] if count >= 3 else V)
    assert len(asked) == (count >= 3)
    for mine, theirs in asked:
        np.testing.assert_allclose(mine, [(V[k] + V[k + 7]) / 2 for k in range(count)])
        np.testing.assert_allclose(theirs, [2 * V[k + 1] for k in range(count)])


def test_a_vtu_file_holds_what_it_is_given():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1 / 3]])
    text = vtu_text(points, np.array([[0, 1, 2, 3]]), {"OMT Ball": 2 * points}, {"OMT Dilation": np.array([0.5])})
    piece = ET.fromstring(text).find("UnstructuredGrid/Piece")
    assert piece.attrib == {"NumberOfPoints": "4", "NumberOfCells": "1"}
    arrays = {a.get("Name"): a.text.split() for a in piece.iter("DataArray")}
    np.testing.assert_array_equal(np.array(arrays["Points"], float).reshape(-1, 3), points)
    np.testing.assert_array_equal(np.array(arrays["OMT Ball"], float).reshape(-1, 3), 2 * points)
    assert arrays["connectivity"] == ["0", "1", "2", "3"] and arrays["offsets"] == ["4"] and arrays["types"] == ["10"]
