"""Put UVs into a binary glTF file: `TEXCOORD_n`, and where a vertex needs several, copies of it behind all others.

A copy has every attribute, weight and morph of its vertex. Nodes, skins, animations, materials, extensions and extras
stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .glb_data import COMPRESSIONS, DRACO, Glb, accessor, floats, read, triangles, write
from .glb_layout import ATTRIBUTES, ELEMENTS, GlbChange, rows_of
from .imported import Imported, InPlaceError, check_found, dropped_warning, find_corners, numbered

# What Blender appends to a name that is taken.
NUMBERED = re.compile(r"\.\d{3,}$")
# As much of a name as it keeps.
NAME_BYTES = 63
# v is turned around with single precision.
TURNED = 1.2e-7
MALFORMED = (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError)


@dataclass(frozen=True)
class Part:
    """A primitive, its triangles as vertices (t,3), and the corner of Blender (3t,) of each of theirs, or -1."""

    primitive: dict
    corners: np.ndarray
    found: np.ndarray
    mesh: Imported


def put(data: bytes, meshes: Sequence[Imported]) -> tuple[bytes, list[str]]:
    """The bytes of a binary glTF file with the UVs of what Blender made of it, and warnings.

    Raises
    ------
    InPlaceError : a mesh is none of the file's, or the file is compressed or has its data elsewhere
    """
    new, told = put_into(read(data), meshes)
    return data if new is None else write(new), told


def put_into(glb: Glb, meshes: Sequence[Imported], grows: bool = False) -> tuple[Glb | None, list[str]]:
    """A file with the UVs of what Blender made of it, None where nothing changes, and warnings.

    grows : every byte that there is stays, and what is new comes behind

    Raises
    ------
    InPlaceError : see `put`
    """
    try:
        return _put(glb, meshes, grows)
    except InPlaceError:
        raise
    except MALFORMED as error:
        raise InPlaceError(f"the file is not as glTF has to be ({type(error).__name__}: {error})") from error


def _put(glb: Glb, meshes: Sequence[Imported], grows: bool) -> tuple[Glb | None, list[str]]:
    change = GlbChange(glb, grows)
    for name in change.doc.get("extensionsUsed", []):
        if name in COMPRESSIONS:
            raise InPlaceError(f"its buffers are compressed ({name})")
    parts, dropped = _parts(change.glb, meshes)
    groups: dict[str, list[Part]] = {}
    for part in parts:
        of = part.primitive
        groups.setdefault(repr((sorted(of["attributes"].items()), of.get("targets"))), []).append(part)
    changed = [part for group in groups.values() for part in _write_group(change, group)]
    if not changed:
        return None, dropped_warning(dropped)
    new = change.result()
    _check(glb, read(write(new)), meshes)
    told = dropped_warning(dropped)
    if any("TANGENT" in part.primitive["attributes"] for part in changed):
        told.append("TANGENT attributes are those of the UVs before. Have them made anew, or removed.")
    return new, told


def _parts(glb: Glb, meshes: Sequence[Imported]) -> tuple[list[Part], int]:
    """The primitives of the meshes that Blender made, and how many triangles it dropped."""
    own = _Meshes(glb)
    parts, dropped = [], 0
    for mesh in sorted(meshes, key=lambda mesh: (NUMBERED.sub("", mesh.name), mesh.name)):
        index, found = own.find(mesh)
        at = 0
        for primitive in glb.doc["meshes"][index]["primitives"]:
            corners = triangles(glb, primitive).ravel()
            if len(corners):
                parts.append(Part(primitive, corners, found[at : at + len(corners)], mesh))
            at += len(corners)
        start = np.arange(0, len(found) + 1, 3)
        dropped += check_found(found, start, np.ones(len(start) - 1, bool), len(mesh.corner_vertex))
    return parts, dropped


class _Meshes:
    """The meshes of a file as Blender builds them, each to be found once."""

    def __init__(self, glb: Glb):
        self.glb, self.taken = glb, set[int]()
        nodes = glb.doc.get("nodes", [])
        self.skinned = {node["mesh"] for node in nodes if "mesh" in node and "skin" in node}
        order: list[int] = []
        for scene in glb.doc.get("scenes", [{"nodes": list(range(len(nodes)))}]):
            self._visit(nodes, scene.get("nodes", []), order)
        self.order = list(dict.fromkeys([*order, *range(len(glb.doc["meshes"]))]))

    def _visit(self, nodes: list, indices: list, order: list[int]) -> None:
        """Meshes in the order in which the nodes come."""
        stack = list(reversed(indices))
        for _ in range(len(nodes)):
            if not stack:
                return
            node = nodes[stack.pop()]
            if "mesh" in node:
                order.append(node["mesh"])
            stack += reversed(node.get("children", []))

    def find(self, mesh: Imported) -> tuple[int, np.ndarray]:
        """The index of a mesh, and the corner of Blender (c,) for each of its corners.

        Raises
        ------
        InPlaceError : there is none
        """
        names = {k: self.glb.doc["meshes"][k].get("name") or f"Mesh_{k}" for k in self.order}
        fits = [k for k, name in names.items() if _is_called(name, mesh.name)]
        for k in (*fits, *(k for k in self.order if k not in fits)):
            if k in self.taken:
                continue
            found = self._corners(k, mesh)
            if found is not None:
                self.taken.add(k)
                return k, found
        raise InPlaceError(f"the mesh {mesh.name!r} is none of the file's, or has several skins")

    def _corners(self, index: int, mesh: Imported) -> np.ndarray | None:
        """The corner of Blender for each corner of a mesh; None if it is another one."""
        vertices, positions, count = [], [], 0
        for primitive in self.glb.doc["meshes"][index]["primitives"]:
            if DRACO in primitive.get("extensions", {}):
                raise InPlaceError(f"its meshes are compressed ({DRACO})")
            if "POSITION" not in primitive["attributes"]:
                continue
            place = floats(self.glb, primitive["attributes"]["POSITION"])
            # Blender has the vertices that a primitive uses, in their order; those of lines and points, too.
            mode, corners = primitive.get("mode", 4), triangles(self.glb, primitive).ravel()
            if mode < 4:
                given = primitive.get("indices")
                corners = np.arange(len(place)) if given is None else accessor(self.glb, given)[:, 0].astype(np.int64)
            used, inverse = np.unique(corners, return_inverse=True)
            if len(used) and not 0 <= used[0] <= used[-1] < len(place):
                raise InPlaceError(f"a primitive of mesh {index} has vertices that do not exist")
            if mode >= 4:
                vertices.append(count + inverse.ravel())
            positions.append(place[used])
            count += len(used)
        ours = np.concatenate([np.zeros(0, np.int64), *vertices])
        if count != len(mesh.positions) or len(ours) < len(mesh.corner_vertex):
            return None
        if index not in self.skinned:
            x, y, z = np.concatenate([np.zeros((0, 3), np.float32), *positions]).T
            if not np.array_equal(np.stack([x, -z, y], axis=1), mesh.positions, equal_nan=True):
                return None
        start = np.arange(0, len(ours) + 1, 3)
        found = find_corners((ours, start), (mesh.corner_vertex, mesh.face_start))
        return found if np.count_nonzero(found >= 0) == len(mesh.corner_vertex) else None


def _is_called(name: str, here: str) -> bool:
    """Whether Blender may have given a mesh this name: it cuts long ones, and numbers those that are taken."""
    bare = NUMBERED.sub("", here)
    return name in (here, bare) or (len(here.encode()) > NAME_BYTES - 8 and name.startswith(bare))


def _write_group(change: GlbChange, parts: list[Part]) -> list[Part]:
    """Write the UVs of primitives that have their vertices in common; returns them if anything changes."""
    attributes = parts[0].primitive["attributes"]
    layer = parts[0].mesh.layer
    if any(part.mesh.layer != layer for part in parts):
        raise InPlaceError("meshes that share their vertices have UV maps of different names")
    layers = [k for k in range(layer + 1) if k == layer or f"TEXCOORD_{k}" not in attributes]
    n = change.doc["accessors"][attributes["POSITION"]]["count"]
    old = [_old_uv(change.glb, attributes, k, n) for k in layers]
    corners = np.concatenate([part.corners for part in parts])
    uv = np.concatenate([_wished(part, old, layers) for part in parts])
    present = [values is not None for values in old]
    before = np.concatenate([np.zeros((n, 2), np.float32) if v is None else v for v in old], axis=1)
    if all(present) and (before[corners] == uv).all():
        return []
    corner_vertex, copies, values = _split(before, corners, uv)
    users = change.users()
    own = _all(parts[0].primitive)
    owned = {k for k in own if users[k] == own.count(k) * len(parts)}
    fresh: dict[str, np.ndarray] = {}
    for k, name in enumerate(f"TEXCOORD_{j}" for j in layers):
        fresh[name] = np.ascontiguousarray(values[:, 2 * k : 2 * k + 2])
    _write_attributes(change, parts, fresh, copies, owned)
    if len(copies):
        _write_indices(change, parts, corner_vertex, users)
    return parts


def _tables(primitive: dict) -> list[dict]:
    """Accessors of the vertices of a primitive, and of its morphs, by name."""
    return [primitive["attributes"], *primitive.get("targets", [])]


def _all(primitive: dict) -> list[int]:
    """Accessors of the vertices of a primitive."""
    return [index for table in _tables(primitive) for index in table.values()]


def _old_uv(glb: Glb, attributes: dict, layer: int, n: int) -> np.ndarray | None:
    """UVs (n,2) of all vertices, None if there are none."""
    index = attributes.get(f"TEXCOORD_{layer}")
    if index is None:
        return None
    values = floats(glb, index)
    if values.shape != (n, 2):
        raise InPlaceError(f"TEXCOORD_{layer} has not as many values as there are vertices")
    return values


def _wished(part: Part, old: list[np.ndarray | None], layers: list[int]) -> np.ndarray:
    """UVs (c, 2 layers) of the corners of a primitive, in glTF's direction; those that stay keep their bits."""
    here = part.found >= 0
    columns = []
    for values, layer in zip(old, layers, strict=True):
        uv = np.zeros((len(part.corners), 2), np.float32)
        new = part.mesh.layers[layer][part.found[here]].astype(np.float32)
        uv[here] = np.stack([new[:, 0], np.float32(1) - new[:, 1]], axis=1)
        if values is not None:
            before = values[part.corners]
            uv[~here] = before[~here]
            same = (before[here, 0] == new[:, 0]) & (np.float32(1) - before[here, 1] == new[:, 1])
            uv[here] = np.where(same[:, None], before[here], uv[here])
        columns.append(uv)
    return np.concatenate(columns, axis=1)


