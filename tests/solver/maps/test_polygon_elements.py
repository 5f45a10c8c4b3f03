"""Elements of polygons: their areas are those that the figures count, whichever diagonal cuts them."""

import meshes
import numpy as np
import polygons
import pytest

from omt_uv.solver.maps import energy as energy_module
from omt_uv.solver.maps import polygon_elements as elements_module
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.energy import area_error, energies, has_folds
from omt_uv.solver.maps.polygon_elements import energy_in_turn, polygon_elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.polygon_areas import polygon_areas
from omt_uv.solver.refinement.projected_newton import first_fold


@pytest.mark.parametrize("scene", [polygons.wavy_quads, polygons.wavy_mixed])
def test_the_area_error_of_a_refinement_is_that_of_the_figures(scene):
    V, faces, uv = scene()
    for turn in (0, 1):
        F, owner = polygons.cut(faces, turn)
        found = polygon_elements(V, F, face_areas(V, F), owner)
        figures = distortion(V, F, uv[F], polygons=owner, overlap=False)
        assert area_error(found, uv @ [1, 1j]) == pytest.approx(figures.area_l1, rel=1e-12)
        assert len(found.area) == len(faces) and figures.area_l1 > 0.01


def test_triangles_of_a_long_polygon_ask_for_its_area_together():
    corners = np.exp(2j * np.pi * np.arange(30) / 30)
    V = np.column_stack([corners.real, corners.imag, 0.3 * (corners**2).real])
    V = np.concatenate([V, [[2, 0, 0.3]]])
    for turn in (0, 7):
        F, owner = polygons.cut([np.arange(30), np.array([1, 0, 30])], turn)
        found = polygon_elements(V, F, face_areas(V, F), owner)
        asked = found.area * found.ratio
        own = polygon_areas(V, F, owner)
        assert np.sort(asked / asked.sum()) == pytest.approx(np.sort(own / own.sum()), rel=1e-12)


@pytest.mark.parametrize("scene", [polygons.wavy_quads, polygons.wavy_mixed, None])
@pytest.mark.parametrize("many", [False, True])
def test_some_polygons_after_the_others_are_to_the_bit_what_all_at_once_are(scene, many, monkeypatch):
    """Large meshes are measured so, in less memory."""
    if scene is None:
        V, F = meshes.bumpy(9, 7)
        w, owner = V[:, :2] @ [1, 1j], None
    else:
        V, faces, uv = scene()
        (F, owner), w = polygons.cut(faces, 0), uv @ [1, 1j]
    faces = polygon_elements(V, F, face_areas(V, F), owner)
    rng = np.random.default_rng(0)
    step = rng.normal(size=(len(w), 2)) @ [1, 1j]
    weight = rng.random(len(faces.area)) if many else 30.0

    def found():
        plain = energy_in_turn(faces, w, weight), energy_in_turn(faces, w + step, weight), first_fold(faces, w, step)
        return plain, faces.areas(w).tolist(), has_folds(faces, w), has_folds(faces, w + step)

    assert energy_in_turn(faces, w, weight) == energies(faces, w, weight).sum()
    whole = found()
    assert np.isfinite(whole[0][0]) and whole[0][1] == np.inf and 0 < whole[0][2] < 1 and whole[2:] == (False, True)
    for module in (energy_module, elements_module):
        monkeypatch.setattr(module, "AT_ONCE", 7)
    assert found() == whole
    # Nor where what was found of the last map is not kept.
    monkeypatch.setattr(energy_module, "KEPT", 7)
    assert found() == whole
    # A step short of the first fold folds nothing, one beyond it does.
    far = whole[0][2]
    assert [has_folds(faces, w + share * far * step) for share in (0.999, 1.001)] == [False, True]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e4])
def test_flat_quads_have_the_areas_of_their_outlines_darts_too_whichever_diagonal_cuts_them(unit, seed):
    """Sums by plain formula; each asks for its share, and all in one density for as much each."""
    rng = np.random.default_rng(seed)
    corner = np.array([[0, 0], [1, 0.1], [1.1, 1], [0, 0.9]])
    quads = corner + 0.2 * rng.random((12, 4, 2))
    # A third of them are darts: one corner is beyond the diagonal beside it.
    quads[::3, 2] = [0.3, 0.35] + 0.05 * rng.random((4, 2))
    quads = unit * (quads + 3 * np.arange(12)[:, None, None])
    x, y = quads[:, :, 0], quads[:, :, 1]
    outline = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
    V = np.column_stack([quads.reshape(-1, 2), np.zeros(48)])
    for turn in (0, 1):
        F, owner = polygons.cut(np.arange(48).reshape(12, 4), turn)
        found = polygon_elements(V, F, face_areas(V, F), owner)
        order = np.argsort(found.polygon[-48:].reshape(12, 4)[:, 0])
        assert (order == np.arange(12)).all() and found.area == pytest.approx(outline / outline.sum(), rel=1e-9)
        assert found.ratio == pytest.approx(found.ratio.mean(), rel=1e-9)
