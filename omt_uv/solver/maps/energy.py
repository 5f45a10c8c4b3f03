"""Evaluate the energy of a piecewise linear map to the plane: shear plus weighted area error, infinite at a fold.

    E = sum_p M_p [ sum_f part_f ((s1/s2 + s2/s1)/2 - 1) ] + area_weight * sum_p M_p [ (r + 1/r)/2 - 1 ],
    r = UV area of the polygon / target

with M_p the greater of a polygon's shares of the surface and of the target area, so that neither a magnified part nor
the rest is neglected, and s1 >= s2 the singular values of the Jacobian of a triangle f of the polygon: MIPS (Hormann,
Greiner 2000) plus its area counterpart (Degener, Meseth, Klein 2003). The area is that of the whole polygon, which does
not depend on how it is cut, and the shear of a quad is the mean of both its triangulations (`polygon_elements`), so
that no diagonal prefers a direction. In complex notation the map is w and its derivatives a = dw/dz, b = dw/dconj(z);
det J = |a|^2 - |b|^2 and the shear term is 2 |b|^2 / det J. The energy of a triangle depends on |a| and |b| alone, so
the Hessian's eigensystem is explicit (Smith, de Goes, Kim 2019): the two tangential directions i a, i b are
eigenvectors and the radial ones form a 2x2 block. No singular value decomposition is needed. The area term of a polygon
of several triangles adds the square of its area's slope (Gauss-Newton), one row a polygon.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ..mesh.geometry import LastAnswer, Sides, Sizes, kept_hats

# A relative error of a region's share counts as so much area error: where areas may be off by 0.8 %, it may by 0.15 %;
SHARE_ERROR = 5.4
# and so much that of single faces of the region, or of the rest: they may be off by 1.8 %.
FACE_ERROR = 0.45
AT_ONCE = 100_000  # triangles whose derivatives are found at a time: on the way they take ten times their memory
KEPT = 200_000  # triangles up to which derivatives of the last map are kept: they take a tenth of a Hessian's memory


@dataclass(frozen=True)
class Quads:
    """Quads of a surface: size (q,4), the areas of their four triangles over that of the quad, those of the given
    diagonal first; convex (q,) bool, whether all four are on the quad's own side; crossed (q,) bool, if there are any,
    whether one stands for images that are cut along the other diagonal, too, so that it needs both in every map; both
    (q,) bool, or None for no quad, whose shear is the mean over both triangulations."""

    size: np.ndarray | Sizes
    convex: np.ndarray
    crossed: np.ndarray | None = None
    both: np.ndarray | None = None

    @property
    def part(self) -> np.ndarray:
        """How much (q,4) of the area of the quad each triangle stands for."""
        return self.size[:] * ([1, 1, 0, 0] if self.both is None else np.where(self.both[:, None], 0.5, [1, 1, 0, 0]))

    def of(self, some) -> Quads:
        """Some of the quads, a slice or (q,) bool."""
        crossed, both = (None if x is None else x[some] for x in (self.crossed, self.both))
        return Quads(self.size[some], self.convex[some], crossed, both)


@dataclass(frozen=True)
class Elements:
    """Polygons of a surface, and the triangles on which their shear is measured, ready for the energy.

    triangles (m,3); hats (m,3), the gradients of the hat functions in each triangle's own plane, complex, or, of many,
    what makes them. Of every polygon: area (p,) of the surface, summing to 1; ratio (p,) target UV area over surface
    area; weight (p,) in the energy, summing to 1; region (p,) in [0, 1], weights of a region whose share shall be
    exact, if there is one.
    polygon (m,): whose triangle each is, None where each is a polygon of its own; lone (k,): how much of its polygon's
    area each stands for that is none of a quad's; quads: those of the last triangles, four each.
    """

    triangles: np.ndarray
    area: np.ndarray
    hats: np.ndarray | Sides
    ratio: np.ndarray
    weight: np.ndarray
    region: np.ndarray | None = None
    polygon: np.ndarray | None = None
    lone: np.ndarray | None = None
    quads: Quads | None = None
    _last: LastAnswer = field(default_factory=LastAnswer, init=False, repr=False, compare=False)

    @property
    def gradient(self) -> np.ndarray:
        """The gradients (m,3) complex of the hat functions."""
        return self.gradient_at(slice(None))

    def gradient_at(self, here) -> np.ndarray:
        """`gradient` of some triangles (k,), a slice or their numbers."""
        return self.hats.gradient(here) if isinstance(self.hats, Sides) else self.hats[here]

    def let_go(self) -> None:
        """Hold of many gradients nothing until they are asked for."""
        if isinstance(self.hats, Sides):
            self.hats.let_go()

    @property
    def part(self) -> np.ndarray | None:
        """How much (m,) of its polygon's area each triangle stands for, 0 for one that does not count; or None."""
        if self.lone is None or self.quads is None:
            return self.lone
        return np.concatenate([self.lone, self.quads.part.ravel()])

    @property
    def owner(self) -> np.ndarray:
        """The polygon (m,) whose triangle each is."""
        return np.arange(len(self.triangles)) if self.polygon is None else self.polygon

    def derivatives(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """dw/dz and dw/dconj(z) per triangle, (m,) complex each and not to be written to, of a map w (n,) complex."""
        few = len(w) <= len(self.triangles) <= KEPT  # else a copy of the map takes as long as what it would save
        return self._last.of(self._derivatives, w, self.triangles, self.hats) if few else self._derivatives(w)

    def _derivatives(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a, b = (np.empty(len(self.triangles), complex) for _ in range(2))
        for here in self.some_at_once():
            a[here], b[here] = self.derivatives_at(w, here)
        return a, b

    def derivatives_at(self, w: np.ndarray, here: slice) -> tuple[np.ndarray, np.ndarray]:
        """`derivatives` of some triangles (k,)."""
        corner, g = 0.5 * w[self.triangles[here]], self.gradient_at(here)
        return np.einsum("mi,mi->m", corner, g.conj()), np.einsum("mi,mi->m", corner, g)

    def some_at_once(self) -> Iterator[slice]:
        """Triangles some after the others: what is found of all on the way takes more memory than the mesh."""
        return (slice(begin, begin + AT_ONCE) for begin in range(0, len(self.triangles), AT_ONCE))

    def some_derivatives(self, w: np.ndarray) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        """`derivatives` of some triangles after the others, and which these are."""
        kept = self.derivatives(w) if len(self.triangles) <= KEPT else ()
        return ((here, *([x[here] for x in kept] or self.derivatives_at(w, here))) for here in self.some_at_once())

    def determinants(self, w: np.ndarray) -> np.ndarray:
        """Of the Jacobian of every triangle, (m,), of a map w (n,) complex."""
        det = np.empty(len(self.triangles))
        for here, a, b in self.some_derivatives(w):
            det[here] = squared(a) - squared(b)
        return det

    def areas(self, w: np.ndarray) -> np.ndarray:
        """Signed UV area of every polygon, (p,), over the area of the surface."""
        return self.area * self.sums(self.determinants(w))

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Values of triangles (m,) summed by their parts of the polygons, (p,)."""
        if self.polygon is None or self.lone is None:
            return values
        first, quads = len(self.lone), self.quads
        # Of no values at all it counts in integers.
        found = np.bincount(self.polygon[:first], self.lone * values[:first], len(self.area)).astype(float, copy=False)
        if quads is not None and len(quads.convex):
            four = quads.part
            four *= values[first:].reshape(-1, 4)
            # In this order, as they come: it is that of bincount.
            found[-len(four) :] = four[:, 0] + four[:, 1] + four[:, 2] + four[:, 3]
        return found

    def of_triangles(self, values):
        """Values of polygons (p,), or one for all, as those of the triangles, (m,)."""
        return values if self.polygon is None or np.ndim(values) == 0 else values[self.polygon]

    def folded(self, det: np.ndarray) -> np.ndarray:
        """Triangles (m,) bool that count and whose determinant (m,) is not positive."""
        folded, part = ~(det > 0), self.part
        return folded if part is None else folded & (part > 0)

    @property
    def triangle_areas(self) -> np.ndarray:
        """Area (m,) of the surface that every triangle stands for."""
        part = self.part
        return self.area if self.polygon is None or part is None else self.area[self.polygon] * part

    @property
    def alone(self) -> np.ndarray | None:
        """Triangles (m,) bool that are polygons of their own, None where all are."""
        return None if self.polygon is None else np.bincount(self.polygon)[self.polygon] == 1


def elements(
    positions: np.ndarray, triangles: np.ndarray, target: np.ndarray, region: np.ndarray | None = None
) -> Elements:
    """Elements of a surface (n,3), (m,3) whose triangles shall have the UV areas target (m,), each a polygon.

    Slivers too thin for double precision keep a finite gradient: their height is at least 1e-9 of their length.
    """
    area, hats = kept_hats(positions, triangles)
    weight = np.maximum(area / area.sum(), target / target.sum())
    return Elements(triangles, area / area.sum(), hats, target / area, weight / weight.sum(), region)


def energy(faces: Elements, w: np.ndarray, area_weight: float) -> float:
    """The energy of a map w (n,) complex; infinity where a face is folded."""
    return energy_of(faces, *faces.derivatives(w), area_weight)


def energy_of(faces: Elements, a: np.ndarray, b: np.ndarray, area_weight: float) -> float:
    """The energy of the derivatives a, b (m,) complex; infinity where a face is folded."""
    return float(energies_of(faces, a, b, area_weight).sum())


def energies(faces: Elements, w: np.ndarray, area_weight: float | np.ndarray) -> np.ndarray:
    """The energy of every polygon (p,) of a map w (n,) complex, infinite at a fold; area_weight: one, or (p,)."""
    return energies_of(faces, *faces.derivatives(w), area_weight)


def energies_of(faces: Elements, a: np.ndarray, b: np.ndarray, area_weight: float | np.ndarray) -> np.ndarray:
    """The energy of every face (m,) from the derivatives a, b (m,) complex."""
    outer, inner = squared(a), squared(b)
    det = outer - inner
    safe = np.where(det > 0, det, 1)
    r = faces.sums(safe) / faces.ratio
    value = faces.weight * (faces.sums(2 * inner / safe) + area_weight * ((r + 1 / r) / 2 - 1))
    folded = faces.folded(det)
    if faces.polygon is None:
        return np.where(folded, np.inf, value)
    return np.where(np.bincount(faces.polygon, folded, len(value)) > 0, np.inf, value) if folded.any() else value


def has_folds(faces: Elements, w: np.ndarray) -> bool:
    """Whether a triangle that counts is folded in a map w (n,) complex, or has no area."""
    return bool(faces.folded(faces.determinants(w)).any())


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
    faces: Elements,
    w: np.ndarray,
    area_weight: float | np.ndarray,
    pressure: float | np.ndarray = 1.0,
    eagerness: float | np.ndarray = 0.0,
) -> FaceDerivatives:
    """Gradients and projected Hessians of all faces of a map w (n,) complex without folds.

    The area term bends the energy in two ways: by how fast its slope grows with the area, and by its slope times the
    curvature of the area itself. The second part is indefinite, and nearly cancels between neighbours (a constant
    pressure on all faces has no effect inside), but not once it is projected face by face: then it only holds the
    faces back. `pressure` in [0, 1] is the share of it that the Hessian keeps; at 0 the term is Gauss-Newton's.
    eagerness : see `eager_bend`
    """
    return derivatives_of(faces, *faces.derivatives(w), area_weight, pressure, eagerness)


def derivatives_of(
    faces: Elements,
    a: np.ndarray,
    b: np.ndarray,
    area_weight: float | np.ndarray,
    pressure: float | np.ndarray,
    eagerness: float | np.ndarray = 0.0,
) -> FaceDerivatives:
    """As `face_derivatives`, from the derivatives a, b (m,) complex of the map."""
    return face_derivatives_of(faces, a, b, *by_squares(faces, a, b, area_weight, pressure, eagerness))


def face_derivatives_of(faces: Elements, a: np.ndarray, b: np.ndarray, first, kept, block) -> FaceDerivatives:
    """Gradients and projected Hessians of an energy of |a|^2 and |b|^2.

    first: its derivatives by both, (m,) each; kept: those that the Hessian along the phases sees; block: the Hessian's
    entries aa, ab, bb by |a| and |b|.
    """
    h_outer, h_inner = kept
    g, corner = faces.gradient, corner_slopes(faces, a, b, first)
    # Linear forms: change of |a|, of |b|, and of the two phases.
    along_a = 0.5 * unit(a).conj()[:, None] * g.conj()
    along_b = 0.5 * unit(b).conj()[:, None] * g
    turn_a = -1j * np.sqrt(np.maximum(2 * h_outer, 0))[:, None] * along_a
    turn_b = -1j * np.sqrt(np.maximum(2 * h_inner, 0))[:, None] * along_b
    (c1, s1, v1), (c2, s2, v2) = _split(*block)
    radial1 = np.sqrt(v1)[:, None] * (c1[:, None] * along_a + s1[:, None] * along_b)
    radial2 = np.sqrt(v2)[:, None] * (c2[:, None] * along_a + s2[:, None] * along_b)
    return FaceDerivatives(corner, np.stack([turn_a, turn_b, radial1, radial2], axis=1))


def corner_slopes(faces: Elements, a: np.ndarray, b: np.ndarray, first) -> np.ndarray:
    """Gradient (m,3) complex by the corners of an energy with these derivatives by |a|^2 and |b|^2, (m,) each."""
    g = faces.gradient
    return (first[0] * a)[:, None] * g + (first[1] * b)[:, None] * g.conj()


def by_squares(faces, a, b, area_weight, pressure, eagerness):
    """Derivatives by |a|^2 and |b|^2, the same for the Hessian, and the Hessian's entries by |a| and |b|."""
    outer, inner = squared(a), squared(b)
    det = outer - inner
    weight, ratio, whole = faces.weight, faces.ratio, det
    if faces.polygon is not None:
        part = faces.part
        det = np.where(part > 0, det, 1)
        weight, ratio = faces.weight[faces.polygon] * part, faces.ratio[faces.polygon]
        whole = faces.sums(det)[faces.polygon]
        area_weight, pressure = faces.of_triangles(area_weight), faces.of_triangles(pressure)
        eagerness = faces.of_triangles(eagerness)
    slope = area_weight / 2 * (1 / ratio - ratio / whole**2)
    bend = area_weight * eager_bend(whole / ratio, eagerness) / ratio**2
    if faces.alone is not None:
        # That of a polygon of several triangles is a row of its own, see `area_forms_of`.
        bend = np.where(faces.alone, bend, 0)
    bend = bend + 4 * inner / det**3
    shear_outer, shear_inner = -2 * inner / det**2, 2 / det + 2 * inner / det**2
    first = weight * (shear_outer + slope), weight * (shear_inner - slope)
    kept = weight * (shear_outer + pressure * slope), weight * (shear_inner - pressure * slope)
    aa = 2 * kept[0] + weight * 4 * outer * bend
    ab = -4 * weight * np.sqrt(outer * inner) * (bend + 2 / det**2)
    bb = 2 * kept[1] + weight * 4 * inner * (bend + 4 / det**2)
    return first, kept, (aa, ab, bb)


def eager_bend(r: np.ndarray, eagerness: float | np.ndarray) -> np.ndarray:
    """Second derivative of (r + 1/r)/2 at area ratios r (p,), less where r is small, and more where it is great.

    With its own, r^-3, Newton's method makes a tiny r half as large again a step, and overshoots a large one. Times
    (r^2 - 1) / (2 log r) it takes the step of log r to 0. eagerness : the power of that factor, 0 for its own
    """
    if not np.any(eagerness):
        return 1 / r**3
    log = np.log(r)
    even = np.abs(log) < 1e-4
    factor = np.where(even, 1 + log, (r * r - 1) / np.where(even, 1, 2 * log))
    return factor**eagerness / r**3


def area_forms_of(
    faces: Elements,
    a: np.ndarray,
    b: np.ndarray,
    area_weight: float | np.ndarray,
    eagerness: float | np.ndarray = 0.0,
) -> np.ndarray:
    """Rows of the area term's Hessian, corner by corner (m,3) complex: a polygon's row is the sum over its triangles.

    The row is the slope of the polygon's area times the root of the area term's second derivative by it. 0 for polygons
    of one triangle, whose term is among the rows of `face_derivatives`. a, b (m,) complex : derivatives of the map;
    eagerness : see `eager_bend`
    """
    whole = faces.sums(squared(a) - squared(b))
    size = np.sqrt(faces.weight * area_weight * eager_bend(whole / faces.ratio, eagerness)) / faces.ratio
    g, alone, part = faces.gradient, faces.alone, faces.part
    if alone is None or part is None:
        return np.zeros(faces.triangles.shape, complex)
    scale = np.where(alone, 0, part * size[faces.polygon])
    return scale[:, None] * (a.conj()[:, None] * g.conj() - b.conj()[:, None] * g)


def _split(aa, ab, bb):
    """Eigenvectors (cos, sin) and eigenvalues, negative ones set to 0, of symmetric 2x2 matrices."""
    angle = 0.5 * np.arctan2(2 * ab, aa - bb)
    c, s = np.cos(angle), np.sin(angle)
    mean, half = (aa + bb) / 2, np.hypot((aa - bb) / 2, ab)
    return (c, s, np.maximum(mean + half, 0)), (-s, c, np.maximum(mean - half, 0))


def without_negative(aa, ab, bb):
    """Symmetric 2x2 matrices, entries (m,) each, with their negative eigenvalues set to 0."""
    mean, half = (aa + bb) / 2, np.hypot((aa - bb) / 2, ab)
    low = mean < half
    scale = np.where(low, np.maximum(mean + half, 0) / np.where(half > 0, 2 * half, 1), 1)
    apart = (aa - bb) / 2
    return np.where(low, scale * (half + apart), aa), scale * ab, np.where(low, scale * (half - apart), bb)


def squared(z: np.ndarray) -> np.ndarray:
    """|z|^2 of complex numbers, in their shape, without the root that `abs` takes."""
    return z.real**2 + z.imag**2


def unit(z: np.ndarray) -> np.ndarray:
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
    """Relative error of the share of the region with UV areas (p,), and of single polygons, in the region or in the
    rest, whichever is worse; 0 without a region."""
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
    """The polygons with exp(tilt * weight) times their targets in the region; the targets sum to what they did."""
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
