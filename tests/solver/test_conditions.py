"""The second half of a condition decides, too: what is sound in one way and not in the other, piece by piece."""

from __future__ import annotations

import json
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from sphere_shapes import blob

from omt_uv.pipelines import remesh
from omt_uv.pipelines.regions.detail import box_of
from omt_uv.pipelines.unwrap import UnwrapJob, _beside
from omt_uv.pipelines.volumes import handle_file
from omt_uv.settings import RemeshSettings
from omt_uv.solver import errors
from omt_uv.solver.arranging import congruence, quad_grid, stacks
from omt_uv.solver.canonical.markers import ChartMarkers, MapMarkers, markers_of_chart
from omt_uv.solver.editing.image_warp import continued
from omt_uv.solver.editing.inset_images import InsetImage, warp_with_insets
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.flows.paths import _rigid
from omt_uv.solver.maps.boxes import box_pairs
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.embedding import check_layout
from omt_uv.solver.maps.local_untangle import straighten_folds
from omt_uv.solver.maps.untangle import circle_boundary
from omt_uv.solver.mesh import mirror
from omt_uv.solver.mesh.charts import Chart
from omt_uv.solver.mesh.geometry import affine_images
from omt_uv.solver.mesh.repair import TINY, _scale
from omt_uv.solver.parameterization.chart_indices import CornerPins, _lone_triangle, clear_of_pins
from omt_uv.solver.parameterization.polygons.polygon_disk import _by_ears
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.elimination_order import renumbered
from omt_uv.solver.refinement.initial_maps import _on_square, _perimeter, _snap_corners
from omt_uv.solver.remeshing.initial import disk_samples


@pytest.mark.parametrize("shape, uv", [((3, 2), (3, 2, 2)), ((3, 4), (3, 4, 2)), ((3,), (3, 2)), ((3, 3), (3, 3, 3)),
                                       ((3, 3), (2, 3, 2))])  # fmt: skip
def test_what_is_measured_is_triangles_with_uvs_of_their_corners(shape, uv):
    with pytest.raises(ValueError, match="expected F"):
        distortion(np.zeros((4, 3)), np.zeros(shape, int), np.zeros(uv))


def test_surfaces_of_other_sizes_are_not_congruent():
    V, F = blob(1)
    assert congruence.matching(V, F, V, F).vertices.tolist() == list(range(len(V)))
    assert congruence.matching(V, F, np.concatenate([V, V[:1]]), F) is None
    assert congruence.matching(V, F, V, F[:-1]) is None and congruence.matching(V[:0], F[:0], V[:0], F[:0]) is None
    # With as many vertices and faces: by their areas first, and then by what they are.
    flat = (V, F, V[:, :2])
    for other, same in (((V + 3, F, V[:, :2]), True), ((1.01 * V, F, V[:, :2]), False), ((V, F[:-1], V[:, :2]), False),
                        ((np.concatenate([V, V[:1]]), F, np.zeros((len(V) + 1, 2))), False)):  # fmt: skip
        assert (stacks.stacks([flat, other]).stack.tolist() == [0, 0]) == same


def grid(columns, rows):
    V, quads = meshes.quad_grid(columns, rows)
    return np.asarray(V, float), np.array(quads)


def test_quads_are_a_grid_where_they_fill_rows_and_columns_and_nothing_is_beside_them():
    V, quads = grid(3, 2)
    found = quad_grid.rectangle(V, quads, np.ones(6))
    assert {found.columns, found.rows} == {2, 3}
    ring = np.array([[k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)])
    corners = {
        "a vertex beside": (np.concatenate([V, V[:1] + 9]), quads),
        "a ring": (
            np.concatenate([np.eye(3)[[0, 1, 0, 1]] * [[1], [1], [-1], [-1]], 2 * np.eye(3)[[0, 1, 0, 1]]]),
            ring,
        ),
        "a quad missing": (V[np.unique(quads[:-1])], np.searchsorted(np.unique(quads[:-1]), quads[:-1])),
        "an edge to itself": (V, np.concatenate([quads[:1], [[1, 1, 5, 5]]])),
    }
    for name, (W, Q) in corners.items():
        with pytest.raises(errors.GridError, match="The quads of an island"):
            quad_grid.rectangle(W, Q, np.ones(len(Q)))
            pytest.fail(name)


