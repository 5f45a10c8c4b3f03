"""Runs of every folder of the solver on small meshes without symmetry: what they call is called on generic input."""

from __future__ import annotations

import functools

import meshes
import numpy as np
from scipy.spatial.transform import Rotation
from tetrahedra import grid_of_tets
from told_otherwise import body, patch, ramp

from omt_uv import solver as omt
from omt_uv.solver import analysis, comparison, flows, globe, partition, strain, transfer
from omt_uv.solver.analysis import curvature, density, joint_density, saliency, vertex_scores
from omt_uv.solver.arranging import congruence, quad_grid, stacks
from omt_uv.solver.canonical import named_maps, rectangles
from omt_uv.solver.conformal import disk_map
from omt_uv.solver.contact import barrier, close_pairs, new_crossings, self_intersections, separation
from omt_uv.solver.editing import image_warp, inset_images, magnify_regions, refine_island
from omt_uv.solver.globe import unfolding
from omt_uv.solver.globe.projections import EQUIRECT, PROJECTIONS
from omt_uv.solver.linalg import additive_schwarz
from omt_uv.solver.maps import development, face_distortion, local_untangle, mirror_symmetry, overlap, untangle
from omt_uv.solver.maps import upright as upright_maps
from omt_uv.solver.mesh import charts, closest_point, cut_mesh, geometry, point_location, spherical_geometry
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.packing import pack_square
from omt_uv.solver.progress import drain
from omt_uv.solver.quads import recombination
from omt_uv.solver.refinement import batch_refine, vertex_sweeps
from omt_uv.solver.registration import RegistrationOptions, suggestions, vertex_landmarks
from omt_uv.solver.registration.charts import chart_maps
from omt_uv.solver.registration.register import register
from omt_uv.solver.seams import limbs, parting
from omt_uv.solver.signatures import embedding, marked, reference, signature, wasserstein
from omt_uv.solver.sphere import dominitz_tannenbaum, moser_flow, multilevel
from omt_uv.solver.strain import beltrami
from omt_uv.solver.subdivision import cage_refinement, catmull_clark, modifier
from omt_uv.solver.transport import (
    ConvexPolygon,
    Disk,
    Rectangle,
    polar_factorization,
    semidiscrete,
    semidiscrete_sphere,
)
from omt_uv.solver.volumes import domains, paper_flow, sampling, shells, slices, tet_mesh, tet_newton
from omt_uv.solver.volumes.tet_exact import exact_volumes
from omt_uv.solver.volumes.transfer import TetLocation

MOVE = Rotation.from_rotvec([0.5, 0.2, -0.9])


def triangles(mesh):
    """The triangles (m,3) of a mesh of quads."""
    V, F = mesh
    return V, np.vstack([F[:, :3], F[:, [0, 2, 3]]])


def curved(count=7):
    """The curved patch in triangles."""
    return triangles(patch(count))


def near_middle(V, F):
    """Weights (n,) that fall with the distance from the middle of the mesh."""
    away = np.linalg.norm(V - V[F].mean(axis=(0, 1)), axis=1)
    return np.clip(1.5 - 3 * away / away.max(), 0, 1)


@functools.cache
def _flat():
    V, F = patch()
    return omt.unwrap(V, F, quality="draft", balance=1.0).uv


@functools.cache
def _flat_curved():
    V, F = curved()
    uv = np.empty((len(V), 2))
    uv[F] = omt.unwrap(V, F, quality="draft", balance=1.0).uv
    return uv


@functools.cache
def _ball():
    V, F = body()
    return omt.sphere_map(V, F, balance=0.5).positions


def _unwrapped():
    V, F = patch()
    omt.unwrap(V, F, density=ramp(V, F, 1, 4))
    pinned, places = np.zeros(F.size, bool), np.zeros((*F.shape, 2))
    for vertex, place in ((3, (0.0, 0.1)), (len(V) - 2, (1.1, 0.9))):
        places[vertex == F], pinned = place, pinned | (vertex == F).ravel()
    omt.unwrap(V, F, pins=(pinned, places))
    W, G = curved(4)
    omt.unwrap(np.vstack([V, 0.4 * W + 3]), [*F.tolist(), *(G + len(V)).tolist()], balance=0.3)


def _unwrapped_into_shapes():
    V, F = patch()
    # Areas so far from the surface's come by conformal map and transport.
    omt.unwrap(V, F, boundary="disk", quality="draft", density=(1 + 20 * near_middle(V, F) ** 4)[: len(F)])
    omt.unwrap(V, F, boundary="square", quality="exact")


