"""Refine the UVs of a cage so that its subdivided surface has its areas, by projected Newton on the cage's vertices.

The UVs of the subdivided mesh are a sparse matrix S times those of the cage (`catmull_clark`), so that the gradient
of an energy of the fine triangles by the cage is S^T g, and its Hessian S^T H S. While fine triangles are folded, the
determinant in the denominators is replaced by chi(det) = (det + sqrt(det^2 + eps^2)) / 2 > 0, with an eps that goes
to 0 with the folds (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov 2021).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix, identity, kron, vstack
from scipy.sparse.linalg import splu

from ..maps.contacts import crossings
from ..maps.energy import Elements, face_derivatives_of, squared, sum_at_vertices
from ..maps.mirror_symmetry import MirrorSymmetry, without_symmetry
from ..mesh.geometry import hat_gradients, signed_areas
from ..mesh.polygon_areas import BOTH
from ..progress import Progress, Steps, part_of
from ..refinement.boundary_barrier import BoundaryBarrier, make_barrier
from ..refinement.continuation import CONTACT_STRENGTH
from ..refinement.hessian_blocks import Assembly
from ..refinement.projected_newton import linear_forms

# Weight of the cage's own triangles beside those of the subdivided surface: they shall not fold.
CAGE_WEIGHT = 1e-3
STEPS = 60  # of Newton at most
HALVINGS = 30  # of one step at most
ARMIJO = 1e-4  # least share of the promised decrease that a step must gain
# Predicted decrease over energy below which it is done.
DONE = 1e-4
# And the share of the energy that so many last steps have to gain, together.
SLOW = 0.02
LAST = 4
# Added to the Hessian's diagonal, relative to its mean: charts have no place and no direction of their own.
SHIFT = 1e-9
# eps over the most negative determinant, and its least value, where a face has 1.
REGULAR = 0.2
LEAST = 1e-3
# After so many steps, triangles of the other diagonals and of the cage that are still folded are left out: a quad with
# three corners on a straight boundary cannot be convex.
PATIENCE = 12
# What touches itself, as the sides of a slit in what was unrolled, is drawn in by this share of the sides there, or by
# halves of that: a barrier is infinite at contact.
DRAWN_IN = 0.02
# Share of the time of a first try, in which triangles of the cage may fold on the way.
FIRST = 0.7
# Area over squared sides of triangles that no symmetric map opens: two quads that share two sides on the axis are
# straight there, and what rounding leaves of their corners would be all of the energy.
FLAT = 1e-9


@dataclass(frozen=True)
class CageMap:
    """UVs (n,2) of the cage, Newton steps, and the triangles of the subdivided surface that are still folded."""

    uv: np.ndarray
    iterations: int
    folds: int


@dataclass(frozen=True)
class CageElements:
    """What is asked of the triangles of fine quads (q,4), four of each, and of those of the cage after them; polygon
    (t,): of the cage's."""

    faces: Elements
    quads: np.ndarray
    polygon: np.ndarray


