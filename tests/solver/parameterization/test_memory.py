"""What is held at most on the way to a map of a large mesh, for a vertex: no figure of it depends on a clock."""

import tracemalloc

import hard_meshes
import pytest

from omt_uv.solver.linalg.additive_schwarz import LARGE
from omt_uv.solver.mesh import geometry
from omt_uv.solver.parameterization import initial_map
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import vertex_sweeps

# A terrain of quads held 5,400 bytes a vertex, beside its factors, and 2,300 with gradients and stars in full.
TERRAIN = 2_150
# All its corners are neighbours of one vertex: there is a triangle for a vertex, and no fill.
FAN = 930


@pytest.mark.parametrize("make, side, most", [(hard_meshes.terrain, 240, TERRAIN), (hard_meshes.fan, 60_000, FAN)])
def test_large_meshes_hold_little_for_a_vertex(make, side, most, monkeypatch):
    """The rows of their matrix, and what is known of their triangles, once, and not in several forms."""
    for module, name in ((initial_map, "EMBEDDED"), (geometry, "KEPT_HATS"), (vertex_sweeps, "KEPT_HATS")):
        monkeypatch.setattr(module, name, LARGE)
    surface = hard_meshes.surface(*make(side))
    count = len(surface.positions)
    assert count > LARGE
    tracemalloc.start()
    try:
        (found,) = drain(unwrap(surface)).maps
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert found.folds == 0
    assert peak < most * count
