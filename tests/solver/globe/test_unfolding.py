"""Spheres laid out in the plane: no face torn, areas kept, seams and poles handled."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import icosphere, polygon_surface
from sphere_shapes import random_sphere

from omt_uv.solver.globe.exact_areas import correct_areas, equirectangular_areas
from omt_uv.solver.globe.pole_vertices import POLES, singular_points
from omt_uv.solver.globe.projections import EQUIRECT, LAMBERT, OCTAHEDRAL, PROJECTIONS, to_sphere
from omt_uv.solver.globe.unfolding import Polygons, gather_polygons, unfold
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.spherical_geometry import spherical_areas
from omt_uv.solver.progress import drain


def uv_sphere(rows=12, columns=16, turn=0.0):
    """Quads and, at the poles, triangles, as Blender's UV sphere; column 0 lies on the seam of the projection."""
    latitude = np.pi * (np.arange(1, rows) / rows - 0.5)
    angle = 2 * np.pi * np.arange(columns) / columns + np.pi / 2 + turn
    ring = [(np.cos(t) * np.cos(a), np.cos(t) * np.sin(a), np.sin(t)) for t in latitude for a in angle]
    points = np.array([(0.0, 0, -1), *ring, (0.0, 0, 1)])
    at = lambda row, column: 1 + (row - 1) * columns + column % columns  # noqa: E731
    faces = [[0, at(1, k + 1), at(1, k)] for k in range(columns)]
    faces += [[len(points) - 1, at(rows - 1, k), at(rows - 1, k + 1)] for k in range(columns)]
    for row in range(1, rows - 1):
        faces += [[at(row, k), at(row, k + 1), at(row + 1, k + 1), at(row + 1, k)] for k in range(columns)]
    return points, faces


def triangle_polygons(F):
    m = len(F)
    return Polygons(F.ravel(), np.repeat(np.arange(m), 3), np.arange(3 * m).reshape(m, 3))


SPHERES = {
    "icosphere": lambda: icosphere(3),
    "random": lambda: random_sphere(400),
    "dense": lambda: random_sphere(900, 1, (0.3, 0.2, 0.5)),
    "coarse": lambda: random_sphere(60, 2),
}


@pytest.fixture(params=SPHERES, scope="module")
def sphere(request):
    return SPHERES[request.param]()


def laid_out(P, F, projection):
    polygons = triangle_polygons(F)
    unfolded, points = unfold(P, polygons, projection)
    shares = spherical_areas(P, F) / (4 * np.pi)
    if projection == EQUIRECT:
        shares = equirectangular_areas(points, unfolded, polygons)
    exact = drain(correct_areas(unfolded, polygons, shares, projection))
    return exact.unfolding, polygons, points, shares


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_corners_are_images_of_their_vertices(sphere, projection):
    P, F = sphere
    polygons = triangle_polygons(F)
    unfolded, points = unfold(P, polygons, projection)
    images = to_sphere(unfolded.corners(), projection)
    # Whatever copy of the square a corner is on, it stands for the same point; a pole for the pole.
    assert np.abs(images - points[polygons.vertex]).max() < 1e-7


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_no_face_is_torn_or_folded(sphere, projection):
    unfolded, polygons, _, _ = laid_out(*sphere, projection)
    corners = unfolded.corners()[polygons.triangles]
    assert (signed_areas(unfolded.corners(), polygons.triangles) > 0).all()
    # A face that was torn would be as long as the square is wide.
    size = np.ptp(corners, axis=1)
    assert np.median(size) < 0.2 and size.max() < 0.75


@pytest.mark.parametrize("projection", [LAMBERT, OCTAHEDRAL])
def test_straight_faces_get_the_areas_of_the_curved_ones(sphere, projection):
    unfolded, polygons, _, shares = laid_out(*sphere, projection)
    areas = signed_areas(unfolded.corners(), polygons.triangles)
    before, _ = unfold(sphere[0], polygons, projection)
    off = signed_areas(before.corners(), polygons.triangles)
    error, worse = (np.abs(a / a.sum() - shares).sum() for a in (areas, off))
    assert error < 0.5 * worse
    if len(shares) > 500:
        assert error < 0.02


def test_cylinders_stay_within_their_rows_and_go_on_past_one(sphere):
    for projection in (EQUIRECT, LAMBERT):
        unfolded, polygons, _, _ = laid_out(*sphere, projection)
        uv = unfolded.corners()
        assert uv[:, 1].min() == 0 and uv[:, 1].max() == 1
        middle = uv[polygons.triangles][..., 0].mean(axis=1)
        assert middle.min() > 0 and middle.max() < 1.4


def test_the_poles_are_vertices_and_their_corners_are_spread():
    P, F = random_sphere(900, 1)
    polygons = triangle_polygons(F)
    unfolded, points = unfold(P, polygons, LAMBERT)
    assert unfolded.missed == 0
    uv = unfolded.corners()
    for row, pole in ((1, POLES[0]), (0, POLES[1])):
        vertex = np.flatnonzero((points == pole).all(axis=1))
        assert len(vertex) == 1
        fan = np.isin(F, vertex).any(axis=1)
        corner = uv[np.flatnonzero(polygons.vertex == vertex[0])]
        assert (corner[:, 1] == row).all() and len(np.unique(corner[:, 0])) == fan.sum()
        # The fan covers every longitude once.
        width = np.ptp(uv[polygons.triangles[fan]][..., 0], axis=1)
        assert width.sum() == pytest.approx(1, abs=1e-9)


