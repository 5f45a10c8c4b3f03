"""Carry what a mesh carries to the mesh that was cut along cells: nothing moves, so that nothing is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...solver.mesh.surface import Surface
from ...solver.mesh.topology import pair_keys
from ...solver.partition.cut_mesh import CellMesh, polygon_edges
from ..attributes import TYPES, Attributes, Layer, Marks


def carry_to_cells(attributes: Attributes, surface: Surface, corners: np.ndarray, mesh: CellMesh) -> Attributes:
    """The attributes of a cut mesh from those of the surface; corners (m,3) of its triangles, which `mesh` counts.

    Edges between cells become seams; pieces of marked edges keep their marks.
    """
    cut = _Cut(surface, corners, mesh)
    return replace(
        attributes,
        material_index=attributes.material_index[cut.polygon],
        smooth=attributes.smooth[cut.polygon],
        marks=_marks(attributes.marks, cut),
        layers=tuple(replace(layer, values=cut.values(layer)) for layer in attributes.layers),
        weights=cut.at_vertices(attributes.weights) if attributes.groups else attributes.weights,
        member=cut.at_vertices(attributes.member) > 0 if attributes.groups else attributes.member,
        keys=tuple(replace(key, offsets=cut.at_vertices(key.offsets)) for key in attributes.keys),
    )


class _Cut:
    """Where the corners, vertices and polygons of a cut mesh lie on its surface."""

    def __init__(self, surface: Surface, corners: np.ndarray, mesh: CellMesh):
        self.mesh, self.corners = mesh, corners
        self.triangles = surface.corner_vertex[corners]
        of_corner = np.full(len(surface.corner_vertex), -1)
        of_corner[surface.triangles] = surface.triangle_face[:, None]
        self.polygon = of_corner[corners[mesh.triangle, 0]]
        self.triangle = np.repeat(mesh.triangle, np.diff(mesh.face_start))
        self.first = np.unique(mesh.corner_vertex, return_index=True)[1]

    def values(self, layer: Layer) -> np.ndarray:
        """Values of a layer: interpolated where they are amounts, else those that are nearest."""
        smooth = TYPES[layer.data_type][3]
        if layer.domain == "FACE":
            return layer.values[self.polygon]
        if layer.domain == "CORNER":
            return self._blended(self.corners, layer.values, smooth)
        return self._blended(self.triangles, layer.values, smooth)[self.first]

    def at_vertices(self, values: np.ndarray) -> np.ndarray:
        return self._blended(self.triangles, values, True)[self.first]

    def _blended(self, rows: np.ndarray, values: np.ndarray, smooth: bool) -> np.ndarray:
        """Values at every corner of the cut mesh, from those in `rows` (m,3) of its triangles."""
        if smooth:
            found = np.asarray(values, float)[rows[self.triangle]]
            return np.einsum("kc,kc...->k...", self.mesh.barycentric, found)
        return values[rows[self.triangle, self.mesh.barycentric.argmax(axis=1)]]


def _marks(marks: Marks, cut: _Cut) -> Marks:
    """Seams between cells, and the marks of old edges on their pieces."""
    mesh = cut.mesh
    a, b, _ = polygon_edges(mesh.corner_vertex, mesh.face_start)
    tail, head = cut.triangles.ravel(), cut.triangles[:, [1, 2, 0]].ravel()
    own = pair_keys(marks.edges[:, 0], marks.edges[:, 1])
    order = np.argsort(own)
    key = pair_keys(tail[mesh.halfedge], head[mesh.halfedge])
    at = order[np.minimum(np.searchsorted(own, key, sorter=order), len(own) - 1)] if len(own) else np.zeros(len(a), int)
    marked = (mesh.halfedge >= 0) & (own[at] == key) if len(own) else np.zeros(len(a), bool)
    between = _between(mesh, a, b)
    rows = np.flatnonzero(marked | between)
    rows = rows[np.unique(pair_keys(a[rows], b[rows]), return_index=True)[1]]
    at, marked, between = at[rows], marked[rows], between[rows]

    def kept(values: np.ndarray) -> np.ndarray:
        return (values[at].T * marked).T if len(own) else np.zeros((len(rows), *values.shape[1:]), values.dtype)

    layers = tuple(replace(layer, values=kept(layer.values)) for layer in marks.layers)
    seam = kept(marks.seam).astype(bool) | between
    return Marks(np.stack([a[rows], b[rows]], axis=1), seam, kept(marks.sharp).astype(bool), kept(marks.crease), layers)


def _between(mesh: CellMesh, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Which edges a, b (c,), one from each corner, part two cells; (c,) bool."""
    cell = np.repeat(mesh.cell, np.diff(mesh.face_start))
    key = np.unique(pair_keys(a, b), return_inverse=True)[1].ravel()
    low, high = np.full(int(key.max()) + 1, len(mesh.cell)), np.full(int(key.max()) + 1, -1)
    np.minimum.at(low, key, cell)
    np.maximum.at(high, key, cell)
    return (low < high)[key]
