"""Which ways a map of a body takes, with its steps written in advance, and what it tells of it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import told, worked

from omt_uv.solver.errors import TetrahedraError
from omt_uv.solver.volumes import body_map
from omt_uv.solver.volumes.meshing import TetMesh


def corner():
    """A tetrahedron whose corners are its boundary, and their directions."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    sphere = np.array([[-1, -1, -1], [2, -1, -1], [-1, 3, -1], [-1, -1, 4.0]])
    return TetMesh(points, np.array([[0, 1, 2, 3]])), sphere / np.linalg.norm(sphere, axis=1, keepdims=True)


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("tangled", [True, False])
@pytest.mark.parametrize("domain", ["ball", "cube"])
def test_bodies_are_untangled_refined_and_made_exact(domain, tangled, given, monkeypatch):
    mesh, sphere = corner()
    calls = []

    def step(name, value):
        def taking(*words, **more):
            calls.append((name, words, more))
            return worked(value)

        return taking

    finer = TetMesh(mesh.points + 1, mesh.tets)
    monkeypatch.setattr(body_map, "harmonic", lambda mesh, start: start)
    monkeypatch.setattr(body_map, "tet_problem", lambda points, tets, kind: ("problem", points, kind))
    monkeypatch.setattr(body_map, "untangled", step("untangled", TetrahedraError("No") if tangled else "free"))
    monkeypatch.setattr(body_map, "_with_room", step("room", (finer, "roomy")))
    monkeypatch.setattr(body_map, "refined", step("refined", ("rough", 5)))
    exact = SimpleNamespace(points=mesh.points + 2, positions="exact", rounds=3)
    monkeypatch.setattr(body_map, "exact_volumes", step("exact", exact))
    steps = body_map._mapped(mesh, sphere, domain, "newton", given)
    if tangled and given:
        with pytest.raises(TetrahedraError, match="Remesh the surface evenly first"):
            told(steps)
        return
    (found, positions, count), fractions = told(steps)
    assert positions == "exact" and count == 8 and np.array_equal(found.points, mesh.points + 2)
    names = ["untangled", "room", "refined", "exact"] if tangled else ["untangled", "refined", "exact"]
    assert [c[0] for c in calls] == names
    refined, last = calls[-2], calls[-1]
    assert refined[1][1:] == (("roomy", body_map.LONG_STAGES) if tangled else ("free", body_map.STAGES))
    own = finer.points if tangled else mesh.points
    assert np.array_equal(refined[1][0][1], own) and np.array_equal(last[1][0], own)
    assert last[1][2] == "rough" and last[2] == {"slide": not given}
    kind = type(refined[1][0][2]).__name__
    assert kind == ("CubeDomain" if domain == "cube" else "BallDomain")
    assert (np.diff(fractions) > -1e-9).all() and fractions[0] == 0.2 and fractions[-1] == pytest.approx(1.0)


def test_the_flow_of_the_paper_is_taken_by_its_name(monkeypatch):
    mesh, sphere = corner()
    monkeypatch.setattr(body_map, "harmonic", lambda mesh, start: start)
    flow = SimpleNamespace(positions="flowed", errors=(3.0, 2.0, 1.0))
    monkeypatch.setattr(body_map, "paper_flow", lambda *_: worked(flow))
    found, positions, steps = told(body_map._mapped(mesh, sphere, "ball", "flow", False))[0]
    assert found is mesh and (positions, steps) == ("flowed", 2)


@pytest.mark.parametrize("domain", ["ball", "cube"])
def test_room_is_made_on_the_sphere_and_on_the_cube_after_it(domain, monkeypatch):
    mesh, sphere = corner()
    calls = []

    def unlocked(mesh, positions, held):
        calls.append((float(np.abs(positions).max()), held))
        return worked((TetMesh(mesh.points + 1, mesh.tets), positions))

    monkeypatch.setattr(body_map, "harmonic", lambda mesh, start: start)
    monkeypatch.setattr(body_map, "on_cube", lambda positions: 7 * np.ones_like(positions))
    monkeypatch.setattr(body_map, "unlocked", unlocked)
    (found, _), fractions = told(body_map._with_room(mesh, sphere, domain))
    assert calls == [(pytest.approx(np.abs(sphere).max()), 4)] + [(7.0, 4)] * (domain == "cube")
    assert np.array_equal(found.points, mesh.points + len(calls)) and fractions[1] == pytest.approx(0.6)


