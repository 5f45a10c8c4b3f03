"""Power diagrams on the sphere: exact sums, and what they do not depend on."""

import meshes
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from omt_uv.solver.errors import TransportError
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.transport.semidiscrete_sphere import SphereDual
from omt_uv.solver.transport.spherical_power_diagram import Hull, by_flips, by_hull, spherical_cells


@pytest.fixture
def sites():
    points = np.random.default_rng(0).normal(size=(90, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


@pytest.fixture
def site_weights():
    return 2e-4 * np.random.default_rng(1).normal(size=90)


def cells_of(sites, site_weights):
    return spherical_cells(sites, site_weights, by_hull(sites, site_weights))


def test_cells_fill_the_sphere(sites, site_weights):
    cells = cells_of(sites, site_weights)
    assert cells.area.sum() == pytest.approx(4 * np.pi)
    np.testing.assert_allclose(cells.moment.sum(axis=0), 0, atol=1e-12)
    assert len(cells.edges) == 3 * 90 - 6


def test_cells_of_an_octahedron_are_equal():
    sites = np.vstack([np.eye(3), -np.eye(3)])
    cells = cells_of(sites, np.zeros(6))
    np.testing.assert_allclose(cells.area, 4 * np.pi / 6, rtol=1e-12)
    np.testing.assert_allclose(cells.centroids(), sites, atol=1e-12)


def test_a_common_weight_and_a_turn_change_no_area(sites, site_weights):
    plain = cells_of(sites, site_weights)
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    for moved in (cells_of(sites, site_weights + 0.3), cells_of(sites @ turn.T, site_weights)):
        np.testing.assert_allclose(moved.area, plain.area, atol=1e-12)


def test_every_direction_belongs_to_its_greatest_support(sites, site_weights):
    """The centroid of a cell lies in it: x . q_i is greatest for its own site."""
    cells = cells_of(sites, site_weights)
    support = cells.centroids() @ (sites * np.exp(site_weights)[:, None]).T
    assert (support.argmax(axis=1) == np.arange(90)).all()


def test_flips_and_hull_agree(sites, site_weights):
    flipped, hidden = by_flips(by_hull(sites, np.zeros(90)), sites, site_weights)
    assert not hidden
    np.testing.assert_allclose(
        spherical_cells(sites, site_weights, flipped).area, cells_of(sites, site_weights).area, atol=1e-12
    )


def test_sites_on_half_of_the_sphere_have_no_cells(sites):
    with pytest.raises(TransportError, match="The sites of the transport leave half of the"):
        by_hull(np.abs(sites), np.zeros(90))


@pytest.mark.filterwarnings("error")
def test_sites_that_coincide_on_a_known_hull_are_named():
    """Facets on both sides of their edge have no normals, and nothing can be divided by what lies between."""
    points, triangles = meshes.icosphere(1)
    one, other = sorted(triangles[5, :2])
    points[other] = points[one]
    hull = Hull(triangles, twins(triangles))
    with pytest.raises(TransportError, match="The sites of the transport coincide") as caught:
        spherical_cells(points, np.zeros(len(points)), hull)
    assert caught.value.elements.tolist() == [one, other]


def test_a_step_to_cells_that_are_none_is_not_taken(monkeypatch):
    points, triangles = meshes.icosphere(1)
    cells = spherical_cells(points, np.zeros(len(points)), Hull(triangles, twins(triangles)))
    assert SphereDual(points).near(np.zeros(len(points)), cells) is not None
    points[triangles[5, 1]] = points[triangles[5, 0]]
    assert SphereDual(points).near(np.zeros(len(points)), cells) is None


@pytest.mark.parametrize("site", [0, 17, 60])
@pytest.mark.parametrize("off", [1e-3, 1e-5, 1e-7, 1e-9])
def test_a_site_is_hidden_from_the_very_weight_on_at_which_it_lies_in_the_hull_of_the_others(sites, site, off):
    """Flips and hulls agree on either side of it, however near."""
    others = ConvexHull(np.delete(sites, site, axis=0)).equations
    outward = others[:, :3] @ sites[site]
    bound = np.log((-others[:, 3] / outward)[outward > 0].min())
    near, weights = by_hull(sites, np.zeros(len(sites))), np.zeros(len(sites))
    weights[site] = bound - off
    assert by_flips(near, sites, weights) == (None, True)
    with pytest.raises(TransportError):
        by_hull(sites, weights)
    weights[site] = bound + off
    found, hidden = by_flips(near, sites, weights)
    faces = [{tuple(sorted(face)) for face in hull.triangles.tolist()} for hull in (found, by_hull(sites, weights))]
    assert faces[0] == faces[1] and not hidden
