"""Surfaces with a thickness, boxes with rounded edges, and what tells their sides apart."""

from __future__ import annotations

import numpy as np

from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.mesh.topology import halfedges, twins


def thickened(V, F, thickness):
    """An open surface with a thickness: its faces, those of the other side, and a border of two triangles an edge."""
    V, F = np.asarray(V, float), np.asarray(F)
    way, n = thickness / 2 * vertex_normals(V, F), len(V)
    tail, head = (ends[twins(F) < 0] for ends in halfedges(F))
    border = [np.column_stack([head, tail, tail + n]), np.column_stack([head, tail + n, head + n])]
    return np.concatenate([V + way, V - way]), np.concatenate([F, F[:, ::-1] + n, *border])


def inner_edges(V, F):
    """Both halfedges (e,2) of the inner edges of a mesh, and their lengths (e,)."""
    twin = twins(F)
    pair = np.array([[h, t] for h, t in enumerate(twin) if h < t])
    tail, head = (ends[pair[:, 0]] for ends in halfedges(F))
    return pair, np.linalg.norm(V[tail] - V[head], axis=1)


def tube(columns=32, rows=12, height=2.0):
    """The wall of a cylinder, open at both ends."""
    angle = 2 * np.pi * np.arange(columns) / columns
    around, z = np.column_stack([np.cos(angle), np.sin(angle)]), np.linspace(0, height, rows + 1)
    V = np.column_stack([np.tile(around, (rows + 1, 1)), np.repeat(z, columns)])
    i, j = np.divmod(np.arange(rows * columns), columns)
    a, b = i * columns + j, i * columns + (j + 1) % columns
    return V, np.concatenate([np.column_stack([a, b, b + columns]), np.column_stack([a, b + columns, a + columns])])


def rounded_box(size, radius, segments):
    """A box of half extents size (3,) whose edges are rounded with so many segments, as vertices and quads."""
    bow = radius * (1 - np.tan(np.linspace(np.pi / 4, 0, segments + 1)))
    lines = [np.concatenate([-s + bow, (s - bow)[::-1]]) for s in size]
    places, quads = {}, []

    def number(point):
        return places.setdefault(tuple(np.round(point, 12)), len(places))

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1, 1):
            for i in range(len(lines[u]) - 1):
                for j in range(len(lines[v]) - 1):
                    corners = []
                    for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))[::sign]:
                        point = np.empty(3)
                        point[axis], point[u], point[v] = sign * size[axis], lines[u][a], lines[v][b]
                        corners.append(number(point))
                    quads.append(corners)
    on_box = np.array(list(places))
    inside = np.clip(on_box, radius - np.array(size), np.array(size) - radius)
    way = on_box - inside
    return inside + radius * way / np.linalg.norm(way, axis=1)[:, None], quads
