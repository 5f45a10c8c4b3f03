"""Closed surfaces on the sphere: no fold, every area exact, and independent of the pose."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from scipy.spatial import cKDTree
from sphere_shapes import SHAPES, blob, creature, star

from omt_uv.solver import errors
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas
from omt_uv.solver.mesh.polygon_areas import polygon_areas
from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere import sphere_map as sphere_maps
from omt_uv.solver.sphere.conformal import conformal_sphere
from omt_uv.solver.sphere.newton import derivatives, project_faces
from omt_uv.solver.sphere.sphere_map import sphere_map
from omt_uv.solver.transport.semidiscrete_sphere import sphere_transport
from omt_uv.solver.transport.spherical_power_diagram import Hull


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


def test_long_limbs_are_mapped_from_coarse_to_fine():
    """Where the conformal map leaves double precision there still is a map without folds, and the result says so."""
    V, F = star(30)
    found = drain(sphere_map(V, F))
    assert any("coarse to fine" in w for w in found.warnings)
    assert (signed_volumes(found.positions, F) > 0).all() and (signed_volumes(found.conformal, F) > 0).all()
    np.testing.assert_allclose(spherical_areas(found.positions, F).sum(), 4 * np.pi, rtol=1e-12)


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


def quads_of(V, F):
    """The polygon of every triangle of a body of squares, and its triangles with other diagonals."""
    first, second = np.split(F, 2)
    quads = np.column_stack([first, second[:, 2]])
    turned = np.where((np.random.default_rng(0).random(len(quads)) < 0.5)[:, None], np.roll(quads, 1, axis=1), quads)
    return np.tile(np.arange(len(quads)), 2), np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def test_polygons_have_their_areas_whichever_way_they_are_cut():
    V, F = creature(4, 3, 2, 3)
    V = V + 0.1 * np.sin(V @ np.random.default_rng(1).normal(size=(3, 3)))
    owner, other = quads_of(V, F)
    one, two = (drain(sphere_map(V, x, polygons=owner, quality="exact")).positions for x in (F, other))
    for p in (one, two):
        for triangles in (F, other):
            assert (signed_volumes(p, triangles) > 0).all()
        area, target = (np.bincount(owner, x) for x in (spherical_areas(p, F), polygon_areas(V, F, owner)))
        assert np.abs(area / area.sum() - target / target.sum()).sum() < 1e-3
    u, _, v = np.linalg.svd(two.T @ one)
    assert np.abs(two @ u @ v - one).max() < 0.02


def symmetric_bodies():
    """A box of squares with any diagonals, and a sphere of triangles, both with a bump at z = 0."""
    V, squares = creature(8, 0, 1, 0)
    owner, other = quads_of(V, squares)
    for points, triangles, polygons in ((V, other, owner), (*meshes.icosphere(2), None)):
        p = (points - points.mean(axis=0)) / np.ptp(points, axis=0) * [1, 1.2, 1]
        yield p * (1 + 0.5 * np.exp(-10 * ((p - [0.4, 0.3, 0]) ** 2).sum(axis=1))[:, None]), triangles, polygons


def test_a_symmetric_body_has_a_symmetric_map():
    for V, F, polygons in symmetric_bodies():
        p = drain(sphere_map(V, F, polygons=polygons)).positions
        image = cKDTree(V).query(V * [1, 1, -1])[1]
        u, _, v = np.linalg.svd(p.T @ p[image])
        assert np.linalg.det(u @ v) < 0
        assert np.abs(p[image] @ (u @ v).T - p).max() < 1e-9


MODELS = ["spot", "bunny_small", "max_planck"]


@pytest.mark.parametrize("name", MODELS)
def test_models(name):
    if not meshes.model_path(name):
        pytest.skip(f"no {name} in {meshes.models_folder()}: set OMT_UV_MODELS")
    V, F = meshes.load_model(name)
    # The quads of spot's two sides are cut along other diagonals: they have their areas, their halves nearly so.
    check(V, F, drain(sphere_map(V, F)), most=0.04 if name == "spot" else 0.01)
    found = drain(conformal_sphere(V, F))
    mass = vertex_areas(V, F)
    carried = drain(sphere_transport(found.sites, mass, hull=Hull(found.triangles, twins(found.triangles))))
    assert carried.residual <= 1e-6 and carried.iterations <= 25


def test_the_warning_about_areas_has_the_figures_of_the_map():
    V, F = blob(2)
    p, target = V / np.linalg.norm(V, axis=1)[:, None], face_areas(V, F)
    pairs = np.arange(len(F)) // 2
    for polygons in (None, pairs):
        owner = np.arange(len(F)) if polygons is None else polygons
        share = np.array([target[owner == k].sum() for k in range(owner.max() + 1)]) / target.sum()
        has = np.array([spherical_areas(p, F)[owner == k].sum() for k in range(owner.max() + 1)]) / (4 * np.pi)
        mean, deviation = 100 * np.abs(has - share).sum(), 100 * np.sqrt((share * (has / share - 1) ** 2).sum())
        text = sphere_maps._area_warning(p, F, 7 * target, polygons)
        assert f"off by {mean:.1f} % on average, standard deviation {deviation:.1f} %" in text and mean > 1
