"""Tables whose rows say in words and figures what comes of something: held as the words are, and numbers about."""

from __future__ import annotations

import os
import re
from pathlib import Path

# So much of a number that is not whole, and of 1, may it be off; and by one in its last place.
SHARE = 0.004
LEAST = 5e-4
NUMBER = re.compile(r"-?\d+\.\d*(?:e[-+]?\d+)?|-?\d+(?:e[-+]\d+)?")
# A cell that another row has, and this one has not.
MISSING = "-"
# A cell that is not the same on every machine.
ANY = "?"
Row = dict[str, str]


def alike(one: str, other: str) -> bool:
    """Whether texts have the same words and whole numbers, and others are about the same."""
    if one == other:
        return True
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(a == b or _about(a, b) for a, b in pairs)


def _about(a: str, b: str) -> bool:
    if "." not in a + b and "e" not in a + b:
        return False
    last = max(10.0 ** -len(text.partition("e")[0].partition(".")[2]) if "e" not in text else 0.0 for text in (a, b))
    x, y = float(a), float(b)
    # Of 12. the last place is that of a number of four digits.
    last = last if last < 1 else 0.0
    return abs(x - y) <= 1.01 * max(last, LEAST) + SHARE * max(abs(x), abs(y))


def read(path: Path) -> dict[str, Row]:
    """Rows of a file by their names, whole: a row of which another one is the beginning has all that this one has."""
    found: dict[str, Row] = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        name, like, *cells = line.split("\t")
        row = dict(found[like]) if like else {}
        for cell in cells:
            key, _, value = cell.partition(" = ")
            row[key] = value
        found[name] = {key: value for key, value in row.items() if value != MISSING}
    return found


def write(path: Path, rows: dict[str, Row], likes: dict[str, str]) -> None:
    """Write rows, of those that are like another one only what is not as there."""
    lines = []
    for name, row in rows.items():
        like = likes.get(name, "")
        base = rows[like] if like else {}
        cells = [f"{key} = {value}" for key, value in row.items() if base.get(key) != value]
        cells += [f"{key} = {MISSING}" for key in base if key not in row]
        lines.append("\t".join([name, like, *cells]))
    path.write_text("\n".join(lines) + "\n")


def unlike(kept: Row, here: Row) -> dict[str, str]:
    """Cells in which rows differ, and how."""
    keys = dict.fromkeys([*kept, *here])
    pairs = [(key, kept.get(key, MISSING), here.get(key, MISSING)) for key in keys]
    return {key: f"{key} = {a} -> {b}" for key, a, b in pairs if a != ANY and not alike(a, b)}


def hold(path: Path, rows: dict[str, Row], likes: dict[str, str]) -> None:
    """Compare rows with those of a file, which is written anew, or without cells that do not hold, where that is asked
    for. What is not in the file passes."""
    accept = os.environ.get("OMT_UV_ACCEPT", "")
    if accept == "1":
        write(path, rows, likes)
    kept = read(path)
    other = {name: found for name, row in kept.items() if (found := unlike(row, rows.get(name, {})))}
    if accept == "fewer":
        write(path, {name: row | dict.fromkeys(other.get(name, ()), ANY) for name, row in kept.items()}, likes)
        return
    told = [f"{name}:\n    " + "\n    ".join(found.values()) for name, found in other.items()]
    assert not told, "\n".join([*told, f"{len(other)} of {len(kept)} rows; OMT_UV_ACCEPT=1 accepts this"])
