"""One round of all commands and operators: what they print, report and leave, and what functions of all rooms but the
solver are given, give, and tell on the way, as a few figures of each in `told.tsv`.

Where these change, what is told or written has changed, and that is on purpose or a bug; OMT_UV_ACCEPT=1 writes the
table anew, each row with how exact it is: as far as it moves with the last digits of the meshes. OMT_UV_ACCEPT=fewer
leaves out rows that do not hold here.
"""

from __future__ import annotations

import os
from pathlib import Path

import front_runs
import pytest
from front_tables import Rounds

TOLD = Path(__file__).with_name("told.tsv")


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="figures are of the sources")
def test_what_is_told_and_left_is_that_of_the_table(package, capfd, monkeypatch, tmp_path):
    Rounds(front_runs, package, capfd, monkeypatch).check(TOLD, tmp_path)
