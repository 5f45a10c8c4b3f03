"""What no function may see: where a mesh lies, how large it is, how it is turned, and how it is numbered.

Each function is run on a mesh and on the same mesh told in another way; what comes out has the same shape.
"""

from __future__ import annotations

import functools
from itertools import product

import numpy as np
import pytest
from told_otherwise import WAYS, Told, body, other_faces_first, patch, ramp

from omt_uv import solver as omt


def near_middle(V, F):
    """Weights (n,) that fall with the distance from the middle of the mesh."""
    away = np.linalg.norm(V - V[F].mean(axis=(0, 1)), axis=1)
    return np.clip(1.5 - 3 * away / away.max(), 0, 1)


def unwrapped(V, F, **options):
    return omt.unwrap(V, F, **options).uv


def flat(V, F):
    """UVs (m,4,2) that are sheared, from the mesh itself."""
    return omt.unwrap(V, F, quality="draft", balance=1.0).uv


ENTRIES = {
    "unwrap": unwrapped,
    "unwrap draft": lambda V, F: unwrapped(V, F, quality="draft"),
    "unwrap exact": lambda V, F: unwrapped(V, F, quality="exact"),
    "unwrap disk": lambda V, F: unwrapped(V, F, boundary="disk"),
    "unwrap square": lambda V, F: unwrapped(V, F, boundary="square"),
    "unwrap balance": lambda V, F: unwrapped(V, F, balance=0.5),
    "unwrap density": lambda V, F: unwrapped(V, F, density=ramp(V, F, 1, 4)),
    "refine": lambda V, F: omt.refine(V, F, flat(V, F)).uv,
    "refine balance": lambda V, F: omt.refine(V, F, flat(V, F), balance=0.5).uv,
    "magnify": lambda V, F: omt.magnify(V, F, flat(V, F), near_middle(V, F), 2.0).uv,
}


def lengths(uv):
    """Lengths (m,k,k) between the corners of faces (m,k,d)."""
    return np.linalg.norm(uv[:, :, None] - uv[:, None], axis=3)


def as_before(uv, told: Told):
    """Places (m,k,d) on a mesh that was told otherwise, at the faces and corners it had."""
    uv = np.roll(uv, -told.rolled, axis=1)
    found = np.empty_like(uv)
    found[told.order] = uv
    return found


@functools.cache
def as_it_is(function, mesh):
    """What a function makes of a mesh as it is."""
    return lengths(function(*mesh()))


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
@pytest.mark.parametrize("name", ENTRIES)
def test_maps_are_those_of_the_same_mesh_told_otherwise(name, way):
    told, expected = way(*patch()), as_it_is(ENTRIES[name], patch)
    off = np.abs(lengths(as_before(ENTRIES[name](told.vertices, told.faces), told)) / told.size - expected)
    assert off.max() <= 1e-5 * expected.mean()


CLOSED = {
    "unwrap": unwrapped,
    "unwrap max_shear": lambda V, F: unwrapped(V, F, max_shear=1.2),
    "sphere": lambda V, F: omt.sphere_map(V, F).positions[F],
    "sphere balance": lambda V, F: omt.sphere_map(V, F, balance=0.5).positions[F],
}


# A search for seams takes the first of cuts that are worth the same.
BY_ORDER = {("unwrap max_shear", other_faces_first)}


@pytest.mark.parametrize(("name", "way"), [pair for pair in product(CLOSED, WAYS) if pair not in BY_ORDER])
def test_maps_of_bodies_are_those_of_the_same_body_told_otherwise(name, way):
    told, expected = way(*body()), as_it_is(CLOSED[name], body)
    size = 1 if name.startswith("sphere") else told.size
    off = np.abs(lengths(as_before(CLOSED[name](told.vertices, told.faces), told)) / size - expected)
    assert off.max() <= 1e-5 * expected.mean()


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_figures_are_those_of_the_same_mesh_told_otherwise(way):
    told, (V, F) = way(*patch()), patch()
    uv = V[F][:, :, :2] * [1, 0.7] + 0.1 * V[F][:, :, 2:]
    uv[3] = uv[3, ::-1]
    mine = np.roll(uv[told.order], told.rolled, axis=1)
    before, after = omt.distortion(V, F, uv), omt.distortion(told.vertices, told.faces, mine)
    for name, value in vars(before).items():
        if isinstance(value, (int, float)):
            assert getattr(after, name) == pytest.approx(value, rel=1e-9), name


def two_bodies():
    """A body, a smaller one beside it, and a patch: components apart, as a batch, and with a boundary."""
    (V, F), (W, G) = body(), patch()
    quads = G + 2 * len(V)
    parts = [V, 0.3 * V[:, [2, 0, 1]] + [3.0, 0.2, 0.1], W + [0.1, 3.0, 0.4]]
    return np.vstack(parts), np.vstack([F, F + len(V), quads[:, :3], quads[:, [0, 2, 3]]])


REMESHES = {
    "body": (body, lambda V, F: {}),
    "patch": (lambda: (patch()[0], np.vstack([patch()[1][:, :3], patch()[1][:, [0, 2, 3]]])), lambda V, F: {}),
    "parts": (two_bodies, lambda V, F: {}),
    "density": (body, lambda V, F: {"density": ramp(V, F, 1, 4), "grading": 0.5}),
    "faces": (two_bodies, lambda V, F: {"count_of": "faces"}),
    "app-cfp": (body, lambda V, F: {"strategy": "app-cfp", "rounds": 0, "fit": False}),
}


@functools.cache
def remeshed(name):
    """What comes of a mesh as it is, and how it is told."""
    mesh, options = REMESHES[name]
    V, F = mesh()
    return V, F, omt.remesh(V, F, 150, **options(V, F))


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
@pytest.mark.parametrize("name", REMESHES)
def test_remeshes_are_those_of_the_same_mesh_told_otherwise(name, way):
    """Vertex for vertex: the way a mesh is told decides about nothing, not even where two edges are as long."""
    V, F, before = remeshed(name)
    told = way(V, F)
    after = omt.remesh(told.vertices, told.faces, 150, **REMESHES[name][1](told.vertices, told.faces))
    assert np.array_equal(after.triangles, before.triangles) and after.warnings == before.warnings
    assert np.array_equal(np.arange(len(F))[told.order][after.faces], before.faces)
    bary = np.roll(after.barycentric, -told.rolled, axis=1)
    np.testing.assert_allclose(bary, before.barycentric, atol=1e-6)
    expected = lengths(before.vertices[None])
    assert np.abs(lengths(after.vertices[None]) / told.size - expected).max() <= 1e-9 * expected.max()
