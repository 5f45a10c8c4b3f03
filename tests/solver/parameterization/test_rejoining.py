"""Charts joined again: across wide borders and no necks, with their images, and only where the bound still holds."""

from dataclasses import replace
from types import SimpleNamespace

import bodies
import meshes
import numpy as np
import pytest
from scripted_steps import worked

from omt_uv.solver.analysis.symmetry_plane import MirrorImages
from omt_uv.solver.cutting.cuts import Cuts
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import edge_lengths
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_edges, pair_keys
from omt_uv.solver.parameterization import rejoining
from omt_uv.solver.parameterization.chart_indices import edge_set
from omt_uv.solver.parameterization.options import ShearBound, UnwrapOptions
from omt_uv.solver.parameterization.shear_search import Round, ShearSearch
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain

BOUND = 1.3


def column(n, k):
    """Edges (n,2) up the column k of vertices of `meshes.grid(n, n)`."""
    (points,) = (np.arange(n + 1) * (n + 1) + k,)
    return np.stack([points[:-1], points[1:]], axis=1)


def round_of(search, edges, shear=1.1, order=1):
    """A round along edges (k,2), its charts in one order or the other, mapped flat with a shear, or that of each."""
    charts = strict_charts(replace(search.surface, seams=edges))[::order]
    shears = np.broadcast_to(shear, len(charts))
    maps = [
        SimpleNamespace(uv=c.vertices[:, :2] * [s**0.5, s**-0.5], angle_mean=s, area_l1=0, folds=0, failure=None)
        for c, s in zip(charts, shears, strict=True)
    ]
    length = float(edge_lengths(search.surface.positions, edges).sum())
    return Round.of(search, charts, maps, Cuts(edges, length, (), edges[:0], ()), {})


def square(n, images=None, keep=None):
    """A flat square of n by n, or the triangles (m,) bool of it that are kept, the search for a bound of its shear."""
    V, F = meshes.grid(n, n)
    middle = V[F].mean(axis=1)
    F = F if keep is None else F[keep(middle)]
    search = ShearSearch(triangle_surface(V, F), None, ShearBound(BOUND), None, {})
    search.__dict__["images"] = images
    return search


def joined_again(search, last, begun=None, shear=1.1, asked=None):
    """What `rejoined` makes of a round where all that is cut anew shears so."""

    def cut(last, kept, most):
        if asked is not None:
            asked.append(edge_set(kept))
        return worked(round_of(search, kept, shear))

    return drain(rejoining.rejoined(search, begun or round_of(search, last.cuts.edges[:0]), last, cut))


@pytest.mark.parametrize("order", [1, -1])
def test_what_is_wide_is_joined_and_leaves_no_seam(order):
    search = square(8)
    last = round_of(search, np.concatenate([column(8, 2), column(8, 4)]), order=order)
    found = joined_again(search, last)
    assert len(last.charts) == 3 and len(found.charts) == 1 and not len(found.cuts.edges)


@pytest.mark.parametrize("width, joined", [(0.4, False), (0.8, True)])
def test_a_neck_stays(width, joined):
    """Two squares that hang together by a bridge: 0.4 and 0.8 wide, of halves whose side is 0.6 and 0.7."""
    search = square(10, keep=lambda p: (np.abs(p[:, 0] - 0.5) > 0.2) | (np.abs(p[:, 1] - 0.5) < width / 2))
    V, edges = search.surface.positions, column(10, 5)
    used = np.isin(edges, search.surface.corner_vertex).all(axis=1) & (np.abs(V[edges].mean(axis=1)[:, 1] - 0.5) < 0.4)
    last = round_of(search, edges[used & (np.abs(V[edges].mean(axis=1)[:, 1] - 0.5) < width / 2)])
    assert len(last.charts) == 2
    assert (joined_again(search, last) is last) != joined


