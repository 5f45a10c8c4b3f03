"""What decides where a gluing is cut: curvature by component, and seams that were marked."""

import meshes
import numpy as np

from omt_uv.solver.cutting.gluing_facts import (
    TurningLines,
    cost_factors,
    marked_triangles,
    total_curvature,
    turning_lines,
)
from omt_uv.solver.mesh.gluing import components, corner_classes
from omt_uv.solver.mesh.surface import strict_gluing, triangle_surface


def glued(V, F, seams=()):
    surface = triangle_surface(V, F, seams)
    return surface, strict_gluing(surface)


def test_curvature_of_a_sphere_is_that_of_gauss_and_bonnet_and_of_a_plane_none():
    (V, F), (W, G) = meshes.icosphere(2), meshes.grid(4, 4)
    surface, gluing = glued(np.concatenate([V, W * [1, 1, 0] + 5]), np.concatenate([F, G + len(V)]))
    curvature = total_curvature(gluing, corner_classes(gluing), components(gluing), surface.positions)
    assert np.allclose(np.sort(curvature), [0, 4 * np.pi])


def test_a_marked_boundary_is_no_marked_seam():
    V, F = meshes.grid(4, 4)
    inner, outer = np.array([[6, 7]]), np.array([[0, 1]])
    assert len(marked_triangles(*glued(V, F, outer))) == 0
    beside = F[marked_triangles(*glued(V, F, inner))]
    assert len(beside) == 2 and (np.isin(beside, inner).sum(axis=1) == 2).all()


def test_what_is_wound_alike_has_no_lines_where_it_turns():
    surface, gluing = glued(*meshes.icosphere(1))
    none = turning_lines(gluing, components(gluing), np.zeros(len(gluing.triangles), dtype=bool))
    assert not none.any() and (cost_factors(surface, gluing) == 1).all()


def test_every_component_has_a_curvature_those_without_inner_vertices_none():
    (V, F), (W, G) = meshes.icosphere(1), meshes.grid(1, 1)
    for parts in ([(V, F), (W, G)], [(W, G), (V, F)], [(W, G), (W, G)]):
        starts = np.cumsum([0, *(len(v) for v, _ in parts)])
        points = np.concatenate([v + 9.0 * k for k, (v, _) in enumerate(parts)])
        surface, gluing = glued(points, np.concatenate([f + s for (_, f), s in zip(parts, starts, strict=False)]))
        found = total_curvature(gluing, corner_classes(gluing), components(gluing), surface.positions)
        np.testing.assert_allclose(found, [4 * np.pi if v is V else 0 for v, _ in parts], atol=1e-9)


def test_turning_lines_have_their_lengths_and_open_their_components_alone():
    (V, F), (W, G) = meshes.grid(3, 3), meshes.icosphere(0)
    P = np.concatenate([V, 3 * W + 9])
    surface, gluing = glued(P, np.concatenate([F, G + len(V)]))
    component = components(gluing)
    lines = np.arange(len(gluing.first)) % 4 == 0
    found = TurningLines.of(gluing, lines, component, surface.positions)
    np.testing.assert_array_equal(found.opened, [True, True])
    corner = surface.corner_vertex[surface.triangles]
    h = gluing.first[lines]
    ends = surface.positions[corner[h // 3, h % 3]], surface.positions[corner[h // 3, (h + 1) % 3]]
    length = np.bincount(component[h // 3], np.linalg.norm(ends[0] - ends[1], axis=1), 2)
    np.testing.assert_allclose(found.length, length)
    one = TurningLines.of(gluing, lines & (component[gluing.first // 3] == 1), component, surface.positions)
    np.testing.assert_array_equal(one.opened, [False, True])
    np.testing.assert_allclose(one.length, [0, length[1]])
