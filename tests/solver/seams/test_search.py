"""The search for seams: what it promises of the predicted scale, of symmetry, and of what is left to be a disk."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from scipy.sparse import csr_matrix
from sphere_shapes import blob

from omt_uv.solver.analysis.seam_costs import seam_costs
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.seams import coarse_cut, growth, improvement, search
from omt_uv.solver.seams.coarse_surface import coarsening
from omt_uv.solver.seams.cut_tree import Removal, Task, cut_along, leaves, stretches
from omt_uv.solver.seams.growth import grow
from omt_uv.solver.seams.improvement import improved, trimmed
from omt_uv.solver.seams.options import SearchOptions
from omt_uv.solver.seams.path_graph import PathGraph, path_graph
from omt_uv.solver.seams.predicted_scale import ScaleModel
from omt_uv.solver.seams.search import SeamSearch


@pytest.fixture(scope="module")
def cap():
    return coarsening(*meshes.cap(20, 40, 0.9), 300).ended(300)


def task_of(coarse, bound):
    n = len(coarse.kept)
    graph = path_graph(coarse, np.ones(n), coarse.boundary)
    return Task(graph, ScaleModel.of(coarse), bound, np.ones(n))


def test_a_cut_by_green_functions_is_that_of_a_new_solve(cap):
    model, vertices = ScaleModel.of(cap), np.flatnonzero(~cap.boundary)[:12]
    cut = model.cut(vertices)
    assert np.isclose(cut.spread, model.spread_cut(vertices), rtol=1e-6) and cut.spread < model.spread
    assert np.abs(cut.plate.value[vertices]).max() < 1e-6 * np.abs(model.plate.value).max()
    # Cut one after another, it is the same.
    twice = model.cut(vertices[:5]).cut(vertices[5:])
    assert np.allclose(twice.scale, cut.scale, atol=1e-5 * np.abs(cut.scale).max())
    one = vertices[:1]
    assert np.isclose(model.gain(one)[0], model.spread - model.spread_cut(one), rtol=1e-6)


def test_what_is_held_already_saves_nothing(cap):
    """Cut twice, or among its neighbours so often that nothing is left but rounding."""
    model = ScaleModel.of(cap)
    inner = np.flatnonzero(~cap.boundary)
    cut = model.cut(inner[:40])
    for again in (inner[:1], inner[3:4], inner[:7]):
        assert abs(cut.spread_cut(again) - cut.spread) <= 1e-6 * model.spread
        assert np.isfinite(cut.cut(again).scale).all()


def test_a_flat_surface_has_no_scale():
    V, F = meshes.grid(12, 12)
    assert np.abs(ScaleModel.of(coarsening(V * [1, 1, 0], F, 1000).ended(1000)).scale).max() < 1e-9


def test_growth_keeps_the_bound_and_lowers_the_spread_with_every_arc(cap):
    task = task_of(cap, 0.02)
    cut = cut_along(task, np.zeros(0, np.int64))
    spreads = [cut.spread]
    while cut.spread > task.bound:
        cut = grow(task, cut, 1)
        spreads.append(cut.spread)
    assert (np.diff(spreads) < 0).all() and len(spreads) < 30
    short = trimmed(task, cut)
    assert short.spread <= task.bound and short.cost <= cut.cost
    *_, better = improved(task, short, 4)
    assert better.spread <= task.bound and better.score(task.bound) <= short.score(task.bound)
    parts = stretches(task.graph, better.steps)
    assert np.array_equal(np.sort(np.concatenate(parts)), better.steps)
    assert 0 < len(leaves(task.graph, better.steps)) <= len(parts)


def test_what_is_taken_back_grows_anew_once(cap, monkeypatch):
    task = task_of(cap, 0.02)
    cut = trimmed(task, grow(task, cut_along(task, np.zeros(0, np.int64)), 30))
    asked, ask = [], improvement.grow
    monkeypatch.setattr(improvement, "grow", lambda *given: asked.append(given[1].steps.tobytes()) or ask(*given))
    found = list(improved(task, cut, 40))
    assert len(found) == 40 and 0 < len(asked) == len(set(asked)) < 40


def test_what_a_cut_loses_is_told_without_a_new_solve(cap):
    task = task_of(cap, 0.01)
    cut = grow(task, cut_along(task, np.zeros(0, np.int64)), 6)
    without, found = Removal.of(task, cut), leaves(task.graph, cut.steps)
    assert len(found) > 1
    for leaf in found:
        for count, loss in enumerate(without.losses(leaf), start=1):
            other = cut_along(task, np.setdiff1d(cut.steps, leaf[:count]))
            assert np.isclose(cut.spread + loss, other.spread, rtol=1e-6)


def test_what_every_part_of_a_path_saves_is_told_at_once(cap):
    model = task_of(cap, 0.01).model
    vertices = np.random.default_rng(0).permutation(np.flatnonzero(~cap.boundary))[:12]
    each = [model.spread - model.spread_cut(vertices[:count]) for count in range(1, 13)]
    assert np.allclose(model.falls(vertices), each, rtol=1e-6)


def found(V, F, spread=0.03):
    surface = triangle_surface(V, F)
    search = SeamSearch(np.full(len(F), spread), surface, lambda: seam_costs(surface))
    return cut_to_disks(surface, search=search)


@pytest.mark.parametrize("name", ["cap", "icosphere", "torus"])
def test_what_is_cut_is_one_disk(name):
    V, F = {"icosphere": lambda: meshes.icosphere(3), "cap": lambda: meshes.cap(20, 40, 0.8), "torus": meshes.torus}[
        name
    ]()
    charts = found(V, F).charts
    # `cut_to_disks` refuses what is no disk.
    assert len(charts) == 1 and len(charts[0].triangles) == len(F)


def test_seams_of_a_symmetric_body_are_symmetric():
    V, F, image, _ = bent_cap()
    edges = np.sort(found(V, F, 0.005).cuts.edges, axis=1)
    keys = set(map(tuple, edges.tolist()))
    assert len(keys) > 8 and keys == set(map(tuple, np.sort(image[edges], axis=1).tolist()))


def bent_cap():
    """A cap that is its own image in x alone, the image (n,) of every vertex, and those in the plane in order (k,)."""
    V, F = meshes.cap(16, 32, 0.9)
    turn = np.arctan2(V[:, 1], V[:, 2])
    V = V * [1.0, 1.3, 1.7] + 0.3 * np.stack([0 * V[:, 0], V[:, 2] ** 2, V[:, 1] * V[:, 2]], axis=1)
    image = np.array([np.argmin(np.linalg.norm(V - p * [-1, 1, 1], axis=1)) for p in V])
    plane = np.flatnonzero(image == np.arange(len(V)))
    return V, F, image, plane[np.argsort(turn[plane])]


def test_seams_are_symmetric_where_the_plane_runs_through_some_faces(monkeypatch):
    """Edges in the plane that are turned run across it, and no cut follows it there; whatever it costs then."""
    monkeypatch.setattr(search, "EXACTLY", np.inf)
    monkeypatch.setattr(coarse_cut, "STUCK", np.inf)
    V, F, image, plane = bent_cap()
    for k in (9, 22):
        ends = plane[[k, k + 1]]
        pair = np.flatnonzero(np.isin(F, ends).sum(axis=1) == 2)
        across = F[pair][~np.isin(F[pair], ends)]
        assert len(pair) == 2
        # As the faces beside them look, which have the edge from one end to the other.
        first = F[pair[0]].tolist()
        forward = first[(first.index(ends[0]) + 1) % 3] == ends[1]
        one, other = across if forward else across[::-1]
        F = np.concatenate([np.delete(F, pair, axis=0), [[one, ends[0], other], [other, ends[1], one]]])
    edges = np.sort(found(V, F, 0.005).cuts.edges, axis=1)
    keys = set(map(tuple, edges.tolist()))
    assert len(keys) > 8 and keys == set(map(tuple, np.sort(image[edges], axis=1).tolist()))


def test_scale_does_not_matter():
    V, F = meshes.cap(12, 24, 0.9)
    a, b = found(V, F).cuts.edges, found(128.0 * V, F).cuts.edges
    assert np.array_equal(a, b)


def test_options_have_to_be_sound():
    assert SearchOptions().rounds > 0


def test_a_search_that_goes_on_leaves_a_share_of_the_spread():
    V, F = meshes.cap(20, 40, 0.9)
    surface = triangle_surface(V, F)
    search = SeamSearch(np.full(len(F), 0.02), surface, lambda: seam_costs(surface))
    first = cut_to_disks(surface, search=search).cuts
    again = cut_to_disks(surface, search=replace(search, share=np.full(len(F), 0.4))).cuts
    assert 0 < first.length < again.length


@pytest.mark.parametrize("how", [{"share": 0.9}, {"share": 0.4, "adding": True}])
def test_what_nearly_keeps_the_bound_stays_and_more_is_cut(how):
    V, F = meshes.cap(20, 40, 0.9)
    surface = triangle_surface(V, F)
    search = SeamSearch(np.full(len(F), 0.02), surface, lambda: seam_costs(surface))
    first = cut_to_disks(surface, search=search).cuts
    (found,) = search.memory.values()
    more = replace(search, **how | {"share": np.full(len(F), how["share"])})
    again = cut_to_disks(surface, search=more).cuts
    (grown,) = search.memory.values()
    assert again.length > first.length
    assert grown.coarse is found.coarse and {*found.steps.tolist()} < {*grown.steps.tolist()}


def test_what_is_flat_once_it_is_cut_is_searched_again():
    # A cone that is cut to its tip has no spread left, of which a share is asked for.
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    V = np.concatenate([[[0, 0, 1.0]], np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])])
    F = np.column_stack([np.zeros(24, np.int64), 1 + np.arange(24), 1 + (np.arange(24) + 1) % 24])
    surface = triangle_surface(V, F)
    search = SeamSearch(np.full(len(F), 1e-4), surface, lambda: seam_costs(surface))
    first = cut_to_disks(surface, search=search).cuts.edges
    again = cut_to_disks(surface, search=replace(search, share=np.full(len(F), 0.5))).cuts.edges
    assert len(first) and np.array_equal(first, again)


def test_what_shears_more_than_was_predicted_is_cut_though_nothing_was_before():
    V, F = meshes.cap(20, 40, 0.5)
    surface = triangle_surface(V, F)
    search = SeamSearch(np.full(len(F), 10.0), surface, lambda: seam_costs(surface))
    assert not len(cut_to_disks(surface, search=search).cuts.edges)
    assert len(cut_to_disks(surface, search=replace(search, share=np.full(len(F), 0.5))).cuts.edges)


def test_what_does_not_come_apart_as_drawn_keeps_the_seams_it_had(monkeypatch):
    V, F = meshes.cap(20, 40, 0.5)
    surface = triangle_surface(V, F)
    search = SeamSearch(np.full(len(F), 0.01), surface, lambda: seam_costs(surface))
    edges = cut_to_disks(surface, search=search).cuts.edges
    assert len(edges)
    monkeypatch.setattr(SeamSearch, "_best", None)
    assert np.array_equal(cut_to_disks(surface, search=replace(search, as_drawn=True)).cuts.edges, edges)
    with pytest.raises(TypeError):
        cut_to_disks(surface, search=replace(search, as_drawn=True, memory={}))


def test_a_net_is_taken_first_and_searched_for_once_its_map_has_missed_the_bound(monkeypatch):
    surface = triangle_surface(*meshes.subdivide(*meshes.cube()))
    count, searched = len(surface.face_start) - 1, []

    def recorded(self, component, base):
        searched.append(component.vertex_count)
        return np.arange(len(component.pair)) < 3
        yield

    monkeypatch.setattr(SeamSearch, "__call__", recorded)
    search = SeamSearch(np.full(count, 1e-3), surface, lambda: seam_costs(surface))
    net = cut(surface, search=search)
    assert not searched and net.length == pytest.approx(7 * np.ptp(surface.positions, axis=0).max())
    cut(surface, search=replace(search, share=np.full(count, 0.5)))
    assert searched == [len(surface.positions)]


def symmetric_arcs_end(monkeypatch):
    """Symmetric cuts have nothing to grow, as where the plane of a mirror passes between the vertices."""
    grown = SeamSearch._grown

    def ended(self, task, cut=None):
        if task.graph.image is not None and (task.graph.image != np.arange(len(task.graph.image))).any():
            return cut_along(task, np.zeros(0, np.int64))
        return (yield from grown(self, task, cut))

    monkeypatch.setattr(SeamSearch, "_grown", ended)


def test_where_symmetric_cuts_have_nothing_left_to_grow_others_are_found(monkeypatch):
    V, F = meshes.two_bumps(20)
    surface, bound = triangle_surface(V, F), 0.02
    search = SeamSearch(np.full(len(F), bound), surface, lambda: seam_costs(surface))
    assert seam_costs(surface).plane is not None
    first = cut_to_disks(surface, search=search)
    (found,) = search.memory.values()
    assert len(first.cuts.edges) and found.mirror is not None
    symmetric_arcs_end(monkeypatch)
    free = replace(search, memory={})
    assert len(cut_to_disks(surface, search=free).cuts.edges)
    (other,) = free.memory.values()
    assert other.mirror is None and len(other.steps)
    # What was found with a mirror goes on without where that is stuck.
    again = replace(search, memory=dict(search.memory), share=np.full(len(F), 0.1))
    cut_to_disks(surface, search=again)
    (further,) = again.memory.values()
    assert further.mirror is None and len(further.steps)


def test_the_model_of_what_was_found_last_is_not_made_again(monkeypatch):
    V, F = meshes.two_bumps(12)
    surface, made, of = triangle_surface(V, F), [], ScaleModel.of
    search = SeamSearch(np.full(len(F), 0.02), surface, lambda: seam_costs(surface))
    cut_to_disks(surface, search=search)
    monkeypatch.setattr(ScaleModel, "of", staticmethod(lambda *given: made.append(given) or of(*given)))
    again = replace(search, memory=dict(search.memory), share=np.ones(len(F)), adding=True)
    known = cut_to_disks(surface, search=again).cuts
    assert not made
    # Without it, it is made anew and the same.
    anew = replace(search, memory=dict(search.memory), share=np.ones(len(F)), adding=True, models={})
    np.testing.assert_array_equal(cut_to_disks(surface, search=anew).cuts.edges, known.edges)
    assert len(made) == 1


def test_a_path_may_leave_the_mirror_plane_and_not_come_back():
    """One step that comes back is enough, whatever the others do; a path within the plane never left it."""
    ends = np.array([[0, 1], [1, 2], [1, 4], [2, 3], [4, 5]])
    n, count = 6, np.arange(1, 6)
    both = np.concatenate([ends, ends[:, ::-1]])
    matrix, keys = csr_matrix((np.tile(count * 1.0, 2), both.T), shape=(n, n)), ends @ [n, 1]
    # 0 is on the boundary, 1 and 2 are in the plane, and so is 5, behind 4, which is not.
    boundary, in_plane = np.arange(n) == 0, np.isin(np.arange(n), [0, 1, 2, 5])
    graph = PathGraph(ends, count * 1.0, boundary, np.arange(n), matrix, keys, in_plane)
    np.testing.assert_array_equal(graph.steps_of(np.array([5, 4, 1, 2, 3])), [4, 2, 1, 3])
    assert graph.is_open(np.array([0, 1, 3])) and graph.is_open(np.array([0, 2]))
    assert not graph.is_open(np.array([4, 2, 0])) and not graph.is_open(np.arange(5))
    assert replace(graph, in_plane=np.zeros(n, bool)).is_open(np.arange(5))


def test_a_density_counts_by_its_ratios_alone():
    V, F = blob(3, seed=2)
    surface = triangle_surface(V, F)
    density = np.exp(1.5 * V[F].mean(axis=1)[:, 0])
    cuts = [
        cut(
            surface, search=SeamSearch(np.full(len(F), 0.1), surface, lambda: seam_costs(surface), density=c * density)
        ).edges
        for c in (1.0, 1e3)
    ]
    assert len(cuts[0]) and np.array_equal(*cuts)


@pytest.mark.parametrize("share", [0.9, 0.5, 0.1])
@pytest.mark.parametrize("worth", [0.0, np.inf])
def test_what_has_no_cut_gets_its_best_arc_whatever_that_is_worth_and_others_have_to_be_worth_theirs(
    monkeypatch, cap, share, worth
):
    task = task_of(cap, 0.0)
    task = replace(task, bound=share * task.model.spread)
    monkeypatch.setattr(growth, "LEAST_WORTH", worth)
    whole = cut_along(task, np.zeros(0, np.int64))
    found = list(growth.growing(task, whole))
    assert found and len(found[0].steps) and found[0].spread < whole.spread
    assert len(found) == 1 or worth == 0
    assert worth == 0 or not list(growth.growing(task, found[0]))
