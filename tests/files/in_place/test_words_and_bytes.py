"""Words of texts and bytes of rows, one by one: what a line says, where a value stands, what is replaced in it."""

from __future__ import annotations

import json
import struct
from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.files import fbx_nodes
from omt_uv.files.formats import headers, off
from omt_uv.files.in_place import glb, glb_data, gltf, imported, obj, obj_text, ply, ply_rows
from omt_uv.files.in_place.imported import Imported, InPlaceError


@pytest.mark.parametrize(
    "data, lines",
    [
        (b"a\nb\n", [b"a\n", b"b\n"]),
        (b"a\nb", [b"a\n", b"b"]),
        (b"a\\\nb\nc", [b"a\\\nb\n", b"c"]),
        (b"", []),
        (b"a\\\r\nb\\\nc\nd\n", [b"a\\\r\nb\\\nc\n", b"d\n"]),
        (b"a\\ b\n", [b"a\\ b\n"]),
    ],
)
def test_lines_go_on_after_a_backslash(data, lines):
    assert obj_text._logical_lines(data) == lines and b"".join(lines) == data


@pytest.mark.parametrize(
    "line, said",
    [
        (b"f 1 2 3\n", [b"f", b"1", b"2", b"3"]),
        (b"v 1 2 # 3\n", [b"v", b"1", b"2"]),
        (b"# v 1\n", []),
        (b"f 1 \\\n2 3\n", [b"f", b"1", b"2", b"3"]),
        (b"f 1 \\\r\n 2\n", [b"f", b"1", b"2"]),
    ],
)
def test_words_are_what_is_said_before_a_comment(line, said):
    assert obj_text.words(line) == said


@pytest.mark.parametrize(
    "corners, found",
    [
        ([b"1", b"-2"], [[1, 0], [-2, 0]]),
        ([b"1/2", b"3/-4"], [[1, 2], [3, -4]]),
        ([b"1//2", b"3//4"], [[1, 0], [3, 0]]),
        ([b"1/2/3", b"4/5/6"], [[1, 2], [4, 5]]),
        ([b"1/2", b"3", b"4//5"], [[1, 2], [3, 0], [4, 0]]),
        ([b"x/2", b"3/y"], [[0, 2], [3, 0]]),
        ([b"123456789012345678901/1"], [[0, 1]]),
        ([b"1/2/3/4"], [[1, 2]]),
        ([], []),
    ],
)
def test_corners_say_vertices_and_uvs(corners, found):
    assert obj_text._indices(corners).tolist() == found


def test_numbers_count_from_one_or_backwards_and_others_are_none():
    data = b"v 0 0 0\nv 1 0 0\nvt 0 0\nf 1/1 2/2 3/-1 -1/-2 -3/0\nv 0 1 0\nvt 1 1\nl 3 1\np 2\nf -1/-1 1/1 2/2\n"
    text = obj_text.read(data)
    assert text.corner_vertex.tolist() == [0, 1, -1, 1, -1, 2, 0, 1, 2, 0, 1]
    assert text.corner_uv.tolist() == [0, -1, 0, -1, -1, -1, -1, -1, 1, 0, 1]
    assert text.face_start.tolist() == [0, 5, 7, 8, 11] and text.face_line.tolist() == [3, 6, 7, 8]
    assert text.is_face.tolist() == [True, False, False, True] and text.last_vertex.tolist() == [2, 5, 5, 5]
    assert text.uv_line.tolist() == [2, 5] and text.positions.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert not text.has_surfaces and obj_text.read(data + b"surf 0 1 0 1 1/1\n").has_surfaces
    for kind in (b"vn 0 0 1\n", b"vp 0 1\n"):
        assert obj_text.read(b"v 0 0 0\n" + kind + b"f 1 1 1\n").last_vertex.tolist() == [1]


def test_uvs_that_lack_numbers_are_zero_there():
    lines = [b"vt 0.5 0.25 1\n", b"vt 0.5\n", b"vt x 2\n", b"vt nan inf\n", b"vt\n"]
    assert obj_text._uvs(lines).tolist() == [[0.5, 0.25], [0.5, 0], [0, 2], [0, 0], [0, 0]]
    assert obj_text._uvs(lines[:1]).tolist() == [[0.5, 0.25]]
    with pytest.raises(InPlaceError, match="lacks a number"):
        obj_text.numbers([b"v 1 2\n"], 3)


