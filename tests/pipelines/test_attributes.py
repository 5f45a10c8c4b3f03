"""What a mesh carries, and the edges at which it jumps."""

import itertools
from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.attributes import (
    TYPES,
    Attributes,
    Layer,
    Marks,
    followed,
    is_uv,
    marked_sharp,
    material_borders,
    uv_seams,
)
from omt_uv.solver.mesh.surface import triangle_surface


def carried(F, marks=None, layers=()):
    none = np.zeros(0, bool)
    marks = marks or Marks(np.zeros((0, 2), np.int64), none, none, np.zeros(0))
    return Attributes(np.zeros(len(F), np.int32), np.zeros(len(F), bool), marks, tuple(layers))


def middle(F, V):
    """Edges of the line x = 1/2 of a grid of two columns."""
    rows = np.flatnonzero(V[:, 0] == 0.5)
    return {tuple(sorted(map(int, edge))) for edge in itertools.pairwise(rows)}


def as_set(edges):
    return {tuple(sorted(map(int, edge))) for edge in edges}


def test_marks_are_sharp_by_any_of_three_names():
    edges = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    bevel = Layer("bevel_weight_edge", "EDGE", "FLOAT", np.array([0, 0, 0.5, 0]))
    other = Layer("freestyle", "EDGE", "BOOLEAN", np.array([0, 0, 0, 1], bool))
    marks = Marks(edges, np.ones(4, bool), np.array([1, 0, 0, 0], bool), np.array([0, 0.3, 0, 0]), (bevel, other))
    attributes = carried(np.zeros((1, 3)), marks)
    assert np.array_equal(marked_sharp(attributes), edges[:3])


def test_what_was_left_before_is_still_named_once_marks_are_left_too():
    edges, none = np.array([[0, 1], [2, 1]]), np.zeros(2, bool)
    far = Layer("far", "EDGE", "INT", np.array([0, 1]))
    given = replace(carried(np.zeros((1, 3)), Marks(edges, none, none, none, (far,))), left=("words", "more words"))
    for lines, named in (([[1, 0]], ("words", "more words", "far")), ([[1, 0], [1, 2]], ("words", "more words"))):
        once = followed(given, np.array(lines))
        assert once.left == named and followed(once, np.array(lines)).left == named


def test_marks_away_from_the_lines_are_left_and_named():
    edges = np.array([[0, 1], [2, 1]])
    near = Layer("near", "EDGE", "INT", np.array([7, 0]))
    far = Layer("far", "EDGE", "INT", np.array([7, 1]))
    none = np.zeros(2, bool)
    found = followed(carried(np.zeros((1, 3)), Marks(edges, none, none, none, (near, far))), np.array([[1, 0]]))
    assert [layer.name for layer in found.marks.layers] == ["near"] and found.left == ("far",)


@pytest.mark.parametrize("seed", range(6))
def test_marks_go_along_exactly_where_all_of_them_are_on_lines(seed):
    """By loops over edges of all kinds of layers; edges and lines have their ends either way round."""
    rng = np.random.default_rng(seed)
    every = np.array(list(itertools.combinations(range(6), 2)))
    edges = every[rng.permutation(len(every))[:8]]
    lines = np.concatenate([edges[rng.random(8) < 0.7], every[rng.random(len(every)) < 0.2]])[:, ::-1]
    layers = []
    for width in (1, 2, 3):
        for share in (0.1, 0.4, 1.0):
            values = rng.integers(-2, 3, (8, width)) * (rng.random((8, width)) < share)
            layers.append(Layer(f"{width} {share}", "EDGE", "INT", values[:, 0] if width == 1 else values))
    none = np.zeros(8, bool)
    there = {frozenset(line) for line in lines.tolist()}
    stays = [
        layer.name
        for layer in layers
        if all(
            frozenset(edge) in there or not np.any(value)
            for edge, value in zip(edges.tolist(), layer.values, strict=True)
        )
    ]
    found = followed(carried(np.zeros((1, 3)), Marks(edges, none, none, none, tuple(layers))), lines)
    assert [layer.name for layer in found.marks.layers] == stays
    assert found.left == tuple(layer.name for layer in layers if layer.name not in stays)
    np.testing.assert_array_equal(found.marks.edges, edges)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_uv_seams_are_where_any_map_jumps_however_large_it_is(size):
    V, F = meshes.grid(2, 3)
    surface, uv = triangle_surface(V, F), V[F.ravel(), :2]
    right = np.repeat(V[F, 0].mean(axis=1) > 0.5, 3)
    rounding = 1e-8 * np.random.default_rng(1).random(uv.shape)
    cut = Layer("cut", "CORNER", "FLOAT2", size * (uv + rounding + 5 * right[:, None]))
    whole = Layer("whole", "CORNER", "FLOAT2", size * (uv + rounding))
    colour = Layer("colour", "CORNER", "FLOAT_COLOR", np.random.default_rng(0).random((len(uv), 4)))
    assert is_uv(cut) and not is_uv(colour)
    assert len(uv_seams(carried(F, layers=[whole, colour]), surface)) == 0
    assert as_set(uv_seams(carried(F, layers=[whole, cut, colour]), surface)) == middle(F, V)


def test_faces_without_area_in_a_map_have_no_seams_between_them():
    V, F = meshes.grid(2, 3)
    surface, uv = triangle_surface(V, F), V[F.ravel(), :2].copy()
    right = np.repeat(V[F, 0].mean(axis=1) > 0.5, 3)
    # As some exporters write where there are no UVs: the same few places at the corners of every face.
    uv[right] = np.tile([[2.0, 1.0], [3.0, 1.0], [2.0, 1.0]], (right.sum() // 3, 1))
    found = uv_seams(carried(F, layers=[Layer("UV", "CORNER", "FLOAT2", uv)]), surface)
    assert as_set(found) == middle(F, V)
    everywhere = Layer("UV", "CORNER", "FLOAT2", np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], (len(F), 1)))
    assert len(uv_seams(carried(F, layers=[everywhere]), surface)) == 0


def test_borders_of_materials():
    V, F = meshes.grid(2, 3)
    attributes = carried(F)
    assert len(material_borders(attributes, triangle_surface(V, F))) == 0
    attributes.material_index[V[F, 0].mean(axis=1) > 0.5] = 3
    assert as_set(material_borders(attributes, triangle_surface(V, F))) == middle(F, V)


@pytest.mark.parametrize("name", TYPES)
def test_only_numbers_that_mean_amounts_are_interpolated(name):
    _, size, kind, smooth = TYPES[name]
    assert size >= 1 and smooth == (kind is np.float32 and name not in ("QUATERNION", "FLOAT4X4"))
