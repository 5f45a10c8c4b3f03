"""Cells, matches, strain and boxes of pipelines against plain sums over faces, edges and vertices."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from sphere_shapes import random_rotation

from omt_uv.pipelines.attributes import Attributes, Layer, Marks, ShapeKey
from omt_uv.pipelines.magnify import Region
from omt_uv.pipelines.regions import detail
from omt_uv.pipelines.shapes import distance, match, partition, strain
from omt_uv.pipelines.shapes.cell_attributes import carry_to_cells
from omt_uv.pipelines.shapes.landmark_pairs import LandmarkPoint, Pairs, pairs_of
from omt_uv.settings import PartitionSettings
from omt_uv.solver.mesh.geometry import face_areas, face_normals
from omt_uv.solver.mesh.surface import chosen_triangles, triangle_surface
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.partition.cut_mesh import cut_along_cells
from omt_uv.solver.partition.division import DivisionOptions, divide
from omt_uv.solver.progress import drain
from omt_uv.solver.registration.results import RegistrationOptions
from omt_uv.solver.strain.beltrami import Beltrami


def quads():
    """A bumpy body of quads, as a surface."""
    V, F = meshes.quad_grid(5, 4)
    V = np.column_stack([V[:, :2], 0.2 * np.sin(3 * V[:, 0]) + V[:, 2]])
    return meshes.polygon_surface(V, [tuple(f) for f in np.asarray(F).tolist()])


def polygons(surface):
    return [surface.corner_vertex[a:b] for a, b in zip(surface.face_start, surface.face_start[1:], strict=False)]


# ---- cells --------------------------------------------------------------------------------------------------


def test_borders_are_edges_between_polygons_of_different_cells():
    surface = quads()
    cell = np.random.default_rng(0).integers(-1, 3, len(surface.face_start) - 1)
    edges = {}
    for k, f in enumerate(polygons(surface)):
        for a, b in zip(f, np.roll(f, -1), strict=True):
            edges.setdefault(frozenset((int(a), int(b))), []).append(cell[k])
    expected = {e for e, c in edges.items() if len(c) == 2 and c[0] != c[1] and min(c) >= 0}
    found = partition._borders(surface, cell)
    assert {frozenset(e) for e in found.tolist()} == expected and len(found) == len(expected)


def test_densities_are_means_of_corners_and_never_nothing():
    F = np.array([[0, 1, 2], [1, 3, 2], [4, 4, 4]])
    found = partition._density(np.array([1.0, 2, -3, 4, 0]), F)
    assert found == pytest.approx([1, 2, 4 * partition.LEAST_DENSITY])
    assert (partition._density(np.zeros(5), F) > 0).all()


def test_polygons_are_those_that_were_chosen():
    surface = quads()
    chosen = np.array([1, 4, 5])
    corners, start = partition._polygons(surface, chosen)
    every = polygons(surface)
    for k, polygon in enumerate(chosen):
        np.testing.assert_array_equal(corners[start[k] : start[k + 1]], every[polygon])


@pytest.mark.parametrize("painted", [False, True])
def test_points_and_figures_are_those_of_the_division(painted):
    V, F = meshes.icosphere(2)
    density = np.random.default_rng(0).uniform(0.5, 2, len(F)) if painted else None
    found = drain(divide(V, F, 9, density, DivisionOptions(relax=2, seed=1)))
    points = partition._points(V, F, found, density)
    here = found.sites.triangle
    np.testing.assert_allclose(points.normals, face_normals(V, F)[here])
    assert points.areas.sum() == pytest.approx((face_areas(V, F) * (1 if density is None else density)).sum())
    local = points.areas / (1 if density is None else density[here])
    np.testing.assert_allclose(np.pi * points.radii**2, local)
    np.testing.assert_allclose(np.linalg.norm(points.positions, axis=1), 1, atol=0.05)
    surface = triangle_surface(V, F)
    weights = None if density is None else np.ones(len(V))
    told = drain(partition.partition_surface(surface, None, weights, PartitionSettings(9, 2, "mesh", 1)))
    assert told.figures["cells"] == 9 and told.figures["area"] == pytest.approx(face_areas(V, F).sum())
    # The nearest pair is nearer than pairs are in the mean.
    assert 0.3 < told.figures["least_distance"] <= 1
    area = np.bincount(told.cell[told.cell >= 0], face_areas(V, F)) / (face_areas(V, F).sum() / 9)
    assert told.figures["error_of_faces"] == pytest.approx(np.abs(area - 1).max(), rel=1e-6)


def cells_of(surface, count=4):
    _, corners, _ = chosen_triangles(surface, None)
    triangles = surface.corner_vertex[corners]
    division = drain(divide(surface.positions, triangles, count, None, DivisionOptions(relax=0, seed=0)))
    return corners, cut_along_cells(surface.positions, triangles, division)


def carried_with(surface, layers=(), marks=None, **others):
    none = Marks(np.zeros((0, 2), int), np.zeros(0, bool), np.zeros(0, bool), np.zeros(0))
    count = len(surface.face_start) - 1
    given = Attributes(np.arange(count), np.arange(count) % 2 == 0, none if marks is None else marks, layers, **others)
    corners, mesh = cells_of(surface)
    return carry_to_cells(given, surface, corners, mesh), mesh


def test_what_is_linear_is_carried_to_cells_exactly():
    surface = quads()
    V, corner = surface.positions, surface.corner_vertex
    A = np.random.default_rng(0).normal(size=(3, 3))
    layers = (
        Layer("p", "POINT", "FLOAT_VECTOR", V @ A),
        Layer("c", "CORNER", "FLOAT2", (V @ A)[corner, :2]),
        Layer("f", "FACE", "INT", np.arange(len(surface.face_start) - 1)),
        Layer("n", "POINT", "INT", np.arange(len(V))),
        Layer("m", "CORNER", "INT", np.arange(len(corner))),
    )
    offsets, weights = V @ A[:, ::-1], np.abs(V[:, :2])
    found, mesh = carried_with(
        surface, layers, groups=("a", "b"), weights=weights, member=weights > -1, keys=(ShapeKey("k", offsets, 0, {}),)
    )
    p, c, f, n, m = (layer.values for layer in found.layers)
    np.testing.assert_allclose(p, mesh.positions @ A, atol=1e-9)
    np.testing.assert_allclose(c, (mesh.positions @ A)[mesh.corner_vertex, :2], atol=1e-9)
    np.testing.assert_allclose(found.keys[0].offsets, mesh.positions @ A[:, ::-1], atol=1e-9)
    np.testing.assert_allclose(found.weights, np.abs(mesh.positions[:, :2]), atol=1e-9)
    np.testing.assert_array_equal(found.material_index, f)
    np.testing.assert_array_equal(found.smooth, f % 2 == 0)
    # What cannot be blended is that of a vertex, or corner, of the polygon around.
    every = polygons(surface)
    start = np.repeat(np.arange(len(mesh.triangle)), np.diff(mesh.face_start))
    _, corners, _ = chosen_triangles(surface, None)
    other = 0
    for k, v in enumerate(mesh.corner_vertex):
        assert surface.face_start[f[start[k]]] <= m[k] < surface.face_start[f[start[k]] + 1]
        assert any(n[v] in every[q] for q in f[start[mesh.corner_vertex == v]])
        # Of the corners of the triangle that it lies in, the one by which it lies.
        mine = corners[mesh.triangle[start[k]]]
        shares = np.linalg.lstsq(np.vstack([V[corner[mine]].T, np.ones(3)]), [*mesh.positions[v], 1], rcond=None)[0]
        assert shares[mine == m[k]] >= shares.max() - 1e-9
        other += int(m[k] != mine[0])
    assert other > 5


@pytest.mark.parametrize(("kind", "shape"), [("FLOAT", ()), ("FLOAT2", (2,)), ("FLOAT_VECTOR", (3,)), ("INT", ())])
@pytest.mark.parametrize("count", [0, 1])
def test_layers_of_marks_keep_their_shapes_where_no_edge_has_any(kind, shape, count):
    surface = quads()
    values = np.ones((count, *shape), np.int32 if kind == "INT" else np.float32)
    none = np.zeros(count, bool)
    marks = Marks(
        surface.corner_vertex[None, :2][:count], none, none, np.zeros(count), (Layer("x", "EDGE", kind, values),)
    )
    found, _ = carried_with(surface, marks=marks)
    (layer,) = found.marks.layers
    assert layer.values.shape == (len(found.marks.edges), *shape) and layer.values.dtype == values.dtype
    assert len(found.marks.edges) and layer.values.any() == (count > 0)


def test_marks_are_on_the_pieces_of_the_edges_that_had_them_and_cells_end_at_seams():
    surface = quads()
    edges = {}
    for f in polygons(surface):
        for a, b in zip(f, np.roll(f, -1), strict=True):
            edges.setdefault((min(a, b), max(a, b)), len(edges))
    last = surface.corner_vertex[surface.triangles[-1]]
    # Those of the last triangle, too: edges inside of faces are of none.
    outer = {tuple(sorted((int(last[k]), int(last[k - 1])))) for k in range(3)}
    edges = np.array([e for e in edges if sum(e) % 3 == 0 or e in outer])
    rng = np.random.default_rng(0)
    marks = Marks(edges, rng.random(len(edges)) < 0.5, rng.random(len(edges)) < 0.5, rng.random(len(edges)),
                  (Layer("bevel", "EDGE", "FLOAT", rng.random(len(edges))),))  # fmt: skip
    found, mesh = carried_with(surface, marks=marks)
    got = found.marks
    V, P = surface.positions, mesh.positions
    owner = np.repeat(mesh.cell, np.diff(mesh.face_start))
    after = np.concatenate(
        [np.roll(np.arange(a, b), -1) for a, b in zip(mesh.face_start, mesh.face_start[1:], strict=False)]
    )
    cells = {}
    for k, v in enumerate(mesh.corner_vertex):
        cells.setdefault(frozenset((int(v), int(mesh.corner_vertex[after[k]]))), set()).add(owner[k])
    lengths = dict.fromkeys(range(len(edges)), 0.0)
    for k, (a, b) in enumerate(got.edges):
        on = [j for j, (x, y) in enumerate(edges) if all(off(P[q], V[x], V[y]) < 1e-9 for q in (a, b))]
        between = len(cells[frozenset((int(a), int(b)))]) > 1
        assert on or between
        if on:
            (j,) = on
            lengths[j] += np.linalg.norm(P[a] - P[b])
            assert got.sharp[k] == marks.sharp[j] and got.crease[k] == pytest.approx(marks.crease[j])
            assert got.layers[0].values[k] == pytest.approx(marks.layers[0].values[j])
        else:
            assert not got.sharp[k] and got.crease[k] == 0 and got.layers[0].values[k] == 0
        assert got.seam[k] == (between or bool(on and marks.seam[on[0]]))
    for j, length in lengths.items():
        assert length == pytest.approx(np.linalg.norm(V[edges[j, 0]] - V[edges[j, 1]]))
    assert {e for e, c in cells.items() if len(c) > 1} <= {frozenset(e) for e in got.edges.tolist()}


@pytest.mark.parametrize("named", [0, 1, 4])
@pytest.mark.parametrize("meeting", [None, 0, 3])
def test_the_report_of_a_match_tells_of_each_landmark_and_how_many_are_met(named, meeting):
    """Those of a file of pairs have numbers in place of names."""
    met, off = np.array([True, False, True, False]), np.array([0.25, 0.5, 0.125, 0.0625])
    stretches = np.stack([np.arange(101.0), 2 * np.arange(101.0)], axis=1)
    found = SimpleNamespace(domain="sphere", flipped=0.75, residuals=off, met=met, stretches=stretches, steps=(3, 5))
    histogram = np.array([0.12345678, 0.5])
    figures = SimpleNamespace(mean_curvature=0.3, curvature=histogram, mean_area=1.7, area=2 * histogram)
    names = tuple("abcd"[:named])

    class Landmarks(tuple):
        pass

    landmarks = Landmarks(range(4))
    landmarks.names = names
    result = match.MatchResult(None, None, None, (), found, landmarks, figures, ("a", "b"), meeting)
    vars(result)["fit"] = 0.0625
    told = result.report()
    assert told.pop("landmarks") == dict(zip([*names, *"0123"[named:]], off.tolist(), strict=True))
    assert told.pop("intersections", None) == meeting
    assert told == {
        "domain": "sphere",
        "flipped_area": 0.75,
        "met": 2,
        "stretch_99": [99.0, 198.0],
        "curvature_difference": {"mean": 0.3, "histogram": [0.123457, 0.5]},
        "area_distortion": {"mean": 1.7, "histogram": [0.246914, 1.0]},
        "fit_rms": 0.0625,
        "steps": [3, 5],
        "warnings": ["a", "b"],
    }


def off(p, a, b):
    """Distance of a point from a segment."""
    t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(p - a - t * (b - a))


# ---- matches ------------------------------------------------------------------------------------------------


def two_parts():
    """A large ball, and two small ones beside it."""
    V, F = meshes.icosphere(2)
    W, G = meshes.icosphere(1)
    parts = [(V, F), (0.2 * W + [1.5, 0, 0], G), (0.1 * W - [0, 1.4, 0.2], G)]
    start = np.cumsum([0, *(len(p) for p, _ in parts)])
    order = np.random.default_rng(0).permutation(start[-1])
    back = np.argsort(order)
    faces = [back[f + s] for (_, f), s in zip(parts, start, strict=False)]
    return np.concatenate([p for p, _ in parts])[order], np.concatenate(faces)


@pytest.mark.parametrize("mirrored", [False, True])
def test_small_parts_go_along_with_a_similarity(mirrored):
    V, F = two_parts()
    surface = triangle_surface(V, F)
    part = match.largest_part(surface, "source")
    R = 1.7 * random_rotation(2)
    moved = V @ R.T + [3, -1, 2]
    wrapped = V.copy()
    wrapped[part.used] = moved[part.used] * ([-1, 1, 1] if mirrored else [1, 1, 1])
    match._carry_parts(wrapped, surface, part)
    if not mirrored:
        np.testing.assert_allclose(wrapped, moved, atol=1e-9)
    else:
        # Parts are never turned inside out: each keeps its shape, of one scale, and its handedness.
        for rows in (np.isin(F, part.rest).all(axis=1),):
            before, after = (np.linalg.det(x[F[rows]] - x[F[rows]].mean(axis=(0, 1))) for x in (V, wrapped))
            assert np.isfinite(after).all() and before.any()


def test_landmarks_have_the_numbers_of_the_part_the_first_vertex_too():
    """And what is on another part a number that no vertex of this one has; places without a vertex stay so."""
    V, F = two_parts()
    surface = triangle_surface(V, F)
    part = match.largest_part(surface, "source")
    given = [*range(len(V)), -1]
    points = tuple(LandmarkPoint(f"{k}", k, None if k >= 0 else (0.0, 0.0, 1.0)) for k in given)
    renamed = match._renamed(Pairs(points, points), part, part)
    place = {k: i for i, k in enumerate(part.used.tolist())}
    expected = [-1 if k < 0 else place.get(k, len(part.used)) for k in given]
    for side in (renamed.source, renamed.target):
        assert [point.vertex for point in side] == expected
        assert [(p.name, p.position) for p in side] == [(p.name, p.position) for p in points]


def horn(before, after):
    """The similarity that fits best, by the largest eigenvector of a matrix of four rows (Horn 1987)."""
    p, q = before - before.mean(axis=0), after - after.mean(axis=0)
    S = p.T @ q
    d = np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])
    N = np.block([[np.trace(S), d], [d[:, None], S + S.T - np.trace(S) * np.eye(3)]])
    w, x, y, z = np.linalg.eigh(N)[1][:, -1]
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    R = np.eye(3) + 2 * w * K + 2 * K @ K
    scale = np.sum(q * (p @ R.T)) / np.sum(p**2)
    return lambda x: scale * (x - before.mean(axis=0)) @ R.T + after.mean(axis=0)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_small_part_goes_by_the_best_similarity_of_all_that_is_near(seed, mirrored):
    """The large part has so few vertices that all are near; what is mirrored is followed by a turn, and smaller."""
    rng = np.random.default_rng(seed)
    (V, F), (W, G) = meshes.icosphere(1), meshes.icosphere(0)
    W = 0.2 * W + [1.5, 0.1, 0]
    surface = triangle_surface(np.concatenate([V, W]), np.concatenate([F, G + len(V)]))
    part = match.largest_part(surface, "source")
    wrapped = surface.positions.copy()
    moved = V * [1.0, 1.3, 0.6] @ (1.4 * random_rotation(seed)).T + rng.normal(scale=0.05, size=V.shape)
    wrapped[: len(V)] = moved * ([1, 1, -1] if mirrored else 1)
    goal = horn(V, wrapped[: len(V)])
    match._carry_parts(wrapped, surface, part)
    np.testing.assert_allclose(wrapped[len(V) :], goal(W), atol=1e-9)


SIDES = ("source", "target")
NOT_POLISHED = RegistrationOptions(polish=False)


@pytest.mark.parametrize("parted", SIDES)
def test_parts_that_go_along_are_counted_and_told_with_whose_they_are(parted):
    surfaces = [triangle_surface(*(two_parts() if parted == name else meshes.icosphere(2))) for name in SIDES]
    pairs = pairs_of([], [], SIDES)
    found = drain(match.match_surfaces(match.MatchJob(*surfaces, pairs, NOT_POLISHED, surfaces[0].seams[:0])))
    told = [text for text in found.warnings if "smaller part" in text]
    assert told == [f"2 smaller parts of the {parted} went along with the largest"]


def test_the_largest_part_by_area_and_what_is_left():
    V, F = two_parts()
    surface = triangle_surface(V, F, np.array([[F[0, 0], F[0, 1]], [F[-1, 0], F[-1, 1]]]))
    part = match.largest_part(surface, "source")
    assert match._count_parts(surface) == 3
    big = np.linalg.norm(V, axis=1) < 1.0001
    np.testing.assert_array_equal(part.used, np.flatnonzero(big))
    np.testing.assert_array_equal(part.rest, np.flatnonzero(~big))
    np.testing.assert_array_equal(part.used[part.triangles], F[part.rows])
    np.testing.assert_array_equal(part.vertices, V[part.used])
    np.testing.assert_array_equal(part.used[match._seams(surface, part)], surface.seams[:1])


def test_distances_of_balls_are_those_of_their_radii():
    V, F = meshes.icosphere(4)
    W, G = meshes.icosphere(2)
    found = match.distance_from((V, F), 1.25 * W, G)
    middle = np.linalg.norm(1.25 * W[G].mean(axis=1), axis=1) - 1
    area = face_areas(1.25 * W, G)
    diagonal = np.linalg.norm(np.ptp(V, axis=0))
    assert found == pytest.approx(np.sqrt(area @ middle**2 / area.sum()) / diagonal, rel=0.01)


# ---- strain, boxes, signatures ------------------------------------------------------------------------------


def test_strain_of_polygons_is_the_mean_of_their_triangles():
    surface = quads()
    m, rng = len(surface.triangles), np.random.default_rng(0)
    direction = rng.normal(size=(m, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    given = Beltrami(np.zeros(m, complex), rng.uniform(0, 1.5, m), direction, rng.uniform(1, 2, m))
    size, vector = strain.of_polygons(given, surface)
    for k in range(len(size)):
        own = surface.triangle_face == k
        mu, area = np.minimum(given.size[own], 1), given.area[own]
        assert size[k] == pytest.approx((mu * area).sum() / area.sum())
        assert np.linalg.norm(vector[k]) == pytest.approx(size[k])
        moment = sum(a * x * np.outer(d, d) for a, x, d in zip(area, mu, direction[own], strict=True))
        axis = vector[k] / size[k]
        assert axis @ moment @ axis == pytest.approx(np.linalg.eigvalsh(moment)[-1])


def test_regions_are_means_of_weights_and_slots():
    surface = quads()
    rng = np.random.default_rng(0)
    weights, slots = rng.random(len(surface.positions)), rng.integers(0, 3, len(surface.face_start) - 1)
    found = strain.regions_of(surface, {"a": weights}, slots, ["x", "y", "z"])
    assert list(found) == ["a", "material x", "material y", "material z"]
    corners = surface.corner_vertex[surface.triangles]
    for t, f in enumerate(corners):
        assert found["a"][t] == pytest.approx(weights[f].mean())
        assert [found[f"material {n}"][t] for n in "xyz"] == (slots[surface.triangle_face[t]] == np.arange(3)).tolist()
    assert list(strain.regions_of(surface, {}, slots, ["x"])) == []
    # A material in two slots is one region, and faces beyond the last slot are of that.
    twice = strain.regions_of(surface, {}, slots, ["x", "y", "x"])
    assert list(twice) == ["material x", "material y"]
    assert np.array_equal(twice["material x"], found["material x"] + found["material z"])
    few = strain.regions_of(surface, {}, slots, ["x", "y"])
    assert np.array_equal(few["material y"], found["material y"] + found["material z"])


def test_the_box_of_regions_is_that_of_the_faces_inside():
    surface = quads()
    uv = surface.positions[surface.corner_vertex, :2] * [2, 3] + 1
    pins = CornerPins(np.zeros(len(uv), bool), uv)
    x = surface.positions[:, 0]
    weights = (x > np.median(x)).astype(float)
    region = Region(surface, np.ones(len(surface.face_start) - 1, bool), weights, pins)
    inside = [f for f in polygons(surface) if weights[f].mean() > detail.INSIDE]
    places = surface.positions[np.concatenate(inside), :2] * [2, 3] + 1
    (low, high) = detail.box_of([region, replace(region, pins=None)])
    assert low == pytest.approx(places.min(axis=0)) and high == pytest.approx(places.max(axis=0))
    assert detail.box_of([replace(region, weights=0 * weights)]) is None


NO_INSETS = ("", "a", "a:", ":0,0,1,1", "a:0,0,1", "a:0,0,1,1,1", "a:0,0,nan,1", "a:0,0,0,1", "a:0,1,1,1", "a:1,0,0,1")


@pytest.mark.parametrize("text", NO_INSETS)
def test_what_is_no_inset_is_refused(text):
    with pytest.raises(ValueError, match=r"box|could not convert"):
        detail.parsed_inset(text)
    assert detail.parsed_inset("a:.1,.2,.3,.4") == ("a", (0.1, 0.2), (0.3, 0.4))


def test_signatures_have_as_many_points_as_those_they_are_compared_with(monkeypatch):
    V, F = meshes.icosphere(2)
    own, asked = triangle_surface(V, F), []

    class Index:
        packed, marked, names, coefficients = np.zeros((3, 57, 4), np.float32), False, ("a", "b", "c"), None

    def signature_of(surfaces, count, markers):
        asked.append((list(surfaces), count, markers))
        yield from ()
        return "mine"

    monkeypatch.setattr(distance, "signature_of", signature_of)
    monkeypatch.setattr(distance, "nearest", lambda mine, index, top, known: [(2, mine), (0, top)])
    assert drain(distance.nearest_of(own, Index(), 2)) == [("c", "mine"), ("a", 2)]
    Index.packed, Index.marked = np.zeros((3, 31, 3), np.float32), True
    drain(distance.nearest_of(own, Index(), 2, "markers"))
    assert asked == [([own], 57, None), ([own], 31, ["markers"])]