@pytest.mark.parametrize(
    "line, uvs, count, new",
    [
        (b"f 1/9 2/9 3/9\n", [0, 4, -1], 5, b"f 1/1 2/5 3/9\n"),
        (b"f 1 2 3\r\n", [0, 1, 2], 3, b"f 1/1 2/2 3/3\r\n"),
        (b"f 1//7 2//7\n", [3, -1], 9, b"f 1/4/7 2//7\n"),
        (b"f -1/-2 -3/1\n", [4, 4], 6, b"f -1/-2 -3/5\n"),
        (b"f  1/9   2/9 # both\n", [1, -1], 5, b"f  1/2   2/9 # both\n"),
        (b"f -1 -2\n", [2, 0], 3, b"f -1/-1 -2/-3\n"),
    ],
)
def test_faces_get_other_numbers_of_uvs_and_keep_the_rest(line, uvs, count, new):
    assert obj._face(line, uvs, count) == new


def test_lines_of_uvs_keep_what_stays_and_end_as_those_beside():
    old, new = np.array([0.5, 0.25]), np.array([0.1, 2.0], np.float32)
    assert obj._uv_line(b"vt  0.50  0.25  0\n", old, old.astype(np.float32)) == b"vt  0.50  0.25  0\n"
    assert obj._uv_line(b"vt  0.50  0.25  0\n", old, new) == b"vt  0.100000001  2  0\n"
    assert obj._uv_line(b"vt 0.5\r\n", old, new) == b"vt 0.100000001 2\r\n"
    assert obj._new_line(new, b"f 1\n") == b"vt 0.100000001 2\n" and obj._new_line(new, b"x\r\n").endswith(b"2\r\n")
    assert obj._replaced(b"a  b c\n", {1: b"X", 2: b"Y"}) == b"a  X Y\n" and obj._replaced(b"a b\n", {}) == b"a b\n"


def text_of(**given):
    fields = {
        "uv": np.zeros((4, 2)),
        "uv_line": np.array([1, 2, 3, 9]),
        "corner_uv": np.array([0, 1, 1, 2, -1]),
        "face_line": np.array([5, 6, 20]),
        "last_vertex": np.array([0, 0, 15]),
        "has_surfaces": False,
    }
    return SimpleNamespace(**fields | given)


def test_uvs_take_the_lines_of_their_corners_then_free_ones_then_new_ones():
    text, here = text_of(), np.array([True, True, True, True, True])
    # Groups 0 and 1 share line 1; 2 has line 2; 3 had none.
    group, values, first = np.array([0, 0, 1, 2, 3]), np.arange(8.0).reshape(4, 2), np.array([0, 0, 1, 2])
    plan = obj._plan(text, here, group, values, first)
    # Line 3 is used by nobody, and stays.
    assert plan.kept.tolist() == [False, False, False, True]
    assert plan.slot.tolist()[:3] == [0, 1, 2] and plan.slot[3] == -1
    assert plan.after.tolist() == [-1, -1, -1, 9]
    some = obj._plan(text, np.array([True, True, False, True, True]), np.array([0, 0, 2, 3]), values, first)
    assert some.kept.tolist() == [False, True, False, True]
    every = obj._plan(text_of(has_surfaces=True), here, group, values, first)
    assert every.kept.all() and (every.slot == -1).all() and (every.after >= 0).all()
    early = obj._plan(
        text_of(uv=np.zeros((0, 2)), uv_line=np.zeros(0, int), corner_uv=np.full(5, -1)), here, group, values, first
    )
    assert early.after.tolist() == [0, 0, 0, 15]


def test_the_first_face_of_each_group():
    text = SimpleNamespace(face_line=np.array([3, 5, 8]), face_start=np.array([0, 2, 4, 6]))
    here = np.array([True, False, True, True, True, True])
    assert obj._first_lines(text, here, np.array([1, 0, 1, 2, 0]), 4).tolist() == [1, 0, 2, 3]


