"""The signature of what was read, and what is nearest to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...solver.canonical.markers import MapMarkers
from ...solver.errors import LandmarkError, MeshError
from ...solver.mesh.surface import Surface, chosen_triangles
from ...solver.progress import Steps, part_of
from ...solver.signatures.marked import marked_signature
from ...solver.signatures.signature import POINTS, Signature, signature
from ...solver.signatures.wasserstein import ShapeDistance, distance_of, nearest, prepared
from .signature_index import SignatureIndex


def signature_of(
    surfaces: Sequence[Surface], count: int = POINTS, markers: Sequence[MapMarkers | None] | None = None
) -> Steps[Signature]:
    """The signature of the largest part of several surfaces; with markers of the part that has them.

    Raises
    ------
    MeshError : nothing to compare, a body with handles, or markers that are not one centre and one start
    """
    triangles, positions, n = [], [], 0
    marked: dict[str, list] = {"centre": [], "start": []}
    for k, surface in enumerate(surfaces):
        _, corners, _ = chosen_triangles(surface, None)
        triangles.append(surface.corner_vertex[corners] + n)
        positions.append(surface.positions)
        if markers is not None and markers[k] is not None:
            for name, found in marked.items():
                found += (np.asarray(getattr(markers[k], name)) + n).tolist()
        n += len(surface.positions)
    if markers is not None:
        centre, start = (_single(found, name) for name, found in marked.items())
        return (yield from marked_signature(np.concatenate(positions), np.concatenate(triangles), centre, start, count))
    return (yield from signature(np.concatenate(positions), np.concatenate(triangles), count))


def markers_of(centre: Sequence[int], start: Sequence[int]) -> MapMarkers:
    """The markers that vertices (k,) are, one each where all is well."""
    return MapMarkers(np.array(centre, int), np.array(start, int), np.zeros(0, int))


def _single(found: list, name: str) -> int:
    if len(found) != 1:
        cause = f"{len(found) or 'No'} vertices are marked as the {name}"
        remedy = "Mark one vertex in the middle, and one of the boundary, or as far from it as what is compared"
        raise LandmarkError(cause, remedy, "vertex", found)
    return int(found[0])


def alike(
    own: Surface,
    others: Sequence[tuple[str, Surface]],
    markers: Sequence[MapMarkers | None] | None = None,
    count: int = POINTS,
) -> Steps[tuple[list[tuple[str, ShapeDistance]], list[str]]]:
    """Distances of surfaces from one, by name, nearest first; and why some have none. With markers, of that one and of
    all others, by what these mark.

    Raises
    ------
    MeshError : the one has no signature
    """
    share = 1 / (1 + len(others))
    marked = [None] * (1 + len(others)) if markers is None else [[found] for found in markers]
    mine = prepared((yield from part_of(signature_of([own], count, marked[0]), 0, share)))
    found, reasons = [], []
    for k, (name, surface) in enumerate(others):
        try:
            its = yield from part_of(signature_of([surface], count, marked[1 + k]), (1 + k) * share, share)
        except MeshError as error:
            reasons.append(f"{name}: {error}")
            continue
        found.append((name, distance_of(mine, prepared(its))))
    return sorted(found, key=lambda pair: pair[1].raw ** 2 - pair[1].floor ** 2), reasons


def nearest_of(
    own: Surface, index: SignatureIndex, top: int, markers: MapMarkers | None = None
) -> Steps[list[tuple[str, ShapeDistance]]]:
    """The nearest of an index, by name, nearest first; with markers where its shapes were compared by such.

    Raises
    ------
    MeshError : the surface has no signature, or no markers
    """
    mine = yield from signature_of([own], index.packed.shape[1], [markers] if index.marked else None)
    return [(index.names[k], found) for k, found in nearest(mine, index, top, index.coefficients)]
