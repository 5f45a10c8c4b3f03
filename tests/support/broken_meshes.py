"""Meshes broken in every way that a file or a slip of the hand can break them."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np

from omt_uv.solver.errors import MeshError
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.parameterization.options import UnwrapOptions

MODELS = ["cow", "spot", "homer", "suzanne", "teapot", "camel_b", "three_holes", "fertility", "snail", "lilium", "ogre"]


def delete(rng, V, P):
    """Up to a quarter of the faces go."""
    gone = set(rng.choice(len(P), rng.integers(1, max(2, len(P) // 4)), replace=False).tolist())
    return V, [p for i, p in enumerate(P) if i not in gone]


def duplicate(rng, V, P):
    """A face is there twice."""
    return V, [*P, list(P[rng.integers(len(P))])]


def flip(rng, V, P):
    """A face is turned over."""
    i = rng.integers(len(P))
    return V, [p[::-1] if k == i else p for k, p in enumerate(P)]


def flip_half(rng, V, P):
    """Half of the faces are turned over."""
    return V, [p[::-1] if k < len(P) // 2 else p for k, p in enumerate(P)]


def weld(rng, V, P):
    """Two far vertices become one: bow-ties, pinches, non-manifold edges."""
    a, b = rng.choice(len(V), 2, replace=False)
    return V, [[a if v == b else v for v in p] for p in P]


def collapse(rng, V, P):
    """One vertex is put upon another of its polygon."""
    p = P[rng.integers(len(P))]
    V[p[0]] = V[p[1]]
    return V, P


def repeat_vertex(rng, V, P):
    """A face of two different vertices."""
    p = list(P[rng.integers(len(P))])
    return V, [*P, [p[0], p[1], p[1]]]


def needle(rng, V, P):
    """A vertex is moved next to the line through two others of its polygon."""
    p = P[rng.integers(len(P))]
    V[p[0]] = V[p[1]] + rng.random() * (V[p[2]] - V[p[1]]) + 10.0 ** rng.uniform(-18, -3) * rng.normal(size=3)
    return V, P


def not_a_number(rng, V, P):
    """A coordinate that is none."""
    V[rng.integers(len(V)), rng.integers(3)] = rng.choice([np.nan, np.inf, -np.inf])
    return V, P


def far_away(rng, V, P):
    """A vertex as far as numbers reach."""
    V[rng.integers(len(V))] *= 10.0 ** rng.integers(2, 300)
    return V, P


def scale(rng, V, P):
    """Units from the smallest to the largest."""
    return V * 10.0 ** rng.uniform(-320, 308), P


def offset(rng, V, P):
    """Far from the origin."""
    return V + 10.0 ** rng.uniform(0, 18), P


def flatten(rng, V, P):
    """One direction is gone, or nearly."""
    V[:, rng.integers(3)] *= 10.0 ** rng.integers(-30, 1)
    return V, P


def jitter(rng, V, P):
    """Noise."""
    return V + 10.0 ** rng.uniform(-3, 1) * rng.normal(size=V.shape), P


def fin(rng, V, P):
    """A third face at an edge."""
    p = P[rng.integers(len(P))]
    return np.concatenate([V, rng.normal(size=(1, 3))]), [*P, [p[1], p[0], len(V)]]


def hole(rng, V, P):
    """The faces around one or two vertices go: several boundaries."""
    gone = set(rng.choice(len(V), rng.integers(1, 3), replace=False).tolist())
    return V, [p for p in P if not gone & set(p)]


def stray_vertices(rng, V, P):
    """Vertices without faces, and without positions."""
    return np.concatenate([V, np.full((3, 3), np.nan)]), P


def second_component(rng, V, P):
    """Another mesh beside the first."""
    W, Q = BASES[rng.integers(len(BASES))]()
    return np.concatenate([V, W + 3]), [*P, *[[v + len(V) for v in q] for q in _lists(Q)]]


def shuffle(rng, V, P):
    """New names for everything: no damage by itself."""
    name = rng.permutation(len(V))
    return V[np.argsort(name)], [[int(name[v]) for v in P[i]] for i in rng.permutation(len(P))]


def swell(rng, V, P):
    """A ball of the model is moved, or grows or shrinks by many orders of magnitude."""
    near = np.linalg.norm(V - V[rng.integers(len(V))], axis=1)
    ball = near <= np.quantile(near, rng.random())
    V[ball] *= 10.0 ** rng.uniform(-12, 12)
    return V, P


def zip_open(rng, V, P):
    """Faces come apart from one another without moving: slits, doubles, loose faces."""
    loose = rng.random(len(P)) < rng.random() ** 3
    polygons, extra, n = [], [], len(V)
    for p, apart in zip(P, loose, strict=True):
        polygons.append(list(range(n, n + len(p))) if apart else p)
        if apart:
            extra.append(V[p])
            n += len(p)
    return np.concatenate([V, *extra]), polygons


def crush(rng, V, P):
    """Many vertices come to lie on one, or on a line."""
    some = rng.choice(len(V), rng.integers(1, max(2, len(V) // 5)), replace=False)
    V[some] = V[some[0]] + rng.integers(2) * rng.random((len(some), 1)) * (V[some[-1]] - V[some[0]])
    return V, P


def double(rng, V, P):
    """The whole mesh lies there twice, once perhaps turned over."""
    turn = -1 if rng.random() < 0.5 else 1
    return V, [*P, *[p[::turn] for p in P]]


def tunnel(rng, V, P):
    """Two faces go and what was around them is joined: a handle, or an edge of many faces."""
    if len(P) < 3:
        return V, P
    a, b = (P[i] for i in rng.choice(len(P), 2, replace=False))
    left = [p for p in P if p is not a and p is not b]
    k = min(len(a), len(b))
    return V, [*left, *[[a[i], a[(i + 1) % k], b[(-i - 2) % len(b)], b[(-i - 1) % len(b)]] for i in range(k)]]


SURGERY = [delete, duplicate, flip, flip_half, weld, collapse, repeat_vertex, needle, not_a_number, far_away, scale,
           offset, flatten, jitter, fin, hole, stray_vertices, second_component, shuffle]  # fmt: skip


# On patches of real models, which have more of everything.
OPERATIONS = [*SURGERY, swell, zip_open, crush, double, tunnel]


BASES = [
    meshes.single_triangle,
    meshes.quad_patch,
    meshes.cube,
    meshes.annulus,
    meshes.quad_grid,
    lambda: meshes.bumpy(6, 6),
    lambda: meshes.cone(3, 8),
    lambda: meshes.cap(5, 10),
    lambda: meshes.comb(3, 3),
    lambda: meshes.spiral_strip(1.5, 20),
    lambda: meshes.random_disk(40),
    lambda: meshes.icosphere(1),
    lambda: meshes.torus(8, 6),
]


def soup(rng):
    """Random polygons on few vertices: everything wrong at once."""
    count = rng.integers(3, 12)
    polygons = [rng.choice(count, rng.integers(3, min(count, 5) + 1), replace=rng.random() < 0.1).tolist()
                for _ in range(rng.integers(0, 10))]  # fmt: skip
    return rng.normal(size=(count, 3)), polygons


def _lists(polygons):
    return [[int(v) for v in p] for p in polygons]


def broken_mesh(seed):
    """The surface, the chosen faces (or None) and arguments of `unwrap` of case `seed`."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.15:
        V, P = soup(rng)
    else:
        V, P = BASES[rng.integers(len(BASES))]()
        P = _lists(P)
        with np.errstate(all="ignore"):
            for _ in range(rng.integers(1, 4)):
                if P:
                    V, P = SURGERY[rng.integers(len(SURGERY))](rng, V.copy(), P)
    return marked(rng, V, P, auto=0.6)


