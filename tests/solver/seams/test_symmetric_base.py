"""Symmetric bodies become disks symmetrically, handles or not, and scans that nearly are get seams that nearly are."""

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.spatial import cKDTree

from omt_uv.solver.analysis.facing import Y_UP
from omt_uv.solver.analysis.seam_costs import SeamPreferences, seam_costs
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.seams import search
from omt_uv.solver.seams import symmetric_base as symmetric_bases
from omt_uv.solver.seams.search import SeamSearch
from omt_uv.solver.seams.symmetric_base import _paths, symmetric_base

RINGS, SECTORS = 24, 48


def egg(holes, noise=0.0):
    """Quads of an egg, its own image in x = 0 with vertices there, open below, without those nearest to some points."""
    V, _ = meshes.cap(RINGS, SECTORS, 0.93)
    V = V * [1.0, 1.3, 1.7] + 0.3 * np.stack([0 * V[:, 0], V[:, 2] ** 2, V[:, 1] * V[:, 2]], axis=1)
    V = V + noise * np.random.default_rng(0).standard_normal(V.shape)
    ring, one = np.arange(RINGS - 1)[:, None] * SECTORS + 1, np.arange(SECTORS)
    other = (one + 1) % SECTORS
    quads = np.stack([ring + one, ring + SECTORS + one, ring + SECTORS + other, ring + other], axis=2).reshape(-1, 4)
    polygons = [*np.column_stack([0 * one, 1 + one, 1 + other]).tolist(), *quads.tolist()]
    away = [min([np.linalg.norm(V[p].mean(axis=0) - hole) for hole in holes], default=1.0) for p in polygons]
    polygons = [p for p, far in zip(polygons, away, strict=True) if far > 0.3]
    used, flat = np.unique(np.concatenate(polygons), return_inverse=True)
    ends = np.cumsum([len(p) for p in polygons])[:-1]
    return meshes.polygon_surface(V[used], [p.tolist() for p in np.split(flat, ends)])


def seams_of(surface, spread):
    count = len(surface.face_start) - 1
    finder = SeamSearch(np.full(count, spread), surface, lambda: seam_costs(surface))
    prepared = cut_to_disks(surface, search=finder)
    # `cut_to_disks` refuses what is no disk.
    assert len(prepared.charts) == 1
    return np.sort(prepared.cuts.edges, axis=1)


EYES = np.array([[0.5, 0.9, 0.6], [-0.5, 0.9, 0.6]])
MOUTH = np.array([[0.0, 1.4, 0.0]])


@pytest.mark.parametrize("spread", [0.5, 0.004])
@pytest.mark.parametrize("holes", [EYES, [*EYES, *MOUTH], [*EYES, *MOUTH, *-EYES]], ids=["eyes", "mouth", "six"])
def test_boundaries_are_joined_symmetrically(holes, spread, monkeypatch):
    joined = []
    monkeypatch.setattr(search, "symmetric_base", lambda *given: joined.append(symmetric_base(*given)) or joined[-1])
    surface = egg(holes)
    V, edges = surface.positions, seams_of(surface, spread)
    far, image = cKDTree(V).query(V * [-1, 1, 1])
    assert far.max() < 1e-9 and len(edges) and joined[0].any()
    assert set(map(tuple, edges.tolist())) == set(map(tuple, np.sort(image[edges], axis=1).tolist()))


def ring(mirrored_in, noise=0.0):
    """Quads of a torus, of which nothing is a mirror plane but one that is across its axis, or holds it."""
    V, _ = meshes.torus(48, 16)
    x, y, z = V.T
    lopsided = {"across": [x + 0.1 * y, y + 0.3 * x**2, z], "along": [x, y + 0.2 * z, z + 0.3 * y**2]}
    V = np.stack(lopsided[mirrored_in], axis=1)
    V = V + noise * np.random.default_rng(0).standard_normal(V.shape)
    ids = np.arange(48 * 16).reshape(48, 16)
    right, up = np.roll(ids, -1, axis=0), np.roll(ids, -1, axis=1)
    return meshes.polygon_surface(V, np.stack([ids, right, np.roll(right, -1, axis=1), up], axis=2).reshape(-1, 4))


@pytest.mark.parametrize("spread", [0.5, 0.004])
@pytest.mark.parametrize(("mirrored_in", "image"), [("across", [1, 1, -1]), ("along", [-1, 1, 1])])
def test_handles_are_opened_symmetrically(mirrored_in, image, spread, monkeypatch):
    joined = []
    monkeypatch.setattr(search, "symmetric_base", lambda *given: joined.append(symmetric_base(*given)) or joined[-1])
    surface = ring(mirrored_in)
    V, edges = surface.positions, seams_of(surface, spread)
    far, image = cKDTree(V).query(V * image)
    assert far.max() < 1e-9 and joined[0].any()
    assert set(map(tuple, edges.tolist())) == set(map(tuple, np.sort(image[edges], axis=1).tolist()))


