"""Components of a triangle mesh: what can be remeshed, apart or as a batch, and boundaries that lie on one another.

Imports solver, solver.mesh and solver.analysis.
Main names: split_components, Component, batched, join_coincident, reopened, OwnFrame.
"""

from ...lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    coincident_boundaries="JoinedBoundaries join_coincident reopened reopened_copies",
    component_batch="batched",
    components="Component Components split_components",
    own_frame="OwnFrame in_own_frame",
)