@pytest.mark.parametrize("fails", [None, "untangled", "exact"])
@pytest.mark.parametrize("placed", [True, False])
def test_one_body_goes_into_another_through_the_ball(placed, fails, monkeypatch):
    mesh, sphere = corner()
    asked = []

    class Location:
        def __init__(self, points, tets):
            self.points = points

        def values(self, at, values):
            asked.append((self.points, at, values))
            return 2 * mesh.points[[0, 2, 1, 3]]

    first = body_map.VolumeMap(
        points=mesh.points, tets=mesh.tets, positions=sphere, domain="ball", shares=0.5, around_vertices=0.5,
        inverted=0, steps=4, warnings=("first",),
    )  # fmt: skip
    other = body_map.replace(first, points=3 * mesh.points, positions=sphere[::-1], warnings=("other",))
    monkeypatch.setattr(body_map, "TetLocation", Location)
    monkeypatch.setattr(body_map, "tet_problem", lambda *_: "problem")
    refused = TetrahedraError("No")
    monkeypatch.setattr(body_map, "untangled", lambda *_: worked(refused if fails == "untangled" else "free"))
    exact = SimpleNamespace(points=mesh.points + 1, positions=5 * mesh.points)
    monkeypatch.setattr(body_map, "exact_volumes", lambda *_: worked(refused if fails == "exact" else exact))
    at = sphere * 0.5 if placed else None
    found, _ = told(body_map.into_body(first, other, at))
    assert np.array_equal(asked[0][0], sphere[::-1]) and np.array_equal(asked[0][2], 3 * mesh.points)
    assert np.array_equal(asked[0][1], sphere * 0.5 if placed else sphere)
    assert found.domain == "body" and found.warnings[:2] == ("first", "other")
    if fails is None:
        assert found.inverted == 0 and len(found.warnings) == 2 and np.array_equal(found.points, mesh.points + 1)
        assert np.array_equal(found.positions, 5 * mesh.points) and found.shares == pytest.approx(0, abs=1e-12)
    else:
        assert found.inverted == 1 and np.array_equal(found.points, mesh.points)
        assert found.warnings[2].startswith("1 of 1 tetrahedra is inverted")


@pytest.mark.parametrize(
    ("count", "shares", "begins"),
    [
        (0, 0.0, []),
        (1, 0.0, ["A tetrahedron is"]),
        (3, 0.0, ["3 tetrahedra are"]),
        (0, 0.99, ["Volumes are 99 % off"]),
        (2, 0.5, ["2 tetra", "Volumes are 50 %"]),
    ],
)
def test_what_is_inverted_or_off_is_told(count, shares, begins):
    found = body_map._told(count, shares)
    assert len(found) == len(begins) and all(a.startswith(b) for a, b in zip(found, begins, strict=True))
    assert len(body_map._told(0, 0.999 * 0.02)) == 0 and len(body_map._told(0, 1.001 * 0.02)) == 1


def test_meshes_are_put_into_the_box_of_their_surface():
    vertices = np.array([[1, 2, 3], [5, 2, 3], [1, 8, 3], [1, 2, 5.0]])
    mesh = TetMesh(np.concatenate([vertices, [[3, 5, 4.0], [4, 5, 4]]]), np.zeros((0, 4), int))
    surface = SimpleNamespace(vertices=(vertices - [3, 5, 4]) / 6, extent=6.0)
    found = body_map._in_box(mesh, vertices, surface)
    assert np.array_equal(found.points[:4], surface.vertices)
    assert found.points[4:] == pytest.approx(np.array([[0, 0, 0], [1 / 6, 0, 0]]))
    assert body_map._middle(vertices) == pytest.approx([3, 5, 4])


def test_surfaces_are_turned_to_look_outwards():
    points = corner()[0].points
    outwards = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    assert np.array_equal(body_map._outwards(points, outwards), outwards)
    assert np.array_equal(body_map._outwards(points, outwards[:, ::-1]), outwards)


@pytest.mark.parametrize("slide", [True, False])
@pytest.mark.parametrize(
    ("errors", "rounds"),
    # Until it is low enough, or has hardly fallen for three rounds; steps that are none cost a round.
    [
        ([0.5, 0.01], 1),
        ([0.5, 0.4, 0.011, 0.01], 3),
        ([0.5] * 9, 3),
        ([0.5, None, 0.01], 2),
        ([0.5, 0.499, 0.498, 0.3, 0.01], 4),
        # Ten times as damped each time, up to a thousand.
        ([0.5] + [None] * 9, 5),
    ],
)
def test_rounds_of_exact_volumes_go_on_while_they_help(errors, rounds, slide, monkeypatch):
    from dataclasses import dataclass

    from omt_uv.solver.volumes import tet_exact

    asked, at = [], [0]

    @dataclass(frozen=True)
    class Both:
        off: np.ndarray
        points: np.ndarray
        positions: np.ndarray

    points = 2 * corner()[0].points

    def both(error, k):
        return Both(np.array([error, 0.0]), points / np.cbrt(8 / 6) + k, np.full((4, 3), float(k)))

    def step(now, domain, damping, slide):
        asked.append((damping, slide))
        at[0] += 1
        error = errors[min(at[0], len(errors) - 1)]
        return (None, False) if error is None else (both(error, at[0]), at[0] % 2 == 1)

    monkeypatch.setattr(tet_exact, "_both", lambda tets, points, positions: both(errors[0], 0))
    monkeypatch.setattr(tet_exact, "_round", step)
    domain = SimpleNamespace(boundary=np.array([0, 1, 2]))
    found, fractions = told(
        tet_exact.exact_volumes(points, np.array([[0, 1, 2, 3]]), np.zeros((4, 3)), domain, 0.01, slide)
    )
    assert found.rounds == rounds and fractions == pytest.approx([k / tet_exact.ROUNDS for k in range(rounds)])
    damping = [0.01]
    for k in range(1, rounds):
        error = errors[min(k, len(errors) - 1)]
        damping.append(damping[-1] * 10 if error is None else max(damping[-1] * (0.25 if k % 2 else 4), 1e-6))
    assert [a[0] for a in asked] == pytest.approx(damping) and all(a[1] == slide for a in asked)
    last = max(k for k in range(rounds + 1) if errors[min(k, len(errors) - 1)] is not None)
    assert np.array_equal(found.points[:3], points[:3]) and (found.positions == last).all()
    # What lies inside moves in the units of the body.
    assert found.points[3] == pytest.approx(points[3] + (np.cbrt(8 / 6) * last if slide else 0))
