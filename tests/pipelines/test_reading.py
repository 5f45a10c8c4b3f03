"""What is read of a mesh: pins of all of it, and of what is worked on."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from readings import reading

from omt_uv.pipelines.reading import check_uvs
from omt_uv.solver.errors import NonFiniteError


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", [0, 1])
def test_uvs_that_are_nowhere_are_refused_of_the_polygons_that_are_asked_for(wrong, axis):
    V, F = meshes.grid(2, 2)
    surface = reading(V, F).surface
    rng = np.random.default_rng(axis)
    for polygon in range(len(F)):
        uv = V[F].reshape(-1, 3)[:, :2].copy()
        uv[3 * polygon + polygon % 3, axis] = wrong
        for faces in (None, *(rng.random((6, len(F))) < 0.5)):
            if faces is not None and not faces[polygon]:
                check_uvs(surface, uv, faces)
                continue
            with pytest.raises(NonFiniteError) as caught:
                check_uvs(surface, uv, faces)
            assert caught.value.elements.tolist() == [polygon] and caught.value.kind == "face"


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
