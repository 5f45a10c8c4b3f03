"""Improving maps that exist: any number of boundaries, any fold that can be undone, nothing moved that is held."""

import meshes
import numpy as np
import pytest
from polygons import cut

from omt_uv.pipelines.layout import Refusal
from omt_uv.pipelines.refine import refine_islands
from omt_uv.settings import RefineSettings
from omt_uv.solver.editing.live_map import LiveMap
from omt_uv.solver.editing.refine_island import STRAIGHTENED, refine_island, signed_area_of
from omt_uv.solver.editing.uv_islands import uv_islands
from omt_uv.solver.errors import FoldedUVError, PinError
from omt_uv.solver.maps.contacts import crossings
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.tutte import tutte
from omt_uv.solver.maps.untangle import arc_length_boundary
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_edges, boundary_loops
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.boundary_barrier import make_barrier


def head(count=16):
    """A bust and its mean value map, which has no folds and very wrong areas."""
    V, F = meshes.head(count)
    loop = boundary_loops(F)[0]
    return V, F, tutte(V, F, loop, arc_length_boundary(V, loop, 1.0))


def ring(sectors=32, rings=6):
    """A bumpy ring seen from above: two boundaries."""
    V, F = meshes.annulus(sectors, rings)
    V = np.column_stack([V[:, :2], 0.5 * np.sin(3 * V[:, 0]) * np.cos(2 * V[:, 1])])
    return V, F, V[:, :2].copy()


def bump():
    V, F = meshes.bumpy(12, 12)
    return V, F, V[:, :2].copy()


def run(V, F, uv, **options):
    return drain(refine_island(V, F, uv, **options))


def figures(V, F, uv):
    return distortion(V, F, uv[F])


def centroid(V, F, uv):
    area = face_areas(V, F)
    return area @ uv[F].mean(1) / area.sum()


def test_a_density_of_areas_is_kept():
    V, F, uv = bump()
    density = np.exp(np.sin(4 * V[F].mean(axis=1)[:, 0]))
    refined = run(V, F, uv, target=density)
    found = distortion(V, F, refined.uv[F], density=density)
    assert found.area_l1 <= 0.01 and found.folds == 0
    live = LiveMap(V, F, uv, target=density)
    while not live.at_rest:
        live.follow(0.0)
    assert distortion(V, F, live.uv[F], density=density).area_l1 <= 0.02


# ---- maps ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [head, ring, bump])
@pytest.mark.parametrize("mirror", [1, -1])
def test_areas_become_right_where_the_map_lies(make, mirror):
    V, F, uv = make()
    uv = uv * [0.1 * mirror, 0.1] + [3, -2]
    result = run(V, F, uv)
    after = figures(V, F, result.uv)
    assert after.area_l1 < 0.01
    assert after.area_l1 < 0.1 * figures(V, F, uv).area_l1
    assert (after.folds, after.overlap) == (0, 0)
    assert signed_areas(result.uv, F).sum() == pytest.approx(signed_areas(uv, F).sum())
    assert centroid(V, F, result.uv) == pytest.approx(centroid(V, F, uv))
    assert result.warnings == ()
    # No turn brings it nearer to where it was.
    a, b = ((x - centroid(V, F, x)) @ [1, 1j] for x in (result.uv, uv))
    mass = np.bincount(F.ravel(), np.repeat(face_areas(V, F), 3), len(V))
    assert np.angle((mass * a.conj()) @ b) == pytest.approx(0, abs=1e-6)


def test_an_isometric_map_stays():
    V, F = meshes.annulus()
    uv = V[:, :2] * 0.2 + 0.5
    assert run(V, F, uv).uv == pytest.approx(uv, abs=1e-9)


def test_the_result_does_not_depend_on_place_and_size_of_the_map():
    V, F, uv = ring()
    first, second = run(V, F, uv).uv, run(1000 * V, F, uv * 1e-3 + 7).uv
    assert second == pytest.approx(first * 1e-3 + 7, abs=1e-8)


def test_balance_trades_area_for_shear():
    V, F, uv = ring()
    results = [figures(V, F, run(V, F, uv, balance=t).uv) for t in (0, 0.5, 1)]
    assert np.all(np.diff([r.area_l1 for r in results]) > 0)
    assert np.all(np.diff([r.angle_mean for r in results]) < 0)


