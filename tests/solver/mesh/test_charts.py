"""Charts: cut along seams, mapped back to corners, and refused with the place of the fault."""

import meshes
import numpy as np
import pytest

from omt_uv.solver import errors
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops


def surface(V, F, seams=()):
    return triangle_surface(V, F, seams)


def rejected(kind, V, F, seams=()):
    """The error of a surface that must be refused; its input must stay as it was."""
    V, F = np.array(V, dtype=float), np.array(F)
    before = V.copy(), F.copy()
    with pytest.raises(errors.MeshError) as caught:
        strict_charts(surface(V, F, seams))
    assert type(caught.value) is kind
    assert caught.value.cause and caught.value.remedy and caught.value.remedy in str(caught.value)
    np.testing.assert_array_equal(V, before[0])
    np.testing.assert_array_equal(F, before[1])
    return caught.value


def test_chart_maps_back_to_the_surface():
    V, F = meshes.bumpy(6, 6)
    mesh = surface(V, F)
    (chart,) = strict_charts(mesh)
    assert sorted(chart.corners.ravel()) == list(range(3 * len(F)))
    np.testing.assert_array_equal(mesh.corner_vertex[chart.corners], chart.vertex_ids[chart.triangles])
    np.testing.assert_array_equal(chart.vertices, V[chart.vertex_ids])


def test_a_seam_across_makes_two_charts_and_one_that_ends_inside_none():
    V, F = meshes.grid(6, 6)
    middle = np.flatnonzero(np.isclose(V[:, 0], 0.5))
    middle = middle[np.argsort(V[middle, 1])]
    seams = np.column_stack([middle[:-1], middle[1:]])
    charts = strict_charts(surface(V, F, seams))
    assert len(charts) == 2 and sum(len(c.triangles) for c in charts) == len(F)
    assert sum(len(c.vertices) for c in charts) == len(V) + len(middle)
    (slit,) = strict_charts(surface(V, F, seams[:3]))
    # Of a slit of three edges that starts on the boundary, three vertices are cut in two and its inner end is not.
    assert len(slit.vertices) == len(V) + 3
    assert len(boundary_loops(slit.triangles)[0]) == 24 + 6


def test_a_cube_cut_to_a_cross_is_one_disk():
    V, F = meshes.cube()
    tree = [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (0, 4), (2, 6)]
    (chart,) = strict_charts(surface(V, F, tree))
    assert len(boundary_loops(chart.triangles)) == 1 and len(chart.vertices) == 14


def test_bow_tie_vertices_are_split_for_the_map():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0.0]])
    charts = strict_charts(surface(V, [[0, 1, 2], [0, 3, 4]]))
    assert len(charts) == 2
    assert [c.vertex_ids.tolist() for c in charts] == [[0, 1, 2], [0, 3, 4]]


def test_quads_are_one_face_each():
    V, polygons = meshes.quad_grid(3, 3)
    (chart,) = strict_charts(meshes.polygon_surface(V, polygons))
    assert len(chart.triangles) == 18 and len(np.unique(chart.faces)) == 9


def test_diagonals_of_polygons_are_no_edges():
    """A triangle on the diagonal of a quad is no third face at an edge: the quad has no edge there."""
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]])
    charts = strict_charts(meshes.polygon_surface(V, [[0, 1, 2, 3], [0, 2, 4]]))
    assert [len(c.triangles) for c in charts] == [2, 1]


def test_part_of_the_faces():
    V, F = meshes.grid(6, 6)
    faces = (V[F][:, :, 0] < 0.51).all(axis=1)
    (chart,) = strict_charts(surface(V, F), faces)
    assert set(chart.faces) == set(np.flatnonzero(faces))
    # What is wrong elsewhere is none of this chart's business.
    V[-1] = np.nan
    assert len(strict_charts(surface(V, F), faces)) == 1


def test_empty_and_not_finite():
    V, F = meshes.bumpy(4, 4)
    rejected(errors.EmptyMeshError, V, np.zeros((0, 3), int))
    V[7] = np.nan
    V[9] = np.inf
    assert rejected(errors.NonFiniteError, V, F).elements.tolist() == [7, 9]


def test_zero_area_and_duplicate_faces():
    V, F = meshes.bumpy(4, 4)
    flat = np.vstack([V, V[F[5, 0]]])
    F2 = np.vstack([F, [[F[5, 0], F[5, 1], len(V)]]])
    assert rejected(errors.ZeroAreaFaceError, flat, F2).elements.tolist() == [len(F)]
    assert rejected(errors.DuplicateFaceError, V, np.vstack([F, F[3, [1, 2, 0]]])).elements.tolist() == [3, len(F)]


def test_non_manifold_edges_unless_they_are_seams():
    V = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1.0]])
    F = [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    assert np.sort(rejected(errors.NonManifoldEdgeError, V, F).elements).tolist() == [[0, 1]]
    assert len(strict_charts(surface(V, F, [(0, 1)]))) == 3


def test_orientation():
    V, F = meshes.quad_patch()
    assert np.sort(rejected(errors.OrientationError, V, [F[0], F[1][::-1]]).elements).tolist() == [[0, 2]]


NO_DISKS = [
    ("icosphere", errors.NotADiskError, "closed sphere"),
    ("torus", errors.NotADiskError, "genus 1"),
    ("annulus", errors.SeveralBoundariesError, "2 boundaries"),
]


@pytest.mark.parametrize("shape, kind, words", NO_DISKS)
def test_what_is_no_disk(shape, kind, words):
    V, F = getattr(meshes, shape)()
    error = rejected(kind, V, F)
    assert words in error.cause and len(error.elements)


def test_a_handle_with_a_boundary():
    V, F = meshes.torus()
    assert "handle" in rejected(errors.NotADiskError, V, F[1:]).cause


def test_error_message_names_place_and_remedy():
    error = errors.ZeroAreaFaceError("Faces have no area", kind="face", elements=[4])
    assert str(error).startswith("Faces have no area (1 face: 4). Dissolve")
    error = errors.NonFiniteError("Bad", kind="vertex", elements=range(9))
    assert "(9 vertices: 0, 1, 2, 3, 4, ...)" in str(error)


@pytest.mark.parametrize("scale, shift", [(1e-6, 0), (1e6, 0), (1, 1e5)])
def test_units_do_not_matter(scale, shift):
    V, F = meshes.head(12)
    (chart,) = strict_charts(surface(V * scale + shift, F))
    assert len(chart.triangles) == len(F)
