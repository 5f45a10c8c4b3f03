"""Versions and lists that stand in several files are the same in all of them."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def pinned(name):
    """Versions of a project in both files of requirements, in the order of their lines."""
    text = (ROOT / "requirements.txt").read_text() + (ROOT / "requirements-dev.txt").read_text()
    return re.findall(rf"^{name}==([\w.]+)", text, re.MULTILINE)


def constant(path, name):
    tree = ast.parse((ROOT / path).read_text())
    (value,) = (n.value for n in tree.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == name)
    return ast.literal_eval(value)


def test_the_hook_runs_the_ruff_of_the_requirements():
    hook = re.search(r"ruff-pre-commit\n\s*rev: v([\d.]+)", (ROOT / ".pre-commit-config.yaml").read_text())
    assert [hook[1]] == pinned("ruff")


def test_the_matrix_runs_the_pytest_of_the_requirements():
    assert constant("scripts/release/matrix.py", "PYTEST").split("==")[1:] == pinned("pytest")


def test_the_server_runs_every_python_that_blender_is_pinned_for():
    requirements = (ROOT / "requirements.txt").read_text()
    pythons = re.findall(r'^bpy==.*python_version == "([\d.]+)"', requirements, re.MULTILINE)
    workflow = (ROOT / ".github" / "workflows" / "test.yml").read_text()
    assert re.findall(r'"(3\.\d+)"', workflow) == pythons


def test_the_wheel_depends_on_what_the_extension_brings():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wheels = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["wheels"]
    # Linux distributions alone have a later Python, which no wheel of the pinned scipy is for.
    brought = {tuple(Path(w).name.split("-")[:2]) for w in wheels if "-cp314-" not in w}
    assert brought == {(name, pinned(name)[0]) for name in ("scipy", "xatlas")}
    assert {f"bpy=={v}" for v in pinned("bpy")} == {
        line.split(";")[0] for line in project["optional-dependencies"]["blender"]
    }


def test_the_extension_has_the_version_of_the_package():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    assert manifest["version"] == constant("omt_uv/__init__.py", "__version__")


def test_the_matrix_runs_the_folders_that_need_blender():
    assert constant("scripts/release/matrix.py", "FOLDERS") == constant("tests/conftest.py", "FOLDERS")
