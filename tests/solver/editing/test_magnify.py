"""Existing maps magnified, and pictures warped with them."""

import meshes
import numpy as np
import pytest
from polygons import cut

from omt_uv.solver.analysis.density import Target, from_vertices, normalised_density, region_share
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.editing.image_warp import warp_image
from omt_uv.solver.editing.magnify import magnify_map, magnify_region, with_concave_quads_apart
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.maps.overlap import overlap_share
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import MapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def blob(points, centre, radius):
    d = np.linalg.norm(points - centre, axis=1)
    t = np.clip((1.3 * radius - d) / (0.6 * radius), 0, 1)
    return t * t * (3 - 2 * t)


def square(n=20):
    V, F = meshes.grid(n, n)
    return V[:, :2].copy(), F


def disk():
    V, F = meshes.random_disk(400)
    return V[:, :2].copy(), F


def magnified(uv, F, weights, factor, **options):
    area, w = np.abs(signed_areas(uv, F)), from_vertices(weights, F)
    found = exact_density(w, area, factor)
    result = drain(magnify_map(uv, F, normalised_density(found.density, area), region=w, **options))
    return result, found, region_share(w, np.abs(signed_areas(result.uv, F)))


@pytest.mark.parametrize("boundary", ["own", "free"])
@pytest.mark.parametrize("factor", [0.25, 8.0])
@pytest.mark.parametrize("make", [square, disk])
def test_the_region_gets_its_share_without_folds(make, factor, boundary):
    uv, F = make()
    result, found, after = magnified(uv, F, blob(uv, uv.mean(0) + 0.05, 0.15 * np.ptp(uv)), factor, boundary=boundary)
    assert after == pytest.approx(found.target_share, rel=5e-3)
    assert (signed_areas(result.uv, F) > 0).all()
    assert overlap_share(result.uv[F]) <= 1e-4
    # A polygon in a circle gains or loses a little where its vertices slide.
    assert signed_areas(result.uv, F).sum() == pytest.approx(signed_areas(uv, F).sum(), rel=2e-2)
    assert result.area_error <= 0.01


def test_outlines_are_kept():
    uv, F = square()
    result, _, _ = magnified(uv, F, blob(uv, [0.3, 0.4], 0.15), 4.0)
    for k in range(2):
        for side in (0, 1):
            on = uv[:, k] == side
            np.testing.assert_allclose(result.uv[on, k], side, atol=1e-9)
    uv, F = disk()
    boundary = np.isclose(np.linalg.norm(uv, axis=1), 1)
    result, _, _ = magnified(uv, F, blob(uv, [0.2, 0.3], 0.3), 3.0)
    assert np.ptp(np.linalg.norm(result.uv[boundary], axis=1)) < 1e-2 and result.outline == "circle"


@pytest.mark.parametrize("boundary", ["own", "free"])
def test_twice_by_two_is_once_by_four(boundary):
    uv, F = square(30)
    weights = blob(uv, [0.35, 0.6], 0.12)
    once, _, share_once = magnified(uv, F, weights, 4.0, boundary=boundary)
    half, _, _ = magnified(uv, F, weights, 2.0, boundary=boundary)
    twice, _, share_twice = magnified(half.uv, F, weights, 2.0, boundary=boundary)
    assert share_twice == pytest.approx(share_once, rel=0.02)
    assert np.linalg.norm(twice.uv - once.uv, axis=1).max() <= 0.02 * np.ptp(once.uv, axis=0).max()


@pytest.mark.parametrize(("first", "second"), [(2.0, 2.0), (2.0, 3.0), (1.5, 2.0)])
@pytest.mark.parametrize(("make", "boundary"), [(square, "own"), (disk, "own"), (disk, "free")])
def test_steps_compose(make, boundary, first, second):
    """The same region magnified twice, and once by the product; on a coarse and irregular mesh, too."""
    uv, F = make()
    w = from_vertices(blob(uv, uv.mean(0) + 0.1 * np.ptp(uv), 0.15 * np.ptp(uv)), F)
    once = drain(magnify_region(uv, F, w, first * second, boundary=boundary))
    half = drain(magnify_region(uv, F, w, first, boundary=boundary))
    twice = drain(magnify_region(half.uv, F, w, second, boundary=boundary))
    shares = [region_share(w, np.abs(signed_areas(x.uv, F))) for x in (once, twice)]
    assert shares == pytest.approx([first * second * region_share(w, np.abs(signed_areas(uv, F)))] * 2, rel=5e-3)
    assert np.linalg.norm(twice.uv - once.uv, axis=1).max() <= 0.02 * np.ptp(once.uv, axis=0).max()
    assert (signed_areas(twice.uv, F) > 0).all() and once.area_error <= 0.02


