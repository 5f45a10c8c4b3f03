"""GLB and PLY files that say what cannot be: each is refused by what is wrong with it, and a neighbour of it goes."""

from __future__ import annotations

import json
import struct
from types import SimpleNamespace

import mesh_bytes
import numpy as np
import pytest

from omt_uv.files.in_place import glb, glb_data, ply
from omt_uv.files.in_place.imported import InPlaceError

JSON, BINARY, OTHER = 0x4E4F534A, 0x004E4942, 0x12345678


def container(*chunks, magic=0x46546C67, version=2):
    body = b"".join(struct.pack("<II", len(data), kind) + data for kind, data in chunks)
    return struct.pack("<III", magic, version, 12 + len(body)) + body


def text(doc):
    return json.dumps(doc).encode()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (container((JSON, text({})), magic=1), "no binary glTF"),
        (container((JSON, text({})), version=1), "no binary glTF"),
        (container((JSON, b"{}")), None),
        (container((JSON, b"{}"))[:19], "no binary glTF"),
        (container((BINARY, b"1234")), "does not begin with JSON"),
        (container((OTHER, b"{}  ")), "does not begin with JSON"),
        (container((JSON, b"{}  "), (BINARY, b"1234"))[:-1], "ends too early"),
        (container((JSON, b"{   ")), "cannot be read"),
        (container((JSON, b"\xff\xff  ")), "cannot be read"),
        (container((JSON, b"[]  ")), "not that of glTF"),
        (container((JSON, text({"accessors": {}}))), "not that of glTF"),
        (container((JSON, text({"accessors": []}))), None),
        (container((JSON, text({"buffers": [{"uri": "a.bin"}]}))), "in other files"),
        (container((JSON, text({"buffers": [{}, {"uri": "a.bin"}]}))), None),
    ],
)
def test_what_is_no_glb_is_refused_by_what_is_wrong(data, words):
    if words is None:
        assert isinstance(glb_data.read(data).doc, dict)
        return
    with pytest.raises(InPlaceError, match=words):
        glb_data.read(data)


def test_chunks_are_told_by_their_kinds():
    found = glb_data.read(container((JSON, b"{}"), (BINARY, b"1234"), (OTHER, b"5678")))
    assert (found.binary, found.others) == (b"1234", [(OTHER, b"5678")])
    found = glb_data.read(container((JSON, b"{}"), (OTHER, b"5678"), (BINARY, b"1234")))
    assert (found.binary, found.others) == (b"", [(OTHER, b"5678"), (BINARY, b"1234")])


def test_meshes_that_share_vertices_have_uvs_of_one_name():
    parts = [SimpleNamespace(primitive={"attributes": {"POSITION": 0}}, mesh=SimpleNamespace(layer=k)) for k in (0, 1)]
    with pytest.raises(InPlaceError, match="different names"):
        glb._write_group(SimpleNamespace(doc={}), parts)


@pytest.mark.parametrize(("shape", "fits"), [((3, 2), True), ((4, 2), False), ((3, 3), False), ((2, 2), False)])
def test_there_are_as_many_uvs_as_vertices(shape, fits, monkeypatch):
    values = np.ones(shape, np.float32)
    monkeypatch.setattr(glb, "floats", lambda file, index: values if index == 7 else None)
    if fits:
        assert glb._old_uv(None, {"TEXCOORD_1": 7}, 1, 3) is values
        assert glb._old_uv(None, {"TEXCOORD_1": 7}, 0, 3) is None
    else:
        with pytest.raises(InPlaceError, match="TEXCOORD_1 has not as many"):
            glb._old_uv(None, {"TEXCOORD_1": 7}, 1, 3)


def test_primitives_are_found_by_what_they_are_and_not_by_what_they_say():
    same = [{"attributes": {}} for _ in range(4)]
    old = SimpleNamespace(doc={"meshes": [{"primitives": same[:1]}, {"primitives": same[1:3]}]})
    assert [glb._place(old, p) for p in same[:3]] == [(0, 0), (1, 0), (1, 1)]
    with pytest.raises(InPlaceError, match="lost a primitive"):
        glb._place(old, same[3])


