"""Put right what flat faces make of a flow: volumes that they lose, and pairs of them that meet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..contact.new_crossings import NewCrossings, touched
from ..contact.self_intersections import FaceCrossings
from .creases import MOST_HELD, FlowRegion, closer, farthest_mended, taken_apart
from .enclosed_volume import EnclosedParts, restore_volumes

# Rounds of giving volumes back after faces were taken apart on the way.
SETTLINGS = 6
# What has gone back by more than this share of what mending may, has.
BACK = 1e-3
# A relative change of volume that is more than rounding.
CHANGED = 1e-6


@dataclass(frozen=True)
class SoundFrame:
    """Positions (n,3) of a frame, pairs (k,2) of triangles that newly intersect, and what was mended (n,) bool."""

    positions: np.ndarray
    pairs: np.ndarray
    mended: np.ndarray


@dataclass(frozen=True)
class FlowShape:
    """Points (n,3) before the flow, triangles (m,3), none in the plane, and which points (n,) bool may be put right."""

    points: np.ndarray
    triangles: np.ndarray
    free: np.ndarray

    @cached_property
    def parts(self) -> EnclosedParts:
        """Connected parts of the triangles."""
        return EnclosedParts.of(self.triangles, len(self.points))

    @cached_property
    def crossings(self) -> NewCrossings:
        """What is asked which triangles newly intersect."""
        return NewCrossings(self.points, FaceCrossings(self.triangles))

    def changes(self, after: np.ndarray) -> np.ndarray:
        """Relative changes (c,) of the volumes of closed parts."""
        if not len(self.triangles):
            return np.zeros(0)
        old, new = self.parts.volumes(self.points), self.parts.volumes(after)
        closed = self.parts.closed & (old != 0)
        return (new[closed] - old[closed]) / np.abs(old[closed])

    def sound(self, after: np.ndarray, mend: bool) -> SoundFrame:
        """Positions with the volumes of before and, with `mend`, no faces that newly intersect; pairs that still do."""
        none, nothing = np.zeros((0, 2), np.int64), np.zeros(len(after), bool)
        if not len(self.triangles):
            return SoundFrame(after, none, nothing)
        restored, _ = restore_volumes(self.points, after, self.parts, self.free)
        if not mend:
            return SoundFrame(restored, none, nothing)
        concerned = touched(self.points, restored, self.triangles)
        move, farthest = (self.points, restored), farthest_mended(self.points, self.triangles)
        mended, pairs = taken_apart(move, self.crossings, self.free, farthest, concerned)
        if mended is restored:
            return SoundFrame(restored, pairs, nothing)
        # What has not been mended keeps its place, and needs no further look.
        moved = (mended != restored).any(axis=1)
        around = np.zeros(len(moved), bool)
        around[self.triangles[moved[self.triangles].any(axis=1)]] = True
        result, _ = restore_volumes(self.points, mended, self.parts, self.free & around)
        concerned = around[self.triangles].any(axis=1)
        concerned[pairs] = True
        return SoundFrame(result, self._apart(result, concerned), moved)

    def _apart(self, at: np.ndarray, concerned: np.ndarray) -> np.ndarray:
        """Pairs (k,2) with a triangle that is `concerned` (m,) bool that newly intersect, and were apart."""
        return self.crossings.apart(self.crossings.pairs(at, concerned))

    def settled(self, apart: np.ndarray, regions: list[FlowRegion]) -> SoundFrame:
        """The same of positions `apart` (n,3) with faces apart; of these, vertices of regions may move."""
        inside = np.zeros(len(apart), bool)
        inside[np.concatenate([region.rows for region in regions])] = True
        concerned, mine = inside[self.triangles].any(axis=1), self.free & inside
        movable, farthest = mine, farthest_mended(self.points, self.triangles)
        for _ in range(SETTLINGS):
            restored, _ = restore_volumes(self.points, apart, self.parts, movable)
            mended, pairs = taken_apart((apart, restored), self.crossings, mine, farthest, concerned)
            if len(pairs):
                mended, pairs = self._brought((apart, restored), regions, (mended, pairs), concerned)
            if mended is restored:
                break
            # What had to go back does not take part in the next round.
            movable = movable & (np.abs(mended - restored).max(axis=1) <= BACK * farthest)
            apart = mended
        if np.abs(self.changes(restored)).max(initial=0.0) > CHANGED:
            # Volumes come first: what is left of pairs is said.
            restored, _ = restore_volumes(self.points, restored, self.parts, mine)
            pairs = self._apart(restored, concerned)
        return SoundFrame(restored, pairs, inside)

    def _brought(self, move, regions: list[FlowRegion], found, concerned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions (n,3) and pairs (k,2) with regions as near to where the second of a move (n,3) has them as faces
        let them come from the first, or what was `found`; pairs have a triangle that is `concerned` (m,) bool."""
        apart, mended = move[0], found[0].copy()
        meeting = np.unique(self.triangles[found[1]])
        for region in regions:
            if len(region.rows) <= MOST_HELD and np.isin(region.rows, meeting).any():
                mended[region.rows] = closer(region, apart[region.rows], move[1][region.rows])
        pairs = self._apart(mended, concerned)
        return (mended, pairs) if len(pairs) < len(found[1]) else found
