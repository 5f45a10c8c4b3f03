"""Maps of quad meshes: areas of polygons, shear, and how far maps of symmetric meshes are from symmetric."""

from __future__ import annotations

from collections.abc import Callable

import meshes
import numpy as np

from benchmarks.part import Option, Part
from benchmarks.tables import Table, missed
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.mirror import find_mirror
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.mesh.topology import pair_keys, row_labels
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import SurfaceMap, unwrap
from omt_uv.solver.progress import drain

AREA_GOAL = 0.01  # area_l1 of the polygons, at balance 0
MIRROR_GOAL = 0.001
FACE = 0.3  # z of the vertices where suzanne's face begins
NEAR = 1e-3  # how far from a plane or a circle, at most, the vertices of a seam are
OUTLINES = ("free", "disk")
BALANCES = (0.0, 0.2)


def terrain(side: int, height: Callable) -> Surface:
    """A graph over [-1, 1]^2 of side^2 quads."""
    y, x = np.divmod(np.arange((side + 1) ** 2), side + 1)
    x, y = 2 * x / side - 1, 2 * y / side - 1
    corner = np.arange((side + 1) * side).reshape(side, side + 1)[:, :-1].ravel()
    quads = np.column_stack([corner, corner + 1, corner + side + 2, corner + side + 1])
    return meshes.polygon_surface(np.column_stack([x, y, height(x, y)]), quads.tolist())


def ring(major: int, minor: int, radius: float = 0.25) -> Surface:
    """A torus, open along a minor ring and the inner ring."""
    i, j = np.divmod(np.arange(major * minor), minor)
    turn, around = 2 * np.pi * i / major, 2 * np.pi * j / minor + np.pi
    far = 1 + radius * np.cos(around)
    V = np.column_stack([far * np.cos(turn), far * np.sin(turn), radius * np.sin(around)])
    after, up = (i + 1) % major * minor, (j + 1) % minor
    quads = np.column_stack([i * minor + j, after + j, after + up, i * minor + up])
    inner = np.column_stack([i * minor, after])[j == 0]
    first = np.column_stack([j, up])[i == 0]
    return meshes.polygon_surface(V, quads.tolist(), np.concatenate([inner, first]))


def cap(rings: int = 40, sectors: int = 60, opening: float = 0.8 * np.pi) -> Surface:
    """A cap of a sphere: rings of quads about triangles."""
    i, j = np.divmod(np.arange(rings * sectors), sectors)
    polar, turn = opening * (i + 1) / rings, 2 * np.pi * j / sectors
    V = np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    after = (j + 1) % sectors
    top = np.column_stack([0 * j, 1 + j, 1 + after])[i == 0]
    quads = (1 + np.column_stack([i * sectors + j - sectors, i * sectors + j, i * sectors + after]))[i > 0]
    quads = np.column_stack([quads, 1 + (i * sectors - sectors + after)[i > 0]])
    return meshes.polygon_surface(np.concatenate([[[0, 0, 1.0]], V]), top.tolist() + quads.tolist())


def suzanne() -> Surface:
    """Blender's head, with seams in its plane behind the face."""
    V, polygons = meshes.load_polygons("suzanne")
    V = V - (V.min(axis=0) + V.max(axis=0)) / 2
    bare = meshes.polygon_surface(V, polygons)
    edges = np.unique(np.sort(bare.corner_vertex[bare.triangles][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)), axis=0)
    on_plane = (np.abs(V[edges][:, :, 0]) < NEAR).all(axis=1)
    # The face looks along z.
    return meshes.polygon_surface(V, polygons, edges[on_plane & (V[edges][:, :, 2].mean(axis=1) < FACE)])


BODIES: dict[str, Callable[[], Surface]] = {
    "torus": lambda: ring(48, 12),
    "cap": cap,
    "bump": lambda: terrain(60, lambda x, y: 0.8 * np.exp(-(x * x + y * y) / 0.12)),
    "saddle": lambda: terrain(60, lambda x, y: 0.6 * (x * x - y * y)),
    "suzanne": suzanne,
}
NAMES = Option("bodies", tuple(BODIES), "default all", {"nargs": "+", "metavar": "NAME", "choices": tuple(BODIES)})


def mirror_error(surface: Surface, uv: np.ndarray) -> float:
    """Mean relative difference between UV lengths, corners (c,2), of mirrored sides, weighted by the sides; nan where
    the surface, with its seams, is no mirror image of itself."""
    start, vertex = surface.face_start, surface.corner_vertex
    seams = pair_keys(*surface.seams.T)

    def cut_alike(image: np.ndarray) -> bool:
        return np.array_equal(np.sort(pair_keys(*image[surface.seams].T)), np.sort(seams))

    mirror = find_mirror(surface.positions, vertex[surface.triangles], surface.triangle_face, accepted=cut_alike)
    if mirror is None:
        return np.nan
    after = np.arange(len(vertex)) + 1
    after[start[1:] - 1] = start[:-1]
    face = np.repeat(np.arange(len(start) - 1), np.diff(start))

    def rows(ids: np.ndarray) -> np.ndarray:
        # A polygon by its least and greatest vertex and their sum, a side by its ends.
        of = [reduce.reduceat(ids, start[:-1])[face] for reduce in (np.minimum, np.maximum, np.add)]
        return np.column_stack([*of, *np.divmod(pair_keys(ids, ids[after]), 1 << 32)])

    here, there = np.split(row_labels(np.concatenate([rows(vertex), rows(mirror.image[vertex])])), 2)
    order = np.argsort(here)
    image = order[np.searchsorted(here[order], there)]
    length = np.linalg.norm(uv[after] - uv, axis=1)
    weight = np.linalg.norm(surface.positions[vertex[after]] - surface.positions[vertex], axis=1)
    off = np.abs(length - length[image]) / np.maximum((length + length[image]) / 2, np.finfo(float).tiny)
    return float(weight @ off / weight.sum())


def corner_uv(surface: Surface, found: SurfaceMap) -> np.ndarray:
    """UVs (c,2) of all corners."""
    corners, uv = found.corner_uv()
    every = np.zeros((len(surface.corner_vertex), 2))
    every[corners] = uv
    return every


def polygon_table(args) -> Table:
    """Area error, shear and symmetry of every body, outline and balance."""
    columns = {"body": 8, "outline": 8, "balance": 7, "area_l1": 9, "shear": 6, "mirror": 9, "folds": 5}
    table = Table("Maps of quad meshes", columns | {"missed goals": 20})
    for name in args.bodies:
        surface = BODIES[name]()
        for outline in OUTLINES:
            for balance in BALANCES:
                found = drain(unwrap(surface, options=UnwrapOptions(boundary=outline, balance=balance)))
                uv = corner_uv(surface, found)
                F = surface.corner_vertex[surface.triangles]
                mapped = uv[surface.triangles]
                figures = distortion(surface.positions, F, mapped, overlap=False, polygons=surface.triangle_face)
                mirror = mirror_error(surface, uv)
                goals = {"areas": balance == 0 and figures.area_l1 > AREA_GOAL, "mirror": not mirror <= MIRROR_GOAL}
                table.add(
                    body=name,
                    outline=outline,
                    balance=balance,
                    area_l1=figures.area_l1,
                    shear=figures.angle_mean,
                    mirror=mirror,
                    folds=figures.folds,
                    **missed(**goals, folds=figures.folds > 0),
                )
    return table


PARTS = (
    Part(
        "polygons", "quad meshes: areas of polygons, symmetry of their maps", polygon_table, (NAMES,), by_default=False
    ),
)
