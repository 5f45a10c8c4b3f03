"""The shear bound: more seam, less shear, and charts that stay disks."""

import meshes
import numpy as np
import pytest

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


def test_the_bound_must_be_possible():
    with pytest.raises(ValueError, match="bound"):
        drain(bound_shear(triangle_surface(*meshes.bumpy()), None, draft, 1.0))
