"""Fit a mesh to a surface: vertices move so that the triangles between them come closer.

A round takes the closest points of samples of both the surface and the mesh, and moves the vertices so that the
distances along the lines between them vanish in the least squares sense (see `least_squares`), while vertices stay
near the centroids of their cells. What is the farthest then is looked at patch by patch (see `hausdorff_peaks`).
"""

from __future__ import annotations

import numpy as np

from ...mesh.closest_point import ClosestPoint, ClosestPointTracker
from ...mesh.geometry import vertex_normals
from ...progress import Progress, Steps, part_of
from ..edits.working_mesh import WorkingMesh
from ..relaxation.surface_samples import area_samples, join_samples, tip_samples
from .closest_pairs import Pairing
from .fit_state import FitState
from .hausdorff_peaks import lower_peaks

# Rounds of least squares.
ROUNDS = 5
# Samples of the surface per vertex.
SAMPLES = 6


def fit_to_surface(mesh: WorkingMesh, index: ClosestPoint, density: np.ndarray) -> Steps[WorkingMesh]:
    """Lower the distance between a mesh and a surface: the mean square first, then the largest; steps of the mesh.

    density (m,) of the surface's triangles, for the cells.
    """
    n = len(mesh.points)
    samples = join_samples(area_samples(index, SAMPLES * n, density), tip_samples(index, n))
    near = index.at_or_near(mesh.points, vertex_normals(mesh.points, mesh.triangles), mesh.near).faces
    state = FitState(mesh, Pairing(index, samples), density, ClosestPointTracker(ROUNDS + 2, start=near))
    for k in range(ROUNDS):
        if not state.step():
            break
        yield Progress("Fit", 0.6 * (k + 1) / ROUNDS)
    # Peaks are lowered by flips as well.
    return (yield from part_of(lower_peaks(state), 0.6, 0.4)) if mesh.delaunay else state.mesh
