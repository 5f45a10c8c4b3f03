"""The maps of a part, kept while it is remeshed: for other numbers of vertices they are the same."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...cutting.disk_charts import cut_to_disks
from ...errors import MeshError
from ...mesh.charts import Chart
from ...mesh.surface import triangle_surface
from ...progress import Steps, part_of
from ...sphere.conformal import ConformalSphere, conformal_sphere
from ..components.component_batch import piled
from ..components.components import Part, Parts, split_parts
from ..edits.long_edges import fine_enough
from .disk_images import Image, conformal_image, preserving_image
from .sphere_samples import sphere_image

# Where the time of two maps goes, as start and width.
FIRST, SECOND = (0.0, 0.5), (0.5, 0.5)


@dataclass(frozen=True)
class Maps:
    """Conformal and measure-preserving image of a chart in the unit disk, (n,2) each, or of a part on the unit sphere,
    (n,3)."""

    conformal: np.ndarray
    preserving: np.ndarray
    warnings: tuple[str, ...]

    def pair(self, strategy: str) -> tuple[np.ndarray, np.ndarray]:
        """The map to sample on and the map to triangulate on that a strategy as "app-cfp" names."""
        of = {"app": self.preserving, "cfp": self.conformal}
        first, second = strategy.split("-")
        return of[first], of[second]


class PartMaps:
    """A part with a density (m,) of its triangles: the charts into which it falls, and maps of these or of the whole.

    Each is made when it is first asked for: conformal ones once, measure-preserving ones for the last density.
    """

    def __init__(self, part: Part):
        self.part = part
        self._sphere: ConformalSphere | None = None
        self._images: dict[int, Image] = {}
        self._latest: dict[int, tuple[np.ndarray, Maps]] = {}
        # Whether to map it to the sphere: charts end at features.
        self.spherical = part.spherical and not part.lined and not part.members
        self.warnings: tuple[str, ...] = ()

    @cached_property
    def charts(self) -> list[Chart]:
        """The part cut into disks along its features, and further where that takes more cuts: the fastest ones, since
        they leave no trace."""
        surface = triangle_surface(self.part.vertices, self.part.triangles, self.part.features)
        return cut_to_disks(surface, extremities=0).charts

    def of_sphere(self, density: np.ndarray) -> Steps[Maps | None]:
        """Maps to the sphere; None, and a warning from then on, where there are none in double precision."""
        if (known := self._known(-1, density)) is not None:
            return known
        V, T = self.part.vertices, self.part.triangles
        try:
            if self._sphere is None:
                self._sphere = yield from part_of(conformal_sphere(V, T), *FIRST)
            preserving = yield from part_of(sphere_image(V, T, self._sphere, density), *SECOND)
        except MeshError as error:
            self.give_up(error.cause)
            return None
        return self._keep(-1, density, Maps(self._sphere.positions, preserving, ()))

    def give_up(self, cause: str) -> None:
        """From now on, do without the sphere."""
        self.spherical = False
        self.warnings = (f"{cause}; a part was remeshed without a map to the sphere",)

    def of_chart(self, k: int, density: np.ndarray) -> Steps[Maps]:
        """Maps of chart number k of those chosen to the disk, and warnings where they are milder than asked for."""
        if (known := self._known(k, density)) is not None:
            return known
        chart = self.charts[k]
        first = self._images.get(k) or (yield from conformal_image(chart.vertices, chart.disk))
        self._images[k] = first
        second = yield from preserving_image(chart.vertices, chart.disk, first.uv, density[chart.faces])
        return self._keep(k, density, Maps(first.uv, second.uv, first.warnings + second.warnings))

    def _known(self, k: int, density: np.ndarray) -> Maps | None:
        latest = self._latest.get(k)
        return latest[1] if latest is not None and np.array_equal(latest[0], density) else None

    def _keep(self, k: int, density: np.ndarray, maps: Maps) -> Maps:
        self._latest[k] = (density, maps)
        return maps


class Original:
    """A surface (n,3), (m,3), with edges (e,2) to keep, to be remeshed once or several times: its parts and their maps,
    made when they are first asked for."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, features: np.ndarray | None = None):
        self.vertices = np.asarray(vertices, dtype=float)
        self.triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
        empty = np.zeros((0, 2), np.int64)
        self.features = empty if features is None else np.asarray(features, np.int64).reshape(-1, 2)
        self._piles: dict[bytes, PartMaps] = {}

    @cached_property
    def parts(self) -> Parts:
        """What the surface consists of; for errors see `parts.split_parts`."""
        return split_parts(self.vertices, self.triangles, self.features)

    @cached_property
    def maps(self) -> list[PartMaps]:
        """The maps of every part."""
        return [PartMaps(fine_enough(part)) for part in self.parts.parts]

    def maps_with_pile(self, small: np.ndarray) -> list[PartMaps]:
        """The maps of every part; where several are `small` (k,) bool, those of piles instead, at the end.

        There is one pile of the parts that have lines to keep, and one of those that have none.
        """
        parts = self.parts.parts
        lined = np.array([part.lined for part in parts])
        piles = [kind for kind in (small & ~lined, small & lined) if kind.sum() > 1]
        alone = np.ones(len(parts), dtype=bool)
        for kind in piles:
            alone &= ~kind
            if kind.tobytes() not in self._piles:
                pile = piled([parts[k] for k in np.flatnonzero(kind)])
                self._piles[kind.tobytes()] = PartMaps(fine_enough(pile))
        return [self.maps[k] for k in np.flatnonzero(alone)] + [self._piles[kind.tobytes()] for kind in piles]
