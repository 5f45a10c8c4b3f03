"""Where a head looks to: where its nose and sockets are, however it is turned, and whatever was told to be up."""

import functools
from itertools import product

import meshes
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omt_uv.solver.analysis.facing import (
    CROWN,
    FIGURE,
    UNSURE,
    SceneAxes,
    _on_top,
    _told_by_shape,
    facing,
    standing,
    towards,
    with_a_face,
)
from omt_uv.solver.analysis.saliency import saliency, unit_size
from omt_uv.solver.analysis.symmetry_plane import SymmetryPlane, symmetry_plane


def looked_at(V, F):
    """What both functions are told of a body, wherever it is seen from."""
    return unit_size(V, F), F, saliency(V, F), symmetry_plane(V, F)


def looks_to(V, F, axes=None):
    return facing(*looked_at(V, F), axes)


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


def stands(V, F, axes):
    return standing(*looked_at(V, F), axes)


# What a file with another up is read as: on its back, on its face, and both upside down.
LYING = [(1, -1), (-1, 1), (1, 1), (-1, -1)]


@pytest.mark.parametrize(("up", "viewer"), LYING)
def test_a_head_that_lies_stands_as_if_it_were_set_up_seen_from_its_front(up, viewer):
    V, F = meshes.head(30)
    V = V * [1, 1, 1.4]
    axes = SceneAxes(up=(up, 0.0, 0.0), viewer=(0.0, 0.0, viewer))
    found = stands(V, F, axes)
    np.testing.assert_allclose(found.viewer, [1, 0, 0], atol=0.02)
    np.testing.assert_allclose(found.up, [0, 0, -viewer * up], atol=0.02)
    np.testing.assert_allclose(looks_to(V, F, found).front, [1, 0, 0], atol=0.02)
    # Size, place and order of the faces, and how long axes are, do not matter.
    moved = stands(100 * V + [5, 3, -2], F[::-1], SceneAxes((7.0 * up, 0.0, 0.0), (0.0, 0.0, 5.0 * viewer)))
    np.testing.assert_allclose([moved.up, moved.viewer], [found.up, found.viewer], atol=1e-3)


def figure(legs=0.4):
    """A figure of boxes on two legs of a length, Z up: vertices and triangles, mirrored in the plane y = 0."""
    V, F = meshes.cube()
    V = V - V.mean(axis=0)
    places = [((0, 0, legs / 2 + 0.4), (0.2, 0.6, 0.8 - legs)), ((0, 0, 0.9), (0.2, 0.2, 0.2))]
    places += [((0, side, legs / 2), (0.2, 0.2, legs)) for side in (-0.2, 0.2)]
    return (
        np.concatenate([V / np.ptp(V, axis=0) * size + place for place, size in places]),
        np.concatenate([F + k * len(V) for k in range(len(places))]),
    )


@pytest.mark.parametrize(("up", "viewer"), LYING)
def test_a_figure_that_lies_stands_on_its_legs(up, viewer):
    V, F = figure()
    plane = SymmetryPlane(np.array([0.0, 1.0, 0.0]), 0.0, 0.0, None)
    found = standing(V, F, np.zeros(len(V)), plane, SceneAxes((up, 0.0, 0.0), (0.0, 0.0, viewer)))
    np.testing.assert_allclose([found.up, found.viewer], [[0, 0, 1], [-up * viewer, 0, 0]], atol=1e-12)
    # Short feet, as of a wagon, are none; nor is what has no body.
    for length in (0.1, 0.75):
        wagon = figure(length)
        axes = SceneAxes((up, 0.0, 0.0), (0.0, 0.0, viewer))
        assert standing(*wagon, np.zeros(len(wagon[0])), plane, axes) is axes


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_figure_looks_at_the_viewer_where_nothing_speaks_against_it(side):
    plane = SymmetryPlane(np.array([0.0, 1.0, 0.0]), 0.0, 0.0, None)
    axes = SceneAxes((0.0, 0.0, 1.0), (side, 0.0, 0.0))
    V, F = figure()
    seen = facing(V, F, np.zeros(len(V)), plane, axes)
    assert seen.front @ axes.viewer > 0.99 and seen.certainty >= FIGURE
    # Seen from its side, or from behind when its face is very salient.
    aside = facing(*figure(), np.zeros(len(figure()[0])), plane, SceneAxes((0.0, 0.0, 1.0), (0.0, side, 0.0)))
    assert aside.certainty < FIGURE
    face = np.where((V[:, 0] * side < 0) & (V[:, 2] > 0.7), 1.0, 0.0) * np.linspace(0.5, 1, len(V))
    assert facing(V, F, face, plane, axes).front @ axes.viewer < -0.99


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_is_higher_than_deep_looks_at_the_viewer_if_nothing_speaks_against_it(side):
    """As whoever sits, or an urn: no legs to see, and its front view is what is looked at."""
    plane = SymmetryPlane(np.array([0.0, 1.0, 0.0]), 0.0, 0.0, None)
    axes = SceneAxes((0.0, 0.0, 1.0), (side, 0.0, 0.0))
    V, F = meshes.icosphere(3)
    none = np.zeros(len(V))
    for depth, sure in ((0.8, True), (0.95, False), (1.5, False)):
        seen = facing(unit_size(V * [depth, 0.5, 1], F), F, none, plane, axes)
        assert (seen.certainty >= FIGURE) == sure and seen.front @ axes.viewer > 0.99
    away = np.where(V[:, 0] * side < -0.9, 1.0, 0.0) * np.linspace(0.5, 1, len(V))
    assert facing(unit_size(V * [0.8, 0.5, 1], F), F, away, plane, axes).front @ axes.viewer < -0.99
    aside = facing(unit_size(V * [0.8, 0.5, 1], F), F, none, plane, SceneAxes(axes.up, (0.0, side, 0.0)))
    assert aside.certainty < FIGURE
    # What lies level has no height at all.
    with np.errstate(all="raise"):
        assert _told_by_shape(V * [1, 0.5, 0], F, none, plane, axes, np.zeros(3)) is None


