"""A surface's target, read in one of its charts."""

import meshes
import numpy as np

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import chart_target, located


def two_charts():
    V, F = meshes.grid(3, 2)
    order = np.random.default_rng(0).permutation(2 * len(F))
    return triangle_surface(np.concatenate([V, V + 5]), np.concatenate([F, F + len(V)])[order])


def test_every_triangle_has_its_own_density():
    surface = two_charts()
    target = Target(1.0 + np.arange(len(surface.triangles)), np.arange(len(surface.triangles)) / 100)
    for chart in strict_charts(surface):
        found = chart_target(target, surface, chart)
        np.testing.assert_array_equal(found.density, 1 + chart.faces)
        np.testing.assert_array_equal(found.region, chart.faces / 100)
    assert chart_target(None, surface, chart) is None


def test_errors_have_the_elements_of_the_surface():
    for chart in strict_charts(two_charts()):
        for kind, elements, expected in (
            ("face", [0, 3], chart.faces[[0, 3]]),
            ("vertex", [2], chart.vertex_ids[[2]]),
            ("edge", [[0, 1]], chart.vertex_ids[[[0, 1]]]),
        ):
            found = located(FoldedUVError("cause", "remedy", kind=kind, elements=np.array(elements)), chart)
            np.testing.assert_array_equal(found.elements, expected)
            assert isinstance(found, FoldedUVError) and (found.cause, found.remedy) == ("cause", "remedy")
