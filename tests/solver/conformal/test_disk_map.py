"""The conformal map: flat but for its corners, exactly on the circle, embedded, and independent of the pose."""

import meshes
import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from omt_uv.solver import errors
from omt_uv.solver.conformal import disk_map
from omt_uv.solver.conformal.disk_map import (
    boundary_turns,
    conformal_disk,
    conformal_rectangle,
    quarter_points,
    sharpest_corners,
)
from omt_uv.solver.conformal.double_cover import double_disk
from omt_uv.solver.conformal.intrinsic_triangulation import euclidean_diagonal, from_mesh, make_delaunay
from omt_uv.solver.conformal.rectangle_to_disk import centre_in_disk, rectangle_to_disk
from omt_uv.solver.conformal.yamabe_flow import yamabe_flow
from omt_uv.solver.mesh.geometry import (
    angle_defects,
    angles_from_lengths,
    cotangent_laplacian,
    cross2,
    halfedge_lengths,
    signed_areas,
    vertex_areas,
)
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain

SHAPES = {
    "grid": meshes.grid(12, 9),
    "bumpy": meshes.bumpy(20, 20, 0.6),
    "cone": meshes.cone(10, 30),
    "cap": meshes.cap(20, 32, 0.85),
    "random": meshes.random_disk(300, height=0.5),
    "head": meshes.head(24),
    "quad": meshes.quad_patch(),
    "triangle": meshes.single_triangle(),
    "comb": meshes.comb(3, 2),
}
MODELS = [m for m in meshes.DISK_MODELS if m not in ("alligator", "maze")]


def check_disk(V, F, most_steps=12):
    result = drain(conformal_disk(V, F))
    (loop,) = boundary_loops(F)
    assert result.residual <= 1e-8 and result.iterations <= most_steps
    np.testing.assert_allclose(np.linalg.norm(result.uv[loop], axis=1), 1, atol=1e-9)
    assert np.linalg.norm(result.uv, axis=1).max() <= 1 + 1e-12
    # Three points of the circle 1e-8 apart lie on one line in double precision.
    length = halfedge_lengths(result.uv, F).reshape(-1, 3).max(axis=1)
    resolved = (length > 1e-7) | ~np.isin(F, loop).all(axis=1)
    assert (signed_areas(result.uv, F)[resolved] > 0).all()
    mass = vertex_areas(V, F)
    np.testing.assert_allclose(mass @ result.uv / mass.sum(), 0, atol=1e-8)
    return result


@pytest.mark.parametrize("name", SHAPES)
def test_disk(name):
    check_disk(*SHAPES[name])


@meshes.models_missing
@pytest.mark.parametrize("name", MODELS)
def test_disk_on_models(name):
    check_disk(*meshes.load_model(name))


@meshes.models_missing
@pytest.mark.parametrize("name", ["alligator", "maze"])
def test_a_map_that_leaves_double_precision_says_so(name):
    """These need more than 1e15 between their largest and their smallest edge."""
    with pytest.raises(errors.PrecisionError, match="double precision"):
        drain(conformal_disk(*meshes.load_model(name)))


@pytest.mark.parametrize("name", SHAPES)
def test_rectangle(name):
    V, F = SHAPES[name]
    result = drain(conformal_rectangle(V, F))
    (loop,) = boundary_loops(F)
    assert result.residual <= 1e-8
    outline = result.uv[loop]
    to_side = np.abs(np.column_stack([outline, outline - [1, result.aspect]])).min(axis=1)
    np.testing.assert_allclose(to_side, 0, atol=1e-12)
    if len(loop) > 3:
        expected = np.array([[0, 0], [1, 0], [1, result.aspect], [0, result.aspect]])
        np.testing.assert_allclose(result.uv[result.corners], expected, atol=1e-12)
    # A triangle with three corners on one side of the rectangle has no area there.
    ear = (np.isclose(result.uv[F], [0, 0]) | np.isclose(result.uv[F], [1, result.aspect])).all(axis=1).any(axis=1)
    assert (signed_areas(result.uv, F)[~ear] > 0).all()


def test_a_flat_rectangle_is_mapped_by_a_similarity():
    V, F = meshes.grid(10, 6, width=5.0, height=2.0)
    result = drain(conformal_rectangle(V, F))
    lengths = sorted([result.aspect, 1 / result.aspect])
    np.testing.assert_allclose(lengths, [0.4, 2.5], rtol=1e-9)
    ratio = halfedge_lengths(result.uv, F) / halfedge_lengths(V, F)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


def test_the_disk_map_converges_to_the_smooth_one():
    """The stereographic projection is the conformal map of a hemisphere; its error falls with the mesh size."""
    error = []
    for rings in (8, 16, 32):
        V, F = meshes.hemisphere(rings, 4 * rings)
        uv = drain(conformal_disk(V, F)).uv
        exact = np.linalg.norm(V[:, :2], axis=1) / (1 + V[:, 2])
        error.append(np.abs(np.linalg.norm(uv, axis=1) - exact).max())
    assert error[2] < 0.01 and error[2] < 0.6 * error[1] < 0.36 * error[0]


