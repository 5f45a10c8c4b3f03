"""Every field of a result is what its name says, told from the others by plain formulas."""

from __future__ import annotations

from itertools import product

import meshes
import numpy as np
import pytest
from scipy.spatial import cKDTree
from sphere_shapes import blob

from omt_uv.solver.analysis.region_density import MOST_OF_HARD, exact_density, target_density
from omt_uv.solver.comparison import comparison_figures
from omt_uv.solver.conformal.disk_map import conformal_disk
from omt_uv.solver.errors import ShareError
from omt_uv.solver.flows.domain import ball_domain
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.strain.beltrami import beltrami
from omt_uv.solver.strain.figures import BINS, MOST, match_figures
from omt_uv.solver.strain.regions import compare_regions, region_strain
from omt_uv.solver.transport.convex_domain import Disk
from omt_uv.solver.transport.polar_factorization import polar_factorisation
from omt_uv.solver.volumes.transfer import TetLocation


@pytest.mark.parametrize("balance", [0.0, 0.4, 1.0])
def test_of_a_polar_factorisation(balance):
    V, F = meshes.bumpy()
    sites, mass, disk = drain(conformal_disk(V, F)).uv, 7 * vertex_areas(V, F), Disk()
    found = drain(polar_factorisation(sites, mass, disk, balance))
    assert np.array_equal(found.sites, sites) and found.iterations >= (balance < 1)
    assert found.mass.sum() == pytest.approx(disk.area) == pytest.approx(found.area.sum())
    assert np.abs(found.area - found.mass).max() == pytest.approx((found.mass * found.residual).max(), abs=1e-6)
    assert (np.abs(found.area - found.mass) / found.mass).max() == pytest.approx(found.residual, rel=1e-3, abs=1e-12)
    # The measure given and that of the sites' own cells, blended: linear in the balance.
    ends = [drain(polar_factorisation(sites, mass, disk, t)).mass for t in (0.0, 1.0)]
    assert np.allclose(found.mass, (1 - balance) * ends[0] + balance * ends[1], rtol=1e-12)
    assert np.allclose(ends[0], mass * disk.area / mass.sum()) and not np.allclose(ends[0], ends[1], rtol=0.01)
    # Cells are convex: each holds its own centroid.
    assert np.array_equal(found.potential(found.uv)[1], sites)


def test_of_the_strain_of_regions():
    V, F = meshes.bumpy(8, 8)
    found = beltrami(V, F, V[:, :2] * [1.5, 1.0])
    rng = np.random.default_rng(0)
    weights = {"soft": rng.random(len(F)), "hard": (rng.random(len(F)) < 0.3).astype(float), "none": np.zeros(len(F))}
    rows = region_strain(found, weights)
    assert [row.name for row in rows] == ["all", "soft", "hard"]
    area = face_areas(V, F)
    for row, w in zip(rows, (np.ones(len(F)), weights["soft"], weights["hard"]), strict=True):
        assert row.share == pytest.approx((area * w).sum() / area.sum()) and row.histogram.sum() == pytest.approx(1)
        assert row.mean == pytest.approx((area * w) @ found.size / (area * w).sum())
        assert row.greatest == pytest.approx(found.size[w > 0].max())
    assert compare_regions(rows, rows) == {"all": 0.0, "soft": 0.0, "hard": 0.0}
    # Without anything in common they are as far apart as can be.
    far = region_strain(beltrami(V, F, V[:, :2] * [40.0, 1.0]), weights)
    near = region_strain(beltrami(V, F, V), weights)
    for one, other in ((far, near), (near, far)):
        assert compare_regions(one, other) == pytest.approx({"all": 1.0, "soft": 1.0, "hard": 1.0})
    assert compare_regions(rows, near[:2]).keys() == {"all", "soft"}


@pytest.mark.parametrize(("width", "mean"), [(0.03, 0.9), (0.07, 2.1)])
def test_of_the_normals_of_a_comparison(width, mean, monkeypatch):
    """A patch, a strip of which is bent up by 30 degrees: three hundredths are beyond the 95th, not the 99th part."""
    monkeypatch.setattr(comparison_figures, "POINTS", 20_000)
    x, y = np.meshgrid([0.0, 0.5, 1 - width, 1.0], np.linspace(0, 1, 5))
    V = np.column_stack([x.ravel(), y.ravel(), np.zeros(20)])
    a = (np.arange(4)[:, None] * 4 + np.arange(3)).ravel()
    F = np.concatenate([np.column_stack([a, a + 1, a + 5]), np.column_stack([a, a + 5, a + 4])])
    bent = V + np.where(V[:, :1] > 0.999, width * np.array([np.cos(np.pi / 6) - 1, 0, 0.5]), 0)
    found = drain(comparison_figures.compare((V, F), (bent, F)))
    assert found.normal_p99 == pytest.approx(30, abs=0.1) and found.normal_mean == pytest.approx(mean, rel=0.15)
    few = drain(comparison_figures.compare((V, F), (V + 0.0, F)))
    assert few.normal_p99 < 1e-3 and few.hausdorff < 1e-9
    # The other way: what bends up is farthest from the patch, by half of the strip's width.
    assert found.hausdorff_b == pytest.approx(0.5 * width / np.sqrt(2), rel=0.02)


