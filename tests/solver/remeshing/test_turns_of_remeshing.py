"""Which way a remesh of a part takes, with its steps written in advance: first meshes, rounds, counts and attempts."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import done

from omt_uv.solver.errors import CrowdedError
from omt_uv.solver.mesh.topology import pair_keys
from omt_uv.solver.progress import Progress, drain
from omt_uv.solver.remeshing import remesh_component as components
from omt_uv.solver.remeshing.edits.vertex_count import StuckError
from omt_uv.solver.remeshing.initial import initial_mesh

# ---- attempts -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vertices", [True, False])
@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("fails", [0, 1, 2, 3, 4])
def test_lines_are_sampled_more_sparsely_until_the_count_is_reached(fails, fixed, vertices, monkeypatch):
    asked = []
    mesh = SimpleNamespace(points=np.zeros((30, 3)), triangles=np.zeros((50, 3), int), fixed=np.array([fixed]))

    def first(maps, count, level, at_vertices, options, spacing):
        asked.append([count, spacing])
        return done(SimpleNamespace(mesh=mesh, line_spacing=spacing + 0.5, reopened_copies=4), 0.0, 1.0)

    def settled(component, start, level, options, allow_folds):
        asked[-1].append(allow_folds)
        yield Progress("A", 0.5)
        if len(asked) <= fails:
            raise StuckError(mesh)
        return "mesh"

    monkeypatch.setattr(components, "make_initial_mesh", first)
    monkeypatch.setattr(components, "_settled", settled)
    monkeypatch.setattr(components, "_at_vertices", lambda *_: None)
    maps = SimpleNamespace(component=SimpleNamespace(area=np.ones(4)))
    options = SimpleNamespace(counts_vertices=vertices)
    assert drain(components.remesh_component(maps, 99, np.ones(4), options)) == "mesh"
    # Faces may fold from the third attempt on, or where nothing is held; then what there is is the count.
    reached = 34 if vertices else 50
    want, count, spacing = [], 99, 1.0
    for k in range(fails + 1):
        folds = k >= 2 or not fixed
        want.append([count, spacing, folds])
        count, spacing = reached if folds else count, 2 * (spacing + 0.5)
    assert asked == want


@pytest.mark.parametrize("measured", [True, False])
@pytest.mark.parametrize(("balances", "carried"), [([True], 1), ([False, True], 2), ([False] * 7, 7)])
def test_vertices_are_carried_in_turns_until_they_are_balanced(balances, carried, measured, monkeypatch):
    calls, rest = [], iter(balances)

    class Relaxing:
        """Goes on from where it ended."""

        def __init__(self, mesh, carrier):
            self.mesh = mesh

        def run(self, rounds):
            calls.append(("relax", rounds))
            self.mesh += 1
            return done((self.mesh, 0.1 * len(calls)), 0.0, 1.0)

    def relax(mesh, rounds, carrier):
        return Relaxing(mesh, carrier).run(rounds)

    def balance(mesh, carrier, sizing, demand):
        calls.append(("balance", demand))
        return SimpleNamespace(mesh=mesh + 100, demand=len(calls), was_balanced=next(rest))

    def reach(mesh, count, sizing, folds):
        calls.append(("reach", count, folds))
        return mesh + 10

    monkeypatch.setattr(components, "relax_cvt", relax)
    monkeypatch.setattr(components, "Relaxation", Relaxing)
    monkeypatch.setattr(components, "balance_vertices", balance)
    monkeypatch.setattr(components, "reach_vertex_count", reach)
    options = SimpleNamespace(rounds=9, samples_by_measure=measured)
    fractions, steps = [], components._relaxed(SimpleNamespace(mesh=0, vertex_count=7), None, None, options, True)
    try:
        while True:
            fractions.append(next(steps).fraction)
    except StopIteration as stop:
        mesh, residual = stop.value
    assert calls[:3] == [("relax", 24), ("reach", 7, True), ("relax", 6)]
    assert (np.diff(fractions) > -1e-9).all() and fractions[:3] == pytest.approx([0, 0.07, 0.07])
    if not measured:
        assert calls[3:] == [("relax", 3)] and mesh == 13 and fractions[-1] == pytest.approx(0.5)
        return
    assert [c[0] for c in calls].count("balance") == carried
    # Each goes on from what the one before asked for.
    demands = [c[1] for c in calls if c[0] == "balance"]
    assert demands[0] is None and all(d is not None for d in demands[1:])
    # Of nine rounds the six before vertices were found balanced are the first.
    last = [("relax", 3)] if carried < 7 else [("relax", 9), ("balance", demands[-1]), ("relax", 6)]
    assert calls[-len(last) :] == last and residual == pytest.approx(0.1 * len(calls))
    assert fractions[-1] == pytest.approx(0.5 if carried < 7 else 0.57)


@pytest.mark.parametrize("rounds", [0, 3])
@pytest.mark.parametrize("fit", [True, False])
@pytest.mark.parametrize("near", [True, False])
def test_a_first_mesh_is_relaxed_brought_to_its_count_and_fitted(near, fit, rounds, monkeypatch):
    V, F = meshes.grid(2, 2)
    calls = []
    at = np.zeros(9, np.int64)
    at[F] = np.arange(8)[:, None]
    mesh = SimpleNamespace(points=V, triangles=F, near=at if near else None)

    def step(name, value):
        def taking(*words):
            calls.append(name)
            return value

        return taking

    monkeypatch.setattr(components, "_relaxed", lambda *words: (calls.append("relax"), done((mesh, 0.25)))[1])
    monkeypatch.setattr(components, "reach_vertex_count", step("reach", mesh))
    monkeypatch.setattr(components, "fit_to_surface", lambda *_: (calls.append("fit"), done(mesh))[1])
    monkeypatch.setattr(components, "reopened", step("reopen", (V, F)))
    component = SimpleNamespace(
        vertices=V + [0, 0, 1],
        triangles=F,
        faces=10 + np.arange(8),
        shift=np.arange(24.0).reshape(8, 3),
        input_barycentric=np.tile(np.eye(3), (8, 1, 1)),
    )
    start = SimpleNamespace(size=0.5, mesh=mesh, vertex_count=9, to_reopen=None, warnings=("told",))
    options = SimpleNamespace(rounds=rounds, fit=fit)
    asked = []
    monkeypatch.setattr(components, "_too_thin", lambda *words: (asked.append(words), ["thin"])[1])
    found = drain(components._settled(component, start, np.full(8, 4.0), options, False))
    assert calls == ["relax"] * (rounds > 0) + ["reach"] + ["fit"] * fit + ["reopen"]
    assert found.residual == (0.25 if rounds else 0.0) and found.warnings == ("told", "thin")
    # Edges are half as long where the density is four times as high.
    ((of, points, edge),) = asked
    assert of is component and points is V and edge.tolist() == [0.25] * 8
    rows = found.faces - 10
    assert found.points == pytest.approx(V - component.shift[rows])
    on = np.einsum("kc,kcd->kd", found.barycentric, component.vertices[F[rows]])
    assert on == pytest.approx(V + [0, 0, 1])


# ---- first meshes -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("any_mesh", "lines", "sphere", "room", "ways"),
    [
        (True, False, True, True, ["decimation"]),
        (True, True, True, True, ["charts"]),
        (False, False, True, True, ["sphere"]),
        (False, False, True, False, ["sphere", "charts"]),
        (False, True, False, True, ["charts"]),
    ],
)
def test_first_meshes_come_by_the_way_that_there_is(any_mesh, lines, sphere, room, ways, monkeypatch):
    calls = []

    def way(name, value, steps=True):
        def taking(*words):
            calls.append(name)
            return done(value) if steps else value

        return taking

    monkeypatch.setattr(initial_mesh, "_by_decimation", way("decimation", "mesh", False))
    monkeypatch.setattr(initial_mesh, "_by_sphere", way("sphere", "mesh" if room else None))
    monkeypatch.setattr(initial_mesh, "_by_charts", way("charts", "mesh"))
    maps = SimpleNamespace(component=SimpleNamespace(has_lines=lines), by_sphere=sphere)
    options = SimpleNamespace(any_mesh_will_do=any_mesh)
    assert drain(initial_mesh.make_initial_mesh(maps, 9, None, None, options)) == "mesh"
    assert calls == ways


@pytest.mark.parametrize(
    ("samples", "inner", "rounds", "works", "way"),
    [
        (3, 0, 1, (), "triangle"),
        (3, 1, 1, ("even",), "even"),
        (4, 0, 1, ("even",), "even"),
        (4, 99, 1, ("map", "even"), "map"),
        (4, 99, 1, ("even",), "even"),
        (4, 0, 0, ("map", "even"), "map"),
        (4, 99, 1, (), "none"),
        (4, 99, 0, (), "crowded"),
    ],
)
def test_charts_are_triangulated_by_their_map_or_evenly(samples, inner, rounds, works, way, monkeypatch):
    V, F = meshes.grid(1, 1)

    def triangulate(places, disk, loop, images, boundary, count):
        kind = "even" if images[0] is images[1] and images[0] == "even" else "map"
        return kind if kind in works else None

    monkeypatch.setattr(initial_mesh, "triangulate_chart", triangulate)
    monkeypatch.setattr(initial_mesh, "even_image", lambda *_: "even")
    chart = SimpleNamespace(vertices=V, disk=F, vertex_ids=np.arange(4), faces=np.array([1, 0]))
    pair = SimpleNamespace(pair=lambda strategy: ("one", "other"), warnings=("of the map",))
    component = SimpleNamespace(vertices=V, faces=np.array([40, 50]))
    maps = SimpleNamespace(charts=[chart], component=component, of_chart=lambda k, density: done(pair))
    boundary = SimpleNamespace(samples=np.arange(samples))
    options = SimpleNamespace(rounds=rounds, strategy="s")
    steps = initial_mesh._chart_mesh(maps, 0, None, boundary, inner, None, options)
    if way == "crowded":
        with pytest.raises(CrowdedError, match=f"2 triangles leaves no room for {inner} vertices") as caught:
            drain(steps)
        assert caught.value.elements.tolist() == [50, 40]
        return
    mesh, told = drain(steps)
    assert told == (("of the map",) if way == "map" else ())
    if way == "triangle":
        assert mesh.triangles.tolist() == [[0, 1, 2]] if hasattr(mesh, "triangles") else mesh is not None
    else:
        assert mesh == (None if way == "none" else way)


@pytest.mark.parametrize("count", [0, 7, 100])
def test_inner_samples_are_shared_by_measure_less_half_of_what_is_on_boundaries(count):
    V, F = meshes.grid(3, 2)
    charts = [
        SimpleNamespace(vertices=V, triangles=F[:4], faces=np.arange(4)),
        SimpleNamespace(vertices=V, triangles=F[4:], faces=np.arange(4, 12)),
    ]
    density = np.linspace(1, 3, 12)
    bounds = [SimpleNamespace(samples=np.arange(6)), SimpleNamespace(samples=np.arange(2))]
    found = initial_mesh._inner_counts(charts, bounds, density, count)
    area = 1 / 12
    measure = np.array([density[:4].sum() * area, density[4:].sum() * area])
    ideal = np.maximum((count + 4) * measure / measure.sum() - [3, 1], 0)
    assert found.sum() == count and np.abs(found - ideal * count / max(ideal.sum(), 1e-9)).max() <= 0.5 + 1e-9


def test_edges_of_arcs_are_those_between_samples_that_follow_each_other():
    samples = SimpleNamespace(along=[np.array([0, 3, 1]), np.array([1, 2]), np.array([2, 4, 0])])
    number = np.array([10, 20, 5, 30, 40])
    found = initial_mesh._edge_keys([0, 2], samples, number)
    want = sorted(int(pair_keys(np.array([a]), np.array([b]))[0]) for a, b in ((10, 30), (30, 20), (5, 40), (40, 10)))
    assert found.tolist() == want and len(initial_mesh._edge_keys([], samples, number)) == 0
