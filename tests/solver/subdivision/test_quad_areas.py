"""Areas of quads: halves add up to them, and flat ones have what the shoelace formula says."""

from __future__ import annotations

import numpy as np

from omt_uv.solver.subdivision.quad_areas import half_areas, quad_areas


def test_flat_quads_have_the_area_of_the_shoelace_formula():
    rng = np.random.default_rng(3)
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    flat = square + rng.uniform(-0.2, 0.2, (20, 4, 2))
    x, y = flat[..., 0], flat[..., 1]
    shoelace = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corners = np.pad(flat, ((0, 0), (0, 0), (0, 1))) @ turn
    assert np.allclose(quad_areas(corners), shoelace)


def test_halves_are_the_triangles_of_the_first_corners():
    quad = np.random.default_rng(4).normal(size=(1, 4, 3))
    a, b, c, d = quad[0]
    one, other = (0.5 * np.linalg.norm(np.cross(p - a, q - a)) for p, q in ((b, c), (c, d)))
    assert np.allclose(half_areas(quad), [one, other])
    assert np.allclose(quad_areas(quad), [one + other])
