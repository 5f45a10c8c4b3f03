"""Nets of bodies with flat sides."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.cutting import developable_nets
from omt_uv.solver.cutting.cut_graph import cut_classes
from omt_uv.solver.cutting.developable_nets import net
from omt_uv.solver.maps.development import developed
from omt_uv.solver.maps.overlap import overlap_share
from omt_uv.solver.mesh.geometry import angle_defects, angles_from_lengths, halfedge_lengths


def test_a_cube_has_a_net_of_seven_edges():
    component = component_of(*meshes.cube())
    found = net(component)
    assert found.cut.sum() == 7 and found.length == pytest.approx(7) and len(found.tips) == 8
    assert found.up_to(found.most) is found and found.up_to(6.9) is None
    assert replace(found, cut=np.ones(len(component.pair), bool)).up_to(found.most) is None


def test_many_long_slits_are_a_comb():
    found = net(component_of(*meshes.cube()))
    side = np.sqrt(6)
    many = replace(found, tips=np.arange(13))
    assert many.is_comb(7 - 1.01 * side) and not many.is_comb(7 - 0.99 * side)
    assert not replace(found, tips=np.arange(12)).is_comb(0.0)


def test_a_net_leaves_no_curvature_inside():
    V, F = meshes.cube()
    component = component_of(*meshes.subdivide(V * [1, 2, 3], F))
    cut = net(component).cut
    classes = cut_classes(component, cut)
    inner = np.isin(np.arange(component.vertex_count), component.ends[cut], invert=True)
    lengths = halfedge_lengths(component.positions, component.triangles).reshape(-1, 3)
    defects = angle_defects(component.triangles, angles_from_lengths(lengths), np.zeros(0, int), component.vertex_count)
    np.testing.assert_allclose(defects[inner], 0, atol=1e-12)
    assert classes.max() + 1 == component.vertex_count + cut.sum() - 1


@pytest.mark.parametrize("mesh", [meshes.icosphere, meshes.torus, meshes.head])
def test_smooth_bodies_have_none(mesh):
    assert net(component_of(*mesh())) is None


def test_the_net_of_a_cylinder_of_many_sides_opens_both_caps():
    n = 10_000
    turn = 2 * np.pi * np.arange(n) / n
    around = np.column_stack([np.cos(turn), np.sin(turn)])
    V = np.concatenate([np.column_stack([around, 0 * turn + z]) for z in (-1, 1)] + [[[0, 0, -1], [0, 0, 1]]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    sides = [(i, j, n + j), (i, n + j, n + i), (j, i, 2 * n + 0 * i), (n + i, n + j, 2 * n + 1 + 0 * i)]
    found = net(component_of(V, np.concatenate([np.column_stack(side) for side in sides])))
    assert len(found.tips) == 2 * n and found.cut.sum() == 2 * n - 1


def test_the_net_of_a_bracket_does_not_cover_itself():
    outline = np.array([(0, 0), (3, 0), (3, 0.5), (0.5, 0.5), (0.5, 3), (0, 3)])
    V = np.concatenate([np.column_stack([outline, np.full(6, z)]) for z in (0.0, 1.0)])
    caps = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)])
    i, j = np.arange(6), (np.arange(6) + 1) % 6
    sides = [np.column_stack([i, j, j + 6]), np.column_stack([i, j + 6, i + 6])]
    component = component_of(V, np.concatenate([caps[:, ::-1], caps + 6, *sides]))
    found = net(component).spread_out()
    cut, tips = found.cut, found.tips
    classes = cut_classes(component, cut)
    positions = np.zeros((classes.max() + 1, 3))
    positions[classes.ravel()] = component.positions[component.triangles.ravel()]
    flat, gap = developed(positions, classes)
    assert len(tips) == 12 and gap.max() < 1e-9
    assert overlap_share(np.stack([flat.real, flat.imag], axis=1)[classes]) == 0


def test_a_net_whose_outline_does_not_cross_itself_is_not_sampled(monkeypatch):
    """Of a fan of slivers every sample would be compared with all."""
    monkeypatch.setattr(developable_nets, "overlap_exceeds", pytest.fail)
    n = 500
    turn = 2 * np.pi * np.arange(n) / n
    V = np.concatenate([np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]), [[0, 0, 2], [0, 0, 0]]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    cone = component_of(
        V, np.concatenate([np.column_stack(side) for side in ((i, j, n + 0 * i), (j, i, n + 1 + 0 * i))])
    )
    found = net(cone)
    assert found.spread_out() is found
