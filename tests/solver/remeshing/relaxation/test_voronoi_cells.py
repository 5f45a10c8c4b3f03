"""Cells of a Delaunay mesh partition its area, and their moments and energies are those of integrals."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.remeshing.relaxation.voronoi_cells import voronoi_cells


@pytest.mark.parametrize("name", ["icosphere", "torus", "grid", "bumpy"])
@pytest.mark.parametrize("delaunay", [True, False])
def test_masses_sum_to_the_area_and_scale_with_the_density(name, delaunay):
    V, F = getattr(meshes, name)()
    cells = voronoi_cells(V, F, np.ones(len(V)), delaunay)
    assert cells.mass.sum() == pytest.approx(face_areas(V, F).sum())
    thrice = voronoi_cells(V, F, np.full(len(V), 3.0), delaunay)
    np.testing.assert_allclose(thrice.mass, 3 * cells.mass)
    np.testing.assert_allclose(thrice.moment, 3 * cells.moment, atol=1e-15)
    assert thrice.energy == pytest.approx(3 * cells.energy)


def test_moments_sum_to_that_of_the_surface():
    """About any point: the sum of cells' masses times their centroids is the integral of the position."""
    V, F = meshes.bumpy(9, 7)
    cells = voronoi_cells(V, F, np.ones(len(V)))
    total = (cells.mass[:, None] * V + cells.moment).sum(axis=0)
    np.testing.assert_allclose(total, face_areas(V, F) @ V[F].mean(axis=1), atol=1e-14)


def test_the_energy_is_the_integral_of_squared_distances():
    """Around the middle of a hexagon of side 1: a cell of side 1 / sqrt(3), and the rest by the vertices' symmetry."""
    turn = np.pi / 3 * np.arange(6)
    V = np.concatenate([np.zeros((1, 3)), np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])])
    F = np.array([[0, 1 + k, 1 + (k + 1) % 6] for k in range(6)])
    cells = voronoi_cells(V, F, np.ones(7))
    side = 1 / np.sqrt(3)
    inner = 6 * (np.sqrt(3) / 4 * side**2) * (5 / 12 * side**2)
    # Every triangle parts its energy evenly between its three corners.
    assert cells.energy == pytest.approx(3 * inner)
    assert cells.mass[0] == pytest.approx(6 * np.sqrt(3) / 4 * side**2)
    np.testing.assert_allclose(cells.moment[0], 0, atol=1e-15)
