"""Runs of branches of the solver that neither `wider_runs` nor `seldom_runs` comes to: pins of several vertices, what
begins from a size on with all sizes lowered, diagonals that are not each other's image, polygons on the sphere, what
answers where the usual way leaves double precision, landmarks that mirrored and known maps have, pictures of whole
numbers, islands with holes, flows in the plane, and the parts by which a chart comes apart."""

from __future__ import annotations

from collections.abc import Iterator

import bodies
import meshes
import numpy as np
import pytest
import recorded_calls
from hard_meshes import voxel_surface
from polygons import wavy_mixed, wavy_quads, with_limbs
from solver_runs import MOVE, curved, near_middle, patch, ramp
from wider_runs import bent

from omt_uv import solver as omt
from omt_uv.solver import flows
from omt_uv.solver.analysis import seam_costs, straight_paths
from omt_uv.solver.analysis.density import Target
from omt_uv.solver.editing import image_warp, inset_images
from omt_uv.solver.editing.live_map import LiveMap
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.errors import PrecisionError, TransportError
from omt_uv.solver.mesh import charts, geometry
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.pockets import pocket_borders
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.refine import refine
from omt_uv.solver.registration import RegistrationOptions, domains, vertex_landmarks
from omt_uv.solver.registration.charts.chart_maps import register_charts
from omt_uv.solver.registration.register import register
from omt_uv.solver.seams import parting
from omt_uv.solver.sphere import sphere_map
from omt_uv.solver.volumes import body_map

# Sizes from which on something is done otherwise, by parts of their names, and what they are lowered to.
SIZES = ("AT_ONCE", "CHUNK", "LARGE", "MANY", "KEPT_HATS", "MOST_PLACED", "BATCH", "ABOVE", "EMBEDDED", "DIRECT",
         "SAMPLED", "FEW_NODES", "FEW_PAIRS", "BLOCK", "SINGLE_FROM")  # fmt: skip
LEAST = 200
LOWERED = 60


def sizes() -> Iterator[tuple[object, str, int]]:
    """Modules of the solver with the names and values of sizes in them."""
    for module in recorded_calls.modules():
        for name, value in sorted(vars(module).items()):
            if type(value) is int and value >= LEAST and any(part in name for part in SIZES):
                yield module, name, value


def ridge():
    """A patch that is its own mirror image across x = 0 but for the diagonals of its quads."""
    y, x = np.mgrid[0:9, 0:9] / 4.0 - 1
    V = np.stack([x, 1.2 * y, 0.5 * np.exp(-2 * (x**2 + (y - 0.3) ** 2))], axis=2).reshape(-1, 3)
    at = np.arange(72).reshape(8, 9)[:, :8].ravel()
    return V, np.concatenate([np.column_stack([at, at + 1, at + 10]), np.column_stack([at, at + 10, at + 9])])


def _as_if_very_large():
    V, F = meshes.bumpy(14, 14)
    V = bent(V)
    A, B = with_limbs(1)
    with pytest.MonkeyPatch.context() as lowered:
        for module, name, _ in list(sizes()):
            lowered.setattr(module, name, LOWERED)
        lowered.setattr(omt.linalg.sparse, "FEW", LOWERED)
        omt.unwrap(V, F)
        omt.unwrap(V, F, boundary="disk", quality="draft")
        W, Q, uv = wavy_quads()
        omt.unwrap(W, Q, quality="exact")
        omt.unwrap(W, Q, balance=0.4)
        omt.distortion(V, F, V[F][..., :2])
        omt.unwrap(A, B, max_shear=1.25)
        S, G = bodies.icosphere(2)
        omt.sphere_map(bent(S), G)
        omt.remesh(bent(S), G, 120, rounds=2)
        geometry.face_areas(V, F)


