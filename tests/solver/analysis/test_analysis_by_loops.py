"""Pieces of what analyses surfaces, against loops over vertices, samples and regions."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.spatial import cKDTree

from omt_uv.solver.analysis import (
    density,
    feature_edges,
    joint_density,
    occlusion,
    order_of_places,
    region_density,
    seam_costs,
    straight_paths,
    symmetry_plane,
    vertex_scores,
)
from omt_uv.solver.errors import DensityError, NoRegionError, ShareError, UniformWeightsError, WeightError
from omt_uv.solver.mesh.geometry import face_areas, face_normals
from omt_uv.solver.mesh.topology import pair_keys


@pytest.mark.parametrize("c", [0.0, 1.0, 2.5])
def test_densities_of_curvature_spread_it_over_the_faces_of_each_vertex(c):
    V, F = meshes.bumpy(4, 3)
    area, curvature = face_areas(V, F), np.random.default_rng(0).normal(size=len(V))
    at = [sum(area[t] / 3 for t in range(len(F)) if v in F[t]) for v in range(len(V))]
    per = np.abs(curvature) / at * area.sum() / 7.0
    expected = [1 + c * np.mean([per[v] for v in f]) for f in F.tolist()]
    np.testing.assert_allclose(density._curvature_density(area, F, curvature, c, 7.0), expected)


@pytest.mark.parametrize("c", [-1e-9, np.nan, np.inf])
def test_weights_of_curvature_are_not_negative(c):
    V, F = meshes.grid(2, 2)
    with pytest.raises(DensityError, match="weight of curvature"):
        density.gaussian_curvature_density(V, F, c)


@pytest.mark.parametrize("error, told", [(0.02, False), (0.0201, True)])
def test_areas_are_said_to_be_off_beyond_twice_the_goal(error, told):
    words = density.area_error_warnings(error, 0.01)
    assert len(words) == told and (not told or words[0].startswith("Areas are 2 % of the texture off"))
    assert density.area_error_warnings(0.125, 0.01)[0].startswith("Areas are 12 % of")


@pytest.mark.parametrize("contrast, good", [(1e6, True), (1.001e6, False)])
def test_densities_vary_by_a_million_at_most(contrast, good):
    values = np.array([2.0, 3.0, 2 * contrast])
    if good:
        np.testing.assert_array_equal(density.checked_density(values), values)
    else:
        with pytest.raises(DensityError) as error:
            density.checked_density(values)
        assert error.value.elements.tolist() == [0] and error.value.kind == "face"


@pytest.mark.parametrize(
    "weights, error, elements",
    [
        ([0, 0.5, 1], None, None),
        ([0, np.nan, np.inf], WeightError, [1, 2]),
        ([-0.01, 0, 1.01], WeightError, [0, 2]),
        ([0, 0, 0], NoRegionError, []),
        ([0.5, 0.5, 0.5], UniformWeightsError, []),
        ([1, 1, 1], UniformWeightsError, []),
    ],
)
def test_weights_of_regions_are_told_what_is_wrong(weights, error, elements):
    if error is None:
        assert density.check_region(weights).tolist() == weights
        return
    with pytest.raises(error) as found:
        density.check_region(weights, "vertex")
    assert list(found.value.elements) == elements and (not elements or found.value.kind == "vertex")


@pytest.mark.parametrize("factor, good", [(1e-9, True), (0.0, False), (-1.0, False), (np.inf, False), (np.nan, False)])
def test_factors_are_positive_and_finite(factor, good):
    if good:
        density.check_factor(factor)
    else:
        with pytest.raises(ShareError, match="A region cannot have"):
            density.check_factor(factor)


def test_vertices_of_a_coarse_mesh_are_as_dense_as_the_map_stretches():
    V, F = meshes.grid(6, 6)
    area = face_areas(V, F)
    even = density.density_of_vertices(V, F, 3 * area, 20)
    np.testing.assert_allclose(even, 1)
    target = area * np.where(V[F].mean(axis=1)[:, 0] < 0.2, 1.5, 1.0)
    found = density.density_of_vertices(V, F, target, 5000)
    left, right = found[V[:, 0] < 0.01], found[V[:, 0] > 0.9]
    assert left.min() > 1.4 * right.max()
    assert (found.min() > 0) and np.isfinite(found).all()


def tilted_measure(regions, area, tilts):
    found = area * np.exp(tilts @ regions)
    return found / found.sum()


@pytest.mark.parametrize("seed", range(3))
def test_tilts_give_regions_the_shares_asked_for(seed):
    rng = np.random.default_rng(seed)
    regions, area = rng.random((2, 30)), rng.uniform(0.5, 2, 30)
    target = regions @ area / area.sum() * rng.uniform(0.9, 1.15, 2)
    tilts = joint_density._tilts(regions, area, target)
    np.testing.assert_allclose(regions @ tilted_measure(regions, area, tilts), target, atol=1e-9)
    measure, value = joint_density._tilted(regions, area, tilts, target)
    np.testing.assert_allclose(measure, tilted_measure(regions, area, tilts))
    assert value == pytest.approx(np.log((area * np.exp(tilts @ regions)).sum() / area.sum()) - tilts @ target)
    # The least of the function.
    for step in (*np.eye(2), *-np.eye(2)):
        assert joint_density._tilted(regions, area, tilts + 0.01 * step, target)[1] > value
    assert joint_density._tilts(regions, area, np.array([1.5, 0.5])) is None


def test_measures_exist_until_one_region_has_all_of_it():
    regions, before = np.array([[1.0, 0, 0], [0, 1.0, 0]]), np.array([0.2, 0.2])
    # Both together may have 1: from 0.4 to 1.6 that is half of the way.
    assert joint_density._share_of_the_way(regions, before, np.array([0.8, 0.8])) == pytest.approx(0.5)
    assert joint_density._share_of_the_way(regions, before, np.array([0.3, 0.3])) == pytest.approx(1)
    error = joint_density._too_much(regions, before, np.array([4.0, 4.0]), "why")
    assert "80 + 80 % of the texture together: why" in str(error) and "such as 2.425, 2.425" in str(error)


def test_frames_look_all_over_half_of_the_sphere():
    frames = occlusion._frames(32).astype(float)
    for frame in frames:
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-5)
        assert np.linalg.det(frame) == pytest.approx(1, abs=1e-4) and frame[2, 2] > 0
    # Evenly: the second moments of directions are a third each.
    np.testing.assert_allclose(frames[:, 2].T @ frames[:, 2] / 32, np.eye(3) / 3, atol=0.02)
    np.testing.assert_allclose(occlusion.half_sphere(32), frames[:, 2], atol=1e-6)
    assert occlusion.half_sphere(8)[:, 2].tolist() == [1 - (k + 0.5) / 8 for k in range(8)]


@pytest.mark.parametrize("slant", [1.0, 0.5, 0.0])
def test_samples_are_seen_from_both_ends_within_the_slope_of_their_faces(slant):
    room = 0.25 + 1.5 * np.sqrt(1 - max(slant, 1e-3) ** 2) / max(slant, 1e-3)
    depth = np.array([0.0, 0.9 * room, 1.1 * room, 5 * room, 7.0])
    seen = np.zeros((3, 5), np.float32)
    seen[2] = depth
    seen[0, 4] = 3  # in a pixel of its own
    owner = np.zeros(5, int)
    near, far = occlusion._visible(seen, np.array([slant]), owner)
    assert near.tolist() == [True, True, False, False, True]
    top = depth[:4].max()
    assert far.tolist() == [*(d >= top - room for d in depth[:4].tolist()), True]


def test_the_side_of_a_part_counts_that_is_less_hidden():
    V, F = meshes.quad_patch()
    both = np.concatenate([F, F + 4])
    hidden = np.array([[0.1, 0.9, 0.8, 0.6], [0.3, 0.2, 0.1, 0.9]])
    area = np.array([3.0, 1.0, 1.0, 1.0])
    # In the mean of the first part 0.3 and 0.275, of the second 0.7 and 0.5.
    assert occlusion._outer(hidden, area, both, 8).tolist() == [0.3, 0.2, 0.1, 0.9]
    area[0] = 5.0
    assert occlusion._outer(hidden, area, both, 8).tolist() == [0.1, 0.9, 0.1, 0.9]


def test_bits_are_spread_by_two():
    for value in (0, 1, 5, 2**20 + 3, 2**21 - 1):
        expected = sum(((value >> k) & 1) << (3 * k) for k in range(21))
        assert int(order_of_places._spread(np.array([value], np.uint64))[0]) == expected


@pytest.mark.parametrize("power", [-60, 0, 40])
def test_points_are_centred_in_units_of_their_extent(power):
    points = np.random.default_rng(0).normal(size=(30, 3)) * [3, 1, 2] + [5, -7, 1]
    expected = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    np.testing.assert_allclose(order_of_places._centred(np.ldexp(points, power)), expected, atol=1e-12)
    assert order_of_places._centred(np.ones((4, 3))) is None


def test_axes_turn_with_the_points_and_are_none_of_what_has_none():
    rng = np.random.default_rng(1)
    points = rng.exponential(size=(200, 3)) * [5, 2, 1]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    axes, turned = order_of_places.own_axes(points), order_of_places.own_axes(points @ turn.T)
    np.testing.assert_allclose(turned, turn @ axes, atol=1e-8)
    assert np.linalg.det(axes) == pytest.approx(1)
    skew = (((points - points.mean(axis=0)) @ axes) ** 3).mean(axis=0)
    assert np.delete(skew, np.abs(skew).argmin()).min() > 0
    one, other = (order_of_places._in_own_frame(x) for x in (points, points @ turn.T))
    np.testing.assert_allclose(other / np.ptp(other), one / np.ptp(one), atol=1e-9)
    cube = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T.astype(float)
    assert order_of_places.own_axes(cube) is None
    np.testing.assert_array_equal(order_of_places._in_own_frame(cube), cube)


@pytest.mark.parametrize("factor", [0.3, 1.0, 2.0])
def test_contrasts_give_regions_their_shares(factor):
    rng = np.random.default_rng(0)
    region, area = rng.random(40), rng.uniform(0.5, 2, 40)
    target = factor * (region @ area) / area.sum() if factor < 2 else 0.8
    found = region_density._contrast(region, area, target)
    measure = area * found**region
    assert region @ measure / measure.sum() == pytest.approx(target, abs=1e-9)


def test_small_regions_join_the_neighbour_with_most_border():
    # 0 and 1 are large; 2 is small, with more of its border along 1; 3 is narrow, along 0 alone.
    area, boundary = np.array([50.0, 40.0, 0.2, 3.0]), np.array([5.0, 5.0, 0.0, 20.0])
    own, other = np.array([0, 2, 1, 0]), np.array([2, 1, 0, 3])
    length = np.array([0.5, 0.8, 6.0, 10.0])
    group = feature_edges._merged(area, boundary, own, other, length)
    assert group[2] == group[1] != group[0] == group[3]
    least = 0.7 * np.sqrt(3) / 4
    for size, joins in ((least * 0.99, True), (least * 1.01, False)):
        group = feature_edges._merged(
            np.array([50.0, size]), np.array([5.0, 0]), np.array([0]), np.array([1]), np.array([0.1])
        )
        assert (group[0] == group[1]) == joins
    for width, joins in ((0.24, True), (0.26, False)):
        found = feature_edges._merged(
            np.array([50.0, 5.0]), np.zeros(2), np.array([0]), np.array([1]), np.array([10 / width])
        )
        assert (found[0] == found[1]) == joins


def test_pairs_of_halfedges_are_edges_between_two_faces():
    V, F = meshes.bumpy(3, 2)
    first, second, edges = feature_edges._pairs(F)
    tail, head = F.ravel(), np.roll(F, -1, axis=1).ravel()
    assert len(first) == sum(1 for k in range(len(tail)) for j in range(k) if {tail[j], head[j]} == {tail[k], head[k]})
    for f, s, (a, b) in zip(first, second, edges.tolist(), strict=True):
        assert (tail[f], head[f]) == (a, b) and {tail[s], head[s]} == {a, b} and f < s


@pytest.mark.parametrize("value, step", [(0.9, 0), (1.0, 0), (1.5, 0.15625), (2.0, 0.5), (3.0, 1), (9.0, 1)])
def test_steps_are_smooth_between_their_ends(value, step):
    assert seam_costs._step(np.array([value]), (1.0, 3.0))[0] == pytest.approx(step)


@pytest.mark.parametrize(
    "residual, normal, chance",
    [
        (1.01, (0, 0, 1), True),
        (0.99, (0, 0, 1), False),
        (1.01, (1, 0, 0), False),
        (1.01, (0, 0.05, 0.999), True),
    ],
)
def test_a_mirror_of_above_and_below_that_is_not_quite_one_is_chance(residual, normal, chance):
    """On whichever side of the plane its normal is, and whichever way up is."""
    for sign, up in ((1, 2), (1, -2), (-1, 2), (-1, -2)):
        plane = SimpleNamespace(residual=residual * seam_costs.CHANCE, normal=sign * np.array(normal, float))
        assert seam_costs._is_chance(plane, SimpleNamespace(up=(0, 0, up))) == chance


def test_vertices_stand_in_the_order_of_their_places():
    V, F = meshes.random_disk(20, 3)
    used = np.random.default_rng(0).permutation(len(V))
    place = np.empty(len(V), int)
    place[used] = np.arange(len(V))
    found, triangles = seam_costs._in_order(V, used, place[F])
    np.testing.assert_array_equal(found[triangles], F)
    np.testing.assert_array_equal(found, used[order_of_places.order_of_places(V[used], place[F])])


def test_planes_of_some_have_images_among_all():
    plane = symmetry_plane.SymmetryPlane(np.array([1.0, 0, 0]), 0.0, 0.0, np.array([1, 0, 2]))
    found = seam_costs._among_all(plane, np.array([4, 2, 5]), 7)
    assert found.image.tolist() == [0, 1, 4, 3, 2, 5, 6]
    near = symmetry_plane.SymmetryPlane(np.array([1.0, 0, 0]), 0.0, 0.1, None)
    assert seam_costs._among_all(near, np.array([4, 2, 5]), 7) is near


def test_edges_are_as_sharp_as_the_angles_between_their_faces():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1.0], [2, 0, 0]])
    F = np.array([[0, 1, 2], [1, 3, 2], [1, 4, 3]])
    keys = np.unique(pair_keys(F.ravel(), np.roll(F, -1, axis=1).ravel()))
    found = dict(zip(keys.tolist(), seam_costs._sharp(V, F, keys), strict=True))
    normal = face_normals(V, F)
    for (a, b), (one, other) in {(1, 2): (0, 1), (1, 3): (1, 2)}.items():
        angle = np.arccos(normal[one] @ normal[other])
        assert found[(a << 32) | b] == pytest.approx(seam_costs._step(np.array([angle]), seam_costs.SHARP)[0])
    assert sum(x > 0 for x in found.values()) <= 2 and found[1] == 0


@pytest.mark.parametrize("drawn", [True, False])
def test_sides_of_quads_are_told_from_diagonals(drawn):
    V, F = meshes.grid(3, 3)
    owner = np.tile(np.arange(9), 2) if drawn else np.arange(18)
    tail, head = F.ravel(), np.roll(F, -1, axis=1).ravel()
    keys = np.unique(pair_keys(tail, head))
    found = seam_costs._sides_of_quads(V, F, owner, keys)
    for key, is_side in zip(keys.tolist(), found, strict=True):
        a, b = key >> 32, key & 0xFFFFFFFF
        is_diagonal = (np.abs(V[a] - V[b]) > 1e-9).sum() == 2
        # Who draws quads asks for no diagonals.
        assert is_side == (not is_diagonal) or (drawn and is_diagonal)
    if drawn:
        # A triangle among them is no quad.
        owner[0] = 99
        found = dict(zip(keys.tolist(), seam_costs._sides_of_quads(V, F, owner, keys), strict=True))
        a, b, c = sorted(F[0].tolist())
        assert not any(found[(x << 32) | y] for x, y in ((a, b), (b, c), (a, c)))


def test_walks_back_are_paths_unless_they_cross_themselves():
    path, tail = np.array([0, 9, 3]), np.array([0, 1, 2, 1])
    assert straight_paths._walked(path, tail, np.array([-9, 0, 1, 2]), 2).tolist() == [0, 1, 2, 3]
    assert straight_paths._walked(path, tail, np.array([-9, 0, 1, 2]), 3) is path
    assert straight_paths._walked(path, tail, np.array([-9, -9, 1, 2]), 2) is path


def test_the_best_path_is_cheapest_with_its_turns():
    V, F = meshes.grid(3, 3)
    edges = np.unique(np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1), axis=0)
    cost = np.random.default_rng(2).uniform(0.5, 2, len(edges))
    network = straight_paths.edge_network(V, F, edges, cost)
    of = {tuple(e): c for e, c in zip(edges.tolist(), cost.tolist(), strict=True)}
    beside = {v: [u for e in of for u in e if v in e and u != v] for v in range(16)}

    def price(path, turn):
        steps = [np.linalg.norm(V[b] - V[a]) * of[tuple(sorted((a, b)))] for a, b in pairwise(path)]
        total = sum(steps)
        for k in range(1, len(path) - 1):
            one, two = V[path[k]] - V[path[k - 1]], V[path[k + 1]] - V[path[k]]
            bend = 1 - one @ two / np.linalg.norm(one) / np.linalg.norm(two)
            total += turn * bend * (steps[k - 1] + steps[k]) / 2
        return total

    def ways(path):
        if path[-1] == 15:
            yield path
            return
        for u in beside[path[-1]]:
            if u not in path:
                yield from ways([*path, u])

    given = [0, 1, 2, 3, 7, 11, 15]
    every = list(ways([0]))
    for turn in (0.0, 1.0, 5.0):
        found = straight_paths._path(network, np.array(given), np.zeros(16, bool), turn)
        assert price(found.tolist(), turn) == pytest.approx(min(price(p, turn) for p in every))


def test_disks_about_paths_go_around_no_hole():
    V, F = meshes.annulus(16, 3)
    edges = np.unique(np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1), axis=0)
    network = straight_paths.edge_network(V, F, edges, np.ones(len(edges)))
    angle = np.arctan2(V[:, 1], V[:, 0])
    near = np.flatnonzero(np.abs(angle) < 0.9)
    middle = near[np.argsort(angle[near])]
    radius = np.hypot(*V[middle][:, :2].T)
    ring = middle[np.isclose(radius, np.unique(np.round(radius, 6))[1])]
    found = straight_paths._disk_about(network, ring, np.zeros(len(V), bool))
    assert found[ring].all() and not found.all()
    blocked = np.zeros(len(V), bool)
    blocked[np.flatnonzero(V[:, 1] > 0.2)] = True
    some = straight_paths._disk_about(network, ring, blocked)
    assert not (some & blocked & ~np.isin(np.arange(len(V)), ring)).any()


@pytest.mark.parametrize("count", [3, 10])
def test_cells_are_taken_evenly_by_their_areas(count):
    areas = np.array([4.0, 1, 1, 1, 1, 2])
    expected = []
    for share in 10 * (np.arange(count) + 0.5) / count:
        expected.append(next(k for k in range(6) if areas[: k + 1].sum() >= share))
    assert symmetry_plane._evenly(areas, count).tolist() == sorted(set(expected))


def test_the_farthest_are_left_out():
    distance = np.arange(1.0, 21.0)[None, ::-1]
    assert symmetry_plane._trimmed(distance)[0] == pytest.approx(np.sqrt((np.arange(1, 18) ** 2).mean()))


def test_candidates_are_apart_and_the_best_first():
    normals = np.array([[1, 0, 0], [0.999, 0.0447, 0], [0, 1, 0], [0, 0, 1.0]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    worth = np.array([0.03, 0.02, 0.5, 0.5])
    found = list(symmetry_plane._chosen(normals, worth, np.array([0, 0, 1.0])))
    assert found == [1, 3, 2]
    assert list(symmetry_plane._chosen(normals, worth, np.array([0, 1.0, 0]))) == [1, 2, 3]


def test_principal_axes_are_rows_by_their_spread():
    points = np.random.default_rng(0).normal(size=(500, 3)) * [1, 9, 3]
    found = np.abs(symmetry_plane._principal(points + 5))
    assert found.argmax(axis=1).tolist() == [0, 2, 1]


def samples_of(points, normals, spacing):
    found = object.__new__(symmetry_plane._Samples)
    found.points, found.normals, found.spacing = points, normals, spacing
    found.few, found.tree = points, cKDTree(points)
    found.quick = found.tree
    return found


def test_distances_of_images_are_from_planes_of_samples_beyond_their_spacing():
    rng = np.random.default_rng(0)
    points, normals = rng.normal(size=(30, 3)), rng.normal(size=(30, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    samples = samples_of(points, normals, 0.3)
    normal, offset = np.array([0.6, 0.8, 0.0]), 0.2
    p = rng.normal(size=(7, 3))
    far, off, facing = samples.distances(normal, offset, symmetry_plane._Nearest(samples, p))
    for k in range(7):
        image = p[k] - 2 * (p[k] @ normal - offset) * normal
        nearest = np.linalg.norm(points - image, axis=1).argmin()
        way = image - points[nearest]
        depth = way @ normals[nearest]
        beside = np.linalg.norm(way - depth * normals[nearest])
        assert off[k] == pytest.approx(depth) and far[k] == pytest.approx(np.hypot(depth, max(beside - 0.3, 0)))
        np.testing.assert_array_equal(facing[k], normals[nearest])
    found, is_known = samples.compared(np.stack([normal, -normal]), np.array([offset, -offset]))
    image = points - 2 * (points @ normal - offset)[:, None] * normal
    away = np.array([np.linalg.norm(points - q, axis=1).min() for q in image])
    least = np.sort(away)[: int(0.85 * 30)]
    np.testing.assert_allclose(found, np.sqrt((least**2).mean()))
    assert is_known.all()
    for far, known in ((1.01 * least[-1], True), (0.99 * least[-1], False)):
        found, is_known = samples.compared(normal[None], np.array([offset]), far)
        np.testing.assert_allclose(found, np.sqrt((np.minimum(least, far) ** 2).mean()))
        assert is_known.tolist() == [known]
    depth = np.sqrt(((points @ normal - offset) ** 2).mean())
    assert samples.is_flat(normal, offset, 0.11 * depth) and not samples.is_flat(normal, offset, 0.09 * depth)


@pytest.mark.parametrize("step", [0.0, 1e-3, 0.05, 1.0])
def test_nearest_samples_of_what_moves_are_those_of_the_tree(step):
    rng = np.random.default_rng(1)
    points, image = rng.normal(size=(500, 3)), rng.normal(size=(40, 3))
    tree = cKDTree(points)
    near = symmetry_plane._Nearest(samples_of(points, points, 0.1), image)
    for _ in range(20):
        image = image + step * rng.normal(size=image.shape)
        far, found = near.query(image)
        expected = tree.query(image)
        np.testing.assert_array_equal(far, expected[0])
        np.testing.assert_array_equal(found, expected[1])


@pytest.mark.parametrize("far", [0.0, 0.02, 0.05, 0.2])
def test_planes_are_chosen_as_if_all_distances_were_known(far, monkeypatch):
    rng = np.random.default_rng(2)
    points = rng.normal(size=(400, 3)) * [0.3, 0.2, 0.1]
    samples, side = samples_of(points, points, 0.01), np.array([0.0, 1.0, 0.0])
    normals = rng.normal(size=(60, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offsets = normals @ points.mean(axis=0)
    expected = list(symmetry_plane._chosen(normals, samples.compared(normals, offsets)[0], side))
    monkeypatch.setattr(symmetry_plane, "FAR", far)
    assert symmetry_plane._chosen_among(samples, normals, offsets, side) == expected


def test_distances_across_edges_are_those_over_triangles_laid_flat():
    V, F = meshes.random_disk(40, 2)
    a, b, across = vertex_scores._across(V, F)
    found = sorted((*sorted(p), x) for p, x in zip(zip(a.tolist(), b.tolist(), strict=True), across, strict=True))
    expected = []
    for i in range(len(F)):
        for j in range(i):
            shared = sorted(set(F[i].tolist()) & set(F[j].tolist()))
            if len(shared) == 2:
                p, q = (next(v for v in F[k].tolist() if v not in shared) for k in (i, j))
                o, x = V[shared[0]], V[shared[1]] - V[shared[0]]
                size = np.linalg.norm(x)
                flat = []
                for v, sign in ((p, 1), (q, -1)):
                    along = (V[v] - o) @ x / size
                    flat.append((along, sign * np.sqrt(((V[v] - o) ** 2).sum() - along**2)))
                (x1, y1), (x2, y2) = flat
                cross = x1 + (x2 - x1) * y1 / (y1 - y2)
                if 0 < cross < size:
                    expected.append((*sorted((p, q)), np.hypot(x2 - x1, y2 - y1)))
    np.testing.assert_allclose(found, sorted(expected))
    # And along edges and those, distances are shortest ways.
    n = len(V)
    way = np.full((n, n), np.inf)
    for i, j in zip(F.ravel(), np.roll(F, -1, axis=1).ravel(), strict=True):
        way[i, j] = way[j, i] = np.linalg.norm(V[i] - V[j])
    for i, j, length in expected:
        way[i, j] = way[j, i] = min(way[i, j], length)
    np.fill_diagonal(way, 0)
    for k in range(n):
        way = np.minimum(way, way[:, [k]] + way[[k]])
    np.testing.assert_allclose(vertex_scores.distance(V, F, np.array([3, 17])), way[[3, 17]].min(axis=0))
