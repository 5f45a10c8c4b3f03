"""Closed surfaces on the sphere: conformal, no fold, every area exact, and independent of the pose."""

import meshes
import numpy as np
import pytest

from omt_uv.solver import errors
from omt_uv.solver.conformal.moebius import boost, centre_on_sphere, to_plane, to_sphere
from omt_uv.solver.maps.energy import derivatives_of, elements
from omt_uv.solver.mesh.geometry import angles_from_lengths, face_areas, halfedge_lengths, vertex_areas
from omt_uv.solver.mesh.spherical_geometry import normalized, signed_volumes, spherical_areas
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.projected_newton import Assembly
from omt_uv.solver.sphere.coarsen import collapse_to_tetrahedron
from omt_uv.solver.sphere.conformal import conformal_sphere
from omt_uv.solver.sphere.multilevel import multilevel_start
from omt_uv.solver.sphere.newton import SphereProblem, derivatives, newton_direction, project_faces, retract, tangents
from omt_uv.solver.sphere.refine import sphere_refine
from omt_uv.solver.sphere.sphere_map import sphere_map
from omt_uv.solver.transport.semidiscrete_sphere import sphere_transport
from omt_uv.solver.transport.spherical_power_diagram import Hull, by_flips, by_hull, spherical_cells

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
)


def blob(subdivisions=3, seed=0, strength=0.4):
    """A sphere with random smooth bumps."""
    V, F = meshes.icosphere(subdivisions)
    wave = np.random.default_rng(seed).normal(0, 2.5, (5, 3))
    return V * (1 + strength * np.sin(V @ wave.T).mean(1))[:, None], F


SHAPES = {
    "tetrahedron": TETRAHEDRON,
    "cube": meshes.cube(),
    "sphere": meshes.icosphere(2),
    "blob": blob(),
    "plate": (blob(3, 1)[0] * [1, 1, 0.05], blob(3, 1)[1]),
    "needle": (blob(3, 2)[0] * [1, 0.2, 0.2], blob(3, 2)[1]),
}


