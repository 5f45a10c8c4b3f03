"""Bodies that sprawl in a texture lose limbs at their necks; what is compact stays whole."""

from dataclasses import replace

import bodies
import meshes
import numpy as np
import pytest
from polygons import with_limbs
from scipy.spatial import cKDTree

from omt_uv.solver.analysis.symmetry_plane import MirrorImages
from omt_uv.solver.mesh.charts import part_of_chart, strict_charts
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization import pieces
from omt_uv.solver.parameterization import unwrap as unwrap_module
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.seams import limbs
from omt_uv.solver.seams.limbs import (
    FULLER,
    LEAST_LIMB,
    MUCH,
    SPRAWLING,
    may_come_apart,
    pieces_of_chart,
    sprawls,
    without_limbs,
)

UP = (0.0, 0.0, 1.0)


def cross(length=14, width=3, lean=(0, 0)):
    """A flat chart of four arms of so many cells around a square, upright in x and z, and its map; leaning, the arms
    are longer on one side."""
    n = 2 * length + width
    V, F = meshes.grid(n, n, width=n, height=n)
    cell = V[F].mean(axis=1)[:, :2] - V[:, :2].mean(axis=0)
    F = F[(np.abs(cell - np.array(lean)) < width / 2).any(axis=1)]
    used, F = np.unique(F, return_inverse=True)
    flat = V[used, :2] - V[:, :2].mean(axis=0)
    points = np.stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]], axis=1)
    surface = triangle_surface(points, F.reshape(-1, 3))
    (chart,) = strict_charts(surface)
    return surface, chart, flat[chart.vertex_ids]


def area_of(chart):
    return float(face_areas(chart.vertices, chart.triangles).sum())


def test_a_cross_loses_arms_across_the_shortest_edges():
    surface, chart, uv = cross()
    assert sprawls(chart, uv, UP, area_of(chart))
    piece, edges = without_limbs(chart, uv, np.ones(len(uv)), UP)
    area = np.bincount(piece, face_areas(chart.vertices, chart.triangles))
    assert 2 <= len(area) <= 5 and area.min() >= LEAST_LIMB * area.sum() / 2
    # Each cut runs straight across one arm.
    assert len(edges) == 3 * (len(area) - 1)
    apart = strict_charts(replace(surface, seams=edges))
    assert sorted(len(c.triangles) for c in apart) == sorted(np.bincount(piece).tolist())
    boxes = [np.ptp(uv[chart.triangles[piece == k]].reshape(-1, 2), axis=0) for k in range(len(area))]
    assert sum(a * b for a, b in boxes) * FULLER < np.prod(np.ptp(uv, axis=0))


def test_a_part_that_keeps_all_else_small_may_come_apart():
    """As long as it is much of the whole, and a square around it would be empty for most of it, whatever is beside."""
    _, chart, uv = cross(length=30)
    own, square = area_of(chart), np.ptp(uv, axis=0).max() ** 2
    most = min(SPRAWLING * square, own / MUCH)
    assert 2 * own < most < SPRAWLING * square * 1.001
    assert may_come_apart(chart, uv, UP, own) and may_come_apart(chart, uv, UP, 0.999 * most)
    assert not may_come_apart(chart, uv, UP, 1.001 * most)
    # Little of a large whole stays as it is, however long.
    _, chart, uv = cross(length=60)
    own, square = area_of(chart), np.ptp(uv, axis=0).max() ** 2
    assert own / MUCH < SPRAWLING * square
    assert may_come_apart(chart, uv, UP, 0.999 * own / MUCH) and not may_come_apart(chart, uv, UP, 1.001 * own / MUCH)


def arc(turn=4.4, width=0.7, radius=2.0, along=60, across=8):
    """A flat chart that goes around so far, upright in x and z, and its map."""
    V, F = meshes.grid(along, across, width=1.0, height=1.0)
    u, v = V[:, 0] / np.ptp(V[:, 0]), V[:, 1] / np.ptp(V[:, 1])
    r = radius + width * (v - v.min() - 0.5)
    angle = turn * (u - u.min())
    points = np.stack([r * np.cos(angle), 0 * r, r * np.sin(angle)], axis=1)
    (chart,) = strict_charts(triangle_surface(points, F))
    return chart, chart.vertices[:, [0, 2]]


