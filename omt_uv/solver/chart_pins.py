"""From pinned corners of a surface to pins of its charts, and pinned charts to their places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .charts import Chart
from .errors import PinError
from .geometry import signed_areas
from .pins import Pins, aligned, check_pins


@dataclass(frozen=True)
class CornerPins:
    """pinned (c,) bool: corners of a surface that must keep their places; uv (c,2): where all corners are now."""

    pinned: np.ndarray
    uv: np.ndarray


@dataclass(frozen=True)
class ChartPins:
    """Vertices (k,) of a chart, each once, their places (k,2), and where its triangles' corners are now (m,3,2)."""

    vertices: np.ndarray
    places: np.ndarray
    given: np.ndarray


def chart_pins(pins: CornerPins | None, chart: Chart) -> ChartPins | None:
    """Pins of a chart, None if it has none.

    Raises
    ------
    PinError : see `pins.check_pins`; pinned corners of one chart vertex that lie apart are two places of it
    """
    if pins is None or not pins.pinned[chart.corners].any():
        return None
    mask = pins.pinned[chart.corners]
    given = np.asarray(pins.uv, float)[chart.corners]
    checked = check_pins(chart.triangles[mask], given[mask], len(chart.vertices))
    return ChartPins(checked.vertices, np.column_stack([checked.places.real, checked.places.imag]), given)


def refuse_outline(pins: ChartPins | None, boundary: str) -> None:
    """Raise PinError for pins in a disk or a square, which has its own place for every vertex."""
    if pins is not None and boundary != "free":
        raise PinError(
            f"Pinned UVs cannot stay in place in a {boundary}",
            remedy="Choose a free boundary, or unpin these vertices",
            kind="vertex",
            elements=pins.vertices,
        )


def facing(uv: np.ndarray, pins: ChartPins | None) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray] | None]:
    """Start uv (n,2) and pins for `refine`, which takes two or more here; None for fewer.

    The start is mirrored where that comes nearer to the pins once it is moved, turned and scaled.
    """
    if pins is None or len(pins.vertices) < 2:
        return uv, None
    held = Pins(pins.vertices, pins.places @ [1, 1j])
    maps = uv @ [1, 1j], uv @ [1, -1j]
    miss, mirrored = (np.abs(aligned(w, held)[held.vertices] - held.places).sum() for w in maps)
    # Two pins, or pins in a row, fit either way: then the map is not mirrored.
    turn_over = miss - mirrored > 1e-4 * np.abs(held.places - held.places.mean()).sum()
    return uv * [1, -1 if turn_over else 1], (pins.vertices, pins.places)


def anchored(uv: np.ndarray, triangles: np.ndarray, pins: ChartPins) -> np.ndarray:
    """The map uv (n,2) with its only pin in place, as large as the UVs that the chart has now and turned like them.

    Where those have no area the map becomes one unit wide.
    """
    w, given = uv[triangles] @ [1, 1j], pins.given @ [1, 1j]
    sides = pins.given[:, 1:] - pins.given[:, :1]
    area = 0.5 * np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]).sum()
    turn = ((w - w.mean()).conj() * (given - given.mean())).sum()
    direction = turn / abs(turn) if np.isfinite(turn) and abs(turn) > 0 else 1.0
    if np.isfinite(area) and area > 0:
        scale = np.sqrt(area / np.abs(signed_areas(uv, triangles)).sum())
    else:
        scale = 1 / np.ptp(uv, axis=0).max()
    turned = (uv @ [1, 1j]) * (scale * direction)
    place = np.column_stack([turned.real, turned.imag])
    place += pins.places[0] - place[pins.vertices[0]]
    place[pins.vertices] = pins.places
    return place
