"""Which steps descents take, and when they end, with energies and crossings written in advance: cages of subdivided
surfaces, folds on the sphere, bodies that flow."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import EmptyMeshError, HandleError, NonFiniteError
from omt_uv.solver.flows import flow_map
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.progress import Progress, drain
from omt_uv.solver.sphere import untangle
from omt_uv.solver.subdivision import cage_refinement as cages

# ---- cages --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Problem:
    """Energies and least determinants that are known in advance, by how often w was moved."""

    energies: tuple
    dets_: tuple = (1.0,)
    counted: np.ndarray = field(default_factory=lambda: np.ones(4, bool))
    barriers: tuple = ()
    unknowns: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))
    elements: object = field(default_factory=lambda: SimpleNamespace(quads=np.zeros((2, 4))))

    def at(self, values, w):
        return values[min(round(float(w[0].real)), len(values) - 1)]

    def energy(self, w, eps=0.0):
        return self.at(self.energies, w)

    def dets(self, w):
        return np.full(int(self.counted.sum()), self.at(self.dets_, w))


@pytest.fixture
def descended(monkeypatch):
    """The map of a cage after steps that lower its energy as is written; what was searched with."""

    def run(problem, *, decrease=5.0, crossing=(), stop=None, outlines=("loop",)):
        asked, rest = [], list(crossing)

        def searched(problem, w, eps, before):
            asked.append((eps, before, len(problem.barriers), problem.counted.tolist()))
            return (None if stop == len(asked) else w + 1), decrease

        monkeypatch.setattr(cages, "_searched", searched)
        monkeypatch.setattr(cages, "crossings", lambda w, loop: [1] if (rest.pop(0) if rest else False) else [])
        monkeypatch.setattr(cages, "_drawn_in", lambda problem, w, loops, strength, before: w + 0.25j)
        monkeypatch.setattr(cages, "make_barrier", lambda w, loop, strength: ("barrier", loop, strength))
        of_cage = np.array([False, False, False, True])
        found = drain(cages._descended(problem, np.zeros(2, complex), of_cage, outlines))
        return found, asked

    return run


def test_a_cage_is_refined_until_next_to_nothing_is_promised(descended):
    found, asked = descended(Problem((9.0, 8.0, 7.0)), decrease=0.999 * 1e-4 * 9.0)
    assert found.iterations == 1 and found.uv.tolist() == [[1, 0], [1, 0]] and found.folds == 0
    assert asked == [(0.0, 9.0, 0, [True] * 4)]
    assert descended(Problem((9.0, 8.0, 7.0)), decrease=0.999 * 1e-4 * 9.0, stop=1)[0].iterations == 0
    steps = descended(Problem(tuple(100.0 - k for k in range(99))), stop=9)
    assert steps[0].iterations == 8 and [a[1] for a in steps[1]] == [100.0 - k for k in range(9)]
    assert descended(Problem((9.0,), unknowns=np.zeros((2, 0))))[0].iterations == 0


def test_while_something_is_folded_it_goes_on_with_a_softer_energy(descended):
    folded = Problem((9.0, 8.0, 7.0, 6.0), dets_=(-2.0, -1.0, 0.5))
    found, asked = descended(folded, decrease=0.0)
    eps = [float(np.hypot(1e-3, 0.2 * d)) for d in (2.0, 1.0)]
    assert [a[0] for a in asked] == pytest.approx([*eps, 0.0]) and found.iterations == 3 and found.folds == 0
    assert descended(Problem((9.0,), dets_=(-1.0,)), stop=1)[0].folds == 4


def test_it_ends_where_the_last_steps_lowered_little(descended):
    energies = tuple(9.0 - 1e-9 * k for k in range(200))
    found, _ = descended(Problem(energies))
    assert found.iterations == 5
    # Not while they lower enough.
    assert descended(Problem(tuple(9.0 * (1 - 2 * 0.02) ** k for k in range(200))), stop=9)[0].iterations == 8


def test_triangles_that_stay_folded_for_long_do_not_count_where_they_are_spare(descended):
    energies = tuple(1000.0 - k for k in range(200))
    found, asked = descended(Problem(energies, dets_=(-1.0,)), stop=15)
    assert [a[3] for a in asked[:12]] == [[True] * 4] * 12
    # The second triangulation of a quad, and the cage's own.
    assert asked[12][3] == [True, True, False, False] and found.iterations == 14


def test_an_outline_that_would_cross_itself_gets_a_barrier_and_the_step_is_not_taken(descended):
    # At first none crosses; the second step would.
    found, asked = descended(Problem(tuple(100.0 - k for k in range(99))), crossing=[False, False, True], stop=4)
    assert [a[2] for a in asked] == [0, 0, 1, 1] and [a[1] for a in asked] == [100, 99, 99, 98]
    # Drawn in a little each time.
    assert found.uv[0].tolist() == [2.0, 0.25] and found.iterations == 3
    # One that crosses from the first is not watched.
    found, asked = descended(Problem(tuple(100.0 - k for k in range(99))), crossing=[True, True, True], stop=4)
    assert [a[2] for a in asked] == [0] * 4


@pytest.mark.parametrize(
    ("energies", "size", "moved"), [((9, 1), 1.0, 1.0), ((9, 8.9999999), 1.0, None), ((9,), 1.0, None)]
)
def test_steps_are_halved_until_they_lower_what_they_promise(energies, size, moved):
    class Plain:
        asked = []

        def newton(self, w, eps):
            return np.ones(1), 4.0

        def bounded(self, w, step):
            return size

        def energy(self, w, eps):
            self.asked.append(float(w[0]))
            return energies[1] if len(energies) > 1 and w[0] >= 1 else 9.0

    problem = Plain()
    problem.asked = []
    found, promised = cages._searched(problem, np.zeros(1), 0.0, 9.0)
    assert promised == 4.0 and (found is None) == (moved is None)
    want = [1.0] if moved else [0.5**k for k in range(30)]
    assert problem.asked == pytest.approx(want)


@pytest.mark.parametrize(
    ("energy", "folds", "crosses", "share"),
    [(5.0, 0, 0, 1.0), (0.5, 0, 0, 0.0), (5.0, 1, 0, 0.5), (5.0, 0, 2, 0.25), (5.0, 99, 0, 0.0)],
)
def test_outlines_are_drawn_in_where_their_barrier_would_be_more_than_all_else(
    energy, folds, crosses, share, monkeypatch
):
    square = np.array([0, 1, 1 + 1j, 1j, 0.5 + 0.5j])
    loop, tried = np.arange(4), []

    def dets(w):
        if np.array_equal(w, square):
            return np.array([1.0, 1.0])
        tried.append(w)
        return np.array([1.0, -1.0 if len(tried) <= folds else 1.0])

    monkeypatch.setattr(cages, "make_barrier", lambda *_: SimpleNamespace(energy=lambda w: energy))
    monkeypatch.setattr(cages, "crossings", lambda w, loop: [1] if len(tried) <= crosses else [])
    found = cages._drawn_in(SimpleNamespace(dets=dets), square, [loop], 1.0, 1.0)
    # Every corner goes along the mean of its sides' normals, by half of the shorter one.
    inwards = 0.5j * np.array([1 - 1j, 1 + 1j, -1 + 1j, -1 - 1j])
    assert found[:4] - square[:4] == pytest.approx(share * 0.02 * inwards) and found[4] == square[4]


# ---- folds on the sphere ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("folds", "works", "steps", "shares"),
    [
        ([0], [], 0, 0),
        ([4, 2, 0], [1, 1], 2, 2),
        ([1, 3, 0], [1, 1], 2, 2),
        ([1, 4, 0], [1, 1], 1, 1),
        ([4, 2, 0], [2, 1], 2, 3),
        ([4, 2], [1, 0], 1, None),
    ],
)
def test_folds_are_taken_out_until_none_is_left_or_they_spread(folds, works, steps, shares, monkeypatch):
    V, F = meshes.icosphere(0)
    tried, left = [], list(works)

    def step(faces, assembly, positions, fixed, share):
        tried.append(share)
        if not left or left[0] == 0:
            return None
        left[0] -= 1
        if left[0]:
            return None
        left.pop(0)
        return positions + 1

    count = lambda positions: folds[min(round(float(positions[0, 0] - V[0, 0])), len(folds) - 1)]  # noqa: E731
    monkeypatch.setattr(untangle, "_step", step)
    monkeypatch.setattr(
        untangle,
        "signed_volumes",
        lambda positions, triangles: np.where(np.arange(len(F)) < count(positions), -1.0, 1.0),
    )
    from omt_uv.solver.maps.energy import elements
    from omt_uv.solver.mesh.geometry import face_areas

    faces = elements(V, F, face_areas(V, F))
    positions, taken = drain(untangle.untangle_on_sphere(faces, None, V))
    assert taken == steps and round(float((positions - V)[0, 0])) == steps
    assert len(tried) == (len(untangle.EPS_SHARES) + 1 if shares is None else shares)


# ---- flows --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("points", "handles", "options", "error", "said"),
    [
        (np.zeros((0, 3)), ["h"], {}, EmptyMeshError, "no vertices"),
        (np.array([[0, 0, np.nan]]), ["h"], {}, NonFiniteError, "finite"),
        (np.zeros((2, 3)), ["h"], {}, EmptyMeshError, "at one place"),
        (np.eye(3), [], {}, HandleError, "no handle"),
        (np.eye(3), ["h"], {"radius": 0.0}, ValueError, "positive"),
        (np.eye(3), ["h"], {"radius": np.inf}, ValueError, "positive"),
        (np.eye(3), ["h"], {"tolerance": 0.0}, ValueError, "positive"),
    ],
)
def test_flows_need_something_to_move_and_somewhere_to_go(points, handles, options, error, said):
    with pytest.raises(error, match=said) as caught:
        flow_map._checked(points, handles, FlowOptions(**options))
    if error is NonFiniteError:
        assert caught.value.elements.tolist() == [0]


@pytest.mark.parametrize("given", [None, 7.0])
def test_lengths_of_a_flow_are_in_units_of_the_diagonal(given):
    points = np.array([[0, 0, 0], [3, 4, 12.0], [1, 1, 1]])
    assert flow_map._checked(points, ["h"], FlowOptions(**({} if given is None else {"diagonal": given}))) == (
        given or 13.0
    )


@dataclass
class Frame:
    positions: np.ndarray
    pairs: np.ndarray
    mended: np.ndarray


@pytest.mark.parametrize("mend", [True, False])
@pytest.mark.parametrize("where", [1, 2], ids=["on the way", "at the end"])
@pytest.mark.parametrize("meeting", [0, 2])
def test_frames_whose_faces_meet_are_taken_apart_where_that_is_asked_for(meeting, where, mend, monkeypatch):
    frames = [np.full((3, 3), float(k)) for k in (1, 2)]
    none = np.zeros((0, 2), int)
    shape = SimpleNamespace(
        changes=lambda at: np.array([at[0, 0] / 10]),
        sound=lambda at, mend: Frame(at + 0.5, np.ones((meeting, 2), int) if at[0, 0] == where else none, None),
    )
    apart = [Frame(frames[0], none, None), Frame(frames[1] + 9, none, None)]

    def apart_on_the_way(found, shape, journey):
        return apart
        yield

    monkeypatch.setattr(flow_map, "_apart_on_the_way", apart_on_the_way)
    found = drain(flow_map._sound(frames, shape, SimpleNamespace(options=SimpleNamespace(mend=mend))))
    taken = mend and meeting > 0
    assert np.array_equal(found.positions, frames[1] + (9 if taken else 0.5)) and len(found.frames) == 2
    assert found.drift.tolist() == [0.2] and found.volumes.tolist() == [(11 if taken else 2.5) / 10]
    assert len(found.intersecting) == (0 if taken or where == 1 else meeting)


@pytest.mark.parametrize("fewer", [True, False])
@pytest.mark.parametrize("beyond", [0, 1])
def test_what_meets_goes_by_pieces_of_the_way_around_it(beyond, fewer, monkeypatch):
    """Of the first frame in which faces meet on, those with fewer pairs than before are taken; what comes into faces
    beyond its region needs a larger one."""
    triangles = np.array([[0, 1, 2], [2, 1, 3], [4, 5, 6]])
    none, pair, far = np.zeros((0, 2), int), np.array([[0, 1]]), np.array([[0, 2]])
    found = [Frame(np.zeros((7, 3)), p, np.zeros(7, bool)) for p in (none, pair, np.concatenate([pair, pair]))]
    asked, marched = [], []

    @dataclass
    class Region:
        rows: np.ndarray
        free: np.ndarray

    def regions(move, faces, pairs, mended, free):
        asked.append(len(pairs))
        return [
            Region(
                np.arange(4 if len(asked) == 1 else 7), np.array([True] * 3 + [False] * (1 if len(asked) == 1 else 4))
            )
        ]

    def march(region, plan, domain):
        marched.append((len(region.rows), len(plan)))
        yield Progress("Flow", 0.0)
        return [np.full((len(region.rows), 3), float(k + 1)) for k in range(len(plan))]

    def settled(position, regions):
        left = far if beyond and len(asked) == 1 else none if fewer else np.concatenate([pair] * 3)
        return Frame(position, left, None)

    monkeypatch.setattr(flow_map, "regions_around", regions)
    monkeypatch.setattr(flow_map, "march", march)
    shape = SimpleNamespace(triangles=triangles, free=None, settled=settled)
    journey = SimpleNamespace(
        everything=np.zeros((9, 3)),
        count=7,
        size=2.0,
        plan=lambda count: (["step"] * count, 0.0),
        way=SimpleNamespace(domain=None),
    )
    result = drain(flow_map._apart_on_the_way(found, shape, journey))
    pieces = -(-flow_map.PIECES // 3)
    rounds = 1 + beyond
    assert result[0] is found[0] and marched[0] == (4, 3 * pieces) and len(marched) == len(asked) == rounds
    # Pairs of all frames from the first on, and those that came from beyond in both.
    assert asked == [3, 5][:rounds]
    for k in (1, 2):
        if fewer:
            at = 2.0 * (k + 1) * pieces
            assert result[k].positions[:3].tolist() == [[at] * 3] * 3 and not result[k].positions[3:].any()
        elif beyond and k == 2:
            assert len(result[k].pairs) == 1
        else:
            assert result[k] is found[k]
