"""UVs in glTF files of text: files of buffers stay, what is new is in the text, and everything else is kept."""

from __future__ import annotations

import base64
import json
from types import SimpleNamespace

import mesh_bytes
import numpy as np
import pytest
from mesh_bytes import gltf_parts, imported, imported_triangles, spread

from omt_uv.files.in_place import glb, glb_data, gltf
from omt_uv.files.in_place.imported import InPlaceError


def uvs(read):
    """UVs (c,2) of the corners, as Blender has them."""
    (primitive,) = read.glb.doc["meshes"][0]["primitives"]
    found = glb_data.accessor(read.glb, primitive["attributes"]["TEXCOORD_0"])
    uv = found[glb_data.triangles(read.glb, primitive).ravel()]
    return np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1)


def as_imported(read, uv):
    """What Blender makes of a file, with other UVs."""
    (primitive,) = read.glb.doc["meshes"][0]["primitives"]
    x, y, z = glb_data.accessor(read.glb, primitive["attributes"]["POSITION"]).T
    return imported(glb_data.triangles(read.glb, primitive), uv, np.stack([x, -z, y], axis=1))


@pytest.mark.parametrize("embedded", [False, True], ids=["beside", "embedded"])
@pytest.mark.parametrize("indent", [None, 2, "\t"])
def test_only_uvs_change_and_files_of_buffers_never(tmp_path, embedded, indent):
    data, raw = gltf_parts(indent, embedded)
    if not embedded:
        (tmp_path / "cu be.bin").write_bytes(raw)
    uv = spread(36)
    new, told = gltf.put(data, [imported_triangles(uv)], tmp_path, tmp_path)
    assert told == [] and np.allclose(uvs(gltf.read(new, tmp_path)), uv, atol=2e-7)
    old, doc = json.loads(data), json.loads(new)
    assert doc["buffers"][0] == old["buffers"][0] and len(doc["buffers"]) == 2
    for key in old.keys() - {"accessors", "bufferViews", "buffers", "meshes"}:
        assert doc[key] == old[key], key
    # The picture has its bytes, and so have the lines of the text.
    view = doc["bufferViews"][doc["images"][0]["bufferView"]]
    assert view == old["bufferViews"][old["images"][0]["bufferView"]]
    lines = {line.rstrip(b",") for line in data.splitlines()} & {line.rstrip(b",") for line in new.splitlines()}
    assert indent is None or len(lines) > 20
    # Again the same is nothing to do, and other ones take the place of these.
    assert gltf.put(new, [as_imported(gltf.read(new, tmp_path), uv)], tmp_path, tmp_path)[0] == new
    again, _ = gltf.put(new, [as_imported(gltf.read(new, tmp_path), uv[::-1])], tmp_path, tmp_path)
    found = gltf.read(again, tmp_path)
    assert np.allclose(uvs(found), uv[::-1], atol=2e-7) and len(found.buffers) == 3
    third, _ = gltf.put(again, [as_imported(found, uv)], tmp_path, tmp_path)
    assert len(third) == pytest.approx(len(again), rel=0.05) and len(gltf.read(third, tmp_path).buffers) == 3


def test_where_the_file_of_a_buffer_is_not_its_bytes_are(tmp_path):
    data, raw = gltf_parts()
    (tmp_path / "cu be.bin").write_bytes(raw)
    (tmp_path / "there").mkdir()
    new, _ = gltf.put(data, [imported_triangles(spread(36))], tmp_path, tmp_path / "there")
    uri = json.loads(new)["buffers"][0]["uri"]
    assert base64.b64decode(uri.partition(",")[2]) == raw
    assert np.allclose(uvs(gltf.read(new, tmp_path / "there")), spread(36), atol=2e-7)
    # Where it is, with the same bytes, it is named as before; where it is another one, it is not.
    (tmp_path / "there" / "cu be.bin").write_bytes(raw)
    new, _ = gltf.put(data, [imported_triangles(spread(36))], tmp_path, tmp_path / "there")
    assert json.loads(new)["buffers"][0]["uri"] == "cu%20be.bin"
    (tmp_path / "there" / "cu be.bin").write_bytes(raw[::-1])
    new, _ = gltf.put(data, [imported_triangles(spread(36))], tmp_path, tmp_path / "there")
    assert json.loads(new)["buffers"][0]["uri"].startswith("data:")