def test_planes_and_moebius_maps():
    rng = np.random.default_rng(0)
    z = rng.normal(size=50) + 1j * rng.normal(size=50)
    np.testing.assert_allclose(to_plane(to_sphere(z)), z, atol=1e-12)
    p = to_sphere(z)
    there = boost(p, np.array([0.3, -0.2, 0.5]))
    np.testing.assert_allclose(boost(there, -np.array([0.3, -0.2, 0.5])), p, atol=1e-13)
    mass = rng.random(50)
    np.testing.assert_allclose(mass @ centre_on_sphere(p, mass), 0, atol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_conformal(name):
    V, F = SHAPES[name]
    found = drain(conformal_sphere(V, F))
    p = found.positions
    assert found.residual <= 1e-9 and found.iterations <= 15
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(spherical_areas(p, F).sum(), 4 * np.pi, rtol=1e-12)
    assert (signed_volumes(p, F) > 0).all()
    p = found.sites
    mass = vertex_areas(V, F)
    np.testing.assert_allclose(mass @ p / mass.sum(), 0, atol=1e-9)


def test_conformal_keeps_angles():
    V, F = blob(4)
    p = drain(conformal_sphere(V, F)).positions
    before, after = (angles_from_lengths(halfedge_lengths(x, F).reshape(-1, 3)) for x in (V, p))
    assert np.degrees(np.abs(before - after)).mean() < 2


def test_conformal_is_one_map_in_any_pose():
    V, F = blob()
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    p, q = (drain(conformal_sphere(x, F)).positions for x in (V, 1e-3 * V @ turn.T + 1e3))
    u, _, v = np.linalg.svd(q.T @ p)
    np.testing.assert_allclose(q @ u @ v, p, atol=1e-6)


def _without_face(V, F):
    return V, F[1:]


def _two(V, F):
    return np.concatenate([V, V + 9]), np.concatenate([F, F + len(V)])


def _kissing(V, F):
    """Two copies that share vertex 0."""
    second = np.where(F == 0, 0, F + len(V) - 1)
    return np.concatenate([V, 2 * V[0] - V[1:]]), np.concatenate([F, second[:, ::-1]])


def _turned(V, F):
    F = F.copy()
    F[3] = F[3, ::-1]
    return V, F


def _not_finite(V, F):
    V = V.copy()
    V[5] = np.nan
    return V, F


BAD = {
    "open": (_without_face, errors.NotASphereError, 3),
    "parts": (_two, errors.NotASphereError, 80),
    "kissing": (_kissing, errors.NotASphereError, 1),
    "turned": (_turned, errors.OrientationError, 3),
    "nan": (_not_finite, errors.NonFiniteError, 1),
    "loose": (lambda V, F: (np.concatenate([V, [[0, 0, 9.0]]]), F), errors.NotASphereError, 1),
    "double": (lambda V, F: (V, np.concatenate([F, F[:1, ::-1]])), errors.DuplicateFaceError, 2),
    "handle": (lambda V, F: meshes.torus(), errors.NotASphereError, 0),
    "empty": (lambda V, F: (V, F[:0]), errors.EmptyMeshError, 0),
}


@pytest.mark.parametrize("name", BAD)
def test_refusals(name):
    spoil, kind, count = BAD[name]
    with pytest.raises(kind) as caught:
        drain(conformal_sphere(*spoil(*meshes.icosphere(1))))
    assert len(caught.value.elements) == count and caught.value.remedy


def test_faces_without_area_get_a_little():
    V, F = meshes.icosphere(1)
    V = V.copy()
    a, b = F[7, :2]
    V[a] = V[b]
    p = drain(conformal_sphere(V, F)).positions
    assert (spherical_areas(p, F) > 0).all()


# ---- transport ------------------------------------------------------------------------------------------------


def random_sites(seed=0):
    """162 unit vectors, well apart."""
    V, _ = meshes.icosphere(2)
    return normalized(V + 0.05 * np.random.default_rng(seed).normal(size=V.shape))


def test_cells_tile_the_sphere_whatever_the_weights():
    sites = random_sites()
    h = 2e-3 * np.random.default_rng(1).normal(size=162)
    cells = spherical_cells(sites, h, by_hull(sites, h))
    np.testing.assert_allclose(cells.area.sum(), 4 * np.pi, rtol=1e-13)
    np.testing.assert_allclose(cells.moment.sum(axis=0), 0, atol=1e-12)
    # Sampling: a point belongs to the site whose plane is farthest out.
    points = normalized(np.random.default_rng(2).normal(size=(100_000, 3)))
    share = np.bincount((points @ (sites * np.exp(h)[:, None]).T).argmax(axis=1), minlength=162) / 100_000
    np.testing.assert_allclose(share, cells.area / (4 * np.pi), atol=2e-3)


def test_derivative_of_the_areas():
    sites, rng = random_sites(), np.random.default_rng(3)
    h, d = 2e-3 * rng.normal(size=162), rng.normal(size=162)
    cells = spherical_cells(sites, h, by_hull(sites, h))
    i, j = cells.edges.T
    slope = np.zeros(162)
    np.add.at(slope, i, cells.conductance * (d[i] - d[j]))
    np.add.at(slope, j, cells.conductance * (d[j] - d[i]))
    step = 1e-6
    before, after = (spherical_cells(sites, h + s * d, by_hull(sites, h + s * d)).area for s in (-step, step))
    np.testing.assert_allclose((after - before) / (2 * step), slope, atol=1e-5)


def test_flips_reach_the_hull():
    sites, rng = random_sites(), np.random.default_rng(4)
    hull = by_hull(sites, np.zeros(162))
    h = 2e-3 * rng.normal(size=162)
    flipped, hidden = by_flips(hull, sites, h)
    assert flipped is not None and not hidden
    a, b = (spherical_cells(sites, h, x).area for x in (flipped, by_hull(sites, h)))
    np.testing.assert_allclose(a, b, atol=1e-13)


def plane_areas(sites, h, pole):
    """Areas of the cells by Green's theorem in the stereographic plane, that of the unbounded cell as what is left.

    A side is an arc of a circle there, and the density 4 / (1 + |z|^2)^2 the divergence of 2 z / (1 + |z|^2).
    """
    q = sites * np.exp(h)[:, None]
    hull = by_hull(sites, h)
    p = q[hull.triangles]
    normal = normalized(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
    tail, head = halfedges(hull.triangles)
    start, end = normal[hull.twin // 3], np.repeat(normal, 3, axis=0)
    node, weight = np.polynomial.legendre.leggauss(24)
    t = (node + 1) / 2
    arc = np.arccos(np.clip((start * end).sum(1), -1, 1))[:, None]
    safe = np.maximum(np.sin(arc), 1e-300)
    x = (np.sin((1 - t) * arc) / safe)[..., None] * start[:, None] + (np.sin(t * arc) / safe)[..., None] * end[:, None]
    v = arc[..., None] * (
        -(np.cos((1 - t) * arc) / safe)[..., None] * start[:, None] + (np.cos(t * arc) / safe)[..., None] * end[:, None]
    )
    # From the pole (0, 0, 1): z = (x - i y) / (1 - z), and its derivative along the side.
    z = (x[..., 0] - 1j * x[..., 1]) / (1 - x[..., 2])
    dz = ((v[..., 0] - 1j * v[..., 1]) + z * v[..., 2]) / (1 - x[..., 2])
    flux = 2 * (z.conj() * dz).imag / (1 + np.abs(z) ** 2)
    area = np.bincount(tail, (flux @ weight) / 2, len(sites))
    assert area[pole] < 0
    area[pole] = 4 * np.pi - np.delete(area, pole).sum()
    return area


def test_the_plane_agrees():
    """Stereographic projection, spherical measure on the plane, one unbounded cell (Su 2015): the same areas."""
    V, F = blob(2)
    found = drain(conformal_sphere(V, F))
    carried = drain(sphere_transport(found.sites, vertex_areas(V, F)))
    cells = carried.cells
    # Turned so that one site is the pole, far inside its cell.
    k = 7
    turn = np.linalg.svd(found.sites[k][None])[2][[1, 2, 0]]
    turn[2] = found.sites[k]
    turn[0] *= np.sign(np.linalg.det(turn))
    np.testing.assert_allclose(plane_areas(found.sites @ turn.T, carried.site_weights, k), cells.area, atol=1e-7)


@pytest.mark.parametrize("name", SHAPES)
def test_transport(name):
    V, F = SHAPES[name]
    found = drain(conformal_sphere(V, F))
    mass = vertex_areas(V, F)
    hull = Hull(found.triangles, twins(found.triangles))
    carried = drain(sphere_transport(found.sites, mass, hull=hull))
    assert carried.residual <= 1e-6 and carried.iterations <= 25
    np.testing.assert_allclose(carried.cells.area, 4 * np.pi * mass / mass.sum(), rtol=1e-6)
    np.testing.assert_allclose(carried.cells.area.sum(), 4 * np.pi, rtol=1e-12)


def test_transport_refuses_masses_that_are_not_positive():
    with pytest.raises(errors.TransportError) as caught:
        drain(sphere_transport(random_sites(), np.r_[0.0, np.ones(161)]))
    assert caught.value.elements.tolist() == [0]


def test_transport_refuses_sites_that_coincide():
    sites = random_sites()
    sites[1] = sites[0]
    with pytest.raises(errors.TransportError):
        drain(sphere_transport(sites, np.ones(162)))


# ---- the whole map --------------------------------------------------------------------------------------------


def figures(V, F, p, density=None):
    """Folds, share of the area in the wrong place, and deviation of the ratios, on the sphere."""
    target = face_areas(V, F) * (1 if density is None else density)
    target /= target.sum()
    area = spherical_areas(p, F) / (4 * np.pi)
    ratio = area / target
    return int((area <= 0).sum()), np.abs(area - target).sum(), np.sqrt(target @ (ratio - 1) ** 2)


def check(V, F, found, density=None, most=0.01):
    p = found.positions
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(spherical_areas(p, F).sum(), 4 * np.pi, rtol=1e-12)
    folds, l1, sd = figures(V, F, p, density)
    assert folds == 0 and l1 <= most and sd <= most
    assert (signed_volumes(found.conformal, F) > 0).all()
    assert found.status == "converged"


@pytest.mark.parametrize("name", SHAPES)
def test_map(name):
    V, F = SHAPES[name]
    found = drain(sphere_map(V, F))
    if name == "tetrahedron":
        # Faces larger than a hemisphere look smaller the larger they get: their error is left, and said.
        assert figures(V, F, found.positions)[0] == 0 and len(found.warnings) == 1
    else:
        check(V, F, found)


def star(length=12):
    """A cube with six arms, each a row of cubes: conformally, their ends vanish."""
    cells = {(0, 0, 0)}
    for axis in range(3):
        cells |= {tuple(sign * k * (np.arange(3) == axis)) for k in range(1, length) for sign in (-1, 1)}
    quads = []
    for cell in sorted(cells):
        for axis in range(3):
            u, v = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]]
            for sign in (0, 1):
                step = np.eye(3, dtype=int)[axis]
                if tuple(np.array(cell) + (2 * sign - 1) * step) not in cells:
                    base = np.array(cell) + sign * step
                    quad = [base, base + u, base + u + v, base + v]
                    quads += quad if sign else quad[::-1]
    V, index = np.unique(quads, axis=0, return_inverse=True)
    Q = index.reshape(-1, 4)
    return V.astype(float), np.concatenate([Q[:, [0, 1, 2]], Q[:, [0, 2, 3]]])


def test_long_limbs_are_mapped_from_coarse_to_fine():
    """Where the conformal map leaves double precision there still is a map without folds, and the result says so."""
    V, F = star(30)
    found = drain(sphere_map(V, F))
    assert any("coarse to fine" in w for w in found.warnings)
    assert (signed_volumes(found.positions, F) > 0).all() and (signed_volumes(found.conformal, F) > 0).all()
    np.testing.assert_allclose(spherical_areas(found.positions, F).sum(), 4 * np.pi, rtol=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_coarse_to_fine_never_folds(name):
    V, F = SHAPES[name]
    area = face_areas(V, F)
    for level in (levels := collapse_to_tetrahedron(V, F, area)):
        assert len(level.triangles) == 2 * len(level.vertices) - 4 and (twins(level.triangles) >= 0).all()
        np.testing.assert_allclose(level.mass.sum(), area.sum())
        assert len(level.mass) == len(level.triangles) and level.mass.min() > 0
    assert len(levels[-1].vertices) == 4
    p, _ = drain(multilevel_start(V, F, area))
    assert (signed_volumes(p, F) > 0).all()


def test_both_starts_lead_to_the_same_shear():
    V, F = blob(2)
    area = face_areas(V, F)
    found = drain(sphere_map(V, F, quality="exact"))
    start, _ = drain(multilevel_start(V, F, area))
    other = drain(sphere_refine(V, F, start, area, quality="exact"))
    u, _, v = np.linalg.svd(found.positions.T @ other.positions)
    assert np.abs(found.positions @ u @ v - other.positions).max() < 0.05


def test_folds_are_straightened():
    V, F = blob()
    p = normalized(V)
    rng = np.random.default_rng(0)
    tangled = normalized(p + 0.05 * rng.normal(size=p.shape) * (rng.random((len(p), 1)) < 0.1))
    assert not (signed_volumes(tangled, F) > 0).all()
    found = drain(sphere_refine(V, F, tangled, face_areas(V, F)))
    assert found.untangling > 0 and (signed_volumes(found.positions, F) > 0).all()


def test_the_slope_is_the_derivative():
    V, F = blob(1)
    target = face_areas(V, F)
    target *= 4 * np.pi / target.sum()
    faces = elements(V, F, target)
    problem = SphereProblem(faces, target, faces.ratio, Assembly(F, len(V)), 3.0)
    p = normalized(V)
    axes, face = tangents(p), project_faces(p, F)
    local = derivatives_of(faces, *derivatives(faces, face.corner), 3.0, 1.0)
    direction, slope = newton_direction(faces, problem.assembly, p, axes, face, local)
    before, after = (problem.energy(retract(p, axes, s * direction)) for s in (-1e-6, 1e-6))
    np.testing.assert_allclose((after - before) / 2e-6, slope, rtol=1e-5)


def test_density():
    V, F = blob(3, 5)
    density = np.where(V[F].mean(1)[:, 2] > 0.3, 4.0, 1.0)
    check(V, F, drain(sphere_map(V, F, density=density)), density)
    for wrong in (0.0, -1.0, np.nan):
        density[7] = wrong
        with pytest.raises(errors.DensityError) as caught:
            drain(sphere_map(V, F, density=density))
        assert caught.value.elements.tolist() == [7]


def test_balance_trades_area_for_shear():
    V, F = blob(3, 6)
    shear, error = [], []
    for balance in (0.0, 0.3, 0.6, 1.0):
        found = drain(sphere_map(V, F, balance=balance))
        a, b = derivatives(elements(V, F, face_areas(V, F)), project_faces(found.positions, F).corner)
        shear.append((np.abs(b) / np.abs(a)).mean())
        error.append(figures(V, F, found.positions)[1])
    assert (np.diff(shear) < 0).all() and (np.diff(error) > 0).all()
    with pytest.raises(ValueError, match="balance"):
        drain(sphere_map(V, F, balance=1.5))


def test_exact_is_more_exact():
    V, F = blob(3, 7)
    assert figures(V, F, drain(sphere_map(V, F, quality="exact")).positions)[1] <= 0.001


@pytest.mark.parametrize("scale, offset", [(1e-3, 0.0), (1e4, 0.0), (1.0, 1e5)])
def test_pose_does_not_count(scale, offset):
    V, F = blob(2)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    p, q = (drain(sphere_map(x, F)).positions for x in (V, scale * V @ turn.T + offset))
    u, _, v = np.linalg.svd(q.T @ p)
    np.testing.assert_allclose(q @ u @ v, p, atol=1e-3)


def test_the_same_twice():
    V, F = blob(2)
    np.testing.assert_array_equal(*(drain(sphere_map(V, F)).positions for _ in range(2)))


MODELS = ["spot", "bunny_small", "max_planck"]


@pytest.mark.parametrize("name", MODELS)
def test_models(name):
    if not meshes.model_path(name):
        pytest.skip(f"no {name} in {meshes.models_folder()}: set OMT_UV_MODELS")
    V, F = meshes.load_model(name)
    check(V, F, drain(sphere_map(V, F)))
    found = drain(conformal_sphere(V, F))
    mass = vertex_areas(V, F)
    carried = drain(sphere_transport(found.sites, mass, hull=Hull(found.triangles, twins(found.triangles))))
    assert carried.residual <= 1e-6 and carried.iterations <= 25
