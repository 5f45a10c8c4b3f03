"""Samples that slide on a boundary stay on it where it is straight enough, and end evenly apart."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np

from omt_uv.solver.mesh.topology import pair_keys
from omt_uv.solver.remeshing.initial.arc_network import find_arcs, sample_arcs
from omt_uv.solver.remeshing.initial.boundary_samples import slide_boundaries
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource

NONE = np.zeros(0, np.int64)


def on_a_disk():
    V, F = meshes.polar(lambda r: r, lambda r: 0 * r, 4, 96)
    maps = RemeshSource(V, F).maps[0]
    component = maps.component
    network = find_arcs(component.vertices, maps.charts, component.boundary_edges, NONE)
    size = np.full(len(component.vertices), 0.11)
    return component, network, sample_arcs(component.vertices, network.arcs, size), size


def test_samples_become_even():
    component, network, samples, size = on_a_disk()
    (arc,) = network.arcs
    share = np.random.default_rng(0).random(len(samples.along[0]))
    share[[0, -1]] = samples.share[0][[0, -1]]
    found = slide_boundaries(component, network, replace(samples, share=[share]), size)
    step = np.linalg.norm(np.diff(found.points[samples.along[0]], axis=0), axis=1)
    assert step.std() < 0.01 * step.mean() and arc.kept
    radius = np.linalg.norm(found.points[samples.along[0]], axis=1)
    assert radius.std() < 1e-3 and 0.98 < radius.mean() / 0.5 <= 1


def test_without_a_boundary_nothing_slides():
    V, F = meshes.torus()
    maps = RemeshSource(V, F).maps[0]
    component = maps.component
    network = find_arcs(component.vertices, maps.charts, NONE, NONE)
    size = np.full(len(component.vertices), 0.1)
    samples = sample_arcs(component.vertices, network.arcs, size)
    assert slide_boundaries(component, network, samples, size) is samples


def test_samples_where_a_feature_ends_stay():
    """All others of the boundary slide until they are even between them."""
    V, F = meshes.polar(lambda r: r, lambda r: 0 * r, 4, 96)
    ray = np.array([0, *(1 + 96 * np.arange(4) + 10)])
    across = np.array([0, *(1 + 96 * np.arange(4) + 51)])
    features = np.concatenate([np.column_stack([line[:-1], line[1:]]) for line in (ray, across)])
    maps = RemeshSource(V, F, features).maps[0]
    component = maps.component
    kept = np.unique(np.concatenate([component.boundary_edges, pair_keys(*component.features.T)]))
    network = find_arcs(component.vertices, maps.charts, kept, NONE)
    size = np.full(len(component.vertices), 0.11)
    samples = sample_arcs(component.vertices, network.arcs, size)
    on = network.along(component.boundary_edges)
    share = [np.asarray(x, float).copy() for x in samples.share]
    for k in on:
        share[k][1:-1] = np.random.default_rng(k).random(len(share[k]) - 2)
    found = slide_boundaries(component, network, replace(samples, share=share), size)
    radius = np.linalg.norm(samples.points, axis=1)
    ends = {int(samples.along[k][at]) for k in range(len(network.arcs)) if k not in on for at in (0, -1)}
    ends = [k for k in ends if radius[k] > 0.49]
    assert len(ends) == 2
    np.testing.assert_allclose(found.points[ends], samples.points[ends], atol=1e-12)
    moved = np.linalg.norm(found.points - samples.points, axis=1)
    others = np.setdiff1d(np.concatenate([samples.along[k] for k in on]), ends)
    assert len(others) > 10 and (moved[others] > 0).mean() > 0.5
