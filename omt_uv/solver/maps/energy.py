"""Evaluate the energy of a piecewise linear map to the plane: shear plus weighted area error, infinite at a fold.

    E = sum_f M_f [ (s1/s2 + s2/s1)/2 - 1 ] + area_weight sum_f M_f [ (r + 1/r)/2 - 1 ],   r = s1 s2 / target ratio

with M_f the greater of a face's shares of the surface and of the target area, so that neither a magnified region nor
the rest is neglected, and s1 >= s2 the singular values of a face's Jacobian: MIPS (Hormann, Greiner 2000) plus its
area counterpart (Degener, Meseth, Klein 2003). In complex notation the map is w and its derivatives
a = dw/dz, b = dw/dconj(z); det J = |a|^2 - |b|^2 and the shear term is 2 |b|^2 / det J. The energy depends on
|a| and |b| alone, so the Hessian's eigensystem is explicit (Smith, de Goes, Kim 2019): the two tangential
directions i a, i b are eigenvectors and the radial ones form a 2x2 block. No singular value decomposition is needed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

# A relative error of a region's share counts as so much area error: where areas may be off by 0.8 % it may be by 0.3 %;
SHARE_ERROR = 2.7
# and so much that of single faces of the region, or of the rest: they may be off by 1.8 %.
FACE_ERROR = 0.45


@dataclass(frozen=True)
class Elements:
    """Faces of a surface, ready for the energy.

    triangles (m,3); area (m,) of the surface, summing to 1; gradient (m,3) complex, the gradients of the hat functions
    in each face's own plane; ratio (m,) target UV area over surface area; weight (m,) in the energy,
    summing to 1; region (m,) in [0, 1], weights of a region whose share shall be exact, if there is one.
    """

    triangles: np.ndarray
    area: np.ndarray
    gradient: np.ndarray
    ratio: np.ndarray
    weight: np.ndarray
    region: np.ndarray | None = None

    def derivatives(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """dw/dz and dw/dconj(z) per face, (m,) complex each, of a map w (n,) complex."""
        corner = 0.5 * w[self.triangles]
        g = self.gradient
        a = np.einsum("mi,mi->m", corner, g.conj())
        b = np.einsum("mi,mi->m", corner, g)
        return a, b

    def areas(self, w: np.ndarray) -> np.ndarray:
        """Signed UV area of every face, (m,), over the area of the surface."""
        a, b = self.derivatives(w)
        return self.area * (squared(a) - squared(b))


def elements(
    positions: np.ndarray, triangles: np.ndarray, target: np.ndarray, region: np.ndarray | None = None
) -> Elements:
    """Elements of a surface (n,3), (m,3) whose faces shall have the UV areas target (m,).

    Slivers too thin for double precision keep a finite gradient: their height is at least 1e-9 of their length.
    """
    p = positions[triangles]
    e1, e2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    side = np.linalg.norm(e1, axis=1)
    x = np.einsum("md,md->m", e2, e1) / side
    y = np.linalg.norm(np.cross(e1, e2), axis=1) / side
    y = np.maximum(y, 1e-9 * np.maximum(side, np.abs(x)))
    local = np.stack([np.zeros(len(x)), side, x + 1j * y], axis=1)
    area = 0.5 * side * y
    # The gradient of a hat function is the opposite side, turned by a quarter, over twice the area.
    gradient = 1j * (local[:, [2, 0, 1]] - local[:, [1, 2, 0]]) / (2 * area)[:, None]
    weight = np.maximum(area / area.sum(), target / target.sum())
    return Elements(
        triangles=triangles,
        area=area / area.sum(),
        gradient=gradient,
        ratio=target / area,
        weight=weight / weight.sum(),
        region=region,
    )


def energy(faces: Elements, w: np.ndarray, area_weight: float) -> float:
    """The energy of a map w (n,) complex; infinity where a face is folded."""
    return energy_of(faces, *faces.derivatives(w), area_weight)


def energy_of(faces: Elements, a: np.ndarray, b: np.ndarray, area_weight: float) -> float:
    """The energy of the derivatives a, b (m,) complex; infinity where a face is folded."""
    return float(_energies(faces, a, b, area_weight).sum())


def energies(faces: Elements, w: np.ndarray, area_weight: float | np.ndarray) -> np.ndarray:
    """The energy of every face (m,) of a map w (n,) complex, infinite at a fold; area_weight: one, or (m,)."""
    return _energies(faces, *faces.derivatives(w), area_weight)


def _energies(faces: Elements, a: np.ndarray, b: np.ndarray, area_weight: float | np.ndarray) -> np.ndarray:
    """The energy of every face (m,) from the derivatives a, b (m,) complex."""
    outer, inner = squared(a), squared(b)
    det = outer - inner
    good = det > 0
    safe = np.where(good, det, 1)
    r = safe / faces.ratio
    return np.where(good, faces.weight * (2 * inner / safe + area_weight * ((r + 1 / r) / 2 - 1)), np.inf)


def gradient(faces: Elements, w: np.ndarray, area_weight: float | np.ndarray) -> np.ndarray:
    """Gradient (n,) complex: real part by u, imaginary part by v."""
    return sum_at_vertices(faces, face_derivatives(faces, w, area_weight).gradient, len(w))


def sum_at_vertices(faces: Elements, corner: np.ndarray, n: int) -> np.ndarray:
    """Sum of corner values (m,3) complex at each of n vertices, (n,)."""
    flat = faces.triangles.ravel()
    return np.bincount(flat, corner.real.ravel(), n) + 1j * np.bincount(flat, corner.imag.ravel(), n)


@dataclass(frozen=True)
class FaceDerivatives:
    """Per face: gradient (m,3) complex by its corners; the Hessian is the sum of squares of its rows (m,4,3) complex.

    A row stands for the linear form dw -> Re(row . dw).
    """

    gradient: np.ndarray
    rows: np.ndarray


def face_derivatives(
    faces: Elements, w: np.ndarray, area_weight: float | np.ndarray, pressure: float | np.ndarray = 1.0
) -> FaceDerivatives:
    """Gradients and projected Hessians of all faces of a map w (n,) complex without folds.

    The area term bends the energy in two ways: by how fast its slope grows with the area, and by its slope times the
    curvature of the area itself. The second part is indefinite, and nearly cancels between neighbours (a constant
    pressure on all faces has no effect inside), but not once it is projected face by face: then it only holds the
    faces back. `pressure` in [0, 1] is the share of it that the Hessian keeps; at 0 the term is Gauss-Newton's.
    """
    return derivatives_of(faces, *faces.derivatives(w), area_weight, pressure)


def derivatives_of(
    faces: Elements, a: np.ndarray, b: np.ndarray, area_weight: float | np.ndarray, pressure: float | np.ndarray
) -> FaceDerivatives:
    """As `face_derivatives`, from the derivatives a, b (m,) complex of the map."""
    return face_derivatives_of(faces, a, b, *_by_squares(faces, a, b, area_weight, pressure))


def face_derivatives_of(faces: Elements, a: np.ndarray, b: np.ndarray, first, kept, block) -> FaceDerivatives:
    """Gradients and projected Hessians of an energy of |a|^2 and |b|^2.

    first: its derivatives by both, (m,) each; kept: those that the Hessian along the phases sees; block: the Hessian's
    entries aa, ab, bb by |a| and |b|.
    """
    (e_outer, e_inner), (h_outer, h_inner) = first, kept
    g = faces.gradient
    corner = (e_outer * a)[:, None] * g + (e_inner * b)[:, None] * g.conj()
    # Linear forms: change of |a|, of |b|, and of the two phases.
    along_a = 0.5 * _unit(a).conj()[:, None] * g.conj()
    along_b = 0.5 * _unit(b).conj()[:, None] * g
    turn_a = -1j * np.sqrt(np.maximum(2 * h_outer, 0))[:, None] * along_a
    turn_b = -1j * np.sqrt(np.maximum(2 * h_inner, 0))[:, None] * along_b
    (c1, s1, v1), (c2, s2, v2) = _split(*block)
    radial1 = np.sqrt(v1)[:, None] * (c1[:, None] * along_a + s1[:, None] * along_b)
    radial2 = np.sqrt(v2)[:, None] * (c2[:, None] * along_a + s2[:, None] * along_b)
    return FaceDerivatives(corner, np.stack([turn_a, turn_b, radial1, radial2], axis=1))


def _by_squares(faces, a, b, area_weight, pressure):
    """Derivatives by |a|^2 and |b|^2, the same for the Hessian, and the Hessian's entries by |a| and |b|."""
    outer, inner = squared(a), squared(b)
    det = outer - inner
    slope = area_weight / 2 * (1 / faces.ratio - faces.ratio / det**2)
    bend = area_weight * faces.ratio / det**3 + 4 * inner / det**3
    weight, shear_outer, shear_inner = faces.weight, -2 * inner / det**2, 2 / det + 2 * inner / det**2
    first = weight * (shear_outer + slope), weight * (shear_inner - slope)
    kept = weight * (shear_outer + pressure * slope), weight * (shear_inner - pressure * slope)
    aa = 2 * kept[0] + weight * 4 * outer * bend
    ab = -4 * weight * np.sqrt(outer * inner) * (bend + 2 / det**2)
    bb = 2 * kept[1] + weight * 4 * inner * (bend + 4 / det**2)
    return first, kept, (aa, ab, bb)


