"""Bodies of flat and round sides come apart along their creases, and lie undistorted; all others stay whole."""

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import polygons
import pytest
from short_cuts import component_of
from thin_walls import rounded_box, thickened

from omt_uv.solver.analysis.feature_edges import fold_angles
from omt_uv.solver.cutting import crease_sides, developable_nets
from omt_uv.solver.cutting.component import SMOOTH, TurnedCopies, lone_edges
from omt_uv.solver.cutting.crease_sides import cap_borders, hard_borders, hard_sides, side_borders
from omt_uv.solver.cutting.gluing_facts import in_unit_box
from omt_uv.solver.maps.overlap import part_covered
from omt_uv.solver.mesh.repair import repaired_gluing
from omt_uv.solver.mesh.surface import Surface, chosen_triangles, triangle_surface
from omt_uv.solver.mesh.topology import graph_components, pair_keys
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def turned(profile, sectors=48):
    """A ring: a closed profile (k,2) of radius and height, turned about the axis, as quads."""
    k, angle = len(profile), 2 * np.pi * np.arange(sectors) / sectors
    r, z = np.asarray(profile, float).T
    V = np.stack([np.outer(np.cos(angle), r), np.outer(np.sin(angle), r), np.tile(z, (sectors, 1))], axis=2).reshape(
        -1, 3
    )
    i, j = np.divmod(np.arange(sectors * k), k)
    up, on = (j + 1) % k, (i + 1) % sectors
    return V, np.stack([i * k + j, on * k + j, on * k + up, i * k + up], axis=1)


def washer(sectors=48):
    return turned([(0.7, -0.15), (1.0, -0.15), (1.0, 0.15), (0.7, 0.15)], sectors)


def triangles_of(quads):
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def prism(outline, height=0.5):
    """An extruded outline (k,2) counter-clockwise, its ends fans."""
    k = len(outline)
    low, high = (np.column_stack([outline, np.full(k, z)]) for z in (0.0, height))
    V = np.concatenate([low, high, [[*outline.mean(axis=0), 0.0]], [[*outline.mean(axis=0), height]]])
    i = np.arange(k)
    j = (i + 1) % k
    sides = np.concatenate([np.stack([i, j, k + j], axis=1), np.stack([i, k + j, k + i], axis=1)])
    ends = [np.stack([j, i, np.full(k, 2 * k)], axis=1), np.stack([k + i, k + j, np.full(k, 2 * k + 1)], axis=1)]
    return V, np.concatenate([sides, *ends])


def borders(component):
    found = hard_sides(component)
    return np.zeros(len(component.pair), dtype=bool) if found is None else side_borders(component, *found)


def sides(component, border):
    return graph_components(*(component.pair[~border] // 3).T, len(component.triangles))[1]


def test_a_washer_comes_apart_into_two_rings_and_two_walls():
    V, Q = washer()
    component = component_of(V, triangles_of(Q))
    border = borders(component)
    side = sides(component, border)
    assert side.max() + 1 == 4
    corners = component.positions[component.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    level = np.abs(normal[:, 2]) > 0.5 * np.linalg.norm(normal, axis=1)
    # No side is both flat and round.
    assert all(len(np.unique(level[side == k])) == 1 for k in range(4))


def test_flat_sides_stay_together_across_straight_edges():
    # Three quarters of a disk: the two walls that are flat meet the ends along straight edges.
    angle = np.linspace(0, 1.5 * np.pi, 60)
    outline = np.concatenate([[[0.0, 0.0]], np.column_stack([np.cos(angle), np.sin(angle)])])
    component = component_of(*prism(outline, 0.3))
    border = borders(component)
    assert border.any()
    side = sides(component, border)
    assert 2 <= side.max() + 1 < 5


def bevelled_cylinder(sectors=32):
    """Caps as fans around their centres, walls, and bevels of three segments."""
    arc = np.linspace(0, np.pi / 2, 4)
    rise = np.column_stack([0.44 + 0.06 * np.sin(arc), 0.06 * (1 - np.cos(arc)) - 1])
    r, z = np.concatenate([rise, (rise * [1, -1])[::-1]]).T
    angle = 2 * np.pi * np.arange(sectors) / sectors
    V = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle)), np.repeat(z[:, None], sectors, 1)], axis=2)
    k = np.arange(sectors)
    ring = np.concatenate([np.column_stack([k, np.roll(k, -1)]) + sectors * i for i in range(len(r) - 1)])
    quads = np.column_stack([ring, ring[:, ::-1] + sectors])
    n, top = len(r) * sectors, (len(r) - 1) * sectors
    ends = [np.column_stack([np.roll(k, -1), k, np.full(sectors, n)])]
    ends += [np.column_stack([k + top, np.roll(k, -1) + top, np.full(sectors, n + 1)])]
    return np.concatenate([V.reshape(-1, 3), [[0, 0, -1], [0, 0, 1]]]), np.concatenate([triangles_of(quads), *ends])


