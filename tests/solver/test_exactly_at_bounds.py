"""What is exactly at a bound belongs to one side of it, and the next number to the other."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.spatial import cKDTree

from omt_uv.solver import freed_memory
from omt_uv.solver.arranging import congruence
from omt_uv.solver.conformal import rectangle_to_disk
from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.flows import flow_map
from omt_uv.solver.globe import rotation
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.options import MOST_ASPECT, MapOptions
from omt_uv.solver.refinement import initial_maps, refine
from omt_uv.solver.refinement.continuation_rules import LOOSE, Quality, first_pressure


def test_markers_have_a_middle_beyond_a_millionth_and_none_at_it():
    least = rotation.LEAST_DISTANCE
    with pytest.raises(rotation.MarkerError, match="have no middle"):
        rotation._direction(np.array([least, 0.0, 0.0]))
    np.testing.assert_allclose(rotation._direction(np.array([0.0, np.nextafter(least, 1), 0.0])), [0, 1, 0])


def test_a_meridian_may_be_a_millionth_from_the_pole_and_no_nearer():
    least = rotation.LEAST_DISTANCE
    assert rotation._equator_angle(np.array([0.0, -least, 1.0]), "meridian") == least
    with pytest.raises(rotation.MarkerError, match="lies at a pole"):
        rotation._equator_angle(np.array([0.0, -np.nextafter(least, 0), 1.0]), "meridian")


def test_the_aspect_of_a_rectangle_stays_below_its_bound():
    assert MapOptions(aspect=float(np.nextafter(MOST_ASPECT, 0))).aspect < MOST_ASPECT
    for aspect in (MOST_ASPECT, np.nextafter(0.0, -1)):
        with pytest.raises(ValueError, match="the aspect of a rectangle must lie in"):
            MapOptions(aspect=float(aspect))
    assert MapOptions(aspect=0.0).aspect == 0


@pytest.mark.parametrize("balance", [np.nextafter(0.0, -1), np.nextafter(1.0, 2)])
def test_a_balance_is_a_share(balance):
    assert MapOptions(balance=0.0).balance == 0 and MapOptions(balance=1.0).balance == 1
    with pytest.raises(ValueError, match="balance must lie in"):
        MapOptions(balance=float(balance))


def test_a_disk_is_crowded_above_its_bound(monkeypatch):
    V, F = meshes.comb()
    loop, area = boundary_loops(F)[0], face_areas(V, F)
    arcs, shares = initial_maps.arcs_of_parts(F, loop, area)
    found = float(np.maximum(arcs - shares, 0).sum())
    for bound, crowded in ((found, False), (np.nextafter(found, 0), True)):
        monkeypatch.setattr(initial_maps, "CROWDED", bound)
        assert initial_maps.is_crowded(F, loop, area) == crowded


@pytest.mark.parametrize(("more", "swept"), [(0, False), (1, True)])
def test_steps_are_followed_by_sweeps_in_large_meshes_with_a_region_alone(monkeypatch, more, swept):
    V, F = meshes.grid(4, 4)
    monkeypatch.setattr(refine, "SWEPT_ABOVE", len(V) - more)
    monkeypatch.setattr(refine, "SWEPT_ABOVE_WARM", len(V) + 1 - more)
    mesh, given = (
        SimpleNamespace(vertices=V, triangles=F, pins=None),
        {"polygon": None, "region": np.ones(len(F), bool)},
    )
    faces = SimpleNamespace(**given)
    disk = refine.RefinementOptions(boundary="disk")
    assert refine._is_loose(mesh, faces, 0.0) == swept
    assert (refine._smoother(mesh, faces, disk) is not None) == swept
    assert refine._smoother(mesh, faces, replace(disk, warm_start=True)) is None
    assert refine._smoother(mesh, faces, replace(disk, boundary="free")) is None
    assert refine._smoother(mesh, faces, replace(disk, balance=0.5)) is None
    assert refine._smoother(mesh, SimpleNamespace(**given | {"region": None}), disk) is None
    monkeypatch.setattr(refine, "SWEPT_ABOVE_WARM", len(V) - more)
    assert (refine._smoother(mesh, faces, replace(disk, warm_start=True)) is not None) == swept
    assert refine._smoother(mesh, SimpleNamespace(**given | {"polygon": np.arange(len(F))}), disk) is None
    assert refine._smoother(SimpleNamespace(**vars(mesh) | {"pins": 1}), faces, disk) is None


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("balance", [0.0, 0.5])
@pytest.mark.parametrize("tolerance", [np.nextafter(LOOSE, 0), LOOSE])
def test_the_first_pressure_is_small_for_free_exact_drafts_alone(free, balance, tolerance):
    quality = Quality(tolerance=float(tolerance), **{f: 1 for f in Quality.__dataclass_fields__ if f != "tolerance"})
    found = first_pressure(quality, balance, free)
    assert (found < first_pressure(quality, 0.5, False)) == (free and balance == 0 and tolerance == LOOSE)


def test_images_of_vertices_are_as_near_as_is_asked_and_one_of_each():
    V, F = meshes.grid(3, 3)
    tree, image = cKDTree(V), V + [0.0, 0.0, 0.25]
    assert congruence._checked(image, tree, F, F, 0.25).tolist() == list(range(len(V)))
    assert congruence._checked(image, tree, F, F, np.nextafter(0.25, 0)) is None
    twice = image.copy()
    twice[0] = image[1]
    assert congruence._checked(twice, tree, F, F, 0.5) is None


@pytest.mark.parametrize(("more", "same"), [(0, False), (1, True)])
def test_more_than_half_of_the_sides_of_triangles_stay(monkeypatch, more, same):
    """Of 33 sides of two strips, so many that the share is exactly the bound, or just beyond it."""
    V, F = meshes.grid(3, 3)
    other = np.concatenate([F[:9], np.roll(F[9:], 1, axis=0)[:, ::-1]])
    one, two = (np.unique(np.sort(np.stack([f.ravel(), np.roll(f, -1, axis=1).ravel()]), axis=0), axis=1).T.tolist()
                for f in (F, other))  # fmt: skip
    share = np.mean([side in two for side in one])
    monkeypatch.setattr(congruence, "SAME_SIDES", share if not more else np.nextafter(share, 0))
    assert (congruence._checked(V, cKDTree(V), F, other, 0.1) is not None) == same


@pytest.mark.parametrize(("function", "bound"), [("give_back_of", "MANY"), ("give_back_often", "VERY_MANY")])
def test_what_is_free_is_given_back_for_larger_meshes_than_the_bound(monkeypatch, function, bound):
    given = []
    monkeypatch.setattr(freed_memory, "give_back", lambda: given.append(1))
    getattr(freed_memory, function)(getattr(freed_memory, bound))
    assert not given
    getattr(freed_memory, function)(getattr(freed_memory, bound) + 1)
    assert given == [1]


@pytest.mark.parametrize(("kind", "bound"), [("missed", "MISSED"), ("volume", "CHANGED")])
def test_a_flow_warns_of_more_than_its_bounds(kind, bound):
    least = getattr(flow_map, bound)
    for value, count in ((least, 0), (float(np.nextafter(least, 1)), 1)):
        missed, volumes = (value, np.zeros(2)) if kind == "missed" else (0.0, np.array([0.0, -value]))
        told = flow_map._warnings(missed, volumes, 0)
        assert len(told) == count
    assert all(("set to their ends" in text) == (kind == "missed") for text in told)
    assert flow_map._warnings(0.0, np.zeros(0), 0) == () and len(flow_map._warnings(1.0, np.ones(1), 2)) == 3


def test_conformal_rectangles_are_as_slim_as_double_precision_holds():
    corners = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    most = rectangle_to_disk.MAX_ASPECT
    assert np.isfinite(rectangle_to_disk.rectangle_to_disk(corners, most)).all()
    assert np.isfinite(rectangle_to_disk.rectangle_to_disk(corners * [1.0, 1 / most], 1 / most)).all()
    with pytest.raises(PrecisionError, match="its modulus is"):
        rectangle_to_disk.rectangle_to_disk(corners, float(np.nextafter(most, np.inf)))
