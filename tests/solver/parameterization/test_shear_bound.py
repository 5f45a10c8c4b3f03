"""The cut budget: more seam, less shear, and charts that stay disks."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.cutting.shear_slit import slit
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import MapOptions
from omt_uv.solver.parameterization.shear_bound import bound_shear
from omt_uv.solver.progress import drain


def draft(chart):
    return map_chart(chart, options=MapOptions(quality="draft"))


def test_slits_bring_the_shear_under_the_bound():
    V, F = meshes.cap(rings=12, sectors=24, opening=0.9)
    result = drain(bound_shear(triangle_surface(V, F), None, draft, 1.25))
    assert result.reached and len(result.slits)
    lengths, shears = zip(*result.history, strict=True)
    assert shears[0] > 1.25 >= shears[-1] and (np.diff(lengths) > 0).all()
    # The slits are seams that leave one disk.
    (chart,) = strict_charts(triangle_surface(V, F, result.slits))
    assert len(chart.triangles) == len(F)


def test_a_chart_within_the_bound_is_left_alone():
    V, F = meshes.bumpy()
    result = drain(bound_shear(triangle_surface(V, F), None, draft, 3.0))
    assert result.reached and len(result.slits) == 0 and len(result.history) == 1


def test_only_the_bad_chart_is_slit():
    (V, F), (W, G) = meshes.grid(6, 6), meshes.cap(rings=10, sectors=20, opening=0.9)
    both = triangle_surface(np.concatenate([V, W + 3]), np.concatenate([F, G + len(V)]))
    result = drain(bound_shear(both, None, draft, 1.3))
    assert result.reached and result.slits.min() >= len(V)


def test_a_slit_starts_on_the_rim_and_ends_in_the_worst_place():
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


def test_the_bound_must_be_possible():
    with pytest.raises(ValueError, match="bound"):
        drain(bound_shear(triangle_surface(*meshes.bumpy()), None, draft, 1.0))
