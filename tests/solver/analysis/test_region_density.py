"""Densities of a painted region: shares come out as asked, compose, and no other density is nearer."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.density import from_vertices, normalised_density, region_share, relative_entropy
from omt_uv.solver.analysis.region_density import exact_density, target_density
from omt_uv.solver.errors import ShareError
from omt_uv.solver.mesh.geometry import face_areas

FACTORS = [0.25, 0.5, 1.0, 2.0, 4.0, 16.0]


def spot(mesh, falloff=0.5, radius=0.25):
    """Weights of faces: 1 within the radius about the middle of a unit square, falling to 0 over the falloff."""
    V, F = mesh
    d = np.linalg.norm(V[:, :2] - 0.5, axis=1)
    return from_vertices(np.clip((radius * (1 + falloff / 2) - d) / (radius * falloff), 0, 1), F)


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("falloff", [1e-3, 0.5, 1.0])
def test_the_share_is_exact(factor, falloff):
    V, F = meshes.bumpy(40, 40)
    area, w = face_areas(V, F), spot((V, F), falloff, radius=0.1)
    found = exact_density(w, area, factor)
    assert found.target_share == pytest.approx(factor * region_share(w, area))
    assert region_share(w, area * found.density) == pytest.approx(found.target_share, rel=1e-9)
    assert (found.density > 0).all()
    order = np.argsort(w)
    assert (np.diff(found.density[order]) * np.sign(factor - 1) >= -1e-12).all()
    assert found.contrast == pytest.approx(found.density[w == 1].mean() / found.density[w == 0].mean())


@pytest.mark.parametrize("falloff", [0.5, 1.9])
def test_shares_compose(falloff):
    """Twice by m is once by m^2, in every face; also where the falloff is most of the region."""
    V, F = meshes.bumpy(40, 40)
    area, w = face_areas(V, F), spot((V, F), falloff, radius=0.1)
    factor = (0.9 / region_share(w / w.max(), area)) ** 0.5
    first = exact_density(w / w.max(), area, factor)
    second = exact_density(w / w.max(), area, factor, base=first.density)
    assert second.target_share == pytest.approx(0.9)
    once = exact_density(w / w.max(), area, factor**2).density
    twice = normalised_density(first.density * second.density, area)
    np.testing.assert_allclose(twice, normalised_density(once, area), rtol=1e-9)


def test_no_measure_with_this_share_is_nearer():
    """Nearest in relative entropy: any change of the faces' areas that keeps the share takes it farther away."""
    V, F = meshes.bumpy(20, 20)
    area, w = face_areas(V, F), spot((V, F))
    target = normalised_density(exact_density(w, area, 2.0).density, area) * area
    random = np.random.default_rng(0)
    for _ in range(5):
        change = random.normal(size=len(F)) * target
        kept = np.column_stack([np.ones(len(F)), w])
        change -= target[:, None] * kept @ np.linalg.solve(kept.T @ (target[:, None] * kept), kept.T @ change)
        other = target + 0.2 * change / np.abs(change / target).max()
        assert region_share(w, other) == pytest.approx(region_share(w, target))
        assert relative_entropy(other, area) > relative_entropy(target, area)


@pytest.mark.parametrize("share", [1.0, 1.5])
def test_a_share_of_everything_is_refused(share):
    w = np.array([0, 0, 0, 1.0])
    with pytest.raises(ShareError, match="leaves nothing"):
        exact_density(w, np.ones(4), 4 * share)


def test_the_target_is_the_share_or_the_contrast():
    V, F = meshes.bumpy()
    area, w = face_areas(V, F), spot((V, F))
    exact, painted = (target_density(w, area, 2.0, exact) for exact in (True, False))
    assert exact.target_share == pytest.approx(2 * exact.share_before)
    assert painted.contrast == 2.0 and painted.density.max() == 2 * painted.density.min()
    assert region_share(w, painted.density * area) == pytest.approx(painted.target_share)