def test_pose_and_units_do_not_matter():
    V, F = meshes.head(16)
    rotation = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    reference = drain(conformal_disk(V, F)).uv
    for moved in (V @ rotation.T, 1e-6 * V, 1e6 * V, V + 1e3):
        np.testing.assert_allclose(drain(conformal_disk(moved, F)).uv, reference, atol=1e-7)


def test_relabelling_moves_nothing():
    V, F = meshes.random_disk(200, height=0.4)
    order = np.random.default_rng(1).permutation(len(V))
    label = np.argsort(order)
    (loop,) = boundary_loops(F)
    corners = quarter_points(V, loop)
    a = drain(conformal_rectangle(V, F, corners))
    b = drain(conformal_rectangle(V[order], label[F], label[corners]))
    np.testing.assert_allclose(b.uv[label], a.uv, atol=1e-8)


def test_gauss_bonnet():
    for V, F in SHAPES.values():
        angle = angles_from_lengths(halfedge_lengths(V, F).reshape(-1, 3))
        defects = angle_defects(F, angle, boundary_loops(F)[0], len(V))
        assert defects.sum() == pytest.approx(2 * np.pi)
    V, F = meshes.torus()
    angle = angles_from_lengths(halfedge_lengths(V, F).reshape(-1, 3))
    assert angle_defects(F, angle, [], len(V)).sum() == pytest.approx(0, abs=1e-10)


def test_cotangent_laplacian_is_the_dirichlet_form():
    """u^T L u is the Dirichlet energy; of a linear function its area times the squared gradient."""
    V, F = meshes.random_disk(150, height=0.0)
    L = cotangent_laplacian(V, F)
    assert abs(L - L.T).max() < 1e-12 and np.abs(L.sum(axis=1)).max() < 1e-12
    area = signed_areas(V[:, :2], F).sum()
    u = V[:, :2] @ [3.0, 4.0]
    assert u @ (L @ u) == pytest.approx(25 * area)
    assert np.linalg.eigvalsh(L.toarray()).min() > -1e-12


def test_the_flow_meets_any_admissible_cone_angles():
    V, F = meshes.cap(10, 16)
    (loop,) = boundary_loops(F)
    tri, _ = make_delaunay(from_mesh(V, F), euclidean_diagonal)
    doubled, owner = double_disk(tri, loop, len(V))
    doubled, _ = make_delaunay(doubled, euclidean_diagonal)
    angle = np.full(len(V), 4 * np.pi)
    angle[loop] = 2 * np.pi
    # Three corners of pi / 3 on the boundary: a flat equilateral triangle.
    angle[loop[[0, 5, 11]]] = 2 * np.pi / 3
    flow = drain(yamabe_flow(doubled, owner, angle))
    around = np.bincount(
        owner[flow.triangulation.triangles[:, [2, 0, 1]]].ravel(), angles_from_lengths(flow.length).ravel(), len(V)
    )
    np.testing.assert_allclose(around, angle, atol=1e-8)


def test_double_is_closed_and_mirrored():
    V, F = meshes.bumpy(6, 6)
    (loop,) = boundary_loops(F)
    tri = from_mesh(V, F)
    doubled, owner = double_disk(tri, loop, len(V))
    assert (doubled.twin >= 0).all() and len(owner) == 2 * len(V) - len(loop)
    assert (doubled.twin[doubled.twin] == np.arange(len(doubled.twin))).all()
    np.testing.assert_array_equal(doubled.log_length, doubled.log_length[doubled.twin])
    edges = 3 * len(doubled.triangles) // 2
    assert len(owner) - edges + len(doubled.triangles) == 2
    np.testing.assert_array_equal(np.sort(owner[doubled.triangles[len(F) :]], axis=1), np.sort(F, axis=1))


@pytest.mark.parametrize("height", [0.2, 0.7, 1.0, 1.6, 4.0])
def test_rectangle_to_disk_is_conformal_and_keeps_the_boundary_in_order(height):
    t = np.linspace(0, 1, 30)[:-1]
    outline = np.concatenate(
        [
            np.column_stack([t, 0 * t]),
            np.column_stack([1 + 0 * t, t * height]),
            np.column_stack([1 - t, height + 0 * t]),
            np.column_stack([0 * t, (1 - t) * height]),
        ]
    )
    image = rectangle_to_disk(outline, height)
    np.testing.assert_allclose(np.linalg.norm(image, axis=1), 1, atol=1e-12)
    turn = np.diff(np.unwrap(np.arctan2(image[:, 1], image[:, 0])))
    assert (turn > 0).all() and turn.sum() < 2 * np.pi
    np.testing.assert_allclose(rectangle_to_disk(np.array([[0.5, height / 2]]), height), 0, atol=1e-12)
    p, step = np.random.default_rng(0).uniform(0.1, 0.9, (40, 2)) * [1, height], 1e-6
    dx = rectangle_to_disk(p + [step, 0], height) - rectangle_to_disk(p - [step, 0], height)
    dy = rectangle_to_disk(p + [0, step], height) - rectangle_to_disk(p - [0, step], height)
    np.testing.assert_allclose(dy, np.column_stack([-dx[:, 1], dx[:, 0]]), atol=1e-4 * np.abs(dx).max())


