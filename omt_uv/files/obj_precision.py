"""Restore full precision in OBJ files: Blender writes six decimals, which blurs small meshes and dense UVs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

import numpy as np


def restore_precision(path: Path, objects: Sequence[bpy.types.Object]) -> None:
    """Rewrite the v and vt lines of an OBJ file that Blender exported from these objects.

    Lines are recognised by the object they follow and replaced where they agree with the mesh to the decimals
    written; all others stay.
    """
    lines = path.read_text().split("\n")
    kinds = [line.split(" ", 1)[0] for line in lines]
    by_name = {obj.name.replace(" ", "_"): obj for obj in objects}
    uv_lines = [i for i, kind in enumerate(kinds) if kind == "vt"]
    begins = [i for i, kind in enumerate(kinds) if kind == "o"]
    for begin, end in zip(begins, [*begins[1:], len(lines)], strict=True):
        obj = by_name.get(lines[begin][2:])
        if obj is None:
            continue
        of_kind = {kind: [i for i in range(begin, end) if kinds[i] == kind] for kind in ("v", "f")}
        _replace(lines, of_kind["v"], _world_positions(obj))
        if uv_lines and obj.data.uv_layers.active:
            _replace_uv(lines, of_kind["f"], uv_lines, obj.data)
    path.write_text("\n".join(lines))


def _world_positions(obj: bpy.types.Object) -> np.ndarray:
    """Positions (n,3) float32 of the vertices in the world."""
    co = np.zeros(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", co)
    matrix = np.array(obj.matrix_world, np.float32)
    if (matrix == np.eye(4, dtype=np.float32)).all():
        return co.reshape(-1, 3)
    return co.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def _replace_uv(lines: list[str], faces: list[int], uv_lines: list[int], mesh: bpy.types.Mesh) -> None:
    """Replace the vt lines that the corners of these faces name."""
    # A corner reads v/vt or v/vt/vn.
    corners = [word.split("/")[1] for i in faces for word in lines[i].split()[1:] if "/" in word]
    if len(corners) != len(mesh.loops) or not all(corners):
        return
    uv = np.zeros(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    index, first = np.unique(np.array(corners, dtype=np.int64) - 1, return_index=True)
    _replace(lines, [uv_lines[i] for i in index], uv.reshape(-1, 2)[first])


def _replace(lines: list[str], where: list[int], values: np.ndarray) -> None:
    """Replace the numbers of lines by rows of values (k,d), where they agree to the decimals written."""
    if len(where) != len(values):
        return
    for i, row in zip(where, values, strict=True):
        kind, *words = lines[i].split()
        if all(abs(float(w) - x) <= 1e-6 + 1e-6 * abs(x) for w, x in zip(words, row.tolist(), strict=False)):
            # Nine digits tell any two single precision numbers apart.
            lines[i] = " ".join([kind, *(f"{x:.9g}" for x in row.tolist()), *words[len(row) :]])
