"""Distortion figures: exact values by hand, invariances, and agreement with an independent judge if at hand."""

from __future__ import annotations

import importlib.util
import os
from dataclasses import asdict
from pathlib import Path

import meshes
import numpy as np
import polygons
import pytest

from omt_uv.solver.errors import EmptyMeshError, NonFiniteError, ZeroAreaFaceError
from omt_uv.solver.maps.distortion import RATIO_FLOOR, distortion, face_distortion, shear_of, uv_charts
from omt_uv.solver.maps.overlap import overlap_share
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.polygon_areas import polygon_areas

JUDGE = Path(os.environ.get("OMT_UV_JUDGE") or meshes.ROOT.parent / "shared" / "tools" / "judge_uv.py")
needs_judge = pytest.mark.skipif(not JUDGE.is_file(), reason=f"no judge at {JUDGE}: set OMT_UV_JUDGE to judge_uv.py")
# what must not depend on the scale, rotation or mirror image of the map
FIGURES = [
    "area_l1",
    "area_sd",
    "area_p99",
    "area_max",
    "angle_mean",
    "angle_p99",
    "seed_area",
    "seed_angle",
    "overlap",
]


def flat(V, F):
    """The map that drops z: (m,3,2)."""
    return V[F][..., :2].copy()


def rough_map(seed=0):
    """A bumpy mesh under a smooth, uneven map with a handful of folded faces."""
    V, F = meshes.bumpy()
    X = V[:, :2] + 0.1 * np.sin(7 * V[:, [1, 0]]) + 0.03 * np.random.default_rng(seed).normal(size=(len(V), 2))
    return V, F, X[F]


def test_identity_is_exact():
    V, F = meshes.grid(7, 5, 2.0, 3.0)
    d = distortion(V, F, flat(V, F))
    assert (d.faces, d.charts, d.folds, d.skipped_zero_area_faces) == (70, 1, 0, 0)
    assert d.area_l1 == pytest.approx(0, abs=1e-12) and d.area_sd == pytest.approx(0, abs=1e-12)
    assert d.area_max == pytest.approx(0, abs=1e-12) and d.area_p99 == pytest.approx(0, abs=1e-12)
    assert d.angle_mean == pytest.approx(1, abs=1e-7) and d.angle_p99 == pytest.approx(1, abs=1e-7)
    assert d.seed_area == pytest.approx(2) and d.seed_angle == pytest.approx(2)
    assert d.overlap == 0 and d.uv_min == (0, 0) and d.uv_max == (2, 3) and d.finite


@pytest.mark.parametrize("stretch", [1.0, 1.5, 4.0, 300.0])
def test_stretch_shears_and_keeps_area_shares(stretch):
    V, F = meshes.grid()
    d = distortion(V, F, flat(V, F) * [stretch, 1.0])
    assert d.angle_mean == pytest.approx(stretch) and d.angle_p99 == pytest.approx(stretch)
    assert d.seed_angle == pytest.approx(stretch + 1 / stretch)
    assert d.area_l1 == pytest.approx(0, abs=1e-12) and d.folds == 0


def test_simple_shear_has_its_singular_values():
    V, F = meshes.grid()
    k = 0.7
    _, shear = face_distortion(V, F, flat(V, F) @ np.array([[1.0, 0], [k, 1]]))
    s1, s2 = np.linalg.svd([[1.0, k], [0, 1]], compute_uv=False)
    assert shear == pytest.approx(np.full(len(F), s1 / s2))


def test_area_figures_of_two_faces_by_hand():
    V, F = meshes.quad_patch()
    uv = flat(V, F)
    uv[1] *= np.sqrt(3)  # two charts of areas 1/2 and 3/2: UV shares 1/4 and 3/4 of what should be halves
    d = distortion(V, F, uv)
    assert d.charts == 2 and d.folds == 0
    assert d.area_l1 == pytest.approx(0.5) and d.area_sd == pytest.approx(0.5)
    assert d.area_max == pytest.approx(1.0) and d.seed_area == pytest.approx((0.5 + 2 + 1.5 + 2 / 3) / 2)
    octaves, _ = face_distortion(V, F, uv)
    assert octaves == pytest.approx([-1, np.log2(1.5)])


def test_one_fold_is_counted_and_left_out_of_the_angles():
    V, F = meshes.grid(2, 2)
    uv = flat(V, F)
    centre = F == 4
    uv[centre] = [1.2, 0.5]  # pulled across the right side: the faces between the centre and that side turn over
    d = distortion(V, F, uv)
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    turned = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] <= 0
    assert d.folds == turned.sum() > 0 and d.charts == 1
    octaves, _ = face_distortion(V, F, uv)
    assert np.array_equal(octaves == np.log2(RATIO_FLOOR), turned)


