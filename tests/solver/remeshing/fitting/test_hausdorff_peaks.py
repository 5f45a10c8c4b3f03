"""The farther from the surface, the more is tried there; distances and errors of curvature fall as vertices come in."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import angle_defects, angles_from_lengths, halfedge_lengths, vertex_normals
from omt_uv.solver.mesh.topology import boundary_loops, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import RemeshOptions, RemeshSource, remesh
from omt_uv.solver.remeshing.fitting import hausdorff_peaks as peaks
from omt_uv.solver.remeshing.fitting.ring_patches import cut_patches, spaced_faces, within_rings
from omt_uv.solver.remeshing.relaxation.surface_samples import area_samples, join_samples, tip_samples

FEW_ROUNDS = RemeshOptions(rounds=5)


def farthest(V, F, result) -> float:
    """The largest distance of a surface's vertices to a mesh, by position and by where it looks, whichever is less."""
    mesh = ClosestPoint(result.vertices, result.triangles, 0.02 * np.ptp(V, axis=0).max())
    normals = vertex_normals(V, F)
    found = mesh.closer(V, normals, mesh(V, normals))
    return float(np.linalg.norm(found.points - V, axis=1).max())


def curvature_in(V, F, centres, radius):
    """Measure of the angle defects around every centre, (c,)."""
    boundary = np.concatenate([np.zeros(0, np.int64), *boundary_loops(F)])
    defect = angle_defects(F, angles_from_lengths(halfedge_lengths(V, F).reshape(-1, 3)), boundary, len(V))
    defect[boundary] = 0
    distance = np.linalg.norm(centres[:, None] - V, axis=2) / radius
    return np.maximum(1 - distance**2, 0) ** 2 @ defect


