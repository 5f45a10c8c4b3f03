"""Hold what is read of a mesh object: its surface, the polygons to work on, and its UVs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.analysis.facing import Z_UP, SceneAxes
from ..solver.mesh.surface import Surface
from ..solver.parameterization.chart_indices import CornerPins
from ..solver.subdivision.modifier import SubdivisionModifier

# Of files whose coordinates are taken as they are, in formats in which Y is up by custom.
Y_UP = SceneAxes(up=(0.0, 1.0, 0.0), viewer=(0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Reading:
    """A surface, the polygons to work on (f,) bool, and of a UV layer, if there is one, the UVs (c,2) float32 and
    which of them are pinned (c,) bool; the Subdivision Surface modifier of the object, if it has one; and how it
    stands in the scene."""

    surface: Surface
    faces: np.ndarray
    uv: np.ndarray | None
    pinned: np.ndarray | None
    subdivision: SubdivisionModifier | None = None
    axes: SceneAxes = Z_UP

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
