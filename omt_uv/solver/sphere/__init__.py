"""Closed surfaces of genus 0 mapped to the unit sphere: conformally, or with prescribed areas and little shear.

Imports solver.mesh, solver.linalg, solver.maps, solver.transport, solver.conformal and solver.refinement.
Main names: sphere_map (in sphere_map), conformal_sphere, flow_map, multilevel_start, sphere_refine.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    conformal="ConformalSphere conformal_sphere",
    dominitz_tannenbaum="SphereFlow flow_map",
    multilevel="multilevel_start",
    refine="SphereRefinement sphere_refine",
    sphere_map="SphereMap",
)
