"""Say how far a flow reaches, which way handles go, and how exactly it is followed."""

from __future__ import annotations

from dataclasses import dataclass

STRAIGHT = "straight"
RADIUS = "radius"
BLEND = "blend"
RIGID = "rigid"
PATHS = (RIGID, STRAIGHT, RADIUS, BLEND)
# Samples of one handle are at least this share of the radius apart, so that the system is well conditioned,
SPACING = 0.18
# and at most so many.
MOST_SAMPLES = 96


@dataclass(frozen=True)
class FlowOptions:
    """How to flow.

    radius : how far a handle reaches, as a share of the diagonal of what flows; the kernel is exp(-lambda r^2) with
        lambda = 1 / radius^2 in units of the diagonal
    path : "rigid" (points of one handle turn together), "straight", "radius" (directions and distances from the middle
        change evenly) or "blend" (straight in the middle, radius far out)
    samples : chords that a curved path is made of
    tolerance : error of the flow, as a share of the diagonal, per unit of time; handles move in a unit of time
    diagonal : the length that radius and tolerance are shares of; 0: of what flows. A flow and the one that takes it
        back have it in common
    spacing : samples of a handle of many points are so far apart, as a share of the radius; most_samples of one
    mend : look for faces that newly pass through one another, and take them apart
    """

    radius: float = 0.2
    path: str = RIGID
    samples: int = 32
    tolerance: float = 1e-5
    diagonal: float = 0.0
    spacing: float = SPACING
    most_samples: int = MOST_SAMPLES
    mend: bool = True
