"""The measure of symmetry that the benchmark of quad meshes has."""

from __future__ import annotations

import meshes
import numpy as np

from benchmarks.parts.polygons import BODIES, corner_uv, mirror_error, ring, terrain
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def test_a_symmetric_map_is_off_by_nothing_and_a_lopsided_one_by_its_stretch():
    surface = terrain(6, lambda x, y: x * x + y)
    uv = surface.positions[surface.corner_vertex][:, :2]
    assert mirror_error(surface, uv) < 1e-12
    lopsided = uv.copy()
    lopsided[uv[:, 0] > 0, 0] *= 1.1
    assert 0.02 < mirror_error(surface, lopsided) < 0.06


def test_what_is_no_mirror_image_has_no_error():
    V, F = meshes.random_disk(60)
    surface = meshes.polygon_surface(V, F.tolist())
    assert np.isnan(mirror_error(surface, V[surface.corner_vertex][:, :2]))


def test_a_ring_has_two_seams_and_a_body_of_quads():
    surface = ring(12, 6)
    assert len(surface.seams) == 12 + 6 and len(surface.face_start) == 12 * 6 + 1
    assert np.ptp(BODIES["cap"]().positions[:, 2]) > 1.7


def test_planes_that_move_the_seams_are_none():
    # The first plane takes the ring's seam to the other side of it, where its map is not cut.
    surface = ring(12, 6)
    assert mirror_error(surface, corner_uv(surface, drain(unwrap(surface)))) < 1e-6
