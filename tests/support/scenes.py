"""Objects to unwrap, and the whole state of a mesh as something to compare."""

from __future__ import annotations

from types import CellType, FunctionType

import bpy

import numpy as np


def add(vertices, faces, name="Mesh", seams=(), edges=()):
    """A selected, active object in Object Mode; seams are vertex pairs."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, v)) for v in vertices], list(edges), [tuple(map(int, f)) for f in faces])
    without_chosen_edges(mesh)
    pairs = {frozenset(map(int, pair)) for pair in seams}
    for edge in mesh.edges:
        edge.use_seam = frozenset(edge.vertices) in pairs
    mesh.update()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    select([*bpy.context.selected_objects, obj])
    return obj


def without_chosen_edges(mesh):
    """No edge selected: from_pydata of Blender 5.0 gives that a wrong type: chance decides, and to set it crashes."""
    if ".select_edge" in mesh.attributes:
        mesh.attributes.remove(mesh.attributes[".select_edge"])


def select(objects):
    """Select these objects alone, the last one active."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[-1] if objects else None


def open_empty():
    """An empty file; Blender 4.2 would hold on to a scene that is gone, see docs/blender_4_2.md."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    _ = bpy.context.tool_settings


def export_gltf(path, **settings):
    """Write all objects with Blender's exporter; tool settings are read for that of 4.2, see docs/blender_4_2.md."""
    _ = bpy.context.tool_settings
    bpy.ops.export_scene.gltf(filepath=str(path), **settings)


def bump(columns=8, rows=6, height=0.5, name="Bump", offset=0.0):
    """A curved patch of quads."""
    y, x = np.mgrid[0 : rows + 1, 0 : columns + 1]
    u, v = x / columns, y / rows
    points = np.stack([u + offset, v, height * np.sin(np.pi * u) * np.sin(2 * v)], axis=-1).reshape(-1, 3)
    corner = (y[:-1, :-1] * (columns + 1) + x[:-1, :-1]).ravel()
    return add(points, np.stack([corner, corner + 1, corner + columns + 2, corner + columns + 1], axis=1), name)


def cube(name="Cube"):
    """A cube of quads with seams that cut it into a cross, one disk."""
    points = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    tree = {(0, 2), (0, 1), (0, 4), (1, 3), (2, 6), (4, 6), (5, 7)}
    return add(points, faces, name, tree)


def edit(*objects, faces=None):
    """Enter Edit Mode with the objects; `faces` of each are selected, all by default."""
    select(list(objects))
    for obj in objects:
        mesh = obj.data
        chosen = np.zeros(len(mesh.polygons), bool)
        chosen[slice(None) if faces is None else faces] = True
        picked = [p for p in mesh.polygons if chosen[p.index]]
        vertices = {v for p in picked for v in p.vertices}
        keys = {k for p in picked for k in p.edge_keys}
        _flag(mesh, ".select_poly", "FACE", chosen)
        _flag(mesh, ".select_vert", "POINT", [v.index in vertices for v in mesh.vertices])
        _flag(mesh, ".select_edge", "EDGE", [e.key in keys for e in mesh.edges])
    bpy.context.scene.tool_settings.mesh_select_mode = (False, False, True)
    bpy.ops.object.mode_set(mode="EDIT")


def _flag(mesh, name, domain, values):
    attribute = mesh.attributes.get(name) or mesh.attributes.new(name, "BOOLEAN", domain)
    attribute.data.foreach_set("value", list(map(bool, values)))


def leave_edit():
    """Back to Object Mode."""
    bpy.ops.object.mode_set(mode="OBJECT")


def set_uv(obj, uv, layer="UVMap"):
    """Write (c,2) to a layer, made as needed, of an object in Object Mode."""
    target = obj.data.uv_layers.get(layer) or obj.data.uv_layers.new(name=layer)
    obj.data.attributes[target.name].data.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())


def seen_from_above(obj, scale=1.0, shift=(0.0, 0.0)):
    """UVs (c,2) that are the x and y of every corner."""
    vertex = np.array([loop.vertex_index for loop in obj.data.loops])
    xy = np.array([v.co[:2] for v in obj.data.vertices])
    return (xy[vertex] * scale + shift).astype(np.float32)


def open_bump():
    """A file with a curved patch alone, whose UVs neither fold nor lie on one another."""
    open_empty()
    obj = bump(4, 3)
    set_uv(obj, seen_from_above(obj, 0.8))
    return obj


def pin(obj, vertices, layer="UVMap"):
    """Pin all corners of vertices of an object in Object Mode; returns the corners (c,) bool."""
    pinned = np.array([loop.vertex_index in vertices for loop in obj.data.loops])
    _flag(obj.data, f".pn.{layer}", "CORNER", pinned)
    return pinned


def uv_of(obj, layer=None):
    """(c,2) float32, also in Edit Mode."""
    if obj.mode == "EDIT":
        obj.update_from_editmode()
        mesh = obj.data.copy()
    else:
        mesh = obj.data
    source = mesh.uv_layers[layer] if layer else mesh.uv_layers.active
    uv = np.zeros(2 * len(mesh.loops), np.float32)
    source.uv.foreach_get("vector", uv)
    if mesh is not obj.data:
        bpy.data.meshes.remove(mesh)
    return uv.reshape(-1, 2)


_VALUE = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "INT32_2D": ("value", 2, np.int32),
    "INT16_2D": ("value", 2, np.int32),
}
# What a refusal may change (it shows the elements it complains about), and Blender's own caches.
_SELECTION = {".select_vert", ".select_edge", ".select_poly", ".uv_select_vert", ".uv_select_edge", ".uv_select_face"}


