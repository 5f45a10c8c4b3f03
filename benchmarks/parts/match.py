"""Match a body with a remesh of itself, twisted: the truth is known. The plain conformal road stands beside it."""

from __future__ import annotations

import numpy as np

from benchmarks.cases import load_case
from benchmarks.part import Part
from benchmarks.tables import Table, missed
from benchmarks.timing import timed
from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.coarse_meshes import far_vertices
from omt_uv.solver.registration.landmarks import Landmarks
from omt_uv.solver.registration.register import register
from omt_uv.solver.registration.results import RegistrationOptions
from omt_uv.solver.remeshing import RemeshOptions, RemeshSource, remesh
from omt_uv.solver.sphere.sphere_map import sphere_map

CASES = (("homer", "twist"), ("max_planck", "none"))
VERTICES = 2500
LANDMARKS = 8
TWIST = np.radians(60)
ROADS = (
    ("ours", RegistrationOptions()),
    ("conformal", RegistrationOptions(balance=1.0, polish=False)),
)
MEAN_GOAL = 1.0
WORST_GOAL = 3.0
TIME_GOAL = 4.0


def twisted(V, angle):
    """Positions (n,3) turned about the vertical, by ever more up to an angle."""
    height = (V[:, 1] - V[:, 1].min()) / np.ptp(V[:, 1])
    cosine, sine = np.cos(angle * height), np.sin(angle * height)
    return np.column_stack([cosine * V[:, 0] - sine * V[:, 2], V[:, 1], sine * V[:, 0] + cosine * V[:, 2]])


def match_table(_args) -> Table:
    """Errors in percent of the diagonal, flipped area, landmarks met, and time over that of the two maps."""
    columns = {"model": 12, "deformation": 12, "road": 10, "landmarks": 10, "mean %": 7, "p95 %": 7, "flipped": 8}
    table = Table("Matches with twisted remeshes, and without landmarks", columns | {"ratio": 6})
    for name, deformation in CASES:
        case = load_case(name)
        shapes = (case.V, twisted(case.V, TWIST) if deformation == "twist" else case.V)
        source, target = (drain(remesh(_whole(V, case.F), VERTICES, RemeshOptions())) for V in shapes)
        diagonal = np.linalg.norm(np.ptp(shapes[1], axis=0))
        truth = np.einsum("nc,ncd->nd", source.barycentric, shapes[1][case.F[source.faces]])
        maps = sum(_seconds_of_map(mesh) for mesh in (source, target))
        pairs = _pairs(shapes, source, target) if deformation == "twist" else None
        for road, options in ROADS:
            own, other = (source.vertices, source.triangles), (target.vertices, target.triangles)
            found, seconds = timed(lambda a=own, b=other, o=options, p=pairs: drain(register(a, b, p, o)))
            off = 100 * np.linalg.norm(found.forward.positions(*other) - truth, axis=1) / diagonal
            row: dict = {"mean %": float(off.mean()), "p95 %": float(np.quantile(off, 0.95)), "flipped": found.flipped}
            row |= {"landmarks": f"{int(found.met.sum())}/{len(found.met)}", "ratio": seconds / maps}
            goals = {
                "mean": row["mean %"] > MEAN_GOAL * (1 if pairs else 2),
                "p95": pairs is not None and row["p95 %"] > WORST_GOAL,
                "flipped": found.flipped > 0,
                "time": row["ratio"] > TIME_GOAL,
            }
            told = missed(**goals) if road == "ours" else {}
            table.add(model=name, deformation=deformation, road=road, **row, **told)
    return table


def _seconds_of_map(mesh) -> float:
    return timed(lambda: drain(sphere_map(mesh.vertices, mesh.triangles, balance=0.5)))[1]


def _whole(V, F) -> RemeshSource:
    return RemeshSource(V, F, np.zeros((0, 2), np.int64))


def _pairs(shapes, source, target) -> Landmarks:
    """Vertices far from one another, on the remeshes of both shapes."""
    chosen = far_vertices(shapes[0], np.array([shapes[0][:, 1].argmax()]), np.zeros(0, np.int64), LANDMARKS)
    sides: list = []
    for V, mesh in zip(shapes, (source, target), strict=True):
        near = np.array([np.linalg.norm(mesh.vertices - V[k], axis=1).argmin() for k in chosen])
        closest = ClosestPoint(mesh.vertices, mesh.triangles, 0.01 * float(np.ptp(V)))
        found = closest(V[chosen], vertex_normals(mesh.vertices, mesh.triangles)[near])
        sides += [found.faces, found.barycentric]
    return Landmarks(sides[0], sides[1], sides[2], sides[3])


PARTS = (
    Part("match", "a body and its twisted remesh: error of the match, flipped area, landmarks, time over the two maps",
         match_table, by_default=False),
)  # fmt: skip
