"""Where flat maps would be distorted most."""

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.cutting.protrusions import log_scale, spread


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
