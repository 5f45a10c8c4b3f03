"""Surfaces of revolution: their axis, their profile, and the rings along which they come apart into bands and caps.

Imports solver.mesh and solver.linalg.
Main names: axis_of_revolution, Axis, profile_of, Profile, closed_profile_of, cheapest_bands, cheapest_rings,
rings_of_edges.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    axis="Axis axis_of_revolution has_axis",
    bands="cheapest_bands",
    closed_profile="ClosedProfile cheapest_rings closed_profile_of",
    profile="Profile harmonic_between profile_of",
    rings="rings_of_edges",
)
