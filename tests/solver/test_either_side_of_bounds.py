"""Bounds told in words or documents: each is asked just on either side of its number."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver import errors
from omt_uv.solver.analysis import region_density
from omt_uv.solver.api import steps as api_steps
from omt_uv.solver.contact import proximity
from omt_uv.solver.contact.new_crossings import NewCrossings
from omt_uv.solver.flows import handles as flow_handles
from omt_uv.solver.linalg import multigrid
from omt_uv.solver.linalg.lbfgs import LBFGS
from omt_uv.solver.maps import energy as map_energies
from omt_uv.solver.maps import polygon_elements
from omt_uv.solver.maps.overlap import cover_pairs
from omt_uv.solver.mesh import mirror
from omt_uv.solver.mesh.surface import degenerate_triangles
from omt_uv.solver.parameterization import chart_indices
from omt_uv.solver.parameterization.polygons import polygon_corners
from omt_uv.solver.remeshing.components import component_batch
from omt_uv.solver.remeshing.edits import long_edges
from omt_uv.solver.remeshing.initial import component_maps
from omt_uv.solver.seams.cut_tree import Cut
from omt_uv.solver.sphere import conformal as sphere_conformal
from omt_uv.solver.sphere import symmetry as sphere_symmetry
from omt_uv.solver.strain import figures as strain_figures
from omt_uv.solver.transfer import correspondence

# Just within a bound, and just beyond it.
BOTH = [(0.99, True), (1.01, False)]


@pytest.mark.parametrize(
    ("share", "said"),
    [(0.0099, "less than 1 %"), (0.01, "1 %"), (0.0151, "2 %"), (0.5, "50 %"), (0.0, "less than 1 %")],
)
def test_shares_below_a_hundredth_are_told_as_such(share, said):
    assert errors.percent(share) == said


@pytest.mark.parametrize(("beside", "inside"), [(2e-9, True), (0.9e-9, False), (-1e-9, False)])
def test_points_on_the_border_of_a_face_are_not_inside(beside, inside):
    """Of a triangle as long as the map: the distance from a side of length 1."""
    uv = np.array([[[0.0, 0], [1, 0], [0, 1]]])
    point, triangle = cover_pairs(uv, np.array([[0.3, beside], [0.25, 0.25]]))
    assert sorted(point.tolist()) == ([0, 1] if inside else [1])


@pytest.mark.parametrize(("cycles", "kept"), [(15, True), (16, False)])
def test_a_hierarchy_serves_while_it_takes_half_as_many_cycles_more(cycles, kept, monkeypatch):
    counts, made = iter([10, cycles, 10]), []
    monkeypatch.setattr(multigrid, "Multigrid", lambda A: made.append(A) or "hierarchy")
    monkeypatch.setattr(multigrid, "_by_gradients", lambda A, b, *_: (b, next(counts)))
    solver = multigrid.LaplacianSolver()
    for _ in range(3):
        found = solver.solve("A", np.array([1.0, 3.0]), None, 1e-9)
        assert found.tolist() == [-1, 1]
    assert len(made) == (1 if kept else 2)


@pytest.mark.parametrize("extent", [1.0, 4.0])
def test_components_of_a_batch_lie_three_extents_apart(extent):
    V, F = meshes.icosphere(0)
    V = extent * V / np.ptp(V, axis=0).max()
    component = SimpleNamespace(
        vertices=V, triangles=F, faces=np.arange(len(F)), input_barycentric=np.zeros((len(F), 3, 3)),
        features=np.array([[0, 1]]), to_reopen=np.array([(2 << 32) | 3]),
    )  # fmt: skip
    found = component_batch.batched([component] * 9)
    corner = found.vertices.reshape(9, -1, 3).min(axis=1)
    apart = np.linalg.norm(corner[:, None] - corner[None], axis=2) + 99 * np.eye(9)
    assert apart.min(axis=1) == pytest.approx(np.full(9, 3 * extent)) and len(found.members) == 9
    assert (np.ptp(corner, axis=0) <= 6 * extent + 1e-9).all()
    n, m = len(V), len(F)
    assert found.features.tolist() == [[k * n, k * n + 1] for k in range(9)]
    assert found.to_reopen.tolist() == [((k * n + 2) << 32) | (k * n + 3) for k in range(9)]
    np.testing.assert_allclose(
        found.vertices[found.triangles] - found.shift[:, None], np.tile(V[F], (9, 1, 1)), atol=1e-9
    )
    assert found.faces.tolist() == list(range(m)) * 9


def test_maps_of_a_component_have_no_edges_longer_than_two_and_a_half_of_the_usual(monkeypatch):
    asked = []
    monkeypatch.setattr(long_edges, "split_long_edges", lambda component, longest, most: asked.append((longest, most)))
    long_edges.refine_for_maps(SimpleNamespace(area=np.array([2.0, 3.0]), vertices=np.zeros((7, 3))))
    # A thousand vertices in equilateral triangles: each has two triangles.
    side = np.sqrt(5 / 2000 / (np.sqrt(3) / 4))
    ((longest, most),) = asked
    assert longest == pytest.approx(np.full(7, 2.5 * side), rel=0.01) and most == 4000


@pytest.mark.parametrize(("share", "far"), [(0.049, False), (0.051, True)])
def test_starts_half_a_radius_from_a_symmetric_one_are_of_no_symmetric_surface(share, far, monkeypatch):
    position = np.array([[1.0, 0, 0]])
    angle = 2 * np.arcsin(share * 10 / 2)
    moved = np.array([[np.cos(angle), np.sin(angle), 0]])
    assert np.linalg.norm(moved - position) == pytest.approx(10 * share)
    monkeypatch.setattr(sphere_symmetry, "SphereSymmetry", lambda *_: SimpleNamespace(averaged=lambda p: 3 * moved))
    monkeypatch.setattr(sphere_symmetry, "_plane", lambda *_: np.eye(3)[2])
    found = sphere_symmetry.symmetric_map([np.array([0])], position)
    assert (found is None) == far


@pytest.mark.parametrize(("count", "looked_at"), [(100, 4), (199, 4), (250, 5), (1000, 20)])
def test_of_the_most_magnified_fiftieth_those_with_the_widest_angles_go_to_infinity(count, looked_at, monkeypatch):
    """The estimate says 0 for the first vertex, and less and less for the others; angles are the wider the later."""
    triangles = np.column_stack([np.arange(count)] * 3)
    monkeypatch.setattr(sphere_conformal, "halfedge_lengths", lambda V, F: np.ones(3 * count))
    angle = np.repeat(np.linspace(0.1, 1, count)[:, None], 3, axis=1)
    monkeypatch.setattr(sphere_conformal, "angles_from_lengths", lambda length: angle)
    monkeypatch.setattr(sphere_conformal, "angle_defects", lambda *_: np.zeros(count))
    monkeypatch.setattr(sphere_conformal, "vertex_areas", lambda *_: np.ones(count))
    asked = []

    def laplacian(length, triangles, n, least, most):
        asked.append((least, most))
        from scipy.sparse import identity

        return identity(n, format="csr")

    monkeypatch.setattr(sphere_conformal, "laplacian_from_lengths", laplacian)
    monkeypatch.setattr(sphere_conformal, "solve_spd", lambda A, b: -np.arange(1.0, count))
    found = sphere_conformal.magnified_vertices(np.zeros((count, 3)), triangles)
    assert sorted(found.tolist()) == list(range(looked_at - 4, looked_at)) and found[0] == looked_at - 1
    assert asked[0][1] == 1e3


# ---- shares, densities, energies -------------------------------------------------------------------------------


@pytest.mark.parametrize(("more", "soft"), [(3.98, False), (4.02, True)])
def test_a_border_is_very_soft_where_four_times_the_contrast_of_a_hard_one_is_needed(more, soft, monkeypatch):
    region, area = np.array([1.0, 0.5, 0.0]), np.ones(3)
    before = 0.5
    target = before * 1.5
    hard = target / (1 - target) * (1 - before) / before
    monkeypatch.setattr(region_density, "_contrast", lambda *_: more * hard)
    found = region_density.exact_density(region, area, 1.5)
    assert any("very soft" in text for text in found.warnings) == soft


@pytest.mark.parametrize("factor", [1.6, 1 / 1.6])
def test_how_much_densities_vary_is_said_alike_of_what_grows_and_of_what_shrinks(factor):
    region, area = np.r_[np.linspace(0, 0.72, 50), 1.0], np.r_[np.ones(50), 1e-3]
    found = region_density.exact_density(region, area, factor)
    (text,) = found.warnings
    spread = found.density.max() / found.density.min()
    assert float(text.rsplit(" ", 1)[1]) == pytest.approx(spread, rel=5e-3) and spread > 1


@pytest.mark.parametrize(
    ("spread", "score"), [(2.0, 10 * 2**0.3), (1.0, 10.0), (0.5, 10 * 0.5**0.3), (0.2, 10 * 0.5**0.3)]
)
def test_cuts_of_other_spreads_are_compared_by_what_they_would_cost(spread, score):
    cut = Cut.__new__(Cut)
    object.__setattr__(cut, "cost", 10.0)
    object.__setattr__(cut, "spread", spread)
    assert Cut.score(cut, 1.0) == pytest.approx(score)


@pytest.mark.parametrize(("region", "error"), [((7e-4, 0.0), 0.004), ((0.001, 0.0), 0.0054), ((0.0, 0.02), 0.009),
                                               ((7e-4, 0.005), 0.004)])  # fmt: skip
def test_errors_of_a_region_count_as_so_much_error_of_areas(region, error, monkeypatch):
    monkeypatch.setattr(map_energies, "_region_error", lambda faces, area: region)
    monkeypatch.setattr(map_energies, "_area_error", lambda faces, area: 0.004)
    assert map_energies._target_error(None, None) == pytest.approx(error)


@pytest.mark.parametrize("eagerness", [0.0, 0.4, 1.0])
def test_eager_bends_go_over_into_their_limit(eagerness):
    """(r^2 - 1) / (2 log r) near 1, to the power, over r^3: without cancellation."""
    r = np.array([0.5, 1 - 0.99e-4, 1 - 1e-9, 1.0, 1 + 1e-7, 1 + 0.99e-4, 1 + 1.01e-4, 1.9e-4 + 1, 2.0])
    found = map_energies.eager_bend(r, eagerness)
    log = np.log(r)
    # sinh(x) / x e^x, as a series where that is small.
    series = np.exp(log) * np.where(np.abs(log) < 1e-2, 1 + log**2 / 6, np.sinh(log) / np.where(log == 0, 1, log))
    np.testing.assert_allclose(found, series**eagerness / r**3, rtol=1e-8)
    # The limit is taken closer by than where it would be seen.
    if eagerness:
        far = np.abs(found / (series**eagerness / r**3) - 1)
        assert far[-2] < 1e-11


@pytest.mark.parametrize(("share", "touch"), [(0.99e-3, True), (1.01e-3, False)])
@pytest.mark.parametrize(("apart", "differ"), [(0.99e-3, False), (1.01e-3, True)])
def test_handles_at_one_place_go_the_same_way(share, touch, apart, differ):
    radius = 0.25
    first = flow_handles.FlowHandle(np.zeros((1, 2)), np.array([[1.0, 0]]), None, "a")
    start = np.array([[share * radius, 0.0]])
    second = flow_handles.FlowHandle(start, start + [1.0, apart * radius], None, "b")
    if touch and differ:
        with pytest.raises(errors.HandleError, match="a and b"):
            flow_handles.joined((first, second), radius)
        return
    begin, end, owner = flow_handles.joined((first, second), radius)
    # What is one place, and goes one way, is there once.
    assert len(begin) == len(end) == 2 - touch and owner.tolist() == [0, 1][: 2 - touch]


# ---- meshes ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize(("height", "line"), [(1.9e-10, True), (2.1e-10, False)])
def test_triangles_whose_area_is_next_to_nothing_are_lines(scale, height, line):
    V = scale * np.array([[0.0, 0, 0], [1, 0, 0], [0.5, height, 0], [0, 1, 0]])
    F = np.array([[0, 1, 2], [0, 1, 3]])
    assert degenerate_triangles(V, F).tolist() == [line, False]
    # Next to those of the same owner alone.
    small = np.concatenate([V, 1e-8 * V])
    every = np.concatenate([F[1:], F[1:] + 4])
    assert degenerate_triangles(small, every).tolist() == [False, False]
    tiny = np.concatenate([V, 0.99e-9 * V])
    assert degenerate_triangles(tiny, every).tolist() == [False, True]
    assert degenerate_triangles(tiny, every, owner=np.array([0, 1])).tolist() == [False, False]


@pytest.mark.parametrize(("own", "few"), [(20, True), (21, False)])
def test_few_polygons_are_their_own_images(own, few, monkeypatch):
    """Of a hundred polygons."""
    asked = []

    class Polygons:
        points, middle, number = np.zeros((4, 3)), 0.0, np.zeros(4, int)

        def __init__(self, *_):
            pass

        def images_of_polygons(self, normal):
            other = np.arange(100)
            other[own:] = np.roll(other[own:], 1)
            return other

        def images_of_corners(self, other, normal, apart):
            asked.append(int(apart.sum()))
            return np.arange(4)

    monkeypatch.setattr(mirror, "_boxed", lambda positions: (positions, 0.0, 1.0))
    monkeypatch.setattr(mirror, "_Polygons", Polygons)
    Polygons.centres = np.zeros((100, 3))
    monkeypatch.setattr(mirror, "_candidates", lambda *_: iter([np.eye(3)[0]]))
    found = mirror.partial_mirror(np.zeros((4, 3)), np.array([[0, 1, 2]]), np.array([0]))
    assert (found is not None) == few and asked == [100 - own] * few


@pytest.mark.parametrize(("sine", "parallel"), [(0.9e-6, True), (1.1e-6, False)])
def test_edges_with_next_to_no_angle_between_them_are_parallel(sine, parallel):
    """Of two edges that cross after a tenth of the first, if they are not parallel."""
    u, v = np.array([[1.0, 0, 0]]), np.array([[np.cos(sine), sine, 0]])
    a, c = np.zeros((1, 3)), 0.1 * u - 0.3 * v
    one, other = proximity._along(a, a + u, c, c + v)
    # At the middle of the first, or where they cross.
    assert one[0] == pytest.approx(0.5 if parallel else 0.1, abs=0.02)
    assert other[0] == pytest.approx(0.7 if parallel else 0.3, abs=0.02)


@pytest.mark.parametrize(("apart", "touched"), [(0.9e-9, True), (1.1e-9, False)])
def test_faces_that_touched_before_are_not_new_crossings(apart, touched):
    V = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4 * apart * np.sqrt(2)], [1, 0, 1], [0, 1, 1]])
    F = np.array([[0, 1, 2], [3, 4, 5]])
    own = NewCrossings.__new__(NewCrossings)
    own.before, own.faces = V, SimpleNamespace(triangles=F)
    assert len(own.apart(np.array([[0, 1]]))) == (not touched)
    assert len(own.apart(np.zeros((0, 2), int))) == 0


@pytest.mark.parametrize(("product", "kept"), [(0.9e-12, False), (1.1e-12, True), (-1.0, False)])
def test_steps_along_which_the_gradient_hardly_changes_are_forgotten(product, kept):
    memory = LBFGS()
    memory.direction(np.zeros((1, 3)), np.zeros((1, 3)), np.ones((1, 1)))
    sine = np.sqrt(1 - min(product**2, 1))
    memory.direction(np.array([[1.0, 0, 0]]), np.array([[product, sine, 0]]), np.ones((1, 1)))
    assert len(memory.pairs) == kept


@pytest.mark.parametrize("sides", [4, 5, 8, 20, 60])
def test_corners_of_polygons_with_many_sides_are_straight_below_less(sides):
    regular = 4 * np.sin(np.pi / sides) ** 2 / sides
    # Of the square of its radius: what a corner of a regular polygon has of its polygon's area.
    angle = 2 * np.pi * np.arange(sides) / sides
    z = np.exp(1j * angle)
    whole = sides / 2 * np.sin(2 * np.pi / sides)
    ear = 0.5 * ((z[1] - z[0]).conj() * (z[2] - z[0])).imag
    assert regular == pytest.approx(ear / whole)
    assert polygon_corners.straight_share(np.array([sides]))[0] == pytest.approx(min(0.02, 0.3 * regular))


@pytest.mark.parametrize(("dent", "convex"), [(0.031, True), (0.029, False)])
def test_quads_are_convex_where_each_of_their_triangles_has_a_thirtieth(dent, convex):
    """A square whose third corner lies on the line between its neighbours, but for a share of the whole."""
    # Triangles 1 2 3 has t, and 0 1 3 the rest.
    corner = 0.5 + dent / (1 - dent) / 2
    V = np.array([[0.0, 0, 0], [1, 0, 0], [corner, corner, 0], [0, 1, 0]])
    whole = 0.5 + (2 * corner - 1) / 2
    assert (whole - 0.5) / whole == pytest.approx(dent)
    assert polygon_elements._convex(V, np.array([[0, 1, 2, 3]])).tolist() == [convex]


@pytest.mark.parametrize(("more", "mirrored"), [(0.9e-4, False), (1.1e-4, True)])
def test_a_start_is_mirrored_where_that_comes_nearer_to_the_pins(more, mirrored, monkeypatch):
    """Pins at 0, 1 and 2 are 2 away from their middle in all."""
    places = np.array([[0.0, 0], [1, 0], [2, 0]])
    pins = SimpleNamespace(vertices=np.arange(3), places=places)
    misses = iter([1.0 + 2 * more, 1.0])
    monkeypatch.setattr(
        chart_indices, "aligned_to_pins", lambda w, pinned: pinned.places + np.array([next(misses), 0, 0])
    )
    uv, given = chart_indices.mirrored_to_pins(np.array([[0.0, 1], [1, 1], [2, 1]]), pins)
    assert uv[:, 1].tolist() == [-1.0 if mirrored else 1.0] * 3 and given == (pins.vertices, places)
    few = SimpleNamespace(vertices=np.arange(2), places=places[:2])
    assert chart_indices.mirrored_to_pins(uv, few) == (uv, None) and chart_indices.mirrored_to_pins(uv, None)[1] is None


@pytest.mark.parametrize(("far", "away"), [(1.51, True), (1.49, False)])
def test_points_are_away_from_seams_at_one_and_a_half_distances(far, away, monkeypatch):
    monkeypatch.setattr(correspondence, "cut_open", lambda *_: "open")
    asked = []
    near = [np.array([[0.0, 0, 0]])]
    monkeypatch.setattr(correspondence, "seam_points", lambda mesh, spacing: asked.append(spacing) or (near[0], None))
    mesh, seams = SimpleNamespace(positions=None, triangles=None), np.array([[0, 1]])
    found = correspondence._away_from(mesh, seams, np.array([[2.0 * far, 0, 0]]), 2.0)
    assert found.tolist() == [away] and asked == [1.0]
    near[0] = np.zeros((0, 3))
    assert correspondence._away_from(mesh, seams, np.zeros((2, 3)), 2.0).tolist() == [True, True]
    assert correspondence._away_from(mesh, seams[:0], np.zeros((2, 3)), 2.0).tolist() == [True, True]


def test_islands_laid_side_by_side_have_room_between_them():
    """Four squares of side 1 fill a square of side 2, and the gap is a hundredth of that."""
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    uv = np.concatenate([square + 7 * k for k in range(4)])
    found = api_steps._side_by_side(uv, [np.arange(4) + 4 * k for k in range(4)])
    low = found.reshape(4, 4, 2).min(axis=1)
    assert low == pytest.approx(np.array([[0, 0], [0, 1.02], [0, 2.04], [0, 3.06]])) or low == pytest.approx(
        np.array([[0, 0], [1.02, 0], [0, 1.02], [1.02, 1.02]])
    )
    wide = np.concatenate([square * [3, 1], square * [1, 2] + 9])
    found = api_steps._side_by_side(wide, [np.arange(4), np.arange(4, 8)])
    # The higher one first; what is wider than the row begins a new one.
    gap = 0.01 * np.sqrt(5)
    assert found[4:].min(axis=0).tolist() == [0, 0] and found[:4].min(axis=0) == pytest.approx([0, 2 + gap])


def test_ratios_are_the_greater_over_the_lesser_up_to_a_bound_and_one_of_nothing():
    a, b = np.array([2.0, 1, 0, 0, 1e9, 3]), np.array([1.0, 2, 0, 1, 1, 3])
    most = 5.0
    assert strain_figures._ratio(a, b).tolist() == [min(2, most), min(2, most), 1, most, most, 1]


@pytest.mark.parametrize(
    ("small", "lines", "kinds"),
    [
        ([1, 1, 0, 0], [0, 0, 0, 0], [[0, 1]]),
        ([1, 0, 0, 0], [0, 0, 0, 0], []),
        ([1, 1, 0, 0], [0, 1, 0, 0], []),
        ([1, 1, 1, 1], [0, 1, 0, 1], [[0, 2], [1, 3]]),
        ([1, 1, 1, 0], [0, 1, 0, 1], [[0, 2]]),
    ],
)
def test_small_components_are_mapped_together_with_those_that_have_lines_or_have_none(small, lines, kinds, monkeypatch):
    made = []
    monkeypatch.setattr(component_maps, "batched", lambda components: [c.name for c in components])
    monkeypatch.setattr(component_maps, "refine_for_maps", lambda batch: batch)
    monkeypatch.setattr(component_maps, "ComponentMaps", lambda batch: made.append(batch) or ("batch", *batch))
    components = [SimpleNamespace(name=k, has_lines=bool(line)) for k, line in enumerate(lines)]
    own = SimpleNamespace(components=SimpleNamespace(components=components), maps=list("abcd"), _batches={})
    class_ = next(c for c in vars(component_maps).values() if hasattr(c, "maps_with_batches"))
    for _ in range(2):
        found = class_.maps_with_batches(own, np.array(small, bool))
        alone = [m for k, m in enumerate("abcd") if not any(k in kind for kind in kinds)]
        assert found == [*alone, *(("batch", *kind) for kind in kinds)]
    # What is known is not made again.
    assert made == kinds
