"""Cells have their masses on any surface in few steps, sites keep apart, and cutting along cells loses nothing."""

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver import errors
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.partition import spacing
from omt_uv.solver.partition.cells import geodesic_cells
from omt_uv.solver.partition.cut_mesh import cut_along_cells
from omt_uv.solver.partition.division import DivisionOptions, divide
from omt_uv.solver.partition.face_labels import _joined, follow_faces
from omt_uv.solver.partition.polar_coordinates import WindowMesh, polar_coordinates
from omt_uv.solver.partition.relaxation import sights
from omt_uv.solver.partition.sites import Sites, allot, parts
from omt_uv.solver.partition.spacing import site_distances
from omt_uv.solver.progress import drain


def two_parts():
    V, F = meshes.icosphere(2)
    W, G = meshes.grid(6, 6)
    return np.concatenate([V, W + [3, 0, 0]]), np.concatenate([F, G + len(V)])


def thin():
    """A rod much thinner than its cells."""
    V, F = meshes.icosphere(2)
    return V * [2.0, 0.2, 0.2], F


SURFACES = {
    "square of two triangles": (meshes.quad_patch, 40),
    "plane": (lambda: meshes.grid(20, 20), 30),
    "sphere": (lambda: meshes.icosphere(4), 60),
    "torus": (meshes.torus, 50),
    "two parts": (two_parts, 20),
    "rod": (thin, 12),
    "one cell": (lambda: meshes.icosphere(2), 1),
}


def found(name, **options):
    make, count = SURFACES[name]
    V, F = make()
    return V, F, drain(divide(V, F, count, options=DivisionOptions(**options)))


