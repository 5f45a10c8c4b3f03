"""Small files of every format that is changed in place, as bytes, with what Blender makes of them."""

from __future__ import annotations

import base64
import json
import struct

import numpy as np

from omt_uv.files.in_place.imported import Imported

# A cube without one of its corners' faces doubled: six quads on eight vertices.
CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float32)
QUADS = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
TRIANGLES = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])


def imported(faces, uv, positions=CUBE, name="Mesh"):
    """A mesh as Blender holds it, with these UVs (c,2) of its corners."""
    start = np.append(0, np.cumsum([len(face) for face in faces]))
    corner = np.concatenate([np.asarray(face) for face in faces])
    return Imported(name, positions, corner, start, (np.asarray(uv, np.float32),), 0)


def imported_triangles(uv, shared=False):
    """The triangles of the cube as Blender's reader of glTF makes them; it gives primitives vertices of their own."""
    parts = [TRIANGLES[:6], TRIANGLES[6:]] if shared else [TRIANGLES]
    used = [np.unique(part) for part in parts]
    faces = [
        np.searchsorted(mine, part) + sum(map(len, used[:k]))
        for k, (mine, part) in enumerate(zip(used, parts, strict=True))
    ]
    return imported(np.concatenate(faces), uv, CUBE[np.concatenate(used)])


def spread(count, seed=0):
    """UVs (count,2) all of which differ."""
    return np.random.default_rng(seed).random((count, 2)).astype(np.float32)


def obj_bytes(end="\r\n"):
    """An OBJ file with most of what the format has, and two faces that Blender drops."""
    lines = ["# a cube", "mtllib some thing.mtl", "o first"]
    lines += [f"v {x:.17g} {y:.17g} {z:.17g} 1 0.5 {k / 8}" for k, (x, y, z) in enumerate(CUBE.tolist())]
    lines += ["vn 0 0 1", "vt 0.25 0.75 0", "vt  1 0 # corner", "vt 0.5 0.5", "g one", "s 1", "usemtl red"]
    lines += ["f 1/1/1 3/2/1  4/3/1 2/2/1", "f 5 6 8 7 # no UVs", f"f -8//1 -7//1 \\{end} -3//1 -4//1", "o second"]
    lines += ["usemtl blue", "f\t3/1 7/2 8/3 4/1", "l 1/3 2/3", "f 1/3 1/3 2/3", "f 1/1 5/2 7/-1 3/-2", "f 1 2 99"]
    return end.join([*lines, "f 2 4 8 6", "# end", ""]).encode()


def ply_bytes(form="ascii", names=("s", "t"), corners=True, end="\n"):
    """A PLY file of the cube with UVs under these names, other properties, another element, and comments."""
    more = [("uchar", "red"), *(("float", name) for name in names), ("double", "weight")]
    head = ["ply", f"format {form} 1.0", "comment made by hand", "element vertex 8"]
    head += [*(f"property float {a}" for a in "xyz"), *(f"property {kind} {name}" for kind, name in more)]
    head += ["element face 6", "property uchar flags", "property list uchar int vertex_indices"]
    head += ["property list uchar float texcoord"] * corners
    head += ["element edge 1", "property int vertex1", "property int vertex2", "end_header", ""]
    rng = np.random.default_rng(1)
    vertices = [
        [*p, 7 + k, *rng.random(len(names)).astype(np.float32).tolist(), k / 7] for k, p in enumerate(CUBE.tolist())
    ]
    faces = [
        [3, 4, *quad, *([8, *rng.random(8).astype(np.float32).tolist()] if corners else [])] for quad in QUADS.tolist()
    ]
    header = end.join(head).encode()
    if form == "ascii":
        rows = [" ".join(f"{value:.9g}" for value in row) for row in [*vertices, *faces, [0, 7]]]
        return header + (end.join(rows) + end).encode()
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(f"{order}3fB{len(names)}fd", *row) for row in vertices)
    body += b"".join(struct.pack(f"{order}BB4i" + ("B8f" if corners else ""), *row) for row in faces)
    return header + body + struct.pack(order + "2i", 0, 7)


