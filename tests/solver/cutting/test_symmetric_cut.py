"""Cuts of bodies that are their own mirror image: symmetric, and into one disk."""

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from meshes import polygon_surface
from short_cuts import component_of

from omt_uv.solver.cutting import cuts as cuts_module
from omt_uv.solver.cutting import symmetric_cut as symmetric_cuts
from omt_uv.solver.cutting.cut_graph import is_disk
from omt_uv.solver.cutting.cuts import DEARER, STEEPER_OUTLINED, cut
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.cutting.protrusions import disk_spread, outline_spread
from omt_uv.solver.cutting.symmetric_cut import outlined_cut, symmetric_cut, symmetric_halves
from omt_uv.solver.mesh.mirror import find_mirror
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.mesh.topology import pair_keys


def figure(*holes: str, side: int = 4) -> Surface:
    """A body of quads that is its own image in x alone, on a grid: two limbs above, a tail below; open where told."""
    cells = {(x, y, z) for x in range(-3, 3) for y in range(2 * side) for z in range(-2, 2)}
    cells |= {(x, y, z) for x in (-3, 2) for y in range(2 * side, 4 * side) for z in range(-1, 1)}
    cells |= {(x, -1 - y, 1) for x in (-1, 0) for y in range(side)}
    sides = []
    for axis in range(3):
        for sign in (0, 1):
            step = np.eye(3, dtype=int)[axis] * (2 * sign - 1)
            corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]][:: 2 * sign - 1])
            square = np.insert(corners, axis, sign, axis=1)
            sides += [np.array(c) + square for c in cells if tuple(np.array(c) + step) not in cells]
    quads = np.array(sides)
    middle = quads.mean(axis=1)
    gone = np.zeros(len(quads), dtype=bool)
    if "limbs" in holes:
        gone |= middle[:, 1] == 4 * side
    if "front" in holes:
        gone |= (middle[:, 2] == -2) & (np.abs(middle[:, 0]) < 1) & (np.abs(middle[:, 1] - side) < 1)
    if "tail" in holes:
        gone |= middle[:, 1] == -side
    V, ids = np.unique(quads[~gone].reshape(-1, 3), axis=0, return_inverse=True)
    V = V + 0.1 * np.sin(V * [0, 1.3, 0.7]) + np.column_stack([0.05 * V[:, 0] * np.cos(V[:, 1]), 0 * V[:, 1:]])
    return polygon_surface(V.astype(float), ids.reshape(-1, 4).tolist())


def is_symmetric(surface: Surface, edges: np.ndarray) -> bool:
    mirror = find_mirror(surface.positions, surface.corner_vertex[surface.triangles], surface.triangle_face)
    return bool(np.isin(pair_keys(*mirror.image[edges].T), pair_keys(*edges.T)).all())


@pytest.mark.parametrize("holes", [[], ["limbs"], ["front", "limbs"], ["tail", "limbs"], ["tail", "front"],
                                   ["tail", "front", "limbs"]])  # fmt: skip
@pytest.mark.parametrize("extremities", [0, 8])
def test_a_figure_is_cut_symmetrically_into_one_disk(holes, extremities):
    surface = figure(*holes)
    found = cut_to_disks(surface, extremities=extremities)
    assert len(found.charts) == 1 and len(found.cuts.edges)
    assert is_symmetric(surface, found.cuts.edges)


def both_cuts(monkeypatch, surface, seams, extremities):
    """The component of a surface, and its cuts (e,) bool, symmetric or not and never so."""
    found, chosen = [], cuts_module.cut_component

    def compared(component, *given):
        found[:] = [component, chosen(component, *given)[0], cuts_module._plain_cut(component, *given[:3])[0]]
        return found[1], np.zeros(0, np.int64)

    monkeypatch.setattr(cuts_module, "cut_component", compared)
    cut_to_disks(surface, seams=seams, extremities=extremities)
    return found


