"""Large meshes solved in parts: Newton steps nearly as good as those of a factorisation, and the same maps."""

from dataclasses import replace

import hard_meshes
import meshes
import numpy as np
import pytest
import scipy.sparse as sp
from newton_steps import check_promise, hemisphere
from work import counted_work

from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.linalg import additive_schwarz as schwarz
from omt_uv.solver.linalg.additive_schwarz import AdditiveSchwarz
from omt_uv.solver.linalg.nested_dissection import mesh_order
from omt_uv.solver.linalg.symmetric_sweeps import sweeping_solver
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.refinement.hessian_blocks import Assembly
from omt_uv.solver.refinement.projected_newton import FreeMotion, NewtonProblem, newton_direction


def flattened(kind, weight=500.0):
    """Newton's problem for a hemisphere, as a whole and in parts, and its map with true meridians."""
    V, F, w, motion = hemisphere(kind)
    problem = NewtonProblem(elements(V, F, face_areas(V, F)), Assembly(F, len(w)), motion, weight)
    return problem, replace(problem, assembly=Assembly(F, len(w), AdditiveSchwarz(V, F, 200))), w


@pytest.mark.parametrize("kind", ["free", "circle"])
@pytest.mark.parametrize("weight", [1.0, 500.0])
def test_steps_promise_nearly_as_much_as_those_of_a_factorisation(kind, weight):
    whole, parted, w = flattened(kind, weight)
    check_promise(whole, parted, w)


def test_steps_follow_a_turned_and_enlarged_map():
    _, parted, w = flattened("free", 30.0)
    scale = 1000 * np.exp(0.7j)
    larger = replace(parted, faces=replace(parted.faces, ratio=1e6 * parted.faces.ratio))
    step, _ = newton_direction(parted, w)
    turned, _ = newton_direction(larger, scale * w)
    assert np.abs(turned - scale * step).max() <= 1e-5 * np.abs(scale * step).max()


def test_steps_of_a_slider_are_solved_by_smaller_parts_from_fewer_vertices_on():
    for side, parted in ((80, False), (100, True)):
        V, F = meshes.head(side)
        order = mesh_order(V, F)
        given = V[order], np.argsort(order)[F]
        assert sweeping_solver(*given) is None
        assert (schwarz.schwarz_solver(*given) is not None) == parted


def test_what_takes_too_long_is_factored(monkeypatch):
    whole, parted, w = flattened("free")
    monkeypatch.setattr(schwarz, "MOST", 2)
    exact, _ = newton_direction(whole, w)
    step, _ = newton_direction(parted, w)
    np.testing.assert_allclose(step, exact, atol=1e-8 * np.abs(exact).max())


def test_stiff_equations_are_factored():
    _, parted, w = flattened("free", 1e5)
    with counted_work() as tally:
        newton_direction(parted, w)
    assert tally.factorisations == 1


def test_parts_of_a_slider_are_taken_as_before_while_the_pattern_is_the_same():
    """And anew where it is another one: factors sort what they are given, in place."""
    _, parted, w = flattened("free", 30.0)
    V, F = meshes.hemisphere(40, 96)
    solver, b = AdditiveSchwarz(V, F, 200, keep=True), np.ones(2 * len(w))
    axes = np.ones((len(w), 2)) * [1, 1j]
    pattern = parted.assembly.pattern().tocsr()
    regular = sp.csr_matrix((np.full(pattern.nnz, -0.01), pattern.indices, pattern.indptr)) + sp.identity(len(b))
    solver.prepare(regular)
    far = sp.coo_matrix(([0.5, 0.5], ([0, len(b) - 1], [len(b) - 1, 0])), shape=regular.shape)
    for matrix in (regular, 2 * regular, (regular + far).tocsr(), 3 * regular):
        # What was found goes on only from the same equations.
        fresh = AdditiveSchwarz(V, F, 200, keep=True)
        solver._kept = None
        x = solver.solve(matrix, b, w, lambda: axes)
        np.testing.assert_array_equal(x, fresh.solve(matrix, b, w, lambda: axes))


