"""Put UVs into a glTF file of text: its buffers are read as one, and what changes goes into one more, in the text.

Files that hold buffers are not touched: they and the text belong together at any time, and one file is replaced.
Where OUT stands elsewhere and they do not, their bytes go into the text as well.
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from .glb import put_into
from .glb_data import ALIGNMENT, Glb, mentions
from .imported import Imported, InPlaceError

EMBEDDED = "data:application/octet-stream;base64,"
# A scheme with an address, or a place that is no part of the file's folder.
ELSEWHERE = re.compile(r"[a-zA-Z][a-zA-Z0-9+.-]*:|/|\\")


@dataclass(frozen=True)
class Gltf:
    """A glTF file: its JSON, the bytes of each buffer, where each begins once they are one, and that one as `Glb`."""

    doc: dict
    buffers: tuple[bytes, ...]
    starts: tuple[int, ...]
    glb: Glb
    indent: str | None


def read(data: bytes, folder: Path) -> Gltf:
    """Read a glTF file and the buffers that it names in its folder.

    Raises
    ------
    InPlaceError : it is none, or a buffer is not there, or elsewhere
    """
    try:
        text = data.decode("utf-8-sig")
        doc = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InPlaceError("the file is no JSON") from error
    if not isinstance(doc, dict) or not isinstance(doc.get("buffers", []), list):
        raise InPlaceError("the JSON of the file is not that of glTF")
    try:
        buffers = tuple(_bytes_of(k, of, folder) for k, of in enumerate(doc.get("buffers", [])))
        starts, joined = [], bytearray()
        for raw in buffers:
            joined += bytes(-len(joined) % ALIGNMENT)
            starts.append(len(joined))
            joined += raw
        views = [_moved(view, starts[view["buffer"]]) for view in doc.get("bufferViews", [])]
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        raise InPlaceError(f"the file is not as glTF has to be ({type(error).__name__}: {error})") from error
    one = {**doc, "buffers": [{"byteLength": len(joined)}], "bufferViews": views}
    found = re.match(r'\s*\{\r?\n([ \t]+)"', text)
    return Gltf(doc, buffers, tuple(starts), Glb(one, bytes(joined), []), found[1] if found else None)


def _bytes_of(index: int, of: dict, folder: Path) -> bytes:
    """The bytes of a buffer, as many as it declares."""
    uri, length = of.get("uri", ""), of["byteLength"]
    if uri.startswith("data:"):
        head, _, body = uri.partition(",")
        if not head.endswith(";base64"):
            raise InPlaceError(f"buffer {index} is of a kind that this program does not read")
        try:
            raw = base64.b64decode(body)
        except ValueError as error:
            raise InPlaceError(f"buffer {index} is no base64") from error
    elif not uri or ELSEWHERE.match(uri):
        raise InPlaceError(f"buffer {index} is not in the folder of the file")
    else:
        try:
            raw = (folder / unquote(uri)).read_bytes()
        except OSError as error:
            raise InPlaceError(f"buffer {index}, {unquote(uri)}: {error.strerror}") from error
    if not isinstance(length, int) or not 0 <= length <= len(raw):
        raise InPlaceError(f"buffer {index} declares {length} bytes and has {len(raw)}")
    return raw[:length]


def _moved(view: dict, start: int) -> dict:
    """A view of a buffer that begins so far into the one of all."""
    return view | {"buffer": 0, "byteOffset": start + view.get("byteOffset", 0)}


def put(data: bytes, meshes: Sequence[Imported], folder: Path, target: Path) -> tuple[bytes, list[str]]:
    """The bytes of a glTF file with the UVs of what Blender made of it, and warnings.

    folder, target : where the file stands, and where it will

    Raises
    ------
    InPlaceError : a mesh is none of the file's, or the file is compressed, or a buffer is not there
    """
    old = read(data, folder)
    new, told = put_into(old.glb, meshes, grows=True)
    if new is None and target == folder:
        return data, told
    made = _text(old, new or old.glb, None if target == folder else target)
    again = read(made, target)
    if _contents(again.glb) != _contents(new or old.glb):
        raise InPlaceError("the new file does not read as the mesh it was written from")
    return made, told


def _contents(glb: Glb) -> list[tuple]:
    """What the views of a file hold, byte for byte, in the order in which they are named."""
    views, held = glb.doc["bufferViews"], []
    for index in mentions(glb.doc):
        begin = views[index].get("byteOffset", 0)
        held.append((glb.binary[begin : begin + views[index]["byteLength"]], views[index].get("byteStride")))
    return held


def _text(old: Gltf, new: Glb, moved: Path | None) -> bytes:
    """The text of a file whose new bytes come after those of the old one; moved : its folder, if another one."""
    end = len(old.glb.binary) + -len(old.glb.binary) % ALIGNMENT
    views = []
    for k, view in enumerate(new.doc["bufferViews"]):
        if k < len(old.glb.doc["bufferViews"]) and view == old.glb.doc["bufferViews"][k]:
            views.append(old.doc["bufferViews"][k])
        else:
            views.append(view | {"buffer": len(old.buffers), "byteOffset": view["byteOffset"] - end})
    buffers = [_placed(of, raw, moved) for of, raw in zip(old.doc.get("buffers", []), old.buffers, strict=True)]
    if len(new.binary) > end:
        buffers.append(_embedded({}, new.binary[end:]))
    # A buffer in the text that no view is in any more is that of a run before this one.
    needed = {view["buffer"] for view in views}
    kept = [k for k, of in enumerate(buffers) if k in needed or not of.get("uri", "").startswith(EMBEDDED)]
    views = [view | {"buffer": kept.index(view["buffer"])} for view in views]
    buffers = [buffers[k] for k in kept]
    return text_of(new.doc | {"bufferViews": views, "buffers": buffers}, old.indent)


def _placed(of: dict, raw: bytes, moved: Path | None) -> dict:
    """A buffer as it is, or in the text where its file is not in the new folder."""
    uri = of.get("uri", "")
    if moved is None or uri.startswith("data:"):
        return of
    there = moved / unquote(uri)
    if there.is_file() and there.read_bytes()[: len(raw)] == raw:
        return of
    return _embedded(of, raw)


def _embedded(of: dict, raw: bytes) -> dict:
    """A buffer in the text itself."""
    return of | {"byteLength": len(raw), "uri": EMBEDDED + base64.b64encode(raw).decode()}


def text_of(doc: dict, indent: str | None = None) -> bytes:
    """JSON as a file has it: indented like its source, or without a space."""
    separators = (",", ":") if indent is None else (",", ": ")
    try:
        return json.dumps(doc, ensure_ascii=False, indent=indent, separators=separators).encode()
    except UnicodeEncodeError:  # half of a surrogate pair, which only an escape can hold
        return json.dumps(doc, indent=indent, separators=separators).encode()


def embedded(glb: Glb) -> bytes:
    """A binary glTF file as text, with its bytes in it."""
    buffers = [_embedded(of, glb.binary[: of["byteLength"]]) for of in glb.doc.get("buffers", [])[:1]]
    return text_of(glb.doc | ({"buffers": buffers} if buffers else {}), "\t")
