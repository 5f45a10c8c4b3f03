"""Shapes compared, matched and divided: what operators and commands of shapes share, from arrays to arrays.

Imports pipelines, settings, errors, solver and its rooms of registration, strain, partition, flows and transfer.
Main names: MatchJob, MatchResult, match_surfaces, transferred, pairs_of, strain_of, partition_surface, carry_to_cells.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    landmark_pairs="LandmarkPoint Pairs pairs_of",
    match="MatchJob MatchResult match_surfaces",
    wrap="wrap_surfaces",
    onto="transferred",
    strain="strain_of",
    cell_attributes="carry_to_cells",
    partition="Partition partition_surface",
)