def test_singular_parts_are_named():
    _, parted, w = flattened("free")
    matrix = sp.csc_matrix((2 * len(w), 2 * len(w)))
    with pytest.raises(PrecisionError, match="A linear system is singular in double"):
        parted.assembly.parts.solve(matrix, np.ones(2 * len(w)), w, lambda: np.ones((len(w), 2), complex))


def test_nonzeros_grow_with_the_mesh():
    counts = []
    for count in (60, 120):
        V, F = meshes.bumpy(count, count, height=0.3)
        w = V[:, 0] + 0.2 * V[:, 1] + 1j * V[:, 1]
        faces = elements(V, F, face_areas(V, F))
        problem = NewtonProblem(
            faces, Assembly(F, len(w), AdditiveSchwarz(V, F, 200)), FreeMotion(np.zeros(len(w), bool)), 30.0
        )
        with counted_work() as tally:
            newton_direction(problem, w)
        counts.append(tally.nonzeros / len(w))
    assert counts[1] <= 1.15 * counts[0]


def test_affine_motions_of_parts_are_among_the_coarse_ones():
    V, F = meshes.bumpy(20, 20)
    w = V[:, 0] + 1j * V[:, 1] + 3 - 2j
    frame = np.exp(1j * np.arange(len(w)))
    parts = AdditiveSchwarz(V, F, 100)
    spread = schwarz.affine_motions(parts._part, parts._count, w, frame[:, None] * [1, 1j]).toarray()
    for motion in (np.ones(len(w)), 1j * np.ones(len(w)), w, 1j * w, w.conj(), 1j * w.conj()):
        along = (motion * frame.conj()).view(float)
        found = np.linalg.lstsq(spread, along, rcond=None)[0]
        np.testing.assert_allclose(spread @ found, along, atol=1e-9)


def test_parts_of_quads_have_the_fill_of_their_equations():
    # All corners of a quad are neighbours in its equations, while its triangles know of one diagonal.
    V, quads = hard_meshes.terrain(60)
    every = quads[:, [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]]].reshape(-1, 3)
    w, axes, counts = V[:, 0] + 1j * V[:, 1], np.tile([1, 1j], (len(V), 1)), []
    blocks = np.tile(np.eye(6) - 1 / 6, (len(every), 1, 1))
    matrix = Assembly(every, len(w)).matrix(blocks, np.full(2 * len(w), 0.1))
    for triangles in (every.reshape(-1, 4, 3)[:, :2].reshape(-1, 3), every):
        parts = AdditiveSchwarz(V, triangles, 1000)
        with counted_work() as tally:
            parts.solve(matrix, np.ones(2 * len(w)), w, lambda: axes)
        counts.append(tally.nonzeros)
    assert counts[0] <= 1.1 * counts[1]