def _split(aa, ab, bb):
    """Eigenvectors (cos, sin) and eigenvalues, negative ones set to 0, of symmetric 2x2 matrices."""
    angle = 0.5 * np.arctan2(2 * ab, aa - bb)
    c, s = np.cos(angle), np.sin(angle)
    mean, half = (aa + bb) / 2, np.hypot((aa - bb) / 2, ab)
    return (c, s, np.maximum(mean + half, 0)), (-s, c, np.maximum(mean - half, 0))


def squared(z: np.ndarray) -> np.ndarray:
    """|z|^2 of complex numbers, in their shape, without the root that `abs` takes."""
    return z.real**2 + z.imag**2


def _unit(z: np.ndarray) -> np.ndarray:
    """Complex numbers (m,) of length one, 1 for 0."""
    size = np.abs(z)
    return np.where(size > 0, z, 1) / np.where(size > 0, size, 1)


def area_error(faces: Elements, w: np.ndarray) -> float:
    """Share of the UV area of w (n,) in the wrong place: sum of |share - target share| over the faces."""
    return _area_error(faces, faces.areas(w))


def _area_error(faces: Elements, area: np.ndarray) -> float:
    """As `area_error`, from the UV areas (m,)."""
    target = faces.area * faces.ratio
    return float(np.abs(area / area.sum() - target / target.sum()).sum())


