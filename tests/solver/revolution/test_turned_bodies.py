"""Surfaces of revolution: their axis and profile, and the rings along which they come apart."""

from dataclasses import replace

import bodies
import meshes
import numpy as np
import polygons
import pytest
from turned import ASKED, ring_edges, somewhere

from omt_uv.solver.mesh.topology import graph_components
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.revolution.axis import PASSES, axis_of_revolution
from omt_uv.solver.revolution.bands import CREASE, ISLAND, WORTH, bands_and_cost, cheapest_bands
from omt_uv.solver.revolution.profile import LEAST_SIDES, MOST_LEVELS, Profile, profile_of

# Distances from the axis, and heights.
VASE = [(0, 0), (0.3, 0), (0.5, 0), (0.65, 0.25), (0.8, 0.5), (0.88, 0.8), (0.9, 1.1), (0.8, 1.5), (0.6, 1.8)]
VASE += [(0.45, 2.0), (0.3, 2.2), (0.35, 2.5), (0.5, 2.6)]
PLATE = [(0, 0), (0.5, 0), (1, 0.2), (1.02, 0.22), (1, 0.24), (0.5, 0.06), (0, 0.06)]
COLUMN = [(0.6, 0), (0.55, 0.15), (0.45, 0.3), (0.4, 0.5), (0.4, 2.1), (0.45, 2.3), (0.55, 2.45), (0.6, 2.6)]
BODIES = {
    "vase": VASE,
    "plate": PLATE,
    "cone": [(0.5, 0), (0.3, 1), (0.1, 2)],
    "barrel": [(0.8, 0), (1, 1), (0.8, 2)],
    "column": COLUMN,
}


def triangulated(name, sides=24, turn=0):
    V, P = bodies.turned(BODIES[name], sides)
    return V, *polygons.cut(P, turn)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("turn", [0, 1])
def test_a_turned_body_has_its_axis_wherever_it_is(name, turn):
    V, F, owner = triangulated(name, turn=turn)
    V, along, point = somewhere(V)
    axis = axis_of_revolution(V, F, owner)
    assert abs(axis.direction @ along) == pytest.approx(1, abs=1e-9)
    assert axis.radius(point[None])[0] == pytest.approx(0, abs=1e-8)
    # Height, radius and the place in the plane across are those of a point in space.
    here = V - axis.point
    np.testing.assert_allclose(axis.height(V) ** 2 + axis.radius(V) ** 2, (here**2).sum(axis=1), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(axis.plane(V), axis=1), axis.radius(V), atol=1e-9)


