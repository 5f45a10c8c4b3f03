"""What the modifier makes of a surface and of its UVs: equal where nothing is cut, straight where it keeps straight."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.subdivision.modifier import SubdivisionModifier, subdivided_surface, subdivided_uv

LINEAR = np.array([[0.6, -0.1], [0.2, 0.7], [-0.3, 0.4]])


def box() -> Surface:
    """A cube, closed."""
    V = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    return meshes.polygon_surface(
        V, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )


def uncut(surface: Surface, modifier: SubdivisionModifier, levels: int = 2):
    """The subdivision of UVs that share the vertices of a surface."""
    ids = np.arange(len(surface.positions))
    return subdivided_uv(surface.corner_vertex, surface.face_start, ids, modifier, levels)


@pytest.mark.parametrize("limit", [False, True])
@pytest.mark.parametrize("mode", ["SMOOTH_ALL", "PRESERVE_BOUNDARIES", "PRESERVE_CORNERS"])
def test_uvs_without_a_boundary_follow_their_surface(mode, limit):
    surface, modifier = box(), SubdivisionModifier(2, uv_smooth=mode, limit=limit)
    mapped, fine = uncut(surface, modifier), subdivided_surface(surface, modifier, 10**6)
    uv = (mapped.matrix @ (surface.positions @ LINEAR))[mapped.quads]
    assert np.allclose(uv, fine.corners @ LINEAR)


def test_creases_of_the_surface_are_those_of_its_uvs():
    surface, ends = box(), np.array([[0, 1], [1, 3], [3, 2], [2, 0]])
    sharp = np.where(np.arange(8) == 5, 2.0, 0.0)
    modifier = SubdivisionModifier(2, "SMOOTH_ALL", ends=ends, sharpness=np.full(4, 3.0), corner_sharpness=sharp)
    mapped, fine = uncut(surface, modifier), subdivided_surface(surface, modifier, 10**6)
    assert abs(mapped.matrix - fine.subdivision.matrix).max() < 1e-12
    smooth = subdivided_surface(surface, SubdivisionModifier(2), 10**6)
    assert abs(fine.corners - smooth.corners).max() > 0.1


@pytest.mark.parametrize("seed", range(4))
def test_creases_have_their_sharpness_in_whatever_order_they_come(seed):
    """And whichever of their ends comes first."""
    rng, surface = np.random.default_rng(seed), box()
    ends = np.array([[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [1, 5]])
    sharpness = np.array([0.3, 0.7, 1.2, 1.9, 2.4, 3.0])
    order = rng.permutation(len(ends))
    turned = np.where(rng.random(len(ends))[:, None] < 0.5, ends[order, ::-1], ends[order])
    plain = SubdivisionModifier(2, "SMOOTH_ALL", ends=ends, sharpness=sharpness)
    other = SubdivisionModifier(2, "SMOOTH_ALL", ends=turned, sharpness=sharpness[order])
    for one, two in ((uncut(surface, plain), uncut(surface, other)),
                     (subdivided_surface(surface, plain, 10**6).subdivision, uncut(surface, other))):  # fmt: skip
        assert abs(one.matrix - two.matrix).max() < 1e-12


@pytest.mark.parametrize(("mode", "straight"), [("PRESERVE_BOUNDARIES", True), ("SMOOTH_ALL", False)])
def test_islands_keep_their_outline_where_the_modifier_says_so(mode, straight):
    # Every polygon is an island: four corners of its own.
    surface = box()
    ids = surface.corner_vertex
    mapped = subdivided_uv(np.arange(24), surface.face_start, ids, SubdivisionModifier(2, mode), 2)
    square = np.tile([[0.0, 0], [1, 0], [1, 1], [0, 1]], (6, 1))
    points = (mapped.matrix @ square)[mapped.quads]
    x, y = points[..., 0], points[..., 1]
    area = 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)
    assert np.allclose(area, 1 / 16) == straight
    assert np.allclose(np.bincount(mapped.polygon, area), 1) == straight


@pytest.mark.parametrize("modifier", [SubdivisionModifier(2, "NONE"), SubdivisionModifier(2, simple=True)])
def test_uvs_without_smoothing_are_bilinear(modifier):
    mapped = uncut(box(), modifier)
    weights = mapped.matrix.toarray()
    assert weights.min() >= 0 and ((weights > 0).sum(axis=1) <= 4).all()


@pytest.mark.parametrize(("most", "levels"), [(10**6, 3), (6 * 4**2, 2), (6 * 4, 1), (1, 1)])
def test_there_are_fewer_levels_where_quads_would_be_too_many(most, levels):
    fine = subdivided_surface(box(), SubdivisionModifier(3), most)
    assert fine.levels == levels
    assert len(fine.corners) == 6 * 4**levels


def test_areas_of_polygons_add_up_to_the_surface():
    fine = subdivided_surface(box(), SubdivisionModifier(3, simple=True), 10**6)
    assert np.allclose(fine.polygon_areas(6), 4)
