"""Hold what the front door returns about UVs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..maps.distortion import Distortion


@dataclass(frozen=True)
class UVs:
    """Texture coordinates of every face corner, and what they are worth.

    uv : (m,k,2) for faces (m,k) given as an array, (c,2) for a list of polygons, corner by corner
    seams : (s,2) pairs of vertices, edges that were cut for the map beside those given
    figures : area error, shear, folds and overlap, see `omt.distortion`
    warnings : what was repaired, replaced or not reached
    """

    uv: np.ndarray
    seams: np.ndarray
    figures: Distortion
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class MagnifiedUVs:
    """As `UVs`, and the share of the UV area that the region had before, was to have, and has."""

    uv: np.ndarray
    figures: Distortion
    warnings: tuple[str, ...]
    share_before: float
    share_asked: float
    share_after: float
