"""Plan the samples of a component: on its boundaries and features, where charts meet, and how many vertices in all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.topology import pair_keys, paired
from ..components.coincident_boundaries import reopened_copies
from ..components.components import Component
from ..edits.vertex_count import edge_length
from .arc_network import ArcNetwork, ArcSamples, find_arcs, sample_arcs
from .boundary_samples import slide_boundaries
from .component_maps import ComponentMaps
from .options import RemeshOptions

# Vertices that a component has at first at least: fewer make no sound mesh, so the rest is taken away afterwards.
INITIAL_VERTICES = 100
# The same for the components of a batch, in the mean.
INITIAL_VERTICES_IN_BATCH = 24
# Factor by which samples on boundaries and features that are too many move apart, again and again,
SPARSER = 1.25
# up to so many edges.
MAX_SPACING = 1e3


@dataclass(frozen=True)
class SamplePlan:
    """The arcs of a component, samples on them, and how many vertices its mesh is to have.

    vertex_count: in the end, initial_vertex_count: to begin with; size: edge length at density 1 in the end,
    initial_size: to begin with; line_spacing: that of samples on boundaries and features, in edges
    """

    network: ArcNetwork
    samples: ArcSamples
    vertex_count: int
    initial_vertex_count: int
    size: float
    initial_size: float
    line_spacing: float
    warnings: tuple[str, ...]


def plan_samples(
    maps: ComponentMaps,
    count: int,
    density: np.ndarray,
    at_vertices: np.ndarray,
    options: RemeshOptions,
    line_spacing: float,
) -> SamplePlan:
    """Sample the arcs of a component with density (m,), and at_vertices (n,), of mean 1; parameters as for the mesh.

    Samples on boundaries and features move apart, and in the end lose corners, where they are more than the count.
    """
    component, charts, kept_edges = maps.component, maps.charts, _kept_edges(maps.component)
    # What is reopened is a boundary on both sides.
    boundary_edges = np.concatenate([component.boundary_edges, component.to_reopen, component.to_reopen])
    boundary = _weighted_length(component.vertices, boundary_edges, at_vertices)
    measure = float(component.area @ density)
    vertex_count = count if options.counts_vertices else max(count // 2 + component.euler, 3)
    size, with_copies = edge_length(measure, boundary, vertex_count), vertex_count
    at_first = initial_vertex_count(component)
    finer = edge_length(measure, boundary, max(vertex_count, at_first)) / size
    lengths = size / np.sqrt(at_vertices)
    first, corners = line_spacing, options.preserve_boundary
    while True:
        corner_scale = line_spacing * lengths if corners else None
        network = find_arcs(component.vertices, charts, kept_edges, component.to_reopen, corner_scale)
        samples = sample_arcs(component.vertices, network.arcs, finer * lengths, line_spacing=line_spacing / finer)
        vertex_count = with_copies - copies_of(component, network, samples)
        if not options.counts_vertices:
            samples, vertex_count = _for_face_count(
                component, network, samples, count, finer * lengths, line_spacing / finer
            )
        if samples.fixed.sum() <= vertex_count:
            break
        line_spacing *= SPARSER
        if line_spacing > MAX_SPACING:
            if not corners:
                break
            line_spacing, corners = first, False
    if not options.preserve_boundary:
        samples = slide_boundaries(component, network, samples, lengths)
    lost = f"{vertex_count} vertices for a part are too few to keep the corners of its boundaries and features"
    return SamplePlan(
        network=network,
        samples=samples,
        vertex_count=vertex_count,
        initial_vertex_count=at_first,
        size=size,
        initial_size=finer * size,
        line_spacing=line_spacing,
        warnings=(lost,) if options.preserve_boundary and not corners else (),
    )


def initial_vertex_count(component: Component) -> int:
    """Vertices that the first mesh of a component has at least."""
    return INITIAL_VERTICES_IN_BATCH * len(component.members) if component.members else INITIAL_VERTICES


def min_sample_count(maps: ComponentMaps, corners: bool) -> int:
    """Samples that the boundaries and features of a component take at least, with their corners or without."""
    component, kept_edges = maps.component, _kept_edges(maps.component)
    if len(kept_edges) == 0:
        return 0
    unbounded = np.full(len(component.vertices), np.inf)
    network = find_arcs(
        component.vertices, maps.charts, kept_edges, component.to_reopen, unbounded if corners else None
    )
    samples = sample_arcs(component.vertices, network.arcs, unbounded)
    return int(samples.fixed.sum()) + copies_of(component, network, samples)


def copies_of(component: Component, network: ArcNetwork, samples: ArcSamples) -> int:
    """Samples that reopening adds to those given."""
    if len(component.to_reopen) == 0:
        return 0
    chains = [samples.along[k] for k in network.along(component.to_reopen)]
    on_boundary = np.zeros(len(samples.points), dtype=bool)
    for k in network.along(component.boundary_edges):
        on_boundary[samples.along[k]] = True
    return reopened_copies(np.concatenate([end for chain in chains for end in (chain[:-1], chain[1:])]), on_boundary)


def _kept_edges(component: Component) -> np.ndarray:
    """Sorted keys of the edges on boundaries and features."""
    return np.union1d(component.boundary_edges, pair_keys(component.features[:, 0], component.features[:, 1]))


def _weighted_length(positions: np.ndarray, keys: np.ndarray, density: np.ndarray) -> float:
    """Length of edges with these keys (k,), in edge lengths that density (n,) asks for at density 1."""
    a, b = paired(keys).T
    length = np.linalg.norm(positions[a] - positions[b], axis=1)
    return float(length @ np.sqrt((density[a] + density[b]) / 2))


def _for_face_count(
    component: Component, network: ArcNetwork, samples: ArcSamples, count: int, size: np.ndarray, line_spacing: float
) -> tuple[ArcSamples, int]:
    """Samples whose boundary fits a number of faces, F = 2 V - 2 euler - b, and the number of vertices V."""
    boundary = network.along(component.boundary_edges)
    b = sum(len(samples.along[k]) - 1 for k in boundary)
    if (count + b) % 2 and boundary:
        longest = max(boundary, key=lambda k: len(samples.along[k]))
        samples = sample_arcs(component.vertices, network.arcs, size, longer=longest, line_spacing=line_spacing)
        b += 1
    return samples, (count + b) // 2 + component.euler