def _pinned_charts():
    V, F = curved(7)
    n = len(V)
    uv = V[:, :2]
    for ids, places in (
        ((3, n - 2, 40), [(0.0, 0.1), (-1.1, 0.9), (-0.6, 0.2)]), ((0, 7, 56, 63), 1.05 * uv[[0, 7, 56, 63]] + 0.02),
        ((20,), [(0.3, 0.4)]), ((27, 28), [(0.4, 0.4), (0.5, 0.55)]),
    ):  # fmt: skip
        pinned, at = np.isin(F, ids).ravel(), np.zeros((*F.shape, 2))
        for vertex, place in zip(ids, np.asarray(places, float), strict=True):
            at[vertex == F] = place
        omt.unwrap(V, F, pins=(pinned, at))
    inner = np.array([18, 21, 45])
    drain(refine(V, F, uv, pins=(inner, uv[inner] + [[0.05, 0.0], [0, -0.05], [0.02, 0.03]])))
    live = LiveMap(V, F, uv, (inner, uv[inner]))
    for k in range(3):
        live.follow(0.3 * k, uv[inner] + 0.02 * k, seconds=0.0)


def _other_diagonals():
    """Mirror images but for diagonals: maps of triangles as of quads; and pairs of charts with densities."""
    V, F = ridge()
    for options in ({}, {"balance": 0.3}, {"quality": "draft"}, {"boundary": "disk"}):
        omt.unwrap(V, F, **options)
    omt.unwrap(V, F, density=1 + V[F].mean(axis=1)[:, 1] ** 2)
    W, G = curved(5)
    both = np.concatenate([W + [1, 0, 0], W * [-1, 1, 1] - [1, 0, 0]])
    faces = np.concatenate([G, G[:, ::-1] + len(W)])
    for density in (None, 1 + np.abs(both[faces].mean(axis=1)[:, 0]), ramp(both, faces, 1, 3)):
        omt.unwrap(both, faces, density=density)
    surface = triangle_surface(both, faces)
    region = np.tile(near_middle(W, G)[G].mean(axis=1), 2)
    drain(unwrap(surface, target=Target(1 + region, region)))
    S, H = meshes.icosphere(2)
    omt.sphere_map(S * [1, 1.3, 0.8] * (1 + 0.2 * S[:, [2]]), H)


def _polygons_on_spheres():
    profile = [(0.8, 0), (0.9, 0.3), (0.7, 1.0), (0.4, 1.3)]
    V, Q = bodies.turned(profile, 9)
    polygons = [list(range(9))[::-1], *Q, list(range(27, 36))]
    V = bent(V)
    for options in ({}, {"method": "flow"}, {"method": "moser"}, {"balance": 0.4}):
        omt.sphere_map(V, polygons, **options)
    W, G = bodies.limbed(1)

    def failing(error):
        def fails(*_, **__):
            raise error("As if it were not done")
            yield

        return fails

    for name, error in (("conformal_sites", PrecisionError), ("sphere_transport", TransportError)):
        with pytest.MonkeyPatch.context() as lowered:
            lowered.setattr(sphere_map, name, failing(error))
            omt.sphere_map(bent(W), G, density=ramp(W, G, 1, 2))


def _without_room():
    V, F = meshes.comb(3, 5)
    V = bent(V)
    for boundary in ("disk", "square", "rectangle"):
        omt.unwrap(V, F, boundary=boundary)
    W, P, _ = wavy_mixed(5, 4)
    height = 0.9 * np.sin(2.5 * W[:, :1]) * np.cos(2 * W[:, 1:2])
    steep = W + np.concatenate([0 * height, 0 * height, height], axis=1)
    for options in ({}, {"balance": 0.4}, {"quality": "exact"}, {"boundary": "disk"}):
        omt.unwrap(steep, P, **options)
    A, B = patch(5)
    omt.unwrap(A * [1, 1, 2.5], B, density=ramp(A, B, 1, 9))
    many = np.concatenate([bent(A) + [2 * k, 0, 0] for k in range(5)])
    faces = np.concatenate([B + k * len(A) for k in range(5)])
    omt.unwrap(many, faces, density=ramp(many, faces, 1, 3))


