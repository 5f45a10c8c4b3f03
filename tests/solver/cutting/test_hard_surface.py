"""Bodies of flat sides: nets in a row, saddles that come apart, bevels cut through the middle of their corners."""

import meshes
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from short_cuts import component_of

from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.cutting.hard_surface import net_factors, rounded_corners
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.geometry import angle_defects, angles_from_lengths, face_areas, halfedge_lengths
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain

CUBE = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def cube():
    """The corners of [-1,1]^3 and its sides."""
    return 2.0 * np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)]) - 1, CUBE


def rounded_cube(radius, segments):
    """A cube with edges and corners rounded by a ball: a grid on each side, the grids' outer rings on the ball."""
    t = np.linspace(-np.pi / 4, 0, segments + 1)
    ring = np.tan(t) * radius - (1 - radius)
    line = np.concatenate([ring, -ring[::-1]])
    n = len(line)
    x, y = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    points, quads = [], []
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    one = np.stack([i, i + n, i + n + 1, i + 1], axis=1)
    for axis in range(3):
        for sign in (1, -1):
            side = np.roll(np.stack([x, y, np.full(n * n, 1.0)], axis=1) * [1, 1, sign], axis + 1, axis=1)
            core = np.clip(side, radius - 1, 1 - radius)
            off = side - core
            points.append(core + radius * off / np.linalg.norm(off, axis=1, keepdims=True))
            quads.append((one if sign > 0 else one[:, ::-1]) + len(quads) * n * n)
    points, quads = np.concatenate(points), np.concatenate(quads)
    _, first, index = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return points[first], [tuple(q) for q in index.ravel()[quads].tolist()]


def prism(profile, depth=2.0):
    """A profile (n,2) in x and z, counterclockwise, drawn out along y."""
    profile, n = np.asarray(profile, float), len(profile)
    points = np.concatenate([np.insert(profile, 1, y, axis=1) for y in (0.0, depth)])
    sides = [(k, (k + 1) % n, (k + 1) % n + n, k + n) for k in range(n)]
    return points, [tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *(s[::-1] for s in sides)]


BRACKET = [(0, 0), (4, 0), (4, 0.5), (0.5, 0.5), (0.5, 3), (0, 3)]
CHANNEL = [(0, 0), (4, 0), (4, 2), (3.5, 2), (3.5, 0.5), (0.5, 0.5), (0.5, 2), (0, 2)]


def shear_of(body):
    surface = meshes.polygon_surface(*body)
    found = drain(unwrap(surface, options=UnwrapOptions()))
    (chart,), (chart_map,) = found.charts, found.maps
    return distortion(chart.vertices, chart.triangles, chart_map.uv[chart.triangles], polygons=chart.faces)


@pytest.mark.parametrize("profile", [BRACKET, CHANNEL])
def test_sides_around_a_saddle_are_not_sheared(profile):
    figures = shear_of(prism(profile))
    assert figures.angle_mean == pytest.approx(1, abs=1e-6)
    assert figures.folds == 0 and figures.overlap == 0


@pytest.mark.parametrize("radius, segments, most", [(0.1, 3, 1.02), (0.1, 6, 1.02), (0.25, 2, 1.05), (0.45, 6, 1.1)])
def test_flat_sides_between_bevels_stay_as_they_are(radius, segments, most):
    figures = shear_of(rounded_cube(radius, segments))
    assert figures.angle_mean < most
    # A quarter of what polygons may be off, and no further.
    assert figures.area_l1 < 2e-3 and figures.folds == 0 and figures.overlap == 0


def chamfered_cube(width):
    """A cube with flat bevels in one segment: triangles at its corners, which have no vertex in their middle."""
    a = 1 - width
    signs = cube()[0]
    points = np.concatenate([signs * np.roll([1, a, a], axis) for axis in range(3)])
    hull = ConvexHull(points)
    sides = np.diff(points[hull.simplices], axis=1)
    outwards = np.einsum("fd,fd->f", np.cross(sides[:, 0], sides[:, 1]), hull.equations[:, :3]) > 0
    return points, [tuple(t if o else t[::-1]) for t, o in zip(hull.simplices.tolist(), outwards, strict=True)]


@pytest.mark.parametrize("width", [0.05, 0.1])
def test_a_net_goes_around_corners_that_are_cut_off(width):
    figures = shear_of(chamfered_cube(width))
    assert figures.angle_mean == pytest.approx(1, abs=1e-6)
    assert figures.folds == 0 and figures.overlap == 0


@pytest.mark.parametrize("height", [1, 1.3])
def test_the_sides_of_a_box_stand_in_a_row_with_top_and_bottom_on_the_front(height):
    points, quads = cube()
    edges = cut(meshes.polygon_surface(points * [1, 1, height], quads)).edges
    ends = points[edges]
    upright = ends[:, 0, 2] != ends[:, 1, 2]
    assert len(edges) == 7 and upright.sum() == 1
    front = (ends[..., 1] == -1).all(axis=1)
    assert not front.any()


def test_a_sphere_has_no_corners_and_a_cube_no_rounded_ones_beside_its_own():
    for body, expected in ((meshes.icosphere(2), None), (meshes.cube(), 8)):
        component = component_of(*body)
        length = halfedge_lengths(component.positions, component.triangles).reshape(-1, 3)
        curvature = angle_defects(component.triangles, angles_from_lengths(length), np.zeros(0, int), len(body[0]))
        found = rounded_corners(component, curvature, face_areas(component.positions, component.triangles))
        assert (found is None) == (expected is None) and (found is None or len(found) == expected)


def test_no_edge_of_a_cube_is_beside_a_reflex_corner():
    component = component_of(*meshes.cube())
    factors = net_factors(component, np.ones(len(component.pair), bool))
    assert factors.min() >= 1 and factors.max() < 1.02
