"""Samples of a disk stay inside, lie evenly, and their triangles fill the polygon of the boundary's."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.remeshing.initial import disk_samples
from omt_uv.solver.remeshing.initial.arc_network import ChartBoundary
from omt_uv.solver.remeshing.initial.disk_samples import (
    even_image,
    spread_samples,
    triangulate_chart,
    triangulate_disk,
)


def circle(count):
    turn = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(turn), np.sin(turn)])


@pytest.mark.parametrize("boundary, inner", [(6, 1), (12, 20), (40, 150)])
def test_triangles_fill_the_polygon(boundary, inner):
    ring = circle(boundary)
    points = spread_samples(ring, inner)
    assert points.shape == (inner, 2) and np.linalg.norm(points, axis=1).max() < 1
    triangles = triangulate_disk(ring, points)
    assert topology(triangles) == (1, 1) and len(triangles) == boundary + 2 * inner - 2
    area = signed_areas(np.concatenate([ring, points]), triangles)
    assert area.min() > 0 and area.sum() == pytest.approx(boundary / 2 * np.sin(2 * np.pi / boundary))


def test_samples_are_even():
    points = spread_samples(circle(60), 300)
    gap = np.linalg.norm(points[:, None] - points, axis=2) + 9 * np.eye(300)
    assert gap.min(axis=1).std() < 0.1 * gap.min(axis=1).mean()


def test_samples_beyond_a_chord_come_inside():
    ring = circle(4)
    triangles = triangulate_disk(ring, np.array([[0.69, 0.69], [0.1, 0.0]]))
    assert topology(triangles) == (1, 1) and len(np.unique(triangles)) == 6


def test_three_samples_are_a_triangle_and_two_none():
    np.testing.assert_array_equal(triangulate_disk(circle(3), np.zeros((0, 2))), [[0, 1, 2]])
    assert triangulate_disk(circle(2), np.zeros((0, 2))) is None


def test_a_chart_gets_the_samples_that_it_is_given():
    V, F = meshes.bumpy(10, 10)
    loop = boundary_loops(F)[0]
    boundary = ChartBoundary(np.arange(20), np.arange(20) * len(loop) / 20)
    image = even_image(V, F, loop, boundary)
    assert signed_areas(image, F).min() > 0
    np.testing.assert_allclose(np.linalg.norm(image[loop], axis=1), 1)
    mesh = triangulate_chart(V, F, loop, (image, image), boundary, 70)
    assert len(mesh.points) == 70 and topology(mesh.triangles) == (1, 1) and mesh.triangles.max() == 89


def test_samples_beyond_a_chord_are_pulled_to_a_share_of_its_length_from_it():
    turn = np.array([0.1, 0.9, 1.4, 3.0, 4.4, 5.6])
    boundary = np.column_stack([np.cos(turn), np.sin(turn)])
    inner = circle(29) * np.linspace(0.4, 0.9999, 29)[:, None]
    found = disk_samples._inside(boundary, inner)
    moved = 0
    for before, after in zip(inner, found, strict=True):
        angle = (np.arctan2(before[1], before[0]) - turn[0]) % (2 * np.pi) + turn[0]
        k = int(np.searchsorted(turn, angle, side="right")) - 1
        half = ((turn[(k + 1) % 6] - turn[k]) % (2 * np.pi)) / 2
        # The chord's distance from the centre along the ray, less a share of half its length times its angle.
        most = np.cos(half) / np.cos(angle - turn[k] - half) - disk_samples.CHORD_MARGIN * np.sin(half) * half - 1e-9
        moved += np.linalg.norm(before) > most
        np.testing.assert_allclose(after, before * min(1, most / np.linalg.norm(before)), rtol=0, atol=1e-12)
    assert 5 < moved < 25


@pytest.mark.parametrize("empty", [[], [0], [3, 4], range(20)])
def test_samples_whose_cells_are_empty_stay_and_the_others_go_to_the_middles_of_theirs(monkeypatch, empty):
    """Cells without area have no middle: whatever stands for it is not taken."""
    empty, turns = np.array(empty, int), []

    def diagram(points, weights, domain):
        turns.append(points)
        area, middle = np.ones(len(points)), 0.5 * points
        area[12 + empty], middle[12 + empty] = 0.0, np.nan
        return SimpleNamespace(area=area, centroid=middle)

    start = spread_samples(circle(12), 20, 0)
    monkeypatch.setattr(disk_samples, "power_diagram", diagram)
    found = spread_samples(circle(12), 20, 3)
    share = np.where(np.isin(np.arange(20), empty), 1.0, 0.5**3)
    np.testing.assert_allclose(found, share[:, None] * start, rtol=1e-12)
    assert all((points[:12] == circle(12)).all() for points in turns) and len(turns) == 3