def domed_box(height, count=48):
    """A box of 2 x 2 and half as high, with a hill on top, as triangles."""
    V, F = meshes.grid(count, count, 2.0, 2.0)
    x, y = V[:, 0] - V[:, 0].mean(), V[:, 1] - V[:, 1].mean()
    hill = height * (np.cos(np.pi * x / 2) * np.cos(np.pi * y / 2)) ** 2
    outer = np.flatnonzero((np.abs(x) > 0.999) | (np.abs(y) > 0.999))
    outer = outer[np.argsort(np.arctan2(y[outer], x[outer]))]
    n, k = len(V), len(outer)
    V = np.concatenate([np.stack([x, y, hill], 1), np.stack([x[outer], y[outer], np.full(k, -1.0)], 1), [[0, 0, -1.0]]])
    i, j = np.arange(k), (np.arange(k) + 1) % k
    walls = [np.stack([n + i, n + j, outer[j]], axis=1), np.stack([n + i, outer[j], outer[i]], axis=1)]
    return V, np.concatenate([F, *walls, np.stack([n + j, n + i, np.full(k, n + k)], axis=1)])


def test_half_of_a_body_in_flat_sides_between_hard_edges_is_enough():
    component = component_of(*domed_box(1.2))
    whole, unrolls = hard_sides(component)
    # The hill alone does not unroll.
    assert len(unrolls) == 6 and np.count_nonzero(~unrolls) == 1
    # The more of it there is, the less of the body is hard.
    assert hard_sides(component_of(*domed_box(5.0))) is None


def test_bands_of_bevels_go_with_the_sides_beside_them():
    V, F = bevelled_cylinder()
    component = component_of(V, F)
    side = sides(component, borders(component))
    assert side.max() + 1 == 3
    middle = component.positions[component.triangles].mean(axis=1)
    for k in range(3):
        # Caps keep to the ends, the wall to what is between.
        height = np.abs(middle[side == k, 2])
        assert height.min() > 0.9 or height.max() < 0.999
    found = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(max_shear=1.35)))
    assert all(m.angle_mean < 1.05 and m.folds == 0 for m in found.maps)


def plate(*steps, sectors=48):
    """A round plate with a hole of some steps (radius, height) down from its top."""
    return turned([(steps[-1][0], -0.05), (1.0, -0.05), (1.0, 0.05), *steps], sectors)


@pytest.mark.parametrize(
    "steps, slopes",
    [([(0.08, 0.05)], 2), ([(0.3, 0.05), (0.3, 0.0), (0.1, 0.0)], 2)],
    ids=["plain", "stepped"],
)
def test_holes_leave_a_plate_flat(steps, slopes):
    V, Q = plate(*steps)
    component = component_of(V, triangles_of(Q))
    side = sides(component, borders(component))
    corners = component.positions[component.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    slope = np.round(np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1), 3)
    assert len(np.unique(slope)) == slopes
    # What is level, the cone, and walls each are sides of their own.
    assert all(len(np.unique(slope[side == k])) == 1 for k in range(side.max() + 1))
    found, shear = shear_of(surface_of(V, Q))
    assert shear < 1.001 and sum(m.folds for m in found.maps) == 0


def test_a_hole_with_a_cone_and_a_wall_comes_apart_from_what_is_level():
    V, Q = plate((0.2, 0.05), (0.1, -0.02), sectors=48)
    component = component_of(V, triangles_of(Q))
    side, unrolls = hard_sides(component)
    tight = np.linalg.norm(component.positions[component.triangles].mean(axis=1)[:, :2], axis=1) < 0.15
    assert not np.isin(np.unique(side[tight]), np.unique(side[~tight])).all()
    assert unrolls.all()


