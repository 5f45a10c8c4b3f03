"""The seams of the benchmarks: one disk, the same every time, whatever the vertices are called."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from benchmarks.seams import cut_seams
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface


def holed_sphere():
    """A sphere without the faces around three vertices: three boundaries."""
    V, F = meshes.icosphere(3)
    gone = [int(np.argmax(V @ d)) for d in np.eye(3)]
    return V, F[~np.isin(F, gone).any(1)]


SURFACES = {"sphere": meshes.icosphere, "cube": meshes.cube, "annulus": meshes.annulus, "holed sphere": holed_sphere}


@pytest.mark.parametrize("name", SURFACES)
def test_seams_open_a_surface_into_one_disk(name):
    V, F = SURFACES[name]()
    seams = cut_seams(V, F)
    charts = strict_charts(triangle_surface(V, F, seams))  # refuses anything that is no disk
    assert len(charts) == 1 and len(charts[0].triangles) == len(F)
    assert np.array_equal(seams, cut_seams(V, F))


def test_a_disk_is_left_whole():
    assert len(cut_seams(*meshes.bumpy())) == 0


@pytest.mark.parametrize("count", [3, 4, 5])
def test_the_seam_ends_at_extremities(count):
    V, F = meshes.icosphere(3)
    V = V * [1.0, 1.0, 4.0]
    seams = cut_seams(V, F, count)
    vertices, degree = np.unique(seams, return_counts=True)
    assert 2 <= (degree == 1).sum() <= count
    tips = vertices[degree == 1]
    assert np.abs(V[tips, 2]).max() == pytest.approx(4.0, rel=0.05)


@meshes.models_missing
@pytest.mark.parametrize("name", ["max_planck", "spot", "homer", "stanford_bunny"])
def test_models_become_one_disk(name):
    V, F = meshes.load_model(name)
    assert len(strict_charts(triangle_surface(V, F, cut_seams(V, F)))) == 1
