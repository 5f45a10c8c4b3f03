"""Notice handles that pass closely by one another: what is around them then moves farther than they do.

A field that is to differ within a distance much smaller than the radius needs strong sources, and moves what is a
radius away by about radius / distance as much as the handles. On a coarse mesh faces meet there by hundreds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .integration import FlowStep

# Rates of flow over those of the handles from which on it is worth a warning.
STRONG = 3.0
# A radius of so many distances of the handles is calm.
CALM = 2.0


@dataclass(frozen=True)
class Surge:
    """The greatest speed of what flows over that of the handles at the same time; the two handles (numbers) that are
    closest for how they differ then, and their distance, or -1, -1 and 0 where one handle alone is there."""

    rate: float
    handles: tuple[int, int]
    distance: float

    def warning(self, names: list[str], radius: float) -> str | None:
        """What to tell, if anything; radius and distance as shares of the diagonal."""
        if self.rate < STRONG or self.handles[0] < 0:
            return None
        one, other = (names[k] for k in self.handles)
        text = (
            f"{one} and {other} are {100 * self.distance:.2g} % of the diagonal apart on their way and go different "
            f"ways, so that what is around them moves {self.rate:.2g} times as fast as they do"
        )
        calm = CALM * self.distance
        return f"{text}; a radius of {calm:.2g} is calmer" if calm < radius else text


def greatest_surge(path: np.ndarray, owner: np.ndarray, steps: list[FlowStep], probes: np.ndarray) -> Surge:
    """The greatest surge of steps, seen by probes (q,d) that flow along; samples of handles are at places
    path (k + 1, p, d) at even steps of time, owner (p,) says of which handle."""
    found = Surge(0.0, (-1, -1), 0.0)
    time, count = 0.0, len(path) - 1
    for step in steps:
        k = min(int((time + 0.5 * step.length) * count), count - 1)
        velocity = (path[k + 1] - path[k]) * count
        fastest = float(np.linalg.norm(velocity, axis=1).max())
        field = step.fields[0]
        rate = float(np.linalg.norm(field(probes), axis=1).max()) / fastest if fastest > 0 else 0.0
        if rate > found.rate:
            found = Surge(rate, *_closest(field.centres[: len(owner)], velocity, owner))
        probes = step(probes)
        time += step.length
    return found


def _closest(places: np.ndarray, velocity: np.ndarray, owner: np.ndarray) -> tuple[tuple[int, int], float]:
    """Two handles that differ most for their distance, of samples at places (p,d), and that distance."""
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    differ = np.linalg.norm(velocity[:, None] - velocity[None], axis=2)
    strength = np.where(owner[:, None] != owner[None], differ / np.maximum(apart, np.finfo(float).tiny), 0.0)
    i, j = np.unravel_index(int(strength.argmax()), strength.shape)
    if not strength[i, j] > 0:
        return (-1, -1), 0.0
    first, second = sorted((int(owner[i]), int(owner[j])))
    return (first, second), float(apart[i, j])
