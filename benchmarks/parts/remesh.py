"""Remesh to 5,000 vertices, beside Blender's QuadriFlow and Decimate, and by the four strategies of B. Gu 2018.

Shapes are of triangles, quads cut along a diagonal. Distances are both ways, in shares of the box's diagonal.
"""

from __future__ import annotations

from typing import Any

import bpy

import numpy as np

from benchmarks.cases import load_case
from benchmarks.part import MODELS, Part
from benchmarks.rivals import make_object, remove_object
from benchmarks.tables import Table, missed
from benchmarks.timing import timed
from omt_uv.solver.mesh.closest_point import ClosestPoint, spread_points
from omt_uv.solver.mesh.geometry import angles_from_lengths, face_areas, halfedge_lengths
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import halfedges, pair_keys
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import STRATEGIES, RemeshOptions, RemeshSource, remesh

DEFAULT_MODELS = ("lion", "face", "max_planck", "rocker_arm")
VERTEX_COUNT = 5000
# What our meshes should reach.
ANGLE_GOAL = 39.0  # degrees that 99 of 100 triangles' smallest angles have at least
BELOW_30_GOAL = 0.1  # per cent of triangles
EDGE_GOAL = 0.10  # standard deviation of lengths over their mean
TIME_GOAL = 3.0  # times the time of our unwrap
POINTS_AN_EDGE = 3  # of the new mesh: how dense the points are whose distances are taken
STRATEGY_FIGURES = ("angle_p1", "edge_cv", "area_cv")


def shape(V, F):
    """angle_p1 (degrees), pct_below_30, edge_cv, area_cv of triangles."""
    least = np.degrees(angles_from_lengths(halfedge_lengths(V, F).reshape(-1, 3)).min(axis=1))
    a, b = halfedges(F)
    edges = np.unique(pair_keys(a, b))
    length = np.linalg.norm(V[edges >> 32] - V[edges & 0xFFFFFFFF], axis=1)
    area = face_areas(V, F)
    return {
        "angle_p1": float(np.percentile(least, 1)),
        "below 30 %": float(100 * (least < 30).mean()),
        "edge_cv": float(length.std() / length.mean()),
        "area_cv": float(area.std() / area.mean()),
    }


def distances(V, F, W, G):
    """Largest and root mean square distance of two meshes, over the diagonal of the first."""
    spacing = np.sqrt(face_areas(V, F).sum() / VERTEX_COUNT)
    largest, squares = [], []
    for source, target in (((V, F), (W, G)), ((W, G), (V, F))):
        owner, points = spread_points(*source, spacing / POINTS_AN_EDGE)
        weight = (face_areas(*source) / np.bincount(owner, minlength=len(source[1])))[owner]
        # Without normals the search is by position alone.
        found = ClosestPoint(*target, spacing)(points, np.zeros(points.shape))
        d = np.linalg.norm(found.points - points, axis=1)
        largest.append(d.max())
        squares.append(np.average(d**2, weights=weight))
    diagonal = np.linalg.norm(np.ptp(V, axis=0))
    return {"hausdorff": max(largest) / diagonal, "rms": float(np.sqrt(np.mean(squares))) / diagonal}


def _triangles_of(obj):
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    V, F = np.empty(3 * len(mesh.vertices), np.float32), np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.vertices.foreach_get("co", V)
    mesh.loop_triangles.foreach_get("vertices", F)
    return V.reshape(-1, 3).astype(float), F.reshape(-1, 3).astype(np.int64)


def quadriflow(V, F, vertex_count=VERTEX_COUNT):
    """Blender's QuadriFlow with as many quads as vertices are asked for; the mesh and its processor seconds."""
    obj = make_object(V, F)
    _, seconds = timed(lambda: bpy.ops.object.quadriflow_remesh(mode="FACES", target_faces=vertex_count, seed=0))
    found = _triangles_of(obj)
    remove_object(obj)
    return found, seconds


