"""Say in a few lines how a batch went: the command summary."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path


def add(commands) -> None:
    command = commands.add_parser("summary", help="figures of a batch by percentile, time against size, failures")
    command.set_defaults(run=run, alone=True)
    command.add_argument("input", type=Path, metavar="OUT", help="folder of the results of a batch")
    command.add_argument("--json", action="store_true", help="print it as JSON")


def run(options: argparse.Namespace) -> None:
    from ...batch.manifest import found_beside, rows_of
    from ...batch.statistics import summary_of

    summary = summary_of(rows_of(found_beside(options.input)))
    print(json.dumps(asdict(summary), indent=1) if options.json else summary.text())
