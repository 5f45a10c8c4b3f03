"""What plays no part in what is found of a mesh: vertices that no face has, wherever they lie, and by how much a
density is larger everywhere.

Of functions that take too long for the laws of `test_what_holds_of_every_function`, and those that everybody calls.
"""

from __future__ import annotations

import functools
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from recorded_calls import leaves
from solver_runs import curved, near_middle
from told_otherwise import body, patch, ramp

from omt_uv import solver as omt
from omt_uv.solver import comparison, partition, subdivision, transfer
from omt_uv.solver.analysis import curvature, density, occlusion, saliency, seam_costs, symmetry_plane, vertex_scores
from omt_uv.solver.analysis.joint_density import joint_density
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.registration import suggestions
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.options import RemeshOptions
from omt_uv.solver.remeshing.remesh_surface import remesh
from omt_uv.solver.signatures import signature
from omt_uv.solver.sphere import multilevel
from omt_uv.solver.transport import Disk, semidiscrete, semidiscrete_sphere

FAR = np.array([[900.0, -2e3, 40.0], [-3e3, 150.0, 5e3]])
MESHES = {
    "patch": curved,
    "body": body,
    "quads": patch,
    "mirrored": lambda: meshes.two_bumps(8),
    "nearly mirrored": lambda: _shaken(*meshes.two_bumps(8)),
    "mirrored body": lambda: _egg(*meshes.icosphere(2)),
}


def _shaken(V, F):
    return V + 3e-3 * np.random.default_rng(0).standard_normal(V.shape), F


def _egg(V, F):
    return V * [1.0, 1.4, 0.8] * (1 + 0.2 * V[:, [2]]), F


def _mirror(V, F):
    return symmetry_plane.symmetry_plane(V, F)


def _images(V, F):
    return symmetry_plane.symmetry_plane(V, F).images(V, F)


def _seam_costs(V, F):
    return seam_costs.seam_costs(omt.polygon_surface(V, F))


def _subdivided(V, F):
    surface = omt.polygon_surface(V, F)
    way = subdivision.modifier.SubdivisionModifier(1)
    return subdivision.modifier.subdivided_surface(surface, way, 10**5).corners


def _flat(V, F):
    return omt.unwrap(V, F, quality="draft").uv


def _magnified(V, F):
    weights = np.zeros(len(V))
    weights[F] = near_middle(V[F].reshape(-1, 3), np.arange(F.size).reshape(F.shape)).reshape(F.shape)
    return omt.magnify(V, F, V[F][:, :, :2], weights, 2.0).uv


def _divided(V, F):
    found = drain(partition.divide(V, F, 5))
    return found.cells.area, found.sites.triangle, found.sites.barycentric, found.residual


def _compared(V, F):
    other = V + 0.02 * np.sin(3 * V[:, [1, 2, 0]])
    found = drain(comparison.compare((V, F), (other, F), 200))
    return [value for key, value in vars(found).items() if key != "vertices" and value is not None]


def _reported(V, F):
    found = drain(remesh(RemeshSource(V, F), 80, RemeshOptions(rounds=6)))
    return found.vertices, found.triangles, found.faces, found.barycentric


def _carried(V, F):
    """Where a new mesh is on the old one, which is cut along a line of its edges."""
    new = drain(remesh(RemeshSource(V[: F.max() + 1], F), 80, RemeshOptions(rounds=4)))
    seams = np.array([[3 + 8 * k, 11 + 8 * k] for k in range(7)])
    return transfer.correspond(V, F, seams, new.vertices, new.triangles, new.faces, new.barycentric)


# Functions, and the meshes that they are asked about.
OF_MESHES = {
    "mirror planes": (_mirror, "mirrored", "nearly mirrored", "mirrored body"),
    "mirror images": (_images, "mirrored", "nearly mirrored", "mirrored body"),
    "where seams cost": (_seam_costs, "patch", "body", "mirrored body"),
    "what is hidden": (occlusion.hidden_sides, "patch", "body"),
    "saliency": (saliency.saliency, "patch", "body"),
    "sharpness": (curvature.sharpness, "patch", "body"),
    "density by curvature": (density.gaussian_curvature_density, "patch", "body"),
    "density by mean curvature": (density.mean_curvature_density, "patch", "body"),
    "landmarks": (lambda V, F: suggestions.suggest_landmarks((V, F), (V * [1.2, 1.1, 1.0], F), 4), "body"),
    "signatures": (lambda V, F: drain(signature.signature(V, F, 40)), "body"),
    "what two have in common": (_compared, "body"),
    "cells": (_divided, "patch", "body"),
    "UVs": (_flat, "patch", "quads", "mirrored"),
    "UVs in a square": (lambda V, F: omt.unwrap(V, F, quality="draft", boundary="square").uv, "quads"),
    "UVs of a body": (lambda V, F: omt.unwrap(V, F, quality="draft", max_shear=1.2).uv, "mirrored body"),
    "distortion": (lambda V, F: omt.distortion(V, F, V[F][:, :, [0, 1]]), "patch", "mirrored"),
    "refined UVs": (lambda V, F: omt.refine(V, F, V[F][:, :, :2], quality="draft").uv, "patch", "mirrored"),
    "magnified regions": (_magnified, "patch", "quads"),
    "new meshes": (_reported, "patch", "body"),
    "what a new mesh takes over": (_carried, "patch"),
    "subdivided corners": (_subdivided, "patch", "quads"),
    "scores": (
        lambda V, F: [vertex_scores.vertex_score(k, V, F, np.arange(len(V)) < 4) for k in vertex_scores.KINDS],
        "patch",
        "body",
    ),
}


