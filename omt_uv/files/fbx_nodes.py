"""Count what a binary FBX file holds, by its records alone: what was lost on the way through Blender can be told."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from .verified import FileError

MAGIC = b"Kaydara FBX Binary  \x00"
SIZES = {b"Y": 2, b"C": 1, b"B": 1, b"I": 4, b"F": 4, b"D": 8, b"L": 8}
# From this version on, offsets have 8 bytes.
LONG = 7500


@dataclass(frozen=True)
class FbxCounts:
    """Vertices, corners of faces and UVs of corners of all meshes, and how many objects there are of each kind."""

    vertices: int
    corners: int
    uv_corners: int
    kinds: Counter[str]


def count(data: bytes) -> FbxCounts:
    """Count what a binary FBX file holds.

    Raises
    ------
    FileError : it is none, or is cut
    """
    if not data.startswith(MAGIC) or len(data) < 27:
        raise FileError("the file is no binary FBX")
    long = struct.unpack_from("<I", data, 23)[0] >= LONG
    totals: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    ended = False
    try:
        for path, length, kind in _records(data, 27, len(data), long, ()):
            ended |= path == ("",)
            if path[:1] == ("Objects",) and len(path) == 2 and kind:
                kinds[kind] += 1
            elif path[:2] == ("Objects", "Geometry Mesh"):
                totals["/".join(path[2:])] += length
    except (struct.error, IndexError) as error:
        raise FileError("the file ends too early") from error
    if not ended:
        raise FileError("the file ends too early")
    uv = totals["LayerElementUV/UVIndex"]
    return FbxCounts(totals["Vertices"] // 3, totals["PolygonVertexIndex"], uv, kinds)


def _records(data: bytes, at: int, end: int, long: bool, path: tuple) -> Iterator[tuple[tuple, int, str]]:
    """Path, length of the first array, and kind of all records within a span, and ("",) where a list of them ends."""
    head = struct.Struct("<QQQB" if long else "<IIIB")
    while at + head.size <= end:
        until, values, size, name = head.unpack_from(data, at)
        if until == 0:
            yield (*path, ""), 0, ""
            return
        body = at + head.size + name
        here = (*path, data[at + head.size : body].decode("latin-1"))
        if not body <= body + size <= until <= end:
            raise IndexError
        length, kind = _values(data, body, values, body + size)
        label = f"{here[-1]} {kind}".strip()
        if len(here) == 2:
            # Shapes of morphs are geometry, too.
            here = (*path, label)
        yield here, length, label
        if len(here) < 4 and (here[0] == "Objects"):
            yield from _records(data, body + size, until, long, here)
        at = until


def _values(data: bytes, at: int, count: int, end: int) -> tuple[int, str]:
    """Length of the first array among the values of a record, and the last of its strings."""
    length, text = 0, ""
    for _ in range(count):
        code, at = data[at : at + 1], at + 1
        if code in SIZES:
            at += SIZES[code]
        elif code in b"SR" and code:
            (size,) = struct.unpack_from("<I", data, at)
            if code == b"S" and size < 64:
                text = data[at + 4 : at + 4 + size].decode("latin-1")
            at += 4 + size
        else:
            items, _, size = struct.unpack_from("<III", data, at)
            length = length or items
            at += 12 + size
        if at > end:
            raise IndexError
    return length, text
