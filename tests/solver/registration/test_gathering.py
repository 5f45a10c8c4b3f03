"""Vertices gather where flat faces would cut off a part of the target, and nothing folds."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import icosphere
from meshes import polar

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.progress import drain
from omt_uv.solver.registration import gathering
from omt_uv.solver.registration.carriers import TargetCarrier
from omt_uv.solver.registration.domains import Case, prepared
from omt_uv.solver.registration.gathering import gathered
from omt_uv.solver.registration.landmarks import vertex_landmarks
from omt_uv.solver.registration.register import register
from omt_uv.solver.registration.results import RegistrationOptions

CLOSE = 0.01


def two_balls(level: int, cap: float):
    """Unit vectors and triangles of a ball, and a body of two balls, the upper one where a cap of the ball was."""
    V, F = icosphere(level)
    angle = np.arccos(np.clip(V[:, 2], -1, 1))
    aside = V[:, :2] / np.maximum(np.linalg.norm(V[:, :2], axis=1, keepdims=True), 1e-12)
    steep = 0.85 * np.pi * angle / cap
    upper = np.column_stack([np.sin(steep)[:, None] * aside, 2 + np.cos(steep)]) * 0.8
    return V, F, np.where((angle < cap)[:, None], upper, V)


def missed(found, F, target):
    """Root mean square distance of points (k,3) from a surface (n,3), (m,3), over the diagonal."""
    closest = ClosestPoint(found, F, 0.05)
    normals = np.zeros_like(target)
    square = ((closest.closer(target, normals, closest(target, normals)).points - target) ** 2).sum(axis=1)
    return np.sqrt(square.mean()) / np.linalg.norm(np.ptp(target, axis=0))


def ball_case(level: int):
    """A ball on a body of two, and the places of its vertices."""
    P, F = icosphere(level)
    Q, G, target = two_balls(level + 2, 0.2)
    pairs = ([int(P[:, k].argmin()) for k in range(3)], [int(Q[:, k].argmin()) for k in range(3)])
    pair = prepared((P, F), (target, G), vertex_landmarks((pairs[0], F), (pairs[1], G)), "auto")
    carrier = TargetCarrier(pair.target.vertices, pair.target.triangles, Q, pair.loop)
    return Case(pair, P[pair.order], carrier, None), carrier.place(P[pair.order])


def test_a_ball_that_few_faces_cover_gets_more():
    case, before = ball_case(3)
    pair, carrier, P = case.pair, case.carrier, icosphere(3)[0]
    after = drain(gathered(case, before, CLOSE))
    beside = [missed(placed.positions, pair.triangles, pair.target.vertices) for placed in (before, after)]
    assert beside[1] < 0.6 * beside[0]
    assert not carrier.folded(after, pair.triangles).any()
    np.testing.assert_array_equal(after.positions[pair.landmarks], before.positions[pair.landmarks])
    far = P[pair.order][:, 2] < 0
    np.testing.assert_array_equal(after.domain[far], before.domain[far])


def test_the_boundary_and_landmarks_stay_while_vertices_gather_beside_them():
    P, F = polar(lambda t: t, lambda t: 0 * t, 6, 18)
    Q, G = polar(lambda t: t, lambda t: 0 * t, 30, 90)
    away = np.linalg.norm(Q[:, :2] - [0.7, 0], axis=1)
    target = Q + np.maximum(0, 1 - away / 0.25)[:, None] * [0, 0, 0.6]
    marks = ([20, 40], [int(np.linalg.norm(Q - P[k], axis=1).argmin()) for k in (20, 40)])
    pair = prepared((P, F), (target, G), vertex_landmarks((marks[0], F), (marks[1], G)), "auto")
    assert pair.domain == "disk" and len(pair.loop) == 18
    carrier = TargetCarrier(pair.target.vertices, pair.target.triangles, Q[:, :2], pair.loop)
    before = carrier.place(carrier.within(P[pair.order, :2]))
    after = drain(gathered(Case(pair, P[pair.order, :2], carrier, None), before, CLOSE))
    stay = np.concatenate([pair.loop, pair.landmarks])
    np.testing.assert_array_equal(after.positions[stay], before.positions[stay])
    moved = np.linalg.norm(after.domain - before.domain, axis=1)
    assert (moved > 0.01).sum() > 5 and not carrier.folded(after, pair.triangles).any()


def test_what_is_close_stays_as_it_is():
    P, F = icosphere(3)
    maps = (P, P)
    plain = drain(register((P, F), (P, F), maps=maps))
    close = drain(register((P, F), (P, F), options=RegistrationOptions(closeness=CLOSE), maps=maps))
    np.testing.assert_array_equal(close.forward.barycentric, plain.forward.barycentric)
    with pytest.raises(ValueError, match="closeness"):
        RegistrationOptions(closeness=0.0)


def test_the_best_of_all_rounds_is_what_is_given(monkeypatch):
    """Though later ones went back to where all began."""
    case, before = ball_case(2)
    moved, calls = gathering._moved, []

    def going_back(*given):
        calls.append(len(calls) < 3 * gathering.MOVES)
        return moved(*given) if calls[-1] else before

    monkeypatch.setattr(gathering, "_moved", going_back)
    after = drain(gathered(case, before, CLOSE))
    assert not calls[-1]
    beside = [missed(placed.positions, case.pair.triangles, case.pair.target.vertices) for placed in (before, after)]
    assert beside[1] < 0.9 * beside[0]


def test_what_has_no_face_around_it_stays():
    case, before = ball_case(2)
    some = case.pair.triangles[:12]
    after = gathering._moved(case, before, some, np.arange(12.0), np.ones(len(before.domain), bool))
    alone = np.setdiff1d(np.arange(len(before.domain)), some)
    np.testing.assert_array_equal(after.domain[alone], before.domain[alone])
    assert np.isfinite(after.positions).all() and (after.domain[some] != before.domain[some]).any()