@pytest.mark.parametrize("name", SURFACES)
def test_every_cell_has_its_area_and_the_cut_mesh_is_the_surface(name):
    V, F, division = found(name, relax=3)
    area = face_areas(V, F)
    assert np.abs(division.cells.area / division.asked - 1).max() < 1e-4 and division.iterations <= 20
    assert np.isclose(division.cells.area.sum(), area.sum())
    mesh = cut_along_cells(V, F, division)
    assert not len(mesh.torn())
    a, b = mesh.corner_vertex, np.roll(mesh.corner_vertex, -1)
    b[mesh.face_start[1:] - 1] = mesh.corner_vertex[mesh.face_start[:-1]]
    edges, uses = np.unique(np.sort(np.stack([a, b], axis=1), axis=1), axis=0, return_counts=True)
    # The same surface: no edge of three faces, and Euler's number and boundary as before.
    own, own_uses = np.unique(np.sort(F[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True)
    assert uses.max() == 2 and (uses == 1).any() == (own_uses == 1).any()
    assert len(mesh.positions) - len(edges) + len(mesh.cell) == len(np.unique(F)) - len(own) + len(F)
    assert np.isclose(lengths(mesh.positions, edges[uses == 1]), lengths(V, own[own_uses == 1]))
    size = np.diff(mesh.face_start)
    first = np.repeat(mesh.face_start[:-1], size - 2)
    step = np.arange(len(first)) - np.repeat(np.cumsum(size - 2) - (size - 2), size - 2)
    fans = mesh.corner_vertex[np.stack([first, first + step + 1, first + step + 2], axis=1)]
    of_cell = np.bincount(np.repeat(mesh.cell, size - 2), face_areas(mesh.positions, fans))
    assert np.allclose(of_cell, division.asked, rtol=2e-4)


# Corners of a further triangle that is a line or a point, of those of the first one.
LINES = {"one edge there and back": (0, 1, 0), "two corners in one": (1, 1, 2), "a point": (2, 2, 2)}


@pytest.mark.parametrize("line", LINES)
@pytest.mark.parametrize("name", ["plane", "rod", "one cell"])
def test_triangles_without_area_stay_out_of_the_cut_mesh(name, line):
    make, count = SURFACES[name]
    V, F = make()
    first = len(F) // 2
    G = np.concatenate([F[:first], F[:1, list(LINES[line])], F[first:]])
    mesh = cut_along_cells(V, G, drain(divide(V, G, count)))
    size, corners = np.diff(mesh.face_start), mesh.face_start[-1]
    assert (
        size.min() >= 3 and first not in mesh.triangle and set(np.unique(mesh.triangle)) == {*range(len(G))} - {first}
    )
    assert {len(mesh.corner_vertex), len(mesh.barycentric), len(mesh.halfedge)} == {corners}
    # Every corner lies where its triangle and its barycentric coordinates say.
    of = G[np.repeat(mesh.triangle, size)]
    np.testing.assert_allclose(
        mesh.positions[mesh.corner_vertex], np.einsum("kc,kcd->kd", mesh.barycentric, V[of]), atol=1e-9
    )


def lengths(positions, edges):
    return np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1).sum()


@pytest.mark.parametrize("name", ["plane", "sphere", "torus", "rod"])
def test_relaxed_sites_keep_apart(name):
    V, F, division = found(name, relax=6)
    distance = site_distances(WindowMesh(V, F), division)
    assert distance.min() > 0.75 * distance.mean()


def test_sites_see_one_another_as_far_as_they_are():
    V, F, division = found("sphere", relax=1)
    i, j, _, distance = sights(WindowMesh(V, F), division.sites, division.pairs)
    x = division.sites.positions(V, F)
    x /= np.linalg.norm(x, axis=1)[:, None]
    assert np.allclose(distance, np.arccos((x[i] * x[j]).sum(axis=1)), rtol=0.05)


def test_density_gives_more_cells_where_it_is_greater():
    V, F = meshes.grid(30, 30)
    right = V[F][:, :, 0].mean(axis=1) > 0.5
    density = np.where(right, 9.0, 1.0)
    division = drain(divide(V, F, 100, density))
    share = (division.sites.positions(V, F)[:, 0] > 0.5).mean()
    assert abs(share - 0.9) < 0.03 and division.residual < 1e-4
    assert np.isclose(division.asked.sum(), 5.0)


def test_parts_get_whole_cells():
    V, F, division = found("two parts", relax=2)
    part = parts(F, len(V))
    area = np.bincount(part, face_areas(V, F))
    count = np.bincount(part[division.sites.triangle])
    assert count.sum() == 20 and count.min() >= 1
    expected = area / area.max() * count.max()
    assert np.abs(count - expected).max() < 1.5 and 0 < division.unequal < 0.5
    assert allot(np.array([1.0, 1e-9, 1e-9]), 5).tolist() == [3, 1, 1]


def test_whole_faces_hang_together():
    V, F, division = found("sphere", relax=2)
    followed = follow_faces(division, np.arange(len(F)), F.ravel(), 3 * np.arange(len(F) + 1))
    assert set(followed.cell.tolist()) == set(range(60))
    assert not len(followed.torn) and not len(followed.empty)
    assert np.allclose(followed.mass, np.bincount(followed.cell, face_areas(V, F)))
    assert np.abs(followed.mass / division.asked - 1).max() < 0.1


def test_size_and_place_play_no_part():
    V, F = meshes.icosphere(3)
    one, other = (drain(divide(p, F, 25)) for p in (V, 1e6 * V + 1e7))
    assert (one.sites.triangle == other.sites.triangle).mean() > 0.9
    assert np.allclose(one.asked * 1e12, other.asked, rtol=1e-6)


def test_what_cannot_be_divided_is_named():
    V, F = two_parts()
    with pytest.raises(errors.CountError, match="fewer than the 2 separate parts"):
        drain(divide(V, F, 1))
    with pytest.raises(errors.CountError, match="none"):
        drain(divide(V, F, 0))
    with pytest.raises(errors.EmptyMeshError, match="There are no faces to divide"):
        drain(divide(V, F[:0], 3))
    with pytest.raises(errors.EmptyMeshError, match="no area"):
        drain(divide(V * [1, 0, 0], F, 3))
    with pytest.raises(errors.DensityError, match="A density is not positive and finite"):
        drain(divide(V, F, 3, np.zeros(len(F))))
    V[3] = np.nan
    with pytest.raises(errors.NonFiniteError, match="1 vertex: 3"):
        drain(divide(V, F, 3))


def test_ring_by_ring_every_face_gets_the_label_beside_it():
    """All labels spread alike: a numbering turned around gives the same cells."""
    corner_vertex = np.array([[k, k + 1, k + 32, k + 31] for k in range(30)]).ravel()
    label = np.repeat([0, 1, 0, 2, 1, 0], [9, 1, 1, 9, 1, 9])
    mass, start = np.linspace(1, 2, 30), 4 * np.arange(31)
    one = _joined(label, mass, corner_vertex, start)
    # The heaviest piece of each stays, all others went to what they touch, and every cell is one piece.
    assert (one[21:] == 0).all() and (one[11:20] == 2).all() and (np.diff(one) != 0).sum() == len(np.unique(one)) - 1
    for turned in np.array([[2, 0, 1], [1, 2, 0], [1, 0, 2]]):
        assert np.array_equal(turned[one], _joined(turned[label], mass, corner_vertex, start))


@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("count", [3, 12])
def test_pieces_of_slivers_have_no_vertex_twice(height, count):
    """Rows of triangles, every second of them as good as flat: points of their cells are one."""
    V, F = meshes.grid(12, 6)
    row = np.round(V[:, 1] / np.ptp(V[:, 1]) * 6).astype(int)
    V[:, 1] = (row + 1) // 2 + height * (row // 2)
    division = drain(divide(V, F, count, options=DivisionOptions(relax=1)))
    mesh = cut_along_cells(V, F, division)
    size = np.diff(mesh.face_start)
    owner = np.repeat(np.arange(len(size)), size)
    assert size.min() >= 3 and len(np.unique(np.stack([owner, mesh.corner_vertex], axis=1), axis=0)) == size.sum()


def test_no_cell_passes_through_a_single_vertex():
    V, F = meshes.grid(8, 8)
    V = np.concatenate([V, V + [1, 1, 0]])
    corner = int(np.flatnonzero((V[:81] == [1, 1, 0]).all(axis=1))[0])
    F = np.concatenate([F, F + 81])
    again = 81 + int(np.flatnonzero((V[81:] == [1, 1, 0]).all(axis=1))[0])
    F = np.where(again == F, corner, F)
    division = drain(divide(V, F, 6, options=DivisionOptions(relax=2)))
    assert division.asked.tolist() == pytest.approx([1 / 3] * 6) and division.residual < 1e-3
    assert not len(cut_along_cells(V, F, division).torn())
    with pytest.raises(errors.CountError, match="2 separate parts"):
        drain(divide(V, F, 1))


# How fields of a division grow with the unit of length, as a power; sides and sites have no unit.
GROWS = {
    "site_weights": 2, "asked": 2, "residual": 0, "iterations": 0, "steps": 0, "unequal": 0, "cells.area": 2,
    "cells.part": 2, "cells.pair": 0, "cells.side": 0, "cells.conductance": 0, "pairs.site": 0, "pairs.face": 0,
    "pairs.squared": 2, "pairs.log": 1, "pairs.nearest": 2, "pairs.farthest": 2, "pairs.last": 0,
}  # fmt: skip


def test_a_division_is_told_in_the_units_of_the_mesh():
    V, F = two_parts()
    one, other = (drain(divide(unit * V, F, 7, options=DivisionOptions(relax=1))) for unit in (1.0, 8.0))
    fields = {
        f"{owner}.{name}": value for owner in ("cells", "pairs") for name, value in vars(getattr(one, owner)).items()
    }
    fields |= vars(one)
    assert {k for k in fields if k not in ("sites", "cells", "pairs", "cells.polygons")} == set(GROWS)
    for name, power in GROWS.items():
        a, b = one, other
        for part in name.split("."):
            a, b = getattr(a, part), getattr(b, part)
        np.testing.assert_allclose(b, np.asarray(a) * 8.0**power, rtol=1e-9, atol=1e-12, err_msg=name)
    assert one.cells.area.sum() == pytest.approx(face_areas(V, F).sum())
    # The least and the greatest of the squares of the three corners, at most.
    assert (one.pairs.nearest <= one.pairs.squared.min(axis=1) + 1e-9).all()
    assert (one.pairs.farthest >= one.pairs.squared.max(axis=1) - 1e-9).all()


@pytest.mark.parametrize("wide", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("density", [False, True])
def test_sites_of_a_strip_are_one_length_apart_and_cells_have_the_areas_of_the_strip(wide, density):
    """Windows of three radii of a cell reach the next one, however long the cells are; the density plays no part."""
    V, F = meshes.grid(12, 4)
    V = np.column_stack([3 * V[:, 0] / np.ptp(V[:, 0]), wide * V[:, 1] / np.ptp(V[:, 1]), 0 * V[:, 0]])
    mesh, x = WindowMesh(V, F), V[F].mean(axis=1)
    at = [int(np.argmin(np.abs(x - [place, wide / 2, 0]).sum(axis=1))) for place in (0.5, 1.5, 2.5)]
    sites = Sites(np.array(at), np.full((3, 3), 1 / 3))
    pairs = polar_coordinates(mesh, sites, np.full(3, 9.0), np.arange(3))
    mass = mesh.areas * (1 + 5 * density * x[:, 0])
    cells = geodesic_cells(pairs, np.zeros(3), mass)
    division = SimpleNamespace(sites=sites, asked=np.ones(3), pairs=pairs, cells=cells)
    assert spacing._areas(mesh, division).sum() == pytest.approx(3 * wide)
    places = sites.positions(V, F)
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 99 * np.eye(3)
    np.testing.assert_allclose(site_distances(mesh, division), apart.min(axis=1), atol=1e-9)
