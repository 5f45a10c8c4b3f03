"""Numbers of OBJ lines are written with more digits where they agree with what is there, and are left alone else."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture
def obj_precision(package):
    return package("files.obj_precision")


@pytest.mark.parametrize(
    ("line", "row", "new"),
    [
        ("v 0.333333 2.000000 1.000000", [1 / 3, 2, 1], "v 0.333333333 2 1"),
        ("v 0.333333 2.000000 1.000000 0.5 0.25", [1 / 3, 2, 1], "v 0.333333333 2 1 0.5 0.25"),
        # A millionth off, to the last bit, and a little more.
        ("vt 0.000001 0.500000", [0, 0.5], "vt 0 0.5"),
        ("vt 0.0000011 0.500000", [0, 0.5], None),
        ("vt 1000.001000 0.500000", [1000, 0.5], "vt 1000 0.5"),
        ("vt 1000.001100 0.500000", [1000, 0.5], None),
        ("vt -999.999000 0.500000", [-1000, 0.5], "vt -1000 0.5"),
        ("vt 0.500000 0.600000", [0.5, 0.5], None),
    ],
)
def test_numbers_that_agree_have_all_their_digits(obj_precision, line, row, new):
    lines = ["# text", line]
    obj_precision._replace(lines, [1], np.array([row], float))
    assert lines == ["# text", new or line]
    obj_precision._replace(lines, [1, 0], np.array([row], float))
    assert lines == ["# text", new or line]
