"""Small parts, such as the eyes of a head, may shear more before they are slit."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.options import LENIENCE, SMALL_PART, SMALL_PARTS, ShearBound, UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain

BOUND = 1.3
# The hemisphere shears that much where it is whole.
WHOLE = (BOUND, BOUND**LENIENCE)


def parts(shares, other=meshes.grid):
    """A surface of a large flat grid and hemispheres with such shares of its area, beside one another."""
    V, F = other(12, 12) if other is meshes.grid else other()
    rest = face_areas(V, F).sum() / (1 - sum(shares))
    positions, triangles = [V], [F]
    for k, share in enumerate(shares):
        dome, faces = meshes.hemisphere(8, 24)
        dome = dome * np.sqrt(share * rest / face_areas(dome, faces).sum()) + [3.0 * (k + 1), 0, 0]
        triangles.append(faces + sum(len(each) for each in positions))
        positions.append(dome)
    return triangle_surface(np.concatenate(positions), np.concatenate(triangles))


def unwrapped(surface, bound=BOUND, **given):
    return drain(unwrap(surface, options=UnwrapOptions(max_shear=bound), **given))


def test_eyes_stay_whole_and_large_domes_are_slit():
    eyes = unwrapped(parts([0.02, 0.02]))
    assert not len(eyes.seams) and not eyes.warnings
    found = distortion(*_of(eyes.charts[1], eyes.maps[1])).angle_mean
    assert WHOLE[0] < found < WHOLE[1] and found == pytest.approx(eyes.maps[1].angle_mean, rel=1e-6)
    for shares in ([0.3], [0.02] * 6):
        domes = unwrapped(parts(shares))
        assert len(domes.seams) and max(one.angle_mean for one in domes.maps) <= BOUND


def test_an_eye_by_itself_is_slit():
    """What is small is small beside all that is unwrapped, not beside what else there is."""
    surface = parts([0.02])
    dome = surface.positions[surface.corner_vertex[surface.triangles]].mean(axis=1)[:, 0] > 1.5
    alone = unwrapped(surface, faces=dome)
    assert len(alone.seams) and max(one.angle_mean for one in alone.maps) <= BOUND


def test_what_small_parts_miss_is_told_as_it_is(monkeypatch):
    """Where nothing more is cut, the warning has the shear that there is, not what it counts as."""
    surface = parts([0.02])
    bound = 1.1
    (text,) = ShearBound(bound).missed(np.array([1.2, 1.0]), np.array([0.02, 0.98]), np.array([False, False]), "why")
    assert "1.2 in the mean, above 1.1" in text
    monkeypatch.setattr("omt_uv.solver.parameterization.shear_bound.MOST_ROUNDS", 1)
    monkeypatch.setattr("omt_uv.solver.parameterization.shear_bound._made_shorter", _as_it_is)
    monkeypatch.setattr("omt_uv.solver.parameterization.shear_search.SPREAD_OF_SHEAR", 1e3)
    told = unwrapped(surface, bound)
    shear = told.maps[1].angle_mean
    assert shear > bound**LENIENCE and f"{shear:.3g} in the mean, above 1.1" in " ".join(told.warnings)


def _as_it_is(search, last, *_):
    yield from ()
    return last


def _of(chart, chart_map):
    return chart.vertices, chart.triangles, chart_map.uv[chart.triangles]


@pytest.mark.parametrize(
    ("shares", "lenient"),
    [
        ([0.02], [True]),
        ([0.5 * SMALL_PART, 0.2], [True, False]),
        ([1.01 * SMALL_PART], [False]),
        ([0.99 * SMALL_PART] * 2, [True, True]),
        ([0.99 * SMALL_PART] * 3, [False] * 3),
        ([(SMALL_PARTS - 1e-6) / 4] * 4, [True] * 4),
    ],
)
def test_which_parts_are_small(shares, lenient):
    surface = parts(shares)
    found = ShearBound(1.35).lenience(surface, None)
    x = surface.positions[surface.corner_vertex[surface.triangles]].mean(axis=1)[:, 0]
    part = np.maximum(np.round(x / 3).astype(int), 0)
    of_part = [np.unique(found[part == k]) for k in range(len(shares) + 1)]
    assert [list(each) for each in of_part] == [[1.0], *([LENIENCE if one else 1.0] for one in lenient)]
    # Neither size, nor place, nor the order of the faces matters.
    order = np.random.default_rng(0).permutation(len(found))
    triangles = surface.corner_vertex[surface.triangles][order]
    moved = triangle_surface(100 * surface.positions + [5, -3, 2], triangles)
    assert (ShearBound(2.0).lenience(moved, None) == found[order]).all()


def test_only_chosen_polygons_count():
    surface = parts([0.02, 0.02])
    x = surface.positions[surface.corner_vertex[surface.triangles]].mean(axis=1)[:, 0]
    found = ShearBound(1.35).lenience(surface, x > 1.5)
    assert (found[x > 1.5] == 1).all()
    assert (ShearBound(1.35).lenience(surface, x < 4.5)[(x > 1.5) & (x < 4.5)] == LENIENCE).all()
