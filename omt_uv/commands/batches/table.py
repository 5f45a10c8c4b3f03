"""Write the results of a batch as a table: the command table."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..common import CommandError

SUFFIXES = (".csv", ".parquet")


def add(commands) -> None:
    command = commands.add_parser("table", help="write the results of a batch as CSV or Parquet")
    command.set_defaults(run=run, alone=True)
    command.add_argument("input", type=Path, metavar="OUT", help="folder of the results of a batch")
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help=".csv or .parquet; default: CSV, printed")


def run(options: argparse.Namespace) -> None:
    from ...batch.manifest import found_beside, rows_of
    from ...batch.tables import csv_text, write_parquet
    from ...files.verified import staged, write_text

    rows = rows_of(found_beside(options.input))
    if options.output is None:
        print(csv_text(rows), end="")
        return
    suffix = options.output.suffix.lower()
    if suffix not in SUFFIXES:
        raise CommandError(f"{options.output}: a table is {' or '.join(SUFFIXES)}. Name one of these.")
    if suffix == ".csv":
        write_text(options.output, csv_text(rows))
        return
    with staged(options.output) as made:
        write_parquet(made, rows)
