"""What every option of every command takes of words that are nearly right, and why it refuses others: a table keeps
it."""

from __future__ import annotations

import argparse
from pathlib import Path

import command_runs
from kept import check

TAKEN = Path(__file__).with_name("taken.tsv")
WORDS = ("", "0", "-1", "1", "2", "3.5", "0.5", "1.5", "-0.25", "100", "1e9", "1e-9", "nan", "inf", "x", "auto", "off",
         "1001", "1010", "1011", "2,3", "2,2", "0,1,2", "3,-1", "a=2", "a=", "=2", "a=-1", "a=0", "a:0,0,1,1",
         "a:0.5,0,0.2,1", "a:0,0,2,1", "4096", "65537", "10%", "groups", "GROUPS", " 1 ", "١")  # fmt: skip


def taken(action: argparse.Action, word: str) -> str:
    """What an option makes of a word, as argparse does."""
    try:
        value = action.type(word) if callable(action.type) else word
    except argparse.ArgumentTypeError as error:
        return f"no: {error}"
    except (TypeError, ValueError):
        return "no"
    if action.choices is not None and value not in action.choices:
        return "no choice"
    return repr(value) if not hasattr(value, "tolist") else repr(value.tolist())


def test_what_options_take_is_that_of_the_table(package):
    lines = []
    for command, parser in sorted(command_runs.commands(package).items()):
        for action in parser._actions:
            if action.type is Path or not (action.type or action.choices):
                continue
            name = action.option_strings[0] if action.option_strings else action.dest
            lines.append("\t".join([command, name, "", *(f"{word!r}: {taken(action, word)}" for word in WORDS)]))
    assert len(lines) > 80
    # Most are alike, which is said and not written out.
    first: dict[str, str] = {}
    for k, line in enumerate(lines):
        names, told = line.split("\t", 2)[:2], line.split("\t", 3)[3]
        lines[k] = line if told not in first else "\t".join([*names, "", f"as {first[told]}"])
        first.setdefault(told, " ".join(names))
    check(TAKEN, lines)
