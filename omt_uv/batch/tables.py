"""The results of a batch as a table: CSV, and Parquet where pyarrow is."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from .figures import columns_of, flat_row
from .plan import BatchError

# What a spreadsheet would take for a formula.
FORMULA = ("=", "+", "-", "@", "\t", "\r")


def table_of(rows: Sequence[dict]) -> tuple[list[str], list[dict[str, object]]]:
    """Columns, and a flat row for each row of a manifest."""
    flat = [flat_row(row) for row in rows]
    return columns_of(flat), flat


def csv_text(rows: Sequence[dict]) -> str:
    """The table as CSV, with a line of names first; a text that a spreadsheet would run gets an apostrophe."""
    columns, flat = table_of(rows)
    return csv_lines([columns, *([_cell(row.get(name)) for name in columns] for row in flat)])


def csv_lines(rows: Iterable[Sequence[object]]) -> str:
    """Rows of values as lines of CSV."""
    lines = []
    for row in rows:
        out = io.StringIO()
        # What is quoted depends on how lines end: a name may have either half of such an end in it.
        csv.writer(out).writerow(row)
        lines.append(out.getvalue().removesuffix("\r\n"))
    return "".join(f"{line}\n" for line in lines)


def _cell(value: object) -> object:
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else "" if value is None else value


def write_parquet(path: Path, rows: Sequence[dict]) -> None:
    """Write the table as Parquet.

    Raises
    ------
    BatchError : pyarrow is not installed
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ModuleNotFoundError as error:
        raise BatchError(f"{error}. Parquet needs pyarrow: pip install 'omt-uv[farm]', or write .csv.") from error
    columns, flat = table_of(rows)
    arrays = {name: pyarrow.array(_same_kind([row.get(name) for row in flat])) for name in columns}
    parquet.write_table(pyarrow.table(arrays), path)


def _same_kind(values: list) -> list:
    """Values of one type, as a column has: whole numbers beside others become those, and anything beside text text."""
    kinds = {type(value) for value in values if value is not None}
    if len(kinds) < 2:
        return values
    kind: type = str if str in kinds else float
    return [value if value is None else kind(value) for value in values]
