"""Two patches, and figures of them by plain formulas, which know nothing of the solver."""

from __future__ import annotations

import bpy

import numpy as np
import scenes


def two_patches():
    """Two curved patches of triangles with UVs of their own, some of which are turned over, in two materials."""
    rng = np.random.default_rng(7)
    for name, offset in (("A", 0.0), ("B", 3.0)):
        obj = scenes.bump(name=name, offset=offset)
        mesh = obj.data
        corners = np.array([p.vertices[:] for p in mesh.polygons])
        points = np.array([v.co[:] for v in mesh.vertices])
        bpy.data.objects.remove(obj)
        faces = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
        obj = scenes.add(points, faces, name)
        plane = points[:, :2] * [0.2, 0.3] + [offset / 6, 0] + rng.normal(0, 0.009, (len(points), 2))
        scenes.set_uv(obj, plane[faces.ravel()])
        for colour in ("red", "blue"):
            obj.data.materials.append(bpy.data.materials.get(colour) or bpy.data.materials.new(colour))
        for polygon in obj.data.polygons:
            polygon.material_index = polygon.index % 3 // 2
    scenes.select(list(bpy.data.objects))


def read(*names):
    """Positions (m,3,3), UVs (m,3,2), corners' vertices (m,3) counted over all, and materials (m,) of the scene, or of
    the objects that are named."""
    points, uv, corners, material, count = [], [], [], [], 0
    for obj in map(bpy.data.objects.get, names) if names else bpy.context.scene.objects:
        mesh = obj.data
        P = np.array([(obj.matrix_world @ v.co)[:] for v in mesh.vertices])
        C = np.array([p.vertices[:] for p in mesh.polygons])
        points.append(P[C])
        corners.append(C + count)
        uv.append(np.array([d.vector[:] for d in mesh.uv_layers.active.uv], float).reshape(-1, 3, 2))
        material += [mesh.materials[p.material_index].name for p in mesh.polygons]
        count += len(P)
    return np.concatenate(points), np.concatenate(uv), np.concatenate(corners), np.array(material)


def areas(P):
    """Areas (m,) of triangles (m,3,3) in space."""
    return np.linalg.norm(np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0]), axis=1) / 2


def signed(UV):
    """Areas (m,) of UVs, below 0 where they are turned over."""
    a, b = UV[:, 1] - UV[:, 0], UV[:, 2] - UV[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def overlap(UV, count=4000):
    """About the share of the area that is under several triangles, by points of each as it has area."""
    rng = np.random.default_rng(3)
    size = np.abs(signed(UV))
    owner, w = rng.choice(len(UV), count, p=size / size.sum()), rng.dirichlet([1, 1, 1], count)
    points = np.einsum("kc,kcd->kd", w, UV[owner])
    sides = [UV[:, (k + 1) % 3] - UV[:, k] for k in range(3)]
    cross = [s[:, 0] * (points[:, None, 1] - UV[:, k, 1]) - s[:, 1] * (points[:, None, 0] - UV[:, k, 0])
             for k, s in enumerate(sides)]  # fmt: skip
    inside = (np.min(cross, axis=0) > 0) | (np.max(cross, axis=0) < 0)
    return (inside.sum(axis=1) > 1).mean()


def shears(P, UV):
    """Ratios (m,) of the singular values of the maps from triangles to their UVs."""
    found = []
    for p, q in zip(P, UV, strict=True):
        x = (p[1] - p[0]) / np.linalg.norm(p[1] - p[0])
        y = p[2] - p[0] - x * (x @ (p[2] - p[0]))
        y /= np.linalg.norm(y)
        E = np.array([[x @ (p[k] - p[0]), y @ (p[k] - p[0])] for k in (1, 2)]).T
        s = np.linalg.svd(np.array([q[1] - q[0], q[2] - q[0]]).T @ np.linalg.inv(E), compute_uv=False)
        found.append(s[0] / s[1])
    return np.array(found)


def quantile(values, weight, share):
    """The least value that at least such a share of the weight does not exceed."""
    order = np.argsort(values)
    return values[order][np.searchsorted(np.cumsum(weight[order]), share * weight.sum())]