def test_many_small_sides_are_a_hard_surface_where_they_are_all_of_it():
    # A ring with teeth, whose flat sides are a tenth of it: no tooth is large, and all edges are hard.
    k = 40
    angle, r = np.pi * np.arange(2 * k) / k, np.where(np.arange(2 * k) % 4 < 2, 1.0, 0.85)
    wall = np.column_stack([r * np.cos(angle), r * np.sin(angle)])
    V = np.concatenate(
        [np.column_stack([s * wall, np.full(2 * k, z)]) for s, z in ((1, 0), (1, 1), (0.8, 1), (0.8, 0))]
    )
    i, j = np.arange(2 * k), np.roll(np.arange(2 * k), -1)
    Q = np.concatenate(
        [
            np.stack([2 * k * a + i, 2 * k * a + j, 2 * k * b + j, 2 * k * b + i], axis=1)
            for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))
        ]
    )
    found = hard_sides(component_of(V, triangles_of(Q)))
    assert found is not None and found[1].all()
    charts, shear = shear_of(surface_of(V, Q))
    assert shear < 1.001 and sum(m.folds for m in charts.maps) == 0


@pytest.mark.parametrize("sectors, depth", [(16, 0.15), (32, 0.1), (64, 0.02)])
def test_the_wall_of_a_coin_stays_in_strips(sectors, depth):
    angle = 2 * np.pi * np.arange(sectors) / sectors
    V, F = prism(np.column_stack([np.cos(angle), np.sin(angle)]), depth)
    found, shear = shear_of(triangle_surface(V, F))
    assert shear < 1.001
    upright = [np.ptp(c.vertices[c.triangles][:, :, 2], axis=1) > 0 for c in found.charts]
    # No flap hangs on a face, and few pieces of the wall are no flaps either.
    assert all(k.all() or not k.any() for k in upright) and sum(k.all() for k in upright) <= 8


def test_a_small_part_that_lies_on_a_large_one_is_seen():
    V, F = meshes.grid(40, 40)
    small = np.array([[0.512, 0.503], [0.522, 0.503], [0.512, 0.511]])
    for move, share in ((0.0, 1.0), (1.0, 0.0)):
        flat = np.concatenate([V[:, :2], small + [move, 0]]) @ [1, 1j]
        corners = np.concatenate([F, len(V) + np.arange(3)[None]])
        assert part_covered(flat, corners, np.array([len(F)])) == share


def test_a_relief_with_holes_is_not_cut_to_them():
    # It looks one way, and does not unroll.
    V, F = meshes.grid(24, 24)
    V = V + np.column_stack([np.zeros((len(V), 2)), 0.04 * np.sin(9 * V[:, 0]) * np.sin(7 * V[:, 1])])
    middle = V[F].mean(axis=1)[:, :2]
    hole = (np.abs(middle - [0.3, 0.4]).max(axis=1) < 0.06) | (np.abs(middle - [0.7, 0.6]).max(axis=1) < 0.06)
    (chart,) = shear_of(triangle_surface(V, F[~hole]))[0].charts
    # Its vertices are those of the mesh, none twice, and one in each hole.
    assert len(chart.vertices) == len(np.unique(F[~hole])) + 2 and len(chart.patches) > 0


def test_the_number_of_segments_of_an_arc_does_not_make_it_a_bevel():
    angle = np.linspace(0, 1.5 * np.pi, 20)
    coarse = np.concatenate([[[0.0, 0.0]], np.column_stack([np.cos(angle), np.sin(angle)])])
    angle = np.linspace(0, 1.5 * np.pi, 200)
    fine = np.concatenate([[[0.0, 0.0]], np.column_stack([np.cos(angle), np.sin(angle)])])
    counts = []
    for outline in (coarse, fine):
        component = component_of(*prism(outline, 0.3))
        counts.append(int(hard_sides(component)[0].max()) + 1)
    assert counts[0] == counts[1] == 5


def lathed(profile, sectors):
    """A closed body: a profile (k,2) of radius and height, turned about the axis, between level ends."""
    k, at = len(profile), np.arange(sectors)
    V, Q = turned(profile, sectors)
    ends = [np.stack([at * k + j, (at + 1) % sectors * k + j], axis=1) for j in (0, k - 1)]
    fans = [np.column_stack([e if j else e[:, ::-1], np.full(sectors, len(V) + j)]) for j, e in enumerate(ends)]
    middles = [[0.0, 0.0, profile[j][1]] for j in (0, -1)]
    return np.concatenate([V, middles]), np.concatenate([triangles_of(Q[np.arange(len(Q)) % k < k - 1]), *fans])