@dataclass(frozen=True)
class _CageProblem:
    """Elements of the fine and the cage's triangles, which of them count and which may not even fold on the way, (m,)
    bool, the matrix to their vertices, that from the unknowns to both coordinates (2n,k) of the map of the cage, and
    barriers of its outlines."""

    elements: CageElements
    counted: np.ndarray
    strict: np.ndarray
    matrix: csr_matrix
    unknowns: csr_matrix
    assembly: Assembly
    area_weight: float
    barriers: tuple[BoundaryBarrier, ...] = ()

    @property
    def faces(self) -> Elements:
        """Those of all triangles; what does not count has no weight."""
        return self.elements.faces

    def dets(self, w: np.ndarray) -> np.ndarray:
        """Determinants (m',) over those that are asked for of what counts, of a map w (n,) complex of the cage."""
        a, b = self.faces.derivatives(self.matrix @ w)
        return ((squared(a) - squared(b)) / self.faces.ratio)[self.counted]

    def energy(self, w: np.ndarray, eps: float) -> float:
        """The energy of a map w (n,) complex of the cage; infinite where the cage folds, with eps 0 at any fold."""
        a, b = self.faces.derivatives(self.matrix @ w)
        outer, inner = (squared(x)[self.counted] / self.faces.ratio[self.counted] for x in (a, b))
        det, eps_of = outer - inner, self._eps(eps)[self.counted]
        if not ((det > 0) | (eps_of > 0)).all():
            return np.inf
        chi = _chi(det, eps_of)[0]
        value = (outer + inner) / chi - 1 + self.area_weight * ((det**2 + 1) / (2 * chi) - 1)
        return float(self.faces.weight[self.counted] @ value + sum(part.energy(w) for part in self.barriers))

    def newton(self, w: np.ndarray, eps: float) -> tuple[np.ndarray, float]:
        """The step (n,) complex of a map w (n,) of the cage and the decrease that it promises."""
        quads, n, fine = self.elements.quads, len(w), self.matrix.shape[0]
        d = face_derivatives_of(self.faces, *self.faces.derivatives(self.matrix @ w), *self._by_squares(w, eps))
        gradient = self.matrix.T @ sum_at_vertices(self.faces, d.gradient, fine)
        cut = 4 * len(quads)
        rows = np.zeros((len(quads), 4, 4, 4), complex)
        for k, corners in enumerate(BOTH):
            rows[:, k, :, corners] = d.rows[k:cut:4].transpose(2, 0, 1)
        blocks = _squares(d.rows[cut:]), _squares(rows.reshape(len(quads), 16, 4))
        by_axes = kron(self.matrix, identity(2), "csr") @ self.unknowns
        hessian = by_axes.T @ (self.assembly.matrix(blocks[0], np.zeros(2 * fine), blocks[1]) @ by_axes)
        for part in self.barriers:
            slope, vertices, forms = part.derivatives(w)
            linear = linear_forms(vertices, forms, n) @ self.unknowns
            gradient, hessian = gradient + slope, hessian + linear.T @ linear
        right = self.unknowns.T @ gradient.view(float)
        shift = SHIFT * hessian.diagonal().mean()
        system = (hessian + shift * identity(len(right))).tocsc()
        factor = splu(system, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        solved = factor.solve(-right)
        return (self.unknowns @ solved).view(complex), float(-right @ solved)

    def _eps(self, eps: float) -> np.ndarray:
        """The eps (m,) of every triangle: 0 of those that do not fold on the way either."""
        return np.where(self.strict, 0.0, eps)

    def bounded(self, w: np.ndarray, step: np.ndarray) -> float:
        """The share of a step (n,) from a map w (n,) that lets no outline with a barrier touch itself."""
        share = 1.0
        for part in self.barriers:
            share *= min(1.0, part.limit(w, share * step))
        return share

    def _by_squares(self, w: np.ndarray, eps: float):
        """Derivatives of the energy by |a|^2 and |b|^2, those that the Hessian keeps, and its entries."""
        ratio, weight = self.faces.ratio, self.faces.weight * self.counted
        a, b = self.faces.derivatives(self.matrix @ w)
        p, q = squared(a) / ratio, squared(b) / ratio
        # What is flat in any map has no area to divide by, and no weight.
        d = np.where(self.counted, p - q, 1.0)
        chi, slope, bend = _chi(d, self._eps(eps))
        h, h1, h2 = 1 / chi, -slope / chi**2, 2 * slope**2 / chi**3 - bend / chi**2
        # (d^2 + 1) h / 2, whose second derivative is kept where it is positive.
        g1 = self.area_weight * (d * h + (d**2 + 1) / 2 * h1)
        g2 = self.area_weight * np.maximum(h + 2 * d * h1 + (d**2 + 1) / 2 * h2, 0)
        shear = h + (p + q) * h1, h - (p + q) * h1
        scale = weight / ratio
        first = scale * (shear[0] + g1), scale * (shear[1] - g1)
        kept = scale * shear[0], scale * shear[1]
        pp, pq, qq = 2 * h1 + (p + q) * h2 + g2, -(p + q) * h2 - g2, -2 * h1 + (p + q) * h2 + g2
        aa = 2 * kept[0] + scale * 4 * p * pp
        ab = scale * 4 * np.sqrt(p * q) * pq
        bb = 2 * kept[1] + scale * 4 * q * qq
        return first, kept, (aa, ab, bb)


def _chi(det: np.ndarray, eps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """chi(det) with an eps (m,) each, and its first and second derivative; with 0 that of a det > 0 itself."""
    root = np.sqrt(det**2 + eps**2)
    # The same without a difference of what is nearly equal, deep in a fold.
    chi = np.where(det > 0, (det + root) / 2, eps**2 / np.where(det > 0, 1.0, 2 * (root - det)))
    return chi, chi / root, eps**2 / (2 * root**3)


def _squares(rows: np.ndarray) -> np.ndarray:
    """Sums (k,2q,2q) of the squares of linear forms (k,r,q) complex, by both axes of each vertex in turn."""
    real = np.stack([rows.real, -rows.imag], axis=3).reshape(*rows.shape[:2], -1)
    return real.transpose(0, 2, 1) @ real


def subdivided_elements(
    corners: np.ndarray,
    quads: np.ndarray,
    cage_corners: np.ndarray,
    cage_triangles: np.ndarray,
    scale: np.ndarray,
    polygon: np.ndarray | None = None,
) -> CageElements:
    """Elements of fine quads (q,4) with corners (q,4,3) in space, and of the cage's triangles (m,3) with corners
    (m,3,3), whose vertices come after those of the quads. Each shall have scale (q+m,) times its area in the plane.

    Triangles of the cage have next to no weight: they only shall not fold. polygon (m,): of each, by default its own
    """
    space = np.concatenate([corners[:, BOTH].reshape(-1, 3), cage_corners.reshape(-1, 3)])
    area, gradient = hat_gradients(space, np.arange(len(space)).reshape(-1, 3))
    offset = int(quads.max(initial=-1)) + 1
    triangles = np.concatenate([quads[:, BOTH].reshape(-1, 3), cage_triangles + offset])
    fine = 4 * len(quads)
    # A face without area has nothing to ask for.
    area = np.maximum(area, 1e-12 * area.sum() / len(area))
    share = area / area[:fine].sum()
    share[fine:] *= CAGE_WEIGHT
    ratio = np.concatenate([np.repeat(scale[: len(quads)], 4), scale[len(quads) :]])
    own = np.arange(len(cage_triangles)) if polygon is None else polygon
    return CageElements(Elements(triangles, share, gradient, ratio, share), quads, own)


def refine_cage(
    elements: CageElements,
    matrix: csr_matrix,
    uv: np.ndarray,
    fixed: np.ndarray,
    area_weight: float,
    symmetry: MirrorSymmetry | None = None,
    outlines: Sequence[np.ndarray] = (),
) -> Steps[CageMap]:
    """Refine the UVs (n,2) of a cage for the elements of its subdivided surface (`subdivided_elements`).

    matrix (n',n): from the cage to the fine vertices; fixed (n,) bool: vertices of the cage that stay; symmetry: that
    of the map, which is kept; outlines: boundaries (b,) of charts, none of which comes to cross itself
    """
    faces, w = elements.faces, uv @ [1, 1j]
    problem = _CageProblem(
        elements=elements,
        counted=np.ones(len(faces.triangles), bool),
        strict=np.zeros(len(faces.triangles), bool),
        matrix=vstack([matrix, identity(len(uv))]).tocsr(),
        unknowns=(symmetry or without_symmetry(len(uv))).unknowns(fixed),
        assembly=Assembly(faces.triangles[4 * len(elements.quads) :], matrix.shape[0] + len(uv), None, elements.quads),
        area_weight=area_weight,
    )
    of_cage = faces.triangles.min(axis=1) >= matrix.shape[0]
    if symmetry is not None:
        problem = replace(problem, counted=~_flat(problem))
    found = yield from part_of(_descended(problem, w, of_cage, outlines), 0.0, FIRST)
    turned = len(np.setdiff1d(_turned(elements, found.uv), _turned(elements, uv)))
    if turned:
        # Blender takes a polygon of the cage that is turned over for an island, and smooths it without its neighbours.
        strict = of_cage.copy()
        strict[of_cage] = _cage_areas(elements, uv) > 0
        again = _descended(replace(problem, strict=strict), w, of_cage, outlines)
        kept = yield from part_of(again, FIRST, 1 - FIRST)
        found = kept if kept.folds <= found.folds + turned else found
    return found


def _cage_areas(elements: CageElements, uv: np.ndarray) -> np.ndarray:
    """Areas (t,) of the triangles of the cage in UVs (n,2)."""
    triangles = elements.faces.triangles[4 * len(elements.quads) :]
    return signed_areas(uv, triangles - (elements.quads.max(initial=-1) + 1))


def _turned(elements: CageElements, uv: np.ndarray) -> np.ndarray:
    """Polygons (k,) of the cage that are turned over in UVs (n,2)."""
    return np.flatnonzero(np.bincount(elements.polygon, _cage_areas(elements, uv)) < 0)


def _descended(
    problem: _CageProblem, w: np.ndarray, of_cage: np.ndarray, outlines: Sequence[np.ndarray]
) -> Steps[CageMap]:
    """What Newton's method makes of a map w (n,) complex of a cage; of_cage (m,) bool: its triangles."""
    watched = [loop for loop in outlines if len(crossings(w, loop)) == 0]
    iterations, history = 0, list[float]()
    # The second of a quad's triangulations, and the cage.
    spare = of_cage | (np.arange(len(of_cage)) % 4 > 1)
    for k in range(STEPS if problem.unknowns.shape[1] else 0):
        yield Progress("Subdivision", k / STEPS)
        if k == PATIENCE:
            bad = np.zeros(len(spare), bool)
            bad[problem.counted] = problem.dets(w) <= 0
            problem = replace(problem, counted=problem.counted & ~(spare & bad))
        least = float(problem.dets(w).min())
        eps = 0.0 if least > 0 else float(np.hypot(LEAST, REGULAR * least))
        before = problem.energy(w, eps)
        new, decrease = _searched(problem, w, eps, before)
        touching = [loop for loop in watched if new is not None and len(crossings(new, loop))]
        if touching:
            watched = [loop for loop in watched if not any(loop is other for other in touching)]
            strength = CONTACT_STRENGTH / len(problem.elements.quads)
            w = _drawn_in(problem, w, touching, strength, before)
            barriers = tuple(make_barrier(w, loop, strength) for loop in touching)
            problem = replace(problem, barriers=(*problem.barriers, *barriers))
            continue
        if new is None:
            break
        w, iterations = new, k + 1
        history = [*history, before] if eps == 0 else []
        slow = len(history) > LAST and history[-LAST - 1] - before < SLOW * before
        if slow or (eps == 0 and decrease < DONE * max(before, 1e-9)):
            break
    folds = int((problem.dets(w) <= 0).sum())
    return CageMap(np.column_stack([w.real, w.imag]), iterations, folds)


def _drawn_in(
    problem: _CageProblem, w: np.ndarray, loops: Sequence[np.ndarray], strength: float, energy: float
) -> np.ndarray:
    """The map w (n,) of an energy with those of its outlines drawn in a little whose barrier would be more than that;
    as it is where that folds a triangle or lets an outline cross itself."""
    for loop in loops:
        with np.errstate(all="ignore"):
            if make_barrier(w, loop, strength).energy(w) <= energy:
                continue
        before, after = w[loop] - w[np.roll(loop, 1)], w[np.roll(loop, -1)] - w[loop]
        size = np.minimum(np.abs(before), np.abs(after))
        inwards = 0.5j * size * (before / np.abs(before) + after / np.abs(after))
        folds, share = (problem.dets(w) <= 0).sum(), DRAWN_IN
        for _ in range(HALVINGS):
            new = w.copy()
            new[loop] += share * inwards
            if (problem.dets(new) <= 0).sum() <= folds and not len(crossings(new, loop)):
                w = new
                break
            share /= 2
    return w


def _flat(problem: _CageProblem) -> np.ndarray:
    """Triangles (m,) bool that have no area in any map that the unknowns stand for."""
    anywhere = np.random.default_rng(0).normal(size=problem.unknowns.shape[1])
    z = (problem.matrix @ (problem.unknowns @ anywhere).view(complex))[problem.faces.triangles]
    one, other = z[:, 1] - z[:, 0], z[:, 2] - z[:, 0]
    return np.abs((one.conj() * other).imag) <= FLAT * (squared(one) + squared(other))


def _searched(problem: _CageProblem, w: np.ndarray, eps: float, before: float) -> tuple[np.ndarray | None, float]:
    """The map (n,) after a step from w (n,) of energy `before`, None without a decrease, and what was promised."""
    step, decrease = problem.newton(w, eps)
    size = problem.bounded(w, step)
    for _ in range(HALVINGS):
        if problem.energy(w + size * step, eps) <= before - ARMIJO * size * decrease:
            return w + size * step, decrease
        size /= 2
    return None, decrease
