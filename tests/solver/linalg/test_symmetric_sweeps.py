"""Newton's equations of large meshes solved by sweeps: steps nearly as good as those of factors, and the same maps."""

from dataclasses import replace

import hard_meshes
import meshes
import numpy as np
import pytest
import scipy.sparse as sp
from newton_steps import check_promise, hemisphere

from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.linalg import additive_schwarz as schwarz
from omt_uv.solver.linalg import symmetric_sweeps as sweeps
from omt_uv.solver.linalg.nested_dissection import mesh_order
from omt_uv.solver.linalg.symmetric_sweeps import SymmetricSweeps, sweeping_solver
from omt_uv.solver.linalg.vertex_rows import RowPattern, VertexRows, coloured
from omt_uv.solver.maps.energy import elements
from omt_uv.solver.maps.polygon_elements import polygon_elements
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import hessian_blocks as blocks
from omt_uv.solver.refinement.hessian_blocks import RowAssembly, assembly_of
from omt_uv.solver.refinement.projected_newton import NewtonProblem, newton_direction


def flattened(kind, weight=500.0, polygons=None):
    """Newton's problem for a hemisphere, with factors and by sweeps, and its map with true meridians."""
    V, F, w, motion = hemisphere(kind)
    faces = polygon_elements(V, F, face_areas(V, F), None if polygons is None else polygons(len(F)))
    whole = NewtonProblem(faces, assembly_of(faces, len(w)), motion, weight)
    return whole, replace(whole, assembly=assembly_of(faces, len(w), SymmetricSweeps(V, F))), w


