"""Initial maps: no folds, the boundary where it shall be, and nothing replaced without a warning."""

import contextlib

import hard_meshes
import meshes
import numpy as np
import pytest

from omt_uv.solver.cutting import cut_to_disks
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.maps.polygon_elements import polygon_mesh
from omt_uv.solver.maps.tutte import NO_QUADS, arc_length_parameters, tutte
from omt_uv.solver.maps.untangle import arc_length_boundary, count_folds
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.refinement import initial_maps
from omt_uv.solver.refinement.initial_maps import (
    NEARLY_FLAT,
    check_initial_map,
    disk_initial_map,
    free_initial_map,
    inner_curvature,
    is_crowded,
    is_curved,
    is_far,
    notched_disk,
    square_initial_map,
    unroll,
)

MESHES = {"bumpy": meshes.bumpy(8, 8), "cap": meshes.cap(6, 16), "random": meshes.random_disk(150)}
DOMAINS = {"free": free_initial_map, "disk": disk_initial_map, "square": square_initial_map}


def arch():
    """A grid bent around a cylinder: its rows of quads are flat."""
    V, F = meshes.grid(6, 6)
    return np.column_stack([np.sin(2 * V[:, 0]), V[:, 1], np.cos(2 * V[:, 0])]), F, boundary_loops(F)[0]


@pytest.mark.parametrize("domain", DOMAINS)
@pytest.mark.parametrize("name", MESHES)
def test_no_face_folds(name, domain):
    V, F = MESHES[name]
    initial = DOMAINS[domain](V, F, V[:, :2], boundary_loops(F)[0])
    assert count_folds(initial.uv, F) == 0


def test_a_disk_has_its_boundary_on_the_circle_of_the_surfaces_area():
    V, F = MESHES["bumpy"]
    loop = boundary_loops(F)[0]
    radius = np.linalg.norm(disk_initial_map(V, F, V[:, :2] - 0.5, loop).uv[loop], axis=1)
    np.testing.assert_allclose(np.pi * radius**2, face_areas(V, F).sum(), rtol=1e-12)


def test_a_square_has_its_boundary_on_the_square_of_the_surfaces_area():
    V, F = MESHES["bumpy"]
    loop = boundary_loops(F)[0]
    initial = square_initial_map(V, F, V[:, :2], loop)
    half = np.sqrt(face_areas(V, F).sum()) / 2
    np.testing.assert_allclose(np.abs(initial.uv[loop]).max(axis=1), half, rtol=1e-12)
    assert (np.abs(initial.uv[loop]) > half * (1 - 1e-12)).all(axis=1).sum() == 4
    assert not initial.motion.free[loop].all() and initial.motion.free[loop].any(axis=1).sum() == len(loop) - 4


@pytest.mark.parametrize("seed", range(5))
def test_no_quad_has_three_corners_on_one_side_whichever_way_it_is_cut(seed):
    """Patches with teeth have quads of three and four boundary vertices all along their outlines."""
    (chart, *_) = cut_to_disks(hard_meshes.surface(*hard_meshes.percolation(6, 0.1, seed))).charts
    V, F = chart.vertices, chart.triangles
    quads, loop = polygon_mesh(F, chart.faces).quads, boundary_loops(F)[0]
    flat = tutte(V, F, loop, arc_length_boundary(V, loop, 1.0))
    half = np.sqrt(face_areas(V, F).sum()) / 2
    start = square_initial_map(V, F, flat, loop, quads)
    on_side = np.abs(start.uv[:, :, None] - half * np.array([-1, 1])) < 1e-9 * half
    assert on_side[quads].sum(axis=1).max() == 2 and count_folds(start.uv, F) == 0


def test_a_map_that_will_do_is_kept():
    V, F = MESHES["random"]
    initial = free_initial_map(V, F, V[:, :2], boundary_loops(F)[0])
    scale = np.sqrt(face_areas(V, F).sum() / signed_areas(V[:, :2], F).sum())
    np.testing.assert_array_equal(initial.uv, V[:, :2] * scale)
    assert not initial.warnings and initial.may_cross


def test_developable_charts_are_unrolled_without_any_change_of_length():
    V, F, loop = arch()
    uv = unroll(V, F, loop)
    a, b = F[:, [0, 1, 2]].ravel(), F[:, [1, 2, 0]].ravel()
    np.testing.assert_allclose(np.linalg.norm(uv[a] - uv[b], axis=1), np.linalg.norm(V[a] - V[b], axis=1), rtol=1e-9)
    V, F = MESHES["cap"]
    assert unroll(V, F, boundary_loops(F)[0]) is None


