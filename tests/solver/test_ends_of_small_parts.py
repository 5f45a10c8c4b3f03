"""What is seen only where numbers differ from places: elements of errors, mirrored charts, the order of a pair."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import meshes
import numpy as np
import pytest
from short_cuts import component_of

from omt_uv.solver.canonical.markers import MapMarkers, markers_of_chart
from omt_uv.solver.contact.new_crossings import NewCrossings
from omt_uv.solver.contact.self_intersections import FaceCrossings, intersecting_pairs
from omt_uv.solver.cutting.protrusions import first_tips
from omt_uv.solver.errors import MeshError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.parameterization.polygons.convexity import dented_faces
from omt_uv.solver.refinement.continuation_rules import QUALITIES, stage_tolerances


@pytest.mark.parametrize(("name", "way"), product(QUALITIES, [True, False]))
def test_with_a_region_no_stage_is_stricter_than_without(name, way):
    quality = QUALITIES[name]
    region, plain = (stage_tolerances(quality, 0.0, way, False, loose) for loose in (True, False))
    assert region[0] >= plain[0] and region[0] >= 0.1


def test_markers_of_one_name_are_told_by_numbers_of_the_mesh():
    """In the second of two islands, whose vertices have numbers of their own."""
    V, F = meshes.bumpy(4, 4)
    both = meshes.polygon_surface(np.vstack([V, V + 3]), np.vstack([F, F + len(V)]).tolist())
    chart = max(strict_charts(both), key=lambda c: c.vertex_ids.min())
    inner = np.array([6, 12]) + len(V)
    with pytest.raises(MeshError) as caught:
        markers_of_chart(MapMarkers(inner, inner[:0], inner[:0]), chart)
    assert sorted(caught.value.elements.tolist()) == inner.tolist()


def test_quads_are_dented_in_charts_that_look_to_the_other_side_as_well():
    V, quads = meshes.quad_grid(4, 4)
    surface = meshes.polygon_surface(V, quads)
    chart = strict_charts(surface)[0]
    turned = replace(chart, triangles=chart.triangles[:, ::-1], corners=chart.corners[:, ::-1])
    uv = chart.vertices[:, :2].copy()
    for other, way in ((chart, [1, 1]), (turned, [-1, 1])):
        assert not len(dented_faces(surface, other, uv * way))
    uv[np.linalg.norm(uv - uv.mean(axis=0), axis=1).argmin()] += 0.1485
    found = dented_faces(surface, chart, uv)
    assert len(found) == 1 and np.array_equal(found, dented_faces(surface, turned, uv * [-1, 1]))


def test_the_first_tip_is_where_a_cut_may_end():
    """The sharpest extremity of all is passed over if cuts are to be avoided there."""
    V, F = meshes.icosphere(2)
    V = V * [1.0, 1.0, 1.6] + 0.1 * np.clip(V[:, [2]], 0, 1) ** 3 * [0, 0, 4.0]
    component = component_of(V, F)
    sharpest = first_tips(component)[0]
    avoid = np.zeros(len(V))
    avoid[sharpest] = 1.0
    object.__setattr__(component, "avoid", avoid)
    assert first_tips(component)[0] != sharpest


def test_pairs_that_intersected_before_are_old_whichever_comes_first():
    """Two blades through each other, one of them moved on: by brute force over all pairs of before and after."""
    V = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.6, 0.5, 1], [0.5, 0.7, 1.0]])
    for F in (np.array([[0, 1, 2], [3, 4, 5]]), np.array([[3, 4, 5], [0, 1, 2]]), np.array([[0, 2, 1], [5, 4, 3]])):
        assert len(intersecting_pairs(V, F)) == 1
        after = V + np.array([0.05, 0.02, 0.1]) * (np.arange(6) > 2)[:, None]
        assert len(intersecting_pairs(after, F)) == 1
        assert not len(NewCrossings(V, FaceCrossings(F)).pairs(after))


@pytest.mark.parametrize("order", [[0, 1, 2], [0, 2, 1], [1, 0, 2], [2, 1, 0]])
def test_what_went_through_a_triangle_is_old_in_the_next_one_too(order):
    """A blade slides from one triangle of a square into the other, whatever comes first."""
    square = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [2, 2, 0]]
    V = np.array([*square, [0.5, 0.5, -1], [0.6, 0.5, 1], [0.5, 0.7, 1.0]])
    F = np.array([[0, 1, 2], [4, 5, 6], [1, 3, 2]])[order]
    after = V + 0.9 * (np.arange(7) > 3)[:, None] * [1, 1, 0]
    assert len(intersecting_pairs(V, F)) == len(intersecting_pairs(after, F)) == 1
    assert not len(NewCrossings(V, FaceCrossings(F)).pairs(after))
