"""Deform a mesh within a carrier to the least distortion, by projected Newton steps, landmarks drawn to their places.

The energy is that of `maps.energy`, MIPS and area (Hormann, Greiner 2000; Degener, Meseth, Klein 2003), of every
triangle from its shape in the reference to its shape in space, in the plane of its own corners. Turning that plane
changes no shape, so to first order corners count by their motion within it. Landmarks are drawn by springs of growing
stiffness (a penalty method), and put into their places where that folds nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..linalg.sparse import Factor
from ..maps.energy import Elements, derivatives_of, elements, energies_of, energy_of
from ..mesh.geometry import face_areas, plane_axes
from ..progress import Progress, Steps
from ..refinement.hessian_blocks import Assembly
from ..refinement.projected_newton import FOLD_SHARE, SHIFT, fold_shares
from ..sphere.newton import derivatives
from .carriers import Carrier, InPlace, TargetCarrier

# Of a step that does not lower the energy.
MAX_HALVINGS = 10
# Rounds in which vertices at folds take their step back.
RESTORING = 30
# Energy of a face, on surfaces of area 1, from which it has no area: rounding may leave it some.
NO_AREA = 1e8
# Weight of the distortion in the domain next to that on the surface: enough to keep folds away.
BARRIER = 1e-2
# Predicted decrease over energy at which a stage of drawing is left, and the last one.
LOOSE = 1e-2
STRICT = 1e-4
# Area weight of the energy, in the domain and on the surface.
AREA_WEIGHT = 1.0


@dataclass(frozen=True)
class Features:
    """Functions that the map is to keep: values (n,c) of the vertices that move, and (k,c) of those of the carrier's
    surface; share (n,) of the area, times a weight, of each vertex."""

    values: np.ndarray
    target: np.ndarray
    share: np.ndarray

    def differences(self, placed: InPlace, triangles: np.ndarray) -> np.ndarray:
        """Values on the surface with triangles (m,3) less those that are to be there, (n,c)."""
        there = np.einsum("nc,ncv->nv", placed.barycentric, self.target[triangles[placed.faces]])
        return there - self.values

    def energy(self, placed: InPlace, triangles: np.ndarray) -> float:
        """Half of the sum of r^2 / (1 + r^2), r the difference at a vertex (Geman, McClure 1985)."""
        square = (self.differences(placed, triangles) ** 2).sum(axis=1)
        return 0.5 * float(self.share @ (square / (1 + square)))

    def rows(self, placed: InPlace, carrier: TargetCarrier) -> tuple[np.ndarray, np.ndarray]:
        """Pull (n,3) of the vertices, and the forms (n,c,3) whose squares are the Hessian."""
        off = self.differences(placed, carrier.triangles)
        corner = self.target[carrier.triangles[placed.faces]]
        slope = np.einsum("ncd,ncv->nvd", carrier.walks.gradients[placed.faces], corner)
        # Iteratively reweighted: a place that fits nothing pulls little.
        weight = self.share / (1 + (off**2).sum(axis=1)) ** 2
        return np.einsum("n,nv,nvd->nd", weight, off, slope), np.sqrt(weight)[:, None, None] * slope


@dataclass(frozen=True)
class Deformation:
    """What is minimised: faces of the reference, how they are summed, where vertices move, which (n,) bool stay.

    features: functions to be kept, and within: the faces in the domain as they were at first, whose distortion there is
    a barrier against folds; both of a carrier that is a surface. left_out: faces (m,) bool that do not count, since no
    derivative tells a face without area where to go.
    """

    faces: Elements
    assembly: Assembly
    carrier: Carrier
    held: np.ndarray
    area_weight: float
    features: Features | None = None
    within: Elements | None = None
    left_out: np.ndarray | None = None

    @property
    def surface(self) -> TargetCarrier:
        """The carrier, where it is a surface."""
        if not isinstance(self.carrier, TargetCarrier):
            raise ValueError("only on a surface there are features, and a domain beside it")
        return self.carrier

    def energies(self, placed: InPlace) -> np.ndarray:
        """The energy (m,) of every face, infinite where it has no area; folds are the carrier's business."""
        _, corner = frames(placed.positions, self.faces.triangles)
        return energies_of(self.faces, *derivatives(self.faces, corner), self.area_weight)

    def energy(self, placed: InPlace) -> float:
        """Their sum without those left out, that of the features, and the barrier."""
        each = self.energies(placed)
        value = float((each if self.left_out is None else each[~self.left_out]).sum())
        if self.features is not None:
            value += self.features.energy(placed, self.surface.triangles)
        if self.within is not None:
            _, corner = frames(in_space(placed.domain), self.within.triangles)
            value += BARRIER * energy_of(self.within, *derivatives(self.within, corner), self.area_weight)
        return value


