"""Painted regions get their shares, over several different objects as well, and everything else stays."""

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from polygons import cut
from readings import reading

from omt_uv.pipelines import magnify as magnify_pipeline
from omt_uv.pipelines.layout import Refusal
from omt_uv.pipelines.magnify import Magnified, Region, Shares, magnify, warped_picture, whole_factor
from omt_uv.pipelines.regions.detail import box_of
from omt_uv.settings import MagnifySettings
from omt_uv.solver.errors import FoldedUVError, ShareError, WeightError
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.progress import drain

DRAFT = {"quality": "draft", "factor": 2.0}


def region(V, F, weights, uv=None, kind="vertex"):
    read = reading(V, F, uv)
    return Region(read.surface, read.faces, weights, read.all_pins, kind)


def spot(V, radius=0.6):
    """Weights that fall off from the middle of the mesh."""
    return np.clip(1.5 - np.linalg.norm(V[:, :2] - V[:, :2].mean(axis=0), axis=1) / radius, 0, 1)


def dome():
    V, F = meshes.hemisphere(6, 20)
    return region(V, F, spot(V), V[:, :2])


def plate(shift=0.0):
    V, F = meshes.grid(10, 10)
    return region(V, F, spot(V, 0.3), V[:, :2] + shift)


def region_shares(regions, result):
    """Weighted UV area of every region, over the UV area of all."""
    inside, whole = [], 0.0
    for mine, corners, uv in zip(regions, result.corners, result.uv, strict=True):
        full = np.zeros((len(mine.surface.corner_vertex), 2))
        full[corners] = uv
        area = np.abs(signed_areas(full, mine.surface.triangles))
        inside.append(area @ mine.of_triangles(np.arange(len(area))))
        whole += area.sum()
    return np.array(inside) / whole


def test_different_objects_in_one_run_get_their_shares_together():
    pytest.importorskip("xatlas")
    regions = [dome(), plate()]
    result = drain(magnify(regions, MagnifySettings(**DRAFT)))
    shares = region_shares(regions, result)
    assert shares.sum() == pytest.approx(result.shares.after, rel=1e-9)
    assert result.shares.target == pytest.approx(2 * result.shares.before)
    assert result.shares.after == pytest.approx(result.shares.target, rel=0.03)
    swapped = drain(magnify(regions[::-1], MagnifySettings(**DRAFT)))
    assert region_shares(regions[::-1], swapped)[::-1] == pytest.approx(shares, rel=1e-6)


@pytest.mark.parametrize("factor", (2.0, 4.0))
@pytest.mark.parametrize("is_soft", (True, False))
@pytest.mark.parametrize("surface", (meshes.hemisphere(10, 30), meshes.grid(20, 20)), ids=("dome", "plate"))
def test_regions_of_a_mesh_have_their_share_to_less_than_a_sixth_of_a_percent(surface, is_soft, factor):
    V, F = surface
    for seed in range(2):
        centre = V[np.random.default_rng(seed).integers(len(V))]
        away = np.linalg.norm(V - centre, axis=1) / np.ptp(V, axis=0).max()
        weights = np.clip(1.5 - away / 0.3, 0, 1) if is_soft else 1.0 * (away < 0.25)
        found = drain(magnify([region(V, F, weights)], MagnifySettings(source="mesh", factor=factor)))
        assert found.shares.after == pytest.approx(found.shares.target, rel=1.6e-3)


def test_different_objects_each_in_their_own_outline():
    regions = [dome(), plate(2.0), region(*meshes.grid(3, 3), np.zeros(16), meshes.grid(3, 3)[0][:, :2] - 3)]
    result = drain(magnify(regions, MagnifySettings(source="uv", boundary="own", **DRAFT)))
    # The third is not painted and not written.
    assert [len(k) for k in result.corners] == [*(len(r.surface.corner_vertex) for r in regions[:2]), 0]
    assert [len(report) for report in result.reports] == [1, 1, 0]
    for island, mine, uv in zip(result.reports, regions, result.uv, strict=False):
        for figures in island:
            assert figures["share_asked"] == pytest.approx(2 * figures["share_before"])
            assert figures["share_after"] == pytest.approx(figures["share_asked"], rel=0.02)
            assert figures["folds"] == 0
        if len(uv):
            # The outline is the one there was; vertices slide along it.
            assert uv.min(axis=0) == pytest.approx(mine.pins.uv.min(axis=0), abs=1e-3)
            assert uv.max(axis=0) == pytest.approx(mine.pins.uv.max(axis=0), abs=1e-3)