def state(obj, leave_out=()):
    """Every attribute of a mesh, seams, layers and vertex groups, as bytes: equal only if nothing changed."""
    obj.update_from_editmode()
    mesh = obj.data.copy()
    try:
        result = {}
        for attribute in mesh.attributes:
            if attribute.name in _SELECTION or attribute.name in leave_out:
                continue
            if attribute.name.startswith((".vs.", ".es.", ".pn.")) and attribute.name[4:] in leave_out:
                continue
            key, width, dtype = _VALUE[attribute.data_type]
            values = np.zeros(len(attribute.data) * width, dtype)
            attribute.data.foreach_get(key, values)
            if attribute.data_type == "BOOLEAN" and not values.any():
                continue  # Blender drops and makes these as it likes
            result[attribute.name] = (attribute.domain, attribute.data_type, values.tobytes())
        result["counts"] = (len(mesh.vertices), len(mesh.edges), len(mesh.polygons), len(mesh.loops))
        result["seams"] = [e.index for e in mesh.edges if e.use_seam]
        result["groups"] = [[(g.group, g.weight) for g in v.groups] for v in mesh.vertices]
        result["materials"] = [p.material_index for p in mesh.polygons]
        result["layers"] = [layer.name for layer in mesh.uv_layers]
        return result
    finally:
        bpy.data.meshes.remove(mesh)


def pixels_of(path) -> np.ndarray:
    """Colours (h,w,3) of a picture in a file, from 0 to 1, the row at the top first."""
    image = bpy.data.images.load(str(path), check_existing=False)
    width, height = image.size
    found = np.array(image.pixels[:]).reshape(height, width, -1)[::-1, :, :3]
    bpy.data.images.remove(image)
    return found


def triangles_of(obj):
    """Positions (m,3,3) with the object's matrix, and UVs (m,3,2), of the loop triangles."""
    uv = uv_of(obj).astype(float)
    mesh = obj.data
    mesh.calc_loop_triangles()
    n, m = len(mesh.vertices), len(mesh.loop_triangles)
    positions, loops, vertices = np.zeros(3 * n, np.float32), np.zeros(3 * m, np.int32), np.zeros(3 * m, np.int32)
    mesh.vertices.foreach_get("co", positions)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    world = positions.reshape(-1, 3).astype(float) @ np.array(obj.matrix_world)[:3, :3].T
    return world[vertices].reshape(-1, 3, 3), uv[loops].reshape(-1, 3, 2)


def areas(obj):
    """Areas (m,) in space and signed areas (m,) in UV."""
    p, uv = triangles_of(obj)
    space = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return space, 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def polygon_areas(obj):
    """Areas (f,) of the polygons in space, and in UV the sums (f,) over their triangles."""
    from omt_uv.solver.mesh import polygon_areas as of_polygons

    p, _ = triangles_of(obj)
    owner, vertex = np.zeros(len(p), np.int32), np.zeros(3 * len(p), np.int32)
    obj.data.loop_triangles.foreach_get("polygon_index", owner)
    obj.data.loop_triangles.foreach_get("vertices", vertex)
    place = np.zeros((len(obj.data.vertices), 3))
    place[vertex] = p.reshape(-1, 3)
    space = of_polygons.polygon_areas(place, vertex.reshape(-1, 3), owner)
    return np.bincount(owner, space), np.bincount(owner, areas(obj)[1])


def error_of(operator, **arguments):
    """Message of the error that an operator reports."""
    try:
        operator(**arguments)
    except RuntimeError as error:
        return str(error)
    raise AssertionError("the operator did not complain")


def class_of(name):
    """The registered class of an operator such as "uv.omt_unwrap"."""
    group, verb = name.split(".")
    return getattr(bpy.types, f"{group.upper()}_OT_{verb}")


def name_of(cls):
    """Name such as "uv.omt_unwrap" of a registered class, whose bl_idname Blender has changed."""
    return (
        ".".join((cls.bl_rna.identifier.split("_OT_")[0].lower(), cls.bl_rna.identifier.split("_OT_")[1]))
        if "_OT_" in cls.bl_rna.identifier
        else cls.bl_idname
    )


def stand_in(name, **settings):
    """An operator as Blender would make it, with the class' own methods: there is no window to click in."""
    cls = class_of(name)
    mixins = tuple(base for base in cls.__bases__ if not issubclass(base, bpy.types.bpy_struct))
    body = {k: v for k, v in vars(cls).items() if not k.startswith("__") and k != "bl_rna"}
    body["reports"] = []
    body["rna_type"] = bpy.context.window_manager.operator_properties_last(name).bl_rna
    for prop in body["rna_type"].properties:
        if not prop.is_readonly and prop.identifier != "rna_type":
            body[prop.identifier] = tuple(prop.default_array) if getattr(prop, "is_array", False) else prop.default
    body |= settings
    body["report"] = lambda self, kind, text: self.reports.append((set(kind), text))
    made = type("StandIn", mixins, body)
    for key, function in body.items():
        # A method that goes on with its base's looks for that behind its own class, which no instance is of.
        if isinstance(function, FunctionType) and "__class__" in function.__code__.co_freevars:
            free = zip(function.__code__.co_freevars, function.__closure__, strict=True)
            cells = [CellType(made) if variable == "__class__" else cell for variable, cell in free]
            own = FunctionType(function.__code__, function.__globals__, key, function.__defaults__, tuple(cells))
            setattr(made, key, own)
    return made()
