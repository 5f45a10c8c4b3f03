"""Turn pinned corners of a surface into pins of its charts, and lay pinned charts where these are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import PinError
from ..maps.similarity import fit_similarity
from ..mesh.charts import Chart
from ..mesh.surface import Surface
from ..refinement.pins import Pins, aligned_to_pins, check_pins
from .chart_indices import located


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


def pins_of_chart(pins: CornerPins | None, chart: Chart) -> ChartPins | None:
    """Pins of a chart, None if it has none.

    Raises
    ------
    PinError : see `pins.check_pins`; pinned corners of one chart vertex that lie apart are two places of it. Its
        elements are those of the surface
    """
    if pins is None or not pins.pinned[chart.corners].any():
        return None
    mask = pins.pinned[chart.corners]
    given = np.asarray(pins.uv, float)[chart.corners]
    try:
        checked = check_pins(chart.triangles[mask], given[mask], len(chart.vertices))
    except PinError as error:
        raise located(error, chart) from error
    places = np.column_stack([checked.places.real, checked.places.imag])
    return ChartPins(vertices=checked.vertices, places=places, given=given)


def clear_of_pins(surface: Surface, pins: CornerPins | None, avoid: np.ndarray | None) -> np.ndarray | None:
    """Vertices (n,) in [0,1] to keep free of cuts: those to `avoid`, and all with a pin; None for none.

    A cut through a pinned vertex would give one point of the surface two places in the texture.
    """
    if pins is None or not pins.pinned.any():
        return avoid
    free = np.zeros(len(surface.positions)) if avoid is None else np.array(avoid, float)
    free[surface.corner_vertex[pins.pinned]] = 1.0
    return free


def refuse_pins_on_outline(pins: ChartPins | None, boundary: str) -> None:
    """Raise PinError for pins in a disk or a square, which has its own place for every vertex."""
    if pins is not None and boundary != "free":
        raise PinError(
            f"Pinned UVs cannot stay in place in a {boundary}",
            remedy="Choose a free boundary, or unpin these vertices",
            kind="vertex",
            elements=pins.vertices,
        )


def mirrored_to_pins(uv: np.ndarray, pins: ChartPins | None) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray] | None]:
    """Start uv (n,2) and pins for `refine`, which takes three or more here; None for fewer, see `moved_to_pins`.

    The start is mirrored where that comes nearer to the pins once it is moved, turned and scaled.
    """
    if pins is None or len(pins.vertices) < 3:
        return uv, None
    pinned = Pins(pins.vertices, pins.places @ [1, 1j])
    maps = uv @ [1, 1j], uv @ [1, -1j]
    miss, mirrored = (np.abs(aligned_to_pins(w, pinned)[pinned.vertices] - pinned.places).sum() for w in maps)
    # Pins in a row fit either way: then the map is not mirrored.
    turn_over = miss - mirrored > 1e-4 * np.abs(pinned.places - pinned.places.mean()).sum()
    return uv * [1, -1 if turn_over else 1], (pins.vertices, pins.places)


def moved_to_pins(uv: np.ndarray, triangles: np.ndarray, pins: ChartPins) -> np.ndarray:
    """The map uv (n,2) moved, turned and scaled to its pins, one or two: its shape is what it would be without them.

    With one pin it is as large as the UVs that the chart has now and turned like them, or one unit wide where those
    have no area.
    """
    w, places = uv @ [1, 1j], pins.places @ [1, 1j]
    if len(pins.vertices) > 1:
        w = aligned_to_pins(w, Pins(pins.vertices, places))
    else:
        w = _placed_like_given(w, triangles, pins.given @ [1, 1j])
        w = w + (places[0] - w[pins.vertices[0]])
    w[pins.vertices] = places
    return np.column_stack([w.real, w.imag])


def _placed_like_given(w: np.ndarray, triangles: np.ndarray, given: np.ndarray) -> np.ndarray:
    """The map w (n,), its triangles turned and scaled to the direction and area of those given, by corners (m,3)."""
    corners = w[triangles]
    now, then = (np.abs(((x[:, 1] - x[:, 0]).conj() * (x[:, 2] - x[:, 0])).imag).sum() for x in (corners, given))
    if not (np.isfinite(then) and then > 0):
        return w / max(np.ptp(corners.real), np.ptp(corners.imag))
    scale = np.sqrt(then / now)
    return fit_similarity(scale * corners.ravel(), given.ravel(), rigid=True)(scale * w)
