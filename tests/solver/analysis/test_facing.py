"""Where a head looks to: where its nose and sockets are, however it is turned, and whatever was told to be up."""

import meshes
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omt_uv.solver.analysis.facing import UNSURE, SceneAxes, facing, towards, with_a_face
from omt_uv.solver.analysis.saliency import saliency, unit_size
from omt_uv.solver.analysis.symmetry_plane import symmetry_plane


def looks_to(V, F, axes=None):
    P = unit_size(V, F)
    return facing(P, F, saliency(V, F), symmetry_plane(V, F), axes)


@pytest.mark.parametrize("turn", [np.eye(3), *Rotation.random(1, random_state=1).as_matrix()])
def test_a_head_looks_where_its_nose_is(turn):
    V, F = meshes.head(30)
    unknown = looks_to(V @ turn.T, F)
    assert unknown.front @ turn[:, 0] > np.cos(np.pi / 4) and unknown.certainty == 1 and not unknown.up.any()
    known = looks_to(V @ turn.T, F, SceneAxes(up=turn[:, 2], viewer=turn[:, 0]))
    assert known.front @ turn[:, 0] > 0.99
    wrong = looks_to(V @ turn.T, F, SceneAxes(up=turn[:, 1], viewer=turn[:, 0]))
    np.testing.assert_allclose(wrong.front, unknown.front)
    assert not wrong.up.any()


def test_what_is_round_or_has_no_mirror_looks_nowhere():
    for V, F in (meshes.icosphere(3), meshes.torus()):
        nowhere = looks_to(V, F)
        assert nowhere.certainty == 0 and not nowhere.front.any()
    V, F = meshes.random_disk(300, height=2)
    assert not looks_to(V, F).front.any()


def test_what_says_little_looks_at_the_viewer_and_a_head_where_its_nose_is():
    axes = SceneAxes(up=(0.0, 0.0, 1.0), viewer=(-1.0, 0.0, 0.0))
    # Its plane may be any, so of a round body there is no telling before it has another one.
    V, F = meshes.icosphere(3)
    seen = facing(unit_size(V, F), F, saliency(V, F), None, axes)
    assert seen.front @ axes.viewer > 0.99 and 0 < seen.certainty <= UNSURE
    V, F = meshes.head(30)
    assert looks_to(V, F, axes).front @ axes.viewer < -0.99


@pytest.mark.parametrize("ahead", [1, -1])
def test_a_beast_looks_where_its_head_is_held_up_and_its_chest_is_no_face(ahead):
    """A long body that rises at one end, towards the viewer or away."""
    V, F = meshes.icosphere(4)
    rise = np.clip((V[:, 1] - 0.5) / 0.3, 0, 1)
    V = V * [0.35, 1, 0.3] + np.outer(rise**2 * (3 - 2 * rise), [0, 0, 0.5])
    V[:, 1] *= ahead
    seen = looks_to(V, F, SceneAxes(up=(0.0, 0.0, 1.0), viewer=(0.0, -1.0, 0.0)))
    assert seen.front @ [0, ahead, 0] > 0.99 and seen.beast == 1
    has_face = with_a_face(unit_size(V, F), F, seen)
    assert has_face[V[:, 2].argmax()] == 1 and (has_face[V[:, 2] < 0] == 0).all()
    # Of what stands upright everything has a face.
    upright = looks_to(*meshes.head(30), SceneAxes(up=(0.0, 0.0, 1.0), viewer=(1.0, 0.0, 0.0)))
    assert upright.beast == 0 and (with_a_face(*meshes.head(30), upright) == 1).all()


def test_towards_is_one_at_the_nearest_end_and_minus_one_at_the_other():
    V, F = meshes.icosphere(3)
    direction = V[17]
    value = towards(V, F, direction)
    assert value[17] == pytest.approx(1, abs=0.02) and value.argmax() == 17
    np.testing.assert_allclose(value, V @ direction, atol=0.02)
    assert not towards(V, F, np.zeros(3)).any()


@pytest.mark.parametrize(
    ("name", "front"),
    [("optcuts_face", (0, 0, 1)), ("max_planck", (0, 0, -1)), ("david", (-0.67, 0.73, 0)), ("lion", (-0.23, 0, -0.97))],
)
def test_published_heads_look_where_their_faces_are(name, front):
    if meshes.model_path(name) is None:
        pytest.skip("no models")
    V, F = meshes.load_model(name)
    assert looks_to(V, F).front @ front > np.cos(np.pi / 4)
