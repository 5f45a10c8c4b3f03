"""Of a mirrored surface one half is counted: what is off the plane has its image on the other side, or, where a coarse
surface has nothing there, is left out; whichever vertices are kept."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.seams.coarse_cut import Setting


@pytest.mark.parametrize("kept", ["all", "some", "one side", "other side", "plane"])
@pytest.mark.parametrize("seed", range(3))
def test_what_is_counted_has_its_image_on_the_other_side_or_in_the_plane(kept, seed):
    component = component_of(*meshes.icosphere(2))
    points = component.positions
    plane, side = np.abs(points[:, 0]) < 1e-6, points[:, 0] > 1e-6
    image = np.linalg.norm(points[:, None] - points * [-1, 1, 1], axis=2).argmin(axis=1)
    chance = np.random.default_rng(seed).random(len(points)) < 0.5
    among = {"all": chance | True, "some": chance, "one side": chance & (side | plane),
             "other side": chance & ~side, "plane": plane}[kept]  # fmt: skip
    rows = np.flatnonzero(among)
    coarse = SimpleNamespace(
        kept=rows, positions=points[rows], boundary=np.zeros(len(rows), bool), size=1.0, images=None
    )
    mirror = SimpleNamespace(plane=plane, side=side, image=image)
    no_base, factor = np.zeros(len(component.pair), bool), np.ones(component.vertex_count)
    found = Setting.of(component, coarse, no_base, mirror, None, factor).mirrored
    x, itself = points[rows, 0], found.image == np.arange(len(rows))
    here = plane[rows]
    assert itself[here].all() and found.side[here].all()
    counted = found.side & ~here
    assert not itself[counted].any() and (x[counted] > 0).all()
    assert (x[counted] * x[found.image[counted]] < 0).all()
    assert counted.any() == (kept in ("all", "some"))
    # Exactly, where the image is kept.
    both = counted & among[image[rows]]
    np.testing.assert_array_equal(rows[found.image[both]], image[rows[both]])