HEADER = (
    b"ply\nformat %s 1.0\nelement vertex 2\nproperty float x\nproperty double y\nelement face 2\n"
    b"property list uchar int vertex_indices\nproperty uchar flag\nend_header\n"
)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("even", [True, False])
def test_rows_of_bytes_are_where_their_sizes_say(order, even):
    name = b"binary_little_endian" if order == "<" else b"binary_big_endian"
    lists = [[5, 6, 7], [8, 9, 10] if even else [8, 9]]
    body = b"".join(struct.pack(order + "fd", x, y) for x, y in ((1.5, 2.5), (3.5, 4.5)))
    body += b"".join(struct.pack(order + f"B{len(of)}iB", len(of), *of, 40 + k) for k, of in enumerate(lists))
    data = HEADER % name + body
    header = ply_rows.read_header(data)
    rows = ply_rows.read_rows(data, header, {"vertex", "face"})
    vertex, face = (header.find(x) for x in ("vertex", "face"))
    assert header.size == len(HEADER % name) and [e.line for e in header.elements] == [2, 5]
    assert vertex.property_lines == [3, 4] and face.property_lines == [6, 7]
    assert rows["vertex"].start.tolist() == [header.size + 12 * k for k in range(3)]
    assert ply_rows.scalars(data, header, vertex, rows["vertex"], "y").tolist() == [2.5, 4.5]
    assert rows["face"].count["vertex_indices"].tolist() == [len(of) for of in lists]
    assert ply_rows.lists(data, header, face, rows["face"], "vertex_indices").tolist() == [
        v for each in lists for v in each
    ]
    assert ply_rows.scalars(data, header, face, rows["face"], "flag").tolist() == [40, 41]
    assert rows["face"].start[-1] == len(data)
    assert (ply_rows._even_layout(data, int(rows["face"].start[0]), face, order) is not None) == even
    for cut in (1, 14):
        with pytest.raises(InPlaceError, match="ends before its face"):
            ply_rows.read_rows(data[:-cut], header, {"face"})
    assert set(ply_rows.read_rows(data, header, {"vertex"})) == {"vertex"}


def test_rows_of_texts_are_lines():
    data = HEADER % b"ascii" + b"1.5 2.5\n 3.5  4.5 \n3 5 6 7 40\n2 8 9 41"
    header = ply_rows.read_header(data)
    rows = ply_rows.read_rows(data, header, {"face"})
    face = header.find("face")
    assert ply_rows.scalars(data, header, header.find("vertex"), rows["vertex"], "y").tolist() == [2.5, 4.5]
    assert ply_rows.lists(data, header, face, rows["face"], "vertex_indices").tolist() == [5, 6, 7, 8, 9]
    assert ply_rows.scalars(data, header, face, rows["face"], "flag").tolist() == [40, 41]
    assert rows["face"].start[-1] == len(data)
    for bad, words in (
        (b"3 5 6\n", "lacks values"),
        (b"x 5\n", "no length"),
        (b"-1 5\n", "negative length"),
        (b"\n", "no length"),
    ):
        with pytest.raises(InPlaceError, match=words):
            ply_rows.read_rows(HEADER % b"ascii" + b"1 2\n3 4\n3 5 6 7 40\n" + bad, header, {"face"})


@pytest.mark.parametrize(
    "change, words",
    [
        ((b"end_header\n", b""), "does not end"),
        ((b"ply", b"plx"), "lacks a format"),
        ((b"format ascii 1.0\n", b""), "lacks a format"),
        ((b"format ascii", b"format other"), "has a line 'format other 1.0'"),
        ((b"vertex 2", b"vertex x"), "has a line 'element"),
        ((b"vertex 2", b"vertex -2"), "more than"),
        ((b"vertex 2", b"vertex 99999"), "more than"),
        ((b"property float x", b"property what x"), "has a line 'property what x'"),
    ],
)
def test_headers_are_refused_by_the_line(change, words):
    with pytest.raises(InPlaceError, match=words):
        ply_rows.read_header((HEADER % b"ascii").replace(*change))
    with pytest.raises(InPlaceError, match="no element 'edge'"):
        ply_rows.read_header(HEADER % b"ascii" + b"x" * 99).find("edge")


def test_bytes_are_gathered_span_by_span():
    assert ply_rows.gather(b"abcdefgh", np.array([5, 0, 2]), np.array([2, 0, 3])) == b"fgcde"
    assert ply_rows.spans(np.array([4, 0]), np.array([3, 2])).tolist() == [4, 5, 6, 0, 1]


