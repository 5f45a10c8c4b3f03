"""The pipeline from a surface to texture coordinates."""

import functools
from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver import errors
from omt_uv.solver.analysis.density import Target
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization import shear_search
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import Progress, drain

BOUNDARIES = ["free", "disk", "square"]


def two_charts():
    """A bumpy square and, far from it, one of twice the size."""
    V, F = meshes.bumpy(10, 10)
    return triangle_surface(np.vstack([V, 2 * V + 5]), np.vstack([F, F + len(V)]))


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("shape", ["bumpy", "cone", "hemisphere", "head", "random_disk", "quad_patch"])
def test_areas_are_kept_and_nothing_folds(shape, boundary):
    V, F = getattr(meshes, shape)()
    result = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(boundary)))
    (chart,), (chart_map,) = result.charts, result.maps
    area = signed_areas(chart_map.uv, chart.triangles)
    assert (area > 0).all() and chart_map.folds == 0
    assert area.sum() == pytest.approx(face_areas(V, F).sum(), rel=1e-9)
    assert chart_map.area_l1 <= (0.01 if boundary == "free" else 0.02)
    figures = distortion(chart.vertices, chart.triangles, chart_map.uv[chart.triangles])
    assert figures.area_l1 == pytest.approx(chart_map.area_l1) and figures.overlap <= 1e-4


def test_the_boundary_fills_the_domain():
    surface = triangle_surface(*meshes.head(16))
    found = [drain(unwrap(surface, options=UnwrapOptions(name))) for name in ("disk", "square")]
    (loop,) = boundary_loops(found[0].charts[0].triangles)
    disk, square = (one.maps[0].uv[loop] for one in found)
    radius = np.linalg.norm(disk, axis=1)
    np.testing.assert_allclose(radius, radius[0], rtol=1e-9)
    side = np.abs(square).max()
    np.testing.assert_allclose(np.abs(square).max(axis=1), side, rtol=1e-9)
    assert (np.abs(np.abs(square) - side) < 1e-9 * side).all(axis=1).sum() == 4


def test_charts_share_one_texel_density():
    result = drain(unwrap(two_charts()))
    assert len(result.maps) == 2
    for chart, chart_map in zip(result.charts, result.maps, strict=True):
        uv_area = signed_areas(chart_map.uv, chart.triangles).sum()
        assert uv_area == pytest.approx(face_areas(chart.vertices, chart.triangles).sum(), rel=1e-9)


def test_corner_uv_names_every_mapped_corner_once():
    surface = two_charts()
    faces = np.arange(len(surface.triangles)) < 200
    corners, uv = drain(unwrap(surface, faces)).corner_uv()
    np.testing.assert_array_equal(np.sort(corners), np.arange(600))
    assert uv.shape == (600, 2) and np.isfinite(uv).all()


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_pose_and_units_only_scale_the_result(boundary):
    V, F = meshes.head(12)
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    reference = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(boundary))).maps[0].uv
    for moved, scale in ((1e-6 * V, 1e-6), (1e6 * V, 1e6), (V @ rotation.T + 7, 1), (V @ rotation.T + 1e5, 1)):
        uv = drain(unwrap(triangle_surface(moved, F), options=UnwrapOptions(boundary))).maps[0].uv / scale
        np.testing.assert_allclose(uv, reference, atol=1e-6 * np.abs(reference).max())


def _move(surface, scale, shift):
    return replace(surface, positions=surface.positions * scale + shift)


@pytest.mark.parametrize("scale, shift", [(1e-6, 0), (1e6, 0), (1, 1e5)])
@pytest.mark.parametrize(
    "shape", ["hinge", "annulus", "torus", pytest.param("teapot", marks=meshes.models_missing), "elongated"]
)
def test_neither_the_unit_nor_the_place_of_a_mesh_changes_its_uvs(shape, scale, shift):
    surface = _surface(shape)
    reference, moved = _unwrapped(shape), drain(unwrap(_move(surface, scale, shift)))
    np.testing.assert_array_equal(moved.seams, reference.seams)
    for a, b in zip(moved.maps, reference.maps, strict=True):
        assert (a.status, b.status) == ("converged", "converged")
        np.testing.assert_allclose(a.uv / scale, b.uv, atol=1e-5 * np.ptp(b.uv, axis=0).max())