def patch_of_a_model(rng):
    """The faces around a vertex of a real model, a few to several hundred of them."""
    V, F = meshes.load_model(MODELS[rng.integers(len(MODELS))])
    far = np.linalg.norm(V - V[rng.integers(len(V))], axis=1)[F].max(axis=1)
    F = F[np.argsort(far, kind="stable")[: int(10 ** rng.uniform(0.5, 2.8))]]
    used, index = np.unique(F, return_inverse=True)
    return V[used], _lists(index.reshape(-1, 3))


def broken_model(seed):
    """As `broken_mesh`, from a patch of a real model."""
    rng = np.random.default_rng(seed)
    V, P = patch_of_a_model(rng)
    with np.errstate(all="ignore"):
        for _ in range(rng.integers(0, 5)):
            if P:
                V, P = OPERATIONS[rng.integers(len(OPERATIONS))](rng, V.copy(), P)
    return marked(rng, V, P, auto=0.9, sparse=4)


def marked(rng, V, P, auto, sparse=1):
    """The mesh with random seams, sharp edges, chosen faces and arguments of `unwrap`."""
    seams = rng.integers(len(V), size=(rng.integers(0, 4), 2))
    if P and rng.random() < 0.5:
        edges = np.array([[p[0], p[1]] for p in P])
        seams = np.concatenate([seams, edges[rng.random(len(edges)) < rng.random() ** sparse]])
    surface = meshes.polygon_surface(V, P, seams)
    faces = rng.random(len(P)) < 0.8 if rng.random() < 0.2 else None
    boundary = str(rng.choice(["disk", "square", "free"]))
    seams = "auto" if rng.random() < auto else "existing"
    arguments = {"options": UnwrapOptions(boundary, "draft", seams=seams, fill_holes=bool(rng.random() < 0.3))}
    if rng.random() < 0.2:
        surface = replace(surface, sharp=rng.integers(len(V), size=(8, 2)))
        arguments["avoid"] = rng.random(len(V))
    return surface, faces, arguments


def arrays(surface: Surface):
    """Copies of all arrays of a surface."""
    return [np.array(getattr(surface, name)) for name in Surface.__dataclass_fields__]


def check_error(error: MeshError, surface: Surface):
    """A refusal has a cause, a remedy, and elements that there are."""
    assert error.cause and str(error).startswith(error.cause) and error.remedy
    limit = {"vertex": len(surface.positions), "edge": len(surface.positions), "face": len(surface.face_start) - 1}
    if len(error.elements):
        assert error.kind in limit
        assert error.elements.min() >= 0 and error.elements.max() < limit[error.kind]
        assert error.elements.shape[1:] == ((2,) if error.kind == "edge" else ())
