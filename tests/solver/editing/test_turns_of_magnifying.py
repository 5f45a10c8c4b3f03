"""What a magnification asks of the solver: which boundaries may not cross themselves, and which are free."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing import magnify
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain


class EnoughError(Exception):
    """The task is known."""


@pytest.mark.parametrize("hole", [True, False])
@pytest.mark.parametrize("boundary", ["own", "free"])
def test_holes_may_not_cross_themselves_where_an_outline_is_kept(hole, boundary, monkeypatch):
    V, F = meshes.grid(6, 6)
    uv = V[:, :2]
    middle = np.abs(uv[F].mean(axis=1) - uv.mean(axis=0)).max(axis=1)
    F = F[middle > 0.25 * np.ptp(uv[:, 0])] if hole else F
    used, F = np.unique(F, return_inverse=True)
    uv, F, asked = uv[used], F.reshape(-1, 3), []

    def minimise(task, start, balance, settings):
        asked.append(task)
        raise EnoughError

    monkeypatch.setattr(magnify, "minimise_in_stages", minimise)
    density = 1 + (uv[F].mean(axis=1)[:, 0] > uv[:, 0].mean())
    with pytest.raises(EnoughError):
        drain(magnify.magnify_map(uv, F, density.astype(float), boundary=boundary))
    (task,) = asked
    lengths = sorted(len(loop) for loop in boundary_loops(F))
    assert len(lengths) == 1 + hole and task.scale_free == (boundary == "own")
    if boundary == "free":
        assert len(task.loop) == sum(lengths)
    else:
        assert task.loop is None if not hole else len(task.loop) == lengths[0]
