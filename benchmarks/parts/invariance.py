"""Compare every model with itself mirrored and turned, triangulated anew and subdivided: distances over the floor."""

from __future__ import annotations

import meshes

from benchmarks.part import MODELS, Part
from benchmarks.tables import Table, missed
from benchmarks.variants import collapsed, moved
from omt_uv.solver.errors import MeshError
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.signature import signature
from omt_uv.solver.signatures.wasserstein import shape_distance

# Closed bodies, and what is one once its holes are filled.
CASES = (
    "woody", "suzanne", "snail", "camel_b", "hemisphere", "spot", "cow", "alligator", "teapot", "lilium", "bunny_small",
    "optcuts_max_planck_i", "optcuts_bimba_i", "optcuts_lion_o", "optcuts_bunny_i", "optcuts_face", "max_planck",
    "homer", "lion", "david",
)  # fmt: skip
POINTS = 1000
# Of finer models so many triangles are left by collapses before anything else, since one change makes four of each.
MOST = 6000
# Share of the triangles that is left by collapses.
FEWER = 0.6
GOAL = 2.0
CHANGES = {
    "turned": lambda mesh: moved(mesh, mirrored=True),
    "remeshed": lambda mesh: collapsed(mesh, round(FEWER * len(mesh[1]))),
    "subdivided": lambda mesh: meshes.subdivide(*mesh),
}


def invariance_table(args) -> Table:
    """Raw distances over the floor that the signatures measure, of each model and what was made of it."""
    columns = {"model": 22, "faces": 7, "floor": 8} | dict.fromkeys(CHANGES, 10)
    table = Table("Signatures of one body", columns | {"missed goals": 30})
    for name in args.models or [n for n in CASES if meshes.model_path(n)] or ["icosphere"]:
        own = collapsed(meshes.load_model(name) if meshes.model_path(name) else getattr(meshes, name)(), MOST)
        try:
            first = _signature(own)
            found = {}
            for change, made in CHANGES.items():
                distance = shape_distance(first, _signature(made(own)))
                found[change] = distance.raw / distance.floor
        except MeshError as error:
            table.add(model=name, faces=len(own[1]), **{"missed goals": str(error)})
            continue
        goals = {change: ratio > GOAL for change, ratio in found.items()}
        table.add(model=name, faces=len(own[1]), floor=first.floor, **found, **missed(**goals))
    return table


def _signature(mesh):
    V, F = mesh
    return drain(signature(V, F, POINTS))


PARTS = (
    Part("invariance", "bodies beside themselves, turned, with other triangles: distances over the floor of sampling",
         invariance_table, (MODELS,), by_default=False),
)  # fmt: skip
