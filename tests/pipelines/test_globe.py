"""Closed components to the plane: one globe each, all areas shared out, and errors by the indices of the surface."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from readings import reading, together

from omt_uv.pipelines import globe as globes
from omt_uv.pipelines.globe import GlobeJob, Markers, closed_components, globe_jobs, project
from omt_uv.pipelines.layout import Refusal
from omt_uv.settings import GlobeSettings
from omt_uv.solver.errors import DuplicateFaceError, MeshError, OrientationError
from omt_uv.solver.globe.rotation import MarkerError
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain

LAMBERT = GlobeSettings(projection="lambert", quality="draft")


def ellipsoid(subdivisions=1):
    V, F = meshes.icosphere(subdivisions)
    return V * [1.0, 0.8, 1.3], F


def two():
    V, F = meshes.icosphere(1)
    return together((V, F), (ellipsoid()[0] + 5, F))


def test_components_share_out_the_polygons_whatever_the_seams():
    V, F = two()
    for seams in ([], F[:20, :2]):
        found = closed_components(triangle_surface(V, F, seams))
        assert np.array_equal(np.sort(np.concatenate([c.faces for c in found])), np.arange(len(F)))
        assert len(found) == 2
        for c in found:
            assert np.array_equal(c.vertex_ids[c.triangles], F[c.faces]) and np.array_equal(c.members, c.faces)
            assert np.array_equal(V[c.vertex_ids], c.vertices)
            assert np.array_equal(F.ravel()[c.corners], F[c.faces])


def test_only_chosen_polygons_are_a_component():
    V, F = two()
    found = closed_components(triangle_surface(V, F), np.arange(len(F)) >= 80)
    assert len(found) == 1 and found[0].faces.min() == 80 and found[0].vertex_ids.min() == 42


def test_fans_that_touch_in_a_vertex_alone_are_apart():
    V, F = two()
    joined = np.where(F == 42, 0, F)
    found = closed_components(triangle_surface(V, joined))
    assert sorted(len(c.faces) for c in found) == [80, 80] and all(0 in c.vertex_ids for c in found)
    # Holes that touch become one, around both copies of their vertex.
    W, G = meshes.icosphere(2)
    around = np.flatnonzero((G == 0).any(axis=1))
    apart = next(k for k in around[1:] if len(np.intersect1d(G[k], G[around[0]])) == 1)
    left = np.delete(G, [around[0], apart], axis=0)
    (job,) = globe_jobs([reading(W, left)], [None], [None])
    (globe,) = drain(project([job], replace(LAMBERT, fill_holes=True))).globes[0]
    assert len(globe.component.centres) == 1 and len(globe.component.vertices) == len(W) + 1
    assert (globe.areas > 0).all() and len(globe.areas) == len(left)


@pytest.mark.parametrize(
    ("spoil", "error", "shape"),
    [
        (lambda F: np.concatenate([F[2:3, ::-1], F[3:]]), OrientationError, (2, 2)),
        (lambda F: np.concatenate([F[1:], F[5:6, [1, 0, 2]]]), DuplicateFaceError, (2,)),
    ],
    ids=["turned", "double"],
)
def test_holes_without_an_outline_are_refused_by_their_cause(spoil, error, shape):
    V, F = meshes.icosphere(1)
    jobs = globe_jobs([reading(V, spoil(F))], [None], [None])
    with pytest.raises(Refusal) as found:
        drain(project(jobs, replace(LAMBERT, fill_holes=True)))
    assert isinstance(found.value.error, error) and found.value.error.elements.shape == shape


def test_different_surfaces_each_get_a_whole_texture_and_their_own_shares():
    rng = np.random.default_rng(0)
    V, F = two()
    W, G = ellipsoid()
    density = 1 + 0.5 * rng.random(len(G))
    jobs = globe_jobs([reading(V, F), reading(W, G)], [None, density], [None, None])
    found = drain(project(jobs, LAMBERT))
    assert [len(mine) for mine in found.globes] == [2, 1]
    assert [text for index, text in found.warnings if index == -1]
    for corners, uv, size in zip(found.corners, found.uv, (F.size, G.size), strict=True):
        assert np.array_equal(np.sort(corners), np.arange(size)) and np.isfinite(uv).all()
    for globe in (g for mine in found.globes for g in mine):
        assert globe.shares.sum() == pytest.approx(1, abs=1e-12)
        # Coarse faces around the poles leave some of the texture free.
        assert (globe.areas >= 0).all() and 0.8 < globe.areas.sum() < 1 + 1e-9
        assert globe.report()["area_l1"] < 0.1
    (one,) = found.globes[1]
    area = np.linalg.norm(np.cross(W[G[:, 1]] - W[G[:, 0]], W[G[:, 2]] - W[G[:, 0]]), axis=1)
    assert one.shares == pytest.approx(area * density / (area @ density), rel=1e-12)


def test_the_unit_of_length_does_not_matter():
    V, F = ellipsoid()
    one, other = (drain(project([GlobeJob(triangle_surface(s * V, F))], LAMBERT)) for s in (1.0, 4.0))
    assert other.uv[0] == pytest.approx(one.uv[0], abs=1e-6)


def test_a_marked_pole_is_the_north():
    V, F = ellipsoid()
    pole = np.zeros(len(V))
    pole[7] = 1
    found = drain(project([GlobeJob(triangle_surface(V, F), markers=Markers(pole))], LAMBERT))
    assert found.uv[0][F.ravel()[found.corners[0]] == 7, 1] == pytest.approx(1, abs=1e-6)
    with pytest.raises(MarkerError, match="The marker of the pole is on no part of the"):
        drain(project([GlobeJob(triangle_surface(V, F), markers=Markers(0 * pole))], LAMBERT))


def test_an_open_surface_is_refused_by_its_index_and_its_own_elements():
    closed, (V, F) = ellipsoid(), two()
    keep = np.arange(len(F)) != 100
    with pytest.raises(Refusal) as caught:
        drain(project([GlobeJob(triangle_surface(*closed)), GlobeJob(triangle_surface(V, F), keep)], LAMBERT))
    error = caught.value.error
    assert caught.value.index == 1 and isinstance(error, MeshError)
    assert error.kind and (error.elements >= (80 if error.kind == "face" else 42)).all()


def test_holes_are_filled_for_the_map_alone():
    V, F = ellipsoid(3)
    F = np.delete(F, np.r_[0, 40:44, 300], axis=0)
    with pytest.raises(Refusal, match="not closed"):
        drain(project([GlobeJob(triangle_surface(V, F))], LAMBERT))
    (globe,) = drain(project([GlobeJob(triangle_surface(V, F))], replace(LAMBERT, fill_holes=True))).globes[0]
    report = globe.report()
    assert report["holes"] >= 3 and report["folds_sphere"] == 0 and report["area_l1_sphere"] < 0.05
    assert len(globe.uv) == F.size and len(globe.points) == len(np.unique(F))
    assert globe.areas.sum() < 1 and report["area_l1"] < 0.08


def test_the_flow_reports_its_costs_and_moser_alone():
    V, F = ellipsoid(2)
    flow = replace(LAMBERT, method="flow")
    (globe,) = drain(project([GlobeJob(triangle_surface(V, F))], flow)).globes[0]
    report = globe.report()
    assert report["costs"] == sorted(report["costs"], reverse=True)
    assert report["moser"]["folds"] == 0 and report["drift"] < 0.05


def test_a_polygon_that_is_folded_near_a_pole_is_counted_once(monkeypatch):
    """However many triangles it has: what is told counts faces of the mesh."""
    V, F = meshes.icosphere(1)
    surface = triangle_surface(V, F)
    faces = np.concatenate([[0, 0, 0], np.arange(1, len(F) - 2)])
    told = []
    monkeypatch.setattr(globes, "closed_components", one_component(faces))
    monkeypatch.setattr(globes, "signed_areas", lambda uv, triangles: np.r_[-1, -1, 1, -1, np.ones(len(F) - 4)])
    monkeypatch.setattr(globes, "_pole_warnings", lambda missed, folded: told.append(folded) or [])
    drain(project([GlobeJob(surface)], LAMBERT))
    assert told == [2]


@pytest.mark.parametrize("flat", [(), (3,), (0, 1), (0, 1, 3)], ids=str)
def test_a_triangle_without_an_area_on_the_sphere_is_not_folded(flat, monkeypatch):
    V, F = meshes.icosphere(1)
    told, real = [], globes.spherical_areas

    def areas(points, triangles):
        found = real(points, triangles)
        found[list(flat)] = 0
        return found

    monkeypatch.setattr(globes, "spherical_areas", areas)
    monkeypatch.setattr(globes, "signed_areas", lambda uv, triangles: np.r_[-1, 0, 1, -1, np.ones(len(F) - 4)])
    monkeypatch.setattr(globes, "_pole_warnings", lambda missed, folded: told.append(folded) or [])
    drain(project([GlobeJob(triangle_surface(V, F))], LAMBERT))
    assert told == [len({0, 1, 3} - set(flat))]


def one_component(faces):
    """What gives the one component of a surface, its triangles of these polygons (m,)."""

    def given(surface, chosen):
        (found,) = closed_components(surface, chosen)
        return [replace(found, faces=faces)]

    return given
