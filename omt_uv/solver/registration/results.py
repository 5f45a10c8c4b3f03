"""How two surfaces are to be matched, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import LandmarkError
from .domains import AUTO, DOMAINS
from .landmarks import Landmarks

# Distance over the extent below which a landmark is met.
MET = 1e-6
# Weight of the features, by default.
FEATURE_WEIGHT = 0.05


@dataclass(frozen=True)
class RegistrationOptions:
    """How two surfaces are matched.

    domain : "sphere", which closes all holes; "disk", which keeps the longest boundary; "auto": a disk where both have
        one that is more than a small hole; "charts": the disks that seams cut both into, for surfaces of any topology
    balance : of the maps to the domain, 0 for exact areas to 1 for the least shear
    mirrored : match the mirror image of the source
    polish : whether the map is optimised on the surfaces, too
    features : weight of the shape's features in the polish, next to the distortion; 0 for none
    strict : refuse where a landmark cannot be met, instead of naming it
    closeness : share of the target's diagonal; where flat faces of the source are farther from the target than that,
        vertices gather there, as a wrap wants it; None: nowhere. Charts gather nothing

    Raises
    ------
    ValueError : a domain that is none of these, a balance outside of [0, 1], a closeness that is not positive
    """

    domain: str = AUTO
    balance: float = 0.5
    mirrored: bool = False
    polish: bool = True
    strict: bool = False
    features: float = FEATURE_WEIGHT
    closeness: float | None = None

    def __post_init__(self):
        if self.domain not in DOMAINS:
            raise ValueError(f"domain must be one of {', '.join(DOMAINS)}, not {self.domain!r}")
        if not 0 <= self.balance <= 1:
            raise ValueError(f"balance must lie in [0, 1], not {self.balance}")
        if self.closeness is not None and not self.closeness > 0:
            raise ValueError(f"closeness must be positive, not {self.closeness}")


@dataclass(frozen=True)
class OnSurface:
    """Points on a surface: triangle (n,), barycentric coordinates (n,3), and which (n,) bool lie where a hole was
    closed, and were moved to the nearest point of the surface."""

    faces: np.ndarray
    barycentric: np.ndarray
    beside: np.ndarray

    def positions(self, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Where they are (n,3), on a surface of vertices (k,3) and triangles (m,3)."""
        return np.einsum("nc,ncd->nd", self.barycentric, vertices[triangles[self.faces]])


@dataclass(frozen=True)
class Registration:
    """A map of a source onto a target and back.

    forward: where the source's vertices lie on the target; backward: where the target's lie on the source
    domain: "sphere", "disk" or "charts"; source_domain (n,d), target_domain (k,d): both surfaces there, as they lie
    over one another, a vertex on a seam in one of its charts; flipped: share of the source's area whose orientation the
    map turns; stretches (m,2): singular values of the map of every triangle of the source, the greater first, in units
    in which both surfaces have the same area
    residuals (l,): how far landmarks are from their places, over the target's extent; met (l,) bool
    steps: Newton steps in the domain and on the surfaces; error: of the alignment; warnings
    """

    forward: OnSurface
    backward: OnSurface
    domain: str
    source_domain: np.ndarray
    target_domain: np.ndarray
    flipped: float
    stretches: np.ndarray
    residuals: np.ndarray
    met: np.ndarray
    steps: tuple[int, int]
    error: float
    warnings: tuple[str, ...]


def stretches(reference: np.ndarray, positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Singular values (m,2), the greater first, of the map of every triangle (m,3) from (n,3) to (n,3)."""
    p, q = reference[triangles], positions[triangles]
    first, second = p[:, 1:] - p[:, :1], q[:, 1:] - q[:, :1]
    before = np.einsum("mid,mjd->mij", first, first)
    after = np.einsum("mid,mjd->mij", second, second)
    # The metric of the image in an orthonormal frame of the reference, by its Cholesky factor.
    a = np.sqrt(np.maximum(before[:, 0, 0], 1e-300))
    b = before[:, 0, 1] / a
    c = np.sqrt(np.maximum(before[:, 1, 1] - b * b, 1e-18 * a * a))
    xx = after[:, 0, 0] / a**2
    xy = (after[:, 0, 1] - b * after[:, 0, 0] / a) / (a * c)
    yy = (after[:, 1, 1] - 2 * b * after[:, 0, 1] / a + b**2 * after[:, 0, 0] / a**2) / c**2
    mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return np.sqrt(np.maximum(np.column_stack([mean + half, mean - half]), 0))


def with_missed(found: Registration, landmarks: Landmarks, strict: bool) -> Registration:
    """A match with a warning that names landmarks (k,) that are not met; if strict, LandmarkError instead."""
    missed = [landmarks.name(k) for k in np.flatnonzero(~found.met).tolist()]
    if not missed:
        return found
    text = f"Landmarks {', '.join(missed)} cannot be met without a fold"
    if strict:
        raise LandmarkError(text, "Move them, or leave them out")
    return replace(found, warnings=(*found.warnings, text))
