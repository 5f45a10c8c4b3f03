"""What is read of a mesh: pins of all of it, and of what is worked on."""

from dataclasses import replace

import meshes
import numpy as np
from readings import reading


def test_without_uvs_there_are_no_pins():
    V, F = meshes.grid(2, 2)
    assert reading(V, F).pins is None and reading(V, F).all_pins is None


def test_pins_outside_of_the_chosen_polygons_do_not_count():
    V, F = meshes.grid(2, 2)
    pinned, faces = np.zeros(F.size, bool), np.zeros(len(F), bool)
    pinned[:3], faces[1:] = True, True
    found = reading(V, F, V[:, :2], faces, pinned)
    assert found.pins is None
    assert (found.all_pins.pinned == pinned).all()
    pinned[3] = True
    found = reading(V, F, V[:, :2], faces, pinned)
    assert found.pins.pinned.nonzero()[0].tolist() == [3]
    assert found.pins.uv is found.uv


def test_uvs_without_pins_and_pins_without_uvs_are_none():
    V, F = meshes.grid(2, 2)
    found = reading(V, F, V[:, :2])
    for bare in (replace(found, pinned=None), replace(found, uv=None), replace(found, uv=None, pinned=None)):
        assert bare.all_pins is None and bare.pins is None