def test_a_file_whose_uvs_stay_goes_elsewhere_with_its_buffers(tmp_path):
    """The text is not the same there: it names files that are not beside it."""
    data, raw = gltf_parts()
    (tmp_path / "cu be.bin").write_bytes(raw)
    (tmp_path / "there").mkdir()
    here, _ = gltf.put(data, [imported_triangles(spread(36))], tmp_path, tmp_path)
    same = as_imported(gltf.read(here, tmp_path), spread(36))
    assert gltf.put(here, [same], tmp_path, tmp_path)[0] == here
    there, _ = gltf.put(here, [same], tmp_path, tmp_path / "there")
    (tmp_path / "cu be.bin").unlink()
    assert np.allclose(uvs(gltf.read(there, tmp_path / "there")), spread(36), atol=2e-7)


def test_what_is_no_gltf_or_lies_elsewhere_is_named(tmp_path):
    data, raw = gltf_parts()
    meshes = [imported_triangles(spread(36))]
    with pytest.raises(InPlaceError, match=r"cu be\.bin"):
        gltf.put(data, meshes, tmp_path, tmp_path)
    (tmp_path / "cu be.bin").write_bytes(raw[:-1])
    with pytest.raises(InPlaceError, match=f"declares {len(raw)} bytes and has {len(raw) - 1}"):
        gltf.put(data, meshes, tmp_path, tmp_path)
    for uri in ("https://x.org/a.bin", "/etc/passwd", "C:\\a.bin", "file:///a"):
        with pytest.raises(InPlaceError, match="not in the folder"):
            gltf.put(data.replace(b"cu%20be.bin", json.dumps(uri)[1:-1].encode()), meshes, tmp_path, tmp_path)
    for bad in (b"", b"\xff\xfe", b"[]", b"{}", b'{"buffers": 3}', data[:-30]):
        with pytest.raises(InPlaceError):
            gltf.put(bad, meshes, tmp_path, tmp_path)


def test_mutants_are_refused_or_changed_and_nothing_else_is_raised(tmp_path):
    data, raw = gltf_parts(embedded=True)
    (tmp_path / "cu be.bin").write_bytes(raw)
    for mutant in mesh_bytes.mutants(data, 150):
        try:
            gltf.put(mutant, [imported_triangles(spread(36))], tmp_path, tmp_path)
        except InPlaceError as error:
            assert str(error)


@pytest.mark.parametrize("count", [0, 2, 3, 4, 7])
def test_lists_strips_and_fans_are_the_triangles_that_the_format_says(count):
    glb = SimpleNamespace(doc={"accessors": [{"count": count}]})
    expected = {
        4: [(k, k + 1, k + 2) for k in range(0, count - 2, 3)],
        # Every other one of a strip is turned.
        5: [(k, k + 1, k + 2) if k % 2 == 0 else (k, k + 2, k + 1) for k in range(count - 2)],
        6: [(0, k, k + 1) for k in range(1, count - 1)],
        1: [],
    }
    for mode, faces in expected.items():
        found = glb_data.triangles(glb, {"attributes": {"POSITION": 0}, "mode": mode})
        assert found.tolist() == [list(face) for face in faces], mode
    assert glb_data.triangles(glb, {"attributes": {}}).shape == (0, 3)


@pytest.mark.parametrize("form", ["embedded", "beside"])
def test_a_buffer_has_as_many_bytes_as_it_declares_and_no_others(tmp_path, form):
    (tmp_path / "a b.bin").write_bytes(b"0123456789")
    head = "data:application/octet-stream;base64,"
    uri = {"embedded": head + base64.b64encode(b"0123456789").decode(), "beside": "a%20b.bin"}[form]
    for length in (0, 1, 9, 10):
        assert gltf._bytes_of(0, {"uri": uri, "byteLength": length}, tmp_path) == b"0123456789"[:length]
    for length in (-1, 11, 1.5, "10", None):
        with pytest.raises(InPlaceError, match="buffer 3 declares"):
            gltf._bytes_of(3, {"uri": uri, "byteLength": length}, tmp_path)
    strange = {"data:text/plain,0123": "of a kind", head + "0": "no base64", "https://a/b.bin": "not in the folder",
               "": "not in the folder", "c.bin": "c.bin: No such file"}  # fmt: skip
    for uri, text in strange.items():
        with pytest.raises(InPlaceError, match=text):
            gltf._bytes_of(3, {"uri": uri, "byteLength": 1}, tmp_path)


# The specification's table of types of numbers (5.1.3).
NUMBERS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}


