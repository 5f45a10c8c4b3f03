"""Everything that a mesh carries, on a new mesh: constants stay, and a mesh carried to itself has what it had."""

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.pipelines import carry_attributes
from omt_uv.pipelines.attributes import TYPES, Attributes, Layer, Marks, ShapeKey
from omt_uv.pipelines.carry_attributes import carry
from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.transfer.correspondence import correspond

ELEMENTS = {"POINT": 0, "FACE": 1, "CORNER": 2}


def layers_of(V, F, value):
    """A layer of every type on every domain, its values made by `value(shape, type)`."""
    counts = {"POINT": len(V), "FACE": len(F), "CORNER": F.size}
    made = []
    for domain, count in counts.items():
        for name, (_, size, kind, _) in TYPES.items():
            if (domain, name) != ("CORNER", "FLOAT2"):
                made.append(Layer(f"{domain} {name}", domain, name, value((count, size), kind)))
    return tuple(made)


def mesh_and_coarser():
    """A flat grid, and a coarser one whose vertices are all among its own."""
    V, F = meshes.grid(8, 8)
    W, G = meshes.grid(4, 4)
    at = np.array([np.flatnonzero((w == V).all(axis=1))[0] for w in W])
    face, corner = np.array([np.argwhere(v == F)[0] for v in at]).T
    return V, F, W, G, correspond(V, F, np.zeros((0, 2), np.int64), W, G, face, np.eye(3)[corner])


def to_itself(V, F, seams):
    face, corner = np.array([np.argwhere(v == F)[0] for v in range(len(V))]).T
    return correspond(V, F, seams, V, F, face, np.eye(3)[corner])


def no_marks():
    none = np.zeros(0, bool)
    return Marks(np.zeros((0, 2), np.int64), none, none, np.zeros(0, np.float32))


def test_constants_of_every_type_on_every_domain_stay_what_they_are():
    V, F, W, G, at = mesh_and_coarser()
    old = Attributes(
        np.full(len(F), 3, np.int32),
        np.ones(len(F), bool),
        no_marks(),
        layers_of(V, F, lambda shape, kind: np.full(shape, 1 if kind is bool else 5, kind)),
        groups=("a", "b"),
        weights=np.full((len(V), 2), 0.5),
        member=np.ones((len(V), 2), bool),
        keys=(ShapeKey("up", np.tile([0.0, 0.0, 2.0], (len(V), 1)), 0, {}),),
    )
    new = carry(old, triangle_surface(V, F), at)
    counts = {"POINT": len(W), "FACE": len(G), "CORNER": G.size}
    for layer, before in zip(new.layers, old.layers, strict=True):
        assert len(layer.values) == counts[layer.domain] and (layer.values == before.values[0]).all(), layer.name
    assert (new.material_index == 3).all() and new.smooth.all() and len(new.smooth) == len(G)
    assert (new.weights == 0.5).all() and new.member.all() and len(new.weights) == len(W)
    assert (new.keys[0].offsets == [0, 0, 2]).all() and new.folded == 0


def test_what_lies_between_members_and_others_is_a_member_where_it_has_weight():
    V, F = meshes.grid(4, 4)
    W, G = meshes.grid(16, 16)
    # A point of the finer mesh in the face of the coarser one that it lies in.
    a, b, c = (V[F[:, k]] for k in range(3))
    inverse = np.linalg.inv(np.stack([b - a, c - a], axis=2)[:, :2])
    local = np.einsum("fij,wfj->wfi", inverse, (W[:, None] - a)[:, :, :2])
    weights = np.concatenate([1 - local.sum(axis=2, keepdims=True), local], axis=2)
    face = weights.min(axis=2).argmax(axis=1)
    at = correspond(V, F, np.zeros((0, 2), np.int64), W, G, face, weights[np.arange(len(W)), face])
    rng = np.random.default_rng(4)
    member = rng.random((len(V), 3)) < 0.4
    old = Attributes(np.zeros(len(F), np.int32), np.zeros(len(F), bool), no_marks(), groups=("a", "b", "c"),
                     weights=member * rng.uniform(0.2, 1, member.shape), member=member)  # fmt: skip
    new = carry(old, triangle_surface(V, F), at)
    assert np.array_equal(new.member, new.weights > 1e-9) and 0.2 < new.member.mean() < 0.95


def test_what_rounding_puts_beside_an_edge_is_no_member_of_what_lies_across():
    V, F, W, G, at = mesh_and_coarser()
    rounded = at.vertex_weights + 1e-9 * np.array([-1.0, 0.5, 0.5])
    member = np.random.default_rng(7).random((len(V), 4)) < 0.5
    old = Attributes(np.zeros(len(F), np.int32), np.zeros(len(F), bool), no_marks(), groups=tuple("abcd"),
                     weights=1.0 * member, member=member)  # fmt: skip
    exact, new = (carry(old, triangle_surface(V, F), each) for each in (at, replace(at, vertex_weights=rounded)))
    assert np.array_equal(new.member, exact.member)


