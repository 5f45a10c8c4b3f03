"""Hold what is read of a mesh object: its surface, the polygons to work on, and its UVs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.analysis.facing import Y_UP as Y_UP
from ..solver.analysis.facing import Z_UP, SceneAxes
from ..solver.errors import NonFiniteError
from ..solver.mesh.surface import Surface, check_finite
from ..solver.parameterization.chart_indices import CornerPins
from ..solver.subdivision.modifier import SubdivisionModifier


@dataclass(frozen=True)
class Reading:
    """A surface, the polygons to work on (f,) bool, and of a UV layer, if there is one, the UVs (c,2) float32 and
    which of them are pinned (c,) bool; the Subdivision Surface modifier of the object, if it has one; and how it
    stands in the scene; and whether its vertices were split by a file format, so that sides that lie on one another are
    one."""

    surface: Surface
    faces: np.ndarray
    uv: np.ndarray | None
    pinned: np.ndarray | None
    subdivision: SubdivisionModifier | None = None
    axes: SceneAxes = Z_UP
    was_split: bool = False

    @property
    def all_pins(self) -> CornerPins | None:
        """UVs and pins of the whole mesh, None if it has no UVs."""
        return None if self.uv is None or self.pinned is None else CornerPins(self.pinned, self.uv)

    @property
    def pins(self) -> CornerPins | None:
        """Pins of the polygons to work on, None if they have none."""
        if self.uv is None or self.pinned is None:
            return None
        pinned = self.pinned & np.repeat(self.faces, np.diff(self.surface.face_start))
        return CornerPins(pinned, self.uv) if pinned.any() else None


def check_places(surface: Surface) -> None:
    """Raise NonFiniteError, with the vertices, where a coordinate of a face is no number."""
    check_finite(surface.positions, surface.corner_vertex[surface.triangles])


def check_uvs(surface: Surface, uv: np.ndarray, faces: np.ndarray | None = None) -> None:
    """Raise NonFiniteError, with the polygons, where a UV (c,2) of the polygons `faces` (f,) bool is no number."""
    wrong = ~np.isfinite(uv[surface.triangles]).all(axis=(1, 2))
    if faces is not None:
        wrong &= faces[surface.triangle_face]
    if wrong.any():
        polygons = np.unique(surface.triangle_face[wrong])
        raise NonFiniteError("A UV is not a finite number", "Unwrap these faces anew first", "face", polygons)
