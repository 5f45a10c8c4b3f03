"""UVs of a cage that are right on the subdivided surface."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.maps.contacts import crossings
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.subdivision.cage_refinement import refine_cage, subdivided_elements
from omt_uv.solver.subdivision.cage_symmetry import CageChart, cage_symmetry
from omt_uv.solver.subdivision.catmull_clark import cage_of, straight_boundary, subdivide

HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def bump(k: int = 6):
    corner = np.arange((k + 1) * k).reshape(k, k + 1)[:, :-1].ravel()
    quads = np.column_stack([corner, corner + 1, corner + k + 2, corner + k + 1])
    y, x = np.divmod(np.arange((k + 1) ** 2), k + 1)
    uv = np.column_stack([x, y]) / k
    cage = cage_of(quads.ravel(), np.arange(0, 4 * len(quads) + 1, 4), len(uv))
    height = 0.5 * np.exp(-8 * ((uv - 0.5) ** 2).sum(axis=1))
    return cage, quads, uv, np.column_stack([uv, height])


def refined(uv, fixed, cage, quads, positions):
    surface, mapping = subdivide(cage, 2), subdivide(straight_boundary(cage), 2)
    corners = (surface.matrix @ positions)[surface.quads]
    triangles = quads[:, HALVES].reshape(-1, 3)
    scale = np.ones(len(corners) + len(triangles))
    elements = subdivided_elements(corners, mapping.quads, positions[triangles], triangles, scale)
    found = drain(refine_cage(elements, mapping.matrix, uv, fixed, 20.0))
    every = mapping.quads[:, HALVES].reshape(-1, 3)
    space = face_areas(corners[:, HALVES].reshape(-1, 3), np.arange(3 * len(every)).reshape(-1, 3))
    return found, space, signed_areas(mapping.matrix @ found.uv, every)


def error(space, plane):
    return np.abs(plane / plane.sum() - space / space.sum()).sum()


def test_areas_of_the_subdivided_surface_come_out_and_nothing_folds():
    cage, quads, uv, positions = bump()
    found, space, plane = refined(uv, np.zeros(len(uv), bool), cage, quads, positions)
    assert found.folds == 0 and (plane > 0).all()
    assert error(space, plane) < 0.03


def test_a_folded_start_unfolds():
    cage, quads, uv, positions = bump()
    tangled = uv.copy()
    tangled[24] += [0.25, 0.1]
    found, space, plane = refined(tangled, np.zeros(len(uv), bool), cage, quads, positions)
    assert (plane > 0).all() and error(space, plane) < 0.03


def test_fixed_vertices_stay():
    cage, quads, uv, positions = bump()
    fixed = (uv == 0).any(axis=1) | (uv == 1).any(axis=1)
    found, _, plane = refined(uv, fixed, cage, quads, positions)
    assert (found.uv[fixed] == uv[fixed]).all() and (plane > 0).all()
    assert not np.allclose(found.uv[~fixed], uv[~fixed])


def elements_of(cage, quads, positions, mapping):
    corners = (subdivide(cage, 2).matrix @ positions)[mapping.quads]
    triangles = quads[:, HALVES].reshape(-1, 3)
    scale = np.ones(len(corners) + len(triangles))
    return subdivided_elements(corners, mapping.quads, positions[triangles], triangles, scale)


def test_a_symmetric_map_stays_symmetric_in_both_its_mirrors():
    cage, quads, uv, positions = bump()
    chart = CageChart(positions, quads[:, HALVES].reshape(-1, 3), np.repeat(np.arange(len(quads)), 2), np.ones(len(uv)))
    symmetry, w = cage_symmetry([chart], uv @ [1, 1j], {})
    assert len(np.unique(symmetry.representative)) < 0.4 * len(uv)
    mapping = subdivide(straight_boundary(cage), 2)
    start = np.column_stack([w.real, w.imag])
    none = np.zeros(len(uv), bool)
    elements = elements_of(cage, quads, positions, mapping)
    found = drain(refine_cage(elements, mapping.matrix, start, none, 1000.0, symmetry)).uv
    assert not np.allclose(found, start, atol=1e-3)
    upside_down = np.arange(49).reshape(7, 7)[::-1].ravel()
    assert np.abs(found[upside_down] * [1, -1] - found).max() < 1e-12


def test_a_chart_that_is_the_image_of_another_follows_it():
    _, quads, uv, positions = bump()
    triangles, faces = quads[:, HALVES].reshape(-1, 3), np.repeat(np.arange(len(quads)), 2)
    rough = positions + 0.02 * np.random.default_rng(0).random(positions.shape)
    charts = [CageChart(p, triangles, faces, np.ones(len(uv))) for p in (rough, rough * [-1, 1, 1])]
    w = uv @ [1, 1j]
    symmetry, centred = cage_symmetry(charts, np.concatenate([w, 5 - w.conj()]), {1: (0, np.arange(len(uv)))})
    change = symmetry.unknowns(np.zeros(2 * len(uv), bool)) @ np.arange(2.0 * len(uv))
    assert symmetry.follows.sum() == len(uv)
    assert np.allclose(centred[len(uv) :], -centred[: len(uv)].conj())
    moved = change.view(complex)
    assert np.allclose(moved[len(uv) :], -moved[: len(uv)].conj())


def with_slit(gap):
    """The elements, the matrix, the map and the outline of a wavy surface with a slit whose sides lie `gap` apart in
    the map: they would pass through each other."""
    columns, rows = 8, 4
    vertex = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    corner = np.stack([vertex[:-1, :-1], vertex[:-1, 1:], vertex[1:, 1:], vertex[1:, :-1]], axis=2)
    y, x = np.divmod(np.arange(vertex.size), columns + 1)
    count = vertex.size + columns // 2
    copy = vertex.copy()
    copy[rows // 2, : columns // 2] = np.arange(vertex.size, count)
    upper = corner[rows // 2 :].copy()
    upper[0, :, 0], upper[0, :, 1] = copy[rows // 2, :-1], copy[rows // 2, 1:]
    quads = np.concatenate([corner[: rows // 2], upper]).reshape(-1, 4)
    uv = np.column_stack([x, y]).astype(float)
    positions = np.column_stack([uv, 0.6 * np.sin(uv[:, 0]) * np.cos(2 * uv[:, 1])])
    positions = np.concatenate([positions, positions[vertex[rows // 2, : columns // 2]]])
    uv = np.concatenate([uv, uv[vertex[rows // 2, : columns // 2]] + [0, gap]])
    cage = cage_of(quads.ravel(), np.arange(0, 4 * len(quads) + 1, 4), count)
    mapping = subdivide(straight_boundary(cage), 2)
    loop = boundary_loops(quads[:, HALVES].reshape(-1, 3))[0]
    return elements_of(cage, quads, positions, mapping), mapping.matrix, uv, loop


def test_an_outline_does_not_come_to_cross_itself():
    elements, matrix, uv, loop = with_slit(0.02)
    none = np.zeros(len(uv), bool)
    free = drain(refine_cage(elements, matrix, uv, none, 1000.0)).uv
    kept = drain(refine_cage(elements, matrix, uv, none, 1000.0, None, [loop])).uv
    assert len(crossings(free @ [1, 1j], loop)) and not len(crossings(kept @ [1, 1j], loop))


def test_a_slit_whose_sides_lie_on_one_another_holds_nothing_up():
    elements, matrix, uv, loop = with_slit(0.0)
    none = np.zeros(len(uv), bool)
    found = drain(refine_cage(elements, matrix, uv, none, 1000.0, None, [loop])).uv
    apart = drain(refine_cage(*with_slit(0.02)[:3], none, 1000.0, None, [loop])).uv
    assert not len(crossings(found @ [1, 1j], loop))

    def off(uv):
        quads = elements.faces.triangles[: 4 * len(elements.quads)]
        return error(elements.faces.area[: len(quads)], signed_areas(np.concatenate([matrix @ uv, uv]), quads))

    assert off(found) < 1.1 * off(apart) < 0.6 * off(uv)


@pytest.mark.parametrize("turn", [0.3, 1.1, 2.0])
def test_two_quads_that_share_two_sides_on_the_axis_do_not_stop_the_others(turn):
    # Both are straight in their common corner, vertex 3, in any symmetric map.
    positions = np.array([[0, 1.2, 0], [-1, 0, 0.2], [0, -1, 0], [0, 0.3, -0.4], [1, 0, 0.2]])
    quads = np.array([[1, 2, 3, 0], [3, 2, 4, 0]])
    quads = np.concatenate([quads, [[1, 5, 6, 2], [2, 6, 7, 4]]])
    positions = np.concatenate([positions, [[-1.2, -1.5, 0], [0, -2, 0.3], [1.2, -1.5, 0]]])
    cage = cage_of(quads.ravel(), np.arange(0, 17, 4), len(positions))
    triangles = quads[:, HALVES].reshape(-1, 3)
    chart = CageChart(positions, triangles, np.repeat(np.arange(4), 2), np.ones(len(positions)))
    symmetry, w = cage_symmetry([chart], np.exp(1j * turn) * (positions[:, 0] + 0.8j * positions[:, 1]), {})
    assert symmetry.on_axis.sum() == 4
    mapping, none = subdivide(straight_boundary(cage), 2), np.zeros(len(positions), bool)
    elements = elements_of(cage, quads, positions, mapping)
    uv, offs = np.column_stack([w.real, w.imag]), []
    space = face_areas(
        positions=(subdivide(cage, 2).matrix @ positions), triangles=mapping.quads[:, HALVES].reshape(-1, 3)
    )
    for weight in (1.0, 10.0, 1000.0):
        found = drain(refine_cage(elements, mapping.matrix, uv, none, weight, symmetry))
        uv = found.uv
        plane = signed_areas(mapping.matrix @ uv, mapping.quads[:, HALVES].reshape(-1, 3))
        assert found.iterations > 0 and found.folds == 0 and plane.min() > 0
        offs.append(error(space, plane))
    assert offs[2] < 0.98 * offs[1] < 0.98 * offs[0]
