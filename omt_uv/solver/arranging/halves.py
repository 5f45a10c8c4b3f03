"""Give both halves of a symmetric body the same UVs: mirror images apart, or one on the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import FoldedUVError, MeshError
from ..mesh.geometry import signed_areas
from .congruence import mirrored_match, nearness


@dataclass(frozen=True)
class Halves:
    """uv: of every island (n_i,2); partner (k,): the one it is the image of, itself or another one, -1 if of none."""

    uv: list[np.ndarray]
    partner: np.ndarray


def halves(
    islands: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], normal: np.ndarray, at: float, on_one_another: bool
) -> Halves:
    """UVs that are the same on both sides of a plane, normal . x = at.

    Of a pair of islands, that on the side of the normal gives its UVs to the other one: as they are, `on_one_another`,
    or mirrored along u where the other one lies. An island across the plane gets the mean of its map and of the image
    of it; on one another, the other half of it lies on the first.

    Parameters
    ----------
    islands : positions (n_i,3), triangles (m_i,3) and UVs (n_i,2) of each
    normal : (3,) of length 1

    Raises
    ------
    MeshError : no island has an image
    FoldedUVError : the mean of an island's map and its image folds a face
    """
    partner = np.full(len(islands), -1)
    uv = [np.array(place, float) for *_, place in islands]
    middle = np.array([V.mean(axis=0) for V, *_ in islands]).reshape(-1, 3)
    centre = middle @ normal - at
    tree, images = cKDTree(middle), middle - 2 * centre[:, None] * normal
    for k, (V, F, place) in enumerate(islands):
        if partner[k] >= 0:
            continue
        # The middle of an image is the image of the middle.
        near = tree.query_ball_point(images[k], 1.01 * nearness(V))
        for other in sorted(j for j in near if j >= k and partner[j] < 0):
            image = mirrored_match(V, F, islands[other][0], islands[other][1], normal, at)
            if image is None:
                continue
            partner[k], partner[other] = other, k
            if other == k:
                uv[k] = symmetric_map(F, place, image)
                if on_one_another:
                    lower = V @ normal < at
                    uv[k][lower] = uv[k][image[lower]]
            else:
                _give(uv, (k, other), image, centre[k] >= centre[other], on_one_another)
            break
    if (partner < 0).all():
        raise MeshError("No island is the image of another one, or of itself", "Choose another axis")
    return Halves(uv, partner)


def _give(uv: list[np.ndarray], pair: tuple[int, int], image: np.ndarray, first: bool, on_one_another: bool) -> None:
    """Write the UVs of the second of a pair from those of the first, or of the first from the second."""
    k, other = pair
    if first:
        source, target, new = k, other, np.empty_like(uv[other])
        new[image] = uv[k]
    else:
        source, target, new = other, k, uv[other][image]
    if not on_one_another:
        new = new * [-1, 1]
        new += _middle(uv[target]) - _middle(new)
    if source != target:
        uv[target] = new


def _middle(uv: np.ndarray) -> np.ndarray:
    return (uv.min(axis=0) + uv.max(axis=0)) / 2


def symmetric_map(F: np.ndarray, uv: np.ndarray, image: np.ndarray) -> np.ndarray:
    """The mean (n,2) of a map and its image in the line that comes nearest: a reflection a z* + b with |a| = 1.

    image (n,) : the vertex that each one is seen as

    Raises
    ------
    FoldedUVError : the mean folds a face that the map did not
    """
    w = uv @ [1, 1j]
    z, target = w[image] - w[image].mean(), w - w.mean()
    # Least squares over |a| = 1: the angle of the correlation (Umeyama 1991, with a conjugate for the reflection).
    a = (target * z).sum()
    a = a / abs(a) if abs(a) > 0 else 1.0
    mean = w.mean() + (target + a * np.conj(z)) / 2
    result = np.column_stack([mean.real, mean.imag])
    before, after = signed_areas(uv, F), signed_areas(result, F)
    turned = np.flatnonzero((before > 0) != (after > 0))
    if len(turned):
        raise FoldedUVError(
            "An island that should be its own mirror image folds", "Unwrap it anew first", "face", turned
        )
    return result