@pytest.mark.parametrize("longer", [0.3, 1e-3, 0.01, 0.02])
@pytest.mark.parametrize("way", [1, -1])
def test_what_is_nearly_a_ball_turns_about_no_axis_of_its_own(longer, way):
    """However exactly it turns about the one along which it is a little longer, or shorter."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 17)
    V, P = bodies.turned([(np.cos(t), (1 + way * longer) * np.sin(t)) for t in turn], 24)
    found = axis_of_revolution(V, *polygons.cut(P, 0))
    assert (found is not None) == (longer > 0.1)
    assert found is None or abs(found.direction[2]) == pytest.approx(1, abs=1e-9)


def test_what_does_not_turn_or_turns_about_any_axis_has_none():
    V, F = bodies.icosphere(2)
    every = np.arange(len(F))
    assert axis_of_revolution(V, F, every) is None
    assert axis_of_revolution(V * [1, 1, 1.5], F, every) is not None
    assert axis_of_revolution(V * [1, 1.3, 1.7], F, every) is None
    assert axis_of_revolution(V, F[:0], every[:0]) is None
    assert axis_of_revolution(0 * V, F, every) is None


@pytest.mark.parametrize("e", [0.06, 0.08])
def test_what_is_nearly_a_ball_of_three_lengths_turns_about_none_of_them(e):
    """Normals pass every axis by as much, however little that is; two that are equal make the third one an axis."""
    V, F = bodies.icosphere(2)
    every = np.arange(len(F))
    for lengths in ([1, 1 + e, 1 + 2 * e], [1 + 2 * e, 1, 1 + e]):
        assert axis_of_revolution(V * lengths, F, every) is None
    found = axis_of_revolution(V * [1, 1 + 2 * e, 1], F, every)
    np.testing.assert_allclose(found.direction, [0, 1, 0], atol=0.05)


@pytest.mark.parametrize("name", ["barrel", "column", "cone"])
@pytest.mark.parametrize(("off", "turns"), [(0.5, True), (1.8, False)])
def test_normals_may_pass_the_axis_by_little(name, off, turns):
    """An oval: its normals pass the middle by about this share of its radius, in the root mean square."""
    V, F, owner = triangulated(name, 96)
    oval = V * [1 + off * PASSES * np.sqrt(2), 1, 1]
    assert (axis_of_revolution(oval, F, owner) is not None) == turns


@pytest.mark.parametrize("name", BODIES)
def test_a_profile_goes_from_end_to_end(name):
    given = np.array(BODIES[name])
    V, F, owner = triangulated(name)
    V, *_ = somewhere(V, 3)
    found = profile_of(V, F, axis_of_revolution(V, F, owner))
    backwards = not np.isclose(found.radius[0], 7 * given[0, 0], atol=1e-6)
    given = given[::-1] if backwards else given
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(given, axis=0), axis=1)))
    assert found.in_rows and found.poles.tolist() == [given[0, 0] == 0, given[-1, 0] == 0]
    np.testing.assert_allclose(found.radius, 7 * given[:, 0], atol=1e-6)
    np.testing.assert_allclose(found.length, 7 * length, atol=1e-6)
    assert (np.diff(found.level) > 0).all() and (found.level[0], found.level[-1]) == (0, 1)
    # A row is at one level.
    np.testing.assert_allclose(np.unique(found.along), found.level, atol=1e-14)


@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize("cut", [False, True])
def test_a_face_around_the_axis_is_an_end_to_its_middle(down, cut):
    """A can without a vertex in the middle of its bottom: that comes off, as a disc of one face or of triangles."""
    V, P = bodies.turned([(0.5, 0), (0.5, 0.3), (0.5, 0.6), (0.48, 1.2)], 16)
    F, owner = polygons.cut([*P, list(range(16))[::-1]])
    owner = np.where(cut & (owner == len(P)), owner + np.arange(len(F)), owner)
    V = V * [1, 1, -1] if down else V
    F = F[:, ::-1] if down else F
    found = profile_of(V, F, axis_of_revolution(V, F, owner))
    end = int(found.poles[1])
    assert found.poles.sum() == 1 and found.radius[-end] == 0 and len(found.level) == 5
    np.testing.assert_allclose(found.radius[[1, -2][end]], 0.5)
    np.testing.assert_allclose(np.abs(np.diff(found.length))[-end], 0.5)
    ends = ring_edges(V, F, owner)
    assert sorted(np.unique(ends)) == list(range(16)) and len(ends) == 16


def test_vertices_in_no_rows_have_levels_as_far_from_each_other():
    rng = np.random.default_rng(1)
    V, F = bodies.icosphere(4)
    V = V * [1, 1, 1.6] + 1e-3 * rng.normal(size=V.shape)
    found = profile_of(V, F, axis_of_revolution(V, F, np.arange(len(F))))
    assert not found.in_rows and found.poles.all() and len(found.level) == MOST_LEVELS
    np.testing.assert_allclose(np.diff(found.length), found.length[-1] / (MOST_LEVELS - 1))
    # Half of an ellipse.
    t = np.linspace(0, np.pi, 2001)
    way = np.hypot(np.diff(np.sin(t)), 1.6 * np.diff(np.cos(t))).sum()
    assert found.length[-1] == pytest.approx(way, rel=0.02) and found.radius.max() == pytest.approx(1, abs=0.02)


def test_what_is_no_smooth_body_in_one_piece_has_no_profile():
    few, enough = ({"sides": n} for n in (LEAST_SIDES - 1, LEAST_SIDES))
    for sides, found in ((few, False), (enough, True)):
        V, F, owner = triangulated("vase", **sides)
        assert (profile_of(V, F, axis_of_revolution(V, F, owner)) is not None) == found
    # A torus has no ends, two barrels have four, and half of a barrel one.
    V, F = meshes.torus()
    assert profile_of(V, F, axis_of_revolution(V, F, np.arange(len(F)))) is None
    V, F, owner = triangulated("barrel")
    axis = axis_of_revolution(V, F, owner)
    assert profile_of(np.concatenate([V, V + [0, 0, 5]]), np.concatenate([F, F + len(V)]), axis) is None
    half = F[(V[F].mean(axis=1)[:, 0] > 0)]
    used, half = np.unique(half, return_inverse=True)
    assert profile_of(V[used], half.reshape(-1, 3), axis) is None


def profile(radius, length, poles=(False, False)):
    radius, length = np.asarray(radius, float), np.asarray(length, float)
    return Profile(np.linspace(0, 1, len(radius)), np.zeros(0), radius, length, True, np.array(poles))


def test_cones_and_discs_stay_in_one_piece():
    s = np.linspace(0, 1, 20)
    for radius, poles in ((1 + 0 * s, (False, False)), (0.2 + 0.7 * s, (False, False)), (s, (True, False))):
        assert not len(cheapest_bands(profile(radius, s, poles), np.ones(20), ASKED))


def test_a_body_comes_apart_where_its_profile_bends():
    s = np.linspace(0, 3, 31)
    radius = np.interp(s, [0, 1, 3], [0, 1, 1])
    assert cheapest_bands(profile(radius, s, (True, False)), np.ones(31), ASKED).tolist() == [10]
    assert cheapest_bands(profile(radius[::-1], s, (False, True)), np.ones(31), ASKED).tolist() == [20]


def test_a_needle_on_top_is_no_trouble():
    s = np.array([0, 0.5, 1, 1.5, 2.0, 2.2, 2.5])
    needle = profile([0.5, 0.5, 0.5, 0.25, 0, 0, 0], s, (False, True))
    with np.errstate(all="raise"):
        found = cheapest_bands(needle, np.ones(7), ASKED)
    assert found.min() > 0 and found.max() < 6 and 3 in found


def test_dear_rings_are_left_out_as_long_as_bands_keep_what_is_asked():
    s = np.linspace(0, 2, 41)
    mild = 1 + 0.12 * np.sin(np.pi * s / 2)
    assert not len(cheapest_bands(profile(mild, s), np.ones(41), ASKED))
    assert len(cheapest_bands(profile(mild, s), np.ones(41), ASKED / 100))
    round_ = np.sin(np.pi * s / 2)
    found = cheapest_bands(profile(round_, s * np.pi / 2, (True, True)), np.full(41, 1e6), ASKED)
    assert 1 <= len(found) <= 2


def test_the_cheapest_of_all_choices_is_found():
    """Beside all subsets of levels, by the costs that are told: shear, cuts along and around, and islands."""
    rng = np.random.default_rng(5)
    s = np.append(0, np.cumsum(rng.uniform(0.1, 0.3, 7)))
    given = profile(0.7 + np.cumsum(rng.uniform(-0.1, 0.1, 8)), s)
    price = rng.uniform(0.5, 1.0, 8)
    middle, step = (given.radius[1:] + given.radius[:-1]) / 2, np.diff(s)
    area, at = 2 * np.pi * middle * step, (s[1:] + s[:-1]) / 2
    side = np.sqrt(area.sum())

    slope = np.arccos(np.diff(given.radius) / np.diff(s))
    hidden = np.append(0, 1 - CREASE * np.abs(np.diff(slope)) / (np.pi / 2))

    def cost(levels):
        total = sum(ISLAND + 2 * np.pi * given.radius[k] * price[k] * hidden[k] / side for k in levels)
        for low, high in zip((0, *levels), (*levels, 7), strict=True):
            here = slice(low, high)
            weight = np.sqrt(step[here] / middle[here])
            basis = np.stack([np.ones(high - low), at[here]], axis=1) * weight[:, None]
            left = middle[here] * weight - basis @ np.linalg.lstsq(basis, middle[here] * weight, rcond=None)[0]
            left = 4 * (left @ left) / (middle[here] @ step[here])
            if left > ASKED:
                return np.inf
            total += WORTH * area[here].sum() / area.sum() * left / ASKED + (s[high] - s[low]) / side
        return total

    every = [tuple(1 + np.flatnonzero([n >> k & 1 for k in range(6)])) for n in range(64)]
    best = min(every, key=cost)
    assert tuple(cheapest_bands(given, price, ASKED)) == best
    levels, least = bands_and_cost(given, price, ASKED)
    assert tuple(levels) == best and least == pytest.approx(cost(best), rel=1e-9)


def test_rings_are_whole_rows_of_edges():
    V, F, owner = triangulated("vase")
    V, *_ = somewhere(V, 2)
    ends = ring_edges(V, F, owner)
    axis = axis_of_revolution(V, F, owner)
    assert len(ends) and len(ends) % 24 == 0
    np.testing.assert_allclose(*axis.height(V)[ends].T, atol=1e-6)
    # Every vertex on one is between two of its edges.
    assert (np.bincount(ends.ravel())[np.unique(ends)] == 2).all()
    assert graph_components(*ends.T, len(V))[0] == len(V) - len(ends) + len(ends) // 24


@pytest.mark.parametrize("name", ["column", "vase", "plate"])
@pytest.mark.parametrize("size", [1.0, 0.37])
def test_numbers_size_and_place_move_no_ring(name, size):
    """Of a column both halves are alike: then no order of vertices and triangles, and no rounding, may choose."""
    V, F, owner = triangulated(name)
    given = ring_edges(V, F, owner)
    rng = np.random.default_rng(1)
    number, order = rng.permutation(len(V)), rng.permutation(len(F))
    moved = np.empty_like(V)
    moved[number] = size * V + [0.1, 2, 0.3]
    found = ring_edges(moved, number[F][order], owner[order])
    assert len(given)
    assert {frozenset(edge) for edge in number[given].tolist()} == {frozenset(edge) for edge in found.tolist()}


def test_what_is_dear_to_cut_has_no_ring():
    V, F, owner = triangulated("vase")
    usual = np.unique(ring_edges(V, F, owner))
    dear = np.isin(np.arange(len(V)), usual)
    others = np.unique(
        ring_edges(V, F, owner, cost=lambda ends, length: length * np.where(dear[ends].all(axis=1), 5, 1))
    )
    assert len(usual) and not dear[others].any()


def test_rings_of_vertices_in_no_rows_are_short():
    V, F = bodies.icosphere(4)
    V = V * [1, 1, 1.6]
    rng = np.random.default_rng(4)
    V = V + 2e-3 * rng.normal(size=V.shape)
    ends = ring_edges(V, F, np.arange(len(F)))
    height = V[:, 2][ends].mean()
    for sign in (-1, 1):
        here = ends[np.sign(V[ends[:, 0], 2]) == sign]
        length = np.linalg.norm(V[here[:, 0]] - V[here[:, 1]], axis=1).sum()
        z = V[here, 2]
        around = 2 * np.pi * np.sqrt(1 - (z.mean() / 1.6) ** 2)
        assert len(here) and np.ptp(z) < 0.25 and length < 1.2 * around
    assert abs(height) < 1.6


def test_what_is_no_such_body_has_none():
    V, F = bodies.limbed(3)
    assert not len(ring_edges(V, F, np.arange(len(F))))


@pytest.mark.parametrize("name", ["vase", "plate"])
def test_a_turned_body_is_unwrapped_in_bands_and_caps(name):
    """One click: the seams are whole rings and one line along each band, and what shears is little."""
    surface = meshes.polygon_surface(*bodies.turned(BODIES[name], 32))
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))
    assert len(found.charts) >= 2
    assert max(one.angle_mean for one in found.maps) < 1.25 and not any(one.folds for one in found.maps)
    around = np.abs(np.diff(surface.positions[found.seams][:, :, 2], axis=1))[:, 0] < 1e-9
    radius = np.linalg.norm(surface.positions[found.seams][:, :, :2], axis=2)
    assert np.count_nonzero(around & (np.ptp(radius, axis=1) < 1e-9)) % 32 == 0


def test_marked_seams_and_parts_to_keep_free_are_left_alone():
    surface = meshes.polygon_surface(*bodies.turned(VASE, 32))
    free = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))
    line = np.array([[0, 1], *([k, k + 32] for k in range(1, 32 * 11, 32))])
    marked = drain(unwrap(replace(surface, seams=line), options=UnwrapOptions(max_shear=1.35)))
    assert len(free.charts) > 1 and len(marked.charts) == 1
