"""Counts of binary FBX files against files that are put together record by record, and cut at every byte."""

from __future__ import annotations

import struct

import pytest
from fbx_bytes import array, file_of, scene, text

from omt_uv.files import fbx_nodes
from omt_uv.files.verified import FileError


@pytest.mark.parametrize("long", [False, True])
def test_what_a_file_holds_is_counted(long):
    found = fbx_nodes.count(file_of(long, scene(long)))
    assert (found.vertices, found.corners, found.uv_corners) == (13, 33, 23)
    assert found.kinds == {"Geometry Mesh": 2, "Geometry Shape": 1, "Model Mesh": 2}


@pytest.mark.parametrize("long", [False, True])
def test_a_file_that_is_cut_anywhere_is_named(long):
    data = file_of(long, scene(long))
    for size in (*range(0, len(data), 7), *range(len(data) - 30, len(data))):
        with pytest.raises(FileError, match=r"too early|no binary FBX"):
            fbx_nodes.count(data[:size])
    fbx_nodes.count(data)


def test_values_that_reach_beyond_their_record_are_refused():
    data = file_of(False, scene(False))
    at = data.index(b"Vertices") + len("Vertices") + 9
    (size,) = struct.unpack_from("<I", data, at)
    with pytest.raises(FileError, match="too early"):
        fbx_nodes.count(data[:at] + struct.pack("<I", size + 1) + data[at + 4 :])


@pytest.mark.parametrize("lengths", [(4,), (4, 9), (9, 4), (0, 5), (3, 0, 7)], ids=str)
@pytest.mark.parametrize("before", [0, 2])
def test_the_length_of_a_record_is_that_of_its_first_array_that_holds_something(lengths, before):
    values = [text(b"name")] * before + [array(b"i", "i", range(n)) for n in lengths]
    data = b"".join(values)
    assert fbx_nodes._values(data, 0, len(values), len(data)) == (next(n for n in lengths if n), "name" * (before > 0))
