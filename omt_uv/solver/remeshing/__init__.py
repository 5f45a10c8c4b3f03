"""Remeshing: a new mesh of a surface with exactly as many vertices as asked for, and nearly equilateral triangles.

Imports solver.mesh, solver.analysis and the folders below, each of which is one step: components, edits, initial,
relaxation, fitting.
Main names: remesh, RemeshSource, RemeshOptions, Remesh, STRATEGIES.
"""

from typing import TYPE_CHECKING

from ..lazy import lazy

if TYPE_CHECKING:
    from .initial.component_maps import RemeshSource as RemeshSource
    from .initial.options import STRATEGIES as STRATEGIES
    from .initial.options import RemeshOptions as RemeshOptions
    from .remesh_surface import Remesh as Remesh
    from .remesh_surface import remesh as remesh

__getattr__, __all__ = lazy(
    __name__,
    remesh_surface="Remesh remesh",
    **{"initial.component_maps": "RemeshSource", "initial.options": "STRATEGIES RemeshOptions"},
)