def _surface(shape):
    if shape == "teapot":
        return triangle_surface(*meshes.load_model(shape))
    return triangle_surface(*(meshes.grid(200, 2, width=100.0) if shape == "elongated" else getattr(meshes, shape)()))


@functools.cache
def _unwrapped(shape):
    return drain(unwrap(_surface(shape)))


def test_halves_that_hang_by_an_edge_start_from_where_no_face_is_squeezed():
    """The conformal map of the one half is so small beside the other's that rounding decides where its points lie."""
    (chart_map,) = _unwrapped("hinge").maps
    assert chart_map.status == "converged" and chart_map.newton_refinement <= 40
    assert chart_map.area_l1 <= 0.01 and chart_map.folds == 0


@pytest.mark.parametrize("boundary", ["free", "disk", "square"])
def test_the_order_of_vertices_and_faces_does_not_matter(boundary):
    V, F = meshes.bumpy(9, 7)
    rng = np.random.default_rng(0)
    order, rows = rng.permutation(len(V)), rng.permutation(len(F))
    maps = []
    for points, triangles in ((V, F), (V[order], np.argsort(order)[F[rows]])):
        found = drain(unwrap(triangle_surface(points, triangles), options=UnwrapOptions(boundary)))
        uv = np.empty((len(V), 2))
        uv[found.charts[0].vertex_ids] = found.maps[0].uv
        maps.append(uv)
    np.testing.assert_array_equal(maps[1], maps[0][order])


def test_the_diagonals_of_quads_do_not_matter():
    V, _ = meshes.grid(6, 6)
    V = np.column_stack([V[:, :2], 0.3 * np.sin(5 * V[:, 0] + 1) * np.cos(3 * V[:, 1])])
    a = (7 * np.arange(6)[:, None] + np.arange(6)).ravel()
    surface = meshes.polygon_surface(V, np.column_stack([a, a + 1, a + 8, a + 7]).tolist())
    other = surface.triangles.reshape(-1, 6)[:, [0, 1, 5, 1, 2, 5]].reshape(-1, 3)
    some = np.repeat(np.random.default_rng(0).random(len(other) // 2) < 0.5, 2)
    cut_otherwise = replace(surface, triangles=np.where(some[:, None], other, surface.triangles))
    found = [drain(unwrap(s)) for s in (surface, cut_otherwise)]
    for given, one in zip((surface, cut_otherwise), found, strict=True):
        drawn = np.sort(one.charts[0].corners, axis=1)
        assert {tuple(t) for t in drawn} == {tuple(t) for t in np.sort(given.triangles, axis=1)}
    np.testing.assert_array_equal(found[0].corner_uv()[1], found[1].corner_uv()[1])


def test_progress_never_runs_backwards():
    seen: list[Progress] = []
    # A strip has no room in a disk for an embedding.
    drain(unwrap(triangle_surface(*meshes.spiral_strip()), options=UnwrapOptions("disk")), seen.append)
    fractions = [p.fraction for p in seen]
    assert {"Conformal map", "Optimal transport", "Refinement"} <= {p.stage for p in seen}
    assert min(fractions) >= 0 and max(fractions) <= 1 and (np.diff(fractions) >= -1e-12).all()


def test_the_bar_rises_through_all_rounds_of_seams(monkeypatch):
    """A search that is content with anything at first, so that several rounds follow."""
    monkeypatch.setattr(shear_search, "SPREAD_OF_SHEAR", 2.0)
    seen: list[Progress] = []
    surface = triangle_surface(*meshes.cap(rings=8, sectors=16, opening=0.9))
    drain(unwrap(surface, options=UnwrapOptions(max_shear=1.15)), seen.append)
    fractions = [p.fraction for p in seen]
    assert any(p.early is not None for p in seen)
    assert (np.diff(fractions) >= -1e-12).all() and max(fractions) <= 1


def test_a_density_magnifies_exactly():
    V, F = meshes.hemisphere(16, 48)
    (chart,) = strict_charts(triangle_surface(V, F))
    density = np.where(chart.vertices[chart.triangles].mean(axis=1)[:, 2] > 0.8, 4.0, 1.0)
    result = drain(map_chart(chart, target=Target(density)))
    target = face_areas(chart.vertices, chart.triangles) * density
    area = signed_areas(result.uv, chart.triangles)
    share = area / area.sum()
    assert np.abs(share - target / target.sum()).sum() <= 0.01


@pytest.mark.parametrize("boundary", ["free", "disk"])
def test_a_draft_has_its_areas_within_5_percent_and_neither_folds_nor_overlap(boundary):
    V, F = meshes.bumpy(40, 40, height=1.5)
    found = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(boundary, "draft")))
    (draft,), (chart,) = found.maps, found.charts
    figures = distortion(chart.vertices, chart.triangles, draft.uv[chart.triangles])
    assert figures.area_l1 <= 0.05 and figures.folds == 0 and figures.overlap <= 1e-6


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_densities_that_make_no_sense(value):
    (chart,) = strict_charts(triangle_surface(*meshes.bumpy(4, 4)))
    density = np.ones(len(chart.triangles))
    density[5] = value
    with pytest.raises(errors.DensityError) as caught:
        drain(map_chart(chart, target=Target(density)))
    assert caught.value.elements.tolist() == [5]


