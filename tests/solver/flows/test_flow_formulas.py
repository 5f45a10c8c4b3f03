"""What flows are made of, against plain formulas: walls, handles, steps of time, volumes, means, passings."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere
from scipy import special
from scipy.spatial import cKDTree

from omt_uv.solver.errors import HandleError, NonFiniteError
from omt_uv.solver.flows import integration
from omt_uv.solver.flows.domain import ball_domain, mesh_domain
from omt_uv.solver.flows.enclosed_volume import (
    EnclosedParts,
    closed_parts,
    component_volumes,
    corner_volumes,
    restore_volumes,
    vertex_normals,
)
from omt_uv.solver.flows.handles import FlowHandle, check_handles, farthest_points, joined, sampled_handles
from omt_uv.solver.flows.passing import Passing, closest_passing, greatest_surge
from omt_uv.solver.flows.paths import handle_paths, rotation_between
from omt_uv.solver.flows.smoothing import _means

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("samples", [7, 60])
def test_walls_of_a_ball_are_all_around_it(dimension, samples):
    middle = np.array([1.0, -2.0, 3.0])[:dimension]
    found = ball_domain(middle, 2.5, samples)
    assert found.ball and found.reach == 2.5 and len(found.points) == len(found.normals) == samples
    np.testing.assert_allclose(found.points, middle + 2.5 * found.normals)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1)
    # Evenly: each has the next one about as near, and their mean is the middle.
    near = cKDTree(found.points).query(found.points, k=2)[0][:, 1]
    assert near.max() < 2 * near.min() and np.abs(found.normals.mean(axis=0)).max() < 0.1
    if dimension == 2:
        assert near == pytest.approx(5 * np.sin(np.pi / samples))
    outside = middle + np.array([[4.0, 0, 3], [0.1, 0, 0], [-2.5, 0, 0]])[:, :dimension]
    held = found.held(outside)
    assert np.linalg.norm(held - middle, axis=1) == pytest.approx([2.5, 0.1, 2.5])
    assert held[0] - middle == pytest.approx((outside - middle)[0] * 2.5 / np.linalg.norm((outside - middle)[0]))
    for bad in ((middle * np.nan, 1.0), (middle, np.inf), (middle, 0.0), (middle, -1.0)):
        with pytest.raises(NonFiniteError, match="The ball has no finite middle and radius"):
            ball_domain(*bad)


def test_walls_of_a_mesh_are_spread_over_it_and_look_out():
    V = CUBE * [4, 2, 1]
    found = mesh_domain(V, SIDES, 100)
    assert len(found.points) == 100 and not found.ball
    np.testing.assert_allclose(found.middle, [2, 1, 0.5])
    assert found.reach == pytest.approx(np.sqrt(21) / 2)
    # Each lies on the side that its normal belongs to.
    for point, normal in zip(found.points, found.normals, strict=True):
        axis = np.abs(normal).argmax()
        assert normal[axis] in (1, -1) and point[axis] == pytest.approx(V[:, axis].max() if normal[axis] > 0 else 0)
    share = np.bincount(2 * np.abs(found.normals).argmax(axis=1) + (found.normals.sum(axis=1) > 0), minlength=6) / 100
    assert share == pytest.approx(np.repeat([2, 4, 8], 2) / 28, abs=0.05)
    near = cKDTree(found.points).query(found.points, k=2)[0][:, 1]
    # As far apart as 100 samples of an area of 28 can be, within reason.
    assert near.min() > 0.4 and near.max() < 1.0
    assert len(mesh_domain(V, SIDES).points) == 400
    with pytest.raises(HandleError, match="no faces"):
        mesh_domain(V * 0, SIDES, 10)


@pytest.mark.parametrize("where", [0, 3, 12])
def test_faces_without_area_are_no_walls_wherever_they_stand(where):
    """Samples have the normals of the faces that they lie on."""
    V = CUBE * [4, 2, 1]
    found, plain = (
        mesh_domain(V, np.insert(SIDES, where, [[0, 1, 1], [2, 2, 2]], axis=0), 60),
        mesh_domain(V, SIDES, 60),
    )
    np.testing.assert_array_equal(found.points, plain.points)
    np.testing.assert_array_equal(found.normals, plain.normals)


def test_bad_handles_are_named_whatever_is_wrong():
    P = np.zeros((2, 3))
    good = FlowHandle(P, P + 1)
    for bad in (
        FlowHandle(P, P[:1], name="hand"),
        FlowHandle(P[:, :2], P[:, :2], name="hand"),
        FlowHandle(P[:0], P[:0], name="hand"),
    ):
        with pytest.raises(HandleError, match="The handle hand has no points"):
            check_handles((good, bad), 3)
    with pytest.raises(HandleError, match="number 1"):
        check_handles((good, FlowHandle(P, P[:1])), 3)
    for bad in (FlowHandle(P * np.nan, P, name="hand"), FlowHandle(P, P + np.inf, name="hand")):
        with pytest.raises(NonFiniteError, match="hand"):
            check_handles((good, bad), 3)
    with pytest.raises(HandleError, match="No handle moves"):
        check_handles((FlowHandle(P, P), FlowHandle(P + 1, P + 1)), 3)
    check_handles((FlowHandle(P, P), good), 3)
    assert FlowHandle(P, P).stays and not good.stays


def test_samples_are_the_farthest_each_time():
    points = np.random.default_rng(0).normal(size=(40, 3))
    rows = farthest_points(points, 0.0, 12)
    assert rows[0] == np.linalg.norm(points - points.mean(axis=0), axis=1).argmin() and len(set(rows)) == 12
    for k in range(1, 12):
        away = np.linalg.norm(points[:, None] - points[rows[:k]], axis=2).min(axis=1)
        assert away[rows[k]] == away.max()
    spacing = 1.0
    few = farthest_points(points, spacing, 100)
    apart = np.linalg.norm(points[few][:, None] - points[few], axis=2) + 9 * np.eye(len(few))
    assert apart.min() >= spacing
    assert np.linalg.norm(points[:, None] - points[few], axis=2).min(axis=1).max() < spacing
    (one,) = sampled_handles((FlowHandle(points, points + 1, np.arange(40) + 5, "x"),), 0.0, 6)
    assert np.array_equal(one.vertices - 5, rows[:6]) and one.name == "x"
    np.testing.assert_array_equal(one.start, points[rows[:6]])
    np.testing.assert_array_equal(one.end, points[rows[:6]] + 1)


def test_handles_in_one_place_have_to_go_one_way():
    first = np.array([[3.0, 2, 1], [4, 2, 1]])
    one = FlowHandle(first, first + [0, 1, 0], name="one")
    same = FlowHandle(one.start[:1] + 5e-4, one.end[:1] + 5e-4, name="same")
    start, _, owner = joined((one, same), 1.0)
    np.testing.assert_array_equal(start, one.start)
    assert owner.tolist() == [0, 0]
    # The same displacement is what counts, of the radius a thousandth.
    assert joined((one, FlowHandle(same.start, same.start + [0, 1.0005, 0])), 1.0)[2].tolist() == [0, 0]
    assert joined((one, FlowHandle(same.start, same.start + [0, 1.0005, 0])), 0.2)[2].tolist() == [0, 0, 1]
    for away in ([0, 1.01, 0], [0, -1, 0], [0.002, 1, 0]):
        with pytest.raises(HandleError, match="one and other"):
            joined((one, FlowHandle(same.start, same.start + away, name="other")), 1.0)
        # What has no name is told by its number.
        with pytest.raises(HandleError, match="one and number 1"):
            joined((one, FlowHandle(same.start, same.start + away)), 1.0)
    far = FlowHandle(one.start[:1] + 2e-3, one.start[:1] - 1)
    assert len(joined((one, far), 1.0)[0]) == 3


class Turning:
    """A field that turns points about the axis with a speed."""

    def __init__(self, speed):
        self.speed = speed

    def __call__(self, points):
        return self.speed * np.stack([-points[:, 1], points[:, 0], 0 * points[:, 0]], axis=1)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_steps_of_time_are_as_exact_as_was_asked_and_no_shorter(tolerance):
    points = np.array([[1.0, 0, 0], [0, -2, 1]])
    speeds = [1.0, 4.0]
    plan = integration.planned_steps(lambda j, t: Turning(speeds[j]), np.array([0.0, 0.3, 1.0]), points, tolerance)
    assert [sum(s.length for s in steps) for steps in plan] == pytest.approx([0.3, 0.7])
    # No step is much shorter than the one beside it.
    for steps in plan:
        length = np.array([s.length for s in steps])
        assert length.max() < 5 * length.min()
    end = integration.carried(points, [s for steps in plan for s in steps])
    angle = 0.3 * 1 + 0.7 * 4
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    error = np.abs(end - points @ turn.T).max()
    assert error < 3 * tolerance
    # Of the fourth order: ten thousand times as exact takes about ten times as many, not a hundred.
    assert len(plan[0]) + len(plan[1]) < 4 + 2.2 * tolerance**-0.25


def test_a_step_is_that_of_runge_and_kutta():
    fields = tuple(Turning(s) for s in (1.0, 2.0, 5.0))
    p, h = np.array([[1.0, 0.5, 0.2]]), 0.4
    a = fields[0](p)
    b = fields[1](p + h / 2 * a)
    c = fields[1](p + h / 2 * b)
    d = fields[2](p + h * c)
    np.testing.assert_allclose(integration.FlowStep(h, fields)(p), p + h * (a + 2 * b + 2 * c + d) / 6)


def test_volumes_of_parts():
    V = np.concatenate([CUBE * [2, 3, 4] + 5, CUBE + 20, CUBE * 0.5 - 9, [[0, 0, 0]]])
    F = np.concatenate([SIDES, SIDES[:, ::-1] + 8, SIDES[:-1] + 16])
    parts = EnclosedParts.of(F, len(V))
    volumes, part = component_volumes(V, F)
    assert [volumes[part[v]] for v in (0, 8)] == pytest.approx([24, -1])
    assert [parts.closed[part[v]] for v in (0, 8, 16, 24)] == [True, True, False, False]
    assert corner_volumes(CUBE, SIDES).sum() == pytest.approx(6)
    # Edges of three faces, and faces that look different ways, close nothing.
    assert not closed_parts(np.concatenate([SIDES, SIDES[:1]]), np.zeros(8, int))[0]
    assert not closed_parts(np.concatenate([SIDES[:1, ::-1], SIDES[1:]]), np.zeros(8, int))[0]
    normal, rng = vertex_normals(CUBE, SIDES), np.random.default_rng(0)
    for _ in range(4):
        way = rng.normal(size=CUBE.shape)
        ahead, back = (corner_volumes(CUBE + s * 1e-6 * way, SIDES).sum() / 6 for s in (1, -1))
        assert (ahead - back) / 2e-6 == pytest.approx((normal * way).sum())
    free = np.arange(len(V)) != 3
    after = V * 1.05 + 0.01 * rng.normal(size=V.shape)
    found, left = restore_volumes(V, after, parts, free)
    assert component_volumes(found, F)[0][parts.closed] == pytest.approx(volumes[parts.closed], rel=1e-12)
    assert np.abs(left).max() < 1e-12
    np.testing.assert_array_equal(found[3], after[3])
    np.testing.assert_array_equal(found[16:], after[16:])
    moved = np.linalg.norm(found - after, axis=1)
    assert np.ptp(np.delete(moved[:8], 3)) < 1e-3 * moved[:8].max() + 1e-9


def test_means_are_those_of_the_neighbours():
    V, F = icosphere(1)
    V, F = np.concatenate([V, [[9.0, 9, 9]]]), F[:-3]
    found = _means(F, len(V)) @ V
    for v in range(len(V)):
        near = sorted(set(F[(v == F).any(axis=1)].ravel()) - {v})
        np.testing.assert_allclose(found[v], V[near].mean(axis=0) if near else 0, atol=1e-12)


def test_the_closest_passing_by_hand():
    """Two points that meet half way, a tenth apart, each going 2."""
    path = np.array([[[-1.0, 0.05, 0], [1, -0.05, 0]], [[1.0, 0.05, 0], [-1, -0.05, 0]]])
    found = closest_passing(path, np.array([0, 1]), 0.3)
    apart = np.hypot(2 / 32, 0.1)
    assert found.handles == (0, 1) and found.distance == pytest.approx(apart, rel=1e-6)
    assert found.strength == pytest.approx(4 * 0.3 / 2 / apart)
    other = closest_passing(path[:, ::-1], np.array([1, 0]), 0.6)
    assert other.strength == pytest.approx(2 * found.strength) and other.handles == (0, 1)
    # One handle contradicts nothing, whatever its points do.
    assert closest_passing(path, np.array([0, 0]), 0.3) == Passing(0.0, (-1, -1), 0.0)
    assert [Passing(s, (0, 1), 1.0).near for s in (2, 3, 4.5, 6, 9)] == pytest.approx([0, 0, 0.1, 0.2, 0.2])
    none = np.zeros((0, 2), int)
    assert Passing(2.0, (0, 1), 0.1).warning(["a", "b"], 2.0, none) == ()
    for surge, strength, pairs in ((3.5, 1.0, none), (2.0, 4.0, np.array([[0, 1]]))):
        (text,) = Passing(strength, (0, 1), 0.1).warning(["a", "b"], surge, pairs)
        assert text.startswith("a and b are 10 % of the diagonal apart") and f"{surge:.2g} times" in text
    assert Passing(2.0, (0, 1), 0.1).warning(["a", "b"], 2.0, np.array([[0, 1]])) == ()
    assert Passing(9.0, (-1, -1), 0.1).warning([], 9.0, np.array([[0, 1]])) == ()


@pytest.mark.parametrize("chords", [1, 2, 3, 16])
def test_a_passing_is_the_same_however_many_chords_the_ways_are_told_in(chords):
    begin = np.array([[0.0, 0, 0], [0.3, 0.2, 0], [-1, 0.3, 0.1]])
    way = np.array([[1.0, 0.1, 0], [-0.5, 0, 0], [2, 0, 0]])
    time = np.linspace(0, 1, chords + 1)[:, None, None]
    owner = np.array([0, 1, 2])
    found, plain = (closest_passing(begin + t * way, owner, 0.3) for t in (time, time[[0, -1]]))
    assert found.handles == plain.handles
    assert (found.strength, found.distance) == pytest.approx((plain.strength, plain.distance), rel=1e-9)


def test_the_surge_is_that_of_what_flows_along_at_the_places_that_it_comes_to():
    """Of steps whose field takes everything to the right, and is faster the farther to the right."""

    def field(points):
        return np.array([1.0, 0, 0]) * (1 + points[:, :1])

    steps = [integration.FlowStep(0.25, (field,) * 3) for _ in range(4)]
    path = np.array([[[0.0, 0, 0]], [[2.0, 0, 0]]])
    # At x after a time t, 1 + x is exp(t) times what it was.
    assert greatest_surge(path, steps, np.zeros((1, 3))) == pytest.approx(np.exp(0.75) / 2, rel=1e-3)


def test_the_surge_is_the_speed_over_that_of_the_handles():
    steps = [integration.FlowStep(0.5, (Turning(k),) * 3) for k in (1.0, 6.0)]
    path = np.array([[[0.0, 0, 0]], [[1.0, 0, 0]], [[1.0, 4, 0]]])
    probes = np.array([[3.0, 0, 0], [0, 1, 0]])
    # Speeds 3 and 18, of handles 2 and 8.
    assert greatest_surge(path, steps, probes) == pytest.approx(18 / 8, rel=1e-2)
    assert greatest_surge(path[:2], steps[:1], probes) == pytest.approx(3)


@pytest.mark.parametrize("kind", ["straight", "radius", "blend", "rigid"])
def test_ways_half_way(kind):
    middle, reach = np.array([1.0, 0, 0]), 4.0
    start = middle + np.array([[2.0, 0, 0], [0, 0, 3.0]])
    end = middle + np.array([[0.0, 4, 0], [0, 0, 1.0]])
    path = handle_paths(start, end, np.array([0, 1]), kind, 2, middle, reach)
    assert path.shape == (3, 2, 3)
    np.testing.assert_array_equal(path[[0, 2]], [start, end])
    straight = (start + end) / 2
    turned = middle + np.array([[3 / 2**0.5, 3 / 2**0.5, 0], [0, 0, 2.0]])
    expected = {"straight": straight, "rigid": straight, "radius": turned}
    weight = np.array([[3 / 4], [2 / 4]])
    expected["blend"] = (1 - weight) * straight + weight * turned
    np.testing.assert_allclose(path[1], expected[kind], atol=1e-12)


def test_the_rotation_between_points_is_the_one_that_turned_them():
    rng = np.random.default_rng(0)
    for d in (2, 3):
        R = np.linalg.qr(rng.normal(size=(d, d)))[0]
        R[0] *= np.linalg.det(R)
        points = rng.normal(size=(6, d))
        np.testing.assert_allclose(rotation_between(points, 2 * points @ R.T + 7), R, atol=1e-12)


class Gust:
    """A steady stream along x that blows across where it is at `place`."""

    def __init__(self, place, width):
        self.place, self.width = place, width

    def __call__(self, points):
        across = np.exp(-(((points[:, 0] - self.place) / self.width) ** 2))
        return np.stack([np.ones(len(points)), across, 0 * across], axis=1)


@pytest.mark.parametrize("place", [0.4, 3.0, 7.5])
@pytest.mark.parametrize("width", [0.2, 1.0])
def test_steps_are_as_exact_wherever_the_probes_come_by_on_their_way(place, width):
    """What is farther on is met where the probes are then, and not where they were: steps are planned along the way,
    and those of one stretch are those from where the stretch before has brought them."""
    start, knots, tolerance = np.array([[0.0, 0, 0], [0.3, 1, 0]]), np.array([0.0, 2.0, 5.0, 8.0]), 1e-5
    plan = integration.planned_steps(lambda j, t: Gust(place, width), knots, start, tolerance)
    points = start
    for time, steps in zip(knots[1:], plan, strict=True):
        points = integration.carried(points, steps)
        assert points[:, 0] == pytest.approx(start[:, 0] + time)
    whole = [special.erf((x - place) / width) for x in (start[:, 0], start[:, 0] + 8)]
    across = start[:, 1] + width * np.sqrt(np.pi) / 2 * (whole[1] - whole[0])
    assert np.abs(points[:, 1] - across).max() < 3 * 8 * tolerance


@pytest.mark.parametrize("power", [1, 3, 6])
def test_every_step_has_the_fields_of_its_own_time(power):
    """Where all points go alike at any moment, the way is the integral of their speed, which steps of the fourth order
    have to the last digit as long as that is a cubic. Each step begins where the one before ends."""
    knots = np.array([0.0, 0.7, 2.0])
    asked = []

    class Wind:
        def __init__(self, time):
            self.time = time
            asked.append(time)

        def __call__(self, points):
            return self.time**power * np.ones_like(points)

    plan = integration.planned_steps(lambda j, time: Wind(time), knots, np.zeros((2, 3)), 1e-6)
    at = 0.0
    for steps, end in zip(plan, knots[1:], strict=True):
        for step in steps:
            times = [field.time for field in step.fields]
            assert times == pytest.approx([at, at + step.length / 2, at + step.length], abs=1e-12)
            at += step.length
        assert at == pytest.approx(end)
    found = integration.carried(np.zeros((2, 3)), [step for steps in plan for step in steps])
    assert found == pytest.approx(2 ** (power + 1) / (power + 1), abs=1e-12 if power <= 3 else 1e-5)
