"""Elements of polygons: their areas are those that the figures count, whichever diagonal cuts them."""

import numpy as np
import polygons
import pytest

from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.energy import area_error
from omt_uv.solver.maps.polygon_elements import polygon_elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.polygon_areas import polygon_areas


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
