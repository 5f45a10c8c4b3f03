"""Renumber a mesh in the order in which its unknowns are eliminated, by nested dissection (George 1973).

Neighbours in the order are neighbours in memory.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import MeshError
from ..linalg.nested_dissection import mesh_order
from ..maps.polygon_elements import polygon_mesh
from ..mesh.geometry import signed_areas
from .initial_maps import check_initial_map
from .pins import Pins, check_pins


@dataclass(frozen=True)
class Renumbered:
    """A mesh and its map, vertex order[k] as vertex k, and mirrored if need be so that most of it is not.

    Attributes
    ----------
    vertices, triangles, uv, pins : (n,3), (m,3), (n,2), renumbered
    order : (n,)
    mirror : (2,) signs of u and v
    """

    vertices: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray
    pins: Pins | None
    order: np.ndarray
    mirror: np.ndarray

    def bare(self) -> Renumbered:
        """The map, and what leads back from it, without the mesh."""
        return replace(self, vertices=self.vertices[:0].copy(), triangles=self.triangles[:0].copy())

    def original(self, w: np.ndarray) -> np.ndarray:
        """A map w (n,) complex as UVs (n,2) of the mesh as it was."""
        uv = np.empty((len(w), 2))
        uv[self.order] = np.column_stack([w.real, w.imag]) * self.mirror
        return uv

    def original_error(self, error: MeshError) -> MeshError:
        """An error with the vertices of the mesh as it was."""
        elements = self.order[error.elements] if error.kind in ("vertex", "edge") else error.elements
        return type(error)(error.cause, error.remedy, error.kind, elements)


def renumbered(
    vertices,
    triangles,
    uv,
    pins: tuple[np.ndarray, np.ndarray] | None,
    polygons: np.ndarray | None = None,
    order: np.ndarray | None = None,
) -> Renumbered:
    """Renumber a mesh (n,3), (m,3), its map (n,2), and pins: vertices (k,) and their places (k,2).

    polygons (m,): of every triangle; all corners of a quad are neighbours; order (n,): where it is known, which
    counts where triangles are polygons of their own.

    Raises
    ------
    FoldedUVError, PinError : see `initial_maps.check_initial_map` and `pins.check_pins`
    """
    uv = np.asarray(uv, float)
    check_initial_map(uv, triangles)
    mirror = np.array([np.sign(signed_areas(uv, triangles).sum()), 1.0])
    if polygons is not None and has_several(polygons):
        order = mesh_order(vertices, polygon_mesh(triangles, polygons).every_triangle())
    elif order is None:
        order = mesh_order(vertices, triangles)
    # What is kept of the mesh takes half of the memory that it came in.
    place = np.empty(len(order), np.int32)
    place[order] = np.arange(len(order))
    renumbered_pins = None
    if pins is not None and len(pins[0]):
        checked = check_pins(np.asarray(pins[0]), np.asarray(pins[1], float).reshape(-1, 2) * mirror, len(order))
        renumbered_pins = Pins(place[checked.vertices], checked.places)
    return Renumbered(
        vertices=vertices[order],
        triangles=place[triangles],
        uv=uv[order] * mirror,
        pins=renumbered_pins,
        order=order,
        mirror=mirror,
    )


def has_several(polygons: np.ndarray) -> bool:
    """Whether some of the triangles (m,) are of one polygon."""
    ordered = np.sort(polygons)
    return bool((ordered[1:] == ordered[:-1]).any())
