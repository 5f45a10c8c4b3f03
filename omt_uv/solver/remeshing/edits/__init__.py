"""Edits of a mesh in the making: edges split, collapsed and flipped, many at once, at fixed topology.

Imports solver, solver.mesh and solver.remeshing.components.
Main names: WorkingMesh, split_edges, collapse_edges, make_delaunay_embedded, reach_vertex_count, split_long_edges.
"""

from ...lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    delaunay_flips="flip_if_valid make_delaunay_embedded",
    long_edges="refine_for_maps split_component split_long_edges",
    split_collapse="Edit collapse_edges independent_splits interior_edges split_edges",
    working_mesh="WorkingMesh",
    vertex_count="SizingField StuckError apportion edge_length min_face_count min_vertex_count reach_vertex_count",
)
