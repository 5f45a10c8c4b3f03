"""Branches of remeshing, seams and flows that are taken seldom: what is decided there, with pieces written before."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scripted_steps import done, told

from omt_uv.solver import errors
from omt_uv.solver.flows import creases
from omt_uv.solver.remeshing.components.components import split_components
from omt_uv.solver.remeshing.edits.vertex_count import apportion
from omt_uv.solver.remeshing.fitting import fit
from omt_uv.solver.remeshing.initial import decimation, disk_samples, initial_mesh
from omt_uv.solver.seams import coarse_cut, coarse_surface, search
from omt_uv.solver.signatures import reference
from omt_uv.solver.sphere import polygon_surface

# ---- remeshing -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("size", "parts"), [(1e-5, 2), (1e-7, 1)])
@pytest.mark.parametrize("count", [1, 2])
def test_parts_without_area_are_left_out(size, parts, count):
    V, F = meshes.icosphere(1)
    every = np.concatenate([V, *(size * V + 3 + k for k in range(count))])
    found = split_components(every, np.concatenate([F + k * len(V) for k in range(count + 1)]), np.zeros((0, 2), int))
    assert len(found.components) == 1 + count * (parts - 1)
    said = [text for text in found.warnings if "left out" in text]
    assert said == (
        [] if parts == 2 else [f"{['A part', '2 parts'][count - 1]} without area {['was', 'were'][count - 1]} left out"]
    )


@pytest.mark.parametrize("seed", range(8))
def test_whole_numbers_are_in_proportion_and_none_too_low(seed):
    rng = np.random.default_rng(seed)
    k = int(rng.integers(1, 9))
    least = rng.integers(1, 9, k)
    proportion = rng.random(k) ** 3
    count = int(least.sum() + rng.integers(0, 40) * (seed > 1))
    found = apportion(count, proportion, least)
    assert found.sum() == count and (found >= least).all()
    # Of those that have more than they have to, none has two less than its share beside one with two more.
    more = found > least
    share = (count - least[~more].sum()) * proportion / max(proportion[more].sum(), 1e-300)
    assert (np.abs(found - share)[more] < 2).all()
    assert apportion(count, 7 * proportion, least).tolist() == found.tolist()


@pytest.mark.parametrize(("works", "rounds"), [(99, None), (2, 2), (0, 0)])
@pytest.mark.parametrize("delaunay", [True, False])
def test_a_fit_ends_where_no_moves_are_left(works, rounds, delaunay, monkeypatch):
    steps = []

    class State:
        def __init__(self, mesh, *_):
            self.mesh = mesh

        def step(self):
            steps.append(len(steps) < works)
            return steps[-1]

    for name in ("Pairing", "join_samples", "area_samples", "tip_samples"):
        monkeypatch.setattr(fit, name, lambda *_: None)
    monkeypatch.setattr(fit, "ClosestPointTracker", lambda *_, start: None)
    monkeypatch.setattr(fit, "vertex_normals", lambda points, triangles: None)
    monkeypatch.setattr(fit, "FitState", State)
    monkeypatch.setattr(fit, "lower_peaks", lambda state: done("lowered", 0.5, 1.0))
    mesh = SimpleNamespace(points=np.zeros((4, 3)), triangles=None, near=None, delaunay=delaunay)
    index = SimpleNamespace(at_or_near=lambda *_: SimpleNamespace(faces=None))
    found, fractions = told(fit.fit_to_surface(mesh, index, None))
    rounds = 5 if rounds is None else rounds
    assert found == ("lowered" if delaunay else mesh)
    own = [0.6 * (k + 1) / 5 for k in range(rounds)]
    assert fractions == pytest.approx([*own, 0.8, 1.0] if delaunay else own)


def test_a_count_that_is_not_reached_leaves_what_was(monkeypatch):
    error = decimation.StuckError("as it is")
    for name in ("collapse_short_edges", "split_long_edges", "collapse_along_lines", "_as_component"):
        monkeypatch.setattr(decimation, name, lambda mesh, *_: mesh)
    monkeypatch.setattr(decimation, "_working_mesh", lambda mesh: ("working", "open"))
    mesh = SimpleNamespace(points=np.zeros((1, 3)), vertices=np.zeros(1))
    monkeypatch.setattr(decimation, "reach_vertex_count", lambda working, count, sizing: (working, count))
    sizing = lambda points: np.ones(len(points))  # noqa: E731
    assert decimation._reached(None, mesh, 7, sizing) == (("working", 7), "open")

    def stuck(*_):
        raise error

    monkeypatch.setattr(decimation, "reach_vertex_count", stuck)
    assert decimation._reached(None, mesh, 7, sizing) == (error.mesh, "open")


@pytest.mark.parametrize("count", [0, 1, 2, 9])
def test_samples_are_spread_from_a_lattice_or_are_it(count, monkeypatch):
    angle = 2 * np.pi * np.arange(2 if count < 2 else 12) / 12
    boundary = np.column_stack([np.cos(angle), np.sin(angle)])
    lattice = disk_samples._lattice(count)
    found = disk_samples.spread_samples(boundary, count)
    # Less than four in all have no cells.
    assert np.array_equal(found, lattice) == (count < 2) and found.shape == (count, 2)

    def fails(*_):
        raise errors.TransportError("no")

    monkeypatch.setattr(disk_samples, "power_diagram", fails)
    assert np.array_equal(disk_samples.spread_samples(boundary, count), lattice)


# ---- seams ---------------------------------------------------------------------------------------------------


def test_the_middle_of_a_cut_is_where_most_of_it_meets():
    """A star with three arms, one of which is long and branches at its end; all steps are as long."""
    ends = np.array([[0, 1], [0, 2], [0, 3], [3, 4], [4, 5], [5, 6], [5, 7], [8, 9]])
    graph = SimpleNamespace(
        ends=ends, cost=np.ones(len(ends)), boundary=np.arange(10) == 8, in_plane=np.zeros(10, bool)
    )
    assert coarse_cut.hub(graph, np.zeros(0, int)) == 8
    # 0 and 5 have three arms each; from 0 the farthest tip is at 4, from 5 at 4, too, and the first is taken.
    assert coarse_cut.hub(graph, np.arange(7)) in (0, 5)
    assert coarse_cut.hub(graph, np.array([0, 1, 2, 3])) == 0
    graph.cost = np.array([1, 1, 1, 1, 1, 5, 1, 1.0])
    assert coarse_cut.hub(graph, np.arange(7)) == 5
    graph.in_plane = np.isin(np.arange(10), [0, 1])
    assert coarse_cut.hub(graph, np.arange(7)) == 0


@pytest.mark.parametrize(("taken", "rounds"), [([30, 20, 10, 10], 3), ([30, 0, 9], 2), ([10, 30, 20], 3)])
def test_coarsening_ends_where_hardly_anything_goes(taken, rounds, monkeypatch):
    asked, gone = [], iter(taken)

    class Shrinking:
        faces = "faces"

        def __init__(self, points, faces, kind, n, trial):
            self.trial, self.next = trial, 0

        def collapse(self, most):
            asked.append(most)
            vertices = np.arange(self.next, self.next + next(gone))
            self.next += len(vertices)
            return vertices, np.full(len(vertices), 99)

    monkeypatch.setattr(coarse_surface, "_ShrinkingMesh", Shrinking)
    start = coarse_surface.Coarsening(
        np.zeros((100, 3)), np.zeros(100, bool), np.zeros(100), None, np.ones(100), np.full(100, 2.0), 100
    )
    found = start.towards(40, 3)
    left = 100 - np.cumsum([0, *taken])
    assert asked == [int(x) - 40 for x in left[:rounds]] and found.left == left[rounds] and found.faces == "faces"
    gone = 100 - found.left
    assert found.curvature[99] == 1 + gone and found.area[99] == 2 + 2 * gone
    assert start.curvature[99] == 1 and start.area[99] == 2


@pytest.mark.parametrize("mirror", [None, "mirror"])
def test_what_has_no_symmetric_cut_is_cut_without_symmetry(mirror, monkeypatch):
    asked = []

    @dataclass(frozen=True)
    class Found:
        mirror: object
        edges: np.ndarray
        coarse: object
        base: object = "base"

    def several(component, base, mirror, bound, trials, finer):
        asked.append((mirror, len(trials), finer))
        return done([] if mirror else [SimpleNamespace(score=1.0)])

    own = SimpleNamespace(options=SimpleNamespace(vertices=10), _several_grown=several)
    own._trials = lambda component, finer: 4
    own._grown_finer = lambda *given: search.SeamSearch._grown_finer(own, *given)
    component = SimpleNamespace(positions=np.zeros((3, 3)), ends=np.array([[0, 1]]))
    found = Found(mirror, np.array([0]), SimpleNamespace(positions=np.zeros((20, 3))))
    cut, _ = told(search.SeamSearch._grown_finer(own, component, found, 0.5))
    finer = min(1.5 * 2.0, 2.5)
    assert cut.score == 1.0 and asked == [(mirror, 3, finer)] * (mirror is not None) + [(None, 3, finer)]


# ---- flows ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("left", "far", "used", "best"),
    [
        ([5, 3, 4, 0], [], 4, 4),
        # The best of all is kept, and what moves something too far is none.
        ([5, 3, 4, 9, 9, 9], [], 6, 2),
        ([5, 3, 1], [3], 3, 2),
        ([], [1], 1, 0),
    ],
)
def test_affine_maps_of_more_rings_are_tried_while_pairs_are_left(left, far, used, best, monkeypatch):
    counts, asked = iter(left), []
    triangles = np.arange(60).reshape(20, 3)
    before, after = np.zeros((60, 3)), np.zeros((60, 3))
    before[:, 0] = np.arange(60)

    def blended(before, after, position, graph, seeds, free, rings):
        asked.append((rings, len(seeds)))
        return after + (1e9 if len(asked) in far else len(asked))

    def pairs_of(count):
        return np.column_stack([np.arange(count), np.arange(count) + 10])

    crossings = SimpleNamespace(
        before=before, faces=SimpleNamespace(triangles=triangles), pairs=lambda position, near: near,
        apart=lambda near: pairs_of(next(counts)),
    )  # fmt: skip
    monkeypatch.setattr(creases, "_blended", blended)
    monkeypatch.setattr(creases, "farthest_mended", lambda before, triangles: 100.0)
    monkeypatch.setattr(creases, "touched", lambda best, position, triangles: np.zeros(20, bool))
    start = pairs_of(6)
    position, pairs = creases._blended_all(after, crossings, None, (after, start))
    assert [a[0] for a in asked] == list(creases.RINGS[:used])
    assert [a[1] for a in asked] == [6, *left][:used]
    assert (position == after + best).all() and len(pairs) == (left[best - 1] if best else 6)


# ---- charts and bodies -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("rounds", [0, 3])
@pytest.mark.parametrize("works", ["at once", "evenly", "never"])
@pytest.mark.parametrize("many", [False, True])
def test_charts_that_cannot_be_triangulated_are_so_by_even_maps_or_refused(rounds, works, many, monkeypatch):
    asked = []
    count = 50 + many

    def triangulate(places, disk, loop, maps, boundary, inner):
        asked.append(maps)
        good = {"at once": True, "evenly": maps == ("even", "even"), "never": False}[works]
        return ("mesh", maps) if good else None

    def of_chart(k, density):
        return done(SimpleNamespace(pair=lambda strategy: ("a map", strategy), warnings=("told",)))

    monkeypatch.setattr(initial_mesh, "triangulate_chart", triangulate)
    monkeypatch.setattr(initial_mesh, "even_image", lambda *_: "even")
    chart = SimpleNamespace(vertex_ids=np.arange(3), vertices=None, disk=None, faces=np.array([1, 2]))
    component = SimpleNamespace(vertices=np.zeros((3, 3)), faces=np.array([7, 8, 9]))
    maps = SimpleNamespace(charts=[chart], component=component, of_chart=of_chart)
    boundary, options = SimpleNamespace(samples=np.arange(5)), SimpleNamespace(rounds=rounds, strategy="x")
    steps = initial_mesh._chart_mesh(maps, 0, None, boundary, count, None, options)
    mapped = many or not rounds
    if works == "never" and not rounds:
        with pytest.raises(errors.CrowdedError, match="2 triangles leaves no room") as caught:
            told(steps)
        assert list(caught.value.elements) == [8, 9]
        return
    mesh, warnings = told(steps)[0]
    if works == "never":
        assert mesh is None and warnings == ()
    elif works == "at once" and mapped:
        assert mesh == ("mesh", ("a map", "x")) and warnings == ("told",) and len(asked) == 1
    else:
        assert mesh == ("mesh", ("even", "even")) and warnings == () and len(asked) == 1 + mapped
    boundary.samples = np.arange(3)
    alone = told(initial_mesh._chart_mesh(maps, 0, None, boundary, 0, None, options))[0][0]
    assert alone.triangles.tolist() == [[0, 1, 2]] and not len(alone.points)


def test_polygons_of_many_sides_become_fans_at_their_density():
    """A prism of six sides: two hexagons and six quads; the lower hexagon is twice as dense."""
    angle = np.pi / 3 * np.arange(6)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    V = np.concatenate([np.column_stack([ring, np.full(6, z)]) for z in (0.0, 1.0)])
    F, of = [], []
    for k in range(6):
        a, b = k, (k + 1) % 6
        F += [[a, b, b + 6], [a, b + 6, a + 6]]
        of += [10 + k] * 2
    for k in range(1, 5):
        F += [[0, k + 1, k], [6, 6 + k, 7 + k]]
        of += [3, 4]
    F, of = np.array(F), np.array(of)

    @dataclass(frozen=True)
    class Closed:
        vertices: np.ndarray
        triangles: np.ndarray

    area = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2
    target = area * np.where(of == 3, 2.0, 1.0)
    given = polygon_surface.PolygonSurface(Closed(V, F), of, target)
    found = polygon_surface.with_polygon_fans(given)
    points, faces = found.surface.vertices, found.surface.triangles
    assert len(points) == 14 and sorted(map(tuple, points[12:].round(9))) == [(0, 0, 0), (0, 0, 1)]
    assert len(faces) == 12 + 12 and np.bincount(found.polygons).tolist() == [6, 6, 2, 2, 2, 2, 2, 2]
    a, b, c = points[faces].transpose(1, 0, 2)
    new = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    dense = np.where(found.polygons == 0, 2.0, 1.0)
    np.testing.assert_allclose(found.target, new / 2 * dense)
    assert polygon_surface.with_polygon_fans(polygon_surface.PolygonSurface(Closed(V, F), None, target)) is None
    quads = of >= 10
    only = polygon_surface.PolygonSurface(Closed(V, F[quads]), of[quads], target[quads])
    assert polygon_surface.with_polygon_fans(only) is None


def test_pairs_of_points_and_triangles_have_the_angles_between_them():
    rng = np.random.default_rng(0)
    V, F = meshes.icosphere(1)
    points = rng.normal(size=(4, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points[3] = -V[0]
    found = reference._pairs(V, F, points)
    assert found.face.tolist() == np.repeat(np.arange(len(F)), 4).tolist()
    assert found.site.tolist() == [0, 1, 2, 3] * len(F) and not found.last.any()
    for row in (0, 3, 17, len(F) * 4 - 1):
        cosine = np.clip(V[F[found.face[row]]] @ points[found.site[row]], -1, 1)
        np.testing.assert_allclose(found.squared[row], np.arccos(cosine) ** 2, atol=1e-6)
        assert found.nearest[row] == found.squared[row].min() and found.farthest[row] == found.squared[row].max()
