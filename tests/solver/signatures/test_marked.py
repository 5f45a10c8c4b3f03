"""Markers fix a shape: it is near itself in any place and size, far from others, and what cannot be marked is named."""

import functools
import itertools

import meshes
import numpy as np
import pytest
import sphere_shapes

from omt_uv.solver import errors
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.marked import marked_signature
from omt_uv.solver.signatures.signature import signature
from omt_uv.solver.signatures.wasserstein import nearest, shape_distance

COUNT = 150


def face(seed=0):
    """A cap (n,3), (m,3) with bumps by a seed; the vertices of both markers."""
    V, F = meshes.icosphere(3)
    V = V @ sphere_shapes.random_rotation(1).T
    keep = (V[:, 2] > 0.2)[F].all(axis=1)
    used, local = np.unique(F[keep], return_inverse=True)
    V, F = V[used], local.reshape(-1, 3)
    waves = np.random.default_rng(seed).normal(size=(3, 3)) * 2
    height = 1 + 0.05 * np.sin(V @ waves.T).sum(axis=1)
    edge = np.flatnonzero(V[:, 2] < 0.35)
    return V * height[:, None], F, int(V[:, 2].argmax()), int(edge[V[edge, 0].argmax()])


@functools.cache
def of(seed=0, change=""):
    V, F, centre, start = face(seed)
    if change == "moved":
        V = 3 * V @ sphere_shapes.random_rotation(4).T + 5
    if change == "mirrored":
        V, F = V * [-1, 1, 1], F[:, ::-1]
    if change == "subdivided":
        V, F = meshes.subdivide(V, F)
    return drain(marked_signature(V, F, centre, start, COUNT))


@pytest.mark.parametrize("change", ["moved", "mirrored", "subdivided"])
def test_a_face_is_near_itself(change):
    found = shape_distance(of(), of(change=change))
    assert found.raw <= (1e-6 if change == "moved" else 1.3 * found.floor)
    assert found.raw < 0.7 * shape_distance(of(), of(1)).raw


def test_masses_are_equal_and_inside_the_circle():
    points = of().points
    assert points.shape == (COUNT, 2) and (np.hypot(*points.T) < 1).all()
    even = drain(marked_signature(*meshes_disk(), COUNT)).points
    assert abs(np.mean((even**2).sum(axis=1)) - 0.5) < 0.01


def meshes_disk():
    """A flat disk (n,3), (m,3), its centre and the vertex at the right."""
    rings, around = 12, 48
    r, a = np.meshgrid(np.arange(1, rings + 1) / rings, 2 * np.pi * np.arange(around) / around, indexing="ij")
    V = np.concatenate([np.zeros((1, 3)), np.stack([r * np.cos(a), r * np.sin(a), 0 * r], axis=2).reshape(-1, 3)])
    j = np.arange(around)
    fan = np.stack([0 * j, 1 + j, 1 + (j + 1) % around], axis=1)
    a, b = ((np.arange(rings - 1)[:, None] * around + 1 + k).ravel() for k in (j, (j + 1) % around))
    rows = [np.stack([a, a + around, b + around], axis=1), np.stack([a, b + around, b], axis=1)]
    return V, np.concatenate([fan, *rows]), 0, 1 + (rings - 1) * around


def test_the_nearest_of_a_library_is_the_face_itself():
    assert nearest(of(change="subdivided"), [of(1), of(2), of(), of(3)], 2)[0][0] == 2


def test_holes_are_filled_but_for_the_one_with_the_marker():
    V, F, centre, start = face()
    hole = F[np.arange(len(F)) != np.flatnonzero((centre != F).all(axis=1) & (V[F].mean(axis=1)[:, 2] > 0.7))[3]]
    found = drain(marked_signature(V, hole, centre, start, COUNT))
    assert shape_distance(found, of()).distance < 0.05


def test_what_has_no_place_for_markers_is_named():
    V, F, centre, start = face()
    with pytest.raises(errors.LandmarkError, match="lies on the boundary"):
        drain(marked_signature(V, F, start, start, COUNT))
    with pytest.raises(errors.EmptyMeshError, match="There are no faces to compare"):
        drain(marked_signature(V, F[:0], centre, start, COUNT))
    whole = drain(signature(*sphere_shapes.blob(seed=0), COUNT))
    with pytest.raises(errors.LandmarkError, match="markers"):
        shape_distance(whole, of())


@pytest.mark.parametrize("seed", range(3))
def test_any_two_vertices_of_a_long_box_are_markers_or_are_refused_by_name(seed):
    """Of large triangles, ways lead to vertices that no part of the surface around the centre reaches."""
    corners = np.array(np.meshgrid([0.0, 1], [0, 1], [0, 30])).reshape(3, -1).T
    V = corners + np.random.default_rng(seed).normal(0, 0.02, (8, 3))
    F = sphere_shapes.outward_hull(V - V.mean(axis=0))
    told = []
    for centre, start in itertools.permutations(range(8), 2):
        try:
            assert np.isfinite(drain(marked_signature(V, F, centre, start, 20)).points).all()
        except errors.LandmarkError as error:
            told.append(error)
    assert all(error.elements.tolist() for error in told) and len(told) < 20
    assert any("does not reach" in str(error) for error in told)
