"""Bodies full of holes: surfaces, tubes and boxes that are sieves, frames, plates with holes right through them."""

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from short_cuts import gluing_of

from omt_uv.pipelines.unwrap import _connected_triangles
from omt_uv.solver.analysis.facing import SceneAxes
from omt_uv.solver.analysis.seam_costs import SeamPreferences
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.cutting.hole_filling import MANY, NO_POLYGON, fill_holes, hole_boundaries, level_parts
from omt_uv.solver.errors import NotADiskError
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def used(V, F):
    vertices, index = np.unique(F, return_inverse=True)
    return V[vertices], index.reshape(-1, 3)


def punched(n, m, hole, closed=False):
    """Parameters (k,2) in [0, 1] of a grid of n by m quads, the first one closed or not, without those in a hole."""
    columns = n if closed else n + 1
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    i, j = i[~hole(i, j)], j[~hole(i, j)]
    a, b = i * (m + 1) + j, (i + 1) % columns * (m + 1) + j
    faces = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)])
    u, v = np.meshgrid(np.arange(columns) / n, np.arange(m + 1) / m, indexing="ij")
    return used(np.stack([u.ravel(), v.ravel()], 1), faces)


def lattice(period, size):
    """Square holes of some size in every square of a period."""
    return lambda i, j: (i % period >= 1) & (i % period <= size) & (j % period >= 1) & (j % period <= size)


def wavy_plate(n, hole):
    p, F = punched(n, n, hole)
    p = 10 * p
    return np.column_stack([p, 0.5 * np.sin(p[:, 0]) * np.cos(1.3 * p[:, 1])]), F


def tube(n, m, hole, bulge=0.0):
    p, F = punched(n, m, hole, closed=True)
    angle, height = 2 * np.pi * p[:, 0], 4 * p[:, 1]
    radius = 1 + bulge * np.sin(1.7 * height)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height]), F


def box(n=12):
    p, F = punched(n, n, lattice(3, 1))
    sides = []
    for axis in range(3):
        for end in (0, 1):
            side = (
                np.insert(p, axis, end, axis=1) if axis != 1 else np.column_stack([p[:, 1], 0 * p[:, 0] + end, p[:, 0]])
            )
            sides.append(side[F if end else F[:, ::-1]])
    corners = np.concatenate(sides).reshape(-1, 3)
    _, first, index = np.unique(np.round(corners * n).astype(int), axis=0, return_index=True, return_inverse=True)
    return corners[first], index.reshape(-1, 3)


def plate(n, thick=0.3):
    """A solid plate with holes right through it."""
    p, F = punched(n, n, lattice(3, 1))
    k = len(p)
    V = np.concatenate([np.column_stack([10 * p, np.full(k, thick)]), np.column_stack([10 * p, np.zeros(k)])])
    boundary = np.concatenate([np.column_stack([loop, np.roll(loop, -1)]) for loop in boundary_loops(F)])
    a, b = boundary.T
    walls = np.concatenate([np.stack([b, a, a + k], 1), np.stack([b, a + k, b + k], 1)])
    return V, np.concatenate([F, F[:, ::-1] + k, walls])


def lattice_body(n):
    """Round struts between n^3 joints: the surface of cubes of which every second one in a row is a joint, smoothed."""
    k = 2 * n - 1
    solid = np.zeros((k + 2,) * 3, bool)
    i = np.stack(np.meshgrid(*[np.arange(k)] * 3, indexing="ij"))
    solid[1:-1, 1:-1, 1:-1] = (i % 2).sum(0) <= 1
    solid = solid.repeat(2, 0).repeat(2, 1).repeat(2, 2)
    faces = []
    for axis in range(3):
        u, v = (np.eye(3, dtype=int)[(axis + s) % 3] for s in (1, 2))
        for end in (0, 1):
            out = solid & ~np.roll(solid, 1 - 2 * end, axis)
            low = np.argwhere(out) + end * np.eye(3, dtype=int)[axis]
            square = np.stack([low, low + u, low + u + v, low + v], axis=1)
            faces.append(square if end else square[:, ::-1])
    points, index = np.unique(np.concatenate(faces).reshape(-1, 3), axis=0, return_inverse=True)
    quads = index.reshape(-1, 4)
    V, F = points.astype(float), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    for _ in range(4):
        around = np.zeros_like(V)
        np.add.at(around, quads.ravel(), V[np.roll(quads, 1, axis=1).ravel()] + V[np.roll(quads, -1, axis=1).ravel()])
        V = around / (2 * np.bincount(quads.ravel()))[:, None]
    return V, F


