"""What pipelines say and do where it seldom comes to that: warnings with their counts, shares, places, errors."""

from __future__ import annotations

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from readings import reading
from sphere_shapes import blob

from omt_uv.pipelines import globe, subdivision, unwrap
from omt_uv.pipelines.arranging.found import arranged, islands_of
from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.regions import several
from omt_uv.pipelines.shapes import match, partition, signature_index
from omt_uv.pipelines.shapes.landmark_pairs import LandmarkPoint, Pairs
from omt_uv.pipelines.volumes.flow import UVPlaces, _crossing, _placed
from omt_uv.pipelines.volumes.volume import VolumeBody, _own
from omt_uv.solver.canonical.markers import MapMarkers
from omt_uv.solver.errors import MeshError, PrecisionError
from omt_uv.solver.flows.handles import FlowHandle
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.parameterization.chart_map import ChartMap
from omt_uv.solver.progress import drain
from omt_uv.solver.signatures.signature import signature
from omt_uv.xatlas_charts import SegmentationError


@pytest.mark.parametrize("missed", [0, 1, 2])
@pytest.mark.parametrize("folded", [0, 1, 5])
def test_poles_within_faces_and_faces_folded_near_them_are_counted(missed, folded):
    texts = globe._pole_warnings(missed, folded)
    assert len(texts) == (missed > 0) + (folded > 0)
    if missed:
        assert texts[0].startswith("A pole of the projection lies" if missed == 1 else f"{missed} poles of the")
    if folded:
        assert texts[-1].startswith("A face is folded" if folded == 1 else f"{folded} faces are folded")


def components():
    """Two closed bodies in one surface, with polygons of two triangles, the second one first in number."""
    (V, F), (W, G) = blob(1), blob(1, seed=3)
    positions, faces = np.concatenate([V, W + 5]), np.concatenate([F, G + len(V)])[::-1]
    return reading(positions, faces).surface, positions, faces


@pytest.mark.parametrize("kind", ["vertex", "face", ""])
def test_errors_of_a_component_are_told_by_the_indices_of_the_mesh(kind):
    surface, positions, faces = components()
    for part in globe.closed_components(surface):
        own = {"vertex": [3, 7], "face": [5, 2, 5], "": []}[kind]
        found = globe._located(PrecisionError("It is so", "Do this", kind, own), part)
        assert type(found) is PrecisionError and (found.cause, found.remedy) == ("It is so", "Do this")
        if kind == "vertex":
            assert np.allclose(positions[found.elements], part.vertices[own])
        elif kind == "face":
            assert sorted(set(found.elements)) == found.elements.tolist() == sorted(set(part.faces[own].tolist()))
        else:
            # As a whole: all of its faces.
            assert found.kind == "face" and set(found.elements) == set(part.faces)
        if kind != "":
            assert globe._located(PrecisionError("It is so", "", kind), part).elements.size == 0


def test_every_part_of_a_surface_is_a_component_with_its_own_numbers():
    surface, positions, faces = components()
    parts = globe.closed_components(surface)
    assert len(parts) == 2 and sorted(np.concatenate([p.members for p in parts])) == list(range(len(faces)))
    for part in parts:
        np.testing.assert_array_equal(part.vertex_ids[part.triangles], faces[part.members])
        np.testing.assert_array_equal(positions[part.vertex_ids], part.vertices)
        np.testing.assert_array_equal(part.corners, np.arange(3 * len(faces)).reshape(-1, 3)[part.members])
        np.testing.assert_array_equal(part.faces, part.members)
    only = np.isin(np.arange(len(faces)), parts[1].members)
    (one,) = globe.closed_components(surface, only)
    np.testing.assert_array_equal(one.vertex_ids, parts[1].vertex_ids)