def barrel(waist, slope, sectors):
    """Two cones that meet in a crease, between level ends: an edge around the ends folds by 90 degrees - slope."""
    c, s = np.cos(np.radians(slope)), np.sin(np.radians(slope))
    return lathed([(waist - s, 0.0), (waist, c), (waist - s, 2 * c)], sectors)


# A column whose ends flare; the same with a narrow bevel around its ends.
COLUMN = [(0.6, 0.0), (0.6, 0.1), (0.5, 0.2), (0.44, 0.3), (0.4, 2.0), (0.44, 2.3), (0.5, 2.4), (0.6, 2.5), (0.6, 2.6)]
BEVELLED = [(0.58, 0.0), (0.595, 0.005), *COLUMN[1:-1], (0.595, 2.595), (0.58, 2.6)]


@pytest.mark.parametrize("profile", [COLUMN, BEVELLED])
def test_the_ends_of_a_column_come_off_whole(profile):
    V, F = lathed(profile, 24)
    component = component_of(V, F)
    assert hard_sides(component) is None
    border = cap_borders(component)
    size = np.sort(np.bincount(sides(component, border)))
    assert size.tolist() == [24, 24, len(F) - 48] and border.sum() == 48
    found, _ = shear_of(triangle_surface(V, F))
    # Two discs and a wall, in one piece or in bands: no disc is cut, alone or with the flare around it.
    assert 3 <= len(found.charts) <= 5 and sum(len(chart.triangles) for chart in found.charts) == len(F)
    for middle in np.flatnonzero(np.bincount(F.ravel()) == 24):
        (whole,) = [chart for chart in found.charts if np.isin(middle, chart.vertex_ids)]
        disc = (whole.vertex_ids[whole.triangles] == middle).any(axis=1)
        assert disc.sum() == 24 and len(np.unique(whole.triangles[disc])) == 25