def test_an_elongated_chart_falls_back_and_says_so():
    V, F = meshes.grid(200, 2, width=100.0)
    V[:, 2] = 0.1 * np.cos(3 * V[:, 0]) * (V[:, 1] == 0.5)
    (chart_map,) = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions("free"))).maps
    assert chart_map.area_l1 < 0.01 and chart_map.angle_mean < 1.1 and chart_map.folds == 0
    (filled,) = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions("disk"))).maps
    assert any("double precision" in w for w in filled.warnings) and filled.folds == 0


@pytest.mark.parametrize("scale, shift", [(1, 0), (1e-6, 0), (1e6, 0), (1, 1e5)])
def test_flat_charts_are_unrolled_however_long_or_slit(scale, shift):
    """A square with holes, whose cuts have two sides in one place, and a strip without a conformal map to the disk."""
    V, F = meshes.grid(60, 60)
    row, column = np.divmod(np.arange(len(F)) % 3600, 60)
    holes = V, F[~((row % 4 == 1) & (column % 4 == 1))]
    for V, F in (holes, meshes.grid(400, 2, width=400.0)):
        (chart_map,) = drain(unwrap(triangle_surface(scale * V + shift, F))).maps
        assert chart_map.area_l1 < 1e-6 and chart_map.angle_mean < 1 + 1e-6 and not chart_map.warnings


def test_errors_carry_the_indices_of_the_surface():
    V, F = meshes.bumpy(6, 6)
    A, T = meshes.annulus()
    both = triangle_surface(np.vstack([V, A + 5]), np.vstack([F, T + len(V)]))
    with pytest.raises(errors.NotADiskError) as caught:
        drain(unwrap(both, options=UnwrapOptions(seams="existing")))
    assert caught.value.elements.min() >= len(V)


def test_the_report_is_plain_data():
    import json

    report = drain(unwrap(two_charts(), options=UnwrapOptions("disk"))).report()
    assert len(report) == 2 and json.loads(json.dumps(report)) == report
    expected = {"vertices", "faces", "newton_conformal", "newton_transport", "residual_transport", "area_l1", "folds"}
    assert expected <= set(report[0]) and {"embedding", "refinement", "measure"} <= set(report[0]["seconds"])


@meshes.models_missing
@pytest.mark.parametrize("name", meshes.DISK_MODELS)
def test_models(name):
    result = drain(unwrap(triangle_surface(*meshes.load_model(name))))
    (chart,), (chart_map,) = result.charts, result.maps
    assert chart_map.folds == 0 and chart_map.area_l1 <= 0.01
    figures = distortion(chart.vertices, chart.triangles, chart_map.uv[chart.triangles])
    assert figures.overlap <= 1e-4
    if chart_map.newton_conformal is not None:
        assert chart_map.newton_conformal <= 12 and chart_map.residual_conformal <= 1e-8
    if name in ("alligator", "maze", "woody"):
        # Flat: unrolled, without distortion.
        assert chart_map.newton_transport is None and chart_map.angle_mean <= 1.001
    elif chart_map.newton_transport is not None:
        assert chart_map.newton_transport <= 25 and chart_map.residual_transport <= 1e-6