def chart_of(V, F):
    return Chart(V, F, np.arange(F.size).reshape(-1, 3), np.arange(len(F)), np.arange(len(V)))


def test_markers_of_a_chart_are_those_on_its_boundary():
    V, F = meshes.grid(3, 3)
    none = np.zeros(0, np.int64)
    chart = chart_of(V, F)
    assert markers_of_chart(None, chart) == ChartMarkers() == markers_of_chart(MapMarkers(none, none, none), chart)
    corners = np.array([0, 3, 12, 15])
    found = markers_of_chart(MapMarkers(np.array([5]), np.array([3]), corners), chart)
    assert found.centre == 5 and found.start == 3 and set(found.corners) == set(corners) and found.corners[0] == 3
    # Corners within the island, and others than three or four of its boundary.
    for wrong in ([5], [0, 3], [5, 6, 9, 10], [0, 1, 2, 3, 7]):
        with pytest.raises(errors.LandmarkError, match="Markers of corners stand at"):
            markers_of_chart(MapMarkers(none, none, np.array(wrong)), chart)
    assert markers_of_chart(MapMarkers(none, none, np.array([99])), chart).corners == ()


def test_boxes_of_nothing_meet_nothing():
    low, high, none = np.zeros((3, 2)), np.ones((3, 2)), np.zeros((0, 2))
    for given in ((low, high, none, none), (none, none, low, high), (none,) * 4):
        assert all(len(part) == 0 for part in box_pairs(*given))
    assert len(box_pairs(low, high, low + 2, high + 2)[0]) == 0 and len(box_pairs(low, high, low + 0.5, high)[0]) == 9


def test_layouts_are_sound_where_nothing_folds_and_nothing_overlaps():
    V, F = meshes.grid(3, 3)
    uv = V[F][:, :, :2]
    flat = check_layout(F, uv)
    assert not flat.folded.any() and flat.overlap == 0
    fine, many = meshes.grid(40, 2)
    twice = np.exp(1j * 3 * np.pi * fine[:, 0]) * (1 + fine[:, 1])
    spiral = np.column_stack([twice.real, -twice.imag])[many]
    found = check_layout(many, spiral)
    # Without a fold, and once and a half around: of three halves of a ring two are on one another.
    assert not found.folded.any() and found.overlap == pytest.approx(2 / 3, abs=0.01)
    apart = np.concatenate([uv, uv + 0.5]), np.concatenate([F, F + len(V)])
    assert check_layout(apart[1], apart[0]).overlap > 0.1 and check_layout(apart[1], apart[0], apart=True).overlap == 0


def test_folds_are_straightened_where_there_is_an_extent_and_numbers():
    V, F = meshes.grid(2, 2)
    uv = V[F][:, :, :2].reshape(-1, 2)
    side = np.ones(len(F), int)
    for bad in (np.zeros_like(uv), np.where(np.arange(len(uv))[:, None] == 3, np.nan, uv)):
        found, left = straighten_folds(F, bad, side)
        assert found is bad and left == 0
    assert straighten_folds(F, uv, side)[1] == 0


def test_a_boundary_is_pushed_to_a_circle_where_it_goes_around_once():
    turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    radius = 1 + 0.3 * np.cos(3 * turn)
    uv, loop = radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]), np.arange(12)
    found = circle_boundary(uv, loop, 2.0)
    np.testing.assert_allclose(found, 2 * np.column_stack([np.cos(turn), np.sin(turn)]), atol=1e-12)
    twice = np.column_stack([np.cos(2 * turn), np.sin(2 * turn)])
    assert circle_boundary(twice, loop, 1.0) is None and circle_boundary(uv[::-1], loop, 1.0) is None
    assert circle_boundary(np.where(loop[:, None] == 4, 0, uv), loop, 1.0) is None