def test_a_hub_brings_its_neighbours_into_no_other_part():
    count = 4000
    angle = 2 * np.pi * np.arange(count) / count
    V = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    V = np.concatenate([V, [[0, 0, 0.5]]])
    F = np.column_stack([np.arange(count), (np.arange(count) + 1) % count, np.full(count, count)])
    parts = AdditiveSchwarz(V, F, 200)
    sizes = [len(unknowns) // 2 for unknowns in parts._unknowns]
    assert len(sizes) >= 8 and max(sizes) <= 2 * count / len(sizes)
    assert np.unique(np.concatenate(parts._unknowns)).size == 2 * len(V)


def test_parts_overlap_by_the_rings_around_them():
    V, F = meshes.hemisphere(16, 40)
    parts = AdditiveSchwarz(V, F, 100)
    near = np.zeros((len(V), len(V)), bool)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        near[F[:, a], F[:, b]] = near[F[:, b], F[:, a]] = True
    for k, unknowns in enumerate(parts._unknowns):
        mine = parts._part == k
        for _ in range(schwarz.OVERLAP):
            mine = mine | near[mine].any(axis=0)
        assert np.array_equal(np.unique(unknowns // 2), np.flatnonzero(mine))


def test_motions_are_those_of_the_parts_in_the_axes_and_their_equations_to_the_bit():
    _, parted, w = flattened("circle", 30.0)
    parts, rng = parted.assembly.parts, np.random.default_rng(0)
    axes = np.exp(2j * np.pi * rng.random((len(w), 2))) * (rng.random((len(w), 2)) > 0.3)
    spread, part = schwarz.affine_motions(parts._part, parts._count, w, axes), parts._part
    of_motions = rng.normal(size=spread.shape[1])
    a, b, c = (of_motions.reshape(-1, 6)[:, k] + 1j * of_motions.reshape(-1, 6)[:, k + 3] for k in range(3))
    for k in range(parts._count):
        here = part == k
        z = w[here] - w[here].mean()
        z /= np.sqrt((np.abs(z) ** 2).mean())
        moved = (axes[here].conj() * (a[k] + b[k] * z.real + c[k] * z.imag)[:, None]).real
        np.testing.assert_allclose((spread @ of_motions).reshape(-1, 2)[here], moved, atol=1e-12)
    matrix = sp.random(len(w) * 2, len(w) * 2, 0.002, "csr", random_state=1)
    found, whole = parts._coarse(matrix, spread), (spread.T @ (matrix @ spread)).tocsc()
    np.testing.assert_array_equal(found.toarray(), whole.toarray())
    # What stays has no entries that would take memory.
    assert spread.nnz == 6 * np.count_nonzero(axes)
    plain = schwarz.affine_motions(part, parts._count, w, np.tile([1, 1j], (len(w), 1)))
    assert plain.nnz == 6 * len(w)


def test_parts_that_stay_are_not_factored_and_the_others_as_before(monkeypatch):
    """Vertices that follow their images are half of a symmetric mesh: identities, and of no use."""
    V, F = meshes.bumpy(30, 30)
    n, parts = len(V), AdditiveSchwarz(V, F, 50)
    stays = V[:, 0] < np.median(V[:, 0])
    moves = np.repeat(~stays, 2)
    i, j = np.repeat(F, 3, axis=1).ravel(), np.tile(F, (1, 3)).ravel()
    graph = sp.kron(sp.csr_matrix((np.ones(len(i)), (i, j)), shape=(n, n)), np.ones((2, 2)))
    free = sp.diags(moves.astype(float))
    matrix = (sp.diags(np.asarray(abs(graph).sum(axis=1)).ravel()) - 0.1 * free @ graph @ free).tocsr()
    monkeypatch.setattr(schwarz, "TOGETHER", 1)
    parts.prepare(matrix)
    every, some = (
        [pair for k in range(parts._count) for pair in parts._group(matrix, k, moved)]
        for moved in (np.ones(2 * n, bool), moves)
    )
    expected = [(d, factor) for d, factor in every if moves[d].any()]
    assert 0 < len(some) == len(expected) < len(every) == parts._count
    r = np.random.default_rng(0).normal(size=2 * n) * moves
    for (d, factor), (e, other) in zip(some, expected, strict=True):
        np.testing.assert_array_equal(d, e)
        np.testing.assert_array_equal(factor.solve(r[d]), other.solve(r[e]))
    w, axes = V[:, 0] + 1j * V[:, 1], np.array([1, 1j]) * ~stays[:, None]
    x = parts.solve(matrix, r, w, lambda: axes)
    assert not x[~moves].any()
    # As good a step as there is, within some percent.
    best = sp.linalg.spsolve(matrix.tocsc(), r)
    assert 0.9 * (r @ best) <= r @ x <= (1 + 1e-9) * (r @ best)
