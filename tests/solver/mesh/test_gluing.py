"""Triangles of corners: what is glued hangs together, and turns over as one."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.gluing import (
    components,
    corner_classes,
    groups,
    orientations,
    polygon_gluing,
    polygon_sides,
    turn_over,
)
from omt_uv.solver.mesh.repair import repaired_gluing
from omt_uv.solver.mesh.surface import strict_gluing, triangle_surface


def glued(V, F, seams=()):
    surface = triangle_surface(V, F, seams)
    return repaired_gluing(surface, np.ones(len(F), bool), surface.triangles, surface.triangle_face).gluing


@pytest.mark.parametrize(("mesh", "vertices"), [(meshes.grid(), 81), (meshes.torus(24, 12), 288)])
def test_classes_of_corners_are_vertices(mesh, vertices):
    gluing = glued(*mesh)
    assert len(np.unique(corner_classes(gluing))) == vertices
    np.testing.assert_array_equal(components(gluing), 0)
    # They are kept for all that ask.
    with pytest.raises(ValueError, match="read-only"):
        corner_classes(gluing)[0] = 1


@pytest.mark.parametrize("polygon", [[0, 1, 2, 3, 4], [0, 1, 0, 2], [0, 0, 1, 2], [0, 1, 1, 0, 2], [0, 1, 2, 0, 1]])
@pytest.mark.parametrize("turn", range(5))
def test_a_polygon_alone_has_a_class_for_each_corner_and_looks_one_way(polygon, turn):
    """However often it uses a vertex, and wherever it is cut: of a diagonal between corners on one vertex the vertices
    do not tell which way it runs."""
    polygon = np.array(polygon)
    size = len(polygon)
    corner = (np.arange(size) + turn) % size
    triangles = np.column_stack([np.full(size - 2, corner[0]), corner[1:-1], corner[2:]])
    gluing = polygon_gluing(triangles, np.zeros(size - 2, int), polygon, np.array([0, size]))
    assert len(gluing.first) == size - 3 and not gluing.parallel().any()
    assert len(np.unique(corner_classes(gluing))) == size
    parts, turned = orientations(gluing, np.ones(size - 2))
    assert len(np.unique(turned)) == 1


def test_seams_are_not_glued():
    V, F = meshes.grid(2, 1)
    # The middle column of edges cuts the grid in two, and doubles its vertices.
    middle = np.flatnonzero(np.isclose(V[:, 0], 0.5))
    gluing = glued(V, F, [middle])
    assert components(gluing).max() == 1 and len(np.unique(corner_classes(gluing))) == len(V) + 2


def test_cut_open_again():
    V, F = meshes.grid()
    gluing = glued(V, F)
    apart = gluing.without(np.ones(len(gluing.first), bool))
    assert components(apart).max() + 1 == len(F)
    assert len(np.unique(corner_classes(apart))) == F.size


def test_some_turned_faces_are_turned_back():
    V, F = meshes.icosphere(2)
    wrong = np.random.default_rng(0).random(len(F)) < 0.3
    gluing = glued(V, np.where(wrong[:, None], F[:, ::-1], F))
    area = face_areas(V, F)
    turned, one_sided = orientations(gluing, area)
    np.testing.assert_array_equal(turned, wrong)
    assert not one_sided.any()
    right = turn_over(gluing, turned)
    assert gluing.parallel().any() and not right.parallel().any()
    assert not orientations(right, area)[0].any()


def test_what_looks_to_either_side_with_as_much_area_looks_one_way_in_the_end():
    V, F = meshes.grid(4, 4)
    for wrong in (np.arange(len(F)) % 2 == 0, np.arange(len(F)) < len(F) // 2):
        gluing = glued(V, np.where(wrong[:, None], F[:, ::-1], F))
        for area in (np.ones(len(F)), np.zeros(len(F))):
            turned, one_sided = orientations(gluing, area)
            assert turned.sum() == len(F) / 2 and not one_sided.any()
            assert gluing.parallel().any() and not turn_over(gluing, turned).parallel().any()


def test_a_moebius_strip_has_one_side():
    n = 12
    a, b = np.arange(n), n + np.arange(n)
    following = np.r_[np.arange(1, n), 0]
    c, d = a[following], b[following]
    c[-1], d[-1] = b[0], a[0]
    F = np.concatenate([np.column_stack([a, c, b]), np.column_stack([c, d, b])])
    gluing = glued(np.random.default_rng(0).random((2 * n, 3)), F)
    turned, one_sided = orientations(gluing, np.ones(len(F)))
    assert one_sided.all() and not turned.any()


def test_diagonals_are_no_sides():
    surface = meshes.polygon_surface(*meshes.quad_grid(3, 3))
    gluing = polygon_gluing(surface.triangles, surface.triangle_face, surface.corner_vertex, surface.face_start)
    assert gluing.side.sum() == 4 * 9 and len(gluing.first) == 9
    np.testing.assert_array_equal(components(gluing), surface.triangle_face)
    backwards = polygon_sides(surface.face_start, surface.triangles[:, ::-1])
    assert backwards.sum() == gluing.side.sum()
    assert components(strict_gluing(surface)).max() == 0


def test_groups_of_labels():
    assert [g.tolist() for g in groups(np.array([2, 0, 2, 1, 0]))] == [[1, 4], [3], [0, 2]]
