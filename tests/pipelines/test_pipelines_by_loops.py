"""Pieces of the pipelines against loops over islands and corners: what is scaled, placed, counted and told."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from readings import reading

from omt_uv.pipelines import magnify, refine, subdivision, texel_density, unwrap
from omt_uv.pipelines.arranging.actions import _placed
from omt_uv.pipelines.attributes import Layer, Marks
from omt_uv.pipelines.carry_attributes import _carried_marks
from omt_uv.pipelines.distortion import _number, _of_each, polygon_outlines, worst_faces
from omt_uv.pipelines.globe import (
    ClosedComponent,
    _as_on_sphere,
    _located,
    _pole_warnings,
    _shares,
    inside_tile,
)
from omt_uv.pipelines.layout import OVERLAP, PlacedIsland, Refusal, grown_together, in_turn, pack_islands
from omt_uv.pipelines.magnify import Region, Shares
from omt_uv.pipelines.measuring.per_face import _stretch
from omt_uv.pipelines.measuring.region_figures import RegionFigures, diameter, perimeter, table_text
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.shapes import partition
from omt_uv.pipelines.shapes.cell_attributes import _between
from omt_uv.pipelines.shapes.distance import _single
from omt_uv.pipelines.shapes.landmark_pairs import MOST_VERTICES, LandmarkPoint, Pairs, _point
from omt_uv.pipelines.shapes.match import _renamed, _seams, largest_part
from omt_uv.pipelines.shapes.onto import _firsts, _real_edges
from omt_uv.pipelines.volumes.flow import FlowBody, UVPlaces, _crossing
from omt_uv.pipelines.volumes.handle_file import _moved, euler_matrix
from omt_uv.pipelines.volumes.vtu import _array
from omt_uv.settings import RefineSettings, Settings
from omt_uv.solver.errors import FoldedUVError, LandmarkError, MeshError
from omt_uv.solver.mesh.charts import Chart
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.parameterization.chart_indices import ChartPins, CornerPins
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.progress import Progress, drain

RNG = np.random.default_rng


def plain_area(points, triangle):
    (a, b), (c, d), (e, f) = (points[v] for v in triangle)
    return ((c - a) * (f - b) - (d - b) * (e - a)) / 2


def quads(columns, rows):
    """Positions (n,3) and quads (f,4) of a grid."""
    V, Q = meshes.quad_grid(columns, rows)
    return V, np.array(Q)


def disk(seed=0, columns=4, rows=3, place=(0.0, 0.0), size=1.0):
    """A chart with UVs that are moved, sheared and grown."""
    V, F = meshes.grid(columns, rows)
    V = V + 0.1 * RNG(seed).standard_normal(V.shape) / columns
    corners = np.arange(F.size).reshape(-1, 3)
    chart = Chart(V, F, corners, np.arange(len(F)), np.arange(len(V)))
    return chart, size * V[:, :2] @ [[1.0, 0.1], [0.2, 0.9]] + place


def island(seed, owner=0, pins=None, fixed=False, density=None, **given):
    chart, uv = disk(seed, **given)
    done = SimpleNamespace(uv=uv, status="done", iterations=2, residual=0.0, overlap=0.0, warnings=())
    return refine._RefinedIsland(owner, SimpleNamespace(chart=chart, uv=uv), pins, fixed, done, density)


# ---- refine -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 1])
def test_loose_islands_share_the_density_that_they_have_together(seed):
    pin = ChartPins(np.array([3]), np.array([[7.0, -2.0]]), np.zeros((24, 3, 2)))
    given = [
        island(seed, size=0.5),
        island(seed + 5, size=2.0, place=(3.0, 4.0)),
        island(seed + 6, size=3.0, fixed=True),
        island(seed + 7, size=0.2, pins=pin, density=np.full(24, 3.0)),
    ]
    found = refine._at_one_density(given)
    spaces, covered = [], []
    for r in given:
        V, T = r.island.chart.vertices, r.island.chart.triangles
        area = [np.linalg.norm(np.cross(V[b] - V[a], V[c] - V[a])) / 2 for a, b, c in T]
        spaces.append(sum(area) * (1 if r.density is None else 3))
        covered.append(sum(plain_area(r.refinement.uv, t) for t in T))
        assert r.areas == pytest.approx((spaces[-1], covered[-1]))
    loose = [0, 1, 3]
    density = sum(covered[k] for k in loose) / sum(spaces[k] for k in loose)
    for k in loose:
        assert signed_areas(found[k], given[k].island.chart.triangles).sum() == pytest.approx(density * spaces[k])
    assert np.array_equal(found[2], given[2].refinement.uv)
    for k, r in enumerate(given[:2]):
        V, T = r.island.chart.vertices, r.island.chart.triangles
        area = np.array([np.linalg.norm(np.cross(V[b] - V[a], V[c] - V[a])) / 2 for a, b, c in T])
        middles = [area @ uv[T].mean(axis=1) / area.sum() for uv in (r.refinement.uv, found[k])]
        assert middles[1] == pytest.approx(middles[0])
        assert refine._centroid(r.island.chart, r.refinement.uv) == pytest.approx(middles[0])
    # One pin stays where it is.
    grown = np.sqrt(density * spaces[3] / covered[3])
    assert found[3] == pytest.approx(pin.places[0] + grown * (given[3].refinement.uv - pin.places[0]))


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_a_map_is_placed_like_another_with_its_area_its_direction_and_its_place(turn):
    chart, uv = disk(3, size=2.0, place=(5.0, 1.0))
    other = np.column_stack([(w := (uv @ [1, 1j]) * 0.3 * np.exp(1j * turn) + 2).real, w.imag])
    assert refine._placed_like(other, uv, chart) == pytest.approx(uv)


def test_an_error_of_a_whole_island_points_to_its_faces_and_others_stay():
    chart, _ = disk()
    shown = refine._shown(FoldedUVError("No"), chart)
    assert shown.kind == "face" and shown.elements.tolist() == list(range(24)) and shown.cause == "No"
    for error in (FoldedUVError("No", kind="vertex", elements=[3]), MeshError("No")):
        assert refine._shown(error, chart) is error


def test_pinned_corners_are_not_written():
    chart, uv = disk()
    pinned = np.zeros(72, bool)
    pinned[[0, 5, 71]] = True
    placed = [PlacedIsland(1, chart, uv)]
    surfaces = [(None, None, CornerPins(np.zeros(3, bool), np.zeros((3, 2)))), (None, None, CornerPins(pinned, uv))]
    corners, values = refine._free_corners(surfaces, placed)
    assert len(corners[0]) == 0 and len(values[0]) == 0
    assert corners[1].tolist() == [k for k in range(72) if k not in (0, 5, 71)]
    assert np.array_equal(values[1], uv[chart.triangles.ravel()[corners[1]]])


def test_islands_with_pins_or_a_scale_of_their_own_are_not_packed():
    pin = ChartPins(np.array([3]), np.array([[7.0, -2.0]]), np.zeros((24, 3, 2)))
    given = [island(1), island(2, pins=pin), island(3, fixed=True), island(4)]
    uvs = [r.refinement.uv + 10 for r in given]
    found = drain(refine._packed(given, uvs, RefineSettings(pack=True)))
    assert np.array_equal(found[1], uvs[1]) and np.array_equal(found[2], uvs[2])
    for k in (0, 3):
        assert found[k].shape == uvs[k].shape and found[k].min() >= 0 and found[k].max() <= 1


# ---- magnify ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("after", "said"), [(0.20099, 0), (0.20101, 1), (0.19901, 0), (0.19899, 1), (0.2, 0)])
def test_a_share_is_missed_beyond_half_a_percent_of_it(after, said):
    shares = Shares(0.1, 0.2, after, 2.5)
    assert len(shares.warnings()) == said
    assert shares.report() == {"before": 0.1, "asked": 0.2, "after": after, "factor": 2.5}
    if said:
        assert shares.warnings()[0].index(f"{100 * after:.4g} %") < shares.warnings()[0].index("20 %")


def test_shares_are_told_in_percents_in_their_order():
    shares = Shares(0.101, 0.202, 0.3035, 2.0)
    assert [value for _, value in shares.said()] == ["10.100 %", "20.200 %", "30.350 %"]
    assert [name.split()[-1] for name, _ in shares.said()] == ["before", "asked", "now"]
    text = shares.text()
    assert text.index("10.1 %") < text.index("to 30.35 %") < text.index("(20.2 % asked")


@pytest.mark.parametrize(("weights", "wrong"), [([0, 1, 0.5], []), ([0, 1.01, -0.01], [1, 2]), ([np.nan, 2, 0], [0])])
def test_weights_that_are_none_are_named(weights, wrong):
    region = SimpleNamespace(weights=np.array(weights, float), kind="face")
    if not wrong:
        magnify.check_weights(region)
        return
    with pytest.raises(MeshError) as caught:
        magnify.check_weights(region)
    assert caught.value.elements.tolist() == wrong and caught.value.kind == "face"


def test_areas_of_triangles_that_are_left_out_are_none():
    V, F = meshes.grid(3, 2)
    read = reading(V, F, V[:, :2])
    faces = np.arange(len(F)) % 3 > 0
    region = Region(read.surface, faces, np.linspace(0, 1, len(V)), read.all_pins)
    rows, area, weights = magnify.region_triangles(region)
    assert rows.tolist() == [k for k in range(len(F)) if k % 3]
    assert area == pytest.approx([1 / 12] * len(rows))
    assert weights == pytest.approx([np.mean([v / (len(V) - 1) for v in F[k]]) for k in rows])
    # Of the triangles worked on only some were written.
    corners = np.concatenate([3 * rows[:4] + k for k in range(3)])
    found = magnify.uv_areas(region, (rows,), corners, 2 * V[F.ravel()[corners], :2])
    assert found == pytest.approx([4 / 12] * 4 + [0] * (len(rows) - 4))


def test_islands_of_a_region_are_those_with_a_part_of_it_and_a_rest():
    V, F = meshes.grid(2, 2)
    parts = [(V + [2 * k, 0, 0], F + 9 * k) for k in range(4)]
    V, F = (np.concatenate(x) for x in zip(*parts, strict=True))
    read = reading(V, F, V[:, :2])
    weights = np.concatenate([np.zeros(9), np.linspace(0, 1, 9), np.ones(9), np.full(9, 0.5)])
    region = Region(read.surface, read.faces, weights, read.all_pins)
    found, warnings = magnify._islands([region])
    assert [(index, i.chart.vertex_ids.min()) for index, i in found] == [(0, 9)]
    assert len(warnings) == 1 and warnings[0][0] == -1 and warnings[0][1].startswith("2 islands")
    weights[18:] = 0
    assert magnify._islands([Region(read.surface, read.faces, weights, read.all_pins)])[1] == []
    weights[:18] = 1
    with pytest.raises(Refusal, match="No island has both"):
        magnify._islands([Region(read.surface, read.faces, weights, read.all_pins)])


# ---- layout, unwrap -----------------------------------------------------------------------------------------


def test_runs_in_turn_say_whose_error_it_is_and_share_the_progress():
    def steps(error=None):
        yield Progress("A", 0.0)
        yield Progress("A", 1.0)
        if error:
            raise MeshError(error)
        return 5

    told = []
    turn = in_turn([steps(), steps(), steps()])
    try:
        while True:
            told.append(next(turn).fraction)
    except StopIteration as stop:
        assert stop.value == [5, 5, 5]
    assert told == pytest.approx([0, 1 / 3, 1 / 3, 2 / 3, 2 / 3, 1])
    with pytest.raises(Refusal) as caught:
        drain(in_turn([steps(), steps("No"), steps("Not")]))
    assert caught.value.index == 1


@pytest.mark.parametrize(("overlap", "told"), [(0.3 * OVERLAP, False), (3 * OVERLAP, True), (0.25, True)])
def test_islands_that_grow_together_are_told_from_a_share_on(overlap, told):
    V, F = meshes.quad_patch()
    chart = Chart(V, F, np.arange(6).reshape(-1, 3), np.arange(2), np.arange(4))
    placed = [PlacedIsland(0, chart, V[:, :2] + [x, 0], V[:, :2] + [2 * x, 0]) for x in (0, 1 - overlap)]
    assert bool(grown_together(placed)) == told
    same = [PlacedIsland(p.owner, chart, p.uv, p.uv) for p in placed]
    assert not grown_together(same) and not grown_together(placed[:1])


def test_nothing_is_packed_where_there_is_nothing_and_tiles_shift_what_is_stacked():
    assert drain(pack_islands([], [], Settings())).islands == []
    chart, uv = disk()
    plain = drain(pack_islands([uv], [chart.triangles], Settings(pack=False)))
    there = drain(pack_islands([uv], [chart.triangles], Settings(pack=False, tile=1012)))
    assert there.islands[0] - plain.islands[0] == pytest.approx(np.broadcast_to([1.0, 1.0], uv.shape))


@pytest.mark.parametrize(
    ("pinned", "others", "begins", "more"), [(1, 0, "An island", 0), (3, 0, "3 islands", 0), (1, 2, "An", 1)]
)
def test_what_stays_in_place_is_told(pinned, others, begins, more):
    text = unwrap._in_place(pinned, others)
    assert text.startswith(begins) and (";" in text) == bool(more)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("quarters", range(4))
def test_a_rectangle_is_placed_with_the_side_up_that_was(mirrored, quarters):
    V, F = meshes.grid(3, 2, 3.0, 1.0)
    before = V[:, :2] * [-1 if mirrored else 1, 1] @ [[1, 0.02], [0.03, 1]] + [4, 7]
    w = (V[:, :2] @ [1, 1j]) * 1j**quarters * 5
    found = _placed(np.column_stack([w.real, w.imag]), before, F)
    assert signed_areas(found, F).sum() == pytest.approx(signed_areas(before, F).sum())
    assert found.mean(axis=0) == pytest.approx(before.mean(axis=0))
    assert np.abs(found - before).max() < 0.1


# ---- texel density, distortion, regions ---------------------------------------------------------------------


@pytest.mark.parametrize(("size", "metres"), [(1024.0, 1.0), (512.0, 0.5)])
def test_every_island_gets_the_density_about_the_middle_of_its_box(size, metres):
    V, F = meshes.grid(2, 2)
    V = np.concatenate([V, 3 * V + [5, 0, 0]])
    F = np.concatenate([F, F + 9])
    uv = np.concatenate([V[:9, :2], 0.1 * V[9:, :2] + 4])
    read = reading(V, F, uv)
    texels = texel_density.Texels(size, metres)
    ((corners, new),) = texel_density.with_texel_density([read], 300.0, texels, each_island=True)
    for k in range(2):
        mine = corners // 24 == k
        old = read.uv[corners[mine]].astype(float)
        middle = (old.min(axis=0) + old.max(axis=0)) / 2
        # 300 pixels a metre, of `metres` a unit, and `size` a unit of UV.
        side = (1, 3)[k] * metres * 300 / size
        assert np.ptp(new[mine], axis=0) == pytest.approx([side, side])
        assert (new[mine].min(axis=0) + new[mine].max(axis=0)) / 2 == pytest.approx(middle)


def test_polygons_of_readings_are_counted_from_their_first_ones():
    ends = np.array([4, 4, 9])
    found = _of_each(np.array([0, 3, 4, 8]), ends)
    assert [(mine.tolist(), start) for mine, start in found] == [([0, 3], 0), ([], 4), ([4, 8], 4)]


def test_outlines_are_the_sides_of_chosen_polygons():
    V, Q = quads(2, 2)
    surface = meshes.polygon_surface(V, [*Q[:2].tolist(), Q[2, :3].tolist(), Q[3].tolist()])
    uv = RNG(2).random((15, 2))
    chosen = np.array([True, False, True, True])
    found = polygon_outlines([Reading(surface, chosen, uv, None), Reading(surface, chosen, None, None)])
    start = [0, 4, 8, 11, 15]
    want = []
    for k in (0, 2, 3):
        mine = range(start[k], start[k + 1])
        want += [[uv[c], uv[c + 1 if c + 1 < start[k + 1] else start[k]]] for c in mine]
    assert np.array_equal(found, want)
    assert polygon_outlines([]).shape == (0, 2, 2)


@pytest.mark.parametrize(("share", "count"), [(0.0, 1), (0.24, 1), (0.26, 2), (0.51, 4), (1.0, 8)])
def test_the_worst_faces_are_as_many_as_the_share_holds(share, count):
    V, F = meshes.grid(2, 2)
    uv = V[F.ravel(), :2].reshape(-1, 3, 2)
    grown = uv * np.array([1, 5, 2, 3, 9, 4, 0.2, 6.0])[:, None, None]
    (found,) = worst_faces([reading(V, F, grown.reshape(-1, 2))], "AREA", share)
    octaves = 2 * np.log2([1, 5, 2, 3, 9, 4, 0.2, 6.0])
    octaves = np.abs(octaves - np.log2(np.mean(2.0**octaves)))
    assert found.tolist() == sorted(np.argsort(-octaves, kind="stable")[:count].tolist())


def test_figures_that_are_missing_are_none():
    assert _number(None) == "none" and _number(1.23456) == "1.235" and _number(0.0) == "0.000"


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0])
def test_stretch_is_where_the_texture_is_pulled(angle):
    V, F = meshes.grid(2, 2)
    rows = np.array([0, 3])
    direction = np.array([np.cos(angle), np.sin(angle)])
    flat = V[F[rows], :2]
    # Half as many pixels along the direction.
    uv = flat - 0.5 * (flat @ direction)[..., None] * direction
    found = _stretch(V[F[rows]], uv, np.array([2, 0]), 4)
    assert np.abs(found[[0, 2], :2] @ direction) == pytest.approx([1, 1]) and (found[:, 2] == 0).all()
    assert (found[[1, 3]] == 0).all() and (_stretch(V[F[rows]], 3 * flat, np.array([2, 0]), 4) == 0).all()


def test_stretch_of_a_polygon_is_that_of_its_largest_triangle():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [3, 0, 0], [0, 3.0, 0]])
    space = V[[[0, 1, 2], [0, 3, 4]]]
    uv = space[..., :2] * [[[0.5, 1]], [[1, 0.5]]]
    for order in ([0, 1], [1, 0]):
        assert np.abs(_stretch(space[order], uv[order], np.zeros(2, int), 1)[0]) == pytest.approx([0, 1, 0])


def test_the_perimeter_is_that_of_edges_at_one_triangle():
    V, F = meshes.grid(3, 2, 3.0, 2.0)
    assert perimeter(V, F) == pytest.approx(10)
    assert perimeter(V, F[:1]) == pytest.approx(2 + 2**0.5)
    assert perimeter(*meshes.cube()) == 0


@pytest.mark.parametrize("kind", ["cloud", "line", "upright", "two", "one", "round"])
def test_the_diameter_is_the_greatest_distance_of_all(kind):
    points = RNG(1).random((30, 2))
    if kind == "line":
        points = points[:, :1] * [2.0, -3.0]
    elif kind == "upright":
        points = points * [0.0, 1.0]
    elif kind in ("one", "two"):
        points = points[: 1 + (kind == "two")]
    elif kind == "round":
        angle = np.linspace(0, 6, 1300)
        points = np.column_stack([np.cos(angle), 0.999 * np.sin(angle)])
    want = max(np.linalg.norm(points - p, axis=1).max() for p in points)
    assert diameter(points) == pytest.approx(want)


def test_a_table_has_a_line_of_names_and_no_separators_within_them():
    row = RegionFigures("a;b\nc", 3, *np.arange(10) / 3)
    names, line, end = table_text([row], ";").split("\n")
    assert names.split(";")[:3] == ["name", "faces", "area"] and end == ""
    assert line.split(";")[:4] == ["a b c", "3", "0", "0.333333333"] and len(line.split(";")) == len(names.split(";"))


# ---- subdivision --------------------------------------------------------------------------------------------


def test_corners_share_a_uv_vertex_where_vertex_uvs_and_side_agree():
    V, Q = quads(2, 1)
    start = np.array([0, 4, 8])
    corner = Q.ravel()
    uv = V[corner, :2].copy()
    vertex, first = subdivision._uv_vertices(corner, start, uv)
    assert len(first) == 6 and (corner[first][vertex] == corner).all()
    moved = uv.copy()
    moved[4:] += [3e-4, 0]
    assert len(subdivision._uv_vertices(corner, start, moved)[1]) == 8
    moved[4:] = uv[4:] + [2e-5, 0]
    assert len(subdivision._uv_vertices(corner, start, moved)[1]) == 6
    # A polygon that lies the other way round has vertices of its own.
    over = uv.copy()
    over[4:, 0] = 2 * uv[4:, 0].min() - uv[4:, 0]
    assert len(subdivision._uv_vertices(corner, start, over)[1]) == 8


def quads_of(seed, density=None):
    """Quads of two polygons in space, and their map: every vertex has a UV of its own."""
    rng = RNG(seed)
    V, Q = quads(2, 2)
    space = V + 0.1 * rng.standard_normal(V.shape)
    uv = V[:, :2] + 0.1 * rng.standard_normal((len(V), 2))
    polygon = np.array([0, 0, 1, 1])
    density = np.ones(4) if density is None else density
    mapping = SimpleNamespace(matrix=np.eye(len(V)), quads=Q)
    part = subdivision._MappedQuads(space[Q], polygon, np.zeros(4, int), density, mapping, np.array([0, len(V)]))
    return part, uv


def halves_of(p):
    """Areas of both triangles of a quad (4,3)."""
    return [float(np.linalg.norm(np.cross(p[i] - p[0], p[i + 1] - p[0]))) / 2 for i in (1, 2)]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_errors_of_quads_are_shares_in_the_wrong_place(seed):
    density = np.array([1.0, 2.0, 1.0, 3.0])
    part, uv = quads_of(seed, density)
    flat = np.column_stack([uv, np.zeros(len(uv))])[part.mapping.quads]
    area, space = (np.array([sum(halves_of(p)) for p in x]) for x in (flat, part.corners))
    assert part.areas == pytest.approx(space * density)
    area, space = area / area.sum(), space * density / (space * density).sum()
    assert part.area_error(uv) == pytest.approx(np.abs(area - space).sum())
    inner = sum(
        abs(area[k] * space[mine].sum() / area[mine].sum() - space[k])
        for mine in (np.arange(2), np.arange(2, 4))
        for k in mine
    )
    assert part.inner_error(uv) == pytest.approx(inner)
    halves = []
    for p in (flat, part.corners):
        halves.append([half for q in p for half in halves_of(q)])
    halves[1] = halves[1] * np.repeat(density, 2)
    halves = [np.array(x) / np.sum(x) for x in halves]
    assert part.triangle_error(uv) == pytest.approx(np.abs(halves[0] - halves[1]).sum())


@pytest.mark.parametrize("fixed", [False, True])
def test_charts_get_the_area_of_the_subdivided_surface_unless_they_are_fixed(fixed):
    part, uv = quads_of(4)
    triangles = np.concatenate([part.mapping.quads[:, [0, 1, 2]], part.mapping.quads[:, [0, 2, 3]]])
    chart = SimpleNamespace(triangles=triangles, vertices=np.zeros((len(uv), 3)))
    from omt_uv.solver.parameterization.unwrap import SurfaceMap

    old = refine._as_chart_map(
        SimpleNamespace(uv=uv, iterations=1, residual=0.0, status="done", area_weight=1.0), np.ones(2)
    )
    held = np.zeros(len(uv), bool)
    held[-1] = fixed
    (new,) = part.resized(SurfaceMap([chart], [old], np.zeros((0, 2), int)), held).maps
    if fixed:
        assert np.array_equal(new.uv, uv)
    else:
        assert signed_areas(new.uv, triangles).sum() == pytest.approx(part.areas.sum())
        assert new.uv / uv == pytest.approx(np.full(uv.shape, (new.uv / uv)[0, 0]))


# ---- globe --------------------------------------------------------------------------------------------------


def ball():
    V, F = meshes.cube()
    corners = np.arange(F.size).reshape(-1, 3)
    return ClosedComponent(V, F, corners, np.arange(len(F)) // 2 + 5, np.arange(len(V)) + 10, np.arange(len(F)))


def test_shares_are_areas_times_density_and_are_split_as_on_the_sphere():
    component = ball()
    assert _shares(component, None) == pytest.approx(np.full(12, 1 / 12))
    density = np.arange(1.0, 13)
    shares = _shares(component, density)
    assert shares == pytest.approx(density / 78)
    on_sphere = RNG(0).random(12) / 10
    found = _as_on_sphere(component, shares, on_sphere)
    for k in range(0, 12, 2):
        whole = (shares[k] + shares[k + 1]) * on_sphere.sum()
        there = on_sphere[k] + on_sphere[k + 1]
        assert found[k : k + 2] == pytest.approx(on_sphere[k : k + 2] * whole / there)


def test_a_tile_holds_what_reached_beyond_it_and_leaves_the_rest():
    uv = np.array([[0.2, -0.5], [0.8, 1.5], [0.4, 0.5]])
    assert inside_tile(uv) == pytest.approx(np.array([[0.2, 0.0], [0.8, 1.0], [0.4, 0.5]]))
    assert np.array_equal(inside_tile(uv[2:]), uv[2:])


@pytest.mark.parametrize(("missed", "folded"), [(0, 0), (1, 0), (2, 0), (0, 1), (0, 4), (1, 4)])
def test_poles_that_are_missed_and_faces_folded_there_are_counted(missed, folded):
    texts = _pole_warnings(missed, folded)
    assert len(texts) == (missed > 0) + (folded > 0)
    if missed:
        assert texts[0].startswith(("A pole of", "2 poles of")[missed - 1]) and "stretched" in texts[0]
    if folded:
        assert texts[-1].startswith("A face is folded" if folded == 1 else "4 faces are folded")


@pytest.mark.parametrize(
    ("kind", "elements", "want"),
    [("face", [3, 2, 0], [5, 6]), ("vertex", [3, 1], [13, 11]), ("", [], list(range(5, 11))), ("edge", [], [])],
)
def test_errors_of_a_closed_part_name_elements_of_the_surface(kind, elements, want):
    found = _located(MeshError("No", "Do", kind, np.array(elements, int)), ball())
    assert found.elements.tolist() == want and found.kind == (kind or "face")
    assert (found.cause, found.remedy) == ("No", "Do")
    # What fills the holes is not the surface's.
    beyond = _located(MeshError("No", "Do", kind, np.array([*elements, 99], int)), ball())
    assert beyond.elements.tolist() == want or not kind
    sides = _located(MeshError("No", "Do", "edge", np.array([[3, 1], [1, 99]])), ball())
    assert sides.elements.tolist() == [[13, 11]]


# ---- attributes ---------------------------------------------------------------------------------------------


def test_marks_go_to_the_edges_that_follow_marked_ones():
    triangles = np.array([[0, 1, 2], [2, 1, 3]])
    edges = np.array([[2, 1], [3, 2], [0, 1]])
    layer = Layer("more", "EDGE", "FLOAT2", np.arange(6.0).reshape(3, 2) + 1)
    marks = Marks(edges, np.array([1, 0, 1], bool), np.array([0, 1, 1], bool), np.array([0.5, 0.25, 1.0]), (layer,))
    # Half-edges 1-2, 3-2 and 1-3, the last of which has no mark.
    at = SimpleNamespace(seams=np.array([[7, 8], [8, 9], [9, 4]]), seam_origin=np.array([1, 5, 4]))
    found = _carried_marks(marks, triangles, at)
    assert np.array_equal(found.edges, at.seams)
    assert found.seam.tolist() == [True, False, False] and found.sharp.tolist() == [False, True, False]
    assert found.crease.tolist() == [0.5, 0.25, 0] and found.layers[0].values.tolist() == [[1, 2], [3, 4], [0, 0]]
    none = _carried_marks(Marks(edges[:0], np.zeros(0, bool), np.zeros(0, bool), np.zeros(0)), triangles, at)
    assert len(none.edges) == 3 and not (none.seam.any() or none.sharp.any() or none.crease.any())


def test_edges_part_cells_where_a_polygon_beside_is_of_another():
    corner = np.array([0, 1, 2, 3, 1, 4, 5, 2, 3, 2, 6])
    mesh = SimpleNamespace(cell=np.array([0, 1, 0]), face_start=np.array([0, 4, 8, 11]), corner_vertex=corner)
    a = corner
    b = np.array([1, 2, 3, 0, 4, 5, 2, 1, 2, 6, 3])
    found = _between(mesh, a, b)
    assert np.flatnonzero(found).tolist() == [k for k in range(11) if {a[k], b[k]} == {1, 2}]


def test_every_corner_and_polygon_has_its_first_triangle_and_only_sides_are_edges():
    V, Q = quads(2, 1)
    surface = meshes.polygon_surface(V, Q.tolist())
    corner, face = _firsts(surface)
    flat = surface.triangles.ravel().tolist()
    assert corner.tolist() == [flat.index(c) for c in range(8)]
    assert face.tolist() == [surface.triangle_face.tolist().index(f) for f in range(2)]
    sides = {frozenset((q[k], q[(k + 1) % 4])) for q in Q.tolist() for k in range(4)}
    every = np.array([(a, b) for a in range(6) for b in range(a)])
    marks = Marks(every, np.arange(15) % 2 > 0, np.arange(15) % 3 > 0, np.arange(15.0))
    found = _real_edges(marks, surface)
    want = [k for k, e in enumerate(every.tolist()) if frozenset(e) in sides]
    assert np.array_equal(found.edges, every[want]) and found.crease.tolist() == want
    assert np.array_equal(found.seam, marks.seam[want]) and np.array_equal(found.sharp, marks.sharp[want])


# ---- shapes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "wrong"),
    [(0, False), (-1, True), (MOST_VERTICES, False), (MOST_VERTICES + 1, True), (True, True), ([1, 2, 3], False)]
    + [([1, 2], True), ([1, 2, float("nan")], True), ("abc", True), ([1e308, 1e308, 1e308], True)],
)
def test_a_point_is_the_number_of_a_vertex_or_a_place(value, wrong):
    if wrong:
        with pytest.raises((TypeError, ValueError, OverflowError)):
            _point("a", value)
    elif isinstance(value, int):
        assert _point("a", value) == LandmarkPoint("a", value, None)
    else:
        assert _point("a", value) == LandmarkPoint("a", -1, (1.0, 2.0, 3.0))


@pytest.mark.parametrize(("found", "begins"), [([], "No"), ([4, 7], "2")])
def test_a_marker_is_one_vertex(found, begins):
    assert _single([9], "centre") == 9
    with pytest.raises(LandmarkError) as caught:
        _single(found, "centre")
    assert caught.value.cause.startswith(begins) and list(caught.value.elements) == found


def test_the_largest_part_has_the_most_area_and_the_rest_is_named():
    V, F = meshes.grid(2, 2)
    V = np.concatenate([V, 0.5 * meshes.grid(3, 3)[0], 3 * V])
    F = np.concatenate([F, meshes.grid(3, 3)[1] + 9, F + 25])
    surface = meshes.polygon_surface(V, F.tolist(), seams=[[25, 26], [0, 1], [33, 30]])
    part = largest_part(surface, "source")
    assert part.used.tolist() == list(range(25, 34)) and part.rest.tolist() == list(range(25))
    assert part.rows.tolist() == list(range(26, 34))
    assert np.array_equal(part.vertices[part.triangles], V[F[26:]])
    assert _seams(surface, part).tolist() == [[0, 1], [8, 5]]
    mine = Pairs((LandmarkPoint("a", 27), LandmarkPoint("b", 3)), (LandmarkPoint("a", -1, (0, 0, 1)),) * 2)
    renamed = _renamed(mine, part, part)
    assert [p.vertex for p in renamed.source] == [2, 9] and [p.vertex for p in renamed.target] == [-1, -1]
    assert renamed.target[0].position == (0, 0, 1)


def test_cells_are_told_with_their_numbers_and_a_verb():
    assert partition._cells(np.array([3])) == "1 cell (3) is"
    assert (
        partition._cells(np.array([3, 5])).startswith("2 cells (3, 5") and partition._cells(np.arange(2))[-3:] == "are"
    )


def test_density_is_the_mean_weight_of_corners_and_never_nothing():
    weights, triangles = np.array([0, 0, 0, 1.0, -3]), np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]])
    assert partition._density(weights, triangles) == pytest.approx([1e-3, 1 / 3, 1 / 3])


def test_borders_are_between_polygons_of_different_cells_inside():
    V, Q = quads(3, 1)
    surface = meshes.polygon_surface(V, Q.tolist())
    for cell in ([0, 0, 1], [0, 1, -1], [-1, -1, 2], [1, 1, 1]):
        found = {frozenset(e) for e in partition._borders(surface, np.array(cell)).tolist()}
        want = set()
        for i in range(3):
            for j in range(i):
                if cell[i] != cell[j] and min(cell[i], cell[j]) >= 0:
                    common = frozenset(Q[i].tolist()) & frozenset(Q[j].tolist())
                    want |= {common} if len(common) == 2 else set()
        assert found == want


@pytest.mark.parametrize("sign", [1, -1])
def test_corners_of_chosen_polygons_are_those_of_the_surface(sign):
    V, Q = quads(2, 2)
    polygons = [Q[0].tolist(), Q[1, :3].tolist(), Q[2].tolist(), Q[3, 1:].tolist()][::sign]
    surface = meshes.polygon_surface(V, polygons)
    vertices, start = partition._polygons(surface, np.array([1, 2]))
    assert vertices.tolist() == polygons[1] + polygons[2] and start.tolist() == [0, len(polygons[1]), len(vertices)]


# ---- volumes ------------------------------------------------------------------------------------------------


def test_crossing_triangles_are_polygons_of_their_bodies():
    first = FlowBody("a", np.zeros((3, 3)), np.zeros((4, 3), int), polygons=np.array([0, 0, 1, 1]))
    second = FlowBody("b", np.zeros((3, 3)), np.zeros((3, 3), int))
    found = _crossing((first, second), np.array([2, 3, 4, 6]))
    assert [f.tolist() for f in found] == [[1], [0, 2]]
    assert [f.tolist() for f in _crossing((first, second), np.array([0, 3]))] == [[0, 1], []]


def test_corners_at_one_place_are_one_place_and_pins_are_places():
    uv = RNG(0).integers(0, 3, (20, 2)).astype(float)
    pinned = np.arange(20) % 7 == 0
    at = UVPlaces.of(uv, pinned)
    assert np.array_equal(at.places[at.place], uv) and len(at.places) == len({tuple(p) for p in uv.tolist()})
    assert sorted(map(tuple, at.places[at.pinned].tolist())) == sorted({tuple(p) for p in uv[pinned].tolist()})


@pytest.mark.parametrize(
    ("axis", "point", "want"), [(0, [0, 1, 0], [0, 0, 1]), (1, [0, 0, 1], [1, 0, 0]), (2, [1, 0, 0], [0, 1, 0])]
)
def test_turns_are_to_the_left_about_their_axes(axis, point, want):
    assert euler_matrix(np.eye(3)[axis] * np.pi / 2) @ point == pytest.approx(want)


def test_turns_are_about_x_then_y_then_z_and_about_the_middle():
    angles = np.array([0.3, -0.8, 1.7])
    each = [euler_matrix(np.eye(3)[k] * angles) for k in range(3)]
    assert euler_matrix(angles) == pytest.approx(each[2] @ each[1] @ each[0])
    points = RNG(1).random((6, 3)) + 5
    moved = _moved(points, {"move": [1, 2, 3], "rotate": [10, 20, 30]}, "here")
    assert moved.mean(axis=0) == pytest.approx(points.mean(axis=0) + [1, 2, 3])
    turn = euler_matrix(np.radians([10, 20, 30]))
    assert moved - moved.mean(axis=0) == pytest.approx(np.array([turn @ (p - points.mean(axis=0)) for p in points]))
    assert np.array_equal(_moved(points, {"move": [0, 0, 0]}, "here").round(12), points.round(12))


def test_arrays_of_vtk_name_their_type_and_their_width():
    assert _array("a", np.array([[1, 2], [3, 4]]), "Int64", 0) == (
        '<DataArray type="Int64" Name="a" format="ascii">\n1 2 3 4\n</DataArray>\n'
    )
    assert 'NumberOfComponents="3"' in _array("a", np.zeros((1, 3)), "Float64", 3)


@pytest.mark.parametrize("figure", ["AREA", "SHEAR", "FOLDS"])
@pytest.mark.parametrize("place", [0, 3, 8])
def test_faces_without_area_change_nothing_of_which_faces_are_worst(figure, place):
    """But for their own numbers: one that lies before others moves these by one."""
    V, F = meshes.grid(3, 3)
    moved = V[:, :2] * [1, 1.3]
    moved[5] += [0.5, 0.3]
    uv = moved[F]
    (plain,) = worst_faces([reading(V, F, uv.reshape(-1, 2))], figure, 0.3)
    flat = np.insert(F, place, [F[0, 0], F[0, 1], len(V)], axis=0)
    W = np.concatenate([V, V[F[0, :1]]])
    beside = np.insert(uv, place, uv[0, [0, 1, 0]], axis=0)
    (found,) = worst_faces([reading(W, flat, beside.reshape(-1, 2))], figure, 0.3)
    assert [k - (k > place) for k in found.tolist() if k != place] == plain.tolist() and len(plain)


# ---- what lies beside, and what is pinned ------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 4])
def test_every_surface_knows_how_much_the_others_have(count):
    """Of polygons that are chosen; what is nowhere has none, and is refused in its turn."""
    jobs, areas = [], []
    for k in range(count):
        V, F = meshes.bumpy(3 + k, 3)
        chosen = RNG(k).random(len(F)) < 0.6
        jobs.append(unwrap.UnwrapJob.of(reading((1 + k) * V, F, faces=chosen), None))
        areas.append(sum(plain_area_3d((1 + k) * V[face]) for face in F[chosen]))
    if count == 4:
        jobs[2] = replace(jobs[2], surface=replace(jobs[2].surface, positions=np.full_like(V, np.nan)))
        areas[2] = 0.0
    found = unwrap._in_one_texture(jobs, UnwrapOptions(max_shear=1.5))
    for k, options in enumerate(found):
        assert options.beside == pytest.approx(sum(areas[:k] + areas[k + 1 :]))
        assert options.max_shear == 1.5 and options.preferences.axes == jobs[k].axes


def plain_area_3d(corners):
    return np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) / 2


@pytest.mark.parametrize("seed", range(4))
def test_corners_that_others_get_their_uvs_from_are_pinned_for_them_unless_they_are_themselves(seed):
    rng = RNG(seed)
    pinned, uv = rng.random(20) < 0.5, rng.random((20, 2))
    corners, hosts = np.split(rng.permutation(20)[:12], 2)
    found = unwrap._pins_of_hosts(CornerPins(pinned, uv), SimpleNamespace(corners=corners, hosts=hosts))
    for corner in range(20):
        mine = corners[hosts == corner]
        by_other = len(mine) > 0 and pinned[mine[0]] and not pinned[corner]
        assert found.pinned[corner] == (pinned[corner] or by_other)
        np.testing.assert_array_equal(found.uv[corner], uv[mine[0]] if by_other else uv[corner])
    assert unwrap._pins_of_hosts(None, SimpleNamespace(corners=corners, hosts=hosts)) is None
