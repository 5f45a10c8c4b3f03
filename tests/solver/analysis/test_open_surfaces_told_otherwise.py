"""What is found on an open surface is the same whichever corner a triangle begins at, in whatever order triangles come,
and whichever way round all of them go: sides of the boundary are in one triangle each, and count for both of their
ends."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis import curvature, density, saliency, vertex_scores
from omt_uv.solver.mesh import geometry
from omt_uv.solver.registration import functional_maps, suggestions


def without_ties(V, F):
    """A mesh no two places of which are alike: rounding would choose between them."""
    length = np.linalg.norm(V[F[:, 0]] - V[F[:, 1]], axis=1).min()
    return V + 0.15 * length * np.random.default_rng(1).normal(size=V.shape), F


MESHES = {
    "patch": lambda: without_ties(*meshes.bumpy(9, 8)),
    "cap": lambda: without_ties(*meshes.cap(7, 14)),
    "band": lambda: without_ties(*meshes.annulus()),
    "strip": lambda: without_ties(*meshes.bumpy(1, 30)),
}
TOLD = {
    "the other way round": lambda F: F[:, ::-1],
    "from another corner": lambda F: np.stack([np.roll(f, k % 3) for k, f in enumerate(F)]),
    "in another order": lambda F: F[np.random.default_rng(0).permutation(len(F))],
}


def uneven(V, F):
    """Values of vertices whose highest places are many, some on the boundary."""
    return np.random.default_rng(len(V)).random(len(V))


def of_faces(function):
    """Values of triangles as their means over the triangles around vertices."""

    def around(V, F):
        return np.bincount(F.ravel(), np.repeat(function(V, F), 3), len(V)) / np.bincount(F.ravel(), minlength=len(V))

    return around


# Values of vertices, or rows of vertices. What has a sign by the side that is looked at is told without it.
FOUND = {
    "mean curvature": lambda V, F: np.abs(curvature.mean_curvature(V, F)),
    "Gaussian curvature": curvature.gaussian_curvature,
    "sharpness": curvature.sharpness,
    "density by mean curvature": of_faces(density.mean_curvature_density),
    "density by Gaussian curvature": of_faces(density.gaussian_curvature_density),
    "saliency": saliency.saliency,
    "unit size": saliency.unit_size,
    "areas of vertices": geometry.vertex_areas,
    "areas of faces": of_faces(geometry.face_areas),
    "least angles": of_faces(geometry.least_angles),
    "normals": lambda V, F: np.abs(geometry.vertex_normals(V, F)),
    "Laplacian": lambda V, F: geometry.cotangent_laplacian(V, F) @ V,
    "descriptors": lambda V, F: np.abs(functional_maps.descriptors(V, F)),
    "scaled areas": vertex_scores.scaled_vertex_areas,
    "distance": lambda V, F: vertex_scores.distance(V, F, np.array([0, len(V) - 1])),
    "peaks": lambda V, F: suggestions._peaks(uneven(V, F), V, F),
    "peaks of saliency": lambda V, F: suggestions._peaks(saliency.saliency(V, F), saliency.unit_size(V, F), F),
    "suggestions": lambda V, F: suggestions.suggest_landmarks((V, F), (V, F)).source,
}


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("told", TOLD)
@pytest.mark.parametrize("name", FOUND)
def test_an_open_surface_is_the_same_however_its_triangles_are_told(name, told, mesh):
    V, F = MESHES[mesh]()
    expected = FOUND[name](V, F)
    found = FOUND[name](V, np.ascontiguousarray(TOLD[told](F)))
    size = max(np.abs(expected).max(initial=0.0), 1e-12)
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-7 * size)


@pytest.mark.parametrize("mesh", MESHES)
def test_peaks_on_a_boundary_are_higher_than_all_that_are_joined_to_them(mesh):
    V, F = MESHES[mesh]()
    for seed in range(5):
        value = np.random.default_rng(seed).random(len(V))
        found: list[int] = []
        for v in np.argsort(-value):
            around = F[(v == F).any(axis=1)]
            if value[v] >= value[around].max() and all(np.linalg.norm(V[v] - V[w]) > suggestions.APART for w in found):
                found.append(int(v))
        assert suggestions._peaks(value, V, F).tolist() == found[: suggestions.PEAKS]
