"""Many objects unwrapped at once."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from work import counted_work

from omt_uv.pipelines import unwrap as unwrap_pipeline
from omt_uv.pipelines.layout import Refusal, UnwrapJob
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import Settings
from omt_uv.solver.analysis.facing import Y_UP, SceneAxes
from omt_uv.solver.maps.overlap import overlap_share
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.parameterization.unwrap import predicted_cuts
from omt_uv.solver.progress import drain


def wavy(count, seed=0):
    """Small height fields, each another one, and the area of each."""
    rng = np.random.default_rng(seed)
    surfaces = []
    for _ in range(count):
        V, F = meshes.bumpy(int(rng.integers(3, 6)), 4, height=rng.uniform(0.1, 0.5))
        surfaces.append(triangle_surface(V * rng.uniform(0.5, 2), F))
    return surfaces


def test_many_objects_take_no_more_factorisations_than_one_of_many_parts():
    surfaces = wavy(40)
    with counted_work() as work:
        layout = drain(lay_out([UnwrapJob(s) for s in surfaces], Settings(pack=False)))
    assert work.factorisations < 100
    for surface_map in layout.maps:
        assert len(surface_map.charts) == 1 and surface_map.maps[0].folds == 0
        assert surface_map.maps[0].area_l1 < 0.01


def test_an_object_among_many_has_the_map_that_it_has_alone():
    surfaces = wavy(12)
    together = drain(lay_out([UnwrapJob(s) for s in surfaces], Settings(pack=False, quality="exact"))).maps
    alone = drain(lay_out([UnwrapJob(surfaces[5])], Settings(pack=False, quality="exact"))).maps[0]
    figures = ("area_l1", "angle_mean")
    for name in figures:
        assert getattr(together[5].maps[0], name) == pytest.approx(getattr(alone.maps[0], name), abs=2e-3)
    areas = [signed_areas(m.maps[0].uv, m.charts[0].triangles) for m in (together[5], alone)]
    np.testing.assert_allclose(*areas, rtol=0.02)


def test_the_object_that_cannot_be_unwrapped_is_named_by_its_number():
    surfaces = wavy(3)
    V, F = meshes.bumpy(3, 3)
    V[4] = np.nan
    jobs = [UnwrapJob(s) for s in [*surfaces[:2], triangle_surface(V, F), surfaces[2]]]
    with pytest.raises(Refusal) as refused:
        drain(lay_out(jobs, Settings()))
    assert refused.value.index == 2


@pytest.mark.parametrize("mirrored", [False, True])
def test_what_is_unwrapped_lies_beside_the_polygons_that_keep_their_uvs(mirrored):
    V, F = meshes.bumpy(6, 6)
    surface = triangle_surface(V, F)
    chosen = V[F].mean(axis=1)[:, 0] > np.median(V[:, 0])
    uv = 0.2 + 0.5 * (V[:, :2] - V[:, :2].min(axis=0)) / np.ptp(V[:, :2], axis=0).max()
    uv = (uv * [-1, 1] + [1, 0] if mirrored else uv)[surface.corner_vertex]
    job = UnwrapJob(surface, chosen, uv=uv)
    layout = drain(lay_out([job], Settings(pack_around=True)))
    kept, new = uv[surface.triangles[~chosen]], uv.copy()
    new[layout.corners[0]] = layout.uv[0]
    moved = new[surface.triangles[chosen]]
    assert moved.min() >= 0 and moved.max() <= 1
    assert overlap_share(np.concatenate([kept, moved])) == 0


def split(V, F):
    """The triangles of a mesh, each with vertices of its own."""
    return triangle_surface(np.asarray(V)[F].reshape(-1, 3), np.arange(3 * len(F)).reshape(-1, 3))


def test_a_mesh_split_by_an_importer_is_mapped_as_if_it_were_whole():
    V, F = meshes.icosphere(2)
    settings = Settings(max_shear=1.35)
    whole, apart = (drain(lay_out([UnwrapJob(s)], settings)) for s in (triangle_surface(V, F), split(V, F)))
    assert len(apart.maps[0].charts) == len(whole.maps[0].charts)
    assert [text for _, text in whole.warnings] == []
    assert [text for _, text in apart.warnings if f"{3 * len(F) - len(V)} boundary vertices" in text]
    order = [np.argsort(layout.corners[0]) for layout in (whole, apart)]
    uv = [layout.uv[0][o] for layout, o in zip((whole, apart), order, strict=True)]
    np.testing.assert_allclose(uv[0], uv[1], atol=1e-9)
    # Seams run along edges that the given mesh has, in all copies.
    seams = apart.maps[0].seams
    assert (seams[:, 0] // 3 == seams[:, 1] // 3).all()
    places = {frozenset(map(tuple, V[F].reshape(-1, 3)[edge])) for edge in seams}
    assert places == {frozenset(map(tuple, V[edge])) for edge in whole.maps[0].seams}


# Of positions as rows, from where Y is up: Z up as in Blender, X up, and askew.
TURNS = {
    "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "x": np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]),
    "askew": Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix(),
}


def lying(surface, rotation):
    """A surface multiplied by a rotation, with its axes, as `Y_UP` says those of what is given."""
    return UnwrapJob(replace(surface, positions=surface.positions @ rotation), axes=Y_UP.turned_by(rotation))


@pytest.mark.parametrize("max_shear", [0.0, 1.3])
@pytest.mark.parametrize("turn", TURNS)
def test_what_a_file_calls_up_is_all_one(turn, max_shear):
    V, F = meshes.torus(16, 8)
    V = V + 0.1 * np.sin(3 * V[:, [1, 2, 0]])
    settings, surface = Settings(max_shear=max_shear), triangle_surface(V, F)
    job = lying(surface, TURNS[turn])
    first, other = (drain(lay_out([one], settings)) for one in (UnwrapJob(surface, axes=Y_UP), job))
    # Turned askew, places are rounded.
    close = 1e-5 if turn == "askew" else 0.0
    np.testing.assert_array_equal(first.corners[0], other.corners[0])
    np.testing.assert_allclose(first.uv[0], other.uv[0], rtol=0, atol=close)
    for one, chart in zip(first.maps[0].charts, other.maps[0].charts, strict=True):
        np.testing.assert_allclose(one.vertices @ TURNS[turn], chart.vertices, atol=1e-14)
    every = np.ones(len(F), bool)
    cuts = [predicted_cuts(j.surface, every, max_shear, j.axes).edges for j in (UnwrapJob(surface, axes=Y_UP), job)]
    np.testing.assert_array_equal(*cuts)


def test_a_loose_vertex_that_is_nowhere_is_no_reason_to_warn():
    V, F = meshes.bumpy(4, 4)
    surface = triangle_surface(np.concatenate([V, [[np.inf, 0, 1]]]), F)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        layout = drain(lay_out([UnwrapJob(surface)], Settings()))
    assert layout.maps[0].maps[0].folds == 0 and not layout.warnings


def test_axes_in_single_precision_turn_nothing_askew():
    exact = Y_UP.turned_by(TURNS["z"])
    rough = SceneAxes(tuple(np.array(exact.up) + 3e-8), tuple(np.array(exact.viewer) - 3e-8))
    np.testing.assert_array_equal(rough.frame, exact.frame)
    np.testing.assert_array_equal(exact.frame, TURNS["z"].T)
    np.testing.assert_array_equal(Y_UP.frame, np.eye(3))
    tilted = Y_UP.turned_by(TURNS["askew"])
    np.testing.assert_allclose(TURNS["askew"] @ tilted.frame, np.eye(3), atol=1e-15)


def test_painted_vertices_and_markers_go_with_what_is_joined():
    V, F = meshes.icosphere(2)
    surface = split(V, F)
    places = surface.positions
    avoid = np.where(places[:, 0] > 0.2, 1.0, 0.0)
    found = drain(lay_out([UnwrapJob(surface, avoid=avoid)], Settings(max_shear=1.35)))
    seams = found.maps[0].seams
    assert len(seams) and (places[seams][:, :, 0] <= 0.2).all()
    assert len(found.maps[0].charts) == 1


def test_parts_between_existing_seams_are_not_joined():
    V, F = meshes.cube()
    found = drain(lay_out([UnwrapJob(split(V, F))], Settings(seams="existing")))
    assert len(found.maps[0].charts) == len(F)


@pytest.mark.parametrize("noise", [0.0, 3e-8])
def test_needles_on_the_edges_of_a_box_change_nothing_of_its_net(noise):
    """Points on edges that belong to one side alone, with a triangle without area in between: exporters leave some."""
    V, P = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)]), []
    P = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
         [1, 5, 7], [1, 7, 3]]  # fmt: skip
    box = drain(lay_out([UnwrapJob(triangle_surface(V, np.array(P)))], Settings(max_shear=1.35)))
    rng = np.random.default_rng(0)
    W, F = V.tolist(), [list(t) for t in P]
    for number, (a, b, c) in ((0, (0, 1, 3)), (2, (4, 6, 7)), (6, (2, 3, 7)), (10, (1, 5, 7))):
        # The triangle has a point on its first side, and a needle goes in between.
        m = len(W)
        W.append((0.6 * np.array(V[a]) + 0.4 * np.array(V[b]) + noise * rng.normal(size=3)).tolist())
        F[number] = [a, m, c]
        F += [[m, b, c], [a, b, m]]
    found = drain(lay_out([UnwrapJob(triangle_surface(np.array(W), np.array(F)))], Settings(max_shear=1.35)))
    assert len(found.maps[0].charts) == len(box.maps[0].charts) == 1
    assert max(m.angle_mean for m in found.maps[0].maps) < 1.01


def test_what_is_long_by_itself_stays_whole_beside_much_else():
    """A hose alone is cut across, so that it fills more of a texture; not so beside a wall."""
    k, sectors, rings = np.arange(12), 12, 120
    V = np.concatenate(
        [np.stack([np.cos(k * np.pi / 6), np.sin(k * np.pi / 6), 0 * k + z], axis=1) for z in range(rings)]
    )
    hose = meshes.polygon_surface(
        V, [[r * 12 + k, r * 12 + (k + 1) % 12, r * 12 + 12 + (k + 1) % 12, r * 12 + 12 + k]
            for r in range(rings - 1) for k in range(sectors)])  # fmt: skip
    wall = triangle_surface(*meshes.grid(8, 8, 120.0, 120.0))
    settings = Settings(max_shear=1.35)
    alone = drain(lay_out([UnwrapJob(hose)], settings))
    beside = drain(lay_out([UnwrapJob(hose), UnwrapJob(wall)], settings))
    assert len(alone.maps[0].charts) > 1 and len(beside.maps[0].charts) == 1
    assert len(beside.maps[1].charts) == 1


def test_what_a_file_had_to_split_at_borders_of_its_uvs_is_mapped_as_if_it_were_whole():
    """Not so a slit of somebody's mesh; and there is nothing to be told of it."""
    V, F = meshes.icosphere(2)
    # Open along a meridian: the triangles on one side have vertices of their own there.
    on = np.flatnonzero((np.abs(V[:, 0]) < 1e-9) & (V[:, 1] > -0.9))
    own = np.arange(len(V))
    own[on[np.abs(V[on, 2]) < 0.6]] = np.arange((np.abs(V[on, 2]) < 0.6).sum()) + len(V)
    G = np.where((V[F].mean(axis=1)[:, 0] > 0)[:, None], own[F], F)
    W = np.concatenate([V, V[own >= len(V)]])
    assert len(W) > len(V)
    settings = Settings(max_shear=1.35)
    whole, split_, slit = (
        drain(lay_out([job], settings))
        for job in (
            UnwrapJob(triangle_surface(V, F)),
            UnwrapJob(triangle_surface(W, G), was_split=True),
            UnwrapJob(triangle_surface(W, G)),
        )
    )
    np.testing.assert_array_equal(split_.uv[0], whole.uv[0])
    assert not split_.warnings and not np.array_equal(slit.uv[0], whole.uv[0])


