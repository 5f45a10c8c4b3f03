"""What large meshes find some after the others, find again or keep in half of the memory is the same to the bit."""

import hard_meshes
import meshes
import numpy as np
import pytest

from omt_uv.solver.linalg import additive_schwarz, kept_factor, sparse, symmetric_sweeps, vertex_rows
from omt_uv.solver.linalg.vertex_rows import RowPattern, VertexRows, corner_pairs
from omt_uv.solver.maps import polygon_elements
from omt_uv.solver.maps.energy import energies
from omt_uv.solver.mesh import geometry
from omt_uv.solver.quads import diagonals


def quads(seed: int):
    """Bumpy quads, and their triangles, of which some are left alone."""
    V, P = hard_meshes.terrain(9, seed)
    return V, P[5:].astype(np.int32), np.concatenate([P[:5, :3], P[:5, [0, 2, 3]]]).astype(np.int32)


def blocks_of(places: vertex_rows.BlockPlaces) -> np.ndarray:
    """Block (c,p) of every pair of corners of cells; ~ that where the second corner comes first."""
    found = places.touched[places.number]
    return np.where(places.turned, ~found, found).T


@pytest.mark.parametrize("at_once", [1, 7, 60])
def test_patterns_do_not_depend_on_how_many_are_looked_at_once(at_once, monkeypatch):
    V, four, three = quads(0)
    whole = RowPattern([three, four], len(V))
    expected = [blocks_of(whole.places()(cells)) for cells in (three, four)]
    monkeypatch.setattr(vertex_rows, "AT_ONCE", at_once)
    found = RowPattern([three, four], len(V))
    for name in ("order", "first", "start", "columns"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    of_cells = found.places()
    for cells, blocks in zip((three, four), expected, strict=True):
        parts = [blocks_of(of_cells(cells[k : k + at_once])) for k in range(0, len(cells), at_once)]
        np.testing.assert_array_equal(np.concatenate(parts), blocks)


def test_blocks_are_those_of_both_corners_of_a_pair():
    """By hand: the rows and the columns of each block of every pair."""
    V, four, three = quads(1)
    pattern = RowPattern([three, four], len(V))
    place = np.argsort(pattern.order)
    row = np.repeat(np.arange(len(V)), np.diff(pattern.start))
    ends = pattern.first[1:][np.searchsorted(pattern.first[1:], row, side="right")]
    column = pattern.columns[::2] // 2 + ends
    assert (pattern.columns[1::2] == pattern.columns[::2] + 1).all() and pattern.count == len(row)
    of_cells = pattern.places()
    for cells in (three, four):
        places = of_cells(cells)
        assert (np.diff(places.touched) > 0).all() and places.alike is None
        for cell, blocks in zip(cells, blocks_of(places), strict=True):
            for one, other, block in zip(*(place[cell[side]] for side in corner_pairs(len(cell))), blocks, strict=True):
                if one == other:
                    assert block == pattern.count + one
                else:
                    assert (block < 0) == (one > other)
                    k = ~block if block < 0 else block
                    assert (row[k], column[k]) == (min(one, other), max(one, other))


@pytest.mark.parametrize("at_once", [1, 7, 1000])
@pytest.mark.parametrize("held", ["none", "vertices", "axes"])
def test_motions_do_not_depend_on_how_many_are_found_at_once(at_once, held, monkeypatch):
    rng, n, parts = np.random.default_rng(0), 60, 4
    w, along = rng.normal(size=(n, 2)) @ [1, 1j], np.tile([1, 1j], (n, 1))
    if held == "vertices":
        along[:9] = 0
    if held == "axes":
        along[::2] = along[::2] * np.exp(0.3j) * [1, 0]
    part = rng.permutation(np.arange(n) % parts)
    monkeypatch.setattr(additive_schwarz, "AT_ONCE", at_once)
    found = additive_schwarz.affine_motions(part, parts, w, along)
    assert found.has_canonical_format and found.shape == (2 * n, 6 * parts)
    for k in range(parts):
        middle = w[part == k].mean()
        scale = np.sqrt((np.abs(w[part == k] - middle) ** 2).mean())
        z = (w[part == k] - middle) / scale
        for axis in range(2):
            side = (along[part == k].real, along[part == k].imag)[axis]
            for m, motion in enumerate((np.ones(len(z)), z.real, z.imag)):
                column = found[:, [6 * k + 3 * axis + m]].toarray().reshape(n, 2)
                np.testing.assert_allclose(column[part == k], side * motion[:, None], atol=1e-12)
                assert not column[part != k].any()


@pytest.mark.parametrize("let_go", [False, True])
def test_elements_that_are_found_again_have_the_same_energies(let_go, monkeypatch):
    V, four, three = quads(2)
    triangles = np.concatenate([three, four[:, [0, 1, 2]], four[:, [0, 2, 3]]])
    owner = np.concatenate([np.arange(len(three)), *[len(three) + np.arange(len(four))] * 2])
    rng, w = np.random.default_rng(3), V[:, :2] @ [1.2, 1j]
    target = rng.uniform(0.5, 2, len(triangles))
    kept = polygon_elements.polygon_elements(V, triangles, target, owner)
    monkeypatch.setattr(geometry, "KEPT_HATS", 0)
    found = polygon_elements.polygon_elements(V, triangles, target, owner)
    assert isinstance(found.hats, geometry.Sides) and isinstance(found.quads.size, geometry.Sizes)
    some = rng.random(len(four)) < 0.5
    for here in (slice(None), slice(3, 17), slice(5, 5), slice(-4, None), slice(1, 40, 3), some):
        if let_go:
            found.let_go()
        np.testing.assert_array_equal(found.quads.of(here).size, kept.quads.of(here).size)
    for name in ("part", "triangle_areas", "gradient"):
        if let_go:
            found.let_go()
        np.testing.assert_array_equal(getattr(found, name), getattr(kept, name))
    np.testing.assert_array_equal(energies(found, w, 30.0), energies(kept, w, 30.0))
    both = [polygon_elements.with_convex_quads(x, w).quads.both for x in (found, kept)]
    np.testing.assert_array_equal(*both)
    assert both[0].any()
    np.testing.assert_array_equal(geometry.hat_areas(V, triangles), geometry.hat_gradients(V, triangles)[0])


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("guessed", [False, True])
def test_what_gradients_start_from_is_overwritten_where_it_may_be(overwrite, guessed):
    rng = np.random.default_rng(4)
    half = rng.normal(size=(30, 30))
    A, b = half @ half.T + np.eye(30), rng.normal(size=30)
    guess = rng.normal(size=30) if guessed else None
    given = b.copy()
    x, done = kept_factor.nearly(A, given, lambda r: r, 60, 1e-9, guess, overwrite)
    assert done and b @ x == pytest.approx(b @ np.linalg.solve(A, b), rel=1e-6)
    assert np.array_equal(given, b) == (not overwrite or guessed)
    plain = kept_factor.by_gradients(A, b.copy(), lambda r: r, 60, 1e-9, guess, not overwrite)
    np.testing.assert_array_equal(plain, x)
    steps = sparse.gradient_steps(A, given := b.copy(), lambda r: r, overwrite)
    next(steps), next(steps)
    assert np.array_equal(given, b) == (not overwrite)


@pytest.mark.parametrize("many", [0, 10**6])
def test_a_surface_that_is_cut_anew_is_the_same_in_half_of_the_memory(many, monkeypatch):
    V, P = hard_meshes.terrain(8, 5)
    given = hard_meshes.surface(V, P)
    monkeypatch.setattr(diagonals, "MANY", many)
    before, found = given.triangles.copy(), diagonals.cut_along_shorter(given)
    assert found.triangles.dtype == (np.int32 if many == 0 else np.int64)
    np.testing.assert_array_equal(given.triangles, before)
    for polygon, two in zip(P, given.corner_vertex[found.triangles].reshape(-1, 2, 3), strict=True):
        cut = set(two[0]) & set(two[1])
        assert set(two.ravel()) == set(polygon) and cut in (set(polygon[::2]), set(polygon[1::2]))
        length = {frozenset(ends): np.linalg.norm(V[ends[0]] - V[ends[1]]) for ends in (polygon[::2], polygon[1::2])}
        assert length[frozenset(cut)] == pytest.approx(min(length.values()), rel=1e-9)


@pytest.mark.parametrize("single", [False, True])
def test_motions_of_parts_precondition_in_either_precision(single, monkeypatch):
    V, F = meshes.bumpy(20, 20)
    n, rng = len(V), np.random.default_rng(6)
    pattern = RowPattern([F, np.zeros((0, 4), np.int64)], n)
    local = np.stack([np.kron([[1, -0.5, -0.5], [-0.5, 1, -0.5], [-0.5, -0.5, 1]], np.eye(2))] * len(F))
    rows = VertexRows(pattern, VertexRows.summed(pattern, [(pattern.places()(F), local)]))
    rows.add_diagonal(np.full(2 * n, 0.01))
    b, solver = rng.normal(size=2 * n), symmetric_sweeps.SymmetricSweeps(V, F)
    monkeypatch.setattr(symmetric_sweeps, "SINGLE_FROM", 0 if single else 10**6)
    x = solver.solve(rows, b, V[:, 0] + 1j * V[:, 1], lambda: np.tile([1, 1j], (n, 1)))
    best = sparse.solve_spd(rows.plain(), b)
    assert solver._parts is None and 0.8 * (b @ best) <= b @ x <= (1 + 1e-9) * (b @ best)