def _region_error(faces: Elements, area: np.ndarray) -> tuple[float, float]:
    """Relative error of the share of the region with UV areas (m,), and of single faces, in the region or in the rest,
    whichever is worse; 0 without a region."""
    if faces.region is None:
        return 0.0, 0.0
    target = faces.area * faces.ratio
    error, target = area / area.sum() - target / target.sum(), target / target.sum()
    whole, single = 0.0, 0.0
    for side in (faces.region, 1 - faces.region):
        share = max(float(side @ target), float(np.finfo(float).tiny))
        whole = max(whole, abs(float(side @ error)) / share)
        single = max(single, float(side @ np.abs(error)) / share)
    return whole, single


def tilted(faces: Elements, tilt: float) -> Elements:
    """The faces with exp(tilt * region) times their targets; the targets sum to what they did."""
    if tilt == 0 or faces.region is None:
        return faces
    ratio = faces.ratio * np.exp(tilt * faces.region)
    return replace(faces, ratio=ratio * ((faces.area @ faces.ratio) / (faces.area @ ratio)))


def missing_tilt(faces: Elements, w: np.ndarray) -> float:
    """The tilt that the areas of a map w (n,) lack to give the region its share, to first order; 0 without a region."""
    if faces.region is None:
        return 0.0
    has, target = (x / x.sum() for x in (faces.areas(w), faces.area * faces.ratio))
    mean = float(faces.region @ has)
    spread = float(faces.region**2 @ has) - mean**2
    return (float(faces.region @ target) - mean) / spread if spread > 0 else 0.0


def target_error(faces: Elements, w: np.ndarray) -> float:
    """What is left to do: the area error of a map (n,), or as much for a region or a rest that are not exact yet."""
    return _target_error(faces, faces.areas(w))


def target_error_but_share(faces: Elements, w: np.ndarray) -> float:
    """`target_error` of the areas that a map w (n,) would have with the tilt that is missing."""
    area = faces.areas(w)
    if faces.region is not None:
        area = area * np.exp(missing_tilt(faces, w) * faces.region)
    return _target_error(faces, area)


def _target_error(faces: Elements, area: np.ndarray) -> float:
    """As `target_error`, from the UV areas (m,)."""
    share, single = _region_error(faces, area)
    return max(_area_error(faces, area), SHARE_ERROR * share, FACE_ERROR * single)