def errors(V, F, counts):
    """Largest distances, and differences of curvature measures, of meshes with these numbers of vertices."""
    centres, radius = V[:: max(len(V) // 100, 1)], 0.25 * np.ptp(V, axis=0).max()
    of_surface = curvature_in(V, F, centres, radius)
    distances, curvatures = [], []
    for count in counts:
        result = drain(remesh(RemeshSource(V, F), count))
        assert len(result.vertices) == count
        distances.append(farthest(V, F, result))
        of_mesh = curvature_in(result.vertices, result.triangles, centres, radius)
        curvatures.append(np.abs(of_mesh - of_surface).sum() / np.abs(of_surface).sum())
    return np.array(distances), np.array(curvatures)


def test_on_a_smooth_surface_distances_fall_like_one_over_n():
    counts = [250, 500, 1000, 2000]
    distances, curvatures = errors(*meshes.torus(144, 72), counts)
    assert -1.15 < np.polyfit(np.log(counts), np.log(distances), 1)[0] < -0.85
    assert (np.diff(curvatures) < 0).all()


def test_errors_fall_on_a_real_model():
    counts = [600, 1200, 2400]
    distances, curvatures = errors(*meshes.load_model("max_planck"), counts)
    assert np.polyfit(np.log(counts), np.log(distances), 1)[0] < -0.6
    assert (np.diff(curvatures) < 0).all()


def groove():
    V, F = meshes.grid(80, 80)
    V[:, 2] = -0.08 * np.exp(-(((V[:, 0] - 0.5 - 0.1 * np.sin(4 * V[:, 1])) / 0.015) ** 2))
    return V, F


def test_grooves_narrower_than_an_edge_are_reached(monkeypatch):
    """With as many vertices, and triangles as good, the mesh comes nearer to the bottom."""
    V, F = groove()
    gap = []
    # How much nearer hangs on where the vertices of a mesh lie, which rounding decides: by several meshes.
    for count in range(820, 1000, 40):
        result = {}
        for passes in (0, peaks.PASSES):
            monkeypatch.setattr(peaks, "PASSES", passes)
            result[passes] = drain(remesh(RemeshSource(V, F), count, FEW_ROUNDS))
        without, lowered = result[0], max(result.items())[1]
        assert len(lowered.vertices) == count and len(boundary_loops(lowered.triangles)) == 1
        gap.append((farthest(V, F, lowered), farthest(V, F, without)))
        least = [
            np.percentile(angles_from_lengths(halfedge_lengths(r.vertices, r.triangles).reshape(-1, 3)).min(axis=1), 1)
            for r in (without, lowered)
        ]
        assert least[1] > least[0] - np.radians(2)
    after, before = np.sum(gap, axis=0)
    assert after < 0.93 * before and all(one <= other for one, other in gap)


def test_random_moves_go_on_where_steps_end(monkeypatch):
    """Alone, they bring the mesh nearer, too, at fixed topology and in one way each time."""
    V, F = groove()
    monkeypatch.setattr(peaks, "PASSES", 0)
    monkeypatch.setattr(peaks, "HIGH", 5.0)
    first, again = (drain(remesh(RemeshSource(V, F), 600, FEW_ROUNDS)) for _ in range(2))
    np.testing.assert_array_equal(first.vertices, again.vertices)
    monkeypatch.setattr(peaks, "SEARCHES", 0)
    without = drain(remesh(RemeshSource(V, F), 600, FEW_ROUNDS))
    np.testing.assert_array_equal(first.triangles, without.triangles)
    # By how much hangs on the last digits of where steps end.
    assert farthest(V, F, first) < 0.8 * farthest(V, F, without)


@pytest.mark.parametrize("rings", [1, 2])
def test_patches_are_disjoint_and_know_their_ring(rings):
    V, F = meshes.icosphere(4)
    n = len(V)
    middle = spaced_faces(F, np.random.default_rng(1).permutation(len(F)), n, 2 * rings + 2, 50)
    patches = cut_patches(F, middle, n, rings)
    assert len(patches) > 3 and (patches.faces[patches.middle] == middle).all()
    assert (patches.vertices[patches.triangles] == F[patches.faces]).all()
    # No vertex is of two patches, and what is not on the outer ring has all its triangles in its own.
    assert len(np.unique(patches.vertices)) == len(patches.vertices)
    assert (patches.of_vertex[patches.triangles] == patches.of_face[:, None]).all()
    inside = np.bincount(patches.triangles.ravel(), minlength=len(patches.vertices))
    whole = np.bincount(F.ravel(), minlength=n)[patches.vertices]
    assert ((inside == whole) == ~patches.outer).all()
    core = np.zeros(n, dtype=bool)
    core[F[middle]] = True
    assert set(patches.vertices[~patches.outer]) == set(np.flatnonzero(within_rings(F, core, rings)))
    open_ = twins(patches.triangles) < 0
    assert patches.outer[patches.triangles.ravel()[open_]].all()


def test_no_vertex_of_the_surface_is_a_sample_twice():
    """Not when looked at again, nor a tip."""
    V, F = groove()
    index = ClosestPoint(V, F, 0.05)
    samples = join_samples(area_samples(index, 900, np.ones(len(F))), tip_samples(index, 50))
    distance = np.zeros(len(samples.points))
    distance[::900] = 1
    distance[-1] = 1
    asked = []

    class State:
        def __init__(self):
            self.index, self.pairing = index, SimpleNamespace(samples=samples)

        def add_samples(self, extra, places):
            asked.append(len(extra.points))
            self.pairing.samples = join_samples(self.pairing.samples, extra)

    state = State()
    for rings in (3, 6):
        peaks.look_closer(state, distance, 0.5, rings, peaks.DENSE)
        distance = np.append(distance, np.zeros(asked[-1]))
    found = state.pairing.samples.points
    assert min(asked) > 0 and len(found) == len(samples.points) + sum(asked)
    assert len(np.unique(found, axis=0)) == len(found)


def test_what_stays_high_in_a_search_counts_for_less_the_next_time(monkeypatch):
    """And what was lowered for as much as it is: the search goes on from where it helps to where it may."""
    largest, gains = np.array([100.0, 99.0, 50.0, 98.0]), iter([[True, False], [False, False], [True, True]])
    asked = []

    def highest(state, now, high, gap, most):
        asked.append(now)
        assert high.tolist() == (now > max(peaks.HIGH, peaks.HIGHEST * now.max())).tolist()
        return np.array([0, 3])

    monkeypatch.setattr(peaks, "look_closer", lambda *given: None)
    monkeypatch.setattr(peaks, "_highest", highest)
    monkeypatch.setattr(peaks, "cut_patches", lambda *given: None)
    monkeypatch.setattr(peaks, "search_randomly", lambda *given: np.array(next(gains)))
    monkeypatch.setattr(peaks, "SEARCHES", 3)
    pairs = SimpleNamespace(distance=largest, largest_distance=lambda m: largest)
    state = SimpleNamespace(triangles=np.zeros((4, 3), int), points=np.zeros((5, 3)), pairs=lambda: pairs)
    told = [step.fraction for step in peaks._search(state, pairs, 1.0)]
    less = peaks.DEMOTION
    expected = np.array([[1, 1, 1, 1], [1, 1, 1, less], [less, 1, 1, less**2]])
    np.testing.assert_allclose(asked, largest * expected)
    assert told == pytest.approx([0.5 + 0.5 * k / 3 for k in (1, 2, 3)])
