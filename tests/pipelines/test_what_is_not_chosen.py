"""Polygons that are not chosen change nothing, however broken they are, and whatever stands before the chosen ones."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.arranging.actions import rectify_islands, stack_islands
from omt_uv.pipelines.distortion import measure_readings, worst_faces
from omt_uv.pipelines.globe import GlobeJob, Markers, project
from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.magnify import Region, magnify
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.refine import refine_islands
from omt_uv.pipelines.texel_density import Texels, texel_density, with_texel_density
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import GlobeSettings, MagnifySettings, RefineSettings, Settings
from omt_uv.solver.analysis.density import Target
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.progress import drain

# A polygon with a vertex used twice, two on the same vertices, three at one edge, one without area, and a sound one.
BROKEN = [[0, 1, 0, 2], [1, 2, 3], [1, 2, 3], [3, 4, 5], [3, 4, 6], [4, 3, 7], [8, 8, 9], [5, 6, 7, 8]]


def body(closed):
    """Positions, polygons, and UVs (n,2) without folds."""
    if closed:
        V, F = meshes.icosphere(1)
        V = V * [1.0, 0.8, 1.3]
        return V, F.tolist(), V[:, :2]
    V, Q = meshes.quad_grid(5, 4)
    x, y = V[:, 0], V[:, 1]
    lifted = np.column_stack([x, y, 0.3 * np.sin(4 * x) * y])
    return lifted, [list(q) for q in Q], np.column_stack([0.1 + 0.5 * x + 0.1 * y * y, 0.2 + 0.4 * y**1.4])


def read(closed, broken):
    """The reading of a body, with what is not chosen before it, weights (n,) of its vertices and a density (m,)."""
    V, polygons, uv = body(closed)
    weights = np.exp(-4 * ((V - V.mean(axis=0) - [0.2, 0.1, 0]) ** 2).sum(axis=1))
    first = 10 if broken else 0
    if broken:
        rng = np.random.default_rng(0)
        V = np.concatenate([3 + 40 * rng.random((10, 3)), V])
        uv = np.concatenate([5 * rng.random((10, 2)), uv])
        weights = np.concatenate([rng.random(10), weights])
        polygons = BROKEN + [[v + first for v in polygon] for polygon in polygons]
    surface = meshes.polygon_surface(V, polygons)
    faces = np.arange(len(polygons)) >= (len(BROKEN) if broken else 0)
    pinned = np.zeros(len(surface.corner_vertex), bool)
    # What is not chosen is pinned, too, and of the rest one vertex.
    pinned[~np.repeat(faces, np.diff(surface.face_start))] = True
    reading = Reading(surface, faces, uv[surface.corner_vertex].astype(np.float32), pinned)
    chosen = faces[surface.triangle_face]
    density = np.full(len(surface.triangles), 7.0)
    density[chosen] = 1 + np.arange(chosen.sum()) % 3
    return reading, weights, density, first


def unwrapped(reading, weights, density, first, seams="existing"):
    job = UnwrapJob(reading.surface, reading.faces, reading.pins, weights, Target(density), uv=reading.uv)
    found = drain(lay_out([job], Settings(quality="draft", seams=seams)))
    return found.corners[0], found.uv[0], [m.report() for m in found.maps], found.warnings


def cut_unwrapped(*given):
    return unwrapped(*given, seams="auto")


def projected(reading, weights, density, first):
    markers = Markers(*(np.eye(len(weights))[first + k] for k in (0, 5, 9)))
    found = drain(project([GlobeJob(reading.surface, reading.faces, density, markers)],
                          GlobeSettings(projection="lambert", quality="draft")))  # fmt: skip
    return found.corners[0], found.uv[0], [g.report() for g in found.globes[0]], found.warnings


def magnified(reading, weights, density, first):
    pins = reading.all_pins
    region = Region(reading.surface, reading.faces, weights, CornerPins(np.zeros(len(pins.uv), bool), pins.uv))
    found = drain(magnify([region], MagnifySettings(quality="draft", factor=1.3, source="uv", boundary="own")))
    return found.corners[0], found.uv[0], found.shares, found.warnings


def magnified_anew(reading, weights, density, first):
    region = Region(reading.surface, reading.faces, weights)
    found = drain(magnify([region], MagnifySettings(quality="draft", factor=1.3, source="mesh", boundary="free")))
    return found.corners[0], found.uv[0], found.shares, found.warnings


def refined(reading, weights, density, first):
    found = drain(refine_islands([(reading.surface, reading.faces, reading.pins or reading.all_pins)],
                                 RefineSettings(quality="draft")))  # fmt: skip
    return found.corners[0], found.uv[0], found.reports, found.warnings


def scaled(reading, weights, density, first):
    texels = Texels(512, 0.5)
    ((corners, uv),) = with_texel_density([reading], 300.0, texels, False)
    return corners, uv, texel_density([reading], texels), ()


def stacked(reading, weights, density, first):
    found = stack_islands([reading], True)
    return found.corners[0], found.uv[0], found.changed, found.warnings


def rectified(reading, weights, density, first):
    found = rectify_islands([reading])
    return found.corners[0], found.uv[0], found.changed, found.warnings


def measured(reading, weights, density, first):
    (worst,) = worst_faces([reading], "SHEAR", 0.2)
    # The first corner of each names the polygon.
    return reading.surface.face_start[worst], np.zeros(0), vars(measure_readings([reading], overlap=False)), ()


def plain(thing):
    """Numbers of reports, whatever holds them, as one flat array."""
    if isinstance(thing, dict):
        return np.concatenate([[0.0], *(plain(v) for k, v in thing.items() if k != "seconds")])
    if isinstance(thing, list | tuple):
        return np.concatenate([[float(len(thing))], *map(plain, thing)])
    if isinstance(thing, bool | int | float | np.number | np.ndarray):
        return np.atleast_1d(np.asarray(thing, float)).ravel()
    return plain(vars(thing)) if hasattr(thing, "__dict__") else np.zeros(1)


@pytest.mark.parametrize(
    ("closed", "action"),
    [(False, unwrapped), (True, cut_unwrapped), (True, projected), (False, magnified), (False, magnified_anew),
     (False, refined), (False, scaled), (False, stacked), (False, rectified), (False, measured)],
)  # fmt: skip
def test_what_is_not_chosen_changes_nothing(closed, action):
    alone, with_more = read(closed, False), read(closed, True)
    corners, uv, figures, said = action(*alone)
    more_corners, more_uv, more_figures, more_said = action(*with_more)
    before = int(with_more[0].surface.face_start[len(BROKEN)])
    assert len(corners) and np.array_equal(np.asarray(more_corners) - before, corners)
    assert np.allclose(more_uv, uv, rtol=0, atol=1e-6)
    assert list(more_said) == list(said)
    assert np.allclose(plain(more_figures), plain(figures), rtol=1e-6, atol=1e-9)