def hose(count=40, sides=12, radius=0.15):
    """A bent tube of so many rows with an end on both sides: positions and polygons."""
    t = np.linspace(0, 1, count)
    middle = np.column_stack([3 * t, np.sin(4 * t), 0.3 * np.cos(3 * t)])
    along = np.gradient(middle, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    one = np.cross(along, [0.0, 0.0, 1.0])
    one /= np.linalg.norm(one, axis=1)[:, None]
    turn = 2 * np.pi * np.arange(sides) / sides
    around = np.outer(np.cos(turn), [1.0, 0]) + np.outer(np.sin(turn), [0, 1.0])
    other = np.cross(along, one)
    V = middle[:, None] + radius * (around[:, :1] * one[:, None] + around[:, 1:] * other[:, None])
    i, j = np.divmod(np.arange((count - 1) * sides), sides)
    on = (j + 1) % sides
    quads = np.stack([i * sides + j, i * sides + on, (i + 1) * sides + on, (i + 1) * sides + j], axis=1).tolist()
    first, last = np.arange(sides), (count - 1) * sides + np.arange(sides)
    return V.reshape(-1, 3), [*quads, first[::-1].tolist(), last.tolist()]


@pytest.mark.parametrize(("sectors", "radius", "cut"), [(12, 0.15, 24), (8, 0.08, 16), (12, 0.03, 0), (4, 0.15, 0)])
def test_round_ends_of_a_hose_come_off(sectors, radius, cut):
    """But those of a wire are specks, and square ones not round; and no facet, however straight, is an end."""
    V, P = hose(sides=sectors, radius=radius)
    component = component_of(V, polygons.cut(P)[0])
    border = cap_borders(component)
    assert border.sum() == cut
    if cut:
        size = np.bincount(sides(component, border))
        assert sorted(size)[:2] == [sectors - 2, sectors - 2] and len(size) == 3
        found, shear = shear_of(meshes.polygon_surface(V, P))
        assert sorted(len(np.unique(chart.faces)) for chart in found.charts)[:2] == [1, 1] and shear < 1.1


def test_a_flat_ring_between_sharp_edges_is_an_end():
    """As the underside of a mushroom's cap, of which no disk has as long an outline."""
    profile = [(0.02, 0.0), (0.3, 0.05), (0.5, 0.2), (0.55, 0.3), (1.0, 0.3), (0.95, 0.6), (0.5, 0.9), (0.02, 1.0)]
    V, F = lathed(profile, 24)
    size = np.bincount(sides(component_of(V, F), cap_borders(component_of(V, F))))
    assert 48 in size and len(size) == 3


def test_a_ring_whose_edges_are_all_rounded_comes_apart_into_its_sides():
    """As letters do: a face, its back, and two walls; on an oval no axis tells so."""
    turn = np.linspace(0, np.pi / 2, 7)
    corners = [(0.95, 0.2), (0.65, 0.2), (0.65, -0.2), (0.95, -0.2)]
    profile = [
        (r + 0.05 * np.cos(a + k * np.pi / 2), z + 0.05 * np.sin(a + k * np.pi / 2))
        for k, (r, z) in enumerate(corners)
        for a in turn
    ]
    V, Q = turned(profile[::-1], 64)
    V = V * [1, 1.2, 1]
    body = component_of(V, triangles_of(Q))
    assert np.abs(fold_angles(body.positions, body.triangles, body.pair)).max() < SMOOTH
    found, shear = shear_of(surface_of(V, Q))
    assert len(found.charts) >= 4 and shear < 1.06
    # Half a letter is a disk, and lies flat but for its outline: it stays whole.
    half = Q[V[Q].mean(axis=1)[:, 2] > 0.15]
    half = half[V[half].mean(axis=1)[:, 0] > 0]
    used, half = np.unique(half, return_inverse=True)
    (chart,) = shear_of(surface_of(V[used], half.reshape(-1, 4)))[0].charts
    assert len(np.unique(chart.faces)) == len(half.reshape(-1, 4))


def test_sides_that_go_on_are_no_caps():
    ends_smoothly = lathed([(0.3, 0.0), (0.5, 0.06), (0.6, 0.2), (0.6, 2.0), (0.5, 2.14), (0.3, 2.2)], 24)
    V, F = lathed(COLUMN, 24)
    lid = V, F[:-24]  # without one end it is a disk
    for mesh in (ends_smoothly, lid, meshes.cube(), meshes.head(), meshes.torus(24, 8)):
        assert not cap_borders(component_of(*mesh)).any()


@pytest.mark.parametrize(("sectors", "ends"), [(5, 0), (8, 16), (12, 24)])
def test_the_facets_of_a_beam_end_at_one_another(sectors, ends):
    """Those of five and eight are flat sides between sharp edges; twelve go round. An end of five has too few edges."""
    beam = lathed([(0.1, z) for z in np.linspace(0, 1, 12)], sectors)
    assert cap_borders(component_of(*beam)).sum() == ends


def test_a_body_of_few_sides_that_unroll_comes_apart_though_some_meet_bluntly():
    """Two cones and two ends: along the middle, four tenths of all edges, they meet at 44 degrees."""
    component = component_of(*barrel(2.0, 22, 32))
    side = sides(component, borders(component))
    assert side.max() + 1 == 4


def pyramid(steps, slope):
    """Eight-sided, its base a cone of such a slope."""
    ledge = 1 - 0.8 * np.arange(steps) / steps
    profile = np.column_stack([np.repeat(ledge, 2), 0.05 * (np.arange(1, 2 * steps + 1) // 2)])
    V, F = lathed(profile, 8)
    V[-2, 2] -= slope  # the middle of the lower end
    return V, F


@pytest.mark.parametrize(("steps", "slope", "hard"), [(8, 0.05, True), (8, 0.25, False), (4, 0.25, True)])
def test_a_body_of_many_sides_that_swell_stays_whole(steps, slope, hard):
    assert (hard_sides(component_of(*pyramid(steps, slope))) is not None) == hard


def cogged(teeth, height, slope):
    """A wheel whose teeth are roofs of 80 degrees, its ends cones of such a slope within a level ring."""
    way = np.pi * np.arange(2 * teeth) / teeth
    out = 1 + np.pi / teeth * np.tan(np.radians(40)) * (np.arange(2 * teeth) % 2)
    wheel = np.stack([np.cos(way), np.sin(way)], axis=1)
    V, F = prism(out[:, None] * wheel, height)
    n, k = len(V), 2 * teeth
    rings = [np.column_stack([0.9 * wheel, np.full(k, z)]) for z in (0.0, height)]
    V[-2:, 2] += [-0.9 * slope, 0.9 * slope]
    fan = F.max(axis=1) >= n - 2
    # The vertices of its outline come first, the middle of the end last.
    a, b, middle = np.array([np.roll(f, 2 - np.argmax(f)) for f in F[fan]]).T
    ra, rb = a + n, b + n
    quads = [np.column_stack(x) for x in ((a, b, rb), (a, rb, ra), (ra, rb, middle))]
    return np.concatenate([V, *rings]), np.concatenate([F[~fan], *quads])


@pytest.mark.parametrize(
    ("teeth", "height", "slope", "hard"),
    [(150, 1.0, 0.25, False), (150, 1.0, 0.05, True), (150, 0.05, 0.25, True), (60, 1.0, 0.25, True)],
)
def test_a_body_of_very_many_sides_without_right_angles_is_flat_or_stays_whole(teeth, height, slope, hard):
    """The lower the wheel is, the more of its edges are around its ends, with right angles."""
    assert (hard_sides(component_of(*cogged(teeth, height, slope))) is not None) == hard


@pytest.mark.parametrize(("height", "ribbons"), [(8.0, False), (15.0, True)])
def test_a_tube_of_ribbons_stays_whole(height, ribbons):
    """Sides that meet at 80 and at 40 degrees in turn, each 1 wide: about half of their borders are hard."""
    way = np.radians([0, 80, 120, 200, 240, 320])
    V, F = prism(np.column_stack([np.cos(way), np.sin(way)]).cumsum(axis=0), height)
    assert (hard_sides(component_of(V, F)) is None) == ribbons


@pytest.mark.parametrize(
    "mesh", [meshes.icosphere(0), meshes.icosphere(1), meshes.icosphere(3), meshes.torus(24, 8), meshes.head()]
)
def test_what_is_round_all_over_stays_whole(mesh):
    assert hard_sides(component_of(*mesh)) is None


def test_noise_is_no_hard_surface():
    V, F = meshes.grid(50, 50)
    V = V + np.column_stack([np.zeros((len(V), 2)), 0.02 * np.random.default_rng(0).standard_normal(len(V))])
    assert hard_sides(component_of(V, F)) is None


def test_an_edge_that_touches_no_other_of_a_cut_is_told():
    component = component_of(*meshes.grid(8, 8))
    middle = 8 * component.positions[component.ends].mean(axis=1)[:, :2]
    # One alone, two that meet, and one from the boundary.
    alone, *others = (np.argmin(np.abs(middle - at).sum(axis=1)) for at in ((2.5, 2), (5.5, 5), (6.5, 5), (0.5, 6)))
    cut = np.zeros(len(component.pair), dtype=bool)
    cut[[alone, *others]] = True
    assert cut.sum() == 4 and np.flatnonzero(lone_edges(component, cut)).tolist() == [alone]


def test_place_size_and_order_do_not_matter():
    V, Q = washer(24)
    F = triangles_of(Q)
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    order = rng.permutation(len(V))
    places = [
        set(map(tuple, np.sort(found, axis=1)))
        for found in (_border_ends(V, F), order[_border_ends(V[order], np.argsort(order)[F[::-1]])])
    ]
    assert places[0] == places[1]
    moved = set(map(tuple, np.sort(_border_ends(V @ turn.T * 40 + 7, F), axis=1)))
    assert moved == places[0]


def _border_ends(V, F):
    component = component_of(V, F)
    return component.vertex_ids[component.ends[borders(component)]]


def surface_of(V, Q, seams=()):
    return meshes.polygon_surface(V, [list(q) for q in Q], seams)


def shear_of(surface: Surface, **options):
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35, **options)))
    total = np.concatenate(
        [np.repeat(m.angle_mean, len(c.triangles)) for c, m in zip(found.charts, found.maps, strict=True)]
    )
    return found, total.mean()


def test_a_washer_is_unwrapped_without_distortion():
    V, Q = washer()
    found, shear = shear_of(surface_of(V, Q))
    # Rings, and walls in pieces: as strips they would leave most of a texture empty.
    assert 4 < len(found.charts) < 9 and shear < 1.001
    assert max(np.ptp(m.uv, axis=0).max() for m in found.maps) < 2 * np.pi * 0.9
    assert sum(m.folds for m in found.maps) == 0


def test_what_has_a_marked_seam_does_not_come_apart():
    V, Q = washer()
    k = 4
    ring = np.arange(0, len(V), k)
    marked = np.stack([ring, np.roll(ring, -1)], axis=1)
    found = drain(unwrap(surface_of(V, Q, marked), options=UnwrapOptions(max_shear=1.35)))
    assert len(found.charts) == 1


def test_the_bevel_of_an_end_is_not_combed():
    """A cylinder with rounded edges: the wall and its bevels are one strip, that no slit leads into."""
    turn = np.linspace(0, np.pi / 2, 4)
    bevel = np.column_stack([0.9 + 0.1 * np.cos(turn), 0.1 * np.sin(turn)])
    profile = [*(bevel[::-1] * [1, -1] + [0, 0.1]), *(bevel + [0, 1.9])]
    V, F = lathed(profile, 32)
    found, shear = shear_of(triangle_surface(V, F))
    assert len(found.charts) == 3 and shear < 1.03
    wall = max(found.charts, key=lambda chart: len(chart.triangles))
    assert len(wall.vertices) == 33 * len(profile)


def borders_of(surface, sharp=(), as_drawn=False):
    """The keys of the edges along which a surface comes apart."""
    surface = replace(surface, sharp=np.array(sharp, np.int64).reshape(-1, 2))
    gluing = repaired_gluing(surface, *chosen_triangles(surface, None)).gluing
    positions = in_unit_box(surface, gluing)[0]
    gone = np.zeros(len(gluing.first), bool)
    known = TurnedCopies(), TurnedCopies()
    search = SimpleNamespace(wants=lambda *_: True, as_drawn=as_drawn, borders=known, asked=0.0)
    found = hard_borders(surface, gluing, positions, gone, search)
    return set(pair_keys(*gluing.ends(gluing.first[found])).tolist())


def twisted_column():
    """Four sides of eight quads that swell and turn, between two more: their longer diagonals fold as edges do."""
    way, level = np.pi / 2 * np.arange(4), np.arange(9)
    wide, turn = 1 + 0.6 * np.sin(np.pi * level / 8), 0.6 * level
    rings = [
        np.column_stack([r * np.cos(way + t), r * np.sin(way + t), np.full(4, z)])
        for r, t, z in zip(wide, turn, level, strict=True)
    ]
    i, k = np.tile(np.arange(4), 8), np.repeat(np.arange(8), 4)
    j = (i + 1) % 4
    quads = np.stack([4 * k + j, 4 * k + 4 + j, 4 * k + 4 + i, 4 * k + i], axis=1)
    return np.concatenate(rings), np.concatenate([quads, [[3, 2, 1, 0], [32, 33, 34, 35]]])


@pytest.mark.parametrize("shaded", [False, True])
def test_a_body_that_was_triangulated_is_told_by_its_quads(shaded):
    """It swells, and stays whole as it does of quads; as it is drawn it comes apart. Flat shading means nothing."""
    V, Q = twisted_column()
    F = triangles_of(Q)
    sharp = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]) if shaded else ()
    assert not borders_of(triangle_surface(V, F), sharp)
    assert borders_of(triangle_surface(V, F), sharp, as_drawn=True)


