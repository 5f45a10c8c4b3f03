"""Occlusion by what it means: nothing hides a convex body, a bowl hides its inside, and place and size do not count."""

import meshes
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omt_uv.solver.analysis.occlusion import face_occlusion, in_view, vertex_occlusion


def bowl():
    """A hemisphere with an inner wall, closed along its edge, and the outer faces, (m,) bool."""
    V, F = meshes.hemisphere()
    n = len(V)
    return np.concatenate([V, 0.9 * V]), np.concatenate([F, F[:, ::-1] + n]), np.arange(2 * len(F)) < len(F)


@pytest.mark.parametrize("inwards", [False, True])
def test_nothing_hides_a_convex_body(inwards):
    """Of large faces, of small ones, and of slivers; when the faces look inwards, too."""
    ball, faces = meshes.icosphere(3)
    for V, F in (meshes.cube(), (ball, faces), (ball * [1, 1e-3, 1e-2], faces)):
        assert face_occlusion(V, F[:, ::-1] if inwards else F).max() < 0.01


def test_the_inside_of_a_bowl_is_hidden_and_its_bottom_most():
    V, F, outer = bowl()
    hidden = face_occlusion(V, F)
    assert hidden[outer].max() < 0.05
    assert hidden[~outer].min() > 0.1
    # Light that comes in at the opening of half a sphere: half of it reaches every place.
    assert hidden[~outer].mean() == pytest.approx(0.5, abs=0.05)


def test_occlusion_does_not_depend_on_place_direction_and_size():
    V, F, _ = bowl()
    hidden = face_occlusion(V, F)
    np.testing.assert_allclose(face_occlusion(1e6 * V + 1e7, F), hidden, atol=0.02)
    turned = face_occlusion(V @ Rotation.random(random_state=0).as_matrix(), F)
    assert np.abs(turned - hidden).mean() < 0.02
    assert np.abs(turned - hidden).max() < 0.15


def test_tiny_faces_beside_huge_ones_are_hidden_as_these_are():
    """A ball of tiny faces in a closed box of huge ones is not seen from anywhere, and hides nothing outside."""
    V, F = meshes.icosphere(3)
    box, sides = meshes.cube()
    hidden = face_occlusion(np.concatenate([box, 0.5 + 1e-2 * V]), np.concatenate([sides, F + len(box)]))
    assert hidden[: len(sides)].max() < 0.01
    assert hidden[len(sides) :].min() > 0.9


def test_vertices_have_the_mean_of_their_faces_and_loose_ones_nothing():
    V, F, outer = bowl()
    hidden = vertex_occlusion(np.concatenate([V, [[9.0, 9.0, 9.0]]]), F)
    assert hidden[-1] == 0
    assert hidden[: len(V) // 2].max() < 0.05 < hidden[len(V) // 2 : -1].min()


@pytest.mark.parametrize("value", [0.0, 0.3, 1.0])
def test_what_is_the_same_on_all_faces_is_the_same_at_all_vertices(value):
    """Whatever their areas; and a mean is between the least and the greatest around a vertex."""
    V, F = meshes.bumpy(7, 5)
    V = V * [1, 30, 1]
    sides = np.full((2, len(F)), value)
    assert vertex_occlusion(V, F, sides) == pytest.approx(np.full(len(V), value))
    sides = np.random.default_rng(3).uniform(0, 1, len(F)) * np.ones((2, 1))
    found = vertex_occlusion(V, F, sides)
    for k in range(len(V)):
        around = sides[0, (k == F).any(axis=1)]
        assert around.min() - 1e-12 <= found[k] <= around.max() + 1e-12


def test_a_patch_shows_the_cosine_of_its_slant_and_its_back_shows_nothing():
    """From all around, whatever of it is whose; and what lies below another one is not seen from above."""
    V, F = meshes.grid(6, 6)
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(30, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    normal = np.cross(V[F[0, 1]] - V[F[0, 0]], V[F[0, 2]] - V[F[0, 0]])
    cosine = directions @ (normal / np.linalg.norm(normal))
    shown = in_view(V, F, directions)
    assert (cosine < 0).any() and (shown[cosine < 0] == 0).all()
    front = cosine > 0.2
    np.testing.assert_allclose(shown[front], np.broadcast_to(cosine[front, None], shown[front].shape), atol=0.02)
    both = np.concatenate([V, V + normal / np.linalg.norm(normal)]), np.concatenate([F, F + len(V)])
    above = in_view(*both, normal[None] / np.linalg.norm(normal))[0]
    assert above[: len(F)].max() == 0 and above[len(F) :].min() > 0.98
