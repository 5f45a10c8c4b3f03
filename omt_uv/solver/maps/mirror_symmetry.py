"""Say how vertices follow their mirror images, so that a symmetric map has fewer unknowns.

A mirror takes w to `phase` conj(w), where the phase is the square of the direction of its axis; two mirrors across one
another make a half turn, too. The energy of a symmetric map as a function of the vertices that represent their images
has the rows and slopes of all vertices, carried over by these moves, so that elements and blocks stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix


@dataclass(frozen=True)
class MirrorSymmetry:
    """The images (k,n) of every vertex in one mirror, or in two across one another.

    phase : of the first mirror in the plane; the second has the opposite one. For every vertex: representative (n,),
    one of its images, the same for all of them; flip (n,) bool and factor (n,), by which w is factor
    w[representative], conjugated where flip; line (n,), direction of the axis on which it must stay, 0 for a vertex in
    the middle, nan for one that is free
    """

    images: np.ndarray
    phase: complex
    representative: np.ndarray
    flip: np.ndarray
    factor: np.ndarray
    line: np.ndarray

    @property
    def follows(self) -> np.ndarray:
        """Vertices (n,) bool that another one represents."""
        return self.representative != np.arange(len(self.representative))

    @property
    def on_axis(self) -> np.ndarray:
        """Vertices (n,) bool that are their own images in a mirror."""
        return ~np.isnan(self.line)

    def spread(self, w: np.ndarray) -> np.ndarray:
        """The symmetric map (n,) complex that the representatives' values stand for."""
        line = np.where(self.on_axis, self.line, 0)
        w = np.where(self.on_axis, line * (w * line.conj()).real, w)[self.representative]
        return self.factor * np.where(self.flip, w.conj(), w)

    def folded(self, slope: np.ndarray) -> np.ndarray:
        """Slopes (n,) complex by all vertices as those by the representatives, 0 for the others."""
        own = np.where(self.flip, slope.conj() * self.factor, slope * self.factor.conj())
        n = len(slope)
        return np.bincount(self.representative, own.real, n) + 1j * np.bincount(self.representative, own.imag, n)

    def unknowns(self, fixed: np.ndarray) -> csr_matrix:
        """Both coordinates of every vertex in turn, (2n,k), by what may be chosen freely of a change of the map.

        Representatives change, and what follows them; but not where one of these is fixed (n,) bool.
        """
        n = len(fixed)
        stays = np.zeros(n, bool)
        stays[self.representative[fixed]] = True
        free = ~stays & ~self.follows
        both, along = free & ~self.on_axis, free & self.on_axis & (self.line != 0)
        columns = np.concatenate([np.flatnonzero(both), np.flatnonzero(both), np.flatnonzero(along)])
        values = np.concatenate([np.full(both.sum(), 1.0 + 0j), np.full(both.sum(), 1j), self.line[along]])
        chosen = coo_matrix((values, (columns, np.arange(len(columns)))), shape=(n, len(columns))).tocsr()
        w = chosen[self.representative].tocoo()
        w.data = self.factor[w.row] * np.where(self.flip[w.row], w.data.conj(), w.data)
        rows, values = np.concatenate([2 * w.row, 2 * w.row + 1]), np.concatenate([w.data.real, w.data.imag])
        found = csr_matrix((values, (rows, np.tile(w.col, 2))), shape=(2 * n, len(columns)))
        found.eliminate_zeros()
        return found

    def carried(self, vertices: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Linear forms by vertices (k,q), rows of any shape (k,...,q), as forms by representatives."""
        shape = len(vertices), *[1] * (rows.ndim - 2), vertices.shape[1]
        rows = rows * self.factor[vertices].reshape(shape)
        return self.representative[vertices], np.where(self.flip[vertices].reshape(shape), rows.conj(), rows)

    def restricted(self, vertices: np.ndarray, place: np.ndarray) -> MirrorSymmetry:
        """That of some vertices (k,), whole images, of which vertex i is vertex place[i]."""
        return replace(
            self,
            images=place[self.images[:, vertices]],
            representative=place[self.representative[vertices]],
            flip=self.flip[vertices],
            factor=self.factor[vertices],
            line=self.line[vertices],
        )

    def with_part(self, other: MirrorSymmetry, vertices: np.ndarray) -> MirrorSymmetry:
        """This symmetry with another one of some vertices (k,), which had none so far."""
        arrays = {}
        for name in ("flip", "factor", "line"):
            arrays[name] = getattr(self, name).copy()
            arrays[name][vertices] = getattr(other, name)
        representative = self.representative.copy()
        representative[vertices] = vertices[other.representative]
        return replace(self, representative=representative, **arrays)

    def averaged(self, w: np.ndarray) -> np.ndarray:
        """A map w (n,) complex averaged with its images."""
        found = w + self.phase * w[self.images[0]].conj()
        if len(self.images) == 2:
            found = found - self.phase * w[self.images[1]].conj() - w[self.images[0][self.images[1]]]
        return self.spread(found / 2 ** len(self.images))


def mirror_symmetry(images: np.ndarray, phase: complex = 1.0, w: np.ndarray | None = None) -> MirrorSymmetry:
    """The symmetry of images (k,n) in one mirror, or in two, whose first one has this phase in the plane.

    w (n,) complex : a symmetric map about the axis; vertices on its left, or in one quarter of it, represent the others
    then, so that hardly any face has representatives from both sides. By default those of the lowest numbers do.
    """
    n = images.shape[1]
    # What takes a vertex to its image, by number: nothing, the mirrors, and both of them.
    moves = orbits(images)
    flips, factors = np.array([False, True, True, False]), np.array([1, phase, -phase, -1])
    rank = np.arange(n)
    if w is not None:
        turned = w * np.sqrt(np.conj(complex(phase)))
        rank = rank - n * (2 * (turned.imag > 0) + (turned.real > 0))
    lowest = np.argmin(rank[moves], axis=0)
    axes = np.sqrt(np.array([phase, -phase], complex))
    line = np.full(n, np.nan, complex)
    for image, axis in zip(images, axes, strict=False):
        fixed = image == np.arange(n)
        line[fixed] = np.where(np.isnan(line[fixed]), axis, 0)
    return MirrorSymmetry(
        images=images,
        phase=complex(phase),
        representative=np.take_along_axis(moves, lowest[None], axis=0)[0],
        flip=flips[lowest],
        factor=factors[lowest],
        line=line,
    )


def orbits(images: np.ndarray) -> np.ndarray:
    """What nothing, every mirror and both of them take a vertex, or a face, to, (2 or 4, n), by the images (k,n)."""
    own = np.arange(images.shape[1])[None]
    return np.concatenate([own, images, *([images[0][images[1]][None]] if len(images) == 2 else [])])


def without_symmetry(n: int) -> MirrorSymmetry:
    """n vertices of which none follows another."""
    return MirrorSymmetry(
        images=np.arange(n)[None],
        phase=1.0,
        representative=np.arange(n),
        flip=np.zeros(n, bool),
        factor=np.ones(n, complex),
        line=np.full(n, np.nan, complex),
    )
