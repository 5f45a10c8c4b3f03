"""UVs in glTF files of text: files of buffers stay, what is new is in the text, and everything else is kept."""

from __future__ import annotations

import base64
import json
from types import SimpleNamespace

import mesh_bytes
import numpy as np
import pytest
from mesh_bytes import gltf_parts, imported, imported_triangles, spread

from omt_uv.files.in_place import glb_data, gltf
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
