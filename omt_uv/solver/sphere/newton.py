"""Evaluate the energy of maps to the unit sphere and its projected Newton step, face by face in tangent planes.

The energy is that of `maps.energy` (symmetric MIPS and area; Degener, Meseth, Klein 2003). A face is measured by the
orthographic projection of its corners along their middle c = (p_0 + p_1 + p_2) / |p_0 + p_1 + p_2|: in a frame of two
axes across c, where it has no area just when it has none on the sphere. With the corners the frame turns: their
coordinates change by dz_k = axes (dp_k - (c . p_k) / |p_0 + p_1 + p_2| (dp_0 + dp_1 + dp_2)). The projection is smaller
than the spherical triangle, so the target areas are shrunk alike, anew in every stage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..linalg.sparse import Factor
from ..maps.energy import Elements, FaceDerivatives, area_forms_of, derivatives_of, energy_of, squared
from ..mesh.geometry import cross3, lengths
from ..mesh.spherical_geometry import normalized, signed_volumes, spherical_areas
from ..refinement.hessian_blocks import Assembly, lone_triangles, long_forms, quad_blocks
from ..refinement.projected_newton import ARMIJO, FOLD_SHARE, MAX_HALVINGS, SHIFT, NewtonStep, fold_shares
from .symmetry import SphereSymmetry


@dataclass(frozen=True)
class ProjectedFaces:
    """Faces projected along their middles: axes (m,2,3) of their frames, corners (m,3) complex in them.

    mixing (m,3,3): what a change of each corner does to every one; least_cosine (m,): of the distances from the middle
    to the corners.
    """

    axes: np.ndarray
    corner: np.ndarray
    mixing: np.ndarray
    least_cosine: np.ndarray

    def change(self, vectors: np.ndarray) -> np.ndarray:
        """How the corners (m,3) complex change when those on the sphere move by vectors (m,3,3)."""
        # Products of small matrices take a half to a third of the time of einsum.
        part = np.matmul(vectors, self.axes.swapaxes(1, 2))
        return np.matmul(self.mixing, part).view(complex)[..., 0]


def project_faces(positions: np.ndarray, triangles: np.ndarray) -> ProjectedFaces:
    """Project the faces (m,3) of unit vectors (n,3) along their middles."""
    p = positions[triangles]
    axes, corner, up, size = _projected(p)
    height = np.einsum("md,mkd->mk", up, p)
    mixing = np.eye(3) - (height / np.maximum(size, 1e-300))[:, :, None]
    least = np.minimum(np.minimum(height[:, 0], height[:, 1]), height[:, 2])
    return ProjectedFaces(axes=axes, corner=corner, mixing=mixing, least_cosine=least)


def projected_corners(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The corners (m,3) complex of `project_faces` alone."""
    return _projected(positions[triangles])[1]