@pytest.mark.parametrize("make", [head, ring])
@pytest.mark.parametrize("noise", [0.05, 0.2])
def test_folds_are_undone_and_said(make, noise):
    V, F, uv = make()
    folded = uv + noise * np.random.default_rng(0).normal(size=uv.shape)
    assert figures(V, F, folded).folds > 10
    result = run(V, F, folded)
    assert figures(V, F, result.uv).folds == 0
    assert figures(V, F, result.uv).area_l1 < 0.01
    assert STRAIGHTENED in result.warnings


def test_a_hole_is_kept_apart_from_the_outline():
    """A ring with a thin wall: pulled into a crossing, the barrier of one loop alone would let it through."""
    V, F, uv = ring(24, 3)
    boundary = boundary_edges(F)
    assert len(boundary) == 48
    w = uv @ [1, 1j]
    assert not len(crossings(w, boundary))
    inner = np.abs(w) < 1.3
    step = np.where(inner, 1.5, 0) + 0j
    assert len(crossings(w + step, boundary)) > 0
    assert make_barrier(w, boundary, 1.0).limit(w, step) < 1


def test_contact_of_edges_equals_contact_of_a_loop():
    V, F, uv = bump()
    loop, w = boundary_loops(F)[0], (uv + 0.02 * np.sin(40 * uv[:, ::-1])) @ [1, 1j]
    a, b = make_barrier(w, loop, 1.0), make_barrier(w, boundary_edges(F), 1.0)
    assert a.energy(w) == pytest.approx(b.energy(w))
    assert a.derivatives(w)[0] == pytest.approx(b.derivatives(w)[0])


def test_fans_that_touch_at_a_corner_are_parted():
    """Two fans of one vertex, joined only around a hole, at one place of the UV map: a barrier would be infinite."""
    V, F = meshes.grid(6, 6)
    V = np.column_stack([V[:, :2], 0.3 * np.sin(3 * V[:, 0]) * V[:, 1]])
    keep = ~np.isin(np.arange(len(F)), hits := np.flatnonzero(pinched(V, F)))
    assert len(hits) > 0
    surface = triangle_surface(V, F[keep])
    (island,) = uv_islands(surface, corner_uv(F[keep], V[:, :2])).islands
    ids = island.chart.vertex_ids
    assert len(ids) > len(np.unique(ids)), "the pinched vertex has two places"
    T = island.chart.triangles
    result = run(island.chart.vertices, T, island.uv)
    after = figures(island.chart.vertices, T, result.uv)
    assert (after.folds, after.overlap) == (0, 0)
    assert after.area_l1 < 0.01
    assert result.warnings == ()


def pinched(V, F):
    """Faces of two squares that meet at the middle vertex, (m,) bool."""
    middle = V[F].mean(1)[:, :2] * 6
    low_left, up_right = (middle > 2).all(1) & (middle < 3).all(1), (middle > 3).all(1) & (middle < 4).all(1)
    return low_left | up_right


# ---- what is held -------------------------------------------------------------------------------------------


def test_pins_stay_to_the_bit():
    V, F, uv = ring()
    pins = np.array([0, 50, 99, 150])
    result = run(V, F, uv, pins=(pins, uv[pins]))
    assert (result.uv[pins] == uv[pins]).all()
    assert figures(V, F, result.uv).area_l1 < 0.01
    assert figures(V, F, result.uv).folds == 0


@pytest.mark.parametrize("make", [head, ring])
def test_the_outline_can_be_kept(make):
    V, F, uv = make()
    boundary = np.unique(boundary_edges(F))
    result = run(V, F, uv, pins=(boundary, uv[boundary]))
    assert (result.uv[boundary] == uv[boundary]).all()
    assert figures(V, F, result.uv).area_l1 < 0.3 * figures(V, F, uv).area_l1
    assert figures(V, F, result.uv).folds == 0


def test_one_pin_holds_the_place_and_two_the_scale():
    V, F, uv = ring()
    one = run(V, F, uv, pins=(np.array([7]), uv[[7]])).uv
    assert (one[7] == uv[7]).all()
    assert signed_areas(one, F).sum() == pytest.approx(signed_areas(uv, F).sum())
    places = uv[[7, 90]] * 2 + 1
    two = run(V, F, uv, pins=(np.array([7, 90]), places)).uv
    assert (two[[7, 90]] == places).all()
    assert figures(V, F, two).area_l1 == pytest.approx(figures(V, F, one).area_l1, abs=1e-9)