def _alike(before: list, after: list, n: int, name: str) -> None:
    assert before and len(before) == len(after), name
    for a, b in zip(before, after, strict=True):
        b = b[:n] if b.ndim and len(b) == n + len(FAR) else b
        assert a.shape == b.shape and a.dtype.kind == b.dtype.kind, name
        if a.dtype.kind in "fc":
            size = np.abs(a[np.isfinite(a)]).max(initial=1e-300)
            np.testing.assert_allclose(b, a, rtol=1e-6, atol=1e-6 * size, err_msg=name)
        else:
            np.testing.assert_array_equal(b, a, err_msg=name)


def _leaves(found) -> list[np.ndarray]:
    return [np.array(leaf) for leaf in leaves(found)]


@pytest.mark.parametrize(
    ("name", "mesh"), [(name, mesh) for name, (_, *named) in OF_MESHES.items() for mesh in named], ids=str
)
def test_vertices_of_no_face_play_no_part_wherever_they_lie(name, mesh):
    (V, F), find = MESHES[mesh](), OF_MESHES[name][0]
    before, after = _leaves(find(V, F)), _leaves(find(np.concatenate([V, FAR]), F))
    _alike(before, after, len(V), name)


# ---- densities ------------------------------------------------------------------------------------------------------


@functools.cache
def _given():
    """A mesh, a body, and what is asked of their faces: of some four times as much as of others."""
    V, F = curved()
    W, G = body()
    return SimpleNamespace(V=V, F=F, W=W, G=G, open=ramp(V, F, 1, 4), closed=ramp(W, G, 1, 3))


def _in_a_disk(times, **options):
    return omt.unwrap(_given().V, _given().F, density=times * _given().open, boundary="disk", **options)


def _of_remesh(times):
    g = _given()
    found = omt.remesh(g.V, g.F, 60, density=times * g.open, rounds=4)
    return found.vertices, found.triangles


def _of_cells(times):
    g = _given()
    found = drain(partition.divide(g.V, g.F, 5, times * g.open))
    return found.cells.area / times, found.sites.triangle, found.residual


def _of_a_sphere(times):
    g = _given()
    return omt.sphere_map(g.W, g.G, balance=0.3, density=times * g.closed).positions


def _of_sites(times):
    sites = np.random.default_rng(5).random((30, 2)) - 0.5
    mass = times * (0.5 + np.arange(30) % 3)
    return drain(semidiscrete.transport(0.9 * sites, mass, Disk())).cells.centroid


def _of_points_of_a_sphere(times):
    points = np.random.default_rng(6).normal(size=(30, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return drain(semidiscrete_sphere.sphere_transport(points, times * (0.5 + np.arange(30) % 3)))


def _of_regions(times):
    g = _given()
    regions = np.stack([near_middle(g.V, g.F), np.clip(g.V[:, 0] - 0.9, 0, 1)])[:, g.F].mean(axis=2)
    return joint_density(regions, times * face_areas(g.V, g.F), [2.0, 0.5]).density


OF_DENSITIES = {
    "UVs": lambda t: omt.unwrap(_given().V, _given().F, density=t * _given().open).uv / np.sqrt(t),
    "UVs in a disk": lambda t: _in_a_disk(t).uv / np.sqrt(t),
    "UVs by name": lambda t: _in_a_disk(t, kind="polar").uv,
    "an island": lambda t: drain(refine_island(_given().V, _given().F, _given().V[:, :2], target=t * _given().open)),
    "new meshes": _of_remesh,
    "cells": _of_cells,
    "a sphere": _of_a_sphere,
    "a first map to the sphere": lambda t: drain(
        multilevel.multilevel_start(_given().W, _given().G, t * face_areas(_given().W, _given().G) * _given().closed)
    ),
    "a transport": _of_sites,
    "a transport on the sphere": _of_points_of_a_sphere,
    "several regions": _of_regions,
}  # fmt: skip


@pytest.mark.parametrize("name", OF_DENSITIES)
@pytest.mark.parametrize("times", [2.0**12, 2.0**-9])
def test_densities_count_by_what_they_are_beside_one_another(name, times):
    find = OF_DENSITIES[name]
    _alike(_leaves(find(1.0)), _leaves(find(times)), -1, name)
