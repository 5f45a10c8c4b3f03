"""Sentences that the package may say, as its sources have them: what a suite looks for that provokes each of them."""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from sources import nodes_of, walked

import omt_uv

ROOT = Path(omt_uv.__file__).parent
# Words of a text from which on it is a sentence, or the rest of one; one fewer behind what is put in.
FEW = 3
# Modules that list names, and what choices are about.
LISTS = ("__init__.py", "choices.py")
# Calls that say something else than a warning: errors, the way of a solver, one or several of something.
OTHER_CALLS = re.compile(r".*(Error|Refusal|Progress|Property)$|plural|part_of|warns?|add_argument|strip")
# Arguments and attributes that hold other texts.
OTHER_NAMES = {"remedy", "description", "help", "metavar", "name", "kind", "epilog", "text", "words"}
# Nodes of which some parts say no warnings.
HOLDING = (ast.Raise, ast.Module, ast.ClassDef, ast.FunctionDef, ast.Call, ast.Assign, ast.AnnAssign)


class Sentence(NamedTuple):
    """A text of a module, below the package, with {} for what is put in."""

    module: str
    text: str

    def fits(self, told: str) -> bool:
        """Whether a text that was told has these words in it."""
        pattern = ".*".join(map(re.escape, self.text.split("{}")))
        return re.search(pattern, told, re.DOTALL) is not None


def sentences(*folders: str) -> list[Sentence]:
    """All sentences of the modules in some folders, or files, of the package, but those of errors and help."""
    paths = [p for f in folders for p in ([ROOT / f] if f.endswith(".py") else sorted((ROOT / f).rglob("*.py")))]
    paths = [p for p in paths if p.name not in LISTS]
    found = [Sentence(str(path.relative_to(ROOT)), text) for path in paths for text in _texts_of(path)]
    return list(dict.fromkeys(found))


@functools.cache
def _texts_of(path: Path) -> tuple[str, ...]:
    return tuple(_texts(nodes_of(path)))


def _texts(nodes: list[ast.AST]) -> Iterator[str]:
    holding = [node for node in nodes if isinstance(node, HOLDING)]
    left_out = {id(inner) for node in holding for other in _others(node) for inner in walked(other)}
    for node in nodes:
        if not isinstance(node, ast.JoinedStr | ast.Constant) or id(node) in left_out:
            continue
        if isinstance(node, ast.JoinedStr):
            text = "".join(v.value if isinstance(v, ast.Constant) else "{}" for v in node.values)
            left_out |= {id(inner) for inner in walked(node)}
        elif isinstance(node.value, str):
            text = re.sub(r"{[^}]*}", "{}", node.value)
        else:
            continue
        if len(text.replace("{}", " ").split()) >= FEW - text.startswith("{} "):
            yield text


def _others(node: ast.AST) -> Iterator[ast.AST]:
    """Parts of a node whose texts are no warnings."""
    if isinstance(node, ast.Raise):
        yield node
    elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and isinstance(node.body[0], ast.Expr):
        yield node.body[0]
    elif isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if OTHER_CALLS.fullmatch(name):
            yield from (*node.args, *node.keywords)
        yield from (keyword.value for keyword in node.keywords if keyword.arg in OTHER_NAMES)
    elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if any(isinstance(t, ast.Name) and t.id == "remedy" for t in targets):
            yield node.value


# What a run of a scene gives: what was told there, and what is to be told.
Told = Iterator[tuple[list[str], list[str]]]


class Scenes:
    """Scenes on both sides of what is said, by the module and the beginning of the sentence."""

    def __init__(self) -> None:
        self.of: dict[tuple[str, str], Callable[..., Told]] = {}

    def says(self, module: str, beginning: str) -> Callable[[Callable[..., Told]], Callable[..., Told]]:
        """Keep the function as the scene of a sentence."""

        def keep(scene: Callable[..., Told]) -> Callable[..., Told]:
            self.of[module, beginning] = scene
            return scene

        return keep

    def check(self, key: tuple[str, str], found: list[Sentence], patch) -> None:
        """Run a scene: all that it tells is as it is to be, the sentence once at least and once at least not."""
        module, beginning = key
        (sentence,) = {s for s in found if s.module == module and s.text.startswith(beginning)}
        sides = set()
        for told, asked in self.of[key](patch):
            assert list(told) == list(asked), (told, asked)
            sides.add(any(sentence.fits(text) for text in told))
        assert sides == {True, False}, sides

    def without(self, found: list[Sentence], reasons: dict[tuple[str, str], str]) -> list[Sentence]:
        """Sentences that no scene provokes, and that have no reason why not, by module and beginning as well."""
        known = [*self.of, *reasons]
        return [s for s in found if not any(s.module == m and s.text.startswith(b) for m, b in known)]
