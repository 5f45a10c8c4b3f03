"""Pictures of power diagrams: every cell in its tint where it lies, its sides in ink, and of the sphere the front."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from omt_uv.display.textures.layouts import FREE, INK, PAPER, cells_picture
from omt_uv.pipelines.measuring.diagrams import Diagram
from omt_uv.solver.mesh.spherical_geometry import fibonacci_sphere
from omt_uv.solver.transport.cell_polygons import planar_cells, spherical_cell_polygons
from omt_uv.solver.transport.convex_domain import Disk, Rectangle
from omt_uv.solver.transport.spherical_power_diagram import by_hull

SIZE = 120


def tint(cell):
    """The colour of a cell away from its sides."""
    turn = 2 * np.pi * (cell * 0.618034 % 1)
    return 0.72 + 0.24 * (0.5 + 0.5 * np.cos(turn + np.array([0.0, 2.1, 4.2])))


def pixel(place, extent):
    """Row and column of a place of the plane, up being up."""
    x, y = (place / extent * (0.5 - FREE) * [1, -1] + 0.5) * SIZE
    return int(y), int(x)


@pytest.mark.parametrize("domain", [Rectangle(), Rectangle(2.0, 1.0), Disk()], ids=["square", "wide", "disk"])
def test_cells_of_the_plane_have_their_tints(domain):
    sites = np.random.default_rng(0).uniform(-0.4, 0.4, (7, 2))
    weights = np.random.default_rng(1).uniform(0, 0.02, 7)
    cells = planar_cells(sites, weights, domain)
    picture = cells_picture(Diagram(cells, np.full(7, 1 / 7), 0.0, 0), SIZE)
    extent = np.abs(cells.points).max()
    assert picture.shape == (SIZE, SIZE, 3) and (picture >= 0).all() and (picture <= 1).all()
    for cell in range(7):
        corners = cells.points[cells.start[cell] : cells.start[cell + 1]]
        middle = corners.mean(axis=0)
        sides = np.roll(corners, -1, axis=0) - corners
        room = np.cross(sides, middle - corners) / np.linalg.norm(sides, axis=1)
        if len(corners) > 2 and room.min() > 0.03 * extent:
            np.testing.assert_allclose(picture[pixel(middle, extent)], tint(cell), atol=1e-6)
            # Along its sides there is ink.
            half = (corners + np.roll(corners, -1, axis=0)) / 2
            row, column = pixel(half[np.linalg.norm(sides, axis=1).argmax()], extent)
            around = picture[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3].reshape(-1, 3)
            assert np.abs(around - INK).sum(axis=1).min() < 0.7 * np.abs(tint(cell) - INK).sum()
    np.testing.assert_array_equal(picture[0, 0], PAPER)


def test_of_the_sphere_the_half_in_front_is_seen():
    """From -Y, with up in space upwards."""
    sites = fibonacci_sphere(12)
    cells = spherical_cell_polygons(sites, np.zeros(12), by_hull(sites, np.zeros(12)))
    picture = cells_picture(Diagram(cells, np.full(12, 1 / 12), 0.0, 0), SIZE)
    extent = np.abs(cells.points[:, [0, 2]]).max()
    assert len(ConvexHull(sites).simplices) == 20
    for cell in np.flatnonzero(sites[:, 1] < -0.5):
        corners = cells.points[cells.start[cell] : cells.start[cell + 1]]
        place = (0.7 * corners.mean(axis=0) + 0.3 * corners[0])[[0, 2]]
        np.testing.assert_allclose(picture[pixel(place, extent)], tint(cell), atol=0.02)
