"""Signatures of many files as a few arrays, and a matrix of distances in blocks."""

from __future__ import annotations

import io
import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from ...errors import UserError
from ...solver.signatures.signature import CURVATURE, Signature
from ...solver.signatures.wasserstein import distance_of, prepared

# Rows and columns of a block of distances.
BLOCK = 24
# What numpy and zip raise about files that are none of theirs, or damaged, or longer than any memory.
UNREADABLE = (OSError, KeyError, ValueError, TypeError, EOFError, BadZipFile, zlib.error, RuntimeError, MemoryError)


class IndexFileError(UserError):
    """A file that holds no signatures."""


@dataclass(frozen=True)
class SignatureIndex(Sequence):
    """Signatures of files: names and marks, which change with the file, (n,); packed (n,k,4), or (n,k,3) with
    markers, single precision; floors (n,); coefficients (n,s,2) by which they are searched, single precision."""

    names: tuple[str, ...]
    marks: tuple[str, ...]
    packed: np.ndarray
    floors: np.ndarray
    coefficients: np.ndarray

    @property
    def marked(self) -> bool:
        """Whether its shapes were compared by markers."""
        return self.packed.shape[2] == 3

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, k):
        return unpacked(self.packed[k], self.floors[k])

    def bytes(self) -> bytes:
        """The index as a file."""
        data = io.BytesIO()
        arrays = {"packed": self.packed, "floors": self.floors, "coefficients": self.coefficients}
        # In bytes: numpy cannot read names of files that are no UTF-8 back as text.
        names = np.array([name.encode("utf-8", "surrogateescape") for name in self.names])
        np.savez(data, names=names, marks=np.array(self.marks), **arrays)
        return data.getvalue()


def packed(found: Signature) -> np.ndarray:
    """A signature as one small array (k,4), or (k,3) with markers, single precision."""
    return np.column_stack([found.points, found.curvature]).astype(np.float32)


def unpacked(array: np.ndarray, floor: float) -> Signature:
    """The signature of an array (k,4) or (k,3) and its floor."""
    array = array.astype(float)
    points = array[:, :-1]
    if points.shape[1] == 3:
        points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return Signature(points, array[:, -1], float(floor))


def index_of(rows: Mapping[str, tuple[str, Signature]], old: SignatureIndex | None = None) -> SignatureIndex:
    """The index of signatures with their marks, by name, in the order of names; those of an older one stay, but where
    a row takes their place.

    Raises
    ------
    IndexFileError : signatures of other numbers of points, or none
    """
    own = {
        name: (mark, packed(s), s.floor, prepared(s).coefficients.astype(np.float32))
        for name, (mark, s) in rows.items()
    }
    if old is not None:
        for name, *row in zip(old.names, old.marks, old.packed, old.floors, old.coefficients, strict=True):
            own.setdefault(name, tuple(row))
    counts = {len(row[1]) for row in own.values()}
    if len({row[1].shape[1] for row in own.values()}) > 1:
        raise IndexFileError("Signatures with markers and others do not go together. Make an index for each.")
    if len(counts) != 1:
        raise IndexFileError(f"Signatures have {sorted(counts) or 'no'} points. Make all of an index with one number.")
    names = sorted(own)
    marks, arrays, floors, coefficients = zip(*(own[name] for name in names), strict=True)
    return SignatureIndex(
        tuple(names), tuple(map(str, marks)), np.stack(arrays), np.array(floors, float), np.stack(coefficients)
    )


def chosen(index: SignatureIndex, names: Sequence[str]) -> SignatureIndex:
    """Of an index, some names."""
    rows = [k for k, name in enumerate(index.names) if name in set(names)]
    return SignatureIndex(
        tuple(index.names[k] for k in rows),
        tuple(index.marks[k] for k in rows),
        index.packed[rows],
        index.floors[rows],
        index.coefficients[rows],
    )


def read_index(path: Path) -> SignatureIndex:
    """Read an index. Raises IndexFileError."""
    if not os.path.isfile(path):
        raise IndexFileError(f"{path}: there is no such index. Make one by the command library.")
    try:
        with open(path, "rb"):
            pass
    except OSError as error:
        raise IndexFileError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        with np.load(path, allow_pickle=False) as data:
            parts = [data[name] for name in ("packed", "floors", "coefficients")]
            names = tuple(map(_text, data["names"].tolist()))
            found = SignatureIndex(names, tuple(data["marks"].tolist()), *parts)
    except UNREADABLE as error:
        raise IndexFileError(f"{path}: is no index of signatures. Make one by the command library.") from error
    if not _is_whole(found):
        raise IndexFileError(f"{path}: is no whole index of signatures. Make one by the command library.")
    return found


def _text(name: bytes | str) -> str:
    return name.decode("utf-8", "surrogateescape") if isinstance(name, bytes) else name


def _is_whole(index: SignatureIndex) -> bool:
    """Whether the arrays of an index belong together, and hold numbers."""
    arrays = (index.packed, index.floors, index.coefficients)
    sizes = {len(index.names), len(index.marks), *(len(x) if x.ndim else -1 for x in arrays)}
    dimensions = tuple(x.ndim for x in arrays) == (3, 1, 3)
    numbers = all(x.dtype.kind == "f" and np.isfinite(x).all() for x in arrays)
    return (
        len(sizes) == 1
        and dimensions
        and numbers
        and index.packed.shape[2] in (3, 4)
        and index.coefficients.shape[2] == 2
        and all(isinstance(text, str) for text in (*index.names, *index.marks))
    )


def blocks_of(count: int) -> list[tuple[int, int, int, int]]:
    """Rows from, to and columns from, to of all blocks on and above the diagonal of a matrix."""
    first = range(0, count, BLOCK)
    return [(i, min(i + BLOCK, count), j, min(j + BLOCK, count)) for i in first for j in first if j >= i]


def block_distances(
    index: SignatureIndex, block: tuple[int, int, int, int], curvature: float = CURVATURE
) -> np.ndarray:
    """Distances (2,r,c), with the floor taken off and raw, of a block; 0 on and below the diagonal."""
    first, last, left, right = block
    rows = [prepared(index[k]) for k in range(first, last)]
    columns = rows if first == left else [prepared(index[k]) for k in range(left, right)]
    found = np.zeros((2, last - first, right - left))
    for i, a in enumerate(rows):
        for j, b in enumerate(columns):
            if left + j > first + i:
                distance = distance_of(a, b, curvature)
                found[:, i, j] = distance.distance, distance.raw
    return found