@pytest.mark.parametrize("size", [1.0, 0.01, 300.0])
def test_of_a_match(size):
    V, F = blob(2, seed=3)
    # To itself, whatever size it has there: every ratio is 1.
    face, corner = np.array([np.argwhere(v == F)[0] for v in range(len(V))]).T
    found = match_figures((V, F), (size * V, F), (face, np.eye(3)[corner]), size * V)
    assert found.mean_curvature == pytest.approx(1, rel=1e-6) and found.mean_area == pytest.approx(1, rel=1e-6)
    assert found.curvature[0] == pytest.approx(1) and found.area[0] == pytest.approx(1)
    # To an image that is stretched: shares of the area, and not areas, are compared.
    image = size * V * [1.0, 1.0, 3.0]
    found = match_figures((V, F), (size * V, F), (face, np.eye(3)[corner]), image)
    share, there = (vertex_areas(x, F) / vertex_areas(x, F).sum() for x in (V, image))
    ratio = np.minimum(np.maximum(share / there, there / share), MOST)
    assert found.mean_area == pytest.approx(share @ ratio, rel=1e-9)
    assert np.allclose(found.area, np.histogram(ratio, BINS, (1, MOST), weights=share)[0])


@pytest.mark.parametrize("factor", [0.5, 1.5, 3.0])
@pytest.mark.parametrize("share", [0.05, 0.2])
def test_of_the_density_of_a_region(factor, share):
    rng = np.random.default_rng(1)
    area = rng.uniform(0.5, 2, 4000)
    hard = (np.cumsum(area) < share * area.sum()).astype(float)
    for region in (hard, hard * rng.uniform(0.6, 1, 4000)):
        found = exact_density(region, area, factor)
        before = region @ area / area.sum()
        after = region @ (area * found.density) / (area @ found.density)
        assert found.share_before == pytest.approx(before) and found.target_share == pytest.approx(factor * before)
        assert after == pytest.approx(found.target_share, rel=1e-9)
        assert np.allclose(found.density, found.contrast**region)
        assert not found.warnings
    plain = target_density(hard, area, factor, exact=False)
    assert plain.contrast == factor and plain.share_before == pytest.approx(hard @ area / area.sum())
    assert plain.target_share == pytest.approx(hard @ (area * plain.density) / (area @ plain.density))


def test_a_border_is_called_soft_where_it_asks_for_far_more_contrast_than_a_hard_one_would():
    told = set()
    for power, factor in product((0.3, 1, 3, 8), (0.25, 0.5, 0.8, 1.2, 1.5, 2.0, 3.0)):
        region = np.linspace(0, 1, 1000) ** power
        before, target = region.mean(), factor * region.mean()
        if not 0 < target < 1:
            continue
        # A region of the same share with a hard border: its density over that of the rest.
        hard = target / before / ((1 - target) / (1 - before))
        try:
            found = exact_density(region, np.ones(1000), factor)
        except ShareError:
            continue
        soft = abs(np.log(found.contrast)) > abs(np.log(hard)) + np.log(MOST_OF_HARD)
        assert bool(found.warnings) == soft, (power, factor)
        told.add((soft, before < 0.5))
    assert len(told) == 4


@pytest.mark.parametrize("outside", [False, True])
def test_of_what_is_read_within_tetrahedra(outside):
    rng = np.random.default_rng(5)
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    tets = np.array([[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]])
    places = rng.uniform(0, 1, (200, 3)) + outside * rng.choice([-2.0, 2.0], (200, 3))
    location = TetLocation(points, tets)
    # What is the same everywhere is that outside as well, and nothing is beyond what is there.
    assert np.allclose(location.values(places, np.full(8, 4.5)), 4.5, rtol=1e-12)
    field = points @ [1.0, -2.0, 0.5] + 3
    found = location.values(places, field)
    assert field.min() - 1e-12 <= found.min() and found.max() <= field.max() + 1e-12
    if not outside:
        assert np.allclose(found, places @ [1.0, -2.0, 0.5] + 3, atol=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_of_a_wall(dimension):
    middle = np.array([3.0, -2.0, 5.0])[:dimension]
    wall = ball_domain(middle, 2.5, 200)
    assert len(wall.points) == 200 and np.array_equal(wall.middle, middle) and wall.reach == 2.5 and wall.ball
    assert np.allclose(np.linalg.norm(wall.points - middle, axis=1), 2.5)
    assert np.allclose(wall.points, middle + 2.5 * wall.normals)
    # Evenly spread: none has another on it, and they balance one another.
    apart = cKDTree(wall.points).query(wall.points, k=2)[0][:, 1]
    assert apart.min() > 0.5 * apart.max() and np.abs(wall.normals.mean(axis=0)).max() < 0.02
