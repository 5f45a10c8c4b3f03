"""Outlines that are circles or straight sides, and others."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing.outline import centroid, fitted_circle, recognise_outline
from omt_uv.solver.mesh.topology import boundary_loops


def outline_of(V, F, change=lambda w: w):
    w, loop = change(V[:, :2] @ [1, 1j]), boundary_loops(F)[0]
    return recognise_outline(w, loop), w, loop


@pytest.mark.parametrize("change", [lambda w: w, lambda w: 1e-3 * w + 5j, lambda w: 1e3 * np.exp(1j) * w])
def test_circles_and_sides_are_recognised_anywhere(change):
    disk = meshes.polar(lambda t: t, lambda t: 0 * t, 4, 24)
    found, w, loop = outline_of(*disk, change)
    assert found.kind == "circle" and np.ptp(np.abs(found.w[loop])) < 1e-12 * np.abs(w).max()
    np.testing.assert_allclose(found.w + found.centre, w, atol=1e-9 * np.abs(w).max())
    found, w, loop = outline_of(*meshes.grid(5, 4, 3.0, 2.0), change)
    assert found.kind == "sides" and found.centre == 0
    np.testing.assert_allclose(found.w, w, atol=1e-9 * np.abs(w).max())


def test_vertices_are_moved_onto_straight_sides_and_corners_stay():
    V, F = meshes.grid(8, 8)
    inner = (V[:, :2] > 0).all(1) & (V[:, :2] < 1).all(1)
    V[:, :2] += np.where(inner[:, None] | np.isin(V[:, :2], [0, 1]).all(1)[:, None], 0, 1e-4 * np.sin(9 * V[:, :2]))
    found, w, loop = outline_of(V, F)
    assert found.kind == "sides"
    corners = np.isin(np.round(w, 9), [0, 1, 1j, 1 + 1j])
    np.testing.assert_array_equal(found.w[corners], w[corners])
    p = found.w[loop]
    away = np.minimum(np.minimum(np.abs(p.real), np.abs(p.real - 1)), np.minimum(np.abs(p.imag), np.abs(p.imag - 1)))
    assert away.max() < 1e-12 and inner.sum() == 49
    np.testing.assert_array_equal(found.w[inner], w[inner])


@pytest.mark.parametrize("mesh", [meshes.random_disk, lambda: meshes.polar(lambda t: t, lambda t: 0 * t, 2, 9)])
def test_other_outlines_are_free(mesh):
    V, F = mesh()
    stretched = V * [1.0, 2.5, 1.0]
    found, w, _ = outline_of(stretched, F)
    assert found.kind == "free" and found.w is w and found.centre == 0


def test_the_centroid_is_that_of_the_area():
    corner = np.array([0, 3, 3 + 2j, 2j]) + (100 - 7j)
    middle, area = centroid(corner)
    assert middle == pytest.approx(101.5 - 6j) and area == pytest.approx(6)
    # More vertices along a side change nothing, another direction the sign.
    more = np.insert(corner, 1, [101 - 7j, 101.1 - 7j])
    assert centroid(more)[0] == pytest.approx(middle) and centroid(corner[::-1])[1] == pytest.approx(-6)
    assert centroid(np.array([0, 1, 2.0])) == (1, 0)


def test_a_circle_is_found_from_points_that_lie_on_it_unevenly():
    angle = 2 * np.pi * np.linspace(0, 1, 40, endpoint=False) ** 2
    points = 3 - 2j + 0.25 * np.exp(1j * angle)
    centre, radius = fitted_circle(points)
    assert abs(centre - (3 - 2j)) < 1e-12 and radius == pytest.approx(0.25, rel=1e-12)
    assert abs(centroid(points)[0] - centre) > 1e-4
    found = recognise_outline(points, np.arange(40))
    assert found.kind == "circle" and abs(found.centre - centre) < 1e-12


def test_half_a_disk_is_no_circle():
    half = np.exp(1j * np.linspace(0, np.pi, 30))
    assert recognise_outline(half, np.arange(30)).kind != "circle"


def test_a_long_curve_that_turns_by_little_at_every_vertex_is_no_side():
    """A strip bent into half a ring, as that of a knotted tube: four corners, and no straight line between two."""
    t = np.pi * np.linspace(0, 1, 400)
    outline = np.concatenate([1.1 * np.exp(1j * t), np.exp(1j * t[::-1])])
    found = recognise_outline(outline, np.arange(len(outline)))
    assert found.kind == "free" and np.array_equal(found.w, outline)
