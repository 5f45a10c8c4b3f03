"""Paths on edges: what is carried from a coarse surface hangs on the boundary and closes no loop."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.seam_costs import seam_costs
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops, graph_components
from omt_uv.solver.seams import coarse_cut
from omt_uv.solver.seams.fine_paths import carried
from omt_uv.solver.seams.search import SeamSearch


@pytest.mark.parametrize("spread", [0.3, 0.05])
def test_what_is_carried_is_a_forest_that_hangs_on_the_boundary(monkeypatch, spread):
    V, F = meshes.cap(14, 28, 0.9)
    seen = []

    def watched(component, coarse, graph, steps, start, mirror):
        seen.append((component, start, carried(component, coarse, graph, steps, start, mirror)))
        return seen[-1][-1]

    monkeypatch.setattr(coarse_cut, "carried", watched)
    surface = triangle_surface(V, F)
    edges = cut(surface, search=SeamSearch(np.full(len(F), spread), surface, lambda: seam_costs(surface))).edges
    ((component, start, chosen),) = seen
    assert start.sum() == len(boundary_loops(F)[0]) and chosen.sum() == len(edges) > 0
    # With all of the boundary as one vertex: connected, and an edge for every other vertex.
    ends = np.where(start, 0, 1 + np.arange(len(start)))[component.ends[chosen]]
    vertices = np.unique(ends)
    label = graph_components(*ends.T, len(start) + 1)[1]
    assert len(vertices) == chosen.sum() + 1 and (label[vertices] == label[0]).all()