def test_pins_that_force_a_fold_are_named():
    V, F, uv = bump()
    pins = np.append(F[100], [0, 12, 156, 168])
    places = uv[pins][[1, 0, 2, 3, 4, 5, 6]]
    with pytest.raises(PinError, match="fold") as info:
        run(V, F, uv, pins=(pins, places))
    assert set(info.value.elements) <= set(pins)


# ---- beyond repair ------------------------------------------------------------------------------------------


def test_maps_that_are_none_are_named():
    V, F, uv = ring()
    with pytest.raises(FoldedUVError, match="no area"):
        run(V, F, 0 * uv)
    with pytest.raises(FoldedUVError, match="not finite"):
        run(V, F, np.nan * uv)
    with pytest.raises(FoldedUVError, match="beyond repair"):
        run(V, F, np.random.default_rng(0).random(uv.shape) * [1, 1e-3])
    V, F = meshes.icosphere(1)
    with pytest.raises(FoldedUVError, match="beyond repair"):
        run(V, F, V[:, :2])
    V, F = meshes.torus(12, 8)
    with pytest.raises(FoldedUVError, match="beyond repair"):
        run(V, F[1:], V[:, :2])


# ---- islands ------------------------------------------------------------------------------------------------


def corner_uv(F, uv):
    """UVs (3m,2) of every corner of triangles, as `triangle_surface` numbers them."""
    return uv[F].reshape(-1, 2).astype(np.float32)


def torn():
    """A bumpy square whose left and right halves lie apart in the UV map, without a seam on the mesh."""
    V, F, uv = bump()
    corners = corner_uv(F, uv)
    right = V[F].mean(1)[:, 0] > 0.5
    corners[np.repeat(right, 3)] += [2, 0]
    return triangle_surface(V, F), corners, right


def refined(surface, uv, faces=None, pinned=None, **options):
    pins = CornerPins(np.zeros(len(uv), bool) if pinned is None else pinned, uv)
    return drain(refine_islands([(surface, faces, pins)], RefineSettings(**options)))


def written(uv, result):
    after = uv.astype(float)
    after[result.corners[0]] = result.uv[0]
    return after


def test_islands_get_one_density_and_keep_their_total_area():
    surface, uv, right = torn()
    uv[np.repeat(right, 3)] *= 0.3
    after = written(uv, refined(surface, uv))
    T = np.arange(len(uv)).reshape(-1, 3)
    area, before, space = signed_areas(after, T), signed_areas(uv, T), face_areas(surface.positions, T_of(surface))
    assert area.sum() == pytest.approx(before.sum(), rel=1e-6)
    left, other = (area[k].sum() / space[k].sum() for k in (~right, right))
    assert left == pytest.approx(other, rel=1e-6)


def T_of(surface):
    return surface.corner_vertex.reshape(-1, 3)


def test_pinned_islands_keep_their_own_density():
    surface, uv, right = torn()
    pinned = np.zeros(len(uv), bool)
    pinned[3 * np.flatnonzero(right)[[0, 20, 40, 60]]] = True
    result = refined(surface, uv, pinned=pinned)
    assert not np.isin(np.flatnonzero(pinned), result.corners[0]).any()
    after, T = written(uv, result), np.arange(len(uv)).reshape(-1, 3)
    left = np.repeat(~right, 3)
    alone = refined(surface, uv, faces=~right)
    assert after[left] == pytest.approx(written(uv, alone)[left], abs=1e-9)
    assert (signed_areas(after, T) > 0).all()


def test_islands_that_grow_into_each_other_are_told():
    surface, uv, right = torn()
    uv[np.repeat(right, 3)] += [-1.95, 0]
    result = refined(surface, uv)
    assert any("grew into" in text for _, text in result.warnings)
    assert not refined(surface, uv, pack=True).warnings


def test_reports_say_what_changed():
    surface, uv, _ = torn()
    for report in refined(surface, uv).reports[0]:
        assert report["area_l1"] < 0.01 < report["before"]["area_l1"]
        assert report["folds"] == 0


def test_an_outline_that_cannot_be_kept_is_named():
    surface, uv, _ = torn()
    V, F, _ = bump()
    corner = np.flatnonzero(np.isclose(uv, [0, 0]).all(1))
    uv[corner] = [0.4, 0.9]
    with pytest.raises(Refusal, match="outline"):
        refined(surface, uv, keep_boundary=True)


