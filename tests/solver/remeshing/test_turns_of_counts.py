"""How parts of a surface share a count of vertices or faces, with remeshes written in advance; what is told of it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scripted_steps import told, worked

from omt_uv.solver.errors import CountError
from omt_uv.solver.remeshing import remesh_surface as remeshes


def options(vertices=True, **more):
    given = {"counts_vertices": vertices, "count_of": "vertices" if vertices else "faces", "preserve_boundary": True}
    return SimpleNamespace(**given | {"grading": 0.0, "rounds": 3} | more)


def parts(*areas):
    starts = np.cumsum([0, *(1 for _ in areas)])
    return [
        SimpleNamespace(component=SimpleNamespace(area=np.array([a]), faces=np.array([k])))
        for k, a in zip(starts, areas, strict=False)
    ]


@pytest.fixture
def made(monkeypatch):
    """Parts that come out with other counts than they were asked for; what was asked, by area."""

    def run(areas, count, least, extra=(), vertices=True):
        asked = []
        maps = parts(*areas)

        def component(m, target, density, options):
            k = maps.index(m)
            more = extra[k] if k < len(extra) else 0
            asked.append((k, target))
            made = np.zeros((target + more, 3))
            other = np.zeros((7, 3))
            return worked(SimpleNamespace(points=made if vertices else other, triangles=other if vertices else made))

        monkeypatch.setattr(remeshes, "remesh_component", component)
        density = np.ones(len(areas))
        found, fractions = told(remeshes._with_min_counts(maps, density, count, np.array(least), options(vertices)))
        return found, asked, fractions

    return run


@pytest.mark.parametrize("vertices", [True, False])
def test_parts_are_remeshed_from_small_to_large_by_their_share(vertices, made):
    (results, least), asked, fractions = made([6.0, 1.0, 3.0], 100, [4, 4, 4], vertices=vertices)
    assert asked == [(1, 10), (2, 30), (0, 60)] and least.tolist() == [4, 4, 4] and len(results) == 3
    assert fractions == pytest.approx([0, 0.1, 0.1, 0.4, 0.4, 1.0])


def test_large_parts_make_up_for_small_ones_that_take_more(made):
    (results, least), asked, _ = made([6.0, 1.0, 3.0], 100, [4, 4, 4], extra=[0, 5, 3])
    # Of the 85 that are left a third is asked for, then what is left of that.
    assert asked[0] == (1, 10) and asked[1] == (2, round(85 / 3)) and asked[2] == (0, 85 - asked[1][1] - 3)
    assert least.tolist() == [4, 15, asked[1][1] + 3] and len(results) == 3
    # What takes fewer says nothing about the least.
    assert made([6.0, 1.0], 70, [4, 4], extra=[0, -2])[0][1].tolist() == [4, 4]


def test_where_too_little_is_left_nothing_is_made(made):
    (results, least), asked, _ = made([6.0, 1.0], 20, [16, 3], extra=[0, 5])
    assert results == [] and len(asked) == 1 and least.tolist() == [16, asked[0][1] + 5]
    (results, _), _, _ = made([6.0, 1.0], 20, [12, 3], extra=[0, 5])
    assert len(results) == 2


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize(("count", "corners"), [(30, [True]), (29, [True, False]), (20, [True, False]), (19, None)])
def test_corners_are_kept_while_the_count_allows_it(count, corners, kept, monkeypatch):
    asked = []

    def least(maps, options, corners):
        asked.append(corners)
        return np.array([10, 20 if corners else 10])

    monkeypatch.setattr(remeshes, "_min_counts", least)
    monkeypatch.setattr(
        remeshes, "_with_min_counts", lambda maps, density, count, least, options: worked((["made"], least))
    )
    steps = remeshes._all_components([], None, count, options(preserve_boundary=kept))
    if corners is None or (not kept and count < 20):
        with pytest.raises(
            CountError,
            match=f"{count} vertices are too few: this topology, with its boundaries and features, takes at least 20",
        ):
            told(steps)
        return
    assert told(steps)[0] == ["made"]
    assert asked == (corners if kept else [False])


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_what_collapses_to_more_is_tried_again_until_there_is_no_room(turns, monkeypatch):
    asked = []

    def made(maps, density, count, least, options):
        asked.append(least.tolist())
        return worked((["made"] if len(asked) == turns else [], least + [2, 3]))

    monkeypatch.setattr(remeshes, "_min_counts", lambda *_: np.array([4, 4]))
    monkeypatch.setattr(remeshes, "_with_min_counts", made)
    steps = remeshes._all_components([], None, 14, options())
    if turns < 3:
        assert told(steps)[0] == ["made"] and asked == [[4, 4], [6, 7]][:turns]
    else:
        with pytest.raises(CountError, match=r"14 vertices are too few: edges of this surface, .* collapse to 18"):
            told(steps)


@pytest.mark.parametrize("vertices", [True, False])
def test_every_part_takes_what_its_topology_and_its_lines_take(vertices, monkeypatch):
    monkeypatch.setattr(remeshes, "min_vertex_count", lambda component: component.least)
    monkeypatch.setattr(remeshes, "min_sample_count", lambda m, corners: 9 if corners else 3)
    monkeypatch.setattr(remeshes, "min_face_count", lambda component, n: 2 * n)
    maps = [SimpleNamespace(component=SimpleNamespace(least=n)) for n in (4, 12)]
    factor = 1 if vertices else 2
    assert remeshes._min_counts(maps, options(vertices), True).tolist() == [9 * factor, 12 * factor]
    assert remeshes._min_counts(maps, options(vertices), False).tolist() == [4 * factor, 12 * factor]


@pytest.mark.parametrize(
    ("count", "vertices", "more"),
    [(4 * 50, True, False), (4 * 50 + 1, True, True), (4 * 90, False, False), (4 * 90 + 1, False, True)],
)
@pytest.mark.parametrize("odd", [False, True])
@pytest.mark.parametrize("grading", [0.0, 0.5])
def test_what_adds_no_detail_and_what_closed_surfaces_cannot_have_is_told(
    grading, odd, count, vertices, more, monkeypatch
):
    monkeypatch.setattr(remeshes, "MAX_REFINEMENT", 4)
    graded = []

    def grade(level, vertices, triangles, grading, samples):
        graded.append((grading, samples))
        return 2 * level

    monkeypatch.setattr(remeshes, "graded_density", grade)
    seen = []
    monkeypatch.setattr(remeshes, "_small", lambda components, level, count: seen.append((level[0], count)))
    results = [SimpleNamespace(triangles=np.zeros((count + odd, 3)), warnings=("same",)) for _ in range(1)]
    monkeypatch.setattr(remeshes, "_all_components", lambda maps, level, count, options: worked(results * 2))
    monkeypatch.setattr(remeshes, "_joined", lambda results, source, warnings, rounds: (warnings, rounds))
    frame = SimpleNamespace(vertices=None, triangles=None)
    source = SimpleNamespace(
        frame=frame,
        components=SimpleNamespace(warnings=("parts",), components=None),
        vertices=np.zeros((50, 3)),
        triangles=np.zeros((90, 3)),
        maps_with_batches=lambda small: None,
    )
    results[0].triangles = np.zeros(((count + odd) // 2, 3))
    (warnings, rounds), _ = told(
        remeshes._in_frame(source, count, options(vertices, grading=grading), np.array([1.0, 3.0]))
    )
    made = 2 * ((count + odd) // 2)
    assert rounds == 3 and warnings[0] == "parts" and warnings[1 + more] == "same (2 times)"
    assert not more or "more than 4 times the input's" in warnings[1]
    uneven = not vertices and made != count
    assert len(warnings) == 2 + more + uneven and (not uneven or f"{made} instead of {count}" in warnings[-1])
    assert graded == ([(0.5, count if vertices else count // 2)] if grading else [])
    assert seen == [(2.0 if grading else 1.0, count if vertices else count / 2)]


def test_densities_are_one_for_each_triangle(monkeypatch):
    assert remeshes._checked_density(None, 3).tolist() == [1, 1, 1]
    assert remeshes._checked_density([1, 2, 3], 3).tolist() == [1, 2, 3]
    with pytest.raises(ValueError, match=r"each of 3 triangles, not the shape \(2,\)"):
        remeshes._checked_density([1, 2], 3)


@pytest.mark.parametrize("count", [10, 1000])
def test_small_parts_are_those_of_a_small_share(count):
    components = [SimpleNamespace(area=np.array([a]), faces=np.array([k])) for k, a in enumerate((1.0, 2.0, 7.0))]
    density = np.array([1.0, 2.0, 1.0])
    found = remeshes._small(components, density, count)
    share = np.array([1, 4, 7]) / 12
    assert found.tolist() == (count * share < 500).tolist()
