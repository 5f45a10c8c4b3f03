"""Read handles of a flow from a JSON file: what moves, and where to.

    {"handles": [{"group": "hand", "move": [0, 0, 1], "rotate": [0, 45, 0]},
                 {"vertices": [5, 9], "object": "Head", "move": [0.1, 0, 0]},
                 {"from": [[0, 0, 1]], "to": [[0, 0, 2]]}],
     "keep": ["feet"]}

Lengths are those of the file, turns are in degrees about x, y, z in this order, about the middle of the points.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import UserError
from ...solver.flows.handles import FlowHandle
from .flow import FlowBody

KNOWN = {"group", "vertices", "object", "from", "to", "move", "rotate"}


class HandleFileError(UserError):
    """A file of handles that says nothing a flow could do."""


@dataclass(frozen=True)
class HandleFile:
    """What such a file says: its handles as they stand there, and names of vertex groups that stay."""

    path: Path
    handles: tuple[dict, ...]
    keep: tuple[str, ...]


def read_handle_file(path: Path) -> HandleFile:
    """The handles of a file.

    Raises
    ------
    HandleFileError : it cannot be read, or is of another form
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise HandleFileError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise HandleFileError(f"{path}: is no JSON ({error})") from error
    handles = data.get("handles") if isinstance(data, dict) else data
    if not isinstance(handles, list) or not handles or not all(isinstance(h, dict) for h in handles):
        raise HandleFileError(
            f"{path}: has no list of handles. Give {{'handles': [{{'group': NAME, 'move': [x, y, z]}}]}}"
        )
    for k, handle in enumerate(handles):
        strange = sorted(handle.keys() - KNOWN)
        if strange:
            raise HandleFileError(f"{path}: handle {k} has {strange[0]!r}. Known are {', '.join(sorted(KNOWN))}.")
    return HandleFile(path, tuple(handles), _kept(path, data.get("keep", []) if isinstance(data, dict) else []))


def _kept(path: Path, keep) -> tuple[str, ...]:
    """The name of the group that stays, if there is one."""
    names = [keep] if isinstance(keep, str) else keep
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise HandleFileError(f"{path}: 'keep' is not the name of a vertex group. Give one, as text.")
    if len(names) > 1:
        raise HandleFileError(f"{path}: 'keep' names {len(names)} vertex groups. Give one that has all that stays.")
    return tuple(names)


def handles_of(
    file: HandleFile, bodies: Sequence[FlowBody], members: Callable[[int, str], np.ndarray | None]
) -> tuple[tuple[int, FlowHandle], ...]:
    """Pairs of a body's number and a handle; `members(body, group)` are the vertices (k,) of a group, None without it.

    Raises
    ------
    HandleFileError : a handle names what is not there
    """
    found: list[tuple[int, FlowHandle]] = []
    for k, entry in enumerate(file.handles):
        where = f"{file.path}: handle {k}"
        if "from" in entry:
            start, end = (_points(entry, key, where) for key in ("from", "to"))
            found.append((-1, FlowHandle(start, end, None, f"number {k}")))
            continue
        mine = [b for b, body in enumerate(bodies) if entry.get("object") in (None, body.name)]
        before = len(found)
        for b in mine:
            rows = _vertices(entry, bodies[b], lambda name, b=b: members(b, name), where)
            if rows is not None and len(rows):
                start = bodies[b].positions[rows]
                found.append((b, FlowHandle(start, _moved(start, entry, where), rows, f"number {k}")))
        if len(found) == before:
            raise HandleFileError(f"{where} has no vertices. Name a vertex group that there is, or vertices.")
    return tuple(found)


def _vertices(entry: dict, body: FlowBody, members, where: str) -> np.ndarray | None:
    """The vertices (k,) of a body that a handle speaks of; None where it has none of these."""
    if "group" in entry:
        return members(str(entry["group"]))
    try:
        given = np.asarray(entry.get("vertices", []))
        if given.size and given.dtype.kind != "i":
            raise TypeError("what is none cannot be cut to a whole number")
        rows = np.unique(given.astype(np.int64).ravel())
    except (TypeError, ValueError) as error:
        raise HandleFileError(f"{where}: vertices are no list of numbers") from error
    if len(rows) and (rows[0] < 0 or rows[-1] >= len(body.positions)):
        raise HandleFileError(f"{where}: {body.name} has vertices 0 to {len(body.positions) - 1}, not {rows[-1]}")
    return rows


def _points(entry: dict, key: str, where: str) -> np.ndarray:
    """Points (k,3) of an entry."""
    try:
        points = np.asarray(entry.get(key), float)
    except (TypeError, ValueError, OverflowError) as error:
        raise HandleFileError(f"{where}: {key!r} is no list of points") from error
    if points.shape == (3,):
        points = points[None]
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise HandleFileError(f"{where}: {key!r} is no list of points [x, y, z]")
    return points


def _moved(start: np.ndarray, entry: dict, where: str) -> np.ndarray:
    """Where points (k,3) go: turned about their middle, then shifted."""
    shift, turn = (_points({key: entry.get(key, [0, 0, 0])}, key, where)[0] for key in ("move", "rotate"))
    middle = start.mean(axis=0)
    return (start - middle) @ euler_matrix(np.radians(turn)).T + middle + shift


def euler_matrix(angles: np.ndarray) -> np.ndarray:
    """The rotation (3,3) about x, then y, then z by angles (3,) in radians."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return z @ y @ x
