"""Divergence-free flows: points that are moved take everything else along, and enclosed volumes stay as they are.

Imports solver.errors, solver.progress, solver.mesh and solver.contact.
Main names: flow, Flow, FlowOptions, FlowHandle, FlowField, ball_domain, mesh_domain.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    domain="FlowDomain ball_domain mesh_domain",
    enclosed_volume="EnclosedParts component_volumes restore_volumes",
    flow_map="Flow flow",
    handles="FlowHandle sampled_handles",
    kernel="FlowField interpolated_field",
    options="FlowOptions",
    paths="handle_paths",
)
