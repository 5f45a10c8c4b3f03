"""How far a map shears, and in which direction: the Beltrami coefficient; and figures that compare matched surfaces.

Imports solver.mesh and solver.analysis.
Main names: beltrami (in beltrami), Beltrami, stretch_directions, compare_regions, match_figures, mean_shape.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    beltrami="Beltrami corner_beltrami",
    collection="MeanShape mean_shape",
    figures="MatchFigures match_figures",
    regions="RegionStrain compare_regions region_strain",
)
