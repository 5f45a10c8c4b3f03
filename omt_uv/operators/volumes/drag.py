"""Show a flow while its handles are being dragged, quickly and roughly, and put everything back to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy

import numpy as np

from ...blender.mesh import target_layer, write_uv
from ...blender.volumes.bodies import read_positions, set_positions, write_positions
from ...pipelines.volumes.flow import FlowJob, UVPlaces, flow_bodies, flow_uvs
from ...solver.errors import HandleError
from ...solver.flows.handles import FlowHandle
from ...solver.flows.options import FlowOptions
from ...solver.progress import drain

# Error of the flow that is shown, as a share of the diagonal: less than a pixel.
ROUGH = 1e-3
# Samples of what is dragged: the rest of it is set where it belongs.
SPACING = 0.35
MOST_SAMPLES = 32


class FlowDrag:
    """Bodies that follow a shift of their handles.

    Raises
    ------
    Complaint, MeshError, UserError : where the operator would
    """

    def __init__(self, objects: Sequence[bpy.types.Object], job: FlowJob):
        self._objects = list(objects)
        # Without faces, which only what is kept is made exact for.
        bodies = tuple(replace(body, triangles=np.zeros((0, 3), np.int64)) for body in job.bodies)
        self._job = replace(job, bodies=bodies)
        self._before = [read_positions(obj) for obj in self._objects]
        self._shown = [body.positions for body in bodies]
        starts = [handle.start for _, handle in job.handles]
        self.middle = np.concatenate(starts).mean(axis=0)

    def to(self, shift: np.ndarray) -> bool:
        """Show the bodies with their handles shifted by (3,); whether there is such a flow."""
        if not np.any(shift):
            self.restore()
            return True
        handles = tuple((k, FlowHandle(h.start, h.start + shift, h.vertices, h.name)) for k, h in self._job.handles)
        options = replace(self._job.options, tolerance=ROUGH, spacing=SPACING, most_samples=MOST_SAMPLES, mend=False)
        job = replace(self._job, handles=handles, options=options, frames=1)
        try:
            found = drain(flow_bodies(job))
        except HandleError:
            # On the way to other places there may be a flow again.
            return False
        for k, (obj, world) in enumerate(zip(self._objects, found.frames[-1], strict=True)):
            # In Edit Mode every vertex that is written costs as much as to let it flow.
            write_positions(obj, world, (world != self._shown[k]).any(axis=1))
            self._shown[k] = world
        return True

    def restore(self) -> None:
        """Every vertex where it was, to the bit."""
        for obj, values in zip(self._objects, self._before, strict=True):
            set_positions(obj, values)
        self._shown = [body.positions for body in self._job.bodies]


class UVDrag:
    """UVs of objects that follow one place which is dragged; `jobs` are triples of object, its Reading, and corners."""

    def __init__(self, jobs: Sequence[tuple], options: FlowOptions):
        self._jobs, self._options = list(jobs), replace(options, tolerance=ROUGH)
        self._layers = [target_layer(obj, "") for obj, *_ in self._jobs]
        self._at = [UVPlaces.of(r.uv[c].astype(float), r.pinned[c]) for _, r, c in self._jobs]

    def to(self, start: np.ndarray, end: np.ndarray) -> bool:
        """Show the UVs with `start` (2,) taken to `end` (2,); whether there is such a flow."""
        for (obj, reading, corners), layer, at in zip(self._jobs, self._layers, self._at, strict=True):
            uv = reading.uv[corners].astype(float)
            if np.any(start != end):
                try:
                    uv = drain(flow_uvs(at, start[None], end[None], self._options)).uv
                except HandleError:
                    return False
            write_uv(obj, layer, corners, uv)
        return True

    def restore(self) -> None:
        """Every UV as it was, to the bit."""
        for (obj, reading, corners), layer in zip(self._jobs, self._layers, strict=True):
            write_uv(obj, layer, corners, reading.uv[corners])