def glb_bytes(shared=False, mode=4, uvs=True):
    """A binary glTF file of the cube as triangles, with weights, a morph, and things that nobody reads.

    shared : two primitives, which share their vertices; mode : 5 for a strip
    """
    positions = np.stack([CUBE[:, 0], CUBE[:, 2], -CUBE[:, 1]], axis=1).astype("<f4")
    tables = {
        "POSITION": positions,
        "TEXCOORD_0": spread(8, 5).astype("<f4"),
        "JOINTS_0": np.arange(32, dtype="<u1").reshape(8, 4) % 2,
        "WEIGHTS_0": np.full((8, 4), 0.25, "<f4"),
        "_CUSTOM": np.arange(8, dtype="<u2")[:, None].repeat(3, 1),
    }
    if not uvs:
        del tables["TEXCOORD_0"]
    index = np.array([0, 1, 2, 3, 6, 7, 4, 5, 0], "<u2") if mode == 5 else TRIANGLES.astype("<u2").ravel()
    parts = [index[:18], index[18:]] if shared else [index]
    chunks, views, accessors = b"", [], []

    def store(values, **more):
        nonlocal chunks
        row = values.dtype.itemsize * values.shape[1]
        raw = np.zeros((len(values), row + (-row % 4 if "j" not in more else 0)), np.uint8)
        raw[:, :row] = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), -1)
        chunks += bytes(-len(chunks) % 4)
        views.append({"buffer": 0, "byteOffset": len(chunks), "byteLength": raw.size})
        if raw.shape[1] != row:
            views[-1]["byteStride"] = raw.shape[1]
        chunks += raw.tobytes()
        code = {"<f4": 5126, "|u1": 5121, "<u2": 5123}[values.dtype.str]
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[values.shape[1]]
        accessors.append({"bufferView": len(views) - 1, "componentType": code, "count": len(values), "type": kind})
        return len(accessors) - 1

    attributes = {name: store(values) for name, values in tables.items()}
    accessors[0] |= {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    morph = {"POSITION": store((positions * 0.5).astype("<f4"))}
    primitives = []
    for part in parts:
        indices = store(part[:, None], j=True)
        primitives.append({"attributes": dict(attributes), "indices": indices, "targets": [dict(morph)], "mode": mode})
    chunks += bytes(-len(chunks) % 4)
    views.append({"buffer": 0, "byteOffset": len(chunks), "byteLength": 5, "name": "picture"})
    chunks += b"\x89PNG!"
    doc = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "extras": {"kept": 1e-5}, "name": "Kübe"}],
        "meshes": [{"name": "Mesh", "primitives": primitives, "weights": [0.5]}],
        "images": [{"bufferView": len(views) - 1, "mimeType": "image/png"}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(chunks)}],
        "extensions": {"ODD_one": {"a": [1, 2]}},
    }
    text = json.dumps(doc, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks += bytes(-len(chunks) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(chunks), 0x004E4942) + chunks
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def mutants(data, count, seed=0):
    """Files with bytes changed, cut out, doubled, or cut off."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        raw = bytearray(data)
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(raw)))
            kind = int(rng.integers(5))
            if kind == 0:
                raw[at] = int(rng.integers(256))
            elif kind == 1:
                raw[at] = int(rng.choice(list(b"0123456789-/ \n,{}[]\\#")))
            elif kind == 2:
                del raw[at : at + int(rng.integers(1, 40))]
            elif kind == 3:
                raw[at:at] = raw[at : at + int(rng.integers(1, 40))]
            else:
                del raw[max(at, len(raw) // 2) :]
            if not raw:
                break
        yield bytes(raw)


def gltf_parts(indent=None, embedded=False):
    """The cube of `glb_bytes` as glTF of text, and the bytes of the file cube.bin that it names."""
    size = struct.unpack_from("<I", glb_bytes(), 12)[0]
    doc = json.loads(glb_bytes()[20 : 20 + size])
    raw = glb_bytes()[28 + size :][: doc["buffers"][0]["byteLength"]]
    where = "data:application/octet-stream;base64," + base64.b64encode(raw).decode() if embedded else "cu%20be.bin"
    doc["buffers"][0] = {"uri": where, "byteLength": len(raw), "extras": {"mine": 1}}
    return json.dumps(doc, ensure_ascii=False, indent=indent).encode(), raw
