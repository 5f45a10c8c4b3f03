"""Evened embeddings give every triangle room, on disks and on rectangles whose sides some triangles lie along."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.canonical.embeddings import evened_sites, mean_value_sites
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.transport.convex_domain import Disk, Rectangle


def with_ears(ears: int):
    """A grid with triangles beside some edges of a side, and its corners, counter-clockwise."""
    V, F = meshes.grid(6, 6)
    low = np.flatnonzero(V[:, 1] == 0)
    low = low[np.argsort(V[low, 0])]
    corners = [np.argmin(np.abs(V[:, :2] - at).sum(axis=1)) for at in ([0, 0], [1, 0], [1, 1], [0, 1])]
    for k in range(1, 1 + 2 * ears, 2):
        tip = (V[low[k]] + V[low[k + 1]]) / 2 - [0, 0.1, 0]
        V, F = np.vstack([V, tip]), np.vstack([F, [low[k + 1], low[k], len(V)]])
    return V, F, np.array(corners)


@pytest.mark.parametrize("ears", [0, 1, 2])
@pytest.mark.parametrize("side", ["disk", "square", "long"])
def test_triangles_along_a_side_have_room(ears, side):
    V, F, corners = with_ears(ears)
    domain = {"disk": Disk(), "square": Rectangle(), "long": Rectangle(2, 0.5)}[side]
    given = None if side == "disk" else corners
    loop = boundary_loops(F)[0]
    faces = elements(V, F, face_areas(V, F))
    sites = evened_sites(faces, V, (loop, given, domain), 10.0, np.inf)
    assert signed_areas(sites, F).min() > 1e-6
    flat = signed_areas(mean_value_sites(V, F, loop, given, domain), F)
    assert (flat > 1e-6).sum() == len(F) - (0 if given is None else ears)
    if given is not None:
        places = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2 * [domain.width, domain.height]
        turn = int(np.argmin(np.abs(places - sites[corners[0]]).sum(axis=1)))
        np.testing.assert_allclose(sites[corners], np.roll(places, -turn, axis=0), atol=1e-9)
