"""Target measures by what defines them: sums, invariances, and shares that come out as asked."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis import curvature
from omt_uv.solver.analysis import density as measure
from omt_uv.solver.analysis.region_density import exact_share
from omt_uv.solver.errors import DensityError, ShareError, WeightError
from omt_uv.solver.mesh.geometry import face_areas

FACTORS = [0.25, 0.5, 1.0, 2.0, 4.0, 16.0]


def rotation(seed=0):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def spot(V, rim=0.5, radius=0.25):
    """Weights of faces: 1 within the radius about the middle of a unit square, falling to 0 over the rim."""
    V, F = V
    d = np.linalg.norm(V[:, :2] - 0.5, axis=1)
    return measure.from_vertices(np.clip((radius * (1 + rim / 2) - d) / (radius * rim), 0, 1), F)


def test_painted_weights():
    w = np.array([0, 0.5, 1.0])
    np.testing.assert_allclose(measure.painted(w, 4), [1, 2.5, 4])
    np.testing.assert_allclose(measure.painted(w, 1), measure.uniform(w))


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("rim", [1e-3, 0.5, 1.0])
def test_the_share_is_exact(factor, rim):
    V, F = meshes.bumpy(40, 40)
    area, w = face_areas(V, F), spot((V, F), rim, radius=0.1)
    found = exact_share(w, area, factor)
    assert found.asked == pytest.approx(factor * measure.share(w, area))
    assert measure.share(w, area * found.density) == pytest.approx(found.asked, rel=1e-9)
    assert (found.density > 0).all()
    order = np.argsort(w)
    assert (np.diff(found.density[order]) * np.sign(factor - 1) >= -1e-12).all()
    assert found.factor == pytest.approx(found.density[w == 1].mean() / found.density[w == 0].mean())


@pytest.mark.parametrize("rim", [0.5, 1.9])
def test_shares_compose(rim):
    """Twice by m is once by m^2, in every face; also where the rim is most of the region."""
    V, F = meshes.bumpy(40, 40)
    area, w = face_areas(V, F), spot((V, F), rim, radius=0.1)
    factor = (0.9 / measure.share(w / w.max(), area)) ** 0.5
    first = exact_share(w / w.max(), area, factor)
    second = exact_share(w / w.max(), area, factor, base=first.density)
    assert second.asked == pytest.approx(0.9)
    once = exact_share(w / w.max(), area, factor**2).density
    twice = measure.normalised(first.density * second.density, area)
    np.testing.assert_allclose(twice, measure.normalised(once, area), rtol=1e-9)


def test_no_measure_with_this_share_is_nearer():
    """Nearest in relative entropy: any change of the faces' areas that keeps the share takes it farther away."""
    V, F = meshes.bumpy(20, 20)
    area, w = face_areas(V, F), spot((V, F))
    target = measure.normalised(exact_share(w, area, 2.0).density, area) * area
    random = np.random.default_rng(0)
    for _ in range(5):
        change = random.normal(size=len(F)) * target
        kept = np.column_stack([np.ones(len(F)), w])
        change -= target[:, None] * kept @ np.linalg.solve(kept.T @ (target[:, None] * kept), kept.T @ change)
        other = target + 0.2 * change / np.abs(change / target).max()
        assert measure.share(w, other) == pytest.approx(measure.share(w, target))
        assert measure.entropy(other, area) > measure.entropy(target, area)


@pytest.mark.parametrize("share", [1.0, 1.5])
def test_a_share_of_everything_is_refused(share):
    w = np.array([0, 0, 0, 1.0])
    with pytest.raises(ShareError, match="leaves nothing"):
        exact_share(w, np.ones(4), 4 * share)


@pytest.mark.parametrize("factor", [0.0, -2.0, np.nan, np.inf])
def test_factors_that_are_none(factor):
    for call in (measure.painted, lambda w, m: exact_share(w, np.ones(2), m)):
        with pytest.raises(ShareError):
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
        measure.painted(np.array(weights, float), 2.0)
    assert caught.value.elements.tolist() == elements


def test_gauss_bonnet():
    for (V, F), total in ((meshes.icosphere(2), 4 * np.pi), (meshes.torus(), 0.0)):
        assert curvature.gaussian(V, F).sum() == pytest.approx(total, abs=1e-9)
    V, F = meshes.bumpy()
    rim = curvature.on_rim(F, len(V))
    assert rim.sum() == 4 * 16 and not curvature.gaussian(V, F)[rim].any()


def test_mean_curvature_of_a_sphere():
    """H = 1 / R, outward positive: the integral is 4 pi R."""
    V, F = meshes.icosphere(3)
    assert curvature.mean(3 * V + 50, F).sum() == pytest.approx(4 * np.pi * 3, rel=0.01)
    assert not curvature.mean(*meshes.grid()).any()


@pytest.mark.parametrize("make", [measure.gaussian_curvature, measure.mean_curvature])
def test_curvature_densities_mean_the_same_on_every_mesh(make):
    """Half of a sphere's measure is curvature with c = 1, whatever its size; the density of a plane is 1."""
    V, F = meshes.icosphere(3)
    for scale in (1e-3, 1.0, 1e4):
        area = face_areas(scale * V, F)
        assert area @ make(scale * V, F, 1.0) == pytest.approx(2 * area.sum(), rel=0.02)
    np.testing.assert_allclose(make(*meshes.grid(), 5.0), 1, atol=1e-9)
    V, F = meshes.bumpy()
    np.testing.assert_allclose(make(7 * V @ rotation() + 3, F), make(V, F), rtol=1e-6)


def test_sharpness_of_a_cube():
    V, F = meshes.cube()
    np.testing.assert_allclose(curvature.sharpness(V, F), np.pi / 2)
    np.testing.assert_allclose(curvature.sharpness(*meshes.grid()), 0, atol=1e-9)


def test_densities_compose_and_normalise():
    V, F = meshes.bumpy()
    area, a, b = face_areas(V, F), measure.painted(spot((V, F)), 3.0), measure.gaussian_curvature(V, F)
    both = measure.attribute(a * b)
    w = spot((V, F))
    # The factor is what it was, against what the other density gives the region and the rest.
    inside, outside = (measure.share(w, area * d) / (1 - measure.share(w, area * d)) for d in (both, b))
    assert 1 < inside / outside <= 3
    assert area @ measure.normalised(both, area) == pytest.approx(area.sum())


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, 1e-9])
def test_attributes_that_are_no_densities(bad):
    with pytest.raises(DensityError) as caught:
        measure.attribute(np.array([1, bad, 1]))
    assert caught.value.elements.tolist() == [1]


def test_grading_limits_how_fast_the_spacing_grows():
    V, F = meshes.grid(40, 40)
    samples, limit = 1000, 0.3
    density = np.where(np.arange(len(F)) == 1700, 400.0, 1.0)
    normal = measure.normalised(density, face_areas(V, F))
    graded = measure.graded(density, V, F, limit, samples)
    assert (graded >= normal * (1 - 1e-12)).all()
    centre = V[F].mean(axis=1)
    spacing = np.sqrt(1 / (samples * graded))
    far = np.linalg.norm(centre[:, None] - centre[None, ::7], axis=2)
    # Spacing is set at vertices and read at faces, whose corners are one edge apart.
    assert (spacing[:, None] <= spacing[None, ::7] + limit * (1.5 * far + 3 / 40)).all()
    np.testing.assert_allclose(measure.graded(np.ones(len(F)), V, F, limit, samples), 1)