def test_place_size_and_mirroring_do_not_matter():
    uv, F = square(16)
    weights = blob(uv, [0.4, 0.5], 0.2)
    there = lambda x: x * [-7, 7] + [100, 3]  # noqa: E731
    plain, _, _ = magnified(uv, F, weights, 3.0)
    moved, _, _ = magnified(there(uv), F, weights, 3.0)
    np.testing.assert_allclose(moved.uv, there(plain.uv), atol=1e-6)


def test_folded_uvs_are_refused():
    uv, F = square(8)
    uv[40] += 0.5
    with pytest.raises(FoldedUVError) as caught:
        drain(magnify_map(uv, F, np.ones(len(F))))
    assert set(caught.value.elements) == set(np.flatnonzero(signed_areas(uv, F) <= 0))


# ---- from the mesh ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("boundary", ["free", "disk", "square"])
@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_a_surface_is_unwrapped_with_a_density(factor, boundary):
    (chart,) = strict_charts(triangle_surface(*meshes.head(16)))
    V, F = chart.vertices, chart.triangles
    w = from_vertices(blob(V, V[np.argmax(V[:, 0])], 0.6), F)
    found = exact_density(w, face_areas(V, F), factor)
    density = normalised_density(found.density, face_areas(V, F))
    result = drain(map_chart(chart, options=MapOptions(boundary), target=Target(density, w)))
    area = signed_areas(result.uv, F)
    assert (area > 0).all() and result.area_l1 <= 0.02
    assert region_share(w, area) == pytest.approx(found.target_share, rel=5e-3)
    assert area.sum() == pytest.approx(face_areas(V, F).sum(), rel=1e-9)


def test_shares_hold_across_charts():
    V, F = meshes.bumpy(12, 12)
    surface = triangle_surface(np.vstack([V, V + 5]), np.vstack([F, F + len(V)]))
    density = np.where(np.arange(2 * len(F)) < len(F), 3.0, 1.0)
    result = drain(unwrap(surface, target=Target(density)))
    first, second = (signed_areas(m.uv, c.triangles).sum() for c, m in zip(result.charts, result.maps, strict=True))
    assert first == pytest.approx(3 * second, rel=1e-6)


# ---- pictures -----------------------------------------------------------------------------------------------


def test_a_warped_picture_shows_the_same_on_the_mesh():
    """A picture that is a smooth function of the place has that function's value at every vertex' new place."""
    uv, F = square(20)
    result, _, _ = magnified(uv, F, blob(uv, [0.5, 0.5], 0.2), 3.0)
    n = 256
    y, x = (np.mgrid[0:n, 0:n] + 0.5) / n
    picture = np.stack([x, y, x * y, np.ones_like(x)], axis=2)
    after = warp_image(picture, uv[F], result.uv[F])
    inner = (np.abs(uv - 0.5) < 0.45).all(axis=1)
    column, row = (np.clip(result.uv[inner] * n, 0, n - 1).astype(int)).T
    expected = np.column_stack([uv, uv.prod(1), np.ones(len(uv))])[inner]
    assert np.abs(after[row, column] - expected).max() < 3 / n * 3
    np.testing.assert_allclose(warp_image(picture, uv[F], uv[F])[1:-1, 1:-1], picture[1:-1, 1:-1], atol=1e-9)


# ---- scores -------------------------------------------------------------------------------------------------


def test_areas_that_cannot_be_are_said():
    V, F = meshes.bumpy(16, 16)
    uv = V[:, :2].copy()
    rough = from_vertices(np.random.default_rng(0).integers(0, 2, len(V)).astype(float), F)
    soft = from_vertices(blob(uv, uv.mean(0), 0.2), F)
    for weights, factor, said in ((rough, 1.9, True), (soft, 2.0, False)):
        found = exact_density(weights, area := face_areas(V, F), factor)
        (chart,) = strict_charts(triangle_surface(V, F))
        options = {"density": normalised_density(found.density, area), "region": weights}
        result = drain(map_chart(chart, target=Target(**options)))
        assert any("Areas are" in text for text in result.warnings) == said == (result.area_l1 > 0.016)


