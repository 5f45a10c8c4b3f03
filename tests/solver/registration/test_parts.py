"""The parts of a registration, each by the property that it is for."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import bumpy, icosphere, torus
from scipy.spatial import cKDTree
from sphere_shapes import blob, random_rotation

from omt_uv.solver.errors import (
    EmptyMeshError,
    LandmarkError,
    NonManifoldEdgeError,
    OrientationError,
    PinchedVertexError,
    SeveralComponentsError,
    TopologyMismatchError,
)
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas
from omt_uv.solver.mesh.spherical_geometry import fibonacci_sphere, normalized, signed_volumes
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.hessian_blocks import Assembly
from omt_uv.solver.registration import alignment, landmark_flow
from omt_uv.solver.registration import coarse_start as coarse_start_module
from omt_uv.solver.registration.carriers import DiskCarrier, SphereCarrier, TargetCarrier
from omt_uv.solver.registration.coarse_meshes import coarse_mesh, far_vertices, laid_out, straightened
from omt_uv.solver.registration.coarse_start import coarse_start
from omt_uv.solver.registration.domains import Case, checked, filled, kind_of, prepared
from omt_uv.solver.registration.functional_maps import descriptors, eigenfunctions, refined_correspondence
from omt_uv.solver.registration.landmark_flow import draw_landmarks, follow_points
from omt_uv.solver.registration.landmarks import split_at, vertex_landmarks
from omt_uv.solver.registration.straight_walks import StraightWalks
from omt_uv.solver.registration.suggestions import suggest_landmarks
from omt_uv.solver.registration.surface_newton import Deformation, frames, minimise_on


def test_the_rotation_of_pairs_is_found_mirrored_too():
    points = icosphere(1)[0]
    R = random_rotation(3)
    assert np.allclose(alignment.rotation_of_pairs(points, points @ R.T).rotation, R)
    M = R @ np.diag([1.0, 1, -1])
    found = alignment.rotation_of_pairs(points[[0, 1, 2, 5]], points[[0, 1, 2, 5]] @ M.T, mirrored=True)
    assert np.allclose(found.rotation, M) and found.error < 1e-20


def test_the_search_finds_a_rotation_of_functions():
    P, _ = icosphere(3)
    R = random_rotation(5)
    values = np.column_stack([P[:, 0] ** 3 + P[:, 1], P[:, 2] * P[:, 0], np.sin(3 * P[:, 1])])
    found = alignment.rotation_by_search((P, values), (P @ R.T, values))
    assert np.trace(found.rotation @ R.T) > 1 + 2 * np.cos(np.radians(4))
    turned = alignment.turn_by_search((P[:, :2], values), (P[:, :2] @ [[0, 1], [-1, 0]], values))
    assert abs(turned.turn - 1j) < 0.05


def test_functions_are_sampled_where_vertices_are_and_between_them_by_the_nearest():
    P = fibonacci_sphere(300)
    values = np.random.default_rng(0).random((300, 2))
    same = alignment._Sampled(P, values, 300)
    np.testing.assert_allclose(same.values, values, atol=1e-6)
    turn = np.diag([1.0, -1, -1])
    np.testing.assert_allclose(alignment._Sampled(P @ turn, values, 300, turn).values, values, atol=1e-6)
    # Of a smooth function, what is near differs little: of one vertex alone by the way to it, and of several by less.
    between = alignment._Sampled(P, P, 2000)
    off = np.linalg.norm(between.values - between.points, axis=1).mean()
    assert off < 0.7 * between.tree.query(P)[0].max() + 0.7 * np.sqrt(4 * np.pi / 300) / 2


def test_rotations_of_the_grid_are_proper():
    grid = alignment.rotation_grid()
    assert np.allclose(np.einsum("rab,rcb->rac", grid, grid), np.eye(3)) and np.allclose(np.linalg.det(grid), 1)


def test_a_moebius_map_takes_three_pairs_where_they_belong():
    given = alignment.MoebiusMap(0.3 - 0.2j, np.exp(0.7j))
    z = np.array([0.1 + 0.2j, -0.5j, 0.6 + 0.1j])
    assert np.abs(alignment.moebius_of_pairs(z, given(z))(z) - given(z)).max() < 1e-2


def test_straight_walks_on_a_sphere_are_great_circles():
    V, F = icosphere(4)
    walks = StraightWalks(V, F)
    rng = np.random.default_rng(0)
    faces, weights = rng.integers(len(F), size=50), rng.dirichlet(np.ones(3), 50)
    start = np.einsum("kc,kcd->kd", weights, V[F[faces]])
    side = np.cross(start, rng.normal(size=(50, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    ends = walks(faces, weights, 1.0 * side)
    end = np.einsum("kc,kcd->kd", ends[1], V[F[ends[0]]])
    expected = np.cos(1.0) * start / np.linalg.norm(start, axis=1, keepdims=True) + np.sin(1.0) * side
    assert np.abs(end - expected).max() < 0.02
    assert (ends[1] >= 0).all() and np.allclose(ends[1].sum(axis=1), 1)


def test_straight_walks_cross_a_crease_as_if_it_were_flat():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]])
    F = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
    folded = V.copy()
    folded[4:] = [[1, 0, 1], [1, 1, 1]]
    start, weights, step = np.array([0]), np.array([[0.2, 0.5, 0.3]]), np.array([[0.8, 0.1, 0.0]])
    flat, bent = StraightWalks(V, F)(start, weights, step), StraightWalks(folded, F)(start, weights, step)
    assert flat[0] == bent[0] and np.allclose(flat[1], bent[1])
    stops = StraightWalks(V, F)(start, weights, 9 * step)
    assert np.abs(stops[1]).min() < 1e-9


def test_landmarks_split_triangles_and_keep_the_surface():
    V, F = bumpy(4, 4)
    inside = np.array([[0.2, 0.3, 0.5], [0.6, 0.2, 0.2], [1, 0, 0]])
    split = split_at(V, F, np.array([3, 3, 7]), inside)
    assert face_areas(split.vertices, split.triangles).sum() == pytest.approx(face_areas(V, F).sum())
    corners = np.einsum("mkc,mcd->mkd", split.corners, V[F[split.parent]])
    assert np.allclose(corners, split.vertices[split.triangles])
    assert split.landmarks[0] == len(V) and split.landmarks[1] == F[3, 0] and split.landmarks[2] == F[7, 0]
    with pytest.raises(LandmarkError, match="without faces"):
        vertex_landmarks((np.array([99]), F), (np.array([0]), F))


def turned_face():
    V, F = bumpy(4, 4)
    F = F.copy()
    F[5] = F[5][::-1]
    return V, F, OrientationError, "edge"


def third_face():
    V, F = bumpy(4, 4)
    a, b = F[9][:2]
    return (
        np.vstack([V, [[0, 0, 5.0], [0, 1, 5.0]]]),
        np.vstack([F, [[a, b, len(V)], [b, a, len(V) + 1]]]),
        (NonManifoldEdgeError),
        "edge",
    )


def two_parts():
    V, F = bumpy(4, 4)
    return np.vstack([V, V[:3] + 9]), np.vstack([F, [[len(V), len(V) + 1, len(V) + 2]]]), SeveralComponentsError, "face"


def one_vertex_in_common():
    V, F = bumpy(4, 4)
    return np.vstack([V, V[:2] + 9]), np.vstack([F, [[0, len(V), len(V) + 1]]]), PinchedVertexError, "vertex"


def no_faces():
    return np.zeros((3, 3)), np.zeros((0, 3), np.int64), EmptyMeshError, None


def a_handle():
    return *torus(), TopologyMismatchError, None


@pytest.mark.parametrize("case", [turned_face, third_face, two_parts, one_vertex_in_common, no_faces, a_handle])
@pytest.mark.parametrize("name", ["source", "target"])
def test_what_cannot_be_matched_is_refused_by_name_and_place(case, name):
    """Their elements are those that a loop over all faces finds."""
    V, F, kind, elements_of = case()
    with pytest.raises(kind, match=name) as caught:
        checked(V, F, name)
    edges = [tuple(int(f[k - i]) for i in (1, 0)) for f in F for k in range(3)]
    found = {tuple(np.atleast_1d(e).tolist()) for e in caught.value.elements}
    if kind is OrientationError:
        assert found == {e for e in edges if edges.count(e) > 1}
    elif kind is NonManifoldEdgeError:
        assert {tuple(sorted(e)) for e in found} == {
            tuple(sorted(e)) for e in edges if edges.count(e) + edges.count(e[::-1]) > 2
        }
    elif elements_of == "face":
        assert found == {(len(F) - 1,)}
    elif elements_of == "vertex":
        assert found == {(0,)}


def test_holes_are_filled_but_for_the_boundary_of_a_disk():
    V, F = bumpy(6, 6)
    gone = np.delete(F, np.flatnonzero((F == 24).any(axis=1)), axis=0)
    used = np.unique(gone)
    name = np.full(len(V), -1)
    name[used] = np.arange(len(used))
    W, G = V[used], name[gone]
    checked(W, G, "source")
    disk, sphere = filled((W, G), "disk", "source"), filled((W, G), "sphere", "source")
    assert (disk.holes, sphere.holes) == (1, 2) and len(disk.loop) == 24
    assert kind_of((W, G), (V, F), "auto") == "disk" and kind_of((W, G), icosphere(0), "auto") == "sphere"


@pytest.mark.parametrize("unit", [1e-8, 1.0, 1e8])
def test_a_small_hole_makes_no_disk_of_a_body(unit):
    P, F = icosphere(4)
    kinds = [opened(P, F, height) for height in (0.4, 0.9, 0.999)]
    # Openings of 9, 1.2 and 0.01 times the root of the area, squared.
    for hole, of_closed in zip(kinds, ("disk", "disk", "sphere"), strict=True):
        scaled = (unit * hole[0], hole[1])
        for other in kinds[:2]:
            assert kind_of(scaled, other, "auto") == kind_of(other, scaled, "auto") == of_closed
        assert kind_of(scaled, (P, F), "auto") == "sphere" and kind_of(scaled, scaled, "disk") == "disk"


def opened(P, F, height):
    """A ball without the faces that are wholly above a height, its vertices renumbered."""
    F = F[~(P[F][:, :, 2] > height).all(axis=1)]
    used, place = np.unique(F, return_inverse=True)
    return P[used], place.reshape(F.shape)


def test_descriptors_do_not_change_with_place_and_size():
    V, F = blob(2)
    assert np.allclose(descriptors(V, F), descriptors(5 * V @ random_rotation().T + 2, F), atol=1e-6)


def test_suggestions_of_a_body_and_itself_are_its_own_peaks():
    V, F = blob(3, seed=2)
    found = suggest_landmarks((V, F), (V, F))
    assert len(found.source) >= 3 and (found.source == found.target).all()


def test_far_vertices_start_with_those_that_are_given():
    V, _ = icosphere(3)
    chosen = far_vertices(V, np.array([7, 9]), np.zeros(0, np.int64), 40)
    assert chosen[:2].tolist() == [7, 9] and len(np.unique(chosen)) == 40


def test_a_coarse_mesh_has_the_landmarks_and_carries_all_others():
    P, F = icosphere(3)
    mesh = coarse_mesh(P, P, np.array([7, 9]), np.zeros(0, np.int64), 60)
    assert mesh.chosen[mesh.landmarks].tolist() == [7, 9] and len(mesh.triangles) == 2 * 60 - 4
    R = random_rotation(4)
    assert np.allclose(mesh.carried(mesh.domain @ R.T, P), P @ R.T)


def test_folds_all_over_are_left_where_nothing_is_around_them():
    P, F = icosphere(2)
    anywhere = np.random.default_rng(0).standard_normal(P.shape)
    anywhere /= np.linalg.norm(anywhere, axis=1)[:, None]
    with np.errstate(divide="raise", invalid="raise"):
        found = drain(straightened(P, F, anywhere, np.zeros(len(P), bool)))
    assert np.allclose(np.linalg.norm(found, axis=1), 1)


def test_folds_are_straightened_and_what_is_held_stays():
    P, F = icosphere(3)
    rng = np.random.default_rng(0)
    folded, held = P.copy(), np.zeros(len(P), bool)
    spot = np.flatnonzero(P[:, 2] > 0.8)
    folded[spot] += 0.1 * rng.normal(size=(len(spot), 3))
    folded /= np.linalg.norm(folded, axis=1, keepdims=True)
    held[P[:, 2] < 0] = True
    assert (signed_volumes(folded, F) <= 0).any()
    found = drain(straightened(P, F, folded, held))
    assert (signed_volumes(found, F) > 0).all() and np.allclose(found[held], P[held], atol=1e-12)
    fresh = laid_out(P, F, folded, P[:, 2] > 0.8)
    assert np.allclose(np.linalg.norm(fresh, axis=1), 1, atol=1e-12)
    assert (signed_volumes(fresh, F) > 0).all() and np.allclose(fresh[held], P[held])


def test_functional_maps_mend_a_rough_correspondence():
    V, F = blob(3)
    values = eigenfunctions(V, F, 40)
    area = vertex_areas(V, F)
    assert np.allclose(values.T @ (area[:, None] / area.sum() * values), np.eye(40), atol=1e-4)
    rough = cKDTree(V).query(V + 0.15 * np.random.default_rng(1).normal(size=V.shape))[1]
    assert (rough != np.arange(len(V))).mean() > 0.8
    marks = values[[0, 40, 99, 200]]
    found = refined_correspondence(values, values, rough, (marks, marks))
    assert (found == np.arange(len(V))).mean() > 0.99


def test_of_two_starts_the_better_one_is_taken():
    V, F = blob(3, seed=4)
    chosen = np.arange(0, len(V), 130)
    pair = prepared((V, F), (V, F), vertex_landmarks((chosen, F), (chosen, F)), "sphere")
    aligned = normalized(pair.vertices + 0.1 * np.sin(4 * pair.vertices[:, [1, 2, 0]]))
    turned = random_rotation(6)
    case = Case(pair, aligned @ turned.T, TargetCarrier(pair.target.vertices, F, aligned[np.argsort(pair.order)]), None)
    found = drain(coarse_start(case))
    assert found.met.all() and (signed_volumes(found.placed.domain, pair.triangles) > 0).all()
    assert np.linalg.norm(found.placed.domain - aligned, axis=1).mean() < 0.05


def test_landmarks_that_are_met_stay_so_in_every_stage_of_a_coarse_start():
    V, F = blob(3, seed=4)
    chosen = np.arange(0, len(V), 130)
    pair = prepared((V, F), (V, F), vertex_landmarks((chosen, F), (chosen, F)), "sphere")
    aligned = normalized(pair.vertices)
    case = Case(pair, aligned, TargetCarrier(pair.target.vertices, F, aligned[np.argsort(pair.order)]), None)
    mesh = coarse_start_module._whole(case)
    start = normalized(aligned + 0.02 * np.sin(5 * aligned[:, [2, 0, 1]]))
    start[mesh.landmarks] = case.targets.domain
    relaxed = drain(coarse_start_module._relaxed(case, mesh, start))
    guide = case.carrier.place(aligned).positions
    met = np.ones(len(mesh.landmarks), bool)
    guided = drain(coarse_start_module._guided(case, mesh, (start, met), guide, coarse_start_module.NEAR))
    for found in (relaxed, guided):
        others = np.setdiff1d(np.arange(len(V)), mesh.landmarks)
        assert np.abs(found[others] - start[others]).max() > 1e-4
        assert np.allclose(found[mesh.landmarks], start[mesh.landmarks], atol=1e-12)
    # The guide is where all belong: what it draws comes nearer to that.
    off = [np.linalg.norm(places - aligned, axis=1)[others].mean() for places in (start, guided)]
    assert off[1] < 0.5 * off[0]


def problem_on(carrier, positions, triangles):
    faces = elements(positions, triangles, face_areas(positions, triangles))
    return Deformation(faces, Assembly(triangles, len(positions)), carrier, np.zeros(len(positions), bool), 1.0)


def test_landmarks_flow_to_their_places_on_the_sphere():
    P, F = icosphere(3)
    carrier = SphereCarrier()
    start = carrier.place(P)
    vertices = np.array([0, 50, 200, 400])
    moved = P[vertices] + 0.4 * np.cross(P[vertices], [0.3, 0.5, 1.0])
    targets = carrier.place(moved / np.linalg.norm(moved, axis=1, keepdims=True))
    found = drain(draw_landmarks(problem_on(carrier, P, F), start, vertices, targets))
    assert found.met.all() and not carrier.folded(found.placed, F).any()
    assert np.abs(found.placed.positions[vertices] - targets.positions).max() < 1e-12


def swirled(P, turns):
    """Points of the sphere turned about the third axis, the farther the nearer they are to its middle."""
    angle = turns * (1 - P[:, 2] ** 2)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.column_stack([cosine * P[:, 0] - sine * P[:, 1], sine * P[:, 0] + cosine * P[:, 1], P[:, 2]])


@pytest.mark.parametrize("seed", range(3))
def test_a_flow_follows_points_without_folds_and_turned_and_mirrored_alike(seed):
    P, F = icosphere(4)
    points = np.random.default_rng(seed).permutation(len(P))[:300]
    places = swirled(P[points], 0.6)
    found = drain(follow_points(P, points, places))
    assert np.allclose(np.linalg.norm(found, axis=1), 1)
    assert signed_volumes(found, F).min() > 0
    before, after = (np.linalg.norm(x - swirled(P, 0.6), axis=1).mean() for x in (P, found))
    assert after < 0.25 * before
    for R in (random_rotation(seed), np.diag([1.0, -1, 1])):
        assert np.allclose(drain(follow_points(P @ R.T, points, places @ R.T)), found @ R.T, atol=1e-9)


def test_a_flow_stays_where_points_are_in_their_places_and_bends_little_for_a_wrong_one():
    P, F = icosphere(4)
    points = np.random.default_rng(7).permutation(len(P))[:300]
    assert np.allclose(drain(follow_points(P, points, P[points])), P, atol=1e-12)
    places = P[points].copy()
    places[0] = -places[0]
    found = drain(follow_points(P, points, places))
    assert signed_volumes(found, F).min() > 0
    assert np.linalg.norm(found - P, axis=1).mean() < 0.05


def test_what_a_flow_moves_at_once_does_not_count(monkeypatch):
    P, _ = icosphere(3)
    points = np.arange(0, len(P), 7)
    places = swirled(P[points], 0.5)
    whole = drain(follow_points(P, points, places))
    monkeypatch.setattr(landmark_flow, "CHUNK", 1000)
    assert np.allclose(drain(follow_points(P, points, places)), whole, atol=1e-12)


def test_newton_on_a_surface_undoes_a_disturbance():
    V, F = icosphere(2)
    carrier = TargetCarrier(V, F, V)
    rng = np.random.default_rng(1)
    disturbed = V + 0.05 * rng.normal(size=V.shape)
    start = carrier.place(disturbed / np.linalg.norm(disturbed, axis=1, keepdims=True))
    problem = problem_on(carrier, V, F)
    before = problem.energy(start)
    placed, _ = drain(minimise_on(problem, start, 30, 1e-5, "Test"))
    assert problem.energy(placed) < 0.05 * before and not carrier.folded(placed, F).any()


def test_vertices_of_the_boundary_stay_on_it():
    V, F = bumpy(6, 6)
    uv = V[:, :2] * 1.0
    loop = np.flatnonzero((V[:, 0] == V[:, 0].min()) | (V[:, 0] == V[:, 0].max()))
    carrier = TargetCarrier(V, F, uv, loop)
    placed = carrier.place(uv)
    moved = carrier.move(placed, np.full(V.shape, 0.03))
    assert (moved.barycentric[loop].min(axis=1) < 1e-12).all()
    assert np.allclose(np.linalg.norm(carrier.axes(moved)[loop, 0], axis=1), 1)


def test_a_disk_keeps_its_boundary_on_the_circle():
    uv = np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1], [0.1, 0]])
    F = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    carrier = DiskCarrier(np.arange(4))
    placed = carrier.place(uv)
    step = np.einsum("na,nad->nd", np.full((5, 2), 0.1), carrier.axes(placed))
    moved = carrier.move(placed, step)
    assert np.allclose(np.linalg.norm(moved.domain[:4], axis=1), 1) and not carrier.folded(moved, F).any()
    assert frames(moved.positions, F)[1].shape == (4, 3)


@pytest.mark.parametrize("count", [25, 40])
def test_far_vertices_hold_the_first_ones_some_of_the_boundary_and_each_time_the_farthest(count):
    V = np.random.default_rng(0).random((400, 3))
    loop, first = np.arange(100, 200), np.array([5, 3, 5, 120])
    found = far_vertices(V, first, loop, count)
    assert len(np.unique(found)) == len(found) == count and np.isin(first, found).all()
    given = np.union1d(first, loop[:: 100 // 12])
    np.testing.assert_array_equal(found[: len(given)], given)
    for k in range(len(given), count):
        distance = np.linalg.norm(V[:, None] - V[found[:k]], axis=2).min(axis=1)
        assert distance[found[k]] == pytest.approx(distance.max())
    np.testing.assert_array_equal(far_vertices(V[:6], first[:0], loop[:0], 20)[:1], [0])
    assert len(far_vertices(V[:6], first[:0], loop[:0], 20)) == 6


def test_means_of_a_domain_are_in_it_again_on_every_carrier():
    """Unit vectors on a sphere; in the plane a mean stays what it is."""
    V, F = icosphere(1)
    rng = np.random.default_rng(1)
    inside = rng.normal(size=(5, 3)) * 0.4
    for carrier in (SphereCarrier(), TargetCarrier(V, F, V)):
        np.testing.assert_allclose(carrier.within(inside), normalized(inside), atol=1e-12)
    W, G = bumpy(4, 4)
    loop = boundary_loops(G)[0]
    flat = rng.uniform(-0.5, 0.5, (5, 2))
    for plane in (DiskCarrier(loop), TargetCarrier(W, G, W[:, :2], loop)):
        np.testing.assert_array_equal(plane.within(flat), flat)
