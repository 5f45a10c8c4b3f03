"""What the stories in a real window use of the package is there: the window itself is seldom at hand to tell."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "scripts" / "gui"
# In the window the whole project is an add-on called omt_uv, with the package inside.
ADDON = "omt_uv.omt_uv"


def used(path):
    """Triples (module, name, attributes) of every import from the package, attributes as dotted names behind it."""
    tree = ast.parse(path.read_text())
    chains = {ast.unparse(n) for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(ADDON):
            for alias in node.names:
                prefix = (alias.asname or alias.name) + "."
                yield node.module, alias.name, sorted(c.removeprefix(prefix) for c in chains if c.startswith(prefix))


USES = [use for path in sorted(FOLDER.glob("**/*.py")) for use in used(path)]


@pytest.mark.parametrize(("module", "name", "attributes"), USES, ids=[f"{m}.{n}" for m, n, _ in USES])
def test_it_is_there(module, name, attributes):
    pytest.importorskip("bpy")
    package = module.replace(ADDON, "omt_uv", 1)
    found = importlib.import_module(f"{package}.{name}")
    for chain in attributes:
        value = found
        for attribute in chain.split("."):
            if value is not None:  # the state of a window, where there is none
                assert hasattr(value, attribute), chain
                value = getattr(value, attribute)


def test_something_is_used():
    assert len(USES) >= 3
