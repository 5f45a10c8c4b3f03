"""Which ways a match of two surfaces takes, with its steps written in advance: starts, landmarks that are met, and what
is polished again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.solver.progress import drain
from omt_uv.solver.registration import coarse_start, landmark_flow, register
from omt_uv.solver.registration.coarse_start import _Trial
from omt_uv.solver.registration.landmark_flow import Drawn

V, F = meshes.icosphere(0)


class Placed(SimpleNamespace):
    """Places that keep what is put where."""

    def put(self, vertices, targets, rows):
        self.holds = (vertices.tolist(), rows.tolist())


# ---- polishing ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("polish", [True, False])
@pytest.mark.parametrize("met", [[True, True, True], [True, False, True], [False, False, False]])
def test_what_had_no_room_is_put_into_its_place_and_polished_again(met, polish, monkeypatch):
    calls, met = [], np.array(met)
    problem = SimpleNamespace(held=np.zeros(12, bool))

    def minimise(problem, placed, steps, tolerance, name):
        calls.append((np.flatnonzero(problem.held).tolist(), steps))
        return done((placed + 1 if isinstance(placed, int) else 5, 10 * len(calls)), 0.0, 1.0)

    def put(problem, placed, vertices, targets):
        calls.append(("put", vertices.tolist(), targets))
        return 50, None

    monkeypatch.setattr(register, "deformation", lambda *_: problem)
    monkeypatch.setattr(register, "minimise_on", minimise)
    monkeypatch.setattr(register, "put_landmarks", put)
    placed = Placed()
    carrier = SimpleNamespace(place=lambda domain: placed)
    pair = SimpleNamespace(landmarks=np.array([7, 3, 9]), vertices=V, triangles=F)
    case = SimpleNamespace(pair=pair, carrier=carrier, targets="targets", features=None)
    drawn = Drawn(SimpleNamespace(domain=V), met, 4)
    (found, steps), fractions = told(register._polished(case, drawn, polish))
    own = pair.landmarks[met].tolist()
    assert placed.holds == (own, met.tolist())
    if not polish:
        assert found is placed and steps == 0 and not calls
        return
    assert calls[0] == (sorted(own), 60)
    if met.all():
        assert (found, steps) == (5, 10) and len(calls) == 1 and fractions == pytest.approx([0, 0.9])
    else:
        assert calls[1:] == [("put", [7, 3, 9], "targets"), ([3, 7, 9], 10)]
        assert (found, steps) == (51, 10 + 30)


@pytest.mark.parametrize("met", [[True, True, True], [True, False, True], [False, False, False]])
def test_of_a_coarse_start_only_what_had_no_room_is_put_into_its_place(met, monkeypatch):
    problem = SimpleNamespace(held=np.zeros(12, bool), energies=lambda placed: np.full(len(F), float(placed)))
    monkeypatch.setattr(coarse_start, "deformation", lambda *_: problem)
    monkeypatch.setattr(coarse_start, "on_coarse", lambda *_: None)
    monkeypatch.setattr(coarse_start, "minimise_on", lambda *_: done((3, 7), 0.0, 1.0))
    monkeypatch.setattr(coarse_start, "put_landmarks", lambda problem, placed, *where: (placed + 2, where))
    monkeypatch.setattr(coarse_start, "replace", lambda problem, within: SimpleNamespace(energy=lambda p: 10 * p))
    placed = Placed()
    carrier = SimpleNamespace(sliding=lambda loop: SimpleNamespace(place=lambda domain: placed))
    case = SimpleNamespace(pair=SimpleNamespace(vertices=V), carrier=carrier, targets="targets", features=None)
    mesh = coarse_start.FewVertices(np.arange(12), F, V, np.array([7, 3, 9]), None)
    met = np.array(met)
    trial = drain(coarse_start._polished(case, mesh, V, met))
    own = mesh.landmarks[met].tolist()
    assert placed.holds == (own, met.tolist()) and np.flatnonzero(problem.held).tolist() == sorted(own)
    if met.all():
        assert trial.placed == 3 and trial.met is met
    else:
        assert trial.placed == 5 and trial.met[0] is mesh.landmarks and trial.met[1] == "targets"
    assert trial.energy == 10 * trial.placed and trial.steps == 7
    area = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2
    each = trial.placed / (1 + trial.placed / (0.5 * area))
    assert trial.distortion == pytest.approx(each.sum())


@pytest.mark.parametrize("weight", [0.0, -1.0, 2.5])
def test_features_are_weighed_by_area_and_are_none_without_a_weight(weight):
    described = np.arange(48.0).reshape(12, 4), np.ones((5, 4))
    pair = SimpleNamespace(vertices=V * [1, 2, 3], triangles=F, described=described)
    found = register._features(pair, weight)
    if weight <= 0:
        assert found is None
        return
    area = np.zeros(12)
    for t in F:
        a, b, c = pair.vertices[t]
        area[t] += np.linalg.norm(np.cross(b - a, c - a)) / 6
    # The last function is for alignment alone.
    values = [np.asarray(x) for x in vars(found).values()]
    assert any(np.array_equal(x, described[0][:, :-1]) for x in values)
    assert any(np.array_equal(x, described[1][:, :-1]) for x in values)
    assert any(x.shape == (12,) and x == pytest.approx(weight * area / area.sum()) for x in values)


@pytest.mark.parametrize("domain", ["sphere", "disk"])
@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_maps_are_turned_by_pairs_or_by_what_is_alike(count, domain, monkeypatch):
    calls = []
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])

    def turned(name):
        def by(*words):
            calls.append(name)
            return SimpleNamespace(rotation=turn, error=0.25) if domain == "sphere" else (lambda z: 1j * z)

        return by

    for name in ("rotation_of_pairs", "rotation_by_search", "moebius_of_pairs", "turn_by_search"):
        monkeypatch.setattr(register, name, turned(name))
    monkeypatch.setattr(register, "check_handedness", lambda landmarks, points, places: calls.append(len(places)))
    pair = SimpleNamespace(
        domain="sphere" if domain == "sphere" else "disk",
        target=SimpleNamespace(triangles=F),
        targets=(np.zeros(count, int), np.full((count, 3), 1 / 3)),
        landmarks=np.arange(count),
        described=(None, None),
    )
    source = V if domain == "sphere" else V[:, :2]
    moved, error = register._aligned(pair, source, source, None)
    if domain == "sphere":
        assert calls == [count, "rotation_of_pairs" if count >= 2 else "rotation_by_search"]
        assert moved == pytest.approx(V @ turn.T) and error == 0.25
    else:
        assert calls == ["moebius_of_pairs" if count else "turn_by_search"] and error == 0
        assert moved == pytest.approx(np.column_stack([-source[:, 1], source[:, 0]]))


@pytest.mark.parametrize("mirrored", [True, False])
@pytest.mark.parametrize("known", [(True, True), (True, False), (False, True), (False, False)])
def test_maps_that_are_known_are_taken_with_landmarks_added(known, mirrored, monkeypatch):
    made = []

    def domain_map(surface, domain, balance):
        made.append((len(surface.vertices), balance))
        return done(9 * surface.vertices, 0.0, 1.0)

    monkeypatch.setattr(register, "domain_map", domain_map)
    # A landmark amid a face, and one that is a vertex.
    split = np.concatenate([V, V[F[4]].mean(axis=0, keepdims=True)])

    from dataclasses import dataclass

    @dataclass
    class Surface:
        vertices: np.ndarray
        triangles: np.ndarray

    pair = SimpleNamespace(
        source=Surface(V, F),
        target=Surface(2 * V, F),
        split=SimpleNamespace(vertices=split, triangles=F, landmarks=np.array([3, 12])),
        domain=register.SPHERE,
    )
    landmarks = SimpleNamespace(
        source_faces=np.array([0, 4]), source_barycentric=np.array([[1, 0, 0], [0.2, 0.3, 0.5]])
    )
    options = SimpleNamespace(balance=0.25, mirrored=mirrored)
    maps = tuple(V if k else None for k in known)
    source, target = drain(register._domain_maps(pair, landmarks, options, maps))
    assert made == [(n, 0.25) for n, k in zip((13, 12), known, strict=True) if not k]
    if known[0]:
        sign = np.array([-1 if mirrored else 1, 1, 1])
        inside = [0.2, 0.3, 0.5] @ V[F[4]] * sign
        assert source == pytest.approx(np.concatenate([V * sign, [inside / np.linalg.norm(inside)]]))
    else:
        assert source == pytest.approx(9 * split)
    assert target == pytest.approx(V if known[1] else 18 * V)
    with pytest.raises(ValueError, match="the map of the target has 11 rows, and its surface 12"):
        drain(register._domain_maps(pair, landmarks, options, (None, V[:11])))


def test_points_on_fillings_go_to_the_nearest_of_the_surface():
    vertices, triangles = meshes.grid(2, 1)
    filled = np.concatenate([vertices, [[0.5, 2.0, 0]]])
    surface = SimpleNamespace(count=4, vertices=filled, triangles=np.concatenate([triangles, [[4, 3, 6]]]))
    found = register._on(surface, np.array([1, 4]), np.array([[0.2, 0.3, 0.5], [0.1, 0.1, 0.8]]))
    assert found.beside.tolist() == [False, True] and found.faces[0] == 1
    assert found.barycentric[0].tolist() == [0.2, 0.3, 0.5]
    at = np.einsum("kc,kcd->kd", found.barycentric, filled[surface.triangles[found.faces]])
    given = [0.1, 0.1, 0.8] @ filled[[4, 3, 6]]
    assert at[1] == pytest.approx([given[0], 1.0, 0]) and found.faces[1] < 4


# ---- starts -------------------------------------------------------------------------------------------------


def trial(missed=0, distortion=1.0, energy=9.0, steps=1):
    met = np.arange(3) >= missed
    return _Trial(SimpleNamespace(domain=V), met, energy, distortion, steps)


@pytest.fixture
def improved(monkeypatch):
    """Trials that are written: what was begun from where, in turn."""

    def run(best, trials, straight=True):
        calls, rest = [], iter(trials)
        monkeypatch.setattr(coarse_start, "_corresponding", lambda case, mesh, start: done(1 * V, 0.0, 1.0))
        folded = V.copy()
        folded[F[0, 0]] = -V[F[0, 0]]

        def straighten(domain, triangles, places, held):
            calls.append(("straight", np.flatnonzero(held).tolist()))
            return done(V if straight else folded)

        def guided(case, mesh, begun, guide, widths):
            calls.append(("guided", round(float(np.linalg.norm(begun[0][0]))), begun[1].tolist(), widths))
            return done(begun[0])

        monkeypatch.setattr(coarse_start, "straightened", straighten)
        monkeypatch.setattr(coarse_start, "_relaxed", lambda *_: done(3 * V))
        monkeypatch.setattr(coarse_start, "_guided", guided)
        monkeypatch.setattr(coarse_start, "_polished", lambda case, mesh, domain, met: done(next(rest)))
        carrier = SimpleNamespace(place=lambda places: SimpleNamespace(positions=places))
        mesh = SimpleNamespace(landmarks=np.array([2, 5, 7]), triangles=F, domain=V)
        flow = Drawn(SimpleNamespace(domain=2 * V), np.array([True, False, True]), 6)
        found, fractions = told(coarse_start._improved(SimpleNamespace(carrier=carrier), mesh, flow, best))
        # Each round begins with functional maps.
        count = 2
        assert fractions == pytest.approx([(k // 2 + 0.3 * (k % 2)) / count for k in range(len(fractions))])
        return found, calls

    return run


def test_what_is_good_is_not_improved(improved):
    good = trial(energy=0.99 * 0.04)
    assert improved(good, []) == (good, [])
    # Unless a landmark is not met.
    assert improved(trial(1, energy=0.0), [trial(1, 1.0)] * 3)[1]
    assert improved(trial(energy=1.01 * 0.04), [trial(0, 2.0)] * 3)[1]


def test_starts_are_that_of_the_flow_and_what_functional_maps_say(improved):
    best = trial()
    found, calls = improved(best, [trial(0, 2.0)] * 3)
    assert found is best and calls[0] == ("straight", [2, 5, 7])
    every = [True] * 3
    assert calls[1:] == [
        ("guided", 2, [True, False, True], coarse_start.FAR),
        ("guided", 1, every, coarse_start.NEAR),
        ("guided", 3, every, coarse_start.NEAR),
    ]
    # What stays folded is no start.
    assert len(improved(best, [trial(0, 2.0)], straight=False)[1]) == 2


def test_the_best_meets_the_most_landmarks_and_of_those_has_the_least_distortion(improved):
    best = trial(1, 1.0, steps=10)
    tried = [trial(2, 0.1), trial(0, 5.0, energy=0.0, steps=3), trial(0, 6.0)]
    found, calls = improved(best, tried)
    assert (found.distortion, found.steps) == (5.0, 13) and len(calls) == 4
    # As long as that helps it goes on from there.
    rounds = [[trial(0, 0.9 - 0.1 * k), trial(0, 2.0), trial(0, 2.0)] for k in range(2)]
    found, calls = improved(trial(), [t for r in rounds for t in r])
    assert found.distortion == pytest.approx(1.0 - 0.1 * 2)
    assert len(calls) == 4 * 2


@pytest.mark.parametrize("sphere", [True, False])
@pytest.mark.parametrize(("count", "coarse"), [(19, False), (20, True)])
def test_large_surfaces_begin_on_a_coarse_mesh(count, coarse, sphere, monkeypatch):
    calls = []
    mesh = SimpleNamespace(carried=lambda places, aligned: ("carried", places), name="coarse")
    whole = SimpleNamespace(carried=lambda places, aligned: ("whole", places), name="whole")
    monkeypatch.setattr(coarse_start, "COARSE", 10)
    monkeypatch.setattr(coarse_start, "_whole", lambda case: whole)
    monkeypatch.setattr(coarse_start, "coarse_mesh", lambda *words: mesh if words[4] == 10 else None)
    monkeypatch.setattr(
        coarse_start,
        "_flowed",
        lambda case, m: (calls.append(m.name), done(Drawn(SimpleNamespace(domain=V), "met", 6), 0.0, 1.0))[1],
    )
    polished = _Trial(SimpleNamespace(domain="polished"), "met", 1.0, 1.0, 2)
    better = _Trial(SimpleNamespace(domain="better"), "met", 1.0, 1.0, 3)
    monkeypatch.setattr(coarse_start, "_polished", lambda *_: done(polished, 0.0, 1.0))
    monkeypatch.setattr(coarse_start, "_improved", lambda *_: done(better, 0.0, 1.0))
    monkeypatch.setattr(coarse_start, "_finished", lambda case, moved, met, steps: done((moved, met, steps)))
    pair = SimpleNamespace(
        vertices=np.zeros((count, 3)), domain="sphere" if sphere else "disk", landmarks=None, loop=None
    )
    case = SimpleNamespace(pair=pair, aligned=None)
    found, fractions = told(coarse_start._begun(case, coarse_start._few(case)))
    assert calls == ["coarse" if coarse else "whole"]
    assert found == (("carried" if coarse else "whole", "better" if sphere else "polished"), "met", 9 if sphere else 8)
    assert fractions == pytest.approx([0, 0.2, 0.2, 0.4] + [0.4, 0.8] * sphere)


@pytest.mark.parametrize(("landmarks", "met", "drawn"), [(0, True, False), (2, True, False), (2, False, True)])
def test_landmarks_that_are_not_there_at_the_end_are_drawn(landmarks, met, drawn, monkeypatch):
    calls = []
    monkeypatch.setattr(
        coarse_start, "straightened", lambda a, t, moved, held: (calls.append(held.sum()), done(moved, 0.0, 1.0))[1]
    )
    monkeypatch.setattr(coarse_start, "deformation", lambda *_: "problem")
    monkeypatch.setattr(coarse_start, "without_folds", lambda problem, before, placed: placed)
    monkeypatch.setattr(coarse_start, "put_landmarks", lambda *_: ("put", np.full(landmarks, met)))
    monkeypatch.setattr(
        coarse_start, "draw_landmarks", lambda *_: done(Drawn("drawn", np.ones(landmarks, bool), 5), 0.0, 1.0)
    )
    carrier = SimpleNamespace(place=lambda places: SimpleNamespace(positions=places))
    pair = SimpleNamespace(landmarks=np.arange(landmarks), loop=None, triangles=F)
    case = SimpleNamespace(pair=pair, aligned=V, domain_carrier=lambda loop: carrier, flat_targets=lambda: "flat")
    given = np.ones(landmarks, bool)
    found, fractions = told(coarse_start._finished(case, 2 * V, given, 30))
    assert fractions == pytest.approx([0.8, 0.9] + [0.9, 1.0] * drawn)
    assert calls == [landmarks] and found.steps == (35 if drawn else 30) and found.met.all() == True  # noqa: E712
    assert (found.placed if landmarks else "put") == ("drawn" if drawn else "put")
    assert landmarks or np.array_equal(found.placed.positions, 2 * V)


# ---- landmarks ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stuck", [False, True])
@pytest.mark.parametrize("way", [0.0, 0.05, 0.3])
def test_landmarks_go_in_strides_and_relax_after_each(way, stuck, monkeypatch):
    moves, relaxed = [], []
    n = len(V)

    class At(SimpleNamespace):
        pass

    placed, vertices = At(positions=V.copy()), np.array([3])
    targets = At(positions=V[[3]] + [way, 0, 0])

    def move(at, field):
        return At(positions=at.positions + (0 if stuck else field))

    def minimise(problem, at, steps, tolerance, name):
        relaxed.append((steps, np.flatnonzero(problem.held).tolist()))
        return done((at, 1))

    from dataclasses import dataclass

    @dataclass
    class Problem:
        held: np.ndarray
        carrier: object

    def field(positions, at, step):
        moves.append(float(np.linalg.norm(step)))
        found = np.ones((n, 3))
        found[at] = step
        return found

    monkeypatch.setattr(landmark_flow, "_field", field)
    monkeypatch.setattr(landmark_flow, "without_folds", lambda problem, before, after: after)
    monkeypatch.setattr(landmark_flow, "minimise_on", minimise)
    monkeypatch.setattr(landmark_flow, "put_landmarks", lambda *_: ("put", np.array([not stuck])))
    held = np.zeros(n, bool)
    held[8] = True
    found = drain(landmark_flow.draw_landmarks(Problem(held, SimpleNamespace(move=move)), placed, vertices, targets))
    count = min(max(int(np.ceil(way / 0.03)), 4), 80)
    if way == 0:
        assert moves == []
    elif not stuck:
        # Even strides, none longer than it may be, and there at the end.
        assert moves == pytest.approx([way / count] * count)
    else:
        even = [way / (count - k) for k in range(count)]
        assert moves == pytest.approx(even + [way] * 40)
    assert relaxed == [(2, [3, 8])] * len(moves) + [(20, [3, 8])]
    assert found.placed == "put" and found.steps == len(relaxed) and held.sum() == 1


# ---- coarse starts ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "coarse"), [(0, False), (-1, False), (1, True)])
@pytest.mark.parametrize("made", [True, False])
@pytest.mark.parametrize("domain", ["sphere", "disk"])
def test_large_sources_begin_with_few_vertices_and_spheres_are_improved(count, coarse, made, domain, monkeypatch):
    """Twice as many vertices as the coarse mesh has are large."""
    n = 2 * coarse_start.COARSE + min(count, 0)
    coarse = n >= 2 * coarse_start.COARSE
    asked = []
    few = SimpleNamespace(carried=lambda places, others: ("carried", places, others), name="few")
    whole = SimpleNamespace(carried=few.carried, name="whole")
    monkeypatch.setattr(coarse_start, "_whole", lambda case: whole)
    monkeypatch.setattr(coarse_start, "coarse_mesh", lambda *given: asked.append(given[-1]) or (few if made else None))
    flow = Drawn(SimpleNamespace(domain="flowed"), np.array([True]), 5)
    first = SimpleNamespace(placed=SimpleNamespace(domain="polished"), met="met", steps=7)
    better = SimpleNamespace(placed=SimpleNamespace(domain="improved"), met="all", steps=70)
    used = []
    monkeypatch.setattr(coarse_start, "_flowed", lambda case, mesh: used.append(mesh.name) or done(flow, 0.0, 1.0))
    monkeypatch.setattr(coarse_start, "_polished", lambda case, mesh, places, met: done(first, 0.0, 1.0))
    monkeypatch.setattr(coarse_start, "_improved", lambda case, mesh, flow, best: done(better, 0.0, 1.0))
    monkeypatch.setattr(coarse_start, "_finished", lambda case, moved, met, steps: done((moved, met, steps), 1.0))
    kind = coarse_start.SPHERE if domain == "sphere" else "disk"
    pair = SimpleNamespace(vertices=np.zeros((n, 3)), landmarks=None, loop=None, domain=kind)
    case = SimpleNamespace(pair=pair, aligned="aligned")
    found, fractions = told(coarse_start._begun(case, coarse_start._few(case)))
    assert used == (["few"] if coarse and made else ["whole"]) and asked == [coarse_start.COARSE] * coarse
    last = ("improved", "all", 75) if domain == "sphere" else ("polished", "met", 12)
    assert found == (("carried", last[0], "aligned"), *last[1:])
    assert fractions == pytest.approx([0, 0.2, 0.2, 0.4, *((0.4, 0.8) if domain == "sphere" else ()), 1])


@dataclass(frozen=True)
class Begun:
    """A case whose starts are counted: bent or not."""

    pair: SimpleNamespace
    carrier: SimpleNamespace
    bent: bool = False


# Of the plain start and the bent one: distortion, how far from functional maps, landmarks met; whether the latter wins.
STARTS = {
    "nearer": ((0.2, 0.4, 2), (0.3, 0.2, 2), True),
    "more distorted than nearer": ((0.2, 0.4, 2), (0.5, 0.2, 2), False),
    "fewer met": ((0.2, 0.4, 2), (0.1, 0.1, 1), False),
    "more met": ((0.2, 0.4, 1), (0.9, 0.9, 2), True),
    "good but not met": ((0.001, 0.4, 1), (0.9, 0.9, 2), True),
    "good": ((0.001, 0.4, 2), None, False),
}


@pytest.mark.parametrize("name", STARTS)
def test_of_a_start_and_of_one_that_was_bent_the_better_one_is_taken(name, monkeypatch):
    plain, other, bent_wins = STARTS[name]
    rows, asked = {False: plain, True: other}, []

    def begun(case, mesh):
        distortion, off, met = rows[case.bent]
        places = SimpleNamespace(domain=np.full((9, 3), off), distortion=distortion)
        return done(Drawn(places, np.arange(2) < met, 10 * (1 + case.bent)), 1.0)

    def bent(case, vertices, places):
        asked.append((vertices.tolist(), len(places)))
        return done(replace(case, bent=True), 1.0)

    monkeypatch.setattr(coarse_start, "_few", lambda case: SimpleNamespace(chosen=np.arange(3), domain="own"))
    monkeypatch.setattr(coarse_start, "_begun", begun)
    monkeypatch.setattr(coarse_start, "_distortion", lambda case, drawn: drawn.placed.distortion)
    monkeypatch.setattr(coarse_start, "_sampled", lambda *_: done((np.arange(5), np.zeros((5, 3))), 1.0))
    monkeypatch.setattr(coarse_start, "_bent", bent)
    carrier = SimpleNamespace(place=lambda places: SimpleNamespace(positions=places))
    case = Begun(SimpleNamespace(domain=coarse_start.SPHERE), carrier)
    found, fractions = told(coarse_start.coarse_start(case))
    assert found.placed.distortion == (other if bent_wins else plain)[0]
    assert found.steps == (10 if name == "good" else 30)
    assert asked == ([] if name == "good" else [([0, 1, 2], 3)])
    assert fractions == pytest.approx([0.4] if name == "good" else [0.4, 0.5, 0.6, 1.0])


@pytest.mark.parametrize("met", [[True, False], [True, True], [False, False]])
def test_guided_places_are_drawn_nearer_and_nearer(met, monkeypatch):
    asked = []

    def deformation(reference, triangles, carrier, features, domain):
        problem = SimpleNamespace(held=np.zeros(12, bool))
        asked.append((features, domain, problem))
        return problem

    class Put(Placed):
        pass

    made = []

    def place(domain):
        made.append(Put(domain=domain))
        return made[-1]

    def minimise(problem, placed, steps, tolerance, name):
        assert (steps, tolerance) == (30, 1e-3)
        return done((SimpleNamespace(domain=placed.domain + 1), 3), 0.0, 1.0)

    monkeypatch.setattr(coarse_start, "deformation", deformation)
    monkeypatch.setattr(coarse_start, "minimise_on", minimise)
    monkeypatch.setattr(coarse_start, "Features", lambda values, of_target, share: (values, of_target, share))
    carrier = SimpleNamespace(sliding=lambda loop: SimpleNamespace(place=place))
    target = SimpleNamespace(vertices=7 * V)
    pair = SimpleNamespace(vertices=np.concatenate([9 + V, V]), target=target)
    case = SimpleNamespace(pair=pair, carrier=carrier, targets="targets")
    mesh = coarse_start.FewVertices(np.arange(12, 24), F, V, np.array([7, 3]), None)
    met = np.array(met)
    found = drain(coarse_start._guided(case, mesh, (V, met), 5 * V, (0.5, 0.25)))
    np.testing.assert_allclose(found, V + 2)
    for k, width in enumerate((0.5, 0.25)):
        (values, of_target, share), domain, problem = asked[k]
        np.testing.assert_allclose(values, 5 * V / width)
        np.testing.assert_allclose(of_target, 7 * V / width)
        np.testing.assert_allclose(share, 30.0 / 12)
        np.testing.assert_allclose(domain, V + k)
        own = mesh.landmarks[met].tolist()
        assert made[k].holds == (own, met.tolist()) and np.flatnonzero(problem.held).tolist() == sorted(own)


def test_what_was_only_just_straightened_is_relaxed_with_its_landmarks_held(monkeypatch):
    problem = SimpleNamespace(held=np.zeros(12, bool))
    asked = []

    def minimise(problem, placed, steps, tolerance, name):
        asked.append((np.flatnonzero(problem.held).tolist(), placed, steps))
        return done((SimpleNamespace(domain="relaxed"), 2), 0.0, 1.0)

    monkeypatch.setattr(coarse_start, "deformation", lambda *_: problem)
    monkeypatch.setattr(coarse_start, "minimise_on", minimise)
    monkeypatch.setattr(coarse_start, "in_space", lambda places: places)
    case = SimpleNamespace(domain_carrier=lambda loop: SimpleNamespace(place=lambda places: ("placed", places)))
    mesh = coarse_start.FewVertices(np.arange(12), F, V, np.array([7, 3]), None)
    assert drain(coarse_start._relaxed(case, mesh, "places")) == "relaxed"
    assert asked == [([3, 7], ("placed", "places"), 5)]


@pytest.mark.parametrize("seed", range(3))
def test_functional_maps_take_every_coarse_vertex_where_it_corresponds_to_in_whatever_order_it_comes(seed, monkeypatch):
    """A surface corresponds to itself: all coarse vertices are at their own places, landmarks at theirs."""
    V, F = meshes.icosphere(2)
    rng, n = np.random.default_rng(seed), len(V)
    chosen, number = rng.permutation(n)[:40], np.arange(n)[:, None]
    marks = np.array([3, 17])
    pair = SimpleNamespace(
        vertices=V,
        landmarks=chosen[marks],
        targets=(np.zeros(2, int), np.eye(3)[:2]),
        target=SimpleNamespace(triangles=F),
        spectra=(number, number),
    )
    targets = SimpleNamespace(domain=np.full((2, 3), 9.0))
    case = SimpleNamespace(pair=pair, carrier=SimpleNamespace(domain=V), aligned=V, targets=targets)
    mesh = SimpleNamespace(chosen=chosen, landmarks=marks, carried=lambda start, at: at)

    def itself(source, other, near, landmarks):
        assert near.tolist() == source[:, 0].tolist() and len(source) == coarse_start.SAMPLES
        assert landmarks[0].tolist() == chosen[marks][:, None].tolist()
        return near

    monkeypatch.setattr(coarse_start, "SAMPLES", 100)
    monkeypatch.setattr(coarse_start, "refined_correspondence", itself)
    places = drain(coarse_start._corresponding(case, mesh, V[chosen]))
    expected = V[chosen].copy()
    expected[marks] = 9.0
    np.testing.assert_array_equal(places, expected)
