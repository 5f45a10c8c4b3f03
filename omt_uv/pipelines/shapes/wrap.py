"""Match one object's surface with another's, and give it the other's shape: no faces pass through one another there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...solver.flows.creases import without_new_intersections
from ...solver.flows.self_intersections import FaceCrossings
from ...solver.mesh.geometry import face_areas
from ...solver.progress import Progress, Steps, part_of
from .match import MatchJob, MatchResult, distance_from, largest_part, match_surfaces

# Share of the time that the match itself takes.
MATCHING = 0.95


def wrap_surfaces(job: MatchJob) -> Steps[MatchResult]:
    """The same as `match_surfaces`, the source's faces apart where they are apart on the source.

    All vertices of a wrapped surface lie on the target, but the flat faces between them cut its creases short, and may
    meet across one. They are moved behind planes that are between them on the source, carried along.
    """
    result = yield from part_of(match_surfaces(job), 0.0, MATCHING)
    yield Progress("Wrapping", MATCHING)
    source, target = largest_part(job.source, "source"), largest_part(job.target, "target")
    other = (target.vertices, target.triangles)
    size = np.sqrt([face_areas(*surface).sum() for surface in ((source.vertices, source.triangles), other)])
    before, after = size[1] / size[0] * source.vertices, result.wrapped[source.used]
    if job.options.mirrored:
        before = before * [-1, 1, 1]
    free = np.ones(len(before), bool)
    free[source.triangles[result.landmarks.source_faces].ravel()] = False
    positions, pairs = without_new_intersections(before, after, FaceCrossings(source.triangles), free)
    wrapped, warnings = result.wrapped.copy(), result.warnings
    wrapped[source.used] = positions
    if len(pairs):
        warnings = (*warnings, f"{len(pairs)} pairs of faces of the wrapped source pass through one another")
    return replace(
        result,
        wrapped=wrapped,
        fit=distance_from(other, positions, source.triangles),
        intersections=len(pairs),
        warnings=warnings,
    )
