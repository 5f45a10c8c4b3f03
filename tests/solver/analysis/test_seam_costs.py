"""Costs of seams: low where an artist would cut, high on a face, the same on both sides, and neutral where told."""

import functools
import itertools
from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis import seam_costs as seam_costs_module
from omt_uv.solver.analysis.facing import Z_UP, SceneAxes
from omt_uv.solver.analysis.seam_costs import LEAST, MOST, SeamPreferences, seam_costs
from omt_uv.solver.analysis.symmetry_plane import SymmetryPlane
from omt_uv.solver.errors import ZeroAreaFaceError
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import pair_keys

NEUTRAL = SeamPreferences(hidden=1, crease=1, sharp=1, underside=1, back=1, front=1, salient=1, mirror=1, loops=1)


@functools.cache
def head_costs(preferences=None):
    V, F = meshes.head(40)
    return V, seam_costs(triangle_surface(V, F), preferences)


def test_neutral_preferences_cost_one_everywhere():
    V, costs = head_costs(NEUTRAL)
    assert (costs.cost == 1).all() and (costs.vertex_cost == 1).all()


def test_the_face_is_dear_and_the_back_of_the_head_cheap():
    V, costs = head_costs()
    along = V[:, 0] / V[:, 0].max()
    assert costs.vertex_cost[along > 1 / 3].min() > 1
    assert costs.face[along > 2 / 3].min() > 0.5 and costs.face[along < 0].max() < 0.1
    middle = np.abs(V[:, 1]) < 0.05
    assert costs.vertex_cost[(along < -0.4) & middle].max() < 0.7
    assert costs.cost.min() >= LEAST and costs.cost.max() <= MOST


def test_both_sides_cost_the_same():
    """Which triangles pair up to quads aside: they are cut one-sidedly."""
    V, F = meshes.head(40)
    costs = seam_costs(triangle_surface(V, F), SeamPreferences(loops=1))
    image, _ = costs.plane.nearest_images(V, F)
    other = image[costs.edges]
    there = np.isin(pair_keys(*other.T), pair_keys(*costs.edges.T))
    assert there.mean() > 0.5
    for reason in costs.reasons.values():
        assert ((reason >= 0) & (reason <= 1)).all()
    np.testing.assert_allclose(costs.of(*other.T)[there], costs.cost[there], rtol=1e-2)


def test_the_factors_of_an_edge_multiply():
    """Near 1, so that no product meets a bound."""
    factors = {
        "hidden": 0.9,
        "crease": 0.92,
        "sharp": 0.93,
        "back": 0.94,
        "front": 1.2,
        "salient": 1.1,
        "mirror": 0.97,
        "loops": 0.96,
    }
    _, costs = head_costs(replace(NEUTRAL, **factors))
    logs = sum(np.log(factor) * costs.reasons[name] for name, factor in factors.items())
    np.testing.assert_allclose(np.log(costs.cost), logs, atol=1e-12)


def test_what_looks_down_is_cheap_only_if_down_is_known():
    V, F = meshes.icosphere(3)
    surface = triangle_surface(V, F)
    assert not seam_costs(surface).reasons["underside"].any()
    costs = seam_costs(surface, SeamPreferences(axes=SceneAxes(up=(0.0, 0.0, 2.0))))
    height = V[costs.edges].mean(axis=1)[:, 2]
    assert (costs.reasons["underside"][height < -0.7] > 0.9).all()
    assert not costs.reasons["underside"][height > 0].any()


def test_edges_are_those_of_polygons_and_only_edges_of_cubes_are_sharp():
    V, _ = meshes.cube()
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    costs = seam_costs(meshes.polygon_surface(V, quads))
    assert len(costs.edges) == 12 and (costs.reasons["sharp"] > 0.99).all() and (costs.reasons["loops"] == 1).all()
    triangles = seam_costs(triangle_surface(*meshes.cube()))
    assert len(triangles.edges) == 18
    # Six diagonals, which are no sides of the quads that the cube was cut from.
    assert (triangles.reasons["loops"] == 0).sum() == 6 == (triangles.reasons["sharp"] == 0).sum()


def test_costs_of_pairs_of_vertices():
    V, costs = head_costs()
    a, b = costs.edges.T
    np.testing.assert_array_equal(costs.of(b, a), costs.cost)
    far = np.array([0]), np.array([len(V) - 1])
    assert costs.of(*far) == (costs.vertex_cost[0] + costs.vertex_cost[-1]) / 2


