"""The job type for Flamenco, in a JavaScript engine with the functions that the manager documents."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "farm" / "omt_uv_batch.js"
NODE = shutil.which("node")
# The manager gives a script `author.Task(name, type)`, `author.Command(name, parameters)`, `print`, `path`; a job has
# `settings`, `addTask`; a task has `addCommand` and `addDependency`. Anything else is an error here.
MANAGER = """
const made = [];
function Task(name, type) {
  const task = { name, type, commands: [], after: [] };
  const addDependency = t => task.after.push(t.task.name);
  return Object.freeze({ task, addCommand: c => task.commands.push(c), addDependency });
}
const author = Object.freeze({ Task, Command: (name, parameters) => ({ name, parameters }) });
const job = { name: "job", settings: GIVEN, addTask: t => made.push(t.task) };
new Function("author", "job", "print", "path", SCRIPT + "; compileJob(job); this.type = JOB_TYPE;").call(
  globalThis, author, job, () => {}, { dirname: null });
console.log(JSON.stringify({ made, type: globalThis.type }));
"""
TYPES = {"string", "int32", "float", "bool"}
KEYS = {"key", "type", "subtype", "choices", "propargs", "description", "default", "required", "visible", "editable"}
pytestmark = pytest.mark.skipif(NODE is None, reason="no JavaScript engine")


def compiled(**settings):
    code = MANAGER.replace("GIVEN", json.dumps(settings)).replace("SCRIPT", json.dumps(SCRIPT.read_text()))
    done = subprocess.run([NODE, "-e", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_settings_are_of_kinds_that_the_manager_knows():
    settings = compiled(command="unwrap", input="/a", output="/b", options="", parts=1)["type"]["settings"]
    for setting in settings:
        assert setting.keys() <= KEYS and setting["type"] in TYPES, setting
        assert setting.get("subtype", "dir_path") in ("dir_path", "file_path", "file_name", "hashed_file_path")
        assert setting.get("visible") in ("visible", "hidden", "submission", "web")
        assert setting["description"] and ("default" in setting or setting["required"])
        assert setting.get("default", "") in setting.get("choices", [setting.get("default", "")])


def test_parts_are_tasks_and_the_table_comes_after_all(package):
    settings = {"command": "remesh", "input": "/mnt/in dir", "output": "/mnt/out $(x)/", "parts": 3, "jobs": 2,
                "timeout": 60, "options": "--vertices 500 --density 'my group'"}  # fmt: skip
    *parts, last = compiled(**settings)["made"]
    assert [task["type"] for task in (*parts, last)] == ["blender"] * 4
    assert last["after"] == [task["name"] for task in parts]
    for k, task in enumerate(parts, 1):
        (command,) = task["commands"]
        assert (command["name"], command["parameters"]["exe"]) == ("exec", "{blender}") and not task["after"]
        words = command["parameters"]["args"]
        assert words[:3] == ["-b", "--command", "omt_uv"]
        options = package("cli").parsed(words[3:])
        assert options.rest == ["--vertices", "500", "--density", "my group"]
        assert (options.command, options.part, options.jobs, options.timeout) == ("remesh", (k, 3), 2, 60.0)
        assert (str(options.input), str(options.output)) == ("/mnt/in dir", "/mnt/out $(x)")
    read = [package("cli").parsed(command["parameters"]["args"][3:]) for command in last["commands"]]
    assert str(read[0].output) == "/mnt/out $(x).csv" and str(read[1].input) == "/mnt/out $(x)"


def test_settings_left_alone_leave_options_out(package):
    (part, _) = compiled(command="unwrap", input="/a", output="/b", options="", parts=1, jobs=0, timeout=0)["made"]
    words = part["commands"][0]["parameters"]["args"]
    assert "--" not in words and "--jobs" not in words and "--timeout" not in words
    assert package("cli").parsed(words[3:]).rest == []
