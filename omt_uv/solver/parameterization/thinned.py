"""Search the seams of a large body with limbs on some of its vertices alone: maps of these are quick.

Where no cut that was rehearsed comes near the bound, parts lie in each other's way, and it takes rounds of maps to tell
which have to come apart. What seams leave a map to shear hangs on where they run, and hardly on how fine the triangles
are: so all these rounds are made of a body with a fraction of the vertices. Its seams are led along the edges of the
whole, which has one map of its own then, and is cut further where that misses the bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..cutting.component import CutComponent, fingerprint
from ..errors import MeshError
from ..mesh.charts import check_disks, strict_charts
from ..mesh.geometry import edge_lengths
from ..mesh.surface import Surface, is_sharp, triangle_surface
from ..mesh.topology import edge_runs, pair_keys
from ..progress import Steps, part_of
from ..seams.coarse_surface import COMMON, coarsening
from ..seams.fine_paths import led_along
from ..seams.search import SeamSearch

# Parts with more vertices are thinned, to so many,
LARGE = 100_000
THINNED = 20_000
# where a rehearsal has so many times the square of log(shear) that is asked for.
CROWDED = 1.15
# Where the time goes, roughly: that of the search that tells whether it is.
RUN = 0.3


@dataclass(frozen=True)
class ThinnedSearch(SeamSearch):
    """A search for seams that goes on on a thinned surface where a part is large and crowded.

    seams_of : gives the seams (k,2) of a small surface, with vertices (n,) in [0,1] to keep free of them
    thinned : polygons (k,) of parts whose seams were found so, to which this search adds
    """

    seams_of: Callable[[Surface, np.ndarray], Steps[np.ndarray]] | None = None
    thinned: list[np.ndarray] | None = None

    def _searched(self, component: CutComponent, base: np.ndarray) -> Steps[np.ndarray]:
        if self.seams_of is None or self.thinned is None or not self._may_be_thinned(component):
            return (yield from super()._searched(component, base))
        edges = yield from part_of(super()._searched(component, base), 0.0, RUN)
        name = fingerprint(component)
        found = self.memory.get(name)
        if found is None or (found.rehearsed or 0.0) <= CROWDED * self.asked:
            return edges
        thinned = yield from part_of(self._of_thinned(self.priced(component), self.seams_of), RUN, 1 - RUN)
        if thinned is None:
            return edges
        # What was found first is not gone on from.
        del self.memory[name]
        self.thinned.append(component.polygons)
        return thinned

    def _may_be_thinned(self, component: CutComponent) -> bool:
        """Whether a part is large, and nothing hangs on its single edges: no density, no holes that are filled, no
        edges marked sharp, and no mirror images vertex by vertex, which seams are to have, too."""
        if self.is_again or component.vertex_count <= LARGE or self.density is not None:
            return False
        if (component.polygons < 0).any() or is_sharp(
            self.surface, pair_keys(*component.vertex_ids[component.ends].T)
        ).any():
            return False
        mirror = self._mirror(component)
        return mirror is None or not mirror.exact

    def _of_thinned(
        self, component: CutComponent, seams_of: Callable[[Surface, np.ndarray], Steps[np.ndarray]]
    ) -> Steps[np.ndarray | None]:
        """Edges (e,) bool of a part along the seams of a thinned one; None where that has no map, or what comes of its
        seams are no disks."""
        coarse = coarsening(component.positions, component.triangles, THINNED // COMMON).ended(THINNED)
        surface = triangle_surface(coarse.positions, coarse.triangles)
        try:
            seams = yield from part_of(seams_of(surface, component.avoid[coarse.kept]), 0.0, 0.95)
        except MeshError:
            # A thinned surface can be worse than the one that it stands for.
            return None
        if not len(seams):
            return None
        # Where charts are disks, all seams hang together: another one is a slit in a face, which was filled.
        run = edge_runs(np.where(coarse.boundary[seams], len(coarse.kept), seams))
        seams = seams[run == np.bincount(run, edge_lengths(coarse.positions, seams)).argmax()]
        edges = led_along(component, coarse, seams)
        cut = replace(triangle_surface(component.positions, component.triangles), seams=component.ends[edges])
        try:
            check_disks(strict_charts(cut))
        except MeshError:
            return None
        return edges
