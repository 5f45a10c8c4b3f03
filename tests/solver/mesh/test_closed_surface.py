"""Closed surfaces of genus 0 pass at any scale; everything else is refused by name."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import (
    DuplicateFaceError,
    EmptyMeshError,
    NonFiniteError,
    NonManifoldEdgeError,
    NotASphereError,
    OrientationError,
)
from omt_uv.solver.mesh.closed_surface import closed_surface
from omt_uv.solver.mesh.geometry import face_areas

SPHERE = meshes.icosphere(1)


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_a_sphere_in_its_box(scale):
    V, F = SPHERE
    found = closed_surface(scale * (V + 5), F)
    low, high = found.vertices.min(axis=0), found.vertices.max(axis=0)
    np.testing.assert_allclose(low, -high, atol=1e-9)
    assert (high - low).max() == pytest.approx(1) and found.extent == pytest.approx(2 * scale, rel=0.1)
    assert found.warnings == () and (found.triangles == F).all()


def test_faces_without_area_get_some_and_it_is_said():
    V, F = SPHERE
    V = V.copy()
    V[F[0, 0]] = V[F[0, 1]]
    found = closed_surface(V, F)
    assert (face_areas(found.vertices, F) > 0).all() and "no area" in found.warnings[0]


def test_a_face_with_corners_in_line_has_an_area():
    """However its polygon is cut: the second of its two triangles may be a line."""
    V, F = SPHERE
    V = V.copy()
    V[F[0, 0]] = V[F[0, 1]]
    polygons = np.arange(len(F))
    flat = np.flatnonzero(face_areas(V, F) < 1e-12)
    beside = [np.flatnonzero((np.isin(F, F[k]).sum(1) == 2) & (face_areas(V, F) > 1e-12))[0] for k in flat]
    polygons[flat] = polygons[beside]
    assert closed_surface(V, F, polygons).warnings == ()


def two(a, b):
    return np.concatenate([a[0], b[0] + 5]), np.concatenate([a[1], b[1] + len(a[0])])


def pinched():
    """Two spheres that share a vertex."""
    V, F = two(SPHERE, SPHERE)
    F = np.where(len(SPHERE[0]) == F, 0, F)
    used = np.unique(F)
    return V[used], np.searchsorted(used, F)


V, F = SPHERE
WRONG = {
    "empty": ((V, F[:0]), EmptyMeshError, "no faces"),
    "nowhere": ((np.where(np.arange(len(V))[:, None] == 3, np.nan, V), F), NonFiniteError, "finite"),
    "open": ((V, F[1:]), NotASphereError, "not closed"),
    "twice": ((V, np.concatenate([F, F[:1]])), DuplicateFaceError, "same vertices"),
    "fin": (
        (np.concatenate([V, [[2.0, 2, 2]]]), np.concatenate([F, [[*F[0, :2], len(V)]]])),
        NonManifoldEdgeError,
        "More than two",
    ),
    "turned": ((V, np.concatenate([F[:1, ::-1], F[1:]])), OrientationError, "opposite"),
    "repeating": ((V, np.concatenate([F, [[0, 0, 1]]])), NotASphereError, "twice"),
    "loose": ((np.concatenate([V, [[2.0, 2, 2]]]), F), NotASphereError, "no face"),
    "two": (two(SPHERE, SPHERE), NotASphereError, "2 parts"),
    "pinched": (pinched(), NotASphereError, "one vertex"),
    "torus": (meshes.torus(12, 8), NotASphereError, "a handle"),
}


@pytest.mark.parametrize("name", WRONG)
def test_refused(name):
    mesh, error, text = WRONG[name]
    with pytest.raises(error, match=text):
        closed_surface(*mesh)


@pytest.mark.parametrize(
    ("name", "chart", "body"),
    [("torus", "unwrap it with cuts", "fill the tunnels through it"), ("open", "as a chart", "the library tetwild")],
)
def test_what_is_inside_of_a_surface_is_in_no_chart_of_it(name, chart, body):
    """A body was told to be unwrapped with cuts, which maps nothing of its inside."""
    mesh = WRONG[name][0]
    for inside, text, other in ((False, chart, body), (True, body, chart)):
        with pytest.raises(NotASphereError) as caught:
            closed_surface(*mesh, body=inside)
        assert text in str(caught.value) and other not in str(caught.value)
