"""The mean of shapes whose vertices correspond, and how far each is from the rest (Hu, Zou, Hua 2014, section 6.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.geometry import nearest_rotations

# Rounds of aligning to the mean, and the change of the mean, over its size, below which they end.
ROUNDS = 20
SETTLED = 1e-9
# Deviations are divided by no less than this share of their mean over the surface.
LEAST_DEVIATION = 0.05


@dataclass(frozen=True)
class MeanShape:
    """Mean (n,3) of shapes; aligned (k,n,3): they, turned and shifted onto it; distance (k,n): of every vertex from the
    mean; deviation (n,): root mean square of these; score (k,n): distance from the mean of all others over their
    deviation, 0 of two shapes: one other has none."""

    mean: np.ndarray
    aligned: np.ndarray
    distance: np.ndarray
    deviation: np.ndarray
    score: np.ndarray


def mean_shape(shapes: np.ndarray, weight: np.ndarray, scaled: bool = False) -> MeanShape:
    """The mean of shapes (k,n,3), k > 1, after turning and shifting them onto one another (Gower 1975).

    Parameters
    ----------
    weight : (n,) of the vertices, such as their areas
    scaled : whether sizes are made alike, too

    Raises
    ------
    ValueError : fewer than two shapes
    """
    if len(shapes) < 2:
        raise ValueError("a mean needs two shapes or more")
    share = weight / weight.sum()
    centred = shapes - np.einsum("n,knd->kd", share, shapes)[:, None]
    if scaled:
        size = np.sqrt(np.einsum("n,knd->k", share, centred**2))
        centred = centred * (size.mean() / size)[:, None, None]
    mean = centred[0]
    for _ in range(ROUNDS):
        moment = np.einsum("n,nd,kne->kde", share, mean, centred)
        aligned = np.einsum("kde,kne->knd", nearest_rotations(moment), centred)
        following = aligned.mean(axis=0)
        change = float(np.sqrt(share @ ((following - mean) ** 2).sum(axis=1)))
        mean = following
        if change < SETTLED * float(np.sqrt(share @ (mean**2).sum(axis=1))):
            break
    distance = np.linalg.norm(aligned - mean, axis=2)
    square = distance**2
    # Each is judged by the mean and the deviation of the others, which it does not spoil.
    apart = len(shapes) / (len(shapes) - 1)
    rest = np.sqrt(np.maximum(square.sum(axis=0) - apart * square, 0) / (len(shapes) - 1))
    least = LEAST_DEVIATION * np.einsum("n,kn->k", share, rest)[:, None]
    score = apart * distance / np.maximum(np.maximum(rest, least), 1e-300) * (len(shapes) > 2)
    return MeanShape(mean, aligned, distance, np.sqrt(square.mean(axis=0)), score)
