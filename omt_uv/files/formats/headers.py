"""Compare what the header of a mesh file declares with the size of the file, before Blender asks for memory for it."""

from __future__ import annotations

import codecs
import json
import re
import struct
from pathlib import Path
from urllib.parse import unquote

# Bytes of the types of PLY.
SIZES = {"char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2, "uint16": 2}
SIZES |= {"int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4, "double": 8, "float64": 8}
# A value of an ASCII file and what separates it from the next.
LEAST_TEXT = 2
# Longer headers are none.
MOST_HEADER = 1 << 20
STL_HEADER = 84
STL_FACE = 50
# What an editor may put before a text in UTF-8, and the lines of an OBJ file of which none may be lost.
MARK = codecs.BOM_UTF8
# Encodings that Windows has for texts beside it, and their marks; two bytes of one are those of another.
OTHERS = (
    ("utf-32-le", codecs.BOM_UTF32_LE),
    ("utf-32-be", codecs.BOM_UTF32_BE),
    ("utf-16-le", codecs.BOM_UTF16_LE),
    ("utf-16-be", codecs.BOM_UTF16_BE),
)
# How the texts of formats begin.
BEGINS = {".obj": ("",), ".ply": ("ply",), ".stl": ("solid",), ".gltf": ("{",), ".off": ("OFF", "COFF")}
# Bytes that tell an encoding.
ENOUGH = 64
NUMBERED = (b"v", b"vt", b"vn", b"f", b"l", b"p")


def check_header(path: Path) -> int | None:
    """The number of faces that a file declares, None where its format has no such number.

    Raises
    ------
    ValueError : the file is too short for what it declares, or a text in an encoding of which nothing, or not its
        first line, would be read. Faces of PLY may be as short as their count of vertices, so that files that were cut
        off pass, and have fewer faces than they declare
    """
    suffix = path.suffix.lower()
    if suffix not in BEGINS and suffix != ".glb":
        return None
    with path.open("rb") as file:
        begin = file.read(MOST_HEADER)
    if suffix in BEGINS:
        _check_encoding(begin[:ENOUGH], suffix)
    if suffix == ".gltf":
        _gltf(path)
    check = {".ply": _ply, ".stl": _stl, ".glb": _glb, ".obj": _obj}.get(suffix)
    return None if check is None else check(begin, path.stat().st_size)


def _check_encoding(begin: bytes, suffix: str) -> None:
    """Raise ValueError for a text in UTF-16 or UTF-32, with its mark or without, and for one behind a mark of UTF-8."""
    for name, mark in OTHERS:
        text = begin.removeprefix(mark).decode(name, "ignore")
        is_marked = begin.startswith(mark) or (text != "" and text.isascii() and "\0" not in text)
        if is_marked and text.lstrip().startswith(BEGINS[suffix]):
            raise ValueError(f"it is a text in {name[:6].upper()}, which is not read. Save it as UTF-8.")
    text = begin.removeprefix(MARK).decode("latin-1")
    if suffix != ".obj" and begin.startswith(MARK) and text.lstrip().startswith(BEGINS[suffix]):
        raise ValueError("it begins with a byte order mark, and would not be read. Save it as UTF-8 without one.")


def _too_short(text: str) -> ValueError:
    return ValueError(f"{text}. The file was cut off, or is damaged.")


def _ply(begin: bytes, size: int) -> int | None:
    end = re.search(rb"end_header[ \t\r]*\n", begin)
    if not begin.startswith(b"ply") or end is None:
        return None
    ascii_file = b"format ascii" in begin[: end.start()]
    elements: list[list] = []
    for line in begin[: end.start()].decode("latin-1").splitlines():
        match line.split():
            case ["element", name, count] if re.fullmatch(r"-?\d+", count):
                elements.append([name, int(count), 0])
            case ["property", "list", kind, *_] if elements:
                elements[-1][2] += LEAST_TEXT if ascii_file else SIZES.get(kind, 1)
            case ["property", kind, *_] if elements:
                elements[-1][2] += LEAST_TEXT if ascii_file else SIZES.get(kind, 1)
    # Nothing has to part the last value of a text from others.
    rest, faces = size - end.end() + (1 if ascii_file else 0), None
    for name, count, least in elements:
        if count < 0 or count * least > rest:
            raise _too_short(f"it declares {count} of the element {name!r} and has {rest} bytes for them")
        rest -= count * least
        faces = count if name == "face" else faces
    return faces


def _stl(begin: bytes, size: int) -> int | None:
    if begin.lstrip().startswith(b"solid") and b"facet" in begin[:1000]:
        return begin.count(b"endfacet") if size == len(begin) else None
    if size < STL_HEADER:
        return None
    (faces,) = struct.unpack_from("<I", begin, STL_HEADER - 4)
    if faces * STL_FACE > size - STL_HEADER:
        raise _too_short(f"it declares {faces} faces and holds {(size - STL_HEADER) // STL_FACE}")
    return faces


def _obj(begin: bytes, _size: int) -> None:
    """Blender does not know a first line with a mark before it, and takes every index for that of its neighbour."""
    first = begin.partition(b"\n")[0].split(maxsplit=1)
    if first and first[0].startswith(MARK) and first[0].removeprefix(MARK) in NUMBERED:
        raise ValueError("its first line follows a byte order mark, and would be lost. Save it as UTF-8 without one.")


def _glb(begin: bytes, size: int) -> None:
    if begin.startswith(b"glTF") and len(begin) >= 12 and struct.unpack_from("<I", begin, 8)[0] > size:
        raise _too_short(f"it declares {struct.unpack_from('<I', begin, 8)[0]} bytes and has {size}")


def _gltf(path: Path) -> None:
    """The buffers that a text names are there; what else is wrong with it is for its readers to say."""
    try:
        buffers = json.loads(path.read_bytes())["buffers"]
        named = [(unquote(of["uri"]), int(of["byteLength"])) for of in buffers if not of["uri"].startswith("data:")]
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, OverflowError):
        return
    for name, size in named:
        there = path.parent / name
        if not there.is_file():
            raise ValueError(f"it needs {name}, which is not there. Put it beside the file.")
        if there.stat().st_size < size:
            raise _too_short(f"it declares {size} bytes of {name}, which has {there.stat().st_size}")
