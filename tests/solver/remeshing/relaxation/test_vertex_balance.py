"""Vertices go to where the density asks for them, and their number stays."""

from __future__ import annotations

import meshes
import numpy as np
from mesh_checks import topology

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.remeshing.edits.vertex_count import SizingField, edge_length
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.initial.sphere_samples import sample_sphere
from omt_uv.solver.remeshing.relaxation.surface_carrier import SurfaceCarrier
from omt_uv.solver.remeshing.relaxation.vertex_balance import balance_vertices


def on_a_sphere(factor):
    V, F = meshes.icosphere(4)
    density = np.where(V[F].mean(axis=1)[:, 2] > 0, factor, 1.0)
    density /= face_areas(V, F) @ density / face_areas(V, F).sum()
    even = sample_sphere(V, F, V, V, 642)
    P, Q = even.points, even.triangles
    size = edge_length(face_areas(V, F).sum(), 0.0, len(P))
    index = ClosestPoint(V, F, size)
    mesh = WorkingMesh(P, Q, np.zeros(len(P), dtype=bool), np.zeros(0, np.int64))
    return mesh, SurfaceCarrier(index, density, len(P)), SizingField(index, density, size)


def test_an_even_mesh_stays_nearly_as_it_is():
    mesh, carrier, sizing = on_a_sphere(1.0)
    found = balance_vertices(mesh, carrier, sizing, None)
    kept = {tuple(p) for p in mesh.points} & {tuple(p) for p in found.mesh.points}
    assert len(kept) > 0.95 * len(mesh.points) and len(found.mesh.points) == len(mesh.points)
    np.testing.assert_array_equal(found.demand, carrier.measure)


def test_vertices_go_to_the_dense_half_at_the_same_number():
    mesh, carrier, sizing = on_a_sphere(4.0)
    found = balance_vertices(mesh, carrier, sizing, None)
    assert not found.was_balanced and len(found.mesh.points) == len(mesh.points)
    assert topology(found.mesh.triangles) == (2, 0)
    above = [(m.points[:, 2] > 0).mean() for m in (mesh, found.mesh)]
    # Half of them in the beginning; relaxation has to make room for more.
    assert abs(above[0] - 0.5) < 0.02 and above[1] > above[0] + 0.08
    again = balance_vertices(found.mesh, carrier, sizing, found.demand)
    assert len(again.demand) == len(found.demand) and len(again.mesh.points) == len(mesh.points)


def test_what_has_too_few_vertices_demands_more_each_time_and_what_has_too_many_less():
    """Where relaxation takes vertices away again they are asked for until they stay."""
    mesh, carrier, sizing = on_a_sphere(4.0)
    first = balance_vertices(mesh, carrier, sizing, carrier.measure)
    change = first.demand / carrier.measure
    # Half of the vertices are above, where four fifths of the measure are.
    above = carrier.density[carrier._samples.faces] > 1
    assert change[above].mean() > 1.02 and change[~above].mean() < 0.98
    assert change.min() >= 0.9 and change.max() <= 1.1


def test_at_an_even_density_nothing_is_demanded_beyond_the_measure():
    """Whatever was demanded before: what relaxation takes away along jumps of the density has no jump here."""
    mesh, carrier, sizing = on_a_sphere(1.0)
    demands = None, carrier.measure, carrier.measure * (1 + 0.5 * np.sin(np.arange(len(carrier.measure))))
    first, *others = (balance_vertices(mesh, carrier, sizing, demand) for demand in demands)
    for found in others:
        np.testing.assert_array_equal(found.demand, carrier.measure)
        np.testing.assert_array_equal(found.mesh.points, first.mesh.points)