def test_vertices_are_split_where_they_have_several_uvs_and_keep_their_own():
    mesh = SimpleNamespace(positions=np.zeros((3, 3)), corner_vertex=np.array([0, 1, 2, 0, 2, 1, 0]))
    wished = np.array([[1, 1], [2, 2], [3, 3], [4, 4], [3, 3], [5, 5]], np.float32)
    here = np.array([True] * 6 + [False])
    split = ply._split(mesh, None, here, wished)
    # The first stays where no UV was there.
    assert split.corner_vertex.tolist() == [0, 1, 2, 3, 2, 4, 0] and split.copies.tolist() == [0, 1]
    assert split.uv[split.corner_vertex[here]].tolist() == wished.tolist() and split.touched.all()
    old = np.array([[4, 4], [9, 9], [3, 3]])
    split = ply._split(mesh, old, here, wished)
    assert split.corner_vertex.tolist() == [3, 1, 2, 0, 2, 4, 0] and split.copies.tolist() == [0, 1]
    assert split.uv[split.corner_vertex[here]].tolist() == wished.tolist()
    before = np.array([[4, 4], [9, 9], [3, 3]], np.float32)
    corner, copies, uv = glb._split(before, mesh.corner_vertex[:6], wished)
    assert corner.tolist() == [3, 1, 2, 0, 2, 4] and copies.tolist() == [0, 1]
    assert uv[corner].tolist() == wished.tolist() and len(uv) == 5
    # What nobody asks for keeps its UV.
    lone = glb._split(before, np.array([0]), wished[:1])[2]
    assert lone.tolist() == [[1, 1], [9, 9], [3, 3]]


def test_words_are_replaced_where_they_begin():
    assert ply._replaced(b"12 345  6\n", {3: b"X", 8: b"YY"}) == b"12 X  YY\n"
    assert ply._digits(np.array([0.1, 2], np.float32)) == [b"0.100000001", b"2"]
    counted = SimpleNamespace(type="f4", count_type="u1")
    assert ply._list("", counted, np.array([1.0, 2.5], np.float32)) == b"2 1 2.5"
    assert ply._list(">", counted, np.array([1.0], np.float32)) == b"\x01" + struct.pack(">f", 1)
    assert len(ply._list("<", counted, np.zeros(255, np.float32))) == 1 + 4 * 255
    with pytest.raises(InPlaceError, match="more corners"):
        ply._list("<", counted, np.zeros(256, np.float32))


def test_places_are_equal_where_positions_are_or_all_agree_but_for_an_offset():
    ours = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 2, 0.0]])
    a, b = imported.same_places(ours, ours[[3, 1, 0]].astype(np.float32))
    assert a[0] == a[2] == b[2] and a[1] == b[1] and a[3] == b[0] and len({*a.tolist()}) == 3
    a, b = imported.same_places(ours + 1e6 + 1e-4, (ours + 1e6).astype(np.float32))
    assert a.tolist() == b.tolist() == [0, 1, 2, 3]
    far = ours + 5e5
    assert imported._agree(far, ours.astype(np.float32)) and not imported._agree(far, (2 * ours).astype(np.float32))
    bound = 2 * np.finfo(np.float32).eps * 2
    near = ours.copy()
    near[3, 1] += 0.9 * bound
    assert imported._agree(ours * 1.0, near) and imported._agree(ours[:0], ours[:0])
    near[3, 1] += 0.3 * bound
    assert not imported._agree(ours * 1.0, near)


@pytest.mark.parametrize(("place", "offset"), [(0, 0), (1e3, -1e3), (1e6, 0), (1e6, 512.3), (1e6, -7e5), (1e6, -1e6)])
def test_positions_agree_wherever_they_are_in_the_world(place, offset):
    """Single precision is that of the place, however small the mesh is."""
    ours = place + np.random.default_rng(2).random((40, 3))
    theirs = (ours + offset).astype(np.float32)
    assert imported._agree(ours, theirs)
    theirs[7, 1] += 9 * np.spacing(np.float32(place + 1))
    assert not imported._agree(ours, theirs)


