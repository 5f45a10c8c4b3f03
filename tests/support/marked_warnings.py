"""A warning in everything that comes with warnings, so that it is seen which of them arrive, and whom they blame."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable

import recorded_calls
from recorded_calls import Call

# Lists of texts that functions of these rooms return are warnings.
TEXTS = ("files.", "commands.", "blender.", "pipelines.", "operators.")
# Where they are names or words.
OTHER = (
    "commands.options.names",
    "commands.batches.",
    "blender.shapes.match_objects._write_keys",
    "blender.remesh_objects.new_objects",
    "blender.volumes.bodies.write_frames",
)


def mark_of(name: str) -> str:
    """What a function is made to warn of."""
    return f"Mark of {name} here"


class Marking(recorded_calls.Record):
    """Hears of every call, keeps none, and marks what comes of it."""

    def __init__(self) -> None:
        super().__init__(0)
        self.marked: set[str] = set()

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        return Call(name, function, (), {})

    def end(self, call: Call | None, args: tuple, kwargs: dict, result, is_method: bool) -> None:
        if call is not None and self._mark(result, call):
            self.marked.add(call.name)

    def _mark(self, result, call: Call) -> bool:
        """Whether a result has warnings; they have one more then."""
        text = mark_of(call.name)
        if dataclasses.is_dataclass(result) and not isinstance(result, type):
            asked = {field.name: str(field.type) for field in dataclasses.fields(result)}.get("warnings", "")
            there = getattr(result, "warnings", None)
        else:
            asked, there = getattr(call.function, "__annotations__", {}).get("return"), result
            if asked == "tuple[str, ...]" or (asked == "list[str]" and not _are_warnings(call.name)):
                return False
        if asked == "tuple[str, ...]" and text not in there:
            object.__setattr__(result, "warnings", (*there, text))
        elif asked == "list[str]" and text not in there:
            there.append(text)
        elif asked == "list[tuple[int, str]]" and (-1, text) not in there:
            there.append((-1, text))
        return asked in ("tuple[str, ...]", "list[str]", "list[tuple[int, str]]")


def _are_warnings(name: str) -> bool:
    """Whether the texts that a function returns in a list are warnings."""
    return name.startswith(TEXTS) and not name.startswith(OTHER)


def marks_in(lines: list[str]) -> set[tuple[str, str]]:
    """Names of functions whose marks are in lines of what was told, and whom each line is about, "" for nobody."""
    found = set()
    for line in lines:
        for name in re.findall(r"Mark of (\S+) here", line):
            before = line.partition("Mark of ")[0].strip().removesuffix(":")
            found.add((name, before.rpartition("arning")[2].strip(" :")))
    return found
