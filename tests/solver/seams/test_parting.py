"""What lies on itself in the plane comes apart there, and bodies of flat sides around these; nothing else does."""

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.symmetry_plane import MirrorImages
from omt_uv.solver.cutting import cuts
from omt_uv.solver.linalg.minimum_cut import capacities
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.overlap import cover_pairs, overlap_share
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import graph_components
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.seams import parting
from omt_uv.solver.seams.parting import (
    LEAST_HALF,
    LEAST_PART,
    MOST_SLITS,
    PolygonGraph,
    flat_sides,
    halves,
    parted,
    slits,
    with_images,
)


def ramp(turns, steps=60, rings=6, rise=0.2):
    """A flat ring of more than a turn that rises, and its place in the plane, where it lies on itself."""
    angle, radius = np.meshgrid(2 * np.pi * turns * np.linspace(0, 1, steps), np.linspace(1, 2, rings), indexing="ij")
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=2).reshape(-1, 2)
    i = (np.arange(steps - 1)[:, None] * rings + np.arange(rings - 1)).ravel()
    triangles = np.concatenate([np.stack([i, i + 1, i + rings], 1), np.stack([i + 1, i + rings + 1, i + rings], 1)])
    return np.column_stack([flat, rise * angle.ravel() / (2 * np.pi)]), triangles[:, ::-1], flat


def test_what_lies_on_itself_comes_apart_along_a_short_cut():
    V, F, flat = ramp(1.3)
    (chart,) = strict_charts(triangle_surface(V, F))
    uv = flat[chart.vertex_ids]
    assert overlap_share(uv[chart.triangles]) > 0.1
    edges = parted(chart, uv, np.ones(len(uv)))
    parts = strict_charts(triangle_surface(V, F, edges))
    whole = face_areas(V, F).sum()
    assert len(parts) == 2
    for part in parts:
        assert overlap_share(flat[part.vertex_ids][part.triangles]) < 1e-3
        assert face_areas(part.vertices, part.triangles).sum() > LEAST_PART * whole / 2
    # Straight across is 1.
    assert np.linalg.norm(V[edges[:, 0]] - V[edges[:, 1]], axis=1).sum() < 1.05


@pytest.mark.parametrize("again", [0, 1, 3])
def test_what_has_come_apart_is_not_cut_again(again, monkeypatch):
    """A corner of one half is apart from all of the other one, however little it costs to cut it off."""
    V, F = meshes.grid(10, 4, width=2.5)
    (chart,) = strict_charts(triangle_surface(V, F))
    x, y = V[F].mean(axis=1)[:, :2].T
    left, right, corner = x < 0.3, x > 2.2, (x < 0.2) & (y < 0.2)
    pairs = [(np.flatnonzero(one), np.flatnonzero(right)) for one in (left, *[corner] * again)]
    monkeypatch.setattr(parting, "_covering", lambda *_: pairs)
    monkeypatch.setattr(parting, "_enlarged", lambda graph, steps, one, other: (one, other))
    parts = strict_charts(triangle_surface(V, F, parted(chart, V[:, :2], np.ones(len(V)))))
    assert len(parts) == 2


def test_cuts_avoid_what_is_dear():
    V, F, flat = ramp(1.5)
    (chart,) = strict_charts(triangle_surface(V, F))
    uv = flat[chart.vertex_ids]
    # Somewhere between the parts that cover each other.
    turn = chart.vertices[:, 2] / 0.2
    cheap = np.abs(turn - 0.8) < 0.03
    edges = parted(chart, uv, np.where(cheap, 0.1, 1.0))
    assert len(edges) and (np.abs(V[edges, 2] / 0.2 - 0.8) < 0.06).all()


