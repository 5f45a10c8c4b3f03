"""The map from which the refinement of a chart starts."""

import hard_meshes
import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal.disk_map import sharpest_corners
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.maps.contacts import touches_itself
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.energy import elements, energy
from omt_uv.solver.maps.untangle import count_folds, map_energy
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.parameterization import initial_map as initial_maps
from omt_uv.solver.parameterization.initial_map import (
    DiskMesh,
    coarse_initial_map,
    good_enough,
    initial_map,
    mean_value_sites,
    roomy_initial_map,
)
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.polygons import polygon_disk
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import RunLog, drain
from omt_uv.solver.transport.convex_domain import Disk, Rectangle
from omt_uv.solver.transport.inverse_map import centroid_map
from omt_uv.solver.transport.semidiscrete import transport


def disk_of(V, F, boundary="free"):
    loop = boundary_loops(F)[0]
    corners = sharpest_corners(V, F, loop) if boundary == "square" else None
    return DiskMesh(V, F, face_areas(V, F), loop, boundary, corners)


@pytest.mark.parametrize("domain", [Disk(), Rectangle()])
def test_mean_value_sites_are_an_embedding_with_its_boundary_on_the_domain(domain):
    V, F = meshes.head(14)
    loop = boundary_loops(F)[0]
    corners = None if isinstance(domain, Disk) else sharpest_corners(V, F, loop)
    sites = mean_value_sites(V, F, loop, corners, domain)
    assert (signed_areas(sites, F) > 0).all()
    on = sites[loop]
    far = np.linalg.norm(on, axis=1) if corners is None else 2 * np.abs(on).max(axis=1)
    np.testing.assert_allclose(far, 1, atol=1e-12)
    if corners is not None:
        np.testing.assert_allclose(np.abs(sites[corners]), 0.5, atol=1e-12)


@pytest.mark.parametrize("boundary", ["free", "disk", "square"])
def test_an_initial_map_keeps_the_boundary_in_order(boundary):
    disk = disk_of(*meshes.bumpy(10, 10), boundary)
    log = RunLog()
    found = drain(initial_map(disk, log))
    assert found.conformal is not None and found.cells is not None and not found.warm
    assert {"conformal", "transport"} <= log.seconds.keys()
    s = disk.domain.boundary_parameter(found.uv[disk.loop])
    step = np.mod(np.roll(s, -1) - s, disk.domain.period)
    assert (step > 0).all() and step.sum() == pytest.approx(disk.domain.period)


def subdivided(V, F, least=1600):
    while len(V) < least:
        V, F = meshes.subdivide(V, F)
    return V, F


@pytest.mark.parametrize("mesh", [meshes.head(50), meshes.cone(), meshes.hemisphere(), meshes.bumpy()])
def test_a_start_with_room_folds_nothing_and_is_not_squeezed(mesh):
    V, F = subdivided(*mesh)
    disk = disk_of(V, F)
    start = roomy_initial_map(disk, RunLog()).uv
    w = np.sqrt(disk.target.sum() / signed_areas(start, F).sum()) * (start @ [1, 1j])
    assert count_folds(start, F) == 0
    flat = disk.flat is not None and np.array_equal(start, disk.flat.uv)
    assert energy(elements(V, F, disk.target), w, 30.0) < (50 if flat else 9)


def test_there_is_no_start_with_room_where_it_would_be_squeezed_or_another_one_is_asked_for():
    assert roomy_initial_map(disk_of(*subdivided(*meshes.spiral_strip())), RunLog()) is None
    V, F = subdivided(*meshes.head(50))
    assert roomy_initial_map(disk_of(V, F, "disk"), RunLog()) is None
    assert roomy_initial_map(disk_of(*meshes.head(15)), RunLog()) is None
    density = np.where(V[F].mean(axis=1)[:, 0] > V[:, 0].mean(), 100.0, 1.0)
    magnified = DiskMesh(V, F, face_areas(V, F) * density, boundary_loops(F)[0])
    assert roomy_initial_map(magnified, RunLog()) is None


def test_a_start_that_is_sheared_by_more_than_is_foretold_is_none(monkeypatch):
    disk = disk_of(*subdivided(*meshes.head(50)))
    start = roomy_initial_map(disk, RunLog())
    assert start is not None and not np.array_equal(start.uv, disk.flat.uv)
    monkeypatch.setattr(initial_maps, "MOST_SHEAR", 0.0)
    assert roomy_initial_map(disk, RunLog()) is None


