"""A shape beside another one is divided and compared as it is alone, whichever of the two comes first."""

from __future__ import annotations

import functools

import meshes
import numpy as np
import pytest
from readings import together
from sphere_shapes import blob

from omt_uv.pipelines.shapes import distance, partition, signature_index
from omt_uv.pipelines.shapes.landmark_pairs import LandmarkPoint, pairs_of
from omt_uv.pipelines.shapes.match import MatchJob, match_surfaces
from omt_uv.settings import PartitionSettings
from omt_uv.solver.errors import LandmarkError
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.results import RegistrationOptions

FIRST = [True, False]
NO_EDGES = np.zeros((0, 2), int)
POINTS = 40


def body(seed, stretch=1.0):
    V, F = blob(2, seed)
    return V * [1, 1, stretch], F


def both(own, other, first):
    """Two meshes as one, `own` first or last: its vertices and faces there, and the mesh."""
    pair = (own, other) if first else (other, own)
    V, F = together(*pair)
    n, m = (0, 0) if first else (len(other[0]), len(other[1]))
    return n + np.arange(len(own[0])), m + np.arange(len(own[1])), (V, F)


# ---- cells -------------------------------------------------------------------------------------------------------


def divided(V, F, faces, weights, **settings):
    return drain(partition.partition_surface(triangle_surface(V, F), faces, weights, PartitionSettings(**settings)))


@functools.cache
def alone(weighted):
    V, F = body(1)
    return divided(V, F, None, weights_of(V) if weighted else None, cells=6, write="mesh")


def weights_of(V):
    return 1 + 0.5 * V[:, 0] / np.abs(V).max()


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("first", FIRST)
def test_faces_that_are_chosen_beside_others_get_the_cells_that_they_get_alone(first, weighted):
    own, (W, G) = body(1), meshes.bumpy(5, 5)
    vertices, faces, (V, F) = both(own, (W + [9, 0, 0], G), first)
    chosen = np.isin(np.arange(len(F)), faces)
    weights = None
    if weighted:
        # What is painted elsewhere does not count, as long as it is no more than here.
        weights = np.zeros(len(V))
        weights[vertices] = weights_of(own[0])
    found, asked = divided(V, F, chosen, weights, cells=6, write="mesh"), alone(weighted)
    np.testing.assert_array_equal(found.cell[faces], asked.cell)
    assert (found.cell[~chosen] == -1).all()
    assert {frozenset(e) for e in found.borders.tolist()} == {
        frozenset(vertices[list(e)].tolist()) for e in asked.borders.tolist()
    }
    np.testing.assert_allclose(found.points.positions, asked.points.positions, atol=1e-12)
    np.testing.assert_allclose(found.points.normals, asked.points.normals, atol=1e-12)
    for name in ("areas", "radii"):
        np.testing.assert_allclose(getattr(found.points, name), getattr(asked.points, name), rtol=1e-9)
    assert found.warnings == asked.warnings
    for name, value in asked.figures.items():
        assert found.figures[name] == pytest.approx(value, rel=1e-6), name
    np.testing.assert_allclose(found.mesh.positions, asked.mesh.positions, atol=1e-12)
    for name in ("corner_vertex", "face_start", "cell"):
        np.testing.assert_array_equal(getattr(found.mesh, name), getattr(asked.mesh, name))


@pytest.mark.parametrize("first", FIRST)
def test_two_bodies_share_the_cells_by_their_areas_and_no_cell_is_on_both(first):
    own, other = body(1), body(2)
    _, faces, (V, F) = both(own, (other[0] / 2 + [5, 0, 0], other[1]), first)
    found = divided(V, F, None, None, cells=10)
    here = set(found.cell[faces].tolist())
    there = set(np.delete(found.cell, faces).tolist())
    assert not here & there and here | there == set(range(10))
    area = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2
    share = area[faces].sum() / area.sum()
    assert len(here) == round(10 * share)
    # Every part has whole cells, and all of one part are of one size.
    sizes = area[faces].sum() / len(here), np.delete(area, faces).sum() / len(there)
    assert found.figures["unequal_parts"] == pytest.approx(max(sizes) / min(sizes) - 1, rel=0.5)
    assert sum(text.startswith("Every separate part has whole cells") for text in found.warnings) == 1
    assert found.figures["area"] == pytest.approx(area.sum())
    assert not any(len({*row} & set(F[faces].ravel().tolist())) == 1 for row in found.borders.tolist())


# ---- signatures --------------------------------------------------------------------------------------------------


def surfaces(*bodies):
    return [triangle_surface(*each) for each in bodies]


def signed(given, markers=None):
    return drain(distance.signature_of(given, POINTS, markers))


@pytest.mark.parametrize("first", FIRST)
@pytest.mark.parametrize("apart", [True, False])
def test_the_signature_is_that_of_the_largest_part_wherever_it_is(first, apart):
    own, other = body(1), body(2)
    small = (other[0] / 3 + [5, 0, 0], other[1])
    given = surfaces(*((own, small) if first else (small, own))) if apart else surfaces(both(own, small, first)[2])
    found, asked = signed(given), signed(surfaces(own))
    for name in ("points", "curvature", "floor"):
        np.testing.assert_allclose(getattr(found, name), getattr(asked, name), atol=1e-9)
    large = (3 * other[0] + [9, 0, 0], other[1])
    other_one = signed(surfaces(own, large))
    assert np.abs(other_one.points - asked.points).max() > 1e-3


