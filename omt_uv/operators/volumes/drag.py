"""Show a flow while its handles are being dragged, quickly and roughly, and put everything back to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy

import numpy as np

from ...blender.mesh import target_layer, write_uv
from ...blender.volumes.bodies import read_positions, set_positions, write_positions
from ...pipelines.volumes.flow import FlowJob, flow_bodies, flow_uvs
from ...solver.errors import HandleError
from ...solver.flows.handles import FlowHandle
from ...solver.flows.options import FlowOptions
from ...solver.progress import drain

# Error of the flow that is shown, as a share of the diagonal: less than a pixel.
ROUGH = 1e-3


class FlowDrag:
    """Bodies that follow a shift of their handles.

    Raises
    ------
    Complaint, MeshError, UserError : where the operator would
    """

    def __init__(self, objects: Sequence[bpy.types.Object], job: FlowJob):
        self._objects, self._job = list(objects), job
        self._before = [read_positions(obj) for obj in self._objects]
        starts = [handle.start for _, handle in job.handles]
        self.middle = np.concatenate(starts).mean(axis=0)

    def to(self, shift: np.ndarray) -> bool:
        """Show the bodies with their handles shifted by (3,); whether there is such a flow."""
        if not np.any(shift):
            self.restore()
            return True
        handles = tuple((k, FlowHandle(h.start, h.start + shift, h.vertices, h.name)) for k, h in self._job.handles)
        options = replace(self._job.options, tolerance=ROUGH, mend=False)
        job = replace(self._job, handles=handles, options=options, frames=1)
        try:
            found = drain(flow_bodies(job))
        except HandleError:
            # On the way to other places there may be a flow again.
            return False
        for obj, world in zip(self._objects, found.frames[-1], strict=True):
            write_positions(obj, world)
        return True

    def restore(self) -> None:
        """Every vertex where it was, to the bit."""
        for obj, values in zip(self._objects, self._before, strict=True):
            set_positions(obj, values)


class UVDrag:
    """UVs of objects that follow one place which is dragged; `jobs` are triples of object, its Reading, and corners."""

    def __init__(self, jobs: Sequence[tuple], options: FlowOptions):
        self._jobs, self._options = list(jobs), replace(options, tolerance=ROUGH)
        self._layers = [target_layer(obj, "") for obj, *_ in self._jobs]

    def to(self, start: np.ndarray, end: np.ndarray) -> bool:
        """Show the UVs with `start` (2,) taken to `end` (2,); whether there is such a flow."""
        for (obj, reading, corners), layer in zip(self._jobs, self._layers, strict=True):
            uv = reading.uv[corners].astype(float)
            if np.any(start != end):
                try:
                    steps = flow_uvs(uv, reading.pinned[corners], start[None], end[None], self._options)
                    uv = drain(steps).uv
                except HandleError:
                    return False
            write_uv(obj, layer, corners, uv)
        return True

    def restore(self) -> None:
        """Every UV as it was, to the bit."""
        for (obj, reading, corners), layer in zip(self._jobs, self._layers, strict=True):
            write_uv(obj, layer, corners, reading.uv[corners])