def check(V, F, shear, parts=1):
    result = drain(unwrap(triangle_surface(V, F)))
    areas = np.array([face_areas(V, F[c.faces]).sum() for c in result.charts])
    mean = {n: areas @ [getattr(m, n) for m in result.maps] / areas.sum() for n in ("area_l1", "angle_mean")}
    assert len(result.charts) == parts and not any(m.folds for m in result.maps)
    assert mean["area_l1"] <= 0.01 and mean["angle_mean"] <= shear
    assert sum(len(c.triangles) for c in result.charts) == len(F)
    return result


def test_a_plate_full_of_holes_is_mapped_whole():
    V, F = wavy_plate(25, lattice(3, 1))
    assert len(boundary_loops(F)) > 33
    result = check(V, F, 1.2)
    assert len(result.seams) == 0 and "holes" in result.warnings[0]
    assert cut(triangle_surface(V, F)).length == 0


def test_the_outer_boundaries_of_a_tube_full_of_holes_stay_open():
    V, F = tube(32, 24, lattice(4, 2))
    result = check(V, F, 1.02)
    cuts = cut(triangle_surface(V, F))
    assert cuts.components[0].boundaries == 2 and cuts.length == pytest.approx(4)
    assert len(boundary_loops(result.charts[0].disk)) == 1


def test_a_tube_that_is_not_flat_is_cut_to_its_extremities():
    check(*tube(48, 40, lattice(4, 2), bulge=0.5), 1.6)


def test_a_box_full_of_holes_has_its_net():
    V, F = box()
    result = check(V, F, 1 + 1e-6)
    assert len(cut(triangle_surface(V, F)).components[0].extremities) == 8
    assert result.maps[0].area_l1 < 1e-6


def test_few_holes_are_cut_to():
    V, F = wavy_plate(12, lattice(3, 1))
    (chart,) = cut_to_disks(triangle_surface(V, F), sieve=32).charts
    assert len(chart.patches) == 0


def test_a_frame_of_few_holes_is_cut():
    result = check(*wavy_plate(44, lattice(11, 9)), 1.3)
    assert len(result.seams) and not len(result.charts[0].patches)


def test_a_plate_with_many_holes_through_it_comes_apart_along_its_edges():
    V, F = plate(18)
    result = check(V, F, 1 + 1e-6, parts=36 + 1)
    assert any("apart" in text for text in result.warnings)
    assert len(np.unique(np.sort(result.seams, axis=1), axis=0)) == len(result.seams)


def test_a_lattice_without_sides_falls_into_clusters():
    """28 handles: cut open into one chart, it is sheared twice as much."""
    V, F = lattice_body(3)
    assert len(V) - len(F) // 2 == 2 - 2 * 28
    parts = len(cut_to_disks(triangle_surface(V, F), sieve=32).charts)
    assert 4 <= parts <= 60
    check(V, F, 1.5, parts)


def test_a_plate_with_few_holes_through_it_stays_connected_triangles():
    check(*plate(6), 1.2)