@pytest.mark.parametrize("code", NUMBERS)
@pytest.mark.parametrize("gap", [0, 4])
def test_numbers_of_every_type_are_read_as_they_were_written(code, gap):
    """Beside one another, and with gaps; all of them, and some in the place of others."""
    kind = np.dtype(NUMBERS[code]).newbyteorder("<")
    top = np.finfo(np.float32).max if code == 5126 else np.iinfo(kind).max
    values = np.array([[0, 1, 2], [top, 3, 4], [5, 6, top]], kind)
    rows = b"".join(row.tobytes() + bytes(gap) for row in values)
    new = np.array([[7, 8, 9]], kind)
    where = np.array([1], "<u2").tobytes() + bytes(2)
    doc = {
        "buffers": [{"byteLength": 4 + len(rows) + len(where) + 12}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 4, "byteLength": len(rows)}
            | ({"byteStride": 3 * kind.itemsize + 4} if gap else {}),
            {"buffer": 0, "byteOffset": 4 + len(rows), "byteLength": 2},
            {"buffer": 0, "byteOffset": 4 + len(rows) + len(where), "byteLength": 3 * kind.itemsize},
        ],
        "accessors": [{"bufferView": 0, "componentType": code, "count": 3, "type": "VEC3"}],
    }
    doc["accessors"].append(
        doc["accessors"][0]
        | {"sparse": {"count": 1, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 2}}}
    )
    doc["accessors"].append({"componentType": code, "count": 2, "type": "VEC3"})
    glb = glb_data.Glb(doc, bytes(4) + rows + where + new.tobytes() + bytes(12), [])
    found = [glb_data.accessor(glb, k) for k in range(3)]
    assert all(one.dtype == kind for one in found)
    np.testing.assert_array_equal(found[0], values)
    np.testing.assert_array_equal(found[1], [values[0], new[0], values[2]])
    np.testing.assert_array_equal(found[2], np.zeros((2, 3)))


DAMAGED = {
    "counts": lambda doc: doc["accessors"][0].update(count=10**9),
    "leads out of": lambda doc: doc["accessors"][0].update(byteOffset=60),
    "matrices of small": lambda doc: doc["accessors"][0].update(componentType=5121, type="MAT3"),
    "does not have": lambda doc: doc["accessors"][0]["sparse"].update(count=3),
    "replaces -1 values": lambda doc: doc["accessors"][0]["sparse"].update(count=-1),
    "in other files": lambda doc: doc["buffers"][0].update(uri="a.bin"),
    "compressed": lambda doc: doc["bufferViews"][0].update(extensions={"EXT_meshopt_compression": {}}),
}


@pytest.mark.parametrize("text", DAMAGED)
def test_accessors_that_lie_are_refused_by_what_is_wrong(text):
    doc = {
        "buffers": [{"byteLength": 64}],
        "bufferViews": [{"buffer": 0, "byteLength": 64}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR"}],
    }
    doc["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": 0, "componentType": 5125},
        "values": {"bufferView": 0},
    }
    glb = glb_data.Glb(doc, bytes(64), [])
    np.testing.assert_array_equal(glb_data.accessor(glb, 0), np.zeros((2, 1)))
    DAMAGED[text](doc)
    with pytest.raises(InPlaceError, match=text):
        glb_data.accessor(glb, 0)


# What leads to the last byte or value that is there, and `more` beyond it, and what is wrong then.
ENDS = {
    "offset of values": (lambda doc, more: doc["accessors"][0].update(byteOffset=56 + more), "leads out of"),
    "offset of a view": (lambda doc, more: doc["bufferViews"][0].update(byteOffset=56 + more), "leads out of"),
    "stride": (lambda doc, more: doc["bufferViews"][0].update(byteStride=60 + more), "leads out of"),
    "count": (lambda doc, more: doc["accessors"][0].update(count=16 + more), "leads out of"),
    "count of new ones": (lambda doc, more: doc["accessors"][0]["sparse"].update(count=2 + more), "does not have"),
    "offset of new ones": (
        lambda doc, more: doc["accessors"][0]["sparse"]["values"].update(byteOffset=60 + more),
        "leads out of",
    ),
    "offset of their places": (
        lambda doc, more: doc["accessors"][0]["sparse"]["indices"].update(byteOffset=60 + more),
        "leads out of",
    ),
    "place of a new one": (lambda doc, more: doc.update(place=1 + more), "does not have"),
}


