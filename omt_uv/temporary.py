"""Folders for temporary files that stay behind no longer than until the next one is made.

A process that is killed leaves its own. Beside each lies a file that says whose it is, and that its process keeps
locked: the system lets go of a lock however a process ends, while the number of one that is gone may be that of another
by now. That file is there before the folder, and goes after it, so that no folder is ever nobody's.
"""

from __future__ import annotations

import os
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows, where nothing tells who is gone: what is left stays.
    fcntl = None  # type: ignore[assignment]

FOLDER = "omt_uv_"
# Of a file beside a folder of ours, with the number of its process and the name of its machine: no other is removed.
OWNER = ".owner"


@contextmanager
def own_folder() -> Iterator[Path]:
    """A folder for temporary files, which goes at the end of the block; before it is made, those of the dead go."""
    place = Path(tempfile.gettempdir())
    sweep_folders(place)
    with ExitStack() as stack:
        folder = _locked(place, stack)
        stack.callback(_remove, folder)
        folder.mkdir(0o700)
        yield folder


def sweep_folders(place: Path) -> None:
    """Remove folders of ours whose processes are gone: of this machine and this user alone."""
    if fcntl is None:
        return
    for owner in place.glob(f"{FOLDER}*{OWNER}"):
        with suppress(OSError):  # Its process lives, or it has gone meanwhile.
            if owner.is_symlink() or owner.stat().st_uid != os.getuid():
                continue
            with open(owner, "rb") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                words = lock.read()
                # Whoever has just made it, and finds it gone, makes another.
                if not words or words.endswith(_machine()):
                    _remove(owner.with_suffix(""))


def remove_of(folder: Path, process: int) -> None:
    """Remove a folder of ours if it is that of a process, whether that lives or not."""
    with suppress(OSError):
        if folder.name.startswith(FOLDER) and _owner_of(folder).read_bytes() == _owned_by(process):
            _remove(folder)


def _locked(place: Path, stack: ExitStack) -> Path:
    """A folder to be made, whose file is there, and locked for as long as the stack is open."""
    while True:
        handle, name = tempfile.mkstemp(prefix=FOLDER, suffix=OWNER, dir=place)
        file = stack.enter_context(os.fdopen(handle, "wb"))
        owner = Path(name)
        if fcntl is not None:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:  # It was taken for one that was left behind.
                continue
            except OSError:  # A file system without locks: nobody gets one, and what is left stays.
                pass
        if owner.exists():
            file.write(_owned_by(os.getpid()))
            file.flush()
            return owner.with_suffix("")


def _remove(folder: Path) -> None:
    """Remove a folder, and its file unless something in it cannot be removed."""
    shutil.rmtree(folder, ignore_errors=True)
    if not folder.exists():
        _owner_of(folder).unlink(missing_ok=True)


def _owner_of(folder: Path) -> Path:
    return folder.with_name(folder.name + OWNER)


def _owned_by(process: int) -> bytes:
    """What says whose a folder is."""
    return str(process).encode() + _machine()


def _machine() -> bytes:
    return b" " + os.fsencode(socket.gethostname())
