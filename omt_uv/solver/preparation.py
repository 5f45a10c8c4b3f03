"""From any mesh an artist has to disk charts: repaired, cut open and filled, all for the map only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .charts import Chart, Surface, assemble, check_disk, check_edges, chosen_triangles, split
from .cutting import Cuts, in_unit_box, open_sheets
from .repair import join, with_area

SEAMS = ("existing", "auto")


@dataclass(frozen=True)
class Prepared:
    """Charts, each a disk; the cuts (None where only existing seams were allowed) and what was repaired."""

    charts: list[Chart]
    cuts: Cuts | None
    warnings: tuple[str, ...]


def prepare(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    seams: str = "auto",
    avoid: np.ndarray | None = None,
) -> Prepared:
    """Disk charts of the polygons `faces` (f,) bool, all by default.

    Parameters
    ----------
    seams : "existing" splits along the seams of the surface alone and refuses what is no disk, or broken;
        "auto" repairs and cuts, for the map only
    avoid : (n,) in [0,1], vertices to keep free of seams

    Raises
    ------
    MeshError : see `charts.split`; with "auto" only EmptyMeshError, NonFiniteError, and ZeroAreaFaceError or
        NonManifoldEdgeError where no repair helps
    """
    if seams not in SEAMS:
        raise ValueError(f"seams must be one of {', '.join(SEAMS)}, not {seams!r}")
    if seams == "existing":
        return Prepared(split(surface, faces), None, ())
    faces, triangles, owner = chosen_triangles(surface, faces)
    repaired = join(surface, faces, triangles, owner)
    sheets, cuts = open_sheets(surface, repaired, avoid=avoid)
    extent = in_unit_box(surface, sheets)[1]
    charts, flat = [], 0
    for chart in assemble(surface, sheets):
        check_edges(chart)
        check_disk(chart)
        chart, count = with_area(chart, extent)
        charts.append(chart)
        flat += count
    warnings = list(cuts.warnings)
    if flat:
        triangles = "A triangle has" if flat == 1 else f"{flat} triangles have"
        warnings.append(f"{triangles} no area and got a little for the map; use Mesh > Clean Up > Degenerate Dissolve")
    return Prepared(charts, cuts, tuple(warnings))