@pytest.mark.parametrize("body", [(tube, 32, 24, lattice(4, 2)), (box,), (plate, 18), (lattice_body, 3)])
def test_the_marked_seams_of_a_sieve_are_enough(body):
    """What Seams marks, Unwrap with existing seams takes; it fills the same holes but those that seams open."""
    V, F = body[0](*body[1:])
    marked = triangle_surface(V, F, cut(triangle_surface(V, F)).edges)
    charts = cut_to_disks(marked, seams="existing", sieve=32).charts
    own = cut_to_disks(triangle_surface(V, F), sieve=32).charts
    assert len(charts) == len(own) and max(len(c.patches) for c in charts) >= 0.9 * max(len(c.patches) for c in own)
    assert sum(len(c.triangles) for c in charts) == len(F)


def test_seams_of_a_sieve_that_leave_a_tube_are_refused():
    V, F = tube(32, 24, lattice(4, 2))
    with pytest.raises(NotADiskError, match="A chart has"):
        cut_to_disks(triangle_surface(V, F), seams="existing", sieve=32)


def test_who_prepares_without_asking_for_it_gets_no_patches():
    charts = cut_to_disks(triangle_surface(*wavy_plate(25, lattice(3, 1)))).charts
    assert not any(len(c.patches) for c in charts)


def test_marked_seams_are_kept_in_sieves():
    V, F = wavy_plate(25, lattice(3, 1))
    line = np.flatnonzero(np.abs(V[:, 0] - 4.8) < 1e-9)
    line = line[np.argsort(V[line, 1])]
    seams = np.column_stack([line[:-1], line[1:]])
    result = drain(unwrap(triangle_surface(V, F, seams)))
    assert len(result.charts) == 2
    assert max(m.area_l1 for m in result.maps) <= 0.01


def test_what_hangs_by_a_vertex_is_packed_with_what_fills_its_holes():
    chart = cut_to_disks(triangle_surface(*wavy_plate(25, lattice(3, 1))), sieve=32).charts[0]
    assert _connected_triangles(chart) is chart.triangles
    half = len(chart.triangles) // 2
    quad, two = (replace(chart, triangles=chart.triangles[[0, k]]) for k in (half, half - 1))
    assert len(_connected_triangles(quad)) == 2
    assert len(_connected_triangles(two)) == len(two.disk)


@pytest.mark.parametrize("change", [lambda V: 1e-6 * V, lambda V: V + 1e3])
def test_sieves_are_the_same_in_every_unit_and_place(change):
    V, F = box()
    result, other = (drain(unwrap(triangle_surface(x, F))) for x in (V, change(V)))
    np.testing.assert_array_equal(result.seams, other.seams)
    np.testing.assert_array_equal(result.charts[0].disk, other.charts[0].disk)


# ---- the fans -----------------------------------------------------------------------------------------------


def test_all_but_the_longest_boundary_are_filled_with_a_fan_each():
    V, F = wavy_plate(9, lattice(4, 2))
    surface, gluing = triangle_surface(V, F), gluing_of(V, F)
    one_sided = np.zeros(len(F), bool)
    around, hole = hole_boundaries(V, gluing, one_sided)
    found = fill_holes(surface, gluing, one_sided)
    assert found.holes == hole.max() + 1 == len(boundary_loops(F)) - 1
    fans = found.gluing.owner == NO_POLYGON
    assert fans.sum() == len(around) and len(found.surface.positions) == len(V) + found.holes
    # What was there stays, and one boundary is left.
    np.testing.assert_array_equal(found.gluing.triangles[~fans], gluing.triangles)
    np.testing.assert_array_equal(found.surface.positions[: len(V)], V)
    filled = found.gluing.vertex[found.gluing.triangles]
    assert sorted(map(len, boundary_loops(filled))) == [max(map(len, boundary_loops(F)))]


