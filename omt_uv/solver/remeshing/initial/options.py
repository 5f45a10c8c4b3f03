"""State how to remesh, in one record that every step reads."""

from __future__ import annotations

from dataclasses import dataclass

# Map to sample on and map to triangulate on, each measure-preserving ("app") or conformal ("cfp"); B. Gu 2018.
STRATEGIES = ("app-cfp", "app-app", "cfp-cfp", "cfp-app")
# Rounds of relaxation after which vertices have settled as a rule.
ROUNDS = 30


@dataclass(frozen=True)
class RemeshOptions:
    """How to remesh a surface.

    Parameters
    ----------
    count_of : what is counted, "vertices" or "faces"
    preserve_boundary : keep vertices on boundaries and on their corners; without, a boundary still is one, but its
        vertices slide until they are evenly apart, and it is smoothed as far as the new edges are too long to show it
    strategy : one of STRATEGIES, the map to sample on and the map to triangulate on. What follows keeps to it: after
        samples on the conformal map no vertices are carried to where the measure asks for them, after triangles of the
        measure-preserving one no edges flip to Delaunay on the surface
    fit : move vertices off the surface to halve the distance of the triangles to it
    rounds : of relaxation on the surface; 0 leaves the strategy's mesh as it is
    grading : most that edges grow by per length, see `density.graded_density`; 0 for as fast as the density has it

    Raises ValueError where a value is none of those that there are.
    """

    count_of: str = "vertices"
    preserve_boundary: bool = True
    strategy: str = STRATEGIES[0]
    fit: bool = True
    rounds: int = ROUNDS
    grading: float = 0.0

    def __post_init__(self) -> None:
        if self.strategy not in STRATEGIES:
            raise ValueError(f"strategy must be one of {', '.join(STRATEGIES)}, not {self.strategy!r}")
        if self.count_of not in ("vertices", "faces"):
            raise ValueError(f"count_of must be 'vertices' or 'faces', not {self.count_of!r}")

    @property
    def counts_vertices(self) -> bool:
        """Whether the count is of vertices, and not of faces."""
        return self.count_of == "vertices"

    @property
    def samples_by_measure(self) -> bool:
        """Whether vertices are where the measure of the surface asks for them, or where a conformal map puts them."""
        return self.strategy.startswith("app")

    @property
    def delaunay(self) -> bool:
        """Whether triangles are Delaunay on the surface, as in a conformal map, or in a measure-preserving one."""
        return self.strategy.endswith("cfp")

    @property
    def any_mesh_will_do(self) -> bool:
        """Whether nobody asks for two maps in particular, or for what they make of a component before it is relaxed."""
        return self.rounds > 0 and self.strategy == STRATEGIES[0]
