"""Closed meshes, and images of the whole globe, in Blender."""

from __future__ import annotations

import bpy

import meshes
import numpy as np
import scenes

ARGUMENTS = {"projection": "LAMBERT"}


def ball(name="Ball", squash=(1.0, 0.8, 1.3), offset=0.0, turn=0.3):
    """A closed, slightly lopsided ellipsoid of triangles, turned so that no vertex is on an axis."""
    V, F = meshes.icosphere(2)
    c, s = np.cos(turn), np.sin(turn)
    V = V @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return scenes.add(V * squash * (1 + V @ [[0.1], [0.07], [0.05]]) + offset, F, name)


def project(**arguments):
    """Run the operator, which must finish; the layout as it is, which may reach beyond the tile."""
    assert bpy.ops.uv.omt_sphere(**{**ARGUMENTS, "inside": False, **arguments}) == {"FINISHED"}


def positions(obj):
    """Positions (n,3) of the vertices."""
    return np.array([tuple(v.co) for v in obj.data.vertices])


def corner_vertices(obj):
    """The vertex (c,) of every corner."""
    return np.array([loop.vertex_index for loop in obj.data.loops])


def open_ball():
    """A sphere without one of its faces."""
    V, F = meshes.icosphere(2)
    return scenes.add(V, F[5:], "Open")


def panorama(name="World", rows=16, columns=32):
    """A smooth image: red goes with the latitude."""
    image = bpy.data.images.new(name, columns, rows, alpha=True)
    values = np.ones((rows, columns, 4), np.float32)
    values[..., 0] = ((np.arange(rows) + 0.5) / rows)[:, None]
    image.pixels.foreach_set(values.ravel())
    image.update()
    return image


def red_of(image):
    """The red channel (h,w) of an image."""
    values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)[..., 0]


def assert_lambert(red):
    """Red goes with the latitude of Lambert's projection."""
    rows = len(red)
    latitude = np.arcsin(2 * (np.arange(rows) + 0.5) / rows - 1) / np.pi + 0.5
    assert np.abs(red - latitude[:, None]).max() < 0.03