def test_centroids_of_the_cells_have_the_mass_of_the_disk():
    V, F = meshes.bumpy(8, 8)
    disk = disk_of(V, F)
    sites = mean_value_sites(V, F, disk.loop, None, Disk())
    mass = np.bincount(F.ravel(), np.repeat(disk.target / 3, 3))
    cells = drain(transport(sites, mass, Disk()))
    uv = centroid_map(cells.cells.centroid, Disk(), disk.loop, None, [])
    inner = np.setdiff1d(np.arange(len(V)), disk.loop)
    np.testing.assert_array_equal(uv[inner], cells.cells.centroid[inner])
    np.testing.assert_allclose(np.linalg.norm(uv[disk.loop], axis=1), 1, atol=1e-12)


def test_a_coarse_mesh_leads_to_a_map_without_folds():
    disk = disk_of(*meshes.bumpy(24, 24))
    found = drain(coarse_initial_map(disk, 0.0, log := RunLog()))
    assert found.uv.shape == (len(disk.vertices), 2) and count_folds(found.uv, disk.triangles) == 0
    assert signed_areas(found.uv, disk.triangles).sum() == pytest.approx(disk.target.sum(), rel=0.02)
    assert {"coarsening", "coarse refinement"} <= log.seconds.keys()


@pytest.mark.parametrize("boundary", ["free", "disk", "square"])
def test_large_meshes_are_embedded_once_they_are_coarse(boundary, monkeypatch):
    """What comes of that is as good a map."""
    V, F = meshes.head(96)
    surface, options = triangle_surface(V, F), UnwrapOptions(boundary)
    sizes, embedded = [], polygon_disk.mean_value_sites

    def seen(vertices, *rest):
        sizes.append(len(vertices))
        return embedded(vertices, *rest)

    monkeypatch.setattr(polygon_disk, "mean_value_sites", seen)
    (whole,) = drain(unwrap(surface, options=options)).maps
    assert max(sizes) == len(V)
    sizes.clear()
    monkeypatch.setattr(initial_maps, "EMBEDDED", 5_000)
    (found,) = drain(unwrap(surface, options=options)).maps
    assert max(sizes, default=0) < len(V) / 4
    assert found.folds == 0 and found.area_l1 <= 0.008 and not found.warnings
    assert found.angle_mean == pytest.approx(whole.angle_mean, rel=0.01)


def test_large_meshes_of_slivers_are_embedded_all_the_same(monkeypatch):
    V, F = hard_meshes.sliver_sphere(6_000)
    chart = cut_to_disks(triangle_surface(V, F)).charts[0]
    disk = disk_of(chart.vertices, chart.triangles)
    before = drain(coarse_initial_map(disk, 0.0, RunLog()))
    monkeypatch.setattr(initial_maps, "EMBEDDED", 1_000)
    found = drain(coarse_initial_map(disk_of(chart.vertices, chart.triangles), 0.0, RunLog()))
    energies = [map_energy(x.uv, disk.vertices, disk.triangles) for x in (found, before)]
    assert energies[0] <= max(1.01 * energies[1], initial_maps.HOPELESS)


def test_a_mesh_of_boundary_vertices_is_not_coarsened():
    assert drain(coarse_initial_map(disk_of(*meshes.spiral_strip(1.0, 20), "disk"), 0.0, RunLog())) is None


def test_slivers_that_a_mean_value_map_squeezes_start_from_a_flat_map_that_scales_evenly(monkeypatch):
    V, F = hard_meshes.sliver_sphere(6_000)
    chart = cut_to_disks(triangle_surface(V, F)).charts[0]
    disk = disk_of(chart.vertices, chart.triangles)
    flat = mean_value_sites(disk.vertices, disk.triangles, disk.loop, None, Disk())
    squeezed = map_energy(flat, disk.vertices, disk.triangles)
    monkeypatch.setattr(initial_maps, "HOPELESS", 0.9 * squeezed)
    monkeypatch.setattr(initial_maps, "coarsen_disk", None)
    found = drain(coarse_initial_map(disk, 0.0, RunLog()))
    assert count_folds(found.uv, disk.triangles) == 0
    assert map_energy(found.uv, disk.vertices, disk.triangles) < 0.2 * squeezed
    # A domain that is asked for is not left.
    monkeypatch.undo()
    monkeypatch.setattr(initial_maps, "HOPELESS", 0.0)
    given = drain(coarse_initial_map(disk_of(chart.vertices, chart.triangles, "disk"), 0.0, RunLog()))
    assert given is None or count_folds(given.uv, disk.triangles) == 0


