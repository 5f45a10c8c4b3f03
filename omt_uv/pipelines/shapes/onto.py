"""Carry what one object carries onto another that is matched with it, whatever polygons that has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...solver.mesh.geometry import unit, vertex_normals
from ...solver.mesh.surface import Surface, side_ends
from ...solver.mesh.topology import halfedges, pair_keys
from ...solver.transfer.correspondence import Correspondence, correspond
from ..attributes import Attributes, Layer, Marks, ShapeKey
from ..carry_attributes import carry
from .match import MatchJob, MatchResult


def transferred(job: MatchJob, result: MatchResult, attributes: Attributes) -> tuple[Attributes, int]:
    """The attributes of a source for the polygons, corners and vertices of the target, and how many faces of it reach
    across a seam, where UVs are continued."""
    source, target = job.source, job.target
    old = source.corner_vertex[source.triangles]
    new = target.corner_vertex[target.triangles]
    lifted = np.einsum("kc,kcd->kd", result.source_barycentric, source.positions[old[result.source_faces]])
    at = correspond(
        source.positions,
        old,
        job.jumps,
        lifted,
        new,
        result.source_faces,
        result.source_barycentric,
        target.triangle_face,
    )
    carried = carry(attributes, source, at)
    corner, face = _firsts(target)
    layers = tuple(_of_polygons(layer, corner, face) for layer in carried.layers)
    return (
        replace(
            carried,
            material_index=carried.material_index[face],
            smooth=carried.smooth[face],
            marks=_real_edges(carried.marks, target),
            layers=layers,
            keys=_turned(carried.keys, lifted, target, at),
        ),
        len(np.unique(target.triangle_face[_across(at)])) if at.extended else 0,
    )


def _across(at: Correspondence) -> np.ndarray:
    """Triangles (e,) whose corners continue a value beyond the triangle that it comes from."""
    return np.flatnonzero((at.corner_weights < -1e-9).any(axis=(1, 2)))


def _firsts(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """For every corner of the surface one corner of its triangles, and for every polygon one triangle."""
    corner = np.zeros(len(surface.corner_vertex), np.int64)
    flat = surface.triangles.ravel()
    corner[flat[::-1]] = np.arange(len(flat))[::-1]
    face = np.zeros(len(surface.face_start) - 1, np.int64)
    face[surface.triangle_face[::-1]] = np.arange(len(surface.triangle_face))[::-1]
    return corner, face


def _of_polygons(layer: Layer, corner: np.ndarray, face: np.ndarray) -> Layer:
    """A layer of triangles as one of polygons."""
    pick = {"CORNER": corner, "FACE": face}.get(layer.domain)
    return layer if pick is None else replace(layer, values=layer.values[pick])


def _real_edges(marks: Marks, surface: Surface) -> Marks:
    """The marks of those edges that are sides of polygons."""
    real = np.isin(pair_keys(marks.edges[:, 0], marks.edges[:, 1]), pair_keys(*side_ends(surface)))
    layers = tuple(replace(layer, values=layer.values[real]) for layer in marks.layers)
    return Marks(marks.edges[real], marks.seam[real], marks.sharp[real], marks.crease[real], layers)


def _turned(
    keys: tuple[ShapeKey, ...], lifted: np.ndarray, target: Surface, at: Correspondence
) -> tuple[ShapeKey, ...]:
    """Shape keys whose offsets turn and grow as the surface around each vertex does, from source to target.

    lifted (k,3) : the target's vertices on the source. The rotation is that of the star and its normal (Kabsch 1976).
    """
    if not keys:
        return keys
    tail, head = halfedges(at.triangles)
    before, after = lifted[head] - lifted[tail], target.positions[head] - target.positions[tail]
    n = len(lifted)
    moment, old, new = np.zeros((n, 3, 3)), np.zeros(n), np.zeros(n)
    outer = np.einsum("ea,eb->eab", after, before)
    for end in (tail, head):
        np.add.at(moment, end, outer)
        np.add.at(old, end, (before**2).sum(axis=1))
        np.add.at(new, end, (after**2).sum(axis=1))
    normals = [unit(vertex_normals(p, at.triangles)) for p in (target.positions, lifted)]
    moment += np.einsum("n,na,nb->nab", np.sqrt(old * new), *normals)
    left, _, right = np.linalg.svd(moment)
    sign = np.ones((n, 3))
    sign[:, 2] = np.sign(np.linalg.det(left) * np.linalg.det(right))
    rotation = np.einsum("nab,nb,nbc->nac", left, sign, right)
    # One growth for all: it is the size of the body that differs, not that of its dents.
    growth = np.sqrt(new.sum() / max(float(old.sum()), 1e-300))
    return tuple(replace(key, offsets=growth * np.einsum("nab,nb->na", rotation, key.offsets)) for key in keys)
