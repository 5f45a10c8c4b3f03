"""Notice handles that pass closely by one another, and keep what is around them calm.

A field that is to differ within a distance much smaller than the radius needs strong sources, and moves what is a
radius away by about radius / distance as much as the handles; on a coarse mesh faces then meet by hundreds. A second,
narrower kernel beside the first takes the difference over. How much of it depends on the ways of handles alone, and is
the same on the way back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .integration import FlowStep

# Moments at which handles are looked at, and fewer where samples are more than so many.
MOMENTS = 32
FEW_MOMENTS = 8
MANY_SAMPLES = 256
# Strength of a passing up to which one kernel does, from which on the second has all of its share, and that share.
CALM = 3.0
STRONG = 6.0
NEAR = 0.2
# Speed of what flows over that of the handles from which on it is worth a warning.
FAST = 3.0


@dataclass(frozen=True)
class Passing:
    """How strongly two handles (numbers) contradict each other at the worst moment: by what they differ, over the
    fastest, times radius over distance; and that distance. 0, -1, -1 and 0 where one handle alone is there."""

    strength: float
    handles: tuple[int, int]
    distance: float

    @property
    def near(self) -> float:
        """The share of the narrow kernel."""
        return NEAR * float(np.clip((self.strength - CALM) / (STRONG - CALM), 0.0, 1.0))

    def warning(self, names: list[str], surge: float, intersecting: np.ndarray) -> tuple[str, ...]:
        """What to tell, if anything, of a flow with a surge, and pairs (k,2) of faces that newly intersect."""
        if self.handles[0] < 0 or not (surge > FAST or (len(intersecting) and self.strength > CALM)):
            return ()
        one, other = (names[k] for k in self.handles)
        return (
            f"{one} and {other} are {100 * self.distance:.2g} % of the diagonal apart on their way and go different "
            f"ways; what is around them moves up to {surge:.2g} times as fast as they do",
        )


def closest_passing(path: np.ndarray, owner: np.ndarray, radius: float) -> Passing:
    """The closest passing of samples of handles at places path (k + 1, p, d) at even steps of time, owner (p,) says of
    which handle; lengths are shares of the diagonal."""
    chords, found = len(path) - 1, Passing(0.0, (-1, -1), 0.0)
    count = MOMENTS if len(owner) <= MANY_SAMPLES else FEW_MOMENTS
    different = owner[:, None] != owner[None]
    for time in (np.arange(count) + 0.5) / count:
        k = min(int(time * chords), chords - 1)
        velocity = (path[k + 1] - path[k]) * chords
        fastest = float(np.linalg.norm(velocity, axis=1).max())
        at = path[k] + (time * chords - k) * (path[k + 1] - path[k])
        apart = np.linalg.norm(at[:, None] - at[None], axis=2)
        differ = np.linalg.norm(velocity[:, None] - velocity[None], axis=2)
        strength = np.where(different, differ / np.maximum(apart, np.finfo(float).tiny), 0.0)
        i, j = np.unravel_index(int(strength.argmax()), strength.shape)
        if fastest > 0 and strength[i, j] * radius > found.strength * fastest:
            pair = min(int(owner[i]), int(owner[j])), max(int(owner[i]), int(owner[j]))
            found = Passing(float(strength[i, j]) * radius / fastest, pair, float(apart[i, j]))
    return found


def greatest_surge(path: np.ndarray, steps: list[FlowStep], probes: np.ndarray) -> float:
    """The greatest speed of probes (q,d) that flow along with steps over that of handles at the same time, whose
    samples are at places path (k + 1, p, d) at even steps of time."""
    surge, time, chords = 0.0, 0.0, len(path) - 1
    for step in steps:
        k = min(int((time + 0.5 * step.length) * chords), chords - 1)
        fastest = float(np.linalg.norm((path[k + 1] - path[k]) * chords, axis=1).max())
        if fastest > 0:
            surge = max(surge, float(np.linalg.norm(step.fields[0](probes), axis=1).max()) / fastest)
        probes = step(probes)
        time += step.length
    return surge