@pytest.mark.parametrize("name", ["grid", "bumpy", "head", "hemisphere"])
@pytest.mark.parametrize("lifted", ["", "start", "end"])
def test_a_part_of_a_surface_tells_no_more_curvature_than_all_of_it(name, lifted):
    """Wherever the curved vertices come in the order of all."""
    V, F = getattr(meshes, name)()
    if lifted:
        V = V * [1, 1, 0]
        (loop,) = boundary_loops(F)
        inner = np.setdiff1d(np.arange(len(V)), loop)
        V[inner[0] if lifted == "start" else inner[-1], 2] += np.ptp(V[:, 0])
    loop = boundary_loops(F)[0]
    assert is_curved(V, F, loop) == (inner_curvature(V, F, loop) > NEARLY_FLAT)


def test_unrolling_follows_the_scale_of_the_surface():
    V, F, loop = arch()
    np.testing.assert_allclose(unroll(1024 * V, F, loop), 1024 * unroll(V, F, loop), rtol=1e-9, atol=1e-9)


def test_a_part_behind_one_edge_leaves_the_circle():
    """Of a square of two triangles none has room; of a finer mesh none needs it."""
    V, F = meshes.quad_patch()
    loop = boundary_loops(F)[0]
    initial = disk_initial_map(V, F, V[:, :2] - 0.5, loop)
    notched = notched_disk(initial, F, loop)
    assert notched.with_barrier and notched.warnings
    assert notched.motion.free[loop].all(axis=1).sum() == 1
    V, F = MESHES["cap"]
    loop = boundary_loops(F)[0]
    assert notched_disk(disk_initial_map(V, F, V[:, :2], loop), F, loop) is None


