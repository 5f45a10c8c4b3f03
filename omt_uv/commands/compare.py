"""Compare meshes with another one, of which they were made: the command compare."""

from __future__ import annotations

import argparse
import csv
import io
import json
from pathlib import Path

from .common import CommandError, UsageError, check_paths, drain_shown, refusals, require_blender, write_picture
from .options import add_input
from .selection import of_file, read_file

# What a plot draws, each a curve, and how the page calls it.
PLOTTED = {
    "hausdorff": "Hausdorff",
    "rms": "rms",
    "gaussian_error": "Gaussian curvature",
    "mean_error": "mean curvature",
}


def add(commands) -> None:
    command = commands.add_parser("compare", help="distances, normals, curvature and shapes of meshes beside another")
    command.set_defaults(run=run)
    add_input(command)
    command.add_argument("others", type=Path, nargs="+", metavar="B", help="meshes that are compared with IN")
    command.add_argument("--json", action="store_true", help="print the figures as JSON")
    command.add_argument("--csv", action="store_true", help="print the figures as CSV, a line for each B")
    command.add_argument(
        "--beltrami", action="store_true", help="how far apart the strain of the UV maps is instead, region by region"
    )
    command.add_argument("--shape-key", default="", metavar="NAME", help="with --beltrami: of this shape key")
    command.add_argument(
        "--samples",
        type=_count,
        default=0,
        metavar="N",
        help="distances of N random points a surface and of its vertices alone, as programs that sample have them",
    )
    command.add_argument("--plot", type=Path, metavar="P.png", help="draw errors over the number of faces")


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of points")
    return value


def run(options: argparse.Namespace) -> None:
    require_blender()
    if options.plot is not None and options.plot.suffix.lower() != ".png":
        raise CommandError(f"{options.plot}: a plot is a picture. Name a .png file.")
    if options.shape_key and not options.beltrami:
        raise UsageError("--shape-key goes with --beltrami. Give both.")
    if options.beltrami and (options.plot is not None or options.csv or options.samples):
        raise UsageError("--plot, --csv and --samples are of distances, which --beltrami has not. Leave them out.")
    check_paths(options)
    if options.beltrami:
        print(_strain(options))
        return
    rows = compared(options)
    if options.plot is not None:
        write_picture(options.plot, plotted(rows))
    if options.json:
        print(json.dumps(rows, indent=1))
    elif options.csv:
        print(_csv(rows), end="")
    else:
        print("\n".join(_line(row) for row in rows))


def compared(options: argparse.Namespace) -> list[dict]:
    """A row of figures for each of the other meshes."""
    from ..solver.comparison.comparison_figures import compare

    first, rows = _mesh(options, options.input), []
    for path in options.others:
        second = _mesh(options, path)
        with refusals(name=f"{options.input}, {path}"):
            rows.append({"file": str(path), **vars(drain_shown(compare(first, second, options.samples)))})
    return rows


def _strain(options: argparse.Namespace) -> str:
    """Distances of the histograms of |mu| between IN and each other mesh, as lines or JSON."""
    from ..solver.strain.regions import compare_regions

    first, found = _strain_of_file(options, options.input), {}
    for path in options.others:
        found[str(path)] = compare_regions(first, _strain_of_file(options, path))
    if options.json:
        return json.dumps(found, indent=1)
    return "\n".join(f"{path}, {name}: {value:.4f}" for path, row in found.items() for name, value in row.items())


def _strain_of_file(options: argparse.Namespace, path: Path) -> list:
    """The strain by region of the one mesh of a file."""
    from ..blender.shapes.strain import strain_rows

    pairs = read_file(of_file(options, path))
    if len(pairs) > 1:
        raise CommandError(f"{path}: it has several meshes. Name one by --object.")
    obj, reading = pairs[0]
    return strain_rows(obj, reading, options.shape_key)


def plotted(rows: list[dict]):
    """A picture (h,w,3) of the errors of rows over their numbers of faces."""
    from ..display.plots import plot

    curves = {name: [(row["faces"], row[key]) for row in rows] for key, name in PLOTTED.items()}
    return plot(curves, "errors, and their exponents")


def _mesh(options: argparse.Namespace, path: Path):
    """Positions (n,3) in the world and triangles (m,3) of all objects of a file."""
    import numpy as np

    from ..blender.measuring.distances import placed_mesh

    positions, triangles, count = [], [], 0
    for obj, reading in read_file(of_file(options, path)):
        mine, faces = placed_mesh(obj, reading)
        positions.append(mine)
        triangles.append(faces + count)
        count += len(mine)
    return np.concatenate(positions), np.concatenate(triangles)


def _line(row: dict) -> str:
    """The figures in words."""
    boundary = "" if row["boundary"] is None else f", boundary {row['boundary']:.5f}"
    kept = "kept" if row["topology_kept"] else "not kept"
    return (
        f"{row['file']}: {row['vertices']} vertices, {row['faces']} triangles; Hausdorff {row['hausdorff']:.5f}, "
        f"rms {row['rms']:.6f} of the diagonal{boundary}; normals off {row['normal_mean']:.2f} degrees "
        f"(99 % within {row['normal_p99']:.1f}); curvature off {100 * row['gaussian_error']:.1f} % Gaussian, "
        f"{100 * row['mean_error']:.1f} % mean; least angle {row['angle_min']:.1f} (99 % above {row['angle_p1']:.1f}) "
        f"degrees; topology {kept}"
    )


def _csv(rows: list[dict]) -> str:
    out = io.StringIO()
    writer = csv.DictWriter(out, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()
