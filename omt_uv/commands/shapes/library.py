"""Keep the signatures of a folder in an index, and find the nearest to a shape: the commands library and similar."""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from ... import __version__
from ...batch.plan import READABLE
from ...files.verified import FileError
from ..common import CommandError, check_paths, require_blender, warn_of
from ..options import add_input, vertices
from .distance import add_markers, add_points, signature_of_file
from .many import add_jobs, carried_out
from .signature import NAME, SUFFIX, read_signature

# Of a folder beside the index, for signatures that a batch has made.
FOLDER = ".signatures"


def add(commands) -> None:
    command = commands.add_parser("library", help="signatures of the shapes of a folder, as an index")
    command.set_defaults(run=run)
    add_input(command, "folder of meshes, and the folders in it", metavar="DIR")
    command.add_argument("-o", "--output", type=Path, metavar="INDEX.npz", required=True, help=".npz; added to")
    add_points(command)
    add_jobs(command)
    similar = commands.add_parser("similar", help="the nearest shapes of an index")
    similar.set_defaults(run=run_similar)
    add_input(similar)
    add_markers(similar)
    similar.add_argument("--index", type=Path, metavar="INDEX.npz", required=True, help="of the command library")
    similar.add_argument("--top", type=vertices, default=10, metavar="K", help="how many, default 10")


def _meshes_below(folder: Path) -> list[Path]:
    """All mesh files of a folder and its folders. Raises CommandError where one of these cannot be read."""

    def shut(error: OSError) -> None:
        raise CommandError(f"{error.filename}: cannot be read ({error.strerror}). Allow that, or move it away.")

    found = [Path(inner) / name for inner, _, names in os.walk(folder, onerror=shut) for name in names]
    return sorted(path for path in found if path.suffix.lower() in READABLE)


def run(options: argparse.Namespace) -> None:
    """Add what is new in a folder to its index; what has no signature is told with the reason."""
    from ...files.verified import check_writable, write_bytes
    from ...pipelines.shapes.signature_index import index_of, read_index

    if not os.path.isdir(options.input):
        raise CommandError(f"{options.input}: there is no such folder")
    if options.output.suffix.lower() != SUFFIX:
        raise CommandError(f"{options.output}: an index is an .npz. Name one.")
    check_paths(options, [])
    check_writable(options.output)
    old = read_index(options.output) if options.output.exists() else None
    files = _meshes_below(options.input)
    known = dict(zip(old.names, old.marks, strict=True)) if old else {}
    due = {p.relative_to(options.input).as_posix(): p for p in files}
    if old and old.marked != (options.markers is not None):
        raise CommandError(f"{options.output}: has shapes {'with' if old.marked else 'without'} markers. Name another.")
    marks = {name: _mark(path, options.markers) for name, path in due.items()}
    due = {name: path for name, path in due.items() if known.get(name) != marks[name]}
    if options.jobs or options.scheduler:
        found = _by_batch(options, set(due))
        write = bool(found)
        index = index_of({name: (marks[name], s) for name, s in found.items()}, old) if found else old
    else:
        require_blender()
        index, write = old, False
        found = {}
        for name, path in due.items():
            try:
                found[name] = signature_of_file(options, path)
            except (CommandError, FileError) as error:
                _tell(options, name, str(error))
                continue
            # What was done stays when the rest is stopped.
            index = index_of({name: (marks[name], found[name])}, index)
            write_bytes(options.output, index.bytes())
    if index is None:
        raise CommandError(f"{options.input}: none of its {len(files)} mesh files has a signature. Give closed meshes.")
    if write:
        write_bytes(options.output, index.bytes())
    print(f"{len(found)} new, {len(index)} in {options.output}")


def _tell(options: argparse.Namespace, name: str, reason: str) -> None:
    """Say why a file below the folder has no signature; a reason that begins with the file is told once."""
    path = options.input / name
    for itself in (f"{path}: ", f"{path.name}: "):
        reason = reason.removeprefix(itself)
    warn_of(f"{name}: {reason}")


def _mark(path: Path, markers: tuple[str, str] | None) -> str:
    of_file = f"{path.stat().st_size} {path.stat().st_mtime_ns}"
    return of_file if markers is None else f"{of_file} {','.join(markers)}"


def _by_batch(options: argparse.Namespace, due: set[str]) -> dict:
    """Signatures of files by name, made by a batch, which goes on where another was stopped."""
    from ...batch.plan import BatchPlan, tasks_of

    words = ["--points", str(options.points)]
    words += [] if options.markers is None else ["--markers", ",".join(options.markers)]
    words += [*(f"--object={name}" for name in options.object)]
    words += [f"--scene={options.scene}"] if options.scene else []
    words += ["--skip-linked"] if options.skip_linked else []
    words += ["--strict"] if options.strict else []
    plan = BatchPlan(
        command=NAME,
        options=tuple(words),
        output=options.output.with_suffix(FOLDER),
        suffix=SUFFIX,
        version=__version__,
        reports=False,
        previews=False,
    )
    rows = carried_out(options, plan, tasks_of(plan, options.input))
    for name, row in rows.items():
        if row["state"] != "done":
            _tell(options, name, row["message"])
    return {
        name: read_signature((plan.output / name).with_suffix(SUFFIX))
        for name, row in rows.items()
        if row["state"] == "done" and name in due
    }


def run_similar(options: argparse.Namespace) -> None:
    """Print the nearest shapes as lines of JSON, nearest first."""
    require_blender()
    from ...pipelines.shapes.signature_index import read_index
    from ...solver.signatures.wasserstein import nearest

    index = read_index(options.index)
    if index.marked != (options.markers is not None):
        given = "was made without markers" if options.markers else "has markers: give them by --markers, too"
        raise CommandError(f"{options.index}: {given}.")
    mine = signature_of_file(options, options.input, index.packed.shape[1])
    for k, found in nearest(mine, index, options.top, index.coefficients):
        print(json.dumps({"name": index.names[k], "distance": found.distance, "raw": found.raw}))