@pytest.mark.parametrize(("row", "pieces"), [(36, 3), (44, 2)])
def test_cuts_have_images_and_leave_no_crumbs_between(row, pieces):
    V, F, flat = ramp(1.5, steps=90)
    (chart,) = strict_charts(triangle_surface(V, F))
    step, ring = np.divmod(np.arange(len(V)), 6)
    image = (89 - step) * 6 + ring
    cost = np.where(step[chart.vertex_ids] == row, 0.01, 1.0)
    uv = flat[chart.vertex_ids]
    alone = parted(chart, uv, cost)
    assert (step[alone] == row).all()
    both = parted(chart, uv, cost, MirrorImages.of(image))
    assert set(np.unique(step[both])) <= {row, 89 - row}
    assert len(strict_charts(triangle_surface(V, F, both))) == pieces
    # By images that are only near, about there.
    near = replace(MirrorImages.of(image), exact=np.full(len(V), -1), are_exact=False)
    both = parted(chart, uv, cost, near)
    assert len(strict_charts(triangle_surface(V, F, both))) == pieces
    assert row in step[both] and np.abs(np.abs(step[both] - 44.5) - np.abs(row - 44.5)).max() < 5
    # Where there is no image, a cut stays as it is.
    assert np.array_equal(parted(chart, uv, cost, MirrorImages.of(np.full(len(V), -1))), alone)


@pytest.mark.parametrize("size", [2, 4, 9])
@pytest.mark.parametrize("flipped", [False, True])
def test_the_image_of_what_comes_off_comes_off_too_however_small(size, flipped):
    """Of a cow both horns, or none, also where a diagonal is no mirror image."""
    n = 40
    V, F = meshes.grid(n, n)
    (chart,) = strict_charts(triangle_surface(V, F))
    graph = PolygonGraph.of(chart)
    middle = V[F].mean(axis=1)[:, :2] * n
    apart = np.zeros(len(graph.area), dtype=bool)
    apart[graph.polygon[(np.abs(middle - [6 + size / 2, 20]) < size / 2).all(axis=1)]] = True
    if flipped:
        # Half of a cell sticks out, and its diagonal runs the other way in the image.
        edge = 20 * (n + 1) + 6 + size + np.array([0, n + 1])
        apart[graph.polygon[np.isin(F, edge).sum(axis=1) == 2]] = True
    y, x = np.divmod(np.arange(len(V)), n + 1)
    images = MirrorImages.of(y * (n + 1) + n - x)
    cut = graph.around(apart)
    both = with_images(chart, graph, cut, images, [apart], capacities(graph.prices(chart, np.ones(len(V)))))
    area = np.sort(np.bincount(graph.pieces(~both), graph.area))
    assert len(area) == 3 and area[1] == pytest.approx(area[0], rel=0.3 if flipped else 1e-9)
    assert area[0] == pytest.approx(graph.area[apart].sum(), rel=0.3) and both[cut].all()


@pytest.mark.parametrize("seamed", [False, True])
def test_halves_come_apart_where_that_is_cheap_and_across_the_seams(seamed):
    V, F, _ = ramp(0.9, steps=91)
    along = np.arange(90) * 6
    seams = np.stack([along + 3, along + 9], axis=1)[20:] if seamed else np.zeros((0, 2), np.int64)
    (chart,) = strict_charts(triangle_surface(V, F, seams))
    turn = V[:, 2] / 0.18
    for cheap in (0.3, 0.7):
        edges = halves(chart, np.where(np.abs(turn - cheap) < 0.02, 0.1, 1.0))
        parts = strict_charts(triangle_surface(V, F, edges))
        share = [face_areas(part.vertices, part.triangles).sum() for part in parts] / face_areas(V, F).sum()
        assert len(parts) == 2 and min(share) >= LEAST_HALF
        assert len(edges) == 5 and (np.abs(turn[edges] - cheap) < 0.03).all()


def test_halves_have_their_share_though_less_would_be_cheaper():
    V, F, _ = ramp(0.9, steps=91)
    (chart,) = strict_charts(triangle_surface(V, F))
    edges = halves(chart, np.where(V[:, 2] / 0.18 < 0.1, 1e-3, 1.0))
    parts = strict_charts(triangle_surface(V, F, edges))
    assert (
        min(face_areas(part.vertices, part.triangles).sum() for part in parts)
        > 0.9 * LEAST_HALF * face_areas(V, F).sum()
    )
    # What is one polygon has none.
    (single,) = strict_charts(triangle_surface(V[[0, 1, 6]], np.array([[0, 1, 2]])))
    assert halves(single, np.ones(3)).shape == (0, 2)


