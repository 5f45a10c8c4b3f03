"""Bodies with very many handles, as plates full of holes, taken apart into their sides.

A cut that opens a hundred handles leaves a chart that has no room for the walls between them.
"""

from __future__ import annotations

import numpy as np

from .holes import hole_rims
from .nets import HARD
from .piece import Kind, classify, fold_angles
from .sheets import Sheets, components, corner_classes


def parting_pairs(sheets: Sheets, positions: np.ndarray, one_sided: np.ndarray, most: int) -> np.ndarray:
    """Pairs (p,) bool along which parts with more than `most` handles fall apart; none where that leaves as many.

    These are the hard edges around the holes of sides: from a plate come away the walls of the holes through it,
    each in one piece. positions (n,3) of the surface; one_sided (m,) bool: see `piece.classify`.
    """
    part, whole = _kinds(sheets, one_sided)
    crowded = (whole.handles > most)[part[sheets.first // 3]]
    if not crowded.any():
        return crowded
    pair = np.stack([sheets.first, sheets.second], axis=1)
    hard = crowded & (np.abs(fold_angles(positions, sheets.vertex[sheets.triangles], pair)) > HARD)
    around = np.zeros(3 * len(sheets.triangles), dtype=bool)
    around[hole_rims(positions, sheets.without(hard), one_sided)[0]] = True
    gone = hard & around[pair].any(axis=1)
    # What ends inside of a side is a slit, which parts nothing.
    side = components(sheets.without(gone))[pair // 3]
    gone &= side[:, 0] != side[:, 1]
    side, left = _kinds(sheets.without(gone), one_sided)
    handles = np.zeros(len(whole.handles), dtype=np.int64)
    np.maximum.at(handles, part, left.handles[side])
    return gone & (handles <= most)[part[sheets.first // 3]]


def _kinds(sheets: Sheets, one_sided: np.ndarray) -> tuple[np.ndarray, Kind]:
    """The part (m,) of every triangle, and the kinds of the parts."""
    part = components(sheets)
    return part, classify(sheets, corner_classes(sheets), part, one_sided)