def test_faces_are_found_again_by_their_vertices_in_their_order():
    ours, start = np.array([0, 1, 2, 2, 1, 3, 0, 1, 2, 4, 4, 1]), np.array([0, 3, 6, 9, 12])
    theirs, their_start = np.array([0, 1, 2, 0, 1, 2, 2, 1, 3]), np.array([0, 3, 6, 9])
    found = imported.find_corners((ours, start), (theirs, their_start))
    assert found.tolist() == [0, 1, 2, 6, 7, 8, 3, 4, 5, -1, -1, -1]
    assert imported.find_corners((ours, start), (ours, start)).tolist() == list(range(12))
    faces = np.ones(4, bool)
    assert imported.check_found(found, start, faces, 9) == 1
    assert imported.check_found(found, start, np.array([True, True, True, False]), 9) == 0
    with pytest.raises(InPlaceError, match="none of the file's"):
        imported.check_found(found, start, faces, 10)
    assert imported.dropped_warning(0) == [] and imported.dropped_warning(1)[0].startswith(
        "1 face that Blender drops keeps its"
    )
    assert imported.dropped_warning(3)[0].startswith("3 faces that Blender drops keep their place")


def test_uvs_are_numbered_by_all_their_columns():
    uv = np.array([[0, 1, 2, 3], [0, 1, 2, 4], [-0.0, 1, 2, 3], [5, 1, 2, 3]], np.float32)
    found = imported.numbered(uv)
    assert found[0] == found[2] and len(set(found.tolist())) == 3


@pytest.mark.parametrize(
    "name, here, called",
    [
        ("Body", "Body", True),
        ("Body", "Body.001", True),
        ("Body", "Body.01", False),
        ("Body", "Bodya", False),
        ("Body.001", "Body.001", True),
        ("x" * 70, "x" * 63, True),
        ("x" * 70, "x" * 59 + ".001", True),
        ("x" * 70, "x" * 40, False),
    ],
)
def test_meshes_are_called_as_blender_may_have_called_them(name, here, called):
    assert glb._is_called(name, here) == called


def test_meshes_come_in_the_order_of_the_nodes():
    doc = {
        "meshes": [{}] * 6,
        "scenes": [{"nodes": [2, 0]}, {"nodes": [5]}],
        "nodes": [
            {"mesh": 1, "children": [1, 3]},
            {"mesh": 3},
            {"mesh": 4, "skin": 0},
            {"mesh": 2},
            {"mesh": 0},
            {"mesh": 4},
        ],
    }
    own = glb._Meshes(glb_data.Glb(doc, b"", []))
    assert own.order == [4, 1, 3, 2, 0, 5] and own.skinned == {4}
    alone = glb._Meshes(glb_data.Glb({"meshes": [{}] * 2, "nodes": [{"mesh": 1}, {"mesh": 0}]}, b"", []))
    assert alone.order == [1, 0]


def test_uvs_of_corners_are_turned_over_and_those_that_stay_keep_their_bits():
    layers = (np.array([[0.1, 0.3], [0.5, 0.75]], np.float32),)
    mesh = Imported("it", np.zeros((2, 3)), np.arange(2), np.array([0, 2]), layers, 0)
    part = glb.Part({}, np.array([0, 1, 2]), np.array([0, -1, 1]), mesh)
    old = np.array([[0.1, np.float32(1) - np.float32(0.3)], [7, 8], [0, 0]], np.float32)
    found = glb._wished(part, [old], [0])
    assert found.tolist() == [old[0].tolist(), [7, 8], [0.5, 0.25]]
    fresh = glb._wished(part, [None, old], [0, 0])
    assert fresh.shape == (3, 4) and fresh[1].tolist() == [0, 0, 7, 8]


def test_views_are_mentioned_wherever_they_stand():
    doc = {
        "accessors": [{"bufferView": 3}, {"sparse": {"indices": {"bufferView": 1}}}],
        "images": [{"bufferView": "x"}],
        "other": {"bufferView": 5, "list": [[{"bufferView": 7}]]},
        "bufferViews": [{"extensions": {"EXT_meshopt_compression": {"bufferView": 9}}}],
        "extensions": {"some": {"bufferView": 11}},
        "extras": {"bufferView": 13},
    }
    assert sorted(glb_data.mentions(doc)) == [1, 3, 5, 7, 9, 11, 13]


def ply_bytes(text, body=b""):
    return b"ply\nformat " + text + b"\nend_header\n" + body