@pytest.mark.parametrize("at", [0, 100, 320])
def test_triangles_without_area_that_would_tear_the_map_lie_on_their_neighbours(at):
    """As in scans whose coordinates an exporter has rounded, once equal vertices are joined."""
    V, F = meshes.icosphere(2)
    a, b = F[40, :2]
    settings = Settings(max_shear=1.35)
    whole = drain(lay_out([UnwrapJob(triangle_surface(V, F))], settings))
    surface = triangle_surface(V, np.insert(F, at, [[a, b, a], [b, a, b], [b, b, b]], axis=0))
    found = drain(lay_out([UnwrapJob(surface)], settings))
    assert len(found.maps[0].charts) == len(whole.maps[0].charts)
    np.testing.assert_array_equal(found.corners[0], np.arange(3 * len(F) + 9))
    flat = np.arange(3 * at, 3 * at + 9)
    np.testing.assert_array_equal(np.delete(found.uv[0], flat, axis=0), whole.uv[0])
    rest = np.delete(found.corners[0], flat)
    for corner in flat:
        there = rest[surface.corner_vertex[rest] == surface.corner_vertex[corner]]
        assert (found.uv[0][there] == found.uv[0][corner]).all(axis=1).any()
    for first in flat[::3]:
        assert signed_areas(found.uv[0][[first, first + 1, first + 2]], np.arange(3)[None])[0] == 0
    text = "3 triangles with two corners at one place, left out of the map; dissolve faces without area"
    assert found.warnings == [(0, text)]


