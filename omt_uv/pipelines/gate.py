"""Look at the UVs of a run once more, as they are stored: a last gate that folds and overlap do not pass unsaid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..solver.errors import EmptyMeshError, plural, two_digits
from ..solver.maps.distortion import NEGLIGIBLE_AREA
from ..solver.maps.embedding import check_layout
from ..solver.mesh.geometry import face_areas
from .distortion import triangles_of
from .layout import OVERLAP
from .reading import Reading


@dataclass(frozen=True)
class Gate:
    """What was found: polygons with a folded triangle, of so many, and the share of the UV area under several faces."""

    faces: int
    folds: int
    overlap: float

    def report(self) -> dict[str, float]:
        """Figures for a report."""
        return asdict(self)

    def warnings(self, before: Gate | None = None) -> tuple[str, ...]:
        """What is to be said: nothing where there is neither fold nor overlap; `before` the run, if there were UVs."""
        told = []
        if self.folds:
            # A new mesh has other faces: shares of them tell, not how many there are.
            same = before is not None and self.folds * before.faces <= before.folds * self.faces
            count = plural(self.folds, "1 face is", "{} faces are")
            told.append(f"{count} folded in the UVs{', as before' if same else ''}")
        if self.overlap > OVERLAP:
            same = before is not None and self.overlap <= before.overlap + OVERLAP
            share = two_digits(self.overlap)
            told.append(f"{share} of the UV area is under several faces{', as before' if same else ''}")
        return tuple(told)


def gate(readings: Sequence[Reading], apart: bool = False) -> Gate:
    """Folds and overlap of the UVs of the chosen polygons of all readings, which share a texture.

    apart : islands may lie on one another, and only overlap inside of them counts
    """
    try:
        found = triangles_of(readings)
    except EmptyMeshError:
        return Gate(0, 0, 0.0)
    area = face_areas(found.positions, found.triangles)
    real = area > NEGLIGIBLE_AREA * area.sum()
    layout = check_layout(found.triangles[real], found.uv[real], apart)
    folded = np.unique(found.polygons[real][layout.folded])
    return Gate(len(np.unique(found.polygons)), len(folded), layout.overlap)
