"""Small parts of solvers at their ends: pictures of whole numbers, stitched vertices, mirrors of cages."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing.inset_images import warp_with_insets
from omt_uv.solver.remeshing.initial import initial_mesh
from omt_uv.solver.subdivision.cage_symmetry import CageChart, _followed, _symmetry_of

SQUARE = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1.0]]])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_pictures_of_whole_numbers_are_rounded_and_others_are_not(dtype):
    whole = np.issubdtype(dtype, np.integer)
    picture = np.random.default_rng(2).integers(0, 200, (8, 8, 3)).astype(dtype)
    old = 0.9 * SQUARE + 0.03
    found, exact = (warp_with_insets(p, old, SQUARE, ()) for p in (picture, picture.astype(float)))
    assert found.dtype == dtype
    want = np.rint(exact) if whole else exact
    assert found == pytest.approx(want, abs=0 if whole else 1e-4)
    assert (want != np.floor(exact)).any()


def test_vertices_of_stitched_charts_that_stay_come_first():
    fixed = np.array([True, False, True, False])
    samples = SimpleNamespace(fixed=fixed, points=np.zeros((4, 3)), along=[np.array([0, 1, 2]), np.array([2, 3])])
    arcs = [SimpleNamespace(kept=True), SimpleNamespace(kept=False)]
    network = SimpleNamespace(arcs=arcs, along=lambda edges: [1])
    plan = SimpleNamespace(
        network=network, samples=samples, warnings=("plan",), vertex_count=6, size=0.5, line_spacing=1.5
    )
    maps = SimpleNamespace(component=SimpleNamespace(to_reopen="edges"), warnings=("maps",))
    points = np.arange(18.0).reshape(6, 3)
    triangles = np.array([[0, 1, 4], [2, 3, 5]])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(initial_mesh, "copies_of", lambda *_: 3)
        patch.setattr(initial_mesh, "WorkingMesh", lambda *words: SimpleNamespace(words=words))
        found = initial_mesh._stitched(maps, plan, points, triangles, ("charts",), True)
    places, rows, stay, locked, delaunay = found.mesh.words
    # Those that stay, then samples on lines and what is inside, all in their order.
    assert np.array_equal(places, points[[0, 2, 1, 3, 4, 5]]) and stay.tolist() == [True, True] + [False] * 4
    assert np.array_equal(places[rows], points[triangles]) and delaunay
    new = {0: 0, 2: 1, 1: 2, 3: 3}
    keys = sorted(int(initial_mesh.pair_keys(np.array([new[a]]), np.array([new[b]]))[0]) for a, b in ((0, 1), (1, 2)))
    assert locked.tolist() == keys
    assert found.to_reopen.tolist() == [int(initial_mesh.pair_keys(np.array([1]), np.array([3]))[0])]
    assert found.warnings == ("maps", "plan", "charts") and found.reopened_copies == 3
    assert (found.vertex_count, found.size, found.line_spacing) == (6, 0.5, 1.5)


def chart(columns=4, rows=2, area=None):
    V, Q = meshes.quad_grid(columns, rows)
    V = V * [1, 1, 0]
    Q = np.array(Q)
    triangles = np.concatenate([Q[:, [0, 1, 2]], Q[:, [0, 2, 3]]])
    around = np.ones(len(V)) if area is None else area
    return CageChart(V, triangles, np.tile(np.arange(len(Q)), 2), around), (V[:, :2] - V[:, :2].mean(axis=0)) @ [1, 1j]


@pytest.mark.parametrize(("off", "found"), [(0.9e-4, True), (1.1e-4, False)])
def test_maps_are_symmetric_where_polygons_around_have_the_same_area(off, found):
    area = np.ones(15)
    assert _symmetry_of(*chart(area=area)) is not None
    # Of both mirrors none maps this vertex to itself.
    area[1] = 1 + off
    assert (_symmetry_of(*chart(area=area)) is not None) == found


@pytest.mark.parametrize(("off", "found"), [(0.2, True), (8.0, False)])
def test_maps_are_symmetric_where_images_lie_at_images(off, found):
    given, w = chart()
    w = w * np.exp(0.4j)
    assert _symmetry_of(given, w) is not None
    w[1] += off * 1e-6 * np.abs(w).max() * 0.5
    assert (_symmetry_of(given, w) is not None) == found
    # A map to one point has no axis.
    assert _symmetry_of(given, np.zeros(15, complex)) is None


def test_a_chart_follows_its_image_to_the_other_side():
    from dataclasses import dataclass

    @dataclass(frozen=True)
    class Symmetry:
        representative: np.ndarray
        flip: np.ndarray
        factor: np.ndarray
        line: np.ndarray

    given = Symmetry(
        np.array([0, 0, 2, 9, 9]),
        np.array([False, True, False, False, False]),
        np.array([1, 1j, 2, 5, 5], complex),
        np.array([0.5, np.nan, 0.1, 0.2, 0.3]),
    )
    found = _followed(given, np.array([3, 4]), np.array([1, 2]))
    assert found.representative.tolist() == [0, 0, 2, 0, 2] and found.flip.tolist() == [False, True, False, False, True]
    assert found.factor.tolist() == [1, 1j, 2, 1j, -2] and np.isnan(found.line).tolist() == [
        False,
        True,
        False,
        True,
        True,
    ]
    assert given.representative[3] == 9