def in_pairs(count):
    """Most triangles in pairs, which are quads where they share a side, some in threes, and some alone."""
    number = np.arange(count) // 2
    number[count // 2 :] = count + np.arange(count // 2, count) // 3
    number[-count // 8 :] = 3 * count + np.arange(count // 8)
    return number


@pytest.mark.parametrize("polygons", [None, in_pairs])
@pytest.mark.parametrize("kind", ["free", "circle"])
def test_rows_are_those_of_the_matrix_that_is_assembled_at_once(kind, polygons, monkeypatch):
    monkeypatch.setattr(blocks, "FEW_AT_ONCE", 700)
    whole, swept, w = flattened(kind, 30.0, polygons)
    assert isinstance(swept.assembly, RowAssembly)
    frame, free = whole.motion.frame(w), whole.motion.free.astype(float)
    found = [p.assembly.hessian(p.faces, w, 30.0, 0.5, (frame, free)) for p in (whole, swept)]
    np.testing.assert_allclose(found[1].gradient, found[0].gradient, atol=1e-15)
    assert found[1].scale == pytest.approx(found[0].scale)
    diagonal = np.random.default_rng(0).random(2 * len(w))
    expected, rows = (one.matrix(diagonal, one.rest) for one in found)
    size = abs(expected).max()
    assert abs(rows.plain() - expected).max() <= 1e-14 * size
    x, order = np.random.default_rng(1).normal(size=2 * len(w)), rows.pattern.order
    image = np.empty((len(w), 2))
    image[order] = (rows @ x.reshape(-1, 2)[order].ravel()).reshape(-1, 2)
    np.testing.assert_allclose(image.ravel(), expected @ x, atol=1e-13 * size)
    assert abs(rows.shifted(2.0).plain() - expected - 2 * sp.identity(len(x))).max() <= 1e-14 * size
    for one in rows.of_colours:
        # A copy would take as much memory as the matrix.
        assert all(not part.nnz or np.shares_memory(part.indices, rows.pattern.columns) for part in one)
    # Each block of two vertices is there once.
    assert sum(first.nnz for first, _ in rows.of_colours) == 2 * rows.pattern.count
    assert rows.pattern.count == (whole.assembly.pattern().nnz / 4 - len(w)) / 2


@pytest.mark.parametrize("polygons", [None, in_pairs])
@pytest.mark.parametrize("kind", ["free", "circle"])
@pytest.mark.parametrize("weight", [1.0, 500.0])
def test_steps_promise_nearly_as_much_as_those_of_a_factorisation(kind, weight, polygons):
    whole, swept, w = flattened(kind, weight, polygons)
    check_promise(whole, swept, w)


def test_what_is_added_may_join_vertices_of_a_colour():
    """As barriers of a boundary do: sweeps converge all the same."""
    V, F = meshes.bumpy(20, 20)
    n, rng = len(V), np.random.default_rng(0)
    solver = SymmetricSweeps(V, F)
    pattern = RowPattern([F, np.zeros((0, 4), np.int64)], n)
    local = np.stack([np.kron([[1, -0.5, -0.5], [-0.5, 1, -0.5], [-0.5, -0.5, 1]], np.eye(2))] * len(F))
    of_colour = pattern.order[pattern.rows(0)]
    joined = [rng.choice(of_colour, 5, replace=False) for _ in range(8)]
    forms = sp.csr_matrix(
        (3 * rng.normal(size=80), (np.repeat(np.arange(8), 10), (2 * np.array(joined)[:, :, None] + [0, 1]).ravel())),
        shape=(8, 2 * n),
    )
    rows = VertexRows(pattern, VertexRows.summed(pattern, [(pattern.places()(F), local)]), forms.T @ forms)
    rows.add_diagonal(np.full(2 * n, 0.01))
    b = rng.normal(size=2 * n)
    x = solver.solve(rows, b, V[:, 0] + 1j * V[:, 1], lambda: np.tile([1, 1j], (n, 1)))
    best = sp.linalg.spsolve(rows.plain(), b)
    assert solver._parts is None and 0.8 * (b @ best) <= b @ x <= (1 + 1e-9) * (b @ best)


@pytest.mark.parametrize("joined", [False, True])
def test_a_sweep_there_parts_and_a_sweep_back_are_those_vertex_by_vertex(joined):
    V, F = meshes.bumpy(7, 7)
    n, rng = len(V), np.random.default_rng(1)
    pattern = RowPattern([F, np.zeros((0, 4), np.int64)], n)
    local = rng.normal(size=(len(F), 6, 6))
    more = sp.random(2 * n, 6, 0.1, "csr", random_state=2) if joined else None
    more = more @ more.T if joined else None
    rows = VertexRows(pattern, VertexRows.summed(pattern, [(pattern.places()(F), local @ local.swapaxes(1, 2))]), more)
    rows.add_diagonal(np.full(2 * n, 0.1))
    unknowns = (2 * pattern.order[:, None] + [0, 1]).ravel()
    matrix = rows.plain().toarray()[np.ix_(unknowns, unknowns)]
    spread = sp.csr_matrix(rng.normal(size=(2 * n, 4)))
    xx, xy, yy = rows._own
    own = [np.array([[xx[v], xy[v]], [xy[v], yy[v]]]) for v in range(n)]
    r = rng.normal(size=2 * n)

    def moved(x, v):
        """The vertex v where nothing is left of its rows, all others as they are."""
        here = slice(2 * v, 2 * v + 2)
        return np.linalg.solve(own[v], (r - matrix @ x)[here] + own[v] @ x[here])

    x, colours = np.zeros(2 * n), [range(*pattern.rows(k).indices(n)) for k in range(len(pattern.first) - 1)]
    for colour in colours:
        new = {v: moved(x, v) for v in colour}
        for v, place in new.items():
            x[2 * v : 2 * v + 2] = place
    x += spread @ (3 * (spread.T @ (r - matrix @ x)))
    for colour in reversed(colours):
        new = {v: moved(x, v) for v in colour}
        for v, place in new.items():
            x[2 * v : 2 * v + 2] = place
    found = sweeps._preconditioner(rows, lambda left: 3 * (spread.T @ left), sweeps.Motions(spread, plain=False))(r)
    np.testing.assert_allclose(found, x, atol=1e-9 * np.abs(x).max())


def test_what_takes_too_long_is_factored_by_parts(monkeypatch):
    whole, swept, w = flattened("free")
    monkeypatch.setattr(sweeps, "MOST", 2)
    _, most = newton_direction(whole, w)
    for _ in range(2):
        _, slope = newton_direction(swept, w)
        assert slope < 0.9 * most
    assert swept.assembly.parts._parts is not None


def test_stiff_equations_are_factored():
    whole, swept, w = flattened("free", 1e5)
    exact, step = (newton_direction(problem, w)[0] for problem in (whole, swept))
    np.testing.assert_allclose(step, exact, atol=1e-9 * np.abs(exact).max())


def test_singular_equations_are_named():
    _, swept, w = flattened("free")
    pattern = swept.assembly._pattern
    rows = VertexRows(pattern, VertexRows.summed(pattern, []))
    with pytest.raises(PrecisionError, match="A linear system is singular in double"):
        swept.assembly.parts.solve(rows, np.ones(2 * len(w)), w, lambda: np.ones((len(w), 2), complex))


def test_neighbours_have_different_colours_and_few_are_enough():
    V, quads = hard_meshes.terrain(40)
    n = len(V)
    pattern = RowPattern([np.zeros((0, 3), np.int64), quads], n)
    colour = np.empty(n, int)
    for k in range(len(pattern.first) - 1):
        colour[pattern.order[pattern.rows(k)]] = k
    corners = colour[quads]
    assert all((corners[:, i] != corners[:, j]).all() for i in range(4) for j in range(i))
    assert colour.max() < 9
    # All neighbours of a hub have one colour or two.
    spokes = np.arange(1, 500)
    tail, head = np.concatenate([[0], 0 * spokes, spokes, spokes]), np.concatenate([[0], spokes, 0 * spokes, spokes])
    order = np.lexsort((head, tail))
    found = coloured(np.searchsorted(tail[order], np.arange(500)), tail[order], head[order])
    assert found.max() == 1 and (found[1:] != found[0]).all()


@pytest.mark.parametrize("boundary", ["free", "disk"])
def test_maps_are_those_of_whole_charts(boundary, monkeypatch):
    V, F = meshes.head(70)
    (whole,) = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(boundary))).maps
    monkeypatch.setattr(schwarz, "LARGE", 1000)
    (swept,) = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(boundary))).maps
    assert not np.array_equal(swept.uv, whole.uv)
    assert swept.folds == 0 and swept.status == "converged"
    assert swept.area_l1 <= 0.008
    assert swept.angle_mean == pytest.approx(whole.angle_mean, rel=0.01)
    assert swept.newton_refinement <= whole.newton_refinement + 3


