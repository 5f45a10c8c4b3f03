"""Move pinned vertices exactly to their places without a fold, by forces of growing stiffness (a penalty method)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import PinError
from ..maps.energy import Elements, has_folds, squared
from ..maps.similarity import fit_similarity
from ..progress import Progress, Steps
from .continuation import MapProblem, StageLimits, minimise, rescaled
from .projected_newton import FreeMotion, NewtonProblem

AREA_WEIGHT = 10.0  # while pins are on their way
# Stiffness of the forces that draw them, from soft to hard: energy per squared distance over the extent of the pins.
STIFFNESS = tuple(10.0**k for k in range(0, 11, 2))
MAX_STEPS = 40  # of Newton's method for each stiffness
# A pin this near to its place, relative to the extent of the pins, is put there if that folds nothing.
NEAR = 1e-3


@dataclass(frozen=True)
class Pins:
    """Vertices (k,), each once, and their places (k,) complex."""

    vertices: np.ndarray
    places: np.ndarray


def check_pins(vertices: np.ndarray, places: np.ndarray, n: int) -> Pins:
    """Pins from vertices (k,) and places (k,2) of a chart with n vertices.

    Raises
    ------
    PinError : places that are not finite, a vertex with two places, two vertices with one place
    """
    vertices, places = np.asarray(vertices, np.int64).ravel(), np.asarray(places, float).reshape(-1, 2)
    if len(vertices) != len(places) or (len(vertices) and not 0 <= vertices.min() <= vertices.max() < n):
        raise ValueError("pins need one place for each vertex, and vertices of this chart")
    wrong = vertices[~np.isfinite(places).all(1)]
    if len(wrong):
        raise PinError("Pinned UVs are not finite", kind="vertex", elements=wrong)
    both = np.unique(np.column_stack([vertices, places]), axis=0)
    vertices, places = both[:, 0].astype(np.int64), both[:, 1:]
    again = np.unique(vertices[1:][vertices[1:] == vertices[:-1]])
    if len(again):
        raise PinError("A vertex is pinned to two places", kind="vertex", elements=again)
    _, first, count = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    same = vertices[count[first.ravel()] > 1]
    if len(same):
        raise PinError("Several vertices are pinned to one place", kind="vertex", elements=same)
    return Pins(vertices, places[:, 0] + 1j * places[:, 1])


@dataclass(frozen=True)
class PinEnergy:
    """An energy that draws pins to their places p: stiffness * |w - p|^2 / unit^2, summed over the pins."""

    pins: Pins
    stiffness: float
    unit: float

    def energy(self, w):
        """The energy of a map w (n,) complex."""
        return float(self.stiffness * squared((w[self.pins.vertices] - self.pins.places) / self.unit).sum())

    def derivatives(self, w):
        """Gradient (n,) complex; vertices (2k,1) and rows (2k,1) of linear forms whose squares are the Hessian."""
        factor = 2 * self.stiffness / self.unit**2
        gradient = np.zeros(len(w), complex)
        gradient[self.pins.vertices] = factor * (w[self.pins.vertices] - self.pins.places)
        rows = np.sqrt(factor) * np.repeat([[1], [-1j]], len(self.pins.vertices), axis=0)
        return gradient, np.tile(self.pins.vertices, 2)[:, None], rows

    def limit(self, w, step):
        """Infinity: the forces allow every step."""
        return np.inf


def aligned_to_pins(w: np.ndarray, pins: Pins) -> np.ndarray:
    """The map w (n,) moved, turned and scaled so that the pins (two or more) come nearest to their places."""
    return fit_similarity(w[pins.vertices], pins.places)(w)


def placed_like(
    w: np.ndarray, given: np.ndarray, faces: Elements, pins: Pins | None = None, area: float | None = None
) -> np.ndarray:
    """The map w (n,) turned and moved to lie as the given one (n,) does, with that UV area; the first pin in its place.

    area : UV area of the result, that of the given map by default
    """
    if area is None:
        area = abs(faces.areas(given).sum())
    w = w * np.sqrt(area / faces.areas(w).sum())
    mass, third = np.zeros(len(w)), faces.triangle_areas / 3
    for here in faces.some_at_once():
        np.add.at(mass, faces.triangles[here].ravel(), np.repeat(third[here], 3))
    placed = fit_similarity(w, given, mass, rigid=True)(w)
    return placed if pins is None else placed + (pins.places[0] - placed[pins.vertices[0]])


def move_pins(problem: MapProblem, w: np.ndarray, pins: Pins) -> Steps[tuple[MapProblem, np.ndarray]]:
    """The map w (n,) complex, moved until all pins (two or more) are in place, and the problem that keeps them there.

    Forces of growing stiffness draw the pins, a penalty method; the barriers against folds and against a boundary that
    crosses itself hold. Once near, a pin is put where it belongs.

    Raises
    ------
    PinError : some pins cannot reach their places without a fold
    """
    w = aligned_to_pins(w, pins)
    extent = np.abs(pins.places - pins.places.mean()).max()
    for k, stiffness in enumerate(STIFFNESS):
        snapped = w.copy()
        snapped[pins.vertices] = pins.places
        near = np.abs(snapped - w).max() <= NEAR * extent or k == 0
        if near and not has_folds(problem.faces, snapped) and not problem.boundary_crosses(snapped):
            fixed = replace(rescaled(problem, snapped), motion=_fixed(len(w), pins), scale_free=True)
            return fixed, snapped
        problem = rescaled(problem, w)
        terms = (PinEnergy(pins, stiffness, extent), problem.barrier(w))
        newton = NewtonProblem(
            faces=problem.faces, assembly=problem.assembly, motion=problem.motion, area_weight=AREA_WEIGHT, terms=terms
        )
        yield Progress("Pins", k / len(STIFFNESS))
        w = (yield from minimise(newton, w, StageLimits(np.inf, MAX_STEPS), k)).w
    far = pins.vertices[np.abs(w[pins.vertices] - pins.places) > NEAR * extent]
    raise PinError("Pins cannot reach their places without a fold", kind="vertex", elements=far)


def _fixed(n: int, pins: Pins) -> FreeMotion:
    pinned = np.zeros(n, bool)
    pinned[pins.vertices] = True
    return FreeMotion(pinned)