def test_a_hole_is_filled_around_its_middle():
    V, F = wavy_plate(6, lattice(5, 3))
    V[:, 2] = 0
    found = fill_holes(triangle_surface(V, F), gluing_of(V, F), np.zeros(len(F), bool))
    for k in range(found.holes):
        loop = boundary_loops(F)
        middles = [V[x].mean(0) for x in loop]
        assert min(np.abs(m - found.surface.positions[len(V) + k]).max() for m in middles) < 1e-12
    total = face_areas(found.surface.positions, found.gluing.vertex[found.gluing.triangles]).sum()
    assert total == pytest.approx(np.prod(np.ptp(V[:, :2], axis=0)))


def test_one_sided_surfaces_and_few_holes_are_left_alone():
    V, F = wavy_plate(9, lattice(4, 2))
    surface, gluing = triangle_surface(V, F), gluing_of(V, F)
    assert fill_holes(surface, gluing, np.ones(len(F), bool)).holes == 0
    assert fill_holes(surface, gluing, np.zeros(len(F), bool), sieve=32).gluing is gluing


# ---- holes in faces -----------------------------------------------------------------------------------------


def pierced(*directions, reach=0.15):
    """A sphere with holes in these directions, and the vertices around each."""
    V, F = meshes.icosphere(4)
    near = [(np.linalg.norm(V - np.array(d) / np.linalg.norm(d), axis=1) < reach)[F].any(axis=1) for d in directions]
    V, F = used(V, F[~np.any(near, axis=0)])
    loops = boundary_loops(F)
    borders = [min(loops, key=lambda loop, d=d: -(V[loop].mean(axis=0) @ np.array(d))) for d in directions]
    return V, F, borders


def face_costs(n, front, in_face=True, within=False):
    """Costs of a surface that is a face to the `front`, all of it or but for the vertices given."""
    where = np.full(n, within) if isinstance(within, bool) else np.isin(np.arange(n), within)
    shown = np.full(n, in_face) if isinstance(in_face, bool) else ~np.isin(np.arange(n), in_face)
    found = SimpleNamespace(in_face=shown, within_face=where, facing=SimpleNamespace(front=np.array(front, float)))
    return lambda: found


def open_ends(V, F, costs, **given):
    """Boundaries that stay open, as sets of vertices, and what was found."""
    found = fill_holes(triangle_surface(V, F), gluing_of(V, F), np.zeros(len(F), bool), 32, costs=costs, **given)
    filled = found.gluing.vertex[found.gluing.triangles]
    return [set(loop.tolist()) for loop in boundary_loops(filled)], found


@pytest.mark.parametrize("size", [1e-120, 1.0, 1e120])
def test_eyes_are_filled_and_what_looks_to_the_side_is_not(size):
    V, F, (left, right, side) = pierced((0.4, -1, 0), (-0.4, -1, 0), (1, 0.2, 0))
    ends, found = open_ends(size * V, F, face_costs(len(V), (0, -1, 0)))
    assert ends == [set(side.tolist())]
    # Nobody has to be told.
    assert found.holes == 0 and len(found.surface.positions) == len(V) + 2
    assert len(open_ends(size * V, F, None)[0]) == 3
    # So it is of what is inside out.
    assert open_ends(size * V, F[:, ::-1], face_costs(len(V), (0, -1, 0)))[0] == ends


def test_the_only_hole_of_a_face_is_filled_too():
    V, F, _ = pierced((0, -1, 0))
    assert open_ends(V, F, face_costs(len(V), (0, -1, 0)))[0] == []


@pytest.mark.parametrize(
    "marked, closing, left", [((), True, 0), ((0,), True, 1), ((1,), True, 1), ((0, 1), True, 1), ((), False, 1)]
)
def test_the_last_boundary_stays_where_seams_were_marked_or_nothing_is_to_be_cut(marked, closing, left):
    V, F, loops = pierced((0.4, -1, 0), (-0.4, -1, 0.1))
    around = [np.column_stack([loops[k], np.roll(loops[k], -1)]) for k in marked]
    surface = triangle_surface(V, F, np.concatenate(around) if marked else ())
    none, costs = np.zeros(len(F), bool), face_costs(len(V), (0, -1, 0))
    found = fill_holes(surface, gluing_of(V, F), none, 32, costs=costs, closing=closing)
    assert len(boundary_loops(found.gluing.vertex[found.gluing.triangles])) == left


