"""Carry points along a flow without divergence that takes handles where they shall go (Hu, Zou, Hua 2014, section 5).

The paper fits one steady field to samples of all paths at all times, which cannot be where two paths cross. Here every
moment has a field of its own, of as many unknowns as there are handles then.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import EmptyMeshError, HandleError, NonFiniteError, plural
from ..progress import Progress, Steps, part_of
from .creases import MOST_HELD, PIECES, march, regions_around
from .domain import FlowDomain
from .handles import FlowHandle, check_handles, farthest_points, joined, sampled_handles
from .integration import BLOCK, FlowStep, carried, planned_steps
from .kernel import FlowField, conditions, interpolated_field
from .options import STRAIGHT, FlowOptions
from .passing import Passing, closest_passing, greatest_surge
from .paths import handle_paths
from .shape import FlowShape, SoundFrame

# Times that what is looked at on the way is widened by what that brings into it.
REGIONS = 3
# Points on which steps are planned, besides those next to the handles.
PROBES = 300
# Samples of walls are this share of the radius apart: closer, and they make the equations ill-conditioned.
WALL_SPACING = 0.35
# What moves by less than this share of the tolerance stays: the field falls like exp(-(distance / radius)^2).
UNMOVED = 1e-3
# Where the time goes, roughly, as start and width: points are carried, then bodies get their volumes back.
CARRYING = (0.0, 0.5)
SOUNDING = (0.5, 0.5)
# Handle points that are missed by more than this share of the diagonal before they are set are worth a warning,
MISSED = 1e-3
# and volumes that change by more.
CHANGED = 1e-3


@dataclass(frozen=True)
class Flow:
    """Where the points are.

    positions (n,d); frames: positions (n,d) at even steps of time, the last one these; steps: of Runge and Kutta's;
    missed: greatest distance of a handle's point from its end, over the diagonal, before such points were set there;
    drift: relative changes (c,) of the volumes of closed parts by the flow alone; volumes: what is left of them (c,)
    surge: greatest speed of what flows over that of the handles at that time, about 1 unless these pass one another
    intersecting: pairs (k,2) of triangles that pass through one another, and did not before
    """

    positions: np.ndarray
    frames: tuple[np.ndarray, ...]
    steps: int
    missed: float
    surge: float
    drift: np.ndarray
    volumes: np.ndarray
    intersecting: np.ndarray
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Way:
    """Places (k + 1, p, d) of handle samples at even steps of time, walls, lambda, and how handles pass one another:
    what fields are made of."""

    path: np.ndarray
    domain: FlowDomain | None
    sharpness: float
    passing: Passing

    def field(self, stretch: int, time: float) -> FlowField:
        """The field at a time within a stretch."""
        count = len(self.path) - 1
        here, there = self.path[stretch], self.path[stretch + 1]
        at = here + (time * count - stretch) * (there - here)
        d = at.shape[1]
        walls = np.zeros((0, d)) if self.domain is None else self.domain.points
        normals = np.zeros((0, d)) if self.domain is None else self.domain.normals
        values = np.concatenate([((there - here) * count).ravel(), np.zeros(len(walls))])
        return interpolated_field(conditions(at, walls, normals), values, self.sharpness, self.passing.near)


def flow(
    points: np.ndarray,
    handles: tuple[FlowHandle, ...],
    options: FlowOptions | None = None,
    triangles: np.ndarray | None = None,
    domain: FlowDomain | None = None,
    frames: int = 1,
) -> Steps[Flow]:
    """Carry points (n,d), d = 2 or 3, along a flow without divergence that takes handles to their ends.

    Parameters
    ----------
    handles : what goes where in a unit of time, and what stays; FlowHandle
    triangles : (m,3), in space: closed parts get back what flat faces lose of their volume, and faces that newly meet
    in
        a crease are taken apart
    domain : walls that nothing crosses
    frames : at how many even steps of time positions are asked for

    Raises
    ------
    HandleError : nothing moves, handles contradict each other, or lie too close together for the radius
    EmptyMeshError, NonFiniteError : there are no points, or some are not finite
    ValueError : an unknown path, or a radius or tolerance that is not positive

    Example
    -------
    >>> import numpy as np
    >>> from omt_uv.solver.progress import drain
    >>> grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 9)] * 2), axis=-1).reshape(-1, 2)
    >>> handle = FlowHandle(np.array([[0.5, 0.5]]), np.array([[0.7, 0.5]]))
    >>> found = drain(flow(grid, (handle,)))
    >>> bool(np.abs(found.positions[40] - [0.7, 0.5]).max() < 1e-9)
    True

    References
    ----------
    Hu, Zou, Hua 2014, section 5; Narcowich, Ward 1994
    """
    options = options or FlowOptions()
    points = np.asarray(points, float)
    size = _checked(points, handles, options)
    check_handles(handles, points.shape[1])
    way = _way(points / size, handles, options, domain, size)
    yield Progress("Paths", 0.0)
    everything = np.concatenate([points, *(h.start for h in handles)]) / size
    journey = _Journey(way, everything, options, len(points), size)
    plan, surge = journey.plan(frames)
    reached = _reached(everything, way, UNMOVED * options.tolerance)
    merged = yield from part_of(_carry_all(everything, plan, way.domain, reached), *CARRYING)
    ends = np.concatenate([h.end for h in handles]) / size
    missed = float(np.abs(merged[-1][len(points) :] - ends).max(initial=0.0))
    moved = np.isin(np.arange(len(points)), reached)[:, None]
    positions = [np.where(moved, at[: len(points)] * size, points) for at in merged]
    _set_handles(positions[-1], points, handles)
    rough = yield from part_of(_sound(positions, _shape(points, triangles, handles), journey), *SOUNDING)
    crossing = way.passing.warning([h.name or f"number {k}" for k, h in enumerate(handles)], surge, rough.intersecting)
    warnings = _warnings(missed, rough.volumes, len(rough.intersecting)) + crossing
    return replace(rough, steps=sum(map(len, plan)), missed=missed, surge=surge, warnings=warnings)


def _shape(points: np.ndarray, triangles: np.ndarray | None, handles: tuple[FlowHandle, ...]) -> FlowShape:
    """Points (n,3) with their triangles (m,3), none in the plane."""
    flat = triangles is None or points.shape[1] == 2
    return FlowShape(points, np.zeros((0, 3), np.int64) if flat else np.asarray(triangles), _free(len(points), handles))


@dataclass(frozen=True)
class _Journey:
    """What flows, points (n + h,d) and then those of handles in units of the diagonal `size`, and how."""

    way: _Way
    everything: np.ndarray
    options: FlowOptions
    count: int
    size: float

    def plan(self, frames: int) -> tuple[list[list[FlowStep]], float]:
        """Steps of every frame, and the greatest surge in them."""
        return _plan(self.way, self.everything, self.options, self.count, frames)


def _sound(frames: list[np.ndarray], shape: FlowShape, journey: _Journey) -> Steps[Flow]:
    """Frames, positions (n,3) each, with their volumes given back, and figures of these; the others are to come."""
    drift = shape.changes(frames[-1])
    found = []
    for k, at in enumerate(frames):
        yield Progress("Volumes", k / len(frames))
        found.append(shape.sound(at, journey.options.mend))
    if journey.options.mend and any(len(one.pairs) for one in found):
        found = yield from _apart_on_the_way(found, shape, journey)
    return Flow(
        positions=found[-1].positions,
        frames=tuple(one.positions for one in found),
        steps=0,
        missed=0.0,
        surge=0.0,
        drift=drift,
        volumes=shape.changes(found[-1].positions),
        intersecting=found[-1].pairs,
        warnings=(),
    )


def _apart_on_the_way(found: list[SoundFrame], shape: FlowShape, journey: _Journey) -> Steps[list[SoundFrame]]:
    """Frames, from the first with faces that newly intersect on with those taken apart piece by piece of the way."""
    first = next(k for k, one in enumerate(found) if len(one.pairs))
    pairs = np.concatenate([one.pairs for one in found[first:]])
    mended = np.any([one.mended for one in found[first:]], axis=0)
    move = (journey.everything[: journey.count], found[-1].positions / journey.size)
    pieces = -(-PIECES // len(found))
    plan, _ = journey.plan(pieces * len(found))
    result = list(found)
    known: dict[bytes, list[np.ndarray]] = {}
    for _ in range(REGIONS):
        regions = regions_around(move, shape.triangles, pairs, mended, shape.free)
        for region in regions:
            # What has grown no farther goes the same way again.
            if region.rows.tobytes() not in known:
                known[region.rows.tobytes()] = yield from march(region, plan, journey.way.domain)
        left = [pairs[:0]]
        for k in range(first, len(found)):
            position = found[k].positions.copy()
            for region in regions:
                through = known[region.rows.tobytes()][(k + 1) * pieces - 1]
                position[region.rows[region.free]] = through[region.free] * journey.size
            settled = shape.settled(position, regions)
            left.append(settled.pairs)
            if len(settled.pairs) < len(result[k].pairs):
                result[k] = settled
        # What comes into faces beyond the regions, or of two of them, needs these in one.
        beyond = np.concatenate(left)
        corners = shape.triangles[beyond].reshape(-1, 6)
        whole = [np.isin(corners, region.rows).all(axis=1) for region in regions]
        beyond = beyond[~np.any(whole, axis=0)]
        if not len(beyond) or max(len(region.rows) for region in regions) > MOST_HELD:
            break
        pairs = np.concatenate([pairs, beyond])
    return result


def _checked(points: np.ndarray, handles: tuple[FlowHandle, ...], options: FlowOptions) -> float:
    """The diagonal of the box around points (n,d), if everything is as it should be."""
    if not (options.radius > 0 and np.isfinite(options.radius) and options.tolerance > 0):
        raise ValueError("radius and tolerance must be positive")
    if not len(points):
        raise EmptyMeshError("There are no vertices to move")
    wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(wrong):
        raise NonFiniteError("Coordinates are not finite numbers", kind="vertex", elements=wrong)
    if not handles:
        raise HandleError("There is no handle", "Choose what shall move, and where to")
    size = options.diagonal or float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    if not (size > 0 and np.isfinite(size)):
        raise EmptyMeshError("All vertices are at one place")
    return size


def _way(points, handles, options: FlowOptions, domain: FlowDomain | None, size: float) -> _Way:
    """Samples of handles on their way, in units of the diagonal."""
    scaled = tuple(FlowHandle(h.start / size, h.end / size, h.vertices, h.name) for h in handles)
    sampled = sampled_handles(scaled, options.spacing * options.radius, options.most_samples)
    start, end, owner = joined(sampled, options.radius)
    if domain is not None:
        rows = farthest_points(domain.points / size, WALL_SPACING * options.radius, len(domain.points))
        domain = replace(
            domain,
            points=domain.points[rows] / size,
            normals=domain.normals[rows],
            middle=domain.middle / size,
            reach=domain.reach / size,
        )
        middle, reach = domain.middle, domain.reach
    else:
        middle, reach = (points.max(axis=0) + points.min(axis=0)) / 2, 0.5
    count = 1 if options.path == STRAIGHT else max(options.samples, 1)
    path = handle_paths(start, end, owner, options.path, count, middle, reach)
    straight = start + np.linspace(0, 1, len(path))[:, None, None] * (end - start)
    if np.abs(path - straight).max() < 1e-12:
        # Nothing turns: one chord does.
        path = path[[0, -1]]
    return _Way(path, domain, 1 / options.radius**2, closest_passing(path, owner, options.radius))


def _plan(
    way: _Way, everything: np.ndarray, options: FlowOptions, n: int, frames: int
) -> tuple[list[list[FlowStep]], float]:
    """Steps of every frame, and the greatest surge in them."""
    stride = max(n // PROBES, 1)
    probes = np.concatenate([everything[:n:stride], _nearest(everything[:n], way.path[0])])
    stretches = len(way.path) - 1
    knots = np.unique(np.concatenate([np.arange(stretches + 1) / stretches, np.arange(frames + 1) / frames]).round(12))

    def field_at(j: int, time: float) -> FlowField:
        stretch = min(int((knots[j] + knots[j + 1]) / 2 * stretches), stretches - 1)
        return way.field(stretch, time)

    plan = planned_steps(field_at, knots, probes, options.tolerance)
    surge = greatest_surge(way.path, [step for steps in plan for step in steps], probes)
    frame = np.minimum(((knots[:-1] + knots[1:]) / 2 * frames).astype(int), frames - 1)
    return [[step for k in np.flatnonzero(frame == f) for step in plan[k]] for f in range(frames)], surge


def _nearest(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Of points (n,d) those nearest to each of places (p,d)."""
    from scipy.spatial import cKDTree

    return points[np.unique(cKDTree(points).query(places, k=min(3, len(points)))[1].ravel())]


