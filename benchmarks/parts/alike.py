"""Which meshes are alike: the nearest of many beside simpler measures, distances as a metric, and what they take."""

from __future__ import annotations

import itertools

import meshes
import numpy as np

from benchmarks.part import MODELS, Part
from benchmarks.tables import Table, missed
from benchmarks.timing import timed
from benchmarks.variants import bent, collapsed, moved, noisy, triangulated_anew
from omt_uv.solver.analysis.curvature import mean_curvature
from omt_uv.solver.mesh.closest_point import random_points
from omt_uv.solver.mesh.geometry import face_areas, vertex_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.embedding import classes_of_nearest
from omt_uv.solver.signatures.signature import Signature, closed_part, signature
from omt_uv.solver.signatures.wasserstein import distance_of, nearest, prepared
from omt_uv.solver.sphere.sphere_map import sphere_map

CASES = (
    "spot", "homer", "max_planck", "lilium", "optcuts_face", "hemisphere", "snail", "woody", "optcuts_bimba_i",
    "bunny_small", "david", "lion", "armadillo",
)  # fmt: skip
PROCEDURAL = ("cap", "head", "cone")
# Triangles of the meshes that are compared, and points of their signatures.
MOST = 2000
POINTS = 400
NEIGHBOURS = (1, 3)
NEAREST_GOAL = 0.95
# Of the rivals.
BINS = 64
SAMPLES = 100_000
SQUASH = 3.0
# Of the metric: triangles, points, and how many bodies, of which so many triples.
WHOLE = 4000
FINE = 1000
TRIPLES = 200
BODIES = 7
SYMMETRY_GOAL = 1e-6
TURN_GOAL = 1e-3
MAP_GOAL = 1.5
PAIR_GOAL = 1.0
# A library of so many signatures, made of those at hand by smooth random fields, of which so many are asked for.
LIBRARY = 10_000
VARIED = 1000
TOPS = (1, 10)
SEARCH_GOAL = 1.0


def nearest_table(args) -> Table:
    """How often neighbours are of the same model, by several distances of five meshes of each."""
    columns = {"distance by": 28, "meshes": 7} | {f"{k} nearest": 10 for k in NEIGHBOURS} | {"missed goals": 20}
    table = Table("The nearest of many meshes", columns)
    kinds, made = [], []
    for name in _names(args):
        for mesh in _family(name):
            kinds.append(name)
            made.append(mesh)
    distances = {"transport of areas": _searched(made, 1 + max(NEIGHBOURS))}
    for title, feature in RIVALS.items():
        found = [feature(*mesh) for mesh in made]
        distances[title] = _pairs(found, lambda a, b: float(np.abs(a - b).sum()))
    for title, away in distances.items():
        told = [np.mean(np.array(classes_of_nearest(away, kinds, k)) == kinds) for k in NEIGHBOURS]
        goals = {"nearest": told[0] < NEAREST_GOAL and title == next(iter(distances))}
        rates = {f"{k} nearest": float(rate) for k, rate in zip(NEIGHBOURS, told, strict=True)}
        table.add(**{"distance by": title, "meshes": len(made)}, **rates, **missed(**goals))
    return table


def metric_table(args) -> Table:
    """Symmetry, triangle inequality, rotations; a signature beside its map, a pair, and a search in a library."""
    columns = {"what": 52, "figure": 10, "asked": 7, "missed goals": 14}
    table = Table("Distances as a metric, and what they take", columns)

    def row(what, figure, asked):
        table.add(what=what, figure=float(figure), asked=asked, **missed(**{"": figure > asked}))

    bodies = [collapsed(_mesh(name), WHOLE) for name in _names(args)[:BODIES]]
    own = [_signature(mesh, FINE) for mesh in bodies]
    ready = [prepared(s) for s in own]
    # What a process does once is no part of a pair.
    distance_of(ready[0], ready[-1])
    found, seconds = timed(lambda: {p: distance_of(*(ready[k] for k in p)) for p in _both_ways(len(own))})
    row("a pair of 1,000 points, mean seconds", seconds / max(len(found), 1), PAIR_GOAL)
    row(
        "symmetry: greatest difference", max(abs(d.raw - found[j, i].raw) for (i, j), d in found.items()), SYMMETRY_GOAL
    )
    triples = list(itertools.permutations(range(len(own)), 3))
    chosen = np.random.default_rng(0).permutation(len(triples))[:TRIPLES]
    excess = [_excess(found, *triples[k]) for k in chosen]
    row(f"{len(excess)} triples: greatest excess over the floor", max(excess), 1.0)
    turned = [_signature(moved(mesh, seed=k), FINE) for k, mesh in enumerate(bodies)]
    pairs = [(k, (k + 1) % len(own)) for k in range(len(own))]
    change = [abs(distance_of(prepared(turned[i]), ready[j]).raw - found[i, j].raw) for i, j in pairs]
    row("rotation of one body: greatest change", max(change), TURN_GOAL)
    ratio = [_time_ratio(mesh) for mesh in bodies]
    row("a signature over its map: median of times", np.median(ratio), MAP_GOAL)
    library = [_signature(mesh, POINTS) for mesh in bodies]
    for top in TOPS:
        row(f"the nearest {top} of {LIBRARY:,}, median seconds", _search_seconds(library, top), SEARCH_GOAL)
    return table