def test_a_hole_that_reaches_out_of_the_face_stays():
    V, F, (border,) = pierced((0, -1, 0))
    assert len(open_ends(V, F, face_costs(len(V), (0, -1, 0), in_face=border[:1]))[0]) == 1


def test_a_large_opening_is_no_eye():
    """Around it is more than half the root of the area."""
    lengths = []
    for reach in (0.15, 0.2, 0.25, 0.3):
        V, F, (border,) = pierced((0, -1, 0), reach=reach)
        around = np.linalg.norm(V[border] - V[np.roll(border, 1)], axis=1).sum() / np.sqrt(face_areas(V, F).sum())
        ends, _ = open_ends(V, F, face_costs(len(V), (0, -1, 0)))
        assert (len(ends) == 0) == (around <= 0.5)
        lengths.append(around)
    assert min(lengths) < 0.5 < max(lengths)


def test_the_open_end_of_a_tube_is_no_eye_unless_it_lies_within():
    """Its sides look away from its middle; a throat is like it, but most of its boundary is hidden in the face."""
    V, F = tube(16, 60, lambda i, j: j < 0)
    V[:, :2] *= 0.1
    V, F = used(V, F[(V[F][:, :, 2] < 4).all(axis=1)])
    top = np.flatnonzero(V[:, 2] > V[:, 2].max() - 1e-9)
    assert len(open_ends(V, F, face_costs(len(V), (0, 0, 1)))[0]) == 2
    for hidden, left in ((top[:9], 1), (top[:8], 2)):
        assert len(open_ends(V, F, face_costs(len(V), (0, 0, 1), within=hidden))[0]) == left


def test_costs_are_asked_for_where_there_is_a_short_hole_alone():
    asked = []

    def costs():
        asked.append(1)
        return face_costs(len(V), (0, -1, 0))()

    for reach, times in ((0.5, 0), (0.15, 1)):
        V, F, _ = pierced((0, -1, 0), reach=reach)
        open_ends(V, F, costs)
        assert len(asked) == times


def test_seams_neither_begin_in_the_eyes_of_a_head_nor_lead_there():
    """A head that is its own mirror image, with a nose, and holes for eyes."""
    V, F, borders = pierced((0.35, -1, 0.2), (-0.35, -1, 0.2))
    nose = np.exp(-40 * (V[:, 0] ** 2 + (V[:, 2] + 0.1) ** 2)) * (V[:, 1] < 0)
    V = V * [0.8, 1, 1.2] - 0.5 * nose[:, None] * [0, 1, 0]
    options = UnwrapOptions(max_shear=1.35, preferences=SeamPreferences(axes=SceneAxes()))
    result = drain(unwrap(triangle_surface(V, F), options=options))
    (chart,) = result.charts
    assert len(chart.patches) and len(result.seams)
    assert not np.isin(result.seams, np.concatenate(borders)).any()
    # Its seams may be marked: they cut it into a disk, with the same holes in it.
    marked = triangle_surface(V, F, result.seams)
    (again,) = drain(unwrap(marked, options=replace(options, seams="existing"))).charts
    assert len(again.patches) == len(chart.patches) and set(again.faces) == set(chart.faces)
    # Where no seams are searched for the shear, holes are joined by the shortest way.
    plain = drain(unwrap(triangle_surface(V, F)))
    assert np.isin(plain.seams, np.concatenate(borders)).any()


