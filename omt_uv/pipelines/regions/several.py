"""Magnify several regions, each by a factor of its own, to shares that are exact together.

From existing UVs, every island gives each region the factor times its share of the island; from the mesh, all surfaces
together do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...settings import MagnifySettings
from ...solver.analysis.density import normalised_density
from ...solver.analysis.joint_density import joint_density, shares_of
from ...solver.editing.magnify import OUTLINES
from ...solver.editing.magnify_regions import JointMagnification, magnify_regions
from ...solver.editing.uv_islands import Island
from ...solver.errors import BoundaryError, MeshError, WeightError
from ...solver.maps.distortion import distortion
from ...solver.mesh.charts import triangle_rows
from ...solver.mesh.geometry import signed_areas
from ...solver.parameterization.chart_indices import located
from ...solver.progress import Steps, part_of
from ..layout import PlacedIsland, Refusal, UnwrapJob, corner_uvs, grown_together
from ..magnify import MISSED, Magnified, Region, check_weights, islands_of, region_triangles, unwrap_jobs, uv_areas
from ..unwrap import lay_out

# Runs from the mesh that ask for what the one before has missed, at most; and relative errors that need none.
REPEATS = 3
EXACT_SHARES = 1e-3


@dataclass(frozen=True)
class NamedRegion:
    """A region by its name, its factor, and what of it is on each surface."""

    name: str
    factor: float
    parts: tuple[Region, ...]


@dataclass(frozen=True)
class JointShares:
    """Shares (k,) of regions by their names: before, as they shall be, and as measured in the result."""

    names: tuple[str, ...]
    before: np.ndarray
    target: np.ndarray
    after: np.ndarray

    def report(self) -> list[dict]:
        """Figures for a report."""
        rows = zip(self.names, self.before, self.target, self.after, strict=True)
        return [{"region": n, "before": float(b), "asked": float(t), "after": float(a)} for n, b, t, a in rows]

    def said(self) -> tuple[tuple[str, str], ...]:
        """What the panel shows."""
        return tuple(
            (name, f"{100 * before:.3f} % to {100 * after:.3f} %")
            for name, before, after in zip(self.names, self.before, self.after, strict=True)
        )

    def text(self) -> str:
        """One sentence for the user."""
        rows = zip(self.names, self.before, self.after, self.target, strict=True)
        parts = (f"{n} from {100 * b:.4g} % to {100 * a:.4g} % ({100 * t:.4g} % asked)" for n, b, a, t in rows)
        return f"Of the texture, {', '.join(parts)}"

    def warnings(self) -> tuple[str, ...]:
        """What is to be said where regions have missed their targets."""
        rows = zip(self.names, self.after, self.target, strict=True)
        return tuple(
            f"{name} has {100 * after:.4g} % of the texture instead of {100 * target:.4g} %"
            for name, after, target in rows
            if abs(after / target - 1) > MISSED
        )


def region_factors(texts: Sequence[str]) -> list[tuple[str, float]]:
    """Pairs of name and factor from texts such as "eyes=3".

    >>> region_factors(["eyes=3", "mouth = 1.5"])
    [('eyes', 3.0), ('mouth', 1.5)]

    Raises ValueError for what is none, or named twice.
    """
    found = []
    for text in texts:
        name, _, factor = text.rpartition("=")
        try:
            found.append((name.strip(), float(factor)))
        except ValueError as error:
            raise ValueError(f"{text!r} is no region and factor such as eyes=3") from error
        if not found[-1][0]:
            raise ValueError(f"{text!r} names no region; write it as eyes=3")
    names = [name for name, _ in found]
    if len(set(names)) < len(names):
        raise ValueError("a region is named twice")
    return found


def magnify_several(regions: Sequence[NamedRegion], settings: MagnifySettings) -> Steps[Magnified]:
    """Magnify several regions of surfaces by factors of their own, as the settings say but for their factor.

    Raises
    ------
    Refusal : with the index of the surface and the MeshError that says why
    MarginError : the margins leave no room
    """
    for region in regions:
        for index, part in enumerate(region.parts):
            try:
                check_weights(part)
            except MeshError as error:
                raise Refusal(index, error) from error
    if settings.source == "uv":
        return (yield from _from_uv(regions, settings))
    return (yield from _from_mesh(regions, settings))


def _factors(regions: Sequence[NamedRegion], settings: MagnifySettings) -> np.ndarray:
    """The factors (k,) of all magnifications in a row."""
    return np.array([region.factor for region in regions], float) ** settings.cascade


# ---- from the mesh ------------------------------------------------------------------------------------------


def _from_mesh(regions: Sequence[NamedRegion], settings: MagnifySettings) -> Steps[Magnified]:
    """Unwrap with the density as target, again for what it misses of the shares."""
    surfaces = regions[0].parts
    parts = [region_triangles(part) for part in surfaces]
    weights = [
        np.array([region.parts[k].of_triangles(rows) for region in regions]) for k, (rows, *_) in enumerate(parts)
    ]
    area, every = np.concatenate([a for _, a, _ in parts]), np.concatenate(weights, axis=1)
    try:
        asked = joint_density(every, area, list(_factors(regions, settings)), settings.exact)
    except MeshError as error:
        raise Refusal(0, error) from error
    found, width = asked, 1 / REPEATS
    for k in range(REPEATS):
        jobs = _jobs(surfaces, parts, normalised_density(found.density, area), np.log(found.density))
        plain = replace(settings, boundary="free") if settings.boundary == "own" else settings
        layout = yield from part_of(lay_out(jobs, plain), k * width, width)
        rows = zip(surfaces, parts, layout.corners, layout.uv, strict=True)
        after = shares_of(every, np.concatenate([uv_areas(*row) for row in rows]))
        missed = asked.target_shares / after
        if not settings.exact or settings.balance > 0 or np.abs(missed - 1).max() < EXACT_SHARES:
            break
        factors = found.target_shares * missed / found.shares_before
        found = joint_density(every, area, list(factors))
    names = tuple(region.name for region in regions)
    shares = JointShares(names, asked.shares_before, asked.target_shares, after)
    warnings = [*layout.warnings, *((-1, text) for text in shares.warnings())]
    reports = [m.report() for m in layout.maps]
    return Magnified(corners=layout.corners, uv=layout.uv, reports=reports, shares=shares, warnings=warnings)


def _jobs(surfaces: Sequence[Region], parts, density: np.ndarray, exponent: np.ndarray) -> list[UnwrapJob]:
    """Jobs to unwrap surfaces by the density (m,) of all of their triangles together."""
    wide = float(np.ptp(exponent))
    direction = (exponent - exponent.min()) / wide if wide > 0 else None
    return unwrap_jobs(surfaces, parts, density, direction)


# ---- from existing UVs --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _JointIsland:
    """An island of a surface, the regions (k,m) of which some are on it, bool (k,), and what became of it."""

    owner: int
    island: Island
    regions: np.ndarray
    here: np.ndarray
    result: JointMagnification

    @property
    def before(self) -> np.ndarray:
        """UV areas (m,) of its triangles before."""
        return np.abs(signed_areas(self.island.uv, self.island.chart.triangles))

    @property
    def after(self) -> np.ndarray:
        """UV areas (m,) of its triangles after."""
        return np.abs(signed_areas(self.result.uv, self.island.chart.triangles))


def _from_uv(regions: Sequence[NamedRegion], settings: MagnifySettings) -> Steps[Magnified]:
    """Magnify inside every island on which a region begins or ends; the others stay to the bit."""
    if settings.boundary not in OUTLINES:
        cause = "Several regions of existing UVs keep the outline of their islands"
        raise Refusal(0, BoundaryError(cause, "Choose the boundary Own or Free (own, free), or New UVs (mesh)"))
    islands, warnings = _islands(regions)
    total, done, found = sum(len(i.chart.triangles) for _, i, _ in islands), 0, []
    for owner, island, weights in islands:
        here = np.ptp(weights, axis=1) > 0
        steps = magnify_regions(
            island.uv,
            island.chart.triangles,
            weights[here],
            list(_factors(regions, settings)[here]),
            exact=settings.exact,
            boundary=settings.boundary,
            quality=settings.quality,
            polygons=island.chart.faces,
        )
        size = len(island.chart.triangles)
        try:
            result = yield from part_of(steps, done / total, size / total)
        except MeshError as error:
            raise Refusal(owner, located(error, island.chart)) from error
        found.append(_JointIsland(owner, island, weights, here, result))
        warnings += [(owner, text) for text in result.warnings]
        done += size
    placed = [PlacedIsland(owner=f.owner, chart=f.island.chart, uv=f.result.uv, before=f.island.uv) for f in found]
    if any(f.result.outline == "free" for f in found) and (warning := grown_together(placed)):
        warnings.append((-1, warning))
    corners, uv = corner_uvs(len(regions[0].parts), placed)
    reports = [[_report(f) for f in found if f.owner == k] for k in range(len(regions[0].parts))]
    shares = _overall(regions, found)
    warnings += ((-1, text) for text in shares.warnings())
    return Magnified(corners=corners, uv=uv, reports=reports, shares=shares, warnings=warnings)


def _islands(regions: Sequence[NamedRegion]) -> tuple[list, list[tuple[int, str]]]:
    """Triples of surface, island and regions (k,m) on islands with a part of a region and a rest; and warnings."""
    found, warnings = [], []
    for index, part in enumerate(regions[0].parts):
        islands = islands_of(index, part)
        warnings += [(index, text) for text in islands.warnings]
        for island in islands.islands:
            rows = triangle_rows(part.surface, island.chart)
            weights = np.array([region.parts[index].of_triangles(rows) for region in regions])
            if (np.ptp(weights, axis=1) > 0).any():
                found.append((index, island, weights))
    missing = [r.name for k, r in enumerate(regions) if not any(np.ptp(w[k]) > 0 for *_, w in found)]
    if missing:
        cause = f"No island has both a part of the region {missing[0]!r} and a rest"
        raise Refusal(0, WeightError(cause, "Paint a part of an island"))
    return found, warnings


def _overall(regions: Sequence[NamedRegion], found: Sequence[_JointIsland]) -> JointShares:
    """Shares of each region in all islands that any of them touches, by their UV area."""
    size = np.array([f.before.sum() for f in found])
    size = size / size.sum()
    before = size @ np.array([shares_of(f.regions, f.before) for f in found])
    target = size @ np.array([_target(f) for f in found])
    after = size @ np.array([shares_of(f.regions, f.after) for f in found])
    return JointShares(tuple(region.name for region in regions), before, target, after)


def _target(found: _JointIsland) -> np.ndarray:
    """Shares (k,) of an island that the regions are to have; one that is all over it keeps it."""
    shares = shares_of(found.regions, found.before)
    shares[found.here] = found.result.target.target_shares
    return shares


def _report(found: _JointIsland) -> dict:
    """Figures of an island for a report."""
    chart, target = found.island.chart, found.result.target
    flat = np.column_stack([found.island.uv, np.zeros(len(found.island.uv))])
    mapped = found.result.uv[chart.triangles]
    figures = distortion(flat, chart.triangles, mapped, density=target.density, polygons=chart.faces)
    return {
        "vertices": len(chart.vertices),
        "triangles": len(chart.triangles),
        "outline": found.result.outline,
        "newton_refinement": found.result.iterations,
        "share_before": shares_of(found.regions, found.before).tolist(),
        "share_asked": _target(found).tolist(),
        "share_after": shares_of(found.regions, found.after).tolist(),
        "area_l1": figures.area_l1,
        "angle_mean": figures.angle_mean,
        "folds": figures.folds,
        "overlap": figures.overlap,
        "warnings": list(found.result.warnings),
    }
