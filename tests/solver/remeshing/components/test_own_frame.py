"""A surface's own frame is the same however the surface is told, and leads back to what was given."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from told_otherwise import WAYS, body

from omt_uv.solver.errors import NonFiniteError, OrientationError, ZeroAreaFaceError
from omt_uv.solver.remeshing.components.own_frame import STEP, in_own_frame

NONE = np.zeros((0, 2), np.int64)
BODIES = {"body": body, "patch": lambda: meshes.bumpy(6, 7), "head": meshes.head}


def lopsided(name):
    V, F = BODIES[name]()
    return V * [1.0, 1.6, 0.7] + 0.1 * V[:, [1, 2, 0]] ** 2 + 0.05 * V[:, [2, 0, 1]] ** 2, F


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
@pytest.mark.parametrize("name", BODIES)
def test_it_is_the_same_however_the_surface_is_told(name, way):
    V, F = lopsided(name)
    told, before = way(V, F), in_own_frame(V, F, F[:5, :2])
    mine = F[:5, :2] if told.vertices.shape == V.shape else NONE
    if way.__name__ == "other_vertices_first":
        mine = np.array([np.flatnonzero((told.vertices == V[v]).all(axis=1))[0] for v in mine.ravel()]).reshape(-1, 2)
    after = in_own_frame(told.vertices, told.faces, mine)
    assert np.array_equal(after.triangles, before.triangles) and np.array_equal(after.features, before.features)
    # The places are the same but where rounding in space meets rounding in the frame.
    off = np.abs(after.vertices - before.vertices)
    assert off.max() <= STEP * 1.01 and (off > 0).sum() <= 2
    if not way.__name__.startswith(("turned", "moved", "enlarged")):
        assert off.max() == 0


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
@pytest.mark.parametrize("name", BODIES)
def test_it_leads_back_to_what_was_given(name, way):
    told = way(*lopsided(name))
    frame = in_own_frame(told.vertices, told.faces, told.faces[:, :2])
    size = np.ptp(told.vertices, axis=0).max()
    np.testing.assert_allclose(frame.places(frame.vertices), told.vertices[frame.used], rtol=0, atol=2 * STEP * size)
    assert np.array_equal(
        np.take_along_axis(told.faces[frame.rows], frame.turn, axis=1), frame.used[frame.triangles]
    ) and np.array_equal(np.sort(frame.rows), np.arange(len(told.faces)))
    assert np.array_equal(
        np.unique(np.sort(told.faces[:, :2]), axis=0), np.unique(np.sort(frame.used[frame.features]), axis=0)
    )
    random = np.random.default_rng(0)
    faces, bary = random.integers(0, len(told.faces), 50), random.dirichlet(np.ones(3), 50)
    there = np.einsum("kc,kcj->kj", bary, frame.places(frame.vertices)[frame.triangles[faces]])
    given, mine = frame.on_given(faces, bary)
    on = np.einsum("kc,kcj->kj", mine, told.vertices[told.faces[given]])
    np.testing.assert_allclose(on, there, rtol=0, atol=2 * STEP * size)
    # It is no mirror image.
    assert np.linalg.det(frame.axes) == pytest.approx(1) and frame.size > 0 and frame.box_size > 0


def test_densities_go_along_and_forget_what_sums_round():
    V, F = lopsided("body")
    frame, random = in_own_frame(V, F, NONE), np.random.default_rng(1)
    density = np.exp(random.normal(scale=20, size=len(F)))
    found = frame.density(density)
    np.testing.assert_allclose(found, density[frame.rows], rtol=2.0**-32)
    noisy = density * (1 + 1e-15 * random.normal(size=len(F)))
    assert (frame.density(noisy) != found).sum() <= 1 and np.array_equal(
        frame.density(np.ones(len(F))), np.ones(len(F))
    )


def test_loose_vertices_play_no_part():
    V, F = lopsided("body")
    far = np.vstack([[[1e9, np.nan, np.inf]], V, [[7.0, 8.0, 9.0]]])
    frame, other = in_own_frame(V, F, F[:3, :2]), in_own_frame(far, F + 1, np.vstack([F[:3, :2] + 1, [[0, 1]]]))
    assert np.array_equal(frame.vertices, other.vertices) and np.array_equal(frame.features, other.features)
    assert np.array_equal(frame.used + 1, other.used)


@pytest.mark.parametrize("broken", ["none", "nan", "one place"])
def test_what_has_no_frame_stays_as_it_is(broken):
    V, F = lopsided("body")
    if broken == "none":
        F = F[:0]
    elif broken == "nan":
        V[F[3, 1], 1] = np.nan
    else:
        V = np.full_like(V, 3.0)
    frame = in_own_frame(V, F, NONE)
    assert np.array_equal(frame.used[frame.triangles], F) and np.array_equal(frame.rows, np.arange(len(F)))
    assert np.array_equal(frame.vertices, V[frame.used], equal_nan=True)
    assert broken == "nan" or np.array_equal(frame.places(frame.vertices), V[frame.used])


def test_bodies_whose_axes_are_not_told_apart_keep_those_given():
    """Elsewhere and in another unit they are the same; turned they are not, to no fault of their own."""
    V, F = meshes.torus()
    frame = in_own_frame(V, F, NONE)
    assert np.array_equal(frame.axes, np.eye(3))
    other = in_own_frame(3.7 * V + [5, -3, 11], F, NONE)
    assert np.abs(other.vertices - frame.vertices).max() <= STEP * 1.01
    assert (other.vertices != frame.vertices).sum() <= 2


@pytest.mark.parametrize("power", [-1000, -300, 300, 1018])
def test_the_unit_plays_no_part(power):
    V, F = lopsided("body")
    frame, other = in_own_frame(V, F, NONE), in_own_frame(np.ldexp(V, power), F, NONE)
    assert np.array_equal(frame.vertices, other.vertices) and np.array_equal(frame.triangles, other.triangles)
    np.testing.assert_allclose(np.ldexp(other.places(other.vertices), -power), frame.places(frame.vertices), atol=1e-12)


@pytest.mark.parametrize("error", [NonFiniteError, OrientationError, ZeroAreaFaceError])
def test_errors_name_the_given_elements(error):
    V, F = lopsided("body")
    frame = in_own_frame(np.vstack([V[:1], V]), F + 1, NONE)
    mine = {"vertex": frame.used[[5, 2]], "edge": frame.used[[[7, 3], [1, 4]]], "face": frame.rows[[9, 4, 6]]}
    for kind, here in {"vertex": [5, 2], "edge": [[7, 3], [1, 4]], "face": [9, 4, 6]}.items():
        with pytest.raises(error) as caught, frame.named():
            raise error("Wrong", "Mend it", kind, here)
        assert np.array_equal(np.sort(caught.value.elements, axis=None), np.sort(mine[kind], axis=None))
        assert (caught.value.cause, caught.value.remedy, caught.value.kind) == ("Wrong", "Mend it", kind)
        assert np.array_equal(caught.value.elements, np.unique(caught.value.elements, axis=0))
    with pytest.raises(error) as caught, frame.named():
        raise error("Wrong as a whole")
    assert len(caught.value.elements) == 0
