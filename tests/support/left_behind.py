"""All that there is in a file and in the session, as texts of a few figures, each known by what it is of."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import bpy

import numpy as np
import scenes

# Numbers of an image with more pixels are not looked at.
MOST_PIXELS = 300 * 300
# Properties of modifiers that every kind has, but for what the panel shows of them.
NOT_OF_MODIFIERS = {"rna_type", "name", "type", "is_active", "show_expanded", "execution_time", "persistent_uid",
                    "is_override_data", "use_pin_to_last", "show_in_editmode"}  # fmt: skip
KINDS = ("objects", "meshes", "curves", "images", "materials", "collections", "texts", "actions", "libraries")
TIME = re.compile(r"\d+(\.\d+)? s\b")
# What Blender makes and drops as it likes.
CACHES = {".corner_vert", ".corner_edge", ".edge_verts", "position"}


# Figures by the numbers that they are of: most of what there is stays as it was.
_KNOWN: dict[tuple, str] = {}


def without_times(text: str) -> str:
    """A text in which no number is one of seconds."""
    return TIME.sub("# s", text)


def number(value: float) -> str:
    """Four digits of a number that is not whole, which its point tells."""
    text = f"{value + 0.0:.4g}"
    return text if any(sign in text for sign in ".en") else f"{text}."


def figures(values) -> str:
    """How many numbers there are, the least, the greatest, their mean, and a sum by where each stands; of whole numbers
    and truth values figures that are whole."""
    x = np.asarray(values)
    key = (x.dtype.char, x.size, x.tobytes())
    if key not in _KNOWN:
        _KNOWN[key] = _figures(x)
    return _KNOWN[key]


def _figures(x: np.ndarray) -> str:
    if not x.size:
        return "none"
    if x.dtype.kind in "biu":
        x = x.ravel().astype(np.int64)
        found = [np.count_nonzero(x), x.min(), x.max(), int((x * (1 + np.arange(len(x)))).sum()) % 999_983]
        return " ".join(map(str, found))
    x = x.ravel().astype(float)
    if not np.isfinite(x).all():
        return f"{np.count_nonzero(~np.isfinite(x))} not finite; {figures(np.nan_to_num(x, posinf=9.0, neginf=-9.0))}"
    along = np.cos(0.3 + 1.7 * np.arange(len(x))) @ x / np.sqrt(len(x))
    return f"{len(x)} {' '.join(map(number, (x.min(), x.max(), x.mean(), along)))}"


def told() -> dict[str, str]:
    """Everything of the file, by what it is of."""
    found = dict(_scene())
    for obj in bpy.data.objects:
        found |= {f"{obj.name_full} {key}": value for key, value in _object(obj)}
        if obj.type == "MESH" and obj == _first_user(obj.data):
            found |= {f"{obj.data.name_full}: {key}": value for key, value in _mesh(obj)}
    for image in bpy.data.images:
        found |= {f"image {image.name} {key}": value for key, value in _image(image)}
    for material in bpy.data.materials:
        found[f"material {material.name}"] = _nodes(material)
    return {key: value for key, value in found.items() if value != ""}


def names(things) -> str:
    """Names of things in their order."""
    return ", ".join(sorted(thing.name_full if hasattr(thing, "name_full") else thing.name for thing in things))


def _scene() -> Iterator[tuple[str, str]]:
    context, layer = bpy.context, bpy.context.view_layer
    active = layer.objects.active
    yield "mode", context.mode
    yield "active", active.name if active is not None else "none"
    yield "selected", names(context.selected_objects)
    yield "hidden", names(obj for obj in layer.objects if obj.hide_get())
    yield "select mode", "".join("VEF"[k] for k in range(3) if context.scene.tool_settings.mesh_select_mode[k])
    yield "frame", str(context.scene.frame_current)
    for kind in KINDS:
        yield f"{kind} there", names(getattr(bpy.data, kind))
    views = [area.spaces.active for area in context.screen.areas if area.type == "VIEW_3D"]
    yield "views", " ".join(f"{v.shading.type} {v.shading.color_type} {v.overlay.show_weight}" for v in views)


def _object(obj) -> Iterator[tuple[str, str]]:
    yield "kind", f"{obj.type} {obj.data.name_full if obj.data else ''}"
    yield "place", figures(np.array(obj.matrix_world))
    yield "own place", figures(np.array(obj.matrix_basis))
    yield "in", f"{names(obj.users_collection)}; {obj.parent.name if obj.parent else ''} {obj.parent_type}"
    shown = (obj.hide_render, obj.hide_viewport, obj.show_name, obj.show_in_front, obj.show_wire)
    yield "shown", f"{obj.display_type} {''.join('01'[flag] for flag in shown)} {figures(obj.color)}"
    if obj.type == "EMPTY":
        yield "empty", f"{obj.empty_display_type} {number(obj.empty_display_size)}"
    for k, modifier in enumerate(obj.modifiers):
        yield f"modifier {k}", f"{modifier.type} {modifier.name} {_settings(modifier)}"
    yield (
        "slots",
        ", ".join(f"{slot.material.name if slot.material else '-'} {slot.link}" for slot in obj.material_slots),
    )
    yield "properties", own_properties(obj)
    yield "motion", _motion(obj)
    if obj.type == "MESH":
        yield "groups", ", ".join(f"{g.name}{' locked' * g.lock_weight}" for g in obj.vertex_groups)
        yield "active group", str(obj.vertex_groups.active_index)
        yield "active key", f"{obj.active_shape_key_index} {obj.show_only_shape_key}"
        rows = obj.omt_uv_regions
        yield "regions", ", ".join(f"{row.group} {number(row.factor)}" for row in rows.rows) + f" [{rows.active}]"


def _settings(modifier) -> str:
    """Settings of a modifier that are not those that a new one has."""
    found = []
    for prop in modifier.bl_rna.properties:
        if prop.identifier in NOT_OF_MODIFIERS or prop.is_readonly:
            continue
        value = getattr(modifier, prop.identifier)
        if prop.type in ("INT", "BOOLEAN", "ENUM") and not getattr(prop, "is_array", False) and value != prop.default:
            found.append(f"{prop.identifier}={value}")
        elif prop.type == "POINTER" and value is not None:
            found.append(f"{prop.identifier}={getattr(value, 'name', '')}")
    return " ".join(found)


def own_properties(owner) -> str:
    """Properties that somebody gave a thing."""
    found = []
    for key, value in sorted(owner.items()):
        value = (
            value.to_dict() if hasattr(value, "to_dict") else value.to_list() if hasattr(value, "to_list") else value
        )
        found.append(
            f"{key}={json.dumps(value, default=lambda held: getattr(held, 'name', str(held)), sort_keys=True)}"
        )
    return "; ".join(each for each in found if not each.startswith(("omt_uv_regions", "cycles")))


def _motion(obj) -> str:
    data = obj.data if obj.type == "MESH" else None
    keys = data.shape_keys if data is not None else None
    found = []
    for owner in (obj, keys):
        action = owner.animation_data.action if owner is not None and owner.animation_data else None
        for curve in _curves(action) if action is not None else ():
            found.append(f"{curve.data_path} {figures([tuple(key.co) for key in curve.keyframe_points])}")
    return "; ".join(sorted(found))


def _curves(action) -> list:
    """Curves of an action, in its layers from Blender 4.4 on."""
    if hasattr(action, "layers"):
        return [
            c for layer in action.layers for strip in layer.strips for bag in strip.channelbags for c in bag.fcurves
        ]
    return list(action.fcurves)


def _first_user(mesh):
    return next(obj for obj in bpy.data.objects if obj.data == mesh)


@contextmanager
def _in_object_mode(obj) -> Iterator[bpy.types.Mesh]:
    """The mesh of an object, or in Edit Mode a copy as it is there."""
    if obj.mode != "EDIT":
        yield obj.data
        return
    obj.update_from_editmode()
    mesh = obj.data.copy()
    try:
        yield mesh
    finally:
        bpy.data.meshes.remove(mesh)


def _mesh(obj) -> Iterator[tuple[str, str]]:
    with _in_object_mode(obj) as mesh:
        yield "size", f"{len(mesh.vertices)} {len(mesh.edges)} {len(mesh.polygons)} {len(mesh.loops)}"
        yield "points", figures(_got(mesh.vertices, "co", 3))
        yield "edges", figures(_got(mesh.edges, "vertices", 2, np.int32))
        yield "faces", figures(np.append(_got(mesh.polygons, "loop_total", 1, np.int32),
                                         _got(mesh.loops, "vertex_index", 1, np.int32)))  # fmt: skip
        for name, things in (("vertices", mesh.vertices), ("edges", mesh.edges), ("faces", mesh.polygons)):
            yield f"selected {name}", figures(_got(things, "select", 1, bool)) if len(things) else ""
        yield "seams", figures(_got(mesh.edges, "use_seam", 1, bool)) if len(mesh.edges) else ""
        yield "UV maps", ", ".join(layer.name + " render" * layer.active_render for layer in mesh.uv_layers)
        yield "active UV map", mesh.uv_layers.active.name if mesh.uv_layers.active else ""
        yield "colours", f"{mesh.color_attributes.active_color_index} {mesh.color_attributes.render_color_index}"
        yield "materials", ", ".join(material.name if material else "-" for material in mesh.materials)
        for attribute in mesh.attributes:
            if attribute.name not in CACHES and not attribute.name.startswith((".select", ".uv_select", ".hide")):
                yield f"attribute {attribute.name}", _attribute(attribute)
        members = [(e.group, v.index, e.weight) for v in mesh.vertices for e in v.groups]
        for group in obj.vertex_groups:
            mine = [(vertex, weight) for index, vertex, weight in members if index == group.index]
            yield f"group {group.name}", f"{figures([v for v, _ in mine])} {figures([w for _, w in mine])}"
    for key in obj.data.shape_keys.key_blocks if obj.data.shape_keys else ():
        yield f"key {key.name}", f"{number(key.value)} {key.mute} {figures(_got(key.data, 'co', 3))}"
    yield "properties", own_properties(obj.data)


def _got(things, name: str, width: int, kind=np.float32) -> np.ndarray:
    values = np.zeros(len(things) * width, kind)
    things.foreach_get(name, values)
    return values


def _attribute(attribute) -> str:
    """Domain, kind and figures; flags that are false everywhere come and go."""
    name, width, kind = scenes._VALUE[attribute.data_type]
    values = _got(attribute.data, name, width, kind)
    if attribute.data_type == "BOOLEAN" and not values.any():
        return ""
    return f"{attribute.domain} {attribute.data_type} {figures(values)}"


def _image(image) -> Iterator[tuple[str, str]]:
    how = (image.source, image.generated_type, image.alpha_mode, image.colorspace_settings.name)
    yield (
        "is",
        f"{image.size[0]} {image.size[1]} {' '.join(how)} {image.is_float} {image.users} {bool(image.packed_file)}",
    )
    if 0 < image.size[0] * image.size[1] <= MOST_PIXELS and image.channels:
        pixels = _got_pixels(image)
        yield "pixels", "; ".join(figures(pixels[:, channel]) for channel in range(pixels.shape[1]))
    with suppress(AttributeError):
        if image.preview is not None and image.preview.image_size[0]:
            yield "preview", f"{tuple(image.preview.image_size)} {figures(np.array(image.preview.image_pixels_float))}"


def _got_pixels(image) -> np.ndarray:
    pixels = np.zeros(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(-1, image.channels)


def _nodes(material) -> str:
    if material.node_tree is None:
        return "plain"
    tree = material.node_tree
    found = [f"{node.type} {node.image.name if getattr(node, 'image', None) else ''}".strip() for node in tree.nodes]
    links = [f"{link.from_node.type}>{link.to_node.type}:{link.to_socket.name}" for link in tree.links]
    active = tree.nodes.active.type if tree.nodes.active else ""
    return f"{material.users}; {', '.join(sorted(found))}; {', '.join(sorted(links))}; {active}"


def session(package) -> dict[str, str]:
    """What the session keeps: what the panel has been told, what is going on, and what was given last."""
    state, overlay = package("session.last_run").state, package("display.overlay")
    found = {"outdated": state.outdated, "error": state.error, "notice shown": str(state.shown)}
    if state.summary is not None:
        summary = state.summary
        found["title"], found["about"] = summary.title, ", ".join(summary.objects)
        found |= {f"row {name}": value for name, value in summary.rows if name != "Time"}
        found |= {f"notice {k}": f"{n.text} [{n.action}]" for k, n in enumerate(summary.notices)}
        found["out of bounds"] = ", ".join(sorted(summary.beyond))
        found["refused"] = "yes" * summary.refused
        found["watched"] = ", ".join(sorted(state.marks))
    shown = overlay._shown
    found["overlay"] = f"{shown.kind} {figures(shown.places)} {figures(shown.colours)} {len(shown.shading)}"
    found["drawn edges"] = figures(shown.edges)
    run, queue = package("session.run").current, package("session.queue").state
    found["running"] = run.label if run is not None else ""
    found["live"] = "yes" * (package("session.following").current is not None)
    if queue is not None:
        found["queue"] = ", ".join(f"{j.name} {j.state} {j.reason} {len(j.warnings)}" for j in queue.jobs)
        found["queue is"] = f"{queue.is_stopped} {queue.is_over}"
    for name in operators(package):
        given = bpy.context.window_manager.operator_properties_last(name)
        found[f"last {name}"] = own_properties(given)
    return {key: value for key, value in found.items() if value}


def operators(package) -> list[str]:
    """Names of all operators of the package."""
    return [c.bl_idname for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]


def forget(package) -> None:
    """Begin with a session of which nothing is left."""
    last_run = package("session.last_run")
    package("display.overlay").hide(bpy.context)
    package("display.shading").hide_textures(bpy.context)
    last_run.forget()
    last_run.state.error, last_run.state.notices = "", []
    package("session.queue").forget()
    for name in operators(package):
        given = bpy.context.window_manager.operator_properties_last(name)
        for key in list(given.keys()):
            given.property_unset(key)


def changed(before: dict[str, str], after: dict[str, str]) -> dict[str, str]:
    """What is not as it was, and what is gone."""
    found = {key: value for key, value in after.items() if before.get(key) != value}
    return found | {key: "gone" for key in before if key not in after}
