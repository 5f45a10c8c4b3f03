"""Surfaces of revolution: their axis, their profile, and the rings along which they come apart into bands and caps.

Imports solver.mesh and solver.linalg.
Main names: axis_of_revolution, Axis, profile_of, Profile, cheapest_bands, rings_of_edges.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    axis="Axis axis_of_revolution has_axis",
    bands="cheapest_bands",
    profile="Profile profile_of",
    rings="rings_of_edges",
)
