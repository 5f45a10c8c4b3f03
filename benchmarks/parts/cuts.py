"""Compare the length of our cuts with what is known to be short.

tree      at genus 0: the shortest tree of edges that joins the same tips and boundaries (exact: Dreyfus, Wagner 1971)
cotree    with handles: the tree-cotree cut with geodesic lengths from one vertex (Erickson, Whittlesey 2005), without
          any tips; our cut is measured without tips too
All lengths are those of edges, divided by the extent of the model.
"""

from __future__ import annotations

import meshes
import numpy as np
from short_cuts import cotree_length, shortest_tree

from benchmarks.part import MODELS, Part
from benchmarks.tables import Table
from benchmarks.timing import timed
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.mesh.surface import triangle_surface

DEFAULT_MODELS = ("max_planck", "bunny_small", "spot", "homer", "cow", "bunny", "david", "armadillo", "stanford_bunny",
                  "beetle", "rocker_arm", "three_holes", "fertility")  # fmt: skip
COLUMNS = {"model": 16, "faces": 7, "handles": 7, "boundaries": 10, "tips": 4, "length": 7, "tree": 7, "cotree": 7,
           "ratio": 6, "seconds": 7}  # fmt: skip


def cuts_table(args) -> Table:
    """One row for every closed model."""
    table = Table("Length of cuts", COLUMNS)
    for name in args.models or [m for m in DEFAULT_MODELS if meshes.model_path(m)]:
        table.add(**_row(name))
    return table


def _row(name):
    V, F = meshes.load_model(name)
    extent = np.ptp(V, axis=0).max()
    surface = triangle_surface(V, F)
    cuts, seconds = timed(lambda: cut(surface))
    (component,) = cuts.components
    cells = {"model": name, "faces": len(F), "handles": component.handles, "boundaries": component.boundaries,
             "tips": len(component.extremities), "length": cuts.length / extent, "seconds": seconds}  # fmt: skip
    if component.handles:
        cells["cotree"] = cotree_length(V, F) / extent
        cells["ratio"] = cut(surface, extremities=0).length / extent / cells["cotree"]
    else:
        cells["tree"] = shortest_tree(V, F, component.extremities) / extent
        cells["ratio"] = cells["length"] / cells["tree"]
    return cells


PARTS = (Part("cuts", "length of our cuts against what is known to be short", cuts_table, (MODELS,)),)
