"""Read a binary glTF file: its JSON, its bytes and its accessors, and write it with more of them."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .imported import InPlaceError

MAGIC = 0x46546C67
JSON_CHUNK = 0x4E4F534A
BINARY_CHUNK = 0x004E4942
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# No format of a value needs more; attributes of vertices need 4.
ALIGNMENT = 8
COMPRESSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"
FLOAT = 5126


@dataclass(frozen=True)
class Glb:
    """A binary glTF file: its JSON, the bytes of its first buffer, and chunks of other kinds (type, bytes)."""

    doc: dict
    binary: bytes
    others: list[tuple[int, bytes]]


def read(data: bytes) -> Glb:
    """Read a binary glTF file.

    Raises
    ------
    InPlaceError : it is none, or is cut
    """
    if len(data) < 20 or struct.unpack_from("<II", data)[:2] != (MAGIC, 2):
        raise InPlaceError("the file is no binary glTF 2.0")
    at, chunks = 12, []
    while at + 8 <= len(data):
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > len(data):
            raise InPlaceError("the file ends too early")
        chunks.append((kind, data[at + 8 : at + 8 + size]))
        at += 8 + size
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise InPlaceError("the file does not begin with JSON")
    try:
        doc = json.loads(chunks[0][1].decode())
    except (ValueError, RecursionError) as error:
        raise InPlaceError("the JSON of the file cannot be read") from error
    binary = b""
    if len(chunks) > 1 and chunks[1][0] == BINARY_CHUNK:
        binary = chunks.pop(1)[1]
    if not isinstance(doc, dict) or not isinstance(doc.get("accessors", []), list):
        raise InPlaceError("the JSON of the file is not that of glTF")
    buffers = doc.get("buffers", [])
    if isinstance(buffers, list) and any(isinstance(of, dict) and "uri" in of for of in buffers[:1]):
        raise InPlaceError("its buffers are in other files, or in its text")
    return Glb(doc, binary, chunks[1:])


def write(glb: Glb) -> bytes:
    """The bytes of a binary glTF file."""
    try:
        text = json.dumps(glb.doc, ensure_ascii=False, separators=(",", ":")).encode()
    except UnicodeEncodeError:  # half of a surrogate pair, which only an escape can hold
        text = json.dumps(glb.doc, separators=(",", ":")).encode()
    chunks = [(JSON_CHUNK, text + b" " * (-len(text) % 4)), (BINARY_CHUNK, glb.binary + bytes(-len(glb.binary) % 4))]
    body = b"".join(struct.pack("<II", len(of), kind) + of for kind, of in [*chunks, *glb.others])
    return struct.pack("<III", MAGIC, 2, 12 + len(body)) + body


def accessor(glb: Glb, index: int) -> np.ndarray:
    """Values (count, width) of an accessor as they are stored; those of a sparse one are filled in.

    Raises
    ------
    InPlaceError : it leads out of the file, or into what this program does not read
    """
    of = glb.doc["accessors"][index]
    kind, width, count = np.dtype(COMPONENTS[of["componentType"]]), WIDTHS[of["type"]], of["count"]
    if not isinstance(count, int) or not 0 <= count <= len(glb.binary):
        raise InPlaceError(f"accessor {index} counts {count} values")
    if width > 4 and kind.itemsize < 4:
        raise InPlaceError(f"accessor {index} holds matrices of small numbers")
    values = np.zeros((count, width), kind)
    if "bufferView" in of:
        values = _strided(glb, of["bufferView"], of.get("byteOffset", 0), values)
    sparse = of.get("sparse")
    if sparse:
        n = sparse["count"]
        where, new = sparse["indices"], sparse["values"]
        place = _strided(glb, where["bufferView"], where.get("byteOffset", 0), _scalars(n, where["componentType"]))
        values = values.copy()
        if not 0 <= n <= count or place.max(initial=0) >= count:
            raise InPlaceError(f"accessor {index} replaces values that it does not have")
        values[place.ravel()] = _strided(glb, new["bufferView"], new.get("byteOffset", 0), values[:n])
    return values


def _scalars(count: int, component: int) -> np.ndarray:
    if not isinstance(count, int) or not 0 <= count < 2**31:
        raise InPlaceError(f"an accessor replaces {count} values")
    return np.zeros((min(count, 2**31), 1), COMPONENTS[component])


def _strided(glb: Glb, view: int, offset: int, like: np.ndarray) -> np.ndarray:
    """Values of a buffer view, as many and of the type of those given."""
    of = glb.doc["bufferViews"][view]
    if any(name in of.get("extensions", {}) for name in COMPRESSIONS):
        raise InPlaceError("its buffers are compressed (EXT_meshopt_compression)")
    if of.get("buffer", 0) != 0 or "uri" in glb.doc["buffers"][0]:
        raise InPlaceError("its buffers are in other files")
    size = like.dtype.itemsize * like.shape[1]
    stride = of.get("byteStride", 0) or size
    at = of.get("byteOffset", 0) + offset
    end = at + stride * (len(like) - 1) + size if len(like) else at
    if at < 0 or stride < 0 or end > len(glb.binary):
        raise InPlaceError(f"buffer view {view} leads out of the file")
    return np.ndarray(like.shape, like.dtype, glb.binary, at, (stride, like.dtype.itemsize))


def mentions(value) -> Iterator[int]:
    """Buffer views that stand anywhere in JSON."""
    if isinstance(value, dict):
        for key, of in value.items():
            if key == "bufferView" and isinstance(of, int):
                yield of
            else:
                yield from mentions(of)
    elif isinstance(value, list):
        for of in value:
            yield from mentions(of)


def floats(glb: Glb, index: int) -> np.ndarray:
    """Values (count, width) float32 of an accessor; whole numbers stand for shares of the greatest if it says so."""
    values = accessor(glb, index)
    if values.dtype.kind == "f" or not glb.doc["accessors"][index].get("normalized"):
        return values.astype(np.float32)
    return (values / np.float32(np.iinfo(values.dtype).max)).astype(np.float32).clip(-1, None)


def triangles(glb: Glb, primitive: dict) -> np.ndarray:
    """Vertices (t,3) of the triangles of a primitive, in Blender's order; none for points and lines."""
    mode = primitive.get("mode", 4)
    if mode not in (4, 5, 6) or "POSITION" not in primitive["attributes"]:
        return np.zeros((0, 3), np.int64)
    if "indices" in primitive:
        index = accessor(glb, primitive["indices"])[:, 0].astype(np.int64)
    else:
        index = np.arange(glb.doc["accessors"][primitive["attributes"]["POSITION"]]["count"])
    if mode == 4:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    if len(index) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == 6:
        return np.stack([np.full(len(index) - 2, index[0]), index[1:-1], index[2:]], axis=1)
    strip = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    strip[1::2] = strip[1::2][:, [0, 2, 1]]
    return strip
