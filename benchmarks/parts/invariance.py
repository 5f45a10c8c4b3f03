"""Compare every model with itself mirrored and turned, triangulated anew and subdivided: distances over the floor."""

from __future__ import annotations

import meshes
import numpy as np

from benchmarks.part import MODELS, Part
from benchmarks.tables import Table, missed
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
# Share of the triangles that is left by collapses.
FEWER = 0.6
GOAL = 2.0
CHANGES = ("turned", "remeshed", "subdivided")


def invariance_table(args) -> Table:
    """Raw distances over the floor that the signatures measure, of each model and what was made of it."""
    columns = {"model": 22, "faces": 7, "floor": 8} | dict.fromkeys(CHANGES, 10)
    table = Table("Signatures of one body", columns | {"missed goals": 30})
    for name in args.models or [n for n in CASES if meshes.model_path(n)] or ["icosphere"]:
        V, F = meshes.load_model(name) if meshes.model_path(name) else getattr(meshes, name)()
        try:
            own = drain(signature(V, F, POINTS))
            found = {}
            for change in CHANGES:
                vertices, triangles = _changed(V, F, change)
                distance = shape_distance(own, drain(signature(vertices, triangles, POINTS)))
                found[change] = distance.raw / distance.floor
        except MeshError as error:
            table.add(model=name, faces=len(F), **{"missed goals": str(error)})
            continue
        goals = {change: ratio > GOAL for change, ratio in found.items()}
        table.add(model=name, faces=len(F), floor=own.floor, **found, **missed(**goals))
    return table


def _changed(V, F, change):
    """A mesh (n,3), (m,3) mirrored, turned and three times as large; with fewer triangles; with four for each."""
    if change == "turned":
        turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
        turn *= -np.sign(np.linalg.det(turn))
        return 3 * V @ turn.T + 5, F[:, ::-1]
    return meshes.subdivide(V, F) if change == "subdivided" else _collapsed(V, F)


def _collapsed(V, F):
    """The mesh after Blender's collapses."""
    import bpy

    mesh = bpy.data.meshes.new("own")
    # Blender keeps positions in single precision.
    mesh.from_pydata(((V - V.mean(axis=0)) / np.ptp(V)).tolist(), [], F.tolist())
    obj = bpy.data.objects.new("own", mesh)
    bpy.context.scene.collection.objects.link(obj)
    obj.modifiers.new("fewer", "DECIMATE").ratio = FEWER
    found = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    found.calc_loop_triangles()
    made = np.array([v.co[:] for v in found.vertices]), np.array([t.vertices[:] for t in found.loop_triangles])
    bpy.data.objects.remove(obj)
    return made


PARTS = (
    Part("invariance", "bodies beside themselves, turned, with other triangles: distances over the floor of sampling",
         invariance_table, (MODELS,), by_default=False),
)  # fmt: skip
