"""Draw docs/pictures/quads.png: quad meshes by Minimum Stretch, as triangles, and as the polygons that they are.

    python scripts/pictures/quad_plate.py [OUT.png]

A torus, suzanne and a sphere with seams marked by hand, the same for all three maps.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import compare
import renders
import rival_maps

from omt_uv.blender.seams import mark_seams
from omt_uv.solver.analysis.feature_edges import edge_union

PIXELS = 300
CELLS = 250  # of the checker, on a body
NEAR = 1e-3  # how far from a plane or a circle, at most, the vertices of a seam are
COLUMNS = ["Minimum Stretch", "OMT UV, as triangles", "OMT UV, as quads"]


def torus(points):
    """A minor ring, and the inner ring."""
    radius = np.hypot(points[:, 0], points[:, 1])
    on_ring = np.abs(np.arctan2(points[:, 1], points[:, 0])) < NEAR
    return [on_ring, radius < radius.min() + NEAR]


def suzanne(points):
    """The plane of symmetry behind the face."""
    return [(np.abs(points[:, 0]) < NEAR) & (points[:, 1] > -0.3)]


def sphere(points):
    """One meridian."""
    return [(np.abs(points[:, 0]) < NEAR) & (points[:, 1] > -NEAR)]


BODIES = {
    "torus": (lambda: bpy.ops.mesh.primitive_torus_add(major_segments=48, minor_segments=12), torus),
    "suzanne": (bpy.ops.mesh.primitive_monkey_add, suzanne),
    "sphere": (lambda: bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16), sphere),
}
VIEWS = {
    "torus": renders.View("Z", -60, 45),
    "suzanne": renders.View("Z", -25, 12),
    "sphere": renders.View("Z", 60, 20),
}


def body(name, as_triangles=False):
    """The object with its seams, its quads cut into triangles or not."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add, seams = BODIES[name]
    add()
    obj = bpy.context.object
    points = np.array([v.co[:] for v in obj.data.vertices])
    edges = np.array([e.vertices[:] for e in obj.data.edges])
    mark_seams(obj, edges[np.any([on[edges].all(axis=1) for on in seams(points)], axis=0)])
    if as_triangles:
        obj.modifiers.new("triangles", "TRIANGULATE").quad_method = "FIXED"
        bpy.ops.object.modifier_apply(modifier="triangles")
    return obj


def maps_of(name):
    """The maps of a body by column."""
    ours = rival_maps.ours(body(name), max_shear=0.0)
    obj = body(name)
    marked = np.array([e.vertices[:] for e in obj.data.edges if e.use_seam])
    stretch = rival_maps.blender_unwrap(obj, edge_union(ours.cut, marked), "Minimum Stretch 50")
    return {"stretch": stretch, "triangles": rival_maps.ours(body(name, True), max_shear=0.0), "ours": ours}


def main():
    """Map, draw, and write the plate."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/pictures/quads.png"
    maps = {name: maps_of(name) for name in BODIES}
    compare.draw_bodies(path, COLUMNS, maps, VIEWS, CELLS, PIXELS)


if __name__ == "__main__":
    main()