def _reached(everything: np.ndarray, way: _Way, small: float) -> np.ndarray:
    """Rows (r,) of points (n,d) that some handle on its way comes near enough to to move them by more than `small`."""
    from scipy.spatial import cKDTree

    if way.domain is not None:
        return np.arange(len(everything))
    chord = float(np.linalg.norm(np.diff(way.path, axis=0), axis=2).max(initial=0.0))
    farthest = np.sqrt(-np.log(small) / way.sharpness) + chord / 2
    places = way.path.reshape(-1, everything.shape[1])
    distance, _ = cKDTree(places).query(everything, distance_upper_bound=farthest)
    return np.flatnonzero(np.isfinite(distance))


def _carry_all(
    everything: np.ndarray, plan: list[list[FlowStep]], domain: FlowDomain | None, reached: np.ndarray
) -> Steps[list]:
    """Positions (n,d) of all points after every frame; those not reached (r,) stay."""
    results = [everything.copy() for _ in plan]
    for start in range(0, len(reached), BLOCK):
        rows = reached[start : start + BLOCK]
        block = everything[rows]
        for steps, result in zip(plan, results, strict=True):
            block = carried(block, steps)
            if domain is not None:
                block = domain.held(block)
            result[rows] = block
        yield Progress("Flow", min((start + BLOCK) / len(reached), 1.0))
    return results


