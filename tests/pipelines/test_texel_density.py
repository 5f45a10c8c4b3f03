"""Pixels per metre: known for squares, and set where they shall be something else."""

import meshes
import numpy as np
import pytest
from readings import reading, together

from omt_uv.pipelines.texel_density import Texels, beyond_tile, texel_density, with_texel_density
from omt_uv.solver.errors import EmptyMeshError, ZeroAreaFaceError

TEXELS = Texels(1024)


def two_squares():
    """Squares of one metre, with a quarter of a metre and with half of one as the side in UV."""
    V, F = together(meshes.grid(2, 2), meshes.grid(2, 2))
    uv = V[:, :2] * np.repeat([0.25, 0.5], 9)[:, None] + np.repeat([0.0, 0.5], 9)[:, None]
    return V, F, uv


@pytest.mark.parametrize("tile", [(0, 0), (3, 1), (-1, 2)])
@pytest.mark.parametrize(
    "side, far", [((0.3, 0), 0.3), ((-0.3, 0), 0.3), ((0, 0.2), 0.2), ((0, -0.2), 0.2), ((0, 0), 0)]
)
def test_what_reaches_beyond_its_tile_is_told_on_every_side(tile, side, far):
    uv = np.array([[0.0, 0.0], [1.0, 1.0], [0.5, 0.5]])
    uv = np.concatenate([uv, [[0.5, 0.5] + 1.0 * np.array(side) + 0.5 * np.sign(side)]]) + tile
    assert beyond_tile(uv) == pytest.approx(far)
    # The tile is that of the middle of what is covered, wherever most corners are.
    for end in (uv.min(axis=0), uv.max(axis=0)):
        assert beyond_tile(np.concatenate([uv, np.tile(end, (50, 1))])) == pytest.approx(far)


def test_a_unit_square_has_the_pixels_of_the_texture_in_every_unit():
    V, F = meshes.grid(3, 3)
    assert texel_density([reading(V, F, V[:, :2])], TEXELS) == pytest.approx(1024, rel=1e-6)
    assert texel_density([reading(V, F, V[:, :2])], Texels(1024, 0.01)) == pytest.approx(102400, rel=1e-6)


@pytest.mark.parametrize("scale", [0.25, 8.0])
def test_it_goes_with_the_uvs_and_against_the_surface(scale):
    V, F, uv = two_squares()
    before = texel_density([reading(V, F, uv)], TEXELS)
    assert texel_density([reading(scale * V, F, uv)], TEXELS) == before / scale
    assert texel_density([reading(V, F, scale * uv)], TEXELS) == before * scale


@pytest.mark.parametrize("each_island", [True, False])
def test_what_was_set_is_what_is_measured(each_island):
    V, F, uv = two_squares()
    other = reading(*meshes.bumpy(4, 4), uv=meshes.bumpy(4, 4)[0][:, :2])
    readings = [reading(V, F, uv), other]
    scaled = with_texel_density(readings, 300.0, TEXELS, each_island)
    after = []
    for old, (corners, new) in zip(readings, scaled, strict=True):
        assert np.array_equal(corners, np.arange(len(old.uv)))
        after.append(reading(old.surface.positions, old.surface.corner_vertex.reshape(-1, 3), new))
    assert texel_density(after, TEXELS) == pytest.approx(300, rel=1e-5)
    first, second = (np.arange(len(F)) < 8), (np.arange(len(F)) >= 8)
    halves = [texel_density([reading(V, F, after[0].uv, part)], TEXELS) for part in (first, second)]
    # Islands alike, or as different as they were.
    assert halves[1] / halves[0] == pytest.approx(1 if each_island else 2, rel=1e-5)


def test_islands_stay_where_their_middle_is_and_keep_it_without_area():
    V, F, uv = two_squares()
    uv[9:] = 0.7
    ((_, new),) = with_texel_density([reading(V, F, uv)], 2048.0, TEXELS, True)
    assert np.array_equal(new[24:], uv[F.ravel()[24:]].astype(np.float32).astype(float))
    assert (new[:24].min(axis=0) + new[:24].max(axis=0)) / 2 == pytest.approx([0.125, 0.125])


def test_all_together_grow_about_the_middle_of_what_they_cover():
    """However many vertices lie on one side of it."""
    V, F, uv = two_squares()
    uv = uv + 0.4 * uv**2
    fine = meshes.grid(9, 9)
    readings = [reading(V, F, uv), reading(*fine, uv=0.1 * fine[0][:, :2] + [0.6, 0.1])]

    def box(corners):
        return np.array([np.min(corners, axis=0), np.max(corners, axis=0)])

    before = box(np.concatenate([r.uv for r in readings]))
    for target in (100.0, 700.0):
        after = box(np.concatenate([new for _, new in with_texel_density(readings, target, TEXELS, False)]))
        assert after.mean(axis=0) == pytest.approx(before.mean(axis=0), abs=1e-6)
        assert np.ptp(after, axis=0) / np.ptp(before, axis=0) == pytest.approx(target / texel_density(readings, TEXELS))


def test_nothing_to_measure_is_an_error():
    V, F, uv = two_squares()
    for wrong in (reading(V, F), reading(V, F, uv, np.zeros(len(F), bool))):
        with pytest.raises(EmptyMeshError, match="There are no"):
            texel_density([wrong], TEXELS)
    with pytest.raises(ZeroAreaFaceError, match="The faces have no area in space, or none in"):
        texel_density([reading(V, F, 0 * uv)], TEXELS)


@pytest.mark.parametrize("flat", ["space", "texture"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_islands_without_an_area_stay_as_they_are_beside_others(flat, place):
    """Of three islands one is a line, in space or in the texture."""
    parts = [meshes.grid(2, 2) for _ in range(3)]
    V, F = together(*parts)
    uv = V[:, :2] * 0.2 + np.repeat([[0.0, 0.0], [0.4, 0.3], [0.1, 0.7]], 9, axis=0)
    mine = slice(9 * place, 9 * place + 9)
    if flat == "space":
        V = V.copy()
        V[mine, 1] = 0.0
    else:
        uv[mine, 1] = uv[mine, 1].mean()
    given = reading(V, F, uv)
    ((corners, found),) = with_texel_density([given], 100.0, TEXELS, True)
    assert len(corners) == len(found) == F.size
    before, vertex = given.uv[corners].astype(float), given.surface.corner_vertex[corners]
    here = (vertex >= mine.start) & (vertex < mine.stop)
    np.testing.assert_allclose(found[here], before[here], atol=1e-12)
    grown = np.ptp(found[~here & (vertex < 9 * (3 if place < 2 else 1))], axis=0) / np.ptp(
        before[~here & (vertex < 9 * (3 if place < 2 else 1))], axis=0
    )
    assert np.isfinite(found).all() and not np.allclose(grown, 1)