@pytest.mark.parametrize("value", [0.0, 2.5, -1e300])
def test_what_is_at_one_place_has_no_mirror_and_no_scale(value):
    points, F = np.full((4, 3), value), np.array([[0, 1, 2], [0, 2, 3]])
    assert mirror._boxed(points) is None and mirror.mirrored_quads(points, F).shape == (0, 2)
    assert mirror._boxed(np.array([[0.0, 0, 0], [np.inf, 0, 0]])) is None
    assert mirror.find_mirror(points, F) is None
    for size, extent, expected in (
        (2.0, 3.0, 2.0),
        (0.0, 3.0, 3.0),
        (0.0, 0.0, 1.0),
        (TINY, 4.0, 4.0 if TINY < 4 * TINY else TINY),
    ):
        assert _scale(size, extent) == expected
    whole = np.zeros(4, np.int64)
    goal = np.arange(12.0).reshape(4, 3)
    # A cluster of one place is shifted to the middle of where it shall be.
    np.testing.assert_allclose(affine_images(points, goal, whole, np.ones(4)), np.tile(goal.mean(axis=0), (4, 1)))
    lone, order = _lone_triangle(chart_of(points[:3], np.array([[0, 1, 2]])))
    assert np.isfinite(lone.vertices).all() and sorted(order) == [0, 1, 2]


def test_pins_are_kept_clear_of_cuts_beside_what_is_avoided():
    surface = SimpleNamespace(positions=np.zeros((4, 3)), corner_vertex=np.array([0, 1, 2, 0, 2, 3]))
    avoid = np.array([0.5, 0, 0, 0])
    uv = np.zeros((6, 2))
    nobody, one = CornerPins(np.zeros(6, bool), uv), CornerPins(np.arange(6) == 4, uv)
    for pins in (None, nobody):
        assert clear_of_pins(surface, pins, None) is None and clear_of_pins(surface, pins, avoid) is avoid
    assert clear_of_pins(surface, one, None).tolist() == [0, 0, 1, 0]
    assert clear_of_pins(surface, one, avoid).tolist() == [0.5, 0, 1, 0] and avoid.tolist() == [0.5, 0, 0, 0]


