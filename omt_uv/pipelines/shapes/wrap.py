"""Match one object's surface with another's, and give it the other's shape: no faces pass through one another there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...solver.contact.self_intersections import FaceCrossings
from ...solver.errors import plural
from ...solver.flows.creases import without_new_intersections
from ...solver.flows.smoothing import smoothed_apart
from ...solver.mesh.geometry import face_areas
from ...solver.progress import Progress, Steps, part_of
from .match import MatchJob, MatchResult, match_surfaces

# Share of the time that the match itself takes.
MATCHING = 0.95
# Distance of faces from the target over its diagonal from which on vertices gather there.
CLOSENESS = 0.005


def wrap_surfaces(job: MatchJob) -> Steps[MatchResult]:
    """The same as `match_surfaces`, with faces close to the target, and apart where they are apart on the source.

    All vertices of a wrapped surface lie on the target, but the flat faces between them cut its creases short, and may
    meet across one. They are moved behind planes that are between them on the source, carried along, and smoothed where
    that does not suffice.
    """
    if job.options.closeness is None:
        job = replace(job, options=replace(job.options, closeness=CLOSENESS))
    result = yield from part_of(match_surfaces(job), 0.0, MATCHING)
    yield Progress("Wrapping", MATCHING)
    source, target = result.parts
    size = np.sqrt([face_areas(part.vertices, part.triangles).sum() for part in result.parts])
    before, after = size[1] / size[0] * source.vertices, result.wrapped[source.used]
    if job.options.mirrored:
        before = before * [-1, 1, 1]
    free = np.ones(len(before), bool)
    landmarks = result.landmarks
    free[source.triangles[landmarks.source_faces][landmarks.source_barycentric > 0]] = False
    faces = FaceCrossings(source.triangles)
    positions, pairs = without_new_intersections(before, after, faces, free)
    if len(pairs):
        positions, pairs = smoothed_apart(before, positions, faces, free)
    wrapped, warnings = result.wrapped.copy(), result.warnings
    wrapped[source.used] = positions
    if len(pairs):
        who = plural(
            len(pairs), "A pair of faces of the wrapped source passes", "{} pairs of faces of the wrapped source pass"
        )
        warnings = (*warnings, f"{who} through one another")
    return replace(result, wrapped=wrapped, intersections=len(pairs), warnings=warnings)
