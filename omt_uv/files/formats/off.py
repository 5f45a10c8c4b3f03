"""Read the Object File Format: OFF, counts, vertices, faces as vertex counts and indices; colours are left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def read_off(path: Path) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Positions (n,3) and faces of an OFF file.

    Raises
    ------
    ValueError : it is none, ends too early, or has a face that is none
    """
    lines = [line.split("#")[0].split() for line in path.read_text(errors="replace").splitlines()]
    lines = [line for line in lines if line]
    if not lines or lines[0][0] not in {"OFF", "COFF"}:
        raise ValueError("the first word is not OFF")
    lines[0] = lines[0][1:]
    lines = [line for line in lines if line]
    if not lines or len(lines[0]) < 2:
        raise ValueError("there are no counts of vertices and faces")
    n, f = int(lines[0][0]), int(lines[0][1])
    if n < 0 or f < 0 or len(lines) < 1 + n + f:
        raise ValueError(f"it declares {n} vertices and {f} faces and has {len(lines) - 1} lines for them")
    rows = lines[1 : 1 + n]
    short = next((k for k, row in enumerate(rows) if len(row) < 3), None)
    if short is not None:
        raise ValueError(f"vertex {short} has fewer than three coordinates")
    positions = np.array([[float(word) for word in row[:3]] for row in rows], float).reshape(-1, 3)
    return positions, [_face(k, line, n) for k, line in enumerate(lines[1 + n : 1 + n + f])]


def _face(k: int, line: list[str], n: int) -> tuple[int, ...]:
    """The vertices of a face."""
    sides = int(line[0])
    corners = tuple(map(int, line[1 : 1 + max(sides, 0)]))
    if sides < 3 or len(corners) < sides:
        raise ValueError(f"face {k} has fewer than three vertices, or fewer than it says")
    if not 0 <= min(corners) <= max(corners) < n:
        raise ValueError(f"face {k} has a vertex that does not exist")
    return corners
