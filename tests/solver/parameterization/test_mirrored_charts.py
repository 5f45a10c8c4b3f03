"""Charts that are equal but for a motion: found whatever their numbers and diagonals, and mapped once."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from polygons import slit_across, wavy_quads
from sphere_shapes import random_rotation

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.analysis.facing import SceneAxes
from omt_uv.solver.cutting.cuts import Cuts
from omt_uv.solver.mesh.charts import Chart, strict_charts
from omt_uv.solver.mesh.geometry import edge_lengths, signed_areas
from omt_uv.solver.mesh.mirror import find_mirror, partial_mirror
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization import unwrap as unwrap_module
from omt_uv.solver.parameterization.mirrored_charts import (
    _mirror_of_all,
    images_of_cuts,
    motion_between,
    remembered,
    with_images,
    with_missing_images,
)
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import predicted_cuts, unwrap
from omt_uv.solver.progress import Progress, drain

DRAFT = UnwrapOptions(quality="draft")


def moved(V, P, seed, mirrored=False):
    """A copy elsewhere, turned, with vertices and polygons in another order, and polygons that begin elsewhere."""
    rng = np.random.default_rng(seed)
    name = rng.permutation(len(V))
    W = (V * ([-1, 1, 1] if mirrored else 1))[np.argsort(name)] @ random_rotation(seed).T + rng.normal(size=3)
    Q = [np.roll(name[p][:: -1 if mirrored else 1], rng.integers(4)).tolist() for p in P]
    return W, [Q[k] for k in rng.permutation(len(Q))]


def charts_of(*parts, seams=()):
    n = np.cumsum([0, *(len(V) for V, _ in parts)])
    P = [[v + first for v in p] for (_, Q), first in zip(parts, n, strict=False) for p in Q]
    surface = meshes.polygon_surface(np.concatenate([V for V, _ in parts]), P, seams)
    return surface, strict_charts(surface)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_motion_is_found_whatever_the_numbers_and_diagonals(mirrored):
    body = wavy_quads()[:2]
    for seed in range(4):
        _, (first, other) = charts_of(body, moved(*body, seed, mirrored))
        image, sign = motion_between(first, other)
        assert sign == (-1.0 if mirrored else 1.0)
        a, b = first.vertices[image], other.vertices
        np.testing.assert_allclose(
            np.linalg.norm(a[:, None] - a, axis=2), np.linalg.norm(b[:, None] - b, axis=2), atol=1e-9
        )


def test_what_differs_anywhere_is_not_equal():
    V, P = wavy_quads()[:2]
    for k, change in enumerate(([1e-3, 0, 0], [0, 0, -1e-3])):
        W = V.copy()
        W[7 + k] += change
        _, (first, other) = charts_of((V, P), moved(W, P, 2))
        assert motion_between(first, other) is None
    _, (first, other) = charts_of((V, P), moved(V, P[:-1], 1))
    assert motion_between(first, other) is None


def test_what_lies_in_a_row_has_no_frame_and_no_motion():
    """Without a word, and whatever its size."""
    row = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], float)
    triangles = np.array([[0, 1, 2], [1, 3, 2]])
    for scale in (1.0, 1e-300, 1e300):
        first, other = (
            Chart(scale * V, triangles, np.arange(6).reshape(-1, 3), np.arange(2), np.arange(4)) for V in (row, row + 5)
        )
        with np.errstate(all="raise", under="ignore"):
            assert motion_between(first, other) is None


def test_both_sides_of_a_slit_are_told_apart():
    V, P = meshes.quad_grid()
    V = V + 0.05 * np.random.default_rng(0).random(V.shape)
    P = [list(map(int, p)) for p in P]
    edges = {(a, b) for p in P for a, b in zip(p, [*p[1:], p[0]], strict=True)}
    # A row of edges from the boundary on.
    inside = [(a, a + 1) for a in range(len(V) // 2 - 3, len(V) // 2) if (a, a + 1) in edges or (a + 1, a) in edges]
    W, Q = moved(V, P, 0)
    name = np.random.default_rng(0).permutation(len(V))
    seams = [*inside, *((name[a] + len(V), name[b] + len(V)) for a, b in inside)]
    _, (first, other) = charts_of((V, P), (W, Q), seams=seams)
    assert len(first.vertices) > len(V)
    image, _ = motion_between(first, other)
    assert sorted(image.tolist()) == list(range(len(first.vertices)))


def test_equal_charts_are_solved_once(monkeypatch):
    body, solved = wavy_quads()[:2], []

    def counted(chart, **given):
        solved.append(chart)
        return map_completed(chart, **given)

    map_completed = unwrap_module.map_completed
    monkeypatch.setattr(unwrap_module, "map_completed", counted)
    surface, charts = charts_of(body, moved(*body, 1), moved(*body, 2, mirrored=True), moved(body[0] * 1.1, body[1], 3))
    found = drain(unwrap(surface, options=DRAFT))
    assert len(charts) == 4 and len(solved) == 2
    for chart, chart_map in zip(found.charts, found.maps, strict=True):
        assert chart_map.folds == 0 and (signed_areas(chart_map.uv, chart.triangles) > 0).all()
    assert found.maps[0].area_l1 == found.maps[1].area_l1 == found.maps[2].area_l1
    # Densities that are not equal part them.
    solved.clear()
    density = np.ones(len(surface.triangles))
    density[charts[1].faces.min() :][:3] = 2.0
    drain(unwrap(surface, options=DRAFT, target=Target(density)))
    assert len(solved) == 3


def bent_grid(turned=0):
    """A surface of 8 by 8 quads that is its own image in x alone, and what takes (column, row) to a vertex."""
    n = 8
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    V = np.column_stack([x - n / 2, y, 0.1 * (x - n / 2) ** 2 + 0.03 * y**2 + 0.05 * y])
    V = V @ random_rotation(turned).T
    corner = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    P = np.column_stack([corner, corner + 1, corner + n + 2, corner + n + 1]).tolist()
    return V, P, lambda column, row: row * (n + 1) + column


def test_a_slit_on_one_side_has_an_image_on_the_other():
    V, P, at = bent_grid(turned=3)
    surface = meshes.polygon_surface(V, P)
    slit = np.array([[at(4, 0), at(4, 1)], [at(4, 1), at(4, 2)], [at(4, 2), at(5, 2)]])
    assert np.sort(images_of_cuts(surface, None, slit)).tolist() == [[at(3, 2), at(4, 2)]]
    both = np.concatenate([slit, [[at(4, 2), at(3, 2)]]])
    assert len(images_of_cuts(surface, None, both)) == 0


def test_a_cut_has_images_in_both_mirrors_of_a_body():
    """A tube of 6 by 8 quads: its own image across y and z, and cut so across y alone."""
    n, m = 8, 6
    k = np.arange(n)
    turn = 2 * np.pi * k / n
    ring = np.column_stack([2 * np.cos(turn) + 0.5 * np.cos(2 * turn), np.sin(turn)])
    height = np.linspace(-1.5, 1.5, m + 1)
    V = np.column_stack([np.tile(ring, (m + 1, 1)), np.repeat(height, n)])
    P = [[r * n + j, r * n + (j + 1) % n, (r + 1) * n + (j + 1) % n, (r + 1) * n + j] for r in range(m) for j in k]
    surface = meshes.polygon_surface(V, P)
    # All along one side, in the plane of y, and a slit up from below on the other side.
    cuts = np.array([[r * n, r * n + n] for r in range(m)] + [[n // 2, n // 2 + n]])
    images = np.sort(images_of_cuts(surface, None, cuts), axis=1)
    assert images.tolist() == [[(m - 1) * n + n // 2, m * n + n // 2]]


def test_what_is_not_symmetric_or_would_be_much_longer_has_no_image():
    V, P, at = bent_grid()
    surface = meshes.polygon_surface(V, P)
    assert len(images_of_cuts(surface, None, np.array([[at(0, 2), at(1, 2)]]))) == 0
    slit = np.array([[at(4, k), at(4, k + 1)] for k in range(3)] + [[at(4, 3), at(5, 3)]])
    assert len(images_of_cuts(surface, None, slit)) == 1
    marked = meshes.polygon_surface(V, P, [(at(7, 6), at(6, 6))])
    assert len(images_of_cuts(marked, None, slit)) == 0
    faces = np.ones(len(P), bool)
    faces[0] = False
    assert len(images_of_cuts(surface, faces, slit)) == 0


@pytest.mark.parametrize("viewer", [(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
def test_handles_are_opened_where_nobody_looks(viewer):
    V, F = meshes.torus()
    cuts = predicted_cuts(triangle_surface(V, F), np.ones(len(F), bool), 3.0, SceneAxes(viewer=viewer))
    angle = np.arctan2(V[:, 1], V[:, 0])[cuts.edges]
    across = cuts.edges[np.isclose(angle[:, 0], angle[:, 1])]
    assert (V[across].mean(axis=(0, 1)) @ viewer) < -0.5


def test_suzanne_is_cut_and_mapped_symmetrically():
    V, P = meshes.load_polygons("suzanne")
    surface = meshes.polygon_surface(V, P)
    found = drain(unwrap(surface, options=UnwrapOptions(quality="draft")))
    mirror = find_mirror(V, surface.corner_vertex[surface.triangles], surface.triangle_face)
    cuts = {tuple(sorted(e)) for e in found.seams.tolist()}
    assert cuts == {tuple(sorted(e)) for e in mirror.image[found.seams].tolist()}
    assert all(m.folds == 0 for m in found.maps)
    predicted = predicted_cuts(surface, np.ones(len(P), bool), 0.0).edges
    assert cuts == {tuple(sorted(e)) for e in predicted.tolist()}


def test_cuts_get_their_images_and_the_length_of_both():
    V, P, at = bent_grid()
    surface = meshes.polygon_surface(V, P)
    slit = np.array([[at(4, 0), at(4, 1)], [at(4, 1), at(4, 2)], [at(4, 2), at(5, 2)]])
    for edges, count in ((slit, 4), (np.concatenate([slit, [[at(4, 2), at(3, 2)]]]), 4)):
        found = with_images(surface, None, Cuts(edges, float(edge_lengths(V, edges).sum()), (), edges[:0], ()))
        assert len(found.edges) == count and found.length == pytest.approx(edge_lengths(V, found.edges).sum())


def test_what_hangs_on_one_side_of_the_plane_leaves_the_rest_symmetric():
    V, Q = slit_across()
    surface = meshes.polygon_surface(V, Q.tolist(), [])
    (chart,) = strict_charts(surface)
    n, whole = len(chart.vertices), with_missing_images(chart)
    assert whole is not None and find_mirror(whole.vertices, whole.triangles, whole.faces) is not None
    # What there is comes first, as it was; its images have vertices of their own, and nothing else lies there.
    np.testing.assert_array_equal(whole.vertices[:n], chart.vertices)
    np.testing.assert_array_equal(whole.triangles[: len(chart.triangles)], chart.triangles)
    assert len(whole.vertices) == n + 3 and len(whole.triangles) == len(chart.triangles) + 4
    found = drain(unwrap(surface, options=UnwrapOptions()))
    (one,), uv = found.charts, found.maps[0].uv
    mirror = partial_mirror(one.vertices, one.triangles, one.faces)
    known = np.flatnonzero(mirror.image >= 0)
    z, image = uv[known] @ [1, 1j], uv[mirror.image[known]] @ [1, 1j]
    # A reflection in the map, too: |z_j - z_k| is that of the images, for all pairs.
    far, as_far = (np.abs(w[:, None] - w) for w in (z, image))
    assert np.abs(far - as_far).max() <= 1e-6 * far.max()
    assert found.maps[0].folds == 0


def test_what_unrolls_needs_no_images():
    V, Q = slit_across()
    surface = meshes.polygon_surface(V * [1, 1, 0], Q.tolist(), [])
    (chart,) = strict_charts(surface)
    assert with_missing_images(chart) is not None
    found = drain(unwrap(surface, options=UnwrapOptions()))
    assert found.maps[0].newton_refinement == 0 and found.maps[0].angle_mean == pytest.approx(1, abs=1e-7)


def test_charts_with_a_mirror_of_all_or_of_nothing_miss_no_images():
    V, Q = slit_across()
    for body in (wavy_quads()[:2], (V + 0.05 * np.sin(5 * V + 1), Q.tolist())):
        (chart,) = strict_charts(meshes.polygon_surface(*body, []))
        assert with_missing_images(chart) is None


def test_what_was_refined_is_told_again_for_the_same_map():
    _, (chart,) = charts_of(wavy_quads()[:2])
    made = []

    def refined(chart, chart_map):
        made.append(chart_map)
        yield Progress("Map", 0.0)
        return chart_map.uv + 1

    again, first = remembered(refined), SimpleNamespace(uv=chart.vertices[:, :2])
    for chart_map in (first, SimpleNamespace(uv=first.uv.copy()), SimpleNamespace(uv=2 * first.uv)):
        np.testing.assert_array_equal(drain(again(chart, chart_map)), chart_map.uv + 1)
    assert len(made) == 2


@pytest.mark.parametrize("filled", [1, 3, 12])
def test_triangles_that_fill_holes_are_polygons_of_their_own_where_a_mirror_is_looked_for(filled):
    """Of two charts that are each other's image, in whatever order their faces are."""
    V, F = meshes.bumpy(5, 4, height=0.3)
    V, rng = V + 0.1 * V[:, ::-1] ** 2, np.random.default_rng(0)
    name = rng.permutation(len(V))
    image = (V * [-1, 1, 1] - [1, 0, 0])[np.argsort(name)], name[F[rng.permutation(len(F)), ::-1]].tolist()
    _, charts = charts_of((V, F.tolist()), image)
    # The same places on both: the middles of faces from the least distance to the mean of a chart on.
    found = []
    for chart in charts:
        middle = chart.vertices[chart.triangles].mean(axis=1)
        order = np.argsort(np.linalg.norm(middle - chart.vertices.mean(axis=0), axis=1))
        hole, rest = order[:filled], np.sort(order[filled:])
        found.append(
            replace(
                chart,
                triangles=chart.triangles[rest],
                faces=chart.faces[rest],
                corners=chart.corners[rest],
                patches=chart.triangles[hole],
            )
        )
    assert _mirror_of_all(charts) is not None
    points = np.concatenate([chart.vertices for chart in found])
    np.testing.assert_allclose(points[_mirror_of_all(found).image], points * [-1, 1, 1] - [1, 0, 0], atol=1e-9)
