"""Formulas at their ends: nothing left over, one of a kind, all at one place, what no map has."""

from __future__ import annotations

from itertools import pairwise

import meshes
import numpy as np
import pytest
from sphere_shapes import blob, random_rotation

from omt_uv.solver import errors
from omt_uv.solver.analysis.joint_density import joint_density, shares_of
from omt_uv.solver.analysis.vertex_scores import soft_weights
from omt_uv.solver.arranging.halves import symmetric_map
from omt_uv.solver.canonical.markers import ChartMarkers
from omt_uv.solver.canonical.rectangles import rectangle_corners
from omt_uv.solver.conformal.moebius import centre_on_sphere
from omt_uv.solver.editing.uv_islands import uv_islands
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.registration.alignment import rotation_of_pairs
from omt_uv.solver.registration.landmarks import Landmarks, check_handedness, check_landmarks
from omt_uv.solver.remeshing.components.coincident_boundaries import join_coincident, reopened, reopened_copies
from omt_uv.solver.remeshing.edits.vertex_count import apportion
from omt_uv.solver.transport.cell_polygons import planar_cells
from omt_uv.solver.transport.convex_domain import ConvexPolygon, Disk


@pytest.mark.parametrize("seed", range(8))
def test_numbers_are_shared_out_in_proportion_whole_and_with_the_least_of_each(seed):
    rng = np.random.default_rng(seed)
    k = int(rng.integers(1, 9))
    proportion = rng.random(k) ** 3 * (rng.random(k) > 0.2)
    least = rng.integers(0, 6, k)
    for count in (least.sum(), least.sum() + 1, least.sum() + 37, least.sum() + 1000):
        found = apportion(int(count), proportion, least)
        assert found.sum() == count and (found >= least).all() and found.dtype.kind == "i"
        if not proportion.any():
            continue
        # Nothing could be given from one to another that is nearer to its due for it, but for what is least.
        due = count * proportion / proportion.sum()
        if (due >= least).all():
            assert np.abs(found - due).max() < 1
    # With the floats a little over: what is too much is taken from those that have most to spare.
    odd = apportion(10, np.array([1.0, 1.0, 1.0]), np.array([0, 0, 10]))
    assert odd.tolist() == [0, 0, 10]
    even = apportion(7, np.ones(3), np.zeros(3, int))
    assert sorted(even) == [2, 2, 3] and even[0] == 3


