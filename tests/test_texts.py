"""Every text with several values in it: a table keeps which stands where, so that two of them change places on purpose.

An error that says «12 cells are fewer than the 3 parts» where it is the other way round reads well, and tests that ask
for its words, or for either number, pass.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

from kept import ROOT, check, modules
from sources import nodes_of, walked

TABLE = Path(__file__).with_name("texts.tsv")
# From so many values on one can stand in the place of another.
SEVERAL = 2


def said(node):
    """A text with values as the table has it, and how many values: None for what is none.

    f"..." and "...".format(...), with the constant words between them; what has no words is no text.
    """
    if isinstance(node, ast.JoinedStr):
        words = "".join(part.value for part in node.values if isinstance(part, ast.Constant))
        return ast.unparse(node), words, sum(isinstance(part, ast.FormattedValue) for part in node.values)
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "format"
        and isinstance(node.func.value, ast.Constant)
    ):
        return ast.unparse(node), str(node.func.value.value), len(node.args) + len(node.keywords)
    return None


def rows():
    """A line of each text, by module and function."""
    for module in modules():
        nodes = nodes_of(ROOT / f"{module.replace('.', '/')}.py")
        owner = {}
        for node in nodes:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                # Functions within others come later, and have what is theirs.
                owner.update(dict.fromkeys(walked(node), node.name))
        for node in nodes:
            text, words, count = said(node) or ("", "", 0)
            if count >= SEVERAL and re.search(r" [^\W\d]{2}", words):
                yield "\t".join([module, owner.get(node, ""), "", " ".join(text.split())])


def test_values_stand_where_the_table_has_them():
    lines = list(dict.fromkeys(rows()))
    assert len(lines) > 150
    check(TABLE, lines)


def test_a_text_whose_values_change_places_is_another():
    one, other = (ast.parse(text).body[0].value for text in ('f"{a} of {b} files"', 'f"{b} of {a} files"'))
    assert said(one) != said(other) and said(one)[2] == 2
    call = ast.parse('"{} of {}".format(a, b)').body[0].value
    assert said(call)[1:] == ("{} of {}", 2) and said(ast.parse('"a" + b').body[0].value) is None