@pytest.mark.parametrize("holes", [[], ["limbs"], ["front", "limbs"], ["tail", "front", "limbs"]])
@pytest.mark.parametrize("seams", ["auto", "outlined"])
@pytest.mark.parametrize("extremities", [0, 8])
def test_symmetry_has_its_price_and_no_more(monkeypatch, holes, seams, extremities):
    """Symmetric cuts are at most half as dear again as others, and in an outline leave not much more distortion."""
    component, found, plain = both_cuts(monkeypatch, figure(*holes), seams, extremities)
    assert component.cost[found].sum() <= DEARER * component.cost[plain].sum()
    if seams == "outlined":
        assert outline_spread(component, found) <= STEEPER_OUTLINED * outline_spread(component, plain)


def component_cut(monkeypatch, surface):
    """The one component of a surface that is to be cut."""
    return both_cuts(monkeypatch, surface, "auto", 8)[0]


def test_any_piece_of_the_plane_may_stay_uncut(monkeypatch):
    """Between the holes of the front and of the tail the plane has two pieces; each is whole in a cut of its own."""
    component = component_cut(monkeypatch, figure("tail", "front"))
    halves = symmetric_halves(component)
    assert len(halves) == 2
    cost = [half.component.cost[half.edges[half.line]].sum() for half in halves]
    assert cost[0] >= cost[1]
    for half, other in (halves, halves[::-1]):
        found, _ = symmetric_cut(half, 0, 0.0)
        assert is_disk(component, found)
        assert not found[half.edges[half.line]].any() and found[other.edges[other.line]].all()


@pytest.mark.parametrize("holes", [[], ["limbs"], ["tail", "front"], ["tail", "front", "limbs"]])
def test_in_an_outline_cuts_spread_less_than_where_it_is_free(monkeypatch, holes):
    """What the outlined cut leaves of a conformal map onto a disk is not above what the other leaves."""
    component = component_cut(monkeypatch, figure(*holes))
    halves = symmetric_halves(component)
    free, _ = symmetric_cut(halves[0], 8, 0.25)
    found, _ = outlined_cut(halves, 8, 0.25)
    assert is_disk(component, found)
    assert disk_spread(component, found) <= 1.1 * disk_spread(component, free)


def test_where_the_plane_runs_through_polygons_twice_nothing_is_cut_symmetrically():
    # A tube of an odd number of quads across would have to be cut through the middle of some.
    found = cut_to_disks(meshes.polygon_surface(*open_box(3)))
    assert len(found.charts) == 1 and len(found.cuts.edges) == 7
    surface = meshes.polygon_surface(*open_box(4))
    assert is_symmetric(surface, cut_to_disks(surface).cuts.edges)


def open_box(across: int) -> tuple[np.ndarray, list]:
    """A tube of quads, `across` of them wide, 5 deep and 7 high, without ends."""
    ring = [(x, 0) for x in range(across)] + [(across, z) for z in range(5)]
    ring += [(across - x, 5) for x in range(across)] + [(0, 5 - z) for z in range(5)]
    n = len(ring)
    V = np.array([(x, y, z + 0.2 * x * (across - x) + 0.1 * y) for y in range(8) for x, z in ring], float)
    quads = [[y * n + k, y * n + (k + 1) % n, (y + 1) * n + (k + 1) % n, (y + 1) * n + k]
             for y in range(7) for k in range(n)]  # fmt: skip
    return V, quads


def prism(sides: int) -> tuple[np.ndarray, list]:
    """A tube of quads with so many sides, an odd number, without ends: its own image in x alone, in a plane through a
    row of vertices and, opposite to it, through the midst of a row of quads."""
    angle = 2 * np.pi * np.arange(sides) / sides
    V = [((1 + 0.1 * y) * np.sin(a), y, np.cos(a) + 0.1 * y * y) for y in range(5) for a in angle]
    rows, along = sides * np.arange(4)[:, None], np.arange(sides)
    onwards = (along + 1) % sides
    quads = [rows + along, rows + onwards, rows + sides + onwards, rows + sides + along]
    return np.array(V), np.stack(quads, axis=2).reshape(-1, 4).tolist()


