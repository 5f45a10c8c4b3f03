"""Keep the signatures of a folder in an index, and find the nearest to a shape: the commands library and similar."""

from __future__ import annotations

import argparse
import io
import json
from pathlib import Path
from zipfile import BadZipFile

from ..common import CommandError, check_paths, require_blender, warn_of
from ..options import add_input, vertices
from .average import READABLE
from .distance import signature_of_file


def add(commands) -> None:
    command = commands.add_parser("library", help="signatures of the shapes of a folder, as an index")
    command.set_defaults(run=run)
    add_input(command, "folder of meshes, and the folders in it", metavar="DIR")
    command.add_argument("-o", "--output", type=Path, metavar="INDEX.npz", required=True, help=".npz; added to")
    similar = commands.add_parser("similar", help="the nearest shapes of an index")
    similar.set_defaults(run=run_similar)
    add_input(similar)
    similar.add_argument("--index", type=Path, metavar="INDEX.npz", required=True, help="of the command library")
    similar.add_argument("--top", type=vertices, default=10, metavar="K", help="how many, default 10")


def read_index(path: Path) -> dict:
    """Packed signatures by the name of their file, and marks of these. Raises CommandError."""
    import numpy as np

    if not path.is_file():
        raise CommandError(f"{path}: there is no such index. Make one by the command library.")
    try:
        with np.load(path) as data:
            rows = zip(data["names"].tolist(), data["marks"].tolist(), data["signatures"], strict=True)
            return {name: (mark, array) for name, mark, array in rows}
    except (OSError, KeyError, ValueError, EOFError, BadZipFile) as error:
        raise CommandError(f"{path}: is no index of signatures. Make one by the command library.") from error


def run(options: argparse.Namespace) -> None:
    """Add what is new in a folder to its index; what has no signature is told with the reason."""
    require_blender()
    from ...files.verified import check_writable
    from ...pipelines.shapes.distance import packed

    if not options.input.is_dir():
        raise CommandError(f"{options.input}: there is no such folder")
    if options.output.suffix.lower() != ".npz":
        raise CommandError(f"{options.output}: an index is an .npz. Name one.")
    check_paths(options, [])
    check_writable(options.output)
    index = read_index(options.output) if options.output.exists() else {}
    files = sorted(p for p in options.input.rglob("*") if p.suffix.lower() in READABLE)
    made = 0
    for path in files:
        name = path.relative_to(options.input).as_posix()
        mark = f"{path.stat().st_size} {path.stat().st_mtime_ns}"
        if name in index and index[name][0] == mark:
            continue
        try:
            index[name] = (mark, packed(signature_of_file(options, path)))
        except ValueError as error:
            warn_of(f"{name}: {error}")
            continue
        made += 1
        _write(options.output, index)
    if not index:
        raise CommandError(f"{options.input}: none of its {len(files)} mesh files has a signature. Give closed meshes.")
    print(f"{made} new, {len(index)} in {options.output}")


def _write(path: Path, index: dict) -> None:
    """Write an index whole: what was done stays when the rest is stopped."""
    import numpy as np

    from ...files.verified import write_bytes

    names = sorted(index)
    arrays = np.stack([index[name][1] for name in names])
    data = io.BytesIO()
    np.savez(data, names=np.array(names), marks=np.array([index[name][0] for name in names]), signatures=arrays)
    write_bytes(path, data.getvalue())


def run_similar(options: argparse.Namespace) -> None:
    """Print the nearest shapes as lines of JSON, nearest first."""
    require_blender()
    from ...pipelines.shapes.distance import unpacked
    from ...solver.signatures.wasserstein import nearest

    index = read_index(options.index)
    names = sorted(index)
    signatures = [unpacked(index[name][1]) for name in names]
    for k, found in nearest(signature_of_file(options, options.input), signatures, options.top):
        print(json.dumps({"name": names[k], "distance": found.distance, "raw": found.raw}))
