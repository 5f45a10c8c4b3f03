"""Data flows one way: the solver knows numpy, scipy and itself, and nothing of Blender."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "omt_uv"
SOLVER = sorted((PACKAGE / "solver").glob("**/*.py"))
ALLOWED = {"numpy", "scipy"} | set(sys.stdlib_module_names)


def imports(path):
    """Pairs (level, module) of every import statement, wherever it stands."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.level, node.module or ""


def test_the_solver_was_found():
    assert len(SOLVER) > 5


@pytest.mark.parametrize("path", SOLVER, ids=lambda p: p.name)
def test_solver_imports_only_numpy_scipy_and_itself(path):
    for level, module in imports(path):
        if level == 0:
            assert module.split(".")[0] in ALLOWED, f"{path.name} imports {module}"
        else:
            assert level == 1, f"{path.name} reaches out of the solver to {module}"


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("**/*.py")), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_the_package_imports_itself_relatively(path):
    """Inside Blender it has another name."""
    assert not [m for level, m in imports(path) if level == 0 and m.split(".")[0] == "omt_uv"]


@pytest.mark.parametrize("name", ["packing", "settings", "unwrapping", "cli", "__init__"])
def test_bpy_stays_in_its_rooms(name):
    tree = ast.parse((PACKAGE / f"{name}.py").read_text())
    top = [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
    assert "bpy" not in {alias.name for n in top if isinstance(n, ast.Import) for alias in n.names}


def test_entry_of_the_extension_imports_nothing_at_the_top():
    tree = ast.parse((PACKAGE.parent / "__init__.py").read_text())
    assert not [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]


@pytest.mark.parametrize("path", SOLVER, ids=lambda p: p.name)
def test_modules_stay_small(path):
    assert len(path.read_text().splitlines()) < 450
