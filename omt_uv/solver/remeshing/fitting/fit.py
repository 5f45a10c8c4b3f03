"""Vertices moved so that the triangles between them come closer to the surface.

A round takes the closest points of samples of both the surface and the mesh, and moves the vertices so that the
distances along the lines between them vanish in the least squares sense (see `displacement.py`), while vertices stay
near the centroids of their cells. What is the farthest then is looked at piece by piece (see `peaks.py`).
"""

from __future__ import annotations

import numpy as np

from ...mesh.closest_point import ClosestPoint, ClosestPointTracker
from ...progress import Progress, Steps, part_of
from ..edits.working_mesh import Draft
from ..relaxation.surface_samples import area_samples, joined, tip_samples
from .closest_pairs import Pairing
from .fit_state import Fitting
from .hausdorff_peaks import lower_peaks

ROUNDS = 5
# Samples of the surface per vertex.
SAMPLES = 6


def fit_to_surface(draft: Draft, index: ClosestPoint, density: np.ndarray) -> Steps[Draft]:
    """A mesh near a surface with less distance between the two: the mean square first, then the largest.

    density (m,) of the surface's triangles, for the cells.
    """
    n = len(draft.points)
    samples = joined(area_samples(index, SAMPLES * n, density), tip_samples(index, n))
    fitting = Fitting(draft, Pairing(index, samples), density, ClosestPointTracker(ROUNDS + 1))
    for k in range(ROUNDS):
        if not fitting.step():
            break
        yield Progress("Fit", 0.6 * (k + 1) / ROUNDS)
    # Peaks are lowered by flips as well.
    return (yield from part_of(lower_peaks(fitting), 0.6, 0.4)) if draft.delaunay else fitting.draft