def test_a_strip_stays_one_where_a_triangle_of_it_has_no_area():
    V, F = meshes.grid(4, 1)
    V[1] = V[2]
    for seams in ("auto", "existing"):
        found = drain(lay_out([UnwrapJob(triangle_surface(V, F))], Settings(seams=seams)))
        assert len(found.maps[0].charts) == 1


def test_pins_of_a_triangle_that_lies_on_its_neighbours_hold_these():
    V, F = meshes.bumpy(4, 4)
    a, b = F[5, :2]
    surface = triangle_surface(V, np.vstack([F, [[a, b, a]]]))
    uv = V[surface.corner_vertex, :2].astype(np.float32)
    pinned = np.arange(len(uv)) >= 3 * len(F)
    found = drain(lay_out([UnwrapJob(surface, pins=CornerPins(pinned, uv))], Settings(quality="draft")))
    np.testing.assert_allclose(found.uv[0][-3:], uv[-3:], atol=1e-6)


@pytest.mark.filterwarnings("error")
def test_a_square_of_what_has_no_triangle_inside_needs_no_division_by_nothing():
    V, F = meshes.cube()
    V = V + np.random.default_rng(0).normal(size=V.shape) * 0.01
    found = drain(lay_out([UnwrapJob(triangle_surface(V, F))], Settings(boundary="square", quality="draft")))
    assert len(found.maps[0].charts) == 1


def test_what_is_nothing_but_triangles_without_area_is_no_reason_to_search():
    V, F = meshes.bumpy(6, 6)
    line = np.array([[2.0, 0, 0], [2.1, 0, 0]])
    strip = np.array([[0, 1, 0], [1, 1, 0], [0, 1, 1]]) + len(V)
    found = drain(lay_out([UnwrapJob(triangle_surface(np.vstack([V, line]), np.vstack([F, strip])))], Settings()))
    assert len(found.corners[0]) == 3 * (len(F) + 3)


@pytest.mark.parametrize("alone", [0, 2])
def test_a_chart_of_which_a_triangle_hangs_by_a_vertex_is_packed_with_what_fills_it(alone):
    """Whichever triangle that is, the last one, too, whose sides have none beside them."""
    triangles = np.insert([[0, 1, 2], [2, 1, 3]], alone, [3, 4, 5], axis=0)
    chart = SimpleNamespace(patches=[1], triangles=triangles, disk="filled")
    assert unwrap_pipeline._connected_triangles(chart) == "filled"
    chart.triangles = triangles[np.arange(3) != alone]
    assert unwrap_pipeline._connected_triangles(chart) is chart.triangles
