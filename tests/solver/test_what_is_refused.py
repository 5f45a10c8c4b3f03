"""What functions of the solver refuse that nothing else comes upon: by its class, by its words, and with its place.

Each stands beside what is as near to it as can be and is not refused.
"""

from __future__ import annotations

from collections.abc import Callable

import meshes
import numpy as np
import pytest

from omt_uv.solver import errors
from omt_uv.solver.analysis.density import graded_density
from omt_uv.solver.analysis.joint_density import joint_density
from omt_uv.solver.analysis.region_density import target_density
from omt_uv.solver.analysis.vertex_scores import vertex_score
from omt_uv.solver.arranging.quad_grid import rectangle
from omt_uv.solver.canonical.markers import ChartMarkers
from omt_uv.solver.conformal import punctured_sphere
from omt_uv.solver.conformal.disk_map import conformal_rectangle
from omt_uv.solver.conformal.intrinsic_triangulation import from_mesh
from omt_uv.solver.cutting.disk_charts import DiskCharts
from omt_uv.solver.editing.magnify import magnify_map, refuse_folds
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.initial_maps import rectangle_initial_map, square_initial_map
from omt_uv.solver.registration.register import register
from omt_uv.solver.registration.results import RegistrationOptions
from omt_uv.solver.remeshing.initial.sphere_samples import sample_sphere
from omt_uv.solver.remeshing.remesh_surface import _checked_density
from omt_uv.solver.signatures.marked import _outlined
from omt_uv.solver.sphere.sphere_map import sphere_map
from omt_uv.solver.transport.semidiscrete import transport
from omt_uv.solver.transport.spherical_power_diagram import by_hull
from omt_uv.solver.volumes.body_map import volume_map

V, F = meshes.grid(4, 4)
FLAT = V[:, :2]
BALL, ROUND = meshes.icosphere(1)
TORUS, AROUND = meshes.torus(12, 6)
ONES, HALF = np.ones(len(F)), np.arange(len(F)) / len(F)
# A third of the area that a region has none of.
NOWHERE = (np.where(np.arange(len(F)) < 4, 1.0, 0.0), np.where(np.arange(len(F)) < 4, 0.0, 1.0))
LOOP = boundary_loops(F)[0]
CORNERS = LOOP[[0, 4, 8, 12]]


def without(k: int, a: np.ndarray) -> np.ndarray:
    """A copy whose row k is no number."""
    a = np.array(a, float)
    a[k] = np.nan
    return a


def drained(make: Callable) -> Callable:
    """A call of a generator that is run to its end."""
    return lambda *a, **k: drain(make(*a, **k))


def book(pages: int) -> tuple[np.ndarray, np.ndarray]:
    """Quads that turn around a vertex, four of them a grid."""
    turn = 2 * np.pi * np.arange(2 * pages) / (2 * pages)
    points = np.concatenate([[[0, 0, 0.0]], np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])])
    k = 2 * np.arange(pages)
    return points, np.column_stack([0 * k, 1 + k, 2 + k, 1 + (k + 2) % (2 * pages)])


def gridded(pages: int):
    points, quads = book(pages)
    return rectangle(points, quads, np.ones(pages))


def rectangular(corners: np.ndarray):
    return drain(conformal_rectangle(V, F, corners))


def sampled(degenerate: bool):
    """A sphere sampled in its own image, and joined in one where all lies in one place."""
    to = BALL * np.where(degenerate, [1e-9, 1e-9, 1], 1)
    return sample_sphere(BALL, ROUND, BALL, to / np.linalg.norm(to, axis=1, keepdims=True), 60)


def marked(points, faces, centre: int, start: int):
    return _outlined(points, faces, centre, start)


def two_grids():
    return np.concatenate([V, V + 9, [[50.0, 0, 0]]]), np.concatenate([F, F + len(V)])


def on_handles():
    """A torus with a hole, the vertices of one face."""
    return TORUS, AROUND[1:]


