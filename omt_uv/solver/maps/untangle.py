"""Untangle a map that has folds, by one Tutte system (Tutte 1963, Floater 2003).

Mean value weights taken from the folded map's own geometry reproduce it where its stars are valid; with all angles
taken as positive the weights are positive everywhere, and with a convex boundary they make an embedding.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import face_areas, signed_areas
from .contacts import covers_itself, touches_itself
from .energy import elements, energy
from .tutte import arc_length_parameters, tutte

# Mean energy above which an untangled map is no better than a fresh one: Newton would spend itself on single faces.
USABLE = 100.0


def count_folds(uv: np.ndarray, triangles: np.ndarray) -> int:
    """Number of faces (m,3) of a map (n,2) that are not counter-clockwise."""
    return int((~(signed_areas(uv, triangles) > 0)).sum())


def is_one_to_one(uv: np.ndarray, triangles: np.ndarray, loop: np.ndarray) -> bool:
    """Whether no face (m,3) of a map uv (n,2) folds, it does not cover itself, nor its boundary (b,) lie on itself."""
    apart = count_folds(uv, triangles) == 0 and not touches_itself(uv, loop)
    return apart and not covers_itself(uv @ [1, 1j], loop)


def untangle(
    uv: np.ndarray, positions: np.ndarray, triangles: np.ndarray, loop: np.ndarray, boundary: np.ndarray
) -> tuple[np.ndarray, str | None]:
    """An embedding near uv (n,2) with the loop (b,) at points boundary (b,2) of a convex curve, and what was done.

    Two systems are tried: mean value weights of the map itself, and where that folds or squeezes faces beyond use,
    those of the surface, or equal ones where these fold. The second return value is None after the first and a warning
    after the second.
    """
    straight = tutte(uv, triangles, loop, boundary)
    first = map_energy(straight, positions, triangles)
    if first <= USABLE:
        return straight, None
    fresh = tutte(positions, triangles, loop, boundary)
    if count_folds(fresh, triangles):
        # Needles give weights that double precision does not solve; equal ones are right, and far from the areas.
        equal = tutte(positions, triangles, loop, boundary, equal=True)
        fresh = min(fresh, equal, key=lambda start: count_folds(start, triangles))
    fewer = count_folds(fresh, triangles) < count_folds(straight, triangles)
    if fewer or map_energy(fresh, positions, triangles) < first:
        return fresh, "The start could not be untangled; the refinement starts from a mean value map of the surface"
    return straight, None


def map_energy(uv: np.ndarray, positions: np.ndarray, triangles: np.ndarray) -> float:
    """Mean of shear and area error of a map (n,2), scaled to the area of the surface; infinite if it folds, or has no
    area."""
    area, covered = face_areas(positions, triangles), np.abs(signed_areas(uv, triangles)).sum()
    if covered == 0:
        return np.inf
    scale = np.sqrt(area.sum() / covered)
    return energy(elements(positions, triangles, area), scale * (uv[:, 0] + 1j * uv[:, 1]), 1.0)


def circle_boundary(uv: np.ndarray, loop: np.ndarray, radius: float) -> np.ndarray | None:
    """Boundary of uv (n,2) pushed radially on to the circle about 0, (b,2); None unless that keeps its order."""
    w = uv[loop, 0] + 1j * uv[loop, 1]
    if not (np.abs(w) > 0).all():
        return None
    turn = np.angle(np.roll(w, -1) / w)
    if not (turn > 0).all() or round(turn.sum() / (2 * np.pi)) != 1:
        return None
    return uv[loop] * (radius / np.abs(w))[:, None]


def arc_length_boundary(positions: np.ndarray, loop: np.ndarray, radius: float) -> np.ndarray:
    """The boundary loop (b,) of a surface spread over the circle by its length, (b,2)."""
    angle = 2 * np.pi * arc_length_parameters(positions, loop)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])
