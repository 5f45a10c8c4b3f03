"""Coarsen the mesh of a disk, and prolong maps without folds, by half-edge collapses (Hoppe 1996).

An independent set of vertices is removed in every round (Kirkpatrick 1983). The mesh is carried along as an embedding
in the plane: a collapse that keeps all its triangles positive there keeps the mesh a disk. Without an embedding it is
one that makes no edge twice (the link condition of Dey, Edelsbrunner, Guha, Nekhayev 1999). On the way back every
vertex returns into the star that it left: the vertex it was collapsed to sees all of that star, so near it there is
always a place where no face folds (Shen, Jiang, Zorin, Panozzo 2019).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..maps.energy import Elements, elements
from ..mesh.geometry import complex_cross, cross2, cross3, face_areas, lengths, of_corners
from ..mesh.topology import are_among, boundary_loops, expand, halfedges, order_of_pairs, pair_keys, runs
from ..progress import Progress, Steps
from .vertex_sweeps import independent_set, relax, stars

# Faces of stars whose collapses are compared at once, roughly: what their pairs take stays in the cache.
PART = 1 << 15
# A vertex with more faces stays: comparing all its collapses costs the square of their number.
MOST_FACES = 9
# Shape (1: equilateral) that new faces need in space, unless the old ones were worse.
LEAST_SHAPE = 0.15
# The same in the plane.
LEAST_FLAT_SHAPE = 1e-7
# Rounds end when one removes a smaller share of the vertices.
LEAST_PROGRESS = 0.03
# Vertices whose stars hold so many times the mean of what is to be spread evenly stay, too.
HEAVY = 1.0
# Vertices of the boundary stay while they are at most this share of those that are left.
BOUNDARY_SHARE = 0.25
# Share of the area at a safe place that every returning face keeps.
KEPT_AREA = 0.1
# Newton steps of a returning vertex: its neighbours have yet to move.
RELAX_STEPS = 2
# Area weight in them.
RELAX_WEIGHT = 10.0


@dataclass(frozen=True)
class RemovalRound:
    """Vertices that were removed in one round.

    Attributes
    ----------
    vertex, into : (k,) each went to the place of another
    corner, share : (k,3) it returns to the mean of these vertices with these weights
    row, after, before : (s,) its star was the triangles (vertex[row], after, before)
    mass : (s,) target areas of these
    """

    vertex: np.ndarray
    into: np.ndarray
    corner: np.ndarray
    share: np.ndarray
    row: np.ndarray
    after: np.ndarray
    before: np.ndarray
    mass: np.ndarray

    def faces(self, vertices: np.ndarray) -> Elements:
        """The triangles of the stars, of the fine mesh (n,3); kept, they would take as much memory as all else."""
        return elements(vertices, np.column_stack([self.vertex[self.row], self.after, self.before]), self.mass)

    @property
    def on_boundary(self) -> np.ndarray:
        """Which vertices (k,) bool return to a chord of the boundary."""
        return self.corner[:, 1] == self.corner[:, 2]


@dataclass(frozen=True)
class CoarseMesh:
    """A coarse mesh.

    Attributes
    ----------
    kept : (c,) vertices of the fine mesh
    triangles : (t,3) of them
    mass : (t,) target area of the triangles
    region : (t,) weights of a region, if there is one
    rounds : of collapses that led there
    vertices : (n,3) of the fine mesh
    """

    kept: np.ndarray
    triangles: np.ndarray
    mass: np.ndarray
    region: np.ndarray | None
    rounds: list[RemovalRound]
    vertices: np.ndarray

    def prolonged(self, uv: np.ndarray, n: int) -> Steps[np.ndarray]:
        """A map uv (c,2) of the coarse mesh without folds, carried to all n vertices, without folds."""
        w = np.zeros(n, complex)
        w[self.kept] = uv[:, 0] + 1j * uv[:, 1]
        for k, removal in enumerate(reversed(self.rounds)):
            yield Progress("Coarser mesh", k / len(self.rounds))
            w[removal.vertex] = _returned(removal, w)
            # Boundary vertices stay on the chords: where the coarse boundary does not cross itself, neither does this.
            faces, fixed = removal.faces(self.vertices), removal.on_boundary
            relax(removal.vertex, removal.row, faces, w, RELAX_WEIGHT, RELAX_STEPS, fixed)
        return np.column_stack([w.real, w.imag])


@dataclass(frozen=True)
class Collapsing:
    """Which vertices are to go; whole_boundary: none of the boundary, however many they are of those that are left;
    light_first: those with few faces sooner, which lets more of them go in a round (Kirkpatrick 1983)."""

    whole_boundary: bool = False
    light_first: bool = False


def coarsen_disk(
    vertices, triangles, flat, mass, goal: int, region=None, density=None, how: Collapsing | None = None
) -> Steps[CoarseMesh]:
    """Coarsen a disk (n,3), (m,3) to about `goal` vertices.

    flat (n,2): an embedding in the plane with a convex boundary, or None; mass (m,): what the triangles' areas in the
    final map are to be, handed on; region (m,) in [0, 1]: weights of a region, which keeps its share of the mass;
    density (n,): how many vertices are to be left there for an area, relative to elsewhere; by default that is left to
    chance.
    """
    how = how or Collapsing()
    mass = np.column_stack([mass] if region is None else [mass, mass * region])
    rounds: list[RemovalRound] = []
    left = count = len(vertices)
    boundary = boundary_loops(triangles)[0]
    while left > goal:
        yield Progress("Coarser mesh", np.log(count / left) / np.log(count / goal))
        rank = np.random.default_rng(len(rounds)).permutation(count)
        if how.light_first:
            rank += count * (MOST_FACES - np.minimum(MOST_FACES, np.bincount(triangles.ravel(), minlength=count)))
        if how.whole_boundary or len(boundary) <= BOUNDARY_SHARE * left:
            rank[boundary] = -1
        if density is not None:
            rank[_heavy(vertices, triangles, density)] = -1
        ahead = np.full(count, -1)
        ahead[boundary] = np.roll(boundary, -1)
        triangles, mass, removal = _round(vertices, triangles, flat, mass, rank, ahead)
        rounds.append(removal)
        left -= len(removal.vertex)
        stays = np.ones(count, bool)
        stays[removal.vertex] = False
        boundary = boundary[stays[boundary]]
        if len(removal.vertex) < LEAST_PROGRESS * left:
            break
    kept = np.unique(triangles)
    place = np.full(count, -1)
    place[kept] = np.arange(len(kept))
    region = None if region is None else mass[:, 1] / mass[:, 0]
    return CoarseMesh(
        kept=kept, triangles=place[triangles], mass=mass[:, 0], region=region, rounds=rounds, vertices=vertices
    )


def _heavy(V, F, density):
    """Vertices (n,) bool whose stars hold more than others of the surface with this density (n,)."""
    weight = density * np.bincount(F.ravel(), np.repeat(face_areas(V, F), 3), len(V))
    return weight > HEAVY * weight[weight > 0].mean()


def _round(V, F, flat, mass, rank, ahead):
    """Collapse an independent set: triangles and mass afterwards, and the removal. ahead (n,): of a vertex of the
    boundary the next one, else -1."""
    count = np.bincount(F.ravel(), minlength=len(V))
    star, turned = stars(F, independent_set(F, np.where((count > MOST_FACES) | (count < 2), -1, rank)))
    v, after, before = np.take_along_axis(F[star], turned, 1).T
    into, good = _collapses(V, flat, v, after, before, ahead)
    if flat is None:
        good &= _simple(F, v, after, before, into, good)
    star, v, after, before, into = (x[good] for x in (star, v, after, before, into))
    vertex, row = runs(v)
    stays = (after != into) & (before != into)
    new = np.column_stack([into, after, before])[stays]
    normal = None if flat is not None else _sums(row, _normals(V, np.column_stack([v, after, before]))[0])
    corner, share = _places(V, flat, vertex, row[stays], new, ahead, normal)
    numbers = {
        "vertex": vertex,
        "into": new[np.searchsorted(row[stays], np.arange(len(vertex))), 0],
        "corner": corner,
        "row": row,
        "after": after,
        "before": before,
    }
    # They wait for the way back, and take half of the memory that they were found in.
    kept = {name: values.astype(np.int32) for name, values in numbers.items()}
    removal = RemovalRound(share=share, mass=mass[star, 0], **kept)
    size = np.sqrt(_squared(_normals(V, new)[0].T))
    part = size / np.maximum(np.bincount(row[stays], size, len(vertex)), 1e-300)[row[stays]]
    others = np.ones(len(F), bool)
    others[star] = False
    total = np.column_stack([np.bincount(row, column[star], len(vertex)) for column in mass.T])
    handed = part[:, None] * total[row[stays]]
    return np.concatenate([F[others], new]), np.concatenate([mass[others], handed]), removal


def _simple(F, v, after, before, into, good):
    """Which faces (s,) of the stars of vertices v (s,) are of collapses, of the good ones (s,) bool, that make no edge
    that is there already, or that another one makes, too."""
    row = runs(v)[1]
    vertex = np.flatnonzero(np.diff(row, prepend=-1))
    goal, fails = into[vertex], np.zeros(len(vertex), bool)
    # Those in the two faces of the edge that goes, one on each side, are joined to both of its ends.
    beside = np.full((2, len(vertex)), -1)
    for known, end, other in zip(beside, (after, before), (before, after), strict=True):
        at = np.flatnonzero(end == into)
        known[row[at]] = other[at]
    ends, of = np.column_stack([after[good], before[good]]).ravel(), np.repeat(row[good], 2)
    new = (ends != goal[of]) & (ends != beside[0, of]) & (ends != beside[1, of])
    ends, of = ends[new], of[new]
    made = pair_keys(ends, goal[of])
    # Every one of them is in two faces of its star, or at the boundary in one; the order is a stable one.
    order = order_of_pairs(made)
    made, of = made[order], of[order]
    first = np.diff(made, prepend=-1) != 0
    owner = of[np.flatnonzero(first)][np.cumsum(first) - 1]
    fails[of[(of != owner) | are_among(made, pair_keys(*halfedges(F)))]] = True
    return ~fails[row]


def _collapses(V, flat, v, after, before, ahead):
    """`_best_collapses` of some stars after the others: pairs of their faces are several times as many as these."""
    ends = np.flatnonzero(np.diff(v)) + 1
    # A star is in one part.
    parts = ends[np.flatnonzero(np.diff(ends // PART, prepend=0))]
    several = [np.split(x, parts) for x in (v, after, before)]
    found = [_best_collapses(V, flat, one, two, three, ahead) for one, two, three in zip(*several, strict=True)]
    return tuple(np.concatenate(x) for x in zip(*found, strict=True))


def _best_collapses(V, flat, v, after, before, ahead):
    """For every face (s,) of the stars: the best vertex that its own may collapse to, and whether it is good enough.

    A vertex of the boundary may only go to the next one.
    """
    if not len(v):
        return v, np.zeros(0, bool)
    row = runs(v)[1]
    size = np.bincount(row)
    first = np.cumsum(size) - size
    # All pairs of a candidate, the corner `after` of one face, and another face of the same star.
    candidate, other = expand(size[row])
    other = other + first[row[candidate]]
    into = after[candidate]
    # Two faces of every star of five or six go, of which nothing is asked.
    stays = (after[other] != into) & (before[other] != into)
    candidate, other = candidate[stays], other[stays]
    left = np.bincount(candidate, minlength=len(v))
    begin = (np.cumsum(left) - left)[left > 0]
    normal, old = _normals(V, np.column_stack([v, after, before]))
    new_normal, shape = _normals_of(*_gathered(V, after, before, candidate, other))
    whole = _sums(row, normal)
    along = [x * y[row[candidate]] for x, y in zip(new_normal, whole.T.copy(), strict=True)]
    turned = along[0] + along[1] + along[2] <= 0
    if flat is not None:
        turned |= _flat_shape(*_gathered(flat, after, before, candidate, other)) < LEAST_FLAT_SHAPE
    # Those that turn over have less than any shape.
    score = np.full(len(v), np.inf)
    score[left > 0] = np.minimum.reduceat(np.where(turned, -1.0, shape), begin)
    bad = ~((score >= 0) & (score < np.inf))
    # Nor does an inner vertex go to the boundary: edges across would cut off parts that have no room in a domain.
    bad |= ((ahead[v] >= 0) & (after != ahead[v])) | ((ahead[v] < 0) & (ahead[after] >= 0))
    bad |= score < np.minimum(LEAST_SHAPE, np.minimum.reduceat(old, first)[row] / 2)
    # Coarse marks, so that rounding does not choose among equals.
    mark = np.where(bad, -1, np.floor(np.minimum(score, 1) * 20 + 0.37).astype(np.int64))
    best = np.maximum.reduceat(mark * len(v) - np.arange(len(v)), first)
    winner = (-best % len(v))[row]
    return after[winner], ~bad[winner]


def _places(V, flat, vertex, row, new, ahead, normal):
    """Corners and weights (k,3) to return to: of the new triangle around the vertex; on the boundary, of its chord.

    normal (k,3): of the stars, along which they are looked at where there is no flat embedding
    """
    a, b, c = (V if flat is None else flat)[new].transpose(1, 0, 2)
    p = (V if flat is None else flat)[vertex[row]]
    sides = ((b - p, c - p), (c - p, a - p), (a - p, b - p))
    if flat is None:
        weights = np.column_stack([np.einsum("sd,sd->s", cross3(*pair), normal[row]) for pair in sides])
    else:
        weights = np.column_stack([cross2(*pair) for pair in sides])
    total = weights.sum(1)[:, None]
    # Of a triangle without area: outside of it.
    weights = np.divide(weights, total, out=np.tile([-1.0, 1.0, 1.0], (len(total), 1)), where=total != 0)
    # The first of those it is deepest in.
    begin, depth = np.searchsorted(row, np.arange(len(vertex))), of_corners(np.minimum, weights)
    deepest = np.flatnonzero(depth == np.maximum.reduceat(depth, begin)[row])
    around = deepest[np.searchsorted(row[deepest], np.arange(len(vertex)))]
    corner, share = new[around], weights[around]
    back = np.full(len(V), -1)
    boundary = np.flatnonzero(ahead >= 0)
    back[ahead[boundary]] = boundary
    on_boundary = np.flatnonzero(ahead[vertex] >= 0)
    v = vertex[on_boundary]
    forth, past = (lengths(V[v] - V[x[v]]) for x in (ahead, back))
    part = past / np.maximum(forth + past, 1e-300)
    corner[on_boundary] = np.column_stack([ahead[v], back[v], back[v]])
    share[on_boundary] = np.column_stack([part, 1 - part, np.zeros(len(v))])
    return corner, share


def _returned(removal: RemovalRound, w: np.ndarray) -> np.ndarray:
    """Places (k,) of the vertices that return: where they belong, or as near to it as their stars allow."""
    target = (removal.share * w[removal.corner]).sum(1)
    row, count, base = removal.row, len(removal.vertex), w[removal.into]
    a, b = w[removal.after], w[removal.before]
    touching = (removal.after == removal.into[row]) | (removal.before == removal.into[row])
    inward = np.where(touching, _left(b - a), 0)
    heading = np.bincount(row, inward.real, count) + 1j * np.bincount(row, inward.imag, count)
    # On the boundary, between the one edge and the chord: beyond the chord may be another part of the map.
    heading = heading + np.where(removal.on_boundary, _left(w[removal.corner[:, 0]] - w[removal.corner[:, 1]]), 0)
    slope, room = complex_cross(b - a, heading[row]), complex_cross(a - base[row], b - base[row])
    reach = np.where(touching | (slope >= 0), np.inf, room / np.maximum(-slope, 1e-300))
    nearest = np.full(count, np.inf)
    np.minimum.at(nearest, row, reach)
    # Lines that hardly slope meet the heading far outside of the star.
    nearest = np.minimum(nearest, np.maximum.reduceat(np.abs(a - base[row]), np.searchsorted(row, np.arange(count))))
    safe = base + 0.5 * nearest * heading
    at_safe, at_target = (complex_cross(a - x[row], b - x[row]) for x in (safe, target))
    short = at_target < KEPT_AREA * at_safe
    way = np.ones(count)
    np.minimum.at(way, row[short], ((1 - KEPT_AREA) * at_safe / np.maximum(at_safe - at_target, 1e-300))[short])
    return safe + way * (target - safe)


def _sums(row, vectors):
    """Sums (k,3) of vectors (s,3) by their rows (s,)."""
    return np.column_stack([np.bincount(row, vectors[:, k]) for k in range(3)])


def _left(edge):
    """Unit vectors to the left of edges (k,) complex."""
    return 1j * edge / np.maximum(np.abs(edge), 1e-300)


def _normals(V, F):
    """Normals (m,3) of triangles, as long as twice their areas, and their shapes (m,): 4 sqrt(3) area over the squared
    sides, 1 for equilateral triangles, 0 for degenerate ones."""
    normal, shape = _normals_of(*(list(np.take(V, F[:, k], axis=0).T) for k in range(3)))
    return np.column_stack(normal), shape


def _normals_of(a, b, c):
    """`_normals` of triangles with these corners, by coordinates (m,) each, the normals, too."""
    ab, bc, ca = ([y - x for x, y in zip(p, q, strict=True)] for p, q in ((a, b), (b, c), (c, a)))
    x, y, z = ab
    u, v, w = (-side for side in ca)
    normal = [y * w - z * v, z * u - x * w, x * v - y * u]
    squares = _squared(ab) + _squared(bc) + _squared(ca)
    return normal, 2 * np.sqrt(3) * np.sqrt(_squared(normal)) / np.maximum(squares, 1e-300)


def _gathered(points, after, before, candidate, other):
    """Coordinates of the corners of new triangles: of the places of the vertices `after` of candidates, and `after` and
    `before` of other faces; faces share these, and each coordinate by itself is gathered faster."""
    one, two = points[after].T.copy(), points[before].T.copy()
    return [x[candidate] for x in one], [x[other] for x in one], [x[other] for x in two]


def _squared(vectors):
    """Squares of the lengths of vectors, by coordinates (m,) each."""
    x, y, z = vectors
    return x * x + y * y + z * z


def _flat_shape(a, b, c):
    """Shapes, as in `_normals`, of triangles in the plane with these corners, by coordinates (m,) each; negative where
    they are turned over."""
    (ax, ay), (bx, by), (cx, cy) = a, b, c
    abx, aby, bcx, bcy, cax, cay = bx - ax, by - ay, cx - bx, cy - by, ax - cx, ay - cy
    squares = (abx * abx + aby * aby) + (bcx * bcx + bcy * bcy) + (cax * cax + cay * cay)
    return 2 * np.sqrt(3) * (abx * (cy - ay) - aby * (cx - ax)) / np.maximum(squares, 1e-300)
