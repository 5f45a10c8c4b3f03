"""What is put into a file is read once more before it counts: whatever a writer spoils, the check after it sees."""

from __future__ import annotations

import re

import mesh_bytes
import numpy as np
import pytest
from mesh_bytes import QUADS, gltf_parts

from omt_uv.files.in_place import glb, glb_data, glb_layout, gltf, obj, ply
from omt_uv.files.in_place.imported import InPlaceError

FACES = [QUADS[0], QUADS[1], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def spoil(monkeypatch, module, writer, change):
    """Let a writer's result be changed behind its back."""
    write = getattr(module, writer)
    monkeypatch.setattr(module, writer, lambda *arguments: change(write(*arguments)))


def replaced(pattern, new, which=0):
    """Bytes with one of the places where a pattern fits changed."""

    def change(data):
        places = list(re.finditer(pattern, data))
        at = places[which]
        assert new != at[0]
        return data[: at.start()] + new + data[at.end() :]

    return change


OBJ = {
    "a position": replaced(rb"(?m)^v 1 0 0 ", b"v 1 0.01 0 "),
    "a position that is lost": replaced(rb"(?m)^v [^\n]*\n", b"# \r\n", -1),
    "a vertex of a face": replaced(rb" 6/", b" 5/"),
    "a UV": replaced(rb"(?m)^vt 0\.\d", b"vt 0.00", 1),
    "a UV of a face": replaced(rb" 6/\d+", b" 6/1"),
    "a face without UVs": replaced(rb" 6/\d+ ", b" 6 "),
    "the UV of a face that Blender drops": replaced(rb"f 1/\d+ 1/\d+", b"f 1/5 1/6"),
}


@pytest.mark.parametrize("what", OBJ)
def test_obj(monkeypatch, what):
    mesh = mesh_bytes.imported(FACES, mesh_bytes.spread(24))
    obj.put(mesh_bytes.obj_bytes(), [mesh])
    spoil(monkeypatch, obj, "_written", OBJ[what])
    with pytest.raises(InPlaceError, match="the new text does not"):
        obj.put(mesh_bytes.obj_bytes(), [mesh])


def in_row(element, name, row):
    """A value of a binary PLY file changed, whatever it is."""

    def change(data):
        read = ply.read(data)
        at = int(read.rows[element].place[name][row])
        kind = next(p.type for p in read.header.find(element).properties if p.name == name)
        dtype = np.dtype(read.header.order + kind)
        old = np.frombuffer(data, dtype, 1, at)[0]
        new = np.array([old + 0.25 if kind[0] == "f" else (old + 1) % 8], dtype)
        return data[:at] + new.tobytes() + data[at + dtype.itemsize :]

    return change


@pytest.mark.parametrize("form", ["binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize(
    "element, name, row", [("vertex", "y", 3), ("vertex", "z", -1), ("vertex", "s", -1), ("face", "vertex_indices", 2)]
)
def test_ply(monkeypatch, form, element, name, row):
    data, mesh = mesh_bytes.ply_bytes(form), mesh_bytes.imported(QUADS, mesh_bytes.spread(24))
    ply.put(data, [mesh])
    spoil(monkeypatch, ply, "_with_corners", in_row(element, name, row))
    with pytest.raises(InPlaceError, match="the new file does not"):
        ply.put(data, [mesh])


def in_accessor(name, row=0):
    """A value of an attribute of the first primitive changed, or of its morph or its vertices."""

    def change(file):
        primitive = file.doc["meshes"][0]["primitives"][0]
        table = (
            primitive["targets"][0] if name == "morph" else {**primitive["attributes"], "indices": primitive["indices"]}
        )
        index = table["POSITION" if name == "morph" else name]
        binary = bytearray(file.binary)
        moved = glb_data.Glb(file.doc, binary, file.others)
        values = glb_data.accessor(moved, index)
        values[row, 0] = values[row, 0] + 0.25 if values.dtype.kind == "f" else (values[row, 0] + 1) % 2
        return glb_data.Glb(file.doc, bytes(binary), file.others)

    return change


@pytest.mark.parametrize("name", ["POSITION", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0", "_CUSTOM", "indices", "morph"])
@pytest.mark.parametrize("row", [2, -1])
def test_glb(monkeypatch, name, row):
    data, mesh = mesh_bytes.glb_bytes(), mesh_bytes.imported_triangles(mesh_bytes.spread(36))
    glb.put(data, [mesh])
    spoil(monkeypatch, glb_layout.GlbChange, "result", in_accessor(name, row))
    with pytest.raises(InPlaceError, match="the new file does not"):
        glb.put(data, [mesh])


def test_gltf_of_text(monkeypatch, tmp_path):
    """A view that begins elsewhere, also of what no mesh holds, as a picture."""
    data, raw = gltf_parts(2)
    (tmp_path / "cu be.bin").write_bytes(raw)
    mesh = mesh_bytes.imported_triangles(mesh_bytes.spread(36))
    new, _ = gltf.put(data, [mesh], tmp_path, tmp_path)
    count = len(gltf.read(new, tmp_path).glb.doc["bufferViews"])
    picture = gltf.read(new, tmp_path).glb.doc["images"][0]["bufferView"]
    write = gltf._text
    for view in range(count):

        def spoilt(*arguments, view=view):
            read = gltf.read(write(*arguments), tmp_path)
            views = read.doc["bufferViews"]
            views[view] = views[view] | {"byteOffset": views[view].get("byteOffset", 0) + 4}
            if view == picture:
                views[view]["byteLength"] -= 4
            return gltf.text_of(read.doc)

        monkeypatch.setattr(gltf, "_text", spoilt)
        with pytest.raises(InPlaceError, match="does not read"):
            gltf.put(data, [mesh], tmp_path, tmp_path)
