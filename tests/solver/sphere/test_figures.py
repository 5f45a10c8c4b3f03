"""Figures of maps to the sphere: those of tables of papers, and of what is known."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import spherical_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.figures import sphere_figures
from omt_uv.solver.sphere.sphere_map import sphere_map


def ellipsoid():
    V, F = meshes.icosphere(3)
    return V * [1.0, 0.8, 1.6], F


def test_a_sphere_is_its_own_map_and_holes_change_nothing():
    V, F = meshes.icosphere(3)
    for kept in (F, F[40:]):
        found = sphere_figures(3 * V, kept, V)
        assert found.folds == 0 and found.area_l1 < 0.01 and found.angle_mean < 1.01
        assert 2 <= found.symmetric_area < 2.001 and 2 <= found.symmetric_angle < 2.001
    assert sphere_figures(V, F[:, ::-1], V).folds == 0
    assert sphere_figures(V, np.concatenate([F[1:], F[:1, ::-1]]), V).folds == 1


def test_means_are_those_of_the_triangles_one_by_one():
    V, F = ellipsoid()
    positions = V / np.linalg.norm(V, axis=1)[:, None]
    ratio = spherical_areas(positions, F) / (4 * np.pi) / (face_areas(V, F) / face_areas(V, F).sum())
    found = sphere_figures(V, F, positions)
    assert found.symmetric_area == pytest.approx(np.mean(ratio + 1 / ratio)) and found.area_l1 > 0.1


def test_the_mean_shear_is_that_of_what_does_not_fold():
    V, F = ellipsoid()
    positions = V / np.linalg.norm(V, axis=1)[:, None]
    folded = F.copy()
    folded[::9] = folded[::9, ::-1]
    found, rest = (sphere_figures(V, faces, positions) for faces in (folded, np.delete(F, np.s_[::9], axis=0)))
    assert found.folds == len(F[::9]) and found.angle_mean == pytest.approx(rest.angle_mean, rel=1e-12)


def test_moser_alone_has_areas_nearly_and_the_flow_takes_cost_off_it():
    V, F = ellipsoid()
    moser, flow = (drain(sphere_map(V, F, method=method)) for method in ("moser", "flow"))
    assert np.array_equal(moser.positions, moser.flow.moser) and moser.status == "moser"
    assert sphere_figures(V, F, moser.positions).area_l1 < 0.02
    assert (np.diff(flow.flow.costs) < 0).all()
    assert sphere_figures(V, F, flow.positions).area_l1 < 0.01


@pytest.mark.parametrize(("where", "folds"), [("apart", 0), ("onto a neighbour", 2), ("beyond a neighbour", 2)])
def test_what_has_no_area_on_the_sphere_is_as_bad_as_what_is_folded(where, folds):
    V, F = meshes.icosphere(2)
    images = V.copy()
    a, b = F[0, 0], F[0, 1]
    if where == "onto a neighbour":
        # The two faces at their edge have no area left.
        images[a] = images[b]
    elif where == "beyond a neighbour":
        beyond = 1.3 * V[b] - 0.3 * V[a]
        images[a] = beyond / np.linalg.norm(beyond)
    found = sphere_figures(V, F, images).folds
    assert found == folds if where != "beyond a neighbour" else found >= folds