@pytest.mark.parametrize("turned", [False, True])
def test_a_hard_body_that_was_triangulated_comes_apart_as_it_does_of_quads(turned):
    V, Q = washer()
    faces, corners = len(Q), np.arange(Q.size).reshape(-1, 4)
    quads = Surface(
        positions=V,
        corner_vertex=Q.ravel(),
        face_start=4 * np.arange(faces + 1),
        triangles=corners[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3),
        triangle_face=np.repeat(np.arange(faces), 2),
        seams=np.zeros((0, 2), np.int64),
    )
    apart = borders_of(quads)
    assert apart and borders_of(triangle_surface(V, triangles_of(np.roll(Q, 1, axis=1) if turned else Q))) == apart


@pytest.mark.parametrize("hard", [True, False])
def test_between_hard_edges_alone_nothing_is_taken_for_a_diagonal(hard, monkeypatch):
    """A machined part has pairs of triangles that could have been quads across its edges, and is no less hard."""
    V, Q = washer()
    surface, asked = triangle_surface(V, triangles_of(Q)), []
    monkeypatch.setattr(
        crease_sides, "diagonal_pairs", lambda left, *_: asked.append(1) or np.ones(len(left.first), bool)
    )
    monkeypatch.setattr(crease_sides, "with_quads", lambda component, diagonal: component)
    if not hard:
        monkeypatch.setattr(crease_sides, "HARD", np.radians(100))
        monkeypatch.setattr(crease_sides, "SHARP", 0.0)
    assert borders_of(surface) and len(asked) == (not hard)