def test_what_lies_beside_itself_stays_whole():
    V, F, flat = ramp(0.9)
    (chart,) = strict_charts(triangle_surface(V, F))
    assert len(parted(chart, flat[chart.vertex_ids], np.ones(len(chart.vertices)))) == 0


def test_a_ramp_of_more_than_a_turn_becomes_islands_without_shear():
    V, F, _ = ramp(1.3)
    whole = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(max_shear=0.0)))
    found = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(max_shear=1.1)))
    assert max(one.angle_mean for one in whole.maps) > 1.1
    assert len(found.charts) == 2 and not found.warnings
    for chart, one in zip(found.charts, found.maps, strict=True):
        figures = distortion(chart.vertices, chart.triangles, one.uv[chart.triangles])
        assert figures.angle_mean < 1.05 and figures.folds == 0 and figures.overlap == 0


@pytest.mark.parametrize("seed", range(3))
def test_pairs_of_points_and_what_they_lie_in_are_all_found(seed):
    random = np.random.default_rng(seed)
    uv, points = random.random((40, 3, 2)), random.random((200, 2))
    point, triangle = cover_pairs(uv, points)
    a, b, c = uv.transpose(1, 0, 2)

    def side(p, q):
        d = q - p
        return d[None, :, 0] * (points[:, None, 1] - p[None, :, 1]) - d[None, :, 1] * (
            points[:, None, 0] - p[None, :, 0]
        )

    sides = np.stack([side(a, b), side(b, c), side(c, a)])
    inside = (sides > 1e-9).all(axis=0) | (sides < -1e-9).all(axis=0)
    assert {*zip(point.tolist(), triangle.tolist(), strict=True)} == {*map(tuple, np.argwhere(inside).tolist())}


def gear(teeth, width=0.4, bevel=0.0):
    """A disk with teeth, drawn out: two flat sides with long outlines, and a band of walls between, or two that lean by
    a bevel where that is not 0."""
    angle = np.linspace(0, 2 * np.pi, 4 * teeth, endpoint=False)
    radius = np.where(np.arange(4 * teeth) % 4 < 2, 1.0, 0.75)
    outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    n, levels = len(outline), [(0.0, 1.0), (width, 1.0)]
    if bevel:
        levels = [(0.0, 1 - bevel), (width / 2, 1.0), (width, 1 - bevel)]
    points = [np.column_stack([scale * outline, np.full(n, z)]) for z, scale in levels]
    top = len(levels) * n
    walls = [(j + k, j + (k + 1) % n, j + n + (k + 1) % n, j + n + k) for j in range(0, top - n, n) for k in range(n)]
    below = [((k + 1) % n, k, top) for k in range(n)]
    above = [(top - n + k, top - n + (k + 1) % n, top + 1) for k in range(n)]
    return np.concatenate([*points, [[0, 0, 0], [0, 0, width]]]), [*walls, *below, *above]


@pytest.mark.parametrize("bound", [1.2, 2.0])
def test_the_flat_sides_of_a_gear_are_islands_without_shear(bound):
    """Whether one chart would keep the bound, as it does the second, or not."""
    surface = meshes.polygon_surface(*gear(20))
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=bound)))
    # Both sides, and the band of the teeth in pieces.
    assert [len(np.unique(c.faces)) for c in found.charts].count(80) == 2
    assert 3 <= len(found.charts) <= 8 and not found.warnings
    for chart, one in zip(found.charts, found.maps, strict=True):
        figures = distortion(chart.vertices, chart.triangles, one.uv[chart.triangles], polygons=chart.faces)
        assert figures.angle_mean == pytest.approx(1, abs=1e-3) and figures.folds == 0 and figures.overlap == 0


def top_of(teeth):
    """The vertices around the upper side of a gear."""
    return np.arange(4 * teeth, 8 * teeth)


