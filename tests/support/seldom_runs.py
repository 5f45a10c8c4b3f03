"""Runs of what other runs of the solver do not come to: functions that answer for what is seldom, each called as its
callers call it, and what is between them. Nothing is symmetric, but where that is what is asked for."""

from __future__ import annotations

import sys
import types

import bodies
import meshes
import numpy as np
import pytest
import scipy.sparse as sp
from hard_meshes import voxel_surface
from scipy.spatial import cKDTree
from short_cuts import component_of
from wider_runs import bent

from omt_uv import solver as omt
from omt_uv.solver.analysis import density, feature_edges, joint_density
from omt_uv.solver.arranging import halves
from omt_uv.solver.conformal import intrinsic_triangulation
from omt_uv.solver.cutting import cuts, handle_partition, protrusions
from omt_uv.solver.cutting.cut_graph import path_to
from omt_uv.solver.cutting.cuts import cut
from omt_uv.solver.editing import magnify, refine_island, uv_islands
from omt_uv.solver.editing.refine_island import island_start
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.linalg.vertex_rows import RowPattern, VertexRows
from omt_uv.solver.maps import boxes, contacts
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.repair import joined_vertices, repaired_gluing
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.packing import shelves
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.polygons.polygon_disk import _by_ears
from omt_uv.solver.parameterization.unwrap import predicted_cuts, unwrap
from omt_uv.solver.partition.division import DivisionOptions, divide
from omt_uv.solver.partition.polar_coordinates import WindowMesh
from omt_uv.solver.partition.spacing import site_distances
from omt_uv.solver.progress import drain, on_thread
from omt_uv.solver.refinement import hessian_blocks, initial_maps, mesh_hierarchy, refine, vertex_sweeps
from omt_uv.solver.registration import coarse_start, vertex_landmarks
from omt_uv.solver.registration.coarse_meshes import laid_out
from omt_uv.solver.registration.functional_maps import eigenfunctions, refined_correspondence
from omt_uv.solver.registration.register import register
from omt_uv.solver.signatures import membrane
from omt_uv.solver.signatures.embedding import classes_of_nearest
from omt_uv.solver.sphere.figures import sphere_figures
from omt_uv.solver.sphere.sphere_map import _area_warning
from omt_uv.solver.subdivision.cage_refinement import refine_cage, subdivided_elements
from omt_uv.solver.subdivision.cage_symmetry import CageChart, cage_symmetry
from omt_uv.solver.subdivision.catmull_clark import cage_of, straight_boundary, subdivide
from omt_uv.solver.transport.cell_polygons import planar_cells, spherical_cell_polygons
from omt_uv.solver.transport.convex_domain import Rectangle
from omt_uv.solver.transport.spherical_power_diagram import by_hull
from omt_uv.solver.volumes import envelope, shells, tet_mesh
from omt_uv.solver.volumes.body_map import volume_map
from omt_uv.solver.volumes.meshing import TetMesh, split_inside
from omt_uv.solver.volumes.sampling import ball_index
from omt_uv.solver.volumes.tet_newton import unlocked


def patch_of(columns=9):
    """A bumpy patch (n,3), (m,3) and a map (n,2) of it without folds."""
    V, F = meshes.bumpy(columns, columns)
    V = bent(V)
    return V, F, V[:, :2] + 0.05 * np.sin(3 * V[:, 1:3])


def _folded_flows():
    """Two vertices of a flat ball pass by one another: faces fold, and are taken apart on the way."""
    V, F = bodies.icosphere(2)
    V = (V + 1e-3 * bent(V)) * [1.0, 0.6, 0.15]
    one = np.square(V - [0.05, 0, 0.15]).sum(axis=1).argmin(keepdims=True)
    other = np.square(V - [-0.05, 0.1, -0.15]).sum(axis=1).argmin(keepdims=True)
    down, up = FlowHandle(V[one], V[one] - [0, 0, 1.2], one), FlowHandle(V[other], V[other] + [0.3, 0, 0.6], other)
    drain(flow(V, (down, up), FlowOptions(radius=0.15), F, frames=2))


