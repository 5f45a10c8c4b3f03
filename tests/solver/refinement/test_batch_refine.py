"""Charts refined side by side: each as if it were alone."""

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.energy import elements
from omt_uv.solver.maps.untangle import count_folds
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import batch_refine
from omt_uv.solver.refinement.batch_refine import refine_batch
from omt_uv.solver.refinement.continuation_rules import QUALITIES
from omt_uv.solver.refinement.initial_maps import unroll


def in_unit_box(charts):
    return [((V - V.mean(axis=0)) / np.ptp(V, axis=0).max(), F) for V, F in charts]


def disks():
    rough = [meshes.random_disk(40 + 20 * k, k, 0.2 + 0.2 * k) for k in range(4)]
    return in_unit_box([*rough, meshes.cap(5, 12), meshes.grid(4, 3)])


def maps_of(found, charts):
    return np.split(found.uv, np.cumsum([len(V) for V, _ in charts])[:-1])


def test_every_face_has_its_area_and_none_folds():
    charts = in_unit_box([meshes.bumpy(8, 6), meshes.hemisphere(6, 14), meshes.cone(4, 12)])
    found = drain(refine_batch(charts, "standard", 0.0))
    assert found.solved.all()
    for k, ((V, F), uv) in enumerate(zip(charts, maps_of(found, charts), strict=True)):
        assert count_folds(uv, F) == 0
        has, target = signed_areas(uv, F), face_areas(V, F)
        error = np.abs(has / has.sum() - target / target.sum()).sum()
        assert error == pytest.approx(found.area_l1[k]) and error <= QUALITIES["standard"].area_error


@pytest.mark.parametrize("balance", [0.0, 0.5])
def test_a_chart_does_not_depend_on_its_company(balance):
    charts = disks()
    together = drain(refine_batch(charts, "standard", balance))
    for k, uv in enumerate(maps_of(together, charts)):
        alone = drain(refine_batch(charts[k : k + 1], "standard", balance))
        np.testing.assert_allclose(alone.uv, uv, atol=1e-6)
        assert alone.steps[0] == together.steps[k] and alone.area_weight[0] == together.area_weight[k]


def test_the_order_of_charts_is_kept():
    charts = disks()
    forth, back = (drain(refine_batch(c, "draft", 0.0)) for c in (charts, charts[::-1]))
    for a, b in zip(maps_of(forth, charts), maps_of(back, charts[::-1])[::-1], strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)
    np.testing.assert_array_equal(forth.steps, back.steps[::-1])


def test_a_flat_chart_is_unrolled_and_stays():
    V, F = disks()[-1]
    found = drain(refine_batch([(V, F)], "exact", 0.0))
    np.testing.assert_allclose(np.linalg.norm(found.uv[F[:, 0]] - found.uv[F[:, 1]], axis=1),
                               np.linalg.norm(V[F[:, 0]] - V[F[:, 1]], axis=1), atol=1e-9)  # fmt: skip
    assert found.angle_mean[0] == pytest.approx(1)


def test_a_region_gets_its_share():
    charts = disks()[:4]
    middle = np.concatenate([np.linalg.norm(V[F].mean(axis=1), axis=1) < 0.25 for V, F in charts]).astype(float)
    density = 1 + 2 * middle
    found = drain(refine_batch(charts, "standard", 0.0, density, middle))
    begin = 0
    for (V, F), uv in zip(charts, maps_of(found, charts), strict=True):
        here = slice(begin, begin := begin + len(F))
        has, target = signed_areas(uv, F), face_areas(V, F) * density[here]
        assert middle[here] @ has / has.sum() == pytest.approx(middle[here] @ target / target.sum(), rel=0.004)


def test_nearly_flat_charts_start_where_each_alone_is_unrolled():
    rng = np.random.default_rng(3)
    charts = []
    for size in ((4, 3), (5, 5), (3, 6)):
        V, F = meshes.grid(*size)
        charts.append((V + rng.normal(size=V.shape) * [0, 0, 1e-3], F))
    charts = in_unit_box([*charts, meshes.hemisphere(6, 14)])
    union = batch_refine._union(charts, None)
    nearly = np.array([True, True, True, False])
    found, w = batch_refine._conformal(union, nearly)
    np.testing.assert_array_equal(found, nearly)
    for k, (V, F) in enumerate(charts[:3]):
        alone = unroll(V, F, boundary_loops(F)[0]) @ [1, 1j]
        mine = w[union.of_vertex == k]
        for edge in (alone, mine):
            edge -= edge.mean()
            edge /= np.abs(edge).max()
        turn = (alone.conj() * mine).sum()
        np.testing.assert_allclose(mine, alone * turn / np.abs(turn), atol=1e-8)


def test_a_chart_whose_map_would_cover_itself_is_given_back():
    """A ramp that goes around by more than a full turn, nearly without curvature, beside one that does not."""
    ramps = []
    for turn in (1.25, 0.6):
        V, F = meshes.grid(60, 2)
        angle, radius = 2 * np.pi * turn * V[:, 0] / V[:, 0].max(), 1 + 0.4 * V[:, 1] / V[:, 1].max()
        ramps.append((np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.1 * angle], axis=1), F))
    found = drain(refine_batch(in_unit_box(ramps), "standard", 0.0))
    assert found.solved.tolist() == [False, True]


@pytest.mark.parametrize("off", [0.0, 0.8e-9, 1.5e-9, 1e-3])
@pytest.mark.parametrize("axes", [[1, 1], [1, 0]])
@pytest.mark.parametrize("first", [True, False])
def test_a_chart_of_one_size_without_shear_is_isometric_whatever_is_beside_it(off, axes, first):
    """One of two squares of a chart is larger by that, along both axes alike, or along one by half of it."""
    V, F = meshes.quad_patch()
    pieces = [V[:, :2], V[:, :2] * (1 + off * np.array(axes))]
    charts = [pieces, [V[:, :2]] * 2] if first else [[V[:, :2]] * 2, pieces]
    w = np.concatenate([uv for chart in charts for uv in chart]) @ [1, 1j]
    triangles = np.concatenate([F + k * len(V) for k in range(4)])
    positions = np.tile(V, (4, 1))
    union = SimpleNamespace(of_vertex=np.repeat([0, 1], 2 * len(V)), count=2)
    found = batch_refine._isometric(union, elements(positions, triangles, face_areas(positions, triangles)), w)
    bad, good = (0, 1) if first else (1, 0)
    assert found[good]
    assert found[bad] == (off < (1e-9 if axes == [1, 1] else 2e-9))
