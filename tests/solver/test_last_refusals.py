"""Refusals that no mesh is known for: each is asked with what would have to be refused, and with a neighbour of it."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from scripted_steps import done, told

from omt_uv.solver import errors
from omt_uv.solver.analysis import joint_density, region_density
from omt_uv.solver.conformal import disk_map, punctured_sphere
from omt_uv.solver.editing import refine_island
from omt_uv.solver.flows import integration, kernel
from omt_uv.solver.linalg.sparse import Factor
from omt_uv.solver.linalg.vertex_rows import RowPattern, VertexRows
from omt_uv.solver.mesh import charts
from omt_uv.solver.partition import cells as partition_cells
from omt_uv.solver.refinement import projected_newton
from omt_uv.solver.registration.surface_newton import Deformation
from omt_uv.solver.remeshing.edits import vertex_count
from omt_uv.solver.seams import predicted_scale
from omt_uv.solver.sphere import coarsen
from omt_uv.solver.sphere import conformal as sphere_conformal
from omt_uv.solver.volumes import envelope, meshing

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
OUTWARDS = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@pytest.mark.parametrize("value", [0.0, -1.0, 1.0])
def test_blocks_of_vertices_are_inverted_where_they_are_positive(value):
    pattern = RowPattern([np.array([[0, 1, 2]]), np.zeros((0, 4), np.int64)], 3)
    rows = VertexRows(pattern, VertexRows.summed(pattern, []))
    rows.add_diagonal(np.array([1.0, 1.0, 1.0, value, 1.0, 1.0]))
    if value > 0:
        assert [x.tolist() for x in rows.inverse(slice(0, 3))] == [[1] * 3, [0] * 3, [1] * 3]
    else:
        with pytest.raises(errors.PrecisionError, match="A linear system is singular in double"):
            rows.inverse(slice(0, 3))


def test_equations_that_stay_singular_are_shifted_until_the_shift_is_that_of_their_size():
    tried = []

    class Parts:
        def solve(self, matrix, b, w, axes):
            tried.append(float(matrix.diagonal()[0]) - 1)
            if len(tried) > 99:
                raise RuntimeError("this goes on forever")
            raise errors.PrecisionError("singular")

    with pytest.raises(errors.PrecisionError, match="Cut the chart into less elongated pieces with"):
        projected_newton._solution(sp.identity(2).tocsc(), np.ones(2), 2.0, Parts(), None, None, None)
    # Each shift is that much larger than the one before, and added to it.
    shifts = np.diff(tried) / 2
    growth = 1e3
    first = 1e-10 * growth
    assert shifts == pytest.approx(first * growth ** np.arange(len(shifts)), rel=1e-3)
    assert shifts[-1] > 1 >= shifts[-2]


def test_only_a_surface_has_features_and_a_domain_beside_it():
    with pytest.raises(ValueError, match="only on a surface"):
        Deformation.surface.fget(SimpleNamespace(carrier=object()))


@pytest.mark.parametrize("shared", [True, False])
def test_two_edges_of_a_chart_have_no_two_vertices_in_common(shared):
    disk = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4] if shared else [1, 2, 4]])
    chart = SimpleNamespace(disk=disk, vertex_ids=np.arange(5) + 10)
    if not shared:
        assert charts.check_edges(chart) is None
        return
    with pytest.raises(errors.NonManifoldEdgeError) as caught:
        charts.check_edges(chart)
    assert caught.value.kind == "edge" and np.sort(caught.value.elements).tolist() == [[10, 11]]


@pytest.mark.parametrize(("entry", "value", "fits"), [(1e-300, 1e9, False), (1e-300, 1.0, True), (1.0, np.nan, False)])
def test_solutions_that_are_not_finite_are_none(entry, value, fits):
    factor = Factor(sp.csc_matrix(np.diag([1.0, entry])))
    if fits:
        assert factor.solve(np.array([2.0, value])).tolist() == [2.0, value / entry]
    else:
        with pytest.raises(errors.PrecisionError, match="A linear system is singular in double"):
            factor.solve(np.array([2.0, value]))


@pytest.mark.parametrize(("balance", "fits"), [(-1e-9, False), (0.0, True), (1.0, True), (1 + 1e-9, False)])
def test_balance_lies_between_nothing_and_all(balance, fits):
    steps = refine_island.refine_island(CORNERS, OUTWARDS[:1], CORNERS[:, :2], balance=balance)
    if fits:
        assert next(steps).fraction == 0
        steps.close()
    else:
        with pytest.raises(ValueError, match="balance"):
            next(steps)


@pytest.mark.parametrize(("beside", "fits"), [(0.5, True), (1.0, True), (1.1, False), (3.0, False)])
def test_inverses_are_those_of_matrices_that_are_positive_or_all_but(beside, fits):
    """Of [[1, b], [b, 1]]: at b = 1 a little is added to the diagonal."""
    matrix = sp.csr_matrix(np.array([[1.0, beside], [beside, 1.0]]))
    free = np.array([2, 0])
    if not fits:
        with pytest.raises(errors.PrecisionError, match="The matrix of a coarse surface is singular in"):
            predicted_scale._inverse(matrix, free, 3)
        return
    found = predicted_scale._inverse(matrix, free, 3)
    own = 1 + 1e-9 * (beside == 1)
    expected = np.linalg.inv([[own, beside], [beside, own]])
    assert not found[1].any() and not found[:, 1].any()
    np.testing.assert_allclose(found[np.ix_(free, free)], expected, rtol=1e-3 if beside == 1 else 1e-12)
    assert not predicted_scale._inverse(matrix, np.zeros(0, int), 3).any()


def test_a_mesh_of_which_nothing_can_go_is_refused(monkeypatch):
    none = np.zeros(0, np.int64)
    monkeypatch.setattr(coarsen, "_choose", lambda *_: (none, none))
    with pytest.raises(errors.CoarseningError, match="The mesh cannot be made coarser"):
        coarsen._level(np.zeros((9, 3)), OUTWARDS, np.ones(4), None)


@pytest.mark.parametrize(("height", "folds"), [(1.0, 0), (0.0, 1), (-1.0, 1)])
def test_a_conformal_map_with_faces_too_small_is_refused(height, folds, monkeypatch):
    """Straightening is tried where something is folded."""
    places = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, height], [-1, -1, -1]])
    calls = []

    def untangle(vertices, triangles, sites):
        calls.append(sites)
        return done(sites)

    monkeypatch.setattr(sphere_conformal, "untangle_locally", untangle)
    flat = SimpleNamespace(triangulation=SimpleNamespace(triangles=OUTWARDS), residual=0.0, iterations=1, flips=0)
    found = SimpleNamespace(sites=places, flat=flat, infinite=0)
    steps = sphere_conformal.straightened(places, np.array([[0, 1, 2]]), found)
    if folds:
        with pytest.raises(errors.PrecisionError, match="Faces of the conformal map are too small for"):
            told(steps)
    else:
        assert told(steps)[0].positions is places
    assert len(calls) == folds


# ---- densities -----------------------------------------------------------------------------------------------


def test_shares_that_no_density_gives_are_refused():
    region, area = np.array([0.2, 0.8]), np.ones(2)
    # Between 0.2 and 0.8, whatever is denser.
    for target in (0.25, 0.5, 0.75):
        contrast = region_density._contrast(region, area, target)
        power = contrast**region
        assert (region @ power) / power.sum() == pytest.approx(target)
    with pytest.raises(errors.ShareError, match="No density gives the region this share"):
        region_density._contrast(region, area, 0.9)


@pytest.mark.parametrize(("beyond", "fits"), [(0.999, True), (1.001, False)])
def test_densities_vary_by_no_more_than_a_bound(beyond, fits, monkeypatch):
    regions, area = np.array([[1.0, 0.0, 0.0]]), np.array([1.0, 1, 8])
    tilt = np.log(beyond * joint_density.CONTRAST)
    monkeypatch.setattr(joint_density, "_tilts", lambda *_: np.array([tilt]))
    if fits:
        found = joint_density.joint_density(regions, area, [2.0])
        assert found.contrast == pytest.approx(beyond * joint_density.CONTRAST)
        assert np.log(found.density[0] / found.density[1]) == pytest.approx(tilt)
    else:
        with pytest.raises(errors.ShareError, match="densities would vary"):
            joint_density.joint_density(regions, area, [2.0])


# ---- conformal maps ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("factor", "fits"), [(1.01, True), (0.99, False)])
def test_neighbours_in_a_conformal_map_lie_apart(factor, fits):
    near = factor * 1e-12
    uv = np.array([[0.0, 0], [1, 0], [near, 0]])
    if fits:
        assert disk_map._check_resolution(uv, np.array([[0, 1, 2]])) is None
    else:
        with pytest.raises(errors.PrecisionError, match="neighbouring vertices"):
            disk_map._check_resolution(uv, np.array([[0, 1, 2]]))


@pytest.mark.parametrize(("steps", "fits"), [(0, True), (3, True), (59, True),
                                             (60, False), (None, False)])  # fmt: skip
def test_flat_polygons_are_found_in_so_many_steps_or_not(steps, fits, monkeypatch):
    class Metric:
        def __init__(self, tri, puncture, k=0):
            self.k, self.pinched = k, steps is None
            self.gradient = np.array([0.0 if k == steps else max(0.5**k, 1e-3)])

        def step(self):
            return Metric(None, 0, self.k + 1)

        def polygon(self, residual, iteration):
            return residual, iteration

    monkeypatch.setattr(punctured_sphere, "_PuncturedMetric", Metric)
    run = punctured_sphere.flatten_punctured_sphere(None, 0)
    if fits:
        found, fractions = told(run)
        assert found == (0.0, steps) and (np.diff(fractions) >= 0).all() and fractions[-1] == 1
    else:
        with pytest.raises(errors.PrecisionError, match="too narrow" if steps is None else "did not converge"):
            told(run)


def test_a_step_that_leads_nowhere_is_halved_and_refused():
    tried = []

    class Stuck(punctured_sphere._PuncturedMetric):
        def __init__(self, *_):
            self.u, self.free, self.tri, self.puncture, self.flips = np.zeros(3), np.ones(3, bool), None, 0, 0
            self.gradient = np.ones(3)

        def _newton_direction(self):
            direction = np.array([40.0, 0.0, 0.0])
            tried.append(direction)
            return 2.0**15 * direction

    with pytest.raises(errors.PrecisionError, match="stuck"):
        Stuck().step()
    assert len(tried) == 1


# ---- flows, cells, counts ------------------------------------------------------------------------------------


def test_flows_that_tear_are_refused(monkeypatch):
    """Probes that go elsewhere however short a step is."""

    class Torn:
        def __init__(self, h, fields):
            self.h = h

        def __call__(self, probes):
            return probes + (1.0 if self.h > 0 and len(probes) else 0.0) * np.sign(probes) / self.h

    monkeypatch.setattr(integration, "FlowStep", Torn)
    with pytest.raises(errors.HandleError, match="tear"):
        integration.planned_steps(lambda j, t: None, np.array([0.0, 1.0]), np.ones((2, 2)), 1e-3)


def test_conditions_that_contradict_each_other_are_refused(monkeypatch):
    given = kernel.Conditions(np.array([[0.0, 0], [1, 0]]), np.array([0, 1]), np.array([[1.0, 0], [1, 0]]))
    assert kernel.interpolated_field(given, np.array([1.0, 1.0]), 1.0) is not None
    monkeypatch.setattr(kernel, "kernel_matrix", lambda given, sharpness: -np.eye(2))
    with pytest.raises(errors.HandleError, match="too close"):
        kernel.interpolated_field(given, np.array([1.0, 1.0]), 1.0)


@pytest.mark.parametrize("rounds", [0, 1, 3, 99])
def test_windows_grow_where_cells_come_to_their_ends(rounds, monkeypatch):
    """Cells of the sites 0 and 2 come to the end of their windows in the first rounds."""
    asked = []

    def cells_of(k):
        part = np.array([1.0, 1, 1, 0])
        return SimpleNamespace(pair=np.arange(4), part=part if k < rounds else np.where([0, 1, 0, 1], part, 0))

    class Pairs:
        site, last = np.array([0, 1, 2, 3]), np.array([True, False, True, True])

        def joined(self, grown, short):
            return self

    def polar(mesh, sites, radius, short):
        asked.append((radius.tolist(), short.tolist()))

    monkeypatch.setattr(partition_cells, "polar_coordinates", polar)
    monkeypatch.setattr(partition_cells, "geodesic_cells", lambda pairs, weights, mass: cells_of(len(asked)))
    problem = SimpleNamespace(mesh=None, mass=None, part=None, asked=None)
    dual = partition_cells.GeodesicDual(problem, None, Pairs(), np.array([1.0, 2, 3, 4]))
    if rounds > 60:
        with pytest.raises(errors.TransportError, match="The cells reach beyond every window"):
            dual._within_windows(None, cells_of(0))
        return
    dual._within_windows(None, cells_of(0))
    assert dual.diagrams == len(asked) == rounds
    for k, (radius, short) in enumerate(asked, 1):
        growth = 1.5**k
        assert short == [0, 2] and radius == [1 * growth, 3 * growth]


@pytest.mark.parametrize("folds", [True, False])
def test_a_count_that_is_not_reached_is_refused_with_the_mesh_as_it_is(folds, monkeypatch):
    calls = []

    def collapse(mesh, h, length, surplus, cosine):
        calls.append((surplus, cosine))
        if cosine == vertex_count.MIN_COSINE:
            raise vertex_count.StuckError(mesh)
        return mesh

    mesh = SimpleNamespace(points=CORNERS, triangles=OUTWARDS, locked=np.zeros(0, np.int64), twin=None)
    monkeypatch.setattr(vertex_count, "_collapse", collapse)
    monkeypatch.setattr(vertex_count, "interior_edges", lambda *_: np.arange(3))
    with pytest.raises(vertex_count.StuckError):
        vertex_count.reach_vertex_count(mesh, 3, lambda points: np.ones(len(points)), folds)
    each = [(1, vertex_count.MIN_COSINE)] + [(1, vertex_count.ANY_COSINE)] * folds
    assert calls == each * (500 if folds else 1)
    assert vertex_count.reach_vertex_count(mesh, 4, None) is mesh


# ---- tetrahedra ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fault", [None, "moved", "fewer", "flat"])
def test_tetrahedra_keep_the_surface_and_have_volume(fault, monkeypatch):
    tets = np.array([[0, 1, 2, 3], [0, 1, 2, 3]])

    def tetgen(points, triangles, most):
        points = points.copy()
        if fault == "moved":
            points[0, 0] += 2e-12
        return (points[:3] if fault == "fewer" else points), tets

    monkeypatch.setattr(meshing, "_tetgen", tetgen)
    monkeypatch.setattr(meshing, "without_chords", lambda points, tets, triangles: (points, tets))
    if fault == "flat":
        monkeypatch.setattr(meshing, "turned_right", lambda points, tets: tets[:, [0, 1, 2, 2]])
    if fault is None:
        found = meshing.tetrahedra(5 + 3 * CORNERS, OUTWARDS, 2)
        np.testing.assert_array_equal(found.points, 5 + 3 * CORNERS)
        assert len(found.tets) == 2
    else:
        words = "2 of 2 tetrahedra have no volume" if fault == "flat" else "moved"
        with pytest.raises(errors.TetrahedraError, match=words):
            meshing.tetrahedra(5 + 3 * CORNERS, OUTWARDS, 2)


def test_fewer_tetrahedra_are_asked_for_until_there_are_about_as_many(monkeypatch):
    sizes, asked = iter([50, 84, 86, 99]), []

    def tetgen(points, triangles, most):
        asked.append(most)
        return points, np.tile([0, 1, 2, 3], (next(sizes), 1))

    monkeypatch.setattr(meshing, "_tetgen", tetgen)
    monkeypatch.setattr(meshing, "without_chords", lambda points, tets, triangles: (points, tets))
    assert len(meshing.tetrahedra(CORNERS, OUTWARDS, 100).tets) == 86
    first = 1.8 * 4 * (1 / 6) / 100
    assert asked == pytest.approx([first, first * 0.5, first * 0.5 * 0.84])


@pytest.mark.parametrize("library", ["tetgen", "pytetwild"])
@pytest.mark.parametrize("fault", ["missing", "fails", "fails without a word", None])
def test_libraries_of_tetrahedra_are_named_where_they_are_missing_or_fail(library, fault, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    given = {}

    def made(*mesh, **options):
        given.update(options)
        (tmp_path / envelope.TRACKED).write_text("")
        if fault in ("fails", "fails without a word"):
            raise RuntimeError("one line\nit is open \n" if fault == "fails" else " ")
        return CORNERS, np.array([[0, 1, 2, 3], [1, 0, 2, 3], [0, 1, 2, 2]])

    class TetGen:
        def __init__(self, points, triangles):
            assert triangles.dtype == np.int32 and points.dtype == float

        tetrahedralize = staticmethod(made)

    module = SimpleNamespace(TetGen=TetGen, tetrahedralize=made)
    monkeypatch.setitem(sys.modules, library, None if fault == "missing" else module)
    call = meshing._tetgen if library == "tetgen" else envelope._tetwild
    if fault is None:
        points, tets = call(CORNERS, OUTWARDS, 0.25)
        assert points.tolist() == CORNERS.tolist()
        assert len(tets) == (3 if library == "tetgen" else 1)
        assert given["maxvolume" if library == "tetgen" else "edge_length_abs"] == 0.25
    else:
        kind = errors.LibraryError if fault == "missing" else errors.TetrahedraError
        words = {"missing": "not installed", "fails": "it is open", "fails without a word": "failed"}[fault]
        with pytest.raises(kind, match=words):
            call(CORNERS, OUTWARDS, 0.25)
    # What was left in the folder is removed, and what was there before is not.
    if library == "pytetwild":
        assert not list(tmp_path.iterdir())
        (tmp_path / envelope.TRACKED).write_text("mine")
        if fault is None:
            call(CORNERS, OUTWARDS, 0.25)
            assert list(tmp_path.iterdir())
