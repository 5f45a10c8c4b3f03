"""Scores of vertices, densities and figures of shapes are those of the same body told in another way.

Each function is named with the power of the body's size that its values have.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from told_otherwise import WAYS, body, patch, ramp

from omt_uv.solver.analysis import curvature, density
from omt_uv.solver.analysis.feature_edges import sharp_edges
from omt_uv.solver.analysis.saliency import saliency
from omt_uv.solver.analysis.vertex_scores import scaled_vertex_areas, soft_weights, vertex_score
from omt_uv.solver.comparison import comparison_figures
from omt_uv.solver.comparison.comparison_figures import compare, distances_to
from omt_uv.solver.comparison.triangle_shapes import compare_shapes, topology_of
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas, vertex_normals
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.signature import pair_costs, signature
from omt_uv.solver.sphere.figures import sphere_figures
from omt_uv.solver.strain.beltrami import beltrami

# Of vertices, which another order of the vertices carries along.
OF_VERTICES = {
    "gaussian curvature": (curvature.gaussian_curvature, 0),
    "mean curvature": (curvature.mean_curvature, 1),
    "sharpness": (curvature.sharpness, 0),
    "vertex areas": (vertex_areas, 2),
    "saliency": (saliency, 0),
    "score gaussian": (lambda V, F: vertex_score("gaussian", V, F), 0),
    "score mean": (lambda V, F: vertex_score("mean", V, F), 0),
    "weights": (lambda V, F: soft_weights(np.linalg.norm(V - V[F].mean((0, 1)), axis=1),
                                          scaled_vertex_areas(V, F), 0.3, 0.9), 0),
    "distances": (lambda V, F: distances_to(V, F, V[F].mean((0, 1)) + 0.5 * (V - V[F].mean((0, 1)))), 1),
}  # fmt: skip
# Of faces, which another order of the faces carries along.
OF_FACES = {
    "face areas": (face_areas, 2),
    "gaussian density": (density.gaussian_curvature_density, None),
    "mean density": (density.mean_curvature_density, None),
    "density of vertices": (lambda V, F: density.from_vertices(np.linalg.norm(V - V[F].mean((0, 1)), axis=1), F), 1),
    "strain": (lambda V, F: beltrami(V, F, V + 0.3 * np.roll(V, 1, axis=1)).size, None),
}  # fmt: skip


def order_of(told, V):
    """The vertex of a body that each of it told otherwise is, by the way its faces have been told."""
    _, F = body()
    new = np.empty(len(V), np.int64)
    new[np.roll(told.faces, -told.rolled, axis=1)] = F[told.order]
    return new


@pytest.fixture(autouse=True)
def fewer_samples(monkeypatch):
    """A surface of so few faces needs no hundred thousand points to be found by: what is exact stays so."""
    monkeypatch.setattr(comparison_figures, "POINTS", 4000)


@pytest.mark.parametrize(("name", "way"), list(product(OF_VERTICES, WAYS)), ids=lambda x: getattr(x, "__name__", x))
def test_scores_of_vertices(name, way):
    (V, F), (function, power) = body(), OF_VERTICES[name]
    told = way(V, F)
    expected, found = function(V, F), function(told.vertices, told.faces) / told.size**power
    assert np.ptp(expected) > 0
    assert np.abs(found - expected[order_of(told, V)]).max() <= 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize(("name", "way"), list(product(OF_FACES, WAYS)), ids=lambda x: getattr(x, "__name__", x))
def test_values_of_faces(name, way):
    (V, F), (function, power) = body(), OF_FACES[name]
    told = way(V, F)
    expected, found = function(V, F), function(told.vertices, told.faces)
    if power is None:
        # Densities count beside one another alone.
        if name == "strain" and way.__name__ in ("turned", "moved"):
            pytest.skip("the image moves another way")
        expected, found, power = expected / expected.mean(), found / found.mean(), 0
    assert np.abs(found / told.size**power - expected[told.order]).max() <= 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_normals_turn_along(way):
    V, F = body()
    told = way(V, F)
    before, after = vertex_normals(V, F)[order_of(told, V)], vertex_normals(told.vertices, told.faces)
    assert np.abs(after @ after.T - before @ before.T).max() < 1e-9
    assert (np.einsum("ij,ij->i", after, told.vertices - told.vertices.mean(axis=0)) > 0).mean() > 0.9


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_figures_of_shapes(way):
    (V, F), told = body(), way(*body())
    T = told.faces
    assert vars(compare_shapes(told.vertices, T)) == pytest.approx(vars(compare_shapes(V, F)), rel=1e-9)
    assert topology_of(T) == topology_of(F)
    edges = order_of(told, V)[sharp_edges(told.vertices, T, np.radians(12))]
    asked = sharp_edges(V, F, np.radians(12))
    assert len(asked) and {tuple(sorted(e)) for e in edges.tolist()} == {tuple(sorted(e)) for e in asked.tolist()}
    other = V * [1.1, 1.0, 0.9]
    image = other[order_of(told, V)]
    image = image / np.linalg.norm(image, axis=1)[:, None]
    plain = other / np.linalg.norm(other, axis=1)[:, None]
    before, after = sphere_figures(V, F, plain), sphere_figures(told.vertices, T, image)
    assert vars(after) == pytest.approx(vars(before), rel=1e-7)


def test_figures_of_a_sphere_map_are_means_over_the_surface():
    V, F = body()
    P = V / np.linalg.norm(V, axis=1)[:, None]
    a, b, c = (P[F[:, k]] for k in range(3))
    # Van Oosterom and Strackee: the solid angle of a triangle.
    solid = 2 * np.arctan2(
        np.einsum("ij,ij->i", a, np.cross(b, c)), 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1)
    )
    w = face_areas(V, F) / face_areas(V, F).sum()
    r = solid / (4 * np.pi) / w
    shear = []
    for p, q in zip(V[F], P[F], strict=True):
        frames = []
        for x in (p, q):
            u = (x[1] - x[0]) / np.linalg.norm(x[1] - x[0])
            v = x[2] - x[0] - u * (u @ (x[2] - x[0]))
            v /= np.linalg.norm(v)
            frames.append(np.array([[s @ (x[k] - x[0]) for k in (1, 2)] for s in (u, v)]))
        s = np.linalg.svd(frames[1] @ np.linalg.inv(frames[0]), compute_uv=False)
        shear.append(s[0] / s[1])
    shear = np.array(shear)
    expected = {"folds": 0, "area_l1": w @ np.abs(r - 1), "area_sd": np.sqrt(w @ (r - 1) ** 2), "angle_mean": w @ shear,
                "symmetric_area": (r + 1 / r).mean(), "symmetric_angle": (shear + 1 / shear).mean()}  # fmt: skip
    assert vars(sphere_figures(V, F, P)) == pytest.approx(expected, rel=1e-9)
    assert sphere_figures(V, F, P).report() == vars(sphere_figures(V, F, P))


@pytest.mark.parametrize("way", [w for w in WAYS if "first" not in w.__name__], ids=lambda way: way.__name__)
def test_comparisons_and_signatures(way):
    (V, F), told = body(), way(*body())
    W = V * (1 + 0.05 * np.sin(5 * V[:, :1]))
    other = way(W, F)
    before = vars(drain(compare((V, F), (W, F), 2000)))
    after = vars(drain(compare((told.vertices, told.faces), (other.vertices, other.faces), 2000)))
    if way.__name__ != "turned":
        # Shares of the diagonal of a box, which is another one where the body is turned.
        assert {name for name, value in after.items() if value is None} == {"boundary", "hausdorff_bound"}
        for name, value in before.items():
            # Points nearest to an edge have the normal of either side.
            near = 1e-2 if name.startswith("normal") else 1e-6
            assert value is None or after[name] == pytest.approx(value, rel=near), name
    assert after["normal_mean"] == pytest.approx(before["normal_mean"], rel=1e-2)
    one, two = (drain(signature(*mesh, 60)) for mesh in ((V, F), (told.vertices, told.faces)))
    costs = pair_costs(one, two)
    assert costs.min(axis=1).max() < 0.2 * costs.mean()


def test_values_of_polygons_are_means_of_their_corners():
    V, F = patch()
    values = V[:, 2]
    assert np.allclose(density.means_of_corners(values, F.ravel(), np.arange(0, F.size + 1, 4)), values[F].mean(axis=1))
    assert np.allclose(density.from_polygons(ramp(V, F, 1, 2), np.repeat(np.arange(len(F)), 2)),
                       np.repeat(ramp(V, F, 1, 2), 2))  # fmt: skip
    found = density.normalised_density(ramp(V, F, 1, 2), np.ones(len(F)))
    assert found.mean() == pytest.approx(1) and found.max() / found.min() == pytest.approx(2)
