"""A surface seen in a plane is found by its places up to rounding, in every unit and order, and no other is."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.arranging.congruence import TOLERANCE, mirrored_match


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e5])
@pytest.mark.parametrize("seed", range(3))
def test_the_image_in_a_plane_is_found_with_the_vertex_of_each(unit, seed):
    rng = np.random.default_rng(seed)
    V, F = meshes.bumpy(6, 5)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    at = float(rng.normal())
    new = rng.permutation(len(V))
    other = np.empty_like(V)
    other[new] = V - 2 * (V @ normal - at)[:, None] * normal
    extent = np.ptp(V, axis=0).max()
    for share, found in ((0.0, True), (0.9, True), (1.5, False)):
        off = np.zeros_like(V)
        off[new[3]] = share * TOLERANCE * extent * normal
        match = mirrored_match(unit * V, F, unit * (other + off), new[F][:, ::-1], normal, unit * at)
        assert (match is not None) == found
        if found:
            np.testing.assert_array_equal(match, new)
    assert mirrored_match(unit * V, F, unit * other, new[F][:, ::-1], normal, unit * (at + 0.1)) is None
    assert (
        mirrored_match(V, F, other[:-1], F, normal, at) is None
        and mirrored_match(V, F, other, F[1:], normal, at) is None
    )
    assert mirrored_match(V[:0], F[:0], V[:0], F[:0], normal, at) is None