@pytest.mark.parametrize("unrolls", [(True, True, False), (True, False, True), (True, False, False)])
def test_what_has_joined_a_side_that_lies_apart_lies_apart_itself(unrolls, monkeypatch):
    """Two small sides lie flat beside each other, but not beside the large one, from which they keep their border; only
    where neither is one of those that lie apart does it go."""
    V = np.array([[0, 0, 0], [100, 0, 0], [0, 20, 0], [1, 0, 0], [0, 2, 0], [0, 2.4, 0.0]])
    component = SimpleNamespace(positions=V, triangles=np.array([[0, 1, 2], [0, 3, 4], [0, 3, 5]]))
    flat = iter([True, False])
    monkeypatch.setattr(crease_sides, "_lies_flat", lambda *_: next(flat))
    monkeypatch.setattr(crease_sides, "_disks", lambda *_: np.zeros(3, bool))
    left = crease_sides._without_crumbs(
        component,
        np.arange(3),
        np.arange(3),
        np.ones(2, bool),
        np.array(unrolls),
        np.arange(2),
        np.array([[1, 2], [0, 1]]),
        np.array([2.0, 1.0]),
    )
    assert left.tolist() == [False, any(unrolls[1:])]


@pytest.mark.parametrize("segments", [2, 5, 8])
@pytest.mark.parametrize(("size", "radius"), [((1, 1, 1), 0.06), ((1, 0.5, 0.2), 0.06), ((0.2, 0.2, 1), 0.02)])
def test_a_box_with_rounded_edges_is_one_net_however_many_segments_these_have(size, radius, segments):
    surface = meshes.polygon_surface(*rounded_box(size, radius, segments))
    found = drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))
    assert len(found.charts) == 1 and found.maps[0].folds == 0
    assert found.maps[0].angle_mean < 1.02


