"""What single solvers decide at their ends: no area, no edge, several islands, nothing to take apart, nothing far."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.api import steps as api_steps
from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.flows import creases
from omt_uv.solver.mesh import closest_point
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.charts import chart_maps
from omt_uv.solver.strain.beltrami import beltrami
from omt_uv.solver.volumes import envelope


@pytest.mark.parametrize(
    ("image", "size"),
    [
        ([[0, 0], [1, 0], [0, 1]], 0.0),
        ([[0, 0], [2, 0], [0, 1]], 1 / 3),
        ([[0, 0], [0, 0], [0, 0]], 0.0),
        ([[0, 0], [1, 0], [0, -1]], np.inf),
        ([[0, 0], [1, 0], [0, 0]], 1.0),
    ],
)
@pytest.mark.parametrize("flat", [True, False])
def test_what_has_no_area_is_sheared_without_end_or_not_at_all(image, size, flat):
    if not flat and np.isinf(size):
        # In space there is no other side.
        return
    V, image = np.array([[0, 0, 0], [1, 0, 0], [0, 1.0, 0]]), np.array(image, float)
    found = beltrami(V, np.array([[0, 1, 2]]), image if flat else np.column_stack([image, np.zeros(3)]))
    assert found.size == pytest.approx([size]) and found.area == pytest.approx([0.5])


def test_islands_refined_by_arrays_have_one_density_and_the_area_they_had(monkeypatch):
    V, F = meshes.grid(3, 2)
    V, F = np.concatenate([V, 2 * V + [5, 0, 0]]), np.concatenate([F, F + 12])
    uv = np.concatenate([0.5 * V[:12, :2], 0.1 * V[12:, :2] + 7])

    def as_it_is(vertices, triangles, uv, **_):
        return SimpleNamespace(uv=1.5 * uv, warnings=("told", "told"))
        yield

    monkeypatch.setattr(api_steps, "refine_island", as_it_is)
    found = drain(api_steps.refine(V, F, uv[F]))
    assert found.warnings == ("told",)
    # What was refined has the areas 1.5^2 (1/4, 4/100) of surfaces of 1 and 4.
    density = 1.5**2 * (0.25 + 0.04) / 5
    corners = np.asarray(found.uv).reshape(-1, 2)
    areas = signed_areas(corners, np.arange(len(corners)).reshape(-1, 3))
    assert areas[:12].sum() == pytest.approx(density) and areas[12:].sum() == pytest.approx(4 * density)
    # About the mean of their vertices.
    for rows in (slice(0, 12), slice(12, 24)):
        new = np.array([corners[np.flatnonzero(F.ravel() == v)[0]] for v in range(24)[rows]])
        assert new.mean(axis=0) == pytest.approx(1.5 * uv[rows].mean(axis=0))


@pytest.mark.parametrize("size", [0.0, 1e-3])
def test_bodies_without_a_size_are_filled_as_they_are(size, monkeypatch):
    asked = []

    def nothing(points, triangles, edge):
        asked.append((points, edge))
        return np.zeros((0, 3)), np.zeros((0, 4), int)

    monkeypatch.setattr(envelope, "_tetwild", nothing)
    V = size * np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [0, 0, 12.0]]) + [1, 2, 3]
    F = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    with pytest.raises(envelope.TetrahedraError, match="The surface encloses nothing"):
        envelope.filled(V, F, 100)
    points, edge = asked[0]
    assert np.isfinite(points).all() and points.max() == pytest.approx(12 / 13 if size else 0.0)
    assert 0.005 <= edge <= 0.2


def test_a_harmonic_map_that_folds_is_refused_and_one_that_does_not_is_the_mean_of_its_neighbours():
    V, F = meshes.grid(3, 3)
    outline = np.array([0, 1, 2, 3, 7, 11, 15, 14, 13, 12, 8, 4])
    angle = 2 * np.pi * np.arange(12) / 12
    places = np.column_stack([np.cos(angle), np.sin(angle)])
    found = chart_maps._harmonic(V[:, :2], F, outline, places)
    assert np.array_equal(found[outline], places) and (signed_areas(found, F) > 0).all()
    for v in (5, 6, 9, 10):
        # Of squares with their diagonals only the sides count.
        assert found[v] == pytest.approx(np.mean([found[v + d] for d in (-4, -1, 1, 4)], axis=0), abs=1e-3)
    with pytest.raises(PrecisionError, match="folded by rounding"):
        chart_maps._harmonic(V[:, :2], F, outline, places[::-1])


@pytest.mark.parametrize("held", [False, True])
def test_steps_of_a_flow_are_taken_apart_together_or_one_by_one(held, monkeypatch):
    """Which of the ways to go leaves the fewest pairs of faces that meet: all at once, one by one, held by barriers."""
    calls = []

    def run(lefts, steps, before=0):
        calls.clear()
        rest = iter(lefts)

        def apart(ends, crossings, free):
            calls.append(("apart", float(ends[1][0, 0])))
            return ends[1] + 0.5, np.zeros((next(rest), 2), int)

        def nearer(region, start, target):
            calls.append(("closer", float(target[0, 0])))
            return target + 10

        monkeypatch.setattr(creases, "taken_apart", apart)
        monkeypatch.setattr(creases, "closer", nearer)
        monkeypatch.setattr(creases, "carried", lambda position, steps: position + sum(steps))
        region = SimpleNamespace(crossings=None, free=None)
        domain = SimpleNamespace(held=lambda x: x + 100) if held else None
        state = np.zeros((1, 3)), np.zeros((before, 2), int)
        position, left = creases._advanced(region, state, steps, domain)
        return float(position[0, 0]) - 100 * held * sum(c[0] == "apart" for c in calls[:1]), len(left)

    # Nothing meets, or no more than before.
    assert run([0], [1.0]) == (1.5, 0) and run([2], [1.0], before=2) == (1.5, 2)
    assert len(calls) == 1
    # One step is brought as near as faces let it, where none meet before.
    assert run([3, 1], [1.0])[1] == 1 and calls[1] == ("closer", 1.0 + 100 * held)
    assert run([3, 3], [1.0]) == (1.5, 3) and len(calls) == 3
    # Where some do, from where they were.
    assert run([3, 2], [1.0], before=1)[1] == 2 and [c[0] for c in calls] == ["apart", "apart"]
    # Several steps are taken by themselves, and kept where that leaves fewer.
    assert run([3, 0, 0], [1.0, 2.0])[1] == 0 and [c[0] for c in calls] == ["apart"] * 3
    assert run([1, 3, 3, 3, 3], [1.0, 2.0]) == (3.5, 1)


def test_what_is_far_from_what_was_found_is_searched_again():
    points = np.array([[0, 0, 0], [0, 0, 1.0], [0, 0, 3.0], [0, 0, 0.5]])
    asked = []

    def closer(places, normals, found):
        asked.append(places[:, 2].tolist())
        return closest_point.SurfacePoints(*(part + 1 for part in vars(found).values()))

    def found_at(n):
        return closest_point.SurfacePoints(np.zeros((n, 3)), np.zeros(n, int), np.zeros((n, 3)))

    # Mean of the squares: 10.25 / 4.
    for far, mine in ((1.0, [2]), (0.6, [1, 2]), (2.0, [])):
        found = found_at(4) if list(vars(found_at(4))) else None
        closest_point._search_again(SimpleNamespace(closer=closer), points, points, found, far)
        assert asked.pop() == points[mine, 2].tolist()
        assert [k for k in range(4) if found.faces[k] == 1] == mine
