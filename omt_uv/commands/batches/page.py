"""Write the results of a batch as one page for a browser: the command page."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..common import CommandError


def add(commands) -> None:
    command = commands.add_parser("page", help="write a page with pictures and figures of every file of a batch")
    command.set_defaults(run=run, alone=True)
    command.add_argument("input", type=Path, metavar="OUT", help="folder of the results of a batch")
    command.add_argument("-o", "--output", type=Path, metavar="FILE.html", help="default: OUT.html")


def run(options: argparse.Namespace) -> None:
    from ...batch.manifest import found_beside, rows_of
    from ...batch.pages import page_of
    from ...batch.plan import beside
    from ...files.verified import write_text

    path = options.output or beside(options.input, ".html")
    if path.suffix.lower() != ".html":
        raise CommandError(f"{path}: a page is a .html file. Name one.")
    rows = rows_of(found_beside(options.input))
    write_text(path, page_of(rows, path.resolve().parent, options.input.name))
    print(path)