def test_of_two_borders_that_are_images_both_go_or_neither_does():
    n = 8
    V = meshes.grid(n, n)[0]
    image = np.array([np.argmin(np.abs(V - [1 - x, y, z]).sum(axis=1)) for x, y, z in V])
    search, edges = square(n, MirrorImages.of(image)), np.concatenate([column(n, 2), column(n, 6)])
    asked = []
    found = joined_again(search, round_of(search, edges), asked=asked)
    assert len(found.charts) == 1 and asked == [edge_set(edges[:0])]
    # Without a mirror they go one by one.
    asked = []
    joined_again(square(n), round_of(square(n), edges), asked=asked)
    assert len(asked) == 2


def test_a_slit_goes_with_the_border_it_hung_on_and_one_from_the_outline_stays():
    search, floats, hangs = square(8), np.array([[40, 41], [41, 42]]), np.array([[26, 25], [25, 24]])
    asked = []
    last = round_of(search, np.concatenate([column(8, 4), floats, hangs]))
    assert edge_set(joined_again(search, last, asked=asked).cuts.edges) == edge_set(hangs)
    assert asked == [edge_set(hangs)]
    # What helps stays where nothing is gained without it.
    asked = []
    joined_again(search, last, shear=1.31, asked=asked)
    assert asked == [edge_set(hangs), edge_set(np.concatenate([floats, hangs]))]


def test_of_a_closed_body_what_hangs_together_most_still_opens_it():
    V, F = meshes.icosphere(2)
    search = ShearSearch(triangle_surface(V, F), None, ShearBound(BOUND), None, {})
    outline = boundary_edges(F[V[F].mean(axis=1)[:, 2] > 0])
    long, short = meshes.climbed(V, F, int(outline[0, 0]), 3, 1), meshes.climbed(V, F, int(outline[-1, 0]), 2, -1)
    edges = np.concatenate([outline, long, short])
    charts = round_of(search, edges).charts
    assert len(charts) == 2
    ways = rejoining._ways(edges, pair_keys(*outline.T), charts)
    assert [edge_set(way) for way in ways] == [edge_set(long), edge_set(np.concatenate([long, short]))]


def test_what_was_apart_before_stays():
    search, edges = square(8), np.concatenate([column(8, 2), column(8, 4)])
    begun, last = round_of(search, column(8, 2)), round_of(search, edges)
    found = joined_again(search, last, begun)
    assert edge_set(found.cuts.edges) == edge_set(column(8, 2))


@pytest.mark.parametrize(
    "shears, tried",
    [((1.1, 1.1), True), ((1.0, 1.1), False), ((1.0, 1.001), False), ((1.29, 1.29), False), ((1.1, 1.29), True)],
)
def test_what_lies_flat_and_what_would_miss_the_bound_is_not_tried(shears, tried):
    search, asked = square(8), []
    last = round_of(search, column(8, 4), shears)
    joined_again(search, last, asked=asked)
    assert bool(asked) == tried


def test_what_shears_too_much_or_has_no_map_or_sprawls_is_not_taken(monkeypatch):
    search, asked = square(8), []
    last = round_of(search, column(8, 4))
    assert joined_again(search, last, shear=1.31, asked=asked) is last and len(asked) == 1
    assert joined_again(search, last, shear=1.29) is not last
    monkeypatch.setattr(rejoining, "may_come_apart", lambda *_: True)
    assert joined_again(search, last) is last


@pytest.mark.parametrize("what", ["an error", "the end", "seams as long", "as many charts"])
def test_a_joint_that_came_to_nothing_leaves_all_as_it_was(what):
    search = square(8)
    last, asked = round_of(search, column(8, 4)), []
    around = np.array([1, 10, 9])
    corner = np.stack([around[:-1], around[1:]], axis=1)

    def cut(round_, kept, most):
        if what == "an error":
            raise FoldedUVError("It folds", "Do not", "face", np.zeros(1, int))
        other = {"seams as long": column(8, 3), "as many charts": corner}.get(what)
        asked.append(most)
        return worked(None if other is None else last if what == "seams as long" else round_of(search, other))

    assert drain(rejoining.rejoined(search, round_of(search, last.cuts.edges[:0]), last, cut)) is last
    # Half of the border, one unit long, has to be saved.
    assert asked == [0.5] * (what != "an error")


