"""Figures of a run as one flat row: what its report says, over all charts of a file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

# Lists of reports whose entries are parts of one file.
PARTS = ("charts", "levels")
# What weighs a part.
WEIGHT = "faces"
# Figures of which the worst part counts as well.
WORST = ("area_l1", "angle_mean", "hausdorff", "overlap")
# Counts, which are added over parts.
ADDED = ("faces", "vertices", "triangles", "folds")
# What every row has, of the manifest itself.
OWN = ("name", "state", "status", "seconds", "processor", "memory", "size", "tries", "host", "version", "message")


def flat_row(row: Mapping) -> dict[str, object]:
    """A row of the manifest with the figures of its report, each a number, a text, or None."""
    flat: dict[str, object] = {name: row[name] for name in OWN}
    flat["warnings"] = len(json.loads(row["warnings"] or "[]"))
    return flat | figures_of(row["report"] or "")


def figures_of(report: str) -> dict[str, object]:
    """Numbers of a report in JSON: of its parts the sum of counts, else the mean weighed by faces, and the worst."""
    try:
        data = json.loads(report)
    except ValueError:
        return {}
    if not isinstance(data, dict):
        return {}
    figures = dict(_numbers(data, ""))
    for name in PARTS:
        parts = data.get(name)
        if isinstance(parts, list):
            figures[name] = len(parts)
            figures |= _of_parts([dict(_numbers(part, "")) for part in parts if isinstance(part, dict)])
    return figures


def _numbers(data: Mapping, prefix: str):
    """Pairs of a dotted name and a number, of dicts within dicts; not of lists."""
    for name, value in data.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{prefix}{name}.")
        elif isinstance(value, int | float):
            yield f"{prefix}{name}", float(value) if isinstance(value, float) else int(value)


def _of_parts(parts: Sequence[Mapping]) -> dict[str, object]:
    """One row of several parts."""
    names = dict.fromkeys(name for part in parts for name in part)
    row: dict[str, object] = {}
    for name in names:
        pairs = [(float(part.get(WEIGHT, 1)), part[name]) for part in parts if name in part]
        total = sum(weight for weight, _ in pairs)
        values = [value for _, value in pairs]
        if name in ADDED or name.startswith("seconds."):
            row[name] = sum(values)
        elif name not in ("chart", "level"):
            row[name] = sum(w * v for w, v in pairs) / total if total else sum(values) / len(values)
        if name in WORST:
            row[f"{name}.worst"] = max(values)
    return row


def columns_of(rows: Sequence[Mapping[str, object]]) -> list[str]:
    """Names of all columns, those of every row first."""
    own = [*OWN, "warnings"]
    return [*own, *dict.fromkeys(name for row in rows for name in row if name not in own)]
