"""What holds for every command: bad input changes no file, one line names it, and old files stay until new are whole.

By reflection over the parser: a command, and an option that holds a path, cannot be added without being looked at.
"""

from __future__ import annotations

import itertools

import command_runs
import numpy as np
import pytest
from command_runs import FOLDERS, READ, WRITTEN, contents, words
from small_disks import small_disk

NOISE = np.random.default_rng(0).bytes(600)
POINTS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
LINES = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2 3\n"
LINE_OFF = b"OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"
BEGUN = b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000\nproperty float x\nend_header\nabcd"
# Files that no command can work on; None is a folder, "" is not there.
BAD: dict[str, bytes | str | None] = {
    "missing.obj": "", "folder.obj": None, "empty.ply": b"", "noise.glb": NOISE, "noise.gltf": NOISE,
    "noise.fbx": NOISE, "noise.blend": NOISE, "noise.stl": NOISE, "noise.off": NOISE, "begun.ply": BEGUN,
    "x" * 300 + ".obj": "", "points.obj": POINTS, "lines.obj": LINES, "flat.off": LINE_OFF, "unknown.xyz": POINTS,
}  # fmt: skip
# Commands that write nothing, or find nothing to do on the bodies here.
NOTHING_WRITTEN = ("distance", "similar", "symmetrize", "rectify")
# What OUT may be: it then takes the place of what was read.
REPLACED = {("output", "input"), ("output", "target"), ("image_out", "image"), ("image_output", "image"),
            ("attributes", "input")}  # fmt: skip


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    """Files that every command can work on, which no test may change."""
    path = tmp_path_factory.mktemp("commands")

    def run(*arguments):
        return package("cli").main([str(a) for a in arguments]), "", ""

    command_runs.prepare(run, path)
    return path


@pytest.fixture(autouse=True)
def untouched(folder):
    """Every test leaves everything in the folder as it was."""
    before = contents(folder)
    yield
    assert contents(folder) == before


def put(path, data):
    if data is None:
        path.mkdir()
    elif data != "":
        path.write_bytes(data)


def refused(run, folder, call, named, statuses=(1, 2)):
    """Run what is refused: one line that names a file, and nothing changes, wherever it is."""
    before = contents(folder)
    status, out, err = run(*call)
    assert status in statuses, (call, status, err)
    assert out == "" and len(err.splitlines()) == 1 and err.startswith("omt_uv: error: "), (call, out, err)
    # A mesh has the name of its file.
    assert any(name.rpartition(".")[0][-40:] in err for name in named if name), (call, err)
    assert "Traceback" not in err and "Location:" not in err, err
    assert contents(folder) == before, call
    return err


def test_every_command_and_every_path_is_looked_at(package):
    commands = command_runs.commands(package)
    assert commands.keys() == command_runs.CALLS.keys()
    for name, command in commands.items():
        for action in command_runs.paths_of(command):
            assert action.dest in READ | WRITTEN, (name, action.dest)
            if action.dest in WRITTEN - {"output"}:
                assert action.option_strings[0] in command_runs.CALLS[name], (name, action.dest)


def test_a_file_that_is_none_is_refused_by_every_command_and_nothing_changes(package, run, folder, tmp_path):
    for name, data in BAD.items():
        (tmp_path / "shapes").mkdir()
        put(tmp_path / name, data)
        if data:
            put(tmp_path / "shapes" / name, data)
        (tmp_path / "shapes" / "a.blend").write_bytes((folder / "in.blend").read_bytes())
        for old in ("out.blend", "report.json", "preview.png"):
            (tmp_path / old).write_bytes(b"old")
        for command in command_runs.CALLS:
            given = name if command not in FOLDERS or not data else "shapes"
            if command in ("seams", "flow") and name == "flat.off":
                continue  # which need no area
            call = words(command, folder, **written_to(tmp_path))
            call[1] = tmp_path / given
            if command == "library" and data:
                # A folder's others go in all the same, and what does not is told of.
                status, _, err = run(*call)
                assert status == 0 and (name in err or name == "unknown.xyz"), (name, err)
                (tmp_path / "out.npz").unlink()
            elif command == "average" and data:
                refused(run, tmp_path, call, [name, "shapes."])
            else:
                refused(run, tmp_path, call, [name], (1,))
        for path in (tmp_path / "shapes").iterdir():
            path.unlink()
        (tmp_path / "shapes").rmdir()


