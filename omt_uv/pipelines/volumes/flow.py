"""Move bodies along one flow, and UVs along another: the one path of object.omt_flow, uv.omt_flow and the command
flow."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...solver.flows.domain import FlowDomain
from ...solver.flows.flow_map import flow
from ...solver.flows.handles import FlowHandle
from ...solver.flows.options import FlowOptions
from ...solver.progress import Steps


@dataclass(frozen=True)
class FlowBody:
    """A body in space: positions (n,3), triangles (m,3) of them, vertices that stay, (n,) bool or None, and the
    polygon (m,) of every triangle, None where these are the polygons."""

    name: str
    positions: np.ndarray
    triangles: np.ndarray
    stays: np.ndarray | None = None
    polygons: np.ndarray | None = None

    def polygons_of(self, triangles: np.ndarray) -> np.ndarray:
        """Polygons (k,), each once, of triangles (t,)."""
        return np.unique(triangles if self.polygons is None else self.polygons[triangles])


@dataclass(frozen=True)
class FlowJob:
    """Bodies that flow together, pairs of the body's number and a handle on its vertices (-1: on none), and walls."""

    bodies: tuple[FlowBody, ...]
    handles: tuple[tuple[int, FlowHandle], ...]
    options: FlowOptions = field(default_factory=FlowOptions)
    domain: FlowDomain | None = None
    frames: int = 1


@dataclass(frozen=True)
class FlowResult:
    """Positions (n,3) of every body at every frame, `frames[k][body]`, and figures.

    volume: greatest relative change of an enclosed volume, 0 where nothing is closed; drift: the same by the flow
    alone;
    missed: greatest distance of a handle's point from its end, over the diagonal, before it was set there; surge:
    greatest speed of what flows over that of the handles; intersecting: pairs of faces that newly intersect; crossing:
    the polygons (k,) of those, of every body
    """

    frames: tuple[tuple[np.ndarray, ...], ...]
    volume: float
    drift: float
    missed: float
    surge: float
    intersecting: int
    crossing: tuple[np.ndarray, ...]
    steps: int
    warnings: tuple[str, ...]

    def report(self) -> dict[str, float | list[list[int]]]:
        """Figures for a report."""
        return {
            "volume_change": self.volume,
            "drift": self.drift,
            "missed": self.missed,
            "surge": self.surge,
            "new_intersections": self.intersecting,
            "new_intersections_faces": [faces.tolist() for faces in self.crossing],
            "steps": self.steps,
        }


def flow_bodies(job: FlowJob) -> Steps[FlowResult]:
    """Move all bodies of a job in one field.

    Raises
    ------
    MeshError : those of `solver.flows.flow`; elements are vertices of all bodies in their order
    """
    sizes = np.array([len(body.positions) for body in job.bodies])
    first = np.concatenate([[0], np.cumsum(sizes)])
    points = np.concatenate([body.positions for body in job.bodies])
    triangles = np.concatenate([body.triangles + first[k] for k, body in enumerate(job.bodies)])
    handles = [_placed(handle, first[owner] if owner >= 0 else -1) for owner, handle in job.handles]
    for k, body in enumerate(job.bodies):
        rows = np.zeros(0, np.int64) if body.stays is None else np.flatnonzero(body.stays)
        if len(rows):
            handles.append(FlowHandle(body.positions[rows], body.positions[rows], first[k] + rows, "what stays"))
    steps = flow(points, tuple(handles), job.options, triangles, job.domain, job.frames)
    found = yield from steps
    return FlowResult(
        frames=tuple(tuple(np.split(at, first[1:-1])) for at in found.frames),
        volume=float(np.abs(found.volumes).max(initial=0.0)),
        drift=float(np.abs(found.drift).max(initial=0.0)),
        missed=found.missed,
        surge=found.surge,
        intersecting=len(found.intersecting),
        crossing=_crossing(job.bodies, np.unique(found.intersecting)),
        steps=found.steps,
        warnings=found.warnings,
    )


def _crossing(bodies: tuple[FlowBody, ...], triangles: np.ndarray) -> tuple[np.ndarray, ...]:
    """Polygons of every body that triangles (t,), counted among those of all bodies, are of."""
    first = np.cumsum([0, *(len(body.triangles) for body in bodies)])
    owner = np.searchsorted(first, triangles, side="right") - 1
    return tuple(body.polygons_of(triangles[owner == k] - first[k]) for k, body in enumerate(bodies))


def _placed(handle: FlowHandle, first: int) -> FlowHandle:
    """A handle with its vertices counted among those of all bodies; of none where `first` is negative."""
    vertices = None if first < 0 or handle.vertices is None else handle.vertices + first
    return FlowHandle(handle.start, handle.end, vertices, handle.name)


@dataclass(frozen=True)
class UVFlow:
    """UVs (c,2) after a flow, and its warnings."""

    uv: np.ndarray
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class UVPlaces:
    """Places (p,2) where UVs are, the place (c,) of each, and places (q,) with a pin: corners at one place stay
    together."""

    places: np.ndarray
    place: np.ndarray
    pinned: np.ndarray

    @staticmethod
    def of(uv: np.ndarray, pinned: np.ndarray) -> UVPlaces:
        """The places of UVs (c,2), of which `pinned` (c,) bool stay."""
        places, inverse = np.unique(uv, axis=0, return_inverse=True)
        inverse = inverse.ravel()
        return UVPlaces(places, inverse, np.unique(inverse[pinned]))


def flow_uvs(at: UVPlaces, start: np.ndarray, end: np.ndarray, options: FlowOptions) -> Steps[UVFlow]:
    """Move UVs so that the places `start` (k,2) go to `end` (k,2) and pins stay; areas stay, too.

    Raises
    ------
    MeshError : those of `solver.flows.flow`
    """
    handles = [FlowHandle(np.asarray(start, float), np.asarray(end, float), name="what is pushed")]
    if len(at.pinned):
        pins = at.places[at.pinned]
        handles.append(FlowHandle(pins, pins, at.pinned, "pins"))
    found = yield from flow(at.places, tuple(handles), options)
    return UVFlow(found.positions[at.place], found.warnings)
