"""Samples that slide on a boundary stay on it where it is straight enough, and end evenly apart."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np

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
