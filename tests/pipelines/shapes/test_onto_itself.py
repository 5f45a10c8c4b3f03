"""A surface that is matched with itself gets back what it carries, element by element, whatever its polygons are."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.attributes import Attributes, Layer, Marks, ShapeKey
from omt_uv.pipelines.shapes import onto
from omt_uv.pipelines.shapes.onto import transferred


def body(kind):
    """Positions and polygons of three to six corners, of a bent plate."""
    V, F = meshes.bumpy(6, 5)
    if kind == "triangles":
        return V, [list(f) for f in F]
    points, quads = meshes.quad_grid(6, 5)
    points = np.column_stack([points[:, 0], points[:, 1], 0.2 * np.sin(3 * points[:, 0]) * points[:, 1]])
    quads = [[int(v) for v in q] for q in quads]
    if kind == "quads":
        return points, quads
    # Some cut into triangles: polygons and triangles have other numbers from the first one on.
    mixed = []
    for k, q in enumerate(quads):
        mixed += [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] if k % 3 == 1 else [q]
    return points, mixed


@pytest.mark.parametrize("kind", ["triangles", "quads", "mixed"])
def test_every_element_keeps_its_own(kind):
    V, polygons = body(kind)
    surface = meshes.polygon_surface(V, polygons)
    n, f, c = len(V), len(polygons), len(surface.corner_vertex)
    rng = np.random.default_rng(0)
    none = np.zeros((0, 2), np.int64)
    empty = np.zeros(0, bool)
    layers = (
        Layer("whole", "FACE", "INT", rng.integers(0, 99, (f, 1))),
        Layer("amount", "FACE", "FLOAT", rng.random((f, 1)).astype(np.float32)),
        Layer("at points", "POINT", "FLOAT_VECTOR", rng.random((n, 3)).astype(np.float32)),
        Layer("UVMap", "CORNER", "FLOAT2", V[surface.corner_vertex, :2].astype(np.float32)),
    )
    given = Attributes(
        material_index=rng.integers(0, 5, f),
        smooth=rng.random(f) < 0.5,
        marks=Marks(none, empty, empty, np.zeros(0, np.float32)),
        layers=layers,
        groups=("a", "b"),
        weights=rng.random((n, 2)),
        member=rng.random((n, 2)) < 2,
        keys=(ShapeKey("Key", rng.normal(size=(n, 3)), 0, {}),),
    )
    corners = surface.corner_vertex[surface.triangles]
    first = np.zeros(n, np.int64)
    first[corners.ravel()] = np.arange(corners.size)
    result = SimpleNamespace(source_faces=first // 3, source_barycentric=np.eye(3)[first % 3])
    job = SimpleNamespace(source=surface, target=surface, jumps=none)
    found, across = transferred(job, result, given)
    assert across == 0
    np.testing.assert_array_equal(found.material_index, given.material_index)
    np.testing.assert_array_equal(found.smooth, given.smooth)
    for old, new in zip(given.layers, found.layers, strict=True):
        assert (old.name, old.domain) == (new.name, new.domain) and len(new.values) in (c, f, n)
        np.testing.assert_allclose(new.values, old.values, atol=1e-6, err_msg=old.name)
    np.testing.assert_allclose(found.weights, given.weights, atol=1e-9)
    np.testing.assert_allclose(found.keys[0].offsets, given.keys[0].offsets, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["triangles", "quads", "mixed"])
def test_polygons_that_reach_across_are_counted_and_not_their_triangles(monkeypatch, kind, seed):
    V, polygons = body(kind)
    surface = meshes.polygon_surface(V, polygons)
    rng = np.random.default_rng(seed)
    across = np.flatnonzero(rng.random(len(surface.triangles)) < (0.1, 0.6, 1.0)[seed])
    corners = surface.corner_vertex[surface.triangles]
    first = np.zeros(len(V), np.int64)
    first[corners.ravel()] = np.arange(corners.size)
    result = SimpleNamespace(source_faces=first // 3, source_barycentric=np.eye(3)[first % 3])
    none = np.zeros((0, 2), np.int64)
    job = SimpleNamespace(source=surface, target=surface, jumps=none)
    marks = Marks(none, np.zeros(0, bool), np.zeros(0, bool), np.zeros(0, np.float32))
    given = Attributes(np.zeros(len(polygons), np.int64), np.zeros(len(polygons), bool), marks)
    true = onto.correspond
    monkeypatch.setattr(onto, "correspond", lambda *words: replace(true(*words), extended=len(across)))
    monkeypatch.setattr(onto, "_across", lambda at: across)
    expected = len({int(surface.triangle_face[k]) for k in across})
    assert transferred(job, result, given)[1] == expected and expected
