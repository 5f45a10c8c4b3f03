"""State how charts are made and mapped, in one dataclass for a chart and one for a surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..analysis.seam_costs import SeamPreferences
from ..cutting.disk_charts import SEAMS
from ..errors import CUT_FURTHER, percent, plural
from ..mesh.geometry import face_areas
from ..mesh.surface import Surface
from ..mesh.topology import triangle_parts
from ..refinement.continuation_rules import QUALITIES
from ..refinement.refine import BOUNDARIES

KINDS = ("authalic", "conformal", "polar")
MOST_ASPECT = 1e4
# Parts of less than this share of the area, if all of them together have no more than that one, may shear as much as
# this power of a bound: an eye is not slit for what nobody sees, and the mean of the whole hardly moves.
SMALL_PART = 0.03
SMALL_PARTS = 0.08
LENIENCE = 1.4


@dataclass(frozen=True)
class ShearBound:
    """A bound of the mean shear s1/s2 of charts, > 1; further: of those whose seams were marked by hand, too;
    preferences: where the cuts for it had better be; beside: the area of what goes into the texture besides.

    With balance the areas are not exact: the shear then stands for that of the map with exact areas that has the same
    symmetric Dirichlet energy (r + 1/r) (q + 1/q), from the area ratio r and the shear q.
    """

    bound: float
    further: bool = False
    preferences: SeamPreferences = field(default_factory=SeamPreferences)
    beside: float = 0.0

    def __post_init__(self):
        if not self.bound > 1:
            raise ValueError(f"no map shears less than 1; the bound must be greater, not {self.bound}")

    def lenience(self, surface: Surface, faces: np.ndarray | None) -> np.ndarray:
        """The power (f,) of the bound that every polygon may shear: more than 1 for small parts of the polygons
        `faces` (f,) bool of a surface, all by default."""
        triangles = surface.corner_vertex[surface.triangles]
        part = triangle_parts(triangles, len(surface.positions))
        chosen = 1.0 if faces is None else faces[surface.triangle_face]
        area = np.bincount(part, chosen * face_areas(surface.positions, triangles))
        small = area < SMALL_PART * area.sum()
        found = np.ones(len(surface.face_start) - 1)
        if area[small].sum() <= SMALL_PARTS * area.sum():
            found[surface.triangle_face[small[part]]] = LENIENCE
        return found

    def missed(self, mean: np.ndarray, area: np.ndarray, by_hand: np.ndarray, why: str) -> Iterator[str]:
        """Warnings of charts of such areas (k,) and mean shear (k,) above the bound, those with seams marked by hand
        (k,) bool apart; why others are."""
        # "1.35, above 1.35" helps nobody.
        missed = np.round(mean, 2) > self.bound
        for chosen, what in (
            (missed & by_hand, f"its seams were marked by hand. {CUT_FURTHER}"),
            (missed & ~by_hand, why),
        ):
            if chosen.any():
                count, share = int(chosen.sum()), area[chosen].sum() / area.sum()
                # Of a whole surface there is no share to tell.
                part = "" if share == 1 else f", {percent(share)} of the surface,"
                who = plural(count, f"An island{part} shears", f"{{}} islands{part} shear")
                what = what if count == 1 else what.replace("its seams", "their seams")
                yield f"{who} {mean[chosen].max():.3g} in the mean, above {self.bound:.3g}: {what}"


@dataclass(frozen=True)
class MapOptions:
    """How a chart is mapped.

    Attributes
    ----------
    boundary : "free" for the least shear; "disk", "square" or "rectangle", which every chart then fills
    quality : "draft", "standard" or "exact", how small the area error of single faces becomes
    balance : from 0, exact areas, to 1, least shear
    kind : "authalic", refined to exact areas; "conformal" or "polar", as papers have them: see `canonical.named_maps`
    aspect : height over width of a rectangle; 0 for that of the conformal map

    Raises
    ------
    ValueError : a boundary, a quality or a kind that is none of these, a balance outside of [0, 1]
    """

    boundary: str = "free"
    quality: str = "standard"
    balance: float = 0.0
    kind: str = "authalic"
    aspect: float = 0.0

    def __post_init__(self):
        _check("boundary", self.boundary, BOUNDARIES)
        _check("quality", self.quality, QUALITIES)
        if not 0 <= self.balance <= 1:
            raise ValueError(f"balance must lie in [0, 1], not {self.balance}")
        _check("kind", self.kind, KINDS)
        if not 0 <= self.aspect < MOST_ASPECT:
            raise ValueError(f"the aspect of a rectangle must lie in [0, {MOST_ASPECT:g}), not {self.aspect}")


@dataclass(frozen=True)
class UnwrapOptions(MapOptions):
    """How a surface becomes charts, and how these are mapped.

    Attributes
    ----------
    seams : "auto" cuts, for the map only; "existing" splits along the seams of the surface alone and refuses what is
        no disk. Both repair what is broken, for the map only
    fill_holes : fill all boundaries of a component but the longest, for the map only, instead of cutting to them
    max_shear : with "auto", and a free boundary, seams are added until the mean shear s1/s2 of charts is at most this,
        > 1; 0 for none that no disk needs. Parts whose seams were marked by hand are left as they are
    cut_further : parts whose seams were marked by hand get more of them, too
    preferences : where these seams had better be
    beside : the area of other surfaces in the same texture: what is long by itself is short beside much else

    Raises
    ------
    ValueError : see `MapOptions`; seams that are neither, a bound that no map can keep
    """

    seams: str = "auto"
    fill_holes: bool = False
    max_shear: float = 0.0
    cut_further: bool = False
    preferences: SeamPreferences = field(default_factory=SeamPreferences)
    beside: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        _check("seams", self.seams, SEAMS)
        if self.max_shear and not self.max_shear > 1:
            raise ValueError(f"no map shears less than 1; the bound must be greater, not {self.max_shear}")

    def shear_bound(self) -> ShearBound | None:
        """The bound of the shear that seams are searched for; None where none are."""
        if not self.max_shear or self.seams != "auto" or self.boundary != "free" or self.kind != "authalic":
            return None
        return ShearBound(self.max_shear, self.cut_further, self.preferences, self.beside)


def _check(name: str, value: str, allowed) -> None:
    if value not in allowed:
        raise ValueError(f"{name} must be one of {', '.join(allowed)}, not {value!r}")
