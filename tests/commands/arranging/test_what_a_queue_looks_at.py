"""A last look at each mesh of a queue: at the UVs that it has then, of faces that were left out as well."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from readings import reading


@pytest.mark.parametrize("there", [True, False])
@pytest.mark.parametrize("mapped", [[], [3, 4, 5], list(range(6))])
def test_uvs_that_stay_are_looked_at_as_they_are(package, monkeypatch, there, mapped):
    queue, gate = package("commands.arranging.queue"), package("pipelines.gate")
    uv = np.arange(12, dtype=float).reshape(6, 2) / 12
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
    given = SimpleNamespace(reading=reading(np.array(points, float), np.array([[0, 1, 2], [1, 3, 2]])), seen=[])
    mesh = replace(given.reading, uv=uv if there else None, pinned=np.zeros(6, bool) if there else None)

    def looked(readings):
        given.seen += [r.uv for r in readings]
        return gate.Gate(2, 1, 0.0)

    monkeypatch.setattr(gate, "gate", looked)
    new = np.full((len(mapped), 2), 0.5)
    layout = SimpleNamespace(corners=[np.array(mapped, int)], uv=[new], warnings=[(0, "one"), (0, "one"), (0, "two")])
    done = queue._Done()
    for name in "AB":
        queue._take(done, name, mesh, layout)
    expected = uv.copy() if there else np.zeros((6, 2))
    expected[mapped] = 0.5
    for found in given.seen:
        np.testing.assert_array_equal(found, expected)
    # The same is said once of each, by its place.
    folded = gate.Gate(2, 1, 0.0).warnings()[0]
    assert done.warnings == [(k, text) for k in (0, 1) for text in ("one", "two", folded)]
    assert done.objects == ["A", "B"] and (mesh.uv is None or (mesh.uv == uv).all())


@pytest.mark.parametrize("steps", [3, 9, 10, 11, 30])
def test_all_steps_of_a_mesh_together_have_so_many_seconds(package, monkeypatch, steps):
    queue, clock = package("commands.arranging.queue"), [100.0]
    monkeypatch.setattr(queue.time, "monotonic", lambda: clock[0])

    def mapped():
        for k in range(steps):
            clock[0] += 0.5
            yield k
        return "done"

    seen = []

    def within():
        found = yield from queue._within(mapped(), SimpleNamespace(limit=5.0))
        seen.append(found)

    if steps <= 10:
        assert list(within()) == list(range(steps)) and seen == ["done"]
    else:
        with pytest.raises(queue.TooSlowError, match="more than 5 s"):
            list(within())
        assert clock[0] == 105.5
