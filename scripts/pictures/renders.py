"""Render a mesh with a texture, distortion as colours, or wires, by Blender's Workbench engine; needs no GPU."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

import numpy as np
from mathutils import Matrix, Vector

from benchmarks.rivals import make_object, remove_object, write_uv

CLAY = (0.75, 0.8, 0.86, 1)
INK = (0.03, 0.05, 0.09, 1)
WIRE = 0.0022  # thickness over the diagonal of the box
SEAM = (0.85, 0.02, 0.06, 1)
SEAM_RADIUS = 0.0028  # over the diagonal of the box
SHARP = np.radians(50)  # between faces: shaded as an edge


@dataclass(frozen=True)
class View:
    """A camera: which axis of the model points up, and turns about and above it, in degrees; zoom 1 fits all."""

    up: str = "Z"
    azimuth: float = 0.0
    elevation: float = 10.0
    zoom: float = 1.0


VIEWS = {
    "face": View("Y", 8, 4),
    "lion": View("Y", 130, 5),
    "lilium": View("Z", 30, 50),
    "max_planck": View("Y", 100, 5),
    "bunny": View("Y", -10, 12),
    "spot": View("Y", 155, 15),
    "homer": View("Y", 330, 5),
    "armadillo": View("Y", 330, 8),
    "suzanne": View("Y", 335, 8),
    "ogre": View("Y", 335, 5),
    "stanford_bunny": View("Y", -20, 12),
    "cow": View("Y", 20, 12),
    "david": View("Z", 75, 5),
    "optcuts_max_planck_i": View("Y", 70, 5),
    "optcuts_bunny_i": View("Y", -20, 12),
    "optcuts_lion_o": View("Y", 10, 12),
    "optcuts_bimba_i": View("Y", -10, 8),
    "optcuts_face": View("Y", 345, 5),
    "head": View("Z", 30, 5),
}


def checker_material(texture):
    """A material that shows the image file `texture` by the active UV layer, in Workbench and the viewport."""
    material = bpy.data.materials.new("checker")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(texture), check_existing=True)
    material.node_tree.nodes.active = node
    material.node_tree.links.new(node.outputs["Color"], material.node_tree.nodes["Principled BSDF"].inputs[0])
    return material


def front_to_south(view):
    """Rotation (3,3) that brings the model's up to +Z and what faces the camera of a view to -Y, Blender's front."""
    up, towards = _axes(view, 0.0)
    up, towards = np.array(up), np.array(towards)
    return np.stack([np.cross(up, -towards) * -1, -towards, up])


def render_checker(V, F, uv, view, path, texture, pixels=480):
    """Render the mesh with the checker on it to `path`; uv (m,3,2) already scaled to taste."""
    obj = make_object(V, F)
    write_uv(obj, uv)
    material = checker_material(texture)
    obj.data.materials.append(material)
    _render(obj, V[np.unique(F)], view, path, "TEXTURE", pixels)
    remove_object(obj)
    bpy.data.materials.remove(material)


def render_cut(found, view, path, texture, pixels=480):
    """Render a `DrawnMap` as a checker, and the edges that it cuts as red lines, to `path`."""
    V, F = found.V, found.F
    obj = make_object(V, F)
    write_uv(obj, found.uv)
    material = checker_material(texture)
    obj.data.materials.append(material)
    obj.data.set_sharp_from_angle(angle=SHARP)
    points = V[np.unique(F)]
    lines = _tubes(V[found.cut], SEAM_RADIUS * float(np.linalg.norm(np.ptp(points, axis=0))))
    _render(obj, points, view, path, "TEXTURE", pixels, also=(lines,))
    curve, paint = lines.data, lines.data.materials[0]
    bpy.data.objects.remove(lines)
    bpy.data.curves.remove(curve)
    bpy.data.materials.remove(paint)
    remove_object(obj)
    bpy.data.materials.remove(material)


def _tubes(ends, radius):
    """An object of one tube for every pair of ends (k,2,3)."""
    curve = bpy.data.curves.new("seams", "CURVE")
    curve.dimensions, curve.bevel_depth, curve.bevel_resolution = "3D", radius, 1
    for pair in ends.tolist():
        spline = curve.splines.new("POLY")
        spline.points.add(1)
        spline.points.foreach_set("co", [*pair[0], 1.0, *pair[1], 1.0])
    paint = bpy.data.materials.new("seams")
    paint.diffuse_color = SEAM
    curve.materials.append(paint)
    obj = bpy.data.objects.new("seams", curve)
    bpy.context.collection.objects.link(obj)
    return obj


def render_colours(V, F, rgb, view, path, pixels=480, unlit=False):
    """Render the mesh with one colour (m,3) per face to `path`; unlit, with these colours as they are."""
    obj = make_object(V, F)
    layer = obj.data.color_attributes.new("distortion", "BYTE_COLOR", "CORNER")
    rgba = np.ones((len(F), 3, 4), np.float32)
    rgba[..., :3] = rgb[:, None]
    layer.data.foreach_set("color_srgb", rgba.ravel())
    obj.data.color_attributes.active_color = layer
    _render(obj, V[np.unique(F)], view, path, "VERTEX", pixels, unlit=unlit)
    remove_object(obj)


def render_wires(V, F, view, path, pixels=480):
    """Render the mesh in clay with its edges drawn on it to `path`."""
    points = V[np.unique(F)]
    clay, wires = make_object(V, F), make_object(V, F, name="wires")
    clay.color, wires.color = CLAY, INK
    modifier = wires.modifiers.new("wires", "WIREFRAME")
    modifier.use_even_offset = False
    modifier.thickness = WIRE * float(np.linalg.norm(np.ptp(points, axis=0)))
    _render(clay, points, view, path, "OBJECT", pixels, also=(wires,))
    remove_object(wires)
    remove_object(clay)


def _render(obj, points, view, path, color_type, pixels, also=(), unlit=False):
    if color_type != "TEXTURE" or not obj.data.attributes.get("sharp_edge"):
        obj.data.shade_smooth()
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.resolution_x = scene.render.resolution_y = pixels
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform = "Standard"
    scene.display.render_aa = "16"
    shading = scene.display.shading
    shading.light, shading.color_type = "FLAT" if unlit else "STUDIO", color_type
    if not unlit:
        shading.studio_light = "paint.sl"
    shading.show_cavity, shading.cavity_type = not unlit, "WORLD"
    shading.show_shadows = False
    camera = _camera(points, view)
    scene.camera = camera
    shown = (obj, *also)
    hidden = [o for o in scene.objects if o.type == "MESH" and o not in shown and not o.hide_render]
    for other in hidden:
        other.hide_render = True
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    for other in hidden:
        other.hide_render = False
    data = camera.data
    bpy.data.objects.remove(camera)
    bpy.data.cameras.remove(data)


def towards_camera(view):
    """Up in the picture, and the direction to the camera of a view, (3,) each."""
    up, towards = _axes(view, view.elevation)
    right = up.cross(towards).normalized()
    return np.array(towards.cross(right)), np.array(towards)


def _axes(view, elevation):
    """Up, and the direction to the camera at an elevation in degrees."""
    up = Vector({"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1)}[view.up[-1]]) * (-1 if view.up[0] == "-" else 1)
    side = up.orthogonal().normalized()
    forward = up.cross(side)
    a, e = np.radians(view.azimuth), np.radians(elevation)
    towards = (side * np.cos(a) + forward * np.sin(a)) * np.cos(e) + up * np.sin(e)
    return up, towards


def _camera(points, view):
    """An orthographic camera that fits the points (n,3)."""
    up, towards = _axes(view, view.elevation)
    right = up.cross(towards).normalized()
    axes = np.array([right, towards.cross(right), towards])
    local = points @ axes.T
    low, high = local.min(0), local.max(0)
    centre = (low + high) / 2
    centre[2] = high[2] + (high - low).max()
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 1.06 * max(high[0] - low[0], high[1] - low[1]) / view.zoom
    camera.data.clip_start, camera.data.clip_end = 1e-3 * (high - low).max(), 10 * (high - low).max()
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes.T, centre @ axes
    camera.matrix_world = Matrix(matrix.tolist())
    bpy.context.collection.objects.link(camera)
    return camera