@pytest.mark.parametrize("over", [False, True])
@pytest.mark.parametrize("sides", [7, 9, 11])
def test_a_line_through_the_midst_of_polygons_ends_at_both_boundaries(monkeypatch, sides, over):
    """It ends at the sides that it crosses there, by their ends in the half, whichever way round polygons are."""
    V, quads = prism(sides)
    component = component_cut(monkeypatch, polygon_surface(V, [q[::-1] if over else q for q in quads]))
    (half,) = symmetric_halves(component)
    ends = np.flatnonzero(half.line_ends)
    assert len(ends) == 2 and half.side[ends].all() and half.on_line[ends].any() == half.on_line[ends].all()
    at = component.positions
    beside = np.linalg.norm(at[ends] - at[half.image[ends]], axis=1)
    assert sorted(at[ends, 1]) == pytest.approx([at[:, 1].min(), at[:, 1].max()])
    # One side of each boundary, of which one is larger than the other, whatever the unit.
    outline = [np.ptp(at[np.isclose(at[:, 1], level), 0]) for level in at[ends, 1]]
    assert max(beside) == pytest.approx(1.4 * min(beside)) and max(outline) == pytest.approx(1.4 * min(outline))
    # Nothing of it is cut: the tube opens along the row of vertices, all of it.
    found, _ = symmetric_cut(half, 0, 0.0)
    assert is_disk(component, found) and found.sum() == 4


def test_a_closed_body_is_opened_by_one_symmetric_tree():
    V, F = meshes.icosphere(3)
    component = component_of(V * [1.0, 1.3, 3.0], F)
    half = symmetric_halves(component)[0]
    cuts, tips = symmetric_cut(half, 2, 0.0)
    image = half.image[component.ends[cuts]]
    assert np.isin(pair_keys(*image.T), pair_keys(*component.ends[cuts].T)).all()
    assert np.isin(tips, component.ends[cuts]).all() and np.isin(half.image[tips], tips).all()


def test_what_has_no_mirror_has_no_half():
    V, F = meshes.icosphere(2)
    assert symmetric_halves(component_of(V @ [[1, 0.2, 0.1], [0, 1, 0.3], [0, 0, 1]], F)) == []


def test_symmetric_cuts_are_those_of_any_order_of_the_vertices():
    surface = figure("front")
    order = np.random.default_rng(0).permutation(len(surface.positions))
    back = np.argsort(order)
    polygons = [order[p].tolist() for p in np.split(surface.corner_vertex, surface.face_start[1:-1])]
    other = polygon_surface(surface.positions[back], polygons)
    one, two = (np.sort(pair_keys(*e.T)) for e in (order[cut(surface).edges], cut(other).edges))
    assert np.array_equal(one, two)


CUTS = [(1.0, 9.0, "a"), (1.5, 2.0, "b"), (1.9, 1.0, "c"), (2.1, 0.0, "d")]


@pytest.mark.parametrize(
    ("spread", "chosen"),
    [((1.0, 1.05), "b"), ((1.05, 1.0), "b"), ((1.0, 1.2), "a"), ((1.2, 1.0), "b")],
    ids=["about equal", "about equal, too", "the first is better", "the second is better"],
)
def test_of_about_equal_outlines_the_one_that_leaves_least_where_it_is_free(monkeypatch, spread, chosen):
    """The two best predicted ones are measured; what is predicted more than twice as steep is not looked at."""
    made = [(a, b, np.array([k]), np.array([k + 10])) for k, (a, b, _) in enumerate(CUTS)]
    monkeypatch.setattr(symmetric_cuts, "_outlined", lambda half, extremities, bearable: iter(made[::-1]))
    looked = []
    monkeypatch.setattr(symmetric_cuts, "disk_spread", lambda part, cut: looked.append(int(cut[0])) or spread[cut[0]])
    cut, tips = symmetric_cuts.outlined_cut([SimpleNamespace(component=None)], 3, 2.0)
    assert CUTS[int(cut[0])][2] == chosen and tips[0] == cut[0] + 10 and looked == [0, 1]


