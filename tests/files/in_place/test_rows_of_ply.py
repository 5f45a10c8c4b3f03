"""Rows of a .ply whose UVs stay keep every byte, whatever kind of numbers its UVs are, in which order its elements are,
whether its last line ends, and how; so do those of vertices that no face has."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from mesh_bytes import imported

from omt_uv.files.in_place import ply, ply_rows

PLACES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0]], np.float32)
# Of these single precision has none.
UVS = [(0.1, 0.2), (0.9, 0.3), (1 / 3, 0.7), (0.123456789012, 0.6), (0.7, 0.45)]
FACE = [[0, 1, 2, 3]]
FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def file_of(form: str, kind: str, faces_first: bool, end: str, ends: bool) -> bytes:
    """A square beside a vertex of no face; `ends`: whether the last line of a text ends."""
    vertex = [
        f"element vertex {len(PLACES)}",
        *(f"property float {a}" for a in "xyz"),
        *(f"property {kind} {a}" for a in "st"),
    ]
    face = ["element face 1", "property list uchar int vertex_indices"]
    parts = [face, vertex] if faces_first else [vertex, face]
    head = ["ply", f"format {form} 1.0", *parts[0], *parts[1], "end_header"]
    order = FORMS[form]
    if not order:
        rows = [[f"{p[0]:g} {p[1]:g} {p[2]:g}  {s!r} {t!r}" for p, (s, t) in zip(PLACES, UVS, strict=True)],
                ["4 0 1 2 3"]]  # fmt: skip
        lines = [*head, *(rows[1] + rows[0] if faces_first else rows[0] + rows[1])]
        return (end.join(lines) + end * ends).encode()
    width = "d" if kind == "double" else "f"
    vertices = b"".join(struct.pack(f"{order}3f2{width}", *p, *uv) for p, uv in zip(PLACES.tolist(), UVS, strict=True))
    faces = struct.pack(f"{order}B4i", 4, 0, 1, 2, 3)
    return (end.join(head) + end).encode() + (faces + vertices if faces_first else vertices + faces)


# The letters by which Python knows each type of number.
LETTERS = {"char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h", "ushort": "H",
           "uint16": "H", "int": "i", "int32": "i", "uint": "I", "uint32": "I", "float": "f", "float32": "f",
           "double": "d", "float64": "d"}  # fmt: skip


def ends_of(letter: str) -> list:
    """The least and the greatest number of a type, and one between."""
    if letter in "fd":
        return [-1.5e30, 1.25, 3.0e-30]
    top = 1 << (8 * struct.calcsize(f"<{letter}"))
    return [0, 100, top - 1] if letter.isupper() else [-top // 2, 100, top // 2 - 1]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", LETTERS)
def test_numbers_of_every_type_are_those_that_python_reads(kind, form):
    """Alone, and in lists of every length with every type of a count, at both ends of what a type can hold."""
    assert set(LETTERS) == set(ply_rows.TYPES)
    letter, order = LETTERS[kind], FORMS[form]
    for counter in (k for k in LETTERS if LETTERS[k] not in "fd"):
        head = f"ply\nformat {form} 1.0\nelement row 4\nproperty {kind} one\n"
        head += f"property list {counter} {kind} several\nproperty uchar last\nend_header\n"
        ends = ends_of(letter)
        rows = [(ends[k % 3], ends[:k], 7 + k) for k in range(4)]
        if order:
            letters = [f"{order}{letter}{LETTERS[counter]}{len(many)}{letter}B" for _, many, _ in rows]
            body = b"".join(
                struct.pack(of, one, len(many), *many, k) for of, (one, many, k) in zip(letters, rows, strict=True)
            )
        else:
            body = "".join(f"{one!r} {len(many)} {' '.join(map(repr, many))} {k}\n" for one, many, k in rows).encode()
        data = head.encode() + body
        header = ply_rows.read_header(data)
        element = header.find("row")
        found = ply_rows.read_rows(data, header, {"row"})["row"]
        tell = np.float32 if letter == "f" and order else float if letter in "fd" else int
        assert list(ply_rows.scalars(data, header, element, found, "one")) == [tell(one) for one, *_ in rows]
        told = [tell(x) for _, many, _ in rows for x in many]
        assert list(ply_rows.lists(data, header, element, found, "several")) == told
        assert list(ply_rows.scalars(data, header, element, found, "last")) == [7, 8, 9, 10]
        assert found.count["several"].tolist() == [0, 1, 2, 3] and found.start[-1] == len(data)


@pytest.mark.parametrize("ends", [True, False])
@pytest.mark.parametrize("faces_first", [False, True])
@pytest.mark.parametrize("kind", ["float", "double"])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("moved", [[], [3], [1, 2], [0, 1, 2, 3]])
def test_only_vertices_whose_uvs_change_have_other_bytes(moved, form, kind, faces_first, ends):
    data = file_of(form, kind, faces_first, "\n", ends or bool(FORMS[form]))
    wished = ply.read_uv(data)[1].astype(np.float32)
    wished[moved] += np.float32(0.25)
    new, told = ply.put(data, [imported(FACE, wished, PLACES)])
    assert told == [] and (ply.read_uv(new)[1].astype(np.float32) == wished).all()
    old_rows, rows = (ply.read(d).rows["vertex"].start for d in (data, new))
    for k in range(len(PLACES)):
        before, after = data[old_rows[k] : old_rows[k + 1]], new[rows[k] : rows[k + 1]]
        # A last line that has no end gets one.
        assert (before.rstrip(b"\n") if not FORMS[form] else before) == (
            after.rstrip(b"\n") if not FORMS[form] else after
        ) or k in moved, k
        if k in moved:
            assert before != after
    if not FORMS[form]:
        assert len(new.splitlines()) == len(data.splitlines()) and all(new.splitlines())


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("ends", [True, False])
def test_a_vertex_that_is_split_stands_behind_all_others_also_where_the_last_line_has_no_end(form, ends):
    """Two faces that share an edge, whose corners there part."""
    data = file_of(form, "float", True, "\n", ends or bool(FORMS[form]))
    if FORMS[form]:
        faces = b"".join(struct.pack(f"{FORMS[form]}B3i", 3, *f) for f in ((0, 1, 2), (0, 2, 3)))
        data = data.replace(struct.pack(f"{FORMS[form]}B4i", 4, 0, 1, 2, 3), faces)
    else:
        data = data.replace(b"4 0 1 2 3", b"3 0 1 2\n3 0 2 3")
    data = data.replace(b"element face 1", b"element face 2")
    wished = np.random.default_rng(3).random((6, 2)).astype(np.float32)
    new, _ = ply.put(data, [imported([[0, 1, 2], [0, 2, 3]], wished, PLACES)])
    mesh, uv = ply.read_uv(new)
    assert len(mesh.positions) == len(PLACES) + 2 and (uv.astype(np.float32) == wished).all()
    assert (mesh.positions[mesh.corner_vertex] == PLACES[[0, 1, 2, 0, 2, 3]]).all()


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("ends", [True, False])
@pytest.mark.parametrize("faces_first", [False, True])
@pytest.mark.parametrize("has_uvs", [True, False])
@pytest.mark.parametrize("form", FORMS)
def test_every_line_ends_as_the_others_do(form, has_uvs, faces_first, ends, end):
    data = file_of(form, "float", faces_first, end, ends or bool(FORMS[form]))
    if not has_uvs:
        data = data.replace(b"float s", b"float other").replace(b"float t", b"float more")
    wished = np.random.default_rng(5).random((4, 2)).astype(np.float32)
    new, _ = ply.put(data, [imported(FACE, wished, PLACES)])
    text = new[: ply.read(new).header.size] if FORMS[form] else new
    lines = text.splitlines(keepends=True)
    assert {line[len(line.rstrip(b"\r\n")) :] for line in lines[:-1]} == {end.encode()}
    assert lines[-1].rstrip(b"\r\n") and lines[-1][len(lines[-1].rstrip(b"\r\n")) :] in (b"", end.encode())