def test_a_mirrored_chart_is_no_fold():
    V, F = meshes.grid()
    half = np.arange(len(F)) < len(F) // 2
    uv = flat(V, F)
    uv[half] = uv[half] * [-1, 1] - [5, 0]
    assert distortion(V, F, uv).folds == 0


def test_known_overlap():
    V, F = meshes.grid(1, 1)
    V = np.concatenate([V, V + [3, 0, 0]])
    F = np.concatenate([F, F + 4])
    uv = flat(V, F)
    uv[2:] -= [2.75, 0]  # the second unit square covers three quarters of the first
    d = distortion(V, F, uv)
    assert d.charts == 2 and d.folds == 0
    assert d.overlap == pytest.approx(0.75, abs=0.005)
    assert distortion(V, F, uv, overlap=False).overlap is None


def test_overlap_counts_doubly_wound_strips_but_not_touching_faces():
    V, F = meshes.spiral_strip(turns=2.0)
    assert overlap_share(flat(V, F)) == 1.0
    V, F = meshes.random_disk(2000)
    assert overlap_share(flat(V, F)) == 0.0


def test_overlap_of_one_giant_and_many_tiny_faces_stays_small_in_memory():
    V, F = meshes.grid(60, 60)
    tiny = flat(V, F) * 1e-3
    giant = np.repeat(np.array([[[0.0, 0], [1, 0], [0, 1]]]), 50, axis=0)
    assert overlap_share(np.concatenate([tiny, giant])) > 0.99


@pytest.mark.parametrize("transform", ["scale", "rotation", "mirror", "mesh scale", "relabelling"])
def test_figures_do_not_depend_on(transform):
    V, F, uv = rough_map()
    expected = distortion(V, F, uv)
    c, s = np.cos(1.1), np.sin(1.1)
    if transform == "scale":
        uv = uv * 1234.5
    elif transform == "rotation":
        uv = uv @ np.array([[c, s], [-s, c]]) + [3, -7]
    elif transform == "mirror":
        uv = uv * [-1, 1]
    elif transform == "mesh scale":
        V = V * 1e-4
    else:
        new = np.random.default_rng(1).permutation(len(V))
        F, V = new[F], V[np.argsort(new)]
    result = distortion(V, F, uv)
    assert result.folds == expected.folds > 0 and result.charts == expected.charts == 1
    for name in FIGURES:
        assert getattr(result, name) == pytest.approx(getattr(expected, name), rel=1e-8, abs=1e-3 * (name == "overlap"))


def test_bad_input_is_a_named_error():
    V, F = meshes.grid(2, 2)
    uv = flat(V, F)
    with pytest.raises(EmptyMeshError, match="There are no faces to measure"):
        distortion(V, F[:0], uv[:0])
    broken = uv.copy()
    broken[3, 1, 0] = np.nan
    with pytest.raises(NonFiniteError) as caught:
        distortion(V, F, broken)
    assert caught.value.kind == "face" and caught.value.elements.tolist() == [3]
    with pytest.raises(NonFiniteError, match="A position is not a finite number"):
        distortion(np.where(np.arange(len(V))[:, None] == 4, np.inf, V), F, uv)
    with pytest.raises(ZeroAreaFaceError, match="No face has an area"):
        distortion(V * [1, 0, 0], F, uv)
    with pytest.raises(ValueError, match="expected F"):
        distortion(V, F, uv[:, :2])
    with pytest.raises(ValueError, match="expected polygons"):
        distortion(V, F, uv, polygons=np.zeros(len(F) - 1, int))
    # Faces of a chart are named as they are in the surface.
    polygons = 100 + np.arange(len(F)) // 2
    for measure in (distortion, face_distortion):
        with pytest.raises(NonFiniteError) as caught:
            measure(V, F, broken, polygons=polygons)
        assert caught.value.elements.tolist() == [101]
        with pytest.raises(ZeroAreaFaceError) as caught:
            measure(V * [1, 0, 0], F, uv, polygons=polygons)
        assert caught.value.elements.tolist() == np.unique(polygons).tolist()


def test_faces_without_area_are_skipped_and_vanished_maps_are_all_folds():
    V, F = meshes.grid(3, 3)
    F = np.concatenate([F, [[0, 1, 1]]])
    d = distortion(V, F, flat(V, F))
    assert d.skipped_zero_area_faces == 1 and d.faces == 18 and d.area_l1 == pytest.approx(0, abs=1e-12)
    octaves, shear = face_distortion(V, F, flat(V, F))
    assert octaves[-1] == 0 and shear[-1] == 1
    vanished = distortion(V, F, 0 * flat(V, F))
    assert vanished.folds == 18 and vanished.seed_area is None and vanished.overlap == 0