def _surfaces_read():
    V, F, uv = patch_of()
    W, G = bodies.icosphere(2)
    W = bent(W)
    joined_vertices(triangle_surface(np.concatenate([V[F].reshape(-1, 3), W[G].reshape(-1, 3)]),
                                     np.arange(3 * (len(F) + len(G))).reshape(-1, 3)),
                    np.ones(len(F) + len(G), bool))  # fmt: skip
    corners = np.arange(3 * len(F)).reshape(-1, 3)
    values = uv[F].reshape(-1, 2).copy()
    values[: len(values) // 2] += 0.3
    feature_edges.value_jumps(F, corners, values, 0.1)
    uv_islands._labels(triangle_surface(np.concatenate([V, V + 5]), np.concatenate([F, F + len(V)])))
    mirrored = np.arange(81).reshape(9, 9)[:, ::-1].ravel()
    X, H = meshes.grid(8, 8)
    halves.symmetric_map(H, bent(X)[:, :2], mirrored)
    density.density_of_vertices(V, F, face_areas(V, F) * (1 + 0.5 * np.sin(np.arange(len(F)))), 30)
    tri = intrinsic_triangulation.from_mesh(V, F)
    intrinsic_triangulation.split_boundary_edge(tri, boundary_loops(F)[0], len(V))


def _shares():
    rng = np.random.default_rng(2)
    regions, before = rng.random((3, 12)), np.array([0.2, 0.1, 0.3])
    joint_density._share_of_the_way(regions, before, np.array([0.7, 0.4, 0.5]))
    regions = np.array([[1.0, 0, 0], [0, 1.0, 0]])
    joint_density._share_of_the_way(regions, before[:2], np.array([0.8, 0.9]))
    joint_density._too_much(regions, before[:2], np.array([4.0, 7.0]), "why")


def _boxes_and_crossings():
    V, F, uv = patch_of()
    w, loop = uv @ [1, 1j], boundary_loops(F)[0]
    rng = np.random.default_rng(1)
    step = 0.4 * (rng.normal(size=len(w)) + 1j * rng.normal(size=len(w)))
    contacts.crossings_on_the_way(w, step, loop, (0.25, 1.0))
    moved = w + 0.1 * step
    vertex_sweeps._uncross(moved, w, loop)
    low = rng.random((60, 2))
    high, low2 = low + 0.2 * rng.random((60, 2)), rng.random((50, 2))
    boxes._in_grid(low, high, low2, low2 + 0.1, np.zeros(2), 0.2)
    _by_ears(np.array([[0, 1, 2], [0, 2, 4], [2, 3, 4]]), bent(np.array([
        [0.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 0.2, 0], [0, 1, 0]]))[:, :2], bent(np.array([
        [0.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 0.2, 0], [0, 1, 0]])))  # fmt: skip


def _rows_of_vertices():
    V, F, _ = patch_of(7)
    n, rng = len(V), np.random.default_rng(1)
    pattern = RowPattern([F, np.zeros((0, 4), np.int64)], n)
    local = rng.normal(size=(len(F), 6, 6)) * np.repeat(V[F].mean(axis=1)[:, :1], 36, axis=1).reshape(-1, 6, 6)
    local = local @ local.transpose(0, 2, 1) + np.eye(6)
    rows = VertexRows(pattern, VertexRows.summed(pattern, [(pattern.places()(F), local)]), None)
    rows.add_diagonal(1 + rng.random(2 * n))
    rows.plain()
    rows.shifted(2.0).plain()
    rows.inverse(slice(0, 9))
    forms = sp.csr_matrix(rng.normal(size=(6, 2 * n)) * (rng.random((6, 2 * n)) < 0.2))
    joined = VertexRows(pattern, VertexRows.summed(pattern, [(pattern.places()(F), local)]), forms.T @ forms)
    joined.add_diagonal(1 + rng.random(2 * n))
    joined.inverse(slice(0, 9))
    joined.plain()


def _refined_in_parts():
    """With the sizes from which on blocks are made some at a time, and vertices swept, lowered to those of here."""
    V, F, uv = patch_of()
    mesh_hierarchy.coarsen_disk(V, F, None, face_areas(V, F), 40)
    slim = bent(V * [1, 0.05, 1])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hessian_blocks, "AT_ONCE", 40)
        patch.setattr(refine, "FEW", 30)
        patch.setattr(refine, "TENSE", 0.0)
        omt.unwrap(slim, F, quality="exact")
        omt.unwrap(slim, F, balance=0.2)
        omt.unwrap(V, F, boundary="disk")
        patch.setattr(refine, "SWEPT_ABOVE", 30)
        near = (np.linalg.norm((V[F].mean(axis=1) - V.mean(axis=0))[:, :2], axis=1) < 0.3).astype(float)
        target = face_areas(V, F) * (1 + 3 * near)
        for boundary in ("free", "disk"):
            drain(refine.refine(V, F, uv, refine.RefinementOptions(boundary), region=near, target=target))