def _bodies_cut_open():
    omt.unwrap(*body(), max_shear=1.2)
    V, F = meshes.torus(12, 8)
    omt.unwrap(V * [1.3, 1.0, 0.8] + 0.1 * V[:, [1, 2, 0]] ** 2, F, fill_holes=True)
    omt.unwrap(*meshes.annulus(12, 3), seams=[(0, 12)])


def _magnified():
    V, F = patch()
    omt.magnify(V, F, _flat(), near_middle(V, F), 2.0)
    omt.refine(V, F, _flat(), balance=0.3)
    W, G = curved()
    pins = np.array([0, 5]), _flat_curved()[[0, 5]]
    drain(refine_island.refine_island(W, G, _flat_curved(), balance=0.2, pins=pins))
    regions = np.stack([near_middle(W, G), np.clip(W[:, 0] - 0.9, 0, 1)])[:, G].mean(axis=2)
    drain(magnify_regions.magnify_regions(_flat_curved(), G, regions, [2.0, 0.7], exact=False))
    joint_density.joint_density(regions, face_areas(W, G) * ramp(W, G, 1, 2), [2.0, 0.5])


def _images():
    W, G = curved(3)
    rng = np.random.default_rng(2)
    old = 0.1 + 0.5 * W[G][:, :, :2]
    new = old * [0.9, 1.2] + 0.05
    picture = rng.random((24, 32, 3))
    image_warp.warp_image(picture, old, new, 2)
    inset_images.warp_with_insets(picture, old, new, size=(20, 28))


def _spheres():
    V, F = body()
    omt.sphere_map(V, F, balance=0.3, density=ramp(V, F, 1, 3))
    P, mass = _ball(), face_areas(V, F) * ramp(V, F, 1, 2)
    drain(multilevel.multilevel_start(V, F, mass))
    drain(moser_flow.moser_map(P, F, mass))
    drain(dominitz_tannenbaum.flow_map(P, F, mass))


def _new_meshes():
    V, F = body()
    omt.remesh(V, F, 100, density=ramp(V, F, 1, 3), grading=0.5)
    omt.remesh(V, F, 120, strategy="app-cfp", rounds=0)
    W, G = curved()
    omt.remesh(W, G, 80)
    rough = omt.remesh(W, G, 60, fit=False)
    at = transfer.correspond(
        W, G, np.zeros((0, 2), int), rough.vertices, rough.triangles, rough.faces, rough.barycentric
    )
    transfer.to_vertices(at, G, np.column_stack([W[:, 0] ** 2, W[:, 1]]))
    corners = np.arange(3 * len(G)).reshape(-1, 3)
    transfer.to_corners(at, corners, _flat_curved()[G].reshape(-1, 2))
    transfer.nearest_to_corners(at, corners, G.reshape(-1) % 5)
    transfer.nearest_to_vertices(at, G, np.arange(len(W)) % 7)
    transfer.to_faces(at, np.arange(len(G)), np.sin(np.arange(len(G))))


def _compared():
    W, G = curved()
    drain(comparison.compare((W, G), (W + 0.02 * W[:, [1, 2, 0]], G), 200))
    comparison.compare_shapes(W, G)
    comparison.curvature_error(np.array([1.0, -2, 0.3]), np.array([1.5, -1.6, 0.1]))


def _told_apart():
    V, F = curved()
    image = V * [1.2, 0.9, 0.7] + 0.1 * V[:, [1, 2, 0]] ** 2
    found = beltrami.beltrami(V, F, image)
    found.histogram()
    strain.corner_beltrami(V[F], image[F])
    weights = {"left": ramp(V, F, 0, 1), "right": 1 - ramp(V, F, 0, 1)}
    strain.compare_regions(
        strain.region_strain(found, weights), strain.region_strain(found, {"left": ramp(V, F, 1, 0)})
    )
    strain.mean_shape(np.stack([V, MOVE.apply(image), 1.3 * V + 2]), 0.5 + near_middle(V, F), True)
    strain.match_figures((V, F), (image, F), (np.zeros(len(V), int), np.full((len(V), 3), 1 / 3)), image)


