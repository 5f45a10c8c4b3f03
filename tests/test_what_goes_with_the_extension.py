"""What modules keep outside of Blender's classes is given back when the extension goes: all of it."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1] / "omt_uv"


def called(function: ast.FunctionDef) -> set[str]:
    """What a function calls, as it is written."""
    return {ast.unparse(node.func) for node in ast.walk(function) if isinstance(node, ast.Call)}


def test_every_module_that_can_forget_does_so_when_the_extension_goes():
    tree = ast.parse((ROOT / "registration.py").read_text(encoding="utf-8"))
    (clear,) = (n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == "_clear")
    made = [
        (path, node)
        for path in sorted(ROOT.rglob("*.py"))
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and node.name == "forget" and not node.args.args
    ]
    assert len(made) > 2
    assert {f"{path.stem}.forget" for path, _ in made} - called(clear) == set()
