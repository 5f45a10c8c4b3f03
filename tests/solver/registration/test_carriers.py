"""What vertices move on: tangents are tangents, steps go along them, folds are told, on every carrier alike."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from sphere_shapes import blob

from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.registration.carriers import DiskCarrier, InPlace, SphereCarrier, TargetCarrier, _Outline


def unit(x):
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def disk():
    """A round patch: its triangles, its places (n,2) in the unit disk, and its loop."""
    V, F = meshes.hemisphere(6, 20)
    radius = np.linalg.norm(V[:, :2], axis=1)
    uv = V[:, :2] / radius.max()
    loop = boundary_loops(F)[0]
    uv[loop] = unit(uv[loop])
    return V, F, uv, loop


def carriers():
    """Each carrier with places of a mesh on it, its triangles, and the vertices that slide."""
    rng = np.random.default_rng(0)
    V, F = blob(2)
    ball = unit(V)
    W, G, uv, loop = disk()
    inner = np.setdiff1d(np.arange(len(uv)), loop)
    within = 0.6 * uv[inner] + rng.uniform(-0.01, 0.01, (len(inner), 2))
    none = np.zeros(0, np.int64)
    return {
        "sphere": (SphereCarrier(), ball, F, none),
        "disk": (DiskCarrier(loop), uv, G, loop),
        "target of a sphere": (TargetCarrier(V, F, ball), unit(ball + rng.normal(0, 0.01, ball.shape)), F, none),
        "target of a disk": (TargetCarrier(W, G, uv), within, None, none),
    }


NAMES = ("sphere", "disk", "target of a sphere", "target of a disk")


@pytest.mark.parametrize("name", NAMES)
def test_tangents_are_orthonormal_and_along_what_they_are_of(name):
    carrier, domain, _, loop = carriers()[name]
    placed = carrier.place(domain)
    axes = carrier.axes(placed)
    free = np.setdiff1d(np.arange(len(domain)), loop)
    np.testing.assert_allclose(np.einsum("nad,nbd->nab", axes[free], axes[free]), np.tile(np.eye(2), (len(free), 1, 1)),
                               atol=1e-9)  # fmt: skip
    if carrier.round:
        normals = placed.positions
    elif name.startswith("target"):
        corners = carrier.vertices[carrier.triangles[placed.faces]]
        normals = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    else:
        normals = np.tile([0.0, 0, 1], (len(domain), 1))
    assert np.abs(np.einsum("nad,nd->na", axes, normals)).max() < 1e-9
    # Those that slide have the one way along the circle.
    assert (axes[loop, 1] == 0).all() and np.allclose(np.linalg.norm(axes[loop, 0], axis=1), 1)
    if len(loop):
        assert np.abs(np.einsum("nd,nd->n", axes[loop, 0, :2], placed.domain[loop])).max() < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_steps_go_along_tangents_and_no_step_goes_nowhere(name):
    carrier, domain, _, loop = carriers()[name]
    placed = carrier.place(domain)
    still = carrier.move(placed, np.zeros((len(domain), 3)))
    np.testing.assert_allclose(still.positions, placed.positions, atol=1e-9)
    np.testing.assert_allclose(still.domain, domain, atol=1e-9)
    axes, rng = carrier.axes(placed), np.random.default_rng(1)
    for size in (1e-3, 1e-4):
        step = size * np.einsum("nad,na->nd", axes, rng.uniform(-1, 1, (len(domain), 2)))
        moved = carrier.move(placed, step)
        off = np.linalg.norm(moved.positions - placed.positions - step, axis=1)
        # Where a step leads around an edge it goes on in the next face.
        assert np.median(off) < 5 * size**2 + 1e-12 and off.max() < 2 * size
        if carrier.round:
            np.testing.assert_allclose(np.linalg.norm(moved.positions, axis=1), 1, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(moved.domain[loop], axis=1), 1, atol=1e-12)
        if name.startswith("target"):
            corners = carrier.vertices[carrier.triangles[moved.faces]]
            np.testing.assert_allclose(np.einsum("nc,ncd->nd", moved.barycentric, corners), moved.positions, atol=1e-12)
            assert moved.barycentric.min() > -1e-9 and np.allclose(moved.barycentric.sum(axis=1), 1)


@pytest.mark.parametrize("name", ["target of a sphere", "target of a disk"])
def test_places_in_the_domain_are_pushed_as_steps_push_them(name):
    carrier, domain, *_ = carriers()[name]
    # Within faces, where a step does not reach an edge.
    placed = carrier.place(domain)
    inside = placed.barycentric.min(axis=1) > 0.02
    axes = carrier.axes(placed)
    pushed = carrier.pushed(placed, axes)
    h = 1e-6
    for a in range(2):
        ahead, behind = (carrier.move(placed, s * h * axes[:, a]).domain for s in (1, -1))
        slope = (ahead - behind) / (2 * h)
        width = slope.shape[1]
        np.testing.assert_allclose(pushed[inside, a, :width], slope[inside], rtol=1e-4, atol=1e-6)
        assert (pushed[:, a, width:] == 0).all()
    assert inside.sum() > 10


@pytest.mark.parametrize("name", ["sphere", "disk", "target of a sphere"])
def test_folds_are_triangles_that_are_turned_over(name):
    carrier, domain, F, _ = carriers()[name]
    assert not carrier.folded(carrier.place(domain), F).any()
    moved = domain.copy()
    a, b = F[len(F) // 2, :2]
    moved[[a, b]] = moved[[b, a]]
    found = carrier.folded(carrier.place(moved), F)
    p, q, r = (moved[F[:, k]] for k in range(3))
    if moved.shape[1] == 3:
        sign = np.einsum("ij,ij->i", p, np.cross(q, r))
    else:
        sign = np.linalg.det(np.stack([q - p, r - p], axis=1))
    np.testing.assert_array_equal(found, sign <= 0)
    assert found.any() and not found.all()


def test_means_are_brought_back_and_places_are_exchanged():
    every = carriers()
    for name, (carrier, domain, *_) in every.items():
        mean = (2 * domain + np.roll(domain, 1, axis=0)) / 3
        back = carrier.within(mean)
        np.testing.assert_allclose(back, unit(mean) if domain.shape[1] == 3 else mean)
        one, other = carrier.place(domain), carrier.place(back)
        take = np.arange(len(domain)) % 3 == 0
        mixed = one.chosen(take, other)
        copy = InPlace(*(part.copy() for part in vars(one).values()))
        copy.put(np.flatnonzero(~take), other, ~take)
        for a, b, x, y in zip(*(vars(p).values() for p in (mixed, copy, one, other)), strict=True):
            np.testing.assert_array_equal(a, np.where(take.reshape(-1, *[1] * (x.ndim - 1)), x, y), name)
            np.testing.assert_array_equal(a, b)


def test_what_slides_on_a_boundary_stays_there_and_goes_to_the_nearest_of_it():
    W, G, uv, loop = disk()
    outline = _Outline(W, G)
    rng = np.random.default_rng(2)
    points = W[rng.choice(loop, 30)] * rng.uniform(0.9, 1.2, (30, 1)) + rng.normal(0, 0.05, (30, 3))
    faces, barycentric = outline.nearest(points)
    found = np.einsum("kc,kcd->kd", barycentric, W[G[faces]])
    tail, head = W[loop], W[np.roll(loop, -1)]
    way = head - tail
    along = np.clip(np.einsum("pkd,kd->pk", points[:, None] - tail, way) / (way**2).sum(axis=1), 0, 1)
    least = np.linalg.norm(tail + along[..., None] * way - points[:, None], axis=2).min(axis=1)
    np.testing.assert_allclose(np.linalg.norm(found - points, axis=1), least, atol=1e-9)
    # The direction is that of the edge it is on, as its face goes around.
    edges = {tuple(sorted(e)) for e in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)}
    inner = barycentric[:, :].max(axis=1) < 0.99
    for face, bary, direction in zip(
        faces[inner], barycentric[inner], outline.direction(faces, barycentric)[inner], strict=True
    ):
        corner = int(bary.argmin())
        p, q = G[face, (corner + 1) % 3], G[face, (corner + 2) % 3]
        assert tuple(sorted((int(p), int(q)))) in edges
        np.testing.assert_allclose(direction, unit(W[q] - W[p]), atol=1e-9)
    carrier = TargetCarrier(W, G, uv).sliding(np.arange(len(loop)))
    placed = carrier.place(uv[loop])
    axes = carrier.axes(placed)
    assert (axes[:, 1] == 0).all() and np.allclose(np.linalg.norm(axes[:, 0], axis=1), 1)
    moved = carrier.move(placed, 0.3 * axes[:, 0])
    np.testing.assert_allclose(np.linalg.norm(moved.domain, axis=1), 1, atol=0.02)
    assert np.linalg.norm(moved.positions - placed.positions, axis=1).min() > 0.2
