"""Runs of the solver on meshes of more kinds and sizes than `solver_runs` has: what is begun only from a size on, on
polygons, limbs, hard edges, holes and handles, and what answers for what fails. None of them is symmetric."""

from __future__ import annotations

import bodies
import meshes
import numpy as np
import pytest
from broken_meshes import broken_mesh
from hard_meshes import voxel_surface
from polygons import wavy_mixed, wavy_quads, with_limbs
from solver_runs import MOVE, curved

from omt_uv import solver as omt
from omt_uv.solver import comparison, flows
from omt_uv.solver.analysis import feature_edges
from omt_uv.solver.arranging.halves import halves
from omt_uv.solver.canonical.markers import MapMarkers, markers_of_chart
from omt_uv.solver.comparison.greatest import exact_distances, farthest, greatest_distance
from omt_uv.solver.conformal.boundary_first import boundary_first
from omt_uv.solver.contact import self_intersections
from omt_uv.solver.editing.live_map import LiveMap
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.errors import MeshError
from omt_uv.solver.flows import creases, smoothing
from omt_uv.solver.globe import pole_vertices
from omt_uv.solver.linalg import additive_schwarz, multigrid, nested_dissection, symmetric_sweeps
from omt_uv.solver.maps.embedding import check_layout
from omt_uv.solver.mesh import charts
from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.packing.single_precision import without_rounded_folds
from omt_uv.solver.parameterization import chart_map as chart_maps
from omt_uv.solver.parameterization import initial_map
from omt_uv.solver.parameterization.chart_map import map_chart
from omt_uv.solver.parameterization.options import MapOptions, UnwrapOptions
from omt_uv.solver.parameterization.polygons import convexity
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import refine as refining
from omt_uv.solver.refinement.refine import refine
from omt_uv.solver.registration import RegistrationOptions, coarse_start, vertex_landmarks
from omt_uv.solver.registration.register import register
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.options import RemeshOptions
from omt_uv.solver.remeshing.remesh_surface import remesh
from omt_uv.solver.signatures import signature, wasserstein
from omt_uv.solver.signatures.marked import marked_signature
from omt_uv.solver.transport import Disk, Rectangle, cell_polygons
from omt_uv.solver.volumes import body_map
from omt_uv.solver.volumes import registration as volume_registration

# Cases of `broken_meshes` that are unwrapped.
BROKEN = range(40)


def bent(V):
    """Positions (n,3) bent so that nothing is symmetric, or flat."""
    size = np.ptp(V, axis=0).max()
    x = V / size
    return V + 0.06 * size * np.sin(3.1 * x[:, [1, 2, 0]] + 1.7 * x[:, [2, 0, 1]] + [0.3, 1.1, 2.3])


def large(columns=80):
    """A bumpy patch of more vertices than charts have that are mapped without a coarser mesh."""
    V, F = meshes.bumpy(columns, columns)
    return bent(V), F


def framed(rows, columns):
    """A flat frame of so many square holes, as quads, with a handle each."""
    solid = np.ones((2 * rows + 1, 2 * columns + 1, 1), bool)
    solid[1::2, 1::2] = False
    V, quads = voxel_surface(solid)
    return bent(V.astype(float)), quads.tolist()


def _large_charts():
    V, F = large()
    omt.unwrap(V, F)
    omt.unwrap(V, F, quality="draft")
    omt.unwrap(V, F, boundary="disk", quality="draft")
    omt.unwrap(V, F, quality="draft", balance=0.4)


def _polygons():
    V, Q, uv = wavy_quads()
    for options in ({}, {"balance": 0.5}, {"boundary": "square"}, {"boundary": "disk"}, {"quality": "exact"}):
        omt.unwrap(V, Q, **options)
    W, P, vw = wavy_mixed(4, 3)
    omt.unwrap(W, P)
    omt.unwrap(W, P, balance=0.6)
    omt.refine(V, Q, uv[Q])
    A, B = with_limbs(3, 4, 3)
    omt.unwrap(A, B, balance=0.3)
    omt.sphere_map(A, B, balance=0.5)


