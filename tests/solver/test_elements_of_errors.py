"""Whoever works on a mesh in numbers of its own says what is wrong in those of the mesh that was given: vertices, pairs
of vertices and faces lie where they lay, however many there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import meshes
import numpy as np
import pytest
from scipy.spatial import cKDTree

from omt_uv.solver.errors import MeshError, PinError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import in_order_of_places, located
from omt_uv.solver.refinement.elimination_order import renumbered
from omt_uv.solver.remeshing.components.own_frame import in_own_frame

KINDS = ("vertex", "edge", "face")


@dataclass(frozen=True)
class Carried:
    """A mesh (n,3), (m,3) in its own numbers, that which was given, and what carries errors from one to the other."""

    own: tuple[np.ndarray, np.ndarray]
    given: tuple[np.ndarray, np.ndarray]
    carry: Callable[[MeshError], MeshError]


def shuffled():
    """A bumpy disk whose vertices and triangles come in any order, among vertices that no face has."""
    V, F = meshes.bumpy(7, 6)
    rng = np.random.default_rng(4)
    name = rng.permutation(len(V) + 5)[: len(V)]
    W = rng.normal(size=(len(V) + 5, 3))
    W[name] = V
    return W, name[F][rng.permutation(len(F))]


def of_an_order() -> Carried:
    V, F = meshes.bumpy(7, 6)
    mesh = renumbered(V, F, V[:, :2], None)
    return Carried((mesh.vertices, mesh.triangles), (V, F), mesh.original_error)


def of_a_chart() -> Carried:
    V, F = shuffled()
    (chart,) = strict_charts(triangle_surface(V, F))
    chart = in_order_of_places(chart)[0]
    return Carried((chart.vertices, chart.triangles), (V, F), lambda error: located(error, chart))


def of_a_frame() -> Carried:
    V, F = shuffled()
    frame = in_own_frame(V, F, np.zeros((0, 2), np.int64))

    def carry(error: MeshError) -> MeshError:
        with pytest.raises(type(error)) as found, frame.named():
            raise error
        return found.value

    return Carried((frame.places(frame.vertices), frame.triangles), (V, F), carry)


CARRIERS = (of_an_order, of_a_chart, of_a_frame)


def pairs(F):
    return np.unique(np.sort(F[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def corners(F, kind, elements):
    """Rows of vertices that elements have."""
    return F[elements] if kind == "face" else elements.reshape(len(elements), -1)


@pytest.mark.parametrize("count", [1, 3, 12])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", CARRIERS)
def test_what_is_wrong_lies_where_it_lay(make, kind, count):
    carried = make()
    V, F = carried.own
    every = {"vertex": np.unique(F), "edge": pairs(F), "face": np.arange(len(F))}[kind]
    wrong = every[np.random.default_rng(count).permutation(len(every))[:count]]
    found = carried.carry(PinError("It is so", "Do this", kind, wrong))
    assert (type(found), found.cause, found.remedy, found.kind) == (PinError, "It is so", "Do this", kind)
    W, G = carried.given
    far, here = cKDTree(W).query(V)
    assert far.max() < 1e-6
    rows = [np.sort(x, axis=1).tolist() for x in (corners(G, kind, found.elements), here[corners(F, kind, wrong)])]
    assert sorted(rows[0]) == sorted(rows[1])


@pytest.mark.parametrize("kind", ["", *KINDS])
@pytest.mark.parametrize("make", CARRIERS)
def test_what_names_nothing_names_nothing_afterwards(make, kind):
    empty = np.zeros((0, 2) if kind == "edge" else 0, np.int64)
    found = make().carry(PinError("It is so", "Do this", kind, empty))
    assert (found.cause, found.kind, len(found.elements)) == ("It is so", kind, 0)
