"""Make of a mesh what still shows the same body: moved, with other triangles, noisy, bent.

Every function takes a mesh, a pair of positions (n,3) and triangles (m,3), and returns another.
"""

from __future__ import annotations

import meshes
import numpy as np


def moved(mesh, mirrored=False, seed=1):
    """Turned, three times as large and elsewhere; mirrored if asked for."""
    V, F = mesh
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    if (np.linalg.det(turn) < 0) != mirrored:
        turn = -turn
    return 3 * V @ turn.T + 5, F[:, ::-1] if mirrored else F


def collapsed(mesh, count):
    """`count` triangles, if there are more, by Blender's collapses."""
    import bpy

    V, F = mesh
    if len(F) <= count:
        return mesh
    data = bpy.data.meshes.new("own")
    # Blender keeps positions in single precision.
    data.from_pydata(((V - V.mean(axis=0)) / np.ptp(V)).tolist(), [], F.tolist())
    obj = bpy.data.objects.new("own", data)
    bpy.context.scene.collection.objects.link(obj)
    obj.modifiers.new("fewer", "DECIMATE").ratio = count / len(F)
    found = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    found.calc_loop_triangles()
    made = np.array([v.co[:] for v in found.vertices]), np.array([t.vertices[:] for t in found.loop_triangles])
    bpy.data.objects.remove(obj)
    return made


def triangulated_anew(mesh, share=0.8):
    """Four triangles for each, of which collapses leave a share of the number of before."""
    return collapsed(meshes.subdivide(*mesh), round(share * len(mesh[1])))


def noisy(mesh, deviation=0.002, seed=0):
    """Every coordinate off by a share of the greatest extent."""
    V, F = mesh
    size = np.ptp(V, axis=0).max()
    return V + deviation * size * np.random.default_rng(seed).normal(size=V.shape), F


def bent(mesh, degrees=40):
    """Bent to an arc along its longest axis."""
    V, F = mesh
    centred = V - V.mean(axis=0)
    along = int(np.ptp(centred, axis=0).argmax())
    across = (along + 1) % 3
    angle = np.radians(degrees) / np.ptp(centred[:, along])
    radius = 1 / angle - centred[:, across]
    turned = angle * centred[:, along]
    made = centred.copy()
    made[:, along], made[:, across] = radius * np.sin(turned), 1 / angle - radius * np.cos(turned)
    return made, F
