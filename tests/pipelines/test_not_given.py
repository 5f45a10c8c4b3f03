"""What is not given is what changes nothing: the neutral value of every array that a function can do without."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import meshes
import numpy as np
import pytest
import scipy.sparse as sp
from told_otherwise import body, patch

from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.pipelines.volumes.flow import FlowBody, FlowJob, flow_bodies
from omt_uv.settings import Settings
from omt_uv.solver.analysis.symmetry_plane import symmetry_plane
from omt_uv.solver.analysis.vertex_scores import vertex_score
from omt_uv.solver.contact.box_pairs import box_pairs
from omt_uv.solver.contact.proximity import close_pairs
from omt_uv.solver.contact.self_intersections import intersecting_pairs
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.cutting.disk_charts import cut_to_disks, disk_charts
from omt_uv.solver.editing.magnify import magnify_map, magnify_region
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.editing.uv_islands import uv_islands
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.linalg.kept_factor import by_gradients
from omt_uv.solver.linalg.sparse import solve_spd
from omt_uv.solver.maps.contacts import turns
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.maps.polygon_elements import polygon_elements
from omt_uv.solver.maps.similarity import fit_similarity
from omt_uv.solver.maps.tutte import tutte
from omt_uv.solver.maps.untangle import arc_length_boundary
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas
from omt_uv.solver.mesh.mirror import find_mirror
from omt_uv.solver.mesh.polygon_areas import polygon_areas
from omt_uv.solver.mesh.repair import perturbed
from omt_uv.solver.mesh.surface import degenerate_triangles, strict_gluing, triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.partition.division import divide
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.batch_refine import refine_batch
from omt_uv.solver.refinement.refine import RefinementOptions, refine
from omt_uv.solver.registration.landmarks import no_landmarks, vertex_landmarks
from omt_uv.solver.sphere.sphere_map import sphere_map
from omt_uv.solver.transport.convex_domain import Disk
from omt_uv.solver.transport.semidiscrete import transport


def disk():
    """A curved patch and a mean value map of it."""
    V, F = patch(5)
    F = np.concatenate([F[:, [0, 1, 2]], F[:, [0, 2, 3]]])
    loop = boundary_loops(F)[0]
    return V, F, tutte(V, F, loop, arc_length_boundary(V, loop, 1.0))


def same(a, b, where="it"):
    """Two results are the same in every part, up to rounding."""
    assert type(a) is type(b), where
    if is_dataclass(a):
        for field in fields(a):
            if field.name not in ("seconds", "_found") and field.compare:
                same(getattr(a, field.name), getattr(b, field.name), f"{where}.{field.name}")
    elif isinstance(a, (list, tuple)):
        assert len(a) == len(b), where
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            same(x, y, f"{where}[{k}]")
    elif isinstance(a, np.ndarray):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12, err_msg=where)
    elif isinstance(a, float):
        assert a == pytest.approx(b, rel=1e-9, abs=1e-12), where
    elif isinstance(a, (int, str, bool, type(None))):
        assert a == b, where


V, F, UV = disk()
BODY, FACES = body()
SURFACE = triangle_surface(BODY, FACES, np.zeros((0, 2), np.int64))
DRAFT = UnwrapOptions(quality="draft")
ALL, NONE, EACH = np.ones(len(FACES), bool), np.zeros(len(BODY)), np.arange(len(FACES))
MASS = face_areas(V, F)
SITES = V[:, :2] - V[:, :2].mean(axis=0)
EVEN = np.full(len(SITES), np.pi / len(SITES))
ROWS = np.arange(12.0)
SPD = sp.csc_matrix(np.diag(ROWS + 2) + 0.1)
# Two of them overlap, as those of a mesh do.
BOXES = np.random.default_rng(0).random((40, 3)), np.random.default_rng(0).random((40, 3)) + 0.2
W = np.exp(2j * np.pi * np.arange(9) / 9)


# A handle at the side that moves a little.
SIDE = np.flatnonzero(BODY[:, 0] > 0.8 * BODY[:, 0].max())
PULL = FlowHandle(BODY[SIDE], BODY[SIDE] + [0.05, 0.02, 0], SIDE)


def plain(matrix):
    return lambda r: r / matrix.diagonal()


# Of every function: what it does, with what is not given, or with what changes nothing.
CASES = {
    "cut faces": lambda **k: cut(SURFACE, **k), "cut avoid": lambda **k: cut(SURFACE, **k),
    "cut_to_disks faces": lambda **k: cut_to_disks(SURFACE, **k).charts,
    "disk_charts faces": lambda **k: drain(disk_charts(SURFACE, **k)).charts,
    "disk_charts avoid": lambda **k: drain(disk_charts(SURFACE, **k)).charts,
    "strict_charts faces": lambda **k: strict_charts(triangle_surface(V, F, np.zeros((0, 2), np.int64)), **k),
    "strict_gluing faces": lambda **k: strict_gluing(SURFACE, **k),
    "unwrap faces": lambda **k: [m.uv for m in drain(unwrap(SURFACE, options=DRAFT, **k)).maps],
    "unwrap avoid": lambda **k: [m.uv for m in drain(unwrap(SURFACE, options=DRAFT, **k)).maps],
    "uv_islands faces": lambda **k: uv_islands(triangle_surface(V, F, np.zeros((0, 2), np.int64)),
                                               UV[F].reshape(-1, 2), **k),
    "perturbed faces": lambda **k: perturbed(V, F, 1.0, **k),
    "symmetry_plane faces": lambda **k: symmetry_plane(*meshes.icosphere(2), **k),
    "find_mirror faces": lambda **k: find_mirror(*meshes.icosphere(2), **k),
    "intersecting_pairs concerned": lambda **k: intersecting_pairs(
        np.concatenate([BODY, BODY + [0.7, 0.1, 0.2]]), np.concatenate([FACES, FACES + len(BODY)]), **k),
    "box_pairs concerned": lambda **k: box_pairs(*BOXES, **k),
    "close_pairs moved": lambda **k: close_pairs(BODY, FACES, 0.1, **k),
    "polygon_areas polygons": lambda **k: polygon_areas(V, F, **k),
    "degenerate_triangles owner": lambda **k: degenerate_triangles(V * [1, 1e-9, 1e-9], F, **k),
    "vertex_areas density": lambda **k: vertex_areas(V, F, **k),
    "vertex_score selected": lambda **k: vertex_score("gaussian", BODY, FACES, **k),
    "elements region": lambda **k: elements(V, F, MASS, **k).weight,
    "polygon_elements faces": lambda **k: polygon_elements(V, F, MASS * (1 + V[F][:, 0, 0]), **k),
    "refine target": lambda **k: drain(refine(V, F, UV, **k)),
    "refine polygons": lambda **k: drain(refine(V, F, UV, **k)),
    "refine options": lambda **k: drain(refine(V, F, UV, **k)),
    "refine_island target": lambda **k: drain(refine_island(V, F, UV, **k)),
    "refine_island polygons": lambda **k: drain(refine_island(V, F, UV, **k)),
    "refine_batch density": lambda **k: drain(refine_batch([(V, F)], "standard", 0.0, **k)),
    "refine_batch polygons": lambda **k: drain(refine_batch([(V, F)], "standard", 0.0, **k)),
    "magnify_map polygons": lambda **k: drain(magnify_map(UV, F, 1 + (V[F][:, 0, 0] > 0.6), **k)),
    "magnify_region polygons": lambda **k: drain(magnify_region(UV, F, (V[F][:, 0, 0] > 0.6) * 1.0, 1.5, **k)),
    "divide density": lambda **k: drain(divide(BODY, FACES, 5, **k)),
    "sphere_map density": lambda **k: drain(sphere_map(BODY, FACES, **k)),
    "sphere_map polygons": lambda **k: drain(sphere_map(BODY, FACES, **k)),
    "transport site_weights": lambda **k: drain(transport(SITES * 0.5, EVEN, Disk(), **k)).site_weights,
    "unwrap_job faces": lambda **k: drain(lay_out([UnwrapJob(SURFACE, **k)], Settings(quality="draft"))).uv,
    "unwrap_job avoid": lambda **k: drain(lay_out([UnwrapJob(SURFACE, **k)], Settings(quality="draft"))).uv,
    "unwrap_job uv": lambda **k: drain(lay_out([UnwrapJob(SURFACE, **k)], Settings(quality="draft"))).uv,
    "flow_body stays": lambda **k: drain(flow_bodies(FlowJob((FlowBody("a", BODY, FACES, **k),), ((0, PULL),)))),
    "flow_body polygons": lambda **k: drain(flow_bodies(FlowJob((FlowBody("a", BODY, FACES, **k),), ((0, PULL),)))),
    "fit_similarity mass": lambda **k: fit_similarity(W, W * 2j + 1 + 0.1 * W**2, **k),
    "turns owner": lambda **k: turns(W, np.arange(9), np.roll(np.arange(9), -1), **k),
    "solve_spd order": lambda **k: solve_spd(SPD, ROWS, **k),
    "by_gradients guess": lambda **k: by_gradients(SPD, ROWS, plain(SPD), 50, **k),
}  # fmt: skip
NEUTRAL = {
    "cut_to_disks faces": ALL, "cut faces": ALL, "disk_charts faces": ALL, "strict_gluing faces": ALL,
    "unwrap faces": ALL, "strict_charts faces": np.ones(len(F), bool), "uv_islands faces": np.ones(len(F), bool),
    "perturbed faces": np.arange(len(F)), "symmetry_plane faces": np.arange(len(meshes.icosphere(2)[1])),
    "find_mirror faces": np.arange(len(meshes.icosphere(2)[1])), "cut avoid": NONE, "disk_charts avoid": NONE,
    "unwrap avoid": NONE, "intersecting_pairs concerned": np.ones(2 * len(FACES), bool),
    "box_pairs concerned": np.ones(40, bool), "close_pairs moved": np.ones(len(BODY), bool),
    "polygon_areas polygons": np.arange(len(F)), "degenerate_triangles owner": np.zeros(len(F), np.int64),
    "vertex_areas density": np.ones(len(F)), "vertex_score selected": np.ones(len(BODY), bool),
    "elements region": np.zeros(len(F)), "polygon_elements faces": np.arange(len(F)), "refine target": MASS,
    "refine polygons": np.arange(len(F)), "refine options": RefinementOptions(),
    "refine_island target": np.ones(len(F)),
    "refine_island polygons": np.arange(len(F)), "refine_batch density": np.ones(len(F)),
    "refine_batch polygons": [np.arange(len(F))], "magnify_map polygons": np.arange(len(F)),
    "magnify_region polygons": np.arange(len(F)), "divide density": np.ones(len(FACES)),
    "sphere_map density": np.ones(len(FACES)), "sphere_map polygons": EACH,
    "transport site_weights": np.zeros(len(SITES)), "fit_similarity mass": np.ones(9),
    "unwrap_job faces": ALL, "unwrap_job avoid": NONE, "unwrap_job uv": np.zeros((3 * len(FACES), 2)),
    "flow_body stays": NONE > 0, "flow_body polygons": EACH,
    "turns owner": np.zeros(9, np.int64), "solve_spd order": np.arange(12), "by_gradients guess": np.zeros(12),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_neutral_value_is_that_which_is_not_given(case):
    function, name = CASES[case], case.split()[1]
    found = function()
    same(found, function(**{name: NEUTRAL[case]}))
    assert found is not None


def test_no_landmarks_are_those_of_no_vertices():
    none = np.zeros(0, np.int64)
    same(no_landmarks(), vertex_landmarks((none, FACES), (none, FACES)))