# ---- unwrapping with pins -----------------------------------------------------------------------------------


def unwrapped(V, F, vertices, given):
    surface = triangle_surface(V, F)
    uv = corner_uv(F, given)
    result = drain(unwrap(surface, pins=CornerPins(np.isin(F.ravel(), vertices), uv)))
    corners, values = result.corner_uv()
    assert (corners == np.arange(F.size)).all()
    return result.maps[0], values, uv


@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("vertices", [[84], [0, 168], [0, 12, 84, 156, 168]])
def test_unwrapping_leaves_pins_in_place(mirror, vertices):
    V, F, given = bump()
    chart_map, values, uv = unwrapped(V, F, vertices, given * [0.2 * mirror, 0.2] + [1, 5])
    pinned = np.isin(F.ravel(), vertices)
    assert chart_map.pinned
    assert (values[pinned] == uv[pinned]).all()
    assert chart_map.folds == 0
    assert chart_map.area_l1 < 0.01


def test_one_pin_keeps_size_and_direction():
    V, F, given = bump()
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    _, values, uv = unwrapped(V, F, [84], 0.1 * given @ turn)
    T = np.arange(F.size).reshape(-1, 3)
    assert signed_areas(values, T).sum() == pytest.approx(signed_areas(uv.astype(float), T).sum(), rel=1e-6)
    plain = drain(unwrap(triangle_surface(V, F))).corner_uv()[1]
    a, b = ((x - x.mean(0)) @ [1, 1j] for x in (values, uv))
    assert abs(np.angle(a.conj() @ b)) < 0.05
    assert np.ptp(plain, axis=0).max() > 5 * np.ptp(values, axis=0).max()


def test_unwrapping_names_pins_that_contradict():
    V, F, given = bump()
    surface, uv = triangle_surface(V, F), corner_uv(F, given)
    twice = np.flatnonzero(F.ravel() == 84)
    uv[twice[0]] += 0.1
    with pytest.raises(PinError, match="two places") as info:
        drain(unwrap(surface, pins=CornerPins(F.ravel() == 84, uv)))
    assert info.value.elements.tolist() == [84]
    with pytest.raises(PinError, match="square") as info:
        drain(unwrap(surface, options=UnwrapOptions("square"), pins=CornerPins(F.ravel() == 7, uv)))
    assert info.value.elements.tolist() == [7]


@pytest.mark.parametrize("balance", [0.0, 0.5])
def test_a_symmetric_island_of_quads_gets_a_symmetric_map(balance):
    _, Q = meshes.quad_grid(12, 10)
    x, y = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 11))
    V = np.column_stack([x.ravel(), y.ravel(), np.exp(-3 * (x**2 + (y - 0.2) ** 2)).ravel()])
    F, faces = cut(Q)
    lopsided = V[:, :2] + 0.02 * np.sin(5 * V[:, [1, 0]] + 1)
    result = run(V, F, lopsided, balance=balance, polygons=faces)
    grid = result.uv @ [1, 1j]
    grid = (grid - grid.mean()).reshape(11, 13)
    # The mirror image, about its own axis.
    phase = (grid * grid[:, ::-1]).sum()
    image = phase / abs(phase) * grid[:, ::-1].conj()
    assert np.abs(image - grid).max() < 1e-9 and (signed_areas(result.uv, F) > 0).all()
    if balance == 0:
        figures = distortion(V, F, result.uv[F], polygons=faces)
        assert figures.area_l1 < 0.01 < distortion(V, F, lopsided[F], polygons=faces).area_l1


@pytest.mark.parametrize("sides", [3, 4, 9])
def test_the_area_of_an_outline_is_that_of_its_fan_wherever_it_lies(sides):
    turn = 2 * np.pi * np.arange(sides) / sides
    polygon = np.column_stack([3 + 2 * np.cos(turn), 5 + np.sin(turn)])
    fan = np.column_stack([np.zeros(sides - 2, int), np.arange(1, sides - 1), np.arange(2, sides)])
    assert signed_area_of(polygon) == pytest.approx(signed_areas(polygon, fan).sum()) and signed_area_of(polygon) > 0
    assert signed_area_of(polygon[::-1]) == pytest.approx(-signed_area_of(polygon))
