"""One body in seven poses, each remeshed apart: a stand-in for the poses of the Armadillo of Su 2015, section 4.3.

The body is of Blender's Skin modifier around a skeleton, and an armature poses it, so that what corresponds is known.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy

import numpy as np

# Joints of the skeleton: where they are, and how thick the body is there.
JOINTS = {
    "hip": ((0, 0, 1.0), 0.17), "spine": ((0, 0, 1.25), 0.15), "chest": ((0, 0, 1.5), 0.19),
    "neck": ((0, 0, 1.68), 0.07), "head": ((0, 0, 1.85), 0.13),
    "shoulder.L": ((0.22, 0, 1.55), 0.09), "elbow.L": ((0.5, 0, 1.5), 0.065), "hand.L": ((0.78, 0, 1.48), 0.05),
    "shoulder.R": ((-0.22, 0, 1.55), 0.09), "elbow.R": ((-0.5, 0, 1.5), 0.065), "hand.R": ((-0.78, 0, 1.48), 0.05),
    "thigh.L": ((0.12, 0, 0.92), 0.11), "knee.L": ((0.14, 0.02, 0.5), 0.08), "foot.L": ((0.15, 0, 0.08), 0.06),
    "toe.L": ((0.15, -0.18, 0.04), 0.05), "thigh.R": ((-0.12, 0, 0.92), 0.11),
    "knee.R": ((-0.14, 0.02, 0.5), 0.08), "foot.R": ((-0.15, 0, 0.08), 0.06), "toe.R": ((-0.15, -0.18, 0.04), 0.05),
    "nose": ((0, -0.16, 1.84), 0.03),
}  # fmt: skip
CHAINS = (
    ("hip", "spine", "chest", "neck", "head", "nose"),
    ("chest", "shoulder.L", "elbow.L", "hand.L"),
    ("chest", "shoulder.R", "elbow.R", "hand.R"),
    ("hip", "thigh.L", "knee.L", "foot.L", "toe.L"),
    ("hip", "thigh.R", "knee.R", "foot.R", "toe.R"),
)
# Turns of bones, which end in the joint of their name: about an axis of the world, by degrees.
POSES = {
    "rest": (),
    "bend": (("spine", "X", 30), ("chest", "X", 30)),
    "twist": (("spine", "Z", 20), ("chest", "Z", 20), ("neck", "Z", 20)),
    "arms": (("elbow.L", "Y", -60), ("elbow.R", "Y", 60)),
    "step": (("knee.L", "X", -60), ("foot.L", "X", 60), ("elbow.L", "Z", -40)),
    "wave": (("hand.L", "Z", -70), ("hand.R", "Y", -50), ("neck", "X", 20)),
    "split": (("knee.L", "Y", -30), ("knee.R", "Y", 30), ("spine", "Y", 20)),
}
# Where landmarks are on the body at rest: nose, crown, hands, toes, belly, back, shoulders, knees.
LANDMARKS = np.array([
    (0, -0.19, 1.84), (0, 0, 1.98), (0.83, 0, 1.48), (-0.83, 0, 1.48), (0.15, -0.23, 0.04), (-0.15, -0.23, 0.04),
    (0, -0.17, 1.0), (0, 0.19, 1.5), (0.22, 0, 1.64), (-0.22, 0, 1.64), (0.14, -0.06, 0.5), (-0.14, -0.06, 0.5),
])  # fmt: skip
SUBDIVISIONS = 3


@dataclass(frozen=True)
class Pose:
    """A posed body, and a remesh of it: positions (n,3), triangles (m,3), and where each of its vertices lies on the
    body, triangle (n,) and coordinates (n,3); places (l,3) of the landmarks."""

    body: np.ndarray
    vertices: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    barycentric: np.ndarray
    landmarks: np.ndarray


def poses(count: int, folder: Path) -> tuple[np.ndarray, dict[str, Pose]]:
    """Triangles (m,3) of the body and its poses, remeshed to `count` vertices; kept in a folder."""
    path = folder / f"poses_{count}.npz"
    if not path.exists():
        triangles, bodies = _posed()
        arrays = {"triangles": triangles}
        for name, V in bodies.items():
            arrays |= {f"{name} {key}": value for key, value in _remeshed(V, triangles, count).items()}
        folder.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(path, **arrays)
    kept = np.load(path)
    rest, triangles = kept["rest body"], kept["triangles"]
    near = np.linalg.norm(rest[:, None] - LANDMARKS, axis=2).argmin(axis=0)
    keys = ("body", "vertices", "triangles", "faces", "barycentric")
    return triangles, {
        name: Pose(**{key: kept[f"{name} {key}"] for key in keys}, landmarks=kept[f"{name} body"][near])
        for name in POSES
    }


def _remeshed(V: np.ndarray, triangles: np.ndarray, count: int) -> dict[str, np.ndarray]:
    """A body (n,3), (m,3) and its remesh, as arrays to be kept."""
    from omt_uv.solver.progress import drain
    from omt_uv.solver.remeshing import RemeshOptions, RemeshSource, remesh

    found = drain(remesh(RemeshSource(V, triangles, np.zeros((0, 2), np.int64)), count, RemeshOptions()))
    return {
        "body": V,
        "vertices": found.vertices,
        "triangles": found.triangles,
        "faces": found.faces,
        "barycentric": found.barycentric,
    }


def _posed() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Triangles (m,3) of the body, and its vertices (n,3) in every pose."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    body, rig = rigged()
    found = {}
    for name, turns in POSES.items():
        pose(rig, turns)
        found[name], triangles = shape_of(body)
    return triangles, found


def rigged() -> tuple[bpy.types.Object, bpy.types.Object]:
    """The body, and the armature that moves it."""
    body, rig = _body(), _rig()
    _choose(rig, body)
    bpy.ops.object.parent_set(type="ARMATURE_AUTO")
    return body, rig


def pose(rig: bpy.types.Object, turns) -> None:
    """Put an armature at rest, and turn bones: name, axis of the world, degrees."""
    for bone in rig.pose.bones:
        bone.matrix_basis.identity()
    bpy.context.view_layer.update()
    for turn in turns:
        _turn(rig.pose.bones[turn[0]], *turn[1:])


def shape_of(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3), as modifiers leave them, and triangles (m,3) of an object."""
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    mesh.calc_loop_triangles()
    return positions.reshape(-1, 3).astype(float), np.array([t.vertices[:] for t in mesh.loop_triangles])


