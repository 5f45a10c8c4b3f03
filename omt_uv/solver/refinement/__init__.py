"""Refinement of maps by projected Newton: exact areas, no fold, least shear; pins, batches of charts, coarser meshes.

Imports solver.mesh, solver.linalg, solver.analysis and solver.maps.
Main names: RefinementOptions, Refinement, refine_batch, minimise_in_stages, Quality, QUALITIES, coarsen_disk.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    batch_refine="BatchMaps refine_batch",
    boundary_barrier="BoundaryBarrier make_barrier",
    continuation="ContinuationResult MapProblem minimise_in_stages",
    continuation_rules="QUALITIES Quality",
    initial_maps="InitialMap unroll",
    mesh_hierarchy="CoarseMesh coarsen_disk",
    projected_newton="CircleMotion FreeMotion LineMotion NewtonProblem newton_step",
    refine="BOUNDARIES Refinement RefinementOptions",
    vertex_sweeps="Smoother",
)