@pytest.mark.parametrize("first", FIRST)
def test_markers_say_which_of_several_surfaces_is_compared_however_large_it_is(first):
    V, F = meshes.bumpy(7, 7)
    # Of as many vertices, and of another shape.
    own, other = (V, F), (V * [4, 4, -9] + [9, 0, 0], F)
    marks = distance.markers_of([27], [4])
    given = surfaces(*((own, other) if first else (other, own)))
    found = signed(given, [marks, None] if first else [None, marks])
    asked = signed(surfaces(own), [marks])
    for name in ("points", "curvature", "floor"):
        np.testing.assert_allclose(getattr(found, name), getattr(asked, name), atol=1e-9)
    for markers, words in (
        ([marks, marks], "2 vertices are marked as the centre"), ([None, None], "No vertices are marked as the centre"),
        ([distance.markers_of([27], []), None], "No vertices are marked as the start"),
        ([distance.markers_of([27], [4, 5]), None], "2 vertices are marked as the start"),
    ):  # fmt: skip
        with pytest.raises(LandmarkError, match=words) as caught:
            signed(given, markers)
        assert caught.value.kind == "vertex"


@functools.cache
def shapes():
    return {"same": body(1), "near": body(1, 1.2), "far": body(2, 2.0)}


def compared(names, own=None):
    others = [(name, triangle_surface(*shapes()[name])) for name in names]
    return drain(distance.alike(triangle_surface(*(own or body(1))), others, None, POINTS))


def test_others_are_as_far_as_each_is_alone_and_come_nearest_first():
    found, reasons = compared(shapes())
    assert [name for name, _ in found] == ["same", "near", "far"] and reasons == []
    for order in (["far", "near", "same"], ["near", "same", "far"]):
        assert [(n, d.raw, d.distance) for n, d in compared(order)[0]] == [(n, d.raw, d.distance) for n, d in found]
    for name, far in found:
        ((_, one),), _ = compared([name])
        assert (one.raw, one.distance, one.floor) == (far.raw, far.distance, far.floor)
        # It is as far back as there.
        back, _ = drain(
            distance.alike(triangle_surface(*shapes()[name]), [("own", triangle_surface(*body(1)))], None, POINTS)
        )
        assert back[0][1].raw == pytest.approx(far.raw, rel=1e-9)
    assert found[0][1].distance == 0 and found[1][1].raw < found[2][1].raw


@pytest.mark.parametrize("where", [0, 1, 2])
def test_one_without_a_signature_is_named_and_the_others_are_compared_all_the_same(where):
    found, _ = compared(["near", "far"])
    others = [(name, triangle_surface(*shapes()[name])) for name in ("near", "far")]
    others.insert(where, ("torus", triangle_surface(*meshes.torus(8, 6))))
    some, reasons = drain(distance.alike(triangle_surface(*body(1)), others, None, POINTS))
    assert [(n, d.raw) for n, d in some] == [(n, d.raw) for n, d in found]
    assert len(reasons) == 1 and reasons[0].startswith("torus: ")


def test_an_index_finds_what_all_others_would_in_any_order_and_no_more_than_asked():
    made = {name: ("mark", signed(surfaces(each))) for name, each in shapes().items()}
    asked, _ = compared(shapes())
    own = triangle_surface(*body(1))
    for names in (list(made), list(made)[::-1]):
        index = signature_index.index_of({name: made[name] for name in names})
        for top in (1, 2, 3):
            found = drain(distance.nearest_of(own, index, top))
            assert [name for name, _ in found] == [name for name, _ in asked[:top]]
            for (_, one), (_, other) in zip(found, asked, strict=False):
                assert one.raw == pytest.approx(other.raw, abs=2e-3)


# ---- matches -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", FIRST)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_smaller_part_goes_where_the_body_beside_it_goes(first, seed):
    """Moved, turned and made larger as that is: so the whole lies where it would if all of it had been matched."""
    own, eye = body(seed), meshes.icosphere(0)
    vertices, _, (V, F) = both(own, (0.1 * eye[0] + [1.6, 0.2, 0.3], eye[1]), first)
    turn = np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])
    goal = 1.7 * V @ turn.T + [4, -2, 1]
    points = [LandmarkPoint(str(k), vertex=int(vertices[k])) for k in (3, 40, 90, 120)]
    at = [LandmarkPoint(str(k), vertex=k) for k in (3, 40, 90, 120)]
    target = triangle_surface(goal[vertices], own[1])
    job = MatchJob(triangle_surface(V, F), target, pairs_of(points, at, ("a", "b")), RegistrationOptions(), NO_EDGES)
    found = drain(match_surfaces(job))
    assert np.abs(found.wrapped - goal).max() < 0.02