def _matched_otherwise():
    V, F = bodies.limbed(1)
    V = bent(V)
    W = MOVE.apply(bent(V * [1.1, 0.9, 1.0]))
    chosen = np.array([3, 40, 20, 31])
    marks = vertex_landmarks((chosen, F), (chosen, F))
    plain = RegistrationOptions(polish=False)
    whole = [domains.filled((P, F), "sphere", "source") for P in (V, W)]
    known = tuple(drain(domains.domain_map(surface, "sphere", 0.5)) for surface in whole)
    drain(register((V, F), (W, F), marks, plain, known))
    turned = vertex_landmarks((chosen, F[:, ::-1]), (chosen, F))
    mirrored = RegistrationOptions(polish=False, mirrored=True)
    drain(register((V * [-1, 1, 1], F[:, ::-1]), (W, F), turned, mirrored))
    known = drain(domains.domain_map(domains.filled((V * [-1, 1, 1], F[:, ::-1]), "sphere", "source"), "sphere", 0.5))
    drain(register((V * [-1, 1, 1], F[:, ::-1]), (W, F), turned, mirrored, (known, None)))
    open_ = np.flatnonzero(np.arange(len(F)) % 29 > 1)
    drain(register((V, F[open_]), (W, F), marks, plain))
    A, G = curved(5)
    B = A * [1.1, 1, 1.4]
    none = np.zeros((0, 2), int)
    corners = np.array([0, 5, 35, 30, 14])
    on = vertex_landmarks((corners, G), (corners, G))
    for options in (RegistrationOptions("charts"), RegistrationOptions("charts", polish=False, balance=0.2)):
        drain(register_charts((A, G, none), (B, G, none), on, options))
    mirrored = RegistrationOptions("charts", mirrored=True, polish=False)
    turned = vertex_landmarks((corners, G[:, ::-1]), (corners, G))
    drain(register_charts((A * [-1, 1, 1], G[:, ::-1], none), (B, G, none), turned, mirrored))
    few = vertex_landmarks((np.array([8, 22, 15]), G), (np.array([8, 22, 15]), G))
    drain(register((A, G), (B, G), few, RegistrationOptions("disk", polish=False)))


def _pictures():
    W, G = curved(3)
    rng = np.random.default_rng(5)
    old = 0.1 + 0.5 * W[G][:, :, :2]
    new = old * [0.9, 1.2] + 0.05
    box = inset_images.InsetImage(rng.random((9, 14, 4)), (0.2, 0.1), (0.6, 0.7))
    for picture in (rng.integers(0, 256, (20, 26, 3)).astype(np.uint8), rng.random((20, 26, 4))):
        for margin in (0, 3):
            image_warp.warp_image(picture, old, new, margin)
        inset = box if picture.shape[2] == 4 else inset_images.InsetImage(rng.random((8, 8, 3)), (0.2, 0.1), (0.6, 0.7))
        inset_images.warp_with_insets(picture, old, new, [inset], (24, 30), 1)


def _islands_with_holes():
    V, F = meshes.annulus(14, 3)
    V = bent(V)
    uv = V[:, :2] + 0.03 * np.sin(5 * V[:, [1, 0]])
    drain(refine_island(V, F, uv, balance=0.3))
    drain(refine_island(V, F, uv, pins=(np.array([0, 7]), uv[[0, 7]])))
    folded = uv.copy()
    folded[16] += 0.4
    drain(refine_island(V, F, folded))
    W, G = curved(6)
    weights = near_middle(W, G)
    flat = {
        kind: omt.unwrap(W, G, boundary=kind, quality="draft").uv for kind in ("disk", "square", "rectangle", "free")
    }
    for places in flat.values():
        for options in ({}, {"exact": False, "boundary": "free"}, {"quality": "draft"}):
            omt.magnify(W, G, places, weights, 1.8, **options)
    outline = boundary_loops(G)[0]
    drain(refine_island(W, G, W[:, :2], pins=(outline, W[outline, :2])))