def test_a_circle_is_crowded_by_small_parts_and_by_no_halves():
    V, F = meshes.grid()
    loop, area = boundary_loops(F)[0], np.ones(len(F))
    assert not is_crowded(F, loop, area)
    at = np.arange(6) * (len(loop) // 6)
    F = np.vstack([F, np.column_stack([loop[at + 1], loop[at], len(V) + np.arange(6)])])
    assert is_crowded(F, boundary_loops(F)[0], np.ones(len(F)))
    # Two halves that one edge joins have as much of the circle as of the area.
    fans = np.array([[0, 1, 6], [1, 2, 6], [2, 3, 6], [3, 0, 6], [3, 2, 7], [2, 4, 7], [4, 5, 7], [5, 3, 7]])
    assert not is_crowded(fans, boundary_loops(fans)[0], np.ones(8))


def test_areas_are_far_by_their_shares_alone():
    area = np.random.default_rng(0).random(100) + 0.1
    assert not is_far(area, area) and not is_far(7 * area, area)
    far = np.where(np.arange(100) < 5, 80.0, 1) * area
    assert is_far(far, area) and is_far(9 * far, 0.1 * area)


def test_maps_that_no_refinement_can_start_from_are_refused():
    V, F = meshes.grid(4, 4)
    check_initial_map(V[:, :2], F)
    check_initial_map(V[:, :2] * [-1, 1], F)
    for wrong in (0 * V[:, :2], V[:, [0, 0]], np.where(np.arange(len(V))[:, None] == 7, np.nan, V[:, :2])):
        with pytest.raises(FoldedUVError, match="The UVs to refine"):
            check_initial_map(wrong, F)
    with pytest.raises(FoldedUVError, match="repair"):
        check_initial_map(np.abs(V[:, :2] - 0.5), F)


@pytest.mark.parametrize("failing", [False, True])
def test_turns_of_a_square_are_told_by_one_system(failing, monkeypatch):
    """The best of eight, or, where embeddings tell nothing, all of them tried."""
    V, F = meshes.bumpy(12, 12)
    loop = boundary_loops(F)[0]
    half, even = np.ones(2) / 2, 4 * arc_length_parameters(V, loop)
    mesh, several = (V, F, V[:, :2] * [2, 0.5], loop, NO_QUADS), [(even + k / 8) % 4 for k in range(8)]
    every = [initial_maps._attempt(mesh, s, half, [])[1] for s in several]
    if failing:
        monkeypatch.setattr(initial_maps, "map_energy", lambda uv, V, F: np.inf)
    found = [energy for _, energy in initial_maps._attempts(mesh, several, half, [])]
    assert len(found) == (8 if failing else 2) and (failing or min(found) == min(every))


@pytest.mark.parametrize("of_start, of_fresh, taken", [(1.99, 1.0, "start"), (2.01, 1.0, "fresh"), (9.0, 9.0, "start")])
def test_a_squeezed_start_gives_way_to_a_mean_value_map_that_is_less_so(of_start, of_fresh, taken, monkeypatch):
    V, F = MESHES["cap"]
    loop, starts = boundary_loops(F)[0], []
    start = initial_maps.disk_initial_map(V, F, V[:, :2], loop)
    monkeypatch.setattr(initial_maps, "disk_initial_map", lambda *_: start)
    monkeypatch.setattr(initial_maps, "unroll", lambda *_: None)
    monkeypatch.setattr(initial_maps, "count_folds", lambda *_: 1)
    monkeypatch.setattr(
        initial_maps, "map_energy", lambda uv, *_: (starts.append(uv), of_start if uv is start.uv else of_fresh)[1]
    )
    found = free_initial_map(V, F, V[:, :2], loop)
    assert found.may_cross and (found.uv is start.uv) == (taken == "start") and len(starts) == 1 + (of_start > 2)
    radius = np.sqrt(face_areas(V, F).sum() / np.pi)
    if taken == "fresh":
        np.testing.assert_allclose(np.linalg.norm(found.uv[loop], axis=1), radius)


@pytest.mark.parametrize("share, refused", [(0.049, True), (0.051, False)])
@pytest.mark.parametrize("sign", [1, -1])
def test_maps_whose_sides_nearly_cancel_are_refused(share, refused, sign):
    """Two triangles, one of them upside down."""
    least = (1 - share) / 2
    uv = np.array([[0, 0], [1, 0], [0, sign], [0, 0], [1, 0], [0, -sign * least / (1 - least)]])
    faces = np.arange(6).reshape(2, 3)
    if not refused:
        check_initial_map(uv, faces)
        return
    with pytest.raises(FoldedUVError, match="beyond repair") as told:
        check_initial_map(uv, faces)
    assert told.value.elements.tolist() == [1]


@pytest.mark.parametrize("height, refused", [(1.9e-12, True), (2.1e-12, False)])
def test_maps_of_no_area_are_refused_in_any_unit(height, refused):
    """A triangle twice as high as the share of its extent's square that is its area."""
    for unit in (1e-6, 1.0, 1e6):
        uv = unit * np.array([[0, 0], [1, 0], [0.5, height]])
        with pytest.raises(FoldedUVError, match="have no area") if refused else contextlib.nullcontext():
            check_initial_map(uv, np.array([[0, 1, 2]]))


@pytest.mark.parametrize("entropy, far", [(0.499, False), (0.501, True)])
def test_targets_are_far_from_half_a_nat_on(entropy, far, monkeypatch):
    monkeypatch.setattr(initial_maps, "relative_entropy", lambda *_: entropy)
    assert is_far(np.ones(2), np.ones(2)) == far


def test_the_middle_of_an_outline_is_its_centroid_wherever_its_vertices_crowd():
    wide = np.array([[0.0, 0], [4, 0], [4, 2], [0, 2]])
    crowded = np.concatenate([wide[:1], np.column_stack([np.linspace(0.01, 0.5, 30), np.zeros(30)]), wide[1:]])
    for outline in (wide, crowded, crowded[::-1], np.roll(crowded, 7, axis=0)):
        np.testing.assert_allclose(initial_maps._middle(outline + [100, -30]), [102, -29])


@pytest.mark.parametrize("left, of_area", [(0.99e-3, False), (1.01e-3, True)])
def test_an_outline_that_encloses_hardly_anything_has_the_mean_of_its_vertices(left, of_area):
    """A bow tie: what the one half encloses the other one takes away, but for a share of both."""
    other = (1 - left) / (1 + left)
    outline = np.array([[0.0, 0], [1, 1], [1, -1], [0, 0], [-1, other], [-1, -other]])
    mean = np.allclose(initial_maps._middle(outline), outline.mean(axis=0))
    assert mean != of_area


@pytest.mark.parametrize("short, second", [(0.9e-6, 1), (1.1e-6, 2)])
def test_of_two_that_are_about_as_far_the_first_is_the_farthest(short, second):
    V = np.array([[0.0, 0, 0], [1 - short, 0, 0], [0, 1, 0]])
    one = np.array([[0, 1], [1, 2], [2, 0]])
    first, far = initial_maps.farthest_from_first(
        np.tile(V, (2, 1)), np.concatenate([one, one + 3]), np.repeat([0, 5], 3)
    )
    assert first.tolist() == [0, 3] and far.tolist() == [second, second + 3]
