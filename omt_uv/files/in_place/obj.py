"""Put UVs into the text of an OBJ file: `vt` lines and what `f` lines say of them change, and no other byte does.

Lines of UVs are used again, so that a file whose UVs stay is the same file, and one whose seams stay has the same
faces. What more is needed follows the last UV, or the last vertex, before the face that needs it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .imported import Imported, InPlaceError, check_found, dropped_warning, find_corners, numbered, same_places
from .obj_text import WORD, ObjText, read, words


@dataclass(frozen=True)
class Plan:
    """What becomes of UVs: `kept` (m,) bool of the old ones that keep their value, `slot` (m,) the new one that takes
    an old one's line or -1, `after` (k,) the line behind which a new one is inserted or -1, `values` (k,2)."""

    kept: np.ndarray
    slot: np.ndarray
    after: np.ndarray
    values: np.ndarray


def put(data: bytes, meshes: Sequence[Imported]) -> tuple[bytes, list[str]]:
    """The bytes of an OBJ file with the UVs of what Blender made of it, and warnings.

    Raises
    ------
    InPlaceError : the mesh is not that of the file
    """
    if len(meshes) != 1:
        raise InPlaceError(f"the file was read as {len(meshes)} objects")
    (mesh,) = meshes
    text = read(data)
    corner = _found(text, mesh)
    dropped = check_found(corner, text.face_start, text.is_face, len(mesh.corner_vertex))
    here = corner >= 0
    wished = mesh.uv[corner[here]]
    group, first = _groups(text, here, wished)
    plan = _plan(text, here, group, wished[first], _first_lines(text, here, group, len(first)))
    new = _written(text, here, group, plan)
    _check(text, read(new), here, wished)
    return new, dropped_warning(dropped)


def _found(text: ObjText, mesh: Imported) -> np.ndarray:
    """The corner of the mesh (c,) for every corner of the file, -1 for faces that Blender drops."""
    there = text.corner_vertex >= 0
    used = np.unique(text.corner_vertex[there])
    # Blender leaves out vertices that no face uses.
    few = len(mesh.positions) != len(text.positions)
    positions = text.positions[used] if few else text.positions
    number = np.full(len(text.positions) + 1, -1)
    place, their_place = same_places(positions, mesh.positions)
    number[used if few else np.arange(len(positions))] = place
    ours = number[np.where(there, text.corner_vertex, len(text.positions))]
    ours[~np.repeat(text.is_face, np.diff(text.face_start))] = -1
    return find_corners((ours, text.face_start), (their_place[mesh.corner_vertex], mesh.face_start))