def _limbs():
    A, B = with_limbs(1)
    omt.unwrap(A, B, max_shear=1.15)
    V, F = bodies.limbed(2)
    omt.unwrap(bent(V), F, quality="draft", max_shear=1.05)
    W, G = meshes.comb(3, 6)
    omt.unwrap(bent(W), G, max_shear=1.05)


def _seams_on_a_coarse_surface():
    V, F = bodies.limbed(4)
    omt.unwrap(bent(V), F, quality="draft", max_shear=1.45)


def _hard_edges():
    rng = np.random.default_rng(3)
    solid = rng.random((4, 4, 3)) < 0.6
    solid[1:3, 1:3, 1] = True
    V, quads = voxel_surface(solid)
    broken = V.astype(float) * [1.0, 1.3, 0.8]
    omt.unwrap(broken, quads.tolist(), max_shear=1.2)
    omt.unwrap(*framed(2, 2), max_shear=1.3)
    W, G = meshes.cube()
    omt.unwrap(bent(W), G, max_shear=1.1)
    X, H = meshes.hinge(8, 8)
    omt.unwrap(bent(X), H, max_shear=1.05)


def _handles_and_holes():
    V, quads = framed(2, 7)
    surface = meshes.polygon_surface(V, quads)
    drain(unwrap(surface))
    W, G = bodies.bowl(6, 14, 0.2)
    omt.unwrap(bent(W), G)
    T, H = meshes.torus(16, 10)
    holes = np.flatnonzero(np.arange(len(H)) % 37 > 2)
    omt.unwrap(bent(T), H[holes], fill_holes=True)
    omt.unwrap(bent(T), H[holes], max_shear=1.3)


def _broken():
    for seed in BROKEN:
        surface, faces, options = broken_mesh(seed)
        try:
            with np.errstate(all="ignore"):
                drain(unwrap(surface, faces, **options))
        except (MeshError, ValueError):
            continue


def _by_name():
    V, F = curved(5)
    for kind in ("conformal", "polar"):
        for boundary in ("free", "disk", "square", "rectangle"):
            if (kind, boundary) != ("polar", "free"):
                omt.unwrap(V, F, kind=kind, boundary=boundary)
    chart = charts.strict_charts(omt.polygon_surface(V, F))[0]
    loop = boundary_loops(chart.triangles)[0]
    given = dict(zip(chart.vertex_ids.tolist(), range(len(V)), strict=True))
    for ids in ((14,), (14, 0), (0, 5, 35, 30)):
        corners = [given[k] for k in ids]
        marks = MapMarkers(*(np.array(x, int) for x in ((ids[:1], ids[1:2], []) if len(ids) < 3 else ([], [], ids))))
        on = markers_of_chart(marks, chart)
        for kind in ("conformal", "authalic") if corners else ():
            options = MapOptions(kind=kind, boundary="disk" if len(ids) < 3 else "rectangle")
            drain(map_chart(chart, options=options, markers=on))
    boundary_first(chart.vertices, chart.triangles, loop)


def _more_spheres():
    V, F = bodies.limbed(2)
    for method in ("newton", "flow", "moser"):
        omt.sphere_map(bent(V), F, method=method)
    needle = bent(V * [1, 0.08, 0.1])
    omt.sphere_map(needle, F)
    omt.sphere_map(bent(V * [1, 1, 0.02]), F, balance=0.3)


def _remeshed():
    V, F = meshes.bumpy(16, 16)
    V = bent(V)
    edges = np.array([[17 * k + 8, 17 * (k + 1) + 8] for k in range(16)])
    source = RemeshSource(V, F, edges)
    for options in (
        {"strategy": "cfp-app", "rounds": 4}, {"preserve_boundary": False, "rounds": 6}, {"rounds": 12},
        {"strategy": "app-app", "rounds": 0, "count_of": "faces"},
    ):  # fmt: skip
        drain(remesh(source, 150, RemeshOptions(**options)))
        drain(remesh(RemeshSource(V, F), 220, RemeshOptions(**options)))
    W, G = bodies.limbed(2)
    for options in ({"strategy": "cfp-cfp", "rounds": 3}, {"rounds": 20}, {"fit": False, "grading": 0.3}):
        drain(remesh(RemeshSource(bent(W), G), 200, RemeshOptions(**options)))
    many = np.concatenate([bent(W) + [3 * k, 0, 0] for k in range(3)])
    drain(remesh(RemeshSource(many, np.concatenate([G + k * len(W) for k in range(3)])), 240))


