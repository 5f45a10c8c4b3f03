"""Islands of UVs that exist."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing.uv_islands import uv_islands
from omt_uv.solver.errors import FoldedUVError, NonFiniteError, NonManifoldEdgeError, ZeroAreaFaceError
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.surface import triangle_surface


def corner_uv(F, uv):
    """UVs (3m,2) of the corners of triangles from those of vertices."""
    return uv[F].reshape(-1, 2)


def bump():
    V, F = meshes.bumpy(12, 12)
    return V, F, V[:, :2].copy()


def torn():
    """A bumpy square whose left and right halves lie apart in the UV map, without a seam on the mesh."""
    V, F, uv = bump()
    corners = corner_uv(F, uv)
    right = V[F].mean(1)[:, 0] > 0.5
    corners[np.repeat(right, 3)] += [2, 0]
    return triangle_surface(V, F), corners, right


def test_islands_follow_the_uvs_and_not_the_seams():
    surface, uv, right = torn()
    islands = uv_islands(surface, uv).islands
    assert sorted(len(i.chart.faces) for i in islands) == [right.sum(), right.sum()]
    for island in islands:
        assert (surface.corner_vertex[island.chart.corners] == island.chart.vertex_ids[island.chart.triangles]).all()
        assert (island.uv[island.chart.triangles] == uv[island.chart.corners]).all()
    seamed = triangle_surface(surface.positions, surface.corner_vertex.reshape(-1, 3), [[0, 13], [13, 14], [14, 1]])
    assert (
        len(uv_islands(seamed, corner_uv(surface.corner_vertex.reshape(-1, 3), surface.positions[:, :2])).islands) == 1
    )


def test_one_face_selects_its_whole_island():
    surface, uv, right = torn()
    faces = np.zeros(len(right), bool)
    faces[np.flatnonzero(right)[5]] = True
    (island,) = uv_islands(surface, uv, faces).islands
    assert (np.sort(island.chart.faces) == np.flatnonzero(right)).all()


def test_three_faces_of_an_island_at_an_edge_are_named():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 0.5, 1]])
    F = np.array([[0, 1, 2], [2, 1, 3], [2, 1, 4]])
    uv = corner_uv(F, np.array([[0, 0], [1, 0], [0, 1], [1, 1], [0.9, 0.9]]))
    with pytest.raises(NonManifoldEdgeError) as info:
        uv_islands(triangle_surface(V, F), uv)
    assert sorted(info.value.elements.ravel()) == [1, 2]


def test_uvs_that_are_nowhere_are_named():
    V, F, uv = bump()
    uv[7] = np.nan
    with pytest.raises(FoldedUVError) as info:
        uv_islands(triangle_surface(V, F), corner_uv(F, uv))
    assert sorted(info.value.elements) == np.flatnonzero((F == 7).any(1)).tolist()


@pytest.mark.parametrize("faces", [None, 0, -1])
def test_vertices_that_are_nowhere_have_their_numbers_on_the_surface(faces):
    """UV vertices have others: of the last vertex there are several before it."""
    surface, corners, _ = torn()
    last = surface.corner_vertex[-1]
    surface.positions[[0, last]] = np.nan
    chosen = None if faces is None else np.arange(len(surface.face_start) - 1) == np.arange(len(corners) // 3)[faces]
    with pytest.raises(NonFiniteError) as caught:
        uv_islands(surface, corners, chosen)
    assert caught.value.elements.tolist() == {None: [0, last], 0: [0], -1: [last]}[faces]


@pytest.mark.parametrize("change", [lambda uv: 1e3 * uv, lambda uv: uv + 1, lambda uv: uv * [-1, 1]])
def test_islands_do_not_depend_on_where_the_uvs_lie(change):
    surface, uv, _ = torn()
    own, other = uv_islands(surface, uv).islands, uv_islands(surface, change(uv)).islands
    for a, b in zip(own, other, strict=True):
        np.testing.assert_array_equal(a.chart.triangles, b.chart.triangles)
        assert abs(signed_areas(b.uv, b.chart.triangles).sum()) > 0


def test_islands_without_any_area_are_left_out_and_said():
    """Letters of a text have such faces: nothing is to be refined of them, and they stop nothing."""
    V, F, uv = bump()
    V = np.concatenate([V, [[2, 0, 0], [3, 0, 0], [4, 0, 0]]])
    surface = triangle_surface(V, np.concatenate([F, len(V) - 3 + np.arange(3)[None]]))
    corners = np.concatenate([corner_uv(F, uv), [[0.5, 2], [0.5, 2.5], [0.5, 3]]])
    found = uv_islands(surface, corners)
    assert len(found.islands) == 1 and len(found.islands[0].chart.faces) == len(F)
    assert [w.split()[0] for w in found.warnings] == ["1"] and "no area" in found.warnings[0]
    faces = np.arange(len(F) + 1) == len(F)
    with pytest.raises(ZeroAreaFaceError, match="No face of the UVs has an area"):
        uv_islands(surface, corners, faces)
