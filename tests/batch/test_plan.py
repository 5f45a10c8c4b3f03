"""Which files a batch works on, where their results go, and the words of each run."""

from __future__ import annotations

import shlex
from pathlib import Path
from types import SimpleNamespace

import pytest

NAMES = ["a.obj", "sub/b.ply", "sub/deep/c.OFF", "-d.glb", "e $(touch x); .obj"]


@pytest.fixture
def folder(tmp_path):
    """A folder with meshes of growing size, and what is none."""
    for k, name in enumerate([*NAMES, "notes.txt", ".hidden.obj", ".git/f.obj"]):
        path = tmp_path / "in" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x" * (k + 1))
    return tmp_path / "in"


def plan_of(package, output, **more):
    return package("batch.plan").BatchPlan("unwrap", ("--quality", "draft"), output, **more)


def test_a_folder_is_taken_with_its_folders_the_largest_first(package, folder, tmp_path):
    module = package("batch.plan")
    tasks = module.tasks_of(plan_of(package, tmp_path / "out"), folder)
    assert [task.name for task in tasks] == NAMES[::-1]
    outputs = {task.name: task.output.relative_to(tmp_path / "out").as_posix() for task in tasks}
    assert outputs == {name: name.replace(".OFF", ".ply") for name in NAMES}


def test_results_within_the_folder_are_no_input(package, folder):
    module = package("batch.plan")
    (folder / "out").mkdir()
    (folder / "out" / "a.obj").write_text("x")
    assert len(module.tasks_of(plan_of(package, folder / "out"), folder)) == len(NAMES)


def test_a_list_is_relative_to_itself_and_names_to_what_its_files_share(package, folder, tmp_path):
    module = package("batch.plan")
    (folder / "list.txt").write_text(f"sub/b.ply\n\n{folder / 'sub/deep/c.OFF'}\nsub/b.ply\nsub/none.obj\n")
    tasks = module.tasks_of(plan_of(package, tmp_path / "out"), folder / "list.txt")
    assert [task.name for task in tasks] == ["deep/c.OFF", "b.ply", "none.obj"]
    assert tasks[-1].size == 0


def test_two_files_with_one_result_are_refused_by_name(package, folder, tmp_path):
    module = package("batch.plan")
    (folder / "a.ply").write_text("x")
    with pytest.raises(module.BatchError, match=r"a\.obj and a\.ply would both become"):
        module.tasks_of(plan_of(package, tmp_path / "out", suffix=".ply"), folder)
    with pytest.raises(module.BatchError, match="would replace it"):
        module.tasks_of(
            plan_of(package, folder), folder / "list.txt" if (folder / "list.txt").exists() else _list(folder)
        )
    assert len(module.tasks_of(plan_of(package, tmp_path / "out", suffix=".ply", writes=False), folder)) == 6


def _list(folder):
    path = folder.parent / "list.txt"
    path.write_text(f"{folder / 'a.obj'}\n")
    return path


@pytest.mark.parametrize("text", ["", "\n \n"])
def test_nothing_to_do_is_an_error(package, tmp_path, text):
    module = package("batch.plan")
    (tmp_path / "list.txt").write_text(text)
    with pytest.raises(module.BatchError, match="empty"):
        module.tasks_of(plan_of(package, tmp_path / "out"), tmp_path / "list.txt")
    with pytest.raises(module.BatchError, match="no mesh") as caught:
        module.tasks_of(plan_of(package, tmp_path / "out"), tmp_path)
    assert str(caught.value).startswith(f"{tmp_path}: there is no mesh")
    with pytest.raises(module.BatchError, match="neither"):
        module.tasks_of(plan_of(package, tmp_path / "out"), tmp_path / "none")


def test_parts_are_all_files_once_whatever_is_added(package, folder, tmp_path):
    module = package("batch.plan")
    plan = plan_of(package, tmp_path / "out")
    parts = [{t.name for t in module.tasks_of(plan, folder, (k, 3))} for k in (1, 2, 3)]
    assert set().union(*parts) == set(NAMES) and sum(map(len, parts)) == len(NAMES)
    (folder / "more.obj").write_text("x")
    again = [{t.name for t in module.tasks_of(plan, folder, (k, 3))} - {"more.obj"} for k in (1, 2, 3)]
    assert again == parts


def test_a_name_is_one_word_and_no_option(package, folder, tmp_path):
    """It reaches no shell; the text that is kept to be pasted quotes it."""
    module = package("batch.plan")
    plan = plan_of(package, tmp_path / "out", memory=2.0)
    for task in module.tasks_of(plan, folder):
        words = module.words_of(plan, task, {"report": tmp_path / "r.json"})
        assert words[:2] == ["unwrap", str(task.path)] and words[1].startswith("/")
        assert words[2:] == [
            "-o",
            str(task.output),
            "--report",
            str(tmp_path / "r.json"),
            "--memory",
            "2",
            *plan.options,
        ]
        assert shlex.split(module.shell_text(words)) == words


def test_paths_are_whole_wherever_the_program_was_begun(package, tmp_path, monkeypatch):
    """A worker begins elsewhere, and a name that begins with a dash would be an option."""
    module = package("batch.plan")
    monkeypatch.chdir(tmp_path)
    places = {name: Path(f"-{name}") for name in ("input", "output", "report", "preview")}
    task = SimpleNamespace(path=Path("-a.obj"), output=Path("-b.obj"))
    here = tmp_path.resolve()
    for given, words in (({}, ["-a.obj", "-b.obj"]), (places, [f"-{name}" for name in places])):
        found = [w for w in module.words_of(plan_of(package, tmp_path / "out"), task, given)[1:] if "/" in w]
        assert [Path(word) for word in found] == [here / word for word in words]


def test_the_key_changes_with_whatever_changes_results(package, tmp_path):
    plan = plan_of(package, tmp_path / "out")
    more = [plan_of(package, tmp_path / "out", **{k: v}) for k, v in
            [("suffix", ".ply"), ("version", "9"), ("previews", False)]]  # fmt: skip
    keys = {p.key() for p in [plan, *more, package("batch.plan").BatchPlan("refine", plan.options, plan.output)]}
    assert len(keys) == 5
    assert plan_of(package, tmp_path / "elsewhere", timeout=9.0, memory=1.0).key() == plan.key()


def test_what_a_run_has_written_is_its_file_or_all_its_levels_of_detail(package, tmp_path):
    outputs = package("batch.child").outputs_of
    task = package("batch.plan").FileTask("a.obj", tmp_path / "a.obj", 1, 1, tmp_path / "out" / "a.obj")
    assert outputs(task) == {}
    (tmp_path / "out").mkdir()
    levels = [tmp_path / "out" / f"a_LOD{k}.obj" for k in (0, 1, 2, 4)]
    for k, path in enumerate(levels):
        path.write_bytes(b"x" * (k + 1))
    # What comes after a gap is of another run.
    found = outputs(task)
    assert {path: size for path, (_, size) in found.items()} == {str(path): k + 1 for k, path in enumerate(levels[:3])}
    assert len({digest for digest, _ in found.values()}) == 3
    task.output.write_bytes(b"whole")
    assert [(path, size) for path, (_, size) in outputs(task).items()] == [(str(task.output), 5)]
