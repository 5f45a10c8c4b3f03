"""Hold what a mesh carries besides its shape, as arrays, and find the edges at which it jumps."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..solver.analysis.feature_edges import edge_union, region_borders, value_jumps
from ..solver.mesh.geometry import signed_areas
from ..solver.mesh.surface import Surface
from ..solver.mesh.topology import pair_keys

# How values of Blender's types of attributes are read and written in bulk: the property of their elements, numbers
# each, the numpy type, and whether values can be interpolated.
TYPES: dict[str, tuple[str, int, type, bool]] = {
    "FLOAT": ("value", 1, np.float32, True),
    "FLOAT2": ("vector", 2, np.float32, True),
    "FLOAT_VECTOR": ("vector", 3, np.float32, True),
    "FLOAT_COLOR": ("color", 4, np.float32, True),
    "BYTE_COLOR": ("color", 4, np.float32, True),
    "QUATERNION": ("value", 4, np.float32, False),
    "FLOAT4X4": ("value", 16, np.float32, False),
    "INT": ("value", 1, np.int32, False),
    "INT8": ("value", 1, np.int32, False),
    "INT16_2D": ("value", 2, np.int32, False),
    "INT32_2D": ("value", 2, np.int32, False),
    "BOOLEAN": ("value", 1, bool, False),
}

# UVs nearer than this share of their extent are the same.
SAME_UV = 1e-5


@dataclass(frozen=True)
class Layer:
    """An attribute: values (elements of its domain, numbers each)."""

    name: str
    domain: str
    data_type: str
    values: np.ndarray


@dataclass(frozen=True)
class ShapeKey:
    """A shape key: offsets (n,3) from the shape of the mesh, and its settings by name."""

    name: str
    offsets: np.ndarray
    relative_to: int
    settings: dict


@dataclass(frozen=True)
class Marks:
    """Edges (e,2) that carry a mark, and the marks: seam (e,) bool, sharp (e,) bool, crease (e,), other attributes.

    Of the other attributes only values other than 0 are marks.
    """

    edges: np.ndarray
    seam: np.ndarray
    sharp: np.ndarray
    crease: np.ndarray
    layers: tuple[Layer, ...] = ()


@dataclass(frozen=True)
class Attributes:
    """What a mesh carries.

    groups: names of vertex groups, weights (n,g), member (n,g) bool; material_index (f,), smooth (f,) bool;
    uv_flags, color_flags: the active and the rendered one; left: names of what cannot be carried;
    custom_normals: whether there were some, which are not carried; folded: faces that carrying left folded in a UV map
    """

    material_index: np.ndarray
    smooth: np.ndarray
    marks: Marks
    layers: tuple[Layer, ...] = ()
    groups: tuple[str, ...] = ()
    weights: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    member: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), bool))
    keys: tuple[ShapeKey, ...] = ()
    keys_relative: bool = True
    uv_flags: tuple[str, str] = ("", "")
    color_flags: tuple[str, str] = ("", "")
    left: tuple[str, ...] = ()
    custom_normals: bool = False
    folded: int = 0


def is_uv(layer: Layer) -> bool:
    """Every attribute of this kind is a UV map."""
    return layer.domain == "CORNER" and layer.data_type == "FLOAT2"


def marked_sharp(attributes: Attributes) -> np.ndarray:
    """Edges (k,2) that are marked sharp, creased, or to be bevelled."""
    marks = attributes.marks
    bevels = [layer.values > 0 for layer in marks.layers if layer.name == "bevel_weight_edge"]
    return marks.edges[np.logical_or.reduce([marks.sharp, marks.crease > 0, *bevels])]


def followed(attributes: Attributes, lines: np.ndarray) -> Attributes:
    """The attributes without those of edges that are marks elsewhere than on `lines` (k,2), which are left.

    A line of marks that the new mesh does not follow would come out interrupted.
    """
    marks = attributes.marks
    off = ~np.isin(pair_keys(*marks.edges.T), pair_keys(*lines.T))
    kept = tuple(layer for layer in marks.layers if not layer.values[off].any())
    gone = tuple(layer.name for layer in marks.layers if layer not in kept)
    return replace(attributes, marks=replace(marks, layers=kept), left=attributes.left + gone)


def uv_seams(attributes: Attributes, surface: Surface) -> np.ndarray:
    """Edges (k,2) where islands of any UV map end."""
    return edge_union(*(_ends_of_islands(layer.values, surface) for layer in attributes.layers if is_uv(layer)))


def _ends_of_islands(uv: np.ndarray, surface: Surface) -> np.ndarray:
    """Edges (k,2) where islands of one map (corners,2) end.

    Between faces without area in the map there is no island, and nothing that a new mesh could follow: exporters write
    such maps, where a mesh has none.
    """
    triangles = surface.corner_vertex[surface.triangles]
    same = SAME_UV * np.ptp(uv, axis=0).max(initial=0)
    jumps = value_jumps(triangles, surface.triangles, uv, same)
    flat = np.flatnonzero(np.abs(signed_areas(uv, surface.triangles)) <= same * same)
    between = region_borders(triangles[flat], flat)
    return jumps[~np.isin(pair_keys(*jumps.T), pair_keys(*between.T))]


def material_borders(attributes: Attributes, surface: Surface) -> np.ndarray:
    """Edges (k,2) between faces of different materials."""
    triangles = surface.corner_vertex[surface.triangles]
    return region_borders(triangles, attributes.material_index[surface.triangle_face])
