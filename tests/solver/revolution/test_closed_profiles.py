"""Surfaces of revolution that close up as a torus does: their rows, their rings, and what comes of them."""

from itertools import combinations

import bodies
import meshes
import numpy as np
import polygons
import pytest
from turned import ASKED, ring_edges, somewhere

from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.revolution.axis import axis_of_revolution
from omt_uv.solver.revolution.bands import CREASE, ISLAND, WORTH
from omt_uv.solver.revolution.closed_profile import ClosedProfile, cheapest_rings, closed_profile_of
from omt_uv.solver.revolution.profile import LEAST_SIDES

SIDES = 24


def tyre(count=16, sides=SIDES, thick=0.3):
    """Positions and quads of a ring with an oval profile of so many rows, which is flat inside."""
    turn = 2 * np.pi * np.arange(count + 1) / count
    profile = np.column_stack([np.maximum(1 + thick * np.cos(turn), 1 - 0.8 * thick), 1.4 * thick * np.sin(turn)])
    V, P = bodies.turned(profile, sides)
    kept = len(V) - sides
    return V[:kept], [[v % kept for v in quad] for quad in P]


def profile_here(V, F, owner):
    return closed_profile_of(V, F, axis_of_revolution(V, F, owner))


@pytest.mark.parametrize("turn", [0, 1])
def test_rows_come_in_order_from_the_one_nearest_to_the_axis(turn):
    V, P = tyre()
    F, owner = polygons.cut(P, turn)
    V, along, point = somewhere(V, 3)
    found = profile_here(V, F, owner)
    assert len(found.radius) == 16 and (np.bincount(found.row) == SIDES).all()
    # Every row is at one distance from the axis, and one height.
    arm = V - point
    radius = np.linalg.norm(np.cross(arm, along), axis=1)
    np.testing.assert_allclose(found.radius[found.row], radius, atol=1e-6)
    height = found.height[found.row] - arm @ along * np.sign((found.height[found.row] * (arm @ along)).sum())
    assert np.ptp(height) < 1e-6
    assert found.radius[0] == pytest.approx(found.radius.min())
    # Neighbours in the profile are neighbours on the surface, and the order turns one way.
    ends = np.concatenate([found.row[F[:, [0, 1]]], found.row[F[:, [1, 2]]]])
    assert set(np.unique(np.diff(ends, axis=1) % 16)) <= {0, 1, 15}
    r, z = found.radius, found.height
    assert np.sum(r * np.roll(z, -1) - z * np.roll(r, -1)) > 0
    # A closed profile turns once around, in all.
    assert found.turns().sum() == pytest.approx(2 * np.pi)


def test_an_opened_profile_goes_all_around():
    V, P = tyre()
    found = profile_here(V, *polygons.cut(P))
    whole = np.abs(np.diff(np.append(found.radius, found.radius[0]) + 1j * np.append(found.height, found.height[0])))
    for start in (0, 5, 15):
        opened, rows = found.opened(start)
        assert rows[0] == rows[-1] == start and sorted(rows[1:]) == list(range(16))
        assert opened.length[-1] == pytest.approx(whole.sum())
        np.testing.assert_allclose(opened.radius, found.radius[rows])
        assert opened.level[0] == 0 and opened.level[-1] == 1 and not opened.poles.any()


def test_what_does_not_close_up_has_no_closed_profile():
    V, P = tyre()
    F, owner = polygons.cut(P)
    assert profile_here(V, F, owner) is not None
    # Without one row of quads it has boundaries, and so has one without a face.
    assert profile_here(V, F[2 * SIDES :], owner[2 * SIDES :]) is None
    axis = axis_of_revolution(V, F, owner)
    assert closed_profile_of(V, F[1:], axis) is None
    # Neither a ball nor two rings side by side, nor rows of few.
    ball, faces = bodies.icosphere(2)
    assert closed_profile_of(ball, faces, axis) is None
    both = np.concatenate([V, V + [0, 0, 3]]), np.concatenate([F, F + len(V)])
    assert closed_profile_of(*both, axis) is None
    for sides, found in ((LEAST_SIDES - 1, False), (LEAST_SIDES, True)):
        V, P = tyre(sides=sides)
        assert (profile_here(V, *polygons.cut(P)) is not None) == found
    V, P = tyre()
    rng = np.random.default_rng(0)
    assert closed_profile_of(V + 1e-2 * rng.normal(size=V.shape), F, axis) is None


def cost_of(given, price, rows):
    """What rings cost, by the costs that are told: shear, cuts along and around, and islands."""
    count = len(given.radius)
    way = given.radius + 1j * given.height
    step = np.abs(np.roll(way, -1) - way)
    middle = (given.radius + np.roll(given.radius, -1)) / 2
    area = 2 * np.pi * middle * step
    side = np.sqrt(area.sum())
    hidden = 1 - CREASE * np.minimum(given.turns() / (np.pi / 2), 1)
    total = ISLAND * (len(rows) - 1) + step.sum() / side
    total += sum(2 * np.pi * given.radius[k] * price[k] * hidden[k] / side for k in rows)
    for low, high in zip(rows, (*rows[1:], rows[0] + count), strict=True):
        here = np.arange(low, high) % count
        at = np.cumsum(step[here]) - step[here] / 2
        weight = np.sqrt(step[here] / middle[here])
        basis = np.stack([np.ones(len(here)), at], axis=1) * weight[:, None]
        left = middle[here] * weight - basis @ np.linalg.lstsq(basis, middle[here] * weight, rcond=None)[0]
        left = 4 * (left @ left) / (middle[here] @ step[here])
        if left > ASKED:
            return np.inf
        total += WORTH * area[here].sum() / area.sum() * left / ASKED
    return total


