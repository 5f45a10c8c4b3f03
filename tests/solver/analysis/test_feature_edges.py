"""Features that a new mesh keeps: exactly where it can show them, and not those it cannot."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.feature_edges import region_borders, resolved_features, sharp_edges
from omt_uv.solver.mesh.topology import pair_keys
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import RemeshSource, remesh


def gear(teeth=8):
    """A closed prism over an outline with teeth, caps as fans: coarse triangles, hard edges, corners of both kinds."""
    turn = 2 * np.pi * np.arange(4 * teeth) / (4 * teeth)
    radius = np.where(np.arange(len(turn)) % 4 < 2, 1.0, 0.75)
    ring, n = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1), len(turn)
    V = np.concatenate([np.c_[ring, np.zeros(n)], np.c_[ring, np.full(n, 0.4)], [[0, 0, 0], [0, 0, 0.4]]])
    k, after = np.arange(n), (np.arange(n) + 1) % n
    low, high = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    sides = ((k, after, n + after), (k, n + after, n + k), (after, k, low), (n + k, n + after, high))
    return V, np.concatenate([np.stack(side, axis=1) for side in sides])


def off_lines(points, V, edges):
    """Distances (k,) of points from the nearest of the edges."""
    a, d = V[edges[:, 0]], V[edges[:, 1]] - V[edges[:, 0]]
    t = np.clip(((points[:, None] - a) * d).sum(axis=2) / (d * d).sum(axis=1), 0, 1)
    return np.linalg.norm(points[:, None] - (a + t[..., None] * d), axis=2).min(axis=1)


def test_hard_edges_stay_straight_and_corners_where_they_are():
    V, F = gear()
    edges = sharp_edges(V, F, np.radians(30))
    assert len(edges) == 3 * 32
    found = drain(remesh(RemeshSource(V, F, edges), 500))
    new = sharp_edges(found.vertices, found.triangles, np.radians(30))
    points = found.vertices[new]
    # Surfaces are remeshed with coordinates rounded to 2^-32 of their extent, which single precision does not see.
    assert off_lines(points.mean(axis=1), V, edges).max() < 1e-9
    length = np.linalg.norm(V[edges[:, 0]] - V[edges[:, 1]], axis=1).sum()
    assert np.linalg.norm(points[:, 0] - points[:, 1], axis=1).sum() == pytest.approx(length, rel=1e-9)
    for corner in V[:64]:
        assert np.linalg.norm(found.vertices - corner, axis=1).min() < 1e-9


def island(scale=1.0):
    """A flat grid in two halves, and between them an island of two triangles that has more border with the left one."""
    V, F = meshes.bumpy(16, 16, height=0.0)
    V = V / np.ptp(V[:, 0])
    centre = V[F].mean(axis=1)
    region = (centre[:, 0] > 0.5).astype(int)
    column = centre[:, 0][centre[:, 0] < 0.5].max()
    edge = np.linalg.norm(V[F[0, 0]] - V[F[0, 1]])
    near = np.linalg.norm(centre - [column, 0.5, 0], axis=1)
    region[np.argsort(near, kind="stable")[:2]] = 2
    return V * scale, F, region, edge * scale


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_an_island_too_small_for_the_new_mesh_joins_its_neighbour(scale):
    V, F, region, edge = island(scale)
    features = region_borders(F, region)
    fine, joined = resolved_features(V, F, features, np.full(len(F), 0.5 * edge))
    assert joined == 0
    assert (fine == features).all()
    coarse, joined = resolved_features(V, F, features, np.full(len(F), 3 * edge))
    assert joined == 1
    kept = set(pair_keys(*coarse.T).tolist())
    # The island is part of one half, and the halves stay apart.
    either = [set(pair_keys(*region_borders(F, np.where(region == 2, half, region)).T).tolist()) for half in (0, 1)]
    assert kept in either


def test_lines_that_end_on_the_surface_are_kept_at_any_size():
    V, F, _, edge = island()
    row = np.flatnonzero(np.abs(V[:, 1] - np.unique(V[:, 1])[7]) < 1e-9)
    line = row[np.argsort(V[row, 0])][3:9]
    features = np.stack([line[:-1], line[1:]], axis=1)
    kept, joined = resolved_features(V, F, features, np.full(len(F), 10 * edge))
    assert joined == 0
    assert (kept == features).all()


@pytest.mark.parametrize("row", [0, 7])
def test_a_narrow_strip_is_no_region_though_it_is_long_inside_and_along_the_boundary(row):
    V, F, _, edge = island()
    centre = V[F].mean(axis=1)
    rows = np.unique(V[:, 1].round(9))
    strip = np.digitize(centre[:, 1], [rows[row], rows[row + 1]])
    features = region_borders(F, strip)
    assert resolved_features(V, F, features, np.full(len(F), edge))[1] == 0
    kept, joined = resolved_features(V, F, features, np.full(len(F), 6 * edge))
    assert joined == 1
    assert len(kept) == (len(features) / 2 if row else 0)