@pytest.mark.parametrize("tangents", [True, False])
def test_tangents_of_other_uvs_are_told(tangents, monkeypatch):
    part = SimpleNamespace(primitive={"attributes": {"POSITION": 0} | ({"TANGENT": 1} if tangents else {})})
    change = SimpleNamespace(doc={}, glb=None, result=lambda: "new")
    monkeypatch.setattr(glb, "GlbChange", lambda file, grows: change)
    monkeypatch.setattr(glb, "_parts", lambda file, meshes: ([part], 2))
    monkeypatch.setattr(glb, "_write_group", lambda change, group: group)
    monkeypatch.setattr(glb, "_check", lambda *_: None)
    monkeypatch.setattr(glb, "read", lambda data: data)
    monkeypatch.setattr(glb, "write", lambda data: data)
    new, told = glb._put("old", [], False)
    assert new == "new" and len(told) == 1 + tangents and ("TANGENT" in told[-1]) == tangents
    monkeypatch.setattr(glb, "_write_group", lambda change, group: [])
    new, told = glb._put("old", [], False)
    assert new is None and len(told) == 1


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_materials_unlit"])
def test_compressed_buffers_are_refused(name, monkeypatch):
    change = SimpleNamespace(doc={"extensionsUsed": ["KHR_texture_transform", name]}, glb=None)
    monkeypatch.setattr(glb, "GlbChange", lambda file, grows: change)
    monkeypatch.setattr(glb, "_parts", lambda file, meshes: ([], 0))
    if "compression" in name:
        with pytest.raises(InPlaceError, match=name):
            glb._put("old", [], False)
    else:
        assert glb._put("old", [], False) == (None, [])


# ---- PLY -----------------------------------------------------------------------------------------------------


def _with_lists(data):
    """The same with an empty list at the beginning of every vertex."""
    head, body = data.split(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    head = head.replace(b"property", b"property list uchar float weights\nproperty", 1)
    lines = body.split(b"\n")
    return head + b"end_header\n" + b"\n".join([b"0 " + line for line in lines[:count]] + lines[count:])


def test_vertices_of_a_ply_have_no_lists():
    data = mesh_bytes.ply_bytes()
    assert len(ply.read(data).positions)
    with pytest.raises(InPlaceError, match="vertices of the file have lists"):
        ply.read(_with_lists(data))


@pytest.mark.parametrize(("kind", "fits"), [("f4", True), ("f8", True), ("i4", False), ("u1", False)])
def test_uvs_of_vertices_are_floats(kind, fits, monkeypatch):
    properties = [SimpleNamespace(name=n, type=kind if n in "st" else "f4") for n in "xyzst"]
    vertex = SimpleNamespace(properties=properties)
    face = SimpleNamespace(properties=[SimpleNamespace(name="vertex_indices", type="u1")])
    header = SimpleNamespace(find=lambda name: vertex if name == "vertex" else face, order="<")
    rows = {"vertex": SimpleNamespace(start=[0, 1]), "face": SimpleNamespace(start=[1, 2])}
    file = SimpleNamespace(header=header, rows=rows, pairs=[("s", "t")], data=b"", indices="vertex_indices")
    monkeypatch.setattr(ply, "scalars", lambda *_: np.zeros(3))
    size = [256]
    monkeypatch.setattr(ply, "_split", lambda *_: SimpleNamespace(touched=np.zeros(size[0], bool)))
    header.size = 0
    monkeypatch.setattr(ply, "_header", lambda ply, count: b"h")
    monkeypatch.setattr(ply, "_binary_vertices", lambda *_: b"v")
    monkeypatch.setattr(ply, "_binary_faces", lambda *_: b"f")
    if not fits:
        with pytest.raises(InPlaceError, match="no floats"):
            ply._with_vertices(file, None, None)
        return
    assert ply._with_vertices(file, None, None) == b"hvf"
    # A byte counts to 255.
    size[0] = 257
    with pytest.raises(InPlaceError, match="no numbers left"):
        ply._with_vertices(file, None, None)