def test_only_chosen_faces_count():
    V, F = meshes.head(20)
    chosen = V[F].mean(axis=1)[:, 2] > 0
    costs = seam_costs(triangle_surface(V, F), faces=chosen)
    assert set(np.unique(costs.edges)) == set(np.unique(F[chosen]))


def test_what_lies_nowhere_and_in_no_face_does_not_count():
    V, F = meshes.head(20)
    costs = seam_costs(triangle_surface(np.concatenate([[[np.nan] * 3], 1e-150 * V]), F + 1))
    same = seam_costs(triangle_surface(V, F))
    np.testing.assert_allclose(costs.cost, same.cost, rtol=1e-5)
    assert costs.vertex_cost[0] == 1 and not costs.face[0]
    with pytest.raises(ZeroAreaFaceError, match="No face has an area"):
        seam_costs(triangle_surface(0 * V, F))


@pytest.mark.parametrize(
    ("normal", "residual", "chance"),
    [((0, 0, 1), 0.008, True), ((0, 0, 1), 0.002, False), ((0, 0.6, 0.8), 0.008, False), ((1, 0, 0), 0.008, False)],
)
def test_what_is_only_about_the_same_above_and_below_has_no_mirror(monkeypatch, normal, residual, chance):
    V, F = meshes.head(20)
    plane = SymmetryPlane(np.array(normal, float), 0.0, residual, None)
    monkeypatch.setattr(seam_costs_module, "symmetry_plane", lambda *_, **__: plane)
    surface = triangle_surface(V, F)
    assert (seam_costs(surface, SeamPreferences(axes=SceneAxes())).plane is None) == chance
    # Where nobody knows what is up, nothing is level.
    assert seam_costs(surface, SeamPreferences()).plane is not None


def test_a_body_that_is_inside_out_costs_what_it_costs_otherwise():
    for V, F in (meshes.head(), meshes.cap(rings=12, sectors=24)):
        out, inside = (seam_costs(triangle_surface(V, f), SeamPreferences(axes=Z_UP)) for f in (F, F[:, ::-1]))
        # Single pixels of what is hidden hang on rounding.
        np.testing.assert_allclose(inside.cost, out.cost, rtol=1e-3)
        assert np.ptp(out.reasons["underside"]) > 0.5 and np.array_equal(inside.in_face, out.in_face)


def among_others(size=1.0, off=0.0):
    """Costs of a long body with heads above and below it that look to x, at y = 0 or off that to both sides; where its
    middle is nobody would take for a face. The vertices of each head, too."""
    V, F = meshes.head(40)
    ball, triangles = meshes.icosphere(3)
    points, faces = [ball * [1, 3, 6]], [triangles]
    for up, side in itertools.product((1, -1), (1, -1) if off else (1,)):
        faces.append((F if side > 0 else F[:, ::-1]) + sum(map(len, points)))
        points.append(size * V * [1, side, 1] + [0, off * side, 8 * up])
    costs = seam_costs(triangle_surface(np.concatenate(points), np.concatenate(faces)))
    assert costs.plane is not None and abs(costs.plane.normal[1]) > 0.99 and costs.facing.certainty < 0.7
    ends = np.cumsum([len(one) for one in points])
    return costs, [slice(*pair) for pair in itertools.pairwise(ends)]


def test_heads_among_other_parts_have_their_faces_though_the_whole_has_none(monkeypatch):
    _, alone = head_costs()
    for faced, found in ((0.7, True), (2.0, False)):
        monkeypatch.setattr(seam_costs_module, "FACED", faced)
        costs, heads = among_others()
        for head in heads:
            assert bool(costs.face[head].max() > 0.9) == found
            assert not found or np.corrcoef(costs.face[head], alone.face)[0, 1] > 0.95


@pytest.mark.parametrize("off, size, faced", [(0.0, 1.0, True), (4.0, 1.0, False), (0.0, 0.1, False)])
def test_only_large_parts_across_the_plane_have_faces_of_their_own(off, size, faced):
    """A head beside the plane is an arm or a foot, and a small one a button."""
    costs, heads = among_others(size, off)
    assert bool(costs.face[heads[0]].max() > 0.9) == faced
