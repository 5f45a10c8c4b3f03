"""Folders for temporary files: whoever is killed leaves them behind, and the next who makes one removes them."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="locks of POSIX")
HOLDER = """
import sys
from omt_uv.temporary import own_folder
with own_folder() as folder:
    (folder / "in").mkdir()
    (folder / "in" / "mesh.obj").write_text("v")
    print(folder, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def temporary(package, tmp_path, monkeypatch):
    """The module; folders for temporary files lie in `tmp_path`."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return package("temporary")


def holder():
    """A process that has a folder, and the folder."""
    process = subprocess.Popen([sys.executable, "-c", HOLDER], cwd=ROOT, text=True, stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, env=dict(os.environ))  # fmt: skip
    return process, Path(process.stdout.readline().strip())


def end(process, number):
    process.send_signal(number)
    process.wait()
    process.stdin.close()
    process.stdout.close()


def test_what_a_killed_process_left_goes_with_the_next_and_what_lives_stays(temporary, tmp_path):
    dead, left = holder()
    alive, kept = holder()
    try:
        assert {left.parent, kept.parent} == {tmp_path} and left != kept
        end(dead, signal.SIGKILL)
        assert (left / "in" / "mesh.obj").exists()
        with temporary.own_folder() as mine:
            assert not left.exists() and (kept / "in" / "mesh.obj").exists()
            # Nor does it take its own, of another thread.
            with temporary.own_folder() as other:
                assert mine.is_dir() and other.is_dir()
        assert [path for path in tmp_path.iterdir() if path.is_dir()] == [kept]
        assert len(list(tmp_path.iterdir())) == 2
        # One that ends well takes its own along.
        alive.communicate("")
        assert list(tmp_path.iterdir()) == []
    finally:
        alive.kill()


def left_behind(temporary, place, words=None):
    """A folder whose process is gone."""
    handle, name = tempfile.mkstemp(prefix=temporary.FOLDER, suffix=temporary.OWNER, dir=place)
    os.close(handle)
    owner = Path(name)
    owner.write_bytes(temporary._owned_by(12345) if words is None else words)
    folder = owner.with_suffix("")
    folder.mkdir()
    (folder / "data").write_bytes(b"1")
    return folder, owner


@pytest.mark.parametrize("change", ["no owner", "machine", "user", "name", "link", "no locks", "unsaid", "nothing"])
def test_only_folders_of_ours_of_this_machine_and_user_go(temporary, tmp_path, monkeypatch, change):
    folder, owner = left_behind(temporary, tmp_path)
    if change == "no owner":
        owner.unlink()
    elif change == "machine":
        owner.write_bytes(b"12345 another machine")
    elif change == "user":
        user = os.getuid()
        monkeypatch.setattr(os, "getuid", lambda: user + 1)
    elif change == "name":
        folder = folder.rename(tmp_path / "others")
        owner.rename(tmp_path / f"others{temporary.OWNER}")
    elif change == "link":
        owner.rename(tmp_path / "there")
        owner.symlink_to(tmp_path / "there")
    elif change == "no locks":
        monkeypatch.setattr(temporary, "fcntl", None)
    elif change == "unsaid":  # It was killed before it said whose it is.
        owner.write_bytes(b"")
    temporary.sweep_folders(tmp_path)
    assert (folder / "data").exists() == (change not in ("unsaid", "nothing"))
    assert folder.exists() or list(tmp_path.iterdir()) == []


def test_a_link_in_place_of_a_folder_leads_to_nothing_that_goes(temporary, tmp_path):
    folder, _ = left_behind(temporary, tmp_path)
    there = folder.rename(tmp_path / "there")
    folder.symlink_to(there)
    temporary.sweep_folders(tmp_path)
    assert (there / "data").exists()


def test_what_cannot_be_removed_is_found_again(temporary, tmp_path, monkeypatch):
    folder, owner = left_behind(temporary, tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "rmtree", lambda path, ignore_errors: (path / "data").unlink())
        temporary.sweep_folders(tmp_path)
    assert owner.exists() and folder.exists()
    temporary.sweep_folders(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_child_removes_the_folder_of_its_parent_and_no_other(temporary, tmp_path):
    mine, _ = left_behind(temporary, tmp_path, temporary._owned_by(7))
    other, _ = left_behind(temporary, tmp_path, temporary._owned_by(77))
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (tmp_path / f"foreign{temporary.OWNER}").write_bytes(temporary._owned_by(7))
    for folder in (mine, other, foreign, tmp_path / "omt_uv_none"):
        temporary.remove_of(folder, 7)
    assert {path for path in tmp_path.iterdir() if path.is_dir()} == {other, foreign}
    assert len(list(tmp_path.iterdir())) == 4


@pytest.mark.parametrize("kind", ["none", "refused"])
def test_where_nothing_is_locked_a_folder_is_made_and_goes(temporary, tmp_path, monkeypatch, kind):
    import fcntl

    def fails(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", fails)
    monkeypatch.setattr(temporary, "fcntl", None if kind == "none" else fcntl)
    left = set(left_behind(temporary, tmp_path))
    with temporary.own_folder() as folder:
        assert folder.is_dir() and temporary._owner_of(folder).read_bytes() == temporary._owned_by(os.getpid())
    assert set(tmp_path.iterdir()) == left


@pytest.mark.parametrize("when", ["locked", "gone"])
def test_a_file_that_is_taken_for_a_rest_is_made_again(temporary, tmp_path, monkeypatch, when):
    import fcntl

    lock, times = fcntl.flock, []

    def first(file, how):
        times.append(file.name)
        if len(times) == 1:
            taken = next(tmp_path.glob("*.owner"))
            taken.unlink()
            if when == "locked":
                raise BlockingIOError(11, "taken")
        lock(file, how)

    monkeypatch.setattr(fcntl, "flock", first)
    with temporary.own_folder() as folder:
        assert {path.name for path in tmp_path.iterdir()} == {folder.name, f"{folder.name}.owner"}
    assert len(times) == 2 and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("mask", [0o000, 0o022, 0o077])
def test_a_folder_is_of_its_user_alone_whatever_the_mask(temporary, mask):
    """Meshes of others may lie in it, and where it stands everybody may look."""
    before = os.umask(mask)
    try:
        with temporary.own_folder() as folder:
            assert folder.stat().st_mode & 0o777 == 0o700
            assert not temporary._owner_of(folder).stat().st_mode & 0o077
    finally:
        os.umask(before)