def _split(before: np.ndarray, corners: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (c,) of corners once each has one UV, the old ones (k,) of which the new are copies, and the UVs
    (n+k,w) of all; the old one keeps the UV it had, if that is among them, or takes the first."""
    n = len(before)
    values = numbered(uv)
    _, first, pair = np.unique(corners * (values.max(initial=0) + 1) + values, return_index=True, return_inverse=True)
    vertex = corners[first]
    moved = (before[vertex] != uv[first]).any(axis=1)
    order = np.lexsort((first, moved, vertex))
    is_main = np.zeros(len(first), bool)
    is_main[order[np.unique(vertex[order], return_index=True)[1]]] = True
    more = np.flatnonzero(~is_main)
    more = more[np.argsort(first[more])]
    new = np.where(is_main, vertex, 0)
    new[more] = n + np.arange(len(more))
    values = np.concatenate([before, before[vertex[more]]])
    values[new] = uv[first]
    return new[pair.ravel()], vertex[more], values


def _write_attributes(change: GlbChange, parts: list[Part], fresh: dict, copies: np.ndarray, owned: set[int]) -> None:
    """Write the UVs `fresh`, and copy the vertices `copies` (k,) in everything else; `owned` nobody else names."""
    doc, done, own = change.doc, dict[tuple, int](), _all(parts[0].primitive)
    for which, targets in enumerate(zip(*(_tables(part.primitive) for part in parts), strict=True)):
        table = dict(targets[0])
        for name in {**table, **(fresh if which == 0 else {})}:
            index, is_new = table.get(name), which == 0 and name in fresh
            key = (index, name if is_new else "")
            if is_new:
                values = fresh[name]
                # Where two attributes are one accessor, the other one keeps it.
                mine = index in owned and own.count(index) == 1
                if mine and index is not None and change.overwrite(index, values):
                    continue
                like = doc["accessors"][index] if index is not None else {"type": "VEC2"}
                done[key] = change.replace(index, values, mine, like, ATTRIBUTES)
            elif index is None or not len(copies):
                continue
            elif key not in done:
                rows = rows_of(change.glb, index)
                like = doc["accessors"][index]
                done[key] = change.replace(
                    index, np.concatenate([rows, rows[copies]]), index in owned, like, ATTRIBUTES
                )
            for target in targets:
                target[name] = done[key]


def _write_indices(change: GlbChange, parts: list[Part], corner_vertex: np.ndarray, users: dict[int, int]) -> None:
    """Write the vertices (c,) of the corners of all primitives."""
    count, at = int(corner_vertex.max(initial=0)) + 1, 0
    for part in parts:
        new = corner_vertex[at : at + len(part.corners)]
        at += len(part.corners)
        if (new == part.corners).all() and part.primitive.get("mode", 4) == 4:
            continue
        index = part.primitive.get("indices")
        like = {"type": "SCALAR"} if index is None else change.doc["accessors"][index]
        wide = count > 65535 or like.get("componentType") == 5125
        values = new.astype("<u4" if wide else "<u2")[:, None]
        owned = index is not None and users.get(index) == 1
        part.primitive["indices"] = change.replace(index, values, owned, like, ELEMENTS)
        if part.primitive.get("mode", 4) != 4:
            part.primitive["mode"] = 4


def _check(old: Glb, new: Glb, meshes: Sequence[Imported]) -> None:
    """Raise InPlaceError unless the new file reads as the same triangles with the UVs that were wished."""
    was, _ = _parts(old, meshes)
    for mesh in meshes:
        for part in (part for part in was if part.mesh is mesh):
            place = _place(old, part.primitive)
            primitive = new.doc["meshes"][place[0]]["primitives"][place[1]]
            corners, here = triangles(new, primitive).ravel(), part.found >= 0
            tables = zip(_tables(part.primitive), _tables(primitive), strict=True)
            same = all(
                accessor(old, index)[part.corners].tobytes() == accessor(new, table[name])[corners].tobytes()
                for was_table, table in tables
                for name, index in was_table.items()
                if name != f"TEXCOORD_{mesh.layer}"
            )
            uv = floats(new, primitive["attributes"][f"TEXCOORD_{mesh.layer}"])[corners[here]]
            off = np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1) - mesh.uv[part.found[here]]
            if not same or not (np.abs(off) <= TURNED * np.maximum(1, np.abs(uv))).all():
                raise InPlaceError("the new file does not read as the mesh it was written from")


def _place(old: Glb, primitive: dict) -> tuple[int, int]:
    """Where a primitive stands: indices of its mesh, and in it."""
    for i, mesh in enumerate(old.doc["meshes"]):
        for k, other in enumerate(mesh["primitives"]):
            if other is primitive:
                return i, k
    raise InPlaceError("the file lost a primitive")
