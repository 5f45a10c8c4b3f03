"""Refusals name all that is wrong, each once and nothing else, wherever it is and however often it is met."""

from __future__ import annotations

from collections.abc import Callable

import meshes
import numpy as np
import pytest
from sphere_shapes import blob

from omt_uv.solver.analysis.density import check_region, checked_density
from omt_uv.solver.comparison import compare
from omt_uv.solver.editing.magnify import refuse_folds
from omt_uv.solver.editing.uv_islands import uv_islands
from omt_uv.solver.errors import MeshError, positive_density
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.closed_surface import closed_surface
from omt_uv.solver.mesh.surface import check_finite, triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.initial_maps import check_initial_map
from omt_uv.solver.refinement.pins import check_pins
from omt_uv.solver.registration.domains import checked
from omt_uv.solver.registration.landmarks import vertex_landmarks
from omt_uv.solver.transport import Disk, semidiscrete
from omt_uv.solver.transport.damped_newton import check_mass
from omt_uv.solver.volumes.envelope import filled

NOWHERE = (np.nan, np.inf, -np.inf)
PATCH, BODY = meshes.bumpy(8, 7), blob(2, seed=1)


def at(bad: np.ndarray, values: np.ndarray, wrong=NOWHERE) -> np.ndarray:
    """Values that are wrong in some rows, each in another way and, if they have several columns, in another one."""
    found = np.array(values, float)
    for k, row in enumerate(bad):
        if found.ndim == 1:
            found[row] = wrong[k % len(wrong)]
        else:
            found[row, k % found.shape[1]] = wrong[k % len(wrong)]
    return found