@pytest.mark.parametrize("count", [1, 2, 7])
@pytest.mark.parametrize("domain", [Disk(), ConvexPolygon(np.array([[-1.5, -1], [1.5, -1], [1.5, 1], [-1.5, 1]]))])
def test_cells_of_sites_fill_their_domain(count, domain):
    rng = np.random.default_rng(count)
    sites = 0.4 * rng.uniform(-1, 1, (count, 2))
    cells = planar_cells(sites, np.zeros(count), domain)
    areas = []
    for begin, end in pairwise(cells.start.tolist()):
        x, y = cells.points[begin:end].T
        areas.append(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    assert len(areas) == count and min(areas) > 0 and sum(areas) == pytest.approx(domain.area, rel=1e-2)
    if count == 1:
        assert len(cells.points) >= 4


@pytest.mark.parametrize("mirrored", [False, True])
def test_rotations_of_pairs_know_mirrors(mirrored):
    rng = np.random.default_rng(1)
    V, _ = blob(3)
    points = V / np.linalg.norm(V, axis=1, keepdims=True)
    turn = random_rotation(rng) @ np.diag([1, 1, -1.0 if mirrored else 1])
    found = rotation_of_pairs(points, points @ turn.T, mirrored)
    np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
    assert found.error < 1e-12
    assert rotation_of_pairs(points, points @ turn.T, not mirrored).error > 0.1


def test_landmarks_of_a_mirror_image_are_told_from_others_that_do_not_fit():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(7, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    none = np.zeros((0, 3))
    marks = Landmarks(np.zeros(7, int), points, np.zeros(7, int), points, tuple("abcdefg"))
    turn = random_rotation(rng)
    check_handedness(marks, points, points @ turn.T)
    with pytest.raises(errors.HandednessError, match="mirror image"):
        check_handedness(marks, points, points @ turn.T * [-1, 1, 1])
    # What fits neither way is no mirror image, and two points say nothing about it.
    noise = rng.normal(size=(7, 3))
    check_handedness(marks, points, noise / np.linalg.norm(noise, axis=1, keepdims=True))
    few = Landmarks(np.zeros(2, int), points[:2], np.zeros(2, int), points[:2], ("a", "b"))
    check_handedness(few, points[:2], points[:2] * [-1, 1, 1])
    check_landmarks(few, points[:1], none)
    same = points.copy()
    same[4] = same[1]
    for given, side in (((same, points), "source"), ((points, same), "target")):
        with pytest.raises(errors.LandmarkError, match=f"are the same point of the {side}") as caught:
            check_landmarks(marks, *given)
        assert {"b", "e"} <= set(str(caught.value).replace("'", " ").replace(",", " ").split())


@pytest.mark.parametrize("exact", [False, True])
def test_several_regions_have_their_factors_or_cannot(exact):
    regions, area = np.eye(3, 6), np.ones(6)
    found = joint_density(regions, area, [2.0, 0.5, 1.0], exact)
    after = shares_of(regions, area * found.density)
    np.testing.assert_allclose(found.shares_before, 1 / 6)
    np.testing.assert_allclose(found.target_shares, after, rtol=1e-9)
    if exact:
        np.testing.assert_allclose(after, np.array([2, 0.5, 1]) / 6, rtol=1e-9)
    else:
        # Against what has weight 0: each so many times as dense.
        np.testing.assert_allclose(found.density[:3] / found.density[3], [2, 0.5, 1])
    with pytest.raises(errors.EmptyRegionError, match="A region has no area"):
        joint_density(regions, np.where(np.arange(6) == 1, 0, 1.0), [2.0, 0.5, 1.0], exact)
    if exact:
        for factors, words in (([3.0, 3.0, 1.0], "together"), ([5.999999999, 0.5, 1e-9], "together")):
            with pytest.raises(errors.ShareError, match=words) as caught:
                joint_density(regions, area, factors)
            named = caught.value.remedy.split("such as ")[1].split(", ")[:3]
            going = [float(x.split(",")[0]) for x in named]
            joint_density(regions, area, going)
            # On the way from no change to what was asked for.
            assert all(min(1, f) - 1e-9 <= g <= max(1, f) + 1e-9 for g, f in zip(going, factors, strict=True))


@pytest.mark.parametrize("top", [False, True])
def test_weights_part_what_is_mostly_of_one_score(top):
    values = np.full(100, 2.0)
    values[:3] = [3.0, 4.0, 9.0] if top else [1.0, 0.5, -7.0]
    found = soft_weights(values, np.ones(100), 0.2, 0.8)
    assert found.min() == 0 and found.max() == 1
    assert (found[3:] == (0 if top else 1)).all() and found[2] == (1 if top else 0)
    np.testing.assert_allclose(soft_weights(values, np.ones(100), 0.2, 0.8, True), 1 - found)
    # Nowhere is at the low end, and so is what has no area to count.
    far = np.where(np.arange(100) == 5, np.inf, values)
    assert soft_weights(far, np.ones(100), 0.2, 0.8)[5] == 0
    for low, high in ((0.5, 0.5), (0.8, 0.2), (-0.1, 0.5), (0.5, 1.1), (np.nan, 0.5)):
        with pytest.raises(errors.WeightError, match="is no range"):
            soft_weights(values, np.ones(100), low, high)
    for same in (np.full(100, 2.0), np.full(100, np.inf)):
        with pytest.raises(errors.WeightError, match="same everywhere"):
            soft_weights(same, np.ones(100), 0.2, 0.8)


def test_points_on_a_sphere_are_balanced_but_for_half_of_all_in_one():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(50, 3)) + [1.5, 0, 0]
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    mass = rng.random(50)
    found = centre_on_sphere(points, mass)
    assert np.linalg.norm(mass @ found) / mass.sum() < 1e-9 and np.allclose(np.linalg.norm(found, axis=1), 1)
    np.testing.assert_allclose(centre_on_sphere(points, 7 * mass), found, atol=1e-9)
    assert centre_on_sphere(found, mass) is found or np.allclose(centre_on_sphere(found, mass), found, atol=1e-9)
    with pytest.raises(errors.PrecisionError, match="half of the surface"):
        centre_on_sphere(points, np.where(np.arange(50) == 3, 100.0, mass))


def test_a_map_is_its_own_image_about_the_line_that_comes_nearest():
    V, F = meshes.grid(4, 2)
    image = np.array([np.argmin(np.linalg.norm(V - [1 - x, y, z], axis=1)) for x, y, z in V])
    turn = np.exp(1j * 0.7)
    w = turn * (V[:, 0] + 0.5j * V[:, 1] + 0.05 * V[:, 0] * V[:, 1]) + 3
    found = symmetric_map(F, np.column_stack([w.real, w.imag]), image) @ [1, 1j]
    z = found - found.mean()
    a = (z * z[image]).sum()
    np.testing.assert_allclose(z[image], a / abs(a) * np.conj(z), atol=1e-9)
    assert found.mean() == pytest.approx(w.mean()) and np.abs(found - w).max() < 0.03


@pytest.mark.parametrize("centre", [-1, 4])
@pytest.mark.parametrize("start", [-1, 1, 4])
def test_a_map_is_turned_until_its_start_is_to_the_right(centre, start):
    uv = np.array([[1, 0.2], [0.3, 1], [-1, 0.1], [0, -1], [0.0, 0.0]])
    found = ChartMarkers(centre=centre, start=start).turned(uv)
    w, z = uv @ [1, 1j], found @ [1, 1j]
    way = 0 if start < 0 else w[start] - (w[centre] if centre >= 0 else 0)
    if way == 0:
        np.testing.assert_array_equal(found, uv)
    else:
        np.testing.assert_allclose(np.abs(z), np.abs(w))
        assert np.angle(z[start] - (z[centre] if centre >= 0 else 0)) == pytest.approx(0, abs=1e-12)


def test_corners_of_a_rectangle_are_where_it_turns_sharply_or_stand_apart():
    V, F = meshes.grid(9, 2, 9.0, 0.3)
    loop = boundary_loops(F)[0]
    ends = {v for v in range(len(V)) if V[v, 0] in (0.0, 9.0) and V[v, 1] in (0.0, V[:, 1].max())}
    assert set(rectangle_corners(V, F, loop)) == ends
    W, G = meshes.hemisphere(5, 24)
    round_loop = boundary_loops(G)[0]
    place = np.flatnonzero(np.isin(round_loop, rectangle_corners(W, G, round_loop)))
    assert len(place) == 4 and np.diff(np.append(place, place[0] + len(round_loop))).min() >= 3


def test_uvs_that_are_nowhere_are_refused_by_their_faces_and_those_at_one_place_have_no_area():
    V, F = meshes.grid(2, 2)
    surface = triangle_surface(V, F)
    with pytest.raises(errors.MeshError) as caught:
        uv_islands(surface, np.full((F.size, 2), np.nan))
    assert caught.value.kind == "face" and len(caught.value.elements) == len(F)
    flat = V * [1, 0, 0]
    with pytest.raises(errors.ZeroAreaFaceError, match="has an area"):
        uv_islands(triangle_surface(flat, F), np.zeros((F.size, 2)))


def test_sides_that_lie_on_one_another_are_joined_where_all_can_be_and_opened_again():
    V, F = meshes.grid(2, 2)
    W = np.concatenate([V, V + [1, 0, 0]])
    G = np.concatenate([F, F + len(V)])
    found = join_coincident(W, G)
    assert len(np.unique(found.triangles)) == len(W) - 3
    apart = join_coincident(np.concatenate([V, V + [2, 0, 0]]), G)
    assert (apart.triangles == G).all()
    # A third side at the same edge would be one too many.
    third = join_coincident(np.concatenate([W, V[:, [2, 1, 0]] + [1, 0, 0]]), np.concatenate([G, F + 2 * len(V)]))
    assert len(np.unique(third.triangles)) == 3 * len(V)
    assert reopened(V, F, np.zeros(0, np.int64))[0] is V
    # Of edges that meet: as many fans as edges inside, and one more at a boundary.
    on_boundary = np.array([True, False, False, True])
    for ends in ([1, 2], [0, 1, 1, 2], [0, 3], [1, 2, 2, 1]):
        meeting = np.bincount(ends, minlength=4)
        expected = sum(max(m - (0 if b else 1), 0) for m, b in zip(meeting.tolist(), on_boundary.tolist(), strict=True))
        assert reopened_copies(np.array(ends), on_boundary) == expected
