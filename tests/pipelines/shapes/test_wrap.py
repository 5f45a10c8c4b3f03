"""A wrapped surface lies on the target, and its faces are apart where they are on the source."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from sphere_shapes import blob

from omt_uv.pipelines.shapes import wrap
from omt_uv.pipelines.shapes.landmark_pairs import LandmarkPoint, Pairs
from omt_uv.pipelines.shapes.match import MatchJob, match_surfaces
from omt_uv.solver.contact.self_intersections import intersecting_pairs
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.results import RegistrationOptions

NONE = np.zeros((0, 2), np.int64)


def plate():
    """A thin body without symmetry, and vertices at its ends."""
    V, F = blob(3, seed=1)
    V = V * [1.0, 1.3, 0.02]
    return V, F, [int(k) for k in (V[:, 0].argmax(), V[:, 0].argmin(), V[:, 1].argmax(), V[:, 1].argmin())]


def test_faces_that_meet_are_taken_apart(monkeypatch):
    V, F, ends = plate()
    points = tuple(LandmarkPoint(str(k), vertex=k) for k in ends)
    surface = triangle_surface(V, F, NONE)
    job = MatchJob(surface, surface, Pairs(points, points), RegistrationOptions(), NONE)
    found = drain(match_surfaces(job))
    assert found.intersections is None and "intersections" not in found.report()
    # A vertex in the middle of one side comes out at the other, beside the vertex there.
    pushed = found.wrapped.copy()
    middle = int((np.abs(pushed[:, :2]).sum(axis=1) + 9 * (pushed[:, 2] < 0)).argmin())
    pushed[middle] = pushed[middle] * [1, 1, 0] + [0.02, 0.013, 1.1 * pushed[:, 2].min()]
    assert len(intersecting_pairs(pushed, F))

    def meeting(_job):
        yield from ()
        return replace(found, wrapped=pushed)

    monkeypatch.setattr(wrap, "match_surfaces", meeting)
    wrapped = drain(wrap.wrap_surfaces(job))
    assert wrapped.intersections == 0 == len(intersecting_pairs(wrapped.wrapped, F))
    assert np.abs(wrapped.wrapped[ends] - pushed[ends]).max() == 0 and not wrapped.warnings
    assert wrapped.fit < 0.01 and wrapped.report()["intersections"] == 0


@functools.cache
def matched_plates():
    """A plate and one twice as large: the job, and its match."""
    V, F, ends = plate()
    points = tuple(LandmarkPoint(str(k), vertex=k) for k in ends)
    source, target = triangle_surface(V, F, NONE), triangle_surface(2 * V, F, NONE)
    job = MatchJob(source, target, Pairs(points, points), RegistrationOptions(), NONE)
    return job, drain(match_surfaces(job))


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("left", [0, 1, 2])
def test_faces_are_compared_with_the_source_of_the_size_of_the_target(monkeypatch, mirrored, left):
    """Mirrored where the match is; landmarks stay, and what planes leave is smoothed, and told of."""
    V, _, ends = plate()
    job, found = matched_plates()
    job = replace(job, options=replace(job.options, mirrored=mirrored))
    asked = []

    def matched(job):
        assert job.options.closeness == wrap.CLOSENESS
        yield from ()
        return found

    def planes(before, after, faces, free):
        asked.append((before, after, free))
        return after, np.zeros((min(left, 1), 2), int)

    def smoothed(before, after, faces, free):
        asked.append((before, after, free))
        return after + 1, np.zeros((max(left - 1, 0), 2), int)

    for name, function in (
        ("match_surfaces", matched),
        ("without_new_intersections", planes),
        ("smoothed_apart", smoothed),
    ):
        monkeypatch.setattr(wrap, name, function)
    result = drain(wrap.wrap_surfaces(job))
    assert len(asked) == 1 + (left > 0)
    for before, after, free in asked:
        np.testing.assert_allclose(before, 2 * V * [-1 if mirrored else 1, 1, 1], rtol=1e-9)
        np.testing.assert_array_equal(after, found.wrapped)
        assert np.flatnonzero(~free).tolist() == sorted(ends)
    np.testing.assert_array_equal(result.wrapped, found.wrapped + (left > 0))
    assert result.intersections == max(left - 1, 0)
    assert sum("through one another" in text for text in result.warnings) == (left == 2)
