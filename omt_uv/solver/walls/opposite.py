"""Find the faces of a body that have others a little beneath them which look the other way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.geometry import dot3, face_areas, face_normals, lengths

# What is opposite is beneath a face by less than this share of the side of a square with the area of the body, looks
# the other way by that cosine at least, and is no farther aside than it is beneath, but for so many sides of a face.
THIN = 0.1
AGAINST = 0.8
ASIDE = 1.5
# Either is so many times as far as the other one at most.
EVEN = 2.0
# Of places that are as near, those whose normals differ by 1 are farther by this share of the same side.
TURNED = 0.5
# Of so many faces nearly as many are opposite to some, or no others are looked at; these are sought among so many.
SAMPLES = 64
LIKELY = 0.6
SOUGHT = 20_000


@dataclass(frozen=True)
class Faces:
    """Middles (m,3), unit normals (m,3), areas (m,) and sides (m,), of a square with that area, of the faces of a body.

    >>> import numpy as np
    >>> V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.0, 0, -0.05], [1, 0, -0.05], [0, 1, -0.05]])
    >>> both = Faces.of(V, np.array([[0, 1, 2], [3, 5, 4]]))
    >>> both.are_likely(), both.opposite().tolist()
    (True, [True, True])
    """

    middle: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    size: np.ndarray

    @staticmethod
    def of(positions: np.ndarray, triangles: np.ndarray) -> Faces:
        area = face_areas(positions, triangles)
        return Faces(positions[triangles].mean(axis=1), face_normals(positions, triangles), area, np.sqrt(area))

    def are_likely(self) -> bool:
        """Whether most of a few faces, each for as much of the area, have others beneath them."""
        reached = np.cumsum(self.area)
        rows = np.searchsorted(reached, (np.arange(SAMPLES) + 0.5) / SAMPLES * reached[-1])
        step = -(-len(self.area) // SOUGHT)
        among = np.arange(0, len(self.area), step)
        return bool(self._beneath(np.minimum(rows, len(self.area) - 1), among, step)[1].mean() >= LIKELY)

    def opposite(self) -> np.ndarray:
        """Which faces (m,) bool have another one opposite, as far from it."""
        every = np.arange(len(self.area))
        beneath, found = self._beneath(every, every)
        # Beneath the border there may be a bend of the wall, whose other side is nearer to it than the border is.
        far = lengths(self.middle[beneath] - self.middle)
        return found & (far <= EVEN * far[beneath])

    def _beneath(self, rows: np.ndarray, among: np.ndarray, step: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """For faces rows (k,) the one of `among` (a,), one in so many of them, that is nearest to being opposite (k,),
        and whether it is (k,) bool."""
        side = float(np.sqrt(self.area.sum()))
        tree = cKDTree(np.hstack([self.middle[among], TURNED * side * self.normal[among]]))
        found = among[tree.query(np.hstack([self.middle[rows], -TURNED * side * self.normal[rows]]))[1]]
        way, normal = self.middle[found] - self.middle[rows], self.normal[rows]
        beneath = -dot3(way, normal)
        aside = lengths(way + beneath[:, None] * normal)
        room = ASIDE * np.sqrt(step) * np.maximum(self.size[rows], self.size[found])
        is_beneath = (beneath > 0) & (beneath < THIN * side) & (aside <= beneath + room)
        return found, is_beneath & (dot3(normal, self.normal[found]) < -AGAINST)