def test_ears_are_cut_off_polygons_with_one_loop():
    V, uv = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 0.2, 0], [0, 1, 0]]), None
    uv = V[:, :2]
    bad = np.array([[0, 1, 2], [0, 2, 4], [2, 3, 4]])
    found = _by_ears(bad, uv, V)
    a, b, c = (uv[found[:, k]] for k in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert (areas > 0).all() and areas.sum() == pytest.approx(2 - 0.8) and len(found) == 3
    apart = np.array([[0, 1, 2], [5, 6, 7]])
    assert _by_ears(apart, np.random.default_rng(0).random((8, 2)), np.random.default_rng(1).random((8, 3))) is apart
    closed = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    assert _by_ears(closed, uv, V) is closed


@pytest.mark.parametrize("pins", [None, (np.zeros(0, int), np.zeros((0, 2))), (np.array([5]), np.array([[1.0, 2.0]]))])
def test_pins_are_renumbered_where_there_are_any(pins):
    V, F = meshes.bumpy(4, 4)
    found = renumbered(V, F, V[:, :2], pins)
    np.testing.assert_array_equal(found.vertices[found.triangles], V[F])
    if pins is None or not len(pins[0]):
        assert found.pins is None
    else:
        np.testing.assert_array_equal(found.order[found.pins.vertices], pins[0])
    turned = renumbered(V, F, V[:, :2] * [-1, 1], pins)
    assert turned.mirror.tolist() == [-1, 1] and found.mirror.tolist() == [1, 1]


def test_corners_of_a_square_are_taken_by_their_nearest_vertices_or_evenly():
    even = np.linspace(0, 4, 12, endpoint=False)
    places, corners = _snap_corners(even)
    np.testing.assert_allclose(places, even, atol=1e-9)
    assert np.flatnonzero(corners).tolist() == [0, 3, 6, 9]
    np.testing.assert_allclose(_perimeter(_on_square(even + 0.1)), even + 0.1, atol=1e-9)
    # All on one side, or twice around: four corners all the same, in their order.
    for crowded in (np.linspace(0.1, 0.9, 8), np.linspace(0, 8, 8, endpoint=False) % 4):
        places, corners = _snap_corners(crowded)
        assert corners.sum() == 4 and np.isfinite(places).all() and len(np.unique(places.round(12))) == 8
    with pytest.raises(errors.FoldedUVError, match="fewer than four"):
        _snap_corners(np.array([0.0, 1.0, 2.0]))


def test_pictures_are_continued_where_there_is_something_to_continue():
    place, none = np.random.default_rng(0).random((4, 5, 2)), np.full((4, 5), -1)
    some = none.copy()
    some[1, 1] = 7
    for face, margin in ((none, 3), (np.zeros((4, 5), int), 3), (some, 0)):
        found = continued(place, face, margin)
        assert found[0] is place and found[1] is face and (found[2] == (face >= 0)).all()
    _, face, known = continued(place, some, 1)
    assert known.sum() == 5 and (face[known] == 7).all()


@pytest.mark.parametrize("kind", [np.float32, np.uint8])
@pytest.mark.parametrize("channels", [3, 4])
def test_only_an_alpha_of_floats_lets_through_what_is_below(kind, channels):
    full = 1.0 if kind is np.float32 else 255
    picture = np.full((8, 8, channels), 0.25 * full, kind)
    inset = np.full((4, 4, channels), full, kind)
    if channels == 4:
        inset[..., 3] = 0
    square = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    found = warp_with_insets(picture, square, square, [InsetImage(inset, (0.0, 0.0), (1.0, 1.0))], None, 0)
    middle = found[4, 4, :3].astype(float) / full
    clear = channels == 4 and kind is np.float32
    np.testing.assert_allclose(middle, 0.25 if clear else 1.0, atol=0.02)


@pytest.mark.parametrize("bad", [{"radius": 0.0}, {"radius": -1.0}, {"radius": np.inf}, {"radius": np.nan},
                                 {"tolerance": 0.0}, {"tolerance": -1.0}])  # fmt: skip
def test_a_flow_has_a_radius_and_a_tolerance(bad):
    points = np.random.default_rng(0).random((9, 3))
    handle = FlowHandle(points[:1], points[:1] + 0.1)
    with pytest.raises(ValueError, match="must be positive"):
        drain(flow(points, (handle,), FlowOptions(**bad)))
    for wrong in (np.zeros((3, 3)), np.full((3, 3), 7.0)):
        with pytest.raises(errors.EmptyMeshError, match="at one place"):
            drain(flow(wrong, (handle,), FlowOptions()))
    with pytest.raises(errors.HandleError, match="no handle"):
        drain(flow(points, (), FlowOptions()))


@pytest.mark.parametrize("angle", [0.4, np.pi])
def test_points_turn_on_their_way_but_for_half_a_turn_that_has_no_side(angle):
    start = np.random.default_rng(3).normal(size=(6, 3))
    c, s = np.cos(angle), np.sin(angle)
    end = start @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [1.0, 2.0, 3.0]
    found = _rigid(start, end, np.linspace(0, 1, 5))
    np.testing.assert_allclose(found[0], start, atol=1e-9)
    np.testing.assert_allclose(found[-1], end, atol=1e-9)
    size = np.linalg.norm(found - found.mean(axis=1, keepdims=True), axis=2)
    turns = np.allclose(size, size[0], atol=1e-6)
    assert (
        turns
        if angle < 3
        else (turns or np.allclose(found, start + np.linspace(0, 1, 5)[:, None, None] * (end - start)))
    )


@pytest.mark.parametrize(
    "text", ['{"handles": [1, 2]}', "[]", '{"handles": {}}', '{"handles": [{"group": "a"}, 3]}', "7"]
)
def test_a_file_of_handles_is_a_list_of_them(tmp_path, text):
    (tmp_path / "h.json").write_text(text)
    with pytest.raises(handle_file.HandleFileError, match="no list of handles"):
        handle_file.read_handle_file(tmp_path / "h.json")


@pytest.mark.parametrize("points", [[1, 2], [[1, 2, 3], [4, 5]], [[1, 2, None]], [[1, 2, float("nan")]], [[[1, 2, 3]]],
                                    [[1, 2, 3, 4]], "no"])  # fmt: skip
def test_places_of_handles_are_finite_points_of_space(tmp_path, points):
    good = [[0, 0, 0], [1, 0, 0]]
    (tmp_path / "h.json").write_text(json.dumps({"handles": [{"from": good, "to": points}]}))
    file = handle_file.read_handle_file(tmp_path / "h.json")
    with pytest.raises(handle_file.HandleFileError, match="'to' is no list of points"):
        handle_file.handles_of(file, (), lambda *_: None)


def test_handles_have_vertices_of_some_body(tmp_path):
    (tmp_path / "h.json").write_text(json.dumps([{"group": "g", "move": [1, 0, 0]}]))
    file = handle_file.read_handle_file(tmp_path / "h.json")
    bodies = tuple(SimpleNamespace(name=name, positions=np.eye(3)) for name in "ab")
    for rows, expected in (((None, np.array([1])), [1]), ((np.zeros(0, int), np.array([0, 2])), [1]),
                           ((np.array([2]), np.array([0])), [0, 1])):  # fmt: skip
        found = handle_file.handles_of(file, bodies, lambda k, _, rows=rows: rows[k])
        assert [k for k, _ in found] == expected
    with pytest.raises(handle_file.HandleFileError, match="no vertices"):
        handle_file.handles_of(file, bodies, lambda k, _: None if k else np.zeros(0, int))


@pytest.mark.parametrize("b, inner", [(3, 0), (3, 1), (4, 0), (6, 9), (1, 1), (2, 0), (2, 3)])
def test_a_disk_is_triangulated_whole_or_not_at_all(b, inner):
    turn = 2 * np.pi * np.arange(b) / b
    boundary = np.column_stack([np.cos(turn), np.sin(turn)])
    points = 0.5 * np.random.default_rng(b).uniform(-1, 1, (inner, 2))
    found = disk_samples.triangulate_disk(boundary, points)
    if b < 3:
        assert found is None
        return
    assert len(found) == 2 * (b + inner) - b - 2 and set(found.ravel()) == set(range(b + inner))
    assert disk_samples.triangulate_disk(np.repeat(boundary[:1], b, axis=0), points) is None or b + inner < 4
    spread = disk_samples.spread_samples(boundary, inner)
    assert spread.shape == (inner, 2) and (np.linalg.norm(spread, axis=1) < 1).all()


@pytest.mark.parametrize("ratio", [0.0, 1.0, -0.5, 2.0, 0.5])
@pytest.mark.parametrize("levels", [1, 2])
def test_a_ratio_counts_where_there_are_levels(ratio, levels):
    V, F = meshes.grid(2, 2)
    surface = SimpleNamespace(positions=V)
    settings = RemeshSettings(count=100, ratio=ratio, levels=levels)
    if levels > 1 and not 0 < ratio < 1:
        with pytest.raises(errors.CountError, match="Give a ratio between 0 and 1"):
            remesh._counts(surface, F, settings)
    else:
        assert remesh._counts(surface, F, settings) == ("vertices", [100, 50][:levels])
    for bad in (0.0, -3.0, np.nan, np.inf):
        with pytest.raises(errors.CountError, match="above 0"):
            remesh._counts(surface, F, RemeshSettings(count=bad))


def test_faces_beside_those_that_are_unwrapped_are_outlined_as_they_lie():
    V, F = meshes.grid(2, 1)
    surface = meshes.polygon_surface(V, F.tolist())
    uv = V[F][:, :, :2].reshape(-1, 2).copy()
    chosen = np.array([True, True, False, False])
    for faces in (None, np.ones(4, bool)):
        assert _beside(UnwrapJob(surface, faces, None, uv=uv)) == []
    assert _beside(UnwrapJob(surface, chosen, None)) == []
    uv[6:9] = uv[6:9][::-1]
    ((points, triangles),) = _beside(UnwrapJob(surface, chosen, None, uv=uv))
    a, b, c = (points[triangles[:, k]] for k in range(3))
    assert len(triangles) == 2 and (np.cross(b - a, c - a) > 0).all()
    uv[6:] = 0
    assert _beside(UnwrapJob(surface, chosen, None, uv=uv)) == []


def test_a_box_of_regions_has_an_extent_both_ways():
    V, F = meshes.grid(2, 2)
    surface = meshes.polygon_surface(V, F.tolist())

    def region(uv, weights):
        pins = CornerPins(np.zeros(F.size, bool), uv)
        return SimpleNamespace(pins=pins, surface=surface, of_triangles=lambda rows: weights[rows])

    uv = V[F][:, :, :2].reshape(-1, 2)
    assert box_of([region(uv, np.ones(8))]) == ((0.0, 0.0), (1.0, 1.0)) and box_of([region(uv, np.zeros(8))]) is None
    for flat in ([1, 0], [0, 1], [0, 0]):
        assert box_of([region(uv * flat, np.ones(8))]) is None
