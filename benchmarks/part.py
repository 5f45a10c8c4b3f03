"""Describe a part of the benchmarks: its name, what it shows, the function that makes its table, its own options."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from benchmarks.tables import Table

PRESETS = ("draft", "standard", "exact")
BOUNDARIES = ("free", "disk", "square")


@dataclass(frozen=True)
class Option:
    """An option of the command line: `--name`, its value where it is not given, and what argparse has to know."""

    name: str
    default: Any
    help: str
    keywords: dict[str, Any] = field(default_factory=dict)


MODELS = Option("models", None, "published or procedural; default all at hand", {"nargs": "+", "metavar": "NAME"})
PRESET = Option("presets", PRESETS, "default all", {"nargs": "+", "choices": PRESETS})
BOUNDARY = Option("boundaries", BOUNDARIES, "default all", {"nargs": "+", "choices": BOUNDARIES})
RUNS = Option("runs", 3, "per figure, of which the median counts", {"type": int})


@dataclass(frozen=True)
class Part:
    """One table of the benchmarks; `table(args)` prints it row by row and returns it.

    A part that is not `by_default` runs only where it is named.
    """

    name: str
    description: str
    table: Callable[[Namespace], Table]
    options: tuple[Option, ...] = ()
    by_default: bool = True
