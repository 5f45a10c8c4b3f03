"""Series of remeshes: counts, densities and errors as the settings have them."""

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.remesh import RemeshJob, density_of, oriented, remesh_series
from omt_uv.settings import DENSITIES, RemeshSettings
from omt_uv.solver.errors import CountError, DensityError, MeshError
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain

NONE = np.zeros((0, 2), np.int64)


def job(V, F, values=None, **more):
    return RemeshJob(triangle_surface(V, F), NONE, NONE, values, **more)


def series(V, F, **settings):
    return drain(remesh_series(job(V, F, warnings=("mended",)), RemeshSettings(**settings)))


@pytest.fixture(scope="module")
def levels():
    return series(*meshes.icosphere(3), count=80, levels=3)


def test_every_level_has_its_count_and_is_closed(levels):
    assert [len(level.positions) for level in levels.levels] == [80, 40, 20]
    for level in levels.levels:
        assert len(level.triangles) == 2 * len(level.positions) - 4
        assert len(level.correspondence.vertex_triangle) == len(level.positions)
        assert level.correspondence.vertex_weights.sum(axis=1) == pytest.approx(np.ones(len(level.positions)))
    assert levels.warnings[0] == "mended"


def test_a_level_is_what_it_is_alone(levels):
    alone = series(*meshes.icosphere(3), count=40)
    assert np.array_equal(alone.levels[0].positions, levels.levels[1].positions)
    assert np.array_equal(alone.levels[0].triangles, levels.levels[1].triangles)


def test_faces_and_edge_lengths_are_counted():
    V, F = meshes.icosphere(3)
    assert len(series(V, F, count_of="faces", count=60).levels[0].triangles) == 60
    found = series(V, F, count_of="edge", count=0.6).levels[0]
    edge = np.linalg.norm(found.positions[found.triangles] - found.positions[np.roll(found.triangles, 1, 1)], axis=2)
    assert edge.mean() == pytest.approx(0.6, rel=0.05)


@pytest.mark.parametrize(
    "settings",
    [{"count": 0}, {"count": np.nan}, {"count_of": "edge", "count": -1}, {"levels": 2, "ratio": 1.0}, {"count": 3}],
)
def test_counts_that_are_none_are_refused(settings):
    with pytest.raises(CountError):
        series(*meshes.icosphere(1), **settings)


def test_errors_say_the_level():
    with pytest.raises(CountError, match=r"^LOD1: "):
        series(*meshes.icosphere(2), count=20, levels=2, ratio=0.1)


@pytest.mark.parametrize("name", [name.lower() for name, *_ in DENSITIES])
def test_densities_do_not_depend_on_the_unit_of_length(name):
    V, F = meshes.bumpy(8, 8)
    values = None if name not in ("weights", "attribute") else np.linspace(0.1, 1, len(F))
    settings = RemeshSettings(density=name)
    one, other = (density_of(job(s * V, F, values), F, settings) for s in (1.0, 1024.0))
    if name == "uniform":
        assert one is None and other is None
        return
    assert one.shape == (len(F),) and (one > 0).all()
    assert other / other.sum() == pytest.approx(one / one.sum(), rel=1e-6)


def test_weights_span_the_factor_and_attributes_are_taken_as_they_are():
    V, F = meshes.grid(4, 4)
    values = np.linspace(0, 1, len(F))
    painted = density_of(job(V, F, values), F, RemeshSettings(density="weights", factor=8.0))
    assert painted[-1] / painted[0] == pytest.approx(8)
    density = density_of(job(V, F, values + 1), F, RemeshSettings(density="attribute"))
    assert np.array_equal(density, values + 1)
    with pytest.raises(DensityError):
        density_of(job(V, F), F, RemeshSettings(density="attribute"))
    with pytest.raises(MeshError):
        density_of(job(V, F, values - 1), F, RemeshSettings(density="attribute"))


def test_triangles_that_look_away_are_turned_over_and_others_stay():
    V, F = meshes.icosphere(1)
    surface = triangle_surface(V, F)
    assert oriented(surface) == (surface, ())
    wrong = F.copy()
    wrong[[3, 50]] = wrong[[3, 50]][:, ::-1]
    turned, warnings = oriented(triangle_surface(V, wrong))
    assert len(warnings) == 1 and "2 faces look to another side" in warnings[0]
    after = turned.corner_vertex[turned.triangles]
    assert {tuple(np.roll(t, -t.argmin())) for t in after} == {tuple(np.roll(t, -t.argmin())) for t in F}
