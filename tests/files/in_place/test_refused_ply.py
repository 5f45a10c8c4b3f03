"""Files of PLY and OFF that say what cannot be: each is refused by what is wrong with it, and beside it one goes."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from omt_uv.files.formats.off import read_off
from omt_uv.files.in_place import obj, ply
from omt_uv.files.in_place.imported import InPlaceError

TEXT = b"""ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""
# What stands in the file, what stands there then, and what is said.
WRONG = {
    "no magic": (b"ply\n", b"plx\n", ""),
    "strips": (b"element face 1", b"element tristrips 0\nproperty list uchar int v\nelement face 1", "triangle strips"),
    "lists of vertices": (
        b"property float x",
        b"property list uchar float x",
        "lacks values",
    ),
    "no heights": (b"float z", b"float w", "no positions"),
    "no faces": (b"vertex_indices", b"others", "no faces"),
    "less than no corners": (b"3 0 1 2", b"-3 0 1 2", "negative length"),
    "no count": (b"3 0 1 2", b"x 0 1 2", "no length"),
    "an end": (b"3 0 1 2\n", b"", "ends before|no length"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_ply_of_text_that_is_none_is_refused_by_what_is_wrong(name):
    old, new, words = WRONG[name]
    assert TEXT.count(old) == 1
    np.testing.assert_array_equal(ply.read(TEXT).corner_vertex, [0, 1, 2])
    with pytest.raises(InPlaceError, match=words or None):
        ply.read(TEXT.replace(old, new))


def binary(order: str, count: str, length: int) -> bytes:
    """The same, of bytes, with the length of its face as it is said."""
    name = {"<": b"binary_little_endian", ">": b"binary_big_endian"}[order]
    words = TEXT[: TEXT.index(b"0 0 0\n")].replace(b"ascii", name).replace(b"uchar", count.encode())
    sized = struct.pack(order + {"char": "b", "short": "h", "int": "i"}[count], length)
    return words + struct.pack(order + "9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + sized + struct.pack(order + "3i", 0, 1, 2)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("count", ["char", "short", "int"])
def test_a_ply_of_bytes_whose_faces_lie_is_refused(order, count):
    np.testing.assert_array_equal(ply.read(binary(order, count, 3)).corner_vertex, [0, 1, 2])
    with pytest.raises(InPlaceError, match="face 0 has a list of negative length"):
        ply.read(binary(order, count, -1))
    with pytest.raises(InPlaceError, match="ends before"):
        ply.read(binary(order, count, 4))
    with pytest.raises(InPlaceError, match="ends before"):
        ply.read(binary(order, count, 3)[:-1])


@pytest.mark.parametrize("module", [ply, obj])
@pytest.mark.parametrize("count", [0, 2])
def test_a_file_of_one_mesh_that_was_read_as_another_number_is_not_written(module, count):
    with pytest.raises(InPlaceError, match=f"read as {count} objects"):
        module.put(TEXT, [None] * count)


OFF = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
WRONG_OFF = {
    "3 1 0": ("-1 1 0", "declares -1 vertices"),
    "3 1": ("3 2", "has 4 lines for them"),
    "3 1 0\n": ("3\n", "no counts"),
    "1 0 0": ("1 0", "vertex 1 has fewer"),
    "3 0 1 2": ("3 0 1", "face 0 has fewer"),
    "0 1 2": ("0 1 3", "does not exist"),
    " 0 1 2": (" 0 -1 2", "does not exist"),
    "3 0": ("2 0", "fewer than three"),
}


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_comments_and_what_follows_in_a_line_of_an_off_say_nothing(tmp_path, end):
    """Before, behind and between its lines; colours behind faces and vertices, too."""
    plain, commented = tmp_path / "a.off", tmp_path / "b.off"
    plain.write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 2 3\n")
    lines = ["# made by hand 3 1", "OFF # 7 8 9", "", "# 9 9 9", "4 2 0 # counts", "0 0 0 # 1 0 0", "1 0 0 0.5 0.5 0.5",
             "  # 5", "0 1 0", "0 0 1", "3 0 1 2 # 3", "#", "3 0 2 3 255 0 0 # red", "# end"]  # fmt: skip
    commented.write_bytes(end.join(lines).encode())
    one, other = read_off(plain), read_off(commented)
    assert one[0].tolist() == other[0].tolist() and one[1] == other[1] == [(0, 1, 2), (0, 2, 3)]


@pytest.mark.parametrize("old", WRONG_OFF)
def test_an_off_that_is_none_is_refused_by_what_is_wrong(tmp_path, old):
    new, words = WRONG_OFF[old]
    path = tmp_path / "a.off"
    path.write_text(OFF)
    assert read_off(path)[1] == [(0, 1, 2)]
    path.write_text(OFF.replace(old, new, 1))
    with pytest.raises(ValueError, match=words):
        read_off(path)
