"""Write files whole or not at all: beside the target, flushed to disk, checked, and only then in its place.

Whatever fails before the last step leaves the old file as it was. What a killed process left is cleared by the next
one that writes into the same folder.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ..errors import UserError
from ..supervision import temporary_prefix

try:
    import fcntl
except ModuleNotFoundError:  # Windows
    fcntl = None  # type: ignore[assignment]

# How the names of temporary files begin, of all processes.
PREFIX = ".omt_uv_"
LOCK = ".lock"
# Blender cuts paths at 1024 bytes without a word, and those of its own temporary files are longer than ours.
MOST_PATH_BYTES = 960
# Seconds after which a file that nothing locks is left over: one whose lock is not made yet is younger.
ABANDONED = 60.0
# Where locks of files cannot be asked for, no run is thought to write for longer than a day.
ABANDONED_WITHOUT_LOCKS = 86400.0


class FileError(UserError):
    """A file that cannot be read or written."""


def check_suffix(path: Path, known: tuple[str, ...]) -> None:
    """Raise FileError unless the suffix of a path is a known one."""
    if path.suffix.lower() not in known:
        raise FileError(f"{path}: unknown format {path.suffix!r}. Use one of {' '.join(known)}.")


def check_writable(path: Path) -> None:
    """Raise FileError unless a file can be written to this path, as far as that can be told beforehand."""
    path = path.resolve()
    check_length(path)
    if not path.parent.is_dir():
        raise FileError(f"{path}: there is no such folder")
    if path.is_dir():
        raise FileError(f"{path}: is a folder. Name a file.")
    if path.exists() and not os.access(path, os.W_OK):
        raise FileError(f"{path}: is write-protected. Allow writing, or name another file.")
    try:
        with _own_name(path.parent):
            pass
    except OSError as error:
        raise FileError(f"{path}: nothing can be written into this folder ({error.strerror})") from error


def check_readable(path: Path) -> None:
    """Raise FileError unless a file is there and may be read: what Blender's readers say then names no cause."""
    try:
        if not path.is_file():
            raise FileError(f"{path}: there is no such file")
        with open(path, "rb"):
            pass
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror})") from error


def check_length(path: Path) -> None:
    """Raise FileError if a path is longer than Blender can hold."""
    length = len(os.fsencode(os.path.abspath(path)))
    if length > MOST_PATH_BYTES:
        raise FileError(
            f"...{str(path)[-60:]}: the path has {length} bytes, and Blender holds {MOST_PATH_BYTES}. "
            "Move the files to a shorter one."
        )
    if len(os.fsencode(path.name)) > 255:
        raise FileError(f"...{str(path)[-60:]}: the name is longer than 255 bytes. Use a shorter one.")


@contextmanager
def staged(target: Path, companions: dict[Path, Path] | None = None) -> Iterator[Path]:
    """The path at which to write a file, and to check it, that takes the place of `target` at the end of the block.

    companions : what the block writes besides, with names that begin like its own, and where that goes

    Raises
    ------
    FileError : the file cannot be written; the one that was there before is left as it was
    """
    target = target.resolve()
    check_writable(target)
    sweep(target.parent)
    try:
        with _own_name(target.parent) as name:
            made = target.with_name(name + target.suffix)
            yield made
            if not made.is_file():
                raise FileError(f"{target}: nothing was written. Look for space and rights in its folder.")
            # The target comes last: it names its companions.
            places = {**(companions or {}), made: target}
            for path, place in places.items():
                _keep_rights(place, path)
                _flush(path)
            for path, place in places.items():
                os.replace(path, place)
            _flush(target.parent)
    except OSError as error:
        raise FileError(f"{target}: cannot be written ({error.strerror or error})") from error