def test_rectangle_to_disk_is_scipys_elliptic_sine():
    """On the lower side the map is sn followed by the Cayley map."""
    m = 0.02
    K, K1 = ellipk(m), ellipk(1 - m)
    x = np.linspace(-0.9, 0.9, 7) * K
    s = ellipj(x, m)[0]
    centre = 1j / m**0.25
    w = (s - centre) / (s - np.conj(centre))
    got = rectangle_to_disk(np.column_stack([x / (2 * K) + 0.5, 0 * x]), K1 / (2 * K))
    np.testing.assert_allclose(got, np.column_stack([w.real, w.imag]), atol=1e-10)


def test_a_too_long_rectangle_is_refused():
    with pytest.raises(errors.PrecisionError, match="The conformal map leaves double precision"):
        rectangle_to_disk(np.zeros((1, 2)), 50.0)


def test_centring_is_a_moebius_map():
    rng = np.random.default_rng(4)
    z = rng.uniform(-0.6, 0.6, (50, 2)) + [0.3, 0]
    mass = rng.random(50)
    w = centre_in_disk(z, mass)
    np.testing.assert_allclose(mass @ w / mass.sum(), 0, atol=1e-9)

    def cross_ratio(p):
        p = p[:, 0] + 1j * p[:, 1]
        return (p[0] - p[1]) * (p[2] - p[3]) / ((p[0] - p[3]) * (p[2] - p[1]))

    assert cross_ratio(w) == pytest.approx(cross_ratio(z), abs=1e-10)


def test_corners():
    V, F = meshes.grid(8, 8)
    (loop,) = boundary_loops(F)
    assert set(sharpest_corners(V, F, loop)) == {0, 8, 72, 80}
    assert len(set(quarter_points(V, loop))) == 4
    uneven = np.array([[0, 0, 0], [100, 0, 0], [100, 1, 0], [99, 1, 0], [98, 1, 0], [0, 1, 0.0]])
    quarters = quarter_points(uneven, np.arange(6))
    assert len(set(quarters)) == 4 and (np.diff(quarters) > 0).all()


def test_a_flat_boundary_turns_by_the_angles_of_its_polygon():
    V, F = meshes.bumpy(6, 5, 0.0)
    V = V @ [[1, 0, 0], [0.7, 1, 0], [0, 0, 1]]
    (loop,) = boundary_loops(F)
    side = np.diff(V[np.append(loop, loop[0])][:, :2] @ [1, 1j])
    np.testing.assert_allclose(boundary_turns(V, F, loop), np.angle(side / np.roll(side, 1)), atol=1e-7)


def test_turning_sense_is_counter_clockwise():
    V, F = meshes.bumpy(8, 8)
    uv = drain(conformal_disk(V, F)).uv
    (loop,) = boundary_loops(F)
    assert (cross2(uv[loop], uv[np.roll(loop, -1)]) > 0).all()


def test_a_square_of_two_triangles_has_its_own_corners():
    V, F = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    found = drain(conformal_rectangle(V, F, np.array([1, 2, 3, 0])))
    np.testing.assert_allclose(found.uv, [[0, 2], [0, 0], [1, 0], [1, 2]], atol=1e-6)
    assert found.aspect == pytest.approx(2)
    for corners in ([0, 2, 1, 3], [0, 1, 2, 2], [3, 2, 1, 0]):
        with pytest.raises(ValueError, match="counter-clockwise"):
            drain(conformal_rectangle(V, F, np.array(corners)))


@pytest.mark.parametrize("folds", [(0,), (3, 0), (5, 2), (4, 4)])
def test_faces_are_called_straightened_that_were_folded_and_are_no_longer(monkeypatch, folds):
    counts, moved = iter(folds + folds[:1]), []
    monkeypatch.setattr(disk_map, "count_folds", lambda *of: next(counts))
    monkeypatch.setattr(disk_map, "untangle", lambda uv, *of: (moved.append(1) or uv, None))
    found = drain(disk_map.conformal_disk(*meshes.bumpy(4, 4)))
    assert found.straightened == folds[0] - folds[-1] and len(moved) == (folds[0] > 0)
