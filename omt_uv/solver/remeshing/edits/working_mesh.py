"""Hold a mesh in the making, and what must not change about it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...mesh.topology import twins


@dataclass(frozen=True)
class WorkingMesh:
    """A mesh in the making: points (n,3), triangles (m,3).

    fixed (n,) bool: vertices that stay, which come first; locked: sorted keys (`topology.pair_keys`) of edges that
    stay; delaunay: whether edges flip to Delaunay as vertices move; near (n,): a triangle of the surface about at every
    vertex, where these are known, so that closest points need not be searched for
    """

    points: np.ndarray
    triangles: np.ndarray
    fixed: np.ndarray
    locked: np.ndarray
    delaunay: bool = True
    near: np.ndarray | None = None

    @cached_property
    def twin(self) -> np.ndarray:
        """Opposite halfedges (3m,), for edits, which ask for them again and again."""
        return twins(self.triangles)

    def turned_into(
        self,
        points: np.ndarray,
        triangles: np.ndarray,
        twin: np.ndarray,
        fixed: np.ndarray | None = None,
        near: np.ndarray | None = None,
    ) -> WorkingMesh:
        """This mesh with other points (n,3) and triangles (m,3), whose opposite halfedges (3m,) are known, and other
        vertices that stay, (n,) bool, if there are others; and where on the surface they are (n,), if that is known."""
        fixed = self.fixed if fixed is None else fixed
        mesh = replace(self, points=points, triangles=triangles, fixed=fixed, near=near)
        vars(mesh)["twin"] = twin
        return mesh