def write_text(target: Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Raises
    ------
    FileError : the file cannot be written
    """
    write_bytes(target, text.encode())


def write_bytes(target: Path, data: bytes) -> None:
    """Write a file of these bytes, whole or not at all.

    Raises
    ------
    FileError : the file cannot be written
    """
    with staged(target) as path:
        path.write_bytes(data)
        check_bytes(path, data)


def check_bytes(path: Path, data: bytes) -> None:
    """Raise FileError unless a file reads as these bytes."""
    if path.read_bytes() != data:
        raise FileError(f"{path.name}: what was written does not read as it should. Is the disk full?")


def sweep(folder: Path) -> None:
    """Remove from a folder what processes left behind that were ended while they wrote into it."""
    # Locks come last: they tell whose the others are.
    for path in sorted(folder.glob(f"{PREFIX}*"), key=lambda path: path.suffix == LOCK):
        if not path.exists():
            continue
        # .omt_uv_abcdefgh.obj belongs to .omt_uv_abcdefgh.lock.
        name = path.name.split(".")[1]
        if _is_abandoned(path, path.with_name(f".{name}{LOCK}")):
            _remove(path)


def same_file(a: Path, b: Path) -> bool:
    """Whether two paths lead to one file, which need not exist."""
    if os.path.exists(a) and os.path.exists(b):
        return os.path.samefile(a, b)
    return os.path.realpath(a) == os.path.realpath(b)


def clash(paths: Sequence[tuple[str, Path]]) -> tuple[str, str] | None:
    """Names of the first two of these named paths that lead to one file; None if there are none."""
    for k, (name, path) in enumerate(paths):
        for other, earlier in paths[:k]:
            if same_file(path, earlier):
                return other, name
    return None


@contextmanager
def _own_name(folder: Path) -> Iterator[str]:
    """A name of this process alone, locked as long as it lives; files whose names begin so go at the end."""
    handle, made = tempfile.mkstemp(dir=folder, prefix=temporary_prefix(), suffix=f"{LOCK}.new")
    new = Path(made)
    name = new.name.removesuffix(f"{LOCK}.new")
    try:
        with open(handle, "wb") as lock:
            if fcntl is not None:
                with suppress(OSError):  # a file system without locks: age decides
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # A file of this name is locked from the first moment on, or nobody is there any more.
                os.replace(new, folder / f"{name}{LOCK}")
            yield name
    finally:
        for path in folder.glob(f"{name}.*"):
            _remove(path)


def _remove(path: Path) -> None:
    """Remove a temporary file; a folder is one of earlier versions."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink()


def _is_abandoned(path: Path, lock: Path) -> bool:
    """Whether the process that made a temporary file is gone."""
    try:
        age = time.time() - path.stat().st_mtime
        if fcntl is None or path.is_dir():
            return age > ABANDONED_WITHOUT_LOCKS
        if not lock.exists():
            return age > ABANDONED or not _lives(path.name)
        with open(lock, "rb") as held:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except OSError:
        # Locked, of another user, or removed meanwhile.
        return False


def _lives(name: str) -> bool:
    """Whether the process that a temporary file is named after may be alive."""
    number = name.removeprefix(PREFIX).split("_")[0]
    try:
        os.kill(int(number), 0)
    except (ProcessLookupError, OverflowError):
        return False
    except (ValueError, PermissionError):
        return True
    return True


def _keep_rights(target: Path, made: Path) -> None:
    """Give a new file the mode and, where that is allowed, the owner of the one it replaces."""
    try:
        old = target.stat()
    except FileNotFoundError:
        return
    if hasattr(os, "chown"):
        with suppress(PermissionError):
            os.chown(made, old.st_uid, old.st_gid)
    os.chmod(made, stat.S_IMODE(old.st_mode))


def _flush(path: Path) -> None:
    """Have the system write a file, or the entries of a folder, to the disk; errors of the disk show here."""
    if path.is_dir() and os.name == "nt":
        return
    # Windows flushes only what was opened to be written.
    handle = os.open(path, os.O_RDONLY if os.name != "nt" else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
