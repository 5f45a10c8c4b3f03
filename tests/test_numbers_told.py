"""How numbers stand in what is told, in every text of the package: one thing is one and several are several, and what
stands before a percent sign is a hundred times a share."""

from __future__ import annotations

import ast
import functools
import re
from pathlib import Path

import pytest
from sources import nodes_of

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "omt_uv").rglob("*.py"))
COUNTING = {"counted", "plural"}
# Words of one thing, and those of several.
SEVERAL = {"is": "are", "has": "have", "was": "were", "its": "their", "vertex": "vertices", "a": "{}", "an": "{}",
           "1": "{}", "another": "others"}  # fmt: skip
# Where the number is a text of its own, or a percentile, by the name that it has.
PERCENTS = {"sums", "mean", "deviation", "p"}


@functools.cache
def nodes():
    """Calls and texts with something put in, by their files."""
    return {path: [node for node in nodes_of(path) if isinstance(node, ast.Call | ast.JoinedStr)]
            for path in SOURCES}  # fmt: skip


def texts():
    """Every call that counts: the file, the line, and both texts."""
    for path, those in nodes().items():
        for node in those:
            name = getattr(node, "func", None) and getattr(node.func, "id", getattr(node.func, "attr", ""))
            if name in COUNTING and all(isinstance(a, ast.Constant) for a in node.args[1:3]) and len(node.args) > 2:
                yield f"{path.relative_to(ROOT)}:{node.lineno}", node.args[1].value, node.args[2].value


def one_of(word):
    """What a word of several things may be of one: verbs lose their s, and names get one."""
    return {word, f"{word}s", word.removesuffix("s"), *(one for one, many in SEVERAL.items() if many == word)}


@pytest.mark.parametrize("where, one, many", list(texts()))
def test_one_thing_is_one_and_several_are_several(where, one, many):
    first, second = (re.findall(r"[\w{}]+", text.lower()) for text in (one, many))
    # Words that both have in common say nothing; what is left has to agree, and a name or a verb says which is which.
    left, right = ([w for w in words if w not in others] for words, others in ((first, second), (second, first)))
    # A verb alone stands behind a number that is told without it.
    assert left and right and ("{}" in second or len(second) == 1), where
    pairs = [(a, b) for b in right for a in left if a != b and a in one_of(b)]
    verbs = {"stay", "lie", "look", "keep", "fold"}
    assert any(SEVERAL.get(a) == b or (b == f"{a}s" and a not in verbs) or (a == f"{b}s" and b in verbs)
               for a, b in pairs), (where, left, right)  # fmt: skip
    assert not any(SEVERAL.get(b) == a or (a == f"{b}s" and b not in verbs) for a, b in pairs), (where, left, right)


def percents():
    """Numbers that stand before a percent sign: the place, and what is written there."""
    for path, those in nodes().items():
        for node in those:
            if isinstance(node, ast.JoinedStr):
                for value, after in zip(node.values, node.values[1:], strict=False):
                    if (
                        isinstance(value, ast.FormattedValue)
                        and isinstance(after, ast.Constant)
                        and re.match(r" ?%", after.value)
                    ):
                        yield f"{path.relative_to(ROOT)}:{node.lineno}", value.value


@pytest.mark.parametrize("where, number", [pytest.param(*pair, id=pair[0]) for pair in percents()])
def test_what_stands_before_a_percent_sign_is_a_hundred_times_a_share(where, number):
    text = ast.unparse(number)
    assert text.startswith("100 * ") or text in PERCENTS, (where, text)


# What a sentence may be about, by the last of the names by which the sources call it.
ABOUT = {"PROGRAM", "about", "address", "attributes", "bare", "cause", "every", "file", "filename", "has", "histogram",
         "image", "index", "input", "label", "made", "name", "names", "output", "path", "plot", "source", "stem",
         "target", "text", "where", "whole"}  # fmt: skip
# What is never one of the things that are named within a sentence.
ABOUT_ALONE = {"names", "obj.name", "options.input", "options.output", "path"}


def put_in():
    """Values that are put into texts: the place, what is written there, whether a colon follows at once at the
    beginning, and whether it is quoted."""
    for path, those in nodes().items():
        for node in those:
            if isinstance(node, ast.JoinedStr):
                for k, value in enumerate(node.values):
                    if isinstance(value, ast.FormattedValue):
                        rest = node.values[k + 1] if k + 1 < len(node.values) else None
                        leads = k == 0 and isinstance(rest, ast.Constant) and rest.value.startswith(": ")
                        yield (
                            f"{path.relative_to(ROOT)}:{node.lineno}",
                            value.value,
                            leads,
                            value.conversion == ord("r"),
                        )


def test_what_stands_before_the_colon_of_a_sentence_is_what_it_is_about_and_is_not_quoted_in_another():
    """An object, a file, or the like; what is named in quotes is something of it."""
    found = list(put_in())
    leading = [(place, value) for place, value, leads, _ in found if leads]
    assert len(leading) > 100
    names = [(place, [n.id if isinstance(n, ast.Name) else n.attr if isinstance(n, ast.Attribute) else n.value
                      for n in ast.walk(value) if isinstance(n, ast.Name | ast.Attribute | ast.Constant)])
             for place, value in leading]  # fmt: skip
    assert [place for place, of in names if not ABOUT & {n for n in of if isinstance(n, str)}] == []
    quoted = [(place, ast.unparse(value)) for place, value, _, is_quoted in found if is_quoted]
    assert len(quoted) > 60
    assert [pair for pair in quoted if pair[1] in ABOUT_ALONE] == []