def _flat_sides():
    """A body with two flat sides that are round otherwise, and one that is taken for no hard body."""
    k = np.arange(16)
    ring = np.column_stack([np.cos(k * np.pi / 8), np.sin(k * np.pi / 8)]) * (1 + 0.3 * (k % 2))[:, None]
    V = np.concatenate([np.column_stack([ring, z + 0 * k]) for z in (0.0, 0.2, 0.4)] + [[[0, 0, 0]], [[0, 0, 0.4]]])
    after = np.roll(k, -1)
    sides = [np.column_stack([k + a, after + a, after + b, k + b]).tolist() for a, b in ((0, 16), (16, 32))]
    below, above = np.column_stack([after, k, 0 * k + 48]), np.column_stack([k + 32, after + 32, 0 * k + 49])
    polygons = [*sides[0], *sides[1], *below.tolist(), *above.tolist()]
    V = V * [1, 0.9, 1.1] + 0.05 * np.sin(5 * V[:, [1, 0, 0]]) * [1, 1, 0]
    with pytest.MonkeyPatch.context() as patch:
        omt.unwrap(V, polygons, max_shear=1.2)
        patch.setattr(cuts, "net", lambda component: None)
        patch.setattr(cuts, "hard_borders", lambda surface, gluing, positions, gone, *_: np.zeros_like(gone))
        omt.unwrap(V, polygons, max_shear=1.6)


def _bodies_filled():
    """As fTetWild fills them, whose part a body that was filled otherwise takes."""
    V, F = bodies.limbed(1)
    V = bent(V)
    found = drain(volume_map(V, F, count=300))

    def tetrahedralize(points, faces, edge_length_abs, num_threads):
        size = np.linalg.norm(np.ptp(V, axis=0))
        return (found.points - V.min(axis=0)) / size + edge_length_abs * 1e-3, found.tets[:, [1, 0, 2, 3]]

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "pytetwild", types.SimpleNamespace(tetrahedralize=tetrahedralize))
        envelope.filled(V, F, 300)


def _predicted_spread():
    V, F = meshes.head(12)
    component = component_of(bent(V), F)
    some = path_to(component, np.flatnonzero(component.on_boundary()), int(np.argmax(component.positions[:, 2])))
    protrusions.outline_spread(component, some)
    protrusions.disk_spread(component, some)
    T, H = meshes.torus(14, 9)
    surface = triangle_surface(bent(T), H)
    cut(surface)
    predicted_cuts(surface, np.ones(len(H), bool), 3.0)
    gluing = repaired_gluing(surface, np.ones(len(H), bool), np.arange(3 * len(H)).reshape(-1, 3), np.arange(len(H)))
    steps = handle_partition._steps(gluing.gluing, surface.positions[surface.corner_vertex])
    handle_partition._nearest_centres(gluing.gluing, steps, np.ones(len(H), bool))