def test_slivers_start_from_no_worse_than_a_mean_value_map(monkeypatch):
    V, F = hard_meshes.sliver_sphere(20_000)
    chart = cut_to_disks(triangle_surface(V, F)).charts[0]
    disk = disk_of(chart.vertices, chart.triangles)
    monkeypatch.setattr(initial_maps, "COARSER", 64)
    found = drain(coarse_initial_map(disk, 0.0, RunLog()))
    flat = mean_value_sites(disk.vertices, disk.triangles, disk.loop, None, Disk())
    energies = [map_energy(uv, disk.vertices, disk.triangles) for uv in (found.uv, flat)]
    assert energies[0] <= 1.001 * energies[1]


def perforated_plate(lift, n=20):
    """A plate of quads (q,4) with four holes, bent by `lift` in its corners, so that all triangles unroll."""
    x, y = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
    V = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1) / n
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    Q = np.stack([i, i + 1, i + n + 2, i + n + 1], axis=1)
    middle = V[Q].mean(axis=1)[:, :2]
    holes = [np.abs(middle - [a, b]).max(axis=1) < 0.1 for a in (0.3, 0.7) for b in (0.3, 0.7)]
    used, quads = np.unique(Q[~np.any(holes, axis=0)], return_inverse=True)
    V = V[used]
    V[(np.abs(V[:, :2] - 0.5) == 0.5).all(axis=1), 2] = lift
    return V, quads.reshape(-1, 4)


@pytest.mark.parametrize("lift", [0.0, 0.02, 0.05])
def test_slits_whose_sides_lie_on_one_another_move_nothing(lift):
    V, Q = perforated_plate(lift)
    found = drain(unwrap(meshes.polygon_surface(V, [list(q) for q in Q]), options=UnwrapOptions(max_shear=1.35)))
    (chart,), (chart_map,) = found.charts, found.maps
    figures = distortion(chart.vertices, chart.triangles, chart_map.uv[chart.triangles])
    assert figures.angle_mean < 1.01 and figures.area_l1 < 1e-3 and figures.folds == 0


def test_a_boundary_touches_itself_where_vertices_lie_on_one_another():
    V, F = meshes.grid(4, 4)
    loop, uv = boundary_loops(F)[0], V[:, :2].copy()
    assert not touches_itself(uv, loop)
    assert not touches_itself(1e-9 * uv, loop) and not touches_itself(uv + 1e6, loop)
    uv[loop[5]] = uv[loop[0]] + 1e-9
    assert touches_itself(uv, loop) and touches_itself(1e6 * uv, loop)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 50.0])
@pytest.mark.parametrize("draft", [False, True])
def test_an_isometry_is_good_enough_in_any_unit_and_what_folds_or_shears_is_not(scale, draft):
    V, F = meshes.grid(6, 6, 1.0, 2.0)
    V = V * [1, 1, 0]
    disk, uv = disk_of(V, F), V[:, :2]
    found = good_enough(disk, scale * uv + 3 * scale, draft, False, 0.0)
    assert found.area_error < 1e-9 and found.iterations == 0
    # What comes out has the area of the surface.
    assert np.abs(signed_areas(found.uv, F)).sum() == pytest.approx(2.0)
    np.testing.assert_allclose(found.uv - found.uv[0], uv - uv[0], atol=1e-9)
    folded = uv.copy()
    folded[24] += [0.5, 0]
    assert good_enough(disk, scale * folded, draft, False, 0.0) is None
    sheared = scale * uv * [3.0, 1.0]
    assert (good_enough(disk, sheared, draft, False, 0.0) is None) != draft
    # The areas of a draft have bounds, too.
    assert good_enough(disk, scale * np.sign(uv - 0.01) * np.abs(uv) ** 3, draft, False, 0.0) is None
