"""Bodies whose surface a library replaces: landmarks go along, and what is wrong is said of the new surface."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.pipelines.volumes import volume
from omt_uv.solver.errors import FoldedUVError, LibraryError, TetrahedraError


@pytest.mark.parametrize(
    "fault", [None, LibraryError("No library"), FoldedUVError("Folded", kind="face", elements=[1])]
)
@pytest.mark.parametrize("replaced", [True, False])
def test_landmarks_go_to_the_nearest_vertices_of_the_new_surface(fault, replaced, monkeypatch):
    old = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]])
    new = SimpleNamespace(vertices=old[[2, 0, 1]] + 0.1, triangles="new triangles", mesh="mesh")
    body = volume.VolumeBody(
        "it", old, "triangles", {"a": np.array([0, 3]), "b": np.array([1]), "c": np.array([2, 0, 2])}
    )
    asked = []

    def mapped(*given, **more):
        asked.append((given, more))
        return done(fault or "map", 0.0, 1.0)

    monkeypatch.setattr(volume, "filled", lambda positions, triangles, count: new)
    monkeypatch.setattr(volume, "volume_map", mapped)
    settings = volume.VolumeSettings(library=volume.TETWILD if replaced else "tetgen", count=77)
    steps = volume._mapped(body, "cube", settings)
    if fault is not None:
        with pytest.raises((LibraryError, FoldedUVError, TetrahedraError)) as caught:
            told(steps)
        if replaced and isinstance(fault, FoldedUVError):
            assert type(caught.value) is TetrahedraError and "Around the tetrahedra of fTetWild: Folded" in str(
                caught.value
            )
        else:
            assert caught.value is fault
        return
    (found, what), _ = told(steps)
    ((given, more),) = asked
    assert what == "map"
    if not replaced:
        assert (found is body and given == (old, "triangles", "cube", settings.method, 77)) or given[1] == "triangles"
        return
    assert given[0] is new.vertices and given[1:] == ("new triangles", "cube", settings.method)
    assert more == {"mesh": "mesh", "held": False}
    assert {k: v.tolist() for k, v in found.landmarks.items()} == {"a": [0, 1], "b": [2], "c": [0, 1]}
    assert found.positions is new.vertices and found.triangles == "new triangles" and found.name == "it"