def _body() -> bpy.types.Object:
    """The skeleton with skin, subdivided."""
    names = list(JOINTS)
    bones = [(names.index(a), names.index(b)) for chain in CHAINS for a, b in pairwise(chain)]
    mesh = bpy.data.meshes.new("skeleton")
    mesh.from_pydata([JOINTS[name][0] for name in names], bones, [])
    skeleton = bpy.data.objects.new("skeleton", mesh)
    bpy.context.collection.objects.link(skeleton)
    _choose(skeleton)
    skeleton.modifiers.new("skin", "SKIN")
    for name, skin in zip(names, mesh.skin_vertices[0].data, strict=True):
        skin.radius = (JOINTS[name][1], JOINTS[name][1])
    mesh.skin_vertices[0].data[0].use_root = True
    skeleton.modifiers.new("smooth", "SUBSURF").levels = SUBDIVISIONS
    whole = bpy.data.meshes.new_from_object(skeleton.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(skeleton)
    body = bpy.data.objects.new("body", whole)
    bpy.context.collection.objects.link(body)
    return body


def _rig() -> bpy.types.Object:
    """A bone between joints, but for the nose, named by that in which it ends."""
    rig = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
    bpy.context.collection.objects.link(rig)
    _choose(rig)
    bpy.ops.object.mode_set(mode="EDIT")
    bones: dict = {}
    for chain in CHAINS:
        for a, b in pairwise(chain):
            if b == "nose":
                continue
            bones[b] = rig.data.edit_bones.new(b)
            bones[b].head, bones[b].tail = JOINTS[a][0], JOINTS[b][0]
            if a in bones:
                bones[b].parent = bones[a]
    bpy.ops.object.mode_set(mode="OBJECT")
    return rig


def _choose(*objects: bpy.types.Object) -> None:
    """Select objects, the first active."""
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]


def _turn(bone: bpy.types.PoseBone, axis: str, degrees: float) -> None:
    """Turn a bone of a pose about its head."""
    from mathutils import Matrix

    turn = Matrix.Rotation(np.radians(degrees), 4, axis)
    bone.matrix = Matrix.Translation(bone.head) @ turn @ Matrix.Translation(-bone.head) @ bone.matrix
    bpy.context.view_layer.update()
