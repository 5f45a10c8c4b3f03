"""Move bodies by handles that chance has chosen, and map their insides: volumes, faces that meet, what is inverted."""

from __future__ import annotations

import meshes
import numpy as np

from benchmarks.part import MODELS, Option, Part
from benchmarks.tables import Table, missed
from benchmarks.timing import peak_mib, timed
from omt_uv.solver.errors import MeshError
from omt_uv.solver.flows.flow_map import flow
from omt_uv.solver.flows.handles import FlowHandle, farthest_points
from omt_uv.solver.flows.options import FlowOptions
from omt_uv.solver.progress import drain
from omt_uv.solver.volumes.body_map import volume_map

FLOW_BODIES = ("suzanne", "woody", "snail", "spot", "cow", "teapot", "fertility", "max_planck", "homer", "camel_b")
VOLUME_BODIES = ("max_planck", "spot", "bunny_small", "homer", "rocker_arm")
# Where no model is at hand.
STAND_IN = ("icosphere",)
SEEDS = Option("seeds", (0,), "of handles, one flow of a body for each; default 0", {"nargs": "+", "type": int})
HANDLES = Option("handles", 6, "single vertices, default 6; 20 are far from one another", {"type": int})
LEAST = Option("least", 0, "vertices: faces are divided into four until there are so many", {"type": int})
WAY = Option("way", 0.1, "of a handle, as a share of the diagonal", {"type": float})
TETS = Option("tets", 40_000, "tetrahedra, about", {"type": int})
# From so many handles on they are chosen far from one another, as an artist's are.
SPREAD = 20
VOLUME_GOAL = 1e-4
MET_GOAL = 1e-6
BACK_GOAL = 1e-4
SHARE_GOAL = 0.01
MEMORY_GOAL = 4096


def chance_handles(V, seed: int, count: int, way: float) -> tuple[FlowHandle, ...]:
    """Handles of single vertices of a body (n,3) that go a share of its diagonal, chosen by chance."""
    rng = np.random.default_rng(seed)
    used = np.flatnonzero(np.isfinite(V).all(axis=1))
    rows = farthest_points(V, 0.0, count) if count >= SPREAD else rng.choice(used, count, replace=False)
    moves = rng.normal(size=(count, 3))
    moves *= way * np.linalg.norm(np.ptp(V, axis=0)) / np.linalg.norm(moves, axis=1)[:, None]
    return tuple(FlowHandle(V[[r]], V[[r]] + move, np.array([r])) for r, move in zip(rows, moves, strict=True))


def back_again(V, handles, found) -> float:
    """How far points are from where they were after the flow alone and the one that takes it back, of the diagonal."""
    size = float(np.linalg.norm(np.ptp(V, axis=0)))
    only = FlowOptions(diagonal=size, mend=False)
    there = drain(flow(V, handles, only)).positions
    returning = tuple(FlowHandle(h.end, h.start, h.vertices) for h in handles)
    return float(np.abs(drain(flow(there, returning, only)).positions - V).max()) / size


def flows_table(args) -> Table:
    """Bodies moved at single vertices; worst figures of all seeds, and the sum of pairs that newly intersect."""
    columns = {"model": 15, "vertices": 8, "flows": 5, "handles off": 11, "volume": 9, "new pairs": 9, "in flows": 8}
    table = Table("Flows of handles chosen by chance", columns | {"back": 9, "seconds": 8, "missed goals": 24})
    for name in _named(args, FLOW_BODIES):
        V, F = _loaded(name)
        while len(V) < args.least:
            V, F = meshes.subdivide(V, F)
        rows = []
        for seed in args.seeds:
            handles = chance_handles(V, seed, args.handles, args.way)
            found, seconds = timed(lambda v=V, f=F, h=handles: drain(flow(v, h, FlowOptions(), f)))
            off = max(float(np.abs(found.positions[h.vertices] - h.end).max()) for h in handles)
            size = float(np.linalg.norm(np.ptp(V, axis=0)))
            worst = float(np.abs(found.volumes).max(initial=0.0))
            rows.append((off / size, worst, len(found.intersecting), back_again(V, handles, found), seconds))
        off, volume, pairs, back, seconds = np.array(rows).T
        goals = {
            "handles": off.max() > MET_GOAL,
            "volume": volume.max() > VOLUME_GOAL,
            "intersections": pairs.sum() > 0,
            "back": back.max() > BACK_GOAL,
        }
        row = {"handles off": off.max(), "volume": volume.max(), "new pairs": int(pairs.sum()), "back": back.max()}
        row |= {"in flows": int((pairs > 0).sum()), "seconds": float(np.median(seconds))}
        table.add(model=name, vertices=len(V), flows=len(rows), **row, **missed(**goals))
    return table


def volumes_table(args) -> Table:
    """Insides mapped to the ball: what is inverted and off, and time and memory; or why a body is refused."""
    columns = {"model": 15, "tetrahedra": 10, "inverted": 8, "off": 9, "at vertices": 11, "seconds": 8, "MiB": 6}
    table = Table("Insides mapped to the ball", columns | {"missed goals": 14, "refused": 60})
    for name in _named(args, VOLUME_BODIES):
        V, F = _loaded(name)
        try:
            found, seconds = timed(lambda v=V, f=F: drain(volume_map(v, f, count=args.tets)))
        except MeshError as error:
            table.add(model=name, refused=str(error))
            continue
        memory = peak_mib()
        goals = {
            "inverted": found.inverted > 0,
            "volume": found.shares > SHARE_GOAL,
            "memory": memory > MEMORY_GOAL,
        }
        row = {"tetrahedra": len(found.tets), "inverted": found.inverted, "off": found.shares, "MiB": memory}
        table.add(model=name, seconds=seconds, **{"at vertices": found.around_vertices}, **row, **missed(**goals))
    return table


def _named(args, usual) -> list[str]:
    """The models that were asked for, or the usual ones at hand, or a stand-in."""
    return list(args.models or [name for name in usual if meshes.model_path(name)] or STAND_IN)


def _loaded(name: str):
    return meshes.load_model(name) if meshes.model_path(name) else getattr(meshes, name)()


PARTS = (
    Part("flows", "bodies moved by handles chosen by chance: volumes, new intersections, the way back, time",
         flows_table, (MODELS, SEEDS, HANDLES, WAY, LEAST), by_default=False),
    Part("volumes", "insides mapped to the ball: inverted tetrahedra, volumes, time, memory; refusals",
         volumes_table, (MODELS, TETS), by_default=False),
)  # fmt: skip