def test_weights_of_faces_are_those_of_their_triangles():
    V, F = meshes.grid(10, 10)
    weights = spot(V, 0.3)[F].mean(axis=1)
    by_faces, by_vertices = region(V, F, weights, kind="face"), region(V, F, spot(V, 0.3))
    rows = np.arange(len(F))[::3]
    assert by_faces.of_triangles(rows) == pytest.approx(by_vertices.of_triangles(rows))


@pytest.mark.parametrize("value", [np.nan, -0.1, 1.1])
def test_wrong_weights_are_refused_with_the_object_and_the_elements(value):
    wrong = plate()
    wrong.weights[5] = value
    with pytest.raises(Refusal) as caught:
        drain(magnify([dome(), wrong], MagnifySettings(**DRAFT)))
    assert caught.value.index == 1 and isinstance(caught.value.error, WeightError)
    assert caught.value.error.kind == "vertex" and caught.value.error.elements.tolist() == [5]


@pytest.mark.parametrize("source", ["mesh", "uv"])
def test_no_region_at_all_is_refused(source):
    V, F = meshes.grid(3, 3)
    with pytest.raises(Refusal, match="All weights are the same"):
        drain(magnify([region(V, F, np.ones(16), V[:, :2])], MagnifySettings(source=source, **DRAFT)))


def test_factors_of_a_cascade_multiply():
    assert whole_factor(MagnifySettings(factor=3.0, cascade=4)) == 81.0
    assert whole_factor(MagnifySettings(factor=1e300, cascade=2)) == np.inf
    for factor in (-1.0, np.nan):
        with pytest.raises(ShareError, match="A region cannot have"):
            whole_factor(MagnifySettings(factor=factor))


def test_shares_that_miss_their_target_are_told():
    assert Shares(before=0.1, target=0.4, after=0.401, contrast=6.0).warnings() == ()
    missed = Shares(before=0.1, target=0.4, after=0.3, contrast=6.0)
    assert missed.warnings() == ("The region has 30 % of the texture instead of 40 %",)
    assert missed.report() == {"before": 0.1, "asked": 0.4, "after": 0.3, "factor": 6.0}


@pytest.mark.parametrize("straight", [False, True])
def test_a_picture_of_one_colour_stays_that(straight):
    regions = [plate()]
    result = drain(magnify(regions, MagnifySettings(source="uv", boundary="own", **DRAFT)))
    picture = np.tile(np.array([0.25, 0.5, 0.75, 0.5], np.float32), (32, 32, 1))
    assert np.array_equal(warped_picture(picture, regions, result, 4, straight), picture)


def test_a_picture_follows_its_uvs():
    """Red is u: after a move by half the texture the red of every pixel is that of half a texture before."""
    V, F = meshes.grid(4, 4, 0.5, 1.0)
    uv = V[F.ravel(), :2]
    pins = CornerPins(np.zeros(F.size, bool), uv)
    mine = Region(reading(V, F).surface, np.ones(len(F), bool), np.zeros(len(V)), pins)
    shares = Shares(before=0.0, target=0.0, after=0.0, contrast=1.0)
    moved = Magnified(corners=[np.arange(F.size)], uv=[uv + (0.5, 0.0)], reports=[[]], shares=shares, warnings=[])
    picture = np.zeros((16, 16, 1))
    picture[..., 0] = (np.arange(16) + 0.5) / 16
    result = warped_picture(picture, [mine], moved, 0)
    assert np.allclose(result[:, 8:], picture[:, :8])


