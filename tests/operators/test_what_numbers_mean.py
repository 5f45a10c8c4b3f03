"""What every operator writes belongs to the vertex, the face and the corner that it is about, whatever their numbers
are, and a mirror image gets the mirror image of it."""

from __future__ import annotations

import numpy as np
import operator_runs
import pytest
import renumbered
from operator_runs import RUNS, Scene
from renumbered import KINDS, alike


@pytest.fixture(scope="module")
def uvs(package):
    return operator_runs.some_uvs()


# How far apart the sides of faces in the UVs of a mirror image may be, of a texture: areas are made in steps.
APART = {"unwrap": 2e-4, "sphere": 2e-2}


def sides(told, faces, name):
    """Those of all faces; islands that are mirror images are packed at another scale."""
    found = np.concatenate([renumbered.sides(one["UVMap"], faces) for one in told.values()])
    return found / found.mean() * 0.1 if name == "unwrap" else found


@pytest.mark.parametrize("name", RUNS)
def test_what_is_written_does_not_hang_on_numbers_and_a_mirror_image_is_mirrored(uvs, name):
    found = operator_runs.bodies(uvs)
    before = {letter: body.told() for letter, body in found.items()}
    operator_runs.call(name)
    first = {letter: body.told() for letter, body in found.items()}
    faces, changes = found["A"].faces, RUNS[name][2]
    for letter, one in first.items():
        assert changes in one and (
            changes not in before[letter] or not alike(before[letter][changes], one[changes], changes)
        ), letter
    # Cells begin from places at random, face by face.
    for kind in ("vertices", "backwards") if name == "cells" else (*KINDS, "backwards"):
        found = operator_runs.bodies(uvs, Scene(kind, kind == "backwards"))
        operator_runs.call(name)
        other = {letter: body.told() for letter, body in found.items()}
        mirrored = kind == "mirrored"
        if mirrored:
            pair = (sides(told, faces, name) for told in (first, other))
            assert np.abs(np.subtract(*pair)).max() < APART.get(name, 2e-5)
        for letter, one in first.items():
            two = other[letter]
            assert one.keys() == two.keys()
            for key in one.keys() - ({"UVMap"} if mirrored else set()):
                assert alike(one[key], two[key], key, mirrored), (kind, letter, key)