def _cable(length, closed):
    """A tube of quads about x, with ends to taste."""
    sectors, rings = 12, 4 * length
    angle = 2 * np.pi * np.arange(sectors) / sectors
    x = np.linspace(0, length, rings + 1)
    V = np.stack(np.broadcast_arrays(x[:, None], 0.2 * np.cos(angle), 0.2 * np.sin(angle)), axis=2).reshape(-1, 3)
    k = np.arange(sectors)
    quads = np.concatenate([np.column_stack([k, (k + 1) % sectors]) + sectors * r for r in range(rings)])
    polygons = np.column_stack([quads, quads[:, ::-1] + sectors]).tolist()
    ends = [k[::-1].tolist(), (k + sectors * rings).tolist()] if closed else []
    return meshes.polygon_surface(V, polygons + ends)


@pytest.mark.parametrize("closed", [True, False])
def test_long_bands_are_cut_across(closed):
    surface = _cable(24, closed)
    result = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))
    side = np.sqrt(sum(signed_areas(m.uv, c.triangles).sum() for c, m in zip(result.charts, result.maps, strict=True)))
    long = [
        max(np.ptp(m.uv @ turned, axis=0).max() for turned in (np.eye(2), np.array([[1, 1], [1, -1]]) / np.sqrt(2)))
        for m in result.maps
    ]
    assert max(long) < 2 * side and len(result.charts) < 12
    assert all(m.folds == 0 and m.area_l1 < 0.01 for m in result.maps)
    faces = np.concatenate([np.unique(c.faces) for c in result.charts])
    assert np.array_equal(np.sort(faces), np.arange(len(surface.face_start) - 1))
    # Along its seams the surface comes apart into these charts.
    again = strict_charts(replace(surface, seams=result.seams))
    assert {frozenset(c.faces.tolist()) for c in again} == {frozenset(c.faces.tolist()) for c in result.charts}


def test_ribbons_and_bands_between_marked_seams_stay_whole():
    V, F = meshes.grid(120, 1, width=120.0, height=1.0)
    ribbon = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(max_shear=1.35)))
    assert len(ribbon.charts) == 1
    short, long = (drain(unwrap(_cable(n, True), options=UnwrapOptions(max_shear=1.35))) for n in (2, 6))
    # The ends of the short one are large enough to come off; what is between them is one band.
    assert len(short.charts) == 3 and len(long.charts) > 1
    cable = _cable(24, False)
    line = 12 * np.arange(24 * 4 + 1)
    marked = replace(cable, seams=np.column_stack([line[:-1], line[1:]]))
    assert len(drain(unwrap(marked, options=UnwrapOptions(max_shear=1.35))).charts) == 1


@pytest.mark.parametrize("size", [2.0**-500, 2.0**-200, 2.0**200])
def test_sizes_of_which_squares_are_no_numbers_come_out_as_others(size):
    V, F = meshes.cap(rings=3, sectors=8)
    options = UnwrapOptions("free", "draft", balance=0.5, max_shear=1.1)
    found = [drain(unwrap(triangle_surface(s * V, F), options=options)) for s in (1.0, size)]
    assert len(found[0].maps) == len(found[1].maps)
    assert all(np.isfinite(chart_map.uv).all() for chart_map in found[1].maps)


@pytest.mark.parametrize("depth", [0.6, 0.9])
def test_a_flat_plane_with_a_dart_is_laid_down_as_it_is(depth):
    V, Q = meshes.quad_grid(6, 6)
    V = V[:, :2].copy()
    # The middle vertex beyond a diagonal of the quad that follows it.
    V[24] += depth * (V[32] - V[24])
    surface = meshes.polygon_surface(np.column_stack([V, 0 * V[:, 0]]), Q)
    (found,) = drain(unwrap(surface)).maps
    assert found.area_l1 < 1e-9 and found.angle_mean == pytest.approx(1, abs=1e-7) and not found.folds