def _set_handles(positions: np.ndarray, points: np.ndarray, handles: tuple[FlowHandle, ...]) -> None:
    """Set vertices of handles where they belong, to the last bit, and those that stay last."""
    for handle in sorted(handles, key=lambda h: h.stays):
        if handle.vertices is None:
            continue
        known = handle.vertices >= 0
        rows = handle.vertices[known]
        positions[rows] = points[rows] if handle.stays else handle.end[known]


def _free(n: int, handles: tuple[FlowHandle, ...]) -> np.ndarray:
    """Which of n points (n,) bool belong to no handle."""
    free = np.ones(n, bool)
    for handle in handles:
        if handle.vertices is not None:
            free[handle.vertices[handle.vertices >= 0]] = False
    return free


def _warnings(missed: float, volumes: np.ndarray, intersecting: int) -> tuple[str, ...]:
    told = []
    if missed > MISSED:
        told.append(
            f"Vertices of a handle that the flow took elsewhere, by up to {100 * missed:.2g} % of the diagonal, "
            "were set to their ends; a handle that keeps its shape, and a smaller radius, are followed more closely"
        )
    worst = float(np.abs(volumes).max(initial=0.0))
    if worst > CHANGED:
        told.append(f"An enclosed volume changes by {100 * worst:.2g} %; a finer mesh near the handles helps")
    if intersecting:
        told.append(
            f"{plural(intersecting, 'A pair of faces passes', '{} pairs of faces pass')} through one another "
            "that did not before; a finer mesh, "
            "a greater radius or a shorter way helps"
        )
    return tuple(told)
