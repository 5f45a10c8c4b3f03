"""Tell the front of a body from its back: the front is where a face has its eyes, nose and mouth.

The most salient parts near the mirror plane of a head or a body lie to its front. Ears, on the sides, count little, and
what lies to both sides of the plane cancels out. Where that says little, the front is where the scene is seen from:
artists model what looks at them in the front view.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import WeightError
from ..mesh.geometry import unit, vertex_areas, vertex_normals
from .symmetry_plane import SymmetryPlane
from .vertex_scores import soft_weights

# Shares of the area with less saliency than what is looked at, and than what counts fully.
SALIENT = (0.9, 0.99)
# How far off the middle, over the size, salient parts lie of a body that clearly has a front, and of one that has none.
CLEAR = 0.06
NONE = 0.02
# How far off the middle, over the size, salient parts would have to lie to speak against the front view.
FRONT_VIEW = 0.03
# Certainty that a body without a mirror plane has at most.
UNSURE = 0.5
# A mirror plane whose normal rises more than this sine is no upright one: what was told to be up is not.
LEANING = 0.3


@dataclass(frozen=True)
class SceneAxes:
    """How a surface stands in the scene.

    Attributes
    ----------
    up (3,) : the direction of its positions that is up
    viewer (3,) : the one from which the front view is seen
    """

    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    viewer: tuple[float, float, float] = (0.0, -1.0, 0.0)


Z_UP = SceneAxes()


@dataclass(frozen=True)
class Facing:
    """Where a body looks to.

    Attributes
    ----------
    front (3,) : unit vector, 0 where there is no telling
    up (3,) : unit vector, 0 where it is not known
    certainty : in [0, 1], of the front
    """

    front: np.ndarray
    up: np.ndarray
    certainty: float


def facing(
    positions: np.ndarray,
    triangles: np.ndarray,
    saliency: np.ndarray,
    plane: SymmetryPlane | None,
    axes: SceneAxes | None = None,
) -> Facing:
    """Where a body of unit size (n,3), (m,3) with saliency (n,) looks to; of the plane the normal alone counts.

    axes : how it stands in the scene, if that is known. A mirror plane that is not upright speaks against it.
    """
    up, viewer = (np.zeros(3),) * 2 if axes is None else (unit(np.array(v, float)) for v in (axes.up, axes.viewer))
    if plane is None and axes is None:
        return Facing(np.zeros(3), up, 0.0)
    if plane is not None and abs(plane.normal @ up) > LEANING:
        up = viewer = np.zeros(3)
    near = area = vertex_areas(positions, triangles)
    if plane is not None:
        depth = (positions - area @ positions / area.sum()) @ plane.normal
        near = area * np.exp(-0.5 * depth**2 * area.sum() / (area @ depth**2))
    eyes = near * salient_weights(saliency, area, SALIENT)
    off = FRONT_VIEW * viewer
    if eyes.sum() > 0:
        off = off + eyes @ positions / eyes.sum() - near @ positions / near.sum()
    if plane is not None:
        off -= (off @ plane.normal) * plane.normal
    if up.any():
        off -= (off @ up) * up
    certainty = float(np.clip((np.linalg.norm(off) - NONE) / (CLEAR - NONE), 0, 1 if plane is not None else UNSURE))
    return Facing(unit(off) if certainty else np.zeros(3), up, certainty)


def towards(positions: np.ndarray, triangles: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """How far the vertices (n,) of a surface (n,3), (m,3) look and lie towards a direction (3,), in [-1, 1].

    The mean of the cosine of the normal and of `ahead`.
    """
    return 0.5 * (vertex_normals(positions, triangles) @ direction + ahead(positions, triangles, direction))


def ahead(positions: np.ndarray, triangles: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """How far the vertices (n,) of a surface (n,3), (m,3) lie along a direction (3,): 0 in the middle, 1 and -1 where
    they lie farthest."""
    area = vertex_areas(positions, triangles)
    along = (positions - area @ positions / area.sum()) @ direction
    used = area > 0
    ends = [max(float((sign * along[used]).max()), np.finfo(float).tiny) for sign in (1, -1)]
    return np.clip(along / np.where(along > 0, *ends), -1, 1)


def salient_weights(saliency: np.ndarray, area: np.ndarray, shares: tuple[float, float]) -> np.ndarray:
    """`soft_weights` (n,) of a saliency (n,) over areas (n,), 0 where it is the same everywhere."""
    try:
        return soft_weights(saliency, area, *shares)
    except WeightError:
        return np.zeros(len(saliency))
