"""Options of every command, their defaults and choices, are an interface: a table keeps them."""

from __future__ import annotations

import argparse
from pathlib import Path

from kept import check, plain

TABLE = Path(__file__).with_name("interface.tsv")
HELPS = Path(__file__).with_name("helps.tsv")


def rows(name, command):
    """A line of each option: its flags, default, choices, and how many values it takes."""
    for action in command._actions:
        if isinstance(action, argparse._HelpAction):
            continue
        kind = type(action).__name__.strip("_").removesuffix("Action")
        cells = [name, " ".join(action.option_strings) or action.dest, "", kind, plain(action.default)]
        cells += [plain(action.choices or ""), str(action.nargs), action.metavar or "", str(int(action.required))]
        yield "\t".join(" ".join(cell.split()) if isinstance(cell, str) else plain(cell) for cell in cells)


def test_options_are_those_of_the_table(package):
    (every,) = (a for a in package("cli").parser()._actions if isinstance(a, argparse._SubParsersAction))
    check(TABLE, [row for name in sorted(every.choices) for row in rows(name, every.choices[name])])


def test_help_is_that_of_the_table(package):
    """What is told of every command and of each of its options, with numbers put in."""
    (every,) = (a for a in package("cli").parser()._actions if isinstance(a, argparse._SubParsersAction))
    told = {action.dest: action.help for action in every._choices_actions}
    lines = []
    for name in sorted(every.choices):
        command = every.choices[name]
        lines.append("\t".join([name, "", "", " ".join(f"{told.get(name)} | {command.epilog or ''}".split())]))
        formatter = command._get_formatter()
        for action in command._actions:
            flags = " ".join(action.option_strings) or action.dest
            help = formatter._expand_help(action) if action.help else ""
            lines.append("\t".join([name, flags, "", " ".join(help.split())]))
    check(HELPS, lines)
