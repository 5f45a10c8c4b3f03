"""Where flat maps would be distorted most."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.cutting.cut_graph import cut_classes, path_to
from omt_uv.solver.cutting.protrusions import disk_spread, first_tips, log_scale, outline_spread, spread
from omt_uv.solver.mesh.geometry import (
    LEAST_STIFFNESS,
    angle_defects,
    angles_from_lengths,
    halfedge_lengths,
    laplacian_from_lengths,
)
from omt_uv.solver.mesh.topology import on_boundary


def uncut(component):
    return np.zeros(len(component.pair), bool)


def test_a_flat_surface_has_no_distortion():
    component = component_of(*meshes.random_disk(height=0.0))
    scale = log_scale(component, uncut(component))
    assert np.abs(scale).max() < 1e-9 and spread(component, scale) < 1e-18


def test_the_tip_of_a_cone_is_where_it_peaks():
    component = component_of(*meshes.cone())
    scale = log_scale(component, uncut(component))
    assert np.argmax(scale) == np.argmax(component.positions[:, 2])
    assert (scale[component.on_boundary()] == 0).all() and scale.min() >= 0


def test_the_scale_does_not_depend_on_the_unit():
    V, F = meshes.head(10)
    one, other = component_of(V, F), component_of(1e3 * V + 5, F)
    scale = log_scale(one, uncut(one))
    np.testing.assert_allclose(log_scale(other, uncut(other)), scale, rtol=1e-6)
    assert spread(one, 2 * scale) == pytest.approx(4 * spread(one, scale))


def test_a_cut_holds_both_of_its_sides_at_zero_and_all_else_as_if_it_were_open():
    """The surface without the cut, its vertices on the cut held, is that which is cut open along it."""
    V, F = meshes.head(12)
    component = component_of(V, F)
    cut = path_to(component, np.flatnonzero(component.on_boundary()), int(np.argmax(component.positions[:, 2])))
    classes, scale = cut_classes(component, cut), log_scale(component, cut)
    opened = np.zeros((int(classes.max()) + 1, 3))
    opened[classes] = component.positions[component.triangles]
    # Not by `component_of`, which numbers vertices by their places: both sides of a cut lie in one.
    length = halfedge_lengths(opened, classes).reshape(-1, 3)
    loop = on_boundary(classes, len(opened))
    curvature = angle_defects(classes, angles_from_lengths(length), np.flatnonzero(loop), len(opened))
    laplacian = laplacian_from_lengths(length, classes, len(opened), LEAST_STIFFNESS).toarray()
    there = np.zeros(len(opened))
    there[~loop] = np.linalg.solve(laplacian[~loop][:, ~loop], curvature[~loop])
    assert cut.sum() > 3 and loop.sum() > component.on_boundary().sum() + cut.sum()
    np.testing.assert_allclose(scale[component.triangles], np.abs(there)[classes], atol=1e-9)


def test_the_spread_of_a_constant_is_its_square():
    component = component_of(*meshes.bumpy())
    assert spread(component, np.full(component.vertex_count, 3.0)) == pytest.approx(9)
    assert spread(replace(component, positions=0 * component.positions), np.full(component.vertex_count, 3.0)) == 0


def test_round_surfaces_fill_a_disk_and_long_ones_are_distorted():
    """A strip is turned at its ends alone, a circle everywhere."""
    rings, sectors = np.divmod(np.arange(12 * 48), 48)
    turn, radius = 2 * np.pi * sectors / 48, (rings + 1) / 12
    V = np.concatenate([[[0, 0, 0]], np.column_stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn])])
    here, after = 1 + np.arange(48), 1 + np.roll(np.arange(48), -1)
    around = np.concatenate([np.column_stack([here + k, after + k, after + k - 48]) for k in range(48, 12 * 48, 48)])
    inner = np.concatenate([np.column_stack([here + k, after + k - 48, here + k - 48]) for k in range(48, 12 * 48, 48)])
    F = np.concatenate([np.column_stack([0 * here, here, after]), around, inner])
    far = []
    for stretch in (1.0, 2.0, 6.0):
        component = component_of(V * [stretch, 1, 1], F)
        far.append(outline_spread(component, uncut(component)))
    assert far[0] < 1e-6 < far[1] < far[2]


def test_a_hemisphere_spreads_a_disk_as_its_stereographic_projection_does():
    """Its scale is 1 / (1 + cos) of the angle from the pole, and the cosine is uniform over the area."""
    n = 40
    i, k = np.divmod(np.arange(n * 6 * n), 6 * n)
    polar, turn = np.pi / 2 * (i + 1) / n, 2 * np.pi * k / (6 * n)
    V = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    after = (k + 1) % (6 * n)
    here, there, up = 1 + i * 6 * n + k, 1 + i * 6 * n + after, 1 + (i - 1) * 6 * n
    top = np.column_stack([0 * k, here, there])[i == 0]
    one = np.column_stack([up + k, here, there])[i > 0]
    other = np.column_stack([up + k, there, up + after])[i > 0]
    component = component_of(np.vstack([[0, 0, 1], V]), np.concatenate([top, one, other]))
    mean, square = 2 * np.log(2) - 1, 2 * np.log(2) ** 2 - 4 * np.log(2) + 2
    assert disk_spread(component, uncut(component)) == pytest.approx(square - mean**2, rel=0.01)


@pytest.mark.parametrize("count, sides", [(0, True), (1, False), (2, False)])
def test_a_first_cut_has_a_third_tip_where_two_are_joined_by_an_edge(count, sides):
    V, F = meshes.icosphere(count) if count else (np.array([[0, 0, 0], [1, 0, 0], [0, 1.2, 0], [0, 0, 3.0]]),
                                                  np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))  # fmt: skip
    component = component_of(V * [1.0, 1.3, 0.8], F)
    tips = first_tips(component)
    edges = {frozenset(edge) for edge in component.ends.tolist()}
    assert (frozenset(tips[:2].tolist()) in edges) == sides == (len(tips) == 3)
    assert len(set(tips.tolist())) == len(tips)