def _matches():
    V, F = bodies.limbed(2)
    V = bent(V)
    W = MOVE.apply(bent(V * [1.1, 0.9, 1.0]))
    drain(register((V, F), (W, F), options=RegistrationOptions(polish=False)))
    chosen = np.array([3, 40, 90, 120])
    marks = vertex_landmarks((chosen, F), (chosen, F))
    drain(register((V, F), (W, F), marks, RegistrationOptions(closeness=0.002)))
    drain(register((V, F), (W * [-1, 1, 1], F[:, ::-1]), marks, RegistrationOptions(mirrored=True, balance=0.1)))
    A, G = curved(6)
    drain(register((A, G), (A * [1.2, 1, 1.3], G), options=RegistrationOptions(polish=False)))


def _flows_and_creases():
    V, F = bodies.icosphere(1)
    V = bent(V)
    rows, held = np.flatnonzero(V[:, 2] > 0.75), np.flatnonzero(V[:, 2] < -0.7)
    push = flows.FlowHandle(V[rows], V[rows] @ MOVE.as_matrix().T * 0.8 + [0.2, 0.05, -0.5], rows)
    rest = flows.FlowHandle(V[held], V[held], held)
    for path in ("rigid", "straight", "radius", "blend"):
        drain(flows.flow(V, (push, rest), flows.FlowOptions(path=path, radius=0.3), F))
    W, G = bodies.icosphere(2)
    W = bent(W)
    tip = np.array([int(W[:, 2].argmax())])
    through = flows.FlowHandle(W[tip], W[tip] + [0.05, 0.03, -1.7], tip)
    around = np.flatnonzero(np.arange(len(W)) != tip[0])
    drain(flows.flow(W, (through, flows.FlowHandle(W[around], W[around], around)), flows.FlowOptions(radius=0.01), G))
    drain(flows.flow(W, (through,), flows.FlowOptions(radius=0.5), G, flows.mesh_domain(1.9 * W, G, 60), 2))


def _as_if_large():
    """With the sizes from which on systems are solved in parts, and seams tried, lowered to those of small meshes."""
    V, F = meshes.bumpy(18, 18)
    V = bent(V)
    W, G = bodies.limbed(2)
    with pytest.MonkeyPatch.context() as patch:
        for module, name, value in (
            (additive_schwarz, "LARGE", 100), (additive_schwarz, "LARGE_KEPT", 100),
            (additive_schwarz, "LITTLE_FILL", 1),
            (additive_schwarz, "SIZE_KEPT", 60), (nested_dissection, "LARGE", 100), (initial_map, "COARSE_ABOVE", 150),
            (initial_map, "DRAFT_ABOVE", 60), (initial_map, "DRAFT_COARSE_ABOVE", 150), (refining, "SWEPT_ABOVE", 100),
            (convexity, "LARGEST", 20), (coarse_start, "COARSE", 40), (symmetric_sweeps, "SINGLE_FROM", 250),
            (multigrid, "COARSEST", 50), (chart_maps, "COARSE_ABOVE", 150),
        ):  # fmt: skip
            patch.setattr(module, name, value)
        omt.unwrap(V, F)
        omt.unwrap(V, F, balance=0.3, quality="exact")
        omt.unwrap(V, F, quality="draft")
        omt.unwrap(V, F, boundary="disk")
        live = LiveMap(V, F, V[:, :2])
        for balance in (0.0, 0.5):
            live.follow(balance, None, seconds=0.0)
        drain(refine_island(V, F, V[:, :2], balance=0.2))
        omt.sphere_map(bent(W), G)
        marks = vertex_landmarks((np.array([3, 40, 90]), G), (np.array([3, 40, 90]), G))
        drain(register((bent(W), G), (bent(W * [1, 1.1, 0.9]), G), marks))