def test_flat_sides_come_off_a_body_that_is_round_otherwise_though_it_keeps_the_bound(monkeypatch):
    """A gear that is not taken for a hard body, nor has a net, as it would not with a round handle."""
    monkeypatch.setattr(cuts, "net", lambda component: None)
    monkeypatch.setattr(cuts, "hard_borders", lambda surface, gluing, positions, gone, *_: np.zeros_like(gone))
    surface = meshes.polygon_surface(*gear(4))
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.6)))
    assert np.isin(found.seams, top_of(4)).all(axis=1).sum() >= 16
    assert all(one.angle_mean == pytest.approx(1, abs=1e-3) for one in found.maps)


def test_flat_sides_stay_where_their_outline_is_to_be_kept_free():
    points, polygons = gear(4)
    avoid = np.zeros(len(points))
    avoid[top_of(4)] = 1
    surface, options = meshes.polygon_surface(points, polygons), UnwrapOptions(max_shear=1.6)
    found = drain(unwrap(surface, options=options, avoid=avoid))
    assert not np.isin(found.seams, top_of(4)).all(axis=1).any()
    everywhere = drain(unwrap(surface, options=options))
    assert np.isin(everywhere.seams, top_of(4)).all(axis=1).sum() == 16


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_flat_sides_are_cut_around_and_nothing_else(turn):
    points, polygons = gear(8)
    c, s = np.cos(turn), np.sin(turn)
    surface = meshes.polygon_surface(points @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]), polygons)
    # Along the outline below and one wall: a disk, whose own seams tell no sides apart.
    n = len(points) // 2 - 1
    outline = np.column_stack([np.arange(n - 1), np.arange(1, n)])
    (chart,) = strict_charts(replace(surface, seams=np.concatenate([outline, [[0, n]]])))
    edges = flat_sides(chart)
    both = np.concatenate([np.column_stack([np.arange(n), np.roll(np.arange(n), -1)]) + k * n for k in range(2)])
    assert {*map(tuple, np.sort(edges, axis=1).tolist())} == {*map(tuple, np.sort(both, axis=1).tolist())}


@pytest.mark.parametrize(("width", "bevel", "sharp"), [(0.4, 0.0, True), (0.4, 0.1, True), (0.1, 0.25, False)])
def test_a_side_between_blunt_edges_is_none_between_sharp_ones(width, bevel, sharp):
    surface = replace(meshes.polygon_surface(*gear(8, width, bevel)), seams=np.array([[0, 1], [1, 2]]))
    (chart,) = strict_charts(surface)
    both = flat_sides(chart)
    assert len(both) == 2 * 32
    assert len(flat_sides(chart, sharp=True)) == sharp * len(both)


def two_sides(cells, turned):
    """A side of square cells below a line, in the plane, and one that rises above it: with their common line along 0 0
    to 2 0, and the cells (x, y) that the second one has, as it lies unfolded."""
    first = [(x, y) for x in range(12) for y in range(-4, 0)] + [(x, y) for x in range(8, 12) for y in range(4)]
    index, polygons = {}, []
    c, s = np.cos(turned), np.sin(turned)
    for flat, side in ((True, first), (False, cells)):
        for x, y in side:
            corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
            named = [(a, b, flat or (b == 0 and a <= 8)) for a, b in corners]
            polygons.append([index.setdefault(name, len(index)) for name in named])
    points = [(a, b, 0.0) if flat else (a, c * b, s * b) for a, b, flat in index]
    return np.array(points, float), polygons


@pytest.mark.parametrize("turned", [0.4, 2.0])
def test_flat_sides_stay_beside_one_another_across_a_line_unless_they_would_cover_each_other(turned):
    beside = [(x, y) for x in range(8) for y in range(4)]
    points, polygons = two_sides(beside, turned)
    (chart,) = strict_charts(meshes.polygon_surface(points, polygons))
    assert len(flat_sides(chart)) == 0
    covering = [*beside, *((x, y) for x in range(8, 12) for y in (2, 3))]
    points, polygons = two_sides(covering, turned)
    (chart,) = strict_charts(meshes.polygon_surface(points, polygons))
    edges = flat_sides(chart)
    line = np.flatnonzero((points[:, 1] == 0) & (points[:, 2] == 0) & (points[:, 0] <= 8))
    assert len(edges) == 8 and {*np.unique(edges).tolist()} == {*line.tolist()}


