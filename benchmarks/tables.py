"""Print tables row by row as figures come, and write them as TSV."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

# Columns wider than this are text and stand to the left.
WIDEST_NUMBER = 14


class Table:
    """Rows printed as they come, and written as TSV at the end; `columns` maps titles to widths."""

    def __init__(self, title: str, columns: Mapping[str, int]):
        self.columns = dict(columns)
        self.rows: list[list[str]] = []
        print(f"\n{title}\n" + self._line(columns), flush=True)

    def add(self, **row) -> None:
        """Print a row; columns that are not named stay empty."""
        self.rows.append([_text(row.get(c, "")) for c in self.columns])
        print(self._line(self.rows[-1]), flush=True)

    def _line(self, cells):
        return "  ".join(
            cell.ljust(width) if width > WIDEST_NUMBER else cell.rjust(width)
            for cell, width in zip(cells, self.columns.values(), strict=True)
        ).rstrip()

    def write(self, path: Path) -> None:
        """Write titles and rows to a TSV file."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join("\t".join(r) for r in [list(self.columns), *self.rows]) + "\n")
        print(f"written to {path}")


def _text(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def missed(**goals) -> dict[str, str]:
    """The cell "missed goals": names of the goals that are missed, of all by name."""
    return {"missed goals": ", ".join(name for name, wrong in goals.items() if wrong)}