def _membranes():
    k = np.arange(24)
    outline = bent(np.column_stack([np.cos(k * np.pi / 12), np.sin(k * np.pi / 12), 0.2 * np.sin(k)]))
    membrane._membrane(outline)
    rng = np.random.default_rng(4)
    apart = rng.random((12, 12))
    classes_of_nearest(apart + apart.T, ["a", "b", "c", "a"] * 3, 3)
    sizes = rng.random((30, 2))
    shelves.blocks_of(sizes, 4)
    shelves._block(np.arange(30), sizes[np.argsort(-sizes[:, 1])])


def _divided():
    V, F = bodies.icosphere(3)
    V = bent(V)
    found = drain(divide(V, F, 9, options=DivisionOptions(relax=1)))
    site_distances(WindowMesh(V, F), found)
    rng = np.random.default_rng(7)
    sites = rng.normal(size=(80, 3))
    sites /= np.linalg.norm(sites, axis=1)[:, None]
    weights = 1e-3 * rng.random(80)
    spherical_cell_polygons(sites, weights, by_hull(sites, weights))
    planar_cells(0.4 * sites[:, :2], weights, Rectangle()).areas()


def _on_the_sphere():
    V, F = bodies.icosphere(3)
    W = bent(V * [1, 0.8, 1.3])
    target = face_areas(W, F)
    sphere_figures(W, F, V)
    _area_warning(V, F, target, None)
    _area_warning(V, F, target, np.arange(len(F)) // 2)
    folded = V.copy()
    folded[np.flatnonzero(V[:, 2] > 0.9)[:3]] *= [-1, 1, 1]
    laid_out(V, F, folded, V[:, 2] > 0.8)
    values = eigenfunctions(W, F, 30)
    rough = cKDTree(W).query(W + 0.1 * np.sin(9 * W[:, [1, 2, 0]]))[1]
    marks = values[[0, 40, 99, 200]]
    refined_correspondence(values**2, values**2, rough, (marks**2, marks**2))


def _matched_from_few():
    V, F = bodies.limbed(2)
    V = bent(V)
    chosen = np.array([3, 40, 90])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coarse_start, "COARSE", 40)
        drain(register((V, F), (bent(V * [1, 1.3, 0.7]), F), vertex_landmarks((chosen, F), (chosen[[1, 2, 0]], F))))


def _insides_with_room():
    V, F = bodies.limbed(1)
    V = bent(V)
    shells.icosphere(2)
    ball_index(1, 3)
    found = drain(volume_map(V, F, count=400))
    mesh = TetMesh(found.points, found.tets)
    split_inside(mesh, found.positions, np.arange(len(found.tets)) % 5 == 0)
    crowded = found.positions.copy()
    crowded[len(V) :] *= 0.01
    drain(unlocked(mesh, crowded, len(V)))
    tet_mesh.tet_volumes(crowded, found.tets)


def _cages():
    k = 6
    corner = np.arange((k + 1) * k).reshape(k, k + 1)[:, :-1].ravel()
    quads = np.column_stack([corner, corner + 1, corner + k + 2, corner + k + 1])
    y, x = np.divmod(np.arange((k + 1) ** 2), k + 1)
    uv = np.column_stack([x, y]) / k
    triangles, faces = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), np.repeat(np.arange(len(quads)), 2)
    height = 0.5 * np.exp(-8 * ((uv - [0.5, 0.3]) ** 2).sum(axis=1))
    one = CageChart(np.column_stack([uv, height]), triangles, faces, np.ones(len(uv)))
    rough = bent(np.column_stack([uv, height]))
    cage_symmetry([one], uv @ [1, 1j], {})
    charts = [CageChart(p, triangles, faces, np.ones(len(uv))) for p in (rough, rough * [-1, 1, 1])]
    w = uv @ [1, 1j]
    cage_symmetry(charts, np.concatenate([w, 5 - w.conj()]), {1: (0, np.arange(len(uv)))})


