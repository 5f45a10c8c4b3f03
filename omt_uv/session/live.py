"""Let UV islands of several objects follow a balance and their pins while these are being dragged."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial

import bpy

import numpy as np

from ..blender import mesh as blender_mesh
from ..pipelines.layout import Refusal, pack_islands
from ..pipelines.refine import found_islands
from ..pipelines.subdivision import target_of
from ..settings import Settings
from ..solver.editing.live_map import LiveMap
from ..solver.errors import MeshError
from ..solver.mesh.charts import Chart
from ..solver.parameterization.chart_indices import chart_target, located
from ..solver.progress import drain
from .run import Disturbed

# Seconds of work between two looks at the mouse.
SLICE = 0.1
# Corners of an island that are looked at, to see whether somebody else wrote its UVs.
SAMPLES = 16
# A UV that is off by more than this share of the extent was moved.
MOVED = 1e-5


@dataclass
class _LiveIsland:
    """An island of object number `owner`: corners (k,) to write, their vertices (k,), and corners of its pins (p,).

    density : (m,) of the area that its triangles ask for, if that is not their own
    targets : where soft pins were dragged to, (p,2); written : UVs (k,2) as this session wrote them last
    pulled : whether a soft pin is not where it was written
    """

    owner: int
    chart: Chart
    corners: np.ndarray
    vertices: np.ndarray
    pin_corners: np.ndarray
    live_map: LiveMap
    density: np.ndarray | None = None
    targets: np.ndarray | None = None
    written: np.ndarray | None = None
    pulled: bool = False


class Session:
    """Islands of the chosen faces, from the moment on when it is made.

    soft : pins give way to the shape of their island, which follows them as a whole
    subdivided : polygons ask for their areas on the surface that their object's modifier makes of them

    Raises
    ------
    Refusal : with the index of the object and the MeshError that says why an island cannot follow
    """

    def __init__(self, context: bpy.types.Context, pairs: list, soft: bool = False, subdivided: bool = False):
        # Until the artist ends it, with its UVs as they are or as they were.
        self.is_on, self.goes_back = True, False
        self.soft = soft
        self._mode = context.mode
        self.objects = [obj for obj, _ in pairs]
        self._names = [obj.name for obj in self.objects]
        self._layers = [obj.data.uv_layers.active.name if obj.data.uv_layers else "" for obj in self.objects]
        self._starts = [reading.surface.face_start for _, reading in pairs]
        self._sizes = [self._size(obj) for obj in self.objects]
        self._before = [reading.uv for _, reading in pairs]
        self._lost = False
        self._targets = [target_of(reading) if subdivided else None for _, reading in pairs]
        self._surfaces = [reading.surface for _, reading in pairs]
        self._islands = [self._live(*found) for found in _islands(pairs)]
        self._whole = all(self._covers(k, reading) for k, (_, reading) in enumerate(pairs))
        # Blender's G knows corners by their addresses.
        self._held = [blender_mesh.hold(obj) for obj in self.objects]
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
        free = np.full(len(vertices), True) if self.soft else ~np.isin(vertices, pinned)
        target = chart_target(self._targets[owner], self._surfaces[owner], chart)
        density = None if target is None else target.density
        try:
            live_map = LiveMap(chart.vertices, chart.triangles, island.uv, at, chart.faces, self.soft, density)
        except MeshError as error:
            raise Refusal(owner, located(error, chart)) from error
        return _LiveIsland(owner, chart, corners[free], vertices[free], pin_corners, live_map, density)

    def _covers(self, owner: int, reading) -> bool:
        """Whether every face of an object is part of an island that follows."""
        mine = [np.zeros(0, int), *(i.chart.corners.ravel() for i in self._islands if i.owner == owner)]
        return len(np.unique(np.concatenate(mine))) == len(np.unique(reading.surface.triangles))

    def follow(self, balance: float, seconds: float = SLICE) -> bool:
        """Work for about so long, and write what has moved; whether anything has.

        Raises
        ------
        Disturbed : the objects are no longer what they were
        """
        self._check()
        end, moved = time.monotonic() + seconds, False
        for island in self._islands:
            self._check_uvs(island)
            places = self._places(island)
            before = island.live_map.uv
            uv = island.live_map.follow(balance, places, max(end - time.monotonic(), 0.0))
            # A soft pin that is put to the same place once more, as at the end of a drag, gives way once more.
            if island.pulled or not np.array_equal(before, uv):
                moved = True
                self._write(island, uv)
            if time.monotonic() > end:
                break
        # Those that are not at rest come first next time.
        self._islands.sort(key=lambda island: island.live_map.at_rest)
        return moved

    def _places(self, island: _LiveIsland) -> np.ndarray | None:
        """Where the pins are by now, or are asked for if they are soft; only Edit Mode lets them move."""
        obj = self.objects[island.owner]
        if not len(island.pin_corners) or obj.mode != "EDIT":
            return None
        now = blender_mesh.corner_uvs(obj, self._layers[island.owner], island.pin_corners, self._starts[island.owner])
        if not self.soft:
            return now
        place = np.searchsorted(island.corners, island.pin_corners)
        if island.targets is None or island.written is None:
            island.targets = now
        else:
            # Where a pin is not as it was left, the artist has moved it.
            moved = np.abs(now - island.written[place]).max(axis=1) > MOVED * np.ptp(island.written)
            island.targets, island.pulled = np.where(moved[:, None], now, island.targets), bool(moved.any())
        return island.targets

    def _write(self, island: _LiveIsland, uv: np.ndarray) -> None:
        obj = self.objects[island.owner]
        island.written = uv[island.vertices].astype(np.float32)
        blender_mesh.write_uv(obj, self._layers[island.owner], island.corners, island.written)

    def _check_uvs(self, island: _LiveIsland) -> None:
        """Raise Disturbed where somebody else wrote UVs of the island since; a few corners tell."""
        if island.written is None or not len(island.corners):
            return
        some = np.linspace(0, len(island.corners) - 1, SAMPLES).astype(int)
        if self.soft:
            some = some[~np.isin(island.corners[some], island.pin_corners)]
        obj, layer = self.objects[island.owner], self._layers[island.owner]
        now = blender_mesh.uvs_at(obj, layer, island.corners[some], self._starts[island.owner])
        if (np.abs(now - island.written[some]) > MOVED * np.ptp(island.written)).any():
            raise Disturbed("The UVs were changed")

    def figures(self):
        """Distortion of the islands as they are, all together."""
        from ..solver.maps.distortion import distortion

        positions, triangles, uv, polygons, density = [], [], [], [], []
        vertices = faces = 0
        for island in self._islands:
            chart = island.chart
            positions.append(chart.vertices)
            triangles.append(chart.triangles + vertices)
            uv.append(island.live_map.uv[chart.triangles])
            polygons.append(chart.faces + faces)
            density.append(np.ones(len(chart.triangles)) if island.density is None else island.density)
            vertices += len(chart.vertices)
            faces += int(chart.faces.max()) + 1
        V, F, places, of, asked = map(np.concatenate, (positions, triangles, uv, polygons, density))
        return distortion(V, F, places, overlap=False, density=asked, polygons=of)

    def pack(self, settings: Settings) -> bool:
        """Pack the islands into the tile again, if they are all that the objects have, and none is pinned."""
        if not self._whole or any(len(island.pin_corners) for island in self._islands):
            return False
        uvs = [island.live_map.uv for island in self._islands]
        packed = drain(pack_islands(uvs, [island.chart.triangles for island in self._islands], settings))
        for island, uv in zip(self._islands, packed.islands, strict=True):
            self._write(island, uv)
        return True

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
        if (wait := _let_go(self._held)) is not None:
            bpy.app.timers.register(partial(_let_go, self._held), first_interval=wait)

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


def _let_go(held: list) -> float | None:
    """Let meshes go that were held, once nothing of theirs is dragged any more; seconds until the next look."""
    windows = bpy.context.window_manager.windows
    modal = [each for window in windows for each in getattr(window, "modal_operators", ())]
    if any(each.bl_idname.startswith("TRANSFORM_OT_") for each in modal):
        return SLICE
    held.clear()
    return None


def _islands(pairs: list) -> list:
    found, _ = found_islands([(reading.surface, reading.faces, reading.all_pins) for _, reading in pairs])
    return found


__all__ = ["SLICE", "Refusal", "Session"]
