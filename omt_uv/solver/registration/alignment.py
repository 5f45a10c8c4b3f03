"""Turn one domain onto the other: by landmarks, or by a search over all rotations where there are none.

Of landmarks the rotation is the least squares one (Kabsch 1976); in the disk the Moebius map by Gauss-Newton. The
search compares functions of the surfaces, as they lie on the sphere, over a grid of rotations that covers them evenly
(Hopf coordinates: Yershova, Jain, LaValle, Mitchell 2010), and refines the best of them on ever finer grids.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.geometry import cross3, nearest_rotations
from ..mesh.spherical_geometry import fibonacci_sphere, normalized

# Directions of the first axis, and turns about it, of the grid of rotations.
DIRECTIONS = 192
TURNS = 24
# Points of the sphere at which functions are compared: on the grid, and when the best are refined.
FEW_POINTS = 400
POINTS = 2000
# Rotations of the grid that are refined, in so many rounds of so many nearby ones, each round nearer by this factor.
BEST = 12
ROUNDS = 7
NEARBY = 24
SHRINKING = 0.6
# Turns of a disk that are tried.
DISK_TURNS = 360


@dataclass(frozen=True)
class Alignment:
    """A rotation (3,3) of the source's domain, with determinant -1 where it is mirrored, and its error: the mean
    square distance of landmarks, or of the functions."""

    rotation: np.ndarray
    error: float


def rotation_of_pairs(points: np.ndarray, places: np.ndarray, mirrored: bool = False) -> Alignment:
    """The rotation that takes points (k,3) nearest to places (k,3) in the mean square (Kabsch 1976)."""
    rotation = nearest_rotations(places.T @ points, mirrored)
    return Alignment(rotation, float(((points @ rotation.T - places) ** 2).sum(axis=1).mean()))


def rotation_by_search(
    source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray], mirrored: bool = False
) -> Alignment:
    """The rotation under which functions of two surfaces differ least.

    source, target : unit vectors (n,3) of the vertices and the functions (n,c) there, of comparable scale
    """
    flip = np.diag([1.0, 1.0, -1.0]) if mirrored else np.eye(3)
    grid = rotation_grid()
    coarse = _scores(_Sampled(*source, FEW_POINTS, flip), _Sampled(*target, FEW_POINTS), grid, _near_on_grid())
    fine_source, fine_target = _Sampled(*source, POINTS, flip), _Sampled(*target, POINTS)
    best, error = grid[np.argsort(coarse, kind="stable")[:BEST]], np.zeros(BEST)
    rng = np.random.default_rng(0)
    angle = np.radians(12)
    for _ in range(ROUNDS):
        turned = np.einsum("nab,kbc->knac", small_rotations(rng, NEARBY, angle), best)
        tried = np.concatenate([best[:, None], turned], axis=1)
        scores = _scores(fine_source, fine_target, tried.reshape(-1, 3, 3)).reshape(len(best), -1)
        pick = scores.argmin(axis=1)
        best, error = tried[np.arange(len(best)), pick], scores.min(axis=1)
        angle *= SHRINKING
    winner = int(error.argmin())
    return Alignment(best[winner] @ flip, float(error[winner]))


class _Sampled:
    """Functions of a surface at points spread evenly over the sphere, and nearest values for any others."""

    def __init__(self, positions: np.ndarray, values: np.ndarray, count: int, flip: np.ndarray | None = None):
        positions = positions if flip is None else positions @ flip.T
        self.points = fibonacci_sphere(count)
        near = cKDTree(positions).query(self.points, k=min(4, len(positions)))
        distance, index = (part.reshape(count, -1) for part in near)
        share = 1 / np.maximum(distance, 1e-9)
        self.values = np.einsum("kc,kcf->kf", share / share.sum(axis=1, keepdims=True), values[index])
        self.tree = cKDTree(self.points)


def _scores(source: _Sampled, target: _Sampled, rotations: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
    """Mean square difference (r,) of the functions under rotations (r,3,3) of the source; near (r,k): which points of
    the target are nearest, where that is known."""
    index = _nearest(source.points, target.tree, rotations) if near is None else near
    return ((target.values[index] - source.values) ** 2).sum(axis=2).mean(axis=1)


def _nearest(points: np.ndarray, tree: cKDTree, rotations: np.ndarray) -> np.ndarray:
    """The points (r,k) of a tree that points (k,3) are nearest to under rotations (r,3,3)."""
    turned = np.einsum("rab,kb->rka", rotations, points)
    return tree.query(turned.reshape(-1, 3))[1].reshape(len(rotations), -1)


@cache
def _near_on_grid() -> np.ndarray:
    """`_nearest` of the few points under all rotations of the grid: the same of all surfaces, a third of the time."""
    points = fibonacci_sphere(FEW_POINTS)
    return _nearest(points, cKDTree(points), rotation_grid()).astype(np.int32)


def rotation_grid() -> np.ndarray:
    """Rotations (DIRECTIONS * TURNS,3,3) spread evenly: a direction for the third axis, and turns about it."""
    direction = fibonacci_sphere(DIRECTIONS)
    helper = np.eye(3)[np.abs(direction).argmin(axis=1)]
    first = normalized(cross3(direction, helper))
    base = np.stack([first, cross3(direction, first), direction], axis=2)
    turn = 2 * np.pi * np.arange(TURNS) / TURNS
    about = np.zeros((TURNS, 3, 3))
    about[:, 0, 0] = about[:, 1, 1] = np.cos(turn)
    about[:, 1, 0], about[:, 0, 1], about[:, 2, 2] = np.sin(turn), -np.sin(turn), 1
    return np.einsum("dab,tbc->dtac", base, about).reshape(-1, 3, 3)


def small_rotations(rng: np.random.Generator, count: int, angle: float) -> np.ndarray:
    """Rotations (count,3,3) about random axes by up to an angle, by Rodrigues' formula."""
    axis = normalized(rng.normal(size=(count, 3)))
    turn = angle * rng.random(count) ** (1 / 3)
    cross = np.zeros((count, 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -axis[:, 2], axis[:, 1], -axis[:, 0]
    cross -= cross.transpose(0, 2, 1)
    square = cross @ cross
    return np.eye(3) + np.sin(turn)[:, None, None] * cross + (1 - np.cos(turn))[:, None, None] * square


@dataclass(frozen=True)
class MoebiusMap:
    """z -> turn (z - centre) / (1 - conj(centre) z) of the unit disk, |turn| = 1, after conjugation if mirrored."""

    centre: complex
    turn: complex
    mirrored: bool = False

    def __call__(self, z: np.ndarray) -> np.ndarray:
        """Images (n,) of points (n,) complex."""
        z = z.conj() if self.mirrored else z
        return self.turn * (z - self.centre) / (1 - np.conj(self.centre) * z)


def moebius_of_pairs(points: np.ndarray, places: np.ndarray, mirrored: bool = False) -> MoebiusMap:
    """The Moebius map of the disk that takes points (k,) nearest to places (k,) complex in the mean square.

    One pair gives the centre alone, none the identity.
    """
    from scipy.optimize import least_squares

    if not len(points):
        return MoebiusMap(0j, 1 + 0j, mirrored)

    def map_of(x: np.ndarray) -> MoebiusMap:
        radius = np.hypot(x[0], x[1])
        # Any real pair is a point of the disk.
        centre = complex(x[0], x[1]) / np.sqrt(1 + radius**2)
        return MoebiusMap(centre, complex(np.exp(1j * x[2])), mirrored)

    def away(x: np.ndarray) -> np.ndarray:
        off = map_of(x)(points) - places
        # A little for leaving the centre, as few pairs leave it open.
        return np.concatenate([off.real, off.imag, 1e-3 * x[:2]])

    tries = [least_squares(away, [0.0, 0.0, angle]) for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False)]
    return map_of(min(tries, key=lambda found: found.cost).x)


def turn_by_search(source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray]) -> MoebiusMap:
    """The turn of the disk under which functions of two surfaces differ least.

    source, target : points (n,2) of the vertices in the unit disk and the functions (n,c) there
    """
    radius = np.sqrt((np.arange(POINTS) + 0.5) / POINTS)
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(POINTS)
    points = radius * np.exp(1j * angle)
    values = source[1][cKDTree(source[0]).query(np.column_stack([points.real, points.imag]))[1]]
    tree = cKDTree(target[0])
    turns = np.exp(2j * np.pi * np.arange(DISK_TURNS) / DISK_TURNS)
    moved = (turns[:, None] * points).ravel()
    index = tree.query(np.column_stack([moved.real, moved.imag]))[1].reshape(DISK_TURNS, POINTS)
    error = ((target[1][index] - values) ** 2).sum(axis=2).mean(axis=1)
    return MoebiusMap(0j, complex(turns[error.argmin()]))