def test_what_is_curved_at_rounded_corners_moves_nothing_else():
    V, quads = rounded_box((1, 0.5, 0.2), 0.06, 3)
    F = polygons.cut(quads)[0]
    body = component_of(V, F)
    unrolled = developable_nets.net(body)
    flat, corners, _ = crease_sides._laid_out(body, unrolled.cut, np.ones(len(F), bool))
    # Faces of the box, and of the bands along its edges, are as they were.
    in_corner = (np.abs(V) > np.array([1, 0.5, 0.2]) - 0.06 + 1e-9).all(axis=1)
    kept = ~in_corner[F].any(axis=1)
    assert kept.mean() > 0.2
    for a, b in ((0, 1), (1, 2), (2, 0)):
        before = np.linalg.norm(body.positions[body.triangles[:, a]] - body.positions[body.triangles[:, b]], axis=1)
        after = np.abs(flat[corners[:, a]] - flat[corners[:, b]])
        # They meet the corners, which are of that size.
        np.testing.assert_allclose(after[kept], before[kept], atol=0.02)


@pytest.mark.parametrize("count", [30, 40, 60])
def test_a_net_that_winds_along_the_border_of_cloth_is_none(count):
    V, F = meshes.grid(count, count, 2.0, 2.0)
    cloth = component_of(*thickened(np.column_stack([V[:, :2], 0.2 * np.sin(4 * V[:, 0])]), F, 0.05))
    assert developable_nets.net(cloth).winds and not crease_sides._has_clear_net(cloth)
    # The border comes off in strips that are whole.
    border = side_borders(cloth, *hard_sides(cloth))
    assert border.any() and sides(cloth, border).max() + 1 <= 6
    for body in (meshes.cube(), bevelled_cylinder(), prism(np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]))):
        unrolled = developable_nets.net(component_of(*body))
        assert unrolled is None or not unrolled.winds