def _flows_in_the_plane():
    V, F = curved(6)
    flat = V[:, :2]
    rows, rest = np.array([24, 25]), np.array([0, 6])
    push = flows.FlowHandle(flat[rows], flat[rows] + [0.1, 0.06], rows)
    held = flows.FlowHandle(flat[rest], flat[rest], rest)
    for domain in (None, flows.ball_domain(np.array([0.6, 0.5]), 1.4, 60)):
        drain(flows.flow(flat, (push, held), flows.FlowOptions(radius=0.4), None, domain))
    S, G = bodies.icosphere(2)
    S = bent(S)
    tip = np.flatnonzero(S[:, 2] > 0.8)
    through = flows.FlowHandle(S[tip], S[tip] + [0.02, 0.05, -1.3], tip)
    drain(flows.flow(S, (through,), flows.FlowOptions(radius=0.25), G, None, 2))


def _parts_of_charts():
    """Charts that lie on themselves, are slit, and have flat sides; deep pockets; loops that are straightened."""
    V, F = curved(9)
    chart = charts.strict_charts(triangle_surface(V, F))[0]
    uv = chart.vertices[:, :2] * [1, 1] + 0
    uv[chart.vertices[:, 0] > 0.8, 0] = 1.6 - uv[chart.vertices[:, 0] > 0.8, 0]
    cost = 1 + 0.3 * np.sin(np.arange(len(uv)))
    parting.parted(chart, uv, cost)
    area, middle = face_areas(V, F), chart.vertices[chart.triangles].mean(axis=1)
    steep = (np.sin(7 * middle[:, 0]) * np.sin(5 * middle[:, 1])) > 0.4
    for rounds, share in ((1, 0.05), (2, 0.2)):
        parting.slits(chart, steep, share * area.sum(), cost, np.arange(len(uv)) % 17 == 3, None, rounds)
    solid = np.ones((4, 2, 2), bool)
    solid[1:3, 1] = False
    W, quads = voxel_surface(solid)
    surface = meshes.polygon_surface(W * [1.0, 1.2, 0.9], quads.tolist())
    drain(unwrap(surface, options=UnwrapOptions(max_shear=1.1)))
    B, G = bodies.bowl(8, 16, 0.1)
    bowl = triangle_surface(bent(B), G)
    costs = seam_costs.seam_costs(bowl)
    pocket_borders(bowl, None, costs)
    ends = np.unique(np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1), axis=0)
    price = np.linalg.norm(V[ends[:, 0]] - V[ends[:, 1]], axis=1) * cost[ends].mean(axis=1)
    network = straight_paths.edge_network(V, F, ends, price)
    loop = np.array([22, 23, 24, 25, 35, 45, 44, 54, 53, 52, 42, 32, 22])
    free = np.zeros(len(V), bool)
    straight_paths.straighten(network, [loop, np.array([11, 12, 22, 23, 33, 34, 44, 45, 55])], free)
    straight_paths.closed_price(V, loop[:-1])


def _volumes_otherwise():
    V, F = bodies.limbed(1)
    V = bent(V * [1, 0.5, 0.8])
    for domain, method in (("cube", "newton"), ("ball", "flow")):
        drain(body_map.volume_map(V, F, domain, method, 200))


# Runs whose figures are kept apart: what is symmetric, or searched, may hang on last digits.
SYMMETRIC = ("other_diagonals", "parts_of_charts")
RUNS = {
    function.__name__.strip("_"): function
    for function in (
        _as_if_very_large, _pinned_charts, _other_diagonals, _polygons_on_spheres, _without_room, _matched_otherwise,
        _pictures, _islands_with_holes, _flows_in_the_plane, _parts_of_charts, _volumes_otherwise,
    )
}  # fmt: skip
