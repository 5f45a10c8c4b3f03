"""What the stories in a real window use of the package is there: the window itself is seldom at hand to tell."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "scripts" / "gui"


def used(path):
    """Pairs (module, attribute) of every `package("module").attribute`, attribute empty where none follows."""
    tree = ast.parse(path.read_text())
    calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call) and ast.unparse(n.func).endswith(".package")]
    for call in calls:
        follows = [n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute) and n.value is call]
        yield from ((call.args[0].value, name) for name in follows or [""])


USES = sorted({use for path in sorted(FOLDER.glob("**/*.py")) for use in used(path)})


@pytest.mark.parametrize(("module", "attribute"), USES, ids=[f"{m}.{a}" for m, a in USES])
def test_it_is_there(module, attribute):
    pytest.importorskip("bpy")
    found = importlib.import_module(f"omt_uv.{module}")
    assert not attribute or hasattr(found, attribute)


def test_something_is_used():
    assert len(USES) >= 3