def test_sides_around_a_blade_unfold_in_a_row():
    """All but one line stay: the last one closes a ring, which cannot lie flat."""
    rows, n = 8, 4
    outline = np.array([[1.0, 0.0], [0.0, 0.2], [-1.0, 0.0], [0.0, -0.2]])
    points = np.concatenate([np.column_stack([outline, np.full(n, 0.5 * z)]) for z in range(rows + 1)])
    polygons = [
        (z * n + k, z * n + (k + 1) % n, (z + 1) * n + (k + 1) % n, (z + 1) * n + k)
        for z in range(rows)
        for k in range(n)
    ]
    seam = np.column_stack([np.arange(rows) * n, np.arange(1, rows + 1) * n])
    (chart,) = strict_charts(meshes.polygon_surface(points, polygons, seam))
    edges = np.sort(flat_sides(chart), axis=1)
    assert len(edges) == rows and len(np.unique(edges[:, 0] % n)) == 1
    assert np.array_equal(edges[:, 1] - edges[:, 0], np.full(rows, n))


@pytest.mark.parametrize("share", [0.5, 0.1])
def test_slivers_of_small_charts_that_cover_little_come_apart(share):
    """Of two strips around a corner, the end of one lies on the other by a sliver."""
    V, F, flat = ramp(1.0 + 0.02 * share, steps=24, rings=2)
    (chart,) = strict_charts(triangle_surface(V, F))
    assert 0 < overlap_share(flat[chart.vertex_ids][chart.triangles], samples=20_000) < 0.02
    edges = parted(chart, flat[chart.vertex_ids], np.ones(len(chart.vertices)))
    assert len(edges) == 1


def test_a_round_body_has_no_flat_sides():
    (chart,) = strict_charts(triangle_surface(*meshes.cap(12, 24, 0.9)))
    assert len(flat_sides(chart)) == 0


def steep_spots(V, F, *middles, radius=0.12):
    """Triangles (m,) bool near any of the points."""
    centre = V[F].mean(axis=1)
    return np.any([np.linalg.norm(centre - middle, axis=1) < radius for middle in middles], axis=0)


@pytest.mark.parametrize("mirrored", [False, True])
def test_slits_run_from_the_boundary_into_what_is_steep(mirrored):
    V, F = meshes.grid(20, 20)
    (chart,) = strict_charts(triangle_surface(V, F))
    spots = [(0.3, 0.55, 0.0), (0.7, 0.55, 0.0)]
    steep = steep_spots(chart.vertices, chart.triangles, *(spots if mirrored else spots[:1]))
    assert steep.any()
    image, images = None, None
    if mirrored:
        there = V * [-1, 1, 1] + [1, 0, 0]
        image = np.linalg.norm(V[None] - there[:, None], axis=2).argmin(axis=1)
        images = MirrorImages.of(image)
    n = len(chart.vertices)
    edges = slits(chart, steep, 1e-6, np.ones(n), np.zeros(n, dtype=bool), images)
    tips, degree = np.unique(edges, return_counts=True)
    outer = (np.abs(V[:, :2] - 0.5) > 0.5 - 1e-9).any(axis=1)
    ends = tips[degree == 1]
    inner = ends[~outer[ends]]
    assert len(inner) == (2 if mirrored else 1) and outer[ends].sum() == len(inner)
    reached = np.linalg.norm(V[inner][:, None] - np.array(spots), axis=2).min(axis=1)
    assert (reached < 0.2).all()
    if mirrored:
        assert np.array_equal(np.sort(image[tips]), tips)
    # No more than is asked for: one spot is enough.
    assert len(strict_charts(triangle_surface(V, F, edges))) == 1


