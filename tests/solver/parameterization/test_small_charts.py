"""Many small charts solved together."""

import hard_meshes
import meshes
import numpy as np
import pytest
from work import counted_work

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.charts import triangle_rows
from omt_uv.solver.mesh.geometry import face_areas, halfedge_lengths, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization import small_charts as batches
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.small_charts import MANY
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain

SHAPES = ["bumpy", "cone", "hemisphere", "random_disk", "comb", "grid", "quad_patch", "spiral_strip"]


def side_by_side(shapes, scale=1.0, shift=0.0):
    """Charts of different shapes and sizes in one surface."""
    found, count = [], 0
    for k, (V, F) in enumerate(shapes):
        found.append((scale * (V * (1 + k % 3) + [20.0 * k, 0, 0]) + shift, F + count))
        count += len(V)
    return triangle_surface(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def all_shapes():
    shapes = [getattr(meshes, name)() for name in SHAPES]
    return [*shapes, *(meshes.random_disk(80, seed) for seed in range(4)), meshes.grid(1, 1)]


def one_by_one(monkeypatch, surface, **arguments):
    with monkeypatch.context() as patch:
        patch.setattr(batches, "MANY", 1000)
        return drain(unwrap(surface, **arguments))


@pytest.mark.parametrize(("quality", "balance"), [("standard", 0.0), ("exact", 0.0), ("standard", 0.5)])
def test_together_is_as_good_as_one_by_one(monkeypatch, quality, balance):
    surface = side_by_side(all_shapes())
    assert len(all_shapes()) >= MANY
    options = UnwrapOptions(quality=quality, balance=balance)
    together = drain(unwrap(surface, options=options))
    alone = one_by_one(monkeypatch, surface, options=options)
    # What went alone has stages of its own.
    batched = [m for m in together.maps if set(m.seconds) == {"refinement"}]
    assert len(batched) >= len(SHAPES) and max(m.newton_refinement for m in batched) <= 25
    for chart, a, b in zip(together.charts, together.maps, alone.maps, strict=True):
        assert a.folds == 0 and (signed_areas(a.uv, chart.triangles) > 0).all()
        figures = distortion(chart.vertices, chart.triangles, a.uv[chart.triangles])
        assert figures.overlap <= 1e-4 and figures.area_l1 == pytest.approx(a.area_l1, abs=1e-9)
        assert figures.area_sd == pytest.approx(a.area_sd, abs=1e-9)
        assert figures.angle_mean == pytest.approx(a.angle_mean, rel=1e-6)
        assert a.angle_mean <= 1.02 * b.angle_mean and a.area_l1 <= max(1.5 * b.area_l1, 1e-3)
        covered = signed_areas(a.uv, chart.triangles).sum()
        assert covered == pytest.approx(face_areas(chart.vertices, chart.triangles).sum(), rel=1e-9)


def test_flat_charts_are_congruent():
    surface = side_by_side([meshes.grid(3, k + 1) for k in range(MANY)])
    for chart, found in zip(*(lambda r: (r.charts, r.maps))(drain(unwrap(surface))), strict=True):
        sides = [np.linalg.norm(np.roll(p[chart.triangles], -1, 1) - p[chart.triangles], axis=2)
                 for p in (chart.vertices, found.uv)]  # fmt: skip
        np.testing.assert_allclose(sides[0], sides[1], rtol=1e-6)


def test_units_and_places_only_scale_the_result():
    # The spiral is not solved together with the others: its boundary needs a barrier.
    shapes = [getattr(meshes, name)() for name in SHAPES[:-1]] + [meshes.grid(1, 1)]
    reference = drain(unwrap(side_by_side(shapes)))
    moved = drain(unwrap(side_by_side(shapes, 1e3, 1e4)))
    for a, b in zip(reference.maps, moved.maps, strict=True):
        np.testing.assert_allclose(b.uv / 1e3, a.uv, atol=1e-5 * np.abs(a.uv).max())


def test_a_chart_that_fails_together_says_so_alone():
    V, F = meshes.bumpy(4, 4)
    needle = np.array([[0, 0, 0], [1, 0, 0], [2, 1e-13, 0.0]]), np.array([[0, 1, 2]])
    surface = side_by_side([(V, F)] * MANY + [needle])
    result = drain(unwrap(surface))
    assert len(result.maps) == MANY + 1 and all(np.isfinite(m.uv).all() for m in result.maps)
    assert all(m.area_l1 <= 0.01 for m in result.maps[:MANY])


def test_regions_get_their_shares_together_as_one_by_one(monkeypatch):
    surface = side_by_side(all_shapes()[3:11])
    centre = surface.positions[surface.corner_vertex[surface.triangles]].mean(axis=1)
    w = np.clip(1.5 - 2 * np.abs(centre[:, 1] % 1 - 0.5) - (centre[:, 0] % 20 > 0.5), 0, 1)
    area = face_areas(surface.positions, surface.corner_vertex[surface.triangles])
    target = Target(exact_density(w, area, 2.0).density, w)
    together = drain(unwrap(surface, target=target))
    alone = one_by_one(monkeypatch, surface, target=target)
    assert sum(m.newton_transport is None for m in together.maps) >= MANY - 2
    for chart, a, b in zip(together.charts, together.maps, alone.maps, strict=True):
        has = signed_areas(a.uv, chart.triangles)
        mine = target.of(triangle_rows(surface, chart))
        asked = mine.density * face_areas(chart.vertices, chart.triangles)
        assert (has > 0).all() and has.sum() == pytest.approx(asked.sum(), rel=1e-9)
        assert mine.region @ has == pytest.approx(mine.region @ asked, rel=5e-3, abs=1e-3 * asked.sum())
        figures = distortion(chart.vertices, chart.triangles, a.uv[chart.triangles], density=mine.density)
        assert figures.overlap <= 1e-4 and figures.area_l1 == pytest.approx(a.area_l1, abs=1e-9)
        assert figures.angle_mean == pytest.approx(a.angle_mean, rel=1e-6)
        assert a.angle_mean <= 1.05 * b.angle_mean and a.area_l1 <= max(1.5 * b.area_l1, 1e-3)


def test_thousands_of_pieces_take_no_more_factorisations_than_a_few():
    V, F = hard_meshes.pieces(2000)
    with counted_work() as work:
        result = drain(unwrap(triangle_surface(V, F)))
    assert len(result.charts) == 2000
    assert work.factorisations < 20
    for chart, chart_map in zip(result.charts[::100], result.maps[::100], strict=True):
        lengths = (halfedge_lengths(x, chart.triangles) for x in (chart.vertices, chart_map.uv))
        np.testing.assert_allclose(*lengths, rtol=1e-6)
