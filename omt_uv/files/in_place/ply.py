"""Put UVs into the bytes of a PLY file: of its vertices, of the corners of its faces, or both, wherever it has them.

A vertex with several UVs is split, the new ones behind all others, with everything that the file says of the first. All
else stays: comments, other elements and properties, and how numbers are written.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .imported import Imported, InPlaceError, check_found, dropped_warning, find_corners, numbered, same_places
from .ply_rows import TOKEN, Header, Property, Rows, lists, read_header, read_rows, scalars, spans

# Names under which programs store UVs of vertices, and of the corners of a face; Blender reads the first pair.
PAIRS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
INDICES = ("vertex_indices", "vertex_index")
CORNERS = "texcoord"


@dataclass(frozen=True)
class PlyMesh:
    """A PLY file: its bytes, header and rows, positions (n,3), and the faces.

    corner_vertex (c,), -1 for a vertex that does not exist; face_start (f+1,); indices : the name of the lists of
    vertices; pairs : names of the properties that hold UVs of vertices; corners : whether faces hold UVs, too
    """

    data: bytes
    header: Header
    rows: dict[str, Rows]
    positions: np.ndarray
    corner_vertex: np.ndarray
    face_start: np.ndarray
    indices: str
    pairs: list[tuple[str, str]]
    corners: bool


def read(data: bytes) -> PlyMesh:
    """Read a PLY file.

    Raises
    ------
    InPlaceError : it is none, is cut, or has no positions or faces
    """
    header = read_header(data)
    vertex, face = header.find("vertex"), header.find("face")
    if any(element.name == "tristrips" for element in header.elements):
        raise InPlaceError("the file has triangle strips")
    rows = read_rows(data, header, {"vertex", "face"})
    names = [p.name for p in vertex.properties]
    if any(p.count_type for p in vertex.properties):
        raise InPlaceError("the vertices of the file have lists")
    indices = next((p.name for p in face.properties if p.name in INDICES and p.count_type), None)
    if indices is None or not {"x", "y", "z"} <= set(names):
        raise InPlaceError("the file has no positions, or no faces")
    positions = np.stack([scalars(data, header, vertex, rows["vertex"], a).astype(float) for a in "xyz"], axis=1)
    corner = lists(data, header, face, rows["face"], indices).astype(np.int64)
    return PlyMesh(
        data=data,
        header=header,
        rows=rows,
        positions=positions,
        corner_vertex=np.where((corner >= 0) & (corner < len(positions)), corner, -1),
        face_start=np.append(0, np.cumsum(rows["face"].count[indices])),
        indices=indices,
        pairs=[pair for pair in PAIRS if set(pair) <= set(names)],
        corners=any(p.name == CORNERS and p.count_type and p.type[0] == "f" for p in face.properties),
    )


def read_uv(data: bytes) -> tuple[PlyMesh, np.ndarray | None]:
    """A PLY file and the UVs (c,2) of its corners, if it has any, under whatever name."""
    mesh = read(data)
    vertex, face = mesh.header.find("vertex"), mesh.header.find("face")
    if mesh.pairs:
        uv = [scalars(data, mesh.header, vertex, mesh.rows["vertex"], name).astype(float) for name in mesh.pairs[0]]
        return mesh, np.stack(uv, axis=1)[np.maximum(mesh.corner_vertex, 0)]
    if mesh.corners:
        whole = mesh.rows["face"].count[CORNERS] == 2 * np.diff(mesh.face_start)
        if not whole.any():
            return mesh, None
        values = np.zeros((len(mesh.corner_vertex), 2))
        found = lists(data, mesh.header, face, mesh.rows["face"], CORNERS).astype(float)
        values[np.repeat(whole, np.diff(mesh.face_start))] = found[
            np.repeat(whole, mesh.rows["face"].count[CORNERS])
        ].reshape(-1, 2)
        return mesh, values
    return mesh, None


def put(data: bytes, meshes: Sequence[Imported]) -> tuple[bytes, list[str]]:
    """The bytes of a PLY file with the UVs of what Blender made of it, and warnings.

    Raises
    ------
    InPlaceError : the mesh is not that of the file, or the file cannot hold its UVs
    """
    if len(meshes) != 1:
        raise InPlaceError(f"the file was read as {len(meshes)} objects")
    (mesh,) = meshes
    ply = read(data)
    place, their_place = same_places(ply.positions, mesh.positions)
    ours = np.append(place, -1)[ply.corner_vertex]
    corner = find_corners((ours, ply.face_start), (their_place[mesh.corner_vertex], mesh.face_start))
    dropped = check_found(corner, ply.face_start, np.ones(len(ply.face_start) - 1, bool), len(mesh.corner_vertex))
    here = corner >= 0
    wished = mesh.uv[corner[here]]
    new = data if ply.corners and not ply.pairs else _with_vertices(ply, here, wished)
    new = _with_corners(read(new), here, wished)
    _check(ply, new, here, wished)
    return new, dropped_warning(dropped)


def _with_corners(ply: PlyMesh, here: np.ndarray, wished: np.ndarray) -> bytes:
    """The bytes of the file with UVs of corners, where it has such."""
    if not ply.corners:
        return ply.data
    face, rows = ply.header.find("face"), ply.rows["face"]
    p = next(p for p in face.properties if p.name == CORNERS)
    uv = np.zeros((len(here), 2), np.float32)
    uv[here] = wished
    old = lists(ply.data, ply.header, face, rows, CORNERS).astype(np.float32)
    old_start = np.append(0, np.cumsum(rows.count[CORNERS]))
    out, at = [], 0
    for k in range(face.count):
        corners = slice(ply.face_start[k], ply.face_start[k + 1])
        values = uv[corners].ravel()
        if not here[corners].any() or np.array_equal(old[old_start[k] : old_start[k + 1]], values):
            continue
        out += [ply.data[at : rows.head[CORNERS][k]], _list(ply.header.order, p, values)]
        at = _end_of_list(ply, k, p)
    return b"".join([*out, ply.data[at:]])


def _end_of_list(ply: PlyMesh, k: int, p: Property) -> int:
    """Where the list of a face ends."""
    rows = ply.rows["face"]
    length = int(rows.count[p.name][k])
    if ply.header.order:
        return int(rows.place[p.name][k]) + length * int(p.type[1])
    words = TOKEN.finditer(ply.data, int(rows.head[p.name][k]))
    return [next(words).end() for _ in range(length + 1)][-1]


def _list(order: str, p: Property, values: np.ndarray) -> bytes:
    """A list as bytes, its length first."""
    if not order:
        return b" ".join([str(len(values)).encode(), *_digits(values)])
    if len(values) > np.iinfo(p.count_type).max:
        raise InPlaceError("a face has more corners than the file can count")
    return np.array([len(values)], order + p.count_type).tobytes() + values.astype(order + p.type).tobytes()


def _digits(values: np.ndarray) -> list[bytes]:
    """Nine digits tell any two single precision numbers apart."""
    return [f"{x:.9g}".encode() for x in values.tolist()]


@dataclass(frozen=True)
class Split:
    """Vertices once their UVs are single: that of each corner (c,), the old ones of which the new ones (k,) are
    copies, and which have UVs that are written, `touched` (n+k,) bool, with these UVs (n+k,2)."""

    corner_vertex: np.ndarray
    copies: np.ndarray
    touched: np.ndarray
    uv: np.ndarray


def _split(ply: PlyMesh, old: np.ndarray | None, here: np.ndarray, wished: np.ndarray) -> Split:
    """Split vertices with several UVs; the old one keeps the UV that it had, if that is among them, or the first."""
    n = len(ply.positions)
    values = numbered(wished)
    key = ply.corner_vertex[here] * (values.max(initial=0) + 1) + values
    _, first, pair = np.unique(key, return_index=True, return_inverse=True)
    vertex, uv = ply.corner_vertex[here][first], wished[first]
    moved = np.ones(len(first), bool) if old is None else (old[vertex].astype(np.float32) != uv).any(axis=1)
    order = np.lexsort((first, moved, vertex))
    is_main = np.zeros(len(first), bool)
    is_main[order[np.unique(vertex[order], return_index=True)[1]]] = True
    new = np.where(is_main, vertex, 0)
    # In the order of corners.
    more = np.flatnonzero(~is_main)
    more = more[np.argsort(first[more])]
    new[more] = n + np.arange(len(more))
    corner_vertex = ply.corner_vertex.copy()
    corner_vertex[here] = new[pair.ravel()]
    touched, all_uv = np.zeros(n + len(more), bool), np.zeros((n + len(more), 2), np.float32)
    touched[new], all_uv[new] = True, uv
    return Split(corner_vertex, vertex[more], touched, all_uv)


def _with_vertices(ply: PlyMesh, here: np.ndarray, wished: np.ndarray) -> bytes:
    """The bytes of the file with UVs of vertices, which are split where they have several."""
    vertex, rows = ply.header.find("vertex"), ply.rows["vertex"]
    old = None
    if ply.pairs:
        old = np.stack([scalars(ply.data, ply.header, vertex, rows, name) for name in ply.pairs[0]], axis=1)
        if any(p.name in ply.pairs[0] and p.type[0] != "f" for p in vertex.properties):
            raise InPlaceError("the UVs of the file are no floats")
    split = _split(ply, old, here, wished)
    face = ply.header.find("face")
    p = next(p for p in face.properties if p.name == ply.indices)
    if len(split.touched) - 1 > np.iinfo(p.type).max:
        raise InPlaceError(f"the file counts vertices as {p.type}, and has no numbers left for those that are split")
    write_vertices, write_faces = (
        (_binary_vertices, _binary_faces) if ply.header.order else (_text_vertices, _text_faces)
    )
    sections = sorted(
        [
            (int(rows.start[0]), int(rows.start[-1]), write_vertices(ply, split, old)),
            (int(ply.rows["face"].start[0]), int(ply.rows["face"].start[-1]), write_faces(ply, split, p)),
        ]
    )
    out, at = [_header(ply, len(split.touched))], ply.header.size
    for begin, end, new in sections:
        out += [ply.data[at:begin], new]
        at = end
    return b"".join([*out, ply.data[at:]])


def _header(ply: PlyMesh, count: int) -> bytes:
    """The header with another number of vertices, and with UVs."""
    lines, vertex = list(ply.header.lines), ply.header.find("vertex")
    if count != vertex.count:
        lines[vertex.line] = lines[vertex.line].replace(b" %d" % vertex.count, b" %d" % count)
    if not ply.pairs:
        last = vertex.property_lines[-1]
        lines[last] += b"".join(b"property float " + name.encode() + ply.header.end for name in PAIRS[0])
    return b"".join(lines)


def _binary_vertices(ply: PlyMesh, split: Split, old: np.ndarray | None) -> bytes:
    """The rows of all vertices of a binary file."""
    vertex, rows = ply.header.find("vertex"), ply.rows["vertex"]
    size = int(rows.start[-1] - rows.start[0]) // max(vertex.count, 1)
    bytes_of = np.frombuffer(ply.data, np.uint8, size * vertex.count, int(rows.start[0])).reshape(-1, size)
    bytes_of = bytes_of[np.concatenate([np.arange(vertex.count), split.copies])]
    if old is None:
        uv = split.uv.astype(ply.header.order + "f4")
        return np.concatenate([bytes_of, uv.view(np.uint8).reshape(len(uv), 8)], axis=1).tobytes()
    before = old[np.concatenate([np.arange(vertex.count), split.copies])].astype(np.float32)
    for axis, name in enumerate(ply.pairs[0]):
        p = next(p for p in vertex.properties if p.name == name)
        at, width = int(rows.place[name][0] - rows.start[0]), int(p.type[1])
        moved = split.touched & (before[:, axis] != split.uv[:, axis])
        values = np.ascontiguousarray(split.uv[moved, axis].astype(ply.header.order + p.type))
        bytes_of[moved, at : at + width] = values.view(np.uint8).reshape(-1, width)
    return bytes_of.tobytes()


def _text_vertices(ply: PlyMesh, split: Split, old: np.ndarray | None) -> bytes:
    """The rows of all vertices of a text."""
    rows = ply.rows["vertex"]
    out = []
    for k, source in enumerate([*range(len(ply.positions)), *split.copies.tolist()]):
        begin, end = int(rows.start[source]), int(rows.start[source + 1])
        line = ply.data[begin:end]
        if not line.endswith(b"\n"):
            line += ply.header.end
        if old is None:
            bare = line.rstrip()
            out.append(bare + b" " + b" ".join(_digits(split.uv[k])) + line[len(bare) :])
            continue
        fresh = {}
        for axis, name in enumerate(ply.pairs[0]):
            if split.touched[k] and np.float32(old[source, axis]) != split.uv[k, axis]:
                fresh[int(rows.place[name][source]) - begin] = _digits(split.uv[k, axis : axis + 1])[0]
        out.append(_replaced(line, fresh))
    return b"".join(out)


def _binary_faces(ply: PlyMesh, split: Split, p: Property) -> bytes:
    """The rows of all faces of a binary file."""
    rows = ply.rows["face"]
    begin, end = int(rows.start[0]), int(rows.start[-1])
    bytes_of, size = np.frombuffer(ply.data, np.uint8)[begin:end].copy(), int(p.type[1])
    place = np.repeat(rows.place[p.name] - begin, rows.count[p.name])
    place = place + size * (np.arange(len(place)) - np.repeat(ply.face_start[:-1], rows.count[p.name]))
    moved = split.corner_vertex != ply.corner_vertex
    new = np.ascontiguousarray(split.corner_vertex[moved].astype(ply.header.order + p.type))
    bytes_of[spans(place[moved], np.full(moved.sum(), size))] = new.view(np.uint8)
    return bytes_of.tobytes()


def _text_faces(ply: PlyMesh, split: Split, p: Property) -> bytes:
    """The rows of all faces of a text."""
    rows = ply.rows["face"]
    moved = split.corner_vertex != ply.corner_vertex
    out = []
    for k in range(len(ply.face_start) - 1):
        begin, end = int(rows.start[k]), int(rows.start[k + 1])
        corners = slice(ply.face_start[k], ply.face_start[k + 1])
        line = ply.data[begin:end]
        if moved[corners].any():
            words = TOKEN.finditer(ply.data, int(rows.place[p.name][k]), end)
            places = [next(words).start() - begin for _ in range(corners.stop - corners.start)]
            new = split.corner_vertex[corners].tolist()
            line = _replaced(line, {at: b"%d" % v for at, v, m in zip(places, new, moved[corners], strict=True) if m})
        out.append(line)
    return b"".join(out)


def _replaced(line: bytes, fresh: dict[int, bytes]) -> bytes:
    """A line with the words that begin at some places replaced, and all blanks kept."""
    out, at = [], 0
    for place in sorted(fresh):
        out += [line[at:place], fresh[place]]
        found = TOKEN.match(line, place)
        at = found.end() if found else place
    return b"".join([*out, line[at:]])


def _check(old: PlyMesh, data: bytes, here: np.ndarray, wished: np.ndarray) -> None:
    """Raise InPlaceError unless the new bytes are the old mesh with the UVs wished (k,2) at the corners mapped."""
    new, uv = read_uv(data)
    positions, count = new.positions[new.corner_vertex[here]], len(old.positions)
    same = (
        np.array_equal(old.face_start, new.face_start)
        and np.array_equal(old.positions, new.positions[:count], equal_nan=True)
        and np.array_equal(old.positions[old.corner_vertex[here]], positions, equal_nan=True)
    )
    if not same or uv is None or not (uv[here].astype(np.float32) == wished).all():
        raise InPlaceError("the new file does not read as the mesh it was written from")
