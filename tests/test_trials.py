"""Every row of the first trials of the project, what was lost or wrong or had no end, has a test: `trials.tsv`."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
HEAD, *ROWS = [line.split("\t") for line in (TESTS / "trials.tsv").read_text().splitlines()]
# What was found: data lost, wrong without a word, crashes, hangs, the contract, what tests did not see.
FOUND = {"D": 9, "W": 4, "C": 4, "H": 6, "K": 5, "S": 5}


def test_every_row_is_there():
    assert all(len(row) == len(HEAD) and all(row) for row in ROWS)
    assert {row[0] for row in ROWS} == {f"{kind}{k}" for kind, count in FOUND.items() for k in range(1, count + 1)}


@pytest.mark.parametrize("test", sorted({row[2] for row in ROWS}))
def test_a_test_of_a_row_exists(test):
    path, _, name = test.partition("::")
    tree = ast.parse((TESTS / path).read_text(encoding="utf-8"))
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")}
    assert name in names if name else names
