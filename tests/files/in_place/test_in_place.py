"""UVs put into the bytes of OBJ, PLY and glTF files: they read as wished, and no other byte differs."""

from __future__ import annotations

import re
import struct
import warnings

import mesh_bytes
import numpy as np
import pytest
from mesh_bytes import CUBE, QUADS, TRIANGLES

from omt_uv.files.in_place import glb, glb_data, obj, obj_text, ply
from omt_uv.files.in_place.glb_layout import GlbChange
from omt_uv.files.in_place.imported import InPlaceError

PLY_FORMS = ("ascii", "binary_little_endian", "binary_big_endian")
FACES = [QUADS[0], QUADS[1], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def stripped(data):
    """An OBJ file without UVs: no lines of them, and no index of them in faces."""
    lines = [line for line in data.split(b"\n") if not line.lstrip().startswith(b"vt")]
    joined = b"\n".join(lines)
    return re.sub(rb"(?<=[\s\d])(-?\d+)/-?\d*(/-?\d+)?", lambda m: m[1] + ((m[2] and b"/" + m[2]) or b""), joined)


def uv_of(data):
    """UVs (c,2) of all corners of an OBJ file, NaN where there are none."""
    text = obj_text.read(data)
    return np.append(text.uv, [[np.nan, np.nan]], axis=0)[text.corner_uv].astype(np.float32), text


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("seams", [True, False])
def test_obj_changes_uvs_and_nothing_else(end, seams):
    data = mesh_bytes.obj_bytes(end)
    wished = mesh_bytes.spread(24) if seams else mesh_bytes.spread(8)[np.concatenate(FACES)]
    new, told = obj.put(data, [mesh_bytes.imported(FACES, wished)])
    assert stripped(new) == stripped(data)
    uv, text = uv_of(new)
    kept = text.is_face & np.isin(np.arange(len(text.is_face)), [0, 1, 2, 3, 6, 8])
    assert (uv[np.repeat(kept, np.diff(text.face_start))] == wished).all()
    assert len(told) == 1
    assert "2 faces" in told[0]
    # Polylines and the faces that Blender drops keep their UVs.
    old, was = uv_of(data)
    rest = np.repeat(~kept, np.diff(text.face_start))
    assert np.array_equal(uv[rest], old[rest], equal_nan=True)


def test_uvs_that_stay_leave_every_byte():
    for seed in range(3):
        once = obj.put(mesh_bytes.obj_bytes(), [mesh_bytes.imported(FACES, mesh_bytes.spread(24, seed))])[0]
        assert obj.put(once, [mesh_bytes.imported(FACES, mesh_bytes.spread(24, seed))])[0] == once
        # And the lines of the run before are used again.
        again = obj.put(once, [mesh_bytes.imported(FACES, mesh_bytes.spread(24, seed + 9))])[0]
        assert again.count(b"\n") == once.count(b"\n")
        for line, before in zip(again.split(b"\n"), once.split(b"\n"), strict=True):
            assert line == before or line.startswith(b"vt")
    for form in PLY_FORMS:
        once = ply.put(mesh_bytes.ply_bytes(form), [mesh_bytes.imported(QUADS, mesh_bytes.spread(24))])[0]
        found = ply.read_uv(once)[0]
        here = mesh_bytes.imported(found.corner_vertex.reshape(-1, 4), mesh_bytes.spread(24), found.positions)
        assert ply.put(once, [here])[0] == once
    once = glb.put(mesh_bytes.glb_bytes(), [mesh_bytes.imported_triangles(mesh_bytes.spread(36) / 4)])[0]
    read = glb_data.read(once)
    corners = glb_data.triangles(read, read.doc["meshes"][0]["primitives"][0])
    here = mesh_bytes.imported(corners, mesh_bytes.spread(36) / 4, CUBE[np.concatenate([np.arange(8), copied(read)])])
    assert glb.put(once, [here])[0] == once


def copied(read):
    """The vertices of which the new ones of the cube are copies."""
    values = glb_data.accessor(read, read.doc["meshes"][0]["primitives"][0]["attributes"]["_CUSTOM"])[:, 0]
    return values[8:].astype(int)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("form", PLY_FORMS)
@pytest.mark.parametrize(
    "names, corners", [(("s", "t"), True), (("texture_u", "texture_v"), False), ((), True), ((), False)]
)
def test_ply_changes_uvs_and_nothing_else(form, names, corners, end):
    data = mesh_bytes.ply_bytes(form, names, corners, end)
    wished = mesh_bytes.spread(24)
    new, told = ply.put(data, [mesh_bytes.imported(QUADS, wished)])
    assert told == []
    old_mesh, mesh = ply.read(data), ply.read(new)
    assert (ply.read_uv(new)[1].astype(np.float32) == wished).all()
    # Corners lie where they lay, on copies of all that their vertices had.
    splits = bool(names) or not corners
    assert len(mesh.positions) == (24 if splits else 8)
    assert (mesh.positions[:8] == CUBE).all()
    assert (mesh.positions[mesh.corner_vertex] == CUBE[QUADS.ravel()]).all()
    for name in ("red", "weight"):
        values = [
            ply.scalars(m.data, m.header, m.header.find("vertex"), m.rows["vertex"], name) for m in (old_mesh, mesh)
        ]
        assert (values[1][mesh.corner_vertex] == values[0][QUADS.ravel()]).all()
    assert data[-2 if form == "ascii" else -8 :] == new[-2 if form == "ascii" else -8 :]
    header = [line for line in new[: mesh.header.size].split(b"\n") if not line.startswith(b"element vertex")]
    added = [line for line in header if line.rstrip() in (b"property float s", b"property float t")]
    assert [line for line in header if splits and not names and line in added] == (added if not names else [])
    kept = [line for line in data[: old_mesh.header.size].split(b"\n") if not line.startswith(b"element vertex")]
    assert kept == [line for line in header if names or line not in added]


@pytest.mark.parametrize("shared, mode, uvs", [(False, 4, True), (True, 4, True), (False, 5, True), (True, 4, False)])
def test_gltf_changes_uvs_and_nothing_else(shared, mode, uvs):
    data = mesh_bytes.glb_bytes(shared, mode, uvs)
    old = glb_data.read(data)
    if mode == 5:
        faces = glb_data.triangles(old, old.doc["meshes"][0]["primitives"][0])
        mesh = mesh_bytes.imported(faces, mesh_bytes.spread(len(faces) * 3))
    else:
        mesh = mesh_bytes.imported_triangles(mesh_bytes.spread(36), shared)
    new = glb_data.read(glb.put(data, [mesh])[0])
    at = 0
    for was, now in zip(*(g.doc["meshes"][0]["primitives"] for g in (old, new)), strict=True):
        before, after = glb_data.triangles(old, was).ravel(), glb_data.triangles(new, now).ravel()
        for a, b in ((was["attributes"], now["attributes"]), *zip(was["targets"], now["targets"], strict=True)):
            for name in set(a) - {"TEXCOORD_0"}:
                assert (glb_data.accessor(old, a[name])[before] == glb_data.accessor(new, b[name])[after]).all()
        uv = glb_data.accessor(new, now["attributes"]["TEXCOORD_0"])[after]
        wished = mesh.uv[at : at + len(after)]
        at += len(after)
        assert uv[:, 0] == pytest.approx(wished[:, 0], abs=0)
        assert 1 - uv[:, 1] == pytest.approx(wished[:, 1], abs=1.2e-7)
    for key in ("asset", "scenes", "nodes", "images", "extensions"):
        assert old.doc[key] == new.doc[key]
    picture = new.doc["bufferViews"][new.doc["images"][0]["bufferView"]]
    assert new.binary[picture["byteOffset"] :][:5] == b"\x89PNG!"
    # Nothing of what was replaced is left behind.
    assert sum(view["byteLength"] for view in new.doc["bufferViews"]) > new.doc["buffers"][0]["byteLength"] - 64


@pytest.mark.parametrize("kind", ["<i2", "<u2", "|i1", "|u1"])
@pytest.mark.parametrize("normal", [True, False])
def test_positions_that_are_whole_numbers_are_found_and_kept(kind, normal):
    """As gltfpack writes them: shares of the greatest number, or numbers that a node scales."""
    most = np.iinfo(kind).max if normal else 1
    change = GlbChange(glb_data.read(mesh_bytes.glb_bytes()))
    primitive = change.doc["meshes"][0]["primitives"][0]
    for name, index in [("POSITION", primitive["attributes"]["POSITION"]), ("TEXCOORD_0", None)]:
        whole = np.abs(CUBE[:, [0, 2, 1]] if index is not None else np.arange(16).reshape(8, 2) % 2) * most
        like = {"type": f"VEC{whole.shape[1]}"} | ({"normalized": True} if normal else {})
        primitive["attributes"][name] = change.replace(index, whole.astype(kind), index is not None, like, 34962)
    data = glb_data.write(change.result())
    faces = np.append(TRIANGLES, [[0, 0, 0]], axis=0)[:-1]
    place = CUBE * [1, -1, 1]
    mesh = mesh_bytes.imported(faces[:-1], mesh_bytes.spread(33), place.astype(np.float32))
    old, new = glb_data.read(data), glb_data.read(glb.put(data, [mesh])[0])
    was, now = (g.doc["meshes"][0]["primitives"][0] for g in (old, new))
    before, after = glb_data.triangles(old, was).ravel(), glb_data.triangles(new, now).ravel()
    stored = [glb_data.accessor(g, p["attributes"]["POSITION"]) for g, p in ((old, was), (new, now))]
    assert stored[0].dtype == stored[1].dtype and (stored[0][before] == stored[1][after]).all()
    uv = glb_data.floats(new, now["attributes"]["TEXCOORD_0"])[after]
    assert uv[:33, 0] == pytest.approx(mesh.uv[:, 0], abs=0)
    # The face that Blender dropped keeps the UVs that the file means.
    assert (uv[33:] == (np.arange(16).reshape(8, 2) % 2)[before[33:]]).all()


@pytest.mark.parametrize("kind", ["<i2", "<u2", "|i1", "|u1"])
@pytest.mark.parametrize("normal", [True, False])
def test_shares_of_the_greatest_number_are_from_minus_one_or_nothing_to_one(kind, normal):
    """The least number with a sign is one further off than the greatest, and means no more than minus one."""
    limits = np.iinfo(kind)
    values = np.array([[limits.min, limits.max], [limits.min // 2, limits.max // 2], [0, 1]]).astype(kind)
    change = GlbChange(glb_data.read(mesh_bytes.glb_bytes()))
    index = change.replace(None, values, False, {"type": "VEC2"} | ({"normalized": True} if normal else {}), 34962)
    found = glb_data.floats(change.result(), index)
    assert found.dtype == np.float32 and found.shape == values.shape
    expected = np.maximum(values / float(limits.max), -1) if normal else values
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_an_obj_keeps_comments_at_its_words_and_uvs_that_are_none():
    data = mesh_bytes.obj_bytes().replace(b"f 2 4 8 6", b"f 2 4 8 6/1#glued 9/9\r\nvt nan\r\nvt x y\r\nvt")
    new = obj.put(data, [mesh_bytes.imported(FACES, mesh_bytes.spread(24))])[0]
    assert stripped(new) == stripped(data) and b"#glued 9/9" in new
    assert (obj_text.read(data).uv[-3:] == 0).all()


def test_buffers_of_a_binary_file_that_lie_elsewhere_are_the_reason_that_is_told():
    read = glb_data.read(mesh_bytes.glb_bytes())
    read.doc["buffers"][0]["uri"] = "cube.bin"
    with pytest.raises(InPlaceError, match="in other files"):
        glb_data.read(glb_data.write(read))


@pytest.mark.parametrize("count", [1, 2])
def test_chunks_of_kinds_that_nobody_knows_stay(count):
    others = b"".join(struct.pack("<II", 4, 0x21212121 + k) + b"abc%d" % k for k in range(count))
    data = bytearray(mesh_bytes.glb_bytes() + others)
    struct.pack_into("<I", data, 8, len(data))
    new = glb.put(bytes(data), [mesh_bytes.imported_triangles(mesh_bytes.spread(36))])[0]
    assert new.endswith(others) and struct.unpack_from("<I", new, 8)[0] == len(new)
    assert [of for _, of in glb_data.read(new).others] == [b"abc%d" % k for k in range(count)]


def test_gltf_without_new_seams_has_only_the_bytes_of_its_uvs_changed():
    data = mesh_bytes.glb_bytes()
    mesh = mesh_bytes.imported_triangles(mesh_bytes.spread(8, 7)[TRIANGLES.ravel()])
    new = glb.put(data, [mesh])[0]
    assert len(new) == len(data)
    view = glb_data.read(data).doc["bufferViews"][1]
    (size,) = struct.unpack_from("<I", data, 12)
    begin = 28 + size + view["byteOffset"]
    assert new[:begin] == data[:begin]
    assert new[begin + view["byteLength"] :] == data[begin + view["byteLength"] :]
    assert new != data


def compressed(doc, name):
    doc["meshes"][0]["primitives"][0]["extensions"] = {name: {}}
    doc["extensionsUsed"] = [name]


@pytest.mark.parametrize("name", ["KHR_draco_mesh_compression", "EXT_meshopt_compression"])
def test_compressed_files_are_refused_by_name(name):
    read = glb_data.read(mesh_bytes.glb_bytes())
    compressed(read.doc, name)
    with pytest.raises(InPlaceError, match=name):
        glb.put(glb_data.write(read), [mesh_bytes.imported_triangles(mesh_bytes.spread(36))])


@pytest.mark.parametrize("put, data", [(obj.put, mesh_bytes.obj_bytes()), (ply.put, mesh_bytes.ply_bytes())])
def test_another_mesh_is_refused(put, data):
    for faces, positions in ((QUADS[:, ::-1], CUBE), (QUADS, CUBE[:, ::-1] * 2 + np.arange(24).reshape(8, 3))):
        with pytest.raises(InPlaceError, match="Blender has faces that are none of the file's"):
            put(data, [mesh_bytes.imported(faces, mesh_bytes.spread(24), positions.astype(np.float32))])


def test_survey_coordinates_that_blender_rounds_or_shifts_are_kept():
    """The mesh is found again where Blender holds it without its offset, and with it rounded to half a metre."""
    place = np.array([4567890.12, 512345.67, 812.5])
    lines = ["v {:.17g} {:.17g} {:.17g}".format(*p) for p in (CUBE + place).tolist()]
    lines += ["f " + " ".join(str(k + 1) for k in face) for face in QUADS.tolist()]
    data = "\n".join(lines).encode()
    for positions in (CUBE, (CUBE + place).astype(np.float32)):
        new, _ = obj.put(data, [mesh_bytes.imported(QUADS, mesh_bytes.spread(24), positions)])
        assert stripped(new) == data


@pytest.mark.parametrize("kind", ["obj", *PLY_FORMS, "glb", "glb shared"])
def test_damaged_files_are_one_named_error_or_done(kind):
    meshes = [mesh_bytes.imported(FACES, mesh_bytes.spread(24))]
    if kind == "obj":
        put, data = obj.put, mesh_bytes.obj_bytes()
    elif kind in PLY_FORMS:
        put, data, meshes = ply.put, mesh_bytes.ply_bytes(kind), [mesh_bytes.imported(QUADS, mesh_bytes.spread(24))]
    else:
        put, data = glb.put, mesh_bytes.glb_bytes("shared" in kind)
        meshes = [mesh_bytes.imported_triangles(mesh_bytes.spread(36), "shared" in kind)]
    done = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for raw in mesh_bytes.mutants(data, 250, seed=3):
            try:
                put(raw, meshes)
                done += 1
            except InPlaceError as error:
                assert str(error)
    assert 0 < done < 250
