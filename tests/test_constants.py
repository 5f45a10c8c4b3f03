"""Every constant of a module or a class, and every setting of a preset: a table keeps it, so that a bound, a size or a
choice changes on purpose."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

from kept import ROOT, check, modules

TABLE = Path(__file__).with_name("constants.tsv")
# What hangs on the system and on the version of Blender.
ELSEWHERE = {"OF_SYSTEM", "MEMORY_IS_LIMITED", "SIGNALS", "SMOOTH_COLOUR_SHADER", "UNIFORM_COLOUR_SHADER"}
# Longer texts have tests of their own that ask for their words.
LONGEST = 160
ASSIGNED = (ast.Assign, ast.AnnAssign)


def named(body):
    """Names that statements of a module or a class give to values in capitals."""
    for node in body:
        targets = getattr(node, "targets", [getattr(node, "target", None)]) if isinstance(node, ASSIGNED) else []
        for target in targets:
            for name in target.elts if isinstance(target, ast.Tuple) else [target]:
                if isinstance(name, ast.Name) and name.id.isupper():
                    yield name.id


def words(value):
    """A value as the table has it: numbers, texts, and what holds them; of anything else the name of its class."""
    if isinstance(value, bool | int | str | type(None)):
        return repr(value)
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, (set, frozenset)):
        return f"{{{', '.join(sorted(map(words, value)))}}}"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{words(k)}: {words(v)}' for k, v in value.items())}}}"
    if isinstance(value, (tuple, list)):
        return f"({', '.join(map(words, value))})"
    if hasattr(value, "tolist") and not isinstance(value, type):
        return words(value.tolist())
    return str(getattr(value, "pattern", getattr(value, "__name__", type(value).__name__)))


def rows():
    """A line of each constant."""
    for module in modules():
        tree = ast.parse((ROOT / f"{module.replace('.', '/')}.py").read_text())
        there = importlib.import_module(module)
        for owner, prefix, body in [
            (there, "", tree.body),
            *((getattr(there, node.name), f"{node.name}.", node.body) for node in tree.body
              if isinstance(node, ast.ClassDef) and hasattr(there, node.name)),
        ]:  # fmt: skip
            for name in dict.fromkeys(named(body)):
                said = words(getattr(owner, name)) if hasattr(owner, name) else ""
                if said and len(said) < LONGEST and name not in ELSEWHERE:
                    yield "\t".join([module, prefix + name, "", said.replace("\n", " ").replace("\t", " ")])


def presets():
    """A line of each setting of a preset that comes with the extension."""
    for path in sorted((ROOT / "omt_uv" / "presets").glob("**/*.py")):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute):
                name = f"{path.parent.name} {path.stem}"
                yield "\t".join([f"presets {name}", node.targets[0].attr, "", ast.unparse(node.value)])


def test_constants_are_those_of_the_table():
    lines = [*rows(), *presets()]
    assert len(lines) > 400
    check(TABLE, lines)