def _groups(text: ObjText, here: np.ndarray, wished: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The group (k,) of every corner that is mapped, and a corner of every group: those that shall share a UV line.

    They have one UV, and either one vertex or one line before.
    """
    values = numbered(wished)
    vertex, old = text.corner_vertex[here], text.corner_uv[here]
    at_vertex = np.unique(vertex * (values.max(initial=0) + 1) + values, return_inverse=True)[1].ravel()
    at_line = np.unique(old * (values.max(initial=0) + 1) + values, return_inverse=True)[1].ravel()
    shares, count = old >= 0, at_vertex.max(initial=-1) + 1
    size = count + at_line.max(initial=-1) + 1
    links = coo_matrix((np.ones(shares.sum()), (at_vertex[shares], count + at_line[shares])), shape=(size, size))
    _, label = connected_components(links, directed=False)
    _, first, group = np.unique(label[at_vertex], return_index=True, return_inverse=True)
    return group.ravel(), first


def _first_lines(text: ObjText, here: np.ndarray, group: np.ndarray, count: int) -> np.ndarray:
    """The index (k,) of the first face that uses each group."""
    face = np.repeat(np.arange(len(text.face_line)), np.diff(text.face_start))[here]
    first = np.full(count, len(text.face_line))
    np.minimum.at(first, group, face)
    return first


def _plan(text: ObjText, here: np.ndarray, group: np.ndarray, values: np.ndarray, first: np.ndarray) -> Plan:
    """Which line each group gets: one that its corners had, one that is free, or a new one."""
    kept = np.zeros(len(text.uv), bool)
    kept[:] = text.has_surfaces
    old = text.corner_uv[here]
    used = np.zeros(len(text.uv), bool)
    used[old[old >= 0]] = True
    rest = text.corner_uv[~here]
    kept[rest[rest >= 0]] = True
    # What nothing used has some other purpose.
    kept |= ~used
    slot, needs = np.full(len(text.uv), -1), np.ones(len(values), bool)
    first_line = text.face_line[first]
    pairs = np.unique(np.stack([group[old >= 0], old[old >= 0]], axis=1), axis=0)
    for g, k in pairs.tolist():
        if needs[g] and slot[k] < 0 and not kept[k] and text.uv_line[k] < first_line[g]:
            slot[k], needs[g] = g, False
    after = np.full(len(values), -1)
    free = iter(np.flatnonzero((slot < 0) & ~kept).tolist())
    k = next(free, None)
    for g in np.argsort(first, kind="stable").tolist():
        if not needs[g]:
            continue
        if k is not None and text.uv_line[k] < first_line[g]:
            slot[k] = g
            k = next(free, None)
        else:
            before = np.searchsorted(text.uv_line, first_line[g])
            after[g] = text.uv_line[before - 1] if before else text.last_vertex[first[g]]
    return Plan(kept, slot, after, values)


def _written(text: ObjText, here: np.ndarray, group: np.ndarray, plan: Plan) -> bytes:
    """The new bytes."""
    inserted: dict[int, list[int]] = {}
    for g in np.flatnonzero(plan.after >= 0).tolist():
        inserted.setdefault(int(plan.after[g]), []).append(g)
    old_at, new_at = [-1] * len(text.uv), [-1] * len(plan.values)
    slot, kept = plan.slot.tolist(), plan.kept.tolist()
    line_of_uv = {line: k for k, line in enumerate(text.uv_line.tolist())}
    face_of_line = {line: f for f, line in enumerate(text.face_line.tolist())}
    goal = np.full(len(here), -1)
    goal[here] = group
    goals, olds, start = goal.tolist(), text.corner_uv.tolist(), text.face_start.tolist()
    out: list[bytes] = []
    count = 0
    for i, line in enumerate(text.lines):
        face, k = face_of_line.get(i), line_of_uv.get(i)
        if face is not None:
            corners = slice(start[face], start[face + 1])
            pairs = zip(goals[corners], olds[corners], strict=True)
            uvs = [new_at[g] if g >= 0 else old_at[u] if u >= 0 else -1 for g, u in pairs]
            out.append(line if uvs == olds[corners] and b"-" not in line else _face(line, uvs, count))
        elif k is None:
            out.append(line)
        elif kept[k] or slot[k] >= 0:
            old_at[k] = count
            if slot[k] >= 0:
                new_at[slot[k]] = count
                line = _uv_line(line, text.uv[k], plan.values[slot[k]])
            out.append(line)
            count += 1
        for g in inserted.get(i, ()):
            new_at[g] = count
            count += 1
            out.append(_new_line(plan.values[g], line))
    return b"".join(out)


def _uv_line(line: bytes, old: np.ndarray, new: np.ndarray) -> bytes:
    """A line of UVs with another value."""
    if (old.astype(np.float32) == new).all():
        return line
    if len(words(line)) < 3:
        return _new_line(new, line)
    return _replaced(line, dict(enumerate(_digits(new), 1)))


def _new_line(uv: np.ndarray, beside: bytes) -> bytes:
    """A line of UVs that ends like the one beside it."""
    return b"vt " + b" ".join(_digits(uv)) + (b"\r\n" if beside.endswith(b"\r\n") else b"\n")


def _digits(uv: np.ndarray) -> list[bytes]:
    """Nine digits tell any two single precision numbers apart."""
    return [f"{x:.9g}".encode() for x in uv.tolist()]


def _face(line: bytes, uvs: Sequence[int], count: int) -> bytes:
    """A line of a face with other indices of UVs from 0, -1 for corners that stay; `count` UVs have come before it."""
    fresh, said = {}, words(line)
    for k, (word, uv) in enumerate(zip(said[1:], uvs, strict=True), 1):
        if uv < 0:
            continue
        vertex, *more = word.split(b"/")
        backward = (more[0] if more and more[0] else vertex).startswith(b"-")
        more[:1] = [str(uv - count if backward else uv + 1).encode()]
        fresh[k] = b"/".join([vertex, *more])
    bare = line.rstrip()
    if b" ".join(said) == bare:
        return b" ".join([fresh.get(k, word) for k, word in enumerate(said)]) + line[len(bare) :]
    return _replaced(line, fresh)


def _replaced(line: bytes, fresh: dict[int, bytes]) -> bytes:
    """A line with some of its words replaced, and all blanks kept."""
    out, end = [], 0
    for k, found in enumerate(WORD.finditer(line)):
        if k in fresh:
            out += [line[end : found.start()], fresh[k]]
            end = found.end()
    return b"".join([*out, line[end:]])


def _check(old: ObjText, new: ObjText, here: np.ndarray, wished: np.ndarray) -> None:
    """Raise InPlaceError unless the new text is the old mesh with the UVs wished (k,2) at the corners mapped."""
    same = np.array_equal(old.positions, new.positions, equal_nan=True) and np.array_equal(
        old.corner_vertex, new.corner_vertex
    )
    if not same or (new.corner_uv[here] < 0).any():
        raise InPlaceError("the new text does not read as the mesh it was written from")
    if not (new.uv[new.corner_uv[here]].astype(np.float32) == wished).all():
        raise InPlaceError("the new text does not read with the UVs it was written for")
    rest = old.corner_uv[~here]
    if not np.array_equal(rest >= 0, new.corner_uv[~here] >= 0) or not np.array_equal(
        old.uv[rest[rest >= 0]], new.uv[new.corner_uv[~here][rest >= 0]]
    ):
        raise InPlaceError("the new text does not keep the UVs of the faces that stay")
