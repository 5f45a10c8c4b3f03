"""All distances between the shapes of a folder or an index, as a table and pictures: the command distances."""

from __future__ import annotations

import argparse
import csv
import io
import json
from pathlib import Path

from ... import __version__
from ...batch.tables import csv_lines
from ..common import CommandError, UsageError, write_picture
from ..options import number
from .distance import add_points
from .library import run as run_library
from .many import add_jobs, carried_out

# Of files and folders beside the table: what is at hand when it is asked for again.
INDEX = ".index.npz"
BLOCKS = ".blocks"
FIGURES = ".figures"
BLOCK_COMMAND = "block"
# Fewer shapes need no batch.
FEW = 24


def add(commands) -> None:
    command = commands.add_parser("distances", help="distances between all shapes of a folder or an index")
    command.set_defaults(run=run, alone=True, told=[])
    command.add_argument("input", type=Path, metavar="DIR|INDEX.npz", help="folder of meshes, or an index of library")
    command.add_argument("-o", "--output", "--csv", type=Path, metavar="D.csv", required=True, help="the matrix")
    command.add_argument("--picture", type=Path, metavar="D.png", help="the matrix as shades of grey")
    command.add_argument("--mds", type=Path, metavar="MAP.png", help="all shapes as points of a map")
    command.add_argument("--labels", type=Path, metavar="L.csv", help="names of files, their classes, and of whom")
    command.add_argument("--knn", type=int, default=0, metavar="K", help="how often K neighbours tell the class")
    add_points(command)
    command.add_argument(
        "--curvature", type=number, default=None, metavar="W", help="weight of curvature, default 0.15"
    )
    add_jobs(command)
    block = commands.add_parser(BLOCK_COMMAND, help="a block of such a matrix, which distances asks for")
    block.set_defaults(run=run_block, alone=True, told=[])
    block.add_argument("input", type=Path, metavar="BLOCK.json")
    block.add_argument("-o", "--output", type=Path, metavar="BLOCK.npy", required=True)
    block.add_argument("--memory", type=number, default=0.0, help=argparse.SUPPRESS)


def run(options: argparse.Namespace) -> None:
    """Write the matrix, its pictures, and say what neighbours tell."""
    import numpy as np

    from ...files.verified import check_writable, write_text
    from ...pipelines.shapes.signature_index import read_index

    if options.output.suffix.lower() != ".csv":
        raise UsageError(f"{options.output}: distances are a .csv. Name one.")
    for path in filter(None, (options.picture, options.mds)):
        if path.suffix.lower() != ".png":
            raise UsageError(f"{path}: this picture is a .png file. Name one.")
    for path in filter(None, (options.output, options.picture, options.mds)):
        check_writable(path)
    if options.knn and options.labels is None:
        raise UsageError("--knn asks for the classes of the files. Give --labels.")
    index = read_index(options.input if options.input.suffix.lower() == ".npz" else _indexed(options))
    classes, owners = (None, None) if options.labels is None else _classes(options.labels, index.names)
    found = _matrix(options, index)
    table = [[name, *(f"{value:.6g}" for value in row)] for name, row in zip(index.names, found[0], strict=True)]
    write_text(options.output, csv_lines([["", *index.names], *table]))
    print(f"{len(index)} shapes, {len(index) * (len(index) - 1) // 2} distances in {options.output}")
    _draw(options, found, index.names, classes)
    if options.knn and classes is not None:
        from ...solver.signatures.embedding import classes_of_nearest

        # Raw, as what is below the floor would all be one.
        told = classes_of_nearest(found[1], classes, options.knn)
        right = np.mean([a == b for a, b in zip(told, classes, strict=True)])
        print(f"{100 * right:.1f} % of the classes are those of {options.knn} neighbours")
        if owners is not None and any(owners):
            same = np.array([[a == b != "" for a in owners] for b in owners])
            told = classes_of_nearest(np.where(same, np.inf, found[1]), classes, options.knn)
            right = np.mean([a == b for a, b in zip(told, classes, strict=True)])
            print(f"{100 * right:.1f} % are those of {options.knn} neighbours of others")