def _mirror_images():
    """What is its own mirror image: cut, searched, mapped and refined as such."""
    V, F = meshes.icosphere(2)
    W = V * [1.0, 1.4, 0.8] * (1 + 0.25 * V[:, [1]] ** 2 + 0.15 * V[:, [2]])
    for options in ({"max_shear": 1.3}, {"max_shear": 1.08}, {}, {"balance": 0.4}):
        omt.unwrap(W, F, **options)
    A, B = with_limbs(1, 3, 2)
    both, faces = (
        np.concatenate([A + [3, 0, 0], A * [-1, 1, 1] - [3, 0, 0]]),
        [*B, *[[k + len(A) for k in f[::-1]] for f in B]],
    )
    omt.unwrap(both, faces, max_shear=1.3)
    T, H = meshes.torus(12, 8)
    omt.unwrap(T * [1, 1.2, 1], H, max_shear=1.4)
    omt.unwrap(T, H)
    X, Y = meshes.two_bumps(12)
    omt.unwrap(X, Y, boundary="disk")
    omt.unwrap(X, Y, quality="draft")
    omt.unwrap(*meshes.polar(lambda t: t, lambda t: 0.4 * t**2, 4, 12), max_shear=1.02)
    voxels = np.ones((3, 3, 2), bool)
    voxels[0, 0, 1] = voxels[2, 0, 1] = False
    P, quads = voxel_surface(voxels)
    omt.unwrap(P.astype(float), quads.tolist(), max_shear=1.2)


def _bodies_mapped():
    V, F = bodies.icosphere(1)
    V = bent(V)
    for method in ("newton", "flow"):
        for domain in ("ball", "cube"):
            drain(body_map.volume_map(V, F, domain, method, 400))
    other = drain(body_map.volume_map(bent(V * [1, 1.2, 0.8]), F, count=400))
    ball = drain(body_map.volume_map(V, F, count=400))
    drain(body_map.into_body(ball, other))


def _pieces():
    V, F = bodies.limbed(2)
    W = bent(V)
    distances = np.linalg.norm(V - W, axis=1)
    exact_distances(ClosestPoint(V, F, 0.2), W[F].mean(axis=1), np.full(len(F), distances.max()))
    farthest(ClosestPoint(V, F, 0.2), W, np.full(len(W), distances.max()))
    drain(greatest_distance(W, F, ClosestPoint(V, F, 0.2), np.arange(len(V)) % len(F), (W[:3], distances[:3])))
    drain(comparison.compare((V, F), (W, F), 300))
    A, G = curved(6)
    uv = A[:, :2].copy()
    live = LiveMap(A, G, uv)
    for balance in (0.0, 0.4, 1.0):
        live.follow(balance, None, seconds=0.0)
    drain(refine_island(A, G, uv, pins=(np.array([0, 6, 48, 24]), uv[[0, 6, 48, 24]] + 0.02)))
    drain(refine_island(A, G, uv + 0.02 * np.sin(9 * uv[:, ::-1])))
    check_layout(G, uv[G], True)
    drain(marked_signature(A, G, 24, 10, 40))
    drain(marked_signature(W, F, 7, 60, 40))
    sites = A[:, :2] - 0.5
    for domain in (Disk(), Rectangle(1.3)):
        cell_polygons.planar_cells(0.9 * sites, 0.01 * np.sin(np.arange(len(A))), domain)
    turn = 2 * np.pi * np.arange(14000) / 14000
    fan = np.column_stack([0.61 + 0.16 * np.cos(turn), 0.37 + 0.16 * np.sin(turn)])
    left, ears = np.arange(len(fan)), []
    while len(left) > 2:
        even = np.arange(0, len(left) - 1, 2)
        ears.append(np.column_stack([left[even], left[even + 1], np.roll(left, -2)[even]]))
        left = np.delete(left, even + 1)
    without_rounded_folds(fan, np.concatenate(ears))
    lines = np.array([[7 * k + 3, 7 * k + 10] for k in range(6)])
    feature_edges.resolved_features(A, G, lines, np.full(len(G), 0.3))
    both = [(A + [2, 0, 0], G, uv), (A * [-1, 1, 1] - [2, 0, 0], G[:, ::-1], uv * 0.5)]
    halves(both, np.array([1.0, 0, 0]), 0.0, False)
    drain(refine(A, G, uv))


