"""Name what a user can mend, for every front end (the solver has errors of its own, `solver.errors`).

An operator reports the text, a command prints it and ends; both catch `UserError` and need not know which one it is.
"""

from __future__ import annotations


class UserError(ValueError):
    """What a user can mend: the text says what is wrong, where, and what to do about it."""


def one_line(text: str) -> str:
    """A message on one line, whatever the files and objects are called that it names."""
    return " ".join(text.split())