@pytest.mark.parametrize("turn", [4.4, 5.0, 5.6])
def test_a_band_that_bends_is_cut_across_in_pieces_as_long(turn):
    chart, uv = arc(turn)
    piece, edges = without_limbs(chart, uv, np.ones(len(uv)), UP)
    area = np.bincount(piece, face_areas(chart.vertices, chart.triangles))
    assert len(area) in (2, 3, 4) and np.ptp(area) < 0.2 * area.mean()
    # Straight across, as the cells are: one angle for each cut.
    place = np.argsort(chart.vertex_ids)
    z, x = uv[place[edges]].T[::-1]
    assert len(edges) == 8 * (len(area) - 1) and np.abs(np.diff(np.arctan2(z, x), axis=0)).max() < 1e-9


def test_a_band_that_is_short_or_of_many_widths_is_no_such_band(monkeypatch):
    told = []
    monkeypatch.setattr(limbs, "_across", lambda graph, *rest: told.append(rest) or np.zeros(len(graph.joined), bool))
    for chart, uv, bends in ((*arc(4.4), True), (*arc(0.7), False), (*cross()[1:], False)):
        told.clear()
        without_limbs(chart, uv, np.ones(len(uv)), UP)
        assert bool(told) == bends


def test_what_is_dear_is_not_cut():
    surface, chart, uv = cross()
    dear = (np.abs(uv) > 2).any(axis=1) & (np.abs(uv) < 8).all(axis=1)
    _, edges = without_limbs(chart, uv, np.where(dear, 50.0, 1.0), UP)
    cut = np.isin(chart.vertex_ids, edges)
    assert cut.any() and not dear[cut].any()


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20])
def test_scale_plays_no_part(scale):
    surface, chart, uv = cross(lean=(1, 3))
    given = without_limbs(chart, uv, np.ones(len(uv)), UP)
    large = type(chart)(scale * chart.vertices, chart.triangles, chart.corners, chart.faces, chart.vertex_ids)
    scaled = without_limbs(large, scale * uv, np.full(len(uv), 4.0), UP)
    assert all(np.array_equal(a, b) for a, b in zip(given, scaled, strict=True))


def test_cuts_of_what_is_symmetric_are_their_own_image():
    # With arms of fourteen cells, pieces fill as much more as is asked for, but for rounding.
    surface, chart, uv = cross(15)
    image = cKDTree(surface.positions).query(surface.positions * [-1, 1, 1])[1]
    _, edges = without_limbs(chart, uv, np.ones(len(uv)), UP, MirrorImages.of(image))
    assert len(edges)
    assert {frozenset(e) for e in image[edges].tolist()} == {frozenset(e) for e in edges.tolist()}


def test_cuts_of_what_is_nearly_symmetric_are_about_their_own_image():
    """No vertex has an exact image, and yet an arm comes off on both sides."""
    surface, chart, uv = cross()
    rng = np.random.default_rng(3)
    surface = replace(surface, positions=surface.positions + 0.2 * rng.uniform(-1, 1, surface.positions.shape))
    chart = replace(chart, vertices=surface.positions[chart.vertex_ids])
    there = surface.positions * [-1, 1, 1]
    near = cKDTree(surface.positions).query(there)[1]
    n = len(near)
    images = MirrorImages(np.full(n, -1), near, np.abs(surface.positions[:, 0]) < 0.5, False)
    piece, edges = without_limbs(chart, uv, np.ones(n), UP, images)
    middle = np.stack([uv[chart.triangles[piece == k]].mean(axis=(0, 1)) for k in range(piece.max() + 1)])
    assert len(middle) > 1 and len(edges)
    # Every piece has one of about the same size where its image is.
    far = np.linalg.norm(middle[None] * [-1, 1] - middle[:, None], axis=2).min(axis=1)
    assert (far < 1.5).all()


def test_what_is_compact_stays_whole():
    V, F = meshes.grid(12, 10)
    (chart,) = strict_charts(triangle_surface(V, F))
    uv = chart.vertices[:, :2]
    assert not sprawls(chart, uv, UP, area_of(chart))
    piece, edges = without_limbs(chart, uv, np.ones(len(uv)), UP)
    assert not piece.any() and not len(edges)


def test_parts_of_a_chart_know_their_vertices():
    _, chart, _ = cross()
    rows = chart.vertices[chart.triangles].mean(axis=1)[:, 0] > 3
    part, used = part_of_chart(chart, rows)
    assert np.array_equal(part.vertices, chart.vertices[used])
    assert np.array_equal(used[part.triangles], chart.triangles[rows])
    assert np.array_equal(part.vertex_ids, chart.vertex_ids[used])
    assert np.array_equal(part.corners, chart.corners[rows]) and np.array_equal(part.faces, chart.faces[rows])


