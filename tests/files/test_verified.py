"""Files come whole or not at all, and what killed processes left goes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from without_rights import folder_of_nobody, own, without_rights

from omt_uv.files import verified
from omt_uv.files.verified import FileError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_block_that_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / "a.txt").write_text("old")
    for error in (OSError(28, "No space left on device"), FileError("no"), KeyboardInterrupt(), MemoryError()):
        with pytest.raises((FileError, KeyboardInterrupt, MemoryError)), verified.staged(tmp_path / "a.txt") as made:
            made.write_text("half")
            raise error
        assert names(tmp_path) == ["a.txt"]
        assert (tmp_path / "a.txt").read_text() == "old"
    with pytest.raises(FileError, match="nothing was written"), verified.staged(tmp_path / "a.txt"):
        pass
    assert (tmp_path / "a.txt").read_text() == "old"


def test_what_does_not_read_as_written_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(type(tmp_path), "write_bytes", lambda path, data: path.write_text("whol"))
    with pytest.raises(FileError, match="disk full"):
        verified.write_text(tmp_path / "a.txt", "whole")
    assert names(tmp_path) == []


def test_disks_that_cannot_flush_are_errors(tmp_path, monkeypatch):
    (tmp_path / "a.txt").write_text("old")

    def broken(handle):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", broken)
    with pytest.raises(FileError, match="Input/output"):
        verified.write_text(tmp_path / "a.txt", "new")
    assert (tmp_path / "a.txt").read_text() == "old"
    assert names(tmp_path) == ["a.txt"]


def test_links_stay_links_and_companions_come_first(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("real.txt")
    companions = {}
    with verified.staged(tmp_path / "link.txt", companions) as made:
        made.write_text("new")
        other = made.with_suffix(".mtl")
        other.write_text("more")
        companions[other] = tmp_path / "more.mtl"
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"
    assert names(tmp_path) == ["link.txt", "more.mtl", "real.txt"]


def test_leftovers_of_the_dead_go_and_files_of_the_living_stay(tmp_path):
    program = (
        "import sys, time; from pathlib import Path; from omt_uv.files import verified\n"
        "with verified.staged(Path(sys.argv[1])) as made:\n"
        "    made.write_text('half'); made.with_suffix('.mtl').write_text('x')\n"
        "    print(made.name, flush=True); time.sleep(60)"
    )
    here = os.path.dirname(os.path.dirname(os.path.dirname(verified.__file__)))
    started = [
        subprocess.Popen([sys.executable, "-c", program, str(tmp_path / "a.txt")], cwd=here, stdout=subprocess.PIPE)
        for _ in range(2)
    ]
    made = [process.stdout.readline().decode().strip() for process in started]
    started[0].kill()
    started[0].wait()
    assert (tmp_path / made[0]).exists()
    verified.write_text(tmp_path / "b.txt", "new")
    rest = names(tmp_path)
    assert not [name for name in rest if name.startswith(made[0].removesuffix(".txt"))]
    assert len([name for name in rest if name.startswith(made[1].removesuffix(".txt"))]) == 3
    started[1].kill()
    started[1].wait()
    verified.sweep(tmp_path)
    assert names(tmp_path) == ["b.txt"]


def test_what_a_process_of_another_machine_left_goes_at_once_with_its_lock(tmp_path):
    """Its number may be that of one that lives here: that nothing holds the lock tells, so the lock goes last."""
    for suffix in (".lock", ".obj", ".mtl", ".aaa"):
        (tmp_path / f".omt_uv_{os.getpid()}_x{suffix}").write_text("half")
    verified.sweep(tmp_path)
    assert names(tmp_path) == []


def test_old_leftovers_without_a_lock_go(tmp_path):
    (tmp_path / ".omt_uv_old").mkdir()
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    (tmp_path / f".omt_uv_{gone.pid}_x.lock.new").write_text("")
    (tmp_path / f".omt_uv_{os.getpid()}_x.obj").write_text("half")
    verified.sweep(tmp_path)
    assert names(tmp_path) == [f".omt_uv_{os.getpid()}_x.obj", ".omt_uv_old"]
    for path in tmp_path.iterdir():
        os.utime(path, (0, 0))
    verified.sweep(tmp_path)
    assert names(tmp_path) == []


def test_paths_that_lead_to_one_file_clash(tmp_path):
    (tmp_path / "a").write_text("")
    os.link(tmp_path / "a", tmp_path / "b")
    (tmp_path / "c").symlink_to("a")
    (tmp_path / "d").mkdir()
    for other in ("a", "b", "c", "d/../a"):
        assert verified.clash([("x", tmp_path / "a"), ("y", tmp_path / other)]) == ("x", "y")
    assert verified.clash([("x", tmp_path / "a"), ("y", tmp_path / "new")]) is None
    assert verified.clash([("x", tmp_path / "new"), ("y", tmp_path / "d/../new")]) == ("x", "y")


def test_missing_rights_are_told_beforehand():
    with folder_of_nobody() as folder:
        (folder / "a").write_text("")
        own(folder)
        with without_rights():
            (folder / "a").chmod(0o400)
            with pytest.raises(FileError, match="write-protected"):
                verified.check_writable(folder / "a")
            folder.chmod(0o500)
            with pytest.raises(FileError, match="nothing can be written"):
                verified.check_writable(folder / "b")
            (folder / "a").chmod(0)
            with pytest.raises(FileError, match=r"a: cannot be read \(Permission denied\)"):
                verified.check_readable(folder / "a")
            folder.chmod(0)
            with pytest.raises(FileError, match="cannot be read"):
                verified.check_readable(folder / "a")
    with pytest.raises(FileError, match="there is no such file"):
        verified.check_readable(folder / "a")


@pytest.mark.parametrize("length, fits", [(255, True), (256, False)])
def test_names_that_no_folder_takes_are_refused(tmp_path, length, fits):
    path = tmp_path / ("é" * (length // 2) + "e" * (length % 2))
    if fits:
        verified.check_length(path)
    else:
        with pytest.raises(FileError, match="longer than 255 bytes"):
            verified.check_length(path)


@pytest.mark.parametrize("age, goes", [(10, False), (50, False), (90, True), (3600, True)])
@pytest.mark.skipif(verified.fcntl is None, reason="no locks of files")
def test_what_nothing_locks_is_left_over_after_a_minute(tmp_path, age, goes):
    path = tmp_path / f"{verified.PREFIX}12345678.obj"
    path.write_text("half")
    then = path.stat().st_mtime - age
    os.utime(path, (then, then))
    verified.sweep(tmp_path)
    assert path.exists() != goes


@pytest.mark.parametrize("fails", [None, "c0", "c1", "target"])
def test_companions_go_to_their_places_before_what_names_them(tmp_path, monkeypatch, fails):
    """If one cannot, the file that was there still names those that were there."""

    target, places = tmp_path / "out.obj", {}
    target.write_text("old")
    moved, replace = [], verified.os.replace

    def recorded(path, place):
        if Path(path).suffix != ".new":
            moved.append(Path(place).name)
            if fails and Path(place).name.startswith(fails.replace("target", "out")):
                raise OSError(28, "No space left on device")
        return replace(path, place)

    monkeypatch.setattr(verified.os, "replace", recorded)

    def write():
        with verified.staged(target, places) as made:
            made.write_text("new")
            for k in range(2):
                other = made.with_suffix(f".c{k}")
                other.write_text(f"new {k}")
                places[other] = tmp_path / f"c{k}.mtl"

    if fails:
        with pytest.raises(verified.FileError, match="No space"):
            write()
    else:
        write()
    every = ["c0.mtl", "c1.mtl", "out.obj"]
    assert moved == every[: 3 if not fails else ["c0", "c1", "target"].index(fails) + 1]
    assert target.read_text() == ("old" if fails else "new")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives files away")
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
def test_a_file_keeps_its_owner_group_and_mode(tmp_path, mode):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(mode)
    os.chown(path, 65534, 1)
    verified.write_text(path, "new")
    found = path.stat()
    assert (found.st_uid, found.st_gid, found.st_mode & 0o777) == (65534, 1, mode) and path.read_text() == "new"


@pytest.mark.skipif(sys.platform == "win32", reason="modes of files are those of POSIX")
@pytest.mark.parametrize(
    "modes", [(0o600, 0o644, 0o640), (0o644, 0o600, None), (None, 0o640, 0o600), (0o604, None, None)]
)
def test_every_file_that_is_replaced_keeps_its_own_mode_and_new_ones_have_none_of_another(tmp_path, modes):
    """Of a file and two companions each has what stood in its own place."""
    places = [tmp_path / name for name in ("out.obj", "a.mtl", "b.mtl")]
    for path, mode in zip(places, modes, strict=True):
        if mode is not None:
            path.write_text("old")
            path.chmod(mode)
    companions: dict[Path, Path] = {}
    with verified.staged(places[0], companions) as made:
        parts = [made, made.with_suffix(".a"), made.with_suffix(".b")]
        for part in parts:
            part.write_text("new")
        usual = [part.stat().st_mode & 0o777 for part in parts]
        companions.update(zip(parts[1:], places[1:], strict=True))
    assert [path.read_text() for path in places] == ["new"] * 3
    kept = [path.stat().st_mode & 0o777 for path in places]
    assert kept == [a if b is None else b for a, b in zip(usual, modes, strict=True)]