def _projected(p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Axes (m,2,3), corners (m,3) complex in them, middles (m,3) and lengths (m,1) of the sums of corners (m,3,3)."""
    total = p[:, 0] + p[:, 1] + p[:, 2]
    size = lengths(total)[..., None]
    up = total / np.maximum(size, 1e-300)
    side = p[:, 1] - p[:, 0]
    first = normalized(side - np.einsum("md,md->m", side, up)[:, None] * up)
    axes = np.stack([first, cross3(up, first)], axis=1)
    part = np.matmul(p - p[:, :1], axes.swapaxes(1, 2))
    return axes, part.view(complex)[..., 0], up, size


def derivatives(faces: Elements, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """dw/dz and dw/dconj(z) per face, (m,) complex each, of corners (m,3) complex."""
    a = 0.5 * np.einsum("mk,mk->m", corner, faces.gradient.conj())
    b = 0.5 * np.einsum("mk,mk->m", corner, faces.gradient)
    return a, b


def tangents(positions: np.ndarray) -> np.ndarray:
    """Two orthonormal tangents (n,2,3) at unit vectors (n,3)."""
    least = np.eye(3)[np.abs(positions).argmin(axis=1)]
    first = normalized(cross3(positions, least))
    return np.stack([first, cross3(positions, first)], axis=1)


def retract(positions: np.ndarray, axes: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) after steps (n,2) along their tangents (n,2,3): the retraction by normalising.

    Absil, Mahony, Sepulchre 2008, section 4.1.
    """
    return normalized(positions + np.einsum("na,nad->nd", step, axes))


@dataclass(frozen=True)
class SphereProblem:
    """What Newton minimises: polygons whose ratio is that of their projections, and the area weight.

    target (p,): spherical areas, summing to 4 pi; ratio (p,): theirs over those of the surface; symmetry: that of the
    maps, which every step keeps; uneven: the energy has it not, since some polygons are cut otherwise than their images
    """

    faces: Elements
    target: np.ndarray
    ratio: np.ndarray
    assembly: Assembly
    area_weight: float
    symmetry: SphereSymmetry | None = None
    uneven: bool = False

    def spherical_areas(self, positions: np.ndarray) -> np.ndarray:
        """Areas (p,) of the polygons on the sphere, by the triangulation given."""
        area = spherical_areas(positions, self.faces.triangles)
        if self.faces.polygon is None:
            return area
        first = lone_triangles(self.faces)
        given = np.concatenate([area[:first], (area[first:].reshape(-1, 4) * [1, 1, 0, 0]).ravel()])
        return np.bincount(self.faces.polygon, given, len(self.target))

    def projected_areas(self, positions: np.ndarray) -> np.ndarray:
        """Areas (p,) of the polygons' projections over those of the surface."""
        a, b = derivatives(self.faces, projected_corners(positions, self.faces.triangles))
        return self.faces.sums(squared(a) - squared(b))

    def energy(self, positions: np.ndarray) -> float:
        """The energy of unit vectors (n,3); infinity where a face is folded."""
        if self.faces.folded(signed_volumes(positions, self.faces.triangles)).any():
            return np.inf
        corner = projected_corners(positions, self.faces.triangles)
        return energy_of(self.faces, *derivatives(self.faces, corner), self.area_weight)

    def area_error(self, positions: np.ndarray) -> float:
        """The deviation of the areas' ratios, which is no less than the share of the area in the wrong place."""
        share = self.target / self.target.sum()
        ratio = self.spherical_areas(positions) / self.target
        return float(np.sqrt(share @ (ratio - 1) ** 2))

    def projected_area_error(self, positions: np.ndarray) -> float:
        """Share of the area in the wrong place, of projected faces against their own targets."""
        error = np.abs(self.projected_areas(positions) / self.faces.ratio - 1)
        return float(self.target @ error / self.target.sum())

    def step(self, positions: np.ndarray, value: float, pressure: float) -> NewtonStep:
        """One line-searched Newton step from unit vectors (n,3) of energy `value`."""
        face = project_faces(positions, self.faces.triangles)
        a, b = derivatives(self.faces, face.corner)
        local = derivatives_of(self.faces, a, b, self.area_weight, pressure)
        whole = None if self.faces.polygon is None else area_forms_of(self.faces, a, b, self.area_weight)
        axes = tangents(positions)
        even = self.symmetry if self.uneven else None
        given = self.faces, self.assembly, positions, face, local
        direction, slope = newton_direction(*given, area=whole, symmetry=even)
        moved = np.einsum("na,nad->nd", direction, axes)
        if self.symmetry is not None:
            moved = self.symmetry.averaged(moved)
            direction = np.einsum("nd,nad->na", moved, axes)
        far = fold_shares(a, b, *derivatives(self.faces, face.change(moved[self.faces.triangles])))
        part = self.faces.part
        counted = far if part is None else far[part > 0]
        share = min(1.0, FOLD_SHARE * float(counted.min(initial=np.inf)))
        for _ in range(MAX_HALVINGS):
            trial = retract(positions, axes, share * direction)
            trial_value = self.energy(trial)
            if trial_value <= value + ARMIJO * share * slope:
                return NewtonStep(trial, trial_value, -slope / 2, share)
            share *= 0.5
        return NewtonStep(positions, value, -slope / 2, 0.0)


def newton_direction(
    faces: Elements,
    assembly: Assembly,
    positions: np.ndarray,
    face: ProjectedFaces,
    local: FaceDerivatives,
    fixed: np.ndarray | None = None,
    area: np.ndarray | None = None,
    symmetry: SphereSymmetry | None = None,
) -> tuple[np.ndarray, float]:
    """Step (n,2) along the `tangents`, 0 for fixed vertices (n,) bool, and the energy's slope along it.

    symmetry: of a map whose energy has none; the step is the symmetric one that is best for it
    area (m,3) complex: the parts that triangles have in the rows of their polygons' areas, see `energy.area_forms_of`
    """
    n, triangles, axes = len(positions), faces.triangles, tangents(positions)
    # How the tangents of the corners lie in the frames of the faces: (m, corner, frame axis, tangent).
    turn = np.matmul(face.axes[:, None], axes[triangles].swapaxes(2, 3))
    rows = _tangential(local.rows, face, turn)
    corner = np.matmul(local.gradient[:, None], face.mixing).reshape(-1, 3).view(float).reshape(-1, 3, 2)
    pull = np.matmul(corner, face.axes).reshape(-1, 3)
    gradient = np.column_stack([np.bincount(triangles.ravel(), pull[:, d], n) for d in range(3)])
    gradient = gradient if symmetry is None else symmetry.averaged(gradient)
    # Moving along a great circle bends inwards: the pull along the radius adds to the Hessian.
    bend = np.maximum(-np.einsum("nd,nd->n", gradient, positions), 0)
    scale = np.einsum("mkd,mkd->", rows, rows) / (2 * n)
    if fixed is not None:
        rows *= ~np.repeat(fixed[triangles], 2, axis=1)[:, None, :]
        gradient[fixed], bend[fixed] = 0, 1
    first = lone_triangles(faces)
    blocks = np.matmul(rows[:first].transpose(0, 2, 1), rows[:first])
    diagonal = np.repeat(bend, 2) + SHIFT * scale
    if area is None:
        matrix = assembly.matrix(blocks, diagonal)
    else:
        whole = _tangential(area[:, None, :], face, turn)[:, 0]
        fours = quad_blocks(rows[first:].reshape(-1, 4, 4, 6), whole[first:].reshape(-1, 4, 6))
        rest = long_forms(faces, triangles, whole[:first], n)
        matrix = assembly.matrix(blocks, diagonal, fours)
        matrix = matrix if rest is None else matrix + rest
    slope = np.einsum("nd,nad->na", gradient, axes).ravel()
    matrix = matrix if symmetry is None else symmetry.averaged_hessian(matrix, axes)
    step = -Factor(matrix, "natural").solve(slope)
    return step.reshape(n, 2), float(step @ slope)


def _tangential(forms: np.ndarray, face: ProjectedFaces, turn: np.ndarray) -> np.ndarray:
    """Linear forms (m,r,3) complex of the faces' corners as rows (m,r,6) by the tangents of these, see `turn`."""
    mixed = np.matmul(forms, face.mixing)
    rows = mixed.real[..., None] * turn[:, None, :, 0]
    rows -= mixed.imag[..., None] * turn[:, None, :, 1]
    return rows.reshape(*forms.shape[:2], 6)