def deformation(
    reference: np.ndarray,
    triangles: np.ndarray,
    carrier: Carrier,
    features: Features | None = None,
    within: np.ndarray | None = None,
) -> Deformation:
    """The problem of a mesh with shapes (n,3), (m,3) that moves on a carrier, no vertex held.

    within (n,d): places in the domain; distortion from there is a barrier against folds
    """
    assembly = Assembly(triangles, len(reference))
    held = np.zeros(len(reference), bool)
    inside = None if within is None else _shapes(in_space(within), triangles)
    return Deformation(_shapes(reference, triangles), assembly, carrier, held, AREA_WEIGHT, features, inside)


def _shapes(positions: np.ndarray, triangles: np.ndarray) -> Elements:
    """Triangles (m,3) as they are, of positions (n,3)."""
    area = face_areas(positions, triangles)
    return elements(positions, triangles, np.maximum(area, 1e-12 * area.mean()))


def frames(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes (m,2,3) in the planes of triangles (m,3) in space (n,3), and their corners (m,3) complex there."""
    p = positions[triangles]
    axes = np.stack(plane_axes(p), axis=1)
    part = np.einsum("mad,mkd->mka", axes, p - p[:, :1])
    return axes, part[..., 0] + 1j * part[..., 1]


def minimise_on(
    problem: Deformation, placed: InPlace, most: int, tolerance: float, stage: str
) -> Steps[tuple[InPlace, int]]:
    """Newton steps, at most so many, until the predicted decrease is below the tolerance times the energy.

    Faces without area on the carrier, as along a straight edge of it, move with their neighbours until they have one.
    """
    value = problem.energy(placed)
    for k in range(most):
        yield Progress(stage, k / most)
        if problem.left_out is not None or not value < NO_AREA:
            problem = replace(problem, left_out=~(problem.energies(placed) < NO_AREA))
            value = problem.energy(placed)
        found = _step(problem, placed, value)
        if found is None:
            return placed, k
        placed, lower, predicted = found
        gained, value = value - lower, lower
        if predicted < tolerance * max(value, 1e-3) or gained < 0.1 * tolerance * max(value, 1e-3):
            return placed, k + 1
    return placed, most


def _step(problem: Deformation, placed: InPlace, value: float) -> tuple[InPlace, float, float] | None:
    """The places after one step, their energy, and the decrease that was predicted; None where none is found.

    One sliver shall not hold up all others: each vertex goes as far as the faces around it allow, and folds are
    smoothed away.
    """
    step, slope, until = _direction(problem, placed)
    triangles = problem.faces.triangles
    own = np.ones(len(step))
    np.minimum.at(own, triangles.ravel(), np.repeat(np.minimum(FOLD_SHARE * until, 1), 3))
    for share in (own[:, None], np.full((len(step), 1), own.min(initial=1.0))):
        for _ in range(MAX_HALVINGS):
            trial = without_folds(problem, placed, problem.carrier.move(placed, share * step))
            lower = problem.energy(trial)
            if lower < value:
                return trial, lower, -slope / 2
            share = share / 2
    return None


def without_folds(problem: Deformation, before: InPlace, after: InPlace) -> InPlace:
    """The places after a step; vertices of folded triangles, and then those around them, stay where they were."""
    triangles = problem.faces.triangles
    moved = np.ones(len(before.positions), bool)
    for _ in range(RESTORING):
        folded = problem.carrier.folded(after, triangles) & moved[triangles].any(axis=1)
        if not folded.any():
            return after
        moved[triangles[folded]] = False
        after = after.chosen(moved, before)
    return before


def _direction(problem: Deformation, placed: InPlace) -> tuple[np.ndarray, float, np.ndarray]:
    """Step (n,3) in space, the energy's slope along it, and the share (m,) of it at which each triangle would fold."""
    n = len(placed.positions)
    axes = problem.carrier.axes(placed)
    axes[problem.held] = 0
    own = _local(problem.faces, placed.positions, axes, problem.area_weight, problem.left_out)
    blocks, slope, gradient, scale = own.blocks, own.slope, own.gradient, own.scale
    diagonal = np.full((n, 2), SHIFT * scale)
    if problem.carrier.round:
        # Moving along a great circle bends inwards: the pull along the radius adds to the Hessian.
        diagonal += np.maximum(-np.einsum("nd,nd->n", gradient, placed.positions), 0)[:, None]
    parts = [own]
    if problem.within is not None:
        pushed = problem.surface.pushed(placed, axes)
        parts.append(_local(problem.within, in_space(placed.domain), pushed, problem.area_weight, None))
        blocks = blocks + BARRIER * parts[1].blocks
        slope = slope + BARRIER * parts[1].slope
    if problem.features is not None:
        more, forms = problem.features.rows(placed, problem.surface)
        slope = slope + np.einsum("nd,nad->na", more, axes).ravel()
        _add_vertex_blocks(blocks, problem.faces.triangles, np.einsum("ncd,nad->nca", forms, axes))
    # What must not move has an equation of its own.
    diagonal[~axes.any(axis=2)] = 1.0
    along = -Factor(problem.assembly.matrix(blocks, diagonal.ravel()), "natural").solve(slope)
    until = np.min([part.until(along.reshape(n, 2)) for part in parts], axis=0)
    return np.einsum("na,nad->nd", along.reshape(n, 2), axes), float(along @ slope), until


@dataclass(frozen=True)
class _Local:
    """Derivatives of the energy of triangles: blocks (m,6,6), slope (2n,) along the tangents, gradient (n,3), mean of
    the diagonal; and what it takes to tell where a step folds them, none of those left out (m,) bool."""

    faces: Elements
    left_out: np.ndarray | None
    corner: np.ndarray
    turn: np.ndarray
    blocks: np.ndarray
    slope: np.ndarray
    gradient: np.ndarray
    scale: float

    def until(self, along: np.ndarray) -> np.ndarray:
        """Share (m,) of a step (n,2) along the tangents at which each triangle has no area, to first order."""
        change = np.einsum("mkfa,mka->mkf", self.turn, along[self.faces.triangles])
        moved = derivatives(self.faces, change[..., 0] + 1j * change[..., 1])
        return fold_shares(*_kept(*derivatives(self.faces, self.corner), self.left_out), *moved)


def _kept(a: np.ndarray, b: np.ndarray, left_out: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (m,), (m,) complex of a map, those of faces that are left out (m,) bool as if nothing moved."""
    return (a, b) if left_out is None else (np.where(left_out, 1, a), np.where(left_out, 0, b))


def _local(
    faces: Elements, positions: np.ndarray, axes: np.ndarray, area_weight: float, left_out: np.ndarray | None
) -> _Local:
    """Derivatives for positions (n,3) that move along tangents (n,2,3), 0 of what is left out (m,) bool."""
    triangles, n = faces.triangles, len(positions)
    frame, corner = frames(positions, triangles)
    local = derivatives_of(faces, *_kept(*derivatives(faces, corner), left_out), area_weight, 1.0)
    # How the tangents of the corners lie in the planes of the faces: (m, corner, frame axis, tangent).
    turn = np.einsum("mfd,mkad->mkfa", frame, axes[triangles])
    if left_out is not None:
        turn, frame = (np.where(left_out.reshape(-1, *[1] * (x.ndim - 1)), 0, x) for x in (turn, frame))
    rows = local.rows.real[..., None] * turn[:, None, :, 0] - local.rows.imag[..., None] * turn[:, None, :, 1]
    rows = np.ascontiguousarray(rows.reshape(len(triangles), 4, 6))
    parts = np.stack([local.gradient.real, local.gradient.imag], axis=2)
    pull = np.einsum("mkf,mfd->mkd", parts, frame).reshape(-1, 3)
    gradient = np.column_stack([np.bincount(triangles.ravel(), pull[:, d], n) for d in range(3)])
    return _Local(
        faces=faces,
        left_out=left_out,
        corner=corner,
        turn=turn,
        blocks=np.matmul(rows.transpose(0, 2, 1), rows),
        slope=np.einsum("nd,nad->na", gradient, axes).ravel(),
        gradient=gradient,
        scale=float(np.einsum("mkd,mkd->", rows, rows)) / (2 * n),
    )


def in_space(domain: np.ndarray) -> np.ndarray:
    """Points of the domain (n,d) as points in space (n,3)."""
    return domain if domain.shape[1] == 3 else np.column_stack([domain, np.zeros(len(domain))])


def flat(placed: InPlace) -> InPlace:
    """Places on a surface as places (n,3) in its domain."""
    return replace(placed, positions=in_space(placed.domain))


def _add_vertex_blocks(blocks: np.ndarray, triangles: np.ndarray, forms: np.ndarray) -> None:
    """Add the squares of forms (n,c,2) of single vertices to the blocks (m,6,6) of a triangle at each."""
    vertex, first = np.unique(triangles.ravel(), return_index=True)
    face, corner = first // 3, first % 3
    square = np.einsum("nca,ncb->nab", forms[vertex], forms[vertex])
    for a in range(2):
        for b in range(2):
            np.add.at(blocks, (face, 2 * corner + a, 2 * corner + b), square[:, a, b])
