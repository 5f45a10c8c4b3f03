"""Run as a user to whom the modes of files are more than advice, even where that is root."""

from __future__ import annotations

import codecs
import ctypes
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

# Who has no rights beyond those of everybody.
NOBODY = 65534
# PR_CAPBSET_DROP, and capabilities to write and execute, to read, and to change modes, whatever these are (Linux).
DROP = 24
OVERRIDES = (1, 2, 3)
IS_ROOT = hasattr(os, "geteuid") and os.geteuid() == 0


@contextmanager
def without_rights() -> Iterator[None]:
    """Context in which root is nobody. What is imported for the first time has to be readable for everybody."""
    groups, group = os.getgroups() if IS_ROOT else [], os.getegid() if IS_ROOT else 0
    if IS_ROOT:
        # Of names in archives: what was not found once is not looked for again.
        codecs.lookup("cp437")
        os.setgroups([])
        os.setresgid(NOBODY, NOBODY, group)
        os.setresuid(NOBODY, NOBODY, 0)
    try:
        yield
    finally:
        if IS_ROOT:
            os.setresuid(0, 0, 0)
            os.setresgid(group, group, group)
            os.setgroups(groups)


@contextmanager
def folder_of_nobody() -> Iterator[Path]:
    """A folder that whoever works `without_rights` owns, and can reach."""
    folder = Path(tempfile.mkdtemp(prefix="omt_uv_nobody_", dir="/tmp" if IS_ROOT else None))
    try:
        own(folder)
        folder.chmod(0o755)
        yield folder
    finally:
        _open_all(folder)
        shutil.rmtree(folder)


def own(folder: Path) -> None:
    """Give a folder, and what is in it, to whoever works `without_rights`."""
    for path in [folder, *folder.rglob("*")] if IS_ROOT else []:
        os.chown(path, NOBODY, NOBODY)


def as_nobody(run: Callable) -> Callable:
    """`run`, without rights."""

    def held(*arguments):
        with without_rights():
            return run(*arguments)

    return held


def _open_all(folder: Path) -> None:
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o755 if path.is_dir() else 0o644)


def drop_rights() -> None:
    """In a child that is about to begin: what it starts may no longer pass over the modes of files, root or not."""
    if IS_ROOT:
        prctl = ctypes.CDLL(None, use_errno=True).prctl
        for number in OVERRIDES:
            if prctl(DROP, number, 0, 0, 0):
                raise OSError(ctypes.get_errno(), "a capability cannot be dropped")
