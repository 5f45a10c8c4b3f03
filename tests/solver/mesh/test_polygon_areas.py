"""Areas of polygons: exact where plane, the same however they are cut, sums of triangles where they must be."""

import numpy as np
import polygons
import pytest

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.polygon_areas import (
    BOTH,
    polygon_areas,
    polygon_fans,
    quad_areas,
    quad_corners,
    quads,
    triangle_pairs,
)


def of_each(V, faces, turn=0):
    """Areas (f,) of polygons that are cut from a corner."""
    F, owner = polygons.cut(faces, turn)
    return np.bincount(owner, polygon_areas(V, F, owner))


@pytest.mark.parametrize("scene", [polygons.wavy_quads, polygons.wavy_mixed])
def test_areas_do_not_depend_on_the_diagonals(scene):
    V, faces, _ = scene()
    for turn in range(1, 8):
        assert of_each(V, faces, turn) == pytest.approx(of_each(V, faces), rel=1e-13)


def test_plane_polygons_have_their_area():
    corners = np.exp(2j * np.pi * np.arange(7) / 7)
    V = np.column_stack([corners.real, corners.imag, corners.real + 2])
    assert of_each(V, [np.arange(7)]) == pytest.approx([3.5 * np.sin(2 * np.pi / 7) * np.sqrt(2)])


def test_a_quad_has_the_mean_of_both_triangulations():
    V = np.array([[0, 0, 0], [1, 0, 0.5], [1, 1, 0], [0, 1, 0.3]])
    both = [face_areas(V, np.array(t)).sum() for t in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]])]
    assert both[0] != pytest.approx(both[1])
    assert of_each(V, [np.arange(4)]) == pytest.approx([np.mean(both)])


@pytest.mark.parametrize("turn", range(4))
def test_a_flat_dart_has_its_own_area_and_a_bent_one_the_mean(turn):
    """Bent by more and more its area has no jump."""
    Q = np.roll([np.arange(4)], turn, axis=1)

    def area(height):
        V = np.array([[0, 0, height], [2, 0, 0], [0.3, 0.3, 0], [0, 2, 0]])
        mean = face_areas(V, Q[:, BOTH].reshape(-1, 3)).sum() / 2
        return quad_areas(V, Q)[0], mean

    assert area(0.0)[0] == pytest.approx(0.6) and area(0.0)[1] > 1.3
    own, mean = np.array([area(h) for h in np.linspace(0, 3, 3001)]).T
    assert np.abs(np.diff(own)).max() < 0.02 and own[-1] == mean[-1] and (own <= mean).all()


def test_a_deep_concave_polygon_is_the_sum_of_its_triangles():
    """A U: its centre is outside, and a fan around it would count twice."""
    V = np.array([[0, 0, 0], [3, 0, 0], [3, 3, 0], [2, 3, 0], [2, 1, 0], [1, 1, 0], [1, 3, 0], [0, 3, 0]], float)
    F = np.array([[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7]])
    assert polygon_areas(V, F, np.zeros(6, int)).sum() == pytest.approx(7)


def test_triangles_of_their_own_keep_their_bits():
    V, faces, _ = polygons.wavy_mixed()
    F, owner = polygons.cut(faces)
    area = face_areas(V, F)
    assert np.array_equal(polygon_areas(V, F), area)
    assert np.array_equal(polygon_areas(V, F, np.arange(len(F))[::-1]), area)
    single = np.bincount(owner)[owner] == 1
    assert single.any() and np.array_equal(polygon_areas(V, F, owner)[single], area[single])


def test_quads_go_around_their_corners():
    _, faces, _ = polygons.wavy_mixed()
    for turn in range(4):
        F, owner = polygons.cut(faces, turn)
        found = F.ravel()[quads(F, owner)]
        expected = [p for p in faces if len(p) == 4]
        assert len(found) == len(expected)
        for mine, given in zip(found, expected, strict=True):
            start = int(np.flatnonzero(mine == given[0])[0])
            assert np.array_equal(np.roll(mine, -start), given)


def test_two_triangles_that_only_touch_are_no_quad():
    F = np.array([[0, 1, 2], [2, 3, 4], [0, 1, 2], [2, 1, 3]])
    first, second = triangle_pairs(np.array([0, 0, 1, 1]))
    assert (first.tolist(), second.tolist()) == ([0, 2], [1, 3])
    assert quad_corners(F, first, second)[1].tolist() == [False, True]


def test_fans_are_the_polygons_around_their_centres():
    """Of a pentagon and a hexagon in a plane and a quad beside them: the same outlines, areas and turns."""
    corners = [np.exp(2j * np.pi * np.arange(k) / k) + 3 * k for k in (5, 4, 6)]
    w = np.concatenate(corners)
    V = np.column_stack([w.real, w.imag, 0.5 * w.real])
    faces = np.split(np.arange(15), [5, 9])
    for turn in range(4):
        F, owner = polygons.cut(faces, turn)
        centres, fans, of_fan = polygon_fans(V, F, owner)
        np.testing.assert_array_equal(np.bincount(of_fan, minlength=3), [5, 0, 6])
        both = np.concatenate([V, centres])
        normals = np.cross(both[fans[:, 1]] - both[fans[:, 0]], both[fans[:, 2]] - both[fans[:, 0]])
        assert (normals[:, 2] > 0).all()
        for k in (0, 2):
            mine = fans[of_fan == k]
            sides = {(int(a), int(b)) for t in mine for a, b in zip(t, np.roll(t, -1), strict=True) if max(a, b) < 15}
            around = faces[k]
            assert sides == {(int(a), int(b)) for a, b in zip(around, np.roll(around, -1), strict=True)}
            middle = np.unique(mine[mine >= 15])
            assert len(middle) == 1
            np.testing.assert_allclose(both[middle[0]], V[around].mean(axis=0), atol=1e-9)
            whole = face_areas(V, F)[owner == k].sum()
            np.testing.assert_allclose(face_areas(both, mine), whole / len(mine), rtol=1e-9)


@pytest.mark.parametrize("dent", [-1e-3, -1e-5, 1e-6, 1e-2])
@pytest.mark.parametrize("short", [1.0, 1e-4])
@pytest.mark.parametrize("turn", range(5))
def test_a_corner_is_straight_by_its_angle_alone_whatever_its_sides_measure(dent, short, turn):
    """The angle of what turns by `dent` is the same between long sides and beside a short one, in either order."""
    angle = np.cumsum([0.0, -dent, 2.0, 1.5])
    for length in ([short, 1.0, 1.0], [1.0, short, 1.0]):
        w = np.concatenate([[0j], np.cumsum(length * np.exp(1j * angle[:3]))])
        w = np.append(w, w[-1] + 0.5 * np.exp(1j * angle[3]))
        F, owner = polygons.cut([np.roll(np.arange(5), turn)], turn)
        V = np.column_stack([w.real, w.imag, np.zeros(5)])
        assert len(polygon_fans(V, F, owner)[1]) == (5 if dent < 0 else 0)


@pytest.mark.parametrize("size", [1e200, -1e180])
def test_what_is_beyond_floats_is_infinite_and_nothing_else_is(size):
    """Not a number is neither large nor small, and whoever sums it has none at all."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    V, F = np.concatenate([size * square, square]), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    with np.errstate(all="ignore"):
        found = polygon_areas(V, F, np.array([3, 3, 8, 8]))
    assert found.tolist() == [np.inf, np.inf, 0.5, 0.5]