@pytest.mark.parametrize(
    "begin, body, faces",
    [
        (b"ascii 1.0\nelement vertex 1\nproperty float x\nelement face 1\nproperty list uchar int i", b"1 3", 1),
        (b"ascii 1.0\nelement vertex 2\nproperty float x\nelement face 1\nproperty list uchar int i", b"1 2 3", 1),
        (
            b"binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty double y\n"
            b"element face 3\nproperty list ushort int i",
            b"x" * 30,
            3,
        ),
        (b"binary_little_endian 1.0\nelement vertex 2\nproperty float x", b"x" * 8, None),
    ],
)
def test_headers_of_ply_declare_no_more_than_there_is(begin, body, faces):
    data = ply_bytes(begin, body)
    assert headers._ply(data, len(data)) == faces
    with pytest.raises(ValueError, match=r"it declares \d+ of the element '\w+' and has \d+ bytes.*cut off"):
        headers._ply(data[:-2], len(data) - 2)
    assert headers._ply(b"plx" + data[3:], 9) is None and headers._ply(b"ply\nformat", 9) is None
    wrong = ply_bytes(b"ascii 1.0\nelement x -1")
    with pytest.raises(ValueError, match="declares -1 of the element 'x'"):
        headers._ply(wrong, len(wrong))


def test_headers_of_others_declare_no_more_than_there_is():
    stl = b" " * 80 + struct.pack("<I", 2) + b"x" * 100
    assert headers._stl(stl, len(stl)) == 2 and headers._stl(stl[:50], 50) is None
    with pytest.raises(ValueError, match="it declares 2 faces and holds 1"):
        headers._stl(stl[:-1], len(stl) - 1)
    text = b"solid x\nfacet\nendfacet\nfacet\nendfacet\n"
    assert headers._stl(text, len(text)) == 2 and headers._stl(text, len(text) + 1) is None
    binary = b"glTF" + struct.pack("<II", 2, 30)
    headers._glb(binary, 30)
    with pytest.raises(ValueError, match="it declares 30 bytes and has 29"):
        headers._glb(binary, 29)
    headers._glb(b"glTX" + binary[4:], 3)
    for line in (b"\xef\xbb\xbfv 0 0 0\n", b"\xef\xbb\xbff 1 2 3"):
        with pytest.raises(ValueError, match="byte order mark"):
            headers._obj(line, 9)
    for line in (b"v 0 0 0\n", b"\xef\xbb\xbf# v\n", b"\n\xef\xbb\xbfv 0\n", b""):
        headers._obj(line, 9)


def test_buffers_of_a_text_are_beside_it_and_as_long_as_it_says(tmp_path):
    path, there = tmp_path / "a.gltf", tmp_path / "b c.bin"

    def check(size):
        path.write_text(
            json.dumps({"buffers": [{"uri": "b%20c.bin", "byteLength": size}, {"uri": "data:x", "byteLength": 9}]})
        )
        headers._gltf(path)

    with pytest.raises(ValueError, match=r"it needs b c\.bin, which is not there"):
        check(3)
    there.write_bytes(b"abc")
    check(3)
    with pytest.raises(ValueError, match=r"it declares 4 bytes of b c\.bin, which has 3"):
        check(4)
    path.write_text("[")
    headers._gltf(path)


@pytest.mark.parametrize(
    "line, words",
    [
        ("2 0 1", "fewer than three"),
        ("4 0 1 2", "fewer than it says"),
        ("3 0 1 3", "does not exist"),
        ("3 -1 1 2", "does not exist"),
        ("3 0 1 2 255 0 0", None),
        ("-1", "fewer than three"),
    ],
)
def test_faces_of_off_have_corners_that_exist(line, words):
    if words is None:
        assert off._face(5, line.split(), 3) == (0, 1, 2)
    else:
        with pytest.raises(ValueError, match=f"face 5 .*{words}"):
            off._face(5, line.split(), 3)


def record(name, values=b"", count=0, inner=b"", at=0, long=False):
    """A record of FBX at an offset, and where it ends."""
    head = struct.Struct("<QQQB" if long else "<IIIB")
    end = at + head.size + len(name) + len(values) + len(inner)
    return head.pack(end, count, len(values), len(name)) + name + values + inner


