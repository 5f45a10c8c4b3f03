"""Objects to remesh, and what came out of it."""

from __future__ import annotations

import bpy

import numpy as np
import scenes


def ball(name="Ball", rings=12, sectors=20, centre=(0.0, 0.0, 0.0)):
    """A closed sphere of quads and, at the poles, triangles."""
    polar = np.pi * np.arange(1, rings) / rings
    turn = 2 * np.pi * np.arange(sectors) / sectors
    t, p = (x.ravel() for x in np.meshgrid(turn, polar))
    points = np.stack([np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)], axis=1)
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]]) + centre
    row, column = (x.ravel() for x in np.meshgrid(np.arange(rings - 2), np.arange(sectors), indexing="ij"))
    after = (column + 1) % sectors
    quads = np.stack([row * sectors + column, (row + 1) * sectors + column, (row + 1) * sectors + after,
                      row * sectors + after], axis=1)  # fmt: skip
    k, last, n = np.arange(sectors), (rings - 2) * sectors, len(points)
    north = np.stack([k, (k + 1) % sectors, np.full(sectors, n - 2)], axis=1)
    south = np.stack([last + (k + 1) % sectors, last + k, np.full(sectors, n - 1)], axis=1)
    return scenes.add(points, [*quads.tolist(), *north.tolist(), *south.tolist()], name)


def arrays(obj):
    """Positions (n,3) and triangles (m,3) of an object."""
    mesh = obj.data
    co = np.zeros(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", co)
    faces = np.zeros(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", faces)
    return co.reshape(-1, 3).astype(float), faces.reshape(-1, 3)


def values(mesh, name, key="value", width=1):
    """Values (k,) or (k,width) of an attribute."""
    attribute = mesh.attributes[name]
    out = np.zeros(len(attribute.data) * width, np.float32)
    attribute.data.foreach_get(key, out)
    return out if width == 1 else out.reshape(-1, width)


def fill(mesh, name, kind, domain, data, key="value"):
    """Add an attribute with the given values."""
    attribute = mesh.attributes.new(name, kind, domain)
    attribute.data.foreach_set(key, np.ascontiguousarray(data).ravel())


def made(before):
    """Objects that were not there before."""
    return [obj for obj in bpy.data.objects if obj not in before]


def remesh(**arguments):
    """Run the operator; the objects that it made. What they were made of stays in sight, to be remeshed again."""
    before = set(bpy.data.objects)
    assert bpy.ops.object.omt_remesh(**{"hide_original": False, **arguments}) == {"FINISHED"}
    return made(before)


def dressed(name="Dressed"):
    """A bumpy patch that carries something of every kind."""
    obj = scenes.bump(14, 12, name=name)
    mesh, n = obj.data, len(obj.data.vertices)
    co, corner = np.zeros(3 * n, np.float32), np.array([loop.vertex_index for loop in obj.data.loops])
    mesh.vertices.foreach_get("co", co)
    co = co.reshape(-1, 3)
    scenes.set_uv(obj, co[corner][:, :2])
    scenes.set_uv(obj, 1 - co[corner][:, :2], "Second")
    mesh.uv_layers.active = mesh.uv_layers["Second"]
    mesh.uv_layers["UVMap"].active_render = True
    fill(mesh, "height", "FLOAT", "POINT", co[:, 2])
    fill(mesh, "where", "FLOAT_VECTOR", "POINT", co, "vector")
    fill(mesh, "index", "INT", "POINT", np.arange(n, dtype=np.int32))
    fill(mesh, "left", "BOOLEAN", "POINT", co[:, 0] < 0.5)
    fill(mesh, "part", "INT", "FACE", np.arange(len(mesh.polygons), dtype=np.int32))
    fill(mesh, "edge thing", "FLOAT", "EDGE", np.ones(len(mesh.edges), np.float32))
    tint = np.concatenate([co[:, :2], np.zeros((n, 1)), np.ones((n, 1))], axis=1).astype(np.float32)
    fill(mesh, "tint", "FLOAT_COLOR", "POINT", tint, "color")
    fill(mesh, "paint", "BYTE_COLOR", "CORNER", tint[corner], "color")
    mesh.attributes.active_color_name = "paint"
    mesh.attributes.default_color_name = "tint"
    for name in ("red", "blue"):
        mesh.materials.append(bpy.data.materials.new(name))
    index = (co[corner].reshape(-1, 4, 3)[:, :, 0].mean(axis=1) > 0.5).astype(np.int32)
    mesh.polygons.foreach_set("material_index", index)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(index), bool))
    group = obj.vertex_groups.new(name="slope")
    obj.vertex_groups.new(name="empty")
    for k, x in enumerate(co[:, 0].tolist()):
        group.add([k], x, "REPLACE")
    obj.shape_key_add(name="Basis")
    for name, shift in (("Up", (0, 0, 1)), ("Wide", (1, 0, 0))):
        key = obj.shape_key_add(name=name)
        key.data.foreach_set("co", (co + np.array(shift, np.float32) * co[:, :1]).ravel())
        key.value = 0.25
    mesh.shape_keys.key_blocks["Wide"].relative_key = mesh.shape_keys.key_blocks["Up"]
    mesh.update()
    return obj


def write_ball(path):
    """Write the sphere, off its centre, as an OBJ file."""
    obj = ball(centre=(1.0, 2.0, 3.0))
    co = [tuple(v.co) for v in obj.data.vertices]
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in co]
    lines += ["f " + " ".join(str(i + 1) for i in p.vertices) for p in obj.data.polygons]
    path.write_text("\n".join(lines) + "\n")


def read_points(path):
    """Positions (n,3) of an OBJ file."""
    lines = [line.split() for line in path.read_text().splitlines()]
    return np.array([list(map(float, line[1:4])) for line in lines if line[:1] == ["v"]])
