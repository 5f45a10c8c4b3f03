"""Read the header of a PLY file, and where in its bytes the rows of its elements and their lists are."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from .imported import InPlaceError

TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TOKEN = re.compile(rb"\S+")


@dataclass(frozen=True)
class Property:
    """A property of an element: its name, the type of its values, and of its count if it is a list."""

    name: str
    type: str
    count_type: str = ""


@dataclass(frozen=True)
class Element:
    """An element of a PLY file: its name, count and properties, and the numbers of its lines in the header."""

    name: str
    count: int
    line: int
    properties: list[Property] = field(default_factory=list)
    property_lines: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class Header:
    """The header of a PLY file: its lines with their ends, the byte order ("" for text), and the elements."""

    lines: list[bytes]
    order: str
    elements: list[Element]

    @property
    def size(self) -> int:
        """Bytes of the header."""
        return sum(map(len, self.lines))

    @property
    def end(self) -> bytes:
        """What its lines end with."""
        return b"\r\n" if self.lines[-1].endswith(b"\r\n") else b"\n"

    def find(self, name: str) -> Element:
        """The element of this name; InPlaceError if there is none."""
        for element in self.elements:
            if element.name == name:
                return element
        raise InPlaceError(f"the file has no element {name!r}")


@dataclass(frozen=True)
class Rows:
    """Rows of an element, as offsets of bytes in the file: start (k+1,); of each property the place (k,) of its only
    or first value; of each list the place of its length, `head` (k,), and the number of its values, `count` (k,)."""

    start: np.ndarray
    place: dict[str, np.ndarray]
    head: dict[str, np.ndarray]
    count: dict[str, np.ndarray]

    @classmethod
    def empty(cls, element: Element, at: int) -> Rows:
        """Rows to be filled, the first of which begins at an offset."""
        start = np.zeros(element.count + 1, np.int64)
        start[0] = at
        of = [{p.name: np.zeros(element.count, np.int64) for p in element.properties} for _ in range(3)]
        lists = {p.name for p in element.properties if p.count_type}
        return cls(start, of[0], *({name: of[k][name] for name in lists} for k in (1, 2)))


def read_header(data: bytes) -> Header:
    """Read the header of a PLY file.

    Raises
    ------
    InPlaceError : it is none
    """
    lines: list[bytes] = []
    elements: list[Element] = []
    at, order = 0, None
    while True:
        end = data.find(b"\n", at)
        if end < 0 or len(lines) > 10000:
            raise InPlaceError("the header of the file does not end")
        lines.append(data[at : end + 1])
        at = end + 1
        said = lines[-1].decode("latin-1").split()
        try:
            if said[:1] == ["end_header"]:
                break
            if said[:1] == ["format"]:
                order = ORDERS[said[1]]
            elif said[:1] == ["element"]:
                elements.append(Element(said[1], int(said[2]), len(lines) - 1))
            elif said[:1] == ["property"]:
                elements[-1].property_lines.append(len(lines) - 1)
                elements[-1].properties.append(_property(said))
        except (IndexError, KeyError, ValueError) as error:
            raise InPlaceError(f"the header of the file has a line {' '.join(said)[:60]!r}") from error
    if order is None or lines[0].strip() != b"ply" or any(not 0 <= e.count <= len(data) for e in elements):
        raise InPlaceError("the header of the file lacks a format, or counts more than the file can hold")
    return Header(lines, order, elements)


def _property(said: list[str]) -> Property:
    if said[1] == "list":
        return Property(said[4], TYPES[said[3]], TYPES[said[2]])
    return Property(said[2], TYPES[said[1]])


def read_rows(data: bytes, header: Header, until: set[str]) -> dict[str, Rows]:
    """Where the rows of all elements are, up to the last one whose name is in `until`.

    Raises
    ------
    InPlaceError : the file ends before they do
    """
    at, found = header.size, {}
    for element in header.elements:
        rows = _text_rows(data, at, element) if not header.order else _binary_rows(data, at, element, header.order)
        found[element.name] = rows
        at = int(rows.start[-1])
        if until <= found.keys():
            break
    return found


def _binary_rows(data: bytes, at: int, element: Element, order: str) -> Rows:
    """Rows of an element in a binary file."""
    layout = _even_layout(data, at, element, order)
    if layout is not None:
        return layout
    rows = Rows.empty(element, at)
    parts = [
        (p.name, int(p.type[1]), np.dtype(order + p.count_type) if p.count_type else None) for p in element.properties
    ]
    for k in range(element.count):
        for name, size, counter in parts:
            length = 1
            if counter is not None:
                if at + counter.itemsize > len(data):
                    raise InPlaceError(f"the file ends before its {element.name} elements do")
                length = int(np.frombuffer(data, counter, 1, at)[0])
                if length < 0:
                    raise InPlaceError(f"{element.name} {k} has a list of negative length")
                rows.head[name][k] = at
                rows.count[name][k] = length
                at += counter.itemsize
            rows.place[name][k] = at
            at += length * size
        rows.start[k + 1] = at
    if at > len(data):
        raise InPlaceError(f"the file ends before its {element.name} elements do")
    return rows


def _even_layout(data: bytes, at: int, element: Element, order: str) -> Rows | None:
    """Rows of an element all of which are as long as the first; None if they are not."""
    offset, offsets, counters = 0, {}, {}
    for p in element.properties:
        length = 1
        if p.count_type:
            counter = np.dtype(order + p.count_type)
            if not element.count or at + offset + counter.itemsize > len(data):
                return None
            length = int(np.frombuffer(data, counter, 1, at + offset)[0])
            counters[p.name] = (offset, counter, length)
            offset += counter.itemsize
            if length < 0:
                return None
        offsets[p.name] = offset
        offset += length * int(p.type[1])
    if at + offset * element.count > len(data):
        if counters:
            return None
        raise InPlaceError(f"the file ends before its {element.name} elements do")
    start = at + offset * np.arange(element.count + 1)
    for place, counter, length in counters.values():
        fields = np.dtype({"names": ["n"], "formats": [counter], "offsets": [place], "itemsize": offset})
        if (np.frombuffer(data, fields, element.count, at)["n"] != length).any():
            return None
    count = {name: np.full(element.count, length) for name, (_, _, length) in counters.items()}
    head = {name: start[:-1] + place for name, (place, _, _) in counters.items()}
    return Rows(start, {name: start[:-1] + offset for name, offset in offsets.items()}, head, count)


def _text_rows(data: bytes, at: int, element: Element) -> Rows:
    """Rows of an element in a text: each a line."""
    rows = Rows.empty(element, at)
    for k in range(element.count):
        end = data.find(b"\n", at) + 1 or len(data)
        words = [found.start() for found in TOKEN.finditer(data, at, end)]
        word = 0
        for p in element.properties:
            length = 1
            if p.count_type:
                length = _count(data, words, word, end)
                rows.head[p.name][k], rows.count[p.name][k] = words[word], length
                word += 1
            if word + length > len(words):
                raise InPlaceError(f"the line of {element.name} {k} lacks values")
            rows.place[p.name][k] = words[word] if length else end
            word += length
        at = end
        rows.start[k + 1] = at
    return rows


def _count(data: bytes, words: list[int], word: int, end: int) -> int:
    """The length of a list that a word of a line says."""
    try:
        length = int(data[words[word] : end].split(None, 1)[0])
    except (IndexError, ValueError) as error:
        raise InPlaceError("a list of the file has no length") from error
    if length < 0:
        raise InPlaceError("a list of the file has a negative length")
    return length


def scalars(data: bytes, header: Header, element: Element, rows: Rows, name: str) -> np.ndarray:
    """Values (k,) of a property that is no list."""
    return lists(data, header, element, rows, name)


def lists(data: bytes, header: Header, element: Element, rows: Rows, name: str) -> np.ndarray:
    """Values of a property of all rows, one list behind the other."""
    p = next(p for p in element.properties if p.name == name)
    count = rows.count.get(name, np.ones(element.count, np.int64))
    if header.order:
        return np.frombuffer(gather(data, rows.place[name], count * int(p.type[1])), header.order + p.type)
    words = [data[a:b].split(None, n)[:n] for a, b, n in zip(rows.place[name], rows.start[1:], count, strict=True)]
    try:
        return np.array([float(w) for row in words for w in row]).astype("f8" if p.type[0] == "f" else "i8")
    except ValueError as error:
        raise InPlaceError(f"a value {name!r} of the file is no number") from error


def gather(data: bytes, place: np.ndarray, size: np.ndarray) -> bytes:
    """The bytes of `size` (k,) each that stand at `place` (k,), one behind the other."""
    return np.frombuffer(data, np.uint8)[spans(place, size)].tobytes()


def spans(place: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Offsets of all bytes of spans that begin at `place` (k,) and have `size` (k,) bytes."""
    first = np.repeat(place - (np.cumsum(size) - size), size)
    return first + np.arange(len(first))