def test_slits_go_where_they_should_not_only_where_nothing_else_helps():
    V, F = meshes.grid(20, 20)
    (chart,) = strict_charts(triangle_surface(V, F))
    steep = steep_spots(chart.vertices, chart.triangles, (0.25, 0.5, 0.0), (0.75, 0.5, 0.0))
    barred, cost = chart.vertices[:, 0] < 0.5, np.ones(len(V))
    there = face_areas(chart.vertices, chart.triangles)[steep & ~barred[chart.triangles].any(axis=1)].sum()
    edges = slits(chart, steep, 0.9 * there, cost, barred)
    assert len(edges) and (V[edges, 0] >= 0.5).all()
    everywhere = slits(chart, steep, 2.5 * there, cost, barred)
    assert (V[everywhere, 0] < 0.5).any() and (V[everywhere, 0] > 0.5).any()


def test_more_is_slit_every_time():
    V, F = meshes.grid(30, 30)
    (chart,) = strict_charts(triangle_surface(V, F))
    spots = [(x, y, 0.0) for x in (0.2, 0.4, 0.6, 0.8) for y in (0.2, 0.5, 0.8)]
    steep = steep_spots(chart.vertices, chart.triangles, *spots, radius=0.06)
    cost, barred = np.ones(len(V)), np.zeros(len(V), dtype=bool)

    def reached(least, rounds):
        edges = slits(chart, steep, least, cost, barred, rounds=rounds)
        # A slit may run on from another one's end: what counts are the spots that are slit.
        return int((np.linalg.norm(V[np.unique(edges)][:, None] - np.array(spots), axis=2).min(axis=0) < 0.1).sum())

    one, two, three = (reached(np.inf, rounds) for rounds in (1, 2, 3))
    assert 0 < one <= MOST_SLITS < two <= 2 * MOST_SLITS < three <= len(spots)
    # However little is asked for: the same slits would be in vain again.
    assert [reached(1e-9, rounds) for rounds in (1, 2, 3)] == [1, 2, 3]


@pytest.mark.parametrize(
    "near, radii, least, first",
    [
        (0.1, (0.08, 0.1), 1e-9, "near"),
        (0.1, (0.08, 0.2), 1e-9, "far"),
        (0.0, (0.03, 0.06), 1e-9, "near"),
        (0.0, (0.03, 0.06), 0.05, "far"),
    ],
)
def test_slits_go_where_they_are_short_for_what_they_slit(near, radii, least, first):
    """A spot near the boundary before a larger one far from it, unless that is much larger, or the near one a crumb."""
    V, F = meshes.grid(60, 60)
    (chart,) = strict_charts(triangle_surface(V, F))
    spots = [(0.5, near, 0.0), (0.5, 0.55, 0.0)]
    both = [steep_spots(V, F, spot, radius=r) for spot, r in zip(spots, radii, strict=True)]
    cost, barred = np.ones(len(V)), np.zeros(len(V), dtype=bool)
    order = slits(chart, both[0] | both[1], least, cost, barred)
    alone = slits(chart, both[first == "far"], least, cost, barred)
    assert len(alone) and np.array_equal(order[: len(alone)], alone)


def test_nothing_steep_nothing_slit():
    V, F = meshes.grid(6, 6)
    (chart,) = strict_charts(triangle_surface(V, F))
    nowhere = np.zeros(len(V), dtype=bool)
    assert slits(chart, np.zeros(len(F), dtype=bool), 0.0, np.ones(len(V)), nowhere).shape == (0, 2)


def test_a_slit_goes_to_the_one_before_where_that_is_nearer_than_the_boundary():
    V, F = meshes.grid(40, 40)
    (chart,) = strict_charts(triangle_surface(V, F))
    spots = [(0.42, 0.5, 0.0), (0.58, 0.5, 0.0)]
    one, other = (steep_spots(V, F, spot, radius=0.06) for spot in spots)
    cost, barred = np.ones(len(V)), np.zeros(len(V), dtype=bool)
    both = slits(chart, one | other, np.inf, cost, barred)
    alone = [slits(chart, mine, np.inf, cost, barred) for mine in (one, other)]
    # A slit of the boundary alone takes as many edges for each.
    assert min(map(len, alone)) <= len(both) < 0.8 * sum(map(len, alone))
    # All of it hangs together.
    _, ends = np.unique(both, return_inverse=True)
    assert len(np.unique(graph_components(*ends.reshape(-1, 2).T, int(ends.max()) + 1)[1])) == 1