def written_to(there):
    """Names of all files that are written, as seen from the folder of those that are read, but in another one."""
    return {key: str(there / command_runs.FILES[key]) for key in (*WRITTEN, "npz")}


def test_a_second_file_that_is_none_is_refused_by_every_command(package, run, folder, tmp_path):
    tried = 0
    for name, data in BAD.items():
        put(tmp_path / name, data)
        for command, parser in command_runs.commands(package).items():
            for action in command_runs.paths_of(parser):
                if action.dest not in READ - {"input"} or (name == "unknown.xyz" and action.dest == "handles"):
                    continue
                replaced = written_to(tmp_path) | {action.dest: str(tmp_path / name)}
                refused(run, tmp_path, words(command, folder, **replaced), [name], (1,))
                tried += 1
    assert tried > 80


def test_what_cannot_be_written_is_refused_before_anything_is_read(package, run, folder, tmp_path):
    """A folder that is not there, a folder in place of the file, a name of another format."""
    for command, parser in command_runs.commands(package).items():
        for action in command_runs.paths_of(parser):
            if action.dest not in WRITTEN:
                continue
            key = "npz" if command in command_runs.ARRAYS else action.dest
            suffix = command_runs.FILES[key].rpartition(".")[2]
            (tmp_path / f"is_folder.{suffix}").mkdir(exist_ok=True)
            given = "" if command in FOLDERS else "not there"
            for bad in (tmp_path / "none" / f"x.{suffix}", tmp_path / f"is_folder.{suffix}", tmp_path / "x.strange"):
                if action.dest == "report" and bad.suffix == ".strange":
                    continue
                call = words(command, folder, given, **(written_to(tmp_path) | {key: str(bad)}))
                refused(run, tmp_path, call, [bad.name, "none."])


def test_no_two_files_of_a_command_may_be_one(package, run, folder):
    tried = 0
    for command, parser in command_runs.commands(package).items():
        dests = [action.dest for action in command_runs.paths_of(parser)]
        for a, b in itertools.product(dests, dests):
            if a not in WRITTEN or a == b or (a, b) in REPLACED or (command in FOLDERS and b == "input"):
                continue
            of_b = command_runs.FILES.get(b, "in.blend")
            key = "npz" if command in command_runs.ARRAYS else a
            call = words(command, folder, **{key: of_b})
            assert refused(run, folder, call, ["one file.", "Name.", "Use.", "Write.", of_b])
            tried += 1
    assert tried > 60


@pytest.fixture
def progress(package, monkeypatch):
    """How far solvers say that they are, a list for each that is run to its end."""
    module, told = package("solver.progress"), []
    drain = module.drain

    def recorded(steps, callback=None):
        told.append([])
        mine = told[-1]
        return drain(steps, lambda p: mine.append(p.fraction) if callback is None else callback(p))

    monkeypatch.setattr(module, "drain", recorded)
    return told


@pytest.mark.parametrize("command", [c for c in command_runs.CALLS if c not in NOTHING_WRITTEN])
def test_a_full_disk_leaves_whole_what_was_there_and_a_good_one_changes_only_what_was_named(
    package, run, folder, tmp_path, command, progress
):
    files = written_to(tmp_path)
    (parser,) = (p for name, p in command_runs.commands(package).items() if name == command)
    keys = {
        "npz" if command in command_runs.ARRAYS else a.dest for a in command_runs.paths_of(parser) if a.dest in WRITTEN
    }
    targets = {command_runs.FILES[key] for key in keys}
    if command == "remesh":
        files["report"] = str(tmp_path / "report.json")
    for name in targets - {"out.npz"}:
        (tmp_path / name).write_bytes(b"old")
    call = words(command, folder, **files)
    with small_disk(900):
        err = refused(run, tmp_path, call, targets, (1,))
    assert "Is the disk full?" in err or "written" in err or "large" in err.lower(), err
    status, _, err = run(*call)
    assert status == 0, err
    found = contents(tmp_path)
    assert found.keys() == targets
    assert all(data != b"old" for data in found.values()), command
    # It went on all the time, and not beyond the end.
    for each in filter(None, progress):
        # Nor did it stand there for long.
        assert len(each) < 4 or np.mean(np.equal(each, 1)) < 0.5, (command, each)
        assert each[0] >= 0 and each[-1] <= 1 and (np.diff(each) >= -1e-9).all(), (command, each)