@pytest.mark.parametrize(
    ("source", "boundary"), [("mesh", "free"), ("uv", "own"), ("uv", "free"), ("uv", "disk"), ("uv", "square")]
)
def test_a_symmetric_region_of_a_grid_of_quads_keeps_its_centre_lines_straight(source, boundary):
    n = 30
    _, Q = meshes.quad_grid(n, n)
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    V, corner = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), np.ravel(Q)
    triangles, faces = cut(np.arange(4 * n * n).reshape(-1, 4))
    surface = Surface(V, corner, 4 * np.arange(n * n + 1), triangles, faces, np.zeros((0, 2), np.int64))
    pins = CornerPins(np.zeros(len(corner), bool), V[corner, :2] / n)
    chosen = Region(surface, np.ones(n * n, bool), spot(V, 0.2 * n), pins)
    result = drain(magnify([chosen], MagnifySettings(source=source, boundary=boundary, factor=4.0)))
    assert result.shares.after == pytest.approx(result.shares.target, rel=5e-3)
    uv = np.zeros((len(V), 2))
    uv[corner[result.corners[0]]] = result.uv[0]
    assert (np.sign(signed_areas(uv, corner[triangles])) == 1).all()
    grid = (uv @ [1, 1j]).reshape(n + 1, n + 1)
    for line in (grid[n // 2], grid[:, n // 2]):
        along = (line[-1] - line[0]) / abs(line[-1] - line[0])
        assert np.abs(((line - line[0]) / along).imag).max() < 1e-6 * np.ptp(uv)


def test_the_box_of_regions_is_that_of_their_faces_in_the_old_uvs():
    V, F = meshes.grid(10, 10)
    middle = V[F].mean(axis=1)[:, :2]
    inside = ((middle > [0.2, 0.3]) & (middle < [0.5, 0.6])).all(axis=1)
    one = region(V, F, inside.astype(float), V[:, :2] + 2, "face")
    assert np.allclose(box_of([one]), [(2.2, 2.3), (2.5, 2.6)], atol=1e-6)
    nothing = region(V, F, np.zeros(len(F)), V[:, :2] - 7, "face")
    assert box_of([nothing]) is None and np.allclose(box_of([nothing, one]), box_of([one]))
    other = region(V, F, inside.astype(float), V[:, :2] + [4, 1], "face")
    assert np.allclose(box_of([one, other]), [(2.2, 1.3), (4.5, 2.6)], atol=1e-6)
    for axis in (0, 1):
        line = V[:, :2].copy()
        line[:, axis] = 0.25
        assert box_of([region(V, F, inside.astype(float), line, "face")]) is None


def test_polygons_at_the_end_without_triangles_hold_up_no_area(monkeypatch):
    surface = SimpleNamespace(
        corner_vertex=np.arange(9), triangles=np.arange(6).reshape(2, 3), triangle_face=np.zeros(2, np.int64)
    )
    monkeypatch.setattr(magnify_pipeline, "polygon_uv_areas", lambda surface, uv, subdivision: np.array([6.0, 0.0]))
    region = SimpleNamespace(surface=surface, subdivision="some")
    assert magnify_pipeline.uv_areas(region, (np.arange(2),), np.arange(6), np.zeros((6, 2))).tolist() == [3, 3]


def test_what_was_left_out_covers_nothing_on_a_subdivision_either(monkeypatch):
    surface = SimpleNamespace(
        corner_vertex=np.arange(9), triangles=np.arange(9).reshape(3, 3), triangle_face=np.array([0, 1, 1])
    )
    monkeypatch.setattr(magnify_pipeline, "polygon_uv_areas", lambda surface, uv, subdivision: np.array([6.0, 8.0]))
    region, rows = SimpleNamespace(surface=surface, subdivision="some"), np.array([0, 2])
    assert magnify_pipeline.uv_areas(region, (rows,), np.arange(9), np.zeros((9, 2))).tolist() == [6, 4]
    assert magnify_pipeline.uv_areas(region, (rows,), np.arange(3, 9), np.zeros((6, 2))).tolist() == [0, 4]


@pytest.mark.parametrize("boundary", ["own", "rectangle", "disk", "square"])
@pytest.mark.parametrize("which", [0, 1])
def test_folded_islands_are_refused_whatever_they_are_to_fill(which, boundary):
    """By the object they are of, and their faces as the object counts them: a map would unfold them without a word."""
    V, F = meshes.grid(10, 10)
    uv = V[:, :2].copy()
    middle = int(np.argmin(np.linalg.norm(uv - [0.5, 0.5], axis=1)))
    uv[middle] += 3 * (uv.max(axis=0) - uv.min(axis=0)) / 10
    bad = region(V, F, spot(V, 0.3), uv)
    regions = [plate(2.0), bad] if which else [bad, plate(2.0)]
    with pytest.raises(Refusal, match="fold") as told:
        drain(magnify(regions, MagnifySettings(**DRAFT, boundary=boundary, source="uv")))
    assert told.value.index == which and isinstance(told.value.error, FoldedUVError)
    assert set(told.value.error.elements) <= set(np.flatnonzero(np.isin(F, middle).any(axis=1)))
