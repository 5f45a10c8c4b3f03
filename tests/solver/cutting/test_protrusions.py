"""Where flat maps would be distorted most."""

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.cutting.protrusions import log_scale, outline_spread, spread


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


def test_the_spread_of_a_constant_is_its_square():
    component = component_of(*meshes.bumpy())
    assert spread(component, np.full(component.vertex_count, 3.0)) == pytest.approx(9)


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
