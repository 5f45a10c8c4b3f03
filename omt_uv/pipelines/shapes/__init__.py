"""Shapes compared and matched: what the operators and commands of shapes share, from arrays to arrays.

Imports pipelines, settings, errors, solver, solver.registration, solver.strain and solver.transfer.
Main names: MatchJob, MatchResult, match_surfaces, transferred, Pairs, pairs_of, strain_of.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    landmark_pairs="LandmarkPoint Pairs pairs_of",
    match="MatchJob MatchResult match_surfaces",
    onto="transferred",
    strain="strain_of",
)
