"""Let UV islands of several objects follow a balance and their pins while these are being dragged."""

from __future__ import annotations

import time
from dataclasses import dataclass

import bpy

import numpy as np

from ..blender import mesh as blender_mesh
from ..pipelines.layout import Refusal
from ..pipelines.refine import found_islands
from ..solver.editing.live_map import LiveMap
from ..solver.errors import MeshError
from ..solver.parameterization.chart_indices import located
from .run import Disturbed

# Seconds of work between two looks at the mouse.
SLICE = 0.1


@dataclass
class _LiveIsland:
    """An island of object number `owner`: corners (k,) to write, their vertices (k,), and corners of its pins (p,)."""

    owner: int
    corners: np.ndarray
    vertices: np.ndarray
    pin_corners: np.ndarray
    live_map: LiveMap


class Session:
    """Islands of the chosen faces, from the moment on when it is made.

    Raises
    ------
    Refusal : with the index of the object and the MeshError that says why an island cannot follow
    """

    def __init__(self, context: bpy.types.Context, pairs: list):
        # Until the artist ends it.
        self.is_on = True
        self._mode = context.mode
        self.objects = [obj for obj, _ in pairs]
        self._names = [obj.name for obj in self.objects]
        self._layers = [obj.data.uv_layers.active.name if obj.data.uv_layers else "" for obj in self.objects]
        self._starts = [reading.surface.face_start for _, reading in pairs]
        self._sizes = [self._size(obj) for obj in self.objects]
        self._before = [reading.uv for _, reading in pairs]
        self._lost = False
        self._islands = [self._live(*found) for found in _islands(pairs)]
        self._handlers = [bpy.app.handlers.undo_post, bpy.app.handlers.redo_post, bpy.app.handlers.load_pre]
        for kind in self._handlers:
            kind.append(self._on_exchange)

    def _live(self, owner: int, island, pins) -> _LiveIsland:
        chart = island.chart
        corners, first = np.unique(chart.corners.ravel(), return_index=True)
        vertices = chart.triangles.ravel()[first]
        pinned, at = (np.zeros(0, int), None) if pins is None else (pins.vertices, (pins.vertices, pins.places))
        # One corner stands for all that a pinned vertex has; pins are in the order of the vertices.
        pin_corners = np.array([corners[vertices == v][0] for v in np.sort(pinned)], int)
        if at is not None:
            order = np.argsort(at[0])
            at = (at[0][order], at[1][order])
        free = ~np.isin(vertices, pinned)
        try:
            live_map = LiveMap(chart.vertices, chart.triangles, island.uv, at, chart.faces)
        except MeshError as error:
            raise Refusal(owner, located(error, chart)) from error
        return _LiveIsland(owner, corners[free], vertices[free], pin_corners, live_map)

    def follow(self, balance: float, seconds: float = SLICE) -> bool:
        """Work for about so long, and write what has moved; whether anything has.

        Raises
        ------
        Disturbed : the objects are no longer what they were
        """
        self._check()
        end, moved = time.monotonic() + seconds, False
        for island in self._islands:
            places = self._places(island)
            before = island.live_map.uv
            uv = island.live_map.follow(balance, places, max(end - time.monotonic(), 0.0))
            if not np.array_equal(before, uv):
                moved = True
                self._write(island, uv)
            if time.monotonic() > end:
                break
        # Those that are not at rest come first next time.
        self._islands.sort(key=lambda island: island.live_map.at_rest)
        return moved

    def _places(self, island: _LiveIsland) -> np.ndarray | None:
        """Where the pins are by now; only Edit Mode lets them move."""
        obj = self.objects[island.owner]
        if not len(island.pin_corners) or obj.mode != "EDIT":
            return None
        return blender_mesh.corner_uvs(obj, self._layers[island.owner], island.pin_corners, self._starts[island.owner])

    def _write(self, island: _LiveIsland, uv: np.ndarray) -> None:
        obj = self.objects[island.owner]
        blender_mesh.write_uv(obj, self._layers[island.owner], island.corners, uv[island.vertices])

    def restore(self) -> None:
        """Every corner as it was at the beginning, to the bit; nothing if the objects are gone."""
        try:
            self._check()
        except Disturbed:
            return
        for obj, layer, uv in zip(self.objects, self._layers, self._before, strict=True):
            blender_mesh.write_uv(obj, layer, np.arange(len(uv)), uv)

    def close(self) -> None:
        for kind in self._handlers:
            if self._on_exchange in kind:
                kind.remove(self._on_exchange)

    def _check(self) -> None:
        if self._lost:
            raise Disturbed("Something was undone")
        try:
            if bpy.context.mode != self._mode:
                raise Disturbed("The mode was changed")
            for obj, name, layer, size in zip(self.objects, self._names, self._layers, self._sizes, strict=True):
                if bpy.data.objects.get(name) != obj or self._size(obj) != size or layer not in obj.data.uv_layers:
                    raise Disturbed("The mesh was changed")
        except ReferenceError as error:
            raise Disturbed("An object was deleted") from error

    @staticmethod
    def _size(obj: bpy.types.Object) -> tuple[int, ...]:
        if obj.mode != "EDIT":
            return len(obj.data.vertices), len(obj.data.loops)
        import bmesh

        edit = bmesh.from_edit_mesh(obj.data)
        return len(edit.verts), len(edit.edges), len(edit.faces)

    def _on_exchange(self, *_) -> None:
        self._lost = True


def _islands(pairs: list) -> list:
    found, _ = found_islands([(reading.surface, reading.faces, reading.all_pins) for _, reading in pairs])
    return found


__all__ = ["SLICE", "Refusal", "Session"]