def _slit_of_a_cage():
    """A wavy surface with a slit whose sides lie close by one another in the map, and would pass through each other."""
    columns, rows = 8, 4
    vertex = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    copy = vertex.copy()
    copy[rows // 2, : columns // 2] = np.arange(vertex.size, vertex.size + columns // 2)
    upper = np.where(np.arange(rows)[:, None] >= rows // 2, copy[:-1], vertex[:-1])
    quads = np.stack([upper[:, :-1], upper[:, 1:], vertex[1:, 1:], vertex[1:, :-1]], axis=2).reshape(-1, 4)
    slit = vertex[rows // 2, : columns // 2]
    y, x = np.divmod(np.arange(vertex.size), columns + 1)
    uv = np.column_stack([x, y]).astype(float)
    positions = bent(np.column_stack([uv, 0.6 * np.sin(uv[:, 0]) * np.cos(2 * uv[:, 1])]))
    positions, uv = np.concatenate([positions, positions[slit]]), np.concatenate([uv, uv[slit] + [0, 0.02]])
    cage = cage_of(quads.ravel(), np.arange(0, 4 * len(quads) + 1, 4), len(uv))
    mapping, triangles = subdivide(straight_boundary(cage), 2), quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    corners = (subdivide(cage, 2).matrix @ positions)[mapping.quads]
    scale = np.ones(len(corners) + len(triangles))
    parts = subdivided_elements(corners, mapping.quads, positions[triangles], triangles, scale)
    none = np.zeros(len(uv), bool)
    drain(refine_cage(parts, mapping.matrix, uv, none, 1000.0, None, boundary_loops(triangles)[:1]))


def _islands_again():
    V, F, uv = patch_of()
    folded = uv.copy()
    folded[len(uv) // 2] += 0.5
    refine_island._straightened(V, F, folded)
    calm = V[:, 0] < np.median(V[:, 0])
    turned = uv @ [[0.6, 0.8], [-0.8, 0.6]] + 3
    magnify.placed_like_outside(turned, uv, F, calm[F].all(axis=1), False)
    magnify.placed_like_outside(turned, uv, F, calm[F].all(axis=1), True)
    initial_maps._middle(uv[boundary_loops(F)[0]])
    island_start(V, F, folded @ [1, 1j], boundary_loops(F)[0], False)


def _threads():
    """What runs on a thread of its own comes to the same."""
    V, F, _ = patch_of()
    surface = triangle_surface(V, F)
    drain(on_thread(unwrap(surface, options=UnwrapOptions(quality="draft"))))


def _outlined():
    """A body that is its own mirror image, with two limbs and a tail, cut for a map onto a disk."""
    solid = np.zeros((6, 9, 4), bool)
    solid[:, 3:6] = True
    solid[[0, 5], 6:, 1:3] = solid[2:4, :3, 2] = True
    V, quads = voxel_surface(solid)
    omt.unwrap(V.astype(float) * [1, 1.2, 0.9], quads.tolist(), boundary="disk", quality="draft")


# Runs whose figures are kept apart: what is symmetric may hang on last digits.
SYMMETRIC = ("cages", "outlined")
RUNS = {
    function.__name__.strip("_"): function
    for function in (
        _folded_flows, _surfaces_read, _shares, _boxes_and_crossings, _rows_of_vertices, _predicted_spread,
        _membranes, _divided, _on_the_sphere, _matched_from_few, _insides_with_room, _cages, _slit_of_a_cage,
        _islands_again, _threads, _refined_in_parts, _flat_sides, _bodies_filled, _outlined,
    )
}  # fmt: skip
