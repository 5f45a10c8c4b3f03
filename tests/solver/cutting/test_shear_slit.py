"""Slits from the boundary of a chart to where it shears most."""

import meshes
import numpy as np

from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.cutting.shear_slit import slit
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops


def test_a_slit_starts_on_the_boundary_and_ends_in_the_worst_place():
    V, F = meshes.grid(10, 10)
    mesh = triangle_surface(V, F)
    (chart,) = cut_to_disks(mesh).charts
    centre = np.linalg.norm(V[F].mean(1)[:, :2] - 0.5, axis=1)
    edges = slit(mesh, chart, 1 + 5 * np.exp(-((centre / 0.1) ** 2)))
    ends, uses = np.unique(edges, return_counts=True)
    tips = V[ends[uses == 1], :2]
    assert np.linalg.norm(tips - 0.5, axis=1).min() < 0.1
    assert np.isclose(np.abs(tips - 0.5).max(axis=1), 0.5).sum() == 1
    assert len(slit(mesh, chart, np.ones(len(F)))) == 0


def test_the_slit_leaves_painted_vertices_free():
    V, F = meshes.grid(10, 10)
    mesh = triangle_surface(V, F)
    (chart,) = cut_to_disks(mesh).charts
    shear = 1 + 5 * np.exp(-((np.linalg.norm(V[F].mean(1)[:, :2] - [0.5, 0.3], axis=1) / 0.1) ** 2))
    plain, steered = slit(mesh, chart, shear), slit(mesh, chart, shear, avoid=(V[:, 1] < 0.25).astype(float))
    assert V[plain, 1].min() < 0.25 < V[steered, 1].min()


def test_a_slit_runs_from_the_boundary_inwards():
    surface = triangle_surface(*meshes.hemisphere())
    (chart,) = cut_to_disks(surface).charts
    top = chart.vertices[chart.triangles].mean(1)[:, 2]
    path = slit(surface, chart, 1 + top)
    vertices, degree = np.unique(path, return_counts=True)
    loop = chart.vertex_ids[boundary_loops(chart.triangles)[0]]
    assert (degree == 1).sum() == 2 and np.isin(vertices, loop).sum() == 1