def fbx(kinds, arrays, long=False):
    """A binary FBX file with objects of these kinds and a mesh with these arrays, by name."""
    begin = b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack("<I", 7500 if long else 7400)
    head = 25 if long else 13
    stop = bytes(head)

    def string(text):
        return b"S" + struct.pack("<I", len(text)) + text

    at = len(begin) + head + len(b"Objects")
    inner = b""
    for kind in kinds:
        inner += record(b"Model", string(b"name") + string(kind), 2, at=at + len(inner), long=long)
    mesh = string(b"g") + string(b"Mesh")
    start = at + len(inner) + head + len(b"Geometry") + len(mesh)
    parts = b""
    for path, count in arrays:
        values = b"d" + struct.pack("<III", count, 0, 8 * count) + bytes(8 * count)
        if len(path) == 1:
            parts += record(path[0], values, 1, at=start + len(parts), long=long)
        else:
            below = start + len(parts) + head + len(path[0])
            lone = record(path[1], values, 1, at=below, long=long) + stop
            parts += record(path[0], b"", 0, lone, at=start + len(parts), long=long)
    inner += record(b"Geometry", mesh, 2, parts + stop, at=at + len(inner), long=long) + stop
    return begin + record(b"Objects", b"", 0, inner, at=len(begin), long=long) + stop


@pytest.mark.parametrize("long", [False, True])
def test_counts_of_fbx_are_those_of_its_arrays(long):
    arrays = [((b"Vertices",), 12), ((b"PolygonVertexIndex",), 7), ((b"LayerElementUV", b"UVIndex"), 7)]
    data = fbx([b"Mesh", b"Light", b"Mesh"], arrays, long)
    found = fbx_nodes.count(data)
    assert (found.vertices, found.corners, found.uv_corners) == (4, 7, 7)
    assert found.kinds["Model Mesh"] == 2 and found.kinds["Model Light"] == 1 and found.kinds["Geometry Mesh"] == 1
    for bad in (data[:-30], data[:40], b"x" + data[1:], data[:26]):
        with pytest.raises(fbx_nodes.FileError, match=r"too early|no binary FBX"):
            fbx_nodes.count(bad)


def test_triangles_that_were_dropped_are_counted_over_all_meshes(monkeypatch):
    asked = []
    doc = {"meshes": [{"primitives": [{"n": 2}, {"n": 0}, {"n": 1}]}, {"primitives": [{"n": 1}]}]}
    found = {"Mesh.10": (0, np.arange(9)), "Mesh.2": (1, np.arange(3) + 20)}

    class Meshes:
        def __init__(self, _glb):
            pass

        def find(self, mesh):
            asked.append(mesh.name)
            return found[mesh.name]

    def check(corners, start, kept, count):
        assert start.tolist() == list(range(0, len(corners) + 1, 3)) and kept.all() and count == 7
        return len(corners) // 3 - 1 + 5

    monkeypatch.setattr(glb, "_Meshes", Meshes)
    monkeypatch.setattr(glb, "triangles", lambda _glb, primitive: np.arange(3 * primitive["n"]).reshape(-1, 3))
    monkeypatch.setattr(glb, "check_found", check)
    meshes = [SimpleNamespace(name=name, corner_vertex=np.zeros(7)) for name in ("Mesh.10", "Mesh.2")]
    parts, dropped = glb._parts(SimpleNamespace(doc=doc), meshes)
    # In the order of their names without Blender's numbers; empty primitives have no part.
    assert sorted(asked) == ["Mesh.10", "Mesh.2"] and dropped == (2 + 5) + (0 + 5)
    of = {id(p.primitive): p for p in parts}
    first, _, third = doc["meshes"][0]["primitives"]
    assert len(parts) == 3 and of[id(first)].found.tolist() == list(range(6))
    assert of[id(third)].found.tolist() == [6, 7, 8] and of[id(third)].mesh is meshes[0]
    assert of[id(doc["meshes"][1]["primitives"][0])].found.tolist() == [20, 21, 22]


def test_a_buffer_in_the_text_stays_as_it_is_wherever_the_file_goes(tmp_path):
    inside, beside = {"uri": "data:application/octet-stream;base64,AAAA", "byteLength": 3}, {"uri": "a%20b.bin"}
    assert gltf._placed(inside, b"new", tmp_path) is inside and gltf._placed(beside, b"new", None) is beside
    # A file that is there, or begins as it does, is the buffer; another one is not.
    assert gltf._placed(beside, b"raw", tmp_path)["uri"].startswith("data:")
    for there, same in ((b"raw", True), (b"raw and more", True), (b"ra", False), (b"row", False)):
        (tmp_path / "a b.bin").write_bytes(there)
        assert (gltf._placed(beside, b"raw", tmp_path) is beside) == same