def test_long_and_narrow_meshes_are_factored_at_once(monkeypatch):
    monkeypatch.setattr(schwarz, "LARGE", 1000)
    for sides, swept in (((400, 5), False), ((150, 150), True)):
        V, F = meshes.bumpy(*sides)
        order = mesh_order(V, F)
        assert (sweeping_solver(V[order], np.argsort(order)[F]) is not None) == swept


def test_elements_of_triangles_need_no_quads():
    V, F = meshes.bumpy(8, 8)
    faces = elements(V, F, face_areas(V, F))
    assembly = assembly_of(faces, len(V), SymmetricSweeps(V, F))
    w = V[:, 0] + 1j * V[:, 1]
    found = assembly.hessian(faces, w, 30.0, 1.0, (np.ones(len(w), complex), np.ones((len(w), 2))))
    assert found.rest is None and found.matrix(np.ones(2 * len(w)), None).plain().shape == (2 * len(w),) * 2


@pytest.mark.parametrize("held", [False, True])
def test_motions_of_both_axes_are_kept_once_where_all_vertices_are_free(held):
    """What they make of unknowns, and the other way round, is the same to the bit."""
    rng, n, parts = np.random.default_rng(0), 300, 7
    w, along = rng.normal(size=(n, 2)) @ [1, 1j], np.tile([1, 1j], (n, 1))
    along[:9] *= not held
    spread = schwarz.affine_motions(rng.permutation(np.arange(n) % parts), parts, w, along)
    motions = sweeps.Motions(spread, not held)
    x, r = rng.normal(size=6 * parts), rng.normal(size=2 * n)
    for own in (slice(0, n), slice(4, 21), slice(7, 7)):
        expected = (spread @ x).reshape(-1, 2)[own]
        np.testing.assert_array_equal(motions.of(x, own), expected)
    np.testing.assert_array_equal(motions.gathered(r), spread.T @ r)


def test_parts_are_made_of_triangles_that_are_held_anyway(monkeypatch):
    whole, swept, w = flattened("free")
    monkeypatch.setattr(sweeps, "MOST", 2)
    swept.assembly.parts.hold(whole.faces.triangles[::-1].copy())
    _, most = newton_direction(whole, w)
    _, slope = newton_direction(swept, w)
    assert slope < 0.9 * most
