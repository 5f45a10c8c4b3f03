"""Conformal maps against what they are by definition: angles, scales, circles, rectangles, doubles."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal import intrinsic_triangulation as intrinsic
from omt_uv.solver.conformal.boundary_first import boundary_first
from omt_uv.solver.conformal.disk_map import (
    boundary_turns,
    conformal_disk,
    conformal_rectangle,
    quarter_points,
    sharpest_corners,
)
from omt_uv.solver.conformal.double_cover import double_disk
from omt_uv.solver.conformal.moebius import boost, centre_on_sphere, to_plane, to_sphere
from omt_uv.solver.conformal.rectangle_to_disk import centre_in_disk, rectangle_to_disk
from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.mesh.geometry import face_areas, signed_areas, vertex_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain


def angle(a, b, c):
    """The angle at a, of a triangle in space or the plane."""
    u, v = b - a, c - a
    return np.arccos(np.clip(u @ v / np.linalg.norm(u) / np.linalg.norm(v), -1, 1))


def test_cosines_opposite_to_edges_in_a_scaled_metric():
    V, F = meshes.bumpy(4, 3)
    tri, u = intrinsic.from_mesh(V, F), np.random.default_rng(0).normal(0, 0.1, len(V))
    length = {}
    for f in F:
        for k in range(3):
            i, j = f[k], f[(k + 1) % 3]
            length[i, j] = length[j, i] = np.linalg.norm(V[i] - V[j]) * np.exp(u[i] + u[j])
    h = np.arange(F.size)
    found = intrinsic.edge_cosines(F.ravel(), tri.log_length, u, h)
    for k, cosine in zip(h, found, strict=True):
        i, j, o = F.ravel()[k], F.ravel()[3 * (k // 3) + (k + 1) % 3], F.ravel()[3 * (k // 3) + (k + 2) % 3]
        a, b, c = length[i, j], length[j, o], length[o, i]
        assert cosine == pytest.approx((b * b + c * c - a * a) / (2 * b * c), abs=1e-9)
    np.testing.assert_allclose(
        tri.scaled(u), [np.log(length[F.ravel()[k], F.ravel()[3 * (k // 3) + (k + 1) % 3]]) for k in h]
    )


@pytest.mark.parametrize("height", [0.2, 0.7, 1.0, 1.9, 6.0])
def test_a_rectangle_fills_the_disk_as_it_stands(height):
    s = np.linspace(0, 1, 9)
    x, y = (g.ravel() for g in np.meshgrid(s, s * height))
    points = np.column_stack([x, y])
    w = rectangle_to_disk(points, height) @ [1, 1j]
    edge = (x == 0) | (x == 1) | (y == 0) | (y == height)
    assert np.abs(w[edge]) == pytest.approx(1) and np.abs(w[~edge]).max() < 1
    assert w[40] == pytest.approx(0, abs=1e-12)
    # Symmetric as the rectangle is, and turned by one turn that hangs on nothing.
    half = w.reshape(9, 9)
    assert half[::-1, ::-1] == pytest.approx(-half, abs=1e-9)
    assert half.ravel()[edge].sum() == pytest.approx(0, abs=1e-9)
    # Conformal and the right way round: a small step right and one up differ by a quarter turn to the left.
    inner = points[~edge]
    e = 1e-5
    here, right, up = (rectangle_to_disk(inner + d, height) @ [1, 1j] for d in ([0, 0], [e, 0], [0, e]))
    assert (up - here) / (right - here) == pytest.approx(np.full(len(inner), 1j), abs=1e-3)
    # Wide ones stand as they are, high ones are turned by a quarter.
    corner = rectangle_to_disk(np.array([[0.0, 0.0]]), height)[0]
    assert (corner < 0).tolist() == [True, height < 1]
    # From one shape to another the middle of the right side goes on where it was, as far as the two ways allow.
    middle = rectangle_to_disk(np.array([[1.0, height / 2]]), height)[0] @ [1, 1j]
    up_there = rectangle_to_disk(np.array([[0.5, height]]), height)[0] @ [1, 1j]
    assert up_there / middle == pytest.approx(1j, abs=1e-9)
    for bad in (8.5, 1 / 8.5):
        with pytest.raises(PrecisionError, match="The conformal map leaves double precision"):
            rectangle_to_disk(points * [1, bad / height], bad)


def test_the_mean_of_a_disk_comes_to_its_middle_by_a_moebius_map():
    rng = np.random.default_rng(0)
    z = np.sqrt(rng.uniform(0, 1, 50)) * np.exp(2j * np.pi * rng.uniform(0, 1, 50)) * 0.9 + 0.05
    mass = rng.uniform(0.1, 3, 50)
    w = centre_in_disk(np.column_stack([z.real, z.imag]), mass) @ [1, 1j]
    assert abs(mass @ w) / mass.sum() < 1e-9 and np.abs(w).max() < 1

    def cross(q):
        return (q[0] - q[2]) * (q[1] - q[3]) / ((q[0] - q[3]) * (q[1] - q[2]))

    for k in range(0, 48, 4):
        assert cross(w[k : k + 4]) == pytest.approx(cross(z[k : k + 4]), rel=1e-6)


def test_the_sphere_and_the_plane():
    z = np.array([0, 1, 1j, -2 + 3j, 1e-9])
    p = to_sphere(z)
    np.testing.assert_allclose(p[:3], [[0, 0, -1], [1, 0, 0], [0, -1, 0]], atol=1e-15)
    assert to_plane(p) == pytest.approx(z) and np.linalg.norm(p, axis=1) == pytest.approx(1)
    centre = np.array([0.3, -0.2, 0.5])
    unit = centre / np.linalg.norm(centre)
    q = boost(np.array([unit, -unit, *p]), centre)
    np.testing.assert_allclose(q[:2], [unit, -unit])
    assert np.linalg.norm(q, axis=1) == pytest.approx(1)
    # What lay around the centre is spread: the ball's own point goes to 0, so nothing is nearer to it than half way.
    rng = np.random.default_rng(0)
    points = rng.normal(size=(300, 3)) + [2, 1, 0]
    points /= np.linalg.norm(points, axis=1)[:, None]
    mass = rng.uniform(0.5, 2, 300)
    found = centre_on_sphere(points, mass)
    assert np.abs(mass @ found).max() / mass.sum() < 1e-12
    with pytest.raises(PrecisionError, match="The map gathers half of the surface in one"):
        centre_on_sphere(np.array([[0, 0, 1.0], [0, 0, 1.0], [1, 0, 0]]), np.ones(3))


@pytest.mark.parametrize("mesh", [lambda: meshes.bumpy(6, 5), meshes.single_triangle, meshes.quad_patch])
def test_turns_of_a_boundary_and_its_corners(mesh):
    V, F = mesh()
    (loop,) = boundary_loops(F)
    turns = boundary_turns(V, F, loop)
    for v, turn in zip(loop, turns, strict=True):
        inside = sum(angle(V[v], *V[[u for u in f if u != v]]) for f in F if v in f)
        assert turn == pytest.approx(np.pi - inside)
    corners = sharpest_corners(V, F, loop)
    place = [loop.tolist().index(c) for c in corners]
    assert place == sorted(place) and len(set(place)) == min(4, len(loop))
    quarters = quarter_points(V, loop)
    place = [loop.tolist().index(c) for c in quarters]
    assert place == sorted(place) and len(set(place)) == min(4, len(loop)) and place[0] == 0
    side = np.linalg.norm(V[np.roll(loop, -1)] - V[loop], axis=1)
    if len(loop) > 8:
        at = (np.cumsum(side) - side)[place] / side.sum()
        assert np.abs(at - np.arange(4) / 4).max() < side.max() / side.sum() + 1e-6
        assert set(corners) == {0, 6, len(V) - 1, len(V) - 7}


@pytest.mark.parametrize("longest", [0, 1, 2, 3, 4])
def test_quarters_are_four_vertices_wherever_the_long_edge_is(longest):
    step = np.where(np.arange(5) == longest, 10.0, 1.0)
    at = np.append(0, np.cumsum(step)[:-1])
    loop = np.arange(5)
    p = np.exp(2j * np.pi * at / step.sum())
    found = quarter_points(np.column_stack([p.real, p.imag, 0 * at]), loop)
    assert len(set(found)) == 4 and (np.diff(found) > 0).all()


def test_a_double_is_two_mirrored_disks_glued_along_the_boundary():
    V, F = meshes.bumpy(3, 3)
    (loop,) = boundary_loops(F)
    doubled, owner = double_disk(intrinsic.from_mesh(V, F), loop, len(V))
    inside = np.setdiff1d(np.arange(len(V)), loop)
    assert owner.tolist() == [*range(len(V)), *inside]
    m = len(F)
    assert np.array_equal(doubled.triangles[:m], F) and (doubled.twin >= 0).all()
    mirrored = {tuple(sorted(t)) for t in owner[doubled.triangles[m:]].tolist()}
    assert mirrored == {tuple(sorted(t)) for t in F.tolist()}
    flat = doubled.triangles.ravel()
    head = np.roll(doubled.triangles, -1, axis=1).ravel()
    twin = doubled.twin
    assert (twin[twin] == np.arange(6 * m)).all() and (flat[twin] == head).all() and (head[twin] == flat).all()
    expected = [np.log(np.linalg.norm(V[owner[a]] - V[owner[b]])) for a, b in zip(flat, head, strict=True)]
    np.testing.assert_allclose(doubled.log_length, expected)


def test_a_flat_disk_is_flattened_to_itself_and_a_curved_one_with_its_boundary_lengths():
    V, F = meshes.bumpy(5, 5, 0.0)
    (loop,) = boundary_loops(F)
    found = boundary_first(V, F, loop)
    np.testing.assert_allclose(found.log_scale, 0, atol=1e-9)
    np.testing.assert_allclose(signed_areas(found.uv, F), face_areas(V, F), atol=1e-9)
    assert found.spread(7 * found.area) == pytest.approx(0, abs=1e-12)
    V, F = meshes.bumpy(8, 8, 0.15)
    (loop,) = boundary_loops(F)
    found = boundary_first(V, F, loop)
    assert not found.log_scale[loop].any() and found.area == pytest.approx(vertex_areas(V, F))
    side, plane = (np.linalg.norm(x[np.roll(loop, -1)] - x[loop], axis=1) for x in (V, found.uv))
    assert plane == pytest.approx(side, rel=0.05) and (signed_areas(found.uv, F) > 0).all()
    asked = found.area * np.exp(2 * found.log_scale)
    assert found.spread(asked) == pytest.approx(0, abs=1e-12)
    share = found.area / found.area.sum()
    mean = share @ found.log_scale
    assert found.spread(found.area) == pytest.approx(share @ (found.log_scale - mean) ** 2)
    # Scales of lengths: areas follow their squares.
    ratio = np.bincount(F.ravel(), np.repeat(signed_areas(found.uv, F) / 3, 3)) / found.area
    inner = np.setdiff1d(np.arange(len(V)), loop)
    assert np.corrcoef(np.log(ratio[inner]), found.log_scale[inner])[0, 1] > 0.9
    assert np.polyfit(found.log_scale[inner], np.log(ratio[inner]), 1)[0] == pytest.approx(2, rel=0.3)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 50.0])
def test_maps_of_a_disk_say_how_they_are(scale):
    V, F = meshes.bumpy(8, 8, 0.3)
    V = scale * V + 3
    said = []
    found = drain(conformal_disk(V, F), said.append)
    fractions = [p.fraction for p in said]
    assert fractions[0] == pytest.approx(0, abs=0.05) and (np.diff(fractions) >= -1e-9).all() and fractions[-1] > 0.99
    (loop,) = boundary_loops(F)
    assert np.linalg.norm(found.uv[loop], axis=1) == pytest.approx(1, abs=1e-12)
    area = vertex_areas(V, F)
    assert np.abs(area @ found.uv / area.sum()).max() < 1e-8 and (signed_areas(found.uv, F) > 0).all()
    assert found.residual < 1e-8 and found.straightened == 0 and len(found.log_scale) == len(V)
    turned = drain(conformal_rectangle(V, F))
    assert turned.aspect == pytest.approx(np.ptp(turned.uv[:, 1])) and np.ptp(turned.uv[:, 0]) == pytest.approx(1)
    np.testing.assert_allclose(turned.uv.min(axis=0), 0, atol=1e-9)
    np.testing.assert_allclose(
        turned.uv[turned.corners], np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [1, turned.aspect], atol=1e-9
    )
    shear = [abs(angle(*turned.uv[np.roll(f, -k)]) - angle(*V[np.roll(f, -k)])) for f in F for k in range(3)]
    assert np.mean(shear) < 0.15