def around(F: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Triangles at some vertices."""
    return np.flatnonzero(np.isin(F, vertices).any(axis=1))


def edges(F: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Distinct edges (k,2) of faces, the lower end first."""
    return np.unique(np.sort(F[faces][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)


def apart(F: np.ndarray, count: int) -> np.ndarray:
    """Triangles without a vertex in common."""
    found, used = [], set()
    for face in np.random.default_rng(count).permutation(len(F)).tolist():
        if not used & set(F[face].tolist()):
            found.append(face)
            used |= set(F[np.isin(F, F[face]).any(axis=1)].ravel().tolist())
    return np.sort(found[:count])


def some(n: int, count: int) -> np.ndarray:
    return np.sort(np.random.default_rng(count).permutation(n)[:count])


# ---- what is not where it should be ------------------------------------------------------------------------------

V, F = PATCH
W, G = BODY
HANDLES = (FlowHandle(np.array([0]), V[:1] + 0.1),)
# A call with wrong rows, how many rows there are, and whether triangles at them are named instead.
OF_ROWS: dict[str, tuple[Callable, int, bool]] = {
    "positions": (lambda bad: check_finite(at(bad, V), F), len(V), False),
    "positions of charts": (lambda bad: strict_charts(triangle_surface(at(bad, V), F)), len(V), False),
    "positions of a body": (lambda bad: closed_surface(at(bad, W), G), len(W), False),
    "positions that are filled": (lambda bad: filled(at(bad, W), G), len(W), False),
    "positions that are compared": (lambda bad: drain(compare((V, F), (at(bad, V), F), 50)), len(V), False),
    "positions that flow": (lambda bad: drain(flow(at(bad, V), HANDLES, FlowOptions())), len(V), False),
    "positions that are measured": (lambda bad: distortion(at(bad, V), F, V[F][:, :, :2]), len(V), False),
    "positions of a source": (lambda bad: checked(at(bad, W), G, "source"), len(W), False),
    "UVs that are measured": (
        lambda bad: distortion(V, F, at(bad, V[F][:, :, :2].reshape(len(F), 6)).reshape(-1, 3, 2)), len(F), False),
    "UVs that are refined": (lambda bad: check_initial_map(at(bad, V[:, :2]), F), len(V), False),
    "UVs that are magnified": (lambda bad: refuse_folds(at(bad, V[:, :2]), F), len(V), True),
    "UVs of islands": (
        lambda bad: uv_islands(triangle_surface(V, F), at(bad, V[:, :2])[F.ravel()]), len(V), True),
    "densities": (lambda bad: positive_density(at(bad, np.ones(30), (0.0, -1.0, *NOWHERE))), 30, False),
    "densities of much contrast": (lambda bad: checked_density(at(bad, np.ones(30), (1e-300, 1e-200))), 30, False),
    "weights that are none": (lambda bad: check_region(at(bad, np.linspace(0, 1, 30))), 30, False),
    "weights beyond 1": (lambda bad: check_region(at(bad, np.linspace(0, 1, 30), (-0.1, 1.1))), 30, False),
    "masses": (lambda bad: check_mass(at(bad, np.ones(30), (0.0, -1.0, *NOWHERE))), 30, False),
    "sites": (lambda bad: drain(semidiscrete.transport(at(bad, V[:, :2] * 0.1), np.ones(len(V)), Disk())),
              len(V), False),
    "pins": (lambda bad: check_pins(np.arange(30), at(bad, np.random.default_rng(0).random((30, 2))), 30), 30, False),
}  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 5, 12])
@pytest.mark.parametrize("name", OF_ROWS)
def test_all_that_is_nowhere_or_no_number_is_named(name, count):
    call, n, of_triangles = OF_ROWS[name]
    bad = some(n, count)
    with pytest.raises(MeshError) as caught:
        call(bad)
    expected = around(F, bad) if of_triangles else bad
    assert caught.value.kind in ("vertex", "face")
    np.testing.assert_array_equal(caught.value.elements, expected)


# ---- what contradicts itself -------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("places", [2, 3, 4])
def test_pins_in_several_places_are_named_once(places, count):
    bad, rng = some(30, count), np.random.default_rng(places)
    vertices = rng.permutation(np.concatenate([np.arange(30), np.tile(bad, places - 1)]))
    with pytest.raises(MeshError, match="two places") as caught:
        check_pins(vertices, rng.random((len(vertices), 2)), 30)
    np.testing.assert_array_equal(caught.value.elements, bad)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_pins_at_one_place_are_named(count):
    bad, places = some(30, 2 * count), np.random.default_rng(0).random((30, 2))
    places[bad] = places[np.repeat(bad[:2], count)]
    with pytest.raises(MeshError, match="one place") as caught:
        check_pins(np.arange(30), places, 30)
    np.testing.assert_array_equal(caught.value.elements, bad)


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize("count", [1, 3])
def test_landmarks_that_no_face_has_are_named_once(count, twice):
    loose = len(V) + np.arange(count)
    given = np.concatenate([[3], np.repeat(loose, 1 + twice), [5]])
    with pytest.raises(MeshError, match="without faces") as caught:
        vertex_landmarks((given, F), (np.arange(len(given)), F))
    np.testing.assert_array_equal(caught.value.elements, loose)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_faces_of_a_body_that_are_missing_turned_doubled_or_broken_are_named(count):
    bad = apart(G, count)
    turned, doubled, broken = G.copy(), np.concatenate([G, G[bad][:, [1, 2, 0]]]), G.copy()
    turned[bad] = turned[bad][:, ::-1]
    broken[bad, 1] = broken[bad, 0]
    both = np.concatenate([bad, len(G) + np.arange(count)])
    sides = edges(G, bad)
    for H, text, expected in (
        (np.delete(G, bad, axis=0), "not closed", sides),
        (turned, "opposite orientation", sides),
        (doubled, "same vertices", both),
        (broken, "a vertex twice", bad),
    ):
        with pytest.raises(MeshError, match=text) as caught:
            closed_surface(W, H)
        np.testing.assert_array_equal(caught.value.elements, expected)
    with pytest.raises(MeshError, match="no face") as caught:
        closed_surface(np.vstack([W, W[:count]]), G)
    np.testing.assert_array_equal(caught.value.elements, len(W) + np.arange(count))


@pytest.mark.parametrize("ask", [closed_surface, lambda points, faces: checked(points, faces, "source")])
@pytest.mark.parametrize("first", [0, 1, 3])
def test_all_parts_but_the_largest_are_named_wherever_it_stands(first, ask):
    parts = [blob(1, seed=k) for k in range(3)]
    parts.insert(first, BODY)
    sizes, before = ([len(part[k]) for part in parts] for k in (1, 0))
    start = np.cumsum([0, *before[:-1]])
    faces = np.concatenate([G + n for (_, G), n in zip(parts, start, strict=True)])
    with pytest.raises(MeshError, match="4 parts") as caught:
        ask(np.concatenate([W for W, _ in parts]), faces)
    assert caught.value.kind == "face"
    expected = np.flatnonzero(np.repeat(np.arange(4), sizes) != first)
    np.testing.assert_array_equal(caught.value.elements, expected)


@pytest.mark.parametrize("of", ["source", "charts"])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_edges_between_faces_that_disagree_or_are_too_many_are_named(count, of):
    inner = [k for k in apart(G, 40).tolist() if 0 not in G[k]]
    bad = np.array(inner[:count])
    turned = G.copy()
    turned[bad] = turned[bad][:, ::-1]
    tips = len(W) + np.arange(count)
    finned = np.vstack([G, np.column_stack([G[bad, 0], G[bad, 1], tips])])
    points = np.vstack([W, 1.3 * W[G[bad, 0]]])

    def ask(H):
        # An open surface: a closed one is no chart.
        H = H[~(H == 0).any(axis=1)]
        if of == "source":
            checked(points, H, "source")
        else:
            strict_charts(triangle_surface(points, H))

    for H, expected in ((turned, edges(G, bad)), (finned, np.sort(G[bad, :2], axis=1))):
        with pytest.raises(MeshError) as caught:
            ask(H)
        assert caught.value.kind == "edge"
        found = np.sort(caught.value.elements, axis=1)
        np.testing.assert_array_equal(found[np.lexsort(found.T[::-1])], expected[np.lexsort(expected.T[::-1])])


@pytest.mark.parametrize("count", [1, 2, 5])
def test_faces_that_fold_or_have_no_area_are_named(count):
    flat = V[:, :2].copy()
    for side in (1, -1):
        bad = apart(F, count)
        uv = np.arange(3 * len(F)).reshape(-1, 3)
        corners = flat[F].copy()
        corners[bad[::2]] = corners[bad[::2]][:, ::-1]
        corners[bad[1::2]] = corners[bad[1::2]][:, :1]
        with pytest.raises(MeshError, match="fold") as caught:
            refuse_folds(corners.reshape(-1, 2) * [side, 1], uv)
        np.testing.assert_array_equal(caught.value.elements, bad)
    lines = triangle_surface(np.vstack([V, V[F[bad, 0]]]), np.vstack([F, np.column_stack(
        [F[bad, 0], F[bad, 1], len(V) + np.arange(count)])]))  # fmt: skip
    with pytest.raises(MeshError, match="no area") as caught:
        strict_charts(lines)
    np.testing.assert_array_equal(caught.value.elements, len(F) + np.arange(count))