@pytest.mark.parametrize("low, high", [((0.1, 0.2), (0.9, 0.8)), ((-0.5, 0.1), (0.5, 0.9)), ((0.0, -1.0), (1.0, 3.0))])
def test_a_layout_is_drawn_into_the_tile_along_each_axis_as_far_as_it_takes(low, high):
    uv = np.array([low, high, np.mean([low, high], axis=0)])
    found = globe.inside_tile(uv)
    assert found.min() >= 0 and found.max() <= 1
    for axis in range(2):
        inside = low[axis] >= 0 and high[axis] <= 1
        if inside:
            np.testing.assert_array_equal(found[:, axis], uv[:, axis])
        else:
            scale = np.ptp(found[:, axis]) / np.ptp(uv[:, axis])
            assert scale == pytest.approx(1 / (max(high[axis], 1) - min(low[axis], 0)))


@pytest.mark.parametrize("density", [False, True])
def test_shares_of_the_texture_are_those_of_areas_times_density(density):
    V, F = blob(1)
    (part,) = globe.closed_components(reading(V, F).surface)
    values = np.random.default_rng(0).uniform(1, 3, len(F)) if density else None
    shares = globe._shares(part, values)
    mass = face_areas(V, F) * (1 if values is None else values)
    np.testing.assert_allclose(shares, mass / mass.sum())
    # Each triangle is its own polygon: it gets its share, whatever its part of the sphere is.
    on_sphere = np.random.default_rng(1).uniform(0.5, 1, len(F))
    np.testing.assert_allclose(globe._as_on_sphere(part, shares, on_sphere), shares * on_sphere.sum())
    pairs = type(part)(**{**vars(part), "faces": np.arange(len(F)) // 2})
    split = globe._as_on_sphere(pairs, shares, on_sphere)
    np.testing.assert_allclose(split.reshape(-1, 2).sum(axis=1), shares.reshape(-1, 2).sum(axis=1) * on_sphere.sum())
    np.testing.assert_allclose(split[::2] / split[1::2], on_sphere[::2] / on_sphere[1::2])


def test_the_density_of_several_regions_tells_which_way_to_go():
    """From 0, where there is least of the density, to 1, where there is most, over all surfaces together."""
    surfaces = [SimpleNamespace(surface=reading(*meshes.grid(2, k)).surface, faces=None, pins=None, subdivision=None,
                                was_split=False, axes="axes") for k in (1, 2)]  # fmt: skip
    counts = [len(s.surface.triangles) for s in surfaces]
    rows = [np.arange(0, counts[0], 2), np.arange(counts[1])]
    parts = [(r, np.ones(len(r)), None) for r in rows]
    total = sum(map(len, rows))
    exponent = np.linspace(-2, 3, total)
    jobs = several._jobs(surfaces, parts, np.exp(exponent), exponent)
    start = 0
    for job, r, count in zip(jobs, rows, counts, strict=True):
        mine = slice(start, start + len(r))
        np.testing.assert_allclose(job.target.density[r], np.exp(exponent)[mine])
        np.testing.assert_allclose(job.target.region[r], (exponent[mine] + 2) / 5)
        rest = np.setdiff1d(np.arange(count), r)
        assert (job.target.density[rest] == 1).all() and (job.target.region[rest] == 0).all()
        assert job.axes == "axes" and job.pins is None
        start += len(r)
    even = several._jobs(surfaces, parts, np.ones(total), np.zeros(total))
    assert all(job.target.region is None for job in even)


@pytest.mark.parametrize("write", ["mesh", "points", "face_sets", "seams", "materials", "attribute"])
def test_what_is_said_of_cells_is_about_what_is_written(write):
    division = SimpleNamespace(unequal=0.02, residual=0.001)
    whole = SimpleNamespace(empty=np.array([4]), torn=np.array([1, 2]))
    told = partition._warnings(division, whole, np.array([7]), partition.PartitionSettings(write=write))
    assert "differ by up to 2 %" in told[0]
    faces = write not in ("mesh", "points")
    assert sum("without a face" in text for text in told) == faces
    assert sum("in several pieces" in text for text in told) == (write != "points")
    if write == "mesh":
        assert told[1] == "1 cell (7) is in several pieces"
    elif faces:
        assert told[1].startswith("1 cell (4) is without a face") and told[2] == "2 cells (1, 2) are in several pieces"
    calm = SimpleNamespace(unequal=0.001, residual=0.001)
    none = SimpleNamespace(empty=np.array([], int), torn=np.array([], int))
    assert partition._warnings(calm, none, np.array([], int), partition.PartitionSettings(write=write)) == ()


def test_signatures_of_one_kind_and_size_make_an_index_that_older_ones_join(monkeypatch):
    V, F = blob(2)
    made = {name: drain(signature(V * [1, 1, 1 + k], F, 40)) for k, name in enumerate("ab")}
    index = signature_index.index_of({name: (f"mark of {name}", s) for name, s in made.items()})
    assert index.names == ("a", "b") and index.marks == ("mark of a", "mark of b") and len(index) == 2
    other = drain(signature(V * [1, 2, 1], F, 40))
    # What is new takes the place of the older one, which stays where there is none.
    both = signature_index.index_of({"b": ("new", other), "0": ("first", other)}, index)
    assert both.names == ("0", "a", "b") and both.marks == ("first", "mark of a", "new")
    np.testing.assert_array_equal(both.packed[1], index.packed[0])
    np.testing.assert_array_equal(both.packed[2], both.packed[0])
    some = signature_index.chosen(both, ["b", "0", "none"])
    assert some.names == ("0", "b") and some.marks == ("first", "new")
    np.testing.assert_array_equal(some.packed, both.packed[[0, 2]])
    np.testing.assert_array_equal(some.floors, both.floors[[0, 2]])
    np.testing.assert_array_equal(some.coefficients, both.coefficients[[0, 2]])
    with pytest.raises(signature_index.IndexFileError, match="no points"):
        signature_index.index_of({})
    with pytest.raises(signature_index.IndexFileError, match=r"\[30, 40\] points"):
        signature_index.index_of({"c": ("", drain(signature(V, F, 30)))}, index)
    flat = SimpleNamespace(points=np.zeros((40, 2)), curvature=np.zeros(40), floor=0.0)
    with pytest.raises(signature_index.IndexFileError, match="with markers and others"):
        monkeypatch.setattr(signature_index, "prepared", lambda s: SimpleNamespace(coefficients=np.zeros((9, 2))))
        signature_index.index_of({"c": ("", flat)}, index)


@pytest.mark.parametrize("count", [1, signature_index.BLOCK, signature_index.BLOCK + 1, 3 * signature_index.BLOCK - 5])
def test_blocks_cover_every_pair_once(count):
    seen = np.zeros((count, count), int)
    for first, last, left, right in signature_index.blocks_of(count):
        assert 0 < last - first <= signature_index.BLOCK and 0 < right - left <= signature_index.BLOCK
        seen[first:last, left:right] += 1
    i, j = np.indices(seen.shape)
    assert (seen[j > i] == 1).all() and seen.max() == 1


def test_a_chart_on_a_subdivided_surface_has_its_figures_and_the_warnings_that_still_hold():
    quads = np.array(
        [[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0]]], float
    )
    flat = quads[:, :, :2]
    texts = (f"{subdivision.AREA_WARNING} by far", "another")
    figures = dict.fromkeys(
        ("newton_refinement", "residual_refinement", "area_l1", "area_sd", "angle_mean", "folds"), 9
    )
    old = ChartMap(uv=np.zeros((6, 2)), status="converged", warnings=texts, **figures)
    uv = np.ones((6, 2))

    def figures_of(row, mapped):
        place, number = np.unique(row.reshape(-1, 3), axis=0, return_inverse=True)
        fine = np.zeros((len(place), 2))
        fine[number.ravel()] = mapped.reshape(-1, 2)
        return subdivision._with_figures(old, uv, row, number.reshape(-1, 4), fine)

    found = figures_of(quads, flat)
    assert found.uv is uv and found.warnings == ("another",)
    assert (found.area_l1, found.area_sd, found.folds) == (pytest.approx(0), pytest.approx(0), 0)
    assert found.angle_mean == pytest.approx(1)
    for count, text in (
        (1, "A face of the subdivided surface is folded"),
        (2, "2 faces of the subdivided surface are"),
    ):
        # A row of quads, of which the last ones are turned over along their edge with the others.
        row = np.concatenate([quads[:1] + [k, 0, 0] for k in range(6)])
        turned = row[:, :, :2].copy()
        turned[:, :, 0] = np.minimum(turned[:, :, 0], 2 * (6 - count) - turned[:, :, 0])
        folded = figures_of(row, turned)
        assert folded.folds == count and folded.warnings[-1].startswith(text) and len(folded.warnings) == 2
    assert subdivision._with_figures(old, uv, quads[:0], np.zeros((0, 4), int), np.zeros((0, 2))) is old


def test_parts_that_lie_on_one_another_are_joined_with_their_marks_and_their_weights():
    (V, F), (W, G) = meshes.grid(2, 2), meshes.grid(2, 2)
    positions, faces = np.concatenate([V, W + [1, 0, 0]]), np.concatenate([F, G + len(V)])
    seam = [np.flatnonzero(np.abs(positions - p).max(axis=1) < 1e-9).tolist() for p in V[V[:, 0] == 1]]
    assert all(len(pair) == 2 for pair in seam)
    avoid = np.zeros(len(positions))
    avoid[seam[0][1]] = 0.7
    markers = MapMarkers(np.array([seam[1][1]]), np.array([], int), np.array([seam[2][0], 0]))
    job = UnwrapJob(reading(positions, faces).surface, None, None, avoid=avoid, markers=markers)
    found, text = unwrap._joined(0, job)
    assert text.startswith("3 boundary vertices lie on others and are joined")
    name = found.surface.corner_vertex[np.argsort(faces.ravel(), kind="stable")]
    assert len(np.unique(found.surface.corner_vertex)) == len(positions) - 3 and len(name) == faces.size
    same = {a: found.surface.corner_vertex[np.flatnonzero(faces.ravel() == a)[0]] for a in range(len(positions))}
    assert all(same[a] == same[b] for a, b in seam)
    assert found.markers.centre.tolist() == [same[seam[1][1]]]
    assert found.markers.corners.tolist() == [same[seam[2][0]], same[0]] and not len(found.markers.start)
    assert found.avoid[same[seam[0][0]]] == 0.7 and np.count_nonzero(found.avoid) == 1
    apart, said = unwrap._joined(0, UnwrapJob(reading(V, F).surface, None, None))
    assert said == "" and apart.surface.corner_vertex is not None
    only = np.arange(len(faces)) < len(F)
    assert unwrap._joined(0, UnwrapJob(job.surface, only, None))[1] == ""


def test_without_charts_it_is_cut_where_it_has_to_be_and_that_is_said(monkeypatch):
    def fails(*_):
        raise SegmentationError("xatlas: no")

    monkeypatch.setattr(unwrap, "chart_seams", fails)
    job = UnwrapJob(reading(*meshes.grid(2, 2)).surface, None, None)
    found, text = unwrap._with_charts(0, job)
    assert found is job and text == "xatlas: no; cut only where it has to be"
    monkeypatch.setattr(unwrap, "chart_seams", lambda *_: np.array([[1, 4]]))
    found, text = unwrap._with_charts(0, job)
    assert text == "" and found.surface.seams.tolist() == [[1, 4]]
    assert unwrap._as_it_is(0, job) == (job, "")

    def refused(*_):
        raise MeshError("It is so")

    monkeypatch.setattr(unwrap, "chart_seams", refused)
    with pytest.raises(unwrap.Refusal) as caught:
        unwrap._with_charts(3, job)
    assert caught.value.index == 3


@pytest.mark.parametrize("kept", [False, True])
def test_the_places_of_a_bodys_own_vertices_are_those_there(kept):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    own = points if kept else np.array([[0.25, 0.25, 0.25], [0.1, 0.0, 0.0]])
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found = SimpleNamespace(points=points, tets=np.array([[0, 1, 2, 3]]), positions=points @ turn.T)
    body = VolumeBody("b", own, np.zeros((0, 3), int), {})
    np.testing.assert_allclose(_own(body, found), own @ turn.T, atol=1e-12)


def test_corners_at_one_place_stay_together():
    rng = np.random.default_rng(0)
    places = rng.random((5, 2))
    which = rng.integers(0, 5, 12)
    pinned = np.isin(which, [2, 4]) & (rng.random(12) < 0.7)
    at = UVPlaces.of(places[which], pinned)
    assert at.place.shape == (12,) and len(at.places) == len(np.unique(which))
    np.testing.assert_array_equal(at.places[at.place], places[which])
    assert set(map(tuple, at.places[at.pinned])) == set(map(tuple, places[which[pinned]]))
    assert len(np.unique(at.pinned)) == len(at.pinned)


def test_faces_that_meet_are_told_by_their_body_and_its_polygons():
    bodies = tuple(SimpleNamespace(triangles=np.zeros((n, 3), int), polygons_of=lambda rows, k=k: 100 * k + rows // 2)
                   for k, n in enumerate((4, 3, 5)))  # fmt: skip
    found = _crossing(bodies, np.array([0, 3, 4, 6, 7, 11]))
    assert [x.tolist() for x in found] == [[0, 1], [100, 101], [200, 202]]
    handle = FlowHandle(np.zeros((2, 3)), np.ones((2, 3)), np.array([0, 5]), "h")
    assert _placed(handle, 10).vertices.tolist() == [10, 15] and _placed(handle, -1).vertices is None
    assert _placed(FlowHandle(handle.start, handle.end), 10).vertices is None and _placed(handle, 0).name == "h"


def test_landmarks_have_the_numbers_of_the_part_and_of_none_where_they_are_elsewhere():
    source = SimpleNamespace(used=np.array([2, 5, 6]))
    target = SimpleNamespace(used=np.array([0, 9]))
    pairs = Pairs(
        (LandmarkPoint("a", 5, None), LandmarkPoint("b", -1, (1.0, 2.0, 3.0))),
        (LandmarkPoint("a", 9, None), LandmarkPoint("b", 30, None)),
    )
    found = match._renamed(pairs, source, target)
    assert [p.vertex for p in found.source] == [1, -1] and found.source[1].position == (1.0, 2.0, 3.0)
    # One that no part has is beyond all of them.
    assert [p.vertex for p in found.target] == [1, 2] and [p.name for p in found.target] == ["a", "b"]
    other = match._renamed(Pairs((LandmarkPoint("c", 3, None),), (LandmarkPoint("c", 1, None),)), source, target)
    assert [other.source[0].vertex, other.target[0].vertex] == [3, 2]


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("given", [[], [(0, "one")], [(-1, "all"), (0, "one")]])
def test_whether_islands_grew_together_or_not_all_else_is_said(apart, given):
    V, F = meshes.grid(2, 2)
    W, G = np.concatenate([V, V + [9, 0, 0]]), np.concatenate([F, F + len(V)])
    found = islands_of([reading(W, G, W[:, :2].copy())])
    beside = arranged(1, found, [each.island.uv for each in found], 2, given, apart)
    over = arranged(1, found, [found[0].island.uv] * 2, 2, given, apart)
    assert beside.warnings == given and over.warnings[: len(given)] == given
    more = over.warnings[len(given) :]
    assert len(more) == apart and all(k == -1 and "grew into each other" in text for k, text in more)
