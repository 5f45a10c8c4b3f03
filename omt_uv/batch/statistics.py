"""A batch in a few lines: figures by percentile, how seconds grow with size, and failures by cause."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from .figures import flat_row
from .manifest import DONE, RUNNING, WAITING

PERCENTILES = (0, 25, 50, 75, 95, 99, 100)
# What differs between messages of one cause: paths, names and numbers.
VARIES = (
    (re.compile(r"(?:/|[A-Za-z]:\\)\S*[/\\]\S+?(?=[:,]?(?:\s|$))"), "FILE"),
    (re.compile(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?"), "N"),
)
# The least number of files of which a law of growth can be told.
LEAST = 8


@dataclass(frozen=True)
class BatchSummary:
    """counts : files by state; figures : percentiles (`PERCENTILES`) of every figure; exponent : p of seconds ~ size^p
    over the larger half of the files, None for few; sizes : what is meant by size; causes : failures and how many"""

    counts: dict[str, int]
    figures: dict[str, list[float]]
    exponent: float | None
    sizes: str
    causes: dict[str, int]

    def text(self) -> str:
        """The summary in lines."""
        lines = [", ".join(f"{count} {state}" for state, count in sorted(self.counts.items())), ""]
        width = max(map(len, self.figures), default=0)
        lines.append(" ".join([" " * width, *(f"{f'{p} %':>10}" for p in PERCENTILES)]))
        lines += [
            " ".join([name.ljust(width), *(f"{value:10.4g}" for value in values)])
            for name, values in self.figures.items()
        ]
        if self.exponent is not None:
            lines += ["", f"seconds grow as {self.sizes} ^ {self.exponent:.2f}"]
        if self.causes:
            lines += ["", *(f"{count:6} x {cause}" for cause, count in self.causes.items())]
        return "\n".join(lines)


def summary_of(rows: Sequence[dict]) -> BatchSummary:
    """The summary of rows of a manifest."""
    flat = [flat_row(row) for row in rows]
    done = [row for row in flat if row["state"] == DONE]
    names = dict.fromkeys(k for row in done for k, v in row.items() if isinstance(v, int | float) and k != "status")
    figures = {name: percentiles_of([x for x in _column(done, name) if x is not None]) for name in names}
    size = "faces" if "faces" in names else "size"
    both = zip(_column(done, size), _column(done, "seconds"), strict=True)
    pairs = [(x, y) for x, y in both if x is not None and y is not None]
    failed = [str(row["message"]) for row in flat if row["state"] not in (DONE, WAITING, RUNNING)]
    causes = Counter(cause_of(message) for message in failed)
    return BatchSummary(
        counts=dict(Counter(str(row["state"]) for row in flat)),
        figures=figures,
        exponent=growth_of(pairs),
        sizes="faces" if size == "faces" else "bytes",
        causes=dict(causes.most_common()),
    )


def _column(rows: Sequence[dict[str, object]], name: str) -> list[float | None]:
    """A figure of all rows, None where a row has none."""
    values = [row.get(name) for row in rows]
    return [float(value) if isinstance(value, int | float) else None for value in values]


def percentiles_of(values: Sequence[float]) -> list[float]:
    """`PERCENTILES` of at least one value, linear between them."""
    import numpy as np

    return [float(x) for x in np.percentile(values, PERCENTILES)]


def growth_of(pairs: Sequence[tuple[float, float]]) -> float | None:
    """p of y ~ x^p by least squares of the logarithms, over the larger half, where what every run takes counts less."""
    import numpy as np

    known = sorted((x, y) for x, y in pairs if x > 0 and y > 0)
    half = known[len(known) // 2 :]
    if len(known) < LEAST or half[0][0] == half[-1][0]:
        return None
    x, y = np.log(np.array(half)).T
    return float(np.polyfit(x, y, 1)[0])


def cause_of(message: str) -> str:
    """A message without what differs between files, so that those of one cause are counted as one."""
    for pattern, word in VARIES:
        message = pattern.sub(word, message)
    return message[:200]
