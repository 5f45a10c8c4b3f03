"""The results of a batch as one page for a browser: pictures, figures, sorted, filtered, 200 rows at a time."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from .figures import columns_of, flat_row
from .page_text import PAGE

# Columns that a page shows first, where they are there; the others are chosen on the page. Messages stand at pictures.
FIRST = ("name", "state", "faces", "area_l1", "angle_mean", "folds", "gate.overlap", "hausdorff", "rms", "seconds",
         "memory")  # fmt: skip


def page_of(rows: Sequence[Mapping], folder: Path, title: str) -> str:
    """The page, as HTML that needs nothing else but its pictures, which it names relative to its folder."""
    flat = []
    for row in rows:
        values = flat_row(row)
        values["picture"] = _link(row["preview"], folder)
        values["words"] = " ".join(json.loads(row["words"] or "[]"))
        flat.append(values)
    hidden = ("picture", "words")
    columns = [name for name in columns_of(flat) if name not in hidden]
    shown = [name for name in FIRST if name in columns]
    table = {
        "title": title,
        "columns": [*shown, *(name for name in columns if name not in shown)],
        "shown": len(shown),
        "rows": [[_value(row.get(name)) for name in (*shown, *(n for n in columns if n not in shown))] for row in flat],
        "pictures": [row["picture"] for row in flat],
        "words": [row["words"] for row in flat],
    }
    return PAGE.replace("DATA_OF_THE_BATCH", _script_text(table))


def _link(path: str, folder: Path) -> str:
    """A path relative to the page, as the address of a picture; "" for none."""
    return quote(Path(os.path.relpath(path, folder)).as_posix()) if path else ""


def _value(value: object) -> object:
    """A value that JSON has, short."""
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value


def _script_text(data: object) -> str:
    """JSON that may stand in a script: no name of a file can end it, or begin another element."""
    text = json.dumps(data, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
