"""Edges are halved until none is too long; the surface, its features and where it lies in the input stay."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.topology import halfedges, pair_keys, paired
from omt_uv.solver.remeshing.components.components import split_components
from omt_uv.solver.remeshing.edits.long_edges import split_long_edges


@pytest.mark.parametrize("longest", [0.5, 0.2])
def test_no_edge_is_longer(longest):
    (component,) = split_components(*meshes.cube(), np.array([[0, 1]])).components
    fine = split_long_edges(component, np.full(len(component.vertices), longest))
    p = fine.vertices[fine.triangles]
    assert np.linalg.norm(p - p[:, [1, 2, 0]], axis=2).max() <= longest * (1 + 1e-12)
    np.testing.assert_allclose(np.bincount(fine.faces, fine.area), component.area)
    ends = fine.vertices[fine.features]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(1)
    np.testing.assert_allclose(fine.input_barycentric.sum(axis=2), 1)


def test_there_is_an_end_to_needles():
    (component,) = split_components(*meshes.cube(), np.zeros((0, 2), int)).components
    fine = split_long_edges(component, np.full(len(component.vertices), 1e-6), 100)
    assert 100 <= len(fine.vertices) - len(component.vertices) < 300


@pytest.mark.parametrize("seed", range(3))
def test_edges_to_open_again_are_halved_with_the_others_and_stay_in_order(seed):
    """Whoever looks for one does so in a sorted row of keys."""
    (component,) = split_components(*meshes.cube(), np.zeros((0, 2), int)).components
    keys = np.unique(pair_keys(*halfedges(component.triangles)))
    some = np.sort(np.random.default_rng(seed).permutation(keys)[:7])
    fine = split_long_edges(replace(component, to_reopen=some), np.full(len(component.vertices), 0.3))
    assert (np.diff(fine.to_reopen) > 0).all()

    def lines(of, keys):
        """Directions and lengths of edges, sums of all on a line."""
        return of.vertices[paired(keys)]

    before, after = lines(component, some), lines(fine, fine.to_reopen)
    length = [np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() for ends in (before, after)]
    assert length[1] == pytest.approx(length[0]) and len(after) > 2 * len(before)
    assert np.isin(fine.to_reopen, pair_keys(*halfedges(fine.triangles))).all()
