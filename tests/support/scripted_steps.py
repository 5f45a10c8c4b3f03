"""Solvers that are written in advance, and what is told on the way."""

from __future__ import annotations

from omt_uv.solver.progress import Progress


def done(value, *fractions):
    """A solver that tells these fractions, and ends with a value or an error."""
    for fraction in fractions:
        yield Progress("A", fraction)
    if isinstance(value, Exception):
        raise value
    return value


def worked(value):
    """The same, that begins and comes to its end."""
    return done(value, 0.0, 1.0)


def told(steps):
    """The result of a solver and the fractions that it told."""
    found = []
    try:
        while True:
            found.append(next(steps).fraction)
    except StopIteration as stop:
        return stop.value, found