def judge_module():
    spec = importlib.util.spec_from_file_location("judge_uv", JUDGE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def assert_agrees(V, F, uv):
    ours, theirs = asdict(distortion(V, F, uv)), judge_module().judge(V, F, uv)
    assert set(theirs) <= set(ours)
    for name, value in theirs.items():
        assert ours[name] == pytest.approx(value, rel=1e-4, abs=1e-4), name


@needs_judge
@pytest.mark.parametrize("seed", range(5))
def test_agrees_with_the_judge_on_rough_maps(seed):
    assert_agrees(*rough_map(seed))


@needs_judge
def test_agrees_with_the_judge_on_several_overlapping_and_mirrored_charts():
    V, F = meshes.icosphere(3)
    V = V * [1.0, 1.3, 0.6]
    below = V[F].mean(1)[:, 2] < 0
    uv = V[F][..., :2] + 0.3 * V[F][..., 2:] ** 2
    uv[below] = uv[below] * [0.4, 0.7] + [0.2, 0.1]
    assert_agrees(V, F, uv)


@needs_judge
@meshes.models_missing
@pytest.mark.parametrize("name", meshes.DISK_MODELS)
def test_agrees_with_the_judge_on_models(name):
    """Seen from the front every model overlaps, folds and shears as badly as a map can."""
    V, F = meshes.load_model(name)
    spread = V - V.mean(0)
    axes = np.linalg.svd(spread.T @ spread)[0][:, :2]
    X = spread @ axes
    assert_agrees(V, F, np.float32(X / np.ptp(X))[F].astype(float))


def measured(V, faces, uv, turn=0, order=None):
    """Figures of a map (n,2) of polygons cut from one of their corners, in some order of the polygons."""
    F, owner = polygons.cut(faces if order is None else [faces[k] for k in order], turn)
    return {**asdict(distortion(V, F, uv[F], polygons=owner, overlap=False)), "overlap": 0.0}


@pytest.mark.parametrize("turn", [1, 2, 3])
def test_figures_of_quads_do_not_depend_on_the_diagonals(turn):
    V, faces, uv = polygons.wavy_quads()
    expected, found = measured(V, faces, uv), measured(V, faces, uv, turn)
    assert expected["faces"] == len(faces) and expected["folds"] == 0 and expected["area_l1"] > 0.01
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-12), name


@pytest.mark.parametrize("turn", [1, 4])
def test_areas_of_polygons_depend_neither_on_diagonals_nor_on_the_order_of_faces(turn):
    V, faces, uv = polygons.wavy_mixed()
    order = np.random.default_rng(turn).permutation(len(faces))
    expected, found = measured(V, faces, uv), measured(V, faces, uv, turn, order)
    for name in ("faces", "charts", "folds", "area_l1", "area_sd", "area_p99", "area_max", "seed_area"):
        assert found[name] == pytest.approx(expected[name], rel=1e-12), name
    same = measured(V, faces, uv, 0, order)
    for name, value in expected.items():
        assert same[name] == pytest.approx(value, rel=1e-12), name


@needs_judge
@pytest.mark.parametrize("scene", [polygons.wavy_quads, polygons.wavy_mixed])
def test_area_error_of_polygons_agrees_with_the_judge(scene):
    V, faces, uv = scene()
    vertex = np.concatenate(faces)
    start = np.concatenate([[0], np.cumsum([len(p) for p in faces])[:-1]])
    theirs = judge_module().polygon_error(V, start, vertex, uv[vertex])
    assert measured(V, faces, uv)["area_l1"] == pytest.approx(theirs, rel=1e-12) and theirs > 0.01


def test_polygons_that_are_triangles_change_no_bit():
    V, F, uv = rough_map()
    for polygons_of in (np.arange(len(F)), np.arange(len(F))[::-1] * 3 - 5):
        assert distortion(V, F, uv, polygons=polygons_of) == distortion(V, F, uv)
        assert np.array_equal(face_distortion(V, F, uv, polygons_of), face_distortion(V, F, uv))


def test_triangles_among_polygons_measure_as_without():
    """One quad far away makes polygons of all, and no difference to the triangles beyond rounding."""
    V, F, uv = rough_map()
    W, G = meshes.quad_patch()
    V, F = np.concatenate([V, W + [5, 0, 0]]), np.concatenate([F, G + len(V)])
    uv = np.concatenate([uv, W[G][..., :2] + [5, 0]])
    owner = np.minimum(np.arange(len(F)), len(F) - 2)
    alone, found = distortion(V, F, uv, overlap=False), distortion(V, F, uv, overlap=False, polygons=owner)
    assert found.faces == alone.faces - 1 and found.folds == alone.folds > 0
    for name in ("area_l1", "area_sd", "angle_mean", "angle_p99", "area_max"):
        assert getattr(found, name) == pytest.approx(getattr(alone, name), rel=1e-10), name


