"""A renumbered mesh is the same mesh, unmirrored, and knows the way back."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import FoldedUVError, PinError
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.refinement.elimination_order import renumbered


@pytest.mark.parametrize("mirror", [1, -1])
def test_there_and_back_is_nothing(mirror):
    V, F = meshes.random_disk(200)
    uv = V[:, :2] * [mirror, 1]
    mesh = renumbered(V, F, uv, None)
    np.testing.assert_array_equal(np.sort(mesh.order), np.arange(len(V)))
    np.testing.assert_array_equal(mesh.original(mesh.uv @ [1, 1j]), uv)
    np.testing.assert_array_equal(mesh.order[mesh.triangles], F)
    np.testing.assert_array_equal(face_areas(mesh.vertices, mesh.triangles), face_areas(V, F))
    assert signed_areas(mesh.uv, mesh.triangles).sum() > 0
    assert mesh.mirror.tolist() == [mirror, 1]


def test_pins_go_along():
    V, F = meshes.grid(6, 6)
    uv = V[:, :2] * [-1, 1]
    pins = np.array([40, 3, 17])
    mesh = renumbered(V, F, uv, (pins, uv[pins]))
    np.testing.assert_array_equal(np.sort(mesh.order[mesh.pins.vertices]), np.sort(pins))
    np.testing.assert_array_equal(mesh.uv[mesh.pins.vertices] @ [1, 1j], mesh.pins.places)


def test_errors_get_the_names_of_the_caller():
    V, F = meshes.grid(6, 6)
    mesh = renumbered(V, F, V[:, :2], None)
    wrong = np.array([2, 30])
    for kind, expected in (("vertex", mesh.order[wrong]), ("face", wrong)):
        error = mesh.original_error(PinError("cause", "remedy", kind, wrong))
        assert isinstance(error, PinError) and (error.cause, error.remedy) == ("cause", "remedy")
        np.testing.assert_array_equal(error.elements, expected)


def test_maps_without_area_are_refused():
    V, F = meshes.grid(3, 3)
    with pytest.raises(FoldedUVError, match="The UVs to refine have no area"):
        renumbered(V, F, np.zeros((len(V), 2)), None)


@pytest.mark.parametrize(
    "polygons, counts", [(None, True), ("each", True), ("a quad", False), ("patches over holes", False)]
)
def test_a_known_order_counts_where_triangles_are_polygons(polygons, counts):
    V, F = meshes.bumpy(6, 6)
    given, each = np.arange(len(V))[::-1], np.arange(len(F))
    several = {"each": each, "a quad": each // 2 * 2, "patches over holes": np.where(each < 2, -1, each)}
    mesh = renumbered(V, F, V[:, :2], None, several.get(polygons), given)
    assert (mesh.order == given).all() == counts
    assert sorted(mesh.order) == list(range(len(V)))