@pytest.mark.parametrize("turn", range(3))
def test_a_ring_comes_apart_whichever_way_it_stands(turn):
    """Each half is an annulus, of which no cut but along the plane, which is barred, makes a disk."""
    V, _ = meshes.torus(24, 12, 0.25)
    ids = np.arange(24 * 12).reshape(24, 12)
    right, up = np.roll(ids, -1, axis=0), np.roll(ids, -1, axis=1)
    quads = np.stack([ids, right, np.roll(right, -1, axis=1), up], axis=2).reshape(-1, 4)
    surface = meshes.polygon_surface(np.roll(V, turn, axis=1), quads)
    options = UnwrapOptions(max_shear=1.35, preferences=SeamPreferences(axes=Y_UP))
    found = drain(unwrap(surface, options=options))
    assert max(one.angle_mean for one in found.maps) < 1.35
    assert sum(one.folds for one in found.maps) == 0 and strict_charts(replace(surface, seams=found.seams))


@pytest.mark.parametrize(("mirrored_in", "image"), [("across", [1, 1, -1]), ("along", [-1, 1, 1])])
def test_handles_of_a_scan_are_opened_nearly_symmetrically(mirrored_in, image):
    surface = ring(mirrored_in, noise=0.002)
    seam = surface.positions[np.unique(seams_of(surface, 0.004))]
    far, _ = cKDTree(seam).query(seam * image)
    assert len(seam) > 20 and far.max() < 0.15


def test_seams_of_a_scan_are_nearly_symmetric():
    surface = egg([], noise=0.004)
    seam = surface.positions[np.unique(seams_of(surface, 0.004))]
    far, _ = cKDTree(seam).query(seam * [-1, 1, 1])
    assert len(seam) > 8 and far.max() < 0.5


@pytest.mark.parametrize("width, mirrored", [(0.0, "exact"), (0.6, "near"), (1.0, None)])
def test_an_ear_that_has_no_image_leaves_a_body_nearly_its_own_image(width, mirrored, monkeypatch):
    """Up to a tenth of the vertices: what has a third of them on one side alone is another body."""
    surface, found = egg([]), []
    known = seam_costs(surface)
    ear = np.linalg.norm(surface.positions - surface.positions[:, 0].max() * np.array([1, 0, 0]), axis=1) < width
    surface.positions[ear] *= [1.5, 1, 1]
    of = SeamSearch._mirror
    monkeypatch.setattr(SeamSearch, "_mirror", lambda *given: found.append(of(*given)) or found[-1])
    cut_to_disks(surface, search=SeamSearch(np.full(len(surface.face_start) - 1, 0.004), surface, lambda: known))
    assert {None if one is None else "exact" if one.exact else "near" for one in found} == {mirrored}


@pytest.mark.parametrize("loop", [3, 4, 5, 6])
@pytest.mark.parametrize("tail", [0, 2])
def test_paths_of_a_cut_have_every_edge_once_and_a_loop_is_two_of_them(loop, tail):
    """A loop at a boundary vertex, or at the end of a path from there."""
    line = np.column_stack([np.arange(tail), np.arange(1, tail + 1)])
    round_ = tail + np.arange(loop)
    ends = np.concatenate([line, np.column_stack([round_, np.roll(round_, -1)]), [[90, 91]]])
    boundary = np.isin(np.arange(92), [0, 90])
    cut = np.arange(len(ends)) < tail + loop
    component = SimpleNamespace(
        vertex_count=92, ends=ends, cost=np.linspace(1, 2, len(ends)), on_boundary=lambda: boundary
    )
    paths = _paths(component, cut)
    steps = [tuple(sorted(step)) for path in paths for step in zip(path[:-1].tolist(), path[1:].tolist(), strict=True)]
    assert sorted(steps) == sorted(tuple(sorted(e)) for e in ends[cut].tolist())
    assert len(paths) == 2 + (tail > 0)
    halves = [path for path in paths if tail in path and (path.max() > tail)]
    assert len(halves) == 2 and set(halves[0]) & set(halves[1]) == {halves[0][0], halves[0][-1]}


@pytest.mark.parametrize("holes", [[*EYES, *-EYES], [*EYES, *MOUTH, *-EYES]], ids=["four", "five"])
def test_whatever_is_joined_is_joined_on_both_sides(holes, monkeypatch):
    """At every turn, arcs and boundaries alike: an arc comes with its image."""
    ways, base, seen = symmetric_bases._ways, symmetric_bases.symmetric_base, []

    def watched(mirror, joined, target, crossing):
        seen.append((joined.sum(), (joined[mirror.image] == joined).mean(), (target[mirror.image] == target).mean()))
        return ways(mirror, joined, target, crossing)

    monkeypatch.setattr(symmetric_bases, "_ways", watched)
    monkeypatch.setattr(search, "symmetric_base", lambda *given: (base(*given), seen.append(None))[0])
    seams_of(egg(holes), 0.5)
    turns = seen[: seen.index(None)]
    count = [turn[0] for turn in turns]
    assert len(turns) > 1 and (np.diff(count) > 0).all()
    assert [turn[1:] for turn in turns] == [(1.0, 1.0)] * len(turns)