def _indexed(options: argparse.Namespace) -> Path:
    """The index of a folder, made or added to."""
    path = options.output.with_suffix(INDEX)
    more = {"object": [], "scene": "", "skip_linked": False, "strict": False, "timeout": 0.0, "memory": 0.0}
    run_library(argparse.Namespace(**{**vars(options), **more, "output": path, "jobs": options.jobs or 1}))
    return path


def _classes(path: Path, names: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """The class of every name, of a table with a name and a class on each line, and whose it is, "" unless a third
    column says so. Raises CommandError."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = {row[0]: (row[1], row[2] if len(row) > 2 else "") for row in csv.reader(file) if len(row) > 1}
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CommandError(f"{path}: is no table of names and classes ({error})") from error
    missing = [name for name in names if name not in rows]
    if missing:
        raise CommandError(f"{path}: has no class for {len(missing)} shapes, as {missing[0]}. Add a line for each.")
    return [rows[name][0] for name in names], [rows[name][1] for name in names]


def _matrix(options: argparse.Namespace, index):
    """Distances (2,n,n), with the floor taken off and raw."""
    import numpy as np

    from ...pipelines.shapes.signature_index import block_distances, blocks_of
    from ...solver.signatures.signature import CURVATURE

    curvature = CURVATURE if options.curvature is None else options.curvature
    blocks = blocks_of(len(index))
    if len(index) <= FEW and not (options.jobs or options.scheduler):
        parts = [block_distances(index, block, curvature) for block in blocks]
    else:
        parts = _by_batch(options, index, blocks, curvature)
    found = np.zeros((2, len(index), len(index)))
    for (first, last, left, right), part in zip(blocks, parts, strict=True):
        found[:, first:last, left:right] = part
    return found + found.transpose(0, 2, 1)


def _by_batch(options: argparse.Namespace, index, blocks, curvature: float) -> list:
    """The blocks of the matrix, each a run of the command block."""
    import hashlib

    import numpy as np

    from ...batch.plan import BatchPlan, tasks_of
    from ...files.verified import write_bytes

    folder = options.output.with_suffix(BLOCKS)
    folder.mkdir(parents=True, exist_ok=True)
    data = index.bytes()
    # Named by what it holds: blocks of another index are other blocks.
    copy = folder / f"{hashlib.sha256(data).hexdigest()[:16]}.npz"
    write_bytes(copy, data)
    places = []
    for block in blocks:
        path = folder / "asked" / ("_".join(map(str, block)) + ".json")
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps({"index": str(copy.resolve()), "block": block, "curvature": curvature}))
        places.append(path)
    (folder / "asked.txt").write_text("".join(f"asked/{path.name}\n" for path in places))
    plan = BatchPlan(
        command=BLOCK_COMMAND,
        options=(),
        output=folder / "found",
        suffix=".npy",
        version=__version__,
        reports=False,
        previews=False,
    )
    rows = carried_out(options, plan, tasks_of(plan, folder / "asked.txt"))
    failed = [row["message"] for row in rows.values() if row["state"] != "done"]
    if failed:
        raise CommandError(f"{len(failed)} of {len(blocks)} blocks could not be done: {failed[0]}")
    return [np.load((plan.output / path.name).with_suffix(".npy"), allow_pickle=False) for path in places]


def run_block(options: argparse.Namespace) -> None:
    """Write the distances (2,r,c) of a block."""
    import numpy as np

    from ...files.verified import write_bytes
    from ...pipelines.shapes.signature_index import block_distances, read_index

    try:
        asked = json.loads(options.input.read_text())
        index, block, curvature = Path(asked["index"]), asked["block"], float(asked["curvature"])
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise CommandError(f"{options.input}: is no block of distances ({error})") from error
    data = io.BytesIO()
    np.save(data, block_distances(read_index(index), tuple(block), curvature))
    write_bytes(options.output, data.getvalue())


def _draw(options: argparse.Namespace, found, names, classes) -> None:
    """The matrix and the map, where they are asked for; this alone needs Blender's letters."""
    if options.picture is None and options.mds is None:
        return
    from ..common import require_blender

    require_blender()
    from ...display.distance_plots import map_picture, matrix_picture
    from ...solver.signatures.embedding import classical_scaling

    if options.picture is not None:
        write_picture(options.picture, matrix_picture(found[1], classes))
    if options.mds is not None:
        stems = [Path(name).stem for name in names]
        write_picture(options.mds, map_picture(classical_scaling(found[1]), stems, classes))