def test_shear_of_a_quad_is_that_of_both_its_triangulations():
    V, faces, uv = polygons.wavy_quads(1, 1)
    both = [polygons.cut(faces, turn)[0] for turn in (0, 1)]
    F = np.concatenate(both)
    a, b = V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]
    area = np.linalg.norm(np.cross(a, b), axis=1)
    shear = np.concatenate([face_distortion(V, f, uv[f])[1] for f in both])
    assert measured(V, faces, uv)["angle_mean"] == pytest.approx(area @ shear / area.sum(), rel=1e-12)


def test_a_polygon_with_a_turned_triangle_is_one_fold():
    V, Q = meshes.quad_grid(3, 3)
    uv = V[:, :2].copy()
    F, owner = polygons.cut(Q)
    inner = np.flatnonzero((np.abs(uv - uv.mean(0)) < 0.4 * np.ptp(uv, axis=0)).all(1))[0]
    uv[inner] += 4 * (uv.mean(0) - uv[inner])
    signed = signed_areas(uv, F)
    found = distortion(V, F, uv[F], polygons=owner, overlap=False)
    assert found.folds == len(np.unique(owner[signed <= 0])) > 0
    octaves, shear = face_distortion(V, F, uv[F], owner)
    assert np.array_equal(np.unique(owner[octaves == np.log2(RATIO_FLOOR)]), np.unique(owner[signed <= 0]))
    pairs = owner[:, None] == owner
    assert all((values[:, None] == values)[pairs].all() for values in (octaves, shear))


def test_a_density_of_polygons_changes_what_is_due():
    V, faces, uv = polygons.wavy_quads()
    F, owner = polygons.cut(faces)
    area = np.bincount(owner, polygon_areas(V, F, owner))
    plane = np.bincount(owner, signed_areas(uv, F))
    found = distortion(V, F, uv[F], density=(plane / area)[owner], polygons=owner)
    assert found.area_l1 == pytest.approx(0, abs=1e-12) and found.area_max == pytest.approx(0, abs=1e-12)
    with pytest.raises(ValueError, match="polygons"):
        distortion(V, F, uv[F], polygons=owner[1:])


def test_charts_are_told_alike_whether_corners_of_a_vertex_have_one_place_to_the_last_digit():
    """Two pieces side by side, one that is drawn twice at one vertex, and the same with rounding at every corner."""
    V, F = meshes.grid(6, 6)
    uv = V[:, :2][F]
    apart = uv + np.where(F.min(axis=1) < 14, 0.0, 3.0)[:, None, None]
    for drawn in (uv, apart):
        count, chart = uv_charts(F, drawn)
        rounded = drawn + 1e-12 * np.random.default_rng(0).standard_normal(drawn.shape)
        again, same = uv_charts(F, rounded)
        assert count == again
        assert len(np.unique(np.stack([chart, same]), axis=1).T) == count
    assert uv_charts(F, uv)[0] == 1 and uv_charts(F, apart)[0] > 1
    split = np.concatenate([F, F + len(V)])
    assert uv_charts(split, np.concatenate([uv, uv]))[0] == 2


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_areas_beyond_the_greatest_number_are_told_as_such():
    V, F = meshes.grid(3, 3)
    for figures in (distortion, face_distortion):
        with pytest.raises(NonFiniteError, match="area") as caught:
            figures(1e200 * V, F, V[F][..., :2])
        assert caught.value.elements.tolist() == list(range(len(F)))
        figures(1e60 * V, F, V[F][..., :2])


@pytest.mark.parametrize("height", [1.0, 0.5, 1.01e-6, 0.99e-6, 1e-9, 0.0])
def test_shear_is_told_up_to_a_million(height):
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    for turned in (1, -1):
        a, b = np.array([[1.0, 0]]), np.array([[0.3, turned * height]])
        (found,) = shear_of(V, np.array([[0, 1, 2]]), a, b)
        if height:
            s = np.linalg.svd(np.column_stack([a[0], b[0]]), compute_uv=False)
            assert found == pytest.approx(min(s[0] / s[1], 1e6), rel=1e-5)
        else:
            assert found == 1e6


def test_where_a_face_without_area_lies_in_the_map_is_left_out_of_its_bounds():
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 2, 0.0]])
    F = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[-7, 0], [0, 9], [0, 5.0]]])
    d = distortion(V, F, uv)
    assert d.skipped_zero_area_faces == 1 and (d.uv_min, d.uv_max) == ((0, 0), (1, 1))
