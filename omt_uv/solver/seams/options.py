"""State how far seams are to be searched, in one dataclass."""

from __future__ import annotations

from dataclasses import dataclass

# Vertices of the coarse surface that seams are searched on.
COARSE_VERTICES = 1200
# Coarse surfaces that seams are grown on.
TRIALS = 3
# The spread that cuts leave goes with this power of the square of log(shear) that maps have.
SPREAD_BY_SHEAR = 1.7
# What is no longer than a square of the whole area by so many times stays in one piece.
COMPACT = 1.4
# Arcs that one component gets at most.
MOST_ARCS = 160


@dataclass(frozen=True)
class SearchOptions:
    """How far seams are searched.

    Attributes
    ----------
    vertices : of the coarse surface
    trials : coarse surfaces that seams are grown on; the best are improved
    arcs : that are added at most
    rounds : of taking arcs back and growing others; 0 for none
    symmetric : seams of a surface that is its own mirror image are their own, too
    """

    vertices: int = COARSE_VERTICES
    trials: int = TRIALS
    arcs: int = MOST_ARCS
    rounds: int = 8
    symmetric: bool = True
