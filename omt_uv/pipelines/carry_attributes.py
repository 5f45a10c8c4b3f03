"""Carry what a mesh carries to a new mesh that lies on it; `solver.transfer.interpolate` says how values are carried.

Normals are none of it: they follow the new shape, smooth and sharp as its faces and edges are marked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..solver.maps.local_untangle import straighten_folds
from ..solver.mesh.geometry import signed_areas
from ..solver.mesh.surface import Surface
from ..solver.mesh.topology import pair_keys
from ..solver.transfer import interpolate
from ..solver.transfer.correspondence import Correspondence
from .attributes import TYPES, Attributes, Layer, Marks, is_uv

# Where rounding puts a vertex beside the edge that it lies on, it takes this much of what lies across it, at most.
ROUNDED = 1e-6


def carry(attributes: Attributes, surface: Surface, at: Correspondence) -> Attributes:
    """The attributes of a new mesh from those of the old one; shape keys become offsets of the new shape."""
    triangles = surface.corner_vertex[surface.triangles]

    def at_vertices(values: np.ndarray) -> np.ndarray:
        return interpolate.to_vertices(at, triangles, values)

    layers, folded = [], 0
    for layer in attributes.layers:
        if is_uv(layer):
            uv, left = _carried_uv(layer, surface, at)
            folded += left
            layers.append(replace(layer, values=uv))
        else:
            layers.append(replace(layer, values=_carried(layer, surface, triangles, at)))
    return replace(
        attributes,
        material_index=interpolate.to_faces(at, surface.triangle_face, attributes.material_index),
        smooth=interpolate.to_faces(at, surface.triangle_face, attributes.smooth),
        marks=_carried_marks(attributes.marks, triangles, at),
        layers=tuple(layers),
        weights=at_vertices(attributes.weights) if attributes.groups else attributes.weights,
        member=at_vertices(attributes.member) > ROUNDED if attributes.groups else attributes.member,
        keys=tuple(replace(key, offsets=at_vertices(key.offsets)) for key in attributes.keys),
        folded=folded,
    )


def _carried_uv(layer: Layer, surface: Surface, at: Correspondence) -> tuple[np.ndarray, int]:
    """UVs of the new corners, and how many faces are folded though the map they come from is not."""
    uv = interpolate.to_corners(at, surface.triangles, layer.values, extend=True)
    area = signed_areas(layer.values.astype(float), surface.triangles)
    return straighten_folds(at.triangles, uv, np.sign(area)[at.face_triangle])


def _carried(layer: Layer, surface: Surface, triangles: np.ndarray, at: Correspondence) -> np.ndarray:
    """Values of a layer on the new mesh: interpolated where they are amounts, else those that are nearest."""
    smooth = TYPES[layer.data_type][3]
    if layer.domain == "FACE":
        return interpolate.to_faces(at, surface.triangle_face, layer.values)
    if layer.domain == "CORNER":
        to_corners: Callable = interpolate.to_corners if smooth else interpolate.nearest_to_corners
        return to_corners(at, surface.triangles, layer.values)
    to_vertices: Callable = interpolate.to_vertices if smooth else interpolate.nearest_to_vertices
    return to_vertices(at, triangles, layer.values)


def _carried_marks(marks: Marks, triangles: np.ndarray, at: Correspondence) -> Marks:
    """Marks of the old edges that the seams of the new mesh follow; what follows a marked edge has its marks."""
    if not len(at.seams) or not len(marks.edges):
        none = np.zeros(len(at.seams), bool)
        return Marks(at.seams, none, none, np.zeros(len(at.seams), np.float32))
    tail, head = triangles.ravel()[at.seam_origin], triangles[:, [1, 2, 0]].ravel()[at.seam_origin]
    key, own = pair_keys(tail, head), pair_keys(marks.edges[:, 0], marks.edges[:, 1])
    order = np.argsort(own)
    found = order[np.minimum(np.searchsorted(own, key, sorter=order), len(own) - 1)]
    same = own[found] == key
    others = tuple(replace(layer, values=(layer.values[found].T * same).T) for layer in marks.layers)
    return Marks(at.seams, marks.seam[found] & same, marks.sharp[found] & same, marks.crease[found] * same, others)
