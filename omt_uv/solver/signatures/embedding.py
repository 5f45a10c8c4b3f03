"""What a matrix of distances says: a map of all things to the plane, and what class the nearest ones have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def classical_scaling(distances: np.ndarray, dimensions: int = 2) -> np.ndarray:
    """Places (n,d) whose distances are near those of a symmetric matrix (n,n), by the eigenvectors of its squares
    (Torgerson 1952); the first of each column's greatest entries is positive.

    >>> import numpy as np
    >>> from omt_uv.solver.signatures.embedding import classical_scaling
    >>> line = np.array([0, 1, 3.0])
    >>> float(np.ptp(classical_scaling(abs(line[:, None] - line))[:, 0]).round(9))
    3.0
    """
    n = len(distances)
    centre = np.eye(n) - 1 / n
    value, vector = np.linalg.eigh(-centre @ (np.asarray(distances, float) ** 2) @ centre / 2)
    value, vector = value[::-1][:dimensions], vector[:, ::-1][:, :dimensions]
    sign = np.sign(vector[np.abs(vector).argmax(axis=0), np.arange(vector.shape[1])])
    return vector * np.where(sign == 0, 1, sign) * np.sqrt(np.maximum(value, 0))


def classes_of_nearest(distances: np.ndarray, classes: Sequence[str], count: int) -> list[str]:
    """The class that most of the `count` nearest others have, of each row of a matrix (n,n); of several, that of the
    nearest; entries that are not finite are of no neighbour."""
    away = np.array(distances, float)
    np.fill_diagonal(away, np.inf)
    names, number = np.unique(np.asarray(classes, str), return_inverse=True)
    order = np.argsort(away, axis=1, kind="stable")[:, :count]
    near = number[order]
    sound = np.isfinite(np.take_along_axis(away, order, axis=1))
    # Less and less for what comes later, so that no two classes are level.
    vote = sound * (1 + 1e-3 / (1 + np.arange(order.shape[1])))
    total = np.zeros((len(away), len(names)))
    np.add.at(total, (np.arange(len(away))[:, None], near), vote)
    return [str(names[k]) for k in total.argmax(axis=1)]