def _read_off():
    V, F = curved()
    curvature.sharpness(V, F)
    density.gaussian_curvature_density(V, F)
    density.mean_curvature_density(V, F)
    density.painted_density(near_middle(V, F), 3.0)
    saliency.saliency(V, F)
    analysis.sharp_edges(V, F, np.radians(8))
    for kind in vertex_scores.KINDS:
        vertex_scores.vertex_score(kind, V, F, np.arange(len(V)) < 4)
    face_distortion(V, F, _flat_curved()[F])
    omt.distortion(V, F, _flat_curved()[F])
    overlap.covered_share(_flat_curved() @ [1, 1j], F)
    local_untangle.straighten_folds(F, folded()[F].reshape(-1, 2), np.ones(len(F)))
    V2, F2 = curved(4)
    loop = np.array([0, 1, 2, 3, 4, 9, 14, 19, 24, 23, 22, 21, 20, 15, 10, 5])
    flat = V2[:, :2].copy()
    flat[12] += [0.5, 0.1]
    untangle.untangle(flat, V2, F2, loop, flat[loop])
    development.developed(V2, F2)


def folded():
    """UVs (n,2) with a fold inside."""
    uv = _flat_curved().copy()
    uv[27] += 0.25
    return uv


def _arranged():
    V, F = curved(4)
    W, G = patch(4)
    turned, order = MOVE.apply(V) + 3, np.random.default_rng(4).permutation(len(V))
    other = np.empty_like(V)
    other[order] = turned
    congruence.matching(V, F, other, order[F])
    normal = np.array([1.0, 2.0, 2.0]) / 3
    congruence.mirrored_match(V, F, V - 2 * np.outer(V @ normal - 0.3, normal), F[:, ::-1], normal, 0.3)
    uv = V[:, :2]
    stacks.stacks([(V, F, uv), (other, order[F], 0.5 * other[:, :2])])
    quad_grid.rectangle(W, G, ramp(W, G, 1, 2))
    islands = [uv, 0.5 * uv[:, ::-1] * [1, -1], uv[:12] * 0.3]
    drain(pack_square.pack(islands, [F, F[:, ::-1], F[(F < 12).all(axis=1)]], 2, 128))
    pack_square.stack(islands)
    diagonal = np.column_stack([np.arange(len(G)), np.arange(len(G)) + len(G)])
    recombination.quad_diagonals(V, F, diagonal)
    recombination.with_shorter_diagonals(V, F, diagonal)


def _in_contact():
    V, F = curved(5)
    after = V.copy()
    after[:, 2] += 0.9 * np.sin(4 * V[:, 0]) * (V[:, 1] > 0.5)
    after[:, 0] -= 2.2 * np.clip(V[:, 0] - 0.7, 0, 1)
    after[:, 2] += 0.8 * np.clip(V[:, 0] - 1.0, 0, 1) - 0.4 * np.clip(V[:, 0] - 0.8, 0, 1)
    faces = self_intersections.FaceCrossings(F)
    pairs = new_crossings.new_intersections(V, after, faces)
    separation.separated(V, after, F, pairs, np.ones(len(V), bool))
    barrier.brought(V, after, new_crossings.NewCrossings(V, faces), np.arange(len(V)) > 2)
    close_pairs(V, F, 0.2)
    self_intersections.intersecting_pairs(after, F)


def _moved_by_flows():
    V, F = body()
    rows = np.flatnonzero(V[:, 0] > 0.9)
    handles = (
        flows.FlowHandle(V[rows], V[rows] + [0.2, 0.1, 0.05], rows),
        flows.FlowHandle(V[[3]], V[[3]] + [[0.05, 0.2, -0.1]], np.array([3])),
    )
    handles = flows.sampled_handles(handles, 0.2, 5)
    for options in (flows.FlowOptions(), flows.FlowOptions(radius=0.8)):
        for domain in (None, flows.ball_domain(np.zeros(3), 2.5, 80)):
            drain(flows.flow(V, handles if isinstance(handles, tuple) else (handles,), options, F, domain))


def _laid_out():
    V, F = body()
    P = _ball()
    m = len(F)
    polygons = unfolding.Polygons(F.ravel(), np.repeat(np.arange(m), 3), np.arange(3 * m).reshape(m, 3))
    shares = face_areas(V, F) / face_areas(V, F).sum()
    globe.along_axes(P, V, F)
    globe.by_markers(P[3], P[50], P[90])
    globe.move_vertices_onto(P, F, np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]))
    for projection in PROJECTIONS:
        globe.to_plane(P, projection)
        globe.to_sphere(0.05 + 0.9 * np.random.default_rng(0).random((30, 2)), projection)
        laid, points = globe.unfold(P, polygons, projection)
        drain(globe.correct_areas(laid, polygons, shares, projection))
        if projection == EQUIRECT:
            globe.equirectangular_areas(points, laid, polygons)