def patched(V, F, filled):
    """The chart of a disk whose triangles `filled` (m,) bool are those of holes."""
    (whole,) = strict_charts(triangle_surface(V, F))
    real = ~filled[whole.faces]
    own = np.isin(np.arange(len(V)), whole.triangles[real])
    return replace(
        whole,
        triangles=whole.triangles[real],
        corners=whole.corners[real],
        faces=whole.faces[real],
        vertex_ids=np.where(own, whole.vertex_ids, -1),
        patches=whole.triangles[~real],
    )


def test_patches_go_with_the_part_that_is_all_around_them():
    """Two holes of a chart, filled; cut beside both, each part is a disk with one, and cut through one that is open."""
    V, F = meshes.grid(12, 4, width=12, height=4)
    middle = V[F].mean(axis=1)
    hole = [(np.abs(middle[:, :2] - at) < 1).all(axis=1) for at in ([3, 2], [9, 2])]
    chart = patched(V, F, hole[0] | hole[1])
    place = chart.vertices[chart.triangles].mean(axis=1)[:, 0]
    for line, counts in ((6, (8, 8)), (3, (0, 8))):
        for side, count in zip((place < line, place > line), counts, strict=True):
            part, used = part_of_chart(chart, side)
            assert len(part.patches) == count and len(part.triangles) == side.sum()
            np.testing.assert_array_equal(part.vertices, chart.vertices[used])
            np.testing.assert_array_equal(used[part.triangles], chart.triangles[side])
            np.testing.assert_array_equal(part.vertex_ids, chart.vertex_ids[used])
            here = chart.vertices[chart.patches].mean(axis=1)[:, 0]
            here = (here < line) if count and side[place.argmin()] else (here > 6)
            np.testing.assert_array_equal(used[part.patches], chart.patches[here & (count > 0)])
            # With its patches it is the disk that it was, without holes.
            assert line != 6 or len(boundary_loops(part.disk)) == 1


@pytest.mark.parametrize("apart", [False, True])
def test_what_hangs_together_by_a_filled_hole_alone_stays_whole(apart):
    V, F = meshes.grid(40, 2, width=20, height=1)
    middle = np.abs(V[F].mean(axis=1)[:, 0] - 10) < 1
    chart = patched(V, F, middle & (apart | (V[F].mean(axis=1)[:, 1] > 0.5)))
    piece, edges = pieces_of_chart(chart, chart.vertices[:, :2], np.ones(len(V)), None, 20.0)
    assert (piece.max() == 0 and not len(edges)) == apart


@pytest.mark.parametrize(("holes", "fill"), [(2, True), (3, False)])
def test_what_has_holes_loses_limbs_as_well(monkeypatch, holes, fill):
    """A head whose eyes are open sprawls as one whose eyes are closed."""
    for name in ("SPRAWLING", "FULL", "FULLER", "HOPEFUL"):
        monkeypatch.setattr(limbs, name, 1.0)
    V, F = bodies.limbed(3)
    middle = V[F].mean(axis=1)
    far = np.linalg.norm(middle[:, None] - middle[[50, 700, 1100][:holes]], axis=2).min(axis=1)
    F = F[far > 0.12]
    found = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(max_shear=1.35, fill_holes=fill)))
    assert len(found.charts) > 1 and any(len(chart.patches) for chart in found.charts)
    assert not any(one.folds for one in found.maps) and max(one.angle_mean for one in found.maps) <= 1.35
    assert sorted(np.concatenate([chart.faces for chart in found.charts])) == list(range(len(F)))


