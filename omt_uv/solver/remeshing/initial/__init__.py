"""The first mesh of a component: samples on one map, triangles of another (B. Gu 2018), or its own edges decimated.

Imports solver, solver.mesh, solver.maps, solver.transport, solver.cutting, solver.conformal, solver.refinement,
solver.parameterization, solver.sphere, solver.remeshing.components and solver.remeshing.edits.
Main names: RemeshSource, RemeshOptions, STRATEGIES, ComponentMaps, make_initial_mesh, decimated.
"""

from ...lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    arc_network="ArcNetwork ArcSamples find_arcs sample_arcs",
    component_maps="ComponentMaps RemeshSource",
    decimation="decimated decimated_between_lines",
    disk_samples="triangulate_chart",
    initial_mesh="InitialMesh make_initial_mesh",
    options="STRATEGIES RemeshOptions",
    sphere_samples="sample_sphere",
    stitching="stitch",
)