def _signed():
    V, F = body()
    one = drain(signature.signature(V, F, 60))
    other = drain(signature.signature(MOVE.apply(V * [1, 1.3, 0.7]), F, 60))
    wasserstein.shape_distance(one, other)
    wasserstein.nearest(one, [other, one], 2)
    W, G = curved()
    drain(marked.marked_signature(W, G, 27, 3, 40))
    distances = np.linalg.norm(V[:9, None] - V[None, :9], axis=2)
    embedding.classical_scaling(distances)
    drain(reference.exact_transport(_ball(), F, face_areas(V, F), spherical_geometry.fibonacci_sphere(12)))


def _transported():
    rng = np.random.default_rng(5)
    sites, mass = rng.random((40, 2)) - 0.5, 0.5 + rng.random(40)
    for domain in (Disk(), Rectangle(1.3), ConvexPolygon(np.array([[-1, -1], [1.2, -0.8], [0.9, 1], [-0.7, 1.1]]))):
        drain(semidiscrete.transport(0.9 * sites, mass, domain))
    found = drain(polar_factorization.polar_factorisation(sites, mass, Disk(), 0.3))
    found.potential(found.uv)
    balls = rng.normal(size=(40, 3))
    drain(semidiscrete_sphere.sphere_transport(balls / np.linalg.norm(balls, axis=1, keepdims=True), mass))


def _named():
    V, F = curved()
    loop = np.array([0, 7, 63, 56])
    for kind in ("disk", "rectangle", "square", "free"):
        corners = None if kind in ("free", "disk") else loop
        mass = face_areas(V, F) * ramp(V, F, 1, 2)
        problem = named_maps.NamedProblem(V, F, mass, kind, corners, 1.3 if kind == "rectangle" else 0.0)
        drain(named_maps.conformal_map(problem))
        if kind != "free":
            drain(named_maps.polar_map(problem))
    rectangles.natural_aspect(V, F, loop)
    drain(disk_map.conformal_rectangle(V, F, loop))
    drain(disk_map.conformal_disk(V, F))


def _divided():
    for V, F in (body(), curved()):
        found = drain(partition.divide(V, F, 7, ramp(V, F, 1, 2)))
        partition.cut_along_cells(V, F, found)
        partition.follow_faces(found, np.arange(len(F)), F.ravel(), 3 * np.arange(len(F) + 1))


def _matched():
    V, F = body()
    W = MOVE.apply(V * [1.2, 0.9, 1.0])
    chosen = np.array([3, 40, 90, 120])
    drain(register((V, F), (W, F), vertex_landmarks((chosen, F), (chosen, F))))
    suggestions.suggest_landmarks((V, F), (W, F), 4)
    A, G = curved(5)
    B = A * [1.1, 1, 1.4]
    drain(register((A, G), (B, G), vertex_landmarks((np.array([8, 22, 15]), G), (np.array([8, 22, 15]), G))))
    none = np.zeros((0, 2), int)
    corners = vertex_landmarks((np.array([0, 5, 35, 30]), G), (np.array([0, 5, 35, 30]), G))
    drain(chart_maps.register_charts((A, G, none), (B, G, none), corners, RegistrationOptions("charts")))


def _insides():
    X, T = grid_of_tets(3, 0.15, 1)
    on = tet_mesh.boundary_vertices(T)
    Y = X - X.mean(axis=0)
    scale = np.linalg.norm(Y, axis=1)
    box = np.abs(Y).max(axis=1)
    Y = Y * (box / np.maximum(scale, 1e-9) / box.max())[:, None]
    Y[on] /= np.linalg.norm(Y[on], axis=1, keepdims=True)
    ball = domains.BallDomain(on)
    problem = tet_newton.tet_problem(X, T, ball)
    drain(tet_newton.refined(problem, Y))
    drain(paper_flow.paper_flow(X, T, Y, ball, 3, keep=(0, 3)))
    drain(exact_volumes(X, T, Y, ball, 0.05))
    sampling.interior_points(X, Y, T, 30)
    shells.shell_surfaces(X, Y, T, 2)
    slices.plane_slice(X, Y, T, np.array([0.6, 0.0, 0.8]), 0.1)
    TetLocation(X, T)(X.mean(axis=0) + 0.1 * np.sin(np.arange(15)).reshape(5, 3))
    sampling.sampled_field(Y, T, X, 0.3 * np.sin(np.arange(12)).reshape(4, 3))
    tet_mesh.boundary_triangles(T)


