"""A third round, of objects with all that a mesh may hold, edited as a whole, operators one after another, pictures,
drags, and words seldom given: what is told and left, as in `test_what_every_function_tells`."""

from __future__ import annotations

import os
from pathlib import Path

import front_rare
import pytest
from front_tables import Rounds

TOLD = Path(__file__).with_name("told_rare.tsv")


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="figures are of the sources")
def test_what_is_told_on_rare_runs_is_that_of_the_table(package, capfd, monkeypatch, tmp_path):
    Rounds(front_rare, package, capfd, monkeypatch).check(TOLD, tmp_path)
