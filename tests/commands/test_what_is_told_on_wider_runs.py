"""A second round, of objects that are edited, choices seldom taken, files of all formats, broken and refused ones, many
files at once, and operators in a window: what is told and left, as in `test_what_every_function_tells`."""

from __future__ import annotations

import os
from pathlib import Path

import front_wider
import pytest
from front_tables import Rounds

TOLD = Path(__file__).with_name("told_wider.tsv")


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="figures are of the sources")
def test_what_is_told_on_wider_runs_is_that_of_the_table(package, capfd, monkeypatch, tmp_path):
    Rounds(front_wider, package, capfd, monkeypatch).check(TOLD, tmp_path)
