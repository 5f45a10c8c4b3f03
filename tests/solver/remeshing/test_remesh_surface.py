"""Remeshing: as many vertices as asked for, the topology of the input, and good triangles on its surface."""

from __future__ import annotations

import re

import meshes
import numpy as np
import pytest
from mesh_checks import angles, topology

from omt_uv.solver.analysis.feature_edges import region_borders
from omt_uv.solver.errors import (
    MERGING,
    CountError,
    DensityError,
    EmptyMeshError,
    NonFiniteError,
    OrientationError,
    PrecisionError,
)
from omt_uv.solver.mesh.cut_mesh import cut_open
from omt_uv.solver.mesh.geometry import face_areas, halfedge_lengths, vertex_areas
from omt_uv.solver.mesh.topology import boundary_loops, halfedges, pair_keys, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import STRATEGIES, RemeshOptions, RemeshSource, remesh
from omt_uv.solver.remeshing.components.coincident_boundaries import reopened
from omt_uv.solver.remeshing.components.components import split_components
from omt_uv.solver.remeshing.edits.long_edges import refine_for_maps
from omt_uv.solver.remeshing.initial import component_maps
from omt_uv.solver.remeshing.initial.component_maps import ComponentMaps
from omt_uv.solver.remeshing.initial.sphere_samples import sample_sphere
from omt_uv.solver.remeshing.relaxation.voronoi_cells import voronoi_cells
from omt_uv.solver.remeshing.remesh_surface import summed_up

CASES = {
    "disk": lambda: meshes.bumpy(24, 24),
    "sphere": lambda: meshes.icosphere(3),
    "torus": lambda: meshes.torus(),
    "annulus": lambda: meshes.annulus(),
    "cube": lambda: meshes.cube(),
}


def run(V, F, count, density=None, features=None, source=None, **options):
    return drain(remesh(source or RemeshSource(V, F, features), count, RemeshOptions(**options), density))


@pytest.mark.parametrize("name", CASES)
def test_topology_and_count_are_exact(name):
    V, F = CASES[name]()
    result = run(V, F, 300, rounds=20)
    assert len(result.vertices) == 300
    assert topology(result.triangles) == topology(F)
    assert result.triangles.max() == 299


@pytest.mark.parametrize("name", ["disk", "sphere", "torus"])
def test_triangles_are_nearly_equilateral(name):
    V, F = CASES[name]()
    result = run(V, F, 400)
    assert np.percentile(angles(result.vertices, result.triangles).min(axis=1), 1) > 36


def test_cuts_between_boundaries_leave_no_trace():
    """A pipe falls into a chart with a cut from end to end; edges along it must flip like any other."""
    V, F = meshes.grid(32, 48)
    P = np.concatenate([np.cos(V[:, :1] * 2 * np.pi), 6 * V[:, 1:2], -np.sin(V[:, :1] * 2 * np.pi)], axis=1)
    number = np.arange(len(P)).reshape(49, 33)
    number[:, 32] = number[:, 0]
    result = run(P, number.ravel()[F], 800)
    assert topology(result.triangles) == (0, 2)
    assert angles(result.vertices, result.triangles).min() > 30


def open_pipe():
    """A rectangle rolled up until two sides of it touch, which stay apart."""
    V, F = meshes.grid(24, 36)
    P = np.concatenate([np.cos(V[:, :1] * 2 * np.pi), 6 * V[:, 1:2], -np.sin(V[:, :1] * 2 * np.pi)], axis=1)
    number = np.arange(len(P)).reshape(37, 25)
    P[number[:, 24]] = P[number[:, 0]]
    return P, F


