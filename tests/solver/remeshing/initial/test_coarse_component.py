"""Coarse components: the boundary and the measure of the fine one, from its own vertices."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial import RemeshSource
from omt_uv.solver.remeshing.initial import coarse_component as module
from omt_uv.solver.remeshing.initial.coarse_component import coarse_component


@pytest.fixture
def fine(monkeypatch):
    """Maps of a disk with a density, and that at its vertices, of which 60 samples need a coarser one."""
    monkeypatch.setattr(module, "FEWEST", 100)
    V, F = meshes.bumpy(24, 24)
    maps = RemeshSource(V, F).maps[0]
    n, m = len(maps.component.vertices), len(maps.component.triangles)
    return maps, 1 + np.arange(m) / m, np.arange(n) + 1.0


def test_boundary_and_measure_stay(fine):
    """A coarse disk has the boundary it had, vertex for vertex, the same measure, and vertices of the fine one."""
    maps, density, at_vertices = fine
    coarse = drain(coarse_component(maps, 60, density, at_vertices))
    old, new = maps.component, coarse.maps.component
    assert len(new.vertices) < len(old.vertices) / 1.5 and new.euler == 1 and new.is_disk
    # The density at a vertex is its number, and 1.
    kept = coarse.at_vertices.astype(np.int64) - 1
    assert (new.vertices == old.vertices[kept]).all()
    loop, other = kept[boundary_loops(new.triangles)[0]], boundary_loops(old.triangles)[0]
    start = int(np.flatnonzero(other == loop[0])[0])
    assert (loop == np.roll(other, -start)).all()
    measure = density @ face_areas(old.vertices, old.triangles)
    assert (coarse.density > 0).all() and coarse.density @ new.area == pytest.approx(measure, rel=1e-12)


def test_what_is_hardly_finer_stays(fine):
    """Coarsening has its price."""
    maps, density, at_vertices = fine
    count = len(maps.component.vertices) // module.PER_SAMPLE
    assert drain(coarse_component(maps, count, density, at_vertices)) is None


def test_what_is_not_embedded_stays(fine, monkeypatch):
    """Its own maps say what is wrong with it."""

    def fails(*_):
        raise PrecisionError("A linear system is singular in double precision")

    monkeypatch.setattr(module, "tutte", fails)
    assert drain(coarse_component(fine[0], 60, *fine[1:])) is None
