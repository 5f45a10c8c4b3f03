"""What a batch is to do: the files, where the results go, and the words that start each run."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..errors import UserError

READABLE = (".blend", ".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx", ".off")
# What cannot be written: the format that takes its place.
WRITTEN_AS = {".off": ".ply"}
# How the names of what lies beside OUT go on: the manifest, failures, previews, and the lock.
MANIFEST = ".manifest.sqlite"
FAILURES = ".failures"
PREVIEWS = ".previews"


class BatchError(UserError):
    """A batch that cannot begin, or go on."""


@contextmanager
def kept(path: Path) -> Iterator[None]:
    """Name what cannot be kept beside the results, or among them, and why, as a BatchError."""
    try:
        yield
    except OSError as error:
        raise BatchError(
            f"{path}: cannot be written ({error.strerror or error}). Look for space, rights and other files of these "
            "names, and start the same command again: it goes on."
        ) from error


@dataclass(frozen=True)
class BatchPlan:
    """What is asked of every file.

    command, options : of the command line; output : the folder of the results; suffix : of the results, "" for that of
    the file; version : of the program; writes : whether there is a result; reports, previews : whether the command
    writes a report and a preview; timeout : seconds, memory : gigabytes of a run, 0 for no limit
    """

    command: str
    options: tuple[str, ...]
    output: Path
    suffix: str = ""
    version: str = ""
    writes: bool = True
    reports: bool = True
    previews: bool = True
    timeout: float = 0.0
    memory: float = 0.0

    def key(self) -> str:
        """What, if it changes, makes all runs stale: command, options, format of the results and version."""
        text = json.dumps([self.command, self.options, self.suffix, self.previews, self.version])
        return hashlib.sha256(text.encode()).hexdigest()

    def beside(self, ending: str) -> Path:
        """A path beside the folder of the results."""
        return beside(self.output, ending)


@dataclass(frozen=True)
class FileTask:
    """One file: its name within the batch, with forward slashes, its path, bytes, time of change, and its result."""

    name: str
    path: Path
    size: int
    changed: int
    output: Path | None


def beside(output: Path, ending: str) -> Path:
    """A path beside a folder of results."""
    folder = Path(os.path.abspath(output))
    return folder.with_name(folder.name + ending)


def tasks_of(plan: BatchPlan, source: Path, part: tuple[int, int] = (1, 1)) -> list[FileTask]:
    """Tasks of all files of a folder and its folders, or of a list, the largest first; of part k of n alone.

    Raises
    ------
    BatchError : there is nothing to do, or two files would have one result
    """
    pairs = _of_folder(source, plan.output) if source.is_dir() else _of_list(source)
    made = [_task(plan, name, path) for name, path in pairs if _part_of(name, part[1]) == part[0]]
    _check_outputs(made)
    return sorted(made, key=lambda task: (-task.size, task.name))


def _of_folder(source: Path, output: Path) -> list[tuple[str, Path]]:
    """Names and paths of the meshes below a folder, but for the results, if they go there, too."""
    own = os.path.realpath(output)
    found = []

    def shut(error: OSError) -> None:
        raise BatchError(
            f"{error.filename}: cannot be read ({error.strerror}). Allow that, or move it away."
        ) from error

    for folder, inner, files in os.walk(source, onerror=shut):
        inner[:] = sorted(n for n in inner if not n.startswith(".") and os.path.realpath(Path(folder) / n) != own)
        found += [Path(folder) / name for name in sorted(files) if not name.startswith(".")]
    pairs = [(path.relative_to(source).as_posix(), path) for path in found if path.suffix.lower() in READABLE]
    if not pairs:
        raise BatchError(f"{source}: there is no mesh in this folder. Formats are {' '.join(READABLE)}.")
    return pairs


def _of_list(source: Path) -> list[tuple[str, Path]]:
    """Names and paths of a text file with a path on each line, relative to it; names to the folder that all share."""
    try:
        lines = source.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BatchError(f"{source}: neither a folder nor a list of files, one on each line ({error})") from error
    if any("\0" in line for line in lines):
        raise BatchError(f"{source}: holds what no path has, and is no list of files. Write a path on each line.")
    paths = [Path(os.path.abspath(source.parent / line.strip())) for line in lines if line.strip()]
    if not paths:
        raise BatchError(f"{source}: the list is empty. Write a path on each line.")
    shared = os.path.commonpath([path.parent for path in paths])
    return [(path.relative_to(shared).as_posix(), path) for path in dict.fromkeys(paths)]


def _part_of(name: str, count: int) -> int:
    """The part, of so many from 1, that a file belongs to, whatever else is there."""
    return int(hashlib.sha256(name.encode(errors="surrogateescape")).hexdigest(), 16) % count + 1


def _task(plan: BatchPlan, name: str, path: Path) -> FileTask:
    """The task of a file; one that is not there has no size, and fails by itself."""
    try:
        stat = path.stat()
        size, changed = stat.st_size, stat.st_mtime_ns
    except OSError:
        size, changed = 0, 0
    suffix = plan.suffix or WRITTEN_AS.get(path.suffix.lower(), path.suffix)
    output = (plan.output / name).with_suffix(suffix) if plan.writes else None
    return FileTask(name, Path(os.path.abspath(path)), size, changed, output)


def _check_outputs(tasks: Iterable[FileTask]) -> None:
    """Raise BatchError if two files would have one result, or one would be replaced by it."""
    taken: dict[Path, str] = {}
    for task in tasks:
        if task.output is None:
            continue
        other = taken.setdefault(task.output, task.name)
        if other != task.name:
            raise BatchError(
                f"{other} and {task.name} would both become {task.output}. Name one format by --format, or put them "
                "into folders of their own."
            )
        if os.path.realpath(task.output) == os.path.realpath(task.path):
            raise BatchError(f"{task.path}: the result would replace it. Name another folder.")


def words_of(plan: BatchPlan, task: FileTask, places: dict[str, Path]) -> list[str]:
    """Words of the command line of a run, after those that start the program.

    places : paths that differ from those of the task, by "input" and "output"; and of "report" and "preview"
    """
    # A path that begins with a dash would be an option.
    words = [plan.command, os.path.abspath(places.get("input", task.path))]
    output = places.get("output", task.output)
    if output is not None:
        words += ["-o", os.path.abspath(output)]
    for name in ("report", "preview"):
        if name in places:
            words += [f"--{name}", os.path.abspath(places[name])]
    if plan.memory:
        words += ["--memory", f"{plan.memory:g}"]
    return [*words, *plan.options]


def hash_of(path: Path) -> str:
    """SHA-256 of a file; "" where it cannot be read."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def shell_text(words: Sequence[str]) -> str:
    """The words as a shell would take them, to be read and pasted; none is ever started from it."""
    import shlex

    return shlex.join(words)