def along_the_equator(half):
    """A sphere cut open along the equator, or half of it."""
    V, F = meshes.icosphere(3)
    V = V + 1e-3 * V[:, [1, 2, 0]]
    above = V[F].mean(axis=1)[:, 2] > 0
    tail, head = halfedges(F)
    twin = twins(F)
    across = above[np.arange(len(tail)) // 3] & ~above[twin // 3]
    if half:
        across &= (V[tail, 0] > 0) & (V[head, 0] > 0)
    return reopened(V, F, np.sort(pair_keys(tail[across], head[across])))


@pytest.mark.parametrize(
    "make, alone", [(open_pipe, None), (lambda: along_the_equator(False), 0), (lambda: along_the_equator(True), 2)]
)
def test_both_sides_of_a_cut_stay_on_one_another(make, alone):
    V, F = make()
    result = run(V, F, 500, rounds=10)
    assert len(result.vertices) == 500 and topology(result.triangles) == topology(F)
    assert any(MERGING in text for text in result.warnings)
    boundary = result.vertices[np.concatenate(boundary_loops(result.triangles))]
    if alone is None:
        boundary = boundary[(boundary[:, 1] > 1e-6) & (boundary[:, 1] < 6 - 1e-6)]
        alone = 0
    count = np.unique(boundary, axis=0, return_counts=True)[1]
    assert len(boundary) > 30 and count.max() == 2 and (count == 1).sum() == alone


@pytest.mark.parametrize("count_of", ["vertices", "faces"])
@pytest.mark.parametrize("seed", [0, 9, 11])
def test_counts_are_exact_where_a_rough_cut_keeps_more_vertices_than_were_planned(seed, count_of):
    rng = np.random.default_rng(seed)
    V, F = meshes.grid(15, 15)
    V[:, 2] = 0.5 * rng.standard_normal(len(V))
    part = V[F, 0].mean(axis=1) + 0.3 * rng.random(len(F)) > 0.6
    sides = cut_open(V, F, region_borders(F, part)).sides
    W = np.zeros((sides.max() + 1, 3))
    W[sides] = V[F]
    for count in (180, 220):
        # An odd number of faces is kept, too.
        count = count if count_of == "vertices" else 2 * count + 1
        found = drain(remesh(RemeshSource(W, sides), count, RemeshOptions(count_of=count_of)))
        assert len(getattr(found, "triangles" if count_of == "faces" else "vertices")) == count


def test_points_of_the_input_under_the_new_vertices():
    V, F = meshes.bumpy(24, 24)
    result = run(V, F, 300, rounds=20, fit=False)
    foot = np.einsum("kc,kcj->kj", result.barycentric, V[F[result.faces]])
    assert np.abs(foot - result.vertices).max() < 1e-9
    assert (result.barycentric >= 0).all()


@pytest.mark.parametrize("count", [399, 400])
def test_faces_are_counted_exactly(count):
    V, F = meshes.bumpy(24, 24)
    result = run(V, F, count, count_of="faces", rounds=10)
    assert len(result.triangles) == count


def test_the_same_twice():
    V, F = meshes.icosphere(3)
    a, b = (run(V, F, 200, rounds=10) for _ in range(2))
    assert (a.vertices == b.vertices).all() and (a.triangles == b.triangles).all()


def test_scale_and_place_do_not_matter():
    V, F = meshes.bumpy(24, 24)
    a, b = run(V, F, 200, rounds=10), run(1000 * V + [5e4, 0, 0], F, 200, rounds=10)
    assert np.abs(angles(a.vertices, a.triangles).mean(axis=0) - angles(b.vertices, b.triangles).mean(axis=0)).max() < 1


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_strategies_make_meshes(strategy):
    V, F = meshes.bumpy(24, 24)
    result = run(V, F, 300, strategy=strategy, rounds=0)
    assert len(result.vertices) == 300 and topology(result.triangles) == (1, 1)


@pytest.mark.parametrize("name", ["bump", "lion"])
def test_sampling_by_measure_and_triangles_by_angles_make_the_best_meshes(name):
    """B. Gu 2018, figure 5: of the four pairs of maps this one has the best angles, the most even edges and areas."""
    V, F = meshes.bumpy(32, 32, height=1.0) if name == "bump" else meshes.load_model(name)
    count = 600 if name == "bump" else 1200
    source, angle, edge, area = RemeshSource(V, F), {}, {}, {}
    for strategy in STRATEGIES:
        result = run(V, F, count, strategy=strategy, source=source)
        W, G = result.vertices, result.triangles
        assert len(W) == count and topology(G) == topology(F)
        length, areas = halfedge_lengths(W, G), face_areas(W, G)
        angle[strategy] = np.percentile(angles(W, G).min(axis=1), 1)
        edge[strategy], area[strategy] = length.std() / length.mean(), areas.std() / areas.mean()
    assert max(angle, key=angle.get) == min(edge, key=edge.get) == min(area, key=area.get) == "app-cfp"


def density_ratio(V, F, dense, result):
    """Vertices per area where the triangles are `dense` (m,), over those per area elsewhere."""
    area, inside = face_areas(V, F), dense[result.faces]
    # The cell of a boundary vertex is half on the surface.
    weight = np.ones(len(inside))
    weight[np.concatenate([np.zeros(0, int), *boundary_loops(result.triangles)])] = 0.5
    return (weight @ inside / area[dense].sum()) / (weight @ ~inside / area[~dense].sum())


@pytest.mark.parametrize("name, factor", [("sphere", 16), ("disk", 4), ("disk", 16)])
def test_density_is_honoured_over_the_whole_region(name, factor):
    """The rows of vertices along the jump, where sizes cannot change at once, count as well."""
    V, F = {"sphere": lambda: meshes.icosphere(4), "disk": lambda: meshes.bumpy(48, 48)}[name]()
    centre = V[F].mean(axis=1)
    dense = centre[:, 0] > 0.85 if name == "sphere" else np.linalg.norm(centre[:, :2] - 0.5, axis=1) < 0.16
    result = run(V, F, 3000, density=np.where(dense, float(factor), 1.0))
    assert density_ratio(V, F, dense, result) == pytest.approx(factor, rel=0.05)


def test_rough_regions_have_no_more_vertices_than_smooth_ones():
    """Triangles cut off what is fine, so that their own area says little of the surface's."""
    V, F = meshes.grid(80, 80)
    rough = V[F].mean(axis=1)[:, 0] > 0.5
    V[:, 2] = np.where(V[:, 0] > 0.5, 0.02 * np.sin(40 * V[:, 0]) * np.sin(40 * V[:, 1]), 0)
    result = run(V, F, 600, rounds=20)
    assert density_ratio(V, F, rough, result) == pytest.approx(1, rel=0.05)


def test_boundary_corners_stay():
    V, F = meshes.grid(10, 10)
    result = run(V, F, 200, rounds=20)
    for corner in ([0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]):
        assert np.linalg.norm(result.vertices - corner, axis=1).min() < 1e-12


def test_boundaries_that_need_not_be_kept_lose_their_frays():
    """A disk with a rough boundary, teeth smaller than the new edges."""
    V, F = meshes.polar(lambda r: r, lambda r: 0 * r, 4, 480)
    boundary = boundary_loops(F)[0]
    V[boundary] *= 1 + 0.04 * np.random.default_rng(0).uniform(-1, 1, (len(boundary), 1))
    radius = []
    for keep in (True, False):
        result = run(V, F, 150, preserve_boundary=keep, rounds=10)
        assert topology(result.triangles) == (1, 1) and len(result.vertices) == 150
        loop = result.vertices[boundary_loops(result.triangles)[0]]
        radius.append(np.linalg.norm(loop, axis=1))
        edges = np.linalg.norm(loop - np.roll(loop, -1, axis=0), axis=1)
    assert radius[1].std() < 0.6 * radius[0].std() and abs(radius[1].mean() - 1) < 0.02
    assert edges.std() < 0.1 * edges.mean()


def test_features_are_lines_of_the_new_mesh():
    V, F = meshes.cube()
    E = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    E = E[np.linalg.norm(V[E[:, 0]] - V[E[:, 1]], axis=1) < 1.1]
    on, fitted = (run(V, F, 300, features=E, rounds=20, fit=fit) for fit in (False, True))
    assert abs(face_areas(on.vertices, on.triangles).sum() - 6) < 1e-9
    assert abs(face_areas(fitted.vertices, fitted.triangles).sum() - 6) < 1e-8


def test_parts_share_the_count():
    V, F = meshes.icosphere(2)
    result = run(np.concatenate([V, 0.5 * V + 3]), np.concatenate([F, F + len(V)]), 250, rounds=10)
    assert len(result.vertices) == 250
    assert topology(result.triangles)[0] == 4


@pytest.mark.parametrize("name, count", [("sphere", 3), ("torus", 6), ("cube", 2)])
def test_too_few_vertices_are_refused(name, count):
    with pytest.raises(CountError):
        run(*CASES[name](), count)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("count", [14, 24])
def test_coarse_meshes_keep_the_topology(name, count):
    V, F = CASES[name]()
    result = run(V, F, count)
    assert len(result.vertices) == count == len(np.unique(result.triangles))
    assert topology(result.triangles) == topology(F)
    assert np.isfinite(result.vertices).all()


def test_closed_surfaces_go_down_to_a_tetrahedron():
    result = run(*meshes.icosphere(2), 4)
    assert len(result.vertices) == 4 and topology(result.triangles) == (2, 0)


def test_large_parts_make_up_for_small_ones():
    """A leaf of one triangle takes more than its share."""
    V, F = meshes.bumpy(12, 12)
    leaf = np.array([[0.0, 0, 2], [1e-3, 0, 2], [0, 1e-3, 2]])
    result = run(np.concatenate([V, leaf]), np.concatenate([F, [[len(V), len(V) + 1, len(V) + 2]]]), 120)
    assert len(result.vertices) == 120 and topology(result.triangles) == (2, 2)


def test_corners_are_kept_while_there_are_vertices_for_them():
    V, F = meshes.grid(6, 6)
    V, F = np.concatenate([V, 0.2 * V + 3]), np.concatenate([F, F + len(V)])
    kept, fewer = run(V, F, 8, rounds=5), run(V, F, 6, rounds=5)
    assert np.abs(kept.vertices[:, None] - V[[0, 6, 42, 48, 49, 55, 91, 97]]).sum(axis=2).min(axis=0).max() < 1e-12
    assert kept.warnings == () and any("corners" in w for w in fewer.warnings)
    assert topology(fewer.triangles) == (2, 2) and len(fewer.vertices) == 6
    with pytest.raises(CountError, match="takes at least 6"):
        run(V, F, 5)


@pytest.mark.parametrize("name, count_of", [("annulus", "vertices"), ("annulus", "faces"), ("torus", "vertices")])
def test_the_least_number_that_is_told_can_be_reached(name, count_of):
    V, F = CASES[name]()
    patch, leaf = meshes.grid(3, 3), np.array([[0.0, 0, 9], [1e-2, 0, 9], [0, 1e-2, 9]])
    V = np.concatenate([V, patch[0] + 5, leaf])
    F = np.concatenate([F, patch[1] + V.shape[0] - 3 - len(patch[0]), [[len(V) - 3, len(V) - 2, len(V) - 1]]])
    told = [5]
    while True:
        try:
            result = run(V, F, told[-1] + told[-1] % 2, count_of=count_of, rounds=5)
            break
        except CountError as error:
            told.append(int(re.findall(r"\d+", str(error))[1]))
    # A bound of the topology, and at the most what edges can collapse to.
    assert told == sorted(set(told)) and len(told) <= 3
    assert len(getattr(result, {"faces": "triangles"}.get(count_of, count_of))) == told[-1] + told[-1] % 2
    assert topology(result.triangles) == topology(F)


def test_odd_numbers_of_faces_are_warned_of_on_closed_surfaces():
    V, F = meshes.icosphere(2)
    result = run(V, F, 201, count_of="faces", rounds=5)
    assert len(result.triangles) == 200 and any("200 instead of 201" in w for w in result.warnings)
    assert run(V, F, 200, count_of="faces", rounds=5).warnings == ()


def test_the_same_warnings_are_summed_up():
    assert summed_up(["a", "b", "a"]) == ["a (2 times)", "b"]


def test_bad_input_is_named():
    V, F = meshes.bumpy(6, 6)
    with pytest.raises(EmptyMeshError, match="There are no faces to unwrap"):
        run(V, F[:0], 100)
    with pytest.raises(NonFiniteError, match="Coordinates are not finite numbers"):
        run(np.where(np.arange(len(V))[:, None] == 3, np.nan, V), F, 100)
    with pytest.raises(DensityError, match="A density is not positive and finite"):
        run(V, F, 100, density=np.zeros(len(F)))


def test_one_sided_surfaces_are_refused():
    k = np.arange(40)
    turn, half = 2 * np.pi * k / 40, np.pi * k / 40
    boundary = [(1 + s * np.cos(half)) * np.exp(1j * turn) for s in (-0.3, 0.3)]
    sides = zip(boundary, (-0.3, 0.3), strict=True)
    V = np.concatenate([np.column_stack([r.real, r.imag, s * np.sin(half)]) for r, s in sides])
    a, b = k, k + 40
    c, d = np.append(k[1:], 40), np.append(k[1:] + 40, 0)
    F = np.concatenate([np.column_stack([a, c, b]), np.column_stack([c, d, b])])
    with pytest.raises(OrientationError, match="A part of the mesh has only one side, like a"):
        run(V, F, 100)


def test_many_more_vertices_than_the_input_has_are_warned_of():
    V, F = meshes.quad_patch()
    assert any("times" in w for w in run(V, F, 300, rounds=5).warnings)


def test_cells_of_flat_triangles_have_mass():
    """Where flips are not allowed, triangles may be so obtuse that a signed cell is less than nothing."""
    V = np.array([[0.0, 0, 0], [10, 0, 0], [5, 0.01, 0], [5, -0.01, 0]])
    cells = voronoi_cells(V, np.array([[0, 1, 2], [0, 3, 1]]), np.ones(4))
    assert (cells.mass > 0).all() and np.isfinite(cells.moment).all()


def test_spheres_go_by_the_sphere_and_others_by_charts():
    components = {name: split_components(*CASES[name](), np.zeros((0, 2), int)).components[0] for name in CASES}
    assert {name for name, component in components.items() if ComponentMaps(component).by_sphere} == {"sphere", "cube"}


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_samples_on_the_sphere_are_as_the_strategy_says(strategy):
    """Uniform on the surface where they were uniform on the measure-preserving map, else on the conformal one."""
    V, F = meshes.icosphere(4)
    V = V * (1 + 0.8 * np.maximum(V[:, 2:], 0) ** 4) * [1, 1, 2]
    component = split_components(V, F, np.zeros((0, 2), int)).components[0]
    maps = drain(ComponentMaps(component).of_sphere(np.ones(len(F))))
    found = sample_sphere(component.vertices, component.triangles, *maps.pair(strategy), 500)
    assert len(found.points) == 500 and topology(found.triangles) == (2, 0)
    area = vertex_areas(found.points, found.triangles)
    assert (area.std() / area.mean() < 0.35) == strategy.startswith("app")
    assert (angles(found.points, found.triangles).min(axis=1).mean() > 40) == strategy.endswith("cfp")


def test_what_has_no_map_to_the_sphere_is_cut_open(monkeypatch):
    def fails(*_):
        raise PrecisionError("No room")
        yield

    V, F = meshes.icosphere(2)
    assert run(V, F, 120, rounds=5, strategy="app-app").warnings == ()
    monkeypatch.setattr(component_maps, "conformal_sphere", fails)
    # Where nobody asks for maps in particular there are none.
    assert run(V, F, 120, rounds=5).warnings == ()
    result = run(V, F, 120, rounds=5, strategy="app-app")
    assert len(result.vertices) == 120 and topology(result.triangles) == (2, 0)
    assert any("No room" in w for w in result.warnings)


def test_maps_serve_again_with_other_counts(monkeypatch):
    calls = []

    def counted(name):
        whole = getattr(component_maps, name)

        def once(*given):
            calls.append(name)
            return (yield from whole(*given))

        monkeypatch.setattr(component_maps, name, once)

    for name in ("conformal_sphere", "sphere_image", "conformal_image", "preserving_image"):
        counted(name)
    for V, F, kinds in ((*meshes.icosphere(3), 2), (*meshes.bumpy(12, 12), 2)):
        calls.clear()
        source = RemeshSource(V, F)
        options = {"rounds": 0, "fit": False}
        again = [run(V, F, count, source=source, **options) for count in (200, 120)]
        assert len(calls) == kinds
        for result in again:
            alone = run(V, F, len(result.vertices), **options)
            assert (result.vertices == alone.vertices).all()


def test_grading_bounds_how_fast_edges_grow():
    V, F = meshes.icosphere(4)
    density = np.where(V[F].mean(axis=1)[:, 2] > 0, 16.0, 1.0)
    growth = []
    for grading in (0.0, 0.25):
        result = run(V, F, 800, density=density, grading=grading, fit=False)
        size = np.sqrt(face_areas(result.vertices, result.triangles) * 4 / np.sqrt(3))
        middle = result.vertices[result.triangles].mean(axis=1)
        twin = twins(result.triangles)
        one, other = np.arange(len(twin)) // 3, twin // 3
        step = np.linalg.norm(middle[one] - middle[other], axis=1)
        growth.append(np.percentile(np.abs(size[one] - size[other]) / step, 99))
    assert growth[1] < 0.7 * growth[0]


def test_a_surface_too_long_for_one_conformal_map_is_mapped_in_pieces():
    V, F = meshes.bumpy(161, 5, height=0.0)
    V = V / np.ptp(V, axis=0).max() * np.array([40.0, 1.0, 1.0])
    result = run(V, F, 700, rounds=5)
    assert len(result.vertices) == 700 and topology(result.triangles) == topology(F)
    assert not [w for w in result.warnings if "conformal" in w]
    assert angles(result.vertices, result.triangles).min() > 20


def sliver_cone():
    """A body of twelve long sides: 24 vertices."""
    turn = 2 * np.pi * np.arange(12) / 12
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    V = np.concatenate([np.column_stack([r * ring, np.full(12, z)]) for r, z in ((0.1, 0.0), (0.02, 0.6))])
    a, b = np.arange(12), np.roll(np.arange(12), -1)
    fan = np.column_stack([np.zeros(10, int), np.arange(1, 11), np.arange(2, 12)])
    sides = np.concatenate([np.column_stack([a, b, b + 12]), np.column_stack([a, b + 12, a + 12])])
    return V, np.concatenate([fan[:, ::-1], sides, fan + 12])


@pytest.mark.parametrize("count", [60, 400])
def test_long_faces_are_no_worse_than_many_small_ones(count):
    V, F = sliver_cone()
    result = run(V, F, count)
    assert len(result.vertices) == count and topology(result.triangles) == (2, 0)
    assert angles(result.vertices, result.triangles).min() > 25
    normal = np.cross(
        *(result.vertices[result.triangles[:, k]] - result.vertices[result.triangles[:, 0]] for k in (1, 2))
    )
    first, second = np.arange(3 * len(normal)) // 3, twins(result.triangles) // 3
    assert (np.einsum("ij,ij->i", normal[first], normal[second]) > 0).mean() > 0.9
    foot = np.einsum("kc,kcj->kj", result.barycentric, V[F[result.faces]])
    assert np.linalg.norm(foot - result.vertices, axis=1).max() < 0.02


def test_faces_without_area_leave_the_mesh_in_its_place():
    """Maps need a little area there, and what they are made from lies elsewhere."""
    V, F = meshes.torus()
    a, b, c = F[0]
    V = np.concatenate([V + 5, (V[[a]] + V[[b]]) / 2 + 5])
    F = np.concatenate([F[1:], [[a, len(V) - 1, c], [len(V) - 1, b, c], [a, b, len(V) - 1]]])
    result = run(V, F, 300, rounds=10)
    assert topology(result.triangles) == (0, 0)
    foot = np.einsum("kc,kcj->kj", result.barycentric, V[F[result.faces]])
    assert np.linalg.norm(foot - result.vertices, axis=1).max() < 0.1


def test_halved_edges_are_the_same_surface():
    V, F = meshes.cube()
    lines = np.array([[0, 1], [1, 3]])
    component = split_components(V, F, lines).components[0]
    fine = refine_for_maps(component)
    assert len(fine.vertices) > 300 and fine.euler == component.euler
    np.testing.assert_allclose(np.bincount(fine.faces, fine.area), component.area)
    places = np.einsum("mkc,mcj->mkj", fine.input_barycentric, component.vertices[component.triangles[fine.faces]])
    np.testing.assert_allclose(fine.vertices[fine.triangles], places, atol=1e-12)
    lengths = [
        np.linalg.norm(p.vertices[p.features[:, 0]] - p.vertices[p.features[:, 1]], axis=1) for p in (component, fine)
    ]
    assert len(lengths[1]) > len(lengths[0]) and abs(lengths[1].sum() - lengths[0].sum()) < 1e-12


def test_many_small_parts_go_together_and_stay_apart():
    """Also where they lie within one another."""
    cone, (P, Q) = sliver_cone(), meshes.bumpy(6, 6)
    bodies = [(cone[0] + [0.03 * k, 0, 0], cone[1]) for k in range(10)] + [
        (0.2 * P + [0, 0, 0.1 * k], Q) for k in range(4)
    ]
    first = np.cumsum([0] + [len(V) for V, _ in bodies])
    V = np.concatenate([V for V, _ in bodies])
    F = np.concatenate([F + k for (_, F), k in zip(bodies, first[:-1], strict=True)])
    source = RemeshSource(V, F)
    result = run(V, F, 700, source=source)
    assert len(result.vertices) == 700 and topology(result.triangles) == (10 * 2 + 4, 4)
    owner = np.searchsorted(first, F[result.faces][:, 0], side="right") - 1
    assert (owner[result.triangles] == owner[result.triangles[:, :1]]).all()
    assert np.percentile(angles(result.vertices, result.triangles).min(axis=1), 1) > 30
    closed, open_ = source.maps_with_batches(np.ones(14, bool))
    assert len(closed.component.members) == 10 and len(open_.component.members) == 4


def test_closed_bodies_with_handles_need_no_maps(monkeypatch):
    """And get the density that they are asked for."""
    monkeypatch.delattr(component_maps, "conformal_image")
    V, F = meshes.torus()
    dense = V[F].mean(axis=1)[:, 0] > 0
    result = run(V, F, 1200, density=np.where(dense, 9.0, 1.0))
    assert len(result.vertices) == 1200 and topology(result.triangles) == (0, 0)
    assert np.percentile(angles(result.vertices, result.triangles).min(axis=1), 1) > 35
    area = face_areas(result.vertices, result.triangles)
    there = result.vertices[result.triangles].mean(axis=1)[:, 0] > 0.05
    here = result.vertices[result.triangles].mean(axis=1)[:, 0] < -0.05
    assert abs(area[here].mean() / area[there].mean() / 9 - 1) < 0.1


def test_features_and_boundaries_hold_without_maps(monkeypatch):
    """Samples on lines are where they would be between charts, exactly, and edges join them."""
    monkeypatch.delattr(component_maps, "conformal_image")
    V, F = meshes.annulus()
    E = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    straight = E[(np.abs(V[E][:, :, 1]) < 1e-9).all(axis=1)]
    result = run(V, F, 400, features=straight)
    assert len(result.vertices) == 400 and topology(result.triangles) == topology(F)
    W, T = result.vertices, result.triangles
    edges = np.concatenate([T[:, [0, 1]], T[:, [1, 2]], T[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    on = edges[(np.abs(W[edges][:, :, 1]) < 1e-12).all(axis=1)]
    whole = np.linalg.norm(V[straight[:, 0]] - V[straight[:, 1]], axis=1)
    whole = whole.sum() * len(np.unique(np.sort(straight, axis=1), axis=0)) / len(straight)
    assert abs(np.linalg.norm(W[on[:, 0]] - W[on[:, 1]], axis=1).sum() - whole) < 1e-9
    assert angles(W, T).min() > 25


def test_a_sieve_keeps_its_holes():
    V, F = meshes.grid(30, 30)
    hole = ((np.arange(900) % 30) % 3 == 1) & ((np.arange(900) // 30) % 3 == 1)
    quad = np.floor(V[F].mean(axis=1)[:, :2] * 30).astype(int)
    F = F[~hole[quad[:, 0] + 30 * quad[:, 1]]]
    result = run(V, F, 1500, rounds=10)
    assert len(result.vertices) == 1500 and topology(result.triangles) == topology(F)
    assert abs(face_areas(result.vertices, result.triangles).sum() - face_areas(V, F).sum()) < 1e-9