def test_a_linear_uv_map_is_carried_as_it_is():
    V, F, W, G, at = mesh_and_coarser()
    linear = np.array([[0.3, 0.1], [-0.2, 0.6]])
    layer = Layer("UVMap", "CORNER", "FLOAT2", V[F.ravel(), :2] @ linear)
    old = Attributes(np.zeros(len(F), np.int32), np.zeros(len(F), bool), no_marks(), (layer,))
    new = carry(old, triangle_surface(V, F), at)
    assert new.layers[0].values == pytest.approx(W[G.ravel(), :2] @ linear, abs=1e-7) and new.folded == 0


@pytest.mark.parametrize("columns", [3, 5, 7])
def test_faces_that_reach_across_a_seam_have_the_map_of_one_side_as_far_as_they_go(columns):
    V, F = meshes.grid(8, 8)
    W, G = meshes.grid(columns, 4)
    V, W = V * [1, 1, 0], W * [1, 1, 0]
    right = V[F].mean(axis=1)[:, 0] > 0.5
    middle = np.flatnonzero(np.isclose(V[:, 0], 0.5))
    seams = np.column_stack([middle[:-1], middle[1:]])
    uv = (V[F, :2] + 5.0 * right[:, None, None]).reshape(-1, 2)
    index = ClosestPoint(V, F, 0.1)
    near = index(W, np.tile([0.0, 0, 1], (len(W), 1)))
    at = correspond(V, F, seams, W, G, near.faces, near.barycentric)
    layer = Layer("UVMap", "CORNER", "FLOAT2", uv)
    old = Attributes(np.zeros(len(F), np.int32), np.zeros(len(F), bool), no_marks(), (layer,))
    found = carry(old, triangle_surface(V, F, seams), at)
    off = found.layers[0].values.reshape(-1, 3, 2) - W[G][:, :, :2]
    assert at.extended > 0 and found.folded == 0
    np.testing.assert_allclose(off, np.repeat(off[:, :1], 3, axis=1), atol=1e-6)
    np.testing.assert_allclose(off, np.where(off > 2, 5.0, 0.0), atol=1e-6)


def test_a_mesh_carried_to_itself_has_what_it_had():
    rng = np.random.default_rng(0)
    V, F = meshes.bumpy(6, 6)

    def value(shape, kind):
        return rng.integers(0, 2, shape).astype(bool) if kind is bool else rng.integers(-9, 9, shape).astype(kind)

    # Edges with two faces; a boundary parts nothing.
    edges, faces = np.unique(np.sort(F[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_counts=True)
    every = edges[faces == 2]
    edges = every[rng.random(len(every)) < 0.7]
    marks = Marks(edges, *(rng.integers(0, 2, len(edges)).astype(bool) for _ in "ab"), rng.random(len(edges)))
    old = Attributes(rng.integers(0, 4, len(F)), rng.integers(0, 2, len(F)) > 0, marks, layers_of(V, F, value))
    new = carry(old, triangle_surface(V, F), to_itself(V, F, every))
    for layer, before in zip(new.layers, old.layers, strict=True):
        assert np.array_equal(layer.values, before.values), layer.name
    assert np.array_equal(new.material_index, old.material_index) and np.array_equal(new.smooth, old.smooth)
    known = {frozenset(map(int, e)): k for k, e in enumerate(edges)}
    found = {frozenset(map(int, e)): k for k, e in enumerate(new.marks.edges)}
    assert known.keys() <= found.keys()
    for edge, k in known.items():
        assert new.marks.seam[found[edge]] == marks.seam[k] and new.marks.sharp[found[edge]] == marks.sharp[k]
        assert new.marks.crease[found[edge]] == marks.crease[k]
    # Seams of the new mesh that follow edges without marks have none.
    bare = [k for edge, k in found.items() if edge not in known]
    assert (
        bare and not new.marks.seam[bare].any() and not new.marks.sharp[bare].any() and not new.marks.crease[bare].any()
    )


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 0, 3, 2)], ids=str)
def test_several_layers_are_carried_as_each_of_them_alone(order, monkeypatch):
    """Whatever comes before or after it; and folds of all are counted."""
    V, F, W, G, at = mesh_and_coarser()
    rng = np.random.default_rng(2)
    # As if so many faces were left folded, of each map another number.
    monkeypatch.setattr(carry_attributes, "straighten_folds", lambda _, uv, side: (uv, round(100 * float(uv.std()))))

    def uv_map(name, values):
        return Layer(name, "CORNER", "FLOAT2", np.asarray(values, np.float32))

    tangled = rng.uniform(0, 1, (len(V), 2)).astype(np.float32)
    layers = [
        uv_map("straight", V[F.ravel(), :2]),
        uv_map("tangled", tangled[F.ravel()]),
        uv_map("more tangled", 3 * tangled[F.ravel()]),
        Layer("of faces", "FACE", "FLOAT", rng.uniform(0, 1, (len(F), 1)).astype(np.float32)),
    ]
    layers = [layers[k] for k in order]

    def carried(some):
        plain = np.zeros(len(F), np.int32), np.zeros(len(F), bool), no_marks()
        return carry(Attributes(*plain, tuple(some)), triangle_surface(V, F), at)

    together, alone = carried(layers), [carried([layer]) for layer in layers]
    for found, one in zip(together.layers, alone, strict=True):
        assert found.name == one.layers[0].name
        np.testing.assert_array_equal(found.values, one.layers[0].values)
    assert together.folded == sum(one.folded for one in alone) and len({one.folded for one in alone}) == 4