def _names(args):
    return args.models or [n for n in CASES if meshes.model_path(n)] or list(PROCEDURAL)


def _mesh(name):
    return meshes.load_model(name) if meshes.model_path(name) else getattr(meshes, name)()


def _signature(mesh, count):
    V, F = mesh
    return drain(signature(V, F, count))


def _family(name):
    """Five meshes of one model: as it is, noisy and turned, a third of it, triangulated anew and mirrored, bent."""
    own = collapsed(_mesh(name), MOST)
    mirrored = moved(triangulated_anew(own), mirrored=True)
    return [own, moved(noisy(own), seed=2), collapsed(own, len(own[1]) // 3), mirrored, bent(own)]


def _searched(made, top):
    """Distances (n,n) of the `top` nearest of each mesh, as a library finds them; the others are infinite."""
    library = [_signature(mesh, POINTS) for mesh in made]
    coefficients = np.stack([prepared(s).coefficients for s in library])
    away = np.full((len(made), len(made)), np.inf)
    for k, s in enumerate(library):
        found = nearest(s, library, top, coefficients)
        away[k, [j for j, _ in found]] = [d.distance for _, d in found]
    return away


def _pairs(items, distance):
    """A matrix of distances (n,n)."""
    away = np.zeros((len(items), len(items)))
    for i, j in itertools.combinations(range(len(items)), 2):
        away[i, j] = away[j, i] = distance(items[i], items[j])
    return away


def _extent_area(V, F):
    """Area over the square of the diagonal, (1,)."""
    return np.array([face_areas(V, F).sum() / (np.ptp(V[np.unique(F)], axis=0) ** 2).sum()])


def _pair_distances(V, F):
    """The histogram (b,) of distances between random points over their mean: D2 (Osada et al. 2002)."""
    rng = np.random.default_rng(0)
    triangle, barycentric = random_points(face_areas(V, F), 2 * SAMPLES, rng)
    # They come in the order of triangles.
    ends = np.einsum("kc,kcd->kd", barycentric, V[F[triangle]])[rng.permutation(2 * SAMPLES)]
    away = np.linalg.norm(ends[:SAMPLES] - ends[SAMPLES:], axis=1)
    return np.histogram(away / away.mean(), BINS, (0, 3))[0] / SAMPLES


def _curvature_histogram(V, F):
    """The histogram (b,) of mean curvature by area, of the body that is compared."""
    V, F = closed_part(V, F)
    mass = vertex_areas(V, F)
    bend = mean_curvature(V, F) / np.maximum(mass, 1e-12 * mass.sum()) * np.sqrt(mass.sum() / (4 * np.pi))
    return np.histogram(np.tanh(bend / SQUASH), BINS, (-1, 1), weights=mass / mass.sum())[0]


RIVALS = {
    "distances of points (D2)": _pair_distances,
    "histogram of mean curvature": _curvature_histogram,
    "area over extent": _extent_area,
}


def _both_ways(count):
    return list(itertools.permutations(range(count), 2))


def _excess(found, i, j, k):
    """How much longer the way from i to k is than over j, over the floor."""
    return (found[i, k].raw - found[i, j].raw - found[j, k].raw) / found[i, k].floor


def _time_ratio(mesh):
    """The time of a signature over that of the map of areas of the same body, at the same quality."""
    _, whole = timed(lambda: _signature(mesh, FINE))
    closed = closed_part(*mesh)
    _, alone = timed(lambda: drain(sphere_map(*closed, quality="draft")))
    return whole / alone


def _search_seconds(own, top):
    """Median processor time of a search for each of the signatures, in a library of many made of them."""
    rng = np.random.default_rng(0)
    made = [_varied(own[k % len(own)], rng) for k in range(VARIED)]
    few = np.stack([prepared(s).coefficients for s in made])
    times = LIBRARY // VARIED
    library, coefficients = made * times, np.concatenate([few] * times).astype(np.float32)
    nearest(own[0], library, top, coefficients)
    return float(np.median([timed(lambda s=s: nearest(s, library, top, coefficients))[1] for s in own]))


def _varied(s, rng):
    """A signature pushed by a smooth random field."""
    wave, phase, push = rng.normal(size=(3, 3)), 6 * rng.random(3), 0.25 * rng.normal(size=3)
    at = s.points + np.sin(1.5 * s.points @ wave.T + phase) * push
    return Signature(at / np.linalg.norm(at, axis=1, keepdims=True), s.curvature, s.floor)


PARTS = (
    Part("nearest", "five meshes of each model: how often the nearest is of the same one, beside simpler measures",
         nearest_table, (MODELS,), by_default=False),
    Part("metric", "distances of shapes: symmetry, triangles, rotations; times of a signature, a pair and a search",
         metric_table, (MODELS,), by_default=False),
)  # fmt: skip
