"""Draw models at several balances of area and shear, along the same seams: a table of their figures, and a plate.

    python scripts/pictures/balance_plate.py MODEL... [--balances 0 0.1 0.3 0.5] [--out P.png] [--table T.tsv]

What the default of the slider should be is seen here: the checker from the front, the layout with shear as colours, and
for every balance the mean shear, the share of the surface that shears by more than 2, the area error, and how far off
the worst hundredth of the surface is in area.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import compare
import numpy as np
import plates
import rival_maps
from rival_maps import DrawnMap

from benchmarks.cases import meshes
from benchmarks.tables import Table
from omt_uv.blender.seams import mark_seams
from omt_uv.files.meshes import load
from omt_uv.pipelines.reading import Y_UP
from omt_uv.solver.maps.distortion import face_distortion
from omt_uv.solver.mesh.geometry import face_areas

BALANCES = (0.0, 0.1, 0.3, 0.5)
STEEP = 2.0
WORST = 0.01  # share of the surface
COLUMNS = {"model": 16, "balance": 7, "shear": 6, "> 2": 7, "area_l1": 8, "worst area": 10}


def maps_of(name: str, balances) -> dict[float, DrawnMap]:
    """Maps of a model along the seams of one click, by balance."""
    axes = Y_UP if compare.view_of(name).up == "Y" else None
    path = meshes.model_path(name)
    seams = rival_maps.ours(load(path)[0], axes).cut
    found = {}
    for balance in balances:
        obj = load(path)[0]
        mark_seams(obj, seams)
        found[balance] = rival_maps.ours(obj, axes, balance=balance, max_shear=0.0, seams="existing")
    return found


def figures(found: DrawnMap) -> dict[str, float]:
    """Shear and area of a map; the worst hundredth of the surface is at least that factor off in area."""
    octaves, shear = face_distortion(found.V, found.F, found.uv, polygons=found.polygons)
    area = face_areas(found.V, found.F)
    weight = area / area.sum()
    order = np.argsort(-np.abs(octaves))
    worst = order[np.searchsorted(np.cumsum(weight[order]), WORST)]
    return {"steep": float(weight[shear > STEEP].sum()), "worst": float(2 ** abs(octaves[worst]) - 1)}


def main():
    """Map, tell, draw, and write one plate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--balances", nargs="*", type=float, default=BALANCES)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "balances.png")
    parser.add_argument("--table", type=Path, help="tab separated, too")
    parser.add_argument("--pixels", type=int, default=300, help="of one picture")
    args = parser.parse_args()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    table = Table("Balances", COLUMNS)
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for name in args.models:
            maps = maps_of(name, args.balances)
            for balance, found in maps.items():
                caption, more = rival_maps.figures_of(found), figures(found)
                table.add(
                    model=name,
                    balance=f"{balance:g}",
                    shear=f"{caption.shear:.3f}",
                    area_l1=f"{caption.area:.4f}",
                    **{"> 2": f"{more['steep']:.2%}", "worst area": f"{more['worst']:.1%}"},
                )
            rows += compare.draw(name, maps, ("front", "layout"), Path(folder), args.pixels)
        if args.table:
            table.write(args.table)
        plates.plate(args.out, [f"balance {balance:g}" for balance in args.balances], rows)
    print(f"{args.out} {args.out.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
