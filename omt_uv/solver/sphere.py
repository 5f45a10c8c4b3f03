"""Area-preserving maps of closed surfaces of genus 0 to the unit sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .progress import Steps
from .sphere_conformal import conformal_sphere

METHODS = ("newton",)


@dataclass(frozen=True)
class SphereMap:
    """A map of a closed surface to the unit sphere.

    positions (n,3) unit vectors, faces counter-clockwise seen from outside; conformal (n,3): the Moebius-centred
    conformal map it started from; status; iterations: Newton steps; residual; warnings: what was replaced and why.
    """

    positions: np.ndarray
    conformal: np.ndarray
    status: str
    iterations: int
    residual: float
    warnings: tuple[str, ...]


def sphere_map(
    vertices: np.ndarray,
    triangles: np.ndarray,
    density: np.ndarray | None = None,
    balance: float = 0.0,
    quality: str = "standard",
    method: str = "newton",
) -> Steps[SphereMap]:
    """Map a closed surface (n,3), (m,3) of genus 0 to the unit sphere.

    Raises
    ------
    MeshError : see `closed.closed_surface`
    PrecisionError : the map leaves double precision
    """
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, not {method!r}")
    found = yield from conformal_sphere(vertices, triangles)
    return SphereMap(found.positions, found.positions, "conformal", found.iterations, found.residual, ())