def test_what_other_meshes_name_is_not_owned(monkeypatch):
    """Two primitives name the same accessors, one of them twice; the UVs are named elsewhere, too."""
    table = {"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "targets": [{"POSITION": 3, "NORMAL": 1}]}
    mesh = SimpleNamespace(layer=0)
    parts = [SimpleNamespace(primitive=table, mesh=mesh, corners=np.arange(3)) for _ in range(2)]
    users = {0: 2, 1: 4, 2: 3, 3: 2}
    change = SimpleNamespace(doc={"accessors": [{"count": 3}]}, glb=None, users=lambda: users)
    found = []
    monkeypatch.setattr(glb, "_old_uv", lambda *_: np.zeros((3, 2), np.float32))
    monkeypatch.setattr(glb, "_wished", lambda part, old, layers: np.ones((3, 2), np.float32))
    monkeypatch.setattr(glb, "_write_attributes", lambda *given: found.append(given))
    assert glb._write_group(change, parts) is parts
    ((_, _, fresh, copies, owned),) = found
    assert owned == {0, 1, 3} and fresh["TEXCOORD_0"].tolist() == [[1, 1]] * 3 and not len(copies)
    users[2] = 2
    glb._write_group(change, parts)
    assert found[1][-1] == {0, 1, 2, 3}


@pytest.mark.parametrize("order", ["<", ">"])
def test_uvs_of_vertices_are_as_wide_as_the_file_says(order):
    """The first of a vertex's numbers, and both of its UV, are of three kinds."""
    name = b"little" if order == "<" else b"big"
    header = (
        b"ply\nformat binary_%s_endian 1.0\nelement vertex 3\nproperty short flag\nproperty float x\nproperty float y\n"
        b"property float z\nproperty double s\nproperty float t\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n"
    ) % name
    places, uv = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])

    def data(uv):
        rows = [struct.pack(order + "hfffdf", 7 + k, *places[k], *uv[k]) for k in range(3)]
        return header + b"".join(rows) + struct.pack(order + "B3i", 3, 0, 1, 2)

    mesh, old = ply.read_uv(data(uv))
    np.testing.assert_allclose(old, uv, atol=1e-7)
    wished = np.array([[0.25, 0.75], [0.5, 0.4375], [0.125, 0.625]], np.float32)
    split = ply.Split(np.arange(3), np.zeros(0, int), np.ones(3, bool), wished)
    rows = ply._binary_vertices(mesh, split, old)
    assert rows == data(wished)[len(header) : len(header) + len(rows)] and len(rows) == 3 * 26


@pytest.mark.parametrize("offset", [None, 0, 6])
def test_views_begin_where_they_say_and_at_the_start_where_they_do_not(offset):
    view = {"buffer": 2, "byteLength": 3, "byteStride": 12} | ({} if offset is None else {"byteOffset": offset})
    begin = offset or 0
    assert gltf._moved(view, 40) == view | {"buffer": 0, "byteOffset": 40 + begin}
    data = bytes(range(20))
    doc = {"bufferViews": [view, {"byteLength": 2}], "accessors": [{"bufferView": 1}, {"bufferView": 0}]}
    held = gltf._contents(SimpleNamespace(doc=doc, binary=data))
    assert held == [(data[:2], None), (data[begin : begin + 3], 12)]


def test_words_of_faces_are_taken_some_after_the_others(monkeypatch):
    """Indices that count backwards do so from where their line stands."""
    data = (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nvt 0 0\nvt 1 1\nf -3/-1 2/1 3\nv 1 1 0\nf 1//1 2 -1 3\nl 1 2\nf 9 1 2\n"
    )
    found = vars(obj_text.read(data))
    monkeypatch.setattr(obj_text, "AT_ONCE", 2)
    for name, values in vars(obj_text.read(data)).items():
        np.testing.assert_array_equal(values, found[name])
    assert found["corner_vertex"].tolist() == [0, 1, 2, 0, 1, 2, 0, 1, 3, 2, 0, 1, -1, 0, 1]
