"""What every command says, and with which status it ends, of two meshes in which state, seldom choices among them:
a table keeps it, word for word but for numbers. What is refused is said of the mesh that it is about, and nothing is
written then; whatever a report holds of its own has its place."""

from __future__ import annotations

import json
from pathlib import Path

import bpy

import operator_states
import pytest
import scenes
from command_runs import commands
from kept import check
from operator_states import GOOD, STATES, plain

SAID = Path(__file__).with_name("said.tsv")
# Words of calls: @ begins what lies in the folder.
DRAFT = "@in.blend -o @out.blend --quality draft"
NEW = "-o @out.blend --report @report.json"
CALLS = [
    f"unwrap {DRAFT} --max-shear 0 --report @report.json --no-pack",
    f"unwrap {DRAFT} --max-shear 0 --boundary rectangle --keep-free part --udim 1012",
    f"refine {DRAFT} --report @report.json --keep-boundary",
    f"magnify {DRAFT} --weights part --factor 1.5 --source mesh --report @report.json",
    f"magnify {DRAFT} --region part=2 --region none=0.5 --source uv",
    f"sphere {DRAFT} --pole part --report @report.json",
    "seams @in.blend -o @out.blend --max-shear 0 --keep-free part",
    "weights @in.blend -o @out.blend --kind gaussian --low 0.2",
    "stack @in.blend -o @out.blend",
    "symmetrize @in.blend -o @out.blend --halves stacked",
    "rectify @in.blend -o @out.blend",
    "measure @in.blend",
    "measure @in.blend --regions groups --csv",
    "measure @in.blend --regions materials",
    "compare @in.blend @in.blend",
    *(f"partition @in.blend {NEW} --cells 3 --relax 0 --write {kind}"
      for kind in ("attribute", "mesh", "points")),
    "partition @in.blend -o @out.blend --cells 3 --relax 0 --capacity part",
    f"remesh @in.blend {NEW} --vertices 8",
    f"flow @in.blend {NEW} --handles @handles.json --samples 1",
    f"flow @in.blend {NEW} --handles @handles.json --samples 1 --keep gone",
    f"flow @in.blend {NEW} --handles @handles.json --samples 1 --keep none",
    "diagram @in.blend -o @out.png --size 16",
    "test-texture @in.blend -o @out.png --kind shear --size 16",
    "queue @in.blend -o @out.blend --quality draft --max-shear 0",
    "volume @in.blend -o @out.blend --tets 60",
    "match @in.blend @other.blend -o @out.blend",
    "distance @in.blend @in.blend --points 40",
    "signature @in.blend -o @out.npz --points 40",
]  # fmt: skip
# These are shown elsewhere: they ask for folders and tables.
WITHOUT = {"average", "library", "similar"}
# What takes long is called where it is refused at once.
LONG = {"remesh", "volume", "match", "distance", "signature", "diagram", "queue", "sphere", "flow"}
# States that files do not keep, or that are the same there as others.
NOT_OF_FILES = {"nothing", "no faces selected", "faces of one selected", "not finite", "in one place", "weight paint",
                "beside a curve", "both without vertices", "folded", "patches", "bodies", "one mesh",
                "without UVs"}  # fmt: skip


def saved(folder: Path, make) -> None:
    """The two meshes of a state in in.blend, and once more in other.blend."""
    operator_states.begin(make)
    for name in ("other", "in"):
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))


def shape(value):
    """The keys of a report, and kinds of values."""
    if isinstance(value, dict):
        return {key: shape(one) for key, one in sorted(value.items())}
    if isinstance(value, list):
        return [shape(value[0])] if value else []
    return type(value).__name__


def told(run, folder: Path, call: str) -> list[str]:
    """The status of a call, what it prints, and which files with what in them are there then."""
    given = set(folder.iterdir())
    status, out, err = run(*(f"{folder}/{word[1:]}" if word[0] == "@" else word for word in call.split()))
    made = sorted(set(folder.iterdir()) - given)
    assert status == 0 or not made, "nothing is written of what is refused"
    report = folder / "report.json"
    keys = [json.dumps(shape(json.loads(report.read_text())))] if report.exists() else []
    if (folder / "out.blend").exists():
        with bpy.data.libraries.load(str(folder / "out.blend")) as (there, _):
            keys += [f"{kind}: {', '.join(sorted(getattr(there, kind)))}" for kind in ("objects", "materials")]
    for path in made:
        path.unlink()
    return [str(status), *map(plain, (*out.splitlines(), *err.splitlines())), *(path.name for path in made), *keys]


def test_every_command_is_called(package):
    assert {call.split()[0] for call in CALLS} | WITHOUT == set(commands(package))


def test_what_is_said_in_which_state_is_that_of_the_table(package, run, tmp_path, monkeypatch):
    pytest.importorskip("tetgen")
    operator_states.with_few_samples(package, monkeypatch)
    (tmp_path / "handles.json").write_text(json.dumps({"handles": [{"vertices": [0], "move": [0, 0, 0.1]}],
                                                       "keep": ["part"]}))  # fmt: skip
    lines = []
    for state, make in STATES.items():
        if state in NOT_OF_FILES:
            continue
        scenes.open_empty()
        saved(tmp_path, make)
        for call in CALLS:
            if call.split()[0] not in LONG or state not in GOOD:
                lines.append("\t".join([state, call, "", *told(run, tmp_path, call)]))
    check(SAID, lines)