def decimate(V, F):
    """Blender's Decimate modifier; the mesh and its processor seconds."""
    obj = make_object(V, F)
    modifier = obj.modifiers.new("Decimate", "DECIMATE")
    modifier.ratio = min(1.0, 2 * VERTEX_COUNT / len(F))
    found, seconds = timed(lambda: _triangles_of(obj))
    remove_object(obj)
    return found, seconds


def ours(V, F):
    """Our remeshing; the mesh and its processor seconds."""
    result, seconds = timed(lambda: drain(remesh(RemeshSource(V, F), VERTEX_COUNT)))
    return (result.vertices, result.triangles), seconds


METHODS = {"ours": ours, "QuadriFlow": quadriflow, "Decimate": decimate}


def _model(name):
    case = load_case(name)
    used, place = np.unique(case.F, return_inverse=True)
    return case.V[used], place.reshape(-1, 3)


def remesh_table(args) -> Table:
    """One row for every model and method."""
    table = Table(
        f"Remeshed to {VERTEX_COUNT} vertices; ratio = time / time of our unwrap",
        {"model": 15, "method": 15, "vertices": 8, "angle_p1": 8, "below 30 %": 10, "edge_cv": 8, "area_cv": 8}
        | {"hausdorff": 9, "rms": 9, "time": 8, "ratio": 7, "missed goals": 20},
    )
    for name in args.models or DEFAULT_MODELS:
        V, F = _model(name)
        _, unit = timed(lambda V=V, F=F: drain(unwrap(triangle_surface(V, F))))
        for method, work in METHODS.items():
            (W, G), seconds = work(V, F)
            row = {**shape(W, G), **distances(V, F, W, G), "time": seconds, "ratio": seconds / unit}
            goals = {**missed_bars(row), "time": row["ratio"] > TIME_GOAL} if method == "ours" else {}
            table.add(model=name, method=method, vertices=len(W), **row, **missed(**goals))
    return table


def missed_bars(row):
    """What the meshes of ours are to keep, by name, each with whether it is missed."""
    angles = row["angle_p1"] < ANGLE_GOAL or row["below 30 %"] > BELOW_30_GOAL
    return {"angles": angles, "edges": row["edge_cv"] > EDGE_GOAL}


def strategies_table(args) -> Table:
    """Sampled on one map, triangulated on another: alone, and relaxed and fitted as the strategy has it."""
    table = Table(
        "Strategies: sampled on the first map, triangulated on the second; then relaxed and fitted",
        {"model": 15, "strategy": 15}
        | {f"{c} {when}": 16 for when in ("raw", "relaxed") for c in STRATEGY_FIGURES}
        | {"best": 6},
    )
    for name in args.models or DEFAULT_MODELS:
        source = RemeshSource(*_model(name))
        rows = {strategy: _strategy(source, strategy) for strategy in STRATEGIES}
        for strategy, row in rows.items():
            others = [other for key, other in rows.items() if key != strategy]
            best = all(row["angle_p1 relaxed"] > other["angle_p1 relaxed"] for other in others)
            for spread in ("edge_cv relaxed", "area_cv relaxed"):
                best &= all(row[spread] < other[spread] for other in others)
            table.add(model=name, strategy=strategy, **row, best="in all" if best else "")
    return table


def _strategy(source, strategy):
    """Figures of one strategy, raw and relaxed."""
    row: dict[str, float] = {}
    ways: dict[str, dict[str, Any]] = {"raw": {"rounds": 0, "fit": False}, "relaxed": {}}
    for when, options in ways.items():
        found = drain(remesh(source, VERTEX_COUNT, RemeshOptions(strategy=strategy, **options)))
        row |= {f"{c} {when}": v for c, v in shape(found.vertices, found.triangles).items() if c in STRATEGY_FIGURES}
    return row


PARTS = (
    Part("remesh", "triangles, distances and time beside QuadriFlow and Decimate", remesh_table, (MODELS,)),
    Part("strategies", "the four strategies of B. Gu 2018, raw and relaxed", strategies_table, (MODELS,)),
)