@pytest.mark.parametrize("count", [0, 1])
def test_without_a_choice_there_is_none_or_the_only_one(monkeypatch, count):
    made = [(1.0, 1.0, np.array([4]), np.array([5]))] * count
    monkeypatch.setattr(symmetric_cuts, "_outlined", lambda half, extremities, bearable: iter(made))
    found = symmetric_cuts.outlined_cut([SimpleNamespace(component=None)], 3, 2.0)
    assert (found is None) == (count == 0) and (not count or [int(x[0]) for x in found] == [4, 5])


def half_of(ends, across, boundary=(), held=()):
    """A half of 8 vertices whose line through 0 to 3 is closed, with edges by their ends."""
    ends = np.array(ends)
    taken = np.isin(np.arange(len(ends)), held)
    on_line = np.arange(8) < 4
    return symmetric_cuts.SymmetricHalf(
        component=None,
        image=np.arange(8),
        side=np.ones(8, bool),
        edges=np.arange(len(ends)),
        image_edge=np.arange(len(ends)),
        ends=ends,
        across=np.array(across),
        line=np.zeros(len(ends), bool),
        on_line=on_line,
        line_ends=np.zeros(8, bool),
        held=taken,
        boundary=np.array(boundary, np.int64).reshape(-1, 2),
    )


def test_a_closed_line_begins_where_it_is_cut_first_and_nowhere_else():
    nowhere = np.zeros(0, np.int64)
    half = half_of([[4, 5], [6, 6], [5, 7], [1, 4]], [False, True, False, False])
    # What is cut beside the plane does not begin there, and what is cut across it, or in it, does.
    beside = half.groups(np.array([True, False, False, False]), nowhere)
    assert beside[4] == beside[5] > 0 and (np.delete(beside, [4, 5]) == -1).all()
    across = half.groups(np.array([True, True, False, False]), nowhere)
    assert across[6] == 0 and across[4] == across[5] > 0
    inside = half.groups(np.array([True, True, False, True]), nowhere)
    assert inside[1] == inside[4] == inside[5] == 0 and inside[6] != -1
    # Tips are there without any edge, and so are boundaries.
    tips = half.groups(np.array([False, False, False, False]), np.array([2, 7]))
    assert tips[2] > 0 and tips[7] > 0 and tips[2] != tips[7] and (np.delete(tips, [2, 7]) == -1).all()
    edged = half_of([[4, 5]], [False], boundary=[[5, 6], [6, 7]]).groups(np.array([True]), nowhere)
    assert len(set(edged[4:])) == 1 and edged[4] > 0
    held = half_of([[4, 5], [5, 6]], [False, False], held=[1]).groups(np.array([False, False]), nowhere)
    assert held[5] == held[6] > 0 and held[4] == -1


@pytest.mark.parametrize("opens, cheaper", [(True, True), (True, False), (False, True)])
@pytest.mark.parametrize("by", ["turned", "shortened"])
def test_a_cut_is_left_for_a_cheaper_one_that_opens_the_component(by, opens, cheaper, monkeypatch):
    """By cuts that cost as much as they have edges."""
    V, F = meshes.icosphere(2)
    half = symmetric_halves(component_of(V, F))[0]
    tips = np.unique(half.ends[half.line])[:3]
    chosen = half.held.copy()
    chosen[np.flatnonzero(half.across)[:3]] = True
    other = half.held.copy()
    other[np.flatnonzero(half.across)[: 2 if cheaper else 4]] = True
    cls = symmetric_cuts.SymmetricHalf
    monkeypatch.setattr(cls, "joined", lambda self, begin, ends: other.copy())
    monkeypatch.setattr(cls, "cost", lambda self, edges: float(edges.sum()))
    monkeypatch.setattr(cls, "opens", lambda self, edges: opens)
    if by == "turned":
        monkeypatch.setattr(cls, "shortened", lambda self, edges, tips, sweeps: edges)
        found = half.turned(chosen, tips)
    else:
        found = half.shortened(chosen, tips)
    assert np.array_equal(found, other if opens and cheaper else chosen)