# What some commands refuse beside what all do, @ for files of the folder, # for new ones, and what they name.
SOME = {
    "distances @index.npz -o #out.txt": ".csv",
    "distances @index.npz -o #out.csv --picture #out.jpg": "out.jpg: this picture is a .png",
    "distances @index.npz -o #out.csv --mds #out.jpg": "out.jpg: this picture is a .png",
    "distances @index.npz -o #out.csv --knn 1": "Give --labels",
    "distances @index.npz -o #out.csv --labels @image.png": "no table",
    "distances @index.npz -o #out.csv --labels #one.csv": "has no class for 1 shapes",
    "page @shapes -o #out.txt": ".html",
    "magnify @in.blend -o #out.blend --weights region --factor 1.5 --source uv --image @image.png": "--image-output",
    "magnify @in.blend -o #out.blend --weights region --factor 1.5 --source uv --image-size 64": "Give all of them",
    "magnify @in.blend -o #out.blend --weights region --factor 1.5 --source mesh --image @image.png "
    "--image-output #out.png": "--source uv",
    "match @in.blend @other.blend --wrap -o #out.stl": "no vertices in common",
    "match @in.blend @in.blend -o #out.blend": "both files are one",
    "match @two.blend @in.blend -o #out.blend": "several meshes",
    "average @shapes -o @shapes/a.blend": "Give the mean a name of its own",
    "average @shapes -o #out.blend --report @shapes/b.blend": "Give each a name of its own",
    "compare @two.blend @in.blend --beltrami": "one by --object",
    "compare @in.blend @other.blend --beltrami --plot #plot.png": "Leave them out",
    "compare @in.blend @other.blend --beltrami --csv": "Leave them out",
    "compare @in.blend @other.blend --beltrami --samples 9": "Leave them out",
    "compare @in.blend @other.blend --shape-key Smile": "--beltrami. Give both",
    "measure @in.blend --shape-key Smile": "--beltrami. Give both",
    "measure @in.blend --histogram #h.png --preview #p.png --regions nowhere": "Paint or assign one",
    "measure @in.blend --beltrami --regions groups": "Leave --regions out",
    "distance @two.blend @in.blend --markers 0,1": "Choose it by --object",
    "distance @in.blend @other.blend --markers 0,900": "no vertex 900",
    "test-texture @in.blend -o #out.png --size 900000": "picture of 3.24e+12 pixels takes more memory",
    "test-texture @in.blend -o #out.png --size 900000 --kind area": "picture of 3.24e+12 pixels takes more memory",
    "diagram @in.blend -o #out.png --size 900000": "picture of 3.24e+12 pixels takes more memory",
    "magnify @in.blend -o #out.blend --weights region --factor 1.5 --source uv --image @image.png "
    "--image-output #out.png --image-size 900000": "pixels takes more memory",
}  # fmt: skip


@pytest.mark.parametrize("call", SOME)
def test_what_some_commands_refuse_is_named_in_one_line_and_nothing_is_written(run, folder, tmp_path, call):
    (tmp_path / "one.csv").write_text("a.blend,first\n")
    at = {"@": folder, "#": tmp_path}
    arguments = [at[word[0]] / word[1:] if word[0] in at else word for word in call.split()]
    err = refused(run, tmp_path, arguments, [SOME[call] + "."])
    assert SOME[call] in err
