"""Components that are to be cut: what they are, and what their edges cost."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from short_cuts import component_of, gluing_of

from omt_uv.solver.analysis.seam_costs import seam_costs
from omt_uv.solver.cutting import component as component_module
from omt_uv.solver.cutting.component import Copies, TurnedCopies, boundary_vertices, classify, fingerprint, fold_angles
from omt_uv.solver.cutting.component_order import Outlined, motion
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.mesh.gluing import components, corner_classes
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.seams.search import SeamSearch


def union(*shapes):
    first = np.cumsum([0, *(len(V) for V, _ in shapes)])
    return np.concatenate([V for V, _ in shapes]), np.concatenate(
        [F + k for (_, F), k in zip(shapes, first, strict=False)]
    )


def test_topology_of_a_union_is_that_of_its_members():
    gluing = gluing_of(*union(meshes.grid(4, 3), meshes.annulus(12, 2), meshes.icosphere(1), meshes.torus(8, 6)))
    found = classify(gluing, corner_classes(gluing), components(gluing), np.zeros(len(gluing.triangles), bool))
    assert found.boundaries.tolist() == [1, 2, 0, 0] and found.handles.tolist() == [0, 0, 0, 1]
    assert found.is_disk.tolist() == [True, False, False, False]


@pytest.mark.parametrize("mesh", [meshes.grid, meshes.annulus, meshes.torus, meshes.cube])
def test_every_edge_is_an_inner_pair_or_a_boundary_halfedge(mesh):
    V, F = mesh()
    component = component_of(V, F)
    assert 2 * len(component.pair) + len(component.boundary) == 3 * len(F)
    assert len(np.unique(np.concatenate([component.pair.ravel(), component.boundary]))) == 3 * len(F)
    p = component.positions[component.ends]
    np.testing.assert_array_equal(component.length, np.linalg.norm(p[:, 0] - p[:, 1], axis=1))
    np.testing.assert_array_equal(component.positions, V[component.vertex_ids])


def test_boundaries_are_told_apart():
    V, F = meshes.annulus(12, 2)
    component = component_of(V, F)
    radii = [np.linalg.norm(component.positions[loop], axis=1) for loop in boundary_vertices(component)]
    assert sorted(map(len, radii)) == [12, 12] and all(np.ptp(r) < 1e-12 for r in radii)
    assert component.on_boundary().sum() == 24
    assert boundary_vertices(component_of(*meshes.torus(8, 6))) == []


def test_folds_have_the_angle_between_the_faces_and_the_sign_of_the_side():
    V, F = meshes.cube()
    component = component_of(V, F)
    for triangles, sign in ((component.triangles, 1), (component.triangles[:, ::-1], -1)):
        pair = component.pair if sign > 0 else 3 * (component.pair // 3) + (1 - component.pair % 3) % 3
        angle = np.sort(sign * fold_angles(component.positions, triangles, pair))
        np.testing.assert_allclose(angle, np.repeat([0, np.pi / 2], [6, 12]), atol=1e-12)


def test_fingerprints_are_equal_for_moved_copies_alone():
    V, F = meshes.bumpy(5, 4)
    own = fingerprint(component_of(V, F))
    assert own == fingerprint(component_of(V + [0.25, 0.5, -1], F))
    assert own != fingerprint(component_of(V * [1, 1, 1.1], F)) and own == fingerprint(component_of(V, F[::-1]))


def test_copies_are_known_where_single_precision_has_moved_their_vertices():
    """Not those that are turned, or of another shape, however little, or whose edges cost something else."""
    V, F = meshes.bumpy(5, 4)
    copies = Copies()
    assert copies.of(component_of(V, F)) is None
    copies.tell(component_of(V, F), "this")
    far = (V + 12.3).astype(np.float32).astype(float)
    assert fingerprint(component_of(V, F)) != fingerprint(component_of(far, F))
    assert copies.of(component_of(far, F)) == copies.of(component_of(3 * V, F)) == "this"
    turned, bent = V[:, [1, 0, 2]] * [-1, 1, 1], V + 1e-4 * np.eye(len(V), 3)
    assert copies.of(component_of(turned, F)) is None and copies.of(component_of(bent, F)) is None
    dearer = component_of(V, F)
    assert copies.of(replace(dearer, cost=2 * dearer.cost)) is None
    copies.tell(component_of(turned, F), "other")
    assert copies.of(component_of(turned, F)) == "other" and copies.of(component_of(V, F)) == "this"


def test_many_copies_are_cut_alike_and_searched_once(monkeypatch):
    V, F = meshes.icosphere(2)
    rng, searched, search_one = np.random.default_rng(0), [], SeamSearch.__call__
    places = rng.uniform(-20, 20, size=(8, 3))
    points, faces = union(*(((V + place).astype(np.float32).astype(float), F) for place in places))
    surface = triangle_surface(points, faces)

    def counted(self, component, base):
        searched.append(component)
        return (yield from search_one(self, component, base))

    monkeypatch.setattr(SeamSearch, "__call__", counted)
    search = SeamSearch(np.full(len(faces), 0.02), surface, lambda: seam_costs(surface))
    edges = cut(surface, search=search).edges
    assert len(searched) == 1
    each = [np.unique(np.sort(edges[edges[:, 0] // len(V) == k] % len(V), axis=1), axis=0) for k in range(len(places))]
    assert all(np.array_equal(each[0], other) for other in each) and len(each[0])


def turned_by(V, seed, sign=1.0):
    """Vertices turned at random, and mirrored where the sign is -1."""
    axes = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return V @ (axes * np.sign(np.linalg.det(axes)) * [1, 1, sign]).T


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_copies_that_are_turned_have_the_same_edges(sign):
    """Whatever their numbers; not what is bent or costs something else."""
    V, F = meshes.bumpy(5, 4)
    V[:, 2] += 0.1 * V[:, 0] ** 2 + 0.05 * V[:, 0] * V[:, 1]
    first, chosen = component_of(V, F), np.zeros(len(component_of(V, F).pair), bool)
    chosen[[1, 4, 7]] = True
    copies = TurnedCopies()
    copies.tell(first, chosen)
    W, order = turned_by(V, 1, sign) + [3, 1, 2], np.random.default_rng(0).permutation(len(V))
    faces = np.argsort(order)[F if sign > 0 else F[:, ::-1]]
    copy = component_of(W[order], faces)
    other, edges, edge = copies.of(copy)
    assert other is first and edges is chosen and sorted(edge.tolist()) == list(range(len(first.pair)))
    np.testing.assert_allclose(copy.length, first.length[edge], atol=1e-9)
    ends = {tuple(sorted(pair)) for pair in first.vertex_ids[first.ends[chosen]].tolist()}
    found = copies.found_for(copy)
    assert {tuple(sorted(pair)) for pair in order[copy.vertex_ids[copy.ends[found]]].tolist()} == ends
    assert copies.of(component_of(W + 1e-3 * np.eye(len(V), 3), F)) is None
    assert copies.of(replace(copy, cost=2 * copy.cost)) is None
    assert copies.of(replace(copy, avoid=copy.avoid + (np.arange(len(V)) == 3))) is None


def test_no_motion_is_looked_for_between_what_is_only_nearly_alike(monkeypatch):
    V, F = meshes.bumpy(5, 4)
    V[:, 2] += 0.1 * V[:, 0] ** 2 + 0.05 * V[:, 0] * V[:, 1]
    rng, copies, looked = np.random.default_rng(2), TurnedCopies(), []
    parts = [component_of(V + 1e-4 * rng.normal(size=V.shape), F) for _ in range(40)]
    monkeypatch.setattr(component_module, "motion", lambda a, b: looked.append(a) or motion(a, b))
    for part in parts:
        assert copies.of(part) is None
        copies.tell(part, np.zeros(len(part.pair), bool))
    names = [len(found) for found in copies.known.values()]
    assert not looked and max(names) > 5 and sum(names) == 40
    for k in (0, 20, 39):
        other, *_ = copies.of(component_of(turned_by(parts[k].positions, k), parts[k].triangles))
        assert other is parts[k]
    assert len(looked) == 3


@pytest.mark.parametrize("scale", [1.0, 1e160, 1e-160])
def test_distances_from_the_middle_are_those_of_any_motion(scale):
    V, F = meshes.bumpy(5, 4)
    sides = F[:, :2]
    found = [
        Outlined(scale * x, sides).distances for x in (V, turned_by(V, 3)[::-1], turned_by(V, 4, -1.0) + [3, 1, 2])
    ]
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-9)
    centre = V.mean(axis=0)
    np.testing.assert_allclose(found[0] / scale, np.sort(np.linalg.norm(V - centre, axis=1)), rtol=1e-9)


def test_parts_that_are_turned_are_searched_once(monkeypatch):
    V, F = meshes.icosphere(2)
    V = V * [1, 1.3, 1.7] + 0.1 * np.column_stack([V[:, 1] ** 2, V[:, 2] ** 2, V[:, 0] ** 2])
    searched, search_one = [], SeamSearch._searched
    parts = [(turned_by(V, k, (-1.0) ** k) + [5 * k, 0, 0], F if k % 2 == 0 else F[:, ::-1]) for k in range(4)]
    points, faces = union(*parts)

    def counted(self, component, base):
        searched.append(component)
        return (yield from search_one(self, component, base))

    monkeypatch.setattr(SeamSearch, "_searched", counted)
    surface = triangle_surface(points, faces)
    search = SeamSearch(np.full(len(faces), 0.02), surface, lambda: seam_costs(surface))
    edges = cut(surface, search=search).edges
    assert len(searched) == 1
    each = [np.sort(edges[edges[:, 0] // len(V) == k] % len(V), axis=1) for k in range(4)]
    assert all(np.array_equal(np.unique(each[0], axis=0), np.unique(other, axis=0)) for other in each)
    assert len(each[0]) and [found.is_copy for found in search.memory.values()] == [False, True, True, True]


def test_neither_order_nor_diagonals_move_a_seam():
    surface = meshes.polygon_surface(*quad_ball())
    rng = np.random.default_rng(1)
    order, rows = rng.permutation(len(surface.positions)), rng.permutation(len(surface.face_start) - 1)
    inverse = np.argsort(order)
    faces = inverse[surface.corner_vertex.reshape(-1, 4)[rows]]
    # From another corner on: the other diagonal.
    shuffled = meshes.polygon_surface(surface.positions[order], np.roll(faces, 1, axis=1).tolist())
    mine, theirs = (
        {tuple(sorted(e)) for e in edges.tolist()} for edges in (cut(surface).edges, order[cut(shuffled).edges])
    )
    assert mine == theirs and len(mine) > 2


def quad_ball():
    """A bumpy ball of quads, without symmetry."""
    n = 7
    t, p = np.meshgrid(np.linspace(0.3, 2.8, n), 2 * np.pi * np.arange(10) / 10, indexing="ij")
    r = 1 + 0.2 * np.sin(3 * p + t) + 0.1 * np.cos(2 * t + 1)
    V = np.column_stack(
        [(r * np.sin(t) * np.cos(p)).ravel(), (r * np.sin(t) * np.sin(p)).ravel(), (r * np.cos(t)).ravel()]
    )
    a = (10 * np.arange(n - 1)[:, None] + np.arange(10)).ravel()
    b = (10 * np.arange(n - 1)[:, None] + (np.arange(10) + 1) % 10).ravel()
    return V, np.column_stack([a, a + 10, b + 10, b]).tolist()
