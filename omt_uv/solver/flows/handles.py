"""Hold what a flow is made to do: points and where they go, thinned out to those that the field needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import HandleError, NonFiniteError

# Handles that start closer together than this share of the radius must go the same way.
TOUCHING = 1e-3


@dataclass(frozen=True)
class FlowHandle:
    """Points (k,d) that go together, and their ends (k,d); the same, and the handle is a place that stays.

    vertices (k,): which of the flowing points they are; -1, or None for all, where they are none of these
    """

    start: np.ndarray
    end: np.ndarray
    vertices: np.ndarray | None = None
    name: str = ""

    @property
    def stays(self) -> bool:
        """Whether it keeps its place."""
        return bool(np.array_equal(self.start, self.end))


def check_handles(handles: tuple[FlowHandle, ...], dimension: int) -> None:
    """Raise unless there is a handle that moves, and all are finite points of this dimension."""
    for k, handle in enumerate(handles):
        name = handle.name or f"number {k}"
        if handle.start.shape != handle.end.shape or handle.start.shape[1:] != (dimension,) or not len(handle.start):
            raise HandleError(f"The handle {name} has no points, or not as many ends as points")
        if not (np.isfinite(handle.start).all() and np.isfinite(handle.end).all()):
            raise NonFiniteError(f"Coordinates of the handle {name} are not finite numbers", "Give finite positions")
    if all(handle.stays for handle in handles):
        raise HandleError("No handle moves", "Move at least one")


def sampled_handles(handles: tuple[FlowHandle, ...], spacing: float, most: int) -> tuple[FlowHandle, ...]:
    """Every handle with those of its points (k,d) that are at least `spacing` apart, at most `most`, chosen farthest
    first."""
    chosen: list[FlowHandle] = []
    for handle in handles:
        rows = farthest_points(handle.start, spacing, most)
        vertices = None if handle.vertices is None else handle.vertices[rows]
        chosen.append(FlowHandle(handle.start[rows], handle.end[rows], vertices, handle.name))
    return tuple(chosen)


def farthest_points(points: np.ndarray, spacing: float, most: int) -> np.ndarray:
    """Rows (s,) of points (k,d), each the farthest from those before, from the one nearest to the middle on."""
    first = int(np.square(points - points.mean(axis=0)).sum(axis=1).argmin())
    rows, distance = [first], np.linalg.norm(points - points[first], axis=1)
    while len(rows) < min(most, len(points)) and distance.max() >= spacing:
        rows.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[rows[-1]], axis=1))
    return np.array(rows)


def joined(handles: tuple[FlowHandle, ...], radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Starts (p,d), ends (p,d) and handle (p,) of all samples, one of each pair that is one point and goes one way.

    Raises
    ------
    HandleError : handles have a point in common, and go apart
    """
    start = np.concatenate([h.start for h in handles])
    end = np.concatenate([h.end for h in handles])
    owner = np.repeat(np.arange(len(handles)), [len(h.start) for h in handles])
    apart = np.linalg.norm(start[:, None] - start[None], axis=2)
    first, second = np.nonzero(np.triu(apart < TOUCHING * radius, 1))
    differ = np.linalg.norm((end - start)[first] - (end - start)[second], axis=1) > TOUCHING * radius
    if differ.any():
        pairs = {tuple(sorted((owner[a], owner[b]))) for a, b in zip(first[differ], second[differ], strict=True)}
        names = "; ".join(" and ".join(handles[k].name or f"number {k}" for k in pair) for pair in sorted(pairs))
        raise HandleError(f"Handles are at one place and go to different ones: {names}")
    keep = np.ones(len(start), bool)
    keep[second] = False
    return start[keep], end[keep], owner[keep]