@pytest.mark.parametrize("side, filled", [(2, 7), (3, 7), (4, 6), (5, 6)])
def test_a_hole_that_is_thrice_as_long_as_the_middle_one_stays_open(side, filled):
    """The outline, four squares of one cell, two of four, and one of this side: the middle one has one cell."""
    V, F = meshes.grid(24, 24, 24.0, 24.0)
    middle, gone = V[F].mean(axis=1), np.zeros(len(F), bool)
    for x, y, size in ((2, 2, 1), (2, 6, 1), (6, 2, 1), (6, 6, 1), (10, 2, 2), (2, 10, 2), (13, 13, side)):
        gone |= (middle[:, 0] > x) & (middle[:, 0] < x + size) & (middle[:, 1] > y) & (middle[:, 1] < y + size)
    warnings = cut_to_disks(triangle_surface(V, F[~gone]), sieve=3).warnings
    assert [text.partition(" are filled")[0] for text in warnings] == [f"{filled} holes"]


@pytest.mark.parametrize(("long", "filled"), [(MANY - 1, 40), (MANY, MANY + 40)])
def test_what_is_long_is_a_hole_where_there_are_too_many_for_outer_boundaries(long, filled):
    """Holes of four cells' sides among forty of one: the outline is the longest, and so many are outer boundaries."""
    V, F = meshes.grid(50, 60, 50.0, 60.0)
    middle, gone = V[F].mean(axis=1), np.zeros(len(F), bool)
    places = [(1 + 6 * (k % 8), 1 + 6 * (k // 8), 4) for k in range(long)]
    places += [(1 + 2 * (k % 20), 50 + 3 * (k // 20), 1) for k in range(40)]
    for x, y, size in places:
        gone |= (middle[:, 0] > x) & (middle[:, 0] < x + size) & (middle[:, 1] > y) & (middle[:, 1] < y + size)
    F = F[~gone]
    found = fill_holes(triangle_surface(V, F), gluing_of(V, F), np.zeros(len(F), bool), sieve=8)
    assert found.holes == filled


def folded_plate(depth, n=16):
    """A plate folded up along its middle by a right angle, with two square holes: the first as deep bevelled."""
    holes = [lambda i, j: (abs(i - 3) <= 1) & (abs(j - 4) <= 1), lambda i, j: (abs(i - 12) <= 1) & (abs(j - 11) <= 1)]
    p, F = punched(n, n, lambda i, j: holes[0](i, j) | holes[1](i, j))
    x, y = n * p.T
    bevel = depth * ((np.maximum(abs(x - 3.5), abs(y - 4.5)) < 2) & (abs(x - 3.5) < 2))
    V = np.column_stack([np.minimum(x, n / 2), y, np.maximum(x - n / 2, 0) - bevel])
    return V, F, np.flatnonzero(bevel[F].any(axis=1)) if depth else np.zeros(0, int)


@pytest.mark.parametrize("depth, level", [(0.3, True), (0.9, False), (0.0, False)])
def test_holes_in_bevels_beside_flat_sides_need_no_cut(depth, level):
    V, F, around = folded_plate(depth)
    gluing = gluing_of(V, F)
    parts = level_parts(gluing, V)
    boundary, loop = hole_boundaries(V, gluing, np.zeros(len(F), bool), MANY, parts)
    found = parts.triangles
    assert len(np.unique(loop)) == level and found.any() == level
    assert np.isin(np.flatnonzero(found), around).all() and np.isin(boundary // 3, around).all()
    # Wherever it lies, and on a part that is cut in two.
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    np.testing.assert_array_equal(level_parts(gluing, 3 * V @ turn + 5).triangles, found)
    two = gluing_of(np.concatenate([V, V + 50]), np.concatenate([F, F + len(V)]))
    np.testing.assert_array_equal(level_parts(two, np.concatenate([V, V + 50])).triangles, np.tile(found, 2))


def test_open_ends_of_tubes_are_no_holes_in_sides():
    V, F = tube(4, 12, lambda i, j: np.zeros(len(i), bool), bulge=0.2)
    assert not level_parts(gluing_of(V, F), V).triangles.any()
