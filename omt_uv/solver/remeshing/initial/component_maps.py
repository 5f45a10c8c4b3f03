"""Keep the maps of a surface's components while it is remeshed: for other vertex counts they are the same."""

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
from ..components.component_batch import batched
from ..components.components import Component, Components, split_components
from ..components.own_frame import OwnFrame, in_own_frame
from ..edits.long_edges import refine_for_maps
from .disk_images import DiskImage, conformal_image, preserving_image
from .sphere_samples import sphere_image

# Where the time of the first map goes, as start and width,
FIRST = (0.0, 0.5)
# and that of the second.
SECOND = (0.5, 0.5)


@dataclass(frozen=True)
class ComponentImages:
    """Conformal and measure-preserving image of a chart in the unit disk, (n,2) each, or of a component on the unit
    sphere, (n,3)."""

    conformal: np.ndarray
    preserving: np.ndarray
    warnings: tuple[str, ...]

    def pair(self, strategy: str) -> tuple[np.ndarray, np.ndarray]:
        """The image to sample on and the image to triangulate on that a strategy as "app-cfp" names."""
        of = {"app": self.preserving, "cfp": self.conformal}
        first, second = strategy.split("-")
        return of[first], of[second]


class ComponentMaps:
    """The charts into which a component falls, and maps of these to the disk or of the whole to the sphere.

    Each is made when it is first asked for: conformal ones once, measure-preserving ones for the last density.
    """

    def __init__(self, component: Component):
        self.component = component
        self._sphere: ConformalSphere | None = None
        self._images: dict[int, DiskImage] = {}
        self._latest: dict[int, tuple[np.ndarray, ComponentImages]] = {}
        # Whether to map it to the sphere: charts end at features.
        self.by_sphere = component.is_sphere and not component.has_lines and not component.members
        self.warnings: tuple[str, ...] = ()

    @cached_property
    def charts(self) -> list[Chart]:
        """The component cut into disks along its features, and further where that takes more cuts: the fastest ones,
        since they leave no trace."""
        surface = triangle_surface(self.component.vertices, self.component.triangles, self.component.features)
        return cut_to_disks(surface, extremities=0).charts

    def of_sphere(self, density: np.ndarray) -> Steps[ComponentImages | None]:
        """Map the component to the sphere, with a density (m,); None, and a warning from then on, where there is no map
        in double precision."""
        if (known := self._known(-1, density)) is not None:
            return known
        V, T = self.component.vertices, self.component.triangles
        try:
            if self._sphere is None:
                self._sphere = yield from part_of(conformal_sphere(V, T), *FIRST)
            preserving = yield from part_of(sphere_image(V, T, self._sphere, density), *SECOND)
        except MeshError as error:
            self.give_up(error.cause)
            return None
        return self._keep(-1, density, ComponentImages(self._sphere.positions, preserving, ()))

    def give_up(self, cause: str) -> None:
        """From now on, do without the sphere."""
        self.by_sphere = False
        self.warnings = (f"{cause}; a part was remeshed without a map to the sphere",)

    def of_chart(self, k: int, density: np.ndarray) -> Steps[ComponentImages]:
        """Map chart number k to the disk, with a density (m,) of the component; warnings where it is milder."""
        if (known := self._known(k, density)) is not None:
            return known
        chart = self.charts[k]
        first = self._images.get(k) or (yield from conformal_image(chart.vertices, chart.disk))
        self._images[k] = first
        second = yield from preserving_image(chart.vertices, chart.disk, first.uv, density[chart.faces])
        return self._keep(k, density, ComponentImages(first.uv, second.uv, first.warnings + second.warnings))

    def _known(self, k: int, density: np.ndarray) -> ComponentImages | None:
        latest = self._latest.get(k)
        return latest[1] if latest is not None and np.array_equal(latest[0], density) else None

    def _keep(self, k: int, density: np.ndarray, maps: ComponentImages) -> ComponentImages:
        self._latest[k] = (density, maps)
        return maps


class RemeshSource:
    """A surface to be remeshed once or several times: vertices (n,3), triangles (m,3), and features (e,2), pairs of
    vertices whose edges are to be lines of the new mesh.

    Its frame, its components and their maps are made when they are first asked for, and kept.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, features: np.ndarray | None = None):
        self.vertices = np.asarray(vertices, dtype=float)
        self.triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
        empty = np.zeros((0, 2), np.int64)
        self.features = empty if features is None else np.asarray(features, np.int64).reshape(-1, 2)
        self._batches: dict[bytes, ComponentMaps] = {}

    @cached_property
    def frame(self) -> OwnFrame:
        """The surface in its own frame."""
        return in_own_frame(self.vertices, self.triangles, self.features)

    @cached_property
    def components(self) -> Components:
        """What the surface consists of, in its own frame; for errors see `components.split_components`."""
        return split_components(self.frame.vertices, self.frame.triangles, self.frame.features)

    @cached_property
    def maps(self) -> list[ComponentMaps]:
        """The maps of every component."""
        return [ComponentMaps(refine_for_maps(component)) for component in self.components.components]

    def maps_with_batches(self, small: np.ndarray) -> list[ComponentMaps]:
        """The maps of every component; where several are `small` (k,) bool, those of batches instead, at the end.

        There is one batch of the components that have lines to keep, and one of those that have none.
        """
        components = self.components.components
        has_lines = np.array([component.has_lines for component in components])
        batches = [kind for kind in (small & ~has_lines, small & has_lines) if kind.sum() > 1]
        alone = np.ones(len(components), dtype=bool)
        for kind in batches:
            alone &= ~kind
            if kind.tobytes() not in self._batches:
                batch = batched([components[k] for k in np.flatnonzero(kind)])
                self._batches[kind.tobytes()] = ComponentMaps(refine_for_maps(batch))
        return [self.maps[k] for k in np.flatnonzero(alone)] + [self._batches[kind.tobytes()] for kind in batches]