@pytest.mark.parametrize("seed", [2, 7])
def test_pieces_are_mapped_as_if_their_seams_were_given(monkeypatch, seed):
    """A limb that comes off for its room in the texture keeps none of the shear that it had on the body."""
    for name in ("SPRAWLING", "FULL", "FULLER", "HOPEFUL"):
        monkeypatch.setattr(limbs, name, 1.0)
    monkeypatch.setattr("omt_uv.solver.parameterization.shear_bound.COMPACT", 0.1)
    surface = meshes.polygon_surface(*with_limbs(seed))
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))
    given = replace(surface, seams=np.concatenate([surface.seams, found.seams]))
    again = drain(unwrap(given, options=UnwrapOptions(seams="existing")))
    assert len(found.charts) == len(again.charts) > 1
    shears = [sorted(one.angle_mean for one in maps) for maps in (found.maps, again.maps)]
    np.testing.assert_allclose(*shears, rtol=1e-3)


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("seed", [3, 8])
def test_limbs_that_come_off_keep_the_bound_by_themselves(seed, large, monkeypatch):
    """Not only in the mean with what they hung on; what is said is about the pieces. What is large is not made shorter
    before."""
    seen, found = bounded_twice(seed, large, 1.0, monkeypatch)
    (whole, cuts, short), (pieces, more, at_last) = seen
    assert pieces > whole and more > cuts and found.warnings == (f"of {pieces}",)
    assert short != large and at_last
    assert all(one.angle_mean <= 1.36 for one in found.maps) and len(found.charts) >= pieces


@pytest.mark.parametrize("large", [False, True])
def test_what_does_not_come_in_pieces_is_made_shorter_all_the_same(large, monkeypatch):
    seen, found = bounded_twice(3, large, np.inf, monkeypatch)
    assert [short for *_, short in seen] == ([False, True] if large else [True])
    assert len({charts for charts, *_ in seen}) == 1
    assert all(one.angle_mean <= 1.36 for one in found.maps)


def bounded_twice(seed, large, fuller, monkeypatch):
    """The charts and cuts that each call was given whose shear was bounded, and whether what it gave was short; and
    the map of a body with limbs. fuller : how much more of a texture pieces have to fill."""
    for name in ("SPRAWLING", "FULL", "HOPEFUL"):
        monkeypatch.setattr(limbs, name, 1.0)
    monkeypatch.setattr(limbs, "FULLER", fuller)
    monkeypatch.setattr(pieces, "LARGE", 0 if large else np.inf)
    monkeypatch.setattr("omt_uv.solver.parameterization.shear_bound.COMPACT", 0.1)
    seen, bound_shear = [], unwrap_module.bound_shear

    def recorded(search, first, maps, *rest, **named):
        found = yield from bound_shear(search, first, maps, *rest, **named)
        seen.append((len(first.charts), len(first.found_cuts.edges), found.is_short))
        return replace(found, warnings=(f"of {len(first.charts)}",))

    monkeypatch.setattr(unwrap_module, "bound_shear", recorded)
    return seen, drain(unwrap(meshes.polygon_surface(*with_limbs(seed)), options=UnwrapOptions(max_shear=1.35)))


def bars():
    """Two long bars with a bridge between them, upright in x and z: the surface, its chart, and the map of that."""
    V, F = meshes.grid(50, 4, width=50, height=4)
    cell = V[F].mean(axis=1) - [25, 2, 0]
    F = F[(np.abs(cell[:, 0]) > 1) | (np.abs(cell[:, 1]) < 1)]
    used, F = np.unique(F, return_inverse=True)
    flat = V[used, :2] - [25, 2]
    surface = triangle_surface(np.column_stack([flat[:, 0], 0 * flat[:, 0], flat[:, 1]]), F.reshape(-1, 3))
    (chart,) = strict_charts(surface)
    return surface, chart, flat[chart.vertex_ids]


def test_halves_of_one_picture_are_not_parted():
    """The bridge lies in the mirror plane: bars do not come apart there."""
    surface, chart, uv = bars()
    cost = np.ones(len(chart.vertices))
    image = cKDTree(surface.positions).query(surface.positions * [-1, 1, 1])[1]
    middle = np.abs(surface.positions[:, 0]) < 0.5
    assert middle[without_limbs(chart, uv, cost, UP)[1]].any()
    assert not middle[without_limbs(chart, uv, cost, UP, MirrorImages.of(image))[1]].any()


@pytest.mark.parametrize("angle", [0.3, 1.1, 2.9])
def test_where_nobody_knows_what_is_up_the_turn_of_a_map_plays_no_part(angle):
    _, chart, uv = bars()
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    given, turned = (without_limbs(chart, flat, np.ones(len(uv)), None) for flat in (uv, uv @ turn))
    assert len(given[1]) and sprawls(chart, uv, None, area_of(chart)) == sprawls(chart, uv @ turn, None, area_of(chart))
    np.testing.assert_array_equal(*(np.unique(np.sort(edges, axis=1), axis=0) for _, edges in (given, turned)))