def _subdivided():
    V, F = patch(3)
    cage = catmull_clark.cage_of(F.ravel(), np.arange(0, F.size + 1, 4), len(V))
    for limit in (True, False):
        catmull_clark.subdivide(cage, 2, limit)
    way = modifier.SubdivisionModifier(1)
    surface = omt.polygon_surface(V, F)
    modifier.subdivided_surface(surface, way, 10**5)
    modifier.subdivided_uv(F.ravel(), np.arange(0, F.size + 1, 4), F.ravel(), way, 1)


def _found_on_meshes():
    V, F = curved(5)
    index = closest_point.ClosestPoint(V, F, 0.2)
    there = V[F].mean(axis=1) + 0.1 * np.sin(np.arange(3 * len(F))).reshape(-1, 3)
    index(there, geometry.face_normals(V, F))
    cut_mesh.cut_open(V, F, np.array([[7, 8], [8, 9], [9, 15]]))
    point_location.locate(V[:, :2], F, V[F[::3], :2].mean(axis=1) + 0.01)
    closest_point.random_points(face_areas(V, F), 20, np.random.default_rng(1))


def _upright():
    """Charts turned, refined together, begun in every shape, parted, and symmetric ones."""
    V, F = curved()
    chart, uv = charts.strict_charts(surface_of(V, F))[0], _flat_curved()
    turned = (uv @ [1, 1j] * np.exp(0.7j)).view(float).reshape(-1, 2)
    upright_maps.turn_upright([chart, chart], [turned, 2 * turned], [[0.1, 1.0, 0.2], [0, 0, 1.0]])
    drain(batch_refine.refine_batch([(V, F), (0.5 * V[:, [1, 0, 2]], F[:, ::-1])], "standard", 0.1))
    drain(vertex_sweeps.smoothed_uv(V, F, face_areas(V, F) * ramp(V, F, 1, 2), uv, 3.0, 2))
    parting.parted(chart, uv, np.ones(len(V)))
    limbs.in_pieces(chart, uv, np.ones(len(V)), 3)
    mirror_symmetry.mirror_symmetry(np.arange(len(V))[None, ::-1], 1.0, turned @ [1, 1j])
    additive_schwarz.schwarz_solver(V, F)


def surface_of(V, F):
    """A surface of faces (m,k)."""
    return omt.polygon_surface(V, F)


def _with_symmetry():
    """Bodies and patches that are their own mirror images."""
    V, F = meshes.icosphere(2)
    W = V * [1.0, 1.4, 0.8] * (1 + 0.2 * np.abs(V[:, [0]]) + 0.1 * V[:, [2]])
    omt.unwrap(W, F, max_shear=1.08)
    omt.sphere_map(W, F, balance=0.5)
    A, G = meshes.two_bumps(10)
    omt.unwrap(A, G, balance=0.2)
    omt.unwrap(A, G, boundary="square")
    omt.unwrap(meshes.cube()[0] * [1.0, 1.2, 0.9], meshes.cube()[1])
    omt.unwrap(*comb_of_quads())


def comb_of_quads():
    """A bent comb with long limbs."""
    V, F = meshes.comb(4, 5)
    return np.column_stack([V[:, 0], V[:, 1], 0.2 * V[:, 0] ** 2 + 0.1 * V[:, 1]]), F


def _cages():
    """A cage refined for its subdivided surface."""
    V, F = patch(4)
    start = np.arange(0, F.size + 1, 4)
    cage = catmull_clark.cage_of(F.ravel(), start, len(V))
    mapping = catmull_clark.subdivide(catmull_clark.straight_boundary(cage), 2)
    fine = (catmull_clark.subdivide(cage, 2).matrix @ V)[mapping.quads]
    pieces = F[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    found = cage_refinement.subdivided_elements(
        fine, mapping.quads, V[pieces], pieces, np.linspace(1, 2, len(fine) + len(pieces))
    )
    uv = V[:, :2] + 0.05 * np.sin(5 * V[:, [1, 0]])
    drain(cage_refinement.refine_cage(found, mapping.matrix, uv, np.arange(len(uv)) == 7, 10.0))
    catmull_clark.bilinear(cage, 1)


RUNS = {
    function.__name__.strip("_"): function
    for function in (
        _unwrapped, _unwrapped_into_shapes, _bodies_cut_open, _magnified, _images, _spheres, _new_meshes, _compared,
        _told_apart, _read_off, _arranged, _in_contact, _moved_by_flows, _laid_out, _signed, _transported, _named,
        _divided, _matched, _insides, _subdivided, _found_on_meshes, _upright, _with_symmetry, _cages,
    )
}  # fmt: skip