M, E = meshes, errors
# What is called, how it is refused, how it is not, the class of the error, its words, and its elements.
REFUSED = {
    "growth": (lambda x: graded_density(ONES, V, F, x, 50), 0.0, 0.5, E.DensityError, "grow by 0.0", ()),
    "growth below": (lambda x: graded_density(ONES, V, F, x, 50), -1.0, 1e-3, E.DensityError, "positive", ()),
    "no area": (lambda x: joint_density(np.array([NOWHERE[0]]), x, [1.5]), NOWHERE[1], ONES, E.EmptyRegionError,
                "no area", ()),
    "no area of one": (lambda x: target_density(NOWHERE[0], x, 1.5, True), NOWHERE[1], ONES, E.EmptyRegionError,
                       "no area", ()),
    "all of it": (lambda x: target_density(NOWHERE[0], ONES, x, True), 8.1, 7.0, E.ShareError, "for the rest", ()),
    "too soft": (lambda x: target_density(HALF / 2 + 0.25, ONES, x, True), 1.7, 1.2, E.SoftRegionError, "weights", ()),
    "contrast": (lambda x: target_density(NOWHERE[0], ONES, x, False), 1.1e6, 9e5, E.ShareError, "would vary", ()),
    "score": (lambda x: vertex_score(x, V, F), "weight", "saliency", ValueError, "kind must be one of", ()),
    "score of nothing": (lambda x: vertex_score("saliency", V, x), F[:0], F, E.EmptyMeshError, "no faces", ()),
    "quads in a circle": (gridded, 5, 4, E.GridError, "rows and columns", ()),
    "centre": (lambda x: ChartMarkers(centre=x).in_disk(np.array([[1.0, 0], [0, 1], [-1, 0], [0.1, 0]]), np.arange(3)),
               1, 3, E.LandmarkError, "boundary", (1,)),
    "corners in turn": (rectangular, CORNERS[[0, 2, 1, 3]], CORNERS, ValueError, "counter-clockwise", ()),
    "corner inside": (rectangular, np.append(CORNERS[:3], 12), np.roll(CORNERS, 2), ValueError, "boundary", ()),
    "corners twice": (rectangular, CORNERS[[0, 1, 1, 3]], CORNERS[[1, 2, 3, 0]], ValueError, "four different", ()),
    "outline": (drained(lambda x: magnify_map(FLAT, F, ONES, boundary=x, quality="draft")), "other", "own", ValueError,
                "boundary must be", ()),
    "UVs": (lambda x: refuse_folds(x, F), without(7, FLAT), FLAT, E.FoldedUVError, "finite",
            np.flatnonzero((F == 7).any(axis=1))),
    "folds": (lambda x: refuse_folds(FLAT, x), np.concatenate([F[:5], F[5:6, ::-1]]), F, E.FoldedUVError, "fold", (5,)),
    "balance": (drained(lambda x: refine_island(V, F, FLAT, balance=x, quality="draft")), -0.01, 0.0, ValueError,
                "balance", ()),
    "balance above": (drained(lambda x: refine_island(V, F, FLAT, balance=x, quality="draft")), 1.01, 1.0, ValueError,
                      "balance", ()),
    "aspect": (lambda x: UnwrapOptions(aspect=x), -1e-9, 0.0, ValueError, "aspect", ()),
    "long aspect": (lambda x: UnwrapOptions(aspect=x), np.inf, 3.0, ValueError, "aspect", ()),
    "unwrap balance": (lambda x: UnwrapOptions(balance=x), 1.01, 1.0, ValueError, "balance", ()),
    "shear": (lambda x: UnwrapOptions(max_shear=x), 1.0, 1.01, ValueError, "less than 1", ()),
    "seams": (lambda x: UnwrapOptions(seams=x), "some", "existing", ValueError, "seams", ()),
    "match balance": (lambda x: RegistrationOptions(balance=x), -0.1, 0.0, ValueError, "balance", ()),
    "closeness": (lambda x: RegistrationOptions(closeness=x), 0.0, 1e-3, ValueError, "closeness", ()),
    "domain": (lambda x: RegistrationOptions(domain=x), "plane", "disk", ValueError, "domain", ()),
    "charts": (drained(lambda x: register((V, F), (V, F), options=RegistrationOptions(domain=x))), "charts", "disk",
               ValueError, "a match of their own", ()),
    "density": (lambda x: _checked_density(x, len(F)), ONES[1:], ONES, ValueError, "one value for each", ()),
    "density of rows": (lambda x: _checked_density(x, len(F)), ONES[:, None], None, ValueError, "the shape", ()),
    "samples": (sampled, True, False, E.PrecisionError, "too close together", ()),
    "marked handles": (lambda x: marked(*x), (*on_handles(), 40, AROUND[0, 0]), (V, F, 12, 0), E.NotADiskError,
                       "handles", ()),
    "marked nothing": (lambda x: marked(*two_grids(), x, 0), 50, 12, E.LandmarkError, "on no face", (50,)),
    "marked elsewhere": (lambda x: marked(*two_grids(), 12, x), 30, 0, E.LandmarkError, "another part", (30,)),
    "marked boundary": (lambda x: marked(V, F, x, 1), 0, 12, E.LandmarkError, "on the boundary", (0,)),
    "method": (drained(lambda x: sphere_map(BALL, ROUND, method=x)), "other", "newton", ValueError, "method", ()),
    "sites in a plane": (lambda x: by_hull(x, np.zeros(len(x))), BALL * [1, 1, 0], BALL, E.TransportError, "plane", ()),
    "half a sphere": (lambda x: by_hull(x, np.zeros(len(x))), BALL[BALL[:, 2] > 0.1], BALL, E.TransportError,
                      "half of the sphere", ()),
    "body": (drained(lambda x: volume_map(BALL, ROUND, domain=x, count=50)), "disk", None, ValueError, "domain", ()),
    "body's method": (drained(lambda x: volume_map(BALL, ROUND, method=x, count=50)), "other", None, ValueError,
                      "method one of", ()),
    "square": (lambda x: square_initial_map(V, F, FLAT * x, LOOP), [1, 0], [1, 1], E.FoldedUVError, "no area", ()),
    "rectangle": (lambda x: rectangle_initial_map(V, F, FLAT * x, LOOP), [0, 1], [2, 1], E.FoldedUVError, "area", ()),
    "three corners": (lambda x: square_initial_map(x[0], x[1], x[0][:, :2], boundary_loops(x[1])[0]),
                      M.single_triangle(), (V, F), E.FoldedUVError, "four boundary vertices", ()),
    "cuts": (lambda x: DiskCharts([], x, ()).found_cuts, None, "cuts", ValueError, "no cuts", ()),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_is_named_and_placed_and_what_is_beside_it_goes(name):
    call, bad, good, kind, words, elements = REFUSED[name]
    with pytest.raises(kind, match=words) as caught:
        call(bad)
    assert caught.type is kind
    if kind is not ValueError:
        np.testing.assert_array_equal(np.sort(np.ravel(caught.value.elements)), np.sort(elements))
        assert str(caught.value).endswith(".")
    if good is not None or name == "density of rows":
        call(good)


def test_sites_that_are_nowhere_are_named(monkeypatch):
    sites = np.random.default_rng(0).random((20, 2))
    with pytest.raises(errors.TransportError, match="finite place") as caught:
        drain(transport(without(7, sites), np.ones(20), None))
    assert caught.value.elements.tolist() == [7]


def test_a_triangulation_that_does_not_settle_is_told(monkeypatch):
    tri = from_mesh(BALL, ROUND)
    assert drain(punctured_sphere.flatten_punctured_sphere(tri, 0)).residual < 1e-9
    monkeypatch.setattr(punctured_sphere, "flip_until_none", lambda *_: (0, False))
    with pytest.raises(errors.PrecisionError, match="does not settle"):
        drain(punctured_sphere.flatten_punctured_sphere(tri, 0))