def test_copies_of_an_edge_differ_by_a_motion_of_the_layout():
    """A seam of the layout is one cut: both sides of it have the same shape."""
    P, F = icosphere(3)
    for projection in (LAMBERT, OCTAHEDRAL):
        unfolded, polygons, _, _ = laid_out(P, F, projection)
        uv = unfolded.corners()[polygons.triangles]
        edges = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
        length = np.concatenate([np.linalg.norm(uv[:, k] - uv[:, (k + 1) % 3], axis=1) for k in range(3)])
        order = np.lexsort(edges.T)
        pairs, length = edges[order].reshape(-1, 2, 2), length[order].reshape(-1, 2)
        inner = ~np.isin(pairs[:, 0], np.flatnonzero(np.isin(np.arange(len(P)), _pole_vertices(unfolded)))).any(axis=1)
        assert np.allclose(length[inner, 0], length[inner, 1], atol=1e-9)


def _pole_vertices(unfolded):
    used = np.zeros(len(unfolded.uv), bool)
    used[unfolded.index] = True
    return np.flatnonzero(~used)


def test_quads_stay_whole_and_the_seam_is_one_column():
    points, faces = uv_sphere()
    surface = polygon_surface(points, faces)
    triangles = surface.corner_vertex[surface.triangles]
    polygons, corners = gather_polygons(surface.triangles, triangles, surface.triangle_face)
    assert (corners == np.arange(len(corners))).all()
    unfolded, placed = unfold(points, polygons, EQUIRECT)
    assert np.allclose(placed, points, atol=1e-12)
    uv = unfolded.corners()
    assert uv.min() >= -1e-6 and uv.max() <= 1 + 1e-6
    assert signed_areas(uv, polygons.triangles).sum() == pytest.approx(1 - 1 / 12, abs=1e-9)
    for face in range(len(faces)):
        mine = uv[polygons.polygon == face]
        assert np.ptp(mine[:, 0]) == pytest.approx(1 / 16, abs=1e-9)


@pytest.mark.parametrize("turn", [0.01, 0.1, 0.19])
def test_quads_across_the_seam_go_on_past_one(turn):
    points, faces = uv_sphere(turn=turn)
    surface = polygon_surface(points, faces)
    triangles = surface.corner_vertex[surface.triangles]
    polygons, _ = gather_polygons(surface.triangles, triangles, surface.triangle_face)
    unfolded, _ = unfold(points, polygons, EQUIRECT)
    uv = unfolded.corners()
    assert uv[:, 0].min() >= 0 and 1 < uv[:, 0].max() < 1 + 1 / 16
    assert signed_areas(uv, polygons.triangles).sum() == pytest.approx(1 - 1 / 12, abs=1e-9)


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("turn", [1e-12, -1e-12, 1e-8, -1e-8])
def test_rounding_of_what_lies_on_the_seam_moves_no_face(projection, turn):
    """Whichever side of it the vertices of a column are by their last digits, faces lie in the same square."""
    found = []
    for angle in (0.0, turn):
        points, faces = uv_sphere(turn=angle)
        corner_vertex = np.concatenate(faces)
        starts = np.append(0, np.cumsum([len(f) for f in faces]))
        polygon = np.repeat(np.arange(len(faces)), np.diff(starts))
        fans = [
            [starts[k], starts[k] + j, starts[k] + j + 1] for k, f in enumerate(faces) for j in range(1, len(f) - 1)
        ]
        found.append(unfold(points, Polygons(corner_vertex, polygon, np.array(fans)), projection)[0].corners())
    np.testing.assert_allclose(found[1], found[0], atol=1e-6)


def test_a_pole_inside_a_face_is_counted_and_laid_out_flat():
    P, F = icosphere(0)
    # Three faces meet nowhere near: the poles' faces are as wide as the limit of a push allows.
    unfolded, _ = unfold(P, triangle_polygons(F), EQUIRECT)
    assert np.isfinite(unfolded.corners()).all()
    uv = unfolded.corners()[np.arange(3 * len(F)).reshape(-1, 3)]
    assert np.ptp(uv, axis=1).max() < 1


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("first", range(6))
def test_a_pole_is_a_vertex_whatever_its_number(projection, first):
    """Also the one of number 0; what is missed is told by no vertex at all."""
    P, F = random_sphere(900, 1)
    targets = singular_points(projection)
    if first >= len(targets):
        return
    at = int((P @ targets[first]).argmax())
    order = np.r_[at, np.delete(np.arange(len(P)), at)]
    number = np.argsort(order)
    unfolded, _ = unfold(P[order], triangle_polygons(number[F]), projection)
    assert unfolded.missed == 0
