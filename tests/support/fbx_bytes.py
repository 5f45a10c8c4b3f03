"""Binary FBX files put together record by record."""

from __future__ import annotations

import struct

from omt_uv.files import fbx_nodes


def array(code, form, values):
    """An array of numbers, not compressed, by the letter of its type in FBX and in `struct`."""
    data = struct.pack(f"<{len(values)}{form}", *values)
    return code + struct.pack("<III", len(values), 0, len(data)) + data


def text(value):
    """A string."""
    return b"S" + struct.pack("<I", len(value)) + value


def record(long, at, name, values=(), inner=()):
    """A record that begins at a place of the file; inner: functions of the place, each a record."""
    head = struct.Struct("<QQQB" if long else "<IIIB")
    body, data = name.encode(), b"".join(values)
    inside = b""
    for make in inner:
        inside += make(at + head.size + len(body) + len(data) + len(inside))
    if inner:
        inside += bytes(head.size)
    end = at + head.size + len(body) + len(data) + len(inside)
    return head.pack(end, len(values), len(data), len(body)) + body + data + inside


def file_of(long, records):
    """A file of records, functions of their places, with offsets of 8 bytes (long) or of 4."""
    data = fbx_nodes.MAGIC + b"\x1a\x00" + struct.pack("<I", 7500 if long else 7400)
    data = data + bytes(27 - len(data))
    for make in records:
        data += make(len(data))
    return data + bytes(25 if long else 13)


def make(long, *args):
    """A record as a function of its place: see `record`."""
    return lambda at: record(long, at, *args)


def scene(long):
    """Two meshes, a morph's shape, which counts as none, and two models."""

    def mesh(vertices, corners, uv):
        values = [b"L" + struct.pack("<q", 7), text(b"Cube\x00\x01Geometry"), text(b"Mesh")]
        places, index = array(b"d", "d", [0.5] * 2 * uv), array(b"i", "i", range(uv))
        inner = [make(long, "UV", [places]), make(long, "UVIndex", [index])]
        layer = make(long, "LayerElementUV", [b"I" + struct.pack("<i", 0)], inner)
        points, polygons = array(b"d", "d", [1.0] * 3 * vertices), array(b"i", "i", [0] * corners)
        inner = [make(long, "Vertices", [points]), make(long, "PolygonVertexIndex", [polygons]), layer]
        return make(long, "Geometry", values, inner)

    simple = [b"Y" + struct.pack("<h", 1), b"C\x01", b"F" + struct.pack("<f", 1), b"D" + struct.pack("<d", 1), b"B\x00"]
    shape = make(long, "Geometry", [text(b"Key"), text(b"Shape")],
                 [make(long, "Vertices", [array(b"d", "d", [0.0] * 99)])])  # fmt: skip
    model = make(long, "Model", [*simple, b"R" + struct.pack("<I", 2) + b"xx", text(b"Mesh")], [make(long, "Version")])
    objects = make(long, "Objects", [], [mesh(8, 24, 20), shape, mesh(5, 9, 3), model, model])
    return [make(long, "Header", [array(b"f", "f", [1.0])]), objects, make(long, "Takes")]