def beast(overhang, legs=0.4):
    """A beast of boxes that holds its head low, Z up, mirrored in the plane y = 0: it is ahead of its feet, x > 0."""
    V, F = meshes.cube()
    V = V - V.mean(axis=0)
    places = [((overhang / 2, 0, legs / 2 + 0.4), (1 + overhang, 0.4, 0.8 - legs))]
    places += [((ahead, side, legs / 2), (0.1, 0.1, legs)) for ahead in (-0.45, 0.45) for side in (-0.15, 0.15)]
    return (
        np.concatenate([V / np.ptp(V, axis=0) * size + place for place, size in places]),
        np.concatenate([F + k * len(V) for k in range(len(places))]),
    )


@pytest.mark.parametrize("ahead", [1.0, -1.0])
def test_a_beast_looks_where_it_is_ahead_of_its_feet_whatever_stands_out_at_its_rump(ahead):
    plane = SymmetryPlane(np.array([0.0, 1.0, 0.0]), 0.0, 0.0, None)
    axes = SceneAxes((0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    for overhang, legs, told in ((0.5, 0.4, True), (0.0, 0.4, False), (0.5, 0.05, False)):
        V, F = beast(overhang, legs)
        V = V * [ahead, 1, 1]
        tail = np.where(V[:, 0] * ahead < -0.4, 1.0, 0.0) * np.linspace(0.5, 1, len(V))
        seen = facing(unit_size(V, F), F, tail, plane, axes)
        assert (seen.front[0] * ahead > 0.99) == told and (not told or seen.certainty >= FIGURE)


def test_a_published_figure_looks_where_its_face_is_wherever_it_is_seen_from():
    for viewer in (1.0, -1.0):
        seen = facing(*published("homer"), SceneAxes((0.0, 1.0, 0.0), (0.0, 0.0, viewer)))
        assert seen.front[2] > 0.99 and seen.certainty >= FIGURE


def test_the_top_of_a_body_is_what_lies_wholly_in_its_highest_share():
    V, F = meshes.icosphere(3)
    top = _on_top(V, F, np.array([0.0, 0.0, 1.0]))
    np.testing.assert_array_equal(top, (V[F, 2] >= 1 - CROWN * 2).all(axis=1))
    assert 0 < top.sum() < len(F)


def test_what_stands_or_cannot_be_told_is_believed():
    V, F = meshes.head(30)
    upright = SceneAxes(up=(0.0, 0.0, 1.0), viewer=(0.0, 1.0, 0.0))
    for axes in (upright, SceneAxes((0.0, 0.0, -1.0), (1.0, 0.0, 0.0)), SceneAxes((0.0, 1.0, 0.0), (1.0, 0.0, 0.0))):
        assert stands(V * [1, 1, 1.4], F, axes) is axes
    # As high as deep; round; without a mirror plane; long and low without a face above or below.
    lying = SceneAxes(up=(1.0, 0.0, 0.0), viewer=(0.0, 0.0, 1.0))
    assert stands(V * [1, 1, 0.9], F, lying) is lying
    assert stands(*meshes.icosphere(3), lying) is lying
    assert standing(unit_size(V, F), F, saliency(V, F), None, lying) is lying
    assert stands(V, F, None) is None
    B, G = meshes.icosphere(4)
    assert stands(B * [0.4, 0.5, 1], G, lying) is lying


def published(name):
    """What is told of a published model, which several tests look at."""
    if meshes.model_path(name) is None:
        pytest.skip("no models")
    return _published(name)


@functools.cache
def _published(name):
    return looked_at(*meshes.load_model(name))


@pytest.mark.parametrize(
    ("name", "front"), [("max_planck", (0, 0, -1)), ("optcuts_face", (0, 0, 1)), ("face", (0, 0, 1))]
)
@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_published_heads_that_lie_look_where_their_faces_are(name, front, up):
    axes = SceneAxes(up=up, viewer=(0.0, -up[2], 0.0))
    found = standing(*published(name), axes)
    assert abs(found.up[1]) > 0.99 and facing(*published(name), found).front @ front > 0.95
    # Without that it is the crown, the neck, or nothing at all.
    assert facing(*published(name), axes).front @ front < 0.1


@pytest.mark.parametrize(("name", "front"), [("spot", 2), ("camel_b", 2), ("cow", 0), ("homer", 2), ("ogre", 2)])
@pytest.mark.parametrize("of", ["head or rump", "side"])
def test_published_models_that_lie_stand_on_their_legs(name, front, of):
    """Seen from above, as where Z is up of a file that is read with Y up."""
    told = published(name)
    ahead, aside = np.eye(3)[front], np.eye(3)[2 - front]
    found = standing(*told, SceneAxes(up=tuple(aside if of == "side" else -ahead), viewer=(0.0, 1.0, 0.0)))
    np.testing.assert_allclose(found.up, [0, 1, 0], atol=0.01)
    upright = facing(*told, SceneAxes(up=(0.0, 1.0, 0.0), viewer=tuple(ahead)))
    assert facing(*told, found).front @ upright.front > 0.99


@pytest.mark.parametrize(
    "name", ["spot", "cow", "camel_b", "homer", "ogre", "armadillo", "lion", "face", "suzanne", "beetle"]
)
def test_published_models_that_stand_are_believed(name):
    axes = SceneAxes(up=(0.0, 1.0, 0.0), viewer=(0.0, 0.0, 1.0))
    assert standing(*published(name), axes) is axes


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
    assert facing(*published(name), None).front @ front > np.cos(np.pi / 4)


STANDING = {
    "figure": lambda: figure(),
    "wagon": lambda: figure(0.1),
    "beast": lambda: beast(0.5),
    "beast that overhangs nothing": lambda: beast(0.0),
    "head": lambda: meshes.head(12),
    "sphere": lambda: meshes.icosphere(2),
}


@pytest.mark.parametrize("body", STANDING)
@pytest.mark.parametrize("place", [*product((-1, 1), repeat=3), (0, 0, 1), (0, 0, -1)], ids=str)
def test_vertices_of_no_face_say_nothing_wherever_they_lie(body, place):
    """A beast has them under its feet, ahead and behind: what is told of it is told of its faces alone."""
    V, F = STANDING[body]()
    V = unit_size(V, F)
    more = np.concatenate([V, V.mean(axis=0) + np.outer([3, 2], place)])
    plane = SymmetryPlane(np.array([0.0, 1.0, 0.0]), 0.0, 0.0, None)
    tail = np.where(V[:, 0] < V[:, 0].min() + 0.1 * np.ptp(V[:, 0]), 1.0, 0.0) * np.linspace(0.5, 1, len(V))
    for axes in (SceneAxes((0.0, 0.0, 1.0), (0.0, -1.0, 0.0)), SceneAxes((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))):
        for saliency_of in (np.zeros(len(V)), tail):
            salient = np.concatenate([saliency_of, [0.0, 1.0]])
            one, other = facing(V, F, saliency_of, plane, axes), facing(more, F, salient, plane, axes)
            np.testing.assert_allclose(other.front, one.front, atol=1e-9)
            assert (other.certainty, other.beast) == pytest.approx((one.certainty, one.beast))
            told = [standing(points, F, s, plane, axes) for points, s in ((V, saliency_of), (more, salient))]
            np.testing.assert_allclose(*([x.up, x.viewer] for x in told), atol=1e-9)