def test_no_more_is_tried_than_is_worth_the_time(monkeypatch):
    search, edges = square(12), np.concatenate([column(12, k) for k in range(1, 12)])
    last, counts = round_of(search, edges), []
    for trials, mapped in ((3, 9000), (30, 9000), (30, 50)):
        monkeypatch.setattr(rejoining, "MOST_TRIALS", trials)
        monkeypatch.setattr(rejoining, "MOST_MAPPED", mapped)
        asked = []
        joined_again(search, last, shear=1.31, asked=asked)
        # No joint is tried twice.
        assert len(set(asked)) == len(asked)
        counts.append(len(asked))
    # Two charts of 26 vertices each time, of 312 in all.
    assert counts == [3, 11, 6]


def test_a_second_way_to_join_two_charts_takes_nothing_from_those_that_come_after(monkeypatch):
    """However it ended: with and without what floats within, the next border is tried all the same."""
    search, floats = square(12), np.array([[18, 17], [17, 16]])
    monkeypatch.setattr(rejoining, "MOST_MAPPED", 300)
    for slits in (floats[:0], floats):
        asked = []
        last = round_of(search, np.concatenate([column(12, 5), column(12, 9), slits]))
        joined_again(search, last, shear=1.31, asked=asked)
        assert len(asked) == 2 + len(slits) // 2


def test_a_round_that_misses_the_bound_is_left_alone():
    search, asked = square(8), []
    last = round_of(search, column(8, 4), (1.5, 1.1))
    assert joined_again(search, last, asked=asked) is last and not asked


def test_a_body_with_legs_has_shorter_seams_and_keeps_the_bound(monkeypatch):
    """Nothing of it is lost, and what shears less than it may without joints shears more with them."""
    rng = np.random.default_rng(4)
    V, F = bodies.icosphere(3)
    out = rng.normal(size=(4, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    surface = triangle_surface(V * (1 + 3.5 * np.exp(12 * (V @ out.T - 1)).max(axis=1, keepdims=True)), F)
    found = []
    for trials in (0, rejoining.MOST_TRIALS):
        monkeypatch.setattr(rejoining, "MOST_TRIALS", trials)
        found.append(drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35))))
    apart, joined = found
    lengths = [edge_lengths(surface.positions, one.seams).sum() for one in found]
    assert len(joined.charts) < len(apart.charts) and lengths[1] < 0.95 * lengths[0]
    assert max(one.angle_mean for one in joined.maps) <= 1.35 and not joined.warnings
    assert not sum(one.folds for one in joined.maps)
    assert sorted(np.concatenate([one.faces for one in joined.charts]).tolist()) == list(range(len(F)))


@pytest.mark.parametrize("what", ["an error", "as it is", "mapped"])
def test_only_joints_that_were_mapped_use_up_the_vertices_that_may_be(monkeypatch, what):
    """No more are mapped than all charts have; what was not mapped leaves room for all others."""
    monkeypatch.setattr(rejoining, "MOST_MAPPED", 0)
    search = square(8)
    last, asked = round_of(search, np.concatenate([column(8, k) for k in (2, 4, 6)])), []

    def cut(round_, kept, most):
        asked.append(len(kept))
        if what == "an error":
            raise FoldedUVError("It folds", "Do not", "face", np.zeros(1, int))
        return worked(last if what == "as it is" else round_of(search, kept, 1.31))

    assert drain(rejoining.rejoined(search, round_of(search, last.cuts.edges[:0]), last, cut)) is last
    # Two of four strips have half of all vertices.
    assert len(asked) == (2 if what == "mapped" else 3)
