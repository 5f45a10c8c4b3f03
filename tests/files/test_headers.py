"""Files may be as short as their headers say and no byte shorter, for every type and format."""

from __future__ import annotations

import json
import struct

import pytest

from omt_uv.files.formats.headers import check_header

PLY_TYPES = {
    "b": ("char", "int8"),
    "B": ("uchar", "uint8"),
    "h": ("short", "int16"),
    "H": ("ushort", "uint16"),
    "i": ("int", "int32"),
    "I": ("uint", "uint32"),
    "f": ("float", "float32"),
    "d": ("double", "float64"),
}


def holds(path, data):
    path.write_bytes(data)
    return check_header(path)


def refused(path, data, *words):
    path.write_bytes(data)
    with pytest.raises(ValueError, match="cut off") as error:
        check_header(path)
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize("letter, name", [(k, name) for k, names in PLY_TYPES.items() for name in names])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_ply_holds_all_values_of_its_types(tmp_path, letter, name, end):
    lines = ["ply", "format binary_little_endian 1.0", "element vertex 3", f"property {name} x", f"property {name} y",
             "element face 2", f"property list {name} int vertex_indices", "end_header"]  # fmt: skip
    # A face may be as short as the count of its vertices.
    least = (3 * 2 + 2) * struct.calcsize("<" + letter)
    head, path = end.join(lines).encode() + end.encode(), tmp_path / "a.ply"
    assert holds(path, head + bytes(least)) == 2
    refused(path, head + bytes(least - 1), "2", "'face'")
    refused(path, head + bytes(6 * struct.calcsize("<" + letter) - 1), "3", "'vertex'")


def test_a_value_of_text_has_a_character_and_what_parts_it_from_the_next(tmp_path):
    lines = ["ply", "format ascii 1.0", "element vertex 2", "property float x", "element face 1",
             "property list uchar int vertex_indices", "end_header"]  # fmt: skip
    head, path = ("\n".join(lines) + "\n").encode(), tmp_path / "a.ply"
    # The last one needs nothing after it.
    assert holds(path, head + b"1\n2\n3") == 1
    refused(path, head + b"1\n2\n")
    refused(path, head.replace(b"vertex 2", b"vertex -1") + bytes(99), "-1")
    # No faces are declared, or it is no PLY.
    assert holds(path, head.replace(b"element face 1\n", b"") + bytes(99)) is None
    assert holds(path, b"plastic") is None and holds(path, head[:-12]) is None


def test_a_binary_stl_has_fifty_bytes_for_every_face(tmp_path):
    path, head = tmp_path / "a.STL", bytes(80) + struct.pack("<I", 3)
    assert holds(path, head + bytes(150)) == 3 and holds(path, head + bytes(170)) == 3
    refused(path, head + bytes(149), "3 faces", "holds 2")
    assert holds(path, bytes(83)) is None and holds(path, bytes(84)) == 0


def test_a_text_of_stl_tells_its_faces_itself(tmp_path):
    facet = b"facet normal 0 0 1\nouter loop\nendloop\nendfacet\n"
    for before in (b"", b" ", b"\n\t"):
        assert holds(tmp_path / "a.stl", before + b"solid a\n" + 2 * facet + b"endsolid") == 2


def test_a_glb_is_as_long_as_it_says(tmp_path):
    path = tmp_path / "a.glb"
    assert holds(path, b"glTF" + struct.pack("<II", 2, 12)) is None
    refused(path, b"glTF" + struct.pack("<II", 2, 13), "13", "12")
    assert holds(path, b"glTF" + bytes(7)) is None and holds(path, b"none" + struct.pack("<II", 2, 99)) is None


def test_buffers_beside_a_gltf_are_there_and_long_enough(tmp_path):
    path = tmp_path / "a.gltf"

    def text(*buffers):
        return json.dumps({"buffers": [{"uri": uri, "byteLength": size} for uri, size in buffers]}).encode()

    (tmp_path / "a b.bin").write_bytes(bytes(10))
    assert holds(path, text(("a%20b.bin", 10), ("data:,x", 99))) is None
    refused(path, text(("a%20b.bin", 11)), "11 bytes", "has 10")
    with pytest.raises(ValueError, match=r"needs c\.bin, which is not there"):
        holds(path, text(("a%20b.bin", 10), ("c.bin", 1)))
    assert holds(path, b"{") is None and holds(path, b"{}") is None
    (tmp_path / "a.obj").write_bytes(b"v")
    assert check_header(tmp_path / "a.obj") is None


@pytest.mark.parametrize("line", ["v 0 0 0", "vt\t0 0", "f 1 2 3", "l 1 2", "# made by hand", "o body", ""])
def test_a_line_that_blender_would_lose_behind_a_mark_is_not_lost(tmp_path, line):
    path = tmp_path / "a.obj"
    path.write_bytes(b"\xef\xbb\xbf" + line.encode() + b"\r\nv 1 0 0\n")
    if line[:2].strip() in ("v", "vt", "f", "l"):
        with pytest.raises(ValueError, match="byte order mark"):
            check_header(path)
    else:
        assert check_header(path) is None
    path.write_text(f"{line}\n")
    assert check_header(path) is None


TEXTS = {
    ".obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    ".ply": "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
    ".stl": "solid a\nfacet normal 0 0 1\nouter loop\nendloop\nendfacet\nendsolid a\n",
    ".gltf": '{\n\t"asset": {"version": "2.0"}}',
    ".off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
}


@pytest.mark.parametrize("suffix", TEXTS)
def test_a_text_that_is_no_utf_8_is_refused_by_the_name_of_its_encoding(tmp_path, suffix):
    path = tmp_path / f"a{suffix.upper()}"
    for name in ("utf-16", "utf-32"):
        for order in ("-le", "-be"):
            for text in (TEXTS[suffix], "\ufeff" + TEXTS[suffix]):
                with pytest.raises(ValueError, match=rf"a text in {name.upper()}.*Save it as UTF-8"):
                    holds(path, text.encode(name + order))
    if suffix == ".obj":
        with pytest.raises(ValueError, match="UTF-16"):
            holds(path, "# Модель\n".encode("utf-16"))
    holds(path, TEXTS[suffix].encode())
    with pytest.raises(ValueError, match=r"byte order mark.*without one"):
        holds(path, TEXTS[suffix].encode("utf-8-sig"))


def test_numbers_are_no_text_of_another_encoding(tmp_path):
    # A file of numbers may have anything before them.
    for begin in ("\ufeffabc".encode("utf-16-le"), "by a program".encode("utf-16-le"), b"\xff\xfe\0\0", b""):
        assert holds(tmp_path / "a.stl", begin.ljust(80, b"\0") + struct.pack("<I", 1) + bytes(50)) == 1
    assert holds(tmp_path / "a.off", b"") is None and holds(tmp_path / "a.obj", b"\0" * 99) is None
    assert holds(tmp_path / "a.obj", "# Модель\nv 0 0 0\n".encode()) is None
