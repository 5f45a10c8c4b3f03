"""UVs of a cage that are right on the subdivided surface."""

from __future__ import annotations

import numpy as np

from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.subdivision.cage_refinement import refine_cage, subdivided_elements
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
