"""Yamabe flow: the cone angles that were prescribed, and nothing where they are there already."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal.intrinsic_triangulation import euclidean_diagonal, from_mesh, make_delaunay
from omt_uv.solver.conformal.yamabe_flow import yamabe_flow
from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.mesh.geometry import angles_from_lengths
from omt_uv.solver.progress import drain


@pytest.fixture
def sphere():
    V, F = meshes.icosphere(2)
    V = V * [1, 2, 0.7]
    return make_delaunay(from_mesh(V, F), euclidean_diagonal)[0], len(V)


def angle_sums(triangulation, length, n):
    return np.bincount(triangulation.triangles[:, [2, 0, 1]].ravel(), angles_from_lengths(length).ravel(), n)


def test_the_angles_become_those_asked_for(sphere):
    tri, n = sphere
    cone_angle = np.full(n, 2 * np.pi)
    cone_angle[:4] = np.pi  # Gauss-Bonnet: four cones of pi
    flow = drain(yamabe_flow(tri, np.arange(n), cone_angle))
    np.testing.assert_allclose(angle_sums(flow.triangulation, flow.length, n), cone_angle, atol=1e-9)
    assert flow.residual <= 1e-10
    np.testing.assert_allclose(flow.length.ravel(), np.exp(flow.triangulation.scaled(flow.log_scale)))


def test_angles_that_are_there_need_no_step(sphere):
    tri, n = sphere
    length = np.exp(tri.log_length).reshape(-1, 3)
    flow = drain(yamabe_flow(tri, np.arange(n), angle_sums(tri, length, n)))
    assert flow.iterations == flow.flips == 0 and not flow.log_scale.any()


def test_an_error_that_is_allowed_to_the_last_bit_needs_no_step(sphere):
    tri, n = sphere
    even = np.full(n, 2 * np.pi * (1 - 2 / n))
    error = drain(yamabe_flow(tri, np.arange(n), even, tolerance=99.0)).residual
    assert error > 0
    for tolerance, steps in ((error, False), (0.999 * error, True)):
        assert bool(drain(yamabe_flow(tri, np.arange(n), even, tolerance=tolerance)).iterations) == steps


def test_a_common_scale_changes_nothing(sphere):
    tri, n = sphere
    even = np.full(n, 2 * np.pi * (1 - 2 / n))
    plain = drain(yamabe_flow(tri, np.arange(n), even))
    larger = type(tri)(tri.triangles, tri.twin, tri.log_length + 1.5)
    np.testing.assert_allclose(drain(yamabe_flow(larger, np.arange(n), even)).log_scale, plain.log_scale, atol=1e-9)
    assert plain.log_scale.mean() == pytest.approx(0, abs=1e-12)


def test_angles_that_no_metric_has_are_an_error(sphere):
    tri, n = sphere
    cone_angle = np.full(n, 2 * np.pi * (1 - 2 / n))
    cone_angle[0], cone_angle[1:] = -0.5, cone_angle[1:] + (cone_angle[0] + 0.5) / (n - 1)
    with pytest.raises(PrecisionError, match="The conformal map leaves double precision"):
        drain(yamabe_flow(tri, np.arange(n), cone_angle))
