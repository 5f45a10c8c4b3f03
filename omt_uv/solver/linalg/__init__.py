"""Sparse linear systems of meshes: direct and iterative solvers, elimination orders, and L-BFGS.

Imports solver.errors and solver.mesh.
Main names: Factor, solve_spd, solve_general, LaplacianSolver, SymmetricSweeps, AdditiveSchwarz, KeptFactor, Dissection,
LBFGS.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    additive_schwarz="AdditiveSchwarz schwarz_solver",
    kept_factor="KeptFactor",
    lbfgs="LBFGS",
    minimum_cut="capacities least_cut",
    multigrid="LaplacianSolver Multigrid",
    nested_dissection="Dissection kd_parts mesh_order vertex_graph",
    symmetric_sweeps="SymmetricSweeps sweeping_solver",
    vertex_rows="RowPattern VertexRows",
    sparse="Factor conjugate_gradients minimum_degree solve_conjugate_gradients solve_general solve_spd",
)