@pytest.mark.parametrize("seed", range(4))
def test_the_cheapest_of_all_rings_are_found(seed):
    """Beside all choices of rows of a profile that only bends a little, as a thin ring does."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * np.arange(9) / 9
    # The profile of a band is told by its distances from the axis alone, so no corner may be one by its heights only.
    given = ClosedProfile(np.zeros(0), 1 + 0.2 * np.cos(turn) + 0.02 * rng.normal(size=9), 0.2 * np.sin(turn))
    price = rng.uniform(0.5, 1.5, 9)
    every = [rows for n in range(1, 5) for rows in combinations(range(9), n)]
    found = tuple(cheapest_rings(given, price, ASKED).tolist())
    best = min(cost_of(given, price, rows) for rows in every)
    assert cost_of(given, price, found) == pytest.approx(best, rel=0.02)


def test_rings_that_cannot_be_cut_are_not_chosen():
    V, P = tyre()
    found = profile_here(V, *polygons.cut(P))
    price = np.ones(16)
    usual = cheapest_rings(found, price, ASKED)
    others = cheapest_rings(found, np.where(np.isin(range(16), usual), np.inf, price), ASKED)
    assert len(usual) and len(others) and not np.isin(others, usual).any()
    assert not len(cheapest_rings(found, np.full(16, np.inf), ASKED))
    # A cone between two rows is exact, however little is asked.
    assert len(cheapest_rings(found, price, 1e-9)) > len(usual)


@pytest.mark.parametrize("size", [1.0, 0.37])
def test_rings_are_whole_rows_whatever_the_numbers(size):
    V, P = tyre()
    F, owner = polygons.cut(P)
    given = ring_edges(V, F, owner)
    assert len(given) and len(given) % SIDES == 0
    np.testing.assert_allclose(*V[given, 2].T, atol=1e-9)
    assert (np.bincount(given.ravel())[np.unique(given)] == 2).all()
    rng = np.random.default_rng(1)
    number, order = rng.permutation(len(V)), rng.permutation(len(F))
    moved = np.empty_like(V)
    moved[number] = size * V + [0.1, 2, 0.3]
    found = ring_edges(moved, number[F][order], owner[order])
    assert {frozenset(edge) for edge in number[given].tolist()} == {frozenset(edge) for edge in found.tolist()}


def test_a_ring_through_a_polygon_is_none():
    """Two quads beside each other joined to one polygon: the row between them closes no ring any more."""
    V, P = tyre()
    usual = np.unique(ring_edges(V, *polygons.cut(P)))
    rows = profile_here(V, *polygons.cut(P)).row
    ring = rows[usual[0]]
    touching = [k for k, quad in enumerate(P) if (rows[quad] == ring).any()]
    first = touching[0]
    edge = {v for v in P[first] if rows[v] == ring}
    other = next(k for k in touching if k != first and edge <= set(P[k]))
    F, owner = polygons.cut(P)
    owner = np.where(owner == other, first, owner)
    assert ring not in rows[np.unique(ring_edges(V, F, owner))]


@pytest.mark.parametrize("which", range(0, SIDES, 5))
def test_a_ring_that_lacks_an_edge_is_none(which):
    """As where there is a hole: what is left of the row closes up no more, and another one is cut."""
    V, P = tyre()
    F, owner = polygons.cut(P)
    usual, rows = ring_edges(V, F, owner), profile_here(V, F, owner).row
    lacking = usual[rows[usual[:, 0]] == rows[usual[0, 0]]][which]
    found = ring_edges(V, F, owner, without=lacking)
    assert len(found) and rows[lacking[0]] not in rows[np.unique(found)]
    assert len(found) % SIDES == 0


def test_a_torus_comes_in_two_halves_with_straight_seams():
    """One click: one ring, and two ways around the tube, about opposite each other."""
    V, F = meshes.torus(48, 12, 0.25)
    quads = [[*a, b[2]] for a, b in zip(F[:576].tolist(), F[576:].tolist(), strict=True)]
    surface = meshes.polygon_surface(V.astype(np.float32).astype(float), quads)
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))
    small, large = sorted(len(np.unique(chart.faces)) for chart in found.charts)
    assert small + large == 576 and large <= 1.2 * small
    assert max(one.angle_mean for one in found.maps) < 1.25 and not any(one.folds for one in found.maps)
    # Vertices are numbered along the profile.
    around, along = found.seams // 12, found.seams % 12
    on_ring, across = along[:, 0] == along[:, 1], around[:, 0] == around[:, 1]
    assert (on_ring ^ across).all()
    assert np.count_nonzero(on_ring) == 48 and len(np.unique(along[on_ring])) == 1
    assert np.count_nonzero(across) == 24 and len(np.unique(around[across])) == 2