@pytest.mark.parametrize("end", ENDS)
def test_the_last_byte_and_the_last_value_are_read_and_none_beyond(end):
    change, text = ENDS[end]
    for more in (-1, 0, 1, 2):
        doc = {
            "buffers": [{"byteLength": 64}],
            "bufferViews": [{"buffer": 0, "byteLength": 64}, {"buffer": 0, "byteLength": 64}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR"}],
        }
        places = {"bufferView": 1, "componentType": 5125}
        doc["accessors"][0]["sparse"] = {"count": 1, "indices": places, "values": {"bufferView": 1}}
        change(doc, more)
        glb = glb_data.Glb(doc, int(doc.get("place", 0)).to_bytes(4, "little") + bytes(60), [])
        if more <= 0:
            assert len(glb_data.accessor(glb, 0)) == doc["accessors"][0]["count"]
            continue
        with pytest.raises(InPlaceError, match=text):
            glb_data.accessor(glb, 0)


@pytest.mark.parametrize("other", ["TEXCOORD_1", "_MINE"])
def test_where_two_attributes_are_one_accessor_the_other_one_keeps_its_values(tmp_path, other):
    data, raw = gltf_parts()
    (tmp_path / "cu be.bin").write_bytes(raw)
    doc = json.loads(data)
    attributes = doc["meshes"][0]["primitives"][0]["attributes"]
    attributes[other] = attributes["TEXCOORD_0"]
    before = gltf.read(json.dumps(doc).encode(), tmp_path)
    corners = glb_data.triangles(before.glb, before.glb.doc["meshes"][0]["primitives"][0]).ravel()
    kept = glb_data.accessor(before.glb, attributes[other])[corners]
    # One UV for each vertex, so that none is split and the accessor could be written over.
    vertex_uv = spread(8, 3)
    x, y, z = glb_data.accessor(before.glb, attributes["POSITION"]).T
    for uv in (vertex_uv[corners], spread(36)):
        mesh = imported(corners.reshape(-1, 3), uv, np.stack([x, -z, y], axis=1))
        new = gltf.read(gltf.put(json.dumps(doc).encode(), [mesh], tmp_path, tmp_path)[0], tmp_path)
        (primitive,) = new.glb.doc["meshes"][0]["primitives"]
        there = glb_data.triangles(new.glb, primitive).ravel()
        np.testing.assert_array_equal(glb_data.accessor(new.glb, primitive["attributes"][other])[there], kept)
        np.testing.assert_allclose(uvs(new), uv, atol=2e-7)


@pytest.mark.parametrize("changed", [(), (0,), (1,), (0, 1)], ids=str)
def test_tangents_are_told_of_where_uvs_beside_them_have_changed(monkeypatch, changed):
    primitives = [{"attributes": {"POSITION": 2 * k, **({"TANGENT": 1} if k == 1 else {})}} for k in range(2)]
    parts = [SimpleNamespace(primitive=primitive) for primitive in primitives]
    change = SimpleNamespace(doc={}, glb="glb", result=lambda: "new")
    monkeypatch.setattr(glb, "GlbChange", lambda *_: change)
    monkeypatch.setattr(glb, "_parts", lambda *_: (parts, 0))
    monkeypatch.setattr(glb, "_write_group", lambda _, group: [p for p in group if parts.index(p) in changed])
    for name in ("_check", "read", "write"):
        monkeypatch.setattr(glb, name, lambda *_: None)
    new, told = glb._put("glb", [], False)
    assert new == ("new" if changed else None) and len(told) == (1 in changed)


@pytest.mark.parametrize("names", [("Cube", "Cube"), ("Cube", "Other"), ("Other", "Cube")])
def test_every_mesh_of_a_file_is_found_once_also_where_meshes_and_names_are_alike(monkeypatch, names):
    doc = {"meshes": [{"name": name, "primitives": []} for name in names], "nodes": [{"mesh": 0}, {"mesh": 1}]}
    meshes = glb._Meshes(SimpleNamespace(doc=doc))
    monkeypatch.setattr(glb._Meshes, "_corners", lambda self, k, mesh: np.array([k]))
    found = [meshes.find(SimpleNamespace(name="Cube"))[0] for _ in names]
    first = names.index("Cube")
    assert found == [first, 1 - first]
    with pytest.raises(InPlaceError, match="none of the file's"):
        meshes.find(SimpleNamespace(name="Cube"))
