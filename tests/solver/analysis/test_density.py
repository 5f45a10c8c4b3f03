"""Target densities by what defines them: sums, invariances, and limits of how fast they vary."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.density import (
    Target,
    checked_density,
    from_vertices,
    gaussian_curvature_density,
    graded_density,
    mean_curvature_density,
    means_of_corners,
    normalised_density,
    painted_density,
    region_share,
    relative_entropy,
)
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.errors import DensityError, ShareError, WeightError
from omt_uv.solver.mesh.geometry import face_areas


def test_means_of_corners_of_triangles_are_those_of_their_vertices():
    V, F = meshes.bumpy(5, 4)
    values = V[:, 0] ** 2
    assert means_of_corners(values, F.ravel(), 3 * np.arange(len(F) + 1)) == pytest.approx(from_vertices(values, F))
    found = means_of_corners(np.arange(6.0), np.array([0, 1, 2, 3, 5, 4, 3]), np.array([0, 4, 7]))
    assert found.tolist() == [1.5, 4.0]


def rotation(seed=0):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def spot(mesh, falloff=0.5, radius=0.25):
    """Weights of faces: 1 within the radius about the middle of a unit square, falling to 0 over the falloff."""
    V, F = mesh
    d = np.linalg.norm(V[:, :2] - 0.5, axis=1)
    return from_vertices(np.clip((radius * (1 + falloff / 2) - d) / (radius * falloff), 0, 1), F)


def test_painted_weights():
    w = np.array([0, 0.5, 1.0])
    np.testing.assert_allclose(painted_density(w, 4), [1, 2.5, 4])
    np.testing.assert_allclose(painted_density(w, 1), np.ones(3))


@pytest.mark.parametrize("factor", [0.0, -2.0, np.nan, np.inf])
def test_factors_that_are_none(factor):
    for call in (painted_density, lambda w, m: exact_density(w, np.ones(2), m)):
        with pytest.raises(ShareError, match="A region cannot have"):
            call(np.array([0, 1.0]), factor)


@pytest.mark.parametrize(
    ("weights", "message", "elements"),
    [
        ([0, np.nan, 1], "finite", [1]),
        ([0, 2, 1], "between", [1]),
        ([0, 0, 0], "zero", []),
        ([1, 1, 1], "same", []),
    ],
)
def test_weights_that_mark_nothing(weights, message, elements):
    with pytest.raises(WeightError, match=message) as caught:
        painted_density(np.array(weights, float), 2.0)
    assert caught.value.elements.tolist() == elements


@pytest.mark.parametrize("make", [gaussian_curvature_density, mean_curvature_density])
def test_curvature_densities_mean_the_same_on_every_mesh(make):
    """Half of a sphere's measure is curvature with c = 1, whatever its size; the density of a plane is 1."""
    V, F = meshes.icosphere(3)
    for scale in (1e-3, 1.0, 1e4):
        area = face_areas(scale * V, F)
        assert area @ make(scale * V, F, 1.0) == pytest.approx(2 * area.sum(), rel=0.02)
    np.testing.assert_allclose(make(*meshes.grid(), 5.0), 1, atol=1e-9)
    V, F = meshes.bumpy()
    np.testing.assert_allclose(make(7 * V @ rotation() + 3, F), make(V, F), rtol=1e-6)


def test_densities_compose_and_normalise():
    V, F = meshes.bumpy()
    area, a, b = face_areas(V, F), painted_density(spot((V, F)), 3.0), gaussian_curvature_density(V, F)
    both = checked_density(a * b)
    w = spot((V, F))
    # The factor is what it was, against what the other density gives the region and the rest.
    inside, outside = (region_share(w, area * d) / (1 - region_share(w, area * d)) for d in (both, b))
    assert 1 < inside / outside <= 3
    assert area @ normalised_density(both, area) == pytest.approx(area.sum())


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, 1e-9])
def test_attributes_that_are_no_densities(bad):
    with pytest.raises(DensityError) as caught:
        checked_density(np.array([1, bad, 1]))
    assert caught.value.elements.tolist() == [1]


def test_grading_limits_how_fast_the_spacing_grows():
    V, F = meshes.grid(40, 40)
    samples, limit = 1000, 0.3
    density = np.where(np.arange(len(F)) == 1700, 400.0, 1.0)
    normal = normalised_density(density, face_areas(V, F))
    graded = graded_density(density, V, F, limit, samples)
    assert (graded >= normal * (1 - 1e-12)).all()
    centre = V[F].mean(axis=1)
    spacing = np.sqrt(1 / (samples * graded))
    far = np.linalg.norm(centre[:, None] - centre[None, ::7], axis=2)
    # Spacing is set at vertices and read at faces, whose corners are one edge apart.
    assert (spacing[:, None] <= spacing[None, ::7] + limit * (1.5 * far + 3 / 40)).all()
    np.testing.assert_allclose(graded_density(np.ones(len(F)), V, F, limit, samples), 1)


@pytest.mark.parametrize("rows", [np.array([4, 1, 1]), np.arange(6) % 2 == 0], ids=["numbers", "mask"])
def test_a_part_of_a_target_keeps_what_it_has(rows):
    density, region = np.arange(1.0, 7.0), np.linspace(0, 1, 6)
    part = Target(density, region).of(rows)
    np.testing.assert_array_equal(part.density, density[rows])
    np.testing.assert_array_equal(part.region, region[rows])
    assert Target(density).of(rows).region is None


@pytest.mark.parametrize("scale", [1.0, 1e-6, 40.0])
def test_entropies_are_of_shares_and_count_what_has_any(scale):
    target, area = np.array([1.0, 3.0, 0.0]), np.array([2.0, 1.0, 1.0])
    expected = 0.25 * np.log(0.25 / 0.5) + 0.75 * np.log(0.75 / 0.25)
    assert relative_entropy(scale * target, area) == pytest.approx(expected)
    assert relative_entropy(target, scale * area) == pytest.approx(expected)
    assert relative_entropy(area, scale * area) == pytest.approx(0, abs=1e-12)
    # A triangle without area, or without a target, is passed over.
    assert relative_entropy(area, target) == pytest.approx(0.5 * np.log(0.5 / 0.25) + 0.25 * np.log(0.25 / 0.75))
