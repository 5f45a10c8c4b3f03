"""The generators of the front door: they say how far they are, and may be closed at any time."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.api import steps
from omt_uv.solver.progress import drain


def tilted_square():
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0]])
    return V, np.array([[0, 1, 2, 3]])


@pytest.mark.parametrize("name", ["unwrap", "refine", "remesh"])
def test_they_can_be_closed_before_their_end(name):
    V, F = tilted_square()
    more = {"unwrap": (), "refine": (V[F][:, :, :2],), "remesh": (20,)}[name]
    run = getattr(steps, name)(V, F, *more)
    next(run)
    run.close()
    with pytest.raises(StopIteration):
        next(run)


def test_seams_that_were_cut_are_returned():
    V = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    F = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    result = drain(steps.unwrap(V, F))
    # A tetrahedron comes open along a tree that reaches its four vertices.
    assert result.seams.shape == (3, 2) and len(np.unique(result.seams)) == 4
    assert result.figures.folds == 0 and result.figures.overlap == 0