def flat_quads(columns=16, rows=16, turn=0):
    """A square of quads: its map (n,2) from -1 to 1, triangles and polygons, cut from their corner `turn`."""
    V, Q = meshes.quad_grid(columns, rows)
    x, y = np.meshgrid(np.linspace(-1, 1, columns + 1), np.linspace(-1, 1, rows + 1))
    assert len(V) == x.size
    return np.column_stack([x.ravel(), y.ravel()]), *cut(Q, turn)


def radial(uv, triangles, faces, radius=0.7):
    """Weights of triangles, the same for all of a polygon, that fall off from 0."""
    t = np.clip(2 * (1 - np.linalg.norm(uv, axis=1) / radius), 0, 1)
    return means_of_polygons(t * t * (3 - 2 * t), triangles, faces)


def means_of_polygons(values, triangles, faces):
    corners = [np.unique(triangles[faces == f]) for f in range(faces.max() + 1)]
    return np.array([values[c].mean() for c in corners])[faces]


@pytest.mark.parametrize("boundary", ["own", "free"])
@pytest.mark.parametrize("factor", [3.0, 0.3])
def test_a_symmetric_region_of_quads_keeps_its_symmetry(factor, boundary):
    uv, F, faces = flat_quads()
    w = radial(uv, F, faces)
    result = drain(magnify_region(uv, F, w, factor, boundary=boundary, polygons=faces))
    area = np.abs(signed_areas(result.uv, F))
    assert region_share(w, area) == pytest.approx(factor * region_share(w, np.abs(signed_areas(uv, F))), rel=5e-3)
    assert (signed_areas(result.uv, F) > 0).all() and result.area_error < 0.02
    grid = result.uv.reshape(17, 17, 2)
    assert np.abs(grid[:, ::-1] * [-1, 1] - grid).max() < 1e-9 and np.abs(grid[::-1] * [1, -1] - grid).max() < 1e-9
    if boundary == "own":
        assert np.abs(np.abs(grid[[0, -1], :, 1]) - 1).max() < 1e-9


def test_the_diagonals_of_quads_do_not_matter():
    found = []
    for turn in (0, 1):
        uv, F, faces = flat_quads(10, 8, turn)
        w = radial(uv + 0.1, F, faces)
        found.append(drain(magnify_region(uv, F, w, 2.0, quality="exact", polygons=faces)).uv)
    assert np.abs(found[0] - found[1]).max() < 1e-6


def test_a_concave_quad_stays_where_its_density_is_one():
    uv = np.array([[0, 0], [4, 0], [4, 4], [0, 4], [1.5, 0.3], [3.0, 1]])
    F, faces = cut([[0, 1, 5, 4], [1, 2, 5], [2, 3, 4], [5, 2, 4], [3, 0, 4]], 1)
    apart = with_concave_quads_apart(uv, F, faces)
    quad = faces == 0
    assert (signed_areas(uv, F) > 0).all() and len(set(apart[quad])) == 2
    assert len(set(apart)) == len(set(faces)) + 1
    result = drain(magnify_map(uv, F, np.ones(len(F)), polygons=faces))
    np.testing.assert_allclose(result.uv, uv, atol=1e-6)


@pytest.mark.parametrize(("factor", "radius"), [(2.0, 0.25), (4.0, 0.25), (8.0, 0.3), (16.0, 0.2)])
def test_a_circle_stays_the_circle_it_is(factor, radius):
    angle = 2 * np.pi * np.arange(64) / 64
    V, F = meshes.polar(lambda t: t, lambda t: 0 * t, 10, 64)
    uv = V[:, :2].copy()
    assert np.abs(uv).max() == pytest.approx(np.abs(np.exp(1j * angle)).max())
    w = from_vertices(blob(uv, np.array([0.5, 0.2]), radius), F)
    result = drain(magnify_region(uv, F, w, factor))
    loop = boundary_loops(F)[0]
    assert result.outline == "circle"
    np.testing.assert_allclose(np.linalg.norm(result.uv[loop], axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("factor", [0.25, 1.5, 8.0])
def test_without_an_exact_share_the_factor_is_that_between_the_weights_after_all_steps(factor):
    uv, F = square(14)
    w = np.where(np.linalg.norm(uv[F].mean(axis=1) - uv.mean(axis=0), axis=1) < 0.3 * np.ptp(uv), 1.0, 0.0)
    found = drain(magnify_region(uv, F, w, factor, exact=False))
    ratio = np.abs(signed_areas(found.uv, F)) / np.abs(signed_areas(uv, F))
    assert ratio[w == 1].mean() / ratio[w == 0].mean() == pytest.approx(factor, rel=0.02)