def _pulled_and_magnified():
    """Pins that are moved, outlines that are known again, faces that are taken apart, and signatures on a disk."""
    A, G = curved(8)
    uv = A[:, :2].copy()
    weights = np.clip(1.5 - 4 * np.linalg.norm(uv - uv.mean(axis=0), axis=1), 0, 1)
    omt.magnify(A, G, uv[G], weights, 2.0)
    flat = omt.unwrap(A, G, boundary="disk", quality="draft").uv
    for options in ({}, {"boundary": "free"}, {"exact": False}):
        omt.magnify(A, G, flat, weights, 1.7, **options)
    pins = np.array([0, 8, 80, 72])
    drain(refine(A, G, uv, pins=(pins, 1.1 * uv[pins] + [[0, 0.05], [0, 0], [0.05, 0], [0, -0.04]])))
    drain(refine(A, G, uv, pins=(pins[:2], uv[pins[:2]])))
    drain(refine(A, G, uv, region=weights[G].mean(axis=1), target=face_areas(A, G) * (1 + weights[G].mean(axis=1))))
    V, F = bodies.icosphere(2)
    V = bent(V)
    after = V.copy()
    after[V[:, 2] > 0.6, 2] -= 1.75
    crossings = self_intersections.FaceCrossings(F)
    creases.without_new_intersections(V, after, crossings, np.ones(len(V), bool))
    smoothing.smoothed_apart(V, after, crossings, V[:, 2] > -0.5)
    one, other = (drain(marked_signature(B, G, 40, 4, 30)) for B in (A, A * [1, 1.2, 0.8]))
    wasserstein.shape_distance(one, other)
    wasserstein.nearest(one, [other, one], 1)
    large, small = (drain(signature.signature(bent(B), F, 400)) for B in (V, V * [1, 0.7, 1.2]))
    wasserstein.shape_distance(large, small)
    sphere = V / np.linalg.norm(V, axis=1, keepdims=True)
    pole_vertices.move_vertices_onto(sphere, F, np.array([[0.1, 0.2, 0.97], [0, 0.1, -1.0], [1, 0.2, 0.1]]))
    drain(volume_registration.registered(0.7 * sphere, 0.5 * sphere[[3, 40, 90]], 0.45 * sphere[[5, 41, 95]]))


def _turned_bodies():
    """Rings of bodies of revolution: in rows, with a face around the axis, open, and noisy as a scan is."""
    bottle = [(0.8, 0), (0.9, 0.1), (0.9, 1.2), (0.75, 1.6), (0.4, 1.9), (0.3, 2.4), (0.33, 2.5)]
    V, Q = bodies.turned([(0, 0), *bottle], 13)
    open_surface, filled = (
        meshes.polygon_surface(V, Q),
        meshes.polygon_surface(V[1:], [list(range(13))[::-1]] + [[v - 1 for v in q] for q in Q[13:]]),
    )
    V, F = bodies.icosphere(3)
    scan = meshes.polygon_surface(V * [1, 1, 1.7] + 1e-3 * np.sin(40 * V[:, [1, 2, 0]]), F.tolist())
    for surface in (open_surface, filled, scan):
        drain(unwrap(surface, options=UnwrapOptions(max_shear=1.35)))


RUNS = {
    function.__name__.strip("_"): function
    for function in (
        _large_charts, _polygons, _by_name, _more_spheres, _remeshed, _matches, _flows_and_creases, _as_if_large,
        _bodies_mapped, _pieces, _pulled_and_magnified, _limbs, _seams_on_a_coarse_surface, _hard_edges,
        _handles_and_holes, _broken, _mirror_images, _turned_bodies,
    )
}  # fmt: skip
# Runs whose figures are kept apart: what is searched, broken or symmetric may hang on last digits.
MARKS = {
    "limbs": " in searches", "seams_on_a_coarse_surface": " in searches", "hard_edges": " in searches",
    "handles_and_holes": " in searches", "broken": " of broken meshes", "mirror_images": " of symmetric meshes",
    "turned_bodies": " of turned bodies",
}  # fmt: skip
